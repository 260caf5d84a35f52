/* L1, CUDA: the checks of hard cores, and keeping the coordinates of before a step. */
#include "cuda/kernels.h"

#include <cub/cub.cuh>

#include "cuda/grid.h"

/* Copies a word of four particles at a time; the last few one by one. */
static __device__ __forceinline__ void copy_four(void *to, const void *from, int64_t i, int64_t n)
{
    if (i + 4 <= n) {
        ((uint4 *)to)[i / 4] = ((const uint4 *)from)[i / 4];
        return;
    }
    for (; i < n; i++) {
        ((uint32_t *)to)[i] = ((const uint32_t *)from)[i];
    }
}

template <bool back> static __global__ void copy(const __grid_constant__ struct gbg_state state)
{
    int64_t i = 4 * gbg_cuda_index(), n = state.owned;
    if (i >= n) {
        return;
    }
#pragma unroll
    for (int a = 0; a < 3; a++) {
        if (a == state.box.dimension) {
            break;
        }
        copy_four(back ? state.high[a] : state.start_high[a],
                  back ? state.start_high[a] : state.high[a], i, n);
        copy_four(back ? state.low[a] : state.start_low[a],
                  back ? state.start_low[a] : state.low[a], i, n);
        if (state.image[a]) {
            copy_four(back ? state.image[a] : state.start_image[a],
                      back ? state.start_image[a] : state.image[a], i, n);
        }
    }
    for (int64_t k = i; state.overlapped && !back && k < i + 4 && k < n; k++) {
        state.overlapped[k] = 0;
    }
}

int gbg_cuda_keep(struct gbg_device *device, struct gbg_state *state)
{
    if (state->owned == 0) {
        return GBG_OK;
    }
    copy<false>
        <<<gbg_cuda_blocks((state->owned + 3) / 4), GBG_CUDA_THREADS, 0, device->stream>>>(*state);
    return gbg_cuda_started(device, "keep");
}

int gbg_cuda_put_back(struct gbg_device *device, struct gbg_state *state)
{
    if (state->owned == 0) {
        return GBG_OK;
    }
    copy<true>
        <<<gbg_cuda_blocks((state->owned + 3) / 4), GBG_CUDA_THREADS, 0, device->stream>>>(*state);
    return gbg_cuda_started(device, "put_back");
}

static const unsigned long long NONE = ~0ull;

/* All pairs of a state that are too close, by cells. */
struct overlaps {
    unsigned long long count;
    unsigned long long lowest; /* first << 32 | second, or NONE */
    double distance;           /* of that pair */
};

static __device__ __forceinline__ double contact_of(const struct gbg_state &state, int64_t i,
                                                    int64_t j)
{
    if (state.own_diameter) {
        return 0.5 * (state.own_diameter[i] + state.own_diameter[j]);
    }
    int s = state.species ? state.species[i] : 0, t = state.species ? state.species[j] : 0;
    return 0.5 * (state.diameter[s] + state.diameter[t]);
}

template <int dimension>
static __device__ __forceinline__ double distance_of(const struct gbg_state &state, int64_t i,
                                                     int64_t j)
{
    double squared = 0.0;
    for (int a = 0; a < dimension; a++) {
        double d = gbg_box_difference(&state.box, a, gbg_join(state.high[a][i], state.low[a][i]),
                                      gbg_join(state.high[a][j], state.low[a][j]));
        squared += d * d;
    }
    return sqrt(squared);
}

template <int dimension>
static __device__ __forceinline__ bool overlap(const struct gbg_state &state, double tolerance,
                                               int64_t i, int64_t j)
{
    double contact = contact_of(state, i, j);
    return contact != 0.0 && !(distance_of<dimension>(state, i, j) >= contact * (1.0 - tolerance));
}

static __global__ void clear(struct overlaps *overlaps)
{
    overlaps->count = 0;
    overlaps->lowest = NONE;
    overlaps->distance = 0.0;
}

