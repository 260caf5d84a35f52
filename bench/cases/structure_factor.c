/* Benchmarks: one frame of a structure factor (goal S12). */
#include <math.h>
#include <stdlib.h>

#include "bench/bench.h"
#include "core/memory.h"
#include "gamboge/analysis.h"

static const double two_pi = 6.283185307179586477;

/* Modes |n| <= reach (a power of 2) of a box with edges 1; species 1 or 2. The aliasing of the
 * window is a bound for any configuration; random points are off by less, `allowed` at most. */
struct variant {
    const char *what;
    int dimension, reach, species;
    double aliasing, allowed;
};

static const struct variant variants[] = {
    {"2D 512^2 modes 1e-6", 2, 256, 1, 5e-6, 1e-6},
    {"2D 512^2 modes 1e-12", 2, 256, 1, 1.5e-12, 1e-12},
    {"2D 512^2, two species 1e-6", 2, 256, 2, 5e-6, 1e-6},
    {"3D 128^3 modes 1e-6", 3, 64, 1, 5e-6, 1e-6},
};

struct job {
    struct gbg_context *context;
    const struct variant *variant;
    struct gbg_analysis *analysis;
    int64_t n;
    double *position[3];
    int32_t *species;
};

static int evaluate(void *user)
{
    const struct job *job = user;
    return gbg_analysis_add_frame(job->analysis, job->n, job->position[0], job->position[1],
                                  job->position[2], 1, job->species, 0, NULL, 0);
}

static int make_analysis(struct job *job, double shell_width)
{
    static const double lengths[3] = {1, 1, 1};
    const struct variant *v = job->variant;
    int status =
        gbg_analysis_create(job->context, v->dimension, lengths, v->species, &job->analysis);
    if (status == 0) {
        status = gbg_analysis_set_real(job->analysis, "k_max", two_pi * v->reach);
    }
    if (status == 0) {
        status =
            gbg_analysis_set_real(job->analysis, "tolerance", v->aliasing * sqrt((double)job->n));
    }
    if (status == 0) {
        status = gbg_analysis_set_text(job->analysis, "partials", v->species > 1 ? "yes" : "no");
    }
    if (status == 0 && gbg_has_component("fftw")) {
        status = gbg_analysis_set_text(job->analysis, "method", "mesh");
    }
    if (status == 0 && shell_width > 0) {
        status = gbg_analysis_set_real(job->analysis, "shell_width", shell_width);
    }
    return status;
}

/* |rho|^2/N by a plain loop; phases are reduced to one turn before they are multiplied out. */
static double plain_S(const struct job *job, const int *mode)
{
    double real = 0, imaginary = 0;
    for (int64_t i = 0; i < job->n; i++) {
        double turns = 0;
        for (int a = 0; a < job->variant->dimension; a++) {
            double product = mode[a] * job->position[a][i];
            turns += (product - rint(product)) + fma(mode[a], job->position[a][i], -product);
        }
        real += cos(two_pi * turns);
        imaginary += sin(two_pi * turns);
    }
    return (real * real + imaginary * imaginary) / (double)job->n;
}

/* Mean of S over all modes with n^2 = square; -1 if there is none. */
static double plain_shell(const struct job *job, int square)
{
    double sum = 0;
    int modes = 0, most = (int)sqrt((double)square),
        depth = job->variant->dimension == 3 ? most : 0;
    for (int x = 0; x <= most; x++) {
        for (int y = x > 0 ? -most : 0; y <= most; y++) {
            for (int z = x > 0 || y > 0 ? -depth : 1; z <= depth || (depth == 0 && z == 0); z++) {
                if (x * x + y * y + z * z == square) {
                    sum += plain_S(job, (int[3]){x, y, z});
                    modes++;
                }
            }
        }
    }
    return modes ? sum / modes : -1;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Shells so narrow that each holds the modes of one n^2; some with few modes against plain sums:
 * n^2 = m reach^2/16 has as many representations as m. */
static int measure_error(struct job *job, struct gbg_bench_result *result)
{
    const struct variant *v = job->variant;
    double width = two_pi / (4.0 * v->reach), error = 0, total = 0, size[16], *S;
    int64_t shells = 0;
    int status = make_analysis(job, width), samples = 0;
    status = status ? status : evaluate(job);
    status = status ? status : gbg_analysis_size(job->analysis, &shells, NULL);
    if (status != 0) {
        return status;
    }
    status = gbg_allocate(job->context, (void **)&S, shells, sizeof *S, "shells");
    status = status ? status : gbg_analysis_get(job->analysis, "S", shells, S);
    for (int m = 1; m <= 16 && status == 0; m++) {
        int square = m * (v->reach / 4) * (v->reach / 4);
        double exact = plain_shell(job, square);
        if (exact >= 0) {
            /* Shell i (from 0) holds (i + 1/2) width <= k < (i + 3/2) width. */
            int64_t shell = (int64_t)floor(two_pi * sqrt((double)square) / width + 0.5) - 1;
            error += (S[shell] - exact) * (S[shell] - exact);
            total += exact * exact;
            size[samples++] = exact;
        }
    }
    if (status == 0) {
        qsort(size, (size_t)samples, sizeof *size, ascending);
        result->error_rms = sqrt(error / total);
        result->error_median = sqrt(error / samples) / size[samples / 2];
    }
    gbg_release(S);
    return status;
}

static int time_one(struct gbg_bench *bench, struct job *job)
{
    static const double lengths[3] = {1, 1, 1};
    const struct variant *v = job->variant;
    struct gbg_bench_result result = {.what = v->what,
                                      .precision = "double",
                                      .unit = "particles",
                                      .n = job->n,
                                      .work = (double)job->n,
                                      .error_rms = NAN,
                                      .error_median = NAN,
                                      .allowed = v->allowed};
    gbg_bench_points(v->dimension, lengths, 0, job->n, job->position);
    for (int64_t i = 0; i < job->n; i++) {
        job->species[i] = (int32_t)(i % v->species);
    }
    int status = make_analysis(job, 0);
    if (status == 0) {
        status = gbg_bench_time(evaluate, job, &result.seconds);
    }
    gbg_analysis_destroy(&job->analysis);
    if (status == 0) {
        status = measure_error(job, &result);
    }
    gbg_analysis_destroy(&job->analysis);
    return status ? status : gbg_bench_report(bench, &result);
}

static int run_one(struct gbg_bench *bench, const struct variant *variant, int64_t n)
{
    struct job job = {.context = bench->context, .variant = variant, .n = n};
    double *memory;
    int status = gbg_allocate(bench->context, (void **)&memory, 4 * n, sizeof *memory, "particles");
    if (status != 0) {
        return status;
    }
    for (int a = 0; a < 3; a++) {
        job.position[a] = memory + a * n;
    }
    job.species = (int32_t *)(memory + 3 * n);
    status = time_one(bench, &job);
    gbg_release(memory);
    return status;
}

static int run(struct gbg_bench *bench)
{
    static const int64_t list[] = {1 << 14, 1000000, 0};
    int64_t size[16];
    int sizes = gbg_bench_sizes(bench, list, 1 << 14, size), status = 0;
    for (int k = 0; k < sizes; k++) {
        for (size_t v = 0; v < sizeof variants / sizeof *variants && status == 0; v++) {
            if (gbg_bench_wanted(bench, variants[v].what)) {
                status = run_one(bench, &variants[v], size[k]);
            }
        }
    }
    return status;
}

const struct gbg_bench_case gbg_bench_structure_factor = {
    "sk", "one frame of a structure factor; error of S against plain sums", run};
