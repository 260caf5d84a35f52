/* L1, CPU: neighbour search: which cells, and the particles sorted into them. */
#include <math.h>
#include <string.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/search.h"
#include "core/memory.h"

enum { BUCKETS_MAX = 1024, BUCKET_LEAST = 512 };

/* Where the rows of candidates of a cell inside the box begin, for each octant. */
static void tabulate_rows(struct gbg_search *search)
{
    int octants = 1 << search->frame.sub, dimension = search->frame.box.dimension;
    int wide[3] = {1, 1, 1};
    for (int a = 0; a < dimension; a++) {
        wide[a] = search->frame.sub ? 2 : 2 * search->frame.around[a] + 1;
    }
    search->rows = wide[1] * wide[2];
    search->row_keys = wide[0] << search->frame.sub;
    for (int o = 0; o < octants && search->rows <= GBG_SEARCH_ROWS; o++) {
        int low[3] = {0, 0, 0};
        for (int a = 0; a < dimension; a++) {
            low[a] = !search->frame.sub ? -search->frame.around[a] : (o >> a & 1) - 1;
        }
        for (int k = 0; k < search->rows; k++) {
            int64_t y = low[1] + k % wide[1], z = low[2] + k / wide[1];
            int64_t cell = (z * search->frame.cells[1] + y) * search->frame.cells[0] + low[0];
            search->row_from[o][k] = cell * octants;
        }
    }
}

int gbg_search_choose_cells(struct gbg_device *device, struct gbg_search *search, double reach)
{
    int status = gbg_search_frame_choose(device->context, &search->frame, reach);
    if (status != GBG_OK) {
        return status;
    }
    tabulate_rows(search);
    if (search->frame.n_keys + 1 > search->key_capacity) {
        gbg_release(search->first);
        search->key_capacity = 0;
        int64_t wanted = search->frame.n_keys + 1 + search->frame.n_keys / 8;
        status = gbg_cpu_scratch(device, (void **)&search->first, wanted, sizeof *search->first,
                                 "cells of the search");
        search->key_capacity = status == GBG_OK ? wanted : 0;
    }
    return status;
}

/* The part of each axis that the particles take, if it is less than half: a power of two. */
int gbg_search_zoom(struct gbg_search *search)
{
    int zoomed = 0, threads = gbg_search_threads(search, search->frame.n);
    (void)threads;
    for (int a = 0; a < search->frame.box.dimension && search->frame.n > 0; a++) {
        const uint64_t *fraction = search->fraction[a];
        int64_t low = 0, high = 0;
#pragma omp parallel for num_threads(threads) schedule(static) reduction(min                       \
                                                                         : low) reduction(max      \
                                                                                          : high)
        for (int64_t i = 0; i < search->frame.n; i++) {
            int64_t from_first = (int64_t)(fraction[i] - fraction[0]);
            low = from_first < low ? from_first : low;
            high = from_first > high ? from_first : high;
        }
        zoomed |= gbg_search_frame_zoom(&search->frame, a, fraction[0], low, high);
    }
    return zoomed;
}

int gbg_search_runs(const struct gbg_search *search, const int c[3], int octant,
                    struct gbg_search_run *runs)
{
    struct gbg_search_span span[3][2] = {{{0, 1}}, {{0, 1}}, {{0, 1}}};
    int count[3] = {1, 1, 1}, made = 0;
    for (int a = 0; a < search->frame.box.dimension; a++) {
        count[a] = gbg_search_spans(&search->frame, a, c[a], octant, span[a]);
    }
    for (int k = 0; k < count[2]; k++) {
        for (int z = span[2][k].begin; z < span[2][k].end; z++) {
            for (int l = 0; l < count[1]; l++) {
                for (int y = span[1][l].begin; y < span[1][l].end; y++) {
                    int64_t row =
                        ((int64_t)z * search->frame.cells[1] + y) * search->frame.cells[0];
                    for (int m = 0; m < count[0]; m++) {
                        struct gbg_search_run run = {
                            search->first[(row + span[0][m].begin) << search->frame.sub],
                            search->first[(row + span[0][m].end) << search->frame.sub]};
                        runs[made] = run;
                        made += run.end > run.begin;
                    }
                }
            }
        }
    }
    return made;
}

int gbg_search_threads(const struct gbg_search *search, int64_t n)
{
    int64_t worth = 1 + n / 2048;
    return worth < search->threads ? (int)worth : search->threads;
}

