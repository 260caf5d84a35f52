/* L1, CPU: neighbour search: which cells, and the particles sorted into them. */
#include <math.h>
#include <string.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/search.h"
#include "core/memory.h"

/* Edges are longer than asked for by this part, and by two units of a high word, so that no
 * rounding of a length can put a neighbour beyond the cells that are looked at. */
static const double EDGE_MARGIN = 1e-9;

enum { BUCKETS_MAX = 1024, BUCKET_LEAST = 512, ZOOM_MOST = 32 };

/* Cells of edge >= the edge asked for, but not many more keys than particles in all. */
static void choose_wide(struct gbg_search *search)
{
    int dimension = search->box.dimension;
    double wanted[3] = {1.0, 1.0, 1.0}, most = fmin(4.0 * (double)search->n + 1024.0, 0x1p30);
    double product = search->plan.method == GBG_SEARCH_OCTANT ? 1 << dimension : 1;
    for (int a = 0; a < dimension; a++) {
        double length = ldexp(search->box.length[a], -search->zoom[a]);
        double edge = search->plan.edge * (1.0 + EDGE_MARGIN) + length * 0x1p-31;
        wanted[a] = fmax(1.0, floor(length / edge));
        product *= wanted[a];
    }
    search->crowded = product > most;
    while (product > most) {
        int longest = 0;
        for (int a = 1; a < dimension; a++) {
            longest = wanted[a] > wanted[longest] ? a : longest;
        }
        product /= wanted[longest];
        wanted[longest] = ceil(wanted[longest] / 2.0);
        product *= wanted[longest];
    }
    for (int a = 0; a < 3; a++) {
        search->cells[a] = (int)wanted[a];
    }
}

/* Cells of edge <= the edge asked for, so that each holds one particle at most. */
static int choose_narrow(struct gbg_device *device, struct gbg_search *search)
{
    double product = 1.0, most = 64.0 * (double)search->n + 0x1p20;
    double wanted[3] = {1.0, 1.0, 1.0};
    for (int a = 0; a < search->box.dimension; a++) {
        wanted[a] = ceil(search->box.length[a] / search->plan.edge * (1.0 + EDGE_MARGIN));
        product *= wanted[a];
    }
    if (!(product <= most) || product > 0x1p30) {
        return gbg_fail(device->context, GBG_E_ARGUMENT,
                        "gbg_neighbours_update: the method occupancy would need %.3g cells for "
                        "%lld particles, allowed up to %.3g: take grid",
                        product, (long long)search->n, fmin(most, 0x1p30));
    }
    for (int a = 0; a < 3; a++) {
        search->cells[a] = (int)wanted[a];
    }
    return GBG_OK;
}

static void choose_reach(struct gbg_search *search, double reach)
{
    double farthest = search->plan.radius + 3.0 * search->plan.skin;
    for (int a = 0; a < search->box.dimension; a++) {
        double length = search->box.length[a], part = ldexp(length, -search->zoom[a]);
        double edge = part / search->cells[a];
        search->around[a] =
            search->plan.method == GBG_SEARCH_OCTANT
                ? 1
                : (int)fmin(search->cells[a], ceil(reach * (1.0 + 0.5 * EDGE_MARGIN) / edge));
        double period = length, apart = fmax(farthest, (search->around[a] + 1) * edge) * 1.001;
        apart = search->zoom[a] > 0 ? fmax(apart, part)
                                    : apart; /* the ends of the part are neighbours */
        int shift = 0;
        while (shift < 31 && period * 0.25 >= apart) {
            period *= 0.5;
            shift++;
        }
        search->shift[a] = shift;
    }
}

/* Where the rows of candidates of a cell inside the box begin, for each octant. */
static void tabulate_rows(struct gbg_search *search)
{
    int octants = 1 << search->sub, dimension = search->box.dimension;
    int wide[3] = {1, 1, 1};
    for (int a = 0; a < dimension; a++) {
        wide[a] = search->sub ? 2 : 2 * search->around[a] + 1;
    }
    search->rows = wide[1] * wide[2];
    search->row_keys = wide[0] << search->sub;
    for (int o = 0; o < octants && search->rows <= GBG_SEARCH_ROWS; o++) {
        int low[3] = {0, 0, 0};
        for (int a = 0; a < dimension; a++) {
            low[a] = !search->sub ? -search->around[a] : (o >> a & 1) - 1;
        }
        for (int k = 0; k < search->rows; k++) {
            int64_t y = low[1] + k % wide[1], z = low[2] + k / wide[1];
            int64_t cell = (z * search->cells[1] + y) * search->cells[0] + low[0];
            search->row_from[o][k] = cell * octants;
        }
    }
}

