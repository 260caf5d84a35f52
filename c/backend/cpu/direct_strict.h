/* L1: sums over all pairs that have the same bits everywhere: their definition, for the CPU and for
 * CUDA. Included by kernel files only.
 *
 * The field of a particle is the sum, in double precision and in the order of ids, of its spans of
 * GBG_STRICT_SPAN sources; a span is the same sum of blocks of GBG_STRICT_BLOCK sources; a block is
 * the sum in single precision of its pairs in the order of ids, multiply-adds fused. A pair is the
 * difference of the high words, wrapped as an integer, and a power law made of operations that IEEE
 * 754 defines. Doubtful pairs (below gbg_strict_near; half a box apart on an axis, so that high
 * words cannot tell the nearest image) count as nothing in their block and are added to the span,
 * before the block, in double precision from all 64 bits. So are all pairs if the power is above 6.
 */
#ifndef GBG_BACKEND_CPU_DIRECT_STRICT_H
#define GBG_BACKEND_CPU_DIRECT_STRICT_H

#include <math.h>
#include <string.h>

#include "backend/backend.h"
#include "backend/cpu/direct_law.h"
#include "backend/cpu/power.h"

/* Quanta of the longest axis below which pairs are doubtful: as in direct.h, where 32 bits are too
 * coarse, but at least some of the closest pairs of n random particles, of which one alone may
 * decide the error of a high power. */
GBG_INLINE double gbg_strict_near(int64_t n, int dimension)
{
    double side = 1.0, least = 0x1p21;
    while (dimension == 3 && side * side * side < (double)n) {
        side += 1.0;
    }
    double near = 0x1p33 / (dimension == 3 ? side * side : n > 0 ? (double)n : 1.0);
    return near > least ? near : least;
}

enum { GBG_STRICT_BLOCK = 64, GBG_STRICT_SPAN = 1024 };

/* Law of a pair: a whole power up to GBG_STRICT_MOST, another one up to it, or double precision. */
enum { GBG_STRICT_DOUBLE = -1, GBG_STRICT_GENERAL = 0, GBG_STRICT_MOST = 6 };

struct gbg_strict {
    int dimension, law;
    int whole; /* the power, or 0 if it is not whole */
    double power;
    float near,
        scale[3];   /* squared, of differences of high words; unit: 2^-6 of the longest side */
    double fine[3]; /* of differences of 64 bits */
    struct gbg_law general;
    double largest; /* strengths are over this one */
    double factor;  /* fields to forces in the user's units */
};

/* squared^-q of a normal number, relative error below (q + 1) 2e-14: no function of a library. */
GBG_INLINE double gbg_strict_raise(double squared, double q)
{
    uint64_t bits, one = UINT64_C(0x3ff0000000000000), part;
    double m, first, second;
    memcpy(&bits, &squared, sizeof bits);
    int64_t exponent = (int64_t)(bits - UINT64_C(0x3fe6a09e667f3bcd)) >> 52; /* m from sqrt(1/2) */
    bits -= (uint64_t)exponent << 52;
    memcpy(&m, &bits, sizeof m);
    /* log m = 2 (s + s^3/3 + ...) */
    double s = (m - 1.0) / (m + 1.0), z = s * s, sum = 1.0 / 19.0;
    for (int k = 17; k > 0; k -= 2) {
        sum = sum * z + 1.0 / (double)k;
    }
    double t = -q * ((double)exponent + s * sum * 2.8853900817779268); /* 2/ln 2 */
    double n = floor(t + 0.5), x = (t - n) * 0.69314718055994531, e = 1.0;
    for (int k = 14; k > 0; k--) {
        e = e * (x * (1.0 / (double)k)) + 1.0;
    }
    int64_t whole = (int64_t)n,
            half = whole / 2; /* in two steps: the result may be 0 or infinite */
    part = one + ((uint64_t)half << 52);
    memcpy(&first, &part, sizeof first);
    part = one + ((uint64_t)(whole - half) << 52);
    memcpy(&second, &part, sizeof second);
    return e * first * second;
}

/* length^-power */
GBG_INLINE double gbg_strict_unit(double length, int whole, double power)
{
    double product = 1.0;
    for (int k = 0; k < whole; k++) {
        product *= length;
    }
    return whole ? 1.0 / product : gbg_strict_raise(length * length, 0.5 * power);
}

