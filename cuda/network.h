/* L1, CUDA: sorting in the registers of a thread. */
#ifndef GBG_CUDA_NETWORK_H
#define GBG_CUDA_NETWORK_H

#include <stdint.h>

/* A network of comparisons that sorts, all of its places known to the compiler (Batcher's merges of
 * odd and even places). To be started with P = K = 1. */
template <int N, int P, int K>
static __device__ __forceinline__ void gbg_cuda_sort_step(int32_t (&key)[N])
{
#pragma unroll
    for (int j = K % P; j <= N - 1 - K; j += 2 * K) {
#pragma unroll
        for (int i = 0; i < K; i++) {
            if (i + j + K < N && (i + j) / (2 * P) == (i + j + K) / (2 * P)) {
                int32_t low = min(key[i + j], key[i + j + K]);
                key[i + j + K] = max(key[i + j], key[i + j + K]);
                key[i + j] = low;
            }
        }
    }
    if constexpr (K > 1) {
        gbg_cuda_sort_step<N, P, K / 2>(key);
    } else if constexpr (2 * P < N) {
        gbg_cuda_sort_step<N, 2 * P, 2 * P>(key);
    }
}

#endif
