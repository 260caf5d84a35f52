/* Analysis room: the wave vectors of a periodic box, one of each pair k, -k, and their shells. */
#ifndef GBG_ANALYSIS_MODES_H
#define GBG_ANALYSIS_MODES_H

#include <stdint.h>

struct gbg_context;

/* Wave vectors k_a = 2 pi n_a / L_a with 0 < |k| <= k_max; of n and -n the one whose first nonzero
 * integer is positive. Axis 0 runs fastest. */
struct gbg_modes {
    int dimension;
    int32_t reach[3]; /* largest |n_a| */
    int64_t count;
    int32_t *n[3];
};

/* Largest |n| on an axis of this length; above 2^30 it returns -1. */
int32_t gbg_modes_reach(double length, double k_max);
/* Number of modes that gbg_modes_make will list, without listing them. */
int64_t gbg_modes_count(int dimension, const double *lengths, double k_max);
int gbg_modes_make(struct gbg_context *context, int dimension, const double *lengths, double k_max,
                   struct gbg_modes *modes);
void gbg_modes_free(struct gbg_modes *modes);

/* Shells of |k|. Edges (i + 1/2) width for i = 0, 1, ...; one more shell [0, width/2) comes first
 * when it holds a mode; the last ends at k_max. */
struct gbg_shells {
    int64_t count;
    double width, k_max;
    int has_core;      /* the shell [0, width/2) is there */
    double lengths[3]; /* of the box that `assign` saw last */
    double *k;         /* |k| of each mode in that box */
    int64_t *start;    /* count+1: the modes of shell i are mode[start[i]] .. */
    uint32_t *mode;
    int32_t *shell_of; /* of each mode, -1 outside all */
};

/* Lays out the shells for the box of `lengths` and assigns the modes. */
int gbg_shells_make(struct gbg_context *context, const struct gbg_modes *modes,
                    const double *lengths, double k_max, double width, struct gbg_shells *shells);
/* Bins the modes by their |k| in another box; modes that leave the range of shells are in none. */
void gbg_shells_assign(struct gbg_shells *shells, const struct gbg_modes *modes,
                       const double *lengths);
double gbg_shells_low(const struct gbg_shells *shells, int64_t shell);
double gbg_shells_high(const struct gbg_shells *shells, int64_t shell);
void gbg_shells_free(struct gbg_shells *shells);

#endif
