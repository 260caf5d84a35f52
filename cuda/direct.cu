/* L1, CUDA: work arrays of the direct sums, and the reference sum on single particles. */
#include "cuda/direct.h"

#include "backend/cpu/direct_strict.h"

static double largest_alpha(const struct gbg_state *state)
{
    double largest = 0.0;
    for (int s = 0; s < state->n_species && !state->own_alpha; s++) {
        largest = fmax(largest, fabs(state->alpha[s]));
    }
    return largest > 0.0 ? largest : 1.0; /* a caller's own are at most 1 */
}

/* Few targets leave room for several blocks each. A matter of the sizes alone, not of the card:
 * the order of a sum follows from it. */
static int64_t segments_for(int64_t targets, int64_t tiles)
{
    enum { THREADS = 1 << 18 };
    int64_t wanted = targets > 0 ? THREADS / targets : 1;
    wanted = wanted > 1 ? wanted : 1;
    return wanted < tiles ? wanted : tiles;
}

struct gbg_cuda_direct gbg_cuda_direct_make(const struct gbg_state *state, double power)
{
    struct gbg_cuda_direct direct = {};
    double longest = 0.0, largest = largest_alpha(state);
    for (int a = 0; a < state->box.dimension; a++) {
        longest = fmax(longest, state->box.length[a]);
    }
    for (int a = 0; a < state->box.dimension; a++) {
        direct.scale[a] = state->box.length[a] / longest * 0x1p-26;
    }
    direct.power = power;
    direct.whole = gbg_whole_power(power);
    direct.whole = direct.whole <= GBG_CUDA_DIRECT_POWER ? direct.whole : 0;
    direct.strength = 1.0 / largest;
    direct.factor = largest * pow(longest * 0x1p-6, -power);
    direct.targets = state->owned;
    direct.n = state->owned + state->ghost;
    double near = gbg_strict_near(direct.n, state->box.dimension) * 0x1p-26;
    direct.near = (float)(near * near);
    direct.tiles = (direct.n + GBG_CUDA_TILE - 1) / GBG_CUDA_TILE;
    direct.segments = segments_for(direct.targets, direct.tiles);
    return direct;
}

int gbg_cuda_direct_room(struct gbg_device *device, const struct gbg_state *state,
                         struct gbg_cuda_direct *direct, size_t more, void **rest)
{
    size_t used = 0;
    int64_t count = direct->segments * direct->targets * state->box.dimension;
    gbg_cuda_take(NULL, &used, count, sizeof *direct->partial);
    void *base;
    int status = gbg_cuda_workspace(device, used + more, &base);
    if (status == GBG_OK) {
        direct->partial = (double *)base;
        *rest = (char *)base + used;
    }
    return status;
}

static __global__ void finish(const __grid_constant__ struct gbg_state state,
                              const __grid_constant__ struct gbg_cuda_direct direct, int add)
{
    int64_t i = gbg_cuda_index();
    if (i >= direct.targets) {
        return;
    }
    double mobility = state.mobility[state.species ? state.species[i] : 0] * direct.factor;
    for (int a = 0; a < state.box.dimension; a++) {
        double field = 0.0;
        for (int64_t s = 0; s < direct.segments; s++) {
            field += direct.partial[(s * state.box.dimension + a) * direct.targets + i];
        }
        double force = mobility * field, *target = &state.force[a][i];
        *target = add ? *target + force : force;
    }
}

int gbg_cuda_direct_run(struct gbg_device *device, const struct gbg_state *state,
                        struct gbg_cuda_direct *direct, gbg_cuda_direct_kernel kernel, int add,
                        const char *what)
{
    void *rest;
    if (direct->targets == 0) {
        return GBG_OK;
    }
    int status = gbg_cuda_direct_room(device, state, direct, 0, &rest);
    if (status == GBG_OK) {
        dim3 blocks(gbg_cuda_blocks(direct->targets, GBG_CUDA_TILE), (unsigned)direct->segments);
        kernel<<<blocks, GBG_CUDA_TILE, 0, device->stream>>>(*state, *direct);
        status = gbg_cuda_started(device, what);
    }
    if (status == GBG_OK) {
        finish<<<gbg_cuda_blocks(direct->targets), GBG_CUDA_THREADS, 0, device->stream>>>(
            *state, *direct, add);
        status = gbg_cuda_started(device, "direct sum, forces");
    }
    return status;
}

