/* L1, CPU: pair lists, built from a cell grid and kept while nobody moved too far. */
#include "backend/cpu/list.h"

#include <string.h>

#include "backend/cpu/cpu.h"
#include "core/memory.h"

static void choose_shift(struct gbg_list *list, const struct gbg_box *box)
{
    for (int a = 0; a < list->dimension; a++) {
        double period = box->length[a];
        int shift = 0;
        while (shift < 31 && period * 0.5 >= 8.0 * list->reach) {
            period *= 0.5;
            shift++;
        }
        list->shift[a] = shift;
        list->unit[a] = period * 0x1p-32;
        list->scale[a] = (float)list->unit[a];
    }
}

static int allocate_arrays(struct gbg_context *context, struct gbg_list *list, int64_t total)
{
    int status = gbg_allocate_zero(context, (void **)&list->chunk, list->n_chunks,
                                   sizeof *list->chunk, "pair list");
    for (int a = 0; status == GBG_OK && a < list->dimension; a++) {
        status = gbg_allocate_zero(context, (void **)&list->local[a], total, sizeof *list->local[a],
                                   "local coordinates");
        if (status == GBG_OK) {
            status = gbg_allocate_zero(context, (void **)&list->built[a], list->n,
                                       sizeof *list->built[a], "coordinates of the list");
        }
        if (status == GBG_OK) {
            status = gbg_allocate_zero(context, (void **)&list->built_high[a], list->n,
                                       sizeof *list->built_high[a], "coordinates of the list");
        }
    }
    if (status == GBG_OK) {
        status = gbg_allocate(context, (void **)&list->offset, list->slices, sizeof *list->offset,
                              "pair list offsets");
    }
    if (status == GBG_OK) {
        status = gbg_allocate(context, (void **)&list->width, list->slices, sizeof *list->width,
                              "pair list widths");
    }
    return status;
}

int gbg_list_create(struct gbg_device *device, const struct gbg_state *state, double reach,
                    double radius, struct gbg_list **list)
{
    struct gbg_list *made;
    int status = gbg_allocate_zero(device->context, (void **)&made, 1, sizeof *made, "pair list");
    if (status != GBG_OK) {
        return status;
    }
    made->dimension = state->box.dimension;
    made->reach = reach;
    made->radius = radius;
    made->n = state->owned;
    made->slices = (state->owned + GBG_SLICE - 1) / GBG_SLICE;
    made->n_chunks = device->threads;
    choose_shift(made, &state->box);
    status = allocate_arrays(device->context, made, state->owned + state->ghost);
    if (status != GBG_OK) {
        gbg_list_destroy(device, made);
        return status;
    }
    for (int c = 0; c < made->n_chunks; c++) {
        made->chunk[c].first_slice = made->slices * c / made->n_chunks;
        made->chunk[c].end_slice = made->slices * (c + 1) / made->n_chunks;
    }
    *list = made;
    return GBG_OK;
}

void gbg_list_destroy(struct gbg_device *device, struct gbg_list *list)
{
    (void)device;
    if (!list) {
        return;
    }
    for (int c = 0; list->chunk && c < list->n_chunks; c++) {
        struct gbg_chunk *chunk = &list->chunk[c];
        gbg_release(chunk->index);
        for (int l = 0; l < GBG_SLICE; l++) {
            gbg_release(chunk->row[l].index);
        }
        gbg_release(chunk->look);
        gbg_release(chunk->move);
        for (int a = 0; a < 3; a++) {
            gbg_release(chunk->push[a]);
        }
    }
    for (int a = 0; a < 3; a++) {
        gbg_release(list->local[a]);
        gbg_release(list->built[a]);
        gbg_release(list->built_high[a]);
    }
    gbg_grid_release(&list->grid);
    gbg_release(list->chunk);
    gbg_release(list->offset);
    gbg_release(list->width);
    gbg_release(list->look);
    gbg_release(list);
}

int64_t gbg_list_builds(const struct gbg_list *list)
{
    return list->builds;
}