/* The sum of a state's forces; arrays of strengths belong to a caller and are at most 1. */
static inline struct gbg_strict gbg_strict_make(const struct gbg_state *state, double power)
{
    struct gbg_strict s = {0};
    const double q = 0.5 * (power + 1.0);
    double near = gbg_strict_near(state->owned + state->ghost, state->box.dimension) * 0x1p-26;
    double longest = 0.0;
    s.dimension = state->box.dimension;
    s.power = power;
    s.whole = gbg_whole_power(power);
    s.law = power > GBG_STRICT_MOST ? GBG_STRICT_DOUBLE : s.whole;
    s.near = (float)(near * near);
    s.general.high = (float)(rint(q * 0x1p8) * 0x1p-8);
    s.general.low = (float)(q - (double)s.general.high);
    for (int a = 0; a < s.dimension; a++) {
        longest = fmax(longest, state->box.length[a]);
    }
    for (int a = 0; a < s.dimension; a++) {
        s.scale[a] = (float)(state->box.length[a] / longest * 0x1p-26);
        s.fine[a] = state->box.length[a] / longest * 0x1p-58;
    }
    for (int k = 0; k < state->n_species && !state->own_alpha; k++) {
        s.largest = fmax(s.largest, fabs(state->alpha[k]));
    }
    s.largest = s.largest > 0.0 ? s.largest : 1.0;
    s.factor = s.largest * gbg_strict_unit(longest * 0x1p-6, s.whole, power);
    return s;
}

GBG_INLINE double gbg_strict_alpha(const struct gbg_strict *s, const struct gbg_state *state,
                                   int64_t i)
{
    return (state->own_alpha ? state->own_alpha[i]
                             : state->alpha[state->species ? state->species[i] : 0]) /
           s->largest;
}

/* Where particle i stands among the sources. */
GBG_INLINE int64_t gbg_strict_place(const struct gbg_state *state, int64_t i)
{
    return i < state->owned ? gbg_rank_of(state, i) : i;
}

/* |r|^-(power+1), 32 bits; garbage of a doubtful pair. */
GBG_VECTOR vf gbg_strict_weight(vf squared, struct gbg_law general, int law)
{
    vf t, e, y, w;
    if (law == GBG_STRICT_GENERAL) {
        return gbg_law_general(squared, general);
    }
    y = gbg_law_seed(squared, &t, &e);
    if (law == 1 || law == 2 || law == 6) {
        return law == 1 ? gbg_law_1(t, e) : law == 2 ? gbg_law_2(y, t, e) : gbg_law_6(y, t, e);
    }
    w = gbg_law_1(t, e);
    return law == 3   ? vf_mul(w, w)
           : law == 4 ? vf_mul(w, gbg_law_2(y, t, e))
                      : vf_mul(vf_mul(w, w), w);
}

/* The vector of a pair from differences of high words; returns its square. */
GBG_VECTOR vf gbg_strict_vector(const float *scale, const vi *difference, int dimension, vf *r)
{
    vf squared = vf_set(0.0f);
    for (int a = 0; a < dimension; a++) {
        r[a] = vf_mul(vf_from_vi(difference[a]), vf_set(scale[a]));
        squared = a == 0 ? vf_mul(r[a], r[a]) : vf_fma(r[a], r[a], squared);
    }
    return squared;
}

GBG_VECTOR vm gbg_strict_doubtful(vf squared, float near, const vi *difference, int dimension)
{
    vm doubt = vf_lt(squared, vf_set(near));
    for (int a = 0; a < dimension; a++) {
        doubt = vm_or(doubt, vi_eq(difference[a], vi_set(INT32_MIN)));
    }
    return doubt;
}

/* |r|^-(power+1) of r^2 > 0 in double precision. */
GBG_VECTOR vd gbg_strict_weight_fine(const struct gbg_strict *s, vd squared)
{
    if (!s->whole) {
        double lane[VD_LANES];
        vd_store(lane, squared);
        for (int k = 0; k < VD_LANES; k++) {
            lane[k] = gbg_strict_raise(lane[k], 0.5 * (s->power + 1.0));
        }
        return vd_load(lane);
    }
    vd y = vd_rsqrt(squared), product = vd_set(1.0);
    for (int left = s->whole + 1; left; left >>= 1) {
        product = left & 1 ? vd_mul(product, y) : product;
        y = vd_mul(y, y);
    }
    return product;
}

/* Adds alpha r/|r|^(power+1) from differences of 64 bits to the sums of the lanes in `these`;
 * nothing where two particles coincide. */
GBG_VECTOR void gbg_strict_add_fine(const struct gbg_strict *s, const vl *difference, vd alpha,
                                    vdm these, int dimension, vd *sum)
{
    vd r[3], squared = vd_set(0.0);
    for (int a = 0; a < dimension; a++) {
        r[a] = vd_mul(vd_from_vl(difference[a]), vd_set(s->fine[a]));
        squared = vd_fma(r[a], r[a], squared);
    }
    vdm apart = vd_lt(vd_set(0.0), squared);
    vd w = gbg_strict_weight_fine(s, vd_select(apart, squared, vd_set(1.0)));
    w = vd_keep(these, vd_keep(apart, vd_mul(w, alpha)));
    for (int a = 0; a < dimension; a++) {
        sum[a] = vd_fma(w, r[a], sum[a]);
    }
}

#endif
