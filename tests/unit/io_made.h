/* Tests of files: engines with a state that is known for every step. */
#ifndef GBG_TESTS_IO_MADE_H
#define GBG_TESTS_IO_MADE_H

#include <string.h>

#include "made_files.h"

#include "core/random.h"
#include "engine/engine.h"
#include "gamboge/gamboge.h"

struct made {
    int dimension;
    int64_t n;
    const char *precision; /* "double" or "float" */
    int unwrapped, overlap, spread_ids;
    int64_t seed;
};

static inline void made_good(const struct gbg_context *context, int status)
{
    if (status != GBG_OK) {
        fail_msg("%s: %s", gbg_status_name(status), gbg_message(context));
    }
}

/* A call failed so, and the context's sentence holds these words. */
static inline void made_refused(const struct gbg_context *context, int status, int expected,
                                const char *words)
{
    if (status != expected || !strstr(gbg_message(context), words)) {
        fail_msg("%s instead of %s with \"%s\": %s", gbg_status_name(status),
                 gbg_status_name(expected), words, gbg_message(context));
    }
}

/* Fraction of the box, image count and overlap flag of particle i at a step: any bits at all. */
static inline uint64_t made_fraction(int64_t step, int64_t i, int axis)
{
    struct gbg_philox r =
        gbg_philox(gbg_philox_counter((uint64_t)step, (uint64_t)i, 200), (uint32_t)axis, 1);
    return (uint64_t)r.word[0] << 32 | r.word[1];
}

static inline int32_t made_image(int64_t step, int64_t i, int axis)
{
    return (int32_t)((step + 7 * i + 3 * axis) % 11 - 5);
}

static inline int32_t made_flag(int64_t step, int64_t i)
{
    return (int32_t)((step + i) % 3 == 0);
}

static inline int64_t made_id(const struct made *made, int64_t i)
{
    return made->spread_ids ? 5 + 3 * i + (i > 2 ? INT64_C(5000000000) : 0) : i;
}

static const double made_length[3] = {1250.5, 725.25, 900.0}, made_origin[3] = {-3.0, 0.5, 100.0};

static inline struct gbg_scene *made_scene(struct gbg_context *context, const struct made *made)
{
    struct gbg_scene *scene;
    int64_t count = made->n > 0 ? -1 : 0; /* from arrays, or none at all */
    made_good(context, gbg_scene_create(context, made->dimension, &scene));
    made_good(context, gbg_scene_set_box(scene, made_length, made_origin));
    made_good(context, gbg_scene_add_species(scene, "big", 1.25, -1, 1, -1, count, NULL));
    made_good(context, gbg_scene_add_species(scene, "small one", 0.1, 1, -2, -1, count, NULL));
    made_good(context, gbg_scene_set_real(scene, "dynamics.dt", 0.01));
    made_good(context, gbg_scene_set_real(scene, "dynamics.temperature", 0.02));
    made_good(context, gbg_scene_set_integer(scene, "run.seed", made->seed));
    made_good(context, gbg_scene_set_text(scene, "output.trajectory.precision", made->precision));
    made_good(context,
              gbg_scene_set_integer(scene, "output.trajectory.unwrapped", made->unwrapped));
    made_good(context, gbg_scene_set_integer(scene, "output.trajectory.overlap", made->overlap));
    if (made->n == 0) {
        made_good(context, gbg_scene_set_text(scene, "particles.start.random", "insertion"));
    }
    if (made->overlap) {
        made_good(context, gbg_scene_set_text(scene, "excluded_volume.rule", "contact"));
    }
    for (int64_t i = 0; i < made->n; i++) {
        int32_t species = i % 3 == 1;
        int64_t id = made_id(made, i);
        double x[3] = {2.0 * (double)(i % 300), 2.0 * (double)(i / 300), 0.0};
        made_good(context, gbg_scene_add_particles(scene, 1, &x[0], &x[1],
                                                   made->dimension == 3 ? &x[2] : NULL, 1, &species,
                                                   0, &id));
    }
    return scene;
}

static inline struct gbg_engine *made_engine(struct gbg_context *context, const struct made *made)
{
    struct gbg_engine *engine;
    struct gbg_scene *scene = made_scene(context, made);
    made_good(context, gbg_engine_create(scene, &engine));
    gbg_scene_destroy(&scene);
    return engine;
}

/* Puts the known state of a step into the engine. */
static inline void made_set(struct gbg_engine *engine, int64_t step)
{
    int64_t n = engine->state.owned;
    int dimension = engine->state.box.dimension, images = engine->state.image[0] != NULL;
    uint64_t *fraction[3] = {NULL, NULL, NULL};
    int32_t *image[3] = {NULL, NULL, NULL};
    for (int a = 0; a < dimension; a++) {
        fraction[a] = malloc((size_t)n * sizeof **fraction);
        image[a] = malloc((size_t)n * sizeof **image);
        for (int64_t i = 0; i < n; i++) {
            fraction[a][i] = made_fraction(step, i, a);
            image[a][i] = made_image(step, i, a);
        }
    }
    made_good(engine->context,
              gbg_engine_restore(engine, (uint64_t)step, (const uint64_t *const *)fraction,
                                 images ? (const int32_t *const *)image : NULL));
    for (int64_t i = 0; engine->state.overlapped && i < n; i++) {
        engine->state.overlapped[i] = (uint8_t)made_flag(step, i);
    }
    for (int a = 0; a < dimension; a++) {
        free(fraction[a]);
        free(image[a]);
    }
}

/* Frames with the known states of these steps. */
static inline void made_append(struct gbg_trajectory *trajectory, struct gbg_engine *engine,
                               int first, int last)
{
    for (int step = first; step <= last; step++) {
        made_set(engine, step);
        made_good(engine->context, gbg_trajectory_append(trajectory, engine));
    }
}

/* The coordinate that a file should hold, computed apart from core/box.h: within 2^-52 of the box.
 */
static inline double made_coordinate(int64_t step, int64_t i, int axis)
{
    long double fraction = (long double)made_fraction(step, i, axis) / 18446744073709551616.0L;
    return (double)(made_origin[axis] + made_length[axis] * fraction);
}

static inline int made_close(struct gbg_context **context, int failed)
{
    gbg_context_destroy(context);
    return failed;
}

/* Runs tests of files with a context of that text at *context: what main returns. */
#define made_run(tests, text, context)                                                             \
    (gbg_context_create(text, context) == GBG_OK                                                   \
         ? made_close(context, cmocka_run_group_tests(tests, made_start, made_stop))               \
         : 1)

#endif
