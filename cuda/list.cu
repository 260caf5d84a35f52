/* L1, CUDA: pair lists, kept while nobody moved too far (building: list_build.cu). */
#include "cuda/list.h"

#include "backend/cpu/list_lengths.h"
#include "backend/cpu/list_square.h"
#include "cuda/unlisted.h"

enum { THREADS = 256, BLOCKS = 8 /* on a multiprocessor */ };

/* An array of the list, zero. */
static int take(struct gbg_device *device, void **pointer, int64_t count, size_t size,
                const char *what)
{
    int status = gbg_cuda_allocate(device, pointer, count, size, what);
    return status || count == 0 ? status : gbg_cuda_clear(device, *pointer, (size_t)count * size);
}

static int allocate_arrays(struct gbg_device *device, struct gbg_cuda_rows *rows, int64_t total)
{
    int status = GBG_OK;
    for (int a = 0; status == GBG_OK && a < rows->dimension; a++) {
        status = take(device, (void **)&rows->local[a], total, 4, "local coordinates");
        status = status
                     ? status
                     : take(device, (void **)&rows->built[a], total, 4, "coordinates of the list");
        status = status ? status
                        : take(device, (void **)&rows->built_high[a], rows->n, 4,
                               "coordinates of the list");
    }
    status = status ? status
                    : take(device, (void **)&rows->offset, rows->slices + 2, sizeof *rows->offset,
                           "pair list offsets");
    return status ? status
                  : take(device, (void **)&rows->width, rows->slices, sizeof *rows->width,
                         "pair list widths");
}

int gbg_cuda_list_create(struct gbg_device *device, const struct gbg_state *state, double reach,
                         double radius, struct gbg_list **list)
{
    void *body;
    int status = gbg_allocate_zero(device->context, &body, 1, sizeof **list, "pair list");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_list *made = (struct gbg_list *)body;
    struct gbg_cuda_rows *rows = &made->rows;
    made->device = device;
    made->reach = reach;
    made->radius = radius;
    made->total = state->owned + state->ghost;
    rows->dimension = state->box.dimension;
    rows->n = state->owned;
    rows->slices = (state->owned + GBG_CUDA_SLICE - 1) / GBG_CUDA_SLICE;
    gbg_list_choose_shift(&state->box, reach, rows->shift, made->unit, rows->scale);
    status = gbg_cuda_unlisted_wanted(device, state, made)
                 ? gbg_cuda_list_unlist(device, state, made)
                 : allocate_arrays(device, rows, made->total);
    if (status == GBG_E_MEMORY) {
        status = gbg_cuda_list_unlist(device, state, made);
    }
    if (status != GBG_OK) {
        gbg_cuda_list_destroy(device, made);
        return status;
    }
    *list = made;
    return GBG_OK;
}

void gbg_cuda_list_destroy(struct gbg_device *device, struct gbg_list *list)
{
    if (!list) {
        return;
    }
    struct gbg_cuda_rows *rows = &list->rows;
    gbg_cuda_contacts_release(device, list);
    gbg_cuda_bridge_release(device, list);
    gbg_cuda_events_release(device, list);
    gbg_cuda_unlisted_release(device, list);
    for (int a = 0; a < 3; a++) {
        gbg_cuda_release(device, rows->local[a], list->total, 4);
        gbg_cuda_release(device, rows->built[a], list->total, 4);
        gbg_cuda_release(device, rows->built_high[a], rows->n, 4);
    }
    gbg_cuda_release(device, rows->offset, rows->slices + 2, sizeof *rows->offset);
    gbg_cuda_release(device, rows->width, rows->slices, sizeof *rows->width);
    gbg_cuda_release(device, rows->index, list->index_capacity, sizeof *rows->index);
    gbg_cuda_grid_release(device, &list->grid);
    gbg_release(list);
}

int64_t gbg_cuda_list_builds(const struct gbg_list *list)
{
    return list->builds;
}

double gbg_cuda_list_bytes(const struct gbg_list *list)
{
    double d = list->rows.dimension;
    double rows = (double)list->rows.n * 12.0 * d + (double)list->rows.slices * 12.0 +
                  (double)list->index_capacity * 4.0;
    double bytes = list->unlisted ? gbg_cuda_unlisted_bytes(list->unlisted) : rows;
    bytes += (double)list->grid.cell_capacity * 4.0 +
             (double)list->grid.particle_capacity * (8.0 + 4.0 * d);
    return bytes + (list->moved[0] ? (double)list->rows.n * (2.0 + 8.0 * d) : 0.0);
}

