/* L1, CPU, per instruction set: cut-off power-law forces over pair lists.
 *
 * Particles stand in lanes and the loop runs over their neighbours in ascending order, so that a
 * sum has one order whatever the instruction set; pairs beyond the cut-off add exact zeros, so that
 * it does not depend on when the list was built. Lengths are taken in units of the cut-off, so that
 * no choice of units overflows a float. */
#include <math.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/list.h"
#include "backend/cpu/power.h"
#include "backend/cpu/simd.h"
#include "backend/cpu/variant.h"

struct job {
    struct gbg_state *state;
    const struct gbg_list *list;
    double power, cutoff;
    int add;
    int whole;                   /* power, if it is whole */
    struct gbg_cutoff_unit unit; /* mixed kernel */
};

static void store(const struct job *job, int64_t i, int axis, double field)
{
    const struct gbg_state *state = job->state;
    double force = state->mobility[state->species ? state->species[i] : 0] * field;
    double *target = &state->force[axis][i];
    *target = job->add ? *target + force : force;
}

/* Field of one vector of particles: sum over neighbours of alpha r/|r|^(power+1). */
__attribute__((always_inline)) static inline void field(const struct job *job, const int32_t *index,
                                                        int32_t width, int64_t first, int dimension,
                                                        int power, int one_species, vf sum[3])
{
    const struct gbg_list *list = job->list;
    const float *source = job->state->source;
    vf strength = vf_set(one_species ? (float)job->state->alpha[0] : 0.0f);
    vi own[3];
    vf scale[3];
    for (int a = 0; a < dimension; a++) {
        own[a] = vi_load(list->local[a] + first);
        scale[a] = vf_set(job->unit.scale[a]);
        sum[a] = vf_set(0.0f);
    }
    for (int32_t k = 0; k < width; k++) {
        vi j = vi_load(index + (int64_t)k * GBG_SLICE);
        vf r[3], squared = vf_set(0.0f);
        for (int a = 0; a < dimension; a++) {
            vi d = vi_sub(own[a], vi_gather(list->local[a], j));
            r[a] = vf_mul(vf_from_vi(d), scale[a]);
            squared = vf_fma(r[a], r[a], squared);
        }
        vm inside = vm_and(vf_lt(squared, vf_set(job->unit.limit)), vf_lt(vf_set(0.0f), squared));
        if (!one_species) {
            strength = vf_gather(source, j);
        }
        vf f = vf_keep(inside, vf_mul(gbg_inverse_power(squared, power), strength));
        for (int a = 0; a < dimension; a++) {
            sum[a] = vf_fma(f, r[a], sum[a]);
        }
    }
}

__attribute__((always_inline)) static inline void mixed_chunk(const struct job *job,
                                                              const struct gbg_chunk *chunk,
                                                              int dimension, int power,
                                                              int one_species)
{
    const struct gbg_list *list = job->list;
    double unit = pow(job->unit.unit, -job->power);
    float values[3][GBG_SLICE];
    for (int64_t slice = chunk->first_slice; slice < chunk->end_slice; slice++) {
        int64_t first = slice * GBG_SLICE;
        for (int part = 0; part < GBG_SLICE; part += VF_LANES) {
            vf sum[3];
            field(job, chunk->index + list->offset[slice] + part, list->width[slice], first + part,
                  dimension, power, one_species, sum);
            for (int a = 0; a < dimension; a++) {
                vf_store(values[a] + part, sum[a]);
            }
        }
        for (int l = 0; l < GBG_SLICE && first + l < list->n; l++) {
            for (int a = 0; a < dimension; a++) {
                store(job, first + l, a, unit * (double)values[a][l]);
            }
        }
    }
}

