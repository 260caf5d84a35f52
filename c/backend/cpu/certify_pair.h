/* L1: squares of 32-bit differences for the certificate's passes, in the names of simd.h: how far
 * it says that particles moved is the same to the last bit on the CPU and on a GPU. */
#ifndef GBG_BACKEND_CPU_CERTIFY_PAIR_H
#define GBG_BACKEND_CPU_CERTIFY_PAIR_H

#include "backend/cpu/simd.h"

GBG_VECTOR vf gbg_certify_squared(vi a, vi b, vf unit, vf sum)
{
    vf d = vf_mul(vf_from_vi(vi_sub(a, b)), unit);
    return vf_fma(d, d, sum);
}

#endif
