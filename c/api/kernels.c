/* L4: single kernels on the caller's arrays. */
#include "gamboge/kernels.h"

#include <math.h>
#include <string.h>

#include "backend/backend.h"
#include "core/context.h"
#include "core/memory.h"
#include "core/view.h"

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

/* The arguments of gbg_pair_forces. */
struct pair_call {
    int dimension;
    const double *lengths;
    double power, cutoff;
    int use_double;
    struct gbg_points points;
    const double *alpha, *mobility;
    double *force[3];
    ptrdiff_t force_step;
};

static int check_numbers(struct gbg_context *context, const struct pair_call *call)
{
    static const char name[] = "gbg_pair_forces";
    if (call->dimension != 2 && call->dimension != 3) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: dimension is %d and must be 2 or 3", name,
                        call->dimension);
    }
    double shortest = INFINITY;
    for (int a = 0; a < call->dimension; a++) {
        if (!call->lengths || !(call->lengths[a] > 0.0) || !isfinite(call->lengths[a])) {
            return gbg_fail(context, GBG_E_ARGUMENT, "%s: box length %d is %g and must be positive",
                            name, a + 1, call->lengths ? call->lengths[a] : 0.0);
        }
        shortest = fmin(shortest, call->lengths[a]);
    }
    if (!(call->power > 0.0 && call->power <= MOST_POWER)) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: power is %g and must lie in (0, %g]", name,
                        call->power, MOST_POWER);
    }
    if (!(call->cutoff >= 0.0 && call->cutoff <= 0.5 * shortest)) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: cutoff is %g and must lie between 0 (none) and "
                        "half the shortest box length, %g",
                        name, call->cutoff, 0.5 * shortest);
    }
    return GBG_OK;
}

static int check_arrays(struct gbg_context *context, const struct pair_call *call)
{
    static const char name[] = "gbg_pair_forces";
    const struct gbg_points *points = &call->points;
    if (points->n < 0 || points->n > INT32_MAX) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: n is %lld and must lie in 0 .. 2147483647",
                        name, (long long)points->n);
    }
    if (points->n == 0) {
        return GBG_OK;
    }
    int missing = !call->alpha || !call->mobility;
    for (int a = 0; a < call->dimension; a++) {
        missing |= !points->base[a] || !call->force[a];
    }
    if (missing) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: a coordinate, force, alpha or mobility array "
                        "is NULL (only z and fz may be, in two dimensions)",
                        name);
    }
    if (points->n > 1 && (points->step == 0 || call->force_step == 0)) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: step is %td and force_step %td; neither may "
                        "be 0",
                        name, points->step, call->force_step);
    }
    int64_t bad = gbg_points_first_bad(points, call->dimension);
    for (int64_t i = 0; bad < 0 && i < points->n; i++) {
        bad = isfinite(call->alpha[i]) && isfinite(call->mobility[i]) ? -1 : i;
    }
    if (bad >= 0) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: particle %lld (counted from 0) has a "
                        "coordinate, alpha or mobility that is not finite",
                        name, (long long)bad);
    }
    return GBG_OK;
}

/* The caller's particles in a backend's memory. */
struct upload {
    const struct gbg_backend *backend;
    struct gbg_device *device;
    struct gbg_state state;
    void *buffer; /* 8 bytes a particle in our own memory */
};

static int add_array(struct upload *u, void **array, size_t size, const char *what)
{
    return u->backend->allocate(u->device, array, u->state.owned, size, what);
}

static int upload_axis(struct upload *u, const struct pair_call *call, int axis)
{
    struct gbg_state *state = &u->state;
    int64_t n = state->owned;
    int status = add_array(u, (void **)&state->high[axis], 4, "positions");
    status = status ? status : add_array(u, (void **)&state->low[axis], 4, "positions");
    status = status ? status : add_array(u, (void **)&state->force[axis], 8, "forces");
    if (status != GBG_OK) {
        return status;
    }
    uint32_t *high = u->buffer, *low = high + n;
    for (int64_t i = 0; i < n; i++) {
        uint64_t fraction =
            gbg_box_encode(&state->box, axis, gbg_point(&call->points, axis, i), NULL);
        high[i] = (uint32_t)(fraction >> 32);
        low[i] = (uint32_t)fraction;
    }
    status = u->backend->upload(u->device, state->high[axis], high, (size_t)n * 4);
    return status ? status : u->backend->upload(u->device, state->low[axis], low, (size_t)n * 4);
}

