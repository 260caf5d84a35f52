/* L1, CUDA: the contact rule "bridge": what its files share. The rule itself: backend/cpu/bridge.c.
 *
 * Blocks, their colours, and the colours of the pairs in a block are those of the CPU. A thread
 * block takes a block and works on all pairs of one colour at the same time: they share no disc, so
 * this is the CPU's order, to the last bit. */
#ifndef GBG_CUDA_BRIDGE_H
#define GBG_CUDA_BRIDGE_H

#include "backend/cpu/bridge_pair.h"
#include "cuda/cuda.h"
#include "cuda/list.h"

/* Threads of a thread block; of those that have a block to themselves 1, 2, .. 2^BRIDGE_WIDEST
 * times as many (bridge_wider). */
enum {
    BRIDGE_THREADS = 128,
    BRIDGE_WIDEST = 3,
    BRIDGE_MOST_THREADS = BRIDGE_THREADS << BRIDGE_WIDEST
};
static const unsigned BRIDGE_WARP = 0xFFFFFFFFu;

/* What a call found out, on the device and fetched once. All zero at its start. */
struct bridge_results {
    unsigned long long found;             /* pairs that the screen let through */
    unsigned long long pairs, virial;     /* pushed; sum in 2^-40 of the unit squared */
    unsigned long long largest, farthest; /* bits of squares: way since the start, push */
    unsigned int depth;                   /* bits of the deepest overlap after the free moves */
    unsigned int stale, overlapping, sweeps;
    unsigned int stopped; /* 1: the last solve, of a pressed scene, came to its limit of rounds */
    unsigned int spilled; /* blocks whose discs did not fit into a table in shared memory */
};

/* Records of pairs. */
struct bridge_records {
    int2 *ends; /* i, j */
    float *half_base, *gap, *quarter_draw, *distance, *start[3], *free[3];
};

/* Everything that a call works on, in the device's workspace; passed to kernels by value. */
struct bridge_work {
    struct bridge_plan plan;
    uint32_t seed, run;
    uint64_t step;
    const int *halt;     /* of a batch of steps; NULL: none */
    int64_t n, capacity; /* pairs that there is memory for */
    unsigned int slots;  /* of a table in shared memory, for the discs of a block */
    /* zero at the start */
    struct bridge_results *results;
    unsigned int *changed;       /* a sweep: 1: a push changed by more than the tolerance */
    unsigned long long *tally;   /* n_blocks + 1: found pairs */
    unsigned int *count;         /* n_blocks: records that were kept */
    unsigned long long *quanta;  /* dimension a particle: sum of pushes */
    float *shift[BRIDGE_SOLVES]; /* the same in units, for each solve */
    size_t zero_bytes;           /* of all of these, from results on */
    /* not set at the start */
    int64_t *first; /* n_blocks + 1: where a block's pairs begin */
    int32_t *colours;
    uint32_t *colour_end; /* BRIDGE_COLOURS a block: in the block, where a colour's pairs end */
    int2 *found;
    int32_t *found_block;
    struct bridge_records raw;  /* by block */
    bridge_key *key, *other;    /* of them */
    int2 *sorted;               /* slots of their ends in a table, in the order of keys */
    unsigned long long *used;   /* 2 a pair: colours of the pairs of a disc, in tables elsewhere */
    struct bridge_records pair; /* by block, in the order of sweeps */
    float *push, *normal[3];    /* of a pair */
    float *last_push;           /* one round before, where pushes go on */
    unsigned char *active;      /* 1: in short sweeps */
};

/* Kept from call to call. */
struct gbg_cuda_bridge {
    int64_t capacity;
    int slots; /* of a table in shared memory, at most: GBG_CUDA_BRIDGE_SLOTS, fewer in tests */
    int64_t spilled; /* of the last call */
    /* asked once; 0: not yet */
    int shared;  /* bytes of shared memory of a multiprocessor */
    int room[2]; /* of a thread block that orders, 2D, 3D; less what it always has */
    int resident[2][BRIDGE_WIDEST + 1]; /* thread blocks of a solve that fit on the device */
};

/* For batches of steps (steps.cu), before the first: takes the memory of the rule, so that no step
 * of the batch lacks it when its particles have been moved already. */
