/* L1, CUDA: what the cut-off sums share, with a list and without: what is asked for, and pairs in
 * double precision. */
#ifndef GBG_CUDA_CUTOFF_H
#define GBG_CUDA_CUTOFF_H

#include "backend/cpu/grid.h"
#include "backend/cpu/power.h"
#include "cuda/cuda.h"

struct gbg_cuda_cutoff {
    double power, limit; /* limit: squared cut-off, double sums */
    double factor;       /* of fields in units of the cut-off, mixed sums */
    int whole, add;
    const int *halt; /* of a batch of steps */
    struct gbg_cutoff_unit unit;
};

static __device__ __forceinline__ void gbg_cuda_store_force(const struct gbg_state &state, int add,
                                                            int64_t i, int axis, double field)
{
    double force = state.mobility[state.species ? state.species[i] : 0] * field;
    double *target = &state.force[axis][i];
    *target = add ? *target + force : force;
}

/* Adds the field of particle j at a place, by all 64 bits; strength(): of the source;
 * inverse(squared): |r|^-(power+1). */
template <int dimension, typename Strength, typename Inverse>
static __device__ __forceinline__ void
gbg_cuda_add_in_double(const struct gbg_state &state, double limit, const uint64_t own[dimension],
                       int32_t j, Strength strength, Inverse inverse, double sum[dimension])
{
    double r[dimension], squared = 0.0;
    for (int a = 0; a < dimension; a++) {
        uint64_t there = gbg_join(__ldg(state.high[a] + j), __ldg(state.low[a] + j));
        r[a] = gbg_box_difference(&state.box, a, own[a], there);
        squared += r[a] * r[a];
    }
    if (squared < limit && squared > 0.0) {
        double f = strength() * inverse(squared);
        for (int a = 0; a < dimension; a++) {
            sum[a] += f * r[a];
        }
    }
}

#endif
