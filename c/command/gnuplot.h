/* Command: gnuplot, fed through a pipe, and what all plots have alike. */
#ifndef GBG_COMMAND_GNUPLOT_H
#define GBG_COMMAND_GNUPLOT_H

#include "command/command.h"

/* Writes the part of a script that is the plot's own, after the canvas. */
typedef void (*gbg_plot_writer)(FILE *script, const void *plot);

/* Draws --out in --width: complete or absent. GBG_EXIT_DONE or an exit status after a complaint. */
int gbg_gnuplot_draw(const struct gbg_arguments *arguments, gbg_plot_writer write,
                     const void *plot);

/* A text in gnuplot's single quotes, where only the quote itself needs care. */
void gbg_gnuplot_quote(FILE *script, const char *text);
/* A colour of the palette as "lc rgb '#rrggbb'"; -1 is black. */
void gbg_gnuplot_colour(FILE *script, int index);

#endif
