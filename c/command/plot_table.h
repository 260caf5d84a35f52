/* Command: tables of columns, read from CSV files and drawn. */
#ifndef GBG_COMMAND_PLOT_TABLE_H
#define GBG_COMMAND_PLOT_TABLE_H

#include "command/command.h"

enum { GBG_COLUMNS_MOST = 64, GBG_COLUMN_TEXT = 64 };

struct gbg_table {
    int columns;
    int64_t rows;
    char name[GBG_COLUMNS_MOST][GBG_COLUMN_TEXT];
    double *value; /* rows x columns, NaN where a cell is empty */
};

/* Reads a table: lines that start with # are left out, the first of the others names the columns,
 * cells are separated by commas. GBG_EXIT_DONE, or GBG_EXIT_USE after a complaint with the line;
 * gbg_table_release belongs after it in either case. */
int gbg_table_read(const char *path, struct gbg_table *table);
void gbg_table_release(struct gbg_table *table);

/* Draws all columns over the first: gamboge plot TABLE.csv. */
int gbg_plot_table(const struct gbg_arguments *arguments);

#endif
