/* L2: coordinates in and out of the state, and its hash. */
#include <string.h>

#include "core/memory.h"
#include "core/sha256.h"
#include "engine/engine.h"

/* One axis of words in host memory, reused by every transfer. */
static int need_words(struct gbg_engine *engine)
{
    if (engine->words) {
        return GBG_OK;
    }
    return gbg_allocate(engine->context, (void **)&engine->words, 2 * engine->state.owned,
                        sizeof *engine->words, "transfer buffer");
}

static int send_axis(struct gbg_engine *engine, int axis)
{
    int64_t n = engine->state.owned;
    size_t bytes = (size_t)n * 4;
    int status =
        engine->backend->upload(engine->device, engine->state.high[axis], engine->words, bytes);
    return status ? status
                  : engine->backend->upload(engine->device, engine->state.low[axis],
                                            engine->words + n, bytes);
}

int gbg_engine_encode(struct gbg_engine *engine, const struct gbg_points *points)
{
    struct gbg_state *state = &engine->state;
    int status = need_words(engine);
    for (int a = 0; status == GBG_OK && a < state->box.dimension; a++) {
        for (int64_t k = 0; k < points->n; k++) {
            int64_t i = gbg_engine_rank(engine, k);
            uint64_t fraction = gbg_box_encode(&state->box, a, gbg_point(points, a, k), NULL);
            engine->words[i] = (uint32_t)(fraction >> 32);
            engine->words[state->owned + i] = (uint32_t)fraction;
        }
        status = send_axis(engine, a);
        if (status == GBG_OK && state->image[a]) {
            for (int64_t k = 0; k < points->n; k++) {
                gbg_box_encode(&state->box, a, gbg_point(points, a, k),
                               (int32_t *)&engine->words[gbg_engine_rank(engine, k)]);
            }
            status = engine->backend->upload(engine->device, state->image[a], engine->words,
                                             (size_t)state->owned * 4);
        }
    }
    engine->moved = 1e300; /* lists do not know the new places */
    engine->forces_current = 0;
    return status;
}

int gbg_engine_replace(struct gbg_engine *engine, const struct gbg_points *points)
{
    /* without cores nothing can be refused, and nothing need be kept */
    int cores = engine->contact > 0.0;
    int status = cores ? engine->kernels->keep(engine->device, &engine->state) : GBG_OK;
    if (status == GBG_OK) {
        status = gbg_engine_encode(engine, points);
    }
    if (status == GBG_OK) {
        status = gbg_engine_check_overlaps(engine, "gbg_engine_set_positions");
    }
    if (status != GBG_OK && cores) {
        engine->kernels->put_back(engine->device, &engine->state);
    }
    return status;
}

static int fetch_axis(struct gbg_engine *engine, int axis)
{
    int status = need_words(engine);
    size_t bytes = (size_t)engine->state.owned * 4;
    if (status == GBG_OK) {
        status = engine->backend->download(engine->device, engine->words, engine->state.high[axis],
                                           bytes);
    }
    return status ? status
                  : engine->backend->download(engine->device, engine->words + engine->state.owned,
                                              engine->state.low[axis], bytes);
}

static uint64_t fetched(const struct gbg_engine *engine, int64_t i)
{
    return (uint64_t)engine->words[i] << 32 | engine->words[engine->state.owned + i];
}

int gbg_engine_decode(struct gbg_engine *engine, int wrapped, int axis, double *base,
                      ptrdiff_t step)
{
    const struct gbg_state *state = &engine->state;
    int status = fetch_axis(engine, axis);
    if (status != GBG_OK) {
        return status;
    }
    for (int64_t k = 0; k < state->owned; k++) {
        base[k * step] =
            gbg_box_decode(&state->box, axis, fetched(engine, gbg_engine_rank(engine, k)));
    }
    if (wrapped) {
        return GBG_OK;
    }
    int32_t *image = (int32_t *)engine->words;
    status = gbg_engine_copy_images(engine, axis, image);
    for (int64_t k = 0; status == GBG_OK && k < state->owned; k++) {
        base[k * step] += image[gbg_engine_rank(engine, k)] * state->box.length[axis];
    }
    return status;
}

