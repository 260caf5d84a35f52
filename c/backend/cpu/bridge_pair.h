/* L1: the contact rule "bridge": the figures of a step and the formulas of a pair, which every
 * backend uses. The rule itself: bridge.c. */
#ifndef GBG_BACKEND_CPU_BRIDGE_PAIR_H
#define GBG_BACKEND_CPU_BRIDGE_PAIR_H

#include <math.h>
#include <stdint.h>

#include "backend/backend.h"
#include "backend/cpu/grid.h"

/* Lengths below are in units of the largest contact distance, so that single precision serves every
 * scale: gaps and displacements are differences made in integers, never of two lengths near 1. */

/* What a sweep reads and writes of a pair. */
struct bridge_pair {
    int32_t i, j;
    float half_base;    /* half of z without pushes: of the distance now, on the present line, less
                           that at the start */
    float gap;          /* g0, at the start */
    float quarter_draw; /* E/4 = -S^2 ln U / 2 */
    float push; /* p: how far the pair has been pushed apart; a half for each of its discs */
};

/* A record before it has its place in the order of its block. */
struct bridge_raw {
    struct bridge_pair pair;
    float distance;          /* at the start */
    float start[3], free[3]; /* r_i - r_j at the start, and what the free moves add to it */
};

/* Key of a record in its block: a random word, then the place. */
typedef uint64_t bridge_key;

/* Colours of the pairs of a block; one that finds none free takes the last. */
enum { BRIDGE_COLOURS = 64 };

/* Sweeps and their parameters, chosen on C3 short at packing 0.79 (dt = T = 0.01, N = 2048), where
 * the mean gap of bound pairs is 3.181(10)e-3 when solved to 1e-4 S in some 120 sweeps. Two solves
 * of 12 sweeps give the same, of 3 and 12 sweeps 0.3 % more, of 3 and 9 sweeps 0.5 %
 * more. The first solve only has to find the lines. Factors of 1.5
 * and 1.6 do as well, 1.7 leaves twice as many pairs overlapping. Tolerances of 1e-2 and 1e-3 of S
 * do not differ here, 3e-2 costs another 0.1 %. A solve is some rounds of a sweep over all pairs
 * and some short ones. */
#define BRIDGE_OMEGA 1.5f
#define BRIDGE_TOLERANCE 1e-2f

/* The same where forces of long range press a whole cluster together. Its pushes add up from the
 * rim inwards, and in a packed cluster there are more pairs than ways to move, so that many sets of
 * pushes give nearly the same places and plain sweeps choose between them very slowly. So there
 * every round is one exact sweep (factor 1), after which all pushes go on by a share of what the
 * round changed, at most 1 - BRIDGE_SLOWING/layers (Nesterov's momentum). The first solve has to
 * come near the second, for its lines are far from the first ones. Layers: of a cluster of all
 * particles, across; rounds grow with them. Measured in docs/accuracy.md. */
#define BRIDGE_SLOWING 3.0
enum {
    BRIDGE_SHORT_SWEEPS = 2,
    BRIDGE_ROUNDS_FIRST = 1,
    BRIDGE_ROUNDS_SECOND = 4,
    BRIDGE_PRESSED_ROUNDS = 20, /* and so many for each layer; in the last solve twice as many */
    BRIDGE_PRESSED_LAYER = 2,
    BRIDGE_MOST_ROUNDS = 2048, /* of a solve */
    BRIDGE_SOLVES = 3          /* at most */
};

/* What a step is solved with; blocks are those of bridge.h. */
struct bridge_plan {
    int dimension;
    double unit;       /* largest contact */
    double quantum[3]; /* in units */
    double look;       /* H: pairs with a smaller free gap are looked at */
    double lee;        /* B: what pushes of others may take off a gap, for the choice of pairs */
    double deviation;  /* S */
    float squared;     /* S^2 */
    float limit;       /* for the squared distances of the screen, in lengths */
    int64_t blocks[3], n_blocks;
    int solves, rounds[BRIDGE_SOLVES]; /* on lines drawn anew; rounds of each, at most */
    float omega;                       /* of their sweeps but the first */
    float momentum; /* largest share of its change by which a push goes on; 0: it does not */
    float stiff;    /* how much smaller changes have to be where pushes are large, per unit */
};

