/* L2: the error of the forces, measured on a sample: sums over pairs against direct sums in double
 * precision, sums over all images against one without a mesh. */
#include "engine/engine.h"
#include "engine/mesh_check.h"
#include "engine/sample.h"

static int reference_forces(struct gbg_engine *engine, const struct gbg_sources *sources,
                            struct gbg_sample *sample)
{
    const struct gbg_scene *scene = &engine->scene;
    int status = GBG_OK;
    for (int f = 0; f < scene->n_forces && status == GBG_OK; f++) {
        const struct gbg_force *force = &scene->force[f];
        double cutoff = force->sum == GBG_SUM_CUTOFF ? force->cutoff : 0.0;
        status = force->sum == GBG_SUM_LATTICE
                     ? gbg_sources_reference(engine->context, sources, force->power, sample,
                                             sample->term)
                     : engine->kernels->direct_targets(engine->device, &engine->state, force->power,
                                                       cutoff, sample->size, sample->index,
                                                       sample->term);
        for (int a = 0; status == GBG_OK && a < scene->dimension; a++) {
            for (int64_t s = 0; s < sample->size; s++) {
                sample->reference[a][s] =
                    (f == 0 ? 0.0 : sample->reference[a][s]) + sample->term[a][s];
            }
        }
    }
    return status;
}

/* Present forces on those particles alone: of a large system little more fits on the host. */
static int sample_forces(struct gbg_engine *engine, struct gbg_sample *sample)
{
    int status = gbg_engine_evaluate_forces(engine);
    for (int a = 0; a < engine->scene.dimension; a++) {
        for (int64_t s = 0; s < sample->size && status == GBG_OK; s++) {
            status = engine->backend->download(engine->device, &sample->force[a][s],
                                               engine->state.force[a] + sample->index[s],
                                               sizeof(double));
        }
    }
    return status;
}

static int measure(struct gbg_engine *engine, struct gbg_sample *sample)
{
    struct gbg_sources sources = {0};
    /* the reference is summed in the order of memory, and the sample counts in that of ids */
    int status = gbg_engine_order_by_id(engine);
    status = status ? status : sample_forces(engine, sample);
    if (status == GBG_OK && engine->mesh_sums) {
        status = gbg_engine_sources(engine, &sources);
    }
    status = status ? status : reference_forces(engine, &sources, sample);
    gbg_sources_release(&sources);
    return status;
}

int gbg_engine_measure_error(struct gbg_engine *engine, int64_t samples, double *rms_over_rms,
                             double *rms_over_median)
{
    struct gbg_sample sample;
    *rms_over_rms = *rms_over_median = 0.0;
    if (engine->scene.n_forces == 0 || samples == 0 || engine->state.owned == 0) {
        return GBG_OK;
    }
    int status = gbg_sample_make(engine->context, engine->scene.dimension, engine->state.owned,
                                 samples, &sample);
    status = status ? status : measure(engine, &sample);
    if (status == GBG_OK) {
        struct gbg_deviation error = gbg_sample_compare(&sample);
        *rms_over_rms = error.difference == 0.0 ? 0.0 : error.difference / error.rms;
        *rms_over_median = error.difference == 0.0 ? 0.0 : error.difference / error.median;
    }
    gbg_sample_release(&sample);
    return status;
}
