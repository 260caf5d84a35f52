/* L0: the periodic box and its fixed-point coordinates. */
#ifndef GBG_CORE_BOX_H
#define GBG_CORE_BOX_H

#include <math.h>
#include <stdint.h>

#include "core/inline.h"

/* A coordinate is an unsigned 64-bit fraction of the box length; the difference of two, read as a
 * signed number, is the minimum image, exactly. */
struct gbg_box {
    int dimension;
    double length[3];
    double origin[3];
    double quantum[3]; /* length 2^-64 */
};

#define GBG_TWO_64 18446744073709551616.0

static inline struct gbg_box gbg_box_make(int dimension, const double *length, const double *origin)
{
    struct gbg_box box = {.dimension = dimension};
    for (int a = 0; a < dimension; a++) {
        box.length[a] = length[a];
        box.origin[a] = origin ? origin[a] : 0.0;
        box.quantum[a] = length[a] / GBG_TWO_64;
    }
    return box;
}

/* Fraction of the box at coordinate r (any finite value) on axis a; *image receives the box number.
 * The fraction is rounded to the nearest 2^-64 that a double can name. */
GBG_INLINE uint64_t gbg_box_encode(const struct gbg_box *box, int a, double r, int32_t *image)
{
    double scaled = (r - box->origin[a]) / box->length[a];
    double whole = floor(scaled);
    double fraction = scaled - whole; /* in [0,1]; 1 when scaled is a tiny negative number */
    if (fraction >= 1.0) {
        whole += 1.0;
        fraction = 0.0;
    }
    if (image) {
        *image = (int32_t)whole;
    }
    return (uint64_t)(fraction * GBG_TWO_64);
}

/* Coordinate of a fraction, in [origin, origin + length). */
GBG_INLINE double gbg_box_decode(const struct gbg_box *box, int a, uint64_t fraction)
{
    double offset = (double)(fraction >> 11) * (box->quantum[a] * 2048.0);
    return box->origin[a] + offset;
}

/* Minimum-image difference p - q on axis a. */
GBG_INLINE double gbg_box_difference(const struct gbg_box *box, int a, uint64_t p, uint64_t q)
{
    return (double)(int64_t)(p - q) * box->quantum[a];
}

#endif
