/* L1: how an overlapping pair of hard cores is parted: the formulas of contact rounds, for the CPU
 * and for a GPU, so that both make the same bits. Loops run to `dimension`, which a GPU's kernels
 * know when they are compiled. */
#ifndef GBG_BACKEND_CPU_CONTACTS_PAIR_H
#define GBG_BACKEND_CPU_CONTACTS_PAIR_H

#include <math.h>

#include "backend/backend.h"
#include "backend/cpu/grid.h"
#include "core/random.h"

/* Contact distances of all species pairs, and how far a pair is moved; made once a call. */
struct gbg_push_rule {
    double contact[GBG_SPECIES_MAX][GBG_SPECIES_MAX];
    double least; /* a pair closer than contact times this overlaps */
    double largest;
    double cap;
    double virial_unit; /* virials are summed in integers, so that their order cannot show */
    int parting;
};

GBG_INLINE struct gbg_push_rule gbg_push_rule_make(const struct gbg_state *state,
                                                   const struct gbg_contacts *contacts)
{
    struct gbg_push_rule rule;
    rule.least = 1.0 - contacts->tolerance;
    rule.largest = 0.0;
    for (int s = 0; s < state->n_species; s++) {
        for (int t = 0; t < state->n_species; t++) {
            double contact = 0.5 * (state->diameter[s] + state->diameter[t]);
            rule.contact[s][t] = contact;
            rule.largest = contact > rule.largest ? contact : rule.largest;
        }
    }
    rule.cap = contacts->cap;
    rule.virial_unit = 0x1p-40 * rule.largest * rule.largest;
    rule.parting = contacts->parting;
    return rule;
}

/* Squared: the largest contact distance with room for the rounding of 32-bit coordinates. */
GBG_INLINE float gbg_push_limit(const struct gbg_push_rule *rule)
{
    return (float)(rule->largest * rule->largest * (1.0 + 1e-5));
}

GBG_INLINE double gbg_push_contact(const struct gbg_push_rule *rule, const struct gbg_state *state,
                                   int64_t i, int64_t j)
{
    if (state->own_diameter) {
        return 0.5 * (state->own_diameter[i] + state->own_diameter[j]);
    }
    return state->species ? rule->contact[state->species[i]][state->species[j]]
                          : rule->contact[0][0];
}

GBG_INLINE double gbg_push_difference(const struct gbg_state *state, int dimension, int64_t i,
                                      int64_t j, int64_t quanta[3])
{
    double squared = 0.0;
    for (int a = 0; a < dimension; a++) {
        quanta[a] = (int64_t)(gbg_join(state->high[a][i], state->low[a][i]) -
                              gbg_join(state->high[a][j], state->low[a][j]));
        double d = (double)quanta[a] * state->box.quantum[a];
        squared += d * d;
    }
    return squared;
}

/* Unit vector in which the first of two coincident particles leaves, from their ids alone: points
 * of the counter generator until one falls well inside the unit disc or ball. */
GBG_INLINE void gbg_push_direction(int dimension, uint64_t first, uint64_t second, double unit[3])
{
    for (uint64_t attempt = 0;; attempt++) {
        struct gbg_philox r =
            gbg_philox(gbg_philox_counter(second, first, GBG_STREAM_CONTACT), (uint32_t)attempt, 0);
        double squared = 0.0;
        for (int a = 0; a < dimension; a++) {
            unit[a] = 2.0 * gbg_uniform(r.word[a], 0) - 1.0;
            squared += unit[a] * unit[a];
        }
        if (squared > 0.01 && squared <= 1.0) {
            for (int a = 0; a < dimension; a++) {
                unit[a] /= sqrt(squared);
            }
            return;
        }
    }
}

GBG_INLINE void gbg_push_add(int64_t *push, int64_t more)
{
    *push = (int64_t)((uint64_t)*push + (uint64_t)more);
}

