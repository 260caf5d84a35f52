/* L0: functions of headers that run on the host and, where CUDA compiles them, on the device. */
#ifndef GBG_CORE_INLINE_H
#define GBG_CORE_INLINE_H

#ifdef __CUDACC__
#define GBG_INLINE static __host__ __device__ __forceinline__
#else
#define GBG_INLINE static inline
#endif

#endif
