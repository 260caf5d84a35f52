/* Command: gamboge plot: S(k), or the columns of a table. */
#include <math.h>
#include <string.h>
#include <unistd.h>

#include "command/gnuplot.h"
#include "command/plot_data.h"
#include "command/plot_table.h"

struct picture {
    const char *path;
    const struct gbg_plot_data *data;
};

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

static void put_axes(FILE *script, const struct gbg_plot_data *data)
{
    fprintf(script,
            "set key top right opaque noenhanced\n"
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
    gbg_gnuplot_quote(script, title);
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
    fprintf(script, "%s$c%d using 1:($2-$3):(0):(2*$3) with vectors nohead lw 1.2 ",
            index ? ", " : "plot 1 with lines lc rgb '#bbbbbb' notitle, ", index);
    gbg_gnuplot_colour(script, index - 1);
    fprintf(script, " notitle, $c%d with lines lw %g dt %d ", index, index ? 1.8 : 2.2,
            index > 0 && index % 3 == 0 ? 2 : 1);
    gbg_gnuplot_colour(script, index - 1);
    fputs(" title ", script);
    gbg_gnuplot_quote(script, label);
}

static void write_script(FILE *script, const void *plot)
{
    const struct picture *picture = plot;
    const struct gbg_plot_data *data = picture->data;
    put_axes(script, data);
    put_title(script, picture->path, data);
    put_block(script, 0, data, &data->total);
    for (int p = 0; p < data->pairs; p++) {
        put_block(script, p + 1, data, &data->pair[p]);
    }
    put_curve(script, 0, "S(k), all");
    for (int p = 0; p < data->pairs; p++) {
        put_curve(script, p + 1, data->pair[p].label);
    }
}

/* Options that say how a table is drawn mean nothing for S(k). */
static int refuse_table_options(const struct gbg_arguments *arguments)
{
    static const char *const names[] = {"log", "points", "title", "ylabel"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        if (gbg_given(arguments, names[k])) {
            return gbg_complain(GBG_EXIT_USE,
                                "--%s is an option of tables: %s does not end in .csv", names[k],
                                arguments->operand);
        }
    }
    return GBG_EXIT_DONE;
}

static int plot_structure(const struct gbg_arguments *arguments)
{
    const char *path = arguments->operand;
    struct gbg_plot_data data = {0};
    const struct picture picture = {path, &data};
    int status = refuse_table_options(arguments);
    if (status) {
        return status;
    }
    status = gbg_plot_data_read(path, &data);
    status = status ? status : gbg_gnuplot_draw(arguments, write_script, &picture);
    if (status == GBG_EXIT_DONE) {
        printf("%s: S(k) of %s, %s shells, %d partials\n", gbg_text_of(arguments, "out", NULL),
               path, gbg_count_text((int64_t)data.shells), data.pairs);
    }
    gbg_plot_data_release(&data);
    return status;
}

int gbg_command_plot(const struct gbg_arguments *arguments)
{
    const char *path = arguments->operand, *out = gbg_text_of(arguments, "out", NULL);
    if (!gbg_has_suffix(out, ".png") && !gbg_has_suffix(out, ".svg")) {
        return gbg_complain(GBG_EXIT_USE, "--out %s: the name must end in .png or .svg", out);
    }
    if (access(path, F_OK) != 0) {
        return gbg_complain(GBG_EXIT_USE, "there is no file %s", path);
    }
    int status = gbg_check_output(out, path);
    if (status) {
        return status;
    }
    return gbg_has_suffix(path, ".csv") ? gbg_plot_table(arguments) : plot_structure(arguments);
}
