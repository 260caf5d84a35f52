/* Command: gamboge plot: S(k) drawn by gnuplot, which reads its script through a pipe. */
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "command/plot_data.h"
#include "core/file.h"

static int gnuplot_exists(void)
{
    const char *path = getenv("PATH");
    char folders[GBG_PATH_MOST], name[GBG_PATH_MOST + 16], *rest = NULL;
    snprintf(folders, sizeof folders, "%s", path ? path : "/usr/bin:/bin");
    for (char *folder = strtok_r(folders, ":", &rest); folder;
         folder = strtok_r(NULL, ":", &rest)) {
        snprintf(name, sizeof name, "%s/gnuplot", folder);
        if (access(name, X_OK) == 0) {
            return 1;
        }
    }
    return 0;
}

/* A text in gnuplot's single quotes, where only the quote itself needs care. */
static void put_quoted(FILE *script, const char *text)
{
    fputc('\'', script);
    for (; *text; text++) {
        fputs(*text == '\'' ? "''" : (char[2]){*text, 0}, script);
    }
    fputc('\'', script);
}

static void put_block(FILE *script, int index, const struct gbg_plot_data *data,
                      const struct gbg_curve *curve)
{
    fprintf(script, "$c%d << END\n", index);
    for (size_t s = 0; s < data->shells; s++) {
        double error = curve->error ? curve->error[s] : NAN;
        if (isfinite(curve->value[s])) {
            fprintf(script, "%.9g %.9g %.9g\n", data->k[s], curve->value[s],
                    isfinite(error) ? error : 0.0);
        }
    }
    fprintf(script, "END\n");
}

static void put_canvas(FILE *script, const struct gbg_plot_data *data, const char *partial,
                       int as_svg, int64_t width)
{
    int64_t height = width * 5 / 8;
    double font = fmax(8, (double)width / 75);
    if (as_svg) {
        fprintf(script,
                "set terminal svg size %lld,%lld enhanced font 'sans,%.0f' "
                "background '#ffffff'\n",
                (long long)width, (long long)height, font);
    } else {
        fprintf(script,
                "if (strstrt(GPVAL_TERMINALS, 'pngcairo') > 0) "
                "set terminal pngcairo size %lld,%lld enhanced font 'sans,%.0f' "
                "background '#ffffff'; else set terminal png size %lld,%lld\n",
                (long long)width, (long long)height, font, (long long)width, (long long)height);
    }
    fprintf(script, "set encoding utf8\nset output ");
    put_quoted(script, partial);
    fprintf(script,
            "\nset border 3 lc rgb '#555555'\nset tics nomirror out\n"
            "set grid lc rgb '#e4e4e4' lt 1\nset key "
            "top right opaque noenhanced\n"
            "set xlabel 'k {/Symbol s}'\nset ylabel 'S(k)'\nset xrange [0:%.9g]\n",
            data->k[data->shells - 1]);
}

static void put_title(FILE *script, const char *path, const struct gbg_plot_data *data)
{
    char title[2 * GBG_PATH_MOST], part[64];
    snprintf(title, sizeof title, "%s", gbg_base_name(data->source[0] ? data->source : path));
    if (data->particles > 0) {
        snprintf(part, sizeof part, "   N = %s", gbg_count_text((int64_t)data->particles));
        strncat(title, part, sizeof title - strlen(title) - 1);
    }
    if (data->frames >= 0) {
        snprintf(part, sizeof part, ", %s frame%s", gbg_count_text(data->frames),
                 data->frames == 1 ? "" : "s");
        strncat(title, part, sizeof title - strlen(title) - 1);
    }
    fputs("set title ", script);
    put_quoted(script, title);
    fputs(" noenhanced\n", script);
    if (isfinite(data->largest_bound)) {
        fprintf(script,
                "set bmargin 5\nset label 1 'error bars: statistical, one standard error; "
                "numerical error at most %.1g at every k' at screen 0.5, screen 0.02 center "
                "noenhanced tc rgb '#777777'\n",
                data->largest_bound);
    }
}

/* Index 0 is the whole, in black and thicker; the partials follow in the colours of the palette,
 * every third dashed, because partials of like species often lie on each other. */
