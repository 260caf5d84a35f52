/* L1: vectors of one AVX2 register. Contract of every name: simd.h. */
#ifndef GBG_BACKEND_CPU_SIMD_AVX2_H
#define GBG_BACKEND_CPU_SIMD_AVX2_H

#include <immintrin.h>
#include <stdint.h>

#define GBG_SIMD_NAME "avx2"
#define VF_LANES 8
#define VD_LANES 4

typedef __m256 vf;
typedef __m256i vi;
typedef __m256d vd;
typedef __m256i vl;
typedef __m256 vm;
typedef __m256d vdm;

static inline vf vf_set(float a)
{
    return _mm256_set1_ps(a);
}
static inline vf vf_load(const float *p)
{
    return _mm256_loadu_ps(p);
}
static inline void vf_store(float *p, vf a)
{
    _mm256_storeu_ps(p, a);
}
static inline vf vf_add(vf a, vf b)
{
    return _mm256_add_ps(a, b);
}
static inline vf vf_sub(vf a, vf b)
{
    return _mm256_sub_ps(a, b);
}
static inline vf vf_mul(vf a, vf b)
{
    return _mm256_mul_ps(a, b);
}
static inline vf vf_div(vf a, vf b)
{
    return _mm256_div_ps(a, b);
}
static inline vf vf_fma(vf a, vf b, vf c)
{
    return _mm256_fmadd_ps(a, b, c);
}
static inline vf vf_fnma(vf a, vf b, vf c)
{
    return _mm256_fnmadd_ps(a, b, c);
}
static inline vf vf_sqrt(vf a)
{
    return _mm256_sqrt_ps(a);
}
static inline vf vf_min(vf a, vf b)
{
    return _mm256_min_ps(a, b);
}
static inline vf vf_max(vf a, vf b)
{
    return _mm256_max_ps(a, b);
}
static inline vm vf_lt(vf a, vf b)
{
    return _mm256_cmp_ps(a, b, _CMP_LT_OQ);
}
static inline vm vf_le(vf a, vf b)
{
    return _mm256_cmp_ps(a, b, _CMP_LE_OQ);
}
static inline vf vf_select(vm m, vf a, vf b)
{
    return _mm256_blendv_ps(b, a, m);
}
static inline vf vf_keep(vm m, vf a)
{
    return _mm256_and_ps(m, a);
}
static inline vm vm_and(vm a, vm b)
{
    return _mm256_and_ps(a, b);
}
static inline vm vm_or(vm a, vm b)
{
    return _mm256_or_ps(a, b);
}
static inline vm vm_not(vm a)
{
    return _mm256_xor_ps(a, _mm256_castsi256_ps(_mm256_set1_epi32(-1)));
}
static inline uint32_t vm_bits(vm a)
{
    return (uint32_t)_mm256_movemask_ps(a);
}

static inline vi vi_set(int32_t a)
{
    return _mm256_set1_epi32(a);
}
static inline vi vi_load(const void *p)
{
    return _mm256_loadu_si256(p);
}
static inline void vi_store(void *p, vi a)
{
    _mm256_storeu_si256(p, a);
}
static inline vi vi_add(vi a, vi b)
{
    return _mm256_add_epi32(a, b);
}
static inline vi vi_sub(vi a, vi b)
{
    return _mm256_sub_epi32(a, b);
}
static inline vi vi_max(vi a, vi b)
{
    return _mm256_max_epi32(a, b);
}
static inline vi vi_min(vi a, vi b)
{
    return _mm256_min_epi32(a, b);
}
static inline vi vi_and(vi a, vi b)
{
    return _mm256_and_si256(a, b);
}
static inline vi vi_or(vi a, vi b)
{
    return _mm256_or_si256(a, b);
}
static inline vi vi_xor(vi a, vi b)
{
    return _mm256_xor_si256(a, b);
}
#define vi_shl(a, count) _mm256_slli_epi32(a, count)
#define vi_shr(a, count) _mm256_srli_epi32(a, count)
#define vi_sar(a, count) _mm256_srai_epi32(a, count)
/* by a count known at run time, 0 .. 32 */
static inline vi vi_shl_by(vi a, int count)
{
    return _mm256_sll_epi32(a, _mm_cvtsi32_si128(count));
}
static inline vi vi_shr_by(vi a, int count)
{
    return _mm256_srl_epi32(a, _mm_cvtsi32_si128(count));
}
static inline vm vi_eq(vi a, vi b)
{
    return _mm256_castsi256_ps(_mm256_cmpeq_epi32(a, b));
}
static inline vm vi_lt(vi a, vi b)
{
    return _mm256_castsi256_ps(_mm256_cmpgt_epi32(b, a));
}
static inline vi vi_select(vm m, vi a, vi b)
{
    return _mm256_blendv_epi8(b, a, _mm256_castps_si256(m));
}
static inline int vi_store_kept(void *p, vm m, vi a)
{
    int32_t lane[VF_LANES], *to = p;
    int count = 0;
    _mm256_storeu_si256((__m256i *)lane, a);
    for (uint32_t bits = vm_bits(m); bits; bits &= bits - 1) {
        to[count++] = lane[__builtin_ctz(bits)];
    }
    return count;
}
static inline vi vi_gather(const void *base, vi index)
{
    return _mm256_i32gather_epi32(base, index, 4);
}
static inline vf vf_gather(const float *base, vi index)
{
    return _mm256_i32gather_ps(base, index, 4);
}
static inline vf vf_from_vi(vi a)
{
    return _mm256_cvtepi32_ps(a);
}
static inline vi vi_from_vf(vf a)
{
    return _mm256_cvtps_epi32(a);
}
static inline vi vi_of_bits(vf a)
{
    return _mm256_castps_si256(a);
}
static inline vf vf_of_bits(vi a)
{
    return _mm256_castsi256_ps(a);
}
static inline vi vi_mul_even(vi a, vi b)
{
    return _mm256_mul_epu32(a, b);
}
static inline vi vi_odd_to_even(vi a)
{
    return _mm256_srli_epi64(a, 32);
}
static inline vi vi_weave(vi even, vi odd)
{
    odd = _mm256_slli_epi64(odd, 32);
    return _mm256_blend_epi32(even, odd, 0xAA);
}

