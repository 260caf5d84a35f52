/* L1, CPU: eight numbers at a time, whatever the width of the registers, so that meshes are read
 * and written in the same pieces by every instruction set. f8: floats, d8: doubles.
 *   *_set (all lanes) *_load *_store *_add *_mul; *_fma(a, b, c) = a b + c, in one rounding except
 *   where the generic form has no such instruction; *_sum: ((0+4)+(2+6))+((1+5)+(3+7)). */
#ifndef GBG_BACKEND_CPU_EWALD_LANES_H
#define GBG_BACKEND_CPU_EWALD_LANES_H

#include "backend/cpu/simd.h"

#if defined(__AVX2__) && defined(__FMA__)

typedef __m256 f8;

static inline f8 f8_set(float a)
{
    return _mm256_set1_ps(a);
}
static inline f8 f8_load(const float *p)
{
    return _mm256_loadu_ps(p);
}
static inline void f8_store(float *p, f8 a)
{
    _mm256_storeu_ps(p, a);
}
static inline f8 f8_add(f8 a, f8 b)
{
    return _mm256_add_ps(a, b);
}
static inline f8 f8_mul(f8 a, f8 b)
{
    return _mm256_mul_ps(a, b);
}
static inline f8 f8_fma(f8 a, f8 b, f8 c)
{
    return _mm256_fmadd_ps(a, b, c);
}
static inline float f8_sum(f8 a)
{
    __m128 four = _mm_add_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps(a, 1));
    __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_add_ss(two, _mm_movehdup_ps(two)));
}

static inline double gbg_sum_four(__m256d a)
{
    __m128d two = _mm_add_pd(_mm256_castpd256_pd128(a), _mm256_extractf128_pd(a, 1));
    return _mm_cvtsd_f64(_mm_add_sd(two, _mm_unpackhi_pd(two, two)));
}

#ifdef __AVX512F__
typedef __m512d d8;

static inline d8 d8_set(double a)
{
    return _mm512_set1_pd(a);
}
static inline d8 d8_load(const double *p)
{
    return _mm512_loadu_pd(p);
}
static inline void d8_store(double *p, d8 a)
{
    _mm512_storeu_pd(p, a);
}
static inline d8 d8_add(d8 a, d8 b)
{
    return _mm512_add_pd(a, b);
}
static inline d8 d8_mul(d8 a, d8 b)
{
    return _mm512_mul_pd(a, b);
}
static inline d8 d8_fma(d8 a, d8 b, d8 c)
{
    return _mm512_fmadd_pd(a, b, c);
}
static inline double d8_sum(d8 a)
{
    return gbg_sum_four(_mm256_add_pd(_mm512_castpd512_pd256(a), _mm512_extractf64x4_pd(a, 1)));
}
#else
typedef struct {
    __m256d low, high;
} d8;

static inline d8 d8_set(double a)
{
    return (d8){_mm256_set1_pd(a), _mm256_set1_pd(a)};
}
static inline d8 d8_load(const double *p)
{
    return (d8){_mm256_loadu_pd(p), _mm256_loadu_pd(p + 4)};
}
static inline void d8_store(double *p, d8 a)
{
    _mm256_storeu_pd(p, a.low);
    _mm256_storeu_pd(p + 4, a.high);
}
static inline d8 d8_add(d8 a, d8 b)
{
    return (d8){_mm256_add_pd(a.low, b.low), _mm256_add_pd(a.high, b.high)};
}
static inline d8 d8_mul(d8 a, d8 b)
{
    return (d8){_mm256_mul_pd(a.low, b.low), _mm256_mul_pd(a.high, b.high)};
}
static inline d8 d8_fma(d8 a, d8 b, d8 c)
{
    return (d8){_mm256_fmadd_pd(a.low, b.low, c.low), _mm256_fmadd_pd(a.high, b.high, c.high)};
}
static inline double d8_sum(d8 a)
{
    return gbg_sum_four(_mm256_add_pd(a.low, a.high));
}
#endif

#else

#if defined(__FP_FAST_FMA) && defined(__FP_FAST_FMAF)
#define GBG_LANE_FMA(fused, a, b, c) fused(a, b, c)
#else
#define GBG_LANE_FMA(fused, a, b, c) ((a) * (b) + (c))
#endif

#define GBG_EIGHT_LANES(type, real, fused)                                                         \
    typedef struct {                                                                               \
        real lane[8];                                                                              \
    } type;                                                                                        \
    static inline type type##_set(real a)                                                          \
    {                                                                                              \
        return (type){{a, a, a, a, a, a, a, a}};                                                   \
    }                                                                                              \
    static inline type type##_load(const real *p)                                                  \
    {                                                                                              \
        type a;                                                                                    \
        memcpy(&a, p, sizeof a);                                                                   \
        return a;                                                                                  \
    }                                                                                              \
    static inline void type##_store(real *p, type a)                                               \
    {                                                                                              \
        memcpy(p, &a, sizeof a);                                                                   \
    }                                                                                              \
    static inline type type##_add(type a, type b)                                                  \
    {                                                                                              \
        for (int l = 0; l < 8; l++) {                                                              \
            a.lane[l] += b.lane[l];                                                                \
        }                                                                                          \
        return a;                                                                                  \
    }                                                                                              \
    static inline type type##_mul(type a, type b)                                                  \
    {                                                                                              \
        for (int l = 0; l < 8; l++) {                                                              \
            a.lane[l] *= b.lane[l];                                                                \
        }                                                                                          \
        return a;                                                                                  \
    }                                                                                              \
    static inline type type##_fma(type a, type b, type c)                                          \
    {                                                                                              \
        for (int l = 0; l < 8; l++) {                                                              \
            c.lane[l] = GBG_LANE_FMA(fused, a.lane[l], b.lane[l], c.lane[l]);                      \
        }                                                                                          \
        return c;                                                                                  \
    }                                                                                              \
    static inline real type##_sum(type a)                                                          \
    {                                                                                              \
        const real *l = a.lane;                                                                    \
        return ((l[0] + l[4]) + (l[2] + l[6])) + ((l[1] + l[5]) + (l[3] + l[7]));                  \
    }

GBG_EIGHT_LANES(f8, float, __builtin_fmaf)
GBG_EIGHT_LANES(d8, double, __builtin_fma)

#endif

#endif
