/* Benchmarks: normal deviates of the noise tape. */
#include "bench/bench.h"

#include <math.h>
#include <stdlib.h>

#include "core/memory.h"
#include "core/random.h"
#include "gamboge/kernels.h"

struct job {
    struct gbg_context *context;
    int dimension;
    int64_t n;
    double *values;
};

static int evaluate(void *user)
{
    const struct job *job = user;
    return gbg_normals(job->context, 1, 2, 3, 0, job->dimension, job->n, job->values);
}

/* The same deviate in double precision with the C library's functions. */
static double exact(int64_t id, int axis)
{
    struct gbg_philox w = gbg_philox(gbg_philox_counter(3, (uint64_t)id, GBG_STREAM_NOISE), 1, 2);
    uint32_t distance = w.word[axis == 2 ? 2 : 0], direction = w.word[axis == 2 ? 3 : 1];
    double u = ((double)(distance >> 1) + 0.5) * 0x1p-31;
    double quarters = (double)(direction >> 30) + (double)(int32_t)(direction << 2) * 0x1p-32;
    double angle = quarters * 1.57079632679489661923;
    return sqrt(-2.0 * log(u)) * (axis == 1 ? sin(angle) : cos(angle));
}

static void measure_error(const struct job *job, struct gbg_bench_result *result)
{
    double error = 0.0, size = 0.0;
    int64_t sample = job->n < 100000 ? job->n : 100000;
    for (int64_t i = 0; i < sample; i++) {
        for (int a = 0; a < job->dimension; a++) {
            double value = exact(i, a), difference = job->values[i * job->dimension + a] - value;
            error += difference * difference;
            size += value * value;
        }
    }
    result->error_rms = sqrt(error / size);
    result->error_median = NAN;
}

static int run_one(struct gbg_bench *bench, int dimension, int64_t n)
{
    struct job job = {bench->context, dimension, n, NULL};
    struct gbg_bench_result result = {.what = dimension == 2 ? "2 a particle" : "3 a particle",
                                      .precision = "single",
                                      .unit = "deviates",
                                      .n = n,
                                      .work = (double)(n * dimension),
                                      .allowed = 2e-7};
    if (!gbg_bench_wanted(bench, result.what)) {
        return 0;
    }
    int status = gbg_allocate(bench->context, (void **)&job.values, n * dimension,
                              sizeof *job.values, "deviates");
    if (status == 0) {
        status = gbg_bench_time(evaluate, &job, &result.seconds);
    }
    if (status == 0) {
        measure_error(&job, &result);
        status = gbg_bench_report(bench, &result);
    }
    gbg_release(job.values);
    return status;
}

static int run(struct gbg_bench *bench)
{
    static const int64_t list[] = {1 << 10, 1 << 16, 1 << 20, 1 << 24, 0};
    int64_t size[16];
    int sizes = gbg_bench_sizes(bench, list, 1 << 16, size), status = 0;
    for (int dimension = 2; dimension <= 3; dimension++) {
        for (int k = 0; k < sizes && status == 0; k++) {
            status = run_one(bench, dimension, size[k]);
        }
    }
    return status;
}

const struct gbg_bench_case gbg_bench_noise = {
    "noise", "normal deviates of the noise tape; error against libm in double", run};
