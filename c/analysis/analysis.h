/* Analysis room: the body of struct gbg_analysis, and what the public calls do with it. */
#ifndef GBG_ANALYSIS_ANALYSIS_H
#define GBG_ANALYSIS_ANALYSIS_H

#include "analysis/blocking.h"
#include "analysis/density.h"
#include "analysis/modes.h"
#include "core/context.h"
#include "gamboge/analysis.h"

enum { GBG_MOST_SPECIES = 10, GBG_SPECIES_NAME = 32, GBG_FEW_FRAMES = 16 };

/* Quantities of a shell that are averaged over frames; after them, for each pair of species, the
 * partial structure factor and its numerical bound. */
enum gbg_analysis_column {
    GBG_COLUMN_K,
    GBG_COLUMN_MODES,
    GBG_COLUMN_S,
    GBG_COLUMN_BOUND,
    GBG_COLUMN_TYPICAL,
    GBG_COLUMN_STORAGE,
    GBG_COLUMN_PAIRS
};

enum gbg_analysis_text {
    GBG_TEXT_TITLE,
    GBG_TEXT_FILES,
    GBG_TEXT_SHA256,
    GBG_TEXT_HISTORY,
    GBG_TEXTS
};

struct gbg_analysis_settings {
    double k_max;        /* 0: default */
    double tolerance;    /* of |d rho|/sqrt(N), a bound */
    double shell_width;  /* 0: default */
    double memory_limit; /* bytes */
    int method;          /* enum gbg_density_method */
    int partials;
};

struct gbg_analysis {
    struct gbg_context *context;
    int dimension, n_species;
    double lengths[3];
    struct gbg_analysis_settings settings;
    char species_name[GBG_MOST_SPECIES][GBG_SPECIES_NAME];
    char *text[GBG_TEXTS];

    /* From the first frame on */
    int64_t frames, n;
    int64_t n_of[GBG_MOST_SPECIES];
    double k_max, largest_bound;
    struct gbg_modes modes;
    struct gbg_shells shells;
    struct gbg_density *density;
    int pairs, columns;  /* pairs 0 without partials */
    double *frame;       /* [column][shell] of the last frame; modes 0: the shell was empty */
    double *sum, *carry; /* compensated sums over frames */
    int64_t *frames_of;  /* frames in which a shell held modes */
    struct gbg_blocking blocking; /* series: S of the shells, then those of the pairs */
};

struct gbg_analysis_frame {
    struct gbg_points points;
    const int32_t *species; /* NULL: all the first */
    int base;
    double lengths[3];
    double storage_error;
};

/* Position of the pair (a, b), a <= b, among (0,0), (0,1), ... (1,1), ... */
static inline int gbg_analysis_pair(int n_species, int a, int b)
{
    return a * n_species - a * (a - 1) / 2 + (b - a);
}

/* Chooses method, modes and mesh for the first frame (plan.c); messages begin with "call". */
int gbg_analysis_begin(struct gbg_analysis *analysis, const struct gbg_analysis_frame *frame);
/* Undoes it. */
void gbg_analysis_forget(struct gbg_analysis *analysis);
/* Adds a checked frame to the sums (accumulate.c); fails only before anything changed. */
int gbg_analysis_accumulate(struct gbg_analysis *analysis, const struct gbg_analysis_frame *frame);
/* Mean over frames of a column for a shell; NaN for a shell that never held a mode. */
double gbg_analysis_mean(const struct gbg_analysis *analysis, int column, int64_t shell);
/* Statistical error of the series (0: S, 1 + pair: a partial) and its independent frames. */
double gbg_analysis_error(const struct gbg_analysis *analysis, int series, int64_t shell,
                          double *independent);

#endif
