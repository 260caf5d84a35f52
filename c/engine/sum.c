/* L2: long-range forces on a caller's arrays. */
#include "engine/sum.h"

#include <math.h>
#include <string.h>

#include "core/context.h"
#include "core/memory.h"
#include "engine/sample.h"

static struct gbg_mesh_place place_of(const struct gbg_sum *sum)
{
    return (struct gbg_mesh_place){.context = sum->context,
                                   .backend = sum->bare.backend,
                                   .kernels = sum->bare.kernels,
                                   .device = sum->bare.device,
                                   .state = &sum->bare.state,
                                   .hurry = sum->hurry,
                                   .name = "gbg_sum_run: the sum"};
}

static int make_arrays(struct gbg_sum *sum)
{
    struct gbg_bare *bare = &sum->bare;
    void *alpha = NULL, *buffer = NULL;
    int64_t n = bare->state.owned;
    int status = gbg_allocate(sum->context, &alpha, n, sizeof(double), "sources");
    sum->alpha = alpha;
    status = status ? status : gbg_allocate(sum->context, &buffer, n, sizeof(double), "forces");
    sum->buffer = buffer;
    if (status == GBG_OK) {
        status = gbg_bare_array(bare, (void **)&bare->state.own_alpha, NULL, 8, "sources");
    }
    if (status == GBG_OK) {
        status = gbg_bare_array(bare, (void **)&bare->state.source, NULL, 4, "sources");
    }
    for (int a = 0; status == GBG_OK && a < bare->state.box.dimension; a++) {
        status = gbg_bare_array(bare, (void **)&bare->state.force[a], NULL, 8, "forces");
    }
    return status;
}

int gbg_sum_make(struct gbg_context *context, int dimension, const double *lengths, int64_t n,
                 struct gbg_sum **sum)
{
    void *memory = NULL, *zeros = NULL;
    int status = gbg_allocate_zero(context, &memory, 1, sizeof **sum, "a long-range sum");
    struct gbg_sum *made = memory;
    status = status ? status : gbg_allocate_zero(context, &zeros, n, sizeof(double), "coordinates");
    if (status == GBG_OK) {
        const struct gbg_points points = {n, {zeros, zeros, zeros}, 1};
        made->context = context;
        made->unit = 1.0;
        status = gbg_bare_make(context, dimension, lengths, &points, &made->bare);
    }
    gbg_release(zeros);
    status = status ? status : make_arrays(made);
    if (status != GBG_OK) {
        gbg_sum_free(made);
        return status;
    }
    *sum = made;
    return GBG_OK;
}

void gbg_sum_drop_mesh(struct gbg_sum *sum)
{
    const struct gbg_mesh_place place = place_of(sum);
    gbg_mesh_sum_free(&place, &sum->mesh);
    sum->checked = sum->current = 0;
}

void gbg_sum_free(struct gbg_sum *sum)
{
    if (!sum) {
        return;
    }
    struct gbg_bare *bare = &sum->bare;
    if (bare->device) {
        gbg_sum_drop_mesh(sum);
        for (int a = 0; a < 3; a++) {
            bare->backend->release(bare->device, bare->state.force[a]);
        }
        bare->backend->release(bare->device, bare->state.own_alpha);
        bare->backend->release(bare->device, bare->state.source);
        bare->backend->release(bare->device, sum->potential);
        gbg_bare_free(bare);
    }
    gbg_release(sum->alpha);
    gbg_release(sum->buffer);
    gbg_release(sum);
}