static int upload_particles(struct upload *u, const struct pair_call *call)
{
    int status = GBG_OK;
    for (int a = 0; a < call->dimension && status == GBG_OK; a++) {
        status = upload_axis(u, call, a);
    }
    status = status ? status : add_array(u, (void **)&u->state.own_alpha, 8, "alpha");
    return status ? status
                  : u->backend->upload(u->device, u->state.own_alpha, call->alpha,
                                       (size_t)u->state.owned * 8);
}

static int sum_pairs(struct upload *u, const struct pair_call *call)
{
    const struct gbg_kernels *kernels = u->backend->kernels(u->device);
    if (call->cutoff > 0.0) {
        int32_t *all = u->buffer;
        for (int64_t i = 0; i < u->state.owned; i++) {
            all[i] = (int32_t)i;
        }
        return kernels->direct_targets(u->device, &u->state, call->power, call->cutoff,
                                       u->state.owned, all, u->state.force);
    }
    return (call->use_double ? kernels->direct_double : kernels->direct_mixed)(u->device, &u->state,
                                                                               call->power, 0);
}

static int download_forces(struct upload *u, const struct pair_call *call)
{
    int status = u->backend->sync(u->device);
    double *force = u->buffer;
    for (int a = 0; a < call->dimension && status == GBG_OK; a++) {
        status = u->backend->download(u->device, force, u->state.force[a],
                                      (size_t)u->state.owned * sizeof *force);
        for (int64_t i = 0; status == GBG_OK && i < u->state.owned; i++) {
            call->force[a][i * call->force_step] = call->mobility[i] * force[i];
        }
    }
    return status;
}

static int run_pairs(struct gbg_context *context, const struct pair_call *call)
{
    struct upload u = {.backend = gbg_backend_find(context->backend)};
    u.state.box = gbg_box_make(call->dimension, call->lengths, NULL);
    u.state.owned = call->points.n;
    u.state.n_species = 1;
    u.state.mobility[0] = 1.0;
    int status = gbg_allocate(context, &u.buffer, call->points.n, 8, "pair forces");
    status = status ? status : u.backend->create(context, &u.device);
    if (status == GBG_OK) {
        status = upload_particles(&u, call);
        status = status ? status : sum_pairs(&u, call);
        status = status ? status : download_forces(&u, call);
        for (int a = 0; a < call->dimension; a++) {
            u.backend->release(u.device, u.state.high[a]);
            u.backend->release(u.device, u.state.low[a]);
            u.backend->release(u.device, u.state.force[a]);
        }
        u.backend->release(u.device, u.state.own_alpha);
        u.backend->destroy(u.device);
    }
    gbg_release(u.buffer);
    return status;
}

int gbg_pair_forces(struct gbg_context *context, int dimension, const double *lengths, double power,
                    double cutoff, const char *precision, int64_t n, const double *x,
                    const double *y, const double *z, ptrdiff_t step, const double *alpha,
                    const double *mobility, double *fx, double *fy, double *fz,
                    ptrdiff_t force_step)
{
    if (!context) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "gbg_pair_forces: context is NULL");
    }
    int mixed = precision && strcmp(precision, "mixed") == 0;
    if (!mixed && !(precision && strcmp(precision, "double") == 0)) {
        return gbg_fail(context, GBG_E_NAME,
                        "gbg_pair_forces: precision is \"%s\" and must be "
                        "\"mixed\" or \"double\"",
                        precision ? precision : "(NULL)");
    }
    const struct pair_call call = {.dimension = dimension,
                                   .lengths = lengths,
                                   .power = power,
                                   .cutoff = cutoff,
                                   .use_double = !mixed,
                                   .points = {n, {x, y, z}, step},
                                   .alpha = alpha,
                                   .mobility = mobility,
                                   .force = {fx, fy, fz},
                                   .force_step = force_step};
    int status = check_numbers(context, &call);
    status = status ? status : check_arrays(context, &call);
    return status != GBG_OK || n == 0 ? status : run_pairs(context, &call);
}
