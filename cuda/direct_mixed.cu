/* L1, CUDA: minimum-image sums over all pairs, 32-bit pairs in 64-bit sums.
 *
 * Here: one thread a target, sources in tiles, every difference an integer one: simple, for few
 * particles, and what the sum of direct_symmetric.cu is compared with. 1/r comes from the unit's
 * approximation (22.9 bits) whose square is corrected by its own remainder: r^-2 is good to 1.2e-7,
 * r^-7 to 5e-7. Near pairs (gbg_strict_near), and those half a box apart, whose nearest image
 * the high words cannot tell, are summed in double precision from all 64 bits. */
#include "cuda/direct.h"

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
    int64_t i = gbg_cuda_index(), segment = blockIdx.y;
    int64_t begin = direct.tiles * segment / direct.segments;
    int64_t end = direct.tiles * (segment + 1) / direct.segments;
    uint64_t own[dimension];
    double total[dimension];
    float scale[dimension];
    for (int a = 0; a < dimension; a++) {
        own[a] = i < direct.targets ? gbg_cuda_position(state, a, i) : 0;
        total[a] = 0.0;
        scale[a] = (float)direct.scale[a];
    }
    for (int64_t tile = begin; tile < end; tile++) {
        int64_t first = tile * GBG_CUDA_TILE, k = first + threadIdx.x;
        for (int a = 0; a < dimension; a++) {
            high[a][threadIdx.x] = k < direct.n ? state.high[a][k] : 0;
        }
        alpha[threadIdx.x] =
            k < direct.n ? (float)(gbg_cuda_alpha(state, k) * direct.strength) : 0.0f;
        __syncthreads();
        int rows = direct.n - first < GBG_CUDA_TILE ? (int)(direct.n - first) : GBG_CUDA_TILE;
        float sum[dimension] = {};
#pragma unroll 4
        for (int row = 0; row < rows; row++) {
            float r[dimension], squared = 0.0f;
            bool doubtful = false;
            for (int a = 0; a < dimension; a++) {
                uint32_t d = (uint32_t)(own[a] >> 32) - high[a][row];
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
                    direct, own, there, gbg_cuda_alpha(state, first + row) * direct.strength,
                    total);
            } else {
                float w = alpha[row] * weight<whole>(squared);
                for (int a = 0; a < dimension; a++) {
                    sum[a] = __fmaf_rn(w, r[a], sum[a]);
                }
            }
        }
        for (int a = 0; a < dimension; a++) {
            total[a] += (double)sum[a];
        }
        __syncthreads();
    }
    for (int a = 0; a < dimension && i < direct.targets; a++) {
        direct.partial[(segment * dimension + a) * direct.targets + i] = total[a];
    }
}

typedef void (*kernel)(const struct gbg_state, const struct gbg_cuda_direct);

template <int dimension> static kernel choose(int whole)
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
    if (direct.targets == 0) {
        return GBG_OK;
    }
    void *rest;
    int status = gbg_cuda_direct_room(device, state, &direct, 0, &rest);
    if (status == GBG_OK) {
        kernel chosen =
            state->box.dimension == 2 ? choose<2>(direct.whole) : choose<3>(direct.whole);
        dim3 blocks(gbg_cuda_blocks(direct.targets, GBG_CUDA_TILE), (unsigned)direct.segments);
        chosen<<<blocks, GBG_CUDA_TILE, 0, device->stream>>>(*state, direct);
        status = gbg_cuda_started(device, "direct sum, mixed");
    }
    return status ? status : gbg_cuda_direct_finish(device, state, &direct, add);
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
