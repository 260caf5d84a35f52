/* Command: gamboge plot TABLE.csv: columns over the first column. */
#include "command/plot_table.h"

#include <math.h>
#include <string.h>

#include "command/gnuplot.h"

static const char error_suffix[] = " error";

struct plot {
    const struct gbg_table *table;
    const char *title, *ylabel, *points;
    int log_x, log_y;
};

static double cell(const struct gbg_table *table, int64_t row, int column)
{
    return table->value[row * table->columns + column];
}

static int column_named(const struct gbg_table *table, const char *name)
{
    for (int c = 1; c < table->columns; c++) {
        if (strcmp(table->name[c], name) == 0) {
            return c;
        }
    }
    return -1;
}

/* Column with the error of a column, -1 if there is none. */
static int error_column(const struct gbg_table *table, int column)
{
    char name[GBG_COLUMN_TEXT + sizeof error_suffix];
    snprintf(name, sizeof name, "%s%s", table->name[column], error_suffix);
    return column_named(table, name);
}

/* 1: the column holds the errors of another one and is no curve itself. */
static int holds_errors(const struct gbg_table *table, int column)
{
    char name[GBG_COLUMN_TEXT];
    size_t length = strlen(table->name[column]), suffix = sizeof error_suffix - 1;
    if (length <= suffix || strcmp(table->name[column] + length - suffix, error_suffix) != 0) {
        return 0;
    }
    snprintf(name, sizeof name, "%.*s", (int)(length - suffix), table->name[column]);
    return column_named(table, name) >= 0;
}

/* The column that a column of points belongs to, by its name without the word of --points and the
 * blank beside it; the column itself if there is none. */
static int partner(const struct plot *plot, int column)
{
    const struct gbg_table *table = plot->table;
    const char *name = table->name[column];
    const char *word = plot->points ? strstr(name, plot->points) : NULL;
    char rest[GBG_COLUMN_TEXT];
    if (!word) {
        return column;
    }
    size_t before = (size_t)(word - name);
    const char *after = word + strlen(plot->points);
    if (*after == ' ') {
        after++;
    } else if (before > 0 && name[before - 1] == ' ') {
        before--;
    }
    snprintf(rest, sizeof rest, "%.*s%s", (int)before, name, after);
    int other = column_named(table, rest);
    return other < 0 ? column : other;
}

static int has_points(const struct plot *plot, int column)
{
    return plot->points && strstr(plot->table->name[column], plot->points);
}

/* Place in the palette: curves in the order of their columns. */
static int colour_of(const struct plot *plot, int column)
{
    int place = 0;
    column = partner(plot, column);
    for (int c = 1; c < column; c++) {
        place += !holds_errors(plot->table, c) && partner(plot, c) == c;
    }
    return place;
}

static int can_show(const struct plot *plot, double x, double y)
{
    return isfinite(x) && isfinite(y) && !(plot->log_x && x <= 0) && !(plot->log_y && y <= 0);
}

static int64_t count_shown(const struct plot *plot, int column)
{
    int64_t shown = 0;
    for (int64_t row = 0; row < plot->table->rows; row++) {
        shown += can_show(plot, cell(plot->table, row, 0), cell(plot->table, row, column));
    }
    return shown;
}

static void put_block(FILE *script, const struct plot *plot, int column)
{
    const struct gbg_table *table = plot->table;
    int errors = error_column(table, column);
    fprintf(script, "$c%d << END\n", column);
    for (int64_t row = 0; row < table->rows; row++) {
        double x = cell(table, row, 0), y = cell(table, row, column);
        double e = errors < 0 ? 0 : cell(table, row, errors);
        e = isfinite(e) ? fabs(e) : 0;
        if (can_show(plot, x, y)) { /* a bar of a logarithmic axis ends within the picture */
            double low = plot->log_y && e >= y ? 1e-3 * y : y - e;
            fprintf(script, "%.9g %.9g %.9g %.9g\n", x, y, low, y + e);
        }
    }
    fprintf(script, "END\n");
}

static void put_axis(FILE *script, const char *axis, const char *label, int is_log)
{
    fprintf(script, "set %slabel ", axis);
    gbg_gnuplot_quote(script, label);
    fprintf(script, " noenhanced\n");
    if (is_log) {
        fprintf(script, "set logscale %s\nset format %s '10^{%%T}'\nset m%stics 10\n", axis, axis,
                axis);
    }
}

