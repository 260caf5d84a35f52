/* L4: engines: create, run, read out. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/memory.h"
#include "core/text.h"
#include "core/view.h"
#include "engine/engine.h"
#include "engine/mesh_check.h"
#include "io/start_file.h"

static int no_engine(const char *call)
{
    return gbg_fail(NULL, GBG_E_ARGUMENT, "%s: engine is NULL", call);
}

int gbg_engine_create(struct gbg_scene *scene, struct gbg_engine **engine)
{
    if (!scene || !engine) {
        return gbg_fail(scene ? scene->context : NULL, GBG_E_ARGUMENT,
                        "gbg_engine_create: %s is "
                        "NULL",
                        scene ? "engine" : "scene");
    }
    *engine = NULL;
    int status = GBG_OK;
    if (scene->start == GBG_START_FILE) {
        status = gbg_io_read_start(scene);
    }
    if (status == GBG_OK) {
        status = gbg_scene_resolve(scene);
    }
    struct gbg_particles particles = {0};
    if (status == GBG_OK) {
        status = gbg_scene_start(scene, &particles);
    }
    if (status == GBG_OK) {
        status = gbg_engine_make(scene, &particles, engine);
    }
    gbg_particles_release(&particles);
    if (status == GBG_OK && scene->context->choice[0]) {
        gbg_log(scene->context, GBG_LOG_INFO, "%s", scene->context->choice);
    }
    return status;
}

int gbg_engine_destroy(struct gbg_engine **engine)
{
    if (engine) {
        gbg_engine_free(*engine);
        *engine = NULL;
    }
    return GBG_OK;
}

int gbg_engine_run(struct gbg_engine *engine, int64_t steps)
{
    if (!engine) {
        return no_engine("gbg_engine_run");
    }
    if (steps < 0) {
        return gbg_fail(engine->context, GBG_E_ARGUMENT,
                        "gbg_engine_run: steps is %lld, allowed "
                        "from 0",
                        (long long)steps);
    }
    if (engine->scene.dynamics == GBG_DYNAMICS_NONE) {
        return gbg_fail(engine->context, GBG_E_ORDER,
                        "gbg_engine_run: the scene has no dynamics: set "
                        "dynamics.kind to brownian and dynamics.dt");
    }
    return gbg_engine_advance(engine, steps);
}

int gbg_engine_size(const struct gbg_engine *engine, int64_t *n, int *dimension)
{
    if (!engine) {
        return no_engine("gbg_engine_size");
    }
    if (n) {
        *n = engine->state.owned;
    }
    if (dimension) {
        *dimension = engine->state.box.dimension;
    }
    return GBG_OK;
}

int gbg_engine_box(const struct gbg_engine *engine, double *lengths, double *origin)
{
    if (!engine) {
        return no_engine("gbg_engine_box");
    }
    for (int a = 0; a < engine->state.box.dimension; a++) {
        if (lengths) {
            lengths[a] = engine->state.box.length[a];
        }
        if (origin) {
            origin[a] = engine->state.box.origin[a];
        }
    }
    return GBG_OK;
}

/* Checks of a call that fills or reads arrays of all n particles. */
static int check_arrays(const struct gbg_engine *engine, const char *call, int64_t n, const void *x,
                        const void *y, const void *z, ptrdiff_t step)
{
    if (!engine) {
        return no_engine(call);
    }
    if (n != engine->state.owned) {
        return gbg_fail(engine->context, GBG_E_ARGUMENT,
                        "%s: n is %lld, the engine has %lld "
                        "particles",
                        call, (long long)n, (long long)engine->state.owned);
    }
    int missing = !x ? 0 : !y ? 1 : (!z && engine->state.box.dimension == 3) ? 2 : -1;
    if (n > 0 && missing >= 0) {
        return gbg_fail(engine->context, GBG_E_ARGUMENT, "%s: %c is NULL", call, "xyz"[missing]);
    }
    if (n > 1 && step == 0) {
        return gbg_fail(engine->context, GBG_E_ARGUMENT,
                        "%s: step is 0: all particles would share "
                        "one element",
                        call);
    }
    return GBG_OK;
}

int gbg_engine_positions(struct gbg_engine *engine, int wrapped, int64_t n, double *x, double *y,
                         double *z, ptrdiff_t step)
{
    double *base[3] = {x, y, z};
    int status = check_arrays(engine, "gbg_engine_positions", n, x, y, z, step);
    if (status == GBG_OK && !wrapped && !engine->state.image[0]) {
        status = gbg_fail(engine->context, GBG_E_ORDER,
                          "gbg_engine_positions: wrapped is 0 but the "
                          "scene keeps no image counts; set output.trajectory.unwrapped to 1");
    }
    for (int a = 0; status == GBG_OK && a < engine->state.box.dimension; a++) {
        status = gbg_engine_decode(engine, wrapped, a, base[a], step);
    }
    return status;
}

