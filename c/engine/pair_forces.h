/* L2: pair forces on a caller's arrays. */
#ifndef GBG_ENGINE_PAIR_FORCES_H
#define GBG_ENGINE_PAIR_FORCES_H

#include "engine/bare.h"

/* What to sum: arguments of gbg_pair_forces that have been checked. */
struct gbg_pair_sum {
    double power, cutoff;   /* cutoff 0: all pairs */
    int use_double, strict; /* of the sum over all pairs; else mixed */
    const double *alpha, *mobility;
};

/* Forces into force[axis][i step]. */
int gbg_caller_pair_forces(struct gbg_bare *bare, const struct gbg_pair_sum *sum,
                           double *const force[3], ptrdiff_t step);

#endif
