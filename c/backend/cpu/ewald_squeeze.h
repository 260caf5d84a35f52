/* L1, CPU, per instruction set: the lanes of a vector that are kept, one after the other in memory.
 * Included by kernel files only. */
#ifndef GBG_BACKEND_CPU_EWALD_SQUEEZE_H
#define GBG_BACKEND_CPU_EWALD_SQUEEZE_H

#include "backend/cpu/simd.h"

/* squeeze_single(to, bits, v), squeeze_double: the lanes of the bits at `to`, where a whole vector
 * may be written. */
#if VF_LANES == 16
/* the forms that write to memory are slow on some processors */
static inline void squeeze_single(float *to, uint32_t bits, vf v)
{
    _mm512_storeu_ps(to, _mm512_maskz_compress_ps((__mmask16)bits, v));
}
static inline void squeeze_double(double *to, uint32_t bits, vd v)
{
    _mm512_storeu_pd(to, _mm512_maskz_compress_pd((__mmask8)bits, v));
}
#elif defined(__AVX2__) && VF_LANES == 8
/* Bytes of an entry: the lanes of its bits, lowest first. */
#define SQUEEZE_BELOW(b, l) __builtin_popcount((b) & ((1 << (l)) - 1))
#define SQUEEZE_LANE(b, l) ((uint64_t)((b) >> (l)&1) * (l) << 8 * (SQUEEZE_BELOW(b, l) & 7))
#define SQUEEZE_ENTRY(b)                                                                           \
    (SQUEEZE_LANE(b, 0) | SQUEEZE_LANE(b, 1) | SQUEEZE_LANE(b, 2) | SQUEEZE_LANE(b, 3) |           \
     SQUEEZE_LANE(b, 4) | SQUEEZE_LANE(b, 5) | SQUEEZE_LANE(b, 6) | SQUEEZE_LANE(b, 7))
#define SQUEEZE_4(b)                                                                               \
    SQUEEZE_ENTRY(b), SQUEEZE_ENTRY(b + 1), SQUEEZE_ENTRY(b + 2), SQUEEZE_ENTRY(b + 3)
#define SQUEEZE_16(b) SQUEEZE_4(b), SQUEEZE_4(b + 4), SQUEEZE_4(b + 8), SQUEEZE_4(b + 12)
#define SQUEEZE_64(b) SQUEEZE_16(b), SQUEEZE_16(b + 16), SQUEEZE_16(b + 32), SQUEEZE_16(b + 48)
static const uint64_t squeeze_lanes[256] = {SQUEEZE_64(0), SQUEEZE_64(64), SQUEEZE_64(128),
                                            SQUEEZE_64(192)};

static inline void squeeze_single(float *to, uint32_t bits, vf v)
{
    __m256i lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128((int64_t)squeeze_lanes[bits]));
    _mm256_storeu_ps(to, _mm256_permutevar8x32_ps(v, lanes));
}
/* Both halves of a double follow its lane. */
static inline void squeeze_double(double *to, uint32_t bits, vd v)
{
    uint32_t both = (bits & 1) * 3 | (bits & 2) * 6 | (bits & 4) * 12 | (bits & 8) * 24;
    __m256i lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128((int64_t)squeeze_lanes[both]));
    __m256 moved = _mm256_permutevar8x32_ps(_mm256_castpd_ps(v), lanes);
    _mm256_storeu_pd(to, _mm256_castps_pd(moved));
}
#else
static inline void squeeze_single(float *to, uint32_t bits, vf v)
{
    float lane[VF_LANES];
    vf_store(lane, v);
    for (int l = 0, n = 0; l < VF_LANES; l++) {
        to[n] = lane[l];
        n += (int)(bits >> l & 1);
    }
}
static inline void squeeze_double(double *to, uint32_t bits, vd v)
{
    double lane[VD_LANES];
    vd_store(lane, v);
    for (int l = 0, n = 0; l < VD_LANES; l++) {
        to[n] = lane[l];
        n += (int)(bits >> l & 1);
    }
}
#endif

#endif
