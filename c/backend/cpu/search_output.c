/* L1, CPU: the result of a neighbour search as rows, as pairs and block by block. */
#include <string.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/search.h"
#include "core/memory.h"

/* Sums before each of `threads` ranges of particles: of whole rows, or of their entries above the
 * particle. start[threads + 1]. */
static int64_t larger_ones(const struct gbg_search *search, int64_t i)
{
    const int32_t *row = gbg_search_row(search, i);
    int64_t count = search->out[i].count, low = 0, high = count;
    while (low < high) {
        int64_t middle = (low + high) / 2;
        if (row[middle] < i) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return count - low;
}

static int sum_ranges(struct gbg_device *device, const struct gbg_search *search, int threads,
                      int upper, int64_t **start)
{
    int64_t n = search->frame.n, *sum;
    int status = gbg_cpu_scratch(device, (void **)start, threads + 1, sizeof **start, "row sums");
    if (status != GBG_OK) {
        return status;
    }
    sum = *start;
    sum[0] = 0;
#pragma omp parallel for num_threads(threads) schedule(static, 1)
    for (int t = 0; t < threads; t++) {
        int64_t total = 0;
        for (int64_t i = n * t / threads; i < n * (t + 1) / threads; i++) {
            total += upper ? larger_ones(search, i) : search->out[i].count;
        }
        sum[t + 1] = total;
    }
    for (int t = 0; t < threads; t++) {
        sum[t + 1] += sum[t];
    }
    return GBG_OK;
}

int gbg_search_csr(struct gbg_device *device, struct gbg_search *search, int base, int64_t *offset,
                   int32_t *neighbour)
{
    int threads = gbg_search_threads(search, search->frame.n);
    int64_t n = search->frame.n, *start;
    int status = sum_ranges(device, search, threads, 0, &start);
    if (status != GBG_OK) {
        return status;
    }
#pragma omp parallel for num_threads(threads) schedule(static, 1)
    for (int t = 0; t < threads; t++) {
        device->variant->search->hand_out(search, n * t / threads, n * (t + 1) / threads, start[t],
                                          base, offset, neighbour);
    }
    offset[n] = start[threads] + base;
    gbg_release(start);
    return GBG_OK;
}

int gbg_search_pairs(struct gbg_device *device, struct gbg_search *search, int base, int32_t *first,
                     int32_t *second)
{
    int threads = gbg_search_threads(search, search->frame.n);
    int64_t n = search->frame.n, *start;
    int status = sum_ranges(device, search, threads, 1, &start);
    if (status != GBG_OK) {
        return status;
    }
#pragma omp parallel for num_threads(threads) schedule(static, 1)
    for (int t = 0; t < threads; t++) {
        int64_t at = start[t];
        for (int64_t i = n * t / threads; i < n * (t + 1) / threads; i++) {
            const int32_t *row = gbg_search_row(search, i);
            int64_t count = search->out[i].count;
            for (int64_t k = count - larger_ones(search, i); k < count; k++) {
                first[at] = (int32_t)i + base;
                second[at++] = row[k] + base;
            }
        }
    }
    gbg_release(start);
    return GBG_OK;
}

int gbg_search_block(struct gbg_device *device, struct gbg_search *search,
                     struct gbg_search_block *block)
{
    int dimension = search->frame.box.dimension;
    (void)device;
    block->count = 0;
    for (; block->particle < search->frame.n; block->particle++, block->entry = 0) {
        int64_t i = block->particle, count = search->out[i].count;
        const int32_t *row = gbg_search_row(search, i);
        for (; block->entry < count; block->entry++) {
            int64_t j = row[block->entry];
            if (j < i) {
                continue;
            }
            if (block->count == block->capacity) {
                return GBG_OK;
            }
            block->first[block->count] = (int32_t)i;
            block->second[block->count] = (int32_t)j;
            for (int a = 0; a < dimension; a++) {
                block->separation[block->count * dimension + a] = gbg_box_difference(
                    &search->frame.box, a, search->fraction[a][i], search->fraction[a][j]);
            }
            block->count++;
        }
    }
    return GBG_OK;
}