int gbg_cuda_direct_reserve(struct gbg_device *device, const struct gbg_state *state)
{
    struct gbg_cuda_direct direct = gbg_cuda_direct_make(state, 2.0);
    size_t symmetric = gbg_cuda_symmetric_bytes(state), strict = gbg_cuda_strict_bytes(state);
    void *rest;
    return gbg_cuda_direct_room(device, state, &direct, symmetric > strict ? symmetric : strict,
                                &rest);
}

/* The reference: a block a target, compensated sums of its threads, then a tree. */
namespace
{

struct reference {
    double power, limit; /* limit: squared cut-off */
    int64_t targets;
    const int32_t *target;
    double *out; /* [axis][target] */
};

enum { REFERENCE_THREADS = 256 };

} // namespace

/* Adds a term to a sum and its rounding error to `lost` (Neumaier). */
static __device__ void add_compensated(double term, double *sum, double *lost)
{
    double total = *sum + term;
    *lost += fabs(*sum) >= fabs(term) ? (*sum - total) + term : (term - total) + *sum;
    *sum = total;
}

static __global__ void sum_reference(const __grid_constant__ struct gbg_state state,
                                     const __grid_constant__ struct reference job)
{
    __shared__ double shared_sum[REFERENCE_THREADS], shared_lost[REFERENCE_THREADS];
    int64_t i = job.target[blockIdx.x];
    int dimension = state.box.dimension, whole = gbg_whole_power(job.power);
    double sum[3] = {0.0, 0.0, 0.0}, lost[3] = {0.0, 0.0, 0.0};
    for (int64_t k = threadIdx.x; k < state.owned + state.ghost; k += REFERENCE_THREADS) {
        double r[3], squared = 0.0;
        for (int a = 0; a < dimension; a++) {
            r[a] = gbg_box_difference(&state.box, a, gbg_cuda_position(state, a, i),
                                      gbg_cuda_position(state, a, k));
            squared += r[a] * r[a];
        }
        if (squared > 0.0 && squared < job.limit) {
            double w = gbg_cuda_alpha(state, k) * gbg_inverse_double(squared, job.power, whole);
            for (int a = 0; a < dimension; a++) {
                add_compensated(w * r[a], &sum[a], &lost[a]);
            }
        }
    }
    double mobility = state.mobility[state.species ? state.species[i] : 0];
    for (int a = 0; a < dimension; a++) {
        shared_sum[threadIdx.x] = sum[a];
        shared_lost[threadIdx.x] = lost[a];
        __syncthreads();
        for (int half = REFERENCE_THREADS / 2; half > 0; half /= 2) {
            if (threadIdx.x < half) {
                add_compensated(shared_sum[threadIdx.x + half], &shared_sum[threadIdx.x],
                                &shared_lost[threadIdx.x]);
                shared_lost[threadIdx.x] += shared_lost[threadIdx.x + half];
            }
            __syncthreads();
        }
        if (threadIdx.x == 0) {
            job.out[a * job.targets + blockIdx.x] = mobility * (shared_sum[0] + shared_lost[0]);
        }
        __syncthreads();
    }
}

int gbg_cuda_direct_targets(struct gbg_device *device, struct gbg_state *state, double power,
                            double cutoff, int64_t n_targets, const int32_t *target,
                            double *const *out)
{
    struct reference job = {power, cutoff > 0.0 ? cutoff * cutoff : INFINITY, n_targets, NULL,
                            NULL};
    size_t used = 0, results;
    gbg_cuda_take(NULL, &used, n_targets, sizeof *target);
    results = used;
    gbg_cuda_take(NULL, &used, n_targets * state->box.dimension, sizeof **out);
    void *base;
    if (n_targets == 0) {
        return GBG_OK;
    }
    int status = gbg_cuda_workspace(device, used, &base);
    if (status == GBG_OK) {
        job.target = (const int32_t *)base;
        job.out = (double *)((char *)base + results);
        status = gbg_cuda_status(device,
                                 cudaMemcpyAsync(base, target, (size_t)n_targets * sizeof *target,
                                                 cudaMemcpyHostToDevice, device->stream),
                                 "copying targets");
    }
    if (status == GBG_OK) {
        sum_reference<<<(unsigned)n_targets, REFERENCE_THREADS, 0, device->stream>>>(*state, job);
        status = gbg_cuda_started(device, "reference sum");
    }
    for (int a = 0; a < state->box.dimension && status == GBG_OK; a++) {
        status = gbg_cuda_fetch(device, out[a], job.out + a * n_targets,
                                (size_t)n_targets * sizeof **out);
    }
    return status;
}