static inline vd vd_set(double a)
{
    return _mm256_set1_pd(a);
}
static inline vd vd_load(const double *p)
{
    return _mm256_loadu_pd(p);
}
static inline void vd_store(double *p, vd a)
{
    _mm256_storeu_pd(p, a);
}
static inline vd vd_add(vd a, vd b)
{
    return _mm256_add_pd(a, b);
}
static inline vd vd_sub(vd a, vd b)
{
    return _mm256_sub_pd(a, b);
}
static inline vd vd_mul(vd a, vd b)
{
    return _mm256_mul_pd(a, b);
}
static inline vd vd_div(vd a, vd b)
{
    return _mm256_div_pd(a, b);
}
static inline vd vd_fma(vd a, vd b, vd c)
{
    return _mm256_fmadd_pd(a, b, c);
}
static inline vd vd_fnma(vd a, vd b, vd c)
{
    return _mm256_fnmadd_pd(a, b, c);
}
static inline vd vd_sqrt(vd a)
{
    return _mm256_sqrt_pd(a);
}
static inline vd vd_min(vd a, vd b)
{
    return _mm256_min_pd(a, b);
}
static inline vd vd_max(vd a, vd b)
{
    return _mm256_max_pd(a, b);
}
static inline vdm vd_lt(vd a, vd b)
{
    return _mm256_cmp_pd(a, b, _CMP_LT_OQ);
}
static inline vd vd_select(vdm m, vd a, vd b)
{
    return _mm256_blendv_pd(b, a, m);
}
static inline vd vd_keep(vdm m, vd a)
{
    return _mm256_and_pd(m, a);
}
static inline uint32_t vdm_bits(vdm a)
{
    return (uint32_t)_mm256_movemask_pd(a);
}
static inline vdm vdm_from_bits(uint32_t bits)
{
    const __m256i lane = _mm256_setr_epi64x(1, 2, 4, 8);
    __m256i set = _mm256_and_si256(_mm256_set1_epi64x(bits), lane);
    return _mm256_castsi256_pd(_mm256_cmpeq_epi64(set, lane));
}
static inline vd vd_low(vf a)
{
    return _mm256_cvtps_pd(_mm256_castps256_ps128(a));
}
static inline vd vd_high(vf a)
{
    return _mm256_cvtps_pd(_mm256_extractf128_ps(a, 1));
}

static inline vl vl_set(int64_t a)
{
    return _mm256_set1_epi64x(a);
}
static inline vl vl_load(const void *p)
{
    return _mm256_loadu_si256(p);
}
static inline vl vl_sub(vl a, vl b)
{
    return _mm256_sub_epi64(a, b);
}
static inline vl vl_and(vl a, vl b)
{
    return _mm256_and_si256(a, b);
}
#define vl_shr(a, count) _mm256_srli_epi64(a, count)
static inline vl vl_of_bits(vd a)
{
    return _mm256_castpd_si256(a);
}
static inline vd vd_of_bits(vl a)
{
    return _mm256_castsi256_pd(a);
}
/* The high word sits in the mantissa of 3 2^67, the low one in that of 2^52: both parts are exact
 * and the last addition is the only rounding, as in AVX-512's own instruction. */
static inline vd vd_from_vl(vl a)
{
    const __m256d high_base = _mm256_set1_pd(442721857769029238784.0); /* 3 2^67 */
    const __m256d both = _mm256_set1_pd(442726361368656609280.0);      /* 3 2^67 + 2^52 */
    __m256i high = _mm256_srai_epi32(a, 16);
    high = _mm256_blend_epi16(high, _mm256_setzero_si256(), 0x33);
    high = _mm256_add_epi64(high, _mm256_castpd_si256(high_base));
    __m256i low = _mm256_castpd_si256(_mm256_set1_pd(0x1p52));
    low = _mm256_blend_epi16(a, low, 0x88);
    return _mm256_add_pd(_mm256_sub_pd(_mm256_castsi256_pd(high), both), _mm256_castsi256_pd(low));
}

#endif
