/* Numbers of long-range sums: Ewald sums in double precision on a few targets, without a mesh: what
 * errors are measured against. Shares no formula with split.c: Gaussian split by incomplete gamma
 * functions, waves one by one. */
#ifndef GBG_EWALD_REFERENCE_H
#define GBG_EWALD_REFERENCE_H

#include <stdint.h>

struct gbg_context;

struct gbg_ewald_sources {
    int dimension;
    double length[3];
    double power; /* 1 to 6 in 2D, 2 in 3D */
    int64_t n;
    const double *position[3]; /* any finite value, taken modulo the box */
    const double *alpha;
};

/* Hidden from users, shared with the program's benchmarks. */
#pragma GCC visibility push(default)

/* Field sum over k and all images of alpha_k r/|r|^(power+1), k = 0 wave removed, own images
 * included, at the listed particles; force[axis][target], potential[target] or NULL (the wave k = 0
 * removed: mean zero up to the near part's mean, which is subtracted too, so that it does not
 * depend on the split). balance: 1 is the usual split, others move work between pairs and waves:
 * two of them must agree. Relative error below 1e-13 of the RMS force. */
int gbg_ewald_reference(struct gbg_context *context, const struct gbg_ewald_sources *sources,
                        double balance, int64_t n_targets, const int32_t *target,
                        double *const *force, double *potential);

#pragma GCC visibility pop

#endif
