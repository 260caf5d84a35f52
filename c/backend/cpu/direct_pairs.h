/* L1: pairs in double precision, for the double sum and for near pairs of the mixed one. Included
 * by kernel files only. */
#ifndef GBG_BACKEND_CPU_DIRECT_PAIRS_H
#define GBG_BACKEND_CPU_DIRECT_PAIRS_H

#include "backend/cpu/direct.h"
#include "backend/cpu/simd.h"

/* r^-(power+1) from r^2 > 0: products of 1/r and its root; the C library for other powers. */
static inline vd gbg_power_lanes(const struct gbg_power *power, vd squared)
{
    if (!power->halves) {
        double lane[VD_LANES];
        vd_store(lane, squared);
        for (int k = 0; k < VD_LANES; k++) {
            lane[k] = gbg_power_scalar(power, lane[k]);
        }
        return vd_load(lane);
    }
    vd base = vd_rsqrt(squared);
    vd result = power->halves & 1 ? vd_sqrt(base) : vd_set(1.0);
    for (int left = power->halves >> 1; left; left >>= 1) {
        if (left & 1) {
            result = vd_mul(result, base);
        }
        base = vd_mul(base, base);
    }
    return result;
}

/* Vectors r from particle k to particles i.., of positions cut to the bits of `mask`, and
 * |r|^-(power+1): 0 where they coincide, that of `least` (squared) where they are nearer. */
static inline vd gbg_direct_weight(const struct gbg_direct *d, int64_t i, int64_t k, int64_t mask,
                                   double least, int dimension, vd r[3])
{
    vd squared = vd_set(0.0);
    for (int a = 0; a < dimension; a++) {
        vl own = vl_and(vl_load(d->position[a] + i), vl_set(mask));
        vl difference = vl_sub(own, vl_set((int64_t)d->position[a][k] & mask));
        r[a] = vd_mul(vd_from_vl(difference), vd_set(d->scale[a] * 0x1p-32));
        squared = vd_fma(r[a], r[a], squared);
    }
    vdm apart = vd_lt(vd_set(0.0), squared);
    squared = vd_max(vd_select(apart, squared, vd_set(1.0)), vd_set(least));
    return vd_keep(apart, gbg_power_lanes(&d->power, squared));
}

#endif