double gbg_list_bytes(const struct gbg_list *list)
{
    double bytes = (double)list->n * (12.0 * list->dimension + (list->look ? 1.0 : 0.0)) +
                   (double)list->slices * 12.0 + (double)list->grid.cell_capacity * 4.0 +
                   (double)list->grid.particle_capacity * (8.0 + 8.0 * list->dimension);
    for (int c = 0; c < list->n_chunks; c++) {
        bytes += (double)list->chunk[c].capacity * 4.0 +
                 (double)list->chunk[c].work_capacity * (8.0 + 8.0 * list->dimension);
    }
    return bytes;
}

static void refresh_local(struct gbg_device *device, const struct gbg_state *state,
                          struct gbg_list *list)
{
    int64_t total = state->owned + state->ghost;
    for (int a = 0; a < list->dimension; a++) {
        const uint32_t *high = state->high[a], *low = state->low[a];
        uint32_t *local = list->local[a];
        int shift = list->shift[a];
#pragma omp parallel for num_threads(device->threads) schedule(static)
        for (int64_t i = 0; i < total; i++) {
            local[i] = gbg_local(high[i], low[i], shift);
        }
    }
    (void)device;
}

static int row_push(struct gbg_context *context, const struct gbg_state *state, struct gbg_row *row,
                    int32_t j)
{
    if (row->count == row->capacity) {
        void *larger;
        int64_t capacity = row->capacity ? 2 * row->capacity : 64;
        int status = gbg_allocate(context, &larger, capacity, sizeof *row->index, "pair list row");
        if (status != GBG_OK) {
            return status;
        }
        if (row->count > 0) {
            memcpy(larger, row->index, (size_t)row->count * sizeof *row->index);
        }
        gbg_release(row->index);
        row->index = larger;
        row->capacity = capacity;
    }
    int64_t k = row->count++;
    int32_t rank = gbg_rank_of(state, j);
    while (k > 0 && gbg_rank_of(state, row->index[k - 1]) >
                        rank) { /* rows are short: insertion keeps them sorted */
        row->index[k] = row->index[k - 1];
        k--;
    }
    row->index[k] = j;
    return GBG_OK;
}

static int find_neighbours(struct gbg_context *context, const struct gbg_state *state,
                           const struct gbg_list *list, int32_t i, struct gbg_row *row)
{
    const struct gbg_grid *grid = &list->grid;
    struct gbg_run runs[GBG_RUNS_MAX];
    int n_runs = gbg_grid_runs(grid, grid->cell_of[i], runs);
    uint64_t self[3] = {0, 0, 0};
    for (int a = 0; a < list->dimension; a++) {
        self[a] = gbg_join(state->high[a][i], state->low[a][i]);
    }
    double limit = list->radius * list->radius;
    row->count = 0;
    for (int r = 0; r < n_runs; r++) {
        for (int32_t slot = runs[r].begin; slot < runs[r].end; slot++) {
            double squared = 0.0;
            for (int a = 0; a < list->dimension; a++) {
                double d = gbg_box_difference(&state->box, a, self[a], grid->position[a][slot]);
                squared += d * d;
            }
            if (squared <= limit && grid->particle[slot] != i) {
                int status = row_push(context, state, row, grid->particle[slot]);
                if (status != GBG_OK) {
                    return status;
                }
            }
        }
    }
    return GBG_OK;
}

static int reserve_index(struct gbg_context *context, struct gbg_chunk *chunk, int64_t more)
{
    if (chunk->used + more <= chunk->capacity) {
        return GBG_OK;
    }
    int64_t capacity = chunk->used + more + chunk->capacity / 2 + 4096;
    void *larger;
    int status = gbg_allocate(context, &larger, capacity, sizeof *chunk->index, "pair list");
    if (status == GBG_OK) {
        if (chunk->used > 0) {
            memcpy(larger, chunk->index, (size_t)chunk->used * sizeof *chunk->index);
        }
        gbg_release(chunk->index);
        chunk->index = larger;
        chunk->capacity = capacity;
    }
    return status;
}

