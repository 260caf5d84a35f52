/* L2: the error of the forces, measured on a sample against a double-precision direct sum. */
#include <math.h>
#include <stdlib.h>

#include "core/memory.h"
#include "core/random.h"
#include "engine/engine.h"

/* Distinct sample particles in ascending order: one at random from each of `samples` equal parts.
 */
static void choose(int64_t n, int64_t samples, int32_t *index)
{
    for (int64_t s = 0; s < samples; s++) {
        int64_t begin = n * s / samples, end = n * (s + 1) / samples;
        struct gbg_philox r =
            gbg_philox(gbg_philox_counter(0, (uint64_t)s, GBG_STREAM_START), 0x5EED, 0);
        index[s] = (int32_t)(begin + (int64_t)(r.word[0] % (uint64_t)(end - begin)));
    }
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

struct sums {
    double error, force;
};

static int reference_forces(struct gbg_engine *engine, int64_t samples, const int32_t *index,
                            double *const *reference, double *const *term)
{
    const struct gbg_scene *scene = &engine->scene;
    int status = GBG_OK;
    for (int f = 0; f < scene->n_forces && status == GBG_OK; f++) {
        const struct gbg_force *force = &scene->force[f];
        double cutoff = force->sum == GBG_SUM_CUTOFF ? force->cutoff : 0.0;
        status = engine->kernels->direct_targets(engine->device, &engine->state, force->power,
                                                 cutoff, samples, index, term);
        for (int a = 0; status == GBG_OK && a < scene->dimension; a++) {
            for (int64_t s = 0; s < samples; s++) {
                reference[a][s] = (f == 0 ? 0.0 : reference[a][s]) + term[a][s];
            }
        }
    }
    return status;
}

static int compare_forces(struct gbg_engine *engine, int64_t samples, double *const *force,
                          double *const *reference, double *size, double *rms_over_rms,
                          double *rms_over_median)
{
    struct sums sums = {0.0, 0.0};
    for (int64_t s = 0; s < samples; s++) {
        double error = 0.0, squared = 0.0;
        for (int a = 0; a < engine->scene.dimension; a++) {
            double d = force[a][s] - reference[a][s];
            error += d * d;
            squared += reference[a][s] * reference[a][s];
        }
        sums.error += error;
        sums.force += squared;
        size[s] = sqrt(squared);
    }
    qsort(size, (size_t)samples, sizeof *size, compare);
    double rms = sqrt(sums.error / (double)samples), median = size[samples / 2];
    *rms_over_rms = rms == 0.0 ? 0.0 : rms / sqrt(sums.force / (double)samples);
    *rms_over_median = rms == 0.0 ? 0.0 : rms / median;
    return GBG_OK;
}

/* Present forces on those particles alone: of a large system little more fits on the host. */
static int sample_forces(struct gbg_engine *engine, int64_t samples, const int32_t *index,
                         double *const *force)
{
    int status = gbg_engine_evaluate_forces(engine);
    for (int a = 0; a < engine->scene.dimension; a++) {
        for (int64_t s = 0; s < samples && status == GBG_OK; s++) {
            status = engine->backend->download(engine->device, &force[a][s],
                                               engine->state.force[a] + index[s], sizeof **force);
        }
    }
    return status;
}

int gbg_engine_measure_error(struct gbg_engine *engine, int64_t samples, double *rms_over_rms,
                             double *rms_over_median)
{
    int64_t n = engine->state.owned;
    samples = samples < n ? samples : n;
    *rms_over_rms = *rms_over_median = 0.0;
    if (engine->scene.n_forces == 0 || samples == 0) {
        return GBG_OK;
    }
    double *work = NULL, *force[3], *reference[3], *term[3];
    int32_t *index = NULL;
    int status =
        gbg_allocate(engine->context, (void **)&work, 10 * samples, sizeof *work, "force error");
    if (status == GBG_OK) {
        status = gbg_allocate(engine->context, (void **)&index, samples, sizeof *index,
                              "force error sample");
    }
    for (int a = 0; a < 3; a++) {
        force[a] = work + a * samples;
        reference[a] = work + (3 + a) * samples;
        term[a] = work + (6 + a) * samples;
    }
    if (status == GBG_OK) { /* the reference is summed in the order of memory */
        status = gbg_engine_order_by_id(engine);
    }
    if (status == GBG_OK) {
        choose(n, samples, index);
        status = sample_forces(engine, samples, index, force);
    }
    if (status == GBG_OK) {
        status = reference_forces(engine, samples, index, reference, term);
    }
    if (status == GBG_OK) {
        status = compare_forces(engine, samples, force, reference, work + 9 * samples, rms_over_rms,
                                rms_over_median);
    }
    gbg_release(work);
    gbg_release(index);
    return status;
}