/* A record is a key, a particle and its local coordinates. */
static void fill_records(const struct gbg_search *search, int64_t begin, int64_t end, int shift,
                         int64_t *cursor)
{
    int dimension = search->frame.box.dimension, words = 2 + dimension;
    for (int64_t i = begin; i < end; i++) {
        int32_t key = search->key[i];
        uint32_t *record = search->record + words * cursor[key >> shift]++;
        record[0] = (uint32_t)key;
        record[1] = (uint32_t)i;
        for (int a = 0; a < dimension; a++) {
            record[2 + a] = gbg_search_local(search->fraction[a][i], search->frame.shift[a]);
        }
    }
}

/* Sorts the records of a bucket, which are in the order of particles, by key. */
static void sort_bucket(struct gbg_search *search, int64_t first_key, int64_t end_key,
                        int64_t begin, int64_t end)
{
    int dimension = search->frame.box.dimension, words = 2 + dimension;
    int32_t *first = search->first;
    memset(first + first_key, 0, (size_t)(end_key - first_key) * sizeof *first);
    for (int64_t s = begin; s < end; s++) {
        first[search->record[words * s]]++;
    }
    int32_t at = (int32_t)end; /* ends of the keys, counted down by the filling from behind */
    for (int64_t key = end_key - 1; key >= first_key; key--) {
        int32_t count = first[key];
        first[key] = at;
        at -= count;
    }
    for (int64_t s = end - 1; s >= begin; s--) {
        const uint32_t *record = search->record + words * s;
        int32_t slot = --first[record[0]];
        search->particle[slot] = (int32_t)record[1];
        for (int a = 0; a < dimension; a++) {
            search->local[a][slot] = record[2 + a];
        }
    }
}

static int reserve_histogram(struct gbg_device *device, struct gbg_search *search, int64_t wanted)
{
    if (wanted <= search->histogram_capacity) {
        return GBG_OK;
    }
    gbg_release(search->histogram);
    search->histogram_capacity = 0;
    int status = gbg_cpu_scratch(device, (void **)&search->histogram, wanted,
                                 sizeof *search->histogram, "buckets of the search");
    search->histogram_capacity = status == GBG_OK ? wanted : 0;
    return status;
}

/* Two passes: into buckets of neighbouring keys, by threads with ranges of particles, which keeps
 * the order of particles; then each bucket alone, in the cache. */
int gbg_search_sort(struct gbg_device *device, struct gbg_search *search)
{
    int64_t n = search->frame.n, wanted = n / BUCKET_LEAST < 1 ? 1 : n / BUCKET_LEAST;
    int threads = gbg_search_threads(search, n), shift = 0;
    wanted = wanted > BUCKETS_MAX ? BUCKETS_MAX : wanted;
    while ((search->frame.n_keys - 1) >> shift >= wanted) {
        shift++;
    }
    int64_t buckets = ((search->frame.n_keys - 1) >> shift) + 1;
    int status = reserve_histogram(device, search, (threads + 1) * (buckets + 1));
    if (status != GBG_OK) {
        return status;
    }
    int64_t *histogram = search->histogram, *start = histogram + threads * buckets;
    memset(histogram, 0, (size_t)(threads * buckets) * sizeof *histogram);
#pragma omp parallel for num_threads(threads) schedule(static, 1)
    for (int t = 0; t < threads; t++) {
        for (int64_t i = n * t / threads; i < n * (t + 1) / threads; i++) {
            histogram[t * buckets + (search->key[i] >> shift)]++;
        }
    }
    int64_t at = 0;
    for (int64_t b = 0; b < buckets; b++) {
        start[b] = at;
        for (int t = 0; t < threads; t++) {
            int64_t count = histogram[t * buckets + b];
            histogram[t * buckets + b] = at;
            at += count;
        }
    }
    start[buckets] = at;
#pragma omp parallel for num_threads(threads) schedule(static, 1)
    for (int t = 0; t < threads; t++) {
        fill_records(search, n * t / threads, n * (t + 1) / threads, shift,
                     histogram + t * buckets);
    }
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
    for (int64_t b = 0; b < buckets; b++) {
        int64_t end_key = (b + 1) << shift;
        sort_bucket(search, b << shift,
                    end_key < search->frame.n_keys ? end_key : search->frame.n_keys, start[b],
                    start[b + 1]);
    }
    search->first[search->frame.n_keys] = (int32_t)n;
    return GBG_OK;
}