int gbg_engine_set_positions(struct gbg_engine *engine, int64_t n, const double *x, const double *y,
                             const double *z, ptrdiff_t step)
{
    int status = check_arrays(engine, "gbg_engine_set_positions", n, x, y, z, step);
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_points points = {n, {x, y, z}, step};
    int64_t bad = gbg_points_first_bad(&points, engine->state.box.dimension);
    if (bad >= 0) {
        return gbg_fail(engine->context, GBG_E_ARGUMENT,
                        "gbg_engine_set_positions: particle %lld has "
                        "a coordinate that is not a finite number",
                        (long long)bad);
    }
    return gbg_engine_replace(engine, &points);
}

/* Copies n values an axis from the order of ids to that of the caller. */
static void reorder(const struct gbg_engine *engine, const double *from, double *to, ptrdiff_t step)
{
    for (int64_t k = 0; k < engine->state.owned; k++) {
        to[k * step] = from[gbg_engine_rank(engine, k)];
    }
}

int gbg_engine_forces(struct gbg_engine *engine, int64_t n, double *x, double *y, double *z,
                      ptrdiff_t step)
{
    double *base[3] = {x, y, z}, *force[3] = {NULL, NULL, NULL};
    int status = check_arrays(engine, "gbg_engine_forces", n, x, y, z, step);
    int dimension = engine ? engine->state.box.dimension : 0;
    for (int a = 0; status == GBG_OK && a < dimension; a++) {
        status = gbg_allocate(engine->context, (void **)&force[a], n, sizeof *force[a], "forces");
    }
    if (status == GBG_OK) {
        status = gbg_engine_copy_forces(engine, force);
    }
    for (int a = 0; a < dimension; a++) {
        if (status == GBG_OK) {
            reorder(engine, force[a], base[a], step);
        }
        gbg_release(force[a]);
    }
    return status;
}

int gbg_engine_force_error(struct gbg_engine *engine, int64_t samples, double *rms_over_rms,
                           double *rms_over_median)
{
    double rms, median;
    if (!engine) {
        return no_engine("gbg_engine_force_error");
    }
    int status = gbg_engine_measure_error(engine, samples > 0 ? samples : 1000, &rms, &median);
    if (status == GBG_OK && rms_over_rms) {
        *rms_over_rms = rms;
    }
    if (status == GBG_OK && rms_over_median) {
        *rms_over_median = median;
    }
    return status;
}

int gbg_engine_get_sum(const struct gbg_engine *engine, int force, double *tolerance,
                       double *predicted, double *measured, int *refined)
{
    if (!engine) {
        return no_engine("gbg_engine_get_sum");
    }
    if (force < 0 || force >= engine->scene.n_forces) {
        return gbg_fail(engine->context, GBG_E_ARGUMENT,
                        "gbg_engine_get_sum: force %d is not one of the %d (counted from 0)", force,
                        engine->scene.n_forces);
    }
    const struct gbg_mesh_sum *sum = gbg_engine_mesh_sum(engine, force);
    if (!sum) {
        return gbg_fail(engine->context, GBG_E_ARGUMENT,
                        "gbg_engine_get_sum: force %d has another sum than lattice", force);
    }
    const double value[3] = {sum->tolerance, sum->predicted, sum->measured};
    double *const output[3] = {tolerance, predicted, measured};
    for (int i = 0; i < 3; i++) {
        if (output[i]) {
            *output[i] = value[i];
        }
    }
    if (refined) {
        *refined = sum->refined;
    }
    return GBG_OK;
}

int gbg_engine_species(struct gbg_engine *engine, int64_t n, int32_t *species, int base)
{
    struct gbg_engine_view view;
    int status = check_arrays(engine, "gbg_engine_species", n, species, species, species, 1);
    if (status == GBG_OK) {
        status = gbg_engine_look(engine, &view);
    }
    for (int64_t k = 0; status == GBG_OK && k < n; k++) {
        species[k] = view.species[gbg_engine_rank(engine, k)] + base;
    }
    return status;
}

int gbg_engine_ids(struct gbg_engine *engine, int64_t n, int64_t *ids)
{
    struct gbg_engine_view view;
    int status = check_arrays(engine, "gbg_engine_ids", n, ids, ids, ids, 1);
    if (status == GBG_OK) {
        status = gbg_engine_look(engine, &view);
    }
    for (int64_t k = 0; status == GBG_OK && k < n; k++) {
        ids[k] = view.id[gbg_engine_rank(engine, k)];
    }
    return status;
}

int gbg_engine_overlapped(struct gbg_engine *engine, int64_t n, int32_t *flags)
{
    int32_t *sorted = NULL;
    int status = check_arrays(engine, "gbg_engine_overlapped", n, flags, flags, flags, 1);
    if (status == GBG_OK) {
        status = gbg_allocate(engine->context, (void **)&sorted, n, sizeof *sorted, "flags");
    }
    if (status == GBG_OK) {
        status = gbg_engine_copy_overlap(engine, sorted);
    }
    for (int64_t k = 0; status == GBG_OK && k < n; k++) {
        flags[k] = sorted[gbg_engine_rank(engine, k)];
    }
    gbg_release(sorted);
    return status;
}

