/* L1, CUDA: the exact tests of pairs of hard cores, for the certificate and the roll-back. The
 * table is made on the host and passed to kernels by value; its pointer to the state means nothing
 * there.
 */
#ifndef GBG_CUDA_EXACT_H
#define GBG_CUDA_EXACT_H

#include "cuda/cuda.h"

#include "backend/cpu/exact_pair.h"

/* What a search for violated pairs found. */
struct gbg_cuda_finding {
    unsigned long long count;
    unsigned long long lowest; /* lower index << 32 | higher index; GBG_CUDA_NO_PAIR: none */
};
static const unsigned long long GBG_CUDA_NO_PAIR = ~0ull;

static __device__ __forceinline__ void gbg_cuda_note(struct gbg_cuda_finding *finding, int64_t i,
                                                     int64_t j)
{
    unsigned long long low = (unsigned long long)(i < j ? i : j);
    unsigned long long high = (unsigned long long)(i < j ? j : i);
    atomicAdd(&finding->count, 1ull);
    atomicMin(&finding->lowest, low << 32 | high);
}

/* Length of the longest move since the step began, by the exact coordinates; uses the workspace. */
int gbg_cuda_widest_move(struct gbg_device *device, const struct gbg_state *state, double *widest);

#endif
