/* L1, CUDA: the Euler-Maruyama step of one particle. */
#ifndef GBG_CUDA_INTEGRATE_H
#define GBG_CUDA_INTEGRATE_H

#include "backend/cpu/grid.h"
#include "backend/cpu/noise.h"
#include "cuda/cuda.h"

/* Squares of the largest moves as bits; the particle of lowest rank with a bad move: rank << 32 |
 * index, or GBG_CUDA_NONE. */
struct gbg_cuda_extremes {
    unsigned long long drift, noise, total, bad;
};
#define GBG_CUDA_NONE (~0ull)

struct gbg_cuda_euler {
    struct gbg_noise noise;
    double dt;
    int sign;
    double half[3], per_quantum[3]; /* of the box; quanta in a length */
};

static inline struct gbg_cuda_euler
gbg_cuda_euler_make(const struct gbg_box *box, const struct gbg_noise *noise, double dt, int sign)
{
    struct gbg_cuda_euler euler;
    memset(&euler, 0, sizeof euler); /* so that two may be compared as bytes */
    euler.noise = *noise;
    euler.dt = dt;
    euler.sign = sign;
    for (int a = 0; a < box->dimension; a++) {
        euler.half[a] = 0.5 * box->length[a];
        euler.per_quantum[a] = 1.0 / box->quantum[a];
    }
    return euler;
}

/* Squares of what one particle did. */
struct gbg_cuda_move {
    double drift, noise, total;
};

static __device__ __forceinline__ void gbg_cuda_draw(const struct gbg_cuda_euler &euler,
                                                     uint64_t step, const struct gbg_state &state,
                                                     int64_t i, float xi[3])
{
    uint64_t id = state.id ? state.id[i] : (uint64_t)i;
    xi[0] = xi[1] = xi[2] = 0.0f;
    if (euler.noise.scale > 0.0) { /* without noise none is drawn */
        gbg_noise_lanes(&euler.noise, step, (vi)(uint32_t)id, (vi)(uint32_t)(id >> 32),
                        state.box.dimension, xi);
    }
}

/* Force on particle i from the state's arrays; none: 0. */
template <int dimension>
static __device__ __forceinline__ void gbg_cuda_stored_force(const struct gbg_state &state,
                                                             int64_t i, double force[dimension])
{
    for (int a = 0; a < dimension; a++) {
        force[a] = state.force[a] ? state.force[a][i] : 0.0;
    }
}

/* Moves particle i on one axis from `old`, which is where it is. */
static __device__ __forceinline__ void gbg_cuda_shift(const struct gbg_state &state, int a,
                                                      int64_t i, uint64_t old, int64_t quanta)
{
    uint64_t moved = old + (uint64_t)quanta;
    state.high[a][i] = (uint32_t)(moved >> 32);
    state.low[a][i] = (uint32_t)moved;
    if (state.image[a]) {
        state.image[a][i] += (quanta > 0 && moved < old) - (quanta < 0 && moved > old);
    }
}

/* x += sign (F dt + scale xi); a particle with a bad move stays and is named. */
template <int dimension>
static __device__ __forceinline__ struct gbg_cuda_move
gbg_cuda_step(const struct gbg_state &state, const struct gbg_cuda_euler &euler, uint64_t step,
              int64_t i, const double *force, struct gbg_cuda_extremes *extremes)
{
    struct gbg_cuda_move made = {0.0, 0.0, 0.0};
    float xi[3];
    int64_t quanta[dimension];
    bool bad = false;
    gbg_cuda_draw(euler, step, state, i, xi);
    for (int a = 0; a < dimension; a++) {
        double drift = force[a] * euler.dt;
        double noise = euler.noise.scale * (double)xi[a], total = drift + noise;
        made.drift += drift * drift;
        made.noise += noise * noise;
        made.total += total * total;
        bool good = fabs(total) < euler.half[a]; /* false for NaN too */
        bad |= !good;
        quanta[a] = (int64_t)rint(good ? total * euler.per_quantum[a] : 0.0);
    }
    if (bad) {
        atomicMin(&extremes->bad,
                  (unsigned long long)gbg_rank_of(&state, i) << 32 | (unsigned long long)i);
        /* NaN is left out of the maxima: its particle is named */
        made.drift = made.drift == made.drift ? made.drift : 0.0;
        made.noise = made.noise == made.noise ? made.noise : 0.0;
        made.total = made.total == made.total ? made.total : 0.0;
        return made;
    }
    for (int a = 0; a < dimension; a++) {
        gbg_cuda_shift(state, a, i, gbg_join(state.high[a][i], state.low[a][i]),
                       euler.sign * quanta[a]);
    }
    return made;
}

static inline double gbg_cuda_root(unsigned long long bits)
{
    double value;
    memcpy(&value, &bits, sizeof value);
    return sqrt(value);
}

#endif
