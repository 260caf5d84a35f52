/* L1, CPU: when a pair of hard cores is too close, and when it passed through each other: on the
 * full 64-bit coordinates, for the checks. The solver of contacts does not use it. The formulas are
 * in exact_pair.h. */
#ifndef GBG_BACKEND_CPU_EXACT_H
#define GBG_BACKEND_CPU_EXACT_H

#include "backend/backend.h"
#include "backend/cpu/grid.h"

__extension__ typedef unsigned __int128 gbg_wide;

/* Limits of all species pairs.
 *
 * Too close means nearer than R = contact (1 - tolerance), R being a double. Where all axes have
 * the same quantum q the squared distance in units of q^2 is an integer below 3 2^126, and it is
 * compared with R^2/q^2, also an exact number: nothing is rounded but R/q itself, by 4e-16 of it.
 * Elsewhere distances are sums of squares in double precision: each of up to nine roundings of
 * 1.1e-16 changes the squared distance by at most 8e-16 of it in all, the distance by 4e-16: a
 * factor 2000 below the tolerance of 1e-12. */
struct gbg_exact {
    const struct gbg_state *state; /* the host's */
    double tolerance;
    int whole;             /* 1: integers decide */
    double largest, least; /* contact distances, of those that are not 0 */
    int one_size;          /* 1: all contact distances are the same */
    double contact[GBG_SPECIES_MAX][GBG_SPECIES_MAX];
    gbg_wide closest[GBG_SPECIES_MAX][GBG_SPECIES_MAX]; /* smallest squared distance allowed */
};

#ifdef __cplusplus
extern "C" {
#endif
void gbg_exact_make(const struct gbg_state *state, double tolerance, struct gbg_exact *exact);

/* Distance of two particles at the present coordinates. */
double gbg_exact_distance(const struct gbg_exact *exact, int64_t i, int64_t j);

/* 1 if the pair is nearer than contact (1 - tolerance). */
int gbg_exact_overlap(const struct gbg_exact *exact, int64_t i, int64_t j);

/* 1 if the straight relative path of the pair from before the step to now comes nearer to zero
 * than contact/sqrt(2); *nearest is how near. With both ends at contact or beyond and no more
 * than a right angle between them the path stays outside: the chord over an angle w of a circle of
 * radius c is c cos(w/2) >= c/sqrt(2) from its centre. So a path that comes nearer connects places
 * on opposite sides of the other particle. Each of its two parts from the nearest point is then
 * longer than c/sqrt(2), so the relative move is longer than sqrt(2) c: where nobody moves by
 * c/sqrt(2) no pair need be looked at. */
int gbg_exact_passed(const struct gbg_exact *exact, int64_t i, int64_t j, double *nearest);

/* Squared length of a particle's move since the step began. */
double gbg_exact_moved_squared(const struct gbg_state *state, int64_t i);

#ifdef __cplusplus
}
#endif

GBG_INLINE double gbg_exact_pair_contact(const struct gbg_exact *exact,
                                         const struct gbg_state *state, int64_t i, int64_t j)
{
    return state->species ? exact->contact[state->species[i]][state->species[j]]
                          : exact->contact[0][0];
}

static inline double gbg_exact_contact(const struct gbg_exact *exact, int64_t i, int64_t j)
{
    return gbg_exact_pair_contact(exact, exact->state, i, j);
}

#endif
