/* L1, CUDA: putting violated pairs back to where they were before the step. */
#include "cuda/kernels.h"

#include "cuda/exact.h"
#include "cuda/grid.h"

/* LAST: put back in the last pass; only pairs with such a particle can be violated anew. */
enum mark { FREE, VIOLATED, LAST, REVERTED };

/* Cells of the coordinates before the step, so wide that two particles which overlap after it, or
 * passed through each other, are neighbours there: whoever is put back stays in his cell. */
struct roll {
    struct gbg_exact exact;
    struct gbg_cuda_grid grid;
    int straight;
    unsigned char *mark;
    unsigned long long *count; /* put back in a pass */
};

template <int dimension>
static __device__ __forceinline__ bool violated(const struct gbg_state &state,
                                                const struct roll &roll, int64_t i, int64_t j)
{
    double nearest;
    return gbg_exact_pair_contact(&roll.exact, &state, i, j) > 0.0 &&
           (gbg_exact_pair_overlap(&roll.exact, &state, dimension, i, j) ||
            (roll.straight &&
             gbg_exact_pair_passed(&roll.exact, &state, dimension, i, j, &nearest)));
}

/* Marks all particles of violated pairs. Several threads may mark the same: all write the same. */
template <int dimension>
static __global__ void find_first(const __grid_constant__ struct gbg_state state,
                                  const __grid_constant__ struct roll roll)
{
    int64_t slot = gbg_cuda_index();
    if (slot >= roll.grid.n) {
        return;
    }
    int32_t i = roll.grid.particle[slot];
    gbg_cuda_visit(roll.grid, roll.grid.cell_of[i], [&](int32_t other) {
        int32_t j = roll.grid.particle[other];
        if (j > i && violated<dimension>(state, roll, i, j)) {
            roll.mark[i] = VIOLATED;
            roll.mark[j] = VIOLATED;
        }
    });
}

/* Marks whoever is in a violated pair with a particle that was put back in the last pass. */
template <int dimension>
static __global__ void find_next(const __grid_constant__ struct gbg_state state,
                                 const __grid_constant__ struct roll roll)
{
    int64_t slot = gbg_cuda_index();
    if (slot >= roll.grid.n) {
        return;
    }
    int32_t i = roll.grid.particle[slot];
    if (roll.mark[i] != LAST) {
        return;
    }
    gbg_cuda_visit(roll.grid, roll.grid.cell_of[i], [&](int32_t other) {
        int32_t j = roll.grid.particle[other];
        if (roll.mark[j] == FREE && violated<dimension>(state, roll, i, j)) {
            roll.mark[j] = VIOLATED;
        }
    });
}

/* Puts the marked particles back. */
static __global__ void collect(const __grid_constant__ struct gbg_state state,
                               const __grid_constant__ struct roll roll)
{
    int64_t i = gbg_cuda_index();
    int mark = i < state.owned ? roll.mark[i] : FREE;
    if (mark == VIOLATED) {
        for (int a = 0; a < state.box.dimension; a++) {
            state.high[a][i] = state.start_high[a][i];
            state.low[a][i] = state.start_low[a][i];
            if (state.image[a]) {
                state.image[a][i] = state.start_image[a][i];
            }
        }
        if (state.overlapped) {
            state.overlapped[i] = 1;
        }
        roll.mark[i] = LAST;
    } else if (mark == LAST) {
        roll.mark[i] = REVERTED;
    }
    int count = __syncthreads_count(mark == VIOLATED);
    if (threadIdx.x == 0 && count > 0) {
        atomicAdd(roll.count, (unsigned long long)count);
    }
}

/* One pass: who is violated, and putting these back; `last` receives their number. */
template <int dimension>
static int pass(struct gbg_device *device, const struct gbg_state *state, const struct roll *roll,
                int first, unsigned long long *last)
{
    unsigned blocks = gbg_cuda_blocks(state->owned);
    int status = gbg_cuda_clear(device, roll->count, sizeof *roll->count);
    if (status != GBG_OK) {
        return status;
    }
    (first ? find_first<dimension>
           : find_next<dimension>)<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, *roll);
    collect<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, *roll);
    status = gbg_cuda_started(device, "roll_back");
    return status ? status : gbg_cuda_fetch(device, last, roll->count, sizeof *last);
}

static int reserve(struct gbg_device *device, const struct gbg_state *state, struct roll *roll)
{
    size_t used = 0;
    double widest;
    void *memory = NULL;
    int status = gbg_cuda_widest_move(device, state, &widest);
    status = status ? status
                    : gbg_cuda_grid_build(device, &roll->grid, &state->box,
                                          roll->exact.largest + 2.0 * widest, state->owned,
                                          state->start_high);
    gbg_cuda_take(NULL, &used, 1, sizeof *roll->count);
    gbg_cuda_take(NULL, &used, state->owned, 1);
    status = status ? status : gbg_cuda_workspace(device, used, &memory);
    status = status ? status : gbg_cuda_clear(device, memory, used);
    used = 0;
    roll->count = (unsigned long long *)gbg_cuda_take(memory, &used, 1, sizeof *roll->count);
    roll->mark = (unsigned char *)gbg_cuda_take(memory, &used, state->owned, 1);
    return status;
}

int gbg_cuda_roll_back(struct gbg_device *device, struct gbg_state *state, double tolerance,
                       int straight, int64_t *reverted)
{
    struct roll roll = {};
    unsigned long long last = 1;
    *reverted = 0;
    if (state->owned == 0) {
        return GBG_OK;
    }
    gbg_exact_make(state, tolerance, &roll.exact);
    roll.straight = straight;
    int status = reserve(device, state, &roll);
    for (int first = 1; status == GBG_OK && last > 0; first = 0) {
        status = state->box.dimension == 2 ? pass<2>(device, state, &roll, first, &last)
                                           : pass<3>(device, state, &roll, first, &last);
        *reverted += status == GBG_OK ? (int64_t)last : 0;
    }
    gbg_cuda_grid_release(device, &roll.grid);
    return status;
}
