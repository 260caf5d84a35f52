/* L1, CPU: building pair lists from cells: rows of neighbours in ascending order of ranks. */
#include <string.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/list.h"
#include "backend/cpu/list_lengths.h"
#include "core/memory.h"

/* Longer rows are sorted digit by digit and not by counting. */
enum { LONG_ROW = 256, DIGITS = 256, ROOM = 16 /* a vector may be written at the end */ };

/* What building a chunk's rows reads. */
struct build {
    struct gbg_device *device;
    const struct gbg_state *state;
    struct gbg_list *list;
    struct gbg_near near;
    int coarse; /* 1: high words are too coarse for the radius, and rows are sifted afterwards */
};

static void prepare_search(struct build *build)
{
    const struct gbg_box *box = &build->state->box;
    struct gbg_near *near = &build->near;
    *near = (struct gbg_near){.grid = &build->list->grid, .dimension = box->dimension};
    build->coarse = gbg_list_choose_search(box, build->list->radius, near->unit, &near->limit);
    for (int a = 0; a < box->dimension; a++) {
        near->high[a] = build->state->high[a];
    }
}

/* Room for `more` elements in a buffer that holds `used`, of which nothing is kept if used is 0. */
static int grow(struct gbg_context *context, int32_t **buffer, int64_t *capacity, int64_t used,
                int64_t more, const char *what)
{
    if (used + more <= *capacity) {
        return GBG_OK;
    }
    int64_t larger = used + more + *capacity / 2 + 256;
    void *made;
    int status = gbg_allocate(context, &made, larger, sizeof **buffer, what);
    if (status == GBG_OK) {
        if (used > 0) {
            memcpy(made, *buffer, (size_t)used * sizeof **buffer);
        }
        gbg_release(*buffer);
        *buffer = made;
        *capacity = larger;
    }
    return status;
}

/* Leaves out neighbours beyond the radius by all 64 bits. */
static int64_t sift(const struct build *build, int64_t i, int32_t *found, int64_t count)
{
    double limit = build->list->radius * build->list->radius;
    int64_t kept = 0;
    for (int64_t k = 0; k < count; k++) {
        if (gbg_list_holds(build->state, i, found[k], limit)) {
            found[kept++] = found[k];
        }
    }
    return kept;
}

/* The runs of slots around the cell that was asked for last. */
struct around {
    int32_t cell;
    int n_runs;
    struct gbg_run runs[GBG_RUNS_MAX];
    int64_t candidates;
};

static void look_around(const struct gbg_grid *grid, int32_t cell, struct around *around)
{
    if (cell == around->cell) {
        return;
    }
    around->cell = cell;
    around->n_runs = gbg_grid_runs(grid, cell, around->runs);
    around->candidates = 0;
    for (int r = 0; r < around->n_runs; r++) {
        around->candidates += around->runs[r].end - around->runs[r].begin;
    }
}

static int find_row(const struct build *build, struct around *around, int64_t i,
                    struct gbg_row *row)
{
    const struct gbg_grid *grid = &build->list->grid;
    look_around(grid, grid->cell_of[i], around);
    int status = grow(build->device->context, &row->index, &row->capacity, 0,
                      around->candidates + ROOM, "pair list row");
    if (status != GBG_OK) {
        return status;
    }
    row->count =
        build->device->variant->find(&build->near, i, around->runs, around->n_runs, row->index);
    if (build->coarse) {
        row->count = sift(build, i, row->index, row->count);
    }
    return GBG_OK;
}

/* Sorts index by key, digit by digit, and lays it out; both are overwritten, and the two spare
 * buffers. */
static void lay_long_row(int32_t *index, int32_t *key, int32_t *spare, int64_t count, int32_t *row)
{
    int32_t *from[2] = {key, index}, *to[2] = {spare, spare + count};
    for (int shift = 0; shift < 32; shift += 8) {
        int64_t start[DIGITS] = {0}, sum = 0;
        for (int64_t k = 0; k < count; k++) {
            start[(uint32_t)from[0][k] >> shift & (DIGITS - 1)]++;
        }
        for (int d = 0; d < DIGITS; d++) {
            int64_t here = start[d];
            start[d] = sum;
            sum += here;
        }
        for (int64_t k = 0; k < count; k++) {
            int64_t place = start[(uint32_t)from[0][k] >> shift & (DIGITS - 1)]++;
            to[0][place] = from[0][k];
            to[1][place] = from[1][k];
        }
        for (int b = 0; b < 2; b++) {
            int32_t *swapped = from[b];
            from[b] = to[b];
            to[b] = swapped;
        }
    }
    for (int64_t k = 0; k < count; k++) {
        row[k * GBG_SLICE] = from[1][k];
    }
}

