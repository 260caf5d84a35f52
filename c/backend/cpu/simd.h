/* L1: a thin layer over vector instructions, the same names for every instruction set.
 *
 * Types: vf floats and vi 32-bit integers (VF_LANES lanes), vd doubles and vl 64-bit integers
 * (VD_LANES lanes, half as many), vm and vdm masks of comparisons. Loads and stores need no
 * alignment.
 *   *_set (all lanes) *_load *_store *_add *_sub *_mul *_div *_sqrt *_min *_max
 *   *_fma(a,b,c) = a b + c and *_fnma(a,b,c) = c - a b in one rounding
 *   *_lt *_le *_eq -> mask; *_select(m,a,b) = m ? a : b; *_keep(m,a) = m ? a : 0;
 *   vi_store_kept(p,m,a): lanes of m one after the other at p, their number; may write a whole vector
 *   vm_bits, vdm_bits: bit k is lane k; vdm_from_bits: the other way, from the lowest bits
 *   vi_shl vi_shr (zeros) vi_sar (sign) vl_shr, vi_shl_by vi_shr_by (counts known at run time);
 *   vi_gather vf_gather (base, element index)
 *   vi_mul_even: 64-bit products of the unsigned even lanes; vi_odd_to_even: odd lanes moved down,
 *   zeros left behind; vi_weave: the even lanes of both, those of the second moved up
 *   vf_from_vi, vi_from_vf (nearest even), vd_from_vl; *_of_bits keep the bits
 *   vd_low, vd_high: the first and second half of the lanes of a vf
 *
 * The avx2 and avx512 forms of every operation give the same bits, lane by lane, and so do kernels
 * that keep one particle in a lane and sum in the order of a loop. The generic form has no fused
 * multiply-add unless the compiler's target has one (then its bits agree too): without, fma rounds
 * twice and results differ from the others in the last places; a file that defines GBG_EXACT_FMA first
 * has it from the C library, slowly where the processor has none.
 *
 * CUDA has one lane a thread (cuda/simd_cuda.h), with the bits of avx2 and avx512: formulas that are
 * written in these names, marked GBG_VECTOR, serve it too.
 *
 * A kernel file is compiled once for each instruction set, GBG_ISA being its name; GBG_ISA_NAME(f)
 * is f_avx512, f_avx2 or f_generic. */
#ifndef GBG_BACKEND_CPU_SIMD_H
#define GBG_BACKEND_CPU_SIMD_H

#if defined(__CUDACC__)
#include "cuda/simd_cuda.h"
#elif defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__) && defined(__AVX512BW__)
#include "backend/cpu/simd_avx512.h"
#elif defined(__AVX2__) && defined(__FMA__)
#include "backend/cpu/simd_avx2.h"
#else
#include "backend/cpu/simd_generic.h"
#endif

#ifndef GBG_VECTOR
#define GBG_VECTOR static inline
#endif

#define GBG_JOIN_EXPANDED(a, b) a##_##b
#define GBG_JOIN(a, b) GBG_JOIN_EXPANDED(a, b)
#define GBG_ISA_NAME(name) GBG_JOIN(name, GBG_ISA)

GBG_VECTOR int vm_any(vm a)
{
    return vm_bits(a) != 0;
}

/* 1/sqrt(a) for normal a > 0 with a relative error below 1.2e-7. Zero gives a large finite number.
 * The seed halves the exponent by an integer shift (error 3.5 %), two steps of orders 4 and 2
 * follow. */
GBG_VECTOR vf vf_rsqrt(vf a)
{
    vf y = vf_of_bits(vi_sub(vi_set(0x5f375a86), vi_shr(vi_of_bits(a), 1)));
    vf e = vf_fnma(vf_mul(y, y), a, vf_set(1.0f));
    vf p = vf_fma(e, vf_set(0.3125f), vf_set(0.375f));
    p = vf_fma(e, p, vf_set(0.5f));
    y = vf_fma(vf_mul(y, e), p, y);
    e = vf_fnma(vf_mul(y, y), a, vf_set(1.0f));
    return vf_fma(vf_mul(y, e), vf_set(0.5f), y);
}

/* 1/sqrt(a) for normal a > 0 with a relative error below 4e-16; orders 4 and 3 after the seed. */
GBG_VECTOR vd vd_rsqrt(vd a)
{
    vd y = vd_of_bits(vl_sub(vl_set(0x5fe6eb50c7b537a9), vl_shr(vl_of_bits(a), 1)));
    vd e = vd_fnma(vd_mul(y, y), a, vd_set(1.0));
    vd p = vd_fma(e, vd_set(0.3125), vd_set(0.375));
    p = vd_fma(e, p, vd_set(0.5));
    y = vd_fma(vd_mul(y, e), p, y);
    e = vd_fnma(vd_mul(y, y), a, vd_set(1.0));
    p = vd_fma(e, vd_set(0.375), vd_set(0.5));
    return vd_fma(vd_mul(y, e), p, y);
}

#endif
