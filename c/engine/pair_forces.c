/* L2: pair forces on a caller's arrays. */
#include "engine/pair_forces.h"

#include <math.h>

#include "core/context.h"
#include "core/memory.h"

/* Sources over the largest one, which becomes the mobility of the single species, so that their
 * single-precision twins neither overflow nor vanish. */
static int set_sources(struct gbg_bare *bare, const double *alpha, double *buffer)
{
    struct gbg_state *state = &bare->state;
    double largest = 0.0;
    for (int64_t i = 0; i < state->owned; i++) {
        largest = fmax(largest, fabs(alpha[i]));
    }
    state->mobility[0] = largest > 0.0 ? largest : 1.0;
    for (int64_t i = 0; i < state->owned; i++) {
        buffer[i] = alpha[i] / state->mobility[0];
    }
    int status = gbg_bare_array(bare, (void **)&state->own_alpha, buffer, 8, "sources");
    float *single = (float *)bare->words;
    for (int64_t i = 0; i < state->owned; i++) {
        single[i] = (float)buffer[i];
    }
    return status ? status : gbg_bare_array(bare, (void **)&state->source, single, 4, "sources");
}

static int sum_within_cutoff(struct gbg_bare *bare, const struct gbg_pair_sum *sum)
{
    const struct gbg_kernels *kernels = bare->kernels;
    struct gbg_list *list = NULL;
    int status = kernels->list_create(bare->device, &bare->state, sum->cutoff, sum->cutoff, &list);
    if (status == GBG_OK) {
        status = kernels->list_update(bare->device, &bare->state, list, 0.0);
    }
    if (status == GBG_OK) {
        status = (sum->use_double ? kernels->cutoff_double : kernels->cutoff_mixed)(
            bare->device, &bare->state, list, sum->power, sum->cutoff, 0);
    }
    kernels->list_destroy(bare->device, list);
    return status;
}

static int sum_pairs(struct gbg_bare *bare, const struct gbg_pair_sum *sum)
{
    if (sum->cutoff > 0.0) {
        return sum_within_cutoff(bare, sum);
    }
    const struct gbg_kernels *kernels = bare->kernels;
    return (sum->strict       ? kernels->direct_strict
            : sum->use_double ? kernels->direct_double
                              : kernels->direct_mixed)(bare->device, &bare->state, sum->power, 0);
}

static int give_forces(struct gbg_bare *bare, const double *mobility, double *buffer,
                       double *const force[3], ptrdiff_t step)
{
    int64_t n = bare->state.owned;
    int status = bare->backend->sync(bare->device);
    for (int a = 0; a < bare->state.box.dimension && status == GBG_OK; a++) {
        status = bare->backend->download(bare->device, buffer, bare->state.force[a],
                                         (size_t)n * sizeof *buffer);
        for (int64_t i = 0; status == GBG_OK && i < n; i++) {
            force[a][i * step] = mobility[i] * buffer[i];
        }
    }
    return status;
}

int gbg_caller_pair_forces(struct gbg_bare *bare, const struct gbg_pair_sum *sum,
                           double *const force[3], ptrdiff_t step)
{
    struct gbg_state *state = &bare->state;
    double *buffer;
    int status =
        gbg_allocate(bare->context, (void **)&buffer, state->owned, sizeof *buffer, "pair forces");
    if (status == GBG_OK) {
        status = set_sources(bare, sum->alpha, buffer);
    }
    for (int a = 0; a < state->box.dimension && status == GBG_OK; a++) {
        status = bare->backend->allocate(bare->device, (void **)&state->force[a], state->owned, 8,
                                         "forces");
    }
    status = status ? status : sum_pairs(bare, sum);
    status = status ? status : give_forces(bare, sum->mobility, buffer, force, step);
    for (int a = 0; a < state->box.dimension; a++) {
        bare->backend->release(bare->device, state->force[a]);
    }
    bare->backend->release(bare->device, state->own_alpha);
    bare->backend->release(bare->device, state->source);
    gbg_release(buffer);
    return status;
}
