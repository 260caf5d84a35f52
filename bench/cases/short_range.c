/* Benchmark: the whole Brownian step with short-range forces, with and without hard cores. */
#include <math.h>
#include <stdlib.h>

#include "bench/bench.h"
#include "gamboge/gamboge.h"

/* Scene S10: one species, r/r^7 cut at 2.5, packing 0.52, T 0.01, dt 0.001; C3 and C4 of Carter
 * 2016 with the same cut-off and his dt. */
struct setting {
    const char *what;
    double packing, dt, alpha[2], mobility[2];
    int n_species;
    const char *rule; /* NULL: no hard cores */
    int random;       /* 1: start by random insertion, so that memory and space begin apart */
};

static const struct setting settings[] = {
    {"S10, hard cores certified", 0.52, 0.001, {1, 0}, {1, 0}, 1, "bounce", 0},
    {"S10, no hard cores", 0.52, 0.001, {1, 0}, {1, 0}, 1, NULL, 0},
    {"C3 short, hard cores", 0.79, 0.01, {-1, 1}, {1, -2}, 2, "bounce", 0},
    {"C4 short, hard cores", 0.0873, 0.01, {1, -1}, {1, -4}, 2, "bounce", 0},
    {"S10, rule bridge", 0.52, 0.001, {1, 0}, {1, 0}, 1, "bridge", 0},
    {"C3 short, rule bridge", 0.79, 0.01, {-1, 1}, {1, -2}, 2, "bridge", 0},
    {"C4 short, rule bridge", 0.0873, 0.01, {1, -1}, {1, -4}, 2, "bridge", 0},
    {"packing 0.3, random start", 0.3, 0.001, {1, 0}, {1, 0}, 1, "bounce", 1},
};
enum { SETTINGS = sizeof settings / sizeof *settings, WARM_UP = 300, STEPS = 50 };
/* Random starts, whose order in memory matters when they are large, have one size of their own. */
enum { RANDOM_N = 1000000, RANDOM_WARM_UP = 40, RANDOM_STEPS = 10 };

static int make(struct gbg_context *context, const struct setting *setting, int64_t n,
                struct gbg_engine **engine)
{
    struct gbg_scene *scene = NULL;
    int index, status = gbg_scene_create(context, 2, &scene);
    const char *names[2] = {"A", "B"};
    for (int s = 0; status == GBG_OK && s < setting->n_species; s++) {
        status = gbg_scene_add_species(scene, names[s], 1.0, setting->alpha[s],
                                       setting->mobility[s], 1.0 / setting->n_species, -1, &index);
    }
    status = status ? status : gbg_scene_set_real(scene, "box.packing", setting->packing);
    status = status ? status : gbg_scene_set_integer(scene, "particles.count", n);
    if (status == GBG_OK && setting->random) {
        status = gbg_scene_set_text(scene, "particles.start.random", "insertion");
    } else if (status == GBG_OK) {
        status = gbg_scene_set_text(scene, "particles.start.lattice", "triangular");
        status = status ? status : gbg_scene_set_real(scene, "particles.start.jitter", 0.5);
    }
    status = status ? status : gbg_scene_add_force(scene, 6.0, "cutoff", 2.5, 0.0);
    if (setting->rule && status == GBG_OK) {
        status = gbg_scene_set_text(scene, "excluded_volume.rule", setting->rule);
    }
    status = status ? status : gbg_scene_set_real(scene, "dynamics.dt", setting->dt);
    status = status ? status : gbg_scene_set_real(scene, "dynamics.temperature", 0.01);
    status = status ? status : gbg_engine_create(scene, engine);
    gbg_scene_destroy(&scene);
    return status;
}

struct job {
    struct gbg_engine *engine;
    int64_t steps;
};

static int evaluate(void *user)
{
    const struct job *job = user;
    return gbg_engine_run(job->engine, job->steps);
}

/* GBG_E_OVERLAP if a pair overlaps at the end of the timing. */
static int check_cores(struct gbg_context *context, struct gbg_engine *engine, int64_t n)
{
    double lengths[2], *r = malloc((size_t)n * 3 * sizeof *r);
    int64_t count = 0;
    int status = r ? gbg_engine_box(engine, lengths, NULL) : GBG_E_MEMORY;
    for (int64_t i = 0; status == GBG_OK && i < n; i++) {
        r[2 * n + i] = 1.0;
    }
    status = status ? status : gbg_engine_positions(engine, 1, n, r, r + n, NULL, 1);
    status = status ? status
                    : gbg_overlaps_find(context, 2, lengths, n, r, r + n, NULL, 1, r + 2 * n, 1e-12,
                                        0, 0, NULL, NULL, &count);
    free(r);
    return status ? status : count > 0 ? GBG_E_OVERLAP : GBG_OK;
}

static int measure(struct gbg_bench *bench, const struct setting *setting, int64_t n)
{
    struct gbg_engine *engine = NULL;
    struct job job = {.steps = setting->random ? RANDOM_STEPS : STEPS};
    struct gbg_bench_result result = {.what = setting->what,
                                      .precision = "mixed",
                                      .unit = "particle-steps",
                                      .n = n,
                                      .work = (double)(n * job.steps),
                                      .allowed = 1e-6};
    int status = make(bench->context, setting, n, &engine);
    status = status ? status : gbg_engine_run(engine, setting->random ? RANDOM_WARM_UP : WARM_UP);
    status = status ? status
                    : gbg_engine_force_error(engine, 1000, &result.error_rms, &result.error_median);
    job.engine = engine;
    status = status ? status : gbg_bench_time(evaluate, &job, &result.seconds);
    if (status == GBG_OK && setting->rule) {
        status = check_cores(bench->context, engine, n);
    }
    gbg_engine_destroy(&engine);
    return status ? status : gbg_bench_report(bench, &result);
}

static int run(struct gbg_bench *bench)
{
    static const int64_t list[] = {4096, 65536, 0};
    int64_t size[16];
    int n_sizes = gbg_bench_sizes(bench, list, 4096, size), status = GBG_OK;
    for (int k = 0; k < n_sizes; k++) {
        for (int s = 0; s < SETTINGS && status == GBG_OK; s++) {
            status = settings[s].random ? GBG_OK : measure(bench, &settings[s], size[k]);
        }
    }
    int64_t n = bench->options->n > 0 ? bench->options->n : RANDOM_N;
    for (int s = 0; s < SETTINGS && status == GBG_OK && !bench->options->quick; s++) {
        status = settings[s].random ? measure(bench, &settings[s], n) : GBG_OK;
    }
    return status;
}

const struct gbg_bench_case gbg_bench_short_range = {
    "short-range", "whole step, r/r^7 cut at 2.5, with and without hard cores (S10, C3, C4)", run};