const struct gbg_cuda_rows *gbg_cuda_list_rows(const struct gbg_list *list)
{
    return &list->rows;
}

const struct gbg_cuda_grid *gbg_cuda_list_grid(const struct gbg_list *list)
{
    return &list->grid;
}

/* Particles are shared out among as many threads as run at once, so that few of them meet in the
 * maximum: the squares are >= 0, and their bits in the order of integers. */
template <int DIMENSION>
static __global__ void follow(const __grid_constant__ struct gbg_state state,
                              const __grid_constant__ struct gbg_cuda_rows rows, int64_t total,
                              uint32_t *largest)
{
    __shared__ uint32_t of_warp[THREADS / 32];
    uint32_t most = 0;
    for (int64_t i = gbg_cuda_index(); i < total; i += (int64_t)gridDim.x * THREADS) {
        vf squared = 0.0f;
        for (int a = 0; a < DIMENSION; a++) {
            uint32_t local = gbg_cuda_local(state.high[a][i], state.low[a][i], rows.shift[a]);
            squared = gbg_list_add_square((vi)(local - rows.built[a][i]), rows.scale[a], squared);
            rows.local[a][i] = local;
        }
        most = max(most, (uint32_t)vi_of_bits(squared));
    }
    most = __reduce_max_sync(0xFFFFFFFFu, most);
    if (threadIdx.x % 32 == 0) {
        of_warp[threadIdx.x / 32] = most;
    }
    __syncthreads();
    if (threadIdx.x == 0) {
        for (int w = 1; w < THREADS / 32; w++) {
            most = max(most, of_warp[w]);
        }
        atomicMax(largest, most);
    }
}

int gbg_cuda_list_follow(struct gbg_device *device, const struct gbg_state *state,
                         struct gbg_list *list, float *largest)
{
    void *work;
    int64_t total = state->owned + state->ghost;
    *largest = 0.0f;
    if (total == 0) {
        return GBG_OK;
    }
    unsigned blocks = gbg_cuda_blocks(total, THREADS);
    unsigned at_once = (unsigned)(BLOCKS * device->multiprocessors);
    blocks = blocks < at_once ? blocks : at_once;
    int status = gbg_cuda_workspace(device, sizeof *largest, &work);
    uint32_t *most = (uint32_t *)work;
    status = status ? status : gbg_cuda_clear(device, most, sizeof *most);
    if (status != GBG_OK) {
        return status;
    }
    if (state->box.dimension == 2) {
        follow<2><<<blocks, THREADS, 0, device->stream>>>(*state, list->rows, total, most);
    } else {
        follow<3><<<blocks, THREADS, 0, device->stream>>>(*state, list->rows, total, most);
    }
    status = gbg_cuda_started(device, "following the pair list");
    return status ? status : gbg_cuda_fetch(device, largest, most, sizeof *largest);
}

static int update_rows(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                       double moved)
{
    double slack = 0.5 * (list->radius - list->reach) * 0.999; /* float rounding of the lengths */
    float largest;
    /* a single large move could fold over the period of the local coordinates unseen */
    if (list->builds == 0 || list->epoch != state->epoch || !(moved <= slack)) {
        return gbg_cuda_list_build(device, state, list);
    }
    int status = gbg_cuda_list_follow(device, state, list, &largest);
    return status == GBG_OK && largest > slack * slack ? gbg_cuda_list_build(device, state, list)
                                                       : status;
}

int gbg_cuda_list_update(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                         double moved)
{
    int status = list->unlisted ? GBG_OK : update_rows(device, state, list, moved);
    if (status == GBG_E_MEMORY) { /* where rows find no room, cells may */
        status = gbg_cuda_list_unlist(device, state, list);
    }
    return status || !list->unlisted ? status
                                     : gbg_cuda_unlisted_update(device, state, list, moved);
}

int gbg_cuda_list_is_kept(const struct gbg_list *list)
{
    return !list->unlisted;
}
