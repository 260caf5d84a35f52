/* L1, CUDA: building pair lists from cells: rows of neighbours in ascending order of ranks. */
#include "cuda/list.h"

#include <cub/device/device_scan.cuh>

#include "backend/cpu/list_lengths.h"
#include "backend/cpu/list_square.h"

/* Threads of a block that has a row a thread; of one that sorts wide slices; rows of those that it
 * sorts in shared memory. */
enum { THREADS = GBG_CUDA_THREADS, SORTERS = 1024, SHARED = 256, NONE = INT32_MAX };

/* What a search for neighbours reads: lengths in units of the radius. */
struct search {
    struct gbg_state state;
    struct gbg_cuda_grid grid;
    float unit[3];
    float limit;    /* squared, with room for rounding */
    double squared; /* of the radius */
    int coarse; /* 1: high words are too coarse for the radius: neighbours are sifted by 64 bits */
};

/* The local coordinates, and those at which the list is built. */
template <int DIMENSION>
static __global__ void remember(const __grid_constant__ struct gbg_state state,
                                const struct gbg_cuda_rows rows, int64_t total)
{
    int64_t i = gbg_cuda_index();
    for (int a = 0; a < DIMENSION && i < total; a++) {
        uint32_t high = state.high[a][i];
        uint32_t local = gbg_cuda_local(high, state.low[a][i], rows.shift[a]);
        rows.local[a][i] = local;
        if (i < rows.n) {
            rows.built[a][i] = local;
            rows.built_high[a][i] = high;
        }
    }
}

/* Calls visit(j) for each neighbour of particle i, in any order. */
template <int DIMENSION, bool COARSE, typename Visit>
static __device__ __forceinline__ void for_neighbours(const struct search &search, int64_t i,
                                                      Visit visit)
{
    uint32_t own[DIMENSION];
    for (int a = 0; a < DIMENSION; a++) {
        own[a] = search.state.high[a][i];
    }
    gbg_cuda_visit(search.grid, search.grid.cell_of[i], [&](int32_t slot) {
        vf squared = 0.0f;
        for (int a = 0; a < DIMENSION; a++) {
            vi d = (vi)(own[a] - search.grid.high[a][slot]);
            squared = gbg_list_add_square(d, search.unit[a], squared);
        }
        if (vf_lt(squared, search.limit)) {
            int32_t j = search.grid.particle[slot];
            if (j != i && (!COARSE || gbg_list_holds(&search.state, i, j, search.squared))) {
                visit(j);
            }
        }
    });
}

/* Widths of slices, a warp's each, where the offsets will be; the widest behind them. */
template <int DIMENSION, bool COARSE>
static __global__ void __launch_bounds__(THREADS)
    count_rows(const __grid_constant__ struct search search, const struct gbg_cuda_rows rows)
{
    int64_t i = gbg_cuda_index(), slice = i / GBG_CUDA_SLICE;
    unsigned count = 0;
    if (i < rows.n) {
        for_neighbours<DIMENSION, COARSE>(search, i, [&](int32_t) { count++; });
    }
    count = __reduce_max_sync(0xFFFFFFFFu, count);
    if (i % GBG_CUDA_SLICE == 0 && slice < rows.slices) {
        unsigned long long *widest = (unsigned long long *)rows.offset + rows.slices + 1;
        rows.width[slice] = (int32_t)count;
        rows.offset[slice] = (int64_t)count * GBG_CUDA_SLICE;
        if (count > *(volatile unsigned long long *)widest) { /* few come that far */
            atomicMax(widest, (unsigned long long)count);
        }
    }
}

static __global__ void invert(const int32_t *rank, int64_t n, int32_t *of_rank)
{
    int64_t i = gbg_cuda_index();
    if (i < n) {
        of_rank[rank[i]] = (int32_t)i;
    }
}

/* Sorts `count` numbers that stand THREADS apart. */
static __device__ void sort_short(int32_t *key, int count)
{
    for (int k = 1; k < count; k++) {
        int32_t held = key[k * THREADS];
        int free = k;
        for (; free > 0 && key[(free - 1) * THREADS] > held; free--) {
            key[free * THREADS] = key[(free - 1) * THREADS];
        }
        key[free * THREADS] = held;
    }
}

/* Rows of slices that are no wider than MOST are found, sorted by ranks, and written as indices.
 * Wider ones are written as ranks in any order and filled up with NONE, for sort_wide. */