static inline double bridge_largest_contact(const struct gbg_state *state)
{
    double largest = 0.0;
    for (int s = 0; s < state->n_species; s++) {
        largest = state->diameter[s] > largest ? state->diameter[s] : largest;
    }
    return largest;
}

/* Blocks so wide that those with one between them touch no common disc: an even number along each
 * axis, or one. Their size follows from the box, the reach and the number of particles. */
static inline void bridge_choose_blocks(struct bridge_plan *plan, const struct gbg_box *box,
                                        int64_t particles)
{
    /* Particles of a block: pairs of a block and what they touch stay in the first-level cache, and
     * a small system still has several blocks. */
    const double block_particles = 256.0;
    double volume = 1.0, n = (double)particles;
    for (int a = 0; a < box->dimension; a++) {
        volume *= box->length[a];
    }
    volume *= block_particles / (n > 1.0 ? n : 1.0);
    double edge = 2.001 * plan->unit * (1.0 + plan->look);
    while (edge * edge * (box->dimension == 2 ? 1.0 : edge) < volume) {
        edge *= 1.125; /* no root: its last bit could differ elsewhere */
    }
    plan->n_blocks = 1;
    for (int a = 0; a < 3; a++) {
        double fit = a < box->dimension ? floor(box->length[a] / edge) : 1.0;
        int64_t count = fit < 1024.0 ? (int64_t)fit : 1024;
        plan->blocks[a] = count < 2 ? 1 : count - count % 2;
        plan->n_blocks *= plan->blocks[a];
    }
}

/* Layers of a cluster of n particles: the root of n. Counted, for a root's last bit may differ. */
static inline int64_t bridge_layers(int dimension, int64_t n)
{
    int64_t layers = 1;
    while (layers * layers * (dimension == 2 ? 1 : layers) < n) {
        layers++;
    }
    return layers;
}

/* How a step is solved: limits of rounds, factor, momentum, and what counts as settled. */
static inline void bridge_choose_sweeps(struct bridge_plan *plan, int64_t n, int pressed)
{
    plan->solves = 2;
    plan->rounds[0] = BRIDGE_ROUNDS_FIRST;
    plan->rounds[1] = BRIDGE_ROUNDS_SECOND;
    plan->omega = BRIDGE_OMEGA;
    plan->momentum = plan->stiff = 0.0f;
    if (pressed) {
        int64_t layers = bridge_layers(plan->dimension, n);
        int64_t rounds = BRIDGE_PRESSED_ROUNDS + BRIDGE_PRESSED_LAYER * layers;
        double share = 1.0 - BRIDGE_SLOWING / (double)layers;
        plan->solves = BRIDGE_SOLVES;
        for (int k = 0; k < plan->solves; k++) {
            int64_t most = k + 1 < plan->solves ? rounds : 2 * rounds;
            plan->rounds[k] = (int)(most < BRIDGE_MOST_ROUNDS ? most : BRIDGE_MOST_ROUNDS);
        }
        plan->omega = 1.0f;
        plan->momentum = (float)(share > 0.8 ? share : 0.8);
        /* a pair under a push p ends with a gap near S^2/(2 p), which has to be found to a share */
        plan->stiff = plan->deviation > 0.0 ? (float)(0.25 / plan->deviation) : 0.0f;
    }
}

/* The figures of a step for n particles with a list of that reach; 0: there is nothing to do. */
static inline int bridge_make_plan(struct bridge_plan *plan, const struct gbg_state *state,
                                   int64_t n, double list_reach,
                                   const struct gbg_contacts *contacts)
{
    /* Part of the searched gap that pushes of others are expected to close. C3 short at packing
     * 0.79, dt 0.01: 0.1 to 0.4 leave the same 0.7 % of the pushed pairs to bounce rounds, all of
     * them for want of sweeps; with 93 sweeps at most 1e-4 are left. */
    const double lee_part = 0.2;
    plan->dimension = state->box.dimension;
    plan->unit = bridge_largest_contact(state);
    if (!(plan->unit > 0.0) || n == 0) {
        return 0;
    }
    for (int a = 0; a < plan->dimension; a++) {
        plan->quantum[a] = state->box.quantum[a] / plan->unit;
    }
    plan->look = list_reach / plan->unit - 1.0;
    plan->lee = lee_part * plan->look;
    plan->deviation = sqrt(2.0) * contacts->noise->scale / plan->unit;
    plan->squared = (float)(plan->deviation * plan->deviation);
    double reach = plan->unit * (1.0 + plan->look);
    plan->limit = (float)(reach * reach * (1.0 + 1e-5)); /* room for rounding */
    bridge_choose_sweeps(plan, n, contacts->pressed);
    bridge_choose_blocks(plan, &state->box, n);
    return 1;
}

