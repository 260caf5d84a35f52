/* L1, CUDA: the backend's body, errors as sentences, memory, and how kernels are started. */
#ifndef GBG_CUDA_CUDA_H
#define GBG_CUDA_CUDA_H

#include <cuda_runtime.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

extern "C" {
#include "backend/backend.h"
#include "core/context.h"
#include "core/memory.h"
}

struct gbg_device {
    struct gbg_context *context;
    int number;
    int multiprocessors, clusters; /* 1: blocks can be started as a cluster */
    cudaStream_t stream; /* all kernels; copies of frames have one of their own */
    struct gbg_kernels kernels;
    struct gbg_cuda_steps *steps; /* batches of steps (steps.cu); NULL: none yet */
    const int *halt;  /* while a batch is started: what its kernels look at first; else NULL */
    uint64_t moments; /* numbers of list builds given so far */
    void *workspace;  /* on the device, for one kernel call at a time */
    size_t workspace_bytes;
    void *staging; /* on the host, pinned, for small results */
    size_t staging_bytes;
    char failure[512]; /* first failure other than of memory: it is final. "": none */
};

/* Turns a CUDA error into a status and the context's sentence; `what` says what was tried. After a
 * failure other than of memory nothing on the device can be relied on: this and every later call
 * answers GBG_E_DEVICE with the sentence of the first. */
int gbg_cuda_status(struct gbg_device *device, cudaError_t error, const char *what);
/* The same for the kernel that was just started. */
int gbg_cuda_started(struct gbg_device *device, const char *kernel);

/* Makes the engine's GPU that of the thread, which may have used another since the last call. */
int gbg_cuda_use(struct gbg_device *device);

/* Device memory, undefined contents; NULL and GBG_E_MEMORY with a sentence if it cannot be had. A
 * release waits for what is on the stream; NULL is allowed. */
int gbg_cuda_allocate(struct gbg_device *device, void **pointer, int64_t count, size_t size,
                      const char *what);
void gbg_cuda_release(struct gbg_device *device, void *pointer, int64_t count, size_t size);
/* The same for memory that outlives its device, of the GPU of that number; waits for nothing. */
void gbg_cuda_free(int number, void *pointer);
/* An array of at least `count` elements, kept with its capacity; what it held is lost if it grows.
 */
int gbg_cuda_grow(struct gbg_device *device, void **pointer, int64_t *capacity, int64_t count,
                  size_t size, const char *what);

/* Memory of the device for one call: grows at first use. */
int gbg_cuda_workspace(struct gbg_device *device, size_t bytes, void **pointer);
/* A part of a workspace, 256-byte aligned; base NULL: only counts. */
void *gbg_cuda_take(void *base, size_t *used, int64_t count, size_t size);

/* Copies a result to the host and waits for it and everything before it. */
int gbg_cuda_fetch(struct gbg_device *device, void *to, const void *from, size_t bytes);
int gbg_cuda_clear(struct gbg_device *device, void *pointer, size_t bytes);

enum { GBG_CUDA_THREADS = 128 };

/* Blocks for n threads in all. */
static inline unsigned gbg_cuda_blocks(int64_t n, int threads = GBG_CUDA_THREADS)
{
    return (unsigned)((n + threads - 1) / threads);
}

/* The number of this thread in the grid. */
static __device__ __forceinline__ int64_t gbg_cuda_index()
{
    return (int64_t)blockIdx.x * blockDim.x + threadIdx.x;
}

/* Maxima of doubles >= 0: their bits are in the same order as integers, so no order of threads
 * shows. All threads of a warp must call it. */
static __device__ __forceinline__ void gbg_cuda_max(unsigned long long *largest, double value)
{
    unsigned long long bits = (unsigned long long)__double_as_longlong(value);
    for (int lane = 16; lane > 0; lane /= 2) {
        unsigned long long other = __shfl_xor_sync(0xFFFFFFFFu, bits, lane);
        bits = other > bits ? other : bits;
    }
    if ((threadIdx.x & 31) == 0 && bits > __ldcg(largest)) {
        atomicMax(largest, bits);
    }
}

/* Kernels of a batch of steps return at once when the batch has been stopped; halt NULL: there is
 * no batch. */
static __device__ __forceinline__ bool gbg_cuda_halted(const int *halt)
{
    return halt && __ldcg(halt) != 0;
}

#endif
