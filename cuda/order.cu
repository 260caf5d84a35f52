/* L1, CUDA: where particles stand in memory: near each other if they are near in space, or in the
 * order of their ids. No result depends on it; the time to fetch neighbours does. */
#include "backend/cpu/order.h"

#include <cub/device/device_radix_sort.cuh>

#include "backend/cpu/list_lengths.h"
#include "cuda/kernels.h"
#include "cuda/list.h"

/* Keys and indices before and after a sort, and what the sort asks for; an array that is moved lies
 * over the keys: 8 bytes a particle. */
struct work {
    uint32_t *key[2];
    int32_t *index[2];
    void *scratch;
    size_t scratch_bytes;
};

static __global__ void make_keys(const __grid_constant__ struct gbg_state state,
                                 const __grid_constant__ struct gbg_halvings halvings,
                                 uint32_t *key, int32_t *index)
{
    int64_t i = gbg_cuda_index();
    if (i < state.owned) {
        key[i] = gbg_order_key(&state, &halvings, i);
        index[i] = (int32_t)i;
    }
}

static __global__ void order_by_rank(const int32_t *rank, int64_t n, int32_t *order)
{
    int64_t i = gbg_cuda_index();
    if (i < n) {
        order[rank[i]] = (int32_t)i;
    }
}

template <typename Element>
static __global__ void gather(int64_t n, const int32_t *order, const Element *from, Element *to)
{
    int64_t k = gbg_cuda_index();
    if (k < n) {
        to[k] = from[order[k]];
    }
}

static __global__ void name(int64_t n, uint64_t *id, int32_t *rank)
{
    int64_t i = gbg_cuda_index();
    if (i < n && id) {
        id[i] = (uint64_t)i;
    }
    if (i < n && rank) {
        rank[i] = (int32_t)i;
    }
}

static cudaError_t sort_keys(struct gbg_device *device, int64_t n, struct work *work)
{
    return cub::DeviceRadixSort::SortPairs(
        work->scratch, work->scratch_bytes, (const uint32_t *)work->key[0], work->key[1],
        (const int32_t *)work->index[0], work->index[1], n, 0, GBG_KEY_BITS, device->stream);
}

static int take_work(struct gbg_device *device, int64_t n, struct work *work)
{
    void *base = NULL;
    memset(work, 0, sizeof *work);
    int status = gbg_cuda_status(device, sort_keys(device, n, work), "asking for a sort's memory");
    for (int pass = 0; status == GBG_OK && pass < 2; pass++) {
        size_t used = 0;
        work->key[0] = (uint32_t *)gbg_cuda_take(base, &used, n, 4);
        work->key[1] = (uint32_t *)gbg_cuda_take(base, &used, n, 4);
        work->index[0] = (int32_t *)gbg_cuda_take(base, &used, n, 4);
        work->index[1] = (int32_t *)gbg_cuda_take(base, &used, n, 4);
        /* never NULL when it sorts, which would only ask for memory again */
        work->scratch = gbg_cuda_take(base, &used, (int64_t)work->scratch_bytes + 1, 1);
        status = pass ? status : gbg_cuda_workspace(device, used, &base);
    }
    return status;
}

/* array[k] = what stood at order[k]. */
template <typename Element>
static void move_array(struct gbg_device *device, int64_t n, const struct work *work,
                       Element *array, int *status)
{
    Element *spare = (Element *)work->key[0];
    if (!array || *status != GBG_OK) {
        return;
    }
    gather<<<gbg_cuda_blocks(n), GBG_CUDA_THREADS, 0, device->stream>>>(
        n, (const int32_t *)work->index[1], (const Element *)array, spare);
    *status = gbg_cuda_started(device, "moving particles in memory");
    if (*status == GBG_OK) {
        *status = gbg_cuda_status(device,
                                  cudaMemcpyAsync(array, spare, (size_t)n * sizeof *array,
                                                  cudaMemcpyDeviceToDevice, device->stream),
                                  "moving particles in memory");
    }
}

static int move_all(struct gbg_device *device, struct gbg_state *state, const struct work *work)
{
    int64_t n = state->owned;
    int status = GBG_OK;
    for (int a = 0; a < state->box.dimension; a++) {
        move_array(device, n, work, state->high[a], &status);
        move_array(device, n, work, state->low[a], &status);
        move_array(device, n, work, state->image[a], &status);
    }
    move_array(device, n, work, state->id, &status);
    move_array(device, n, work, state->rank, &status);
    move_array(device, n, work, state->species, &status);
    move_array(device, n, work, state->source, &status);
    move_array(device, n, work, state->overlapped, &status);
    return status;
}

