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
    double power; /* any real number from 1 to 6 */
    int64_t n;
    const double *position[3]; /* any finite value, taken modulo the box */
    const double *alpha;
};

/* Hidden from users, shared with the program's benchmarks. */
#pragma GCC visibility push(default)

/* Field sum over k and all images of alpha_k r/|r|^(power+1), k = 0 wave removed, own images
 * included, at the listed particles; force[axis][target], potential[target] or NULL. What coincides
 * with a target exerts no force. balance: 1 is the cheapest split, from 1/16 to 16, others move
 * work between pairs and waves: two of them must agree. Error below 1e-13 of the RMS force, or of
 * the force of a particle's own nearest image if a few particles in a long box have less.
 *
 * The potential, of which the force is minus the gradient, is the sum of alpha_k r^-s/s, s =
 * power-1 (power 1: -alpha_k log r) over all others and all images, own ones included, minus what
 * smears out evenly: the sum inside a large smooth window minus its continuum's integral over
 * total alpha/volume. For s below the dimension this is the sum without the wave k = 0: its mean
 * over the box is zero. For s above it is the plain sum. For s equal to it the integral starts at
 * the distance volume^(1/dimension). None of them depends on the split. */
int gbg_ewald_reference(struct gbg_context *context, const struct gbg_ewald_sources *sources,
                        double balance, int64_t n_targets, const int32_t *target,
                        double *const *force, double *potential);

#pragma GCC visibility pop

#endif
