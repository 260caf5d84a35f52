/* L1, CPU: exact tests of pairs of hard cores: distance, and passing through each other. */
#include "backend/cpu/exact.h"

#include <math.h>

#include "backend/cpu/exact_pair.h"

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

double gbg_exact_distance(const struct gbg_exact *exact, int64_t i, int64_t j)
{
    const struct gbg_state *state = exact->state;
    return sqrt(gbg_exact_pair_squared(state, state->box.dimension, i, j));
}

int gbg_exact_overlap(const struct gbg_exact *exact, int64_t i, int64_t j)
{
    return gbg_exact_pair_overlap(exact, exact->state, exact->state->box.dimension, i, j);
}

double gbg_exact_moved_squared(const struct gbg_state *state, int64_t i)
{
    return gbg_exact_way_squared(state, state->box.dimension, i);
}

int gbg_exact_passed(const struct gbg_exact *exact, int64_t i, int64_t j, double *nearest)
{
    return gbg_exact_pair_passed(exact, exact->state, exact->state->box.dimension, i, j, nearest);
}
