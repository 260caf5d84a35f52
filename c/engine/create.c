/* L2: makes an engine: device, arrays that the scene needs, plan. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "engine/engine.h"
#include "engine/mesh_check.h"
#include "engine/relax.h"

static int device_array(struct gbg_engine *engine, void *pointer, size_t size, const char *what)
{
    return engine->backend->allocate(engine->device, pointer,
                                     engine->state.owned + engine->state.ghost, size, what);
}

static int has_cores(const struct gbg_scene *scene)
{
    return scene->rule != GBG_RULE_NONE;
}

/* Positions always; everything else only if a term of the scene asks for it. */
static int allocate_state(struct gbg_engine *engine, int ids_are_indices)
{
    struct gbg_state *state = &engine->state;
    const struct gbg_scene *scene = &engine->scene;
    int status = GBG_OK, sources = 0;
    for (int f = 0; f < scene->n_forces; f++) {
        sources |= scene->force[f].sum == GBG_SUM_CUTOFF && scene->n_species > 1;
    }
    for (int a = 0; status == GBG_OK && a < scene->dimension; a++) {
        status = device_array(engine, &state->high[a], 4, "positions");
        status = status ? status : device_array(engine, &state->low[a], 4, "positions");
        if (status == GBG_OK && scene->unwrapped) {
            status = device_array(engine, &state->image[a], 4, "image counts");
        }
        if (status == GBG_OK && scene->n_forces > 0) {
            status = device_array(engine, &state->force[a], 8, "forces");
        }
        if (status == GBG_OK && has_cores(scene)) {
            status = device_array(engine, &state->start_high[a], 4, "positions before the step");
            status =
                status ? status
                       : device_array(engine, &state->start_low[a], 4, "positions before the step");
            if (status == GBG_OK && scene->unwrapped) {
                status = device_array(engine, &state->start_image[a], 4, "images before the step");
            }
        }
    }
    if (status == GBG_OK && scene->n_species > 1) {
        status = device_array(engine, &state->species, 1, "species");
    }
    if (status == GBG_OK && !ids_are_indices) {
        status = device_array(engine, &state->id, 8, "ids");
    }
    if (status == GBG_OK && scene->overlap) {
        status = device_array(engine, &state->overlapped, 1, "overlap flags");
    }
    if (status == GBG_OK && sources) {
        status = device_array(engine, &state->source, 4, "sources");
    }
    return status;
}

static void fill_table(struct gbg_engine *engine)
{
    struct gbg_state *state = &engine->state;
    const struct gbg_scene *scene = &engine->scene;
    state->n_species = scene->n_species;
    double least = INFINITY;
    for (int s = 0; s < scene->n_species; s++) {
        state->diameter[s] = has_cores(scene) ? scene->species[s].diameter : 0.0;
        state->alpha[s] = scene->species[s].alpha;
        state->mobility[s] = scene->species[s].mobility;
        engine->contact = fmax(engine->contact, state->diameter[s]);
        if (scene->species[s].diameter > 0.0 && scene->species[s].count != 0) {
            least = fmin(least, state->diameter[s]);
        }
    }
    engine->least_contact = isfinite(least) ? least : 0.0;
}

/* Variance of a normal deviate that is clamped, or redrawn, beyond `limit` deviations. */
static double limited_variance(int limit_by, double limit)
{
    double density = exp(-0.5 * limit * limit) / sqrt(2.0 * acos(-1.0));
    double inside = erf(limit / sqrt(2.0));
    double core = inside - 2.0 * limit * density; /* integral of x^2 within the limit */
    switch (limit_by) {
    case GBG_LIMIT_CLAMP:
        return core + limit * limit * (1.0 - inside);
    case GBG_LIMIT_REDRAW:
        return core / inside;
    default:
        return 1.0;
    }
}

static void set_noise(struct gbg_engine *engine)
{
    const struct gbg_scene *scene = &engine->scene;
    double variance = scene->rescale ? limited_variance(scene->limit_by, scene->noise_limit) : 1.0;
    engine->noise = (struct gbg_noise){
        .seed = (uint32_t)scene->seed,
        .run = (uint32_t)scene->run,
        .limit_by = scene->limit_by,
        .limit = scene->noise_limit,
        .scale = sqrt(scene->temperature * scene->dt / variance),
    };
}

/* Species, sources and flags of `count` particles; buffer: 4 bytes each. */
static int upload_piece(struct gbg_engine *engine, const int32_t *species, int64_t first,
                        int64_t count, void *buffer)
{
    struct gbg_state *state = &engine->state;
    size_t n = (size_t)count;
    int status = GBG_OK;
    if (state->species) {
        for (size_t i = 0; i < n; i++) {
            ((uint8_t *)buffer)[i] = (uint8_t)species[i];
        }
        status = engine->backend->upload(engine->device, state->species + first, buffer, n);
    }
    if (status == GBG_OK && state->source) {
        for (size_t i = 0; i < n; i++) {
            ((float *)buffer)[i] = (float)state->alpha[species[i]];
        }
        status = engine->backend->upload(engine->device, state->source + first, buffer, 4 * n);
    }
    if (status == GBG_OK && state->overlapped) {
        memset(buffer, 0, n);
        status = engine->backend->upload(engine->device, state->overlapped + first, buffer, n);
    }
    return status;
}

