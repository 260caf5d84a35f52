/* L1, CUDA: the names of backend/cpu/simd.h for a thread that has one lane: the same bits as avx2
 * and avx512, because every operation is rounded once and only fma is fused (-fmad=false). */
#ifndef GBG_CUDA_SIMD_CUDA_H
#define GBG_CUDA_SIMD_CUDA_H

#include <curand_philox4x32_x.h>
#include <stdint.h>

#define GBG_SIMD_NAME "cuda"
#define GBG_VECTOR static __device__ __forceinline__
#define VF_LANES 1
#define VD_LANES 1

typedef float vf;
typedef int32_t vi;
typedef double vd;
typedef int64_t vl;
typedef bool vm;
typedef bool vdm;

GBG_VECTOR vf vf_set(float a)
{
    return a;
}
GBG_VECTOR vf vf_load(const float *p)
{
    return *p;
}
GBG_VECTOR void vf_store(float *p, vf a)
{
    *p = a;
}
GBG_VECTOR vf vf_add(vf a, vf b)
{
    return __fadd_rn(a, b);
}
GBG_VECTOR vf vf_sub(vf a, vf b)
{
    return __fsub_rn(a, b);
}
GBG_VECTOR vf vf_mul(vf a, vf b)
{
    return __fmul_rn(a, b);
}
GBG_VECTOR vf vf_div(vf a, vf b)
{
    return __fdiv_rn(a, b);
}
GBG_VECTOR vf vf_fma(vf a, vf b, vf c)
{
    return __fmaf_rn(a, b, c);
}
GBG_VECTOR vf vf_fnma(vf a, vf b, vf c)
{
    return __fmaf_rn(-a, b, c);
}
GBG_VECTOR vf vf_sqrt(vf a)
{
    return __fsqrt_rn(a);
}
GBG_VECTOR vm vf_lt(vf a, vf b)
{
    return a < b;
}
GBG_VECTOR vm vf_le(vf a, vf b)
{
    return a <= b;
}
GBG_VECTOR vf vf_select(vm m, vf a, vf b)
{
    return m ? a : b;
}
GBG_VECTOR vf vf_keep(vm m, vf a)
{
    return m ? a : 0.0f;
}
GBG_VECTOR vf vf_min(vf a, vf b)
{
    return a < b ? a : b;
}
GBG_VECTOR vf vf_max(vf a, vf b)
{
    return a > b ? a : b;
}
GBG_VECTOR vm vm_and(vm a, vm b)
{
    return a && b;
}
GBG_VECTOR vm vm_or(vm a, vm b)
{
    return a || b;
}
GBG_VECTOR vm vm_not(vm a)
{
    return !a;
}
GBG_VECTOR uint32_t vm_bits(vm a)
{
    return a ? 1u : 0u;
}

GBG_VECTOR vi vi_set(int32_t a)
{
    return a;
}
GBG_VECTOR vi vi_load(const void *p)
{
    return *(const int32_t *)p;
}
GBG_VECTOR void vi_store(void *p, vi a)
{
    *(int32_t *)p = a;
}
GBG_VECTOR vi vi_add(vi a, vi b)
{
    return (vi)((uint32_t)a + (uint32_t)b);
}
GBG_VECTOR vi vi_sub(vi a, vi b)
{
    return (vi)((uint32_t)a - (uint32_t)b);
}
GBG_VECTOR vi vi_and(vi a, vi b)
{
    return a & b;
}
GBG_VECTOR vi vi_or(vi a, vi b)
{
    return a | b;
}
GBG_VECTOR vi vi_xor(vi a, vi b)
{
    return a ^ b;
}
GBG_VECTOR vi vi_shl(vi a, int count)
{
    return (vi)((uint32_t)a << count);
}
GBG_VECTOR vi vi_shr(vi a, int count)
{
    return (vi)((uint32_t)a >> count);
}
GBG_VECTOR vi vi_sar(vi a, int count)
{
    return a >> count;
}
GBG_VECTOR vm vi_eq(vi a, vi b)
{
    return a == b;
}
GBG_VECTOR vm vi_lt(vi a, vi b)
{
    return a < b;
}
GBG_VECTOR vi vi_select(vm m, vi a, vi b)
{
    return m ? a : b;
}
GBG_VECTOR vi vi_gather(const void *base, vi index)
{
    return __ldg((const int32_t *)base + index);
}
GBG_VECTOR vf vf_gather(const float *base, vi index)
{
    return __ldg(base + index);
}
GBG_VECTOR vf vf_from_vi(vi a)
{
    return __int2float_rn(a);
}
GBG_VECTOR vi vi_from_vf(vf a)
{
    return __float2int_rn(a);
}
GBG_VECTOR vi vi_of_bits(vf a)
{
    return __float_as_int(a);
}
GBG_VECTOR vf vf_of_bits(vi a)
{
    return __int_as_float(a);
}

GBG_VECTOR vd vd_set(double a)
{
    return a;
}
GBG_VECTOR vd vd_load(const double *p)
{
    return *p;
}
GBG_VECTOR void vd_store(double *p, vd a)
{
    *p = a;
}
GBG_VECTOR vd vd_add(vd a, vd b)
{
    return __dadd_rn(a, b);
}
GBG_VECTOR vd vd_sub(vd a, vd b)
{
    return __dsub_rn(a, b);
}
GBG_VECTOR vd vd_mul(vd a, vd b)
{
    return __dmul_rn(a, b);
}
GBG_VECTOR vd vd_fma(vd a, vd b, vd c)
{
    return __fma_rn(a, b, c);
}
GBG_VECTOR vd vd_fnma(vd a, vd b, vd c)
{
    return __fma_rn(-a, b, c);
}
GBG_VECTOR vd vd_sqrt(vd a)
{
    return __dsqrt_rn(a);
}
GBG_VECTOR vdm vd_lt(vd a, vd b)
{
    return a < b;
}
GBG_VECTOR vd vd_select(vdm m, vd a, vd b)
{
    return m ? a : b;
}
GBG_VECTOR vd vd_keep(vdm m, vd a)
{
    return m ? a : 0.0;
}

GBG_VECTOR vl vl_set(int64_t a)
{
    return a;
}
GBG_VECTOR vl vl_sub(vl a, vl b)
{
    return (vl)((uint64_t)a - (uint64_t)b);
}
GBG_VECTOR vl vl_and(vl a, vl b)
{
    return a & b;
}
GBG_VECTOR vl vl_shr(vl a, int count)
{
    return (vl)((uint64_t)a >> count);
}
GBG_VECTOR vl vl_of_bits(vd a)
{
    return __double_as_longlong(a);
}
GBG_VECTOR vd vd_of_bits(vl a)
{
    return __longlong_as_double(a);
}
GBG_VECTOR vd vd_from_vl(vl a)
{
    return __ll2double_rn(a);
}

/* Counter words in, random words out: cuRAND's round function is the same bijection. */
#define GBG_PHILOX_LANES
GBG_VECTOR void gbg_philox_lanes(vi c[4], uint32_t key0, uint32_t key1)
{
    uint4 counter = make_uint4((uint32_t)c[0], (uint32_t)c[1], (uint32_t)c[2], (uint32_t)c[3]);
    uint4 word = curand_Philox4x32_10(counter, make_uint2(key0, key1));
    c[0] = (vi)word.x;
    c[1] = (vi)word.y;
    c[2] = (vi)word.z;
    c[3] = (vi)word.w;
}

#endif
