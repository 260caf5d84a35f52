/* L1: near pairs of sums by a mesh: power law less polynomial, one formula a precision for every
 * instruction set. Included by kernel files only. */
#ifndef GBG_BACKEND_CPU_EWALD_LAW_H
#define GBG_BACKEND_CPU_EWALD_LAW_H

#include "backend/cpu/direct_law.h"

/* u^-((power+1)/2) + minus for a whole power from 1 to 6 and normal u > 0. Single precision: the
 * usual integer seed and minimax polynomials of our own in what it leaves, relative error of the
 * first term 8e-9 (power 1), 2e-8, 4e-8, 1e-7, 1e-8, 1e-8 (power 6) before rounding. */
GBG_VECTOR vf gbg_ewald_weight(vf u, vf minus, int power)
{
    vf t, e, y = gbg_law_seed(u, &t, &e), p = t, base = t;
    switch (power) {
    case 1:
        p = gbg_law_next(vf_set(0x1.00a3bep+0f), e, 0x1.01cc2cp+0f);
        p = gbg_law_next(p, e, 0x1.000094p+0f);
        p = gbg_law_next(p, e, 0x1.fffe64p-1f);
        p = gbg_law_next(p, e, 0x1p+0f);
        p = gbg_law_next(p, e, 0x1p+0f);
        break;
    case 2:
        p = gbg_law_next(vf_set(0x1.5b3fdcp+1f), e, 0x1.3da298p+1f);
        p = gbg_law_next(p, e, 0x1.180154p+1f);
        p = gbg_law_next(p, e, 0x1.dffda4p+0f);
        p = gbg_law_next(p, e, 0x1.7ffffep+0f);
        p = gbg_law_next(p, e, 0x1p+0f);
        base = vf_mul(t, y);
        break;
    case 3:
        p = gbg_law_next(vf_set(0x1.80ab6ep+2f), e, 0x1.4324d2p+2f);
        p = gbg_law_next(p, e, 0x1.000228p+2f);
        p = gbg_law_next(p, e, 0x1.7ffd3p+1f);
        p = gbg_law_next(p, e, 0x1.fffffcp+0f);
        p = gbg_law_next(p, e, 0x1p+0f);
        base = vf_mul(t, t);
        break;
    case 4:
        p = gbg_law_next(vf_set(0x1.77d748p+3f), e, 0x1.240a8ap+3f);
        p = gbg_law_next(p, e, 0x1.a405b4p+2f);
        p = gbg_law_next(p, e, 0x1.17fd1p+2f);
        p = gbg_law_next(p, e, 0x1.3ffffcp+1f);
        p = gbg_law_next(p, e, 0x1p+0f);
        base = vf_mul(vf_mul(t, t), y);
        break;
    case 5:
        p = gbg_law_next(vf_set(0x1.c07fb2p+4f), e, 0x1.54b67cp+4f);
        p = gbg_law_next(p, e, 0x1.e00a7cp+3f);
        p = gbg_law_next(p, e, 0x1.3ffa66p+3f);
        p = gbg_law_next(p, e, 0x1.7ffff4p+2f);
        p = gbg_law_next(p, e, 0x1.800004p+1f);
        p = gbg_law_next(p, e, 0x1p+0f);
        base = vf_mul(vf_mul(t, t), t);
        break;
    default:
        p = gbg_law_next(vf_set(0x1.8f071p+5f), e, 0x1.1df504p+5f);
        p = gbg_law_next(p, e, 0x1.776b8p+4f);
        p = gbg_law_next(p, e, 0x1.cdf57ep+3f);
        p = gbg_law_next(p, e, 0x1.f7ffe6p+2f);
        p = gbg_law_next(p, e, 0x1.c00006p+1f);
        p = gbg_law_next(p, e, 0x1p+0f);
        base = vf_mul(vf_mul(vf_mul(t, t), t), y);
    }
    return vf_fma(base, p, minus);
}

/* The same in double precision: what the inverse root's square misses of 1/u is put right to first
 * order, so that powers of it are good to a few units in the last place. */
GBG_VECTOR vd gbg_ewald_weight_double(vd u, vd minus, int power)
{
    vd y = vd_rsqrt(u), t = vd_mul(y, y), e = vd_fnma(t, u, vd_set(1.0));
    vd base = t;
    for (int k = 3; k <= power; k += 2) {
        base = vd_mul(base, t);
    }
    if (power % 2 == 0) { /* y^2 is t up to rounding */
        base = vd_mul(base, y);
    }
    vd right = vd_mul(vd_set(0.5 * (power + 1)), e);
    return vd_add(vd_fma(base, right, base), minus);
}

#endif
