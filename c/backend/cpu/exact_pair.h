/* L1: the exact tests of a pair of hard cores: the formulas behind exact.h, for the CPU and for a
 * GPU. The state is an argument of its own, because a GPU's is another than the host's; loops run
 * to `dimension`, which its kernels know when they are compiled. */
#ifndef GBG_BACKEND_CPU_EXACT_PAIR_H
#define GBG_BACKEND_CPU_EXACT_PAIR_H

#include <math.h>

#include "backend/cpu/exact.h"

GBG_INLINE int64_t gbg_exact_quanta(const struct gbg_state *state, int a, int64_t i, int64_t j)
{
    return (int64_t)(gbg_join(state->high[a][i], state->low[a][i]) -
                     gbg_join(state->high[a][j], state->low[a][j]));
}

GBG_INLINE double gbg_exact_pair_squared(const struct gbg_state *state, int dimension, int64_t i,
                                         int64_t j)
{
    double squared = 0.0;
    for (int a = 0; a < dimension; a++) {
        double d = (double)gbg_exact_quanta(state, a, i, j) * state->box.quantum[a];
        squared += d * d;
    }
    return squared;
}

GBG_INLINE int gbg_exact_pair_overlap(const struct gbg_exact *exact, const struct gbg_state *state,
                                      int dimension, int64_t i, int64_t j)
{
    if (!exact->whole) {
        double least = gbg_exact_pair_contact(exact, state, i, j) * (1.0 - exact->tolerance);
        return gbg_exact_pair_squared(state, dimension, i, j) < least * least;
    }
    gbg_wide squared = 0;
    for (int a = 0; a < dimension; a++) {
        int64_t quanta = gbg_exact_quanta(state, a, i, j);
        uint64_t size = quanta < 0 ? 0 - (uint64_t)quanta : (uint64_t)quanta;
        squared += (gbg_wide)size * size;
    }
    int s = state->species ? state->species[i] : 0, t = state->species ? state->species[j] : 0;
    return squared < exact->closest[s][t];
}

/* How far particle i has come on an axis since the step began. */
GBG_INLINE double gbg_exact_moved_on(const struct gbg_state *state, int a, int64_t i)
{
    return gbg_box_difference(&state->box, a, gbg_join(state->high[a][i], state->low[a][i]),
                              gbg_join(state->start_high[a][i], state->start_low[a][i]));
}

GBG_INLINE double gbg_exact_way_squared(const struct gbg_state *state, int dimension, int64_t i)
{
    double squared = 0.0;
    for (int a = 0; a < dimension; a++) {
        double d = gbg_exact_moved_on(state, a, i);
        squared += d * d;
    }
    return squared;
}

GBG_INLINE int gbg_exact_pair_passed(const struct gbg_exact *exact, const struct gbg_state *state,
                                     int dimension, int64_t i, int64_t j, double *nearest)
{
    double before[3], path = 0.0, along = 0.0, squared = 0.0;
    double move[3];
    for (int a = 0; a < dimension; a++) {
        before[a] = gbg_box_difference(&state->box, a,
                                       gbg_join(state->start_high[a][i], state->start_low[a][i]),
                                       gbg_join(state->start_high[a][j], state->start_low[a][j]));
        move[a] = gbg_exact_moved_on(state, a, i) - gbg_exact_moved_on(state, a, j);
        path += move[a] * move[a];
        along -= before[a] * move[a];
    }
    double time = along <= 0.0 ? 0.0 : along >= path ? 1.0 : along / path;
    for (int a = 0; a < dimension; a++) {
        double d = before[a] + time * move[a];
        squared += d * d;
    }
    double contact = gbg_exact_pair_contact(exact, state, i, j);
    *nearest = sqrt(squared);
    /* 1e-9 is room for rounding: a pair that moved less than is needed to pass is never named */
    return squared < 0.5 * (1.0 - 1e-9) * contact * contact;
}

#endif