int gbg_sum_take_sources(struct gbg_sum *sum, const double *alpha)
{
    struct gbg_bare *bare = &sum->bare;
    int64_t n = bare->state.owned;
    double largest = 0.0;
    float *single = (float *)bare->words;
    for (int64_t i = 0; i < n; i++) {
        sum->alpha[i] = alpha[i];
        largest = fmax(largest, fabs(alpha[i]));
    }
    sum->unit = largest > 0.0 ? largest : 1.0;
    for (int64_t i = 0; i < n; i++) {
        sum->buffer[i] = alpha[i] / sum->unit;
        single[i] = (float)sum->buffer[i];
    }
    bare->state.mobility[0] = sum->unit; /* forces have the caller's size again */
    int status =
        bare->backend->upload(bare->device, bare->state.own_alpha, sum->buffer, (size_t)n * 8);
    status = status
                 ? status
                 : bare->backend->upload(bare->device, bare->state.source, single, (size_t)n * 4);
    sum->has_sources = status == GBG_OK;
    sum->current = 0;
    return status;
}

static int sum_pairs(struct gbg_sum *sum)
{
    const struct gbg_kernels *kernels = sum->bare.kernels;
    return (sum->use_double ? kernels->direct_double : kernels->direct_mixed)(
        sum->bare.device, &sum->bare.state, sum->power, 0);
}

static int sum_mesh(struct gbg_sum *sum)
{
    return sum->bare.kernels->ewald_force(sum->bare.device, &sum->bare.state, sum->mesh.body, 0);
}

/* Places and sources as the kernels have them; mobility 1. */
static int look(struct gbg_sum *sum, struct gbg_sources *sources)
{
    const struct gbg_box *box = &sum->bare.state.box;
    int64_t n = sum->bare.state.owned;
    int status = gbg_sources_make(sum->context, box->dimension, box->length, n, sources);
    for (int a = 0; status == GBG_OK && a < box->dimension; a++) {
        double *position = sources->position[a];
        status = gbg_bare_fractions(&sum->bare, a, (uint64_t *)(void *)position);
        for (int64_t i = 0; status == GBG_OK && i < n; i++) {
            uint64_t fraction;
            memcpy(&fraction, &position[i], sizeof fraction);
            position[i] = (double)fraction * (box->length[a] * 0x1p-64);
        }
    }
    for (int64_t i = 0; status == GBG_OK && i < n; i++) {
        sources->alpha[i] = sum->alpha[i];
        sources->mobility[i] = 1.0;
    }
    return status;
}

static int sample_forces(struct gbg_sum *sum, struct gbg_sample *sample)
{
    const struct gbg_bare *bare = &sum->bare;
    int status = GBG_OK;
    for (int a = 0; a < sample->dimension; a++) {
        for (int64_t s = 0; s < sample->size && status == GBG_OK; s++) {
            status =
                bare->backend->download(bare->device, &sample->force[a][s],
                                        bare->state.force[a] + sample->index[s], sizeof(double));
        }
    }
    return status;
}

struct check {
    struct gbg_sum *sum;
    struct gbg_sources *sources;
    struct gbg_sample *sample;
    int referred; /* 1: the reference is there */
};

static int measure_mesh(void *user, struct gbg_mesh_sum *mesh)
{
    struct check *check = user;
    int status = sum_mesh(check->sum);
    status = status ? status : sample_forces(check->sum, check->sample);
    if (status == GBG_OK && !check->referred) {
        status = gbg_sources_reference(check->sum->context, check->sources, check->sum->power,
                                       check->sample, check->sample->reference);
        check->referred = status == GBG_OK;
    }
    if (status == GBG_OK) {
        gbg_mesh_sum_judge(mesh, check->sample, gbg_sample_compare(check->sample).rms,
                           gbg_sources_typical(check->sources, check->sum->power));
    }
    return status;
}

static int check_mesh(struct gbg_sum *sum)
{
    const struct gbg_mesh_place place = place_of(sum);
    struct gbg_sources sources = {0};
    struct gbg_sample sample = {0};
    struct check check = {sum, &sources, &sample, 0};
    int status = look(sum, &sources);
    status = status ? status
                    : gbg_sample_make(sum->context, sum->bare.state.box.dimension,
                                      sum->bare.state.owned, GBG_MESH_SAMPLES, &sample);
    status = status ? status
                    : gbg_mesh_sum_settle(&place, sample.size, measure_mesh, &check, &sum->mesh);
    gbg_sample_release(&sample);
    gbg_sources_release(&sources);
    sum->checked = status == GBG_OK;
    return status;
}