/* In pieces, so that a large start is not held twice. */
static int upload_particles(struct gbg_engine *engine, const struct gbg_particles *particles)
{
    enum { PIECE = 1 << 22 };
    const struct gbg_state *state = &engine->state;
    int64_t n = particles->n, piece = n < PIECE ? n : PIECE;
    void *buffer = NULL;
    int status = GBG_OK;
    if (state->id) {
        status = engine->backend->upload(engine->device, state->id, particles->id, 8 * (size_t)n);
    }
    if (status != GBG_OK || !(state->species || state->source || state->overlapped)) {
        return status;
    }
    status = gbg_allocate(engine->context, &buffer, piece, 4, "start");
    for (int64_t first = 0; status == GBG_OK && first < n; first += piece) {
        int64_t count = n - first < piece ? n - first : piece;
        status = upload_piece(engine, particles->species + first, first, count, buffer);
    }
    gbg_release(buffer);
    return status;
}

static int ids_are_indices(const struct gbg_engine *engine, const struct gbg_particles *particles)
{
    int same = 1;
#pragma omp parallel for num_threads(engine->context->threads) reduction(& : same)                  \
    if (particles->n > GBG_WORTH_THREADS)
    for (int64_t i = 0; i < particles->n; i++) {
        same &= particles->id[i] == i;
    }
    return same;
}

/* rank[k]: where the k-th particle that the caller gave stands in the order of ids. */
static int make_rank(struct gbg_engine *engine, const struct gbg_particles *given,
                     const struct gbg_particles *sorted)
{
    int same = given->n == 0;
    for (int64_t k = 0; !same && k < given->n && given->id[k] == sorted->id[k]; k++) {
        same = k == given->n - 1;
    }
    if (same || given->n != sorted->n) {
        return GBG_OK;
    }
    int status = gbg_allocate(engine->context, (void **)&engine->rank, given->n,
                              sizeof *engine->rank, "order of the caller");
    for (int64_t k = 0; status == GBG_OK && k < given->n; k++) {
        int64_t low = 0, high = sorted->n - 1;
        while (low < high) {
            int64_t middle = (low + high) / 2;
            if (sorted->id[middle] < given->id[k]) {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        engine->rank[k] = low;
    }
    return status;
}

static int fill_engine(struct gbg_engine *engine, const struct gbg_scene *scene,
                       const struct gbg_particles *particles)
{
    engine->backend = gbg_backend_find(engine->context->backend);
    int status = engine->backend->create(engine->context, &engine->device);
    if (status != GBG_OK) {
        return status;
    }
    engine->kernels = engine->backend->kernels(engine->device);
    engine->state.box = gbg_box_make(scene->dimension, scene->length, scene->origin);
    engine->state.owned = particles->n;
    fill_table(engine);
    set_noise(engine);
    status = allocate_state(engine, ids_are_indices(engine, particles));
    if (status == GBG_OK) {
        status = upload_particles(engine, particles);
    }
    if (status == GBG_OK) {
        struct gbg_points points = {
            particles->n,
            {particles->position[0], particles->position[1], particles->position[2]},
            1};
        status = gbg_engine_encode(engine, &points); /* rank is not set yet: order of ids */
        gbg_release(engine->words); /* a run without output has no transfer buffer */
        engine->words = NULL;
    }
    if (status == GBG_OK && scene->start == GBG_START_ARRAYS) {
        status = make_rank(engine, &scene->arrays, particles);
    }
    if (status == GBG_OK) {
        if (engine->backend->expect && !gbg_engine_has_direct_sums(engine)) {
            engine->backend->expect(engine->device, particles->n);
        }
        status = gbg_engine_plan(engine);
    }
    return status;
}

int gbg_engine_make(struct gbg_scene *scene, const struct gbg_particles *particles,
                    struct gbg_engine **engine)
{
    struct gbg_engine *made;
    int status = gbg_allocate_zero(scene->context, (void **)&made, 1, sizeof *made, "engine");
    if (status != GBG_OK) {
        return status;
    }
    made->context = scene->context;
    made->scene = *scene;
    memset(&made->scene.arrays, 0, sizeof made->scene.arrays);
    status = fill_engine(made, scene, particles);
    if (status == GBG_OK && scene->separate == GBG_OVERLAPPING_RELAX) {
        status = gbg_engine_relax(made, "gbg_engine_create");
    }
    if (status == GBG_OK) {
        status = gbg_engine_check_overlaps(made, "gbg_engine_create");
    }
    if (status == GBG_OK) {
        status = gbg_engine_prepare(made);
    }
    if (status != GBG_OK) {
        gbg_engine_free(made);
        return status;
    }
    *engine = made;
    return GBG_OK;
}

void gbg_engine_free(struct gbg_engine *engine)
{
    if (!engine) {
        return;
    }
    const struct gbg_backend *backend = engine->backend;
    struct gbg_device *device = engine->device;
    if (device) {
        struct gbg_state *state = &engine->state;
        for (int a = 0; a < 3; a++) {
            void *arrays[] = {state->high[a],       state->low[a],        state->image[a],
                              state->force[a],      state->start_high[a], state->start_low[a],
                              state->start_image[a]};
            for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++) {
                backend->release(device, arrays[k]);
            }
        }
        backend->release(device, state->id);
        backend->release(device, state->rank);
        backend->release(device, state->species);
        backend->release(device, state->overlapped);
        backend->release(device, state->source);
        engine->kernels->list_destroy(device, engine->pairs);
        engine->kernels->list_destroy(device, engine->contacts);
        gbg_engine_free_mesh_sums(engine);
        backend->destroy(device);
    }
    gbg_release(engine->rank);
    gbg_release(engine->place);
    gbg_release(engine->species);
    gbg_release(engine->id);
    gbg_release(engine->words);
    gbg_release(engine);
}
