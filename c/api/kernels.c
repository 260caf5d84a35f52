/* L4: single kernels on the caller's arrays. */
#include "gamboge/kernels.h"

#include "backend/backend.h"
#include "core/context.h"
#include "core/memory.h"

enum { IDS_AT_A_TIME = 1 << 14 };

static const int64_t MOST_IDS = INT64_C(1) << 56;

static int check_normals(struct gbg_context *context, int64_t seed, int64_t run, int64_t at_step,
                         int64_t first_id, int dimension, int64_t n, const double *values)
{
    static const char call[] = "gbg_normals";
    if (seed < 0 || seed > UINT32_MAX || run < 0 || run > UINT32_MAX) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: seed %lld and run %lld must lie in 0 .. "
                        "4294967295",
                        call, (long long)seed, (long long)run);
    }
    if (at_step < 0) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: at_step is %lld and must not be negative",
                        call, (long long)at_step);
    }
    if (dimension != 2 && dimension != 3) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: dimension is %d and must be 2 or 3", call,
                        dimension);
    }
    if (n < 0 || first_id < 0 || first_id > MOST_IDS || n > MOST_IDS - first_id) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: first_id %lld and n %lld must not be negative, "
                        "and their sum must not exceed 2^56",
                        call, (long long)first_id, (long long)n);
    }
    if (n > 0 && !values) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: values is NULL", call);
    }
    return GBG_OK;
}

/* Through a block of the backend's memory. */
static int copy_normals(const struct gbg_backend *backend, struct gbg_device *device,
                        const struct gbg_noise *noise, int64_t at_step, int64_t first_id,
                        int dimension, int64_t n, double *values)
{
    const struct gbg_kernels *kernels = backend->kernels(device);
    void *block;
    int64_t most = n < IDS_AT_A_TIME ? n : IDS_AT_A_TIME;
    int status = backend->allocate(device, &block, most * dimension, sizeof *values, "deviates");
    for (int64_t done = 0; status == GBG_OK && done < n; done += most) {
        int64_t count = n - done < most ? n - done : most;
        status = kernels->normals(device, noise, (uint64_t)at_step, (uint64_t)(first_id + done),
                                  count, dimension, block);
        if (status == GBG_OK) {
            status = backend->download(device, values + done * dimension, block,
                                       (size_t)(count * dimension) * sizeof *values);
        }
    }
    backend->release(device, block);
    return status;
}

int gbg_normals(struct gbg_context *context, int64_t seed, int64_t run, int64_t at_step,
                int64_t first_id, int dimension, int64_t n, double *values)
{
    if (!context) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "gbg_normals: context is NULL");
    }
    int status = check_normals(context, seed, run, at_step, first_id, dimension, n, values);
    if (status != GBG_OK || n == 0) {
        return status;
    }
    const struct gbg_backend *backend = gbg_backend_find(context->backend);
    struct gbg_noise noise = {.seed = (uint32_t)seed, .run = (uint32_t)run, .scale = 1.0};
    struct gbg_device *device;
    status = backend->create(context, &device);
    if (status == GBG_OK) {
        status = copy_normals(backend, device, &noise, at_step, first_id, dimension, n, values);
        backend->destroy(device);
    }
    return status;
}