int gbg_sum_forces(struct gbg_sum *sum)
{
    const struct gbg_mesh_place place = place_of(sum);
    int status = GBG_OK;
    if (sum->current || sum->bare.state.owned == 0) {
        sum->current = 1;
        return GBG_OK;
    }
    if (sum->lattice && !sum->mesh.body) {
        status = gbg_mesh_sum_make(&place, &sum->mesh);
    }
    if (status == GBG_OK && sum->lattice && sum->check && !sum->checked) {
        status = check_mesh(sum); /* which sums too */
    } else if (status == GBG_OK) {
        status = sum->lattice ? sum_mesh(sum) : sum_pairs(sum);
    }
    sum->current = status == GBG_OK;
    return status;
}

int gbg_sum_give_forces(struct gbg_sum *sum, const double *mobility, double *const force[3],
                        ptrdiff_t step)
{
    const struct gbg_bare *bare = &sum->bare;
    int64_t n = bare->state.owned;
    int status = bare->backend->sync(bare->device);
    for (int a = 0; a < bare->state.box.dimension && status == GBG_OK; a++) {
        status = bare->backend->download(bare->device, sum->buffer, bare->state.force[a],
                                         (size_t)n * sizeof(double));
        for (int64_t i = 0; status == GBG_OK && i < n; i++) {
            force[a][i * step] = mobility ? mobility[i] * sum->buffer[i] : sum->buffer[i];
        }
    }
    return status;
}

int gbg_sum_give_potential(struct gbg_sum *sum, double *values)
{
    struct gbg_bare *bare = &sum->bare;
    int64_t n = bare->state.owned;
    int status = GBG_OK;
    if (!sum->potential) {
        void *memory = NULL;
        status = bare->backend->allocate(bare->device, &memory, n, sizeof(double), "potential");
        sum->potential = memory;
    }
    status = status ? status
                    : bare->kernels->ewald_potential(bare->device, &bare->state, sum->mesh.body,
                                                     sum->potential);
    status = status ? status
                    : bare->backend->download(bare->device, sum->buffer, sum->potential,
                                              (size_t)n * sizeof(double));
    for (int64_t i = 0; status == GBG_OK && i < n; i++) {
        values[i] = sum->unit * sum->buffer[i];
    }
    return status;
}

static int refer(struct gbg_sum *sum, struct gbg_sample *sample)
{
    struct gbg_sources sources = {0};
    if (!sum->lattice) {
        return sum->bare.kernels->direct_targets(sum->bare.device, &sum->bare.state, sum->power,
                                                 0.0, sample->size, sample->index,
                                                 sample->reference);
    }
    int status = look(sum, &sources);
    status = status ? status
                    : gbg_sources_reference(sum->context, &sources, sum->power, sample,
                                            sample->reference);
    gbg_sources_release(&sources);
    return status;
}

int gbg_sum_measure(struct gbg_sum *sum, int64_t samples, double *rms_over_rms,
                    double *rms_over_median)
{
    struct gbg_sample sample;
    *rms_over_rms = *rms_over_median = 0.0;
    int status = gbg_sample_make(sum->context, sum->bare.state.box.dimension, sum->bare.state.owned,
                                 samples, &sample);
    status = status ? status : sample_forces(sum, &sample);
    status = status ? status : refer(sum, &sample);
    if (status == GBG_OK) {
        struct gbg_deviation error = gbg_sample_compare(&sample);
        *rms_over_rms = error.difference == 0.0 ? 0.0 : error.difference / error.rms;
        *rms_over_median = error.difference == 0.0 ? 0.0 : error.difference / error.median;
    }
    gbg_sample_release(&sample);
    return status;
}
