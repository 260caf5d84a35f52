/* L1: power laws of the cut-off sums, the same bits on the CPU and on CUDA. Included by kernel
 * files only. */
#ifndef GBG_BACKEND_CPU_POWER_H
#define GBG_BACKEND_CPU_POWER_H

#include <math.h>

#include "backend/cpu/simd.h"
#include "core/inline.h"

/* |r|^-(power+1) of a squared distance, for the powers 2 and 6. The square of the inverse root is
 * corrected by its own remainder, so that its cube does not triple the error. */
GBG_VECTOR vf gbg_inverse_power(vf squared, int power)
{
    vf inverse = vf_rsqrt(squared), second = vf_mul(inverse, inverse);
    vf rest = vf_fnma(second, squared, vf_set(1.0f));
    second = vf_fma(second, rest, second);
    inverse = vf_fma(vf_mul(inverse, vf_set(0.5f)), rest, inverse);
    return power == 2 ? vf_mul(second, inverse)
                      : vf_mul(vf_mul(vf_mul(second, second), second), inverse);
}

/* The whole power, or 0 for one that needs the C library. */
enum { GBG_POWER_MOST = 24 };
GBG_INLINE int gbg_whole_power(double power)
{
    return power >= 1.0 && power <= GBG_POWER_MOST && power == rint(power) ? (int)power : 0;
}

/* |r|^-(whole+1) of a squared distance by operations that IEEE 754 defines to the last bit;
 * relative error below (whole/2 + 2) 2^-53. */
GBG_INLINE double gbg_inverse_whole(double squared, int whole)
{
    /* (whole+1)/2 squares, of which the last is a root if whole is even */
    double product = whole & 1 ? squared : squared * sqrt(squared);
    for (int k = 2 + !(whole & 1); k < whole; k += 2) {
        product *= squared;
    }
    return 1.0 / product;
}

/* |r|^-(power+1) of a squared distance; other powers than whole ones differ by 2 units in the last
 * place between C libraries. */
GBG_INLINE double gbg_inverse_double(double squared, double power, int whole)
{
    return whole ? gbg_inverse_whole(squared, whole) : pow(squared, -0.5 * (power + 1.0));
}

/* Lengths in units of the cut-off, up to a power of two: no choice of units overflows a float. */
struct gbg_cutoff_unit {
    double unit;    /* of length, mixed sums */
    float scale[3]; /* of local coordinates, in units */
    float limit;    /* squared cut-off, in units */
};

/* list_unit: length of a unit of a local coordinate. */
static inline struct gbg_cutoff_unit gbg_cutoff_unit_make(int dimension, const double *list_unit,
                                                          double cutoff)
{
    struct gbg_cutoff_unit made = {0};
    made.unit = ldexp(list_unit[0], ilogb(cutoff / list_unit[0]));
    for (int a = 0; a < dimension; a++) {
        made.scale[a] = (float)(list_unit[a] / made.unit);
    }
    made.limit = (float)(cutoff / made.unit * (cutoff / made.unit));
    return made;
}

#endif
