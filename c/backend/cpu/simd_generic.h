/* L1: vectors of 16 bytes in the compiler's own vector types, for any machine. Contract of every
 * name: simd.h. */
#ifndef GBG_BACKEND_CPU_SIMD_GENERIC_H
#define GBG_BACKEND_CPU_SIMD_GENERIC_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#define GBG_SIMD_NAME "generic"
#define VF_LANES 4
#define VD_LANES 2

typedef float vf __attribute__((vector_size(16)));
typedef int32_t vi __attribute__((vector_size(16)));
typedef uint32_t gbg_vu __attribute__((vector_size(16)));
typedef double vd __attribute__((vector_size(16)));
typedef int64_t vl __attribute__((vector_size(16)));
typedef uint64_t gbg_vul __attribute__((vector_size(16)));
typedef vi vm;
typedef vl vdm;

static inline vf vf_set(float a)
{
    return (vf){a, a, a, a};
}
static inline vf vf_load(const float *p)
{
    vf a;
    memcpy(&a, p, sizeof a);
    return a;
}
static inline void vf_store(float *p, vf a)
{
    memcpy(p, &a, sizeof a);
}
static inline vf vf_add(vf a, vf b)
{
    return a + b;
}
static inline vf vf_sub(vf a, vf b)
{
    return a - b;
}
static inline vf vf_mul(vf a, vf b)
{
    return a * b;
}
static inline vf vf_div(vf a, vf b)
{
    return a / b;
}
static inline vf vf_fma(vf a, vf b, vf c)
{
#if defined(__FP_FAST_FMAF) || defined(GBG_EXACT_FMA)
    return (vf){fmaf(a[0], b[0], c[0]), fmaf(a[1], b[1], c[1]), fmaf(a[2], b[2], c[2]),
                fmaf(a[3], b[3], c[3])};
#else
    return a * b + c;
#endif
}
static inline vf vf_fnma(vf a, vf b, vf c)
{
    return vf_fma(-a, b, c);
}
static inline vf vf_sqrt(vf a)
{
    return (vf){sqrtf(a[0]), sqrtf(a[1]), sqrtf(a[2]), sqrtf(a[3])};
}
static inline vm vf_lt(vf a, vf b)
{
    return a < b;
}
static inline vm vf_le(vf a, vf b)
{
    return a <= b;
}
static inline vf vf_select(vm m, vf a, vf b)
{
    return (vf)((m & (vi)a) | (~m & (vi)b));
}
static inline vf vf_keep(vm m, vf a)
{
    return (vf)(m & (vi)a);
}
static inline vf vf_min(vf a, vf b)
{
    return vf_select(a < b, a, b);
}
static inline vf vf_max(vf a, vf b)
{
    return vf_select(a > b, a, b);
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
    return ~a;
}
static inline uint32_t vm_bits(vm a)
{
    return (a[0] ? 1u : 0u) | (a[1] ? 2u : 0u) | (a[2] ? 4u : 0u) | (a[3] ? 8u : 0u);
}

