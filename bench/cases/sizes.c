/* Benchmark: whole steps of scene S10 from four million particles up to what memory holds (S9). */
#include <stdio.h>
#include <sys/resource.h>

#include "backend/backend.h"
#include "bench/bench.h"
#include "bench/cases/suspension.h"
#include "core/context.h"
#include "gamboge/gamboge.h"

/* 6 times 20 steps, five of which are timed: 100 steps. */
enum { TIMES = 5, STEPS = 20, SETTINGS = 3 };

static const struct gbg_bench_suspension settings[SETTINGS] = {
    {"S10, no hard cores", GBG_BENCH_S10, NULL, GBG_BENCH_LATTICE},
    {"S10, hard cores certified", GBG_BENCH_S10, "bounce", GBG_BENCH_LATTICE},
    {"S10, rule bridge", GBG_BENCH_S10, "bridge", GBG_BENCH_LATTICE},
};

/* Pairs that overlap now, by the engine's search of all cells: the caller's arrays of such a system
 * would take more memory than its state. */
static int check_cores(struct gbg_bench *bench, struct gbg_engine *engine,
                       struct gbg_bench_result *line)
{
    int64_t left = 0, reverted = 0;
    int status = gbg_engine_integer(engine, "overlaps_left", &left);
    status = status ? status : gbg_engine_integer(engine, "reverted", &reverted);
    if (status == GBG_OK && left > 0) {
        status = gbg_fail(bench->context, GBG_E_OVERLAP, "%lld pairs overlap after the timing",
                          (long long)left);
    }
    gbg_bench_extra(line, "reverted", (double)reverted);
    return status;
}

/* Largest memory that the process ever had, of which little is not this system's. */
static double host_bytes(void)
{
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) == 0 ? 1024.0 * (double)usage.ru_maxrss : 0.0;
}

/* Memory of the device that is free now; 0: the backend has none of its own. */
static double free_bytes(const struct gbg_bench *bench)
{
    const struct gbg_backend *backend = gbg_backend_find(bench->context->backend);
    return backend->free_bytes ? backend->free_bytes(bench->context) : 0.0;
}

static int make(struct gbg_bench *bench, const struct gbg_bench_suspension *s,
                struct gbg_engine **engine, struct gbg_bench_result *line)
{
    double bytes = 0.0, before = free_bytes(bench), began = gbg_bench_now();
    int status = gbg_bench_suspend(bench->context, s, line->n, engine);
    gbg_bench_extra(line, "seconds to the start", gbg_bench_now() - began);
    gbg_bench_extra(line, "peak host bytes a particle", host_bytes() / (double)line->n);
    status = status ? status : gbg_engine_run(*engine, STEPS);
    status = status ? status : gbg_engine_real(*engine, "bytes_per_particle", &bytes);
    gbg_bench_extra(line, "bytes a particle", bytes);
    if (before > 0.0) {
        gbg_bench_extra(line, "device bytes a particle",
                        (before - free_bytes(bench)) / (double)line->n);
    }
    return status;
}

static int measure(struct gbg_bench *bench, const struct gbg_bench_suspension *s, int64_t n)
{
    struct gbg_bench_steps job = {NULL, STEPS};
    struct gbg_bench_result line = {.what = s->what,
                                    .precision = "mixed",
                                    .unit = "particle-steps",
                                    .n = n,
                                    .work = (double)n * STEPS,
                                    .allowed = 1e-6};
    int status = make(bench, s, &job.engine, &line);
    status = status ? status : gbg_bench_time_steps(&job, TIMES, &line);
    if (status == GBG_OK && s->rule) {
        status = check_cores(bench, job.engine, &line);
    }
    status = status ? status
                    : gbg_engine_force_error(job.engine, 1000, &line.error_rms, &line.error_median);
    gbg_engine_destroy(&job.engine);
    return status ? gbg_bench_leave_out(bench, s->what, n, status) : gbg_bench_report(bench, &line);
}

static int run(struct gbg_bench *bench)
{
    static const int64_t small[] = {1 << 14, 0},
                         large[] = {1 << 22, 1 << 24, 1 << 26, 1 << 28, 1 << 30, 0};
    int64_t size[16];
    int n_sizes = gbg_bench_sizes(bench, bench->options->quick ? small : large, 1 << 14, size);
    int status = GBG_OK;
    for (int k = 0; k < n_sizes; k++) {
        for (int s = 0; s < SETTINGS && status == GBG_OK; s++) {
            if (gbg_bench_wanted(bench, settings[s].what)) {
                status = measure(bench, &settings[s], size[k]);
            }
        }
    }
    return status;
}

const struct gbg_bench_case gbg_bench_sizes_case = {
    "sizes", "whole steps of S10 from 2^22 to 2^30, as far as memory goes, bytes a particle", run};
