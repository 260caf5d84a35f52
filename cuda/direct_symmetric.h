/* L1, CUDA: the arrays of the sum that computes each pair once for both (direct_symmetric.cu). */
#ifndef GBG_CUDA_DIRECT_SYMMETRIC_H
#define GBG_CUDA_DIRECT_SYMMETRIC_H

#include "cuda/direct.h"

enum {
    GBG_SYMMETRIC_WARPS = 4,                          /* of a block of threads */
    GBG_SYMMETRIC_THREADS = 32 * GBG_SYMMETRIC_WARPS, /* also the sources of a tile */
    GBG_SYMMETRIC_CHUNKS = GBG_SYMMETRIC_THREADS / 32 /* of a tile */
};

struct gbg_cuda_symmetric {
    int64_t n, padded, blocks;
    int each;              /* targets of a lane: 8, or 4 of few particles */
    int64_t block;         /* targets of a block */
    int64_t reach;         /* a block meets those 0 .. reach - 1 further on, modulo blocks */
    int64_t batch, splits; /* blocks of targets in a pass; parts of their sources */
    float scale[3];        /* of high words */
    float half[3];         /* of the box */
    double fine[3];        /* of 64-bit positions */
    double strength;
    /* sorted */
    int32_t *order;
    uint32_t *high[3], *low[3];
    float *alpha;
    uint32_t *middle[3], *extent[3]; /* of chunks: their intervals, half as long */
    float *common;                   /* of chunks: the strength of all their particles, or NaN */
    double *field[3];
    float *row[3];  /* of a pass: [target block][distance][source] */
    double *own[3]; /* of a pass: [target block][split][target] */
    uint64_t *key[2];
    int32_t *index;
    void *scratch;
    size_t scratch_bytes;
};

/* Sizes from those of a state, and the arrays in a workspace; base NULL: only counts bytes. */
struct gbg_cuda_symmetric gbg_cuda_symmetric_make(const struct gbg_state *state);
size_t gbg_cuda_symmetric_lay_out(struct gbg_cuda_symmetric *s, int dimension, void *base);
/* Sorts the particles by species and along a Hilbert curve; intervals of their chunks. */
int gbg_cuda_symmetric_sort(struct gbg_device *device, const struct gbg_state *state,
                            const struct gbg_cuda_symmetric *s);

/* Middle and half length of the interval of a warp's coordinates, count of them in each lane. */
template <int count>
static __device__ __forceinline__ void gbg_cuda_interval(const uint32_t high[count],
                                                         uint32_t *middle, uint32_t *extent)
{
    uint32_t origin = __shfl_sync(0xFFFFFFFFu, high[0], 0);
    int32_t low = 0, top = 0;
    for (int k = 0; k < count; k++) {
        int32_t d = (int32_t)(high[k] - origin);
        low = d < low ? d : low;
        top = d > top ? d : top;
    }
    low = __reduce_min_sync(0xFFFFFFFFu, low);
    top = __reduce_max_sync(0xFFFFFFFFu, top);
    int64_t length = (int64_t)top - low;
    *middle = origin + (uint32_t)low + (uint32_t)(length / 2);
    *extent = (uint32_t)(length / 2) + 1;
}

#endif
