/* L2: finding and removing overlaps in a caller's arrays. */
#ifndef GBG_ENGINE_OVERLAPS_H
#define GBG_ENGINE_OVERLAPS_H

#include "engine/bare.h"

/* Arguments have been checked. Pairs as indices from 0. */
int gbg_caller_find_overlaps(struct gbg_bare *bare, const double *diameter, double tolerance,
                             int64_t capacity, int32_t *first, int32_t *second, int64_t *count);

/* Moves the particles that took part in an overlap in x, y, z; others keep every bit. */
int gbg_caller_remove_overlaps(struct gbg_bare *bare, const double *diameter, int bounce,
                               int64_t max_rounds, double *const base[3], ptrdiff_t step,
                               int64_t *rounds);

#endif
