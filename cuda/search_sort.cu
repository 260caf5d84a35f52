/* L1, CUDA: the indices of each row in ascending order. */
#include "cuda/search.h"

#include <limits.h>

/* Long rows: threads of a block, rows that a block looks after, and entries of one that fit on the
 * multiprocessor. */
enum { LONG_THREADS = 256, LONG_ROWS = 32, LONG_HELD = 8192 };

/* Rows of up to LANES EACH entries, LANES threads for each: an entry goes to the place that the
 * number of smaller ones names. */
template <int LANES, int EACH>
static __global__ void sort_short(const __grid_constant__ struct gbg_cuda_rows rows, int64_t n)
{
    int64_t i = gbg_cuda_index() / LANES, begin = 0;
    int lane = (int)(threadIdx.x % LANES), count = 0, rank[EACH];
    int32_t own[EACH];
    if (i < n) {
        begin = rows.offset[i];
        int64_t length = rows.offset[i + 1] - begin;
        count = length <= LANES * EACH ? (int)length : 0;
    }
#pragma unroll
    for (int e = 0; e < EACH; e++) {
        int k = e * LANES + lane;
        own[e] = k < count ? rows.index[begin + k] : INT_MAX; /* which no index is */
        rank[e] = 0;
    }
    int most = __reduce_max_sync(0xFFFFFFFFu, count);
#pragma unroll
    for (int e = 0; e < EACH; e++) {
        for (int l = 0; l < LANES && e * LANES + l < most; l++) {
            int32_t value = __shfl_sync(0xFFFFFFFFu, own[e], l, LANES);
#pragma unroll
            for (int u = 0; u < EACH; u++) {
                rank[u] += value < own[u];
            }
        }
    }
    __syncwarp(); /* all have been read before any is written */
#pragma unroll
    for (int e = 0; e < EACH; e++) {
        if (e * LANES + lane < count) {
            rows.index[begin + rank[e]] = own[e];
        }
    }
}

static __device__ __forceinline__ void put_in_order(int32_t *row, int64_t low, int64_t high,
                                                    int64_t count)
{
    if (high < count && row[low] > row[high]) {
        int32_t larger = row[low];
        row[low] = row[high];
        row[high] = larger;
    }
}

/* A bitonic network (Batcher 1968) all of whose comparisons move the larger entry up, so that what
 * is missing to a power of two can be left away: it would stay at the end. */
static __device__ void sort_network(int32_t *row, int64_t count)
{
    for (int bit = 0; INT64_C(1) << bit < count; bit++) {
        /* runs of twice 1 << bit: a rising half meets its neighbour read backwards */
        int64_t last = (INT64_C(2) << bit) - 1, below = (INT64_C(1) << bit) - 1;
        for (int64_t p = threadIdx.x; p >> bit << (bit + 1) < count; p += LONG_THREADS) {
            int64_t run = p >> bit << (bit + 1), at = p & below;
            put_in_order(row, run + at, run + last - at, count);
        }
        __syncthreads();
        for (int lower = bit - 1; lower >= 0; lower--) {
            int64_t gap = INT64_C(1) << lower;
            for (int64_t p = threadIdx.x; p >> lower << (lower + 1) < count; p += LONG_THREADS) {
                int64_t low = (p >> lower << (lower + 1)) + (p & (gap - 1));
                put_in_order(row, low, low + gap, count);
            }
            __syncthreads();
        }
    }
}

/* One row by all threads of the block. */
static __device__ void sort_one(int32_t *row, int64_t count, int32_t *held)
{
    int wrong = 0;
    for (int64_t k = threadIdx.x; k + 1 < count; k += LONG_THREADS) {
        wrong |= row[k] > row[k + 1];
    }
    if (!__syncthreads_or(wrong)) {
        return; /* candidates of one cell come in order */
    }
    if (count > LONG_HELD) {
        sort_network(row, count);
        return;
    }
    for (int64_t k = threadIdx.x; k < count; k += LONG_THREADS) {
        held[k] = row[k];
    }
    __syncthreads();
    sort_network(held, count);
    for (int64_t k = threadIdx.x; k < count; k += LONG_THREADS) {
        row[k] = held[k];
    }
    __syncthreads();
}

/* Rows of more than `limit` entries. */
static __global__ void sort_long(const __grid_constant__ struct gbg_cuda_rows rows, int64_t n,
                                 int64_t limit)
{
    __shared__ int32_t held[LONG_HELD];
    __shared__ int is_long[LONG_ROWS];
    int64_t first = (int64_t)blockIdx.x * LONG_ROWS;
    if (threadIdx.x < LONG_ROWS) {
        int64_t i = first + threadIdx.x;
        is_long[threadIdx.x] = i < n && rows.offset[i + 1] - rows.offset[i] > limit;
    }
    __syncthreads();
    for (int k = 0; k < LONG_ROWS; k++) {
        if (is_long[k]) {
            int64_t begin = rows.offset[first + k];
            sort_one(rows.index + begin, rows.offset[first + k + 1] - begin, held);
        }
    }
}

template <int LANES, int EACH>
static int64_t start_short(struct gbg_device *device, const struct gbg_cuda_rows *rows, int64_t n)
{
    sort_short<LANES, EACH>
        <<<gbg_cuda_blocks(n * LANES), GBG_CUDA_THREADS, 0, device->stream>>>(*rows, n);
    return LANES * EACH;
}

int gbg_cuda_search_sort_rows(struct gbg_device *device, const struct gbg_cuda_rows *rows,
                              int64_t n)
{
    if (rows->longest < 2) {
        return GBG_OK;
    }
    /* threads for a row: by the mean, so that few long rows do not make all of them slow */
    int64_t usual = 2 * (rows->total / n) + 8, limit;
    usual = rows->longest < usual ? rows->longest : usual;
    if (usual <= 16) {
        limit = start_short<4, 4>(device, rows, n);
    } else if (usual <= 32) {
        limit = start_short<8, 4>(device, rows, n);
    } else if (usual <= 64) {
        limit = start_short<16, 4>(device, rows, n);
    } else if (usual <= 128) {
        limit = start_short<32, 4>(device, rows, n);
    } else {
        limit = start_short<32, 8>(device, rows, n);
    }
    int status = gbg_cuda_started(device, "sorting rows");
    if (status == GBG_OK && rows->longest > limit) {
        sort_long<<<gbg_cuda_blocks(n, LONG_ROWS), LONG_THREADS, 0, device->stream>>>(*rows, n,
                                                                                      limit);
        status = gbg_cuda_started(device, "sorting long rows");
    }
    return status;
}
