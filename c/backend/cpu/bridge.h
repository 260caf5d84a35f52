/* L1, CPU: the contact rule "bridge": what its files share. The rule itself: bridge.c. */
#ifndef GBG_BACKEND_CPU_BRIDGE_H
#define GBG_BACKEND_CPU_BRIDGE_H

#include "backend/backend.h"
#include "backend/cpu/list.h"
#include "backend/cpu/simd.h"

/* Lengths below are in units of the largest contact distance, so that single precision serves every
 * scale: gaps and displacements are differences made in integers, never of two lengths near 1. */

/* What a sweep reads and writes of a pair. */
struct bridge_pair {
    int32_t i, j;
    float half_base;    /* half of z without pushes: of the distance now, on the present line, less
                         * that    at the start */
    float gap;          /* g0, at the start */
    float quarter_draw; /* E/4 = -S^2 ln U / 2 */
    float push; /* p: how far the pair has been pushed apart; a half for each of its discs */
};

/* A pair that the screen let through, and the block that it belongs to. */
struct bridge_found {
    int32_t i, j, block;
};

/* A record before it has its place in the order of its block. */
struct bridge_raw {
    struct bridge_pair pair;
    float distance;          /* at the start */
    float start[3], free[3]; /* r_i - r_j at the start, and what the free moves add to it */
};

/* Key of a record in its block: a random word, then the place. */
typedef uint64_t bridge_key;

/* Everything that a call works on. Blocks are boxes of a grid over the periodic box; a pair belongs
 * to the block in which its disc of smaller id is after its free move. Blocks of one colour (their
 * parities) share no disc, so they are swept at the same time; a block's pairs are swept one after
 * the other in the order of their keys. So the order of a sweep follows from coordinates and ids
 * alone. */
struct bridge {
    struct gbg_device *device;
    struct gbg_state *state;
    struct gbg_list *list;
    const struct gbg_contacts *rule;
    int dimension, threads;
    double unit;       /* largest contact */
    double quantum[3]; /* in units */
    double look;       /* H: pairs with a smaller free gap are looked at */
    double lee;        /* B: what pushes of others may take off a gap, for the choice of pairs */
    float squared;     /* S^2 */
    double deviation;  /* S */

    int64_t blocks[3], n_blocks;
    int64_t *first;             /* n_blocks + 1: where a block's pairs begin */
    int64_t *count;             /* n_blocks: records it kept */
    int64_t *active;            /* n_blocks: of them, those in short sweeps */
    float *depth;               /* n_blocks: deepest overlap after the free moves */
    int64_t *tally;             /* chunks x blocks: found pairs, then their places */
    int32_t *order;             /* blocks with pairs, by colour */
    int64_t colour_first[9];    /* into order */
    int64_t found_capacity;     /* of one chunk */
    int64_t *found_count;       /* chunks */
    struct bridge_found *found; /* chunks x found_capacity */
    int32_t *sorted;            /* two indices a pair, by block */
    struct bridge_pair *pair;   /* by block, in the order of sweeps */
    float *normal;              /* dimension a pair: half of the unit vector from j to i */
    float *shape;               /* 2 dimension + 1 a pair: start, free, distance */
    int32_t *short_list;        /* by block: places of the pairs in short sweeps */
    struct bridge_raw *raw;     /* threads x most */
    bridge_key *key;            /* threads x 2 most */
    int64_t most;               /* pairs of the fullest block */
    float *shift;               /* dimension a particle: sum of pushes */
    uint64_t *used;             /* a particle: colours of the pairs of its block; zeros */
    int64_t *quanta;            /* the same in quanta, for the end */
};

/* Symbols of one instruction set. */
#define bridge_find GBG_ISA_NAME(gbg_bridge_find)
#define bridge_make_records GBG_ISA_NAME(gbg_bridge_make_records)
#define bridge_solve GBG_ISA_NAME(gbg_bridge_solve)

/* Pairs of a chunk whose free gap may be below `look`, by 32-bit coordinates; counts them by block.
 * Counts on where memory ends. */
void bridge_find(struct bridge *bridge, int chunk);
/* The records of a block, in the order of its sweeps, from its sorted pairs. */
void bridge_make_records(struct bridge *bridge, int64_t block, struct bridge_raw *raw,
                         bridge_key *key);
/* All sweeps; returns their number. */
int64_t bridge_solve(struct bridge *bridge);

static inline double bridge_contact(const struct bridge *bridge, int64_t i, int64_t j)
{
    const struct gbg_state *state = bridge->state;
    if (state->own_diameter) {
        return 0.5 * (state->own_diameter[i] + state->own_diameter[j]);
    }
    return 0.5 * (state->diameter[state->species ? state->species[i] : 0] +
                  state->diameter[state->species ? state->species[j] : 0]);
}

static inline uint64_t bridge_id(const struct bridge *bridge, int64_t i)
{
    return bridge->state->id ? bridge->state->id[i] : (uint64_t)i;
}

#endif
