/* L1, CUDA: lists without rows, for systems whose rows memory does not hold: the cells are kept as
 * long as a list would be, and rows live in shared memory while a force is summed
 * (unlisted_sum.cu). */
#include "cuda/unlisted.h"

#include "cuda/kernels.h"
#include "cuda/places.h"

/* Widest radius of the cells over the reach, and bytes that are worth asking for what is free. */
static const double WIDEST_RADIUS = 1.25;
static const double MUCH = 1 << 28;

static int64_t place_words(const struct gbg_state *state)
{
    return state->box.dimension == 2 && !state->source ? 2 : 4;
}

static double cell_radius(const struct gbg_list *list)
{
    return fmin(list->radius, WIDEST_RADIUS * list->reach);
}

/* Local coordinates tell particles of neighbouring cells apart if these are less than half a period
 * away from each other, wherever they have gone since the cells were built. */
static int cells_serve(const struct gbg_state *state, const struct gbg_list *list)
{
    int cells[3];
    double radius = cell_radius(list);
    if (state->owned == 0 || state->ghost > 0 || !state->force[0] || state->start_high[0]) {
        return 0; /* contacts need rows */
    }
    gbg_grid_choose(&state->box, radius, state->owned, cells);
    for (int a = 0; a < state->box.dimension; a++) {
        double edge = state->box.length[a] / cells[a], period = list->unit[a] * 0x1p32;
        if (list->rows.shift[a] > 0 &&
            2.0 * edge + (radius - list->reach) > 0.5 * period * (1.0 - 1e-6)) {
            return 0;
        }
    }
    return 1;
}

/* Bytes of a list with rows and of batches of steps, if the particles are spread evenly: longest
 * rows of slices, coordinates, cells and their sort, places. */
static double bytes_with_rows(const struct gbg_state *state, double radius)
{
    int dimension = state->box.dimension;
    double n = (double)state->owned, pi = acos(-1.0);
    double close = dimension == 2 ? pi * n : 4.0 / 3.0 * pi * n;
    for (int a = 0; a < dimension; a++) {
        close *= radius / state->box.length[a];
    }
    double row = 4.0 * (close + 3.0 * sqrt(close) + 1.0);
    return n * (row + 12.0 * dimension + 24.0 + 4.0 * dimension + 8.0 * (double)place_words(state));
}

int gbg_cuda_unlisted_wanted(struct gbg_device *device, const struct gbg_state *state,
                             const struct gbg_list *list)
{
    size_t free_bytes = 0, all = 0;
    double wanted = bytes_with_rows(state, list->radius);
    if (wanted < MUCH || !cells_serve(state, list) || gbg_cuda_use(device) != GBG_OK) {
        return 0;
    }
    if (cudaMemGetInfo(&free_bytes, &all) != cudaSuccess) {
        cudaGetLastError(); /* the next call that needs the GPU tells of it */
        return 0;
    }
    return wanted + (double)all / 64.0 > (double)free_bytes;
}

static void release_rows(struct gbg_device *device, struct gbg_list *list)
{
    struct gbg_cuda_rows *rows = &list->rows;
    for (int a = 0; a < 3; a++) {
        gbg_cuda_release(device, rows->local[a], list->total, 4);
        gbg_cuda_release(device, rows->built[a], list->total, 4);
        gbg_cuda_release(device, rows->built_high[a], rows->n, 4);
        rows->local[a] = rows->built[a] = rows->built_high[a] = NULL;
    }
    gbg_cuda_release(device, rows->offset, rows->slices + 2, sizeof *rows->offset);
    gbg_cuda_release(device, rows->width, rows->slices, sizeof *rows->width);
    gbg_cuda_release(device, rows->index, list->index_capacity, sizeof *rows->index);
    rows->offset = NULL;
    rows->width = rows->index = NULL;
    list->index_capacity = 0;
}

int gbg_cuda_list_unlist(struct gbg_device *device, const struct gbg_state *state,
                         struct gbg_list *list)
{
    void *body;
    if (list->unlisted) {
        return GBG_OK;
    }
    if (!cells_serve(state, list)) {
        return GBG_E_MEMORY;
    }
    int status =
        gbg_allocate_zero(device->context, &body, 1, sizeof *list->unlisted, "cells of forces");
    if (status != GBG_OK) {
        return status;
    }
    release_rows(device, list);
    gbg_cuda_steps_release(device); /* batches are not made without rows */
    list->unlisted = (struct gbg_cuda_unlisted *)body;
    list->radius = cell_radius(list);
    list->epoch = state->epoch - 1; /* to be built */
    return GBG_OK;
}

