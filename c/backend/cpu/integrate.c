/* L1, CPU, per instruction set: the Euler-Maruyama step of Brownian dynamics. */
#include <math.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/grid.h"
#include "backend/cpu/noise.h"
#include "backend/cpu/variant.h"

/* What every block of the loop needs. */
struct euler {
    struct gbg_state *state;
    const struct gbg_noise *noise;
    uint64_t step;
    double dt;
    int sign;
};

/* Squares of the largest moves; particles with a bad move: that of the lowest rank. */
struct extremes {
    double drift, noise, total;
    int64_t bad; /* rank << 32 | index; INT64_MAX: none */
};

/* Moves of one vector of particles, in quanta. */
struct block {
    double drift[VF_LANES], noise[VF_LANES], total[VF_LANES];
    int64_t quanta[3][VF_LANES];
    int bad[VF_LANES];
};

static void draw(const struct euler *euler, int64_t first, float xi[3][VF_LANES])
{
    const struct gbg_state *state = euler->state;
    vi id_low, id_high;
    vf lanes[3];
    if (state->id) {
        uint32_t low[VF_LANES] = {0}, high[VF_LANES] = {0};
        int64_t there = state->owned - first < VF_LANES ? state->owned - first : VF_LANES;
        for (int64_t l = 0; l < there; l++) {
            low[l] = (uint32_t)state->id[first + l];
            high[l] = (uint32_t)(state->id[first + l] >> 32);
        }
        id_low = vi_load(low);
        id_high = vi_load(high);
    } else {
        gbg_noise_ids((uint64_t)first, &id_low, &id_high);
    }
    gbg_noise_lanes(euler->noise, euler->step, id_low, id_high, state->box.dimension, lanes);
    for (int a = 0; a < state->box.dimension; a++) {
        vf_store(xi[a], lanes[a]);
    }
}

static inline void find_moves(const struct euler *euler, int64_t first, int lanes,
                              struct block *block)
{
    const struct gbg_state *state = euler->state;
    float xi[3][VF_LANES] = {{0.0f}};
    if (euler->noise->scale > 0.0) { /* without noise none is drawn */
        draw(euler, first, xi);
    }
    for (int l = 0; l < VF_LANES; l++) {
        block->drift[l] = block->noise[l] = block->total[l] = 0.0;
        block->bad[l] = 0;
    }
    for (int a = 0; a < state->box.dimension; a++) {
        const double *force = state->force[a] ? state->force[a] + first : NULL;
        double half = 0.5 * state->box.length[a], per_quantum = 1.0 / state->box.quantum[a];
        for (int l = 0; l < lanes; l++) {
            double drift = force ? force[l] * euler->dt : 0.0;
            double noise = euler->noise->scale * (double)xi[a][l], total = drift + noise;
            block->drift[l] += drift * drift;
            block->noise[l] += noise * noise;
            block->total[l] += total * total;
            int good = fabs(total) < half; /* false for NaN too */
            block->bad[l] |= !good;
            block->quanta[a][l] = (int64_t)rint(good ? total * per_quantum : 0.0);
        }
    }
}

static inline void move(const struct euler *euler, int64_t first, int lanes,
                        const struct block *block)
{
    struct gbg_state *state = euler->state;
    for (int a = 0; a < state->box.dimension; a++) {
        uint32_t *high = state->high[a] + first, *low = state->low[a] + first;
        for (int l = 0; l < lanes; l++) {
            int64_t quanta = block->bad[l] ? 0 : euler->sign * block->quanta[a][l];
            uint64_t old = gbg_join(high[l], low[l]), moved = old + (uint64_t)quanta;
            high[l] = (uint32_t)(moved >> 32);
            low[l] = (uint32_t)moved;
            if (state->image[a]) {
                state->image[a][first + l] +=
                    (quanta > 0 && moved < old) - (quanta < 0 && moved > old);
            }
        }
    }
}

static inline double larger(double a, double b)
{
    return b > a ? b : a; /* NaN in b is left out: its particle is counted as bad */
}

static inline void note(const struct gbg_state *state, const struct block *block, int64_t first,
                        int lanes, struct extremes *seen)
{
    for (int l = 0; l < lanes; l++) {
        seen->drift = larger(seen->drift, block->drift[l]);
        seen->noise = larger(seen->noise, block->noise[l]);
        seen->total = larger(seen->total, block->total[l]);
        if (block->bad[l]) {
            int64_t name = (int64_t)gbg_rank_of(state, first + l) << 32 | (first + l);
            seen->bad = name < seen->bad ? name : seen->bad;
        }
    }
}

int GBG_ISA_NAME(gbg_cpu_integrate)(struct gbg_device *device, struct gbg_state *state,
                                    const struct gbg_noise *noise, uint64_t step, double dt,
                                    int sign, struct gbg_moves *moves)
{
    struct euler euler = {state, noise, step, dt, sign};
    double largest_drift = 0.0, largest_noise = 0.0, largest = 0.0;
    int64_t bad = INT64_MAX;
#pragma omp parallel num_threads(device->threads)                                                  \
    reduction(max                                                                                  \
              : largest_drift, largest_noise, largest) reduction(min                               \
                                                                 : bad)
    {
        struct extremes seen = {0.0, 0.0, 0.0, INT64_MAX};
#pragma omp for schedule(static) nowait
        for (int64_t first = 0; first < state->owned; first += VF_LANES) {
            int lanes = state->owned - first < VF_LANES ? (int)(state->owned - first) : VF_LANES;
            struct block block;
            find_moves(&euler, first, lanes, &block);
            move(&euler, first, lanes, &block);
            note(state, &block, first, lanes, &seen);
        }
        largest_drift = larger(largest_drift, seen.drift);
        largest_noise = larger(largest_noise, seen.noise);
        largest = larger(largest, seen.total);
        bad = seen.bad < bad ? seen.bad : bad;
    }
    *moves = (struct gbg_moves){sqrt(largest_drift), sqrt(largest_noise), sqrt(largest),
                                bad == INT64_MAX ? -1 : bad & UINT32_MAX};
    (void)device;
    return GBG_OK;
}