/* Counts the partners j > i of each particle, a thread for each slot of the grid. */
template <int dimension>
static __global__ void count_partners(const __grid_constant__ struct gbg_state state,
                                      const __grid_constant__ struct gbg_cuda_grid grid,
                                      double tolerance, int64_t *partners,
                                      struct overlaps *overlaps)
{
    int64_t slot = gbg_cuda_index();
    if (slot >= grid.n) {
        return;
    }
    int32_t i = grid.particle[slot], least = INT32_MAX;
    int64_t found = 0;
    gbg_cuda_visit(grid, grid.cell_of[i], [&](int32_t other) {
        int32_t j = grid.particle[other];
        if (j > i && overlap<dimension>(state, tolerance, i, j)) {
            found++;
            least = j < least ? j : least;
        }
    });
    partners[i] = found;
    if (found > 0) {
        atomicAdd(&overlaps->count, (unsigned long long)found);
        atomicMin(&overlaps->lowest, (unsigned long long)i << 32 | (unsigned long long)least);
    }
}

template <int dimension>
static __global__ void measure_lowest(const __grid_constant__ struct gbg_state state,
                                      struct overlaps *overlaps)
{
    if (overlaps->lowest != NONE) {
        overlaps->distance = distance_of<dimension>(state, (int64_t)(overlaps->lowest >> 32),
                                                    (int64_t)(overlaps->lowest & UINT32_MAX));
    }
}

/* Writes the partners of each particle in ascending order where its pairs begin; of those of the
 * particle at the end of the room the smallest that fit. */
template <int dimension>
static __global__ void write_pairs(const __grid_constant__ struct gbg_state state,
                                   const __grid_constant__ struct gbg_cuda_grid grid,
                                   double tolerance, const int64_t *offset, int64_t capacity,
                                   int32_t *first, int32_t *second)
{
    int64_t slot = gbg_cuda_index();
    if (slot >= grid.n) {
        return;
    }
    int32_t i = grid.particle[slot];
    int64_t begin = offset[i], kept = 0;
    if (begin >= capacity) {
        return;
    }
    int64_t room = capacity - begin;
    int32_t *partner = second + begin;
    gbg_cuda_visit(grid, grid.cell_of[i], [&](int32_t other) {
        int32_t j = grid.particle[other];
        if (j <= i || !overlap<dimension>(state, tolerance, i, j) ||
            (kept == room && partner[room - 1] <= j)) {
            return;
        }
        int64_t k = kept < room ? kept++ : room - 1;
        for (; k > 0 && partner[k - 1] > j; k--) {
            partner[k] = partner[k - 1];
        }
        partner[k] = j;
    });
    for (int64_t k = 0; k < kept; k++) {
        first[begin + k] = i;
    }
}

/* A search that has been counted: what the pairs are written from. */
struct counted {
    const struct gbg_state *state;
    struct gbg_cuda_grid grid;
    double tolerance;
    int64_t *partners; /* of each particle; afterwards where its pairs begin */
    struct overlaps *overlaps;
    void *scratch; /* of the prefix sum */
    size_t scratch_bytes;
};

/* Counts all pairs, and turns the counts into places for the pairs if `places`. */
template <int dimension>
static int count_pairs(struct gbg_device *device, struct counted *search, int places,
                       struct overlaps *found)
{
    int64_t n = search->state->owned;
    unsigned blocks = gbg_cuda_blocks(n);
    clear<<<1, 1, 0, device->stream>>>(search->overlaps);
    count_partners<dimension><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(
        *search->state, search->grid, search->tolerance, search->partners, search->overlaps);
    measure_lowest<dimension><<<1, 1, 0, device->stream>>>(*search->state, search->overlaps);
    int status = gbg_cuda_started(device, "overlaps");
    if (status == GBG_OK && places) {
        status = gbg_cuda_status(
            device,
            cub::DeviceScan::ExclusiveSum(search->scratch, search->scratch_bytes, search->partners,
                                          search->partners, n, device->stream),
            "overlaps");
    }
    return status ? status : gbg_cuda_fetch(device, found, search->overlaps, sizeof *found);
}

