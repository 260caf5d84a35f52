/* L1: the noise tape in vectors: one particle id a lane, two or three normal deviates each.
 *
 * Words w0..w3 = Philox4x32-10 with key (seed, run) and counter (step, id, stream), core/random.h.
 * Box-Muller in single precision: u = ((w0 >> 1) + 1/2) 2^-31, r = sqrt(-2 ln u); the angle t is
 * the top two bits of w1 in quarter turns plus the other thirty, read as a signed fraction in
 * [-1/2, 1/2), of a quarter turn; xi = (r cos t, r sin t), and the third component is the first of
 * the pair that w2, w3 give. |xi| <= 6.67. The logarithm keeps its relative accuracy
 * near u = 1 and the angle is reduced in integers, so every deviate is within 5 units in the last
 * place of exact arithmetic on the same words (4.43 measured over 6e7 deviates); for each u the
 * four angles a quarter turn apart give deviates that add up to exactly 0.
 *
 * Polynomials are our own minimax fits: ln(1+s) = s + s^2 Q(s) on [sqrt(1/2)-1, sqrt(2)-1]
 * to 3.5e-8, sin and cos of a quarter turn around 0 to 4e-8. */
#ifndef GBG_BACKEND_CPU_NOISE_H
#define GBG_BACKEND_CPU_NOISE_H

#include <math.h>

#include "backend/backend.h"
#include "backend/cpu/simd.h"
#include "core/random.h"

enum { GBG_NOISE_NONE, GBG_NOISE_CLAMP, GBG_NOISE_REDRAW, GBG_NOISE_REDRAWS = 15 };

#ifndef GBG_PHILOX_LANES
/* One round of Philox on the even lanes; odd lanes hold anything. */
GBG_VECTOR void gbg_philox_round(vi c[4], vi key0, vi key1)
{
    vi p = vi_mul_even(c[0], vi_set((int32_t)0xD2511F53u));
    vi q = vi_mul_even(c[2], vi_set((int32_t)0xCD9E8D57u));
    c[0] = vi_xor(vi_xor(vi_odd_to_even(q), c[1]), key0);
    c[1] = q;
    c[2] = vi_xor(vi_xor(vi_odd_to_even(p), c[3]), key1);
    c[3] = p;
}

/* Counter words in, random words out. */
GBG_VECTOR void gbg_philox_lanes(vi c[4], uint32_t key0, uint32_t key1)
{
    vi odd[4];
    for (int w = 0; w < 4; w++) {
        odd[w] = vi_odd_to_even(c[w]);
    }
    for (int round = 0; round < 10; round++) {
        vi k0 = vi_set((int32_t)key0), k1 = vi_set((int32_t)key1);
        gbg_philox_round(c, k0, k1);
        gbg_philox_round(odd, k0, k1);
        key0 += 0x9E3779B9u;
        key1 += 0xBB67AE85u;
    }
    for (int w = 0; w < 4; w++) {
        c[w] = vi_weave(c[w], odd[w]);
    }
}
#endif

/* -2 ln u. */
GBG_VECTOR vf gbg_noise_exponential(vi word)
{
    vi v = vi_shr(word, 1);
    vf f = vf_add(vf_from_vi(v), vf_set(0.5f)); /* u 2^31 */
    vi bits = vi_of_bits(f);
    vi exponent =
        vi_sar(vi_sub(bits, vi_set(0x3f3504f3)), 23); /* f = m 2^exponent, m >= sqrt(1/2) */
    vf m = vf_of_bits(vi_sub(bits, vi_shl(exponent, 23)));
    vi k = vi_sub(exponent, vi_set(31));
    /* Near u = 1, u - 1 comes from the integer, without the rounding of f. */
    vf below = vf_add(vf_from_vi(vi_sub(vi_set(0x7fffffff), v)), vf_set(0.5f));
    vf s =
        vf_select(vi_eq(k, vi_set(0)), vf_mul(below, vf_set(-0x1p-31f)), vf_sub(m, vf_set(1.0f)));
    vf q = vf_set(0x1.65c76ap-4f);
    q = vf_fma(q, s, vf_set(-0x1.250494p-3f));
    q = vf_fma(q, s, vf_set(0x1.318522p-3f));
    q = vf_fma(q, s, vf_set(-0x1.535d32p-3f));
    q = vf_fma(q, s, vf_set(0x1.98d2c0p-3f));
    q = vf_fma(q, s, vf_set(-0x1.00049ap-2f));
    q = vf_fma(q, s, vf_set(0x1.5556f4p-2f));
    q = vf_fma(q, s, vf_set(-0x1.fffffap-2f));
    vf log = vf_fma(vf_mul(s, s), q, s);
    log = vf_fma(vf_from_vi(k), vf_set(0x1.62e430p-1f), log);
    return vf_mul(log, vf_set(-2.0f));
}

GBG_VECTOR vf gbg_noise_radius(vi word)
{
    return vf_sqrt(gbg_noise_exponential(word));
}