int gbg_search_choose_cells(struct gbg_device *device, struct gbg_search *search, double reach)
{
    int status = GBG_OK, method = search->plan.method;
    search->sub = method == GBG_SEARCH_OCTANT ? search->box.dimension : 0;
    if (method == GBG_SEARCH_BRUTE) {
        search->cells[0] = search->cells[1] = search->cells[2] = 1;
    } else if (method == GBG_SEARCH_OCCUPANCY) {
        status = choose_narrow(device, search);
    } else {
        choose_wide(search);
    }
    if (status != GBG_OK) {
        return status;
    }
    choose_reach(search, reach);
    tabulate_rows(search);
    search->n_keys = (int64_t)search->cells[0] * search->cells[1] * search->cells[2] << search->sub;
    if (search->n_keys + 1 > search->key_capacity) {
        gbg_release(search->first);
        search->key_capacity = 0;
        int64_t wanted = search->n_keys + 1 + search->n_keys / 8;
        status = gbg_cpu_scratch(device, (void **)&search->first, wanted, sizeof *search->first,
                                 "cells of the search");
        search->key_capacity = status == GBG_OK ? wanted : 0;
    }
    return status;
}

/* The part of each axis that the particles take, if it is less than half: a power of two. */
int gbg_search_zoom(struct gbg_search *search)
{
    int zoomed = 0, threads = gbg_search_threads(search, search->n);
    (void)threads;
    for (int a = 0; a < search->box.dimension && search->n > 0; a++) {
        const uint64_t *fraction = search->fraction[a];
        int64_t low = 0, high = 0;
#pragma omp parallel for num_threads(threads) schedule(static) reduction(min                       \
                                                                         : low) reduction(max      \
                                                                                          : high)
        for (int64_t i = 0; i < search->n; i++) {
            int64_t from_first = (int64_t)(fraction[i] - fraction[0]);
            low = from_first < low ? from_first : low;
            high = from_first > high ? from_first : high;
        }
        uint64_t spread = (uint64_t)high - (uint64_t)low;
        int zoom = 0;
        while (zoom < ZOOM_MOST && spread < UINT64_C(1) << (63 - zoom)) {
            zoom++;
        }
        search->origin[a] = zoom > 0 ? fraction[0] + (uint64_t)low : 0;
        search->zoom[a] = zoom;
        zoomed |= zoom > 0;
    }
    return zoomed;
}

struct span {
    int begin, end;
};

/* Cells c - around .. c + around of a periodic axis, each once, in ascending order. */
static int spans(const struct gbg_search *search, int a, int c, int octant, struct span out[2])
{
    int cells = search->cells[a], low = c - search->around[a], high = c + search->around[a];
    if (search->sub) { /* the half of the cell says which neighbour the ball can touch */
        int upper = octant >> a & 1;
        low = upper ? c : c - 1;
        high = upper ? c + 1 : c;
    }
    if (high - low + 1 >= cells) {
        out[0] = (struct span){0, cells};
        return 1;
    }
    if (low >= 0 && high < cells) {
        out[0] = (struct span){low, high + 1};
        return 1;
    }
    out[0] = (struct span){0, low < 0 ? high + 1 : high - cells + 1};
    out[1] = (struct span){low < 0 ? low + cells : low, cells};
    return 2;
}

int gbg_search_runs(const struct gbg_search *search, const int c[3], int octant,
                    struct gbg_search_run *runs)
{
    struct span span[3][2] = {{{0, 1}}, {{0, 1}}, {{0, 1}}};
    int count[3] = {1, 1, 1}, made = 0;
    for (int a = 0; a < search->box.dimension; a++) {
        count[a] = spans(search, a, c[a], octant, span[a]);
    }
    for (int k = 0; k < count[2]; k++) {
        for (int z = span[2][k].begin; z < span[2][k].end; z++) {
            for (int l = 0; l < count[1]; l++) {
                for (int y = span[1][l].begin; y < span[1][l].end; y++) {
                    int64_t row = ((int64_t)z * search->cells[1] + y) * search->cells[0];
                    for (int m = 0; m < count[0]; m++) {
                        struct gbg_search_run run = {
                            search->first[(row + span[0][m].begin) << search->sub],
                            search->first[(row + span[0][m].end) << search->sub]};
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
    int dimension = search->box.dimension, words = 2 + dimension;
    for (int64_t i = begin; i < end; i++) {
        int32_t key = search->key[i];
        uint32_t *record = search->record + words * cursor[key >> shift]++;
        record[0] = (uint32_t)key;
        record[1] = (uint32_t)i;
        for (int a = 0; a < dimension; a++) {
            record[2 + a] = gbg_search_local(search->fraction[a][i], search->shift[a]);
        }
    }
}

/* Sorts the records of a bucket, which are in the order of particles, by key. */
static void sort_bucket(struct gbg_search *search, int64_t first_key, int64_t end_key,
                        int64_t begin, int64_t end)
{
    int dimension = search->box.dimension, words = 2 + dimension;
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
    int64_t n = search->n, wanted = n / BUCKET_LEAST < 1 ? 1 : n / BUCKET_LEAST;
    int threads = gbg_search_threads(search, n), shift = 0;
    wanted = wanted > BUCKETS_MAX ? BUCKETS_MAX : wanted;
    while ((search->n_keys - 1) >> shift >= wanted) {
        shift++;
    }
    int64_t buckets = ((search->n_keys - 1) >> shift) + 1;
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
        sort_bucket(search, b << shift, end_key < search->n_keys ? end_key : search->n_keys,
                    start[b], start[b + 1]);
    }
    search->first[search->n_keys] = (int32_t)n;
    return GBG_OK;
}