static void mixed_2d(const struct job *job, const struct gbg_chunk *chunk)
{
    int one = job->state->n_species == 1 && !job->state->own_alpha;
    if (job->power == 2.0) {
        one ? mixed_chunk(job, chunk, 2, 2, 1) : mixed_chunk(job, chunk, 2, 2, 0);
    } else {
        one ? mixed_chunk(job, chunk, 2, 6, 1) : mixed_chunk(job, chunk, 2, 6, 0);
    }
}

static void mixed_3d(const struct job *job, const struct gbg_chunk *chunk)
{
    int one = job->state->n_species == 1 && !job->state->own_alpha;
    if (job->power == 2.0) {
        one ? mixed_chunk(job, chunk, 3, 2, 1) : mixed_chunk(job, chunk, 3, 2, 0);
    } else {
        one ? mixed_chunk(job, chunk, 3, 6, 1) : mixed_chunk(job, chunk, 3, 6, 0);
    }
}

int GBG_ISA_NAME(gbg_cpu_cutoff_mixed)(struct gbg_device *device, struct gbg_state *state,
                                       const struct gbg_list *list, double power, double cutoff,
                                       int add)
{
    struct job job = {.state = state, .list = list, .power = power, .cutoff = cutoff, .add = add};
    if (power != 2.0 && power != 6.0) {
        return GBG_ISA_NAME(gbg_cpu_cutoff_double)(device, state, list, power, cutoff, add);
    }
    job.unit = gbg_cutoff_unit_make(list->dimension, list->unit, cutoff);
#pragma omp parallel for num_threads(device->threads) schedule(static, 1)
    for (int c = 0; c < list->n_chunks; c++) {
        if (list->dimension == 2) {
            mixed_2d(&job, &list->chunk[c]);
        } else {
            mixed_3d(&job, &list->chunk[c]);
        }
    }
    return GBG_OK;
}

/* Field of one particle from all 64 bits of the coordinates, any power. */
static void field_double(const struct job *job, const int32_t *index, int32_t width, int64_t i,
                         double sum[3])
{
    const struct gbg_state *state = job->state;
    double limit = job->cutoff * job->cutoff;
    for (int32_t k = 0; k < width; k++) {
        int64_t j = index[(int64_t)k * GBG_SLICE];
        double r[3], squared = 0.0;
        for (int a = 0; a < state->box.dimension; a++) {
            r[a] = gbg_box_difference(&state->box, a, gbg_join(state->high[a][i], state->low[a][i]),
                                      gbg_join(state->high[a][j], state->low[a][j]));
            squared += r[a] * r[a];
        }
        if (squared < limit && squared > 0.0) {
            double f = (state->own_alpha ? state->own_alpha[j]
                                         : state->alpha[state->species ? state->species[j] : 0]) *
                       gbg_inverse_double(squared, job->power, job->whole);
            for (int a = 0; a < state->box.dimension; a++) {
                sum[a] += f * r[a];
            }
        }
    }
}

int GBG_ISA_NAME(gbg_cpu_cutoff_double)(struct gbg_device *device, struct gbg_state *state,
                                        const struct gbg_list *list, double power, double cutoff,
                                        int add)
{
    struct job job = {.state = state, .list = list, .power = power, .cutoff = cutoff, .add = add};
    job.whole = gbg_whole_power(power);
#pragma omp parallel for num_threads(device->threads) schedule(static, 1)
    for (int c = 0; c < list->n_chunks; c++) {
        const struct gbg_chunk *chunk = &list->chunk[c];
        for (int64_t slice = chunk->first_slice; slice < chunk->end_slice; slice++) {
            for (int l = 0; l < GBG_SLICE && slice * GBG_SLICE + l < list->n; l++) {
                int64_t i = slice * GBG_SLICE + l;
                double sum[3] = {0.0, 0.0, 0.0};
                field_double(&job, chunk->index + list->offset[slice] + l, list->width[slice], i,
                             sum);
                for (int a = 0; a < list->dimension; a++) {
                    store(&job, i, a, sum[a]);
                }
            }
        }
    }
    return GBG_OK;
}
