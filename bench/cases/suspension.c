/* Benchmark: suspensions in the plane that several cases run: an engine of them, and its checks. */
#include "bench/cases/suspension.h"

#include "bench/bench.h"
#include "core/context.h"
#include "core/memory.h"
#include "gamboge/gamboge.h"

static const double diameter = 1.0, temperature = 0.01;

static int add_species(struct gbg_scene *scene, const struct gbg_bench_suspension *s)
{
    static const char *const names[2] = {"A", "B"};
    int index, n_species = s->share < 1.0 ? 2 : 1, status = GBG_OK;
    for (int k = 0; k < n_species && status == GBG_OK; k++) {
        status = gbg_scene_add_species(scene, names[k], diameter, s->alpha[k], s->mobility[k],
                                       k ? 1.0 - s->share : s->share, -1, &index);
    }
    return status;
}

static int set_start(struct gbg_scene *scene, const struct gbg_bench_suspension *s, int64_t n)
{
    int status = gbg_scene_set_real(scene, "box.packing", s->packing);
    status = status ? status : gbg_scene_set_integer(scene, "particles.count", n);
    if (status == GBG_OK && s->start == GBG_BENCH_SCATTERED) {
        return gbg_scene_set_text(scene, "particles.start.random", "insertion");
    }
    status = status ? status : gbg_scene_set_text(scene, "particles.start.lattice", "triangular");
    status = status ? status
                    : gbg_scene_set_real(scene, "particles.start.jitter",
                                         s->vacancies > 0.0 ? 0.05 : 0.5);
    if (status == GBG_OK && s->vacancies > 0.0) {
        status = gbg_scene_set_real(scene, "particles.start.vacancies", s->vacancies);
    }
    return status;
}

/* With the noise of the thesis where the start is that of its scenes. */
static int set_dynamics(struct gbg_scene *scene, const struct gbg_bench_suspension *s)
{
    int status = gbg_scene_set_real(scene, "dynamics.dt", s->dt);
    status = status ? status : gbg_scene_set_real(scene, "dynamics.temperature", temperature);
    if (status == GBG_OK && s->vacancies > 0.0) {
        status = gbg_scene_set_real(scene, "dynamics.noise.limit", 3.0);
        status = status ? status : gbg_scene_set_text(scene, "dynamics.noise.limit_by", "clamp");
    }
    return status;
}

int gbg_bench_suspend(struct gbg_context *context, const struct gbg_bench_suspension *suspension,
                      int64_t n, struct gbg_engine **engine)
{
    const struct gbg_bench_suspension *s = suspension;
    struct gbg_scene *scene = NULL;
    int status = gbg_scene_create(context, 2, &scene);
    status = status ? status : add_species(scene, s);
    status = status ? status : set_start(scene, s, n);
    status =
        status ? status
               : gbg_scene_add_force(scene, s->power, s->cutoff > 0.0 ? "cutoff" : "minimum_image",
                                     s->cutoff, 0.0);
    if (status == GBG_OK && s->rule) {
        status = gbg_scene_set_text(scene, "excluded_volume.rule", s->rule);
    }
    status = status ? status : set_dynamics(scene, s);
    status = status ? status : gbg_engine_create(scene, engine);
    gbg_scene_destroy(&scene);
    return status;
}

int gbg_bench_check_cores(struct gbg_context *context, struct gbg_engine *engine, int64_t n)
{
    double lengths[2], *r;
    int64_t count = 0;
    int status = gbg_allocate(context, (void **)&r, 3 * n, sizeof *r, "check of cores");
    status = status ? status : gbg_engine_box(engine, lengths, NULL);
    for (int64_t i = 0; status == GBG_OK && i < n; i++) {
        r[2 * n + i] = diameter;
    }
    status = status ? status : gbg_engine_positions(engine, 1, n, r, r + n, NULL, 1);
    status = status ? status
                    : gbg_overlaps_find(context, 2, lengths, n, r, r + n, NULL, 1, r + 2 * n, 1e-12,
                                        0, 0, NULL, NULL, &count);
    gbg_release(r);
    return status || count == 0
               ? status
               : gbg_fail(context, GBG_E_OVERLAP,
                          "%lld pairs of hard cores overlap after the timing", (long long)count);
}

int gbg_bench_make_steps(void *user)
{
    const struct gbg_bench_steps *job = user;
    return gbg_engine_run(job->engine, job->steps);
}

int gbg_bench_time_steps(struct gbg_bench_steps *job, int times, struct gbg_bench_result *line)
{
    int64_t builds[2], step[2];
    int status = gbg_engine_integer(job->engine, "list_builds", &builds[0]);
    status = status ? status : gbg_engine_integer(job->engine, "step", &step[0]);
    if (status == GBG_OK) {
        status = times > 0
                     ? gbg_bench_time_exactly(gbg_bench_make_steps, job, times, &line->seconds)
                     : gbg_bench_time(gbg_bench_make_steps, job, &line->seconds);
    }
    status = status ? status : gbg_engine_integer(job->engine, "list_builds", &builds[1]);
    status = status ? status : gbg_engine_integer(job->engine, "step", &step[1]);
    if (status == GBG_OK) {
        gbg_bench_extra(line, "lists per 1000 steps",
                        1e3 * (double)(builds[1] - builds[0]) / (double)(step[1] - step[0]));
    }
    return status;
}
