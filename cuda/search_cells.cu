/* L1, CUDA: neighbour search: fractions of a caller's coordinates, cells, particles sorted into
 * them. */
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "cuda/search.h"

enum { STEP_MOST = 8 }; /* elements between coordinates that are copied with what is between them */

/* The caller's coordinates on the device. */
struct brought {
    const double *base[3];
    ptrdiff_t step;
};

static int copy_up(struct gbg_device *device, double *to, const double *from, int64_t n)
{
    return gbg_cuda_status(
        device,
        cudaMemcpyAsync(to, from, (size_t)n * sizeof *to, cudaMemcpyHostToDevice, device->stream),
        "copying coordinates");
}

/* Where the lowest element of an axis stands. */
static const double *lowest(const struct gbg_points *points, int a)
{
    return points->base[a] + (points->step < 0 ? (points->n - 1) * points->step : 0);
}

/* Do all axes stand within one step, as in x y z x y z? Then `*from` is the lowest element. */
static int interleaved(const struct gbg_points *points, int dimension, const double **from)
{
    int64_t step = points->step < 0 ? -points->step : points->step;
    uintptr_t low = UINTPTR_MAX, high = 0;
    for (int a = 0; a < dimension; a++) {
        uintptr_t at = (uintptr_t)points->base[a];
        *from = at < low ? lowest(points, a) : *from;
        low = at < low ? at : low;
        high = at > high ? at : high;
    }
    uintptr_t apart = high - low;
    return points->n > 1 && step <= STEP_MOST && apart < (uintptr_t)step * sizeof(double) &&
           apart % sizeof(double) == 0;
}

/* An array for each axis, one after the other. */
static int bring_arrays(struct gbg_device *device, const struct gbg_points *points, int dimension,
                        struct brought *brought)
{
    void *raw;
    int64_t n = points->n;
    int status = gbg_cuda_workspace(device, (size_t)(n * dimension) * sizeof(double), &raw);
    brought->step = points->step < 0 ? -1 : 1;
    for (int a = 0; a < dimension && status == GBG_OK; a++) {
        double *to = (double *)raw + a * n;
        status = copy_up(device, to, lowest(points, a), n);
        brought->base[a] = to + (points->step < 0 ? n - 1 : 0);
    }
    return status;
}

/* One piece of memory with all coordinates. */
static int bring_together(struct gbg_device *device, const struct gbg_points *points, int dimension,
                          const double *from, struct brought *brought)
{
    void *raw;
    int64_t last = 0, step = points->step < 0 ? -points->step : points->step;
    for (int a = 0; a < dimension; a++) {
        int64_t at = lowest(points, a) - from;
        last = at > last ? at : last;
    }
    int64_t count = last + (points->n - 1) * step + 1;
    int status = gbg_cuda_workspace(device, (size_t)count * sizeof(double), &raw);
    for (int a = 0; a < dimension; a++) {
        brought->base[a] = (const double *)raw + (points->base[a] - from);
    }
    brought->step = points->step;
    return status ? status : copy_up(device, (double *)raw, from, count);
}

/* Any other step: the coordinates are put together on the host. */
static int bring_gathered(struct gbg_device *device, struct gbg_search *search,
                          const struct gbg_points *points, int dimension, struct brought *brought)
{
    int64_t n = points->n;
    struct gbg_points close = {n, {NULL, NULL, NULL}, 1};
    if (n * dimension > search->gathered_capacity) {
        void *room;
        gbg_release(search->gathered);
        search->gathered = NULL;
        search->gathered_capacity = 0;
        int status =
            gbg_allocate(device->context, &room, n * dimension, sizeof(double), "coordinates");
        if (status != GBG_OK) {
            return status;
        }
        search->gathered = (double *)room;
        search->gathered_capacity = n * dimension;
    }
    for (int a = 0; a < dimension; a++) {
        double *to = search->gathered + a * n;
        for (int64_t i = 0; i < n; i++) {
            to[i] = gbg_point(points, a, i);
        }
        close.base[a] = to;
    }
    return bring_arrays(device, &close, dimension, brought);
}

static __global__ void encode(const __grid_constant__ struct gbg_search search,
                              const __grid_constant__ struct brought brought)
{
    int64_t i = gbg_cuda_index();
    for (int a = 0; a < search.frame.box.dimension && i < search.frame.n; a++) {
        search.fraction[a][i] =
            gbg_box_encode(&search.frame.box, a, brought.base[a][i * brought.step], NULL);
    }
}

