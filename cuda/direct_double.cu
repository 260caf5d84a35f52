/* L1, CUDA: minimum-image sums over all pairs in double precision, all 64 bits of the positions: a
 * thread a target, sources in tiles. */
#include "cuda/direct.h"

template <int dimension, int whole>
static __global__ void all_pairs(const __grid_constant__ struct gbg_state state,
                                 const __grid_constant__ struct gbg_cuda_direct direct)
{
    __shared__ uint64_t place[dimension][GBG_CUDA_TILE];
    __shared__ double alpha[GBG_CUDA_TILE];
    int64_t i = gbg_cuda_index(), segment = blockIdx.y;
    int64_t begin = direct.tiles * segment / direct.segments;
    int64_t end = direct.tiles * (segment + 1) / direct.segments;
    uint64_t own[dimension];
    double total[dimension];
    for (int a = 0; a < dimension; a++) {
        own[a] = i < direct.targets ? gbg_cuda_position(state, a, i) : 0;
        total[a] = 0.0;
    }
    for (int64_t tile = begin; tile < end; tile++) {
        int64_t k = tile * GBG_CUDA_TILE + threadIdx.x;
        for (int a = 0; a < dimension; a++) {
            place[a][threadIdx.x] = k < direct.n ? gbg_cuda_position(state, a, k) : 0;
        }
        alpha[threadIdx.x] = k < direct.n ? gbg_cuda_alpha(state, k) * direct.strength : 0.0;
        __syncthreads();
        double sum[dimension] = {};
#pragma unroll 4
        for (int row = 0; row < GBG_CUDA_TILE; row++) {
            uint64_t there[dimension];
            for (int a = 0; a < dimension; a++) {
                there[a] = place[a][row];
            }
            gbg_cuda_add_pair<dimension, whole>(direct, own, there, alpha[row], sum);
        }
        for (int a = 0; a < dimension; a++) {
            total[a] += sum[a];
        }
        __syncthreads();
    }
    for (int a = 0; a < dimension && i < direct.targets; a++) {
        direct.partial[(segment * dimension + a) * direct.targets + i] = total[a];
    }
}

typedef void (*kernel)(const struct gbg_state, const struct gbg_cuda_direct);

int gbg_cuda_direct_double(struct gbg_device *device, struct gbg_state *state, double power,
                           int add)
{
    struct gbg_cuda_direct direct = gbg_cuda_direct_make(state, power);
    if (direct.targets == 0) {
        return GBG_OK;
    }
    void *rest;
    int status = gbg_cuda_direct_room(device, state, &direct, 0, &rest);
    if (status == GBG_OK) {
        kernel chosen = GBG_CUDA_CHOOSE(all_pairs, state->box.dimension, direct.whole);
        dim3 blocks(gbg_cuda_blocks(direct.targets, GBG_CUDA_TILE), (unsigned)direct.segments);
        chosen<<<blocks, GBG_CUDA_TILE, 0, device->stream>>>(*state, direct);
        status = gbg_cuda_started(device, "direct sum, double");
    }
    return status ? status : gbg_cuda_direct_finish(device, state, &direct, add);
}
