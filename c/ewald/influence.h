/* Numbers of long-range sums: influence of many rows of waves at a time, and the mean of near
 * parts. */
#ifndef GBG_EWALD_INFLUENCE_H
#define GBG_EWALD_INFLUENCE_H

#include <stdint.h>

#include "ewald/plan.h"

/* Rows (n_1, n_2) of gbg_ewald_fill_row for n_1, n_2 >= 0, n_1 fastest: `count` from number `first`
 * on, one behind the other, by so many threads. */
void gbg_ewald_fill_rows(const struct gbg_ewald_plan *plan, const struct gbg_ewald_axis axis[3],
                         int threads, int64_t first, int64_t count, double *rows);

/* Integral over the volume of one source's near potential r^-s/s (power 1: -log r) less its smooth
 * part. Where the power law itself has none, it is what is left when a power of a small radius (s =
 * dimension: its logarithm, with the edge of a cube of the box's volume) is taken off. Over the
 * volume it is what a potential is to be less by for each unit of sources, so that its mean
 * vanishes. */
double gbg_ewald_near_integral(const struct gbg_ewald_plan *plan);

#endif