/* The first column from end to end, with a little room beside it; one value alone has room too. */
static void put_range(FILE *script, const struct plot *plot)
{
    double low = INFINITY, high = -INFINITY;
    for (int64_t row = 0; row < plot->table->rows; row++) {
        double x = cell(plot->table, row, 0);
        if (can_show(plot, x, 1)) {
            low = fmin(low, x);
            high = fmax(high, x);
        }
    }
    if (plot->log_x) {
        double room = high > low ? pow(high / low, 0.03) : 2;
        low /= room;
        high *= room;
    } else {
        double room = high > low ? 0.03 * (high - low) : 1;
        low -= room;
        high += room;
    }
    fprintf(script, "set xrange [%.9g:%.9g]\n", low, high);
}

static void put_head(FILE *script, const struct plot *plot)
{
    fputs("set title ", script);
    gbg_gnuplot_quote(script, plot->title);
    fputs(" noenhanced\nset key outside right top noenhanced\nset offsets 0, 0, graph 0.04, "
          "0\n",
          script);
    put_axis(script, "x", plot->table->name[0], plot->log_x);
    put_range(script, plot);
    put_axis(script, "y", plot->ylabel, plot->log_y);
    if (!plot->log_y) {
        fputs("set yrange [*<0:*]\n", script);
    }
}

static void put_curve(FILE *script, const struct plot *plot, int column, const char *before)
{
    int place = colour_of(plot, column), points = has_points(plot, column);
    fputs(before, script);
    if (error_column(plot->table, column) >= 0) {
        fprintf(script, "$c%d using 1:2:3:4 with yerrorbars pt 0 lw 1.2 ", column);
        gbg_gnuplot_colour(script, place);
        fputs(" notitle, ", script);
    }
    fprintf(script, "$c%d using 1:2 with ", column);
    fprintf(script, points ? "points pt 6 ps 1.3 lw 1.8 " : "linespoints pt 7 ps 0.6 lw 2 ");
    gbg_gnuplot_colour(script, place);
    fputs(" title ", script);
    gbg_gnuplot_quote(script, plot->table->name[column]);
}

static void write_script(FILE *script, const void *of)
{
    const struct plot *plot = of;
    const char *before = "plot ";
    put_head(script, plot);
    for (int pass = 0; pass < 2; pass++) {
        for (int c = 1; c < plot->table->columns; c++) {
            if (holds_errors(plot->table, c) || count_shown(plot, c) == 0) {
                continue;
            }
            if (pass == 0) {
                put_block(script, plot, c);
            } else {
                put_curve(script, plot, c, before);
                before = ", ";
            }
        }
    }
}

static int draw(const struct gbg_arguments *arguments, const struct plot *plot)
{
    const struct gbg_table *table = plot->table;
    int64_t shown = 0, values = 0;
    int curves = 0;
    for (int c = 1; c < table->columns; c++) {
        if (!holds_errors(table, c)) {
            int64_t there = count_shown(plot, c);
            curves += there > 0;
            shown += there;
            for (int64_t row = 0; row < table->rows; row++) {
                values += isfinite(cell(table, row, c));
            }
        }
    }
    if (curves == 0) {
        return gbg_complain(GBG_EXIT_USE, "%s holds no value that can be drawn%s",
                            arguments->operand,
                            plot->log_x || plot->log_y ? " on logarithmic axes" : "");
    }
    int status = gbg_gnuplot_draw(arguments, write_script, plot);
    if (status == GBG_EXIT_DONE) {
        printf("%s: %d curves of %s, %s rows\n", gbg_text_of(arguments, "out", NULL), curves,
               arguments->operand, gbg_count_text(table->rows));
    }
    if (status == GBG_EXIT_DONE && shown < values) {
        printf("values left out that a logarithmic axis cannot show: %s\n",
               gbg_count_text(values - shown));
    }
    return status;
}

int gbg_plot_table(const struct gbg_arguments *arguments)
{
    struct gbg_table table;
    const char *log = gbg_text_of(arguments, "log", "");
    const struct plot plot = {
        .table = &table,
        .title = gbg_text_of(arguments, "title", gbg_base_name(arguments->operand)),
        .ylabel = gbg_text_of(arguments, "ylabel", ""),
        .points = gbg_text_of(arguments, "points", NULL),
        .log_x = strchr(log, 'x') != NULL,
        .log_y = strchr(log, 'y') != NULL,
    };
    int status = gbg_table_read(arguments->operand, &table);
    status = status ? status : draw(arguments, &plot);
    gbg_table_release(&table);
    return status;
}
