/* L1, CUDA: cut-off power-law forces over pair lists: a thread a particle, its neighbours in the
 * order of its row, so that the bits are those of the CPU. */
#include "cuda/kernels.h"

#include "cuda/cutoff.h"
#include "cuda/list.h"
#include "cuda/unlisted.h"

namespace
{

/* Where the strength of a source comes from. */
enum sources { ONE, SPECIES, OWN };
/* Powers with code of their own; WHOLE: other whole ones. */
enum law { LAW_2 = 2, LAW_6 = 6, WHOLE = 100, OTHER };

} // namespace

/* The particle of this thread; its row and the number of neighbours in it. */
static __device__ __forceinline__ const int32_t *row_of(const struct gbg_cuda_rows &rows, int64_t i,
                                                        int32_t *width)
{
    int64_t slice = i / GBG_CUDA_SLICE;
    *width = rows.width[slice];
    return rows.index + rows.offset[slice] + i % GBG_CUDA_SLICE;
}

template <int dimension, int power, bool one_species>
static __global__ void mixed(const __grid_constant__ struct gbg_state state,
                             const __grid_constant__ struct gbg_cuda_rows rows,
                             const __grid_constant__ struct gbg_cuda_cutoff job)
{
    int64_t i = gbg_cuda_index();
    if (i >= rows.n || gbg_cuda_halted(job.halt)) {
        return;
    }
    int32_t width;
    const int32_t *index = row_of(rows, i, &width);
    vf strength = one_species ? (float)state.alpha[0] : 0.0f, sum[dimension];
    vi own[dimension];
    for (int a = 0; a < dimension; a++) {
        own[a] = vi_load(rows.local[a] + i);
        sum[a] = vf_set(0.0f);
    }
#pragma unroll 4
    for (int32_t k = 0; k < width; k++) {
        vi j = __ldg(index + (int64_t)k * GBG_CUDA_SLICE);
        vf r[dimension], squared = vf_set(0.0f);
        for (int a = 0; a < dimension; a++) {
            vi d = vi_sub(own[a], vi_gather(rows.local[a], j));
            r[a] = vf_mul(vf_from_vi(d), job.unit.scale[a]);
            squared = vf_fma(r[a], r[a], squared);
        }
        vm inside = vm_and(vf_lt(squared, job.unit.limit), vf_lt(vf_set(0.0f), squared));
        if (!one_species) {
            strength = vf_gather(state.source, j);
        }
        vf f = vf_keep(inside, vf_mul(gbg_inverse_power(squared, power), strength));
        for (int a = 0; a < dimension; a++) {
            sum[a] = vf_fma(f, r[a], sum[a]);
        }
    }
    for (int a = 0; a < dimension; a++) {
        gbg_cuda_store_force(state, job.add, i, a, job.factor * (double)sum[a]);
    }
}

template <int law>
static __device__ __forceinline__ double inverse(const struct gbg_cuda_cutoff &job, double squared)
{
    return law == OTHER   ? pow(squared, -0.5 * (job.power + 1.0))
           : law == WHOLE ? gbg_inverse_whole(squared, job.whole)
                          : gbg_inverse_whole(squared, law);
}

/* Field of one particle from all 64 bits of the coordinates. */
template <int dimension, int law, int sources>
static __global__ void in_double(const __grid_constant__ struct gbg_state state,
                                 const __grid_constant__ struct gbg_cuda_rows rows,
                                 const __grid_constant__ struct gbg_cuda_cutoff job)
{
    int64_t i = gbg_cuda_index();
    if (i >= rows.n || gbg_cuda_halted(job.halt)) {
        return;
    }
    int32_t width;
    const int32_t *index = row_of(rows, i, &width);
    double sum[dimension];
    uint64_t own[dimension];
    for (int a = 0; a < dimension; a++) {
        own[a] = gbg_join(state.high[a][i], state.low[a][i]);
        sum[a] = 0.0;
    }
#pragma unroll 2
    for (int32_t k = 0; k < width; k++) {
        int32_t j = __ldg(index + (int64_t)k * GBG_CUDA_SLICE);
        auto strength = [&] {
            return sources == OWN   ? __ldg(state.own_alpha + j)
                   : sources == ONE ? state.alpha[0]
                                    : state.alpha[state.species[j]];
        };
        gbg_cuda_add_in_double<dimension>(
            state, job.limit, own, j, strength,
            [&](double squared) { return inverse<law>(job, squared); }, sum);
    }
    for (int a = 0; a < dimension; a++) {
        gbg_cuda_store_force(state, job.add, i, a, sum[a]);
    }
}

