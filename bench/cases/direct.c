/* Benchmarks: minimum-image sums over all pairs (goals S1, S2): steps of particles that stand
 * still, so that no copy to or from a GPU is timed. */
#include "bench/bench.h"

#include <math.h>
#include <stdlib.h>

#include "core/memory.h"
#include "core/random.h"
#include "gamboge/gamboge.h"

enum { TARGETS = 1000 };

struct job {
    struct gbg_context *context;
    struct gbg_engine *engine;
    const char *precision;
    int dimension;
    double power, length[3];
    int64_t n;
    double *position[3], *force[3];
    int32_t *species;
};

/* Strength and mobility of the two species, which take turns. */
static const double alpha[2] = {-1.0, 1.0}, mobility[2] = {1.0, -2.0};

/* A step so short that no coordinate changes. */
static int evaluate(void *user)
{
    const struct job *j = user;
    return gbg_engine_run(j->engine, 1);
}

static int make_engine(struct job *j)
{
    struct gbg_scene *scene = NULL;
    int index, status = gbg_scene_create(j->context, j->dimension, &scene);
    status = status ? status : gbg_scene_set_box(scene, j->length, NULL);
    for (int s = 0; s < 2 && status == GBG_OK; s++) {
        status = gbg_scene_add_species(scene, s ? "B" : "A", 1.0, alpha[s], mobility[s], -1.0, -1,
                                       &index);
    }
    status = status ? status : gbg_scene_add_force(scene, j->power, "minimum_image", 0.0, 0.0);
    status = status ? status : gbg_scene_set_text(scene, "precision.mode", j->precision);
    status = status ? status : gbg_scene_set_real(scene, "dynamics.dt", 1e-60);
    status = status ? status
                    : gbg_scene_add_particles(scene, j->n, j->position[0], j->position[1],
                                              j->position[2], 1, j->species, 0, NULL);
    status = status ? status : gbg_engine_create(scene, &j->engine);
    gbg_scene_destroy(&scene);
    return status;
}