template <int DIMENSION, bool COARSE, int MOST>
static __global__ void __launch_bounds__(THREADS)
    fill_rows(const __grid_constant__ struct search search, const struct gbg_cuda_rows rows,
              const int32_t *of_rank)
{
    __shared__ int32_t found[MOST * THREADS];
    int64_t i = gbg_cuda_index(), slice = i / GBG_CUDA_SLICE;
    if (slice >= rows.slices) {
        return;
    }
    int32_t *key = found + threadIdx.x;
    int32_t *row = rows.index + rows.offset[slice] + i % GBG_CUDA_SLICE;
    int32_t width = rows.width[slice], count = 0;
    int32_t self = (int32_t)(i < rows.n ? i : rows.n - 1);
    bool narrow = width <= MOST;
    if (i < rows.n) {
        for_neighbours<DIMENSION, COARSE>(search, i, [&](int32_t j) {
            int32_t rank = gbg_rank_of(&search.state, j);
            if (narrow) {
                key[count * THREADS] = rank;
            } else {
                row[(int64_t)count * GBG_CUDA_SLICE] = rank;
            }
            count++;
        });
    }
    if (narrow) {
        sort_short(key, count);
        __syncwarp();
    }
    for (int32_t k = 0; k < width; k++) {
        int64_t to = (int64_t)k * GBG_CUDA_SLICE;
        if (k >= count) {
            row[to] = narrow ? self : NONE;
        } else if (narrow) {
            row[to] = of_rank ? of_rank[key[k * THREADS]] : key[k * THREADS];
        }
    }
}

/* Puts the smaller number of each lane at the lower place. */
static __device__ __forceinline__ void compare(int32_t *key, int64_t low, int64_t high,
                                               int64_t count)
{
    if (high < count) {
        int lane = (int)(threadIdx.x & 31);
        int32_t *p = key + low * GBG_CUDA_SLICE + lane, *q = key + high * GBG_CUDA_SLICE + lane;
        int32_t a = *p, b = *q;
        if (a > b) {
            *p = b;
            *q = a;
        }
    }
}

/* Sorts the 32 rows of a slice side by side, each warp a comparison of all of them: a bitonic
 * network in which every comparison puts the smaller number lower, so that places behind the end
 * count as larger than all and are left away. */
static __device__ void sort_slice(int32_t *key, int64_t count)
{
    int64_t warp = threadIdx.x / 32, warps = blockDim.x / 32, pairs = 1;
    while (2 * pairs < count) {
        pairs *= 2;
    }
    for (int64_t half = 1; half <= pairs; half *= 2) { /* a power of two */
        for (int64_t c = warp; c < pairs; c += warps) {
            int64_t place = c & (half - 1), first = 2 * (c - place);
            compare(key, first + place, first + 2 * half - 1 - place, count);
        }
        __syncthreads();
        for (int64_t apart = half / 2; apart > 0; apart /= 2) {
            for (int64_t c = warp; c < pairs; c += warps) {
                int64_t low = 2 * c - (c & (apart - 1));
                compare(key, low, low + apart, count);
            }
            __syncthreads();
        }
    }
}

/* A block for each slice of more than `most` neighbours: ranks in any order to sorted indices. */
static __global__ void __launch_bounds__(SORTERS)
    sort_wide(const struct gbg_cuda_rows rows, int32_t most, const int32_t *of_rank)
{
    __shared__ int32_t near[SHARED * GBG_CUDA_SLICE];
    int64_t slice = blockIdx.x, width = rows.width[slice];
    if (width <= most) {
        return;
    }
    int32_t *row = rows.index + rows.offset[slice];
    int32_t *key = width <= SHARED ? near : row;
    int64_t self = slice * GBG_CUDA_SLICE + threadIdx.x % 32;
    self = self < rows.n ? self : rows.n - 1;
    for (int64_t k = threadIdx.x; k < width * GBG_CUDA_SLICE && key != row; k += SORTERS) {
        key[k] = row[k];
    }
    __syncthreads();
    sort_slice(key, width);
    for (int64_t k = threadIdx.x; k < width * GBG_CUDA_SLICE; k += SORTERS) {
        int32_t rank = key[k];
        row[k] = rank == NONE ? (int32_t)self : of_rank ? of_rank[rank] : rank;
    }
}

template <int DIMENSION, bool COARSE>
static int start_count(struct gbg_device *device, const struct search &search,
                       const struct gbg_cuda_rows &rows)
{
    unsigned blocks = gbg_cuda_blocks(rows.slices * GBG_CUDA_SLICE, THREADS);
    remember<DIMENSION><<<gbg_cuda_blocks(search.grid.n), GBG_CUDA_THREADS, 0, device->stream>>>(
        search.state, rows, search.grid.n);
    int status = gbg_cuda_started(device, "coordinates of the pair list");
    if (status == GBG_OK) {
        count_rows<DIMENSION, COARSE><<<blocks, THREADS, 0, device->stream>>>(search, rows);
        status = gbg_cuda_started(device, "counting neighbours");
    }
    return status;
}

