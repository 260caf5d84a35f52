/* Estimators: engines from a few numbers, and what their steps cost. */
#include <stddef.h>
#include <time.h>

#include "bench/estimators/estimators.h"

static double now(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int fill(struct gbg_scene *scene, const struct gbg_sample *sample, int64_t n,
                const double *x, const double *y, const int32_t *species)
{
    static const char *const names[2] = {"A", "B"};
    double lengths[2] = {sample->edge, sample->edge};
    int index, status = gbg_scene_set_box(scene, lengths, NULL);
    for (int s = 0; status == GBG_OK && s < sample->species; s++) {
        status = gbg_scene_add_species(scene, names[s], 1.0, sample->alpha[s], sample->mobility[s],
                                       -1.0, -1, &index);
    }
    if (status == GBG_OK && sample->power > 0.0) {
        status = gbg_scene_add_force(scene, sample->power, "cutoff", sample->cutoff, 0.0);
    }
    if (status == GBG_OK && sample->precision) {
        status = gbg_scene_set_text(scene, "precision.mode", sample->precision);
    }
    if (status == GBG_OK && sample->rule) {
        status = gbg_scene_set_text(scene, "excluded_volume.rule", sample->rule);
    }
    status = status ? status : gbg_scene_set_real(scene, "dynamics.dt", sample->dt);
    status =
        status ? status : gbg_scene_set_real(scene, "dynamics.temperature", sample->temperature);
    status = status ? status : gbg_scene_set_integer(scene, "output.trajectory.unwrapped", 1);
    status = status ? status : gbg_scene_set_integer(scene, "run.seed", sample->seed);
    return status ? status : gbg_scene_add_particles(scene, n, x, y, NULL, 1, species, 0, NULL);
}

int gbg_sample_engine(struct gbg_context *context, const struct gbg_sample *sample, int64_t n,
                      const double *x, const double *y, const int32_t *species,
                      struct gbg_engine **engine)
{
    struct gbg_scene *scene = NULL;
    *engine = NULL;
    int status = gbg_scene_create(context, 2, &scene);
    status = status ? status : fill(scene, sample, n, x, y, species);
    status = status ? status : gbg_engine_create(scene, engine);
    gbg_scene_destroy(&scene);
    return status;
}

int gbg_rule_is_built(struct gbg_context *context, const char *rule)
{
    static const double x[2] = {2.0, 7.0}, y[2] = {5.0, 5.0};
    struct gbg_sample sample = {.rule = rule,
                                .edge = 10.0,
                                .dt = 1e-4,
                                .temperature = 1.0,
                                .species = 1,
                                .mobility = {1.0}};
    struct gbg_engine *engine = NULL;
    int status = gbg_sample_engine(context, &sample, 2, x, y, NULL, &engine);
    gbg_engine_destroy(&engine);
    return status == GBG_OK;
}

int gbg_work_run(struct gbg_engine *engine, int64_t steps, struct gbg_work *work)
{
    int64_t n = 0;
    double wall = now(CLOCK_MONOTONIC), core = now(CLOCK_PROCESS_CPUTIME_ID);
    int status = gbg_engine_run(engine, steps);
    gbg_engine_size(engine, &n, NULL);
    work->core += now(CLOCK_PROCESS_CPUTIME_ID) - core;
    work->wall += now(CLOCK_MONOTONIC) - wall;
    work->particle_steps += (double)n * (double)steps;
    return status;
}
