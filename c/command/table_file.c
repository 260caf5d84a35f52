/* Command: tables of columns read from CSV files. */
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "command/plot_table.h"

struct reader {
    const char *path;
    FILE *file;
    char *line;
    size_t capacity;
    int64_t number; /* of the line, from 1 */
    int64_t room;   /* rows that fit into the table */
};

/* The next line that is neither empty nor a comment; NULL at the end. */
static char *next_line(struct reader *reader)
{
    while (getline(&reader->line, &reader->capacity, reader->file) >= 0) {
        reader->number++;
        char *line = reader->line + strspn(reader->line, " \t\r\n");
        if (*line && *line != '#') {
            line[strcspn(line, "\r\n")] = 0;
            return line;
        }
    }
    return NULL;
}

/* Cuts the next cell from *rest, without blanks and quotation marks around it; NULL: no more. */
static char *next_cell(char **rest)
{
    char *cell = *rest;
    if (!cell) {
        return NULL;
    }
    char *comma = strchr(cell, ',');
    *rest = comma ? comma + 1 : NULL;
    char *end = comma ? comma : cell + strlen(cell);
    while (cell < end && (isspace((unsigned char)*cell) || *cell == '"')) {
        cell++;
    }
    while (end > cell && (isspace((unsigned char)end[-1]) || end[-1] == '"')) {
        end--;
    }
    *end = 0;
    return cell;
}

static int read_names(struct reader *reader, struct gbg_table *table)
{
    char *rest = next_line(reader);
    if (!rest) {
        return gbg_complain(GBG_EXIT_USE, "%s holds no line with names of columns", reader->path);
    }
    for (char *cell = next_cell(&rest); cell; cell = next_cell(&rest)) {
        if (table->columns == GBG_COLUMNS_MOST || strlen(cell) >= GBG_COLUMN_TEXT) {
            return gbg_complain(
                GBG_EXIT_USE, "%s, line %lld: at most %d columns with names of up to %d bytes",
                reader->path, (long long)reader->number, GBG_COLUMNS_MOST, GBG_COLUMN_TEXT - 1);
        }
        strcpy(table->name[table->columns++], cell);
    }
    return table->columns > 1
               ? GBG_EXIT_DONE
               : gbg_complain(GBG_EXIT_USE, "%s, line %lld: at least two columns are needed",
                              reader->path, (long long)reader->number);
}

static int read_cell(const struct reader *reader, const char *name, const char *cell, double *value)
{
    char *end = NULL;
    *value = NAN;
    if (!*cell) {
        return GBG_EXIT_DONE;
    }
    *value = strtod(cell, &end);
    return *end ? gbg_complain(GBG_EXIT_USE,
                               "%s, line %lld, column \"%s\": \"%s\" is neither a number nor empty",
                               reader->path, (long long)reader->number, name, cell)
                : GBG_EXIT_DONE;
}

static int make_room(struct reader *reader, struct gbg_table *table)
{
    if (table->rows < reader->room) {
        return GBG_EXIT_DONE;
    }
    int64_t room = reader->room ? 2 * reader->room : 64;
    size_t size = (size_t)room * (size_t)table->columns * sizeof *table->value;
    double *value = realloc(table->value, size);
    if (!value) {
        return gbg_complain(GBG_EXIT_FAILED, "no memory for %lld rows", (long long)room);
    }
    table->value = value;
    reader->room = room;
    return GBG_EXIT_DONE;
}

static int read_row(struct reader *reader, struct gbg_table *table, char *rest)
{
    int status = make_room(reader, table), column = 0;
    char *cell = next_cell(&rest);
    for (; status == GBG_EXIT_DONE && cell; cell = next_cell(&rest), column++) {
        double value;
        if (column < table->columns) {
            status = read_cell(reader, table->name[column], cell, &value);
            table->value[table->rows * table->columns + column] = value;
        }
    }
    if (status == GBG_EXIT_DONE && column != table->columns) {
        status = gbg_complain(GBG_EXIT_USE, "%s, line %lld: %d cells, but %d columns have names",
                              reader->path, (long long)reader->number, column, table->columns);
    }
    table->rows++;
    return status;
}

int gbg_table_read(const char *path, struct gbg_table *table)
{
    *table = (struct gbg_table){0};
    struct reader reader = {.path = path, .file = fopen(path, "r")};
    if (!reader.file) {
        return gbg_complain(GBG_EXIT_USE, "%s cannot be read", path);
    }
    int status = read_names(&reader, table);
    char *line = NULL;
    while (status == GBG_EXIT_DONE && (line = next_line(&reader))) {
        status = read_row(&reader, table, line);
    }
    if (status == GBG_EXIT_DONE && ferror(reader.file)) {
        status = gbg_complain(GBG_EXIT_USE, "%s cannot be read", path);
    } else if (status == GBG_EXIT_DONE && table->rows == 0) {
        status = gbg_complain(GBG_EXIT_USE, "%s holds no row of numbers", path);
    }
    fclose(reader.file);
    free(reader.line);
    return status;
}

void gbg_table_release(struct gbg_table *table)
{
    free(table->value);
    table->value = NULL;
}
