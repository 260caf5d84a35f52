/* L1, per instruction set: squared lengths from differences of coordinates in 32 bits. */
#ifndef GBG_BACKEND_CPU_LIST_SQUARE_H
#define GBG_BACKEND_CPU_LIST_SQUARE_H

#include "backend/cpu/simd.h"

/* sum + (difference unit)^2 */
GBG_VECTOR vf gbg_list_add_square(vi difference, vf unit, vf sum)
{
    vf length = vf_mul(vf_from_vi(difference), unit);
    return vf_fma(length, length, sum);
}

#endif
