/* L1: vectors of one AVX-512 register. Contract of every name: simd.h. */
#ifndef GBG_BACKEND_CPU_SIMD_AVX512_H
#define GBG_BACKEND_CPU_SIMD_AVX512_H

#include <immintrin.h>
#include <stdint.h>

#define GBG_SIMD_NAME "avx512"
#define VF_LANES 16
#define VD_LANES 8

typedef __m512 vf;
typedef __m512i vi;
typedef __m512d vd;
typedef __m512i vl;
typedef __mmask16 vm;
typedef __mmask8 vdm;

static inline vf vf_set(float a)
{
    return _mm512_set1_ps(a);
}
static inline vf vf_load(const float *p)
{
    return _mm512_loadu_ps(p);
}
static inline void vf_store(float *p, vf a)
{
    _mm512_storeu_ps(p, a);
}
static inline vf vf_add(vf a, vf b)
{
    return _mm512_add_ps(a, b);
}
static inline vf vf_sub(vf a, vf b)
{
    return _mm512_sub_ps(a, b);
}
static inline vf vf_mul(vf a, vf b)
{
    return _mm512_mul_ps(a, b);
}
static inline vf vf_div(vf a, vf b)
{
    return _mm512_div_ps(a, b);
}
static inline vf vf_fma(vf a, vf b, vf c)
{
    return _mm512_fmadd_ps(a, b, c);
}
static inline vf vf_fnma(vf a, vf b, vf c)
{
    return _mm512_fnmadd_ps(a, b, c);
}
static inline vf vf_sqrt(vf a)
{
    return _mm512_sqrt_ps(a);
}
static inline vf vf_min(vf a, vf b)
{
    return _mm512_min_ps(a, b);
}
static inline vf vf_max(vf a, vf b)
{
    return _mm512_max_ps(a, b);
}
static inline vm vf_lt(vf a, vf b)
{
    return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ);
}
static inline vm vf_le(vf a, vf b)
{
    return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ);
}
static inline vf vf_select(vm m, vf a, vf b)
{
    return _mm512_mask_blend_ps(m, b, a);
}
static inline vf vf_keep(vm m, vf a)
{
    return _mm512_maskz_mov_ps(m, a);
}
static inline vm vm_and(vm a, vm b)
{
    return a & b;
}
static inline vm vm_or(vm a, vm b)
{
    return a | b;
}
static inline vm vm_not(vm a)
{
    return (vm)~a;
}
static inline uint32_t vm_bits(vm a)
{
    return a;
}

static inline vi vi_set(int32_t a)
{
    return _mm512_set1_epi32(a);
}
static inline vi vi_load(const void *p)
{
    return _mm512_loadu_si512(p);
}
static inline void vi_store(void *p, vi a)
{
    _mm512_storeu_si512(p, a);
}
static inline vi vi_add(vi a, vi b)
{
    return _mm512_add_epi32(a, b);
}
static inline vi vi_sub(vi a, vi b)
{
    return _mm512_sub_epi32(a, b);
}
static inline vi vi_max(vi a, vi b)
{
    return _mm512_max_epi32(a, b);
}
static inline vi vi_min(vi a, vi b)
{
    return _mm512_min_epi32(a, b);
}
static inline vi vi_and(vi a, vi b)
{
    return _mm512_and_si512(a, b);
}
static inline vi vi_or(vi a, vi b)
{
    return _mm512_or_si512(a, b);
}
static inline vi vi_xor(vi a, vi b)
{
    return _mm512_xor_si512(a, b);
}
#define vi_shl(a, count) _mm512_slli_epi32(a, count)
#define vi_shr(a, count) _mm512_srli_epi32(a, count)
#define vi_sar(a, count) _mm512_srai_epi32(a, count)
/* by a count known at run time, 0 .. 32 */
static inline vi vi_shl_by(vi a, int count)
{
    return _mm512_sll_epi32(a, _mm_cvtsi32_si128(count));
}
static inline vi vi_shr_by(vi a, int count)
{
    return _mm512_srl_epi32(a, _mm_cvtsi32_si128(count));
}
static inline vm vi_eq(vi a, vi b)
{
    return _mm512_cmpeq_epi32_mask(a, b);
}
static inline vm vi_lt(vi a, vi b)
{
    return _mm512_cmplt_epi32_mask(a, b);
}
static inline vi vi_select(vm m, vi a, vi b)
{
    return _mm512_mask_blend_epi32(m, b, a);
}
static inline int vi_store_kept(void *p, vm m, vi a)
{
    /* the form that writes to memory is slow on some processors */
    _mm512_storeu_si512(p, _mm512_maskz_compress_epi32(m, a));
    return __builtin_popcount(m);
}
static inline vi vi_gather(const void *base, vi index)
{
    return _mm512_i32gather_epi32(index, base, 4);
}
static inline vf vf_gather(const float *base, vi index)
{
    return _mm512_i32gather_ps(index, base, 4);
}
static inline vf vf_from_vi(vi a)
{
    return _mm512_cvtepi32_ps(a);
}
static inline vi vi_from_vf(vf a)
{
    return _mm512_cvtps_epi32(a);
}
static inline vi vi_of_bits(vf a)
{
    return _mm512_castps_si512(a);
}
static inline vf vf_of_bits(vi a)
{
    return _mm512_castsi512_ps(a);
}
static inline vi vi_mul_even(vi a, vi b)
{
    return _mm512_mul_epu32(a, b);
}
static inline vi vi_odd_to_even(vi a)
{
    return _mm512_srli_epi64(a, 32);
}
static inline vi vi_weave(vi even, vi odd)
{
    odd = _mm512_slli_epi64(odd, 32);
    return _mm512_mask_blend_epi32(0xAAAA, even, odd);
}

