/* Side room io: the file of a structure factor. */
#ifndef GBG_IO_ANALYSIS_FILE_H
#define GBG_IO_ANALYSIS_FILE_H

#include <stdint.h>

struct gbg_context;

enum { GBG_FILE_TEXTS = 16, GBG_FILE_COLUMNS = 8, GBG_FILE_SPECIES = 10 };

/* A variable over shells, or over pairs and shells. */
struct gbg_file_column {
    const char *name, *long_name, *extra_name, *extra; /* extra: one more attribute, or NULL */
    const double *value;
};

struct gbg_analysis_content {
    int dimension, species, pairs; /* pairs 0: no partials */
    int64_t shells;
    const double *k, *k_bounds; /* k_bounds(shells, 2) */
    const double *modes;
    const double *lengths;
    int columns;
    struct gbg_file_column column[GBG_FILE_COLUMNS];
    int pair_columns;
    struct gbg_file_column pair_column[GBG_FILE_COLUMNS];
    const char *species_name[GBG_FILE_SPECIES];
    int64_t particles[GBG_FILE_SPECIES];
    int texts; /* global attributes */
    const char *text_name[GBG_FILE_TEXTS], *text[GBG_FILE_TEXTS];
    int64_t n, frames;
    double n_effective, tolerance, bound;
};

/* Writes the content as a CF netCDF-4 file under a temporary name, syncs and renames it. Messages
 * begin with "gbg_analysis_write: PATH". */
int gbg_analysis_file_write(struct gbg_context *context, const char *path,
                            const struct gbg_analysis_content *content);

#endif