int gbg_cuda_search_encode(struct gbg_device *device, struct gbg_search *search,
                           const struct gbg_points *points)
{
    int dimension = search->frame.box.dimension, status;
    const double *from = NULL;
    struct brought brought = {};
    if (points->n == 0) {
        return GBG_OK;
    }
    if (points->n == 1 || points->step == 1 || points->step == -1) {
        status = bring_arrays(device, points, dimension, &brought);
    } else if (interleaved(points, dimension, &from)) {
        status = bring_together(device, points, dimension, from, &brought);
    } else {
        status = bring_gathered(device, search, points, dimension, &brought);
    }
    if (status == GBG_OK) {
        encode<<<gbg_cuda_blocks(points->n), GBG_CUDA_THREADS, 0, device->stream>>>(*search,
                                                                                    brought);
        status = gbg_cuda_started(device, "fractions");
    }
    return status;
}

/* The least and the largest difference of a fraction to that of particle 0. */
static __global__ void find_extent(const __grid_constant__ struct gbg_search search)
{
    int64_t i = gbg_cuda_index();
    for (int a = 0; a < search.frame.box.dimension; a++) {
        const uint64_t *fraction = search.fraction[a];
        long long low = 0, high = 0;
        if (i < search.frame.n) {
            low = high = (long long)(fraction[i] - fraction[0]);
        }
        for (int lane = 16; lane > 0; lane /= 2) {
            long long other = __shfl_xor_sync(0xFFFFFFFFu, low, lane);
            low = other < low ? other : low;
            other = __shfl_xor_sync(0xFFFFFFFFu, high, lane);
            high = other > high ? other : high;
        }
        if ((threadIdx.x & 31) == 0 && low < 0) {
            atomicMin(&search.totals->low[a], low);
        }
        if ((threadIdx.x & 31) == 0 && high > 0) {
            atomicMax(&search.totals->high[a], high);
        }
        if (i == 0) {
            search.totals->first[a] = fraction[0];
        }
    }
}

static int zoom(struct gbg_device *device, struct gbg_search *search, int *zoomed)
{
    struct gbg_cuda_totals totals;
    *zoomed = 0;
    if (search->frame.n == 0) {
        return GBG_OK;
    }
    int status = gbg_cuda_clear(device, search->totals, sizeof totals);
    if (status == GBG_OK) {
        find_extent<<<gbg_cuda_blocks(search->frame.n), GBG_CUDA_THREADS, 0, device->stream>>>(
            *search);
        status = gbg_cuda_started(device, "extent of the particles");
    }
    status = status ? status : gbg_cuda_fetch(device, &totals, search->totals, sizeof totals);
    for (int a = 0; a < search->frame.box.dimension && status == GBG_OK; a++) {
        *zoomed |= gbg_search_frame_zoom(&search->frame, a, totals.first[a], totals.low[a],
                                         totals.high[a]);
    }
    return status;
}

static __global__ void find_keys(const __grid_constant__ struct gbg_search search)
{
    int64_t i = gbg_cuda_index();
    if (i < search.frame.n) {
        search.key[i] = (uint32_t)gbg_search_key(&search.frame, search.fraction, i,
                                                 search.frame.box.dimension, search.frame.sub);
        search.slot[i] = (int32_t)i; /* what the sort moves along */
    }
}

int gbg_cuda_search_place(struct gbg_device *device, struct gbg_search *search, double reach)
{
    int zoomed = 0;
    gbg_search_frame_start(&search->frame);
    int status = gbg_search_frame_choose(device->context, &search->frame, reach);
    if (status == GBG_OK && search->frame.crowded) {
        status = zoom(device, search, &zoomed);
    }
    if (status == GBG_OK && zoomed) {
        status = gbg_search_frame_choose(device->context, &search->frame, reach);
    }
    if (status != GBG_OK || search->frame.plan.method == GBG_SEARCH_BRUTE) {
        return status;
    }
    int64_t keys = search->frame.n_keys + 1;
    if (keys > search->key_capacity) {
        status = gbg_cuda_grow(device, (void **)&search->first, &search->key_capacity,
                               keys + keys / 8, sizeof *search->first, "cells of the search");
    }
    if (status == GBG_OK && search->frame.n > 0) {
        find_keys<<<gbg_cuda_blocks(search->frame.n), GBG_CUDA_THREADS, 0, device->stream>>>(
            *search);
        status = gbg_cuda_started(device, "keys");
    }
    return status;
}

static __device__ uint4 locate(const struct gbg_search &search, int32_t particle)
{
    uint32_t word[3] = {0, 0, 0};
    for (int a = 0; a < search.frame.box.dimension; a++) {
        word[a] = gbg_search_local(search.fraction[a][particle], search.frame.shift[a]);
    }
    return make_uint4(word[0], word[1], word[2], (uint32_t)particle);
}

/* Local coordinates; marks 1: `first`, all zero before, becomes the number of particles of a key,
 * the end of its slots less their beginning. */
