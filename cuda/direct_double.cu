/* L1, CUDA: minimum-image sums over all pairs in double precision, all 64 bits of the positions: a
 * thread a target, sources in tiles. */
#include "cuda/direct.h"

template <int dimension, int whole>
static __global__ void all_pairs(const __grid_constant__ struct gbg_state state,
                                 const __grid_constant__ struct gbg_cuda_direct direct)
{
    __shared__ uint64_t place[dimension][GBG_CUDA_TILE];
    __shared__ double alpha[GBG_CUDA_TILE];
    struct gbg_cuda_target<dimension> target(state, direct);
    for (int64_t tile = target.begin; tile < target.end; tile++) {
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
            gbg_cuda_add_pair<dimension, whole>(direct, target.own, there, alpha[row], sum);
        }
        for (int a = 0; a < dimension; a++) {
            target.total[a] += sum[a];
        }
        __syncthreads();
    }
    target.store(direct);
}

int gbg_cuda_direct_double(struct gbg_device *device, struct gbg_state *state, double power,
                           int add)
{
    struct gbg_cuda_direct direct = gbg_cuda_direct_make(state, power);
    return gbg_cuda_direct_run(device, state, &direct,
                               GBG_CUDA_CHOOSE(all_pairs, state->box.dimension, direct.whole), add,
                               "direct sum, double");
}