GBG_INLINE double bridge_contact(const struct gbg_state *state, int64_t i, int64_t j)
{
    if (state->own_diameter) {
        return 0.5 * (state->own_diameter[i] + state->own_diameter[j]);
    }
    return 0.5 * (state->diameter[state->species ? state->species[i] : 0] +
                  state->diameter[state->species ? state->species[j] : 0]);
}

GBG_INLINE uint64_t bridge_id(const struct gbg_state *state, int64_t i)
{
    return state->id ? state->id[i] : (uint64_t)i;
}

GBG_INLINE int32_t bridge_block_of(const struct bridge_plan *plan, const struct gbg_state *state,
                                   int64_t i, int64_t j)
{
    int64_t owner = bridge_id(state, i) < bridge_id(state, j) ? i : j, block = 0;
    for (int a = plan->dimension - 1; a >= 0; a--) {
        uint64_t cell = (uint64_t)state->high[a][owner] * (uint64_t)plan->blocks[a] >> 32;
        block = block * plan->blocks[a] + (int64_t)cell;
    }
    return (int32_t)block;
}

/* Distances of a pair at the start and after the free moves. Returns 1 if the pair may have to be
 * pushed: a pair at gaps g0 and g touches in between with the probability exp(-2 g0 g/S^2), and it
 * touches if 4 g0 g < E; what others push may take `lee` off g. */
GBG_INLINE int bridge_measure(const struct bridge_plan *plan, const struct gbg_state *state,
                              int32_t i, int32_t j, struct bridge_raw *raw)
{
    const double most_exponential = 44.37; /* -2 ln U of the smallest U that noise.h makes, 2^-32 */
    double squared = 0.0, change = 0.0, start[3], move[3];
    for (int a = 0; a < plan->dimension; a++) {
        uint64_t before = gbg_join(state->start_high[a][i], state->start_low[a][i]) -
                          gbg_join(state->start_high[a][j], state->start_low[a][j]);
        uint64_t after = gbg_join(state->high[a][i], state->low[a][i]) -
                         gbg_join(state->high[a][j], state->low[a][j]);
        start[a] = (double)(int64_t)before * plan->quantum[a];
        move[a] = (double)(int64_t)(after - before) * plan->quantum[a];
        squared += start[a] * start[a];
        change += (2.0 * start[a] + move[a]) * move[a];
    }
    double distance = sqrt(squared), contact = bridge_contact(state, i, j) / plan->unit;
    double gap = distance - contact > 0.0 ? distance - contact : 0.0;
    double base = change / (sqrt(squared + change > 0.0 ? squared + change : 0.0) + distance);
    double near = gap + base - plan->lee, most = plan->deviation * plan->deviation;
    most *= most_exponential;
    if (contact == 0.0 || distance == 0.0 || gap + base >= plan->look ||
        (near > 0.0 && 4.0 * gap * near >= most)) {
        return 0;
    }
    raw->pair.i = i;
    raw->pair.j = j;
    raw->pair.half_base = (float)(0.5 * base);
    raw->pair.gap = (float)gap;
    raw->pair.quarter_draw = raw->pair.push = 0.0f;
    raw->distance = (float)distance;
    for (int a = 0; a < plan->dimension; a++) {
        raw->start[a] = (float)start[a];
        raw->free[a] = (float)move[a];
    }
    return 1;
}

