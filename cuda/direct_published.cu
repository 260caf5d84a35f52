/* L1, CUDA: the two designs of Carter (2016) for the sum over all pairs, for the benchmark only:
 * one-sided, all in single precision, nearest images by rounding differences of floats. Design 0:
 * tiles of sources in shared memory; design 1: a warp's sources pass from lane to lane. */
#include "cuda/direct.h"

namespace
{

struct published {
    int64_t n, targets;
    float *x[3], *alpha; /* padded to whole tiles */
    float length[3], inverse[3];
    int64_t padded;
    double power;
};

} // namespace

static __global__ void pack(const __grid_constant__ struct gbg_state state,
                            const __grid_constant__ struct published p)
{
    int64_t i = gbg_cuda_index();
    if (i < p.padded) {
        for (int a = 0; a < state.box.dimension; a++) {
            p.x[a][i] = i < p.n ? (float)state.high[a][i] * 0x1p-32f * p.length[a] : 0.0f;
        }
        p.alpha[i] = i < p.n ? (float)gbg_cuda_alpha(state, i) : 0.0f;
    }
}

/* Whole powers up to 6 by products of the inverse root, others by the library. */
template <int whole> static __device__ __forceinline__ float weight(float squared, float power)
{
    return whole ? gbg_cuda_raise<whole>(rsqrtf(squared)) : powf(squared, -0.5f * (power + 1.0f));
}

template <int dimension, int whole>
static __device__ __forceinline__ void
interact(const struct published &p, const float own[dimension], const float there[dimension],
         float alpha, float sum[dimension])
{
    float r[dimension], squared = 0.0f;
    for (int a = 0; a < dimension; a++) {
        r[a] = own[a] - there[a];
        r[a] = __fmaf_rn(-p.length[a], rintf(r[a] * p.inverse[a]), r[a]);
        squared = __fmaf_rn(r[a], r[a], squared);
    }
    float w = squared > 0.0f ? alpha * weight<whole>(squared, (float)p.power) : 0.0f;
    for (int a = 0; a < dimension; a++) {
        sum[a] = __fmaf_rn(w, r[a], sum[a]);
    }
}

static __device__ void store(const struct gbg_state &state, int64_t i, const float *sum)
{
    if (i < state.owned) {
        double mobility = state.mobility[state.species ? state.species[i] : 0];
        for (int a = 0; a < state.box.dimension; a++) {
            state.force[a][i] = mobility * (double)sum[a];
        }
    }
}

template <int dimension, int whole>
static __global__ void shared_tiles(const __grid_constant__ struct gbg_state state,
                                    const __grid_constant__ struct published p)
{
    __shared__ float x[dimension][GBG_CUDA_TILE], alpha[GBG_CUDA_TILE];
    int64_t i = gbg_cuda_index();
    float own[dimension], sum[dimension] = {};
    for (int a = 0; a < dimension; a++) {
        own[a] = p.x[a][i];
    }
    for (int64_t first = 0; first < p.padded; first += GBG_CUDA_TILE) {
        for (int a = 0; a < dimension; a++) {
            x[a][threadIdx.x] = p.x[a][first + threadIdx.x];
        }
        alpha[threadIdx.x] = p.alpha[first + threadIdx.x];
        __syncthreads();
#pragma unroll 8
        for (int row = 0; row < GBG_CUDA_TILE; row++) {
            float there[dimension];
            for (int a = 0; a < dimension; a++) {
                there[a] = x[a][row];
            }
            interact<dimension, whole>(p, own, there, alpha[row], sum);
        }
        __syncthreads();
    }
    store(state, i, sum);
}

template <int dimension, int whole>
static __global__ void shuffled(const __grid_constant__ struct gbg_state state,
                                const __grid_constant__ struct published p)
{
    int64_t i = gbg_cuda_index();
    float own[dimension], sum[dimension] = {};
    for (int a = 0; a < dimension; a++) {
        own[a] = p.x[a][i];
    }
    for (int64_t first = threadIdx.x % 32; first < p.padded; first += 32) {
        float mine[dimension], alpha = p.alpha[first];
        for (int a = 0; a < dimension; a++) {
            mine[a] = p.x[a][first];
        }
#pragma unroll 8
        for (int lane = 0; lane < 32; lane++) {
            float there[dimension];
            for (int a = 0; a < dimension; a++) {
                there[a] = __shfl_sync(0xFFFFFFFFu, mine[a], lane);
            }
            interact<dimension, whole>(p, own, there, __shfl_sync(0xFFFFFFFFu, alpha, lane), sum);
        }
    }
    store(state, i, sum);
}

typedef void (*kernel)(const struct gbg_state, const struct published);

int gbg_cuda_direct_published(struct gbg_device *device, struct gbg_state *state, double power,
                              int design)
{
    int dimension = state->box.dimension, whole = gbg_cuda_direct_make(state, power).whole;
    struct published p = {};
    size_t used = 0;
    void *base;
    p.n = state->owned + state->ghost;
    p.padded = (p.n + GBG_CUDA_TILE - 1) / GBG_CUDA_TILE * GBG_CUDA_TILE;
    p.power = power;
    for (int a = 0; a < dimension; a++) {
        p.length[a] = (float)state->box.length[a];
        p.inverse[a] = 1.0f / p.length[a];
    }
    if (state->owned == 0) {
        return GBG_OK;
    }
    int status = gbg_cuda_workspace(device, (size_t)p.padded * 16 + 1024, &base);
    if (status != GBG_OK) {
        return status;
    }
    for (int a = 0; a < dimension; a++) {
        p.x[a] = (float *)gbg_cuda_take(base, &used, p.padded, sizeof(float));
    }
    p.alpha = (float *)gbg_cuda_take(base, &used, p.padded, sizeof(float));
    unsigned blocks = gbg_cuda_blocks(p.padded, GBG_CUDA_TILE);
    pack<<<blocks, GBG_CUDA_TILE, 0, device->stream>>>(*state, p);
    kernel chosen = design == 0 ? GBG_CUDA_CHOOSE(shared_tiles, dimension, whole)
                                : GBG_CUDA_CHOOSE(shuffled, dimension, whole);
    chosen<<<blocks, GBG_CUDA_TILE, 0, device->stream>>>(*state, p);
    return gbg_cuda_started(device, "direct sum, published design");
}