static inline vi vi_set(int32_t a)
{
    return (vi){a, a, a, a};
}
static inline vi vi_load(const void *p)
{
    vi a;
    memcpy(&a, p, sizeof a);
    return a;
}
static inline void vi_store(void *p, vi a)
{
    memcpy(p, &a, sizeof a);
}
static inline vi vi_add(vi a, vi b)
{
    return (vi)((gbg_vu)a + (gbg_vu)b);
}
static inline vi vi_sub(vi a, vi b)
{
    return (vi)((gbg_vu)a - (gbg_vu)b);
}
static inline vi vi_and(vi a, vi b)
{
    return a & b;
}
static inline vi vi_or(vi a, vi b)
{
    return a | b;
}
static inline vi vi_xor(vi a, vi b)
{
    return a ^ b;
}
#define vi_shl(a, count) ((vi)((gbg_vu)(a) << (count)))
#define vi_shr(a, count) ((vi)((gbg_vu)(a) >> (count)))
#define vi_sar(a, count) ((vi)(a) >> (count))
/* by a count known at run time, 0 .. 32 */
static inline vi vi_shl_by(vi a, int count)
{
    return count > 31 ? a ^ a : vi_shl(a, count);
}
static inline vi vi_shr_by(vi a, int count)
{
    return count > 31 ? a ^ a : vi_shr(a, count);
}
static inline vm vi_eq(vi a, vi b)
{
    return a == b;
}
static inline vm vi_lt(vi a, vi b)
{
    return a < b;
}
static inline vi vi_select(vm m, vi a, vi b)
{
    return (m & a) | (~m & b);
}
static inline vi vi_max(vi a, vi b)
{
    return vi_select(a > b, a, b);
}
static inline vi vi_min(vi a, vi b)
{
    return vi_select(a < b, a, b);
}
static inline int vi_store_kept(void *p, vm m, vi a)
{
    int32_t *to = p;
    int count = 0;
    for (int l = 0; l < VF_LANES; l++) {
        to[count] = a[l];
        count += m[l] != 0;
    }
    return count;
}
static inline vi vi_gather(const void *base, vi index)
{
    const int32_t *p = base;
    return (vi){p[index[0]], p[index[1]], p[index[2]], p[index[3]]};
}
static inline vf vf_gather(const float *base, vi index)
{
    return (vf){base[index[0]], base[index[1]], base[index[2]], base[index[3]]};
}
static inline vf vf_from_vi(vi a)
{
    return __builtin_convertvector(a, vf);
}
static inline vi vi_from_vf(vf a)
{
    return (vi){(int32_t)lrintf(a[0]), (int32_t)lrintf(a[1]), (int32_t)lrintf(a[2]),
                (int32_t)lrintf(a[3])};
}
static inline vi vi_of_bits(vf a)
{
    return (vi)a;
}
static inline vf vf_of_bits(vi a)
{
    return (vf)a;
}
static inline vi vi_mul_even(vi a, vi b)
{
    const gbg_vul low = {UINT32_MAX, UINT32_MAX};
    return (vi)(((gbg_vul)a & low) * ((gbg_vul)b & low));
}
static inline vi vi_odd_to_even(vi a)
{
    return (vi)((gbg_vul)a >> 32);
}
static inline vi vi_weave(vi even, vi odd)
{
    const gbg_vul low = {UINT32_MAX, UINT32_MAX};
    return (vi)(((gbg_vul)even & low) | (gbg_vul)odd << 32);
}

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
static inline vd vd_sub(vd a, vd b)
{
    return a - b;
}
static inline vd vd_mul(vd a, vd b)
{
    return a * b;
}
static inline vd vd_div(vd a, vd b)
{
    return a / b;
}
static inline vd vd_fma(vd a, vd b, vd c)
{
#if defined(__FP_FAST_FMA) || defined(GBG_EXACT_FMA)
    return (vd){fma(a[0], b[0], c[0]), fma(a[1], b[1], c[1])};
#else
    return a * b + c;
#endif
}
static inline vd vd_fnma(vd a, vd b, vd c)
{
    return vd_fma(-a, b, c);
}
static inline vd vd_sqrt(vd a)
{
    return (vd){sqrt(a[0]), sqrt(a[1])};
}
static inline vdm vd_lt(vd a, vd b)
{
    return a < b;
}
static inline vd vd_select(vdm m, vd a, vd b)
{
    return (vd)((m & (vl)a) | (~m & (vl)b));
}
static inline vd vd_keep(vdm m, vd a)
{
    return (vd)(m & (vl)a);
}
static inline vd vd_min(vd a, vd b)
{
    return vd_select(a < b, a, b);
}
static inline vd vd_max(vd a, vd b)
{
    return vd_select(a > b, a, b);
}
static inline uint32_t vdm_bits(vdm a)
{
    return (a[0] ? 1u : 0u) | (a[1] ? 2u : 0u);
}
static inline vdm vdm_from_bits(uint32_t bits)
{
    return (vl){-(int64_t)(bits & 1), -(int64_t)(bits >> 1 & 1)};
}
static inline vd vd_low(vf a)
{
    return (vd){a[0], a[1]};
}
static inline vd vd_high(vf a)
{
    return (vd){a[2], a[3]};
}

static inline vl vl_set(int64_t a)
{
    return (vl){a, a};
}
static inline vl vl_load(const void *p)
{
    vl a;
    memcpy(&a, p, sizeof a);
    return a;
}
static inline vl vl_sub(vl a, vl b)
{
    return (vl)((gbg_vul)a - (gbg_vul)b);
}
static inline vl vl_and(vl a, vl b)
{
    return a & b;
}
#define vl_shr(a, count) ((vl)((gbg_vul)(a) >> (count)))
static inline vl vl_of_bits(vd a)
{
    return (vl)a;
}
static inline vd vd_of_bits(vl a)
{
    return (vd)a;
}
static inline vd vd_from_vl(vl a)
{
    return __builtin_convertvector(a, vd);
}

#endif