typedef void (*kernel)(const struct gbg_state, const struct gbg_cuda_rows,
                       const struct gbg_cuda_cutoff);

template <int dimension> static kernel choose_mixed(const struct gbg_state *state, double power)
{
    bool one = state->n_species == 1 && !state->own_alpha;
    return power == 2.0 ? one ? mixed<dimension, 2, true> : mixed<dimension, 2, false>
           : one ? mixed<dimension, 6, true>
                        : mixed<dimension, 6, false>;
}

template <int dimension, int law> static kernel choose_sources(const struct gbg_state *state)
{
    return state->own_alpha ? in_double<dimension, law, OWN>
           : state->species ? in_double<dimension, law, SPECIES>
                            : in_double<dimension, law, ONE>;
}

template <int dimension> static kernel choose_double(const struct gbg_state *state, int whole)
{
    return whole == 2   ? choose_sources<dimension, LAW_2>(state)
           : whole == 6 ? choose_sources<dimension, LAW_6>(state)
           : whole      ? choose_sources<dimension, WHOLE>(state)
                        : choose_sources<dimension, OTHER>(state);
}

static int run(struct gbg_device *device, kernel chosen, const struct gbg_state *state,
               const struct gbg_list *list, const struct gbg_cuda_cutoff *job, const char *name)
{
    if (list->rows.n == 0) {
        return GBG_OK;
    }
    chosen<<<gbg_cuda_blocks(list->rows.n), GBG_CUDA_THREADS, 0, device->stream>>>(
        *state, list->rows, *job);
    return gbg_cuda_started(device, name);
}

int gbg_cuda_cutoff_mixed(struct gbg_device *device, struct gbg_state *state,
                          const struct gbg_list *list, double power, double cutoff, int add)
{
    if (power != 2.0 && power != 6.0) {
        return gbg_cuda_cutoff_double(device, state, list, power, cutoff, add);
    }
    struct gbg_cuda_cutoff job = {power, 0.0, 0.0, 0, add, device->halt, {}};
    job.unit = gbg_cutoff_unit_make(list->rows.dimension, list->unit, cutoff);
    job.factor = pow(job.unit.unit, -power);
    if (list->unlisted) {
        return gbg_cuda_unlisted_mixed(device, state, list, &job);
    }
    kernel chosen =
        list->rows.dimension == 2 ? choose_mixed<2>(state, power) : choose_mixed<3>(state, power);
    return run(device, chosen, state, list, &job, "cut-off forces, mixed");
}

int gbg_cuda_cutoff_double(struct gbg_device *device, struct gbg_state *state,
                           const struct gbg_list *list, double power, double cutoff, int add)
{
    struct gbg_cuda_cutoff job = {power, cutoff * cutoff, 0.0, gbg_whole_power(power),
                                  add,   device->halt,    {}};
    if (list->unlisted) {
        job.unit = gbg_cutoff_unit_make(list->rows.dimension, list->unit, cutoff);
        return gbg_cuda_unlisted_double(device, state, list, &job);
    }
    kernel chosen = list->rows.dimension == 2 ? choose_double<2>(state, job.whole)
                                              : choose_double<3>(state, job.whole);
    return run(device, chosen, state, list, &job, "cut-off forces, double");
}