int gbg_engine_copy_fractions(struct gbg_engine *engine, int axis, uint64_t *fraction)
{
    int status = fetch_axis(engine, axis);
    for (int64_t i = 0; status == GBG_OK && i < engine->state.owned; i++) {
        fraction[i] = fetched(engine, i);
    }
    return status;
}

int gbg_engine_copy_images(struct gbg_engine *engine, int axis, int32_t *image)
{
    if (!engine->state.image[axis]) {
        return gbg_fail(engine->context, GBG_E_ORDER,
                        "image counts are not kept by this scene: set "
                        "output.trajectory.unwrapped to 1");
    }
    return engine->backend->download(engine->device, image, engine->state.image[axis],
                                     (size_t)engine->state.owned * 4);
}

int gbg_engine_copy_overlap(struct gbg_engine *engine, int32_t *flag)
{
    int64_t n = engine->state.owned;
    if (!engine->state.overlapped) {
        return gbg_fail(engine->context, GBG_E_ORDER,
                        "overlap flags are not kept by this scene: set "
                        "output.trajectory.overlap to 1");
    }
    int status = need_words(engine);
    if (status != GBG_OK) {
        return status;
    }
    unsigned char *bytes = (unsigned char *)engine->words;
    status = engine->backend->download(engine->device, bytes, engine->state.overlapped, (size_t)n);
    for (int64_t i = 0; status == GBG_OK && i < n; i++) {
        flag[i] = bytes[i];
    }
    return status;
}

int gbg_engine_copy_forces(struct gbg_engine *engine, double *const *force)
{
    size_t bytes = (size_t)engine->state.owned * 8;
    int status = gbg_engine_evaluate_forces(engine);
    for (int a = 0; status == GBG_OK && a < engine->state.box.dimension; a++) {
        if (engine->state.force[a]) {
            status =
                engine->backend->download(engine->device, force[a], engine->state.force[a], bytes);
        } else {
            memset(force[a], 0, bytes);
        }
    }
    return status;
}

int gbg_engine_restore(struct gbg_engine *engine, uint64_t step, const uint64_t *const *fraction,
                       const int32_t *const *image)
{
    struct gbg_state *state = &engine->state;
    int status = need_words(engine);
    for (int a = 0; status == GBG_OK && a < state->box.dimension; a++) {
        for (int64_t i = 0; i < state->owned; i++) {
            engine->words[i] = (uint32_t)(fraction[a][i] >> 32);
            engine->words[state->owned + i] = (uint32_t)fraction[a][i];
        }
        status = send_axis(engine, a);
        if (status == GBG_OK && state->image[a] && image) {
            status = engine->backend->upload(engine->device, state->image[a], image[a],
                                             (size_t)state->owned * 4);
        }
    }
    engine->step = step;
    engine->moved = 1e300;
    engine->forces_current = 0;
    return status;
}

static void hash_number(struct gbg_sha256 *hash, uint64_t value)
{
    unsigned char bytes[8];
    for (int k = 0; k < 8; k++) {
        bytes[k] = (unsigned char)(value >> (8 * k)); /* the same on any byte order */
    }
    gbg_sha256_add(hash, bytes, sizeof bytes);
}

int gbg_engine_digest(struct gbg_engine *engine, char text[65])
{
    struct gbg_sha256 hash;
    unsigned char digest[32];
    struct gbg_engine_view view;
    int status = gbg_engine_look(engine, &view);
    gbg_sha256_start(&hash);
    if (status == GBG_OK) {
        hash_number(&hash, view.step);
        for (int64_t i = 0; i < view.n; i++) {
            hash_number(&hash, (uint64_t)view.id[i]);
        }
    }
    for (int a = 0; status == GBG_OK && a < engine->state.box.dimension; a++) {
        status = fetch_axis(engine, a);
        for (int64_t i = 0; status == GBG_OK && i < view.n; i++) {
            hash_number(&hash, fetched(engine, i));
        }
    }
    gbg_sha256_finish(&hash, digest);
    gbg_sha256_text(digest, text);
    return status;
}
