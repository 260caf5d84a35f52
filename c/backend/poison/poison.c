/* L1: the CPU backend with every fresh array and every output filled with NaN, to find reads of
 * what nobody wrote. */
#include <string.h>

#include "backend/backend.h"
#include "backend/cpu/cpu.h"
#include "core/memory.h"

enum { POISON = 0xFF }; /* bytes of a NaN, of the integer -1, of the largest unsigned */

/* The padding is poisoned too: what kernels read there must not matter. */
static int allocate(struct gbg_device *device, void **pointer, int64_t count, size_t size,
                    const char *what)
{
    int status = gbg_allocate(device->context, pointer, count, size, what);
    if (status == GBG_OK) {
        memset(*pointer, POISON, (size_t)count * size + GBG_ALIGNMENT);
    }
    return status;
}

static int normals(struct gbg_device *device, const struct gbg_noise *noise, uint64_t step,
                   uint64_t first, int64_t n, int dimension, double *values)
{
    memset(values, POISON, (size_t)(n * dimension) * sizeof *values);
    return device->variant->kernels.normals(device, noise, step, first, n, dimension, values);
}

static void poison_forces(struct gbg_state *state)
{
    for (int a = 0; a < state->box.dimension; a++) {
        memset(state->force[a], POISON, (size_t)state->owned * sizeof *state->force[a]);
    }
}

static int direct_mixed(struct gbg_device *device, struct gbg_state *state, double power, int add)
{
    if (!add) {
        poison_forces(state);
    }
    return device->variant->kernels.direct_mixed(device, state, power, add);
}

static int direct_double(struct gbg_device *device, struct gbg_state *state, double power, int add)
{
    if (!add) {
        poison_forces(state);
    }
    return device->variant->kernels.direct_double(device, state, power, add);
}

static int cutoff_mixed(struct gbg_device *device, struct gbg_state *state,
                        const struct gbg_list *list, double power, double cutoff, int add)
{
    if (!add) {
        poison_forces(state);
    }
    return device->variant->kernels.cutoff_mixed(device, state, list, power, cutoff, add);
}

static int cutoff_double(struct gbg_device *device, struct gbg_state *state,
                         const struct gbg_list *list, double power, double cutoff, int add)
{
    if (!add) {
        poison_forces(state);
    }
    return device->variant->kernels.cutoff_double(device, state, list, power, cutoff, add);
}

static int create(struct gbg_context *context, struct gbg_device **device)
{
    int status = gbg_cpu_create(context, device);
    if (status == GBG_OK) {
        (*device)->poison = 1;
        struct gbg_kernels *kernels = &(*device)->kernels;
        kernels->normals = normals;
        kernels->direct_mixed = direct_mixed;
        kernels->direct_double = direct_double;
        kernels->cutoff_mixed = cutoff_mixed;
        kernels->cutoff_double = cutoff_double;
    }
    return status;
}

/* Output goes the way of a GPU's: a copy in the order of ids, read later by another thread. */
struct gbg_slot {
    int64_t n;
    int dimension, images, overlapped;
    void *block; /* fractions, then image counts, then flags */
    struct gbg_frame frame;
};

static void frame_release(struct gbg_slot *slot)
{
    if (slot) {
        gbg_release(slot->block);
        gbg_release(slot);
    }
}

static int make_slot(struct gbg_device *device, const struct gbg_state *state, int images,
                     int overlapped, struct gbg_slot **slot)
{
    int64_t n = state->owned;
    int dimension = state->box.dimension;
    void *body;
    int status = gbg_allocate_zero(device->context, &body, 1, sizeof **slot, "a frame's slot");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_slot *made = body;
    *made = (struct gbg_slot){n, dimension, images, overlapped, NULL, {{0}, {0}, NULL}};
    status = gbg_allocate(device->context, &made->block, n,
                          (size_t)(dimension * (8 + 4 * images) + 4 * overlapped), "a frame");
    if (status != GBG_OK) {
        gbg_release(made);
        return status;
    }
    int32_t *words = (int32_t *)((uint64_t *)made->block + dimension * n);
    for (int a = 0; a < dimension; a++) {
        made->frame.fraction[a] = (uint64_t *)made->block + a * n;
        made->frame.image[a] = images ? words + a * n : NULL;
    }
    made->frame.overlapped = overlapped ? words + images * dimension * n : NULL;
    *slot = made;
    return GBG_OK;
}

static void fill(const struct gbg_state *state, struct gbg_slot *slot)
{
    uint64_t *fraction = slot->block;
    int32_t *words = (int32_t *)(fraction + slot->dimension * slot->n);
    int32_t *flag = words + slot->images * slot->dimension * slot->n;
    for (int64_t i = 0; i < slot->n; i++) {
        int64_t k = state->rank ? state->rank[i] : i;
        for (int a = 0; a < slot->dimension; a++) {
            fraction[a * slot->n + k] = (uint64_t)state->high[a][i] << 32 | state->low[a][i];
            if (slot->images) {
                words[a * slot->n + k] = state->image[a][i];
            }
        }
        if (slot->overlapped) {
            flag[k] = state->overlapped[i];
        }
    }
}

static int frame_begin(struct gbg_device *device, const struct gbg_state *state, int images,
                       int overlapped, struct gbg_slot **slot)
{
    const struct gbg_slot *old = *slot;
    int status = GBG_OK;
    if (!old || old->n != state->owned || old->dimension != state->box.dimension ||
        old->images != images || old->overlapped != overlapped) {
        frame_release(*slot);
        *slot = NULL;
        status = make_slot(device, state, images, overlapped, slot);
    }
    if (status == GBG_OK) {
        fill(state, *slot);
    }
    return status;
}

static const char *frame_wait(struct gbg_slot *slot, struct gbg_frame *frame)
{
    *frame = slot->frame;
    return NULL;
}

const struct gbg_backend gbg_backend_poison = {
    .name = "poison",
    .probe = gbg_cpu_probe,
    .create = create,
    .destroy = gbg_cpu_destroy,
    .allocate = allocate,
    .release = gbg_cpu_release,
    .upload = gbg_cpu_copy,
    .download = gbg_cpu_copy,
    .sync = gbg_cpu_sync,
    .frame_begin = frame_begin,
    .frame_wait = frame_wait,
    .frame_release = frame_release,
    .scratch_bytes = gbg_cpu_scratch_bytes,
    .kernels = gbg_cpu_kernels,
};