static const char *const integer_names[] = {
    "step",           "particles",       "species",       "threads",  "list_builds",
    "contact_rounds", "contact_pairs",   "reverted",      "repeated", "events_left",
    "unsettled",      "unsettled_pairs", "overlaps_left", NULL};

int gbg_engine_integer(struct gbg_engine *engine, const char *name, int64_t *value)
{
    if (!engine || !name || !value) {
        return gbg_fail(engine ? engine->context : NULL, GBG_E_ARGUMENT,
                        "gbg_engine_integer: engine, "
                        "name or value is NULL");
    }
    int64_t builds = 0;
    builds += engine->pairs ? engine->kernels->list_builds(engine->pairs) : 0;
    builds += engine->contacts ? engine->kernels->list_builds(engine->contacts) : 0;
    const int64_t values[] = {(int64_t)engine->step,
                              engine->state.owned,
                              engine->state.n_species,
                              engine->context->threads,
                              builds,
                              engine->contact_rounds,
                              engine->contact_pairs,
                              engine->reverted,
                              engine->repeated,
                              engine->events_left,
                              engine->unsettled,
                              engine->unsettled_pairs,
                              0};
    int k = gbg_text_find(name, integer_names);
    if (k < 0) {
        return gbg_fail(engine->context, GBG_E_NAME,
                        "gbg_engine_integer: no integer \"%s\"; nearest: "
                        "%s",
                        name, gbg_text_nearest(name, integer_names));
    }
    if (strcmp(name, "overlaps_left") == 0) {
        return gbg_engine_count_overlaps(engine, value);
    }
    *value = values[k];
    return GBG_OK;
}

static const char *const real_names[] = {"time",           "dt",
                                         "seconds",        "largest_move",
                                         "packing",        "bytes_per_particle",
                                         "contact_virial", "reverted_fraction",
                                         "check_seconds",  NULL};

int gbg_engine_real(const struct gbg_engine *engine, const char *name, double *value)
{
    if (!engine || !name || !value) {
        return gbg_fail(engine ? engine->context : NULL, GBG_E_ARGUMENT,
                        "gbg_engine_real: engine, "
                        "name or value is NULL");
    }
    const double values[] = {(double)engine->step * engine->scene.dt,
                             engine->scene.dt,
                             engine->seconds,
                             engine->step > 0 ? engine->moves.total : 0.0,
                             gbg_scene_packing(&engine->scene),
                             gbg_engine_bytes(engine),
                             engine->contact_virial,
                             gbg_engine_reverted_fraction(engine),
                             engine->check_seconds};
    int k = gbg_text_find(name, real_names);
    if (k < 0) {
        return gbg_fail(engine->context, GBG_E_NAME, "gbg_engine_real: no real \"%s\"; nearest: %s",
                        name, gbg_text_nearest(name, real_names));
    }
    *value = values[k];
    return GBG_OK;
}

int gbg_engine_plan_size(const struct gbg_engine *engine, int *lines)
{
    if (!engine || !lines) {
        return gbg_fail(engine ? engine->context : NULL, GBG_E_ARGUMENT,
                        "gbg_engine_plan_size: engine "
                        "or lines is NULL");
    }
    *lines = engine->n_plan;
    return GBG_OK;
}

int gbg_engine_plan_line(const struct gbg_engine *engine, int line, int64_t capacity, char *text)
{
    if (!engine || !text || capacity < 1) {
        return gbg_fail(engine ? engine->context : NULL, GBG_E_ARGUMENT,
                        "gbg_engine_plan_line: engine "
                        "or text is NULL, or capacity below 1");
    }
    if (line < 0 || line >= engine->n_plan) {
        return gbg_fail(engine->context, GBG_E_ARGUMENT,
                        "gbg_engine_plan_line: line is %d, allowed 0 "
                        "to %d",
                        line, engine->n_plan - 1);
    }
    const struct gbg_plan_step *step = &engine->plan[line];
    int length =
        snprintf(text, (size_t)capacity, "%s | %s | %.3g", step->kernel, step->what, step->bytes);
    if (length >= capacity) {
        return gbg_fail(engine->context, GBG_E_SPACE,
                        "gbg_engine_plan_line: capacity is %lld, %d "
                        "needed",
                        (long long)capacity, length + 1);
    }
    return GBG_OK;
}

int gbg_engine_hash(struct gbg_engine *engine, int64_t capacity, char *text)
{
    if (!engine || !text || capacity < 65) {
        return gbg_fail(engine ? engine->context : NULL, GBG_E_ARGUMENT,
                        "gbg_engine_hash: engine or "
                        "text is NULL, or capacity below 65");
    }
    return gbg_engine_digest(engine, text);
}