/* Plain double-precision loop over all k, each component summed with compensation (Neumaier). */
static void reference(const struct job *j, int64_t i, double force[3])
{
    double lost[3] = {0.0, 0.0, 0.0}, half = -0.5 * (j->power + 1.0);
    force[0] = force[1] = force[2] = 0.0;
    for (int64_t k = 0; k < j->n; k++) {
        double r[3], squared = 0.0;
        for (int a = 0; a < j->dimension; a++) {
            r[a] = j->position[a][i] - j->position[a][k];
            r[a] -= j->length[a] * rint(r[a] / j->length[a]);
            squared += r[a] * r[a];
        }
        double strength = k == i            ? 0.0
                          : j->power == 2.0 ? alpha[j->species[k]] / (squared * sqrt(squared))
                                            : alpha[j->species[k]] * pow(squared, half);
        for (int a = 0; a < j->dimension; a++) {
            double term = strength * r[a], sum = force[a] + term;
            lost[a] +=
                fabs(force[a]) >= fabs(term) ? (force[a] - sum) + term : (term - sum) + force[a];
            force[a] = sum;
        }
    }
    for (int a = 0; a < j->dimension; a++) {
        force[a] = mobility[j->species[i]] * (force[a] + lost[a]);
    }
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* One random target out of each of up to TARGETS equal parts. */
static void measure_error(const struct job *j, struct gbg_bench_result *result)
{
    double error = 0.0, total = 0.0, size[TARGETS];
    int64_t targets = j->n < TARGETS ? j->n : TARGETS;
    for (int64_t t = 0; t < targets; t++) {
        int64_t begin = j->n * t / targets, end = j->n * (t + 1) / targets;
        struct gbg_philox w =
            gbg_philox(gbg_philox_counter(1, (uint64_t)t, GBG_STREAM_START), 1, 2);
        int64_t i = begin + (int64_t)(w.word[0] % (uint64_t)(end - begin));
        double exact[3], squared = 0.0;
        reference(j, i, exact);
        for (int a = 0; a < j->dimension; a++) {
            error += pow(j->force[a][i] - exact[a], 2.0);
            squared += exact[a] * exact[a];
        }
        total += squared;
        size[t] = sqrt(squared);
    }
    qsort(size, (size_t)targets, sizeof *size, ascending);
    result->error_rms = sqrt(error / total);
    result->error_median = sqrt(error / (double)targets) / size[targets / 2];
}

static int time_one(struct gbg_bench *bench, struct job *job, const char *what, int lattice)
{
    struct gbg_bench_result result = {.what = what, .precision = job->precision, .unit = "pairs"};
    job->n = gbg_bench_points(job->dimension, job->length, lattice, job->n, job->position);
    for (int64_t i = 0; i < job->n; i++) {
        job->species[i] = (int32_t)(i % 2);
    }
    result.n = job->n;
    result.work = (double)job->n * (double)(job->n - 1);
    result.allowed = job->precision[0] == 'd' ? 1e-12 : 1e-6;
    int status = make_engine(job);
    status = status ? status : gbg_bench_time(evaluate, job, &result.seconds);
    status = status ? status
                    : gbg_engine_forces(job->engine, job->n, job->force[0], job->force[1],
                                        job->force[2], 1);
    gbg_engine_destroy(&job->engine);
    if (status == 0) {
        measure_error(job, &result);
        status = gbg_bench_report(bench, &result);
    }
    return status;
}

static int run_one(struct gbg_bench *bench, const char *what, int dimension, double power,
                   int lattice, const char *precision, int64_t n)
{
    struct job job = {.context = bench->context,
                      .precision = precision,
                      .dimension = dimension,
                      .power = power,
                      .n = n};
    double *memory;
    int status = gbg_allocate(bench->context, (void **)&memory, 7 * n, sizeof *memory, "particles");
    if (status != 0) {
        return status;
    }
    for (int a = 0; a < dimension; a++) {
        job.length[a] = pow((double)n, 1.0 / dimension);
        job.position[a] = memory + a * n;
        job.force[a] = memory + (3 + a) * n;
    }
    job.species = (int32_t *)(void *)(memory + 6 * n);
    status = time_one(bench, &job, what, lattice);
    gbg_release(memory);
    return status;
}

static int run(struct gbg_bench *bench)
{
    static const int64_t list[] = {1 << 10, 1 << 12, 1 << 14, 1 << 16, 1 << 17, 0};
    int64_t size[16];
    int sizes = gbg_bench_sizes(bench, list, 1 << 12, size), status = 0;
    for (int k = 0; k < sizes && status == 0; k++) {
        int64_t n = size[k];
        status = run_one(bench, "2D r/r^3 jittered lattice", 2, 2.0, 1, "mixed", n);
        status = status ? status : run_one(bench, "2D r/r^3 random", 2, 2.0, 0, "mixed", n);
        status =
            status ? status : run_one(bench, "2D r/r^3 jittered lattice", 2, 2.0, 1, "strict", n);
        if (n <= 1 << 16) {
            status = status ? status : run_one(bench, "2D r/r^7 random", 2, 6.0, 0, "mixed", n);
            status = status ? status : run_one(bench, "3D r/r^3 random", 3, 2.0, 0, "mixed", n);
            status = status ? status : run_one(bench, "2D r/r^3 random", 2, 2.0, 0, "double", n);
            status = status ? status : run_one(bench, "2D r/r^3 random", 2, 2.0, 0, "strict", n);
            status = status ? status : run_one(bench, "2D r/r^7 random", 2, 6.0, 0, "strict", n);
            status = status ? status : run_one(bench, "3D r/r^3 random", 3, 2.0, 0, "strict", n);
        }
        if (n <= 1 << 14) {
            status = status ? status : run_one(bench, "2D r/r^4.5 random", 2, 3.5, 0, "mixed", n);
        }
    }
    return status;
}

const struct gbg_bench_case gbg_bench_direct = {
    "direct", "minimum-image sums over all pairs; error on 1000 targets against double", run};
