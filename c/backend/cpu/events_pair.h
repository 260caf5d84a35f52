/* L1: straight paths, and when two of them meet: the same formulas for every backend. */
#ifndef GBG_BACKEND_CPU_EVENTS_PAIR_H
#define GBG_BACKEND_CPU_EVENTS_PAIR_H

#include <math.h>

#include "backend/backend.h"
#include "backend/cpu/grid.h"

/* A particle that had this many events in a step takes part in no more: it goes on straight, and
 * the rounds that follow part what it then overlaps. The limit is that of a particle, so that it
 * does not depend on how the events are shared out. */
enum { GBG_EVENTS_MOST = 2000 };

/* A straight part of a path: the place at a time in [0, 1], the velocity in lengths a step. */
struct gbg_leg {
    double time;
    uint64_t place[3];
    double velocity[3];
    int32_t events; /* that the particle has had */
    int32_t next;   /* in the part's legs; -1: the last one */
};

/* The free path of a particle. */
GBG_INLINE void gbg_events_free(const struct gbg_state *state, int64_t i, struct gbg_leg *leg)
{
    leg->time = 0.0;
    leg->events = 0;
    leg->next = -1;
    for (int a = 0; a < state->box.dimension; a++) {
        uint64_t to = gbg_join(state->high[a][i], state->low[a][i]);
        leg->place[a] = gbg_join(state->start_high[a][i], state->start_low[a][i]);
        leg->velocity[a] = gbg_box_difference(&state->box, a, to, leg->place[a]);
    }
}

GBG_INLINE double gbg_events_contact(const struct gbg_state *state, int64_t i, int64_t j)
{
    if (state->own_diameter) {
        return 0.5 * (state->own_diameter[i] + state->own_diameter[j]);
    }
    int s = state->species ? state->species[i] : 0, t = state->species ? state->species[j] : 0;
    return 0.5 * (state->diameter[s] + state->diameter[t]);
}

/* Quanta of a shift that may be longer than half the box; *boxes receives the whole boxes in it. */
GBG_INLINE int64_t gbg_events_quanta(double shift, int32_t *boxes)
{
    *boxes = 0;
    if (fabs(shift) >= 0x1p63) {
        double whole = rint(shift * 0x1p-64);
        shift -= whole * 0x1p64;
        if (shift >= 0x1p63) { /* exactly half a box */
            shift -= 0x1p64;
            whole += 1.0;
        }
        *boxes = (int32_t)whole;
    }
    return (int64_t)llrint(shift);
}

/* The place on a leg at a time. */
GBG_INLINE uint64_t gbg_events_place(const double per_quantum[3], const struct gbg_leg *leg, int a,
                                     double time)
{
    int32_t boxes;
    double ago = time - leg->time;
    if (ago == 0.0) {
        return leg->place[a];
    }
    return leg->place[a] +
           (uint64_t)gbg_events_quanta(leg->velocity[a] * ago * per_quantum[a], &boxes);
}

/* Time after which a pair at difference d with relative velocity w is at the contact distance. A
 * pair that touches and approaches meets at once. An approach below 1e-14 of the speed is none: the
 * paths part again after a depth of 1e-28, and the sign of so small a product is that of its
 * rounding. */
GBG_INLINE double gbg_events_solve(int dimension, const double d[3], const double w[3],
                                   double contact)
{
    double closing = 0.0, distance = 0.0, speed = 0.0;
    for (int a = 0; a < dimension; a++) {
        closing += d[a] * w[a];
        distance += d[a] * d[a];
        speed += w[a] * w[a];
    }
    if (closing >= 0.0 || closing * closing <= 1e-28 * speed * distance) {
        return INFINITY;
    }
    double gap = distance - contact * contact;
    if (gap <= 0.0) {
        return 0.0;
    }
    double root = closing * closing - speed * gap;
    return root > 0.0 ? gap / (sqrt(root) - closing) : INFINITY;
}

/* Moves so long that more than the nearest image may be met: all images in the way. */
GBG_INLINE double gbg_events_meet_images(const struct gbg_box *box, const double d[3],
                                         const double w[3], double rest, double contact)
{
    int dimension = box->dimension;
    int least[3] = {0, 0, 0}, most[3] = {0, 0, 0};
    double soonest = INFINITY;
    for (int a = 0; a < dimension; a++) {
        double length = box->length[a], end = d[a] + w[a] * rest;
        least[a] = (int)ceil((-contact - fmax(d[a], end)) / length - 1e-9);
        most[a] = (int)floor((contact - fmin(d[a], end)) / length + 1e-9);
    }
    for (int z = least[2]; z <= most[2]; z++) {
        for (int y = least[1]; y <= most[1]; y++) {
            for (int x = least[0]; x <= most[0]; x++) {
                const int image[3] = {x, y, z};
                double image_d[3] = {0.0, 0.0, 0.0};
                for (int a = 0; a < dimension; a++) {
                    image_d[a] = d[a] + image[a] * box->length[a];
                }
                soonest = fmin(soonest, gbg_events_solve(dimension, image_d, w, contact));
            }
        }
    }
    return soonest;
}

/* The difference is taken when the later of both legs began, so that the answer is one of the pair
 * of legs alone and not of the moment at which it is asked for. */
GBG_INLINE double gbg_events_time(const struct gbg_state *state, const double per_quantum[3],
                                  int64_t i, int64_t j, const struct gbg_leg *first,
                                  const struct gbg_leg *second)
{
    const struct gbg_box *box = &state->box;
    double contact = gbg_events_contact(state, i, j);
    if (first->events >= GBG_EVENTS_MOST || second->events >= GBG_EVENTS_MOST || contact <= 0.0) {
        return INFINITY;
    }
    double begin = first->time > second->time ? first->time : second->time, rest = 1.0 - begin;
    double d[3] = {0.0, 0.0, 0.0}, w[3] = {0.0, 0.0, 0.0};
    int far = 0;
    for (int a = 0; a < box->dimension; a++) {
        d[a] = gbg_box_difference(box, a, gbg_events_place(per_quantum, first, a, begin),
                                  gbg_events_place(per_quantum, second, a, begin));
        w[a] = first->velocity[a] - second->velocity[a];
        far |= fabs(d[a]) + fabs(w[a]) * rest + contact > box->length[a];
    }
    return begin + (far ? gbg_events_meet_images(box, d, w, rest, contact)
                        : gbg_events_solve(box->dimension, d, w, contact));
}

#endif
