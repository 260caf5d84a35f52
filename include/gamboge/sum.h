/* Public: long-range forces and potentials on the caller's arrays, for a code that keeps its own run.
 */
#ifndef GAMBOGE_SUM_H
#define GAMBOGE_SUM_H

#include <stddef.h>
#include <stdint.h>

#include "context.h"

#ifdef __cplusplus
extern "C" {
#endif

struct gbg_sum;

/* A solver for F_i = mobility_i sum_k alpha_k r_ik/|r_ik|^(power+1) of n particles (0 .. 2^31-1) in a
 * periodic box of dimension 2 or 3; lengths between 1e-100 and 1e100. kind:
 *   "lattice"        all images, the wave k = 0 removed (a uniform background; sources need not be
 *                    neutral), by a mesh. power 1 to 6 in two dimensions, 2 in three. tolerance:
 *                    relative RMS error of the forces, (0, 0.1], 0: 1e-4. The first run measures it
 *                    on 1000 particles against a sum without a mesh and refines the mesh where it is
 *                    missed.
 *   "minimum_image"  the nearest image of every other particle, pair by pair; power (0, 24].
 *                    tolerance 0 or from 1e-5: pairs in 32 bits, below: in 64 bits.
 * Coordinates are taken modulo the box. Positions and sources have to be set before the first run;
 * what is not set again stays. */
GBG_API int gbg_sum_create(struct gbg_context *context, int dimension, const double *lengths,
                           double power, const char *kind, double tolerance, int64_t n,
                           struct gbg_sum **sum);
GBG_API int gbg_sum_destroy(struct gbg_sum **sum);

/* With kind "lattice", as in scene files: "split" (prolate, gaussian), "window" (prolate, bspline),
 * "gradient" (waves, window), "check" (true, false); and "precision" (auto, double), "hurry" (false;
 * true: few runs will be made, transforms are not tuned for). Set before the first run, or the mesh
 * is made anew by the next. */
GBG_API int gbg_sum_set_option(struct gbg_sum *sum, const char *option, const char *value);

/* Positions of all n particles: base addresses (z NULL in two dimensions), consecutive particles
 * `step` elements apart. Any finite value, taken modulo the box lengths. */
GBG_API int gbg_sum_set_positions(struct gbg_sum *sum, const double *x, const double *y,
                                  const double *z, ptrdiff_t step);
/* Source strengths of all n particles, finite. */
GBG_API int gbg_sum_set_sources(struct gbg_sum *sum, const double *alpha);

/* Sums. The first run of a lattice sum makes the mesh. */
GBG_API int gbg_sum_run(struct gbg_sum *sum);

/* Of the last run, for the positions and sources that it had; GBG_E_ORDER after other ones were set.
 * mobility: of all n particles, or NULL: 1. */
GBG_API int gbg_sum_get_forces(struct gbg_sum *sum, const double *mobility, double *fx, double *fy,
                               double *fz, ptrdiff_t step);
/* sum_k alpha_k/((power-1) |r_ik|^(power-1)) over all images but the particle itself, -log for power
 * 1, mean zero over the box for each source: its negative gradient is the force. "lattice" only. */
GBG_API int gbg_sum_get_potential(struct gbg_sum *sum, double *values);
/* Measured error of the forces of the last run on `samples` particles (<= 0: 1000): RMS(dF)/RMS(F)
 * and RMS(dF)/median|F|, in double precision, against a sum without a mesh or pair by pair. */
GBG_API int gbg_sum_get_error(struct gbg_sum *sum, int64_t samples, double *rms_over_rms,
                              double *rms_over_median);
/* "r/r^3, all images: reach 3.7, mesh 128x128, width 6, float, error 9.1e-05, 64 ns a particle": the
 * error and time are those of the parameter model. */
GBG_API int gbg_sum_describe(struct gbg_sum *sum, int64_t capacity, char *text);

#ifdef __cplusplus
}
#endif
#endif
