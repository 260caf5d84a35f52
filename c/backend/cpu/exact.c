/* L1, CPU: exact tests of pairs of hard cores: distance, and passing through each other. */
#include "backend/cpu/exact.h"

#include <math.h>

/* Smallest integer >= (radius/quantum)^2, from the bits of the double radius/quantum. */
static gbg_wide squared_quanta(double radius, double quantum)
{
    int exponent;
    double fraction = frexp(radius / quantum, &exponent); /* in [1/2, 1): 53 bits */
    gbg_wide whole = (gbg_wide)ldexp(fraction, 53), squared = whole * whole;
    int shift = 2 * (53 - exponent); /* squared 2^-shift is the square; exponent <= 63 */
    if (shift <= 0) {
        return squared << -shift;
    }
    if (shift >= 107) {
        return 1; /* below one quantum: only coincident particles are too close */
    }
    gbg_wide floor_part = squared >> shift;
    return floor_part + ((floor_part << shift) != squared);
}

void gbg_exact_make(const struct gbg_state *state, double tolerance, struct gbg_exact *exact)
{
    exact->state = state;
    exact->tolerance = tolerance;
    exact->largest = 0.0;
    exact->least = INFINITY;
    exact->whole = 1;
    for (int a = 1; a < state->box.dimension; a++) {
        exact->whole &= state->box.quantum[a] == state->box.quantum[0];
    }
    exact->one_size = 1;
    for (int s = 0; s < state->n_species; s++) {
        for (int t = 0; t < state->n_species; t++) {
            double contact = 0.5 * (state->diameter[s] + state->diameter[t]);
            exact->contact[s][t] = contact;
            exact->closest[s][t] =
                contact > 0.0 ? squared_quanta(contact * (1.0 - tolerance), state->box.quantum[0])
                              : 0;
            exact->largest = fmax(exact->largest, contact);
            exact->least = contact > 0.0 ? fmin(exact->least, contact) : exact->least;
            exact->one_size &= contact == exact->contact[0][0];
        }
    }
}

static inline int64_t quanta_between(const struct gbg_state *state, int a, int64_t i, int64_t j)
{
    return (int64_t)(gbg_join(state->high[a][i], state->low[a][i]) -
                     gbg_join(state->high[a][j], state->low[a][j]));
}

static double squared_distance(const struct gbg_state *state, int64_t i, int64_t j)
{
    double squared = 0.0;
    for (int a = 0; a < state->box.dimension; a++) {
        double d = (double)quanta_between(state, a, i, j) * state->box.quantum[a];
        squared += d * d;
    }
    return squared;
}

double gbg_exact_distance(const struct gbg_exact *exact, int64_t i, int64_t j)
{
    return sqrt(squared_distance(exact->state, i, j));
}

int gbg_exact_overlap(const struct gbg_exact *exact, int64_t i, int64_t j)
{
    const struct gbg_state *state = exact->state;
    if (!exact->whole) {
        double least = gbg_exact_contact(exact, i, j) * (1.0 - exact->tolerance);
        return squared_distance(state, i, j) < least * least;
    }
    gbg_wide squared = 0;
    for (int a = 0; a < state->box.dimension; a++) {
        int64_t quanta = quanta_between(state, a, i, j);
        uint64_t size = quanta < 0 ? 0 - (uint64_t)quanta : (uint64_t)quanta;
        squared += (gbg_wide)size * size;
    }
    int s = state->species ? state->species[i] : 0, t = state->species ? state->species[j] : 0;
    return squared < exact->closest[s][t];
}

static inline double moved_on(const struct gbg_state *state, int a, int64_t i)
{
    return gbg_box_difference(&state->box, a, gbg_join(state->high[a][i], state->low[a][i]),
                              gbg_join(state->start_high[a][i], state->start_low[a][i]));
}

double gbg_exact_moved_squared(const struct gbg_state *state, int64_t i)
{
    double squared = 0.0;
    for (int a = 0; a < state->box.dimension; a++) {
        double d = moved_on(state, a, i);
        squared += d * d;
    }
    return squared;
}

int gbg_exact_passed(const struct gbg_exact *exact, int64_t i, int64_t j, double *nearest)
{
    const struct gbg_state *state = exact->state;
    double before[3], path = 0.0, along = 0.0, squared = 0.0;
    double move[3];
    for (int a = 0; a < state->box.dimension; a++) {
        before[a] = gbg_box_difference(&state->box, a,
                                       gbg_join(state->start_high[a][i], state->start_low[a][i]),
                                       gbg_join(state->start_high[a][j], state->start_low[a][j]));
        move[a] = moved_on(state, a, i) - moved_on(state, a, j);
        path += move[a] * move[a];
        along -= before[a] * move[a];
    }
    double time = along <= 0.0 ? 0.0 : along >= path ? 1.0 : along / path;
    for (int a = 0; a < state->box.dimension; a++) {
        double d = before[a] + time * move[a];
        squared += d * d;
    }
    double contact = gbg_exact_contact(exact, i, j);
    *nearest = sqrt(squared);
    /* 1e-9 is room for rounding: a pair that moved less than is needed to pass is never named */
    return squared < 0.5 * (1.0 - 1e-9) * contact * contact;
}
