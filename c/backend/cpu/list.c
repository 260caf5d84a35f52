/* L1, CPU: pair lists, kept while nobody moved too far (building: list_build.c). */
#include "backend/cpu/list.h"

#include <string.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/events.h"
#include "backend/cpu/list_lengths.h"
#include "core/memory.h"

/* Particles that a thread follows at a time: a multiple of every vector. */
enum { BLOCK = 1024 };

static int allocate_arrays(struct gbg_context *context, struct gbg_list *list, int64_t total)
{
    int status = gbg_allocate_zero(context, (void **)&list->chunk, list->n_chunks,
                                   sizeof *list->chunk, "pair list");
    for (int a = 0; status == GBG_OK && a < list->dimension; a++) {
        status = gbg_allocate_zero(context, (void **)&list->local[a], total, sizeof *list->local[a],
                                   "local coordinates");
        if (status == GBG_OK) {
            status = gbg_allocate_zero(context, (void **)&list->built[a], total,
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
    gbg_list_choose_shift(&state->box, reach, made->shift, made->unit, made->scale);
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
    if (!list) {
        return;
    }
    for (int c = 0; list->chunk && c < list->n_chunks; c++) {
        struct gbg_chunk *chunk = &list->chunk[c];
        gbg_release(chunk->index);
        for (int l = 0; l < GBG_SLICE; l++) {
            gbg_release(chunk->row[l].index);
        }
        gbg_release(chunk->key);
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
    gbg_events_destroy(device, list->events);
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
                   (double)list->grid.particle_capacity * (8.0 + 4.0 * list->dimension);
    bytes += list->events ? gbg_events_bytes(list->events) : 0.0;
    for (int c = 0; c < list->n_chunks; c++) {
        bytes += (double)list->chunk[c].capacity * 4.0 +
                 (double)list->chunk[c].work_capacity * (8.0 + 8.0 * list->dimension);
    }
    return bytes;
}

float gbg_list_follow(struct gbg_device *device, const struct gbg_state *state,
                      struct gbg_list *list)
{
    float largest = 0.0f;
    int64_t blocks = (state->owned + state->ghost + BLOCK - 1) / BLOCK;
#pragma omp parallel for num_threads(device->threads) schedule(static) reduction(max : largest)
    for (int64_t b = 0; b < blocks; b++) {
        int64_t end = (b + 1) * BLOCK, total = state->owned + state->ghost;
        float squared = device->variant->follow(state, list, b * BLOCK, end < total ? end : total);
        largest = squared > largest ? squared : largest;
    }
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
    return gbg_list_follow(device, state, list) > slack * slack
               ? gbg_list_build(device, state, list)
               : GBG_OK;
}
