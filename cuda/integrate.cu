/* L1, CUDA: the Euler-Maruyama step of Brownian dynamics. */
#include "cuda/integrate.h"

#include "cuda/kernels.h"

template <int dimension>
static __global__ void integrate(const __grid_constant__ struct gbg_state state,
                                 const __grid_constant__ struct gbg_cuda_euler euler, uint64_t step,
                                 struct gbg_cuda_extremes *extremes)
{
    int64_t i = gbg_cuda_index();
    struct gbg_cuda_move made = {0.0, 0.0, 0.0};
    if (i < state.owned) {
        double force[dimension];
        gbg_cuda_stored_force<dimension>(state, i, force);
        made = gbg_cuda_step<dimension>(state, euler, step, i, force, extremes);
    }
    gbg_cuda_max(&extremes->drift, made.drift);
    gbg_cuda_max(&extremes->noise, made.noise);
    gbg_cuda_max(&extremes->total, made.total);
}

static __global__ void start(struct gbg_cuda_extremes *extremes)
{
    extremes->drift = extremes->noise = extremes->total = 0;
    extremes->bad = GBG_CUDA_NONE;
}

int gbg_cuda_integrate(struct gbg_device *device, struct gbg_state *state,
                       const struct gbg_noise *noise, uint64_t step, double dt, int sign,
                       struct gbg_moves *moves)
{
    struct gbg_cuda_euler euler = gbg_cuda_euler_make(&state->box, noise, dt, sign);
    struct gbg_cuda_extremes seen = {0, 0, 0, GBG_CUDA_NONE}, *extremes;
    void *memory;
    int status = gbg_cuda_workspace(device, sizeof seen, &memory);
    if (status == GBG_OK && state->owned > 0) {
        unsigned blocks = gbg_cuda_blocks(state->owned);
        extremes = (struct gbg_cuda_extremes *)memory;
        start<<<1, 1, 0, device->stream>>>(extremes);
        (state->box.dimension == 2 ? integrate<2>
                                   : integrate<3>)<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(
            *state, euler, step, extremes);
        status = gbg_cuda_started(device, "integrate");
        status = status ? status : gbg_cuda_fetch(device, &seen, extremes, sizeof seen);
    }
    moves->drift = gbg_cuda_root(seen.drift);
    moves->noise = gbg_cuda_root(seen.noise);
    moves->total = gbg_cuda_root(seen.total);
    moves->bad = seen.bad == GBG_CUDA_NONE ? -1 : (int64_t)(seen.bad & UINT32_MAX);
    return status;
}
