/* Numbers of long-range sums: the waves of the reference and the sums over sources. */
#ifndef GBG_EWALD_REFERENCE_WAVES_H
#define GBG_EWALD_REFERENCE_WAVES_H

#include "ewald/reference_parts.h"

struct gbg_context;

/* Particles as the reference takes them: axes in the order of their lengths, the longest first. */
struct gbg_reference_sources {
    int dimension;
    int axis[3]; /* of the caller */
    double length[3], volume;
    int64_t n;
    double *position[3];      /* in [0, length) */
    double *high[3], *low[3]; /* fractions, as the kernel `phases` takes them */
    const double *alpha;
};

/* All waves up to wave number k_max, and what completes their tiles. group NULL: counts only. */
void gbg_reference_list_waves(int dimension, const double *length, double k_max,
                              struct gbg_reference_waves *waves);
/* coefficient[n_sums] of the long potential: sums over all sources times its transform over the
 * volume. */
int gbg_reference_sum_waves(struct gbg_context *context,
                            const struct gbg_reference_kernels *kernels,
                            const struct gbg_reference_waves *waves,
                            const struct gbg_reference_law *law,
                            const struct gbg_reference_sources *sources, double *coefficient);
/* field[4 t ..]: long force on each axis and potential at the targets. */
int gbg_reference_waves_at(struct gbg_context *context, const struct gbg_reference_kernels *kernels,
                           const struct gbg_reference_waves *waves, const double *coefficient,
                           const struct gbg_reference_sources *sources, int64_t n_targets,
                           const int32_t *target, double *field);

#endif