template <int DIMENSION, bool COARSE>
static int start_fill(struct gbg_device *device, const struct search &search,
                      const struct gbg_cuda_rows &rows, const int32_t *of_rank, int64_t widest)
{
    enum { NARROW = 32, WIDER = 64 };
    unsigned blocks = gbg_cuda_blocks(rows.slices * GBG_CUDA_SLICE, THREADS);
    if (widest <= NARROW) {
        fill_rows<DIMENSION, COARSE, NARROW>
            <<<blocks, THREADS, 0, device->stream>>>(search, rows, of_rank);
    } else {
        fill_rows<DIMENSION, COARSE, WIDER>
            <<<blocks, THREADS, 0, device->stream>>>(search, rows, of_rank);
    }
    int status = gbg_cuda_started(device, "filling the pair list");
    if (status == GBG_OK && widest > WIDER) {
        sort_wide<<<(unsigned)rows.slices, SORTERS, 0, device->stream>>>(rows, WIDER, of_rank);
        status = gbg_cuda_started(device, "sorting the pair list");
    }
    return status;
}

/* Offsets from widths; to the host: how long the index is, and how wide the widest slice. */
static int sum_widths(struct gbg_device *device, const struct gbg_cuda_rows *rows, void *scratch,
                      size_t scratch_bytes, int64_t sums[2])
{
    cudaError_t error = cub::DeviceScan::ExclusiveSum(
        scratch, scratch_bytes, rows->offset, rows->offset, rows->slices + 1, device->stream);
    int status = gbg_cuda_status(device, error, "summing the widths of the pair list");
    return status ? status
                  : gbg_cuda_fetch(device, sums, rows->offset + rows->slices, 2 * sizeof *sums);
}

struct work {
    int32_t *of_rank; /* index of each rank; NULL: the same */
    void *scratch;
    size_t scratch_bytes;
};

static int take_work(struct gbg_device *device, const struct gbg_state *state,
                     const struct gbg_cuda_rows *rows, struct work *work)
{
    void *base = NULL;
    memset(work, 0, sizeof *work);
    int status = gbg_cuda_status(device,
                                 cub::DeviceScan::ExclusiveSum(NULL, work->scratch_bytes,
                                                               rows->offset, rows->offset,
                                                               rows->slices + 1, device->stream),
                                 "asking for a sum's memory");
    for (int pass = 0; status == GBG_OK && pass < 2; pass++) {
        size_t used = 0;
        work->scratch = gbg_cuda_take(base, &used, (int64_t)work->scratch_bytes + 1, 1);
        work->of_rank = state->rank ? (int32_t *)gbg_cuda_take(base, &used, rows->n, 4) : NULL;
        status = pass ? status : gbg_cuda_workspace(device, used, &base);
    }
    if (status == GBG_OK && work->of_rank) {
        invert<<<gbg_cuda_blocks(rows->n), GBG_CUDA_THREADS, 0, device->stream>>>(
            state->rank, rows->n, work->of_rank);
        status = gbg_cuda_started(device, "order of ranks");
    }
    return status;
}

/* By half more than is needed, so that it rarely grows again. */
static int reserve_index(struct gbg_device *device, struct gbg_list *list, int64_t needed)
{
    return needed <= list->index_capacity
               ? GBG_OK
               : gbg_cuda_grow(device, (void **)&list->rows.index, &list->index_capacity,
                               needed + needed / 2 + 4096, sizeof *list->rows.index, "pair list");
}

template <int DIMENSION, bool COARSE>
static int build_rows(struct gbg_device *device, const struct search &search, struct gbg_list *list)
{
    struct work work;
    struct gbg_cuda_rows *rows = &list->rows;
    int64_t sums[2] = {0, 0};
    int status = take_work(device, &search.state, rows, &work);
    /* the end of the offsets and the widest */
    status = status ? status : gbg_cuda_clear(device, rows->offset + rows->slices, sizeof sums);
    status = status ? status : start_count<DIMENSION, COARSE>(device, search, *rows);
    status = status ? status : sum_widths(device, rows, work.scratch, work.scratch_bytes, sums);
    status = status ? status : reserve_index(device, list, sums[0]);
    return status ? status
                  : start_fill<DIMENSION, COARSE>(device, search, *rows, work.of_rank, sums[1]);
}

int gbg_cuda_list_build(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list)
{
    struct search search = {*state, {}, {}, 0.0f, list->radius * list->radius, 0};
    int status;
    list->epoch = state->epoch - 1; /* a build that fails is done again */
    if (list->rows.n > 0) {
        status = gbg_cuda_grid_build(device, &list->grid, &state->box, list->radius,
                                     state->owned + state->ghost, state->high);
        search.grid = list->grid;
        search.coarse =
            gbg_list_choose_search(&state->box, list->radius, search.unit, &search.limit);
        if (status != GBG_OK) {
            return status;
        }
        if (state->box.dimension == 2) {
            status = search.coarse ? build_rows<2, true>(device, search, list)
                                   : build_rows<2, false>(device, search, list);
        } else {
            status = search.coarse ? build_rows<3, true>(device, search, list)
                                   : build_rows<3, false>(device, search, list);
        }
        if (status != GBG_OK) {
            return status;
        }
    }
    list->builds++;
    list->epoch = state->epoch;
    return GBG_OK;
}