/* The first `count` pairs, to the host. */
template <int dimension>
static int fetch_pairs(struct gbg_device *device, const struct counted *search, int64_t count,
                       int32_t *first, int32_t *second)
{
    int32_t *pair = NULL; /* all first particles, then all second ones */
    int status = gbg_cuda_allocate(device, (void **)&pair, 2 * count, sizeof *pair, "pairs");
    if (status == GBG_OK) {
        write_pairs<dimension>
            <<<gbg_cuda_blocks(search->state->owned), GBG_CUDA_THREADS, 0, device->stream>>>(
                *search->state, search->grid, search->tolerance, search->partners, count, pair,
                pair + count);
        status = gbg_cuda_started(device, "overlaps");
    }
    size_t bytes = (size_t)count * sizeof *pair;
    status = status ? status : gbg_cuda_fetch(device, first, pair, bytes);
    status = status ? status : gbg_cuda_fetch(device, second, pair + count, bytes);
    gbg_cuda_release(device, pair, 2 * count, sizeof *pair);
    return status;
}

/* Memory of the search, from the workspace. */
static int reserve(struct gbg_device *device, struct counted *search)
{
    int64_t n = search->state->owned;
    size_t used = 0;
    void *memory = NULL;
    search->scratch_bytes = 0;
    int status =
        gbg_cuda_status(device,
                        cub::DeviceScan::ExclusiveSum(NULL, search->scratch_bytes, search->partners,
                                                      search->partners, n, device->stream),
                        "overlaps");
    gbg_cuda_take(NULL, &used, 1, sizeof *search->overlaps);
    gbg_cuda_take(NULL, &used, n, sizeof *search->partners);
    gbg_cuda_take(NULL, &used, (int64_t)search->scratch_bytes, 1);
    status = status ? status : gbg_cuda_workspace(device, used, &memory);
    used = 0;
    search->overlaps = (struct overlaps *)gbg_cuda_take(memory, &used, 1, sizeof *search->overlaps);
    search->partners = (int64_t *)gbg_cuda_take(memory, &used, n, sizeof *search->partners);
    search->scratch = gbg_cuda_take(memory, &used, (int64_t)search->scratch_bytes, 1);
    return status;
}

int gbg_cuda_overlaps(struct gbg_device *device, struct gbg_state *state, double tolerance,
                      int64_t capacity, int32_t *first, int32_t *second, struct gbg_pair *lowest,
                      int64_t *count)
{
    struct counted search = {};
    struct overlaps found = {0, NONE, 0.0};
    int flat = state->box.dimension == 2;
    double largest = 0.0;
    for (int s = 0; s < state->n_species; s++) {
        largest = state->diameter[s] > largest ? state->diameter[s] : largest;
    }
    *lowest = {-1, -1, 0.0};
    *count = 0;
    if (state->owned == 0) {
        return GBG_OK;
    }
    search.state = state;
    search.tolerance = tolerance;
    int status =
        gbg_cuda_grid_build(device, &search.grid, &state->box, largest, state->owned, state->high);
    status = status ? status : reserve(device, &search);
    if (status == GBG_OK) {
        status = flat ? count_pairs<2>(device, &search, capacity > 0, &found)
                      : count_pairs<3>(device, &search, capacity > 0, &found);
    }
    int64_t kept = (int64_t)found.count < capacity ? (int64_t)found.count : capacity;
    if (status == GBG_OK && kept > 0) {
        status = flat ? fetch_pairs<2>(device, &search, kept, first, second)
                      : fetch_pairs<3>(device, &search, kept, first, second);
    }
    if (status == GBG_OK && found.lowest != NONE) {
        *lowest = {(int64_t)(found.lowest >> 32), (int64_t)(found.lowest & UINT32_MAX),
                   found.distance};
    }
    *count = status == GBG_OK ? (int64_t)found.count : 0;
    gbg_cuda_grid_release(device, &search.grid);
    return status;
}