/* Ranks, and ids if they were the indices until now: present from the first time on. */
static int reserve_names(struct gbg_device *device, struct gbg_state *state)
{
    int64_t n = state->owned;
    void *id = NULL, *rank = NULL;
    int status = GBG_OK;
    if (!state->id) {
        status = gbg_cuda_allocate(device, &id, n, sizeof *state->id, "ids");
    }
    if (status == GBG_OK && !state->rank) {
        status = gbg_cuda_allocate(device, &rank, n, sizeof *state->rank, "ranks of ids");
    }
    if (status == GBG_OK && (id || rank)) {
        name<<<gbg_cuda_blocks(n), GBG_CUDA_THREADS, 0, device->stream>>>(n, (uint64_t *)id,
                                                                          (int32_t *)rank);
        status = gbg_cuda_started(device, "ids and ranks");
    }
    if (status != GBG_OK) {
        gbg_cuda_release(device, id, n, sizeof *state->id);
        gbg_cuda_release(device, rank, n, sizeof *state->rank);
        return status;
    }
    state->id = id ? (uint64_t *)id : state->id;
    state->rank = rank ? (int32_t *)rank : state->rank;
    return GBG_OK;
}

int gbg_cuda_arrange(struct gbg_device *device, struct gbg_state *state, int by_place)
{
    struct work work;
    int64_t n = state->owned;
    if ((!by_place && !state->rank) || n == 0) {
        return GBG_OK; /* they have always stood in that order */
    }
    int status = take_work(device, n, &work);
    status = status ? status : reserve_names(device, state);
    if (status != GBG_OK) {
        return status;
    }
    if (by_place) {
        make_keys<<<gbg_cuda_blocks(n), GBG_CUDA_THREADS, 0, device->stream>>>(
            *state, gbg_order_halvings(&state->box), work.key[0], work.index[0]);
        status = gbg_cuda_started(device, "places of particles");
        status = status ? status
                        : gbg_cuda_status(device, sort_keys(device, n, &work),
                                          "sorting particles by place");
    } else {
        order_by_rank<<<gbg_cuda_blocks(n), GBG_CUDA_THREADS, 0, device->stream>>>(state->rank, n,
                                                                                   work.index[1]);
        status = gbg_cuda_started(device, "sorting particles by id");
    }
    status = status ? status : move_all(device, state, &work);
    state->epoch++;
    return status;
}

/* Two sieves for a slice: places that it names, and the lines they lie in. What is counted does not
 * depend on who comes first. */
static __global__ void look_far(const struct gbg_cuda_rows rows, unsigned long long *sums)
{
    enum { WORDS = GBG_SIEVE_PLACES / 32 };
    __shared__ uint32_t seen[2][WORDS];
    int64_t slice = (int64_t)blockIdx.x * GBG_SCATTER_STRIDE;
    const int32_t *index = rows.index + rows.offset[slice];
    int64_t entries = (int64_t)rows.width[slice] * GBG_CUDA_SLICE;
    for (int w = (int)threadIdx.x; w < 2 * WORDS; w += (int)blockDim.x) {
        seen[w / WORDS][w % WORDS] = 0;
    }
    __syncthreads();
    for (int64_t k = threadIdx.x; k < entries; k += blockDim.x) {
        uint32_t place = gbg_sieve_place((uint32_t)index[k]);
        uint32_t line = gbg_sieve_place((uint32_t)index[k] / GBG_SCATTER_LINE);
        atomicOr(&seen[0][place / 32], 1u << place % 32);
        atomicOr(&seen[1][line / 32], 1u << line % 32);
    }
    __syncthreads();
    for (int s = 0; s < 2; s++) {
        unsigned count = 0;
        for (int w = (int)threadIdx.x; w < WORDS; w += (int)blockDim.x) {
            count += (unsigned)__popc(seen[s][w]);
        }
        count = __reduce_add_sync(0xFFFFFFFFu, count);
        if (threadIdx.x % 32 == 0) {
            atomicAdd(&sums[s], (unsigned long long)count);
        }
    }
}

double gbg_cuda_list_scatter(const struct gbg_list *list)
{
    enum { NEAREST_CACHE = 4 << 20 };
    const struct gbg_cuda_rows *rows = &list->rows;
    struct gbg_device *device = list->device;
    unsigned long long sums[2] = {0, 0};
    void *work;
    if (list->builds == 0 || !rows->index || /* the last build found no memory */
        rows->n * rows->dimension * 4 <= NEAREST_CACHE) {
        return 0.0;
    }
    int status = gbg_cuda_workspace(device, sizeof sums, &work);
    status = status ? status : gbg_cuda_clear(device, work, sizeof sums);
    if (status == GBG_OK) {
        look_far<<<gbg_cuda_blocks(rows->slices, GBG_SCATTER_STRIDE), GBG_CUDA_THREADS, 0,
                   device->stream>>>(*rows, (unsigned long long *)work);
        status = gbg_cuda_started(device, "how far neighbours stand apart");
    }
    status = status ? status : gbg_cuda_fetch(device, sums, work, sizeof sums);
    /* an error stays with the device: the next call tells of it */
    return status == GBG_OK && sums[0] > 0 ? (double)sums[1] / (double)sums[0] : 0.0;
}
