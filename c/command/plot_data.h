/* Command: the structure factor in a file of gamboge sk. */
#ifndef GBG_COMMAND_PLOT_DATA_H
#define GBG_COMMAND_PLOT_DATA_H

#include <stddef.h>

#include "command/command.h"

enum { GBG_PAIRS_MOST = GBG_MAX_SPECIES * (GBG_MAX_SPECIES + 1) / 2 };

struct gbg_curve {
    char label[2 * GBG_TEXT_MOST + 4]; /* "A-B" */
    double *value, *error;             /* statistical, NaN where there is none */
};

struct gbg_plot_data {
    size_t shells;
    double *k;
    struct gbg_curve total;
    int pairs;
    struct gbg_curve pair[GBG_PAIRS_MOST];
    double largest_bound; /* largest numerical error of S in any shell; NaN: not in the file */
    double particles;     /* 0: not in the file */
    long long frames;     /* -1: not in the file */
    char source[GBG_PATH_MOST];
};

/* Reads the file: GBG_EXIT_DONE, or GBG_EXIT_USE after a complaint. gbg_plot_data_release belongs
 * after it in either case. */
int gbg_plot_data_read(const char *path, struct gbg_plot_data *data);
void gbg_plot_data_release(struct gbg_plot_data *data);

#endif