/* A row in ascending order of ranks, into every GBG_SLICE-th element of `slots`. */
static int lay_row(const struct build *build, struct gbg_chunk *chunk, const struct gbg_row *row,
                   int32_t *slots)
{
    int64_t count = row->count;
    int status = grow(build->device->context, &chunk->key, &chunk->key_capacity, 0,
                      (count > LONG_ROW ? 3 * count : count) + ROOM, "pair list keys");
    if (status != GBG_OK) {
        return status;
    }
    for (int64_t k = 0; k < count; k++) {
        chunk->key[k] = gbg_rank_of(build->state, row->index[k]);
    }
    if (count > LONG_ROW) {
        lay_long_row(row->index, chunk->key, chunk->key + count, count, slots);
    } else {
        build->device->variant->lay_row(row->index, chunk->key, count, slots);
    }
    return GBG_OK;
}

/* Rows of one slice: found one after the other, then laid out slot by slot. A short row is filled
 * up with its own particle, which every pair kernel skips because its distance is zero. */
static int build_slice(const struct build *build, struct around *around, struct gbg_chunk *chunk,
                       int64_t slice)
{
    struct gbg_list *list = build->list;
    struct gbg_row *rows = chunk->row;
    int64_t first = slice * GBG_SLICE, width = 0;
    int lanes = list->n - first < GBG_SLICE ? (int)(list->n - first) : GBG_SLICE;
    int status = GBG_OK;
    for (int l = 0; status == GBG_OK && l < lanes; l++) {
        status = find_row(build, around, first + l, &rows[l]);
        width = status == GBG_OK && rows[l].count > width ? rows[l].count : width;
    }
    if (status == GBG_OK) {
        status = grow(build->device->context, &chunk->index, &chunk->capacity, chunk->used,
                      width * GBG_SLICE, "pair list");
    }
    for (int l = 0; status == GBG_OK && l < GBG_SLICE; l++) {
        int32_t *slots = chunk->index + chunk->used + l;
        int64_t filled = l < lanes ? rows[l].count : 0;
        if (l < lanes) {
            status = lay_row(build, chunk, &rows[l], slots);
        }
        for (int64_t k = filled; k < width; k++) {
            slots[k * GBG_SLICE] = (int32_t)(l < lanes ? first + l : list->n - 1);
        }
    }
    if (status == GBG_OK) {
        list->offset[slice] = chunk->used;
        list->width[slice] = (int32_t)width;
        chunk->used += width * GBG_SLICE;
    }
    return status;
}

static void build_chunk(const struct build *build, struct gbg_chunk *chunk)
{
    struct around around = {.cell = -1};
    chunk->used = 0;
    chunk->status = GBG_OK;
    for (int64_t s = chunk->first_slice; s < chunk->end_slice && chunk->status == GBG_OK; s++) {
        chunk->status = build_slice(build, &around, chunk, s);
    }
    if (chunk->status == GBG_OK && build->list->builds == 0) { /* grows without asking again */
        chunk->status = grow(build->device->context, &chunk->index, &chunk->capacity, chunk->used,
                             chunk->used / 2 + 4096, "pair list");
    }
}

/* The coordinates at which the list was built. */
static void remember(const struct gbg_state *state, struct gbg_list *list,
                     const struct gbg_chunk *chunk)
{
    int64_t first = chunk->first_slice * GBG_SLICE, end = chunk->end_slice * GBG_SLICE;
    end = end < list->n ? end : list->n;
    for (int a = 0; a < list->dimension && end > first; a++) {
        size_t bytes = (size_t)(end - first) * sizeof *list->built[a];
        memcpy(list->built[a] + first, list->local[a] + first, bytes);
        memcpy(list->built_high[a] + first, state->high[a] + first, bytes);
    }
}

int gbg_list_build(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list)
{
    struct build build = {.device = device, .state = state, .list = list};
    list->epoch = state->epoch - 1; /* a build that fails is done again */
    int status = gbg_grid_build(device->context, &list->grid, &state->box, list->radius,
                                state->owned + state->ghost, state->high);
    if (status != GBG_OK) {
        return status;
    }
    prepare_search(&build);
    gbg_list_follow(device, state, list);
#pragma omp parallel for num_threads(device->threads) schedule(static, 1)
    for (int c = 0; c < list->n_chunks; c++) {
        build_chunk(&build, &list->chunk[c]);
        remember(state, list, &list->chunk[c]);
    }
    for (int c = 0; c < list->n_chunks; c++) {
        status = list->chunk[c].status != GBG_OK ? list->chunk[c].status : status;
    }
    list->builds++;
    if (status == GBG_OK) {
        list->epoch = state->epoch;
    }
    return status;
}
