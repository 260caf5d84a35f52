/* L1, CPU: when two straight paths meet. */
#ifndef GBG_BACKEND_CPU_EVENTS_PAIR_H
#define GBG_BACKEND_CPU_EVENTS_PAIR_H

#include <math.h>

#include "backend/cpu/events.h"

/* Quanta of a shift that may be longer than half the box; *boxes receives the whole boxes in it. */
static inline int64_t gbg_events_quanta(double shift, int32_t *boxes)
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
static inline uint64_t gbg_events_place(const struct gbg_events_call *call,
                                        const struct gbg_leg *leg, int a, double time)
{
    int32_t boxes;
    double ago = time - leg->time;
    if (ago == 0.0) {
        return leg->place[a];
    }
    return leg->place[a] +
           (uint64_t)gbg_events_quanta(leg->velocity[a] * ago * call->per_quantum[a], &boxes);
}

/* Time after which a pair at difference d with relative velocity w is at the contact distance. A
 * pair that touches and approaches meets at once. An approach below 1e-14 of the speed is none: the
 * paths part again after a depth of 1e-28, and the sign of so small a product is that of its
 * rounding. */
static inline double gbg_events_solve(int dimension, const double d[3], const double w[3],
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

#endif
