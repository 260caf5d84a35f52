/* Public: single kernels on the caller's arrays, for a code that keeps its own run. */
#ifndef GAMBOGE_KERNELS_H
#define GAMBOGE_KERNELS_H

#include <stddef.h>
#include <stdint.h>

#include "context.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Coordinates are three base addresses and one step in elements (z NULL in two dimensions), any
 * finite value, taken modulo the box lengths. */

/* F_i = mobility_i sum_{k != i} alpha_k r_ik/|r_ik|^(power+1) with the nearest image of each k, all
 * pairs (cutoff 0) or those closer than cutoff (<= half the shortest box length). Coincident pairs
 * contribute nothing. precision: "mixed" (32-bit pairs, 64-bit sums), "double", or
 * "strict" (mixed, the same bits on every processor and GPU). */
GBG_API int gbg_pair_forces(struct gbg_context *context, int dimension, const double *lengths,
                            double power, double cutoff, const char *precision, int64_t n,
                            const double *x, const double *y, const double *z, ptrdiff_t step,
                            const double *alpha, const double *mobility, double *fx, double *fy,
                            double *fz, ptrdiff_t force_step);

/* Pairs closer than (d_i + d_j)/2 (1 - tolerance): their number, and the first `capacity` of them
 * as indices counted from base (first < second, sorted). */
GBG_API int gbg_overlaps_find(struct gbg_context *context, int dimension, const double *lengths,
                              int64_t n, const double *x, const double *y, const double *z,
                              ptrdiff_t step, const double *diameter, double tolerance, int base,
                              int64_t capacity, int32_t *first, int32_t *second, int64_t *count);

/* Moves overlapping particles apart in place by rounds of the rule ("contact" or "bounce") until no
 * pair overlaps; *rounds receives their number. Coincident particles part in a direction that
 * follows from their indices. GBG_E_STEP when max_rounds (0: 10000) were not enough: the arrays are
 * then unchanged. */
GBG_API int gbg_overlaps_remove(struct gbg_context *context, int dimension, const double *lengths,
                                int64_t n, double *x, double *y, double *z, ptrdiff_t step,
                                const double *diameter, const char *rule, int64_t max_rounds,
                                int64_t *rounds);

/* Standard normal deviates of the noise tape: for particle ids first_id .. first_id+n-1 at `at_step`
 * the `dimension` components (2 or 3), value(dimension, n) in Fortran's order. Same numbers as the
 * engine's. seed, run: 0 .. 2^32-1. */
GBG_API int gbg_normals(struct gbg_context *context, int64_t seed, int64_t run, int64_t at_step,
                        int64_t first_id, int dimension, int64_t n, double *values);

#ifdef __cplusplus
}
#endif
#endif