int gbg_cuda_bridge_reserve(struct gbg_device *device, const struct gbg_state *state,
                            struct gbg_list *list, const struct gbg_contacts *contacts);
/* Starts the rule for one step, whose number is `step`, without waiting; nothing is done if *halt
 * is set. Where the results will be, for as long as no other kernel takes the workspace, and pairs
 * that there is memory for: if more were found nobody has been moved. *results NULL: there is
 * nothing to do. */
int gbg_cuda_bridge_start(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                          const struct gbg_contacts *contacts, uint64_t step, const int *halt,
                          struct bridge_results **results, int64_t *capacity);

/* Starts what finds the pairs, and makes their records. */
int gbg_cuda_bridge_find(struct gbg_device *device, const struct gbg_state *state,
                         const struct gbg_list *list, const struct bridge_work *work, void *scan,
                         size_t scan_bytes);
/* Chooses work->slots. */
int gbg_cuda_bridge_order(struct gbg_device *device, struct gbg_cuda_bridge *kept,
                          const struct gbg_state *state, struct bridge_work *work);
/* Bytes of scratch for gbg_cuda_bridge_find. */
size_t gbg_cuda_bridge_scan_bytes(int64_t n_blocks);
/* Starts all sweeps. */
int gbg_cuda_bridge_solve(struct gbg_device *device, struct gbg_cuda_bridge *kept,
                          const struct bridge_work *work);

/* Colours of blocks: along an axis with one block there is one parity. */
GBG_INLINE int64_t bridge_stride(const struct bridge_plan *plan, int a)
{
    return plan->blocks[a] > 1 ? 2 : 1;
}

GBG_INLINE bool bridge_has_colour(const struct bridge_plan *plan, int colour)
{
    for (int a = 0; a < 3; a++) {
        if ((colour >> a & 1) >= bridge_stride(plan, a)) {
            return false;
        }
    }
    return true;
}

/* Blocks of one colour, the same number for every colour, and which block the k-th of them is. */
GBG_INLINE int64_t bridge_of_colour(const struct bridge_plan *plan)
{
    int64_t blocks = plan->n_blocks;
    for (int a = 0; a < 3; a++) {
        blocks /= bridge_stride(plan, a);
    }
    return blocks;
}

GBG_INLINE int64_t bridge_block(const struct bridge_plan *plan, int colour, int64_t k)
{
    int64_t block = 0, weight = 1;
    for (int a = 0; a < 3; a++) {
        int64_t stride = bridge_stride(plan, a), along = plan->blocks[a] / stride;
        block += weight * (k % along * stride + (colour >> a & 1));
        weight *= plan->blocks[a];
        k /= along;
    }
    return block;
}

/* How wide thread blocks are for so many blocks at a time, a thread block each: a thread for each
 * pair of a colour, of which there are at most half as many as discs, where there is room for them.
 */
static inline int bridge_wider(const struct gbg_device *device, const struct bridge_work *work,
                               int64_t blocks)
{
    int64_t pairs = work->n / (2 * work->plan.n_blocks);
    int64_t room = (int64_t)device->multiprocessors * BRIDGE_MOST_THREADS;
    int wider = 0;
    while (wider < BRIDGE_WIDEST && BRIDGE_THREADS << wider < pairs &&
           blocks * (2 * BRIDGE_THREADS << wider) <= room) {
        wider++;
    }
    return wider;
}

/* Sum of the counts of the lanes up to this one. */
static __device__ __forceinline__ unsigned bridge_warp_upto(unsigned count)
{
    unsigned lane = threadIdx.x & 31u;
    for (unsigned step = 1; step < 32; step *= 2) {
        unsigned before = __shfl_up_sync(BRIDGE_WARP, count, step);
        count += lane >= step ? before : 0u;
    }
    return count;
}

/* 1 if there is nothing to work on: no pair, or more than there is memory for, and the host will
 * find them again. */
static __device__ __forceinline__ bool bridge_idle(const struct bridge_work &work)
{
    unsigned long long found = work.results->found;
    return found == 0 || found > (unsigned long long)work.capacity;
}

#endif
