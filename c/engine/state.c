/* L2: coordinates in and out of the state, and its hash. */
#include <string.h>

#include "core/memory.h"
#include "core/sha256.h"
#include "engine/engine.h"
#include "engine/relax.h"

/* One axis of words in host memory, reused by every transfer. */
static int need_words(struct gbg_engine *engine)
{
    if (engine->words) {
        return GBG_OK;
    }
    return gbg_allocate(engine->context, (void **)&engine->words, 2 * engine->state.owned,
                        sizeof *engine->words, "transfer buffer");
}

int gbg_engine_fetch(struct gbg_engine *engine, const void *from, size_t bytes)
{
    int status = need_words(engine);
    return status ? status : engine->backend->download(engine->device, engine->words, from, bytes);
}

int gbg_engine_places(struct gbg_engine *engine, const int32_t **place)
{
    const struct gbg_state *state = &engine->state;
    *place = NULL;
    int status = GBG_OK;
    if (!state->rank) {
        return GBG_OK;
    }
    if (!engine->place) {
        status = gbg_allocate(engine->context, (void **)&engine->place, state->owned,
                              sizeof *engine->place, "places of particles");
    } else if (engine->place_epoch == state->epoch) {
        *place = engine->place;
        return GBG_OK;
    }
    if (status == GBG_OK) {
        status = gbg_engine_fetch(engine, state->rank, (size_t)state->owned * 4);
    }
    for (int64_t i = 0; status == GBG_OK && i < state->owned; i++) {
        engine->place[engine->words[i]] = (int32_t)i;
    }
    engine->place_epoch = status == GBG_OK ? state->epoch : 0;
    *place = engine->place;
    return status;
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

enum { PIECE = 1 << 22 };

/* One axis of some particles that stand in the state as they are given; words: three each. */
static int encode_piece(struct gbg_engine *engine, const struct gbg_points *points, int a,
                        int64_t first, int64_t count, uint32_t *words)
{
    const struct gbg_backend *backend = engine->backend;
    struct gbg_state *state = &engine->state;
    uint32_t *high = words, *low = words + count;
    int32_t *image = (int32_t *)(words + 2 * count);
    size_t bytes = (size_t)count * sizeof *words;
#pragma omp parallel for num_threads(engine->context->threads) if (count > GBG_WORTH_THREADS)
    for (int64_t k = 0; k < count; k++) {
        uint64_t fraction =
            gbg_box_encode(&state->box, a, gbg_point(points, a, first + k), &image[k]);
        high[k] = (uint32_t)(fraction >> 32);
        low[k] = (uint32_t)fraction;
    }
    int status = backend->upload(engine->device, state->high[a] + first, high, bytes);
    status = status ? status : backend->upload(engine->device, state->low[a] + first, low, bytes);
    return status || !state->image[a]
               ? status
               : backend->upload(engine->device, state->image[a] + first, image, bytes);
}

/* In pieces, so that a large start is not held twice. */
static int encode_in_order(struct gbg_engine *engine, const struct gbg_points *points)
{
    int64_t n = points->n, piece = n < PIECE ? n : PIECE;
    uint32_t *words;
    int status = gbg_allocate(engine->context, (void **)&words, 3 * piece, sizeof *words, "start");
    for (int a = 0; a < engine->state.box.dimension; a++) {
        for (int64_t first = 0; status == GBG_OK && first < n; first += piece) {
            int64_t count = n - first < piece ? n - first : piece;
            status = encode_piece(engine, points, a, first, count, words);
        }
    }
    gbg_release(words);
    return status;
}

static int encode_in_places(struct gbg_engine *engine, const struct gbg_points *points)
{
    struct gbg_state *state = &engine->state;
    const int32_t *place;
    int status = need_words(engine);
    status = status ? status : gbg_engine_places(engine, &place);
    for (int a = 0; status == GBG_OK && a < state->box.dimension; a++) {
        for (int64_t k = 0; k < points->n; k++) {
            int64_t i = gbg_engine_place(place, gbg_engine_rank(engine, k));
            uint64_t fraction = gbg_box_encode(&state->box, a, gbg_point(points, a, k), NULL);
            engine->words[i] = (uint32_t)(fraction >> 32);
            engine->words[state->owned + i] = (uint32_t)fraction;
        }
        status = send_axis(engine, a);
        if (status == GBG_OK && state->image[a]) {
            for (int64_t k = 0; k < points->n; k++) {
                int64_t i = gbg_engine_place(place, gbg_engine_rank(engine, k));
                gbg_box_encode(&state->box, a, gbg_point(points, a, k),
                               (int32_t *)&engine->words[i]);
            }
            status = engine->backend->upload(engine->device, state->image[a], engine->words,
                                             (size_t)state->owned * 4);
        }
    }
    return status;
}

int gbg_engine_encode(struct gbg_engine *engine, const struct gbg_points *points)
{
    int status = engine->rank || engine->state.rank ? encode_in_places(engine, points)
                                                    : encode_in_order(engine, points);
    engine->state.epoch++;
    engine->forces_current = 0;
    return status;
}

/* Coordinates and image counts as they are, to be put back; one block, released by the caller. */
static int copy_places(struct gbg_engine *engine, uint64_t **block, uint64_t **fraction,
                       int32_t **image)
{
    int64_t n = engine->state.owned;
    int status = gbg_allocate(engine->context, (void **)block, 6 * n, 8, "positions before");
    for (int a = 0; status == GBG_OK && a < engine->state.box.dimension; a++) {
        fraction[a] = *block + a * n;
        image[a] = (int32_t *)(*block + (3 + a) * n);
        status = gbg_engine_copy_fractions(engine, a, fraction[a]);
        if (status == GBG_OK && engine->state.image[a]) {
            status = gbg_engine_copy_images(engine, a, image[a]);
        }
    }
    return status;
}

/* New places with their overlaps relaxed; where that fails everything is as before. */
static int replace_and_relax(struct gbg_engine *engine, const struct gbg_points *points)
{
    uint64_t *block = NULL, *fraction[3];
    int32_t *image[3];
    int status = gbg_engine_order_by_id(engine);
    status = status ? status : copy_places(engine, &block, fraction, image);
    if (status == GBG_OK) {
        status = gbg_engine_encode(engine, points);
        status = status ? status : gbg_engine_relax(engine, "gbg_engine_set_positions");
        status = status ? status : gbg_engine_check_overlaps(engine, "gbg_engine_set_positions");
        if (status != GBG_OK) {
            gbg_engine_restore(engine, engine->step, (const uint64_t *const *)fraction,
                               (const int32_t *const *)image);
        }
    }
    gbg_release(block);
    return status;
}

int gbg_engine_replace(struct gbg_engine *engine, const struct gbg_points *points)
{
    if (engine->contact > 0.0 && engine->scene.separate == GBG_OVERLAPPING_RELAX) {
        return replace_and_relax(engine, points);
    }
    /* without cores nothing can be refused, and nothing need be kept; the pair that a refusal names
     * must not depend on the order in memory */
    int cores = engine->contact > 0.0;
    int status = cores ? gbg_engine_order_by_id(engine) : GBG_OK;
    if (status == GBG_OK && cores) {
        status = engine->kernels->keep(engine->device, &engine->state);
    }
    if (status == GBG_OK) {
        status = gbg_engine_encode(engine, points);
    }
    if (status == GBG_OK) {
        status = gbg_engine_check_overlaps(engine, "gbg_engine_set_positions");
    }
    if (status != GBG_OK && cores) {
        engine->kernels->put_back(engine->device, &engine->state);
        engine->state.epoch++;
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

/* Image counts of an axis into engine->words. */
static int fetch_images(struct gbg_engine *engine, int axis)
{
    if (!engine->state.image[axis]) {
        return gbg_fail(engine->context, GBG_E_ORDER,
                        "image counts are not kept by this scene: set "
                        "output.trajectory.unwrapped to 1");
    }
    return gbg_engine_fetch(engine, engine->state.image[axis], (size_t)engine->state.owned * 4);
}

static uint64_t fetched(const struct gbg_engine *engine, int64_t i)
{
    return (uint64_t)engine->words[i] << 32 | engine->words[engine->state.owned + i];
}

int gbg_engine_decode(struct gbg_engine *engine, int wrapped, int axis, double *base,
                      ptrdiff_t step)
{
    const struct gbg_state *state = &engine->state;
    const int32_t *place;
    int status = gbg_engine_places(engine, &place);
    status = status ? status : fetch_axis(engine, axis);
    for (int64_t k = 0; status == GBG_OK && k < state->owned; k++) {
        int64_t i = gbg_engine_place(place, gbg_engine_rank(engine, k));
        base[k * step] = gbg_box_decode(&state->box, axis, fetched(engine, i));
    }
    if (wrapped || status != GBG_OK) {
        return status;
    }
    const int32_t *image = (const int32_t *)engine->words;
    status = fetch_images(engine, axis);
    for (int64_t k = 0; status == GBG_OK && k < state->owned; k++) {
        int64_t i = gbg_engine_place(place, gbg_engine_rank(engine, k));
        base[k * step] += image[i] * state->box.length[axis];
    }
    return status;
}

int gbg_engine_copy_fractions(struct gbg_engine *engine, int axis, uint64_t *fraction)
{
    const int32_t *place;
    int status = gbg_engine_places(engine, &place);
    status = status ? status : fetch_axis(engine, axis);
    for (int64_t k = 0; status == GBG_OK && k < engine->state.owned; k++) {
        fraction[k] = fetched(engine, gbg_engine_place(place, k));
    }
    return status;
}

int gbg_engine_copy_images(struct gbg_engine *engine, int axis, int32_t *image)
{
    const int32_t *place;
    int status = gbg_engine_places(engine, &place);
    status = status ? status : fetch_images(engine, axis);
    for (int64_t k = 0; status == GBG_OK && k < engine->state.owned; k++) {
        image[k] = (int32_t)engine->words[gbg_engine_place(place, k)];
    }
    return status;
}

int gbg_engine_copy_overlap(struct gbg_engine *engine, int32_t *flag)
{
    int64_t n = engine->state.owned;
    if (!engine->state.overlapped) {
        return gbg_fail(engine->context, GBG_E_ORDER,
                        "overlap flags are not kept by this scene: set "
                        "output.trajectory.overlap to 1");
    }
    const int32_t *place;
    int status = gbg_engine_places(engine, &place);
    status = status ? status : gbg_engine_fetch(engine, engine->state.overlapped, (size_t)n);
    const unsigned char *bytes = (const unsigned char *)engine->words;
    for (int64_t k = 0; status == GBG_OK && k < n; k++) {
        flag[k] = bytes[gbg_engine_place(place, k)];
    }
    return status;
}

static int copy_force(struct gbg_engine *engine, int axis, const int32_t *place, double *force)
{
    int64_t n = engine->state.owned;
    const double *values = engine->state.force[axis];
    if (!place) {
        return engine->backend->download(engine->device, force, values, (size_t)n * 8);
    }
    int status = gbg_engine_fetch(engine, values, (size_t)n * 8);
    values = (const double *)(const void *)engine->words;
    for (int64_t k = 0; status == GBG_OK && k < n; k++) {
        force[k] = values[place[k]];
    }
    return status;
}

int gbg_engine_copy_forces(struct gbg_engine *engine, double *const *force)
{
    const int32_t *place;
    int status = gbg_engine_evaluate_forces(engine);
    status = status ? status : gbg_engine_places(engine, &place);
    for (int a = 0; status == GBG_OK && a < engine->state.box.dimension; a++) {
        if (engine->state.force[a]) {
            status = copy_force(engine, a, place, force[a]);
        } else {
            memset(force[a], 0, (size_t)engine->state.owned * sizeof *force[a]);
        }
    }
    return status;
}

int gbg_engine_restore(struct gbg_engine *engine, uint64_t step, const uint64_t *const *fraction,
                       const int32_t *const *image)
{
    struct gbg_state *state = &engine->state;
    const int32_t *place;
    int status = need_words(engine);
    status = status ? status : gbg_engine_places(engine, &place);
    for (int a = 0; status == GBG_OK && a < state->box.dimension; a++) {
        for (int64_t k = 0; k < state->owned; k++) {
            int64_t i = gbg_engine_place(place, k);
            engine->words[i] = (uint32_t)(fraction[a][k] >> 32);
            engine->words[state->owned + i] = (uint32_t)fraction[a][k];
        }
        status = send_axis(engine, a);
        if (status == GBG_OK && state->image[a] && image) {
            for (int64_t k = 0; k < state->owned; k++) {
                engine->words[gbg_engine_place(place, k)] = (uint32_t)image[a][k];
            }
            status = engine->backend->upload(engine->device, state->image[a], engine->words,
                                             (size_t)state->owned * 4);
        }
    }
    engine->step = step;
    state->epoch++;
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
    const int32_t *place = NULL;
    int status = gbg_engine_look(engine, &view);
    status = status ? status : gbg_engine_places(engine, &place);
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
            hash_number(&hash, fetched(engine, gbg_engine_place(place, i)));
        }
    }
    gbg_sha256_finish(&hash, digest);
    gbg_sha256_text(digest, text);
    return status;
}
