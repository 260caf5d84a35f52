/* L2: a state without an engine, made from a caller's arrays for one kernel call. */
#include "engine/bare.h"

#include <math.h>
#include <string.h>

#include "core/context.h"
#include "core/memory.h"

int gbg_bare_check(struct gbg_context *context, const char *call, int dimension,
                   const double *lengths, const struct gbg_points *points)
{
    if (dimension != 2 && dimension != 3) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: dimension is %d, allowed 2 or 3", call,
                        dimension);
    }
    if (!lengths) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: lengths is NULL", call);
    }
    for (int a = 0; a < dimension; a++) {
        if (!(lengths[a] > 0.0) || !isfinite(lengths[a])) {
            return gbg_fail(context, GBG_E_ARGUMENT,
                            "%s: lengths[%d] is %g, allowed finite and above 0", call, a,
                            lengths[a]);
        }
    }
    if (points->n < 0 || points->n > INT32_MAX) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: n is %lld, allowed 0 to %d", call,
                        (long long)points->n, INT32_MAX);
    }
    for (int a = 0; a < dimension; a++) {
        if (points->n > 0 && !points->base[a]) {
            return gbg_fail(context, GBG_E_ARGUMENT, "%s: %c is NULL", call, "xyz"[a]);
        }
    }
    if (points->n > 1 && points->step == 0) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: step is 0: all particles would share one element", call);
    }
    int64_t bad = gbg_points_first_bad(points, dimension);
    if (bad >= 0) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: particle %lld (from 0) has a coordinate that is not a finite number",
                        call, (long long)bad);
    }
    return GBG_OK;
}

int gbg_bare_array(struct gbg_bare *bare, void **pointer, const void *from, size_t size,
                   const char *what)
{
    int64_t n = bare->state.owned;
    int status = bare->backend->allocate(bare->device, pointer, n, size, what);
    if (status != GBG_OK) {
        return status;
    }
    if (from) {
        return bare->backend->upload(bare->device, *pointer, from, (size_t)n * size);
    }
    void *zeros;
    status = gbg_allocate_zero(bare->context, &zeros, n, size, what);
    if (status == GBG_OK) {
        status = bare->backend->upload(bare->device, *pointer, zeros, (size_t)n * size);
        gbg_release(zeros);
    }
    return status;
}

/* Fractions of an axis, high words before low ones, into the transfer buffer. */
static void encode(struct gbg_bare *bare, const struct gbg_points *points, int axis)
{
    int64_t n = points->n;
    for (int64_t i = 0; i < n; i++) {
        uint64_t fraction =
            gbg_box_encode(&bare->state.box, axis, gbg_point(points, axis, i), NULL);
        bare->words[i] = (uint32_t)(fraction >> 32);
        bare->words[n + i] = (uint32_t)fraction;
    }
}

static int encode_axis(struct gbg_bare *bare, const struct gbg_points *points, int axis)
{
    encode(bare, points, axis);
    int status =
        gbg_bare_array(bare, (void **)&bare->state.high[axis], bare->words, 4, "coordinates");
    return status ? status
                  : gbg_bare_array(bare, (void **)&bare->state.low[axis], bare->words + points->n,
                                   4, "coordinates");
}

int gbg_bare_move(struct gbg_bare *bare, const struct gbg_points *points)
{
    size_t bytes = (size_t)points->n * 4;
    int status = GBG_OK;
    for (int a = 0; status == GBG_OK && a < bare->state.box.dimension; a++) {
        encode(bare, points, a);
        status = bare->backend->upload(bare->device, bare->state.high[a], bare->words, bytes);
        status = status ? status
                        : bare->backend->upload(bare->device, bare->state.low[a],
                                                bare->words + points->n, bytes);
    }
    bare->state.epoch++;
    return status;
}

int gbg_bare_make(struct gbg_context *context, int dimension, const double *lengths,
                  const struct gbg_points *points, struct gbg_bare *bare)
{
    memset(bare, 0, sizeof *bare);
    bare->context = context;
    bare->backend = gbg_backend_find(context->backend);
    bare->state.box = gbg_box_make(dimension, lengths, NULL);
    bare->state.owned = points->n;
    bare->state.n_species = 1;
    int status = bare->backend->create(context, &bare->device);
    if (status != GBG_OK) {
        return status;
    }
    bare->kernels = bare->backend->kernels(bare->device);
    status = gbg_allocate(context, (void **)&bare->words, 2 * points->n, sizeof *bare->words,
                          "transfer buffer");
    for (int a = 0; status == GBG_OK && a < dimension; a++) {
        status = encode_axis(bare, points, a);
    }
    if (status != GBG_OK) {
        gbg_bare_free(bare);
    }
    return status;
}

void gbg_bare_free(struct gbg_bare *bare)
{
    for (int a = 0; a < 3 && bare->device; a++) {
        bare->backend->release(bare->device, bare->state.high[a]);
        bare->backend->release(bare->device, bare->state.low[a]);
    }
    if (bare->device) {
        bare->backend->destroy(bare->device);
    }
    gbg_release(bare->words);
    memset(bare, 0, sizeof *bare);
}

int gbg_bare_fractions(struct gbg_bare *bare, int axis, uint64_t *fraction)
{
    int64_t n = bare->state.owned;
    size_t bytes = (size_t)n * 4;
    int status = bare->backend->download(bare->device, bare->words, bare->state.high[axis], bytes);
    if (status == GBG_OK) {
        status =
            bare->backend->download(bare->device, bare->words + n, bare->state.low[axis], bytes);
    }
    for (int64_t i = 0; status == GBG_OK && i < n; i++) {
        fraction[i] = (uint64_t)bare->words[i] << 32 | bare->words[n + i];
    }
    return status;
}
