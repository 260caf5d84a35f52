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
    .scratch_bytes = gbg_cpu_scratch_bytes,
    .kernels = gbg_cpu_kernels,
};
