/* L1: power laws of 32-bit pairs for sums over all pairs: 1/r^n from the usual integer seed y
 * (y^2 r^2 = 1 - e, |e| < 0.07) and minimax polynomials of our own: r^-2 = y^2 P(e) with relative
 * error 8e-9 at most before rounding, r^-3 with 2.8e-7, r^-7 with 2.1e-7; other powers are
 * exponentials of logarithms, 6e-7. Included by kernel files only. */
#ifndef GBG_BACKEND_CPU_DIRECT_LAW_H
#define GBG_BACKEND_CPU_DIRECT_LAW_H

#include "backend/cpu/simd.h"

/* Exponent (power+1)/2 = high + low of the general law, high with 12 bits. */
struct gbg_law {
    float high, low;
};

/* The seed's square t = y^2, and e. */
GBG_VECTOR vf gbg_law_seed(vf squared, vf *t, vf *e)
{
    vf y = vf_of_bits(vi_sub(vi_set(0x5f3759df), vi_shr(vi_of_bits(squared), 1)));
    *t = vf_mul(y, y);
    *e = vf_fnma(*t, squared, vf_set(1.0f));
    return y;
}

/* p x + c */
GBG_VECTOR vf gbg_law_next(vf p, vf x, float c)
{
    return vf_fma(p, x, vf_set(c));
}

/* |r|^-2 from the seed. */
GBG_VECTOR vf gbg_law_1(vf t, vf e)
{
    vf p = gbg_law_next(vf_set(0x1.00a376p0f), e, 0x1.01cc28p0f);
    p = gbg_law_next(p, e, 0x1.000094p0f);
    p = gbg_law_next(p, e, 0x1.fffe64p-1f);
    p = gbg_law_next(p, e, 0x1p0f);
    return vf_mul(t, gbg_law_next(p, e, 0x1p0f));
}

/* |r|^-3 */
GBG_VECTOR vf gbg_law_2(vf y, vf t, vf e)
{
    vf p = gbg_law_next(vf_set(0x1.3b8d16p1f), e, 0x1.1a06bap1f);
    p = gbg_law_next(p, e, 0x1.e001d6p0f);
    p = gbg_law_next(p, e, 0x1.7ffecap0f);
    return vf_mul(vf_mul(t, y), gbg_law_next(p, e, 0x1p0f));
}

/* |r|^-7 */
GBG_VECTOR vf gbg_law_6(vf y, vf t, vf e)
{
    vf p = gbg_law_next(vf_set(0x1.198696p5f), e, 0x1.7cf666p4f);
    p = gbg_law_next(p, e, 0x1.ce0dbep3f);
    p = gbg_law_next(p, e, 0x1.f7f610p2f);
    p = gbg_law_next(p, e, 0x1.bfffecp1f);
    p = gbg_law_next(p, e, 0x1.000002p0f);
    return vf_mul(vf_mul(vf_mul(vf_mul(t, t), t), y), p);
}

/* 2^-(q log2 r^2), q = (power+1)/2, with the exact part of q times the exponent kept apart. */
GBG_VECTOR vf gbg_law_general(vf squared, struct gbg_law q)
{
    vi bits = vi_of_bits(squared);
    vi exponent = vi_sar(vi_sub(bits, vi_set(0x3f3504f3)), 23);
    vf s = vf_sub(vf_of_bits(vi_sub(bits, vi_shl(exponent, 23))), vf_set(1.0f));
    vf l = gbg_law_next(vf_set(0x1.00d8d2p-3f), s, -0x1.aeb2a4p-3f);
    l = gbg_law_next(l, s, 0x1.bd30b0p-3f);
    l = gbg_law_next(l, s, -0x1.e87d00p-3f);
    l = gbg_law_next(l, s, 0x1.268f88p-2f);
    l = gbg_law_next(l, s, -0x1.7160e6p-2f);
    l = gbg_law_next(l, s, 0x1.ec76f4p-2f);
    l = gbg_law_next(l, s, -0x1.71546ap-1f);
    l = vf_mul(s, gbg_law_next(l, s, 0x1.715474p0f));
    vf whole = vf_from_vi(exponent), exact = vf_mul(whole, vf_set(-q.high));
    vi n = vi_from_vf(exact);
    vf f = vf_fnma(vf_set(q.low), whole, vf_sub(exact, vf_from_vi(n)));
    f = vf_fnma(vf_set(q.high + q.low), l, f);
    vi m = vi_from_vf(f);
    f = vf_sub(f, vf_from_vi(m));
    vf p = gbg_law_next(vf_set(0x1.41d350p-13f), f, 0x1.5f456ap-10f);
    p = gbg_law_next(p, f, 0x1.3b2dbcp-7f);
    p = gbg_law_next(p, f, 0x1.c6aed4p-5f);
    p = gbg_law_next(p, f, 0x1.ebfbdap-3f);
    p = gbg_law_next(p, f, 0x1.62e430p-1f);
    p = gbg_law_next(p, f, 0x1p0f);
    return vf_of_bits(vi_add(vi_of_bits(p), vi_shl(vi_add(n, m), 23)));
}

#endif