static inline vd vd_set(double a)
{
    return _mm512_set1_pd(a);
}
static inline vd vd_load(const double *p)
{
    return _mm512_loadu_pd(p);
}
static inline void vd_store(double *p, vd a)
{
    _mm512_storeu_pd(p, a);
}
static inline vd vd_add(vd a, vd b)
{
    return _mm512_add_pd(a, b);
}
static inline vd vd_sub(vd a, vd b)
{
    return _mm512_sub_pd(a, b);
}
static inline vd vd_mul(vd a, vd b)
{
    return _mm512_mul_pd(a, b);
}
static inline vd vd_div(vd a, vd b)
{
    return _mm512_div_pd(a, b);
}
static inline vd vd_fma(vd a, vd b, vd c)
{
    return _mm512_fmadd_pd(a, b, c);
}
static inline vd vd_fnma(vd a, vd b, vd c)
{
    return _mm512_fnmadd_pd(a, b, c);
}
static inline vd vd_sqrt(vd a)
{
    return _mm512_sqrt_pd(a);
}
static inline vd vd_min(vd a, vd b)
{
    return _mm512_min_pd(a, b);
}
static inline vd vd_max(vd a, vd b)
{
    return _mm512_max_pd(a, b);
}
static inline vdm vd_lt(vd a, vd b)
{
    return _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ);
}
static inline vd vd_select(vdm m, vd a, vd b)
{
    return _mm512_mask_blend_pd(m, b, a);
}
static inline vd vd_keep(vdm m, vd a)
{
    return _mm512_maskz_mov_pd(m, a);
}
static inline uint32_t vdm_bits(vdm a)
{
    return a;
}
static inline vdm vdm_from_bits(uint32_t bits)
{
    return (vdm)bits;
}
static inline vd vd_low(vf a)
{
    return _mm512_cvtps_pd(_mm512_castps512_ps256(a));
}
static inline vd vd_high(vf a)
{
    return _mm512_cvtps_pd(_mm512_extractf32x8_ps(a, 1));
}

static inline vl vl_set(int64_t a)
{
    return _mm512_set1_epi64(a);
}
static inline vl vl_load(const void *p)
{
    return _mm512_loadu_si512(p);
}
static inline vl vl_sub(vl a, vl b)
{
    return _mm512_sub_epi64(a, b);
}
static inline vl vl_and(vl a, vl b)
{
    return _mm512_and_si512(a, b);
}
#define vl_shr(a, count) _mm512_srli_epi64(a, count)
static inline vl vl_of_bits(vd a)
{
    return _mm512_castpd_si512(a);
}
static inline vd vd_of_bits(vl a)
{
    return _mm512_castsi512_pd(a);
}
static inline vd vd_from_vl(vl a)
{
    return _mm512_cvtepi64_pd(a);
}

#endif
