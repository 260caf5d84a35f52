/* L1, CUDA: minimum-image sums over all pairs, 32-bit pairs in 64-bit sums.
 *
 * Here: one thread a target, sources in tiles, every difference an integer one: simple, for few
 * particles, and what the sum of direct_symmetric.cu is compared with. 1/r comes from the unit's
 * approximation (22.9 bits) whose square is corrected by its own remainder: r^-2 is good to 1.2e-7,
 * r^-7 to 5e-7. Near pairs (gbg_strict_near), and those half a box apart, whose nearest image
 * the high words cannot tell, are summed in double precision from all 64 bits. */
#include "cuda/direct.h"

/* Sources whose pairs are summed in single precision: few, since terms of one sign that cancel in
 * the end lose more in longer sums. */
enum { RUN = 16 };

template <int whole> static __device__ __forceinline__ float weight(float squared)
{
    float y;
    asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(y) : "f"(squared));
    float second = __fmul_rn(y, y), rest = __fmaf_rn(-second, squared, 1.0f);
    second = __fmaf_rn(second, rest, second);
    y = __fmaf_rn(0.5f * y, rest, y);
    return whole == 1   ? second
           : whole == 2 ? second * y
           : whole == 3 ? second * second
           : whole == 4 ? second * second * y
           : whole == 5 ? second * second * second
                        : second * second * second * y;
}

template <int dimension, int whole>
static __global__ void one_sided(const __grid_constant__ struct gbg_state state,
                                 const __grid_constant__ struct gbg_cuda_direct direct)
{
    __shared__ uint32_t high[dimension][GBG_CUDA_TILE];
    __shared__ float alpha[GBG_CUDA_TILE];
    struct gbg_cuda_target<dimension> target(state, direct);
    float scale[dimension];
    for (int a = 0; a < dimension; a++) {
        scale[a] = (float)direct.scale[a];
    }
    for (int64_t tile = target.begin; tile < target.end; tile++) {
        int64_t first = tile * GBG_CUDA_TILE, k = first + threadIdx.x;
        for (int a = 0; a < dimension; a++) {
            high[a][threadIdx.x] = k < direct.n ? state.high[a][k] : 0;
        }
        alpha[threadIdx.x] =
            k < direct.n ? (float)(gbg_cuda_alpha(state, k) * direct.strength) : 0.0f;
        __syncthreads();
        int rows = direct.n - first < GBG_CUDA_TILE ? (int)(direct.n - first) : GBG_CUDA_TILE;
        for (int run = 0; run < rows; run += RUN) {
            const int stop = run + RUN < rows ? run + RUN : rows;
            float sum[dimension] = {};
#pragma unroll 4
            for (int row = run; row < stop; row++) {
                float r[dimension], squared = 0.0f;
                bool doubtful = false;
                for (int a = 0; a < dimension; a++) {
                    uint32_t d = (uint32_t)(target.own[a] >> 32) - high[a][row];
                    doubtful |= d == 0x80000000u;
                    r[a] = (float)(int32_t)d * scale[a];
                    squared = __fmaf_rn(r[a], r[a], squared);
                }
                if (doubtful || squared < direct.near) {
                    uint64_t there[dimension];
                    for (int a = 0; a < dimension; a++) {
                        there[a] = gbg_cuda_position(state, a, first + row);
                    }
                    gbg_cuda_add_pair<dimension, whole>(
                        direct, target.own, there,
                        gbg_cuda_alpha(state, first + row) * direct.strength, target.total);
                } else {
                    float w = alpha[row] * weight<whole>(squared);
                    for (int a = 0; a < dimension; a++) {
                        sum[a] = __fmaf_rn(w, r[a], sum[a]);
                    }
                }
            }
            for (int a = 0; a < dimension; a++) {
                target.total[a] += (double)sum[a];
            }
        }
        __syncthreads();
    }
    target.store(direct);
}

template <int dimension> static gbg_cuda_direct_kernel choose(int whole)
{
    return whole == 1   ? one_sided<dimension, 1>
           : whole == 2 ? one_sided<dimension, 2>
           : whole == 3 ? one_sided<dimension, 3>
           : whole == 4 ? one_sided<dimension, 4>
           : whole == 5 ? one_sided<dimension, 5>
                        : one_sided<dimension, 6>;
}

int gbg_cuda_direct_simple(struct gbg_device *device, struct gbg_state *state, double power,
                           int add)
{
    struct gbg_cuda_direct direct = gbg_cuda_direct_make(state, power);
    if (direct.whole == 0) {
        return gbg_cuda_direct_double(device, state, power, add);
    }
    return gbg_cuda_direct_run(device, state, &direct,
                               state->box.dimension == 2 ? choose<2>(direct.whole)
                                                         : choose<3>(direct.whole),
                               add, "direct sum, mixed");
}

/* Few particles are not worth 32 bits, nor, a little above, a sort. */
enum { FEWEST = 256 };

int gbg_cuda_direct_mixed(struct gbg_device *device, struct gbg_state *state, double power, int add)
{
    int64_t n = state->owned + state->ghost;
    struct gbg_cuda_direct direct = gbg_cuda_direct_make(state, power);
    if (n <= FEWEST || direct.whole == 0) {
        return gbg_cuda_direct_double(device, state, power, add);
    }
    return (n < GBG_CUDA_SYMMETRIC_FEWEST ? gbg_cuda_direct_simple
                                          : gbg_cuda_direct_symmetric)(device, state, power, add);
}