static void put_curve(FILE *script, int index, const char *label)
{
    double colour[3] = {0.13, 0.13, 0.13};
    char line[64];
    if (index > 0) {
        gbg_palette(index - 1, colour);
    }
    snprintf(line, sizeof line, "lc rgb '#%02x%02x%02x'", (int)lround(255 * colour[0]),
             (int)lround(255 * colour[1]), (int)lround(255 * colour[2]));
    fprintf(script,
            "%s$c%d using 1:($2-$3):(0):(2*$3) with vectors nohead lw 1.2 %s notitle, "
            "$c%d with lines lw %g dt %d %s title ",
            index ? ", " : "plot 1 with lines lc rgb '#bbbbbb' notitle, ", index, line, index,
            index ? 1.8 : 2.2, index > 0 && index % 3 == 0 ? 2 : 1, line);
    put_quoted(script, label);
}

static void write_script(FILE *script, const char *path, const struct gbg_plot_data *data,
                         const char *partial, int as_svg, int64_t width)
{
    put_canvas(script, data, partial, as_svg, width);
    put_title(script, path, data);
    put_block(script, 0, data, &data->total);
    for (int p = 0; p < data->pairs; p++) {
        put_block(script, p + 1, data, &data->pair[p]);
    }
    put_curve(script, 0, "S(k), all");
    for (int p = 0; p < data->pairs; p++) {
        put_curve(script, p + 1, data->pair[p].label);
    }
    fputs("\nset output\n", script);
}

/* Runs gnuplot on the script; 0 when it ended well and left a picture. */
static int run_gnuplot(const char *path, const struct gbg_plot_data *data, const char *partial,
                       int as_svg, int64_t width)
{
    struct stat made;
    void (*before)(int) = signal(SIGPIPE, SIG_IGN);
    fflush(stdout);
    FILE *script = popen("exec gnuplot", "w");
    int status = -1;
    if (script) {
        write_script(script, path, data, partial, as_svg, width);
        status = pclose(script);
    }
    signal(SIGPIPE, before);
    if (status != 0 || stat(partial, &made) != 0 || made.st_size == 0) {
        return -1;
    }
    return 0;
}

static int draw(const struct gbg_arguments *arguments, const struct gbg_plot_data *data)
{
    const char *path = arguments->operand, *out = gbg_text_of(arguments, "out", NULL);
    int64_t width = gbg_integer_of(arguments, "width", 1200);
    char temporary[GBG_PATH_MOST];
    if (gbg_file_temporary(NULL, out, temporary, sizeof temporary) != GBG_OK) {
        return gbg_complain_library(GBG_EXIT_FAILED, NULL);
    }
    if (run_gnuplot(path, data, temporary, gbg_has_suffix(out, ".svg"), width) != 0) {
        gbg_file_abandon(temporary);
        return gbg_complain(GBG_EXIT_FAILED, "gnuplot did not draw %s", out);
    }
    if (gbg_file_commit(NULL, temporary, out) != GBG_OK) {
        gbg_file_abandon(temporary);
        return gbg_complain_library(GBG_EXIT_FAILED, NULL);
    }
    printf("%s: S(k) of %s, %s shells, %d partials\n", out, path,
           gbg_count_text((int64_t)data->shells), data->pairs);
    return GBG_EXIT_DONE;
}

static int plot(const struct gbg_arguments *arguments, struct gbg_plot_data *data)
{
    const char *path = arguments->operand, *out = gbg_text_of(arguments, "out", NULL);
    if (!gbg_has_suffix(out, ".png") && !gbg_has_suffix(out, ".svg")) {
        return gbg_complain(GBG_EXIT_USE, "--out %s: the name must end in .png or .svg", out);
    }
    if (access(path, F_OK) != 0) {
        return gbg_complain(GBG_EXIT_USE, "there is no file %s", path);
    }
    int status = gbg_check_output(out, path);
    status = status ? status : gbg_plot_data_read(path, data);
    if (status) {
        return status;
    }
    if (!gnuplot_exists()) {
        return gbg_complain(GBG_EXIT_FAILED,
                            "plot draws with gnuplot, which is not installed: apt-get install "
                            "gnuplot-nox");
    }
    return draw(arguments, data);
}

int gbg_command_plot(const struct gbg_arguments *arguments)
{
    struct gbg_plot_data data = {0};
    int status = plot(arguments, &data);
    gbg_plot_data_release(&data);
    return status;
}
