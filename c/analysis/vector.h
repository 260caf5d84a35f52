/* Analysis room: vectors of doubles, as long as the instruction set has them. */
#ifndef GBG_ANALYSIS_VECTOR_H
#define GBG_ANALYSIS_VECTOR_H

/* vd_fma(a, b, c) = a b + c, in one rounding where the instruction set can. Loads and stores need
 * no alignment. */
#if defined(__AVX512F__)
#include <immintrin.h>
enum { VD_LANES = 8 };
typedef __m512d vd;
#define vd_set _mm512_set1_pd
#define vd_load _mm512_loadu_pd
#define vd_store _mm512_storeu_pd
#define vd_add _mm512_add_pd
#define vd_mul _mm512_mul_pd
#define vd_fma _mm512_fmadd_pd
#define vd_fnma _mm512_fnmadd_pd
#define vd_reverse(a) _mm512_permutexvar_pd(_mm512_set_epi64(0, 1, 2, 3, 4, 5, 6, 7), a)
#elif defined(__AVX2__) && defined(__FMA__)
#include <immintrin.h>
enum { VD_LANES = 4 };
typedef __m256d vd;
#define vd_set _mm256_set1_pd
#define vd_load _mm256_loadu_pd
#define vd_store _mm256_storeu_pd
#define vd_add _mm256_add_pd
#define vd_mul _mm256_mul_pd
#define vd_fma _mm256_fmadd_pd
#define vd_fnma _mm256_fnmadd_pd
#define vd_reverse(a) _mm256_permute4x64_pd(a, 0x1B)
#else
#include <string.h>
enum { VD_LANES = 2 };
typedef double vd __attribute__((vector_size(16)));
static inline vd vd_set(double a)
{
    return (vd){a, a};
}
static inline vd vd_load(const double *p)
{
    vd a;
    memcpy(&a, p, sizeof a);
    return a;
}
static inline void vd_store(double *p, vd a)
{
    memcpy(p, &a, sizeof a);
}
static inline vd vd_add(vd a, vd b)
{
    return a + b;
}
static inline vd vd_mul(vd a, vd b)
{
    return a * b;
}
static inline vd vd_fma(vd a, vd b, vd c)
{
#ifdef __FP_FAST_FMA
    return (vd){__builtin_fma(a[0], b[0], c[0]), __builtin_fma(a[1], b[1], c[1])};
#else
    return a * b + c;
#endif
}
static inline vd vd_fnma(vd a, vd b, vd c)
{
    return vd_fma(-a, b, c);
}
static inline vd vd_reverse(vd a)
{
    return (vd){a[1], a[0]};
}
#endif

#endif