/* Which of two pairs with the same random word comes first: by ids. */
GBG_INLINE int bridge_precedes(const struct gbg_state *state, int32_t i, int32_t j, int32_t k,
                               int32_t l)
{
    uint64_t id[4] = {bridge_id(state, i), bridge_id(state, j), bridge_id(state, k),
                      bridge_id(state, l)};
    uint64_t low = id[0] < id[1] ? id[0] : id[1], other_low = id[2] < id[3] ? id[2] : id[3];
    uint64_t high = id[0] < id[1] ? id[1] : id[0], other_high = id[2] < id[3] ? id[3] : id[2];
    return low != other_low ? low < other_low : high < other_high;
}

/* How deep a pair would overlap after the free moves; negative: it would not. */
GBG_INLINE float bridge_depth(float gap, float half_base)
{
    return -(gap + 2.0f * half_base);
}

/* A component of half of the unit vector along a difference of that length. */
GBG_INLINE float bridge_half_unit(float difference, float length)
{
    return 0.5f * difference / length;
}

/* Solves a pair for its own push, the others being as they are: all in halves, h = z/2:
 * p = sqrt(h^2 + E/4) - h - g0. `along` is the shift of i against j on half of the line. Written
 * without branches, for whether a pair is pushed cannot be foreseen. */
GBG_INLINE float bridge_relaxed(float along, float half_base, float gap, float quarter_draw,
                                float old, float factor)
{
    float h = along + (half_base - 0.5f * old);
    float wanted = sqrtf(h * h + quarter_draw) - (h + gap);
    wanted = wanted > 0.0f ? wanted : 0.0f;
    float push = factor * wanted + (1.0f - factor) * old;
    return push > 0.0f ? push : 0.0f;
}

/* What a change of a push counts when it is asked whether pushes have settled. */
GBG_INLINE float bridge_change(float change, float push, float stiff)
{
    return fabsf(change) * (1.0f + stiff * push);
}

/* The share of its last change by which a push goes on after a round. */
GBG_INLINE float bridge_share(const struct bridge_plan *plan, int round)
{
    float share = (float)round / (float)(round + 3);
    return share < plan->momentum ? share : plan->momentum;
}

/* Where a push goes on to; `last`: it was that one round before. */
GBG_INLINE float bridge_gone_on(float push, float last, float share)
{
    float next = push + share * (push - last);
    return next > 0.0f ? next : 0.0f;
}

/* Draws the line of a pair anew through the present places, which the discs' shifts (i less j)
 * give; returns the half base on it. Where the discs stand nearly through each other the line says
 * nothing, and the old one stays. */
GBG_INLINE float bridge_turned(int dimension, const float *start, const float *free, float distance,
                               const float *shift, float half_base, float *normal)
{
    float now[3], squared = 0.0f, change = 0.0f, along = 0.0f;
    for (int a = 0; a < dimension; a++) {
        float move = free[a] + shift[a];
        now[a] = start[a] + move;
        squared += now[a] * now[a];
        change += (2.0f * start[a] + move) * move;
    }
    float present = sqrtf(squared);
    if (!(present > 0.1f * distance)) {
        return half_base;
    }
    for (int a = 0; a < dimension; a++) {
        normal[a] = bridge_half_unit(now[a], present);
        along += normal[a] * shift[a];
    }
    return 0.5f * change / (present + distance) - along;
}

/* What a push moves a disc by along an axis, in quanta. */
GBG_INLINE int64_t bridge_quanta(float push, float normal, double quantum)
{
    return (int64_t)rint((double)push * (double)normal / quantum);
}

/* A push's share of the virial, in 2^-40 of the unit squared. */
GBG_INLINE int64_t bridge_virial(const struct bridge_plan *plan, const struct gbg_state *state,
                                 int64_t i, int64_t j, float push)
{
    return (int64_t)rint(bridge_contact(state, i, j) / plan->unit * (double)push * 0x1p39);
}

/* 1 if the pair is nearer than `least` contacts now. */
GBG_INLINE int bridge_overlap(const struct gbg_state *state, int64_t i, int64_t j, double least)
{
    double squared = 0.0, contact = least * bridge_contact(state, i, j);
    for (int a = 0; a < state->box.dimension; a++) {
        double d = gbg_box_difference(&state->box, a, gbg_join(state->high[a][i], state->low[a][i]),
                                      gbg_join(state->high[a][j], state->low[a][j]));
        squared += d * d;
    }
    return squared < contact * contact;
}

#endif
