/* Benchmark: the whole Brownian step with short-range forces, with and without hard cores. */
#include <string.h>

#include "bench/bench.h"
#include "bench/cases/suspension.h"
#include "core/context.h"
#include "gamboge/gamboge.h"

/* C3 and C4 of Carter 2016 with the cut-off of S10 and his dt. */
#define C3 0.79, 0.01, 0.5, {-1, 1}, {1, -2}, 6.0, 2.5, 0.0
#define C4 0.0873, 0.01, 0.5, {1, -1}, {1, -4}, 6.0, 2.5, 0.0
#define SPARSE 0.3, 0.001, 1.0, {1}, {1}, 6.0, 2.5, 0.0

static const struct gbg_bench_suspension settings[] = {
    {"S10, hard cores certified", GBG_BENCH_S10, "bounce", GBG_BENCH_LATTICE},
    {"S10, no hard cores", GBG_BENCH_S10, NULL, GBG_BENCH_LATTICE},
    {"C3 short, hard cores", C3, "bounce", GBG_BENCH_LATTICE},
    {"C4 short, hard cores", C4, "bounce", GBG_BENCH_LATTICE},
    {"S10, rule bridge", GBG_BENCH_S10, "bridge", GBG_BENCH_LATTICE},
    {"C3 short, rule bridge", C3, "bridge", GBG_BENCH_LATTICE},
    {"C4 short, rule bridge", C4, "bridge", GBG_BENCH_LATTICE},
    {"packing 0.3, random start", SPARSE, "bounce", GBG_BENCH_SCATTERED},
};
enum { SETTINGS = sizeof settings / sizeof *settings, WARM_UP = 300, STEPS = 50 };
/* Random starts, whose order in memory matters when they are large, have one size of their own. */
enum { RANDOM_N = 1000000, RANDOM_WARM_UP = 40, RANDOM_STEPS = 10 };

static int measure(struct gbg_bench *bench, const struct gbg_bench_suspension *setting, int64_t n)
{
    struct gbg_engine *engine = NULL;
    int random = setting->start == GBG_BENCH_SCATTERED;
    struct gbg_bench_steps job = {.steps = random ? RANDOM_STEPS : STEPS};
    struct gbg_bench_result result = {.what = setting->what,
                                      .precision = "mixed",
                                      .unit = "particle-steps",
                                      .n = n,
                                      .work = (double)(n * job.steps),
                                      .allowed = 1e-6};
    int status = gbg_bench_suspend(bench->context, setting, n, &engine);
    status = status ? status : gbg_engine_run(engine, random ? RANDOM_WARM_UP : WARM_UP);
    status = status ? status
                    : gbg_engine_force_error(engine, 1000, &result.error_rms, &result.error_median);
    job.engine = engine;
    status = status ? status : gbg_bench_time_steps(&job, 0, &result);
    if (status == GBG_OK && setting->rule) {
        status = gbg_bench_check_cores(bench->context, engine, n);
    }
    gbg_engine_destroy(&engine);
    return status ? gbg_bench_leave_out(bench, setting->what, n, status)
                  : gbg_bench_report(bench, &result);
}

/* Whether a line is asked for, of those with such a start. */
static int is_wanted(struct gbg_bench *bench, int s, int start)
{
    return settings[s].start == start && gbg_bench_wanted(bench, settings[s].what);
}

static int run(struct gbg_bench *bench)
{
    static const int64_t on_host[] = {4096, 65536, 0};
    static const int64_t on_device[] = {1 << 10, 1 << 14, 1 << 17, 1 << 20, 1 << 22, 0};
    int device = strcmp(bench->context->backend, "cuda") == 0;
    int64_t size[16];
    int n_sizes = gbg_bench_sizes(bench, device ? on_device : on_host, 4096, size);
    int status = GBG_OK;
    for (int k = 0; k < n_sizes; k++) {
        for (int s = 0; s < SETTINGS && status == GBG_OK; s++) {
            status = is_wanted(bench, s, GBG_BENCH_LATTICE) ? measure(bench, &settings[s], size[k])
                                                            : GBG_OK;
        }
    }
    int64_t n = bench->options->n > 0 ? bench->options->n : RANDOM_N;
    for (int s = 0; s < SETTINGS && status == GBG_OK && !bench->options->quick; s++) {
        status =
            is_wanted(bench, s, GBG_BENCH_SCATTERED) ? measure(bench, &settings[s], n) : GBG_OK;
    }
    return status;
}

const struct gbg_bench_case gbg_bench_short_range = {
    "short-range", "whole step, r/r^7 cut at 2.5, with and without hard cores (S10, C3, C4)", run};
