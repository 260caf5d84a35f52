/* L1, CPU: the contact rule "bridge": what its files share. The rule itself: bridge.c. */
#ifndef GBG_BACKEND_CPU_BRIDGE_H
#define GBG_BACKEND_CPU_BRIDGE_H

#include "backend/backend.h"
#include "backend/cpu/bridge_pair.h"
#include "backend/cpu/list.h"
#include "backend/cpu/simd.h"

/* A pair that the screen let through, and the block that it belongs to. */
struct bridge_found {
    int32_t i, j, block;
};

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
    struct bridge_plan plan;

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
    float *last_push;           /* one round before, where pushes go on */
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
/* All sweeps; returns their number. *stopped: 1 if the last solve, of a pressed scene, came to its
 * limit of rounds. */
int64_t bridge_solve(struct bridge *bridge, int64_t *stopped);

#endif