/* Cosine and sine of the angle: the top two bits are the quarter, the others its signed rest. */
GBG_VECTOR void gbg_noise_direction(vi word, vf *cosine, vf *sine)
{
    vf x = vf_mul(vf_from_vi(vi_shl(word, 2)), vf_set(0x1p-31f)); /* in eighths of a turn */
    vf x2 = vf_mul(x, x);
    vf s = vf_fma(vf_set(-0x1.33198ep-15f), x2, vf_set(0x1.4680a4p-9f));
    s = vf_fma(s, x2, vf_set(-0x1.4abc24p-4f));
    s = vf_mul(x, vf_fma(s, x2, vf_set(0x1.921fb6p-1f)));
    vf c = vf_fma(vf_set(-0x1.4e78bep-12f), x2, vf_set(0x1.03b058p-6f));
    c = vf_fma(c, x2, vf_set(-0x1.3bd39cp-2f));
    c = vf_fma(c, x2, vf_set(1.0f));
    const vi sign = vi_set(INT32_MIN), quarter = vi_set(0x40000000);
    vm odd = vi_eq(vi_and(word, quarter), quarter);
    vi flip_cosine = vi_and(vi_add(word, quarter), sign), flip_sine = vi_and(word, sign);
    *cosine = vf_of_bits(vi_xor(vi_of_bits(vf_select(odd, s, c)), flip_cosine));
    *sine = vf_of_bits(vi_xor(vi_of_bits(vf_select(odd, c, s)), flip_sine));
}

/* Unlimited deviates of one stream. */
GBG_VECTOR void gbg_noise_draw(const struct gbg_noise *noise, uint64_t step, vi id_low,
                                  vi id_high, uint32_t stream, int dimension, vf xi[3])
{
    vi word[4] = {vi_set((int32_t)(uint32_t)step), vi_set((int32_t)(uint32_t)(step >> 32)), id_low,
                  vi_or(vi_and(id_high, vi_set(0xFFFFFF)), vi_set((int32_t)(stream << 24)))};
    gbg_philox_lanes(word, noise->seed, noise->run);
    vf radius = gbg_noise_radius(word[0]), cosine, sine;
    gbg_noise_direction(word[1], &cosine, &sine);
    xi[0] = vf_mul(radius, cosine);
    xi[1] = vf_mul(radius, sine);
    if (dimension == 3) {
        gbg_noise_direction(word[3], &cosine, &sine);
        xi[2] = vf_mul(gbg_noise_radius(word[2]), cosine);
    }
}

/* The largest float that is not above a positive limit. */
GBG_VECTOR float gbg_noise_limit(const struct gbg_noise *noise)
{
    float limit = (float)noise->limit;
    return (double)limit > noise->limit ? nextafterf(limit, 0.0f) : limit;
}

GBG_VECTOR vf gbg_noise_clamp(vf xi, float limit)
{
    return vf_max(vf_min(xi, vf_set(limit)), vf_set(-limit));
}

/* Lanes outside +-limit. */
GBG_VECTOR vm gbg_noise_outside(vf xi, float limit)
{
    return vm_or(vf_lt(vf_set(limit), xi), vf_lt(xi, vf_set(-limit)));
}

/* Each component outside the limit is replaced by that of the first stream 1..15 where it is
 * inside, or clamped when there is none. */
GBG_VECTOR void gbg_noise_redraw(const struct gbg_noise *noise, uint64_t step, vi id_low,
                                    vi id_high, int dimension, float limit, vf xi[3])
{
    for (uint32_t stream = 1; stream <= GBG_NOISE_REDRAWS; stream++) {
        uint32_t left = 0;
        for (int a = 0; a < dimension; a++) {
            left |= vm_bits(gbg_noise_outside(xi[a], limit));
        }
        if (!left) {
            return;
        }
        vf fresh[3];
        gbg_noise_draw(noise, step, id_low, id_high, stream, dimension, fresh);
        for (int a = 0; a < dimension; a++) {
            xi[a] = vf_select(gbg_noise_outside(xi[a], limit), fresh[a], xi[a]);
        }
    }
    for (int a = 0; a < dimension; a++) {
        xi[a] = gbg_noise_clamp(xi[a], limit);
    }
}

/* Limited deviates, not yet multiplied by noise->scale, for the ids in the lanes: low words and
 * high words (of which 24 bits count). */
GBG_VECTOR void gbg_noise_lanes(const struct gbg_noise *noise, uint64_t step, vi id_low,
                                   vi id_high, int dimension, vf xi[3])
{
    gbg_noise_draw(noise, step, id_low, id_high, GBG_STREAM_NOISE, dimension, xi);
    if (noise->limit_by == GBG_NOISE_CLAMP) {
        for (int a = 0; a < dimension; a++) {
            xi[a] = gbg_noise_clamp(xi[a], gbg_noise_limit(noise));
        }
    } else if (noise->limit_by == GBG_NOISE_REDRAW) {
        gbg_noise_redraw(noise, step, id_low, id_high, dimension, gbg_noise_limit(noise), xi);
    }
}

/* Low and high words of the ids first .. first + VF_LANES - 1. */
GBG_VECTOR void gbg_noise_ids(uint64_t first, vi *id_low, vi *id_high)
{
    static const int32_t lane[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    const vi sign = vi_set(INT32_MIN), start = vi_set((int32_t)(uint32_t)first);
    *id_low = vi_add(start, vi_load(lane));
    vm carry = vi_lt(vi_xor(*id_low, sign), vi_xor(start, sign));
    vi high = vi_set((int32_t)(first >> 32));
    *id_high = vi_select(carry, vi_add(high, vi_set(1)), high);
}

#endif
