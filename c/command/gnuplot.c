/* Command: gnuplot, which reads its script through a pipe, and what all plots have alike. */
#include "command/gnuplot.h"

#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

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

void gbg_gnuplot_quote(FILE *script, const char *text)
{
    fputc('\'', script);
    for (; *text; text++) {
        fputs(*text == '\'' ? "''" : (char[2]){*text, 0}, script);
    }
    fputc('\'', script);
}

void gbg_gnuplot_colour(FILE *script, int index)
{
    double colour[3] = {0.13, 0.13, 0.13};
    if (index >= 0) {
        gbg_palette(index, colour);
    }
    fprintf(script, "lc rgb '#%02x%02x%02x'", (int)lround(255 * colour[0]),
            (int)lround(255 * colour[1]), (int)lround(255 * colour[2]));
}

static void put_canvas(FILE *script, const char *partial, int as_svg, int64_t width)
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
    gbg_gnuplot_quote(script, partial);
    fprintf(script, "\nset border 3 lc rgb '#555555'\nset tics nomirror out\n"
                    "set grid lc rgb '#e4e4e4' lt 1\n");
}

/* Runs gnuplot on the script; 0 when it ended well and left a picture. */
static int run_gnuplot(gbg_plot_writer write, const void *plot, const char *partial, int as_svg,
                       int64_t width)
{
    struct stat made;
    void (*before)(int) = signal(SIGPIPE, SIG_IGN);
    fflush(stdout);
    FILE *script = popen("exec gnuplot", "w");
    int status = -1;
    if (script) {
        put_canvas(script, partial, as_svg, width);
        write(script, plot);
        fputs("\nset output\n", script);
        status = pclose(script);
    }
    signal(SIGPIPE, before);
    if (status != 0 || stat(partial, &made) != 0 || made.st_size == 0) {
        return -1;
    }
    return 0;
}

int gbg_gnuplot_draw(const struct gbg_arguments *arguments, gbg_plot_writer write, const void *plot)
{
    const char *out = gbg_text_of(arguments, "out", NULL);
    int64_t width = gbg_integer_of(arguments, "width", 1200);
    char temporary[GBG_PATH_MOST];
    if (!gnuplot_exists()) {
        return gbg_complain(GBG_EXIT_FAILED,
                            "plot draws with gnuplot, which is not installed: apt-get install "
                            "gnuplot-nox");
    }
    if (gbg_file_temporary(NULL, out, temporary, sizeof temporary) != GBG_OK) {
        return gbg_complain_library(GBG_EXIT_FAILED, NULL);
    }
    if (run_gnuplot(write, plot, temporary, gbg_has_suffix(out, ".svg"), width) != 0) {
        gbg_file_abandon(temporary);
        return gbg_complain(GBG_EXIT_FAILED, "gnuplot did not draw %s", out);
    }
    if (gbg_file_commit(NULL, temporary, out) != GBG_OK) {
        gbg_file_abandon(temporary);
        return gbg_complain_library(GBG_EXIT_FAILED, NULL);
    }
    return GBG_EXIT_DONE;
}