static __global__ void arrange(const __grid_constant__ struct gbg_search search, int marks)
{
    int64_t s = gbg_cuda_index(), n = search.frame.n;
    if (s >= n) {
        return;
    }
    search.place[s] = locate(search, search.particle[s]);
    if (marks) {
        uint32_t key = search.key_sorted[s];
        if (s == 0 || search.key_sorted[s - 1] != key) {
            atomicAdd(&search.first[key], -(int32_t)s);
        }
        if (s == n - 1 || search.key_sorted[s + 1] != key) {
            atomicAdd(&search.first[key], (int32_t)(s + 1));
        }
    }
}

static int start_arrange(struct gbg_device *device, const struct gbg_search *search, int marks)
{
    if (search->frame.n == 0) {
        return GBG_OK;
    }
    arrange<<<gbg_cuda_blocks(search->frame.n), GBG_CUDA_THREADS, 0, device->stream>>>(*search,
                                                                                       marks);
    return gbg_cuda_started(device, "local coordinates");
}

int gbg_cuda_search_locate(struct gbg_device *device, struct gbg_search *search)
{
    return start_arrange(device, search, 0);
}

static int sort_keys(struct gbg_device *device, struct gbg_search *search)
{
    void *scratch = NULL;
    size_t bytes = 0;
    int bits = 1, n = (int)search->frame.n;
    while (bits < 32 && (search->frame.n_keys - 1) >> bits > 0) {
        bits++;
    }
    int status = gbg_cuda_status(
        device,
        cub::DeviceRadixSort::SortPairs(NULL, bytes, search->key, search->key_sorted, search->slot,
                                        search->particle, n, 0, bits, device->stream),
        "sorting into cells");
    status = status ? status : gbg_cuda_workspace(device, bytes, &scratch);
    return status ? status
                  : gbg_cuda_status(device,
                                    cub::DeviceRadixSort::SortPairs(
                                        scratch, bytes, search->key, search->key_sorted,
                                        search->slot, search->particle, n, 0, bits, device->stream),
                                    "sorting into cells");
}

template <typename Number>
static int sum_in_place(struct gbg_device *device, Number *values, int64_t n)
{
    void *scratch = NULL;
    size_t bytes = 0;
    int status = gbg_cuda_status(
        device, cub::DeviceScan::ExclusiveSum(NULL, bytes, values, values, n, device->stream),
        "sums");
    status = status ? status : gbg_cuda_workspace(device, bytes, &scratch);
    return status ? status
                  : gbg_cuda_status(device,
                                    cub::DeviceScan::ExclusiveSum(scratch, bytes, values, values, n,
                                                                  device->stream),
                                    "sums");
}

int gbg_cuda_search_sum(struct gbg_device *device, int64_t *values, int64_t n)
{
    return sum_in_place(device, values, n);
}

int gbg_cuda_search_sort(struct gbg_device *device, struct gbg_search *search)
{
    int64_t keys = search->frame.n_keys + 1;
    if (search->frame.n == 0) {
        return GBG_OK; /* nobody will ask for slots */
    }
    int status = gbg_cuda_clear(device, search->first, (size_t)keys * sizeof *search->first);
    status = status ? status : sort_keys(device, search);
    status = status ? status : start_arrange(device, search, 1);
    return status ? status : sum_in_place(device, search->first, keys);
}

/* The particle of lowest index in each cell. As unsigned numbers -1 is above all of them. */
static __global__ void occupy(const __grid_constant__ struct gbg_search search)
{
    int64_t i = gbg_cuda_index();
    if (i < search.frame.n) {
        search.place[i] = locate(search, (int32_t)i);
        atomicMin((uint32_t *)&search.first[search.key[i]], (uint32_t)i);
    }
}

static __global__ void find_crowded(const __grid_constant__ struct gbg_search search)
{
    int64_t i = gbg_cuda_index();
    if (i < search.frame.n && search.first[search.key[i]] != (int32_t)i) {
        atomicMax(&search.totals->crowded, ~(unsigned long long)i);
    }
}

int gbg_cuda_search_occupy(struct gbg_device *device, struct gbg_search *search)
{
    int64_t n = search->frame.n;
    if (n == 0) {
        return GBG_OK;
    }
    int status = gbg_cuda_status(
        device,
        cudaMemsetAsync(search->first, 0xFF, (size_t)search->frame.n_keys * sizeof *search->first,
                        device->stream),
        "clearing cells");
    if (status == GBG_OK) {
        occupy<<<gbg_cuda_blocks(n), GBG_CUDA_THREADS, 0, device->stream>>>(*search);
        find_crowded<<<gbg_cuda_blocks(n), GBG_CUDA_THREADS, 0, device->stream>>>(*search);
        status = gbg_cuda_started(device, "particles of cells");
    }
    return status;
}