GBG_INLINE void gbg_push_coincident(const struct gbg_state *state, int dimension, int64_t i,
                                    int64_t j, double move, int64_t push[3])
{
    uint64_t a = state->id ? state->id[i] : (uint64_t)i, b = state->id ? state->id[j] : (uint64_t)j;
    double unit[3];
    gbg_push_direction(dimension, a < b ? a : b, a < b ? b : a, unit);
    double sign = a < b ? 1.0 : -1.0;
    for (int d = 0; d < dimension; d++) {
        gbg_push_add(&push[d], (int64_t)(sign * rint(unit[d] * move / state->box.quantum[d])));
    }
}

/* Adds what the overlap with j moves i by; both particles of a pair find the same numbers with
 * opposite signs, so the pair's sum is zero to the last bit. Returns 1 if they overlap. */
GBG_INLINE int gbg_push_pair(const struct gbg_push_rule *rule, const struct gbg_state *state,
                             int dimension, int64_t i, int64_t j, int64_t push[3], int64_t *virial)
{
    /* the rule "contact" separates to this much more than contact, so that rounds end: each round
     * shrinks the overlaps that neighbours push back, but never to zero */
    const double contact_margin = 1e-9;
    int64_t quanta[3];
    double squared = gbg_push_difference(state, dimension, i, j, quanta);
    double contact = gbg_push_contact(rule, state, i, j), least = contact * rule->least;
    if (squared >= least * least) {
        return 0;
    }
    double distance = sqrt(squared);
    double depth = contact - distance;
    double move =
        rule->parting == GBG_PARTING_CONTACT ? 0.5 * (depth + contact_margin * contact) : depth;
    /* the cap is taken from a pair and not from the sum of pushes: that conserves momentum */
    if (rule->parting != GBG_PARTING_CARTER && move > rule->cap * contact) {
        move = rule->cap * contact;
    }
    /* distance half way: the push of a bounce from r to 2 contact - r counts with contact, and the
     * virial of an equilibrium is that of its pair distribution */
    gbg_push_add(virial, i < j ? (int64_t)rint((distance + move) * move / rule->virial_unit) : 0);
    if (distance < 1e-12 * contact) {
        gbg_push_coincident(state, dimension, i, j, move, push);
        return 1;
    }
    for (int a = 0; a < dimension; a++) {
        gbg_push_add(&push[a], (int64_t)rint((double)quanta[a] * (move / distance)));
    }
    return 1;
}

/* The sum of all pushes on particle i, cut to a quarter of its diameter. */
GBG_INLINE void gbg_push_cut(const struct gbg_push_rule *rule, const struct gbg_state *state,
                             int dimension, int64_t i, int64_t push[3])
{
    double squared = 0.0, most = 0.25 * gbg_push_contact(rule, state, i, i);
    for (int a = 0; a < dimension; a++) {
        double d = (double)push[a] * state->box.quantum[a];
        squared += d * d;
    }
    for (int a = 0; squared > most * most && a < dimension; a++) {
        push[a] = (int64_t)rint((double)push[a] * (most / sqrt(squared)));
    }
}

/* Moves particle i; returns the squared length of the push. */
GBG_INLINE double gbg_push_apply(const struct gbg_state *state, int dimension, int64_t i,
                                 const int64_t push[3])
{
    double squared = 0.0;
    for (int a = 0; a < dimension; a++) {
        uint64_t old = gbg_join(state->high[a][i], state->low[a][i]),
                 moved = old + (uint64_t)push[a];
        state->high[a][i] = (uint32_t)(moved >> 32);
        state->low[a][i] = (uint32_t)moved;
        if (state->image[a]) {
            state->image[a][i] += (push[a] > 0 && moved < old) - (push[a] < 0 && moved > old);
        }
        double d = (double)push[a] * state->box.quantum[a];
        squared += d * d;
    }
    return squared;
}

/* Squared length of the way of particle i since the step began. */
GBG_INLINE double gbg_push_displaced(const struct gbg_state *state, int dimension, int64_t i)
{
    double squared = 0.0;
    for (int a = 0; a < dimension; a++) {
        double d = gbg_box_difference(&state->box, a, gbg_join(state->high[a][i], state->low[a][i]),
                                      gbg_join(state->start_high[a][i], state->start_low[a][i]));
        squared += d * d;
    }
    return squared;
}

#endif