void gbg_cuda_unlisted_release(struct gbg_device *device, struct gbg_list *list)
{
    struct gbg_cuda_unlisted *unlisted = list->unlisted;
    if (unlisted) {
        gbg_cuda_release(device, unlisted->places, unlisted->place_words, 4);
        gbg_cuda_release(device, unlisted->of_rank, unlisted->n_ranks, 4);
        gbg_cuda_release(device, unlisted->widest, 1, sizeof *unlisted->widest);
        gbg_release(unlisted);
        list->unlisted = NULL;
    }
}

double gbg_cuda_unlisted_bytes(const struct gbg_cuda_unlisted *unlisted)
{
    return 4.0 * (double)(unlisted->place_words + unlisted->n_ranks);
}

/* A thread a slot: the present coordinates in the order of cells and by index. */
template <int dimension, bool sources>
static __global__ void place_all(const __grid_constant__ struct gbg_state state,
                                 const __grid_constant__ struct gbg_cuda_rows rows,
                                 const __grid_constant__ struct gbg_cuda_grid grid, void *places)
{
    int64_t slot = gbg_cuda_index();
    if (slot >= grid.n) {
        return;
    }
    int32_t i = grid.particle[slot];
    gbg_cuda_put_place<dimension, sources>(state, rows, places, i);
    for (int a = 0; a < dimension; a++) {
        grid.high[a][slot] = gbg_cuda_local(state.high[a][i], state.low[a][i], rows.shift[a]);
    }
}

static int reserve(struct gbg_device *device, const struct gbg_state *state,
                   struct gbg_cuda_unlisted *unlisted)
{
    int status =
        gbg_cuda_grow(device, &unlisted->places, &unlisted->place_words,
                      place_words(state) * state->owned, 4, "places of particles in cells");
    if (status == GBG_OK && state->rank) {
        status = gbg_cuda_grow(device, (void **)&unlisted->of_rank, &unlisted->n_ranks,
                               state->owned, sizeof *unlisted->of_rank, "order of ranks");
    }
    if (status == GBG_OK && !unlisted->widest) {
        status = gbg_cuda_allocate(device, (void **)&unlisted->widest, 1, sizeof *unlisted->widest,
                                   "longest row");
        status =
            status ? status : gbg_cuda_clear(device, unlisted->widest, sizeof *unlisted->widest);
    }
    return status;
}

static int build_cells(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list)
{
    struct gbg_cuda_unlisted *unlisted = list->unlisted;
    list->epoch = state->epoch - 1; /* a build that fails is done again */
    int status = reserve(device, state, unlisted);
    status = status ? status
                    : gbg_cuda_grid_build(device, &list->grid, &state->box, list->radius,
                                          state->owned, state->high);
    if (status == GBG_OK && state->rank) {
        status = gbg_cuda_invert_ranks(device, state, state->owned, unlisted->of_rank);
    }
    if (status == GBG_OK) {
        unlisted->displaced = 0.0;
        unlisted->looked = 0;
        list->builds++;
        list->epoch = state->epoch;
        list->moment = ++device->moments;
    }
    return status;
}

int gbg_cuda_unlisted_update(struct gbg_device *device, struct gbg_state *state,
                             struct gbg_list *list, double moved)
{
    struct gbg_cuda_unlisted *unlisted = list->unlisted;
    double slack = 0.5 * (list->radius - list->reach) * 0.999;
    int status = GBG_OK;
    unlisted->displaced += moved; /* the sum of the largest moves is no less than any way */
    if (list->builds == 0 || list->epoch != state->epoch || !(unlisted->displaced <= slack)) {
        status = build_cells(device, state, list);
    }
    if (status != GBG_OK) {
        return status;
    }
    auto *place = state->box.dimension == 2
                      ? state->source ? place_all<2, true> : place_all<2, false>
                  : state->source ? place_all<3, true>
                                  : place_all<3, false>;
    place<<<gbg_cuda_blocks(state->owned), GBG_CUDA_THREADS, 0, device->stream>>>(
        *state, list->rows, list->grid, unlisted->places);
    return gbg_cuda_started(device, "places of particles in cells");
}
