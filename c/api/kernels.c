/* L4: single kernels on the caller's arrays. */
#include "gamboge/kernels.h"

#include <math.h>
#include <string.h>

#include "backend/backend.h"
#include "core/context.h"
#include "core/memory.h"
#include "engine/pair_forces.h"

enum { IDS_AT_A_TIME = 1 << 12 };

static const int64_t MOST_IDS = INT64_C(1) << 56;
static const double MOST_POWER = 24.0;

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

static int check_law(struct gbg_context *context, int dimension, const double *lengths,
                     double power, double cutoff)
{
    static const char call[] = "gbg_pair_forces";
    double shortest = INFINITY;
    for (int a = 0; a < dimension; a++) {
        shortest = fmin(shortest, lengths[a]);
    }
    if (!(power > 0.0 && power <= MOST_POWER)) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: power is %g, allowed above 0 up to %g", call,
                        power, MOST_POWER);
    }
    if (!(cutoff >= 0.0 && cutoff <= 0.5 * shortest)) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: cutoff is %g, allowed 0 (none) to half the "
                        "shortest box length, %g",
                        call, cutoff, 0.5 * shortest);
    }
    return GBG_OK;
}

static int check_values(struct gbg_context *context, int dimension, int64_t n,
                        const struct gbg_pair_sum *sum, double *const force[3],
                        ptrdiff_t force_step)
{
    static const char call[] = "gbg_pair_forces";
    int missing = !sum->alpha || !sum->mobility;
    for (int a = 0; a < dimension; a++) {
        missing |= !force[a];
    }
    if (n > 0 && missing) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: alpha, mobility, fx, fy or (in three "
                        "dimensions) fz is NULL",
                        call);
    }
    if (n > 1 && force_step == 0) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: force_step is 0: all forces would share one "
                        "element",
                        call);
    }
    for (int64_t i = 0; i < n; i++) {
        if (!isfinite(sum->alpha[i]) || !isfinite(sum->mobility[i])) {
            return gbg_fail(context, GBG_E_ARGUMENT,
                            "%s: particle %lld (from 0) has alpha %g and "
                            "mobility %g, which must be finite",
                            call, (long long)i, sum->alpha[i], sum->mobility[i]);
        }
    }
    return GBG_OK;
}

int gbg_pair_forces(struct gbg_context *context, int dimension, const double *lengths, double power,
                    double cutoff, const char *precision, int64_t n, const double *x,
                    const double *y, const double *z, ptrdiff_t step, const double *alpha,
                    const double *mobility, double *fx, double *fy, double *fz,
                    ptrdiff_t force_step)
{
    static const char call[] = "gbg_pair_forces";
    if (!context) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "%s: context is NULL", call);
    }
    int use_double = precision && strcmp(precision, "double") == 0;
    int strict = precision && strcmp(precision, "strict") == 0;
    if (!use_double && !strict && !(precision && strcmp(precision, "mixed") == 0)) {
        return gbg_fail(context, GBG_E_NAME,
                        "%s: precision is \"%s\", allowed mixed, double or strict", call,
                        precision ? precision : "(NULL)");
    }
    const struct gbg_points points = {n, {x, y, z}, step};
    const struct gbg_pair_sum sum = {power, cutoff, use_double, strict, alpha, mobility};
    double *const force[3] = {fx, fy, fz};
    int status = gbg_bare_check(context, call, dimension, lengths, &points);
    status = status ? status : check_law(context, dimension, lengths, power, cutoff);
    status = status ? status : check_values(context, dimension, n, &sum, force, force_step);
    if (status != GBG_OK || n == 0) {
        return status;
    }
    struct gbg_bare bare;
    status = gbg_bare_make(context, dimension, lengths, &points, &bare);
    if (status == GBG_OK) {
        status = gbg_caller_pair_forces(&bare, &sum, force, force_step);
        gbg_bare_free(&bare);
    }
    return status;
}