/* Rows of one slice: found one after the other, then laid out slot by slot. A short row is filled
 * up with its own particle, which every pair kernel skips because its distance is zero. */
static int build_slice(struct gbg_context *context, const struct gbg_state *state,
                       struct gbg_list *list, struct gbg_chunk *chunk, int64_t slice)
{
    struct gbg_row *rows = chunk->row;
    int64_t width = 0;
    for (int l = 0; l < GBG_SLICE; l++) {
        int64_t i = slice * GBG_SLICE + l;
        rows[l].count = 0;
        if (i < list->n) {
            int status = find_neighbours(context, state, list, (int32_t)i, &rows[l]);
            if (status != GBG_OK) {
                return status;
            }
        }
        width = rows[l].count > width ? rows[l].count : width;
    }
    int status = reserve_index(context, chunk, width * GBG_SLICE);
    if (status != GBG_OK) {
        return status;
    }
    int32_t *index = chunk->index + chunk->used;
    for (int64_t k = 0; k < width; k++) {
        for (int l = 0; l < GBG_SLICE; l++) {
            int64_t i = slice * GBG_SLICE + l, own = i < list->n ? i : list->n - 1;
            index[k * GBG_SLICE + l] = k < rows[l].count ? rows[l].index[k] : (int32_t)own;
        }
    }
    list->offset[slice] = chunk->used;
    list->width[slice] = (int32_t)width;
    chunk->used += width * GBG_SLICE;
    return GBG_OK;
}

static void build_chunk(struct gbg_context *context, const struct gbg_state *state,
                        struct gbg_list *list, struct gbg_chunk *chunk)
{
    chunk->used = 0;
    chunk->status = GBG_OK;
    for (int64_t s = chunk->first_slice; s < chunk->end_slice && chunk->status == GBG_OK; s++) {
        chunk->status = build_slice(context, state, list, chunk, s);
    }
    if (chunk->status == GBG_OK && list->builds == 0) { /* room to grow without asking again */
        chunk->status = reserve_index(context, chunk, chunk->used / 2);
    }
}

int gbg_list_build(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list)
{
    int64_t total = state->owned + state->ghost;
    list->epoch = state->epoch - 1; /* a build that fails is done again */
    int status = gbg_grid_build(device->context, &list->grid, &state->box, list->radius, total,
                                state->high, state->low);
    if (status != GBG_OK) {
        return status;
    }
    refresh_local(device, state, list);
#pragma omp parallel for num_threads(device->threads) schedule(static, 1)
    for (int c = 0; c < list->n_chunks; c++) {
        build_chunk(device->context, state, list, &list->chunk[c]);
    }
    for (int c = 0; c < list->n_chunks; c++) {
        status = list->chunk[c].status != GBG_OK ? list->chunk[c].status : status;
    }
    for (int a = 0; a < list->dimension; a++) {
        memcpy(list->built[a], list->local[a], (size_t)list->n * sizeof *list->built[a]);
        memcpy(list->built_high[a], state->high[a],
               (size_t)list->n * sizeof *list->built_high[a]);
    }
    list->builds++;
    if (status == GBG_OK) {
        list->epoch = state->epoch;
    }
    return status;
}

static float largest_moved_squared(struct gbg_device *device, const struct gbg_list *list)
{
    float largest = 0.0f;
#pragma omp parallel for num_threads(device->threads) schedule(static) reduction(max : largest)
    for (int64_t i = 0; i < list->n; i++) {
        float squared = gbg_list_moved_squared(list, i);
        largest = squared > largest ? squared : largest;
    }
    (void)device;
    return largest;
}

int gbg_list_update(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                    double moved)
{
    double slack = 0.5 * (list->radius - list->reach) * 0.999; /* float rounding of the lengths */
    /* a single large move could fold over the period of the local coordinates unseen */
    if (list->builds == 0 || list->epoch != state->epoch || !(moved <= slack)) {
        return gbg_list_build(device, state, list);
    }
    refresh_local(device, state, list);
    if (largest_moved_squared(device, list) > slack * slack) {
        return gbg_list_build(device, state, list);
    }
    return GBG_OK;
}
