/* L1, CUDA: batches of steps: what the kernels of a step tell each other, without the host. */
#ifndef GBG_CUDA_STEPS_H
#define GBG_CUDA_STEPS_H

#include "cuda/integrate.h"
#include "cuda/list.h"

enum { GBG_CUDA_BATCH = 32 }; /* steps that are recorded once and started together */

/* What became of one step. */
struct gbg_cuda_slot {
    struct gbg_cuda_extremes moves;
    unsigned long long farthest; /* bits of the largest squared way of those corrected */
    unsigned long long virial;   /* sum modulo 2^64 */
    unsigned long long pairs;    /* pushes */
    unsigned int
        followed[2]; /* bits of the largest squared displacement since each list was built */
    unsigned int way, drift;     /* of the certificate: since the start, since the list was built */
    unsigned int rounds, faults; /* faults: pairs that are too close */
    unsigned int ticket[3];      /* blocks that have finished a stage */
};

struct gbg_cuda_control {
    int halt;    /* 1: nothing more is done */
    int done;    /* steps that are complete */
    int undo;    /* 1 + the step whose moves are to be taken back */
    int spoiled; /* 1: they cannot be, for there is no copy of the coordinates before it */
    int limit;   /* steps to be made */
    uint64_t first;
    double moved;      /* largest move of the step before the first */
    unsigned int mark; /* of the last round: marks of earlier ones are void */
    unsigned int candidates[2], movers, stale;
    unsigned long long found; /* overlapping pairs of the present round */
    struct gbg_cuda_slot slot[GBG_CUDA_BATCH];
};

#endif
