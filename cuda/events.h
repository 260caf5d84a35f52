/* L1, CUDA: elastic collisions of the straight moves of a step: what its files share. */
#ifndef GBG_CUDA_EVENTS_H
#define GBG_CUDA_EVENTS_H

#include "cuda/list.h"

#include "backend/cpu/events_pair.h"
#include "cuda/events_host.h"

/* Rounds of sharing the events out to clusters; what is not settled by then goes to the host. */
enum { GBG_CUDA_PASSES = 12 };

/* Events in a queue of global memory, and such queues in a pass. */
enum { GBG_CUDA_EVENTS_SLAB = 4096, GBG_CUDA_EVENTS_SLABS = 128 };

/* Why a step is not done; bits. */
enum {
    GBG_CUDA_NARROW = 1, /* somebody leaves the range of the list */
    GBG_CUDA_LARGE = 2,  /* a cluster outgrew its queue */
    GBG_CUDA_FULL = 4    /* an array is too short */
};

/* A particle with events, as struct gbg_member of the CPU. */
struct gbg_cuda_member {
    int32_t particle, first, last; /* legs */
    int32_t events, depth;
    int32_t cluster; /* its name: the lowest particle of it; -1: this member no longer counts */
    int32_t image[3];
    int64_t virial;
    uint64_t target[3];
    uint64_t free[3]; /* where the free path ended */
    double off[3];
};

struct gbg_cuda_first {
    double time;
    int32_t first, second;
};

struct gbg_cuda_queued {
    double time;
    int32_t first, second;
    uint32_t events; /* that they had had: of the first, of the second << 16 */
};

/* Counters of a step. Counts may exceed what the arrays hold: then the step is done again. */
struct gbg_cuda_events_report {
    unsigned moved, started; /* squares, bits of floats: free move, start from where built */
    unsigned failed;
    unsigned done;
    int32_t candidates, events, members, legs;
    int32_t todo[GBG_CUDA_PASSES + 1], next[GBG_CUDA_PASSES + 1];
    int32_t slabs[GBG_CUDA_PASSES + 1], conflicts[GBG_CUDA_PASSES + 1];
    int32_t begin[GBG_CUDA_PASSES + 1]; /* members made before this pass */
    unsigned long long events_had, stopped, virial, largest;
    int depth;
};

/* What kernels read and write. All on the device. */
struct gbg_cuda_events_arrays {
    uint4 *path;        /* n, 3D: 2 n: local coordinates of the end, free move as floats */
    int32_t *parent;    /* n: union of particles with events, towards the lowest index */
    int32_t *head;      /* n: first events of a cluster, at its root; -1 */
    int32_t *due;       /* n: the pass in which the cluster of this root is to be worked on */
    int32_t *claim;     /* n: cluster that changed this particle, plus 1; 0: on its free path */
    int32_t *member_of; /* n: where claim is not 0 */
    int2 *candidate;
    struct gbg_cuda_first *event;
    int32_t *next; /* events: of the same cluster; -1 */
    int32_t *todo; /* roots */
    struct gbg_cuda_member *member;
    struct gbg_leg *leg;
    int2 *conflict; /* clusters */
    struct gbg_cuda_queued *slab;
    struct gbg_cuda_events_report *report;
    int32_t candidates, events, members, legs, conflicts, slabs; /* capacities */
};

struct gbg_cuda_events {
    int64_t n;
    int fresh; /* 1: the arrays of n were just made or are void: to be set anew */
    struct gbg_cuda_events_arrays arrays;
    struct gbg_cuda_events_report report; /* of the last step on the device */
    int on_host;                          /* 1: the paths of the last step are the host's */
    int skip, wait; /* steps to give to the host before the device is tried again */
    int64_t steps, host_steps, passes; /* since it was made: for tests and notes */
    struct gbg_cuda_events_host *host;
    void *copy; /* pinned: the state on the host */
    size_t copy_bytes;
};

/* What every kernel of a call gets, by value. */
struct gbg_cuda_events_call {
    struct gbg_state state;
    struct gbg_cuda_rows rows;
    struct gbg_cuda_events_arrays arrays;
    double unit[3], per_quantum[3];
    double largest, longest; /* contact distance; edge of the box */
    double slack, range, virial_unit;
};

/* The parts of a step on the device, in this order; start: the first events, pass: from 1 until
 * there are no conflicts, finish: the results, if it is done. What came of it is in the report. */
int gbg_cuda_events_start(struct gbg_device *device, const struct gbg_cuda_events_call *call,
                          int fresh);
int gbg_cuda_events_pass(struct gbg_device *device, const struct gbg_cuda_events_call *call,
                         int pass);
int gbg_cuda_events_finish(struct gbg_device *device, const struct gbg_cuda_events_call *call,
                           int pass);
int gbg_cuda_events_work(struct gbg_device *device, const struct gbg_cuda_events_call *call,
                         int pass);

/* The state in host memory that the work arrays keep; makes the device for the rule there. */
int gbg_cuda_events_download(struct gbg_device *device, const struct gbg_state *state,
                             struct gbg_cuda_events *work, struct gbg_state *copy);

/* Blocks that keep the device busy, and no more than n threads need. */
static inline unsigned gbg_cuda_events_blocks(const struct gbg_device *device, int64_t n)
{
    int64_t most = 16 * (int64_t)device->multiprocessors,
            needed = (n + GBG_CUDA_THREADS - 1) / GBG_CUDA_THREADS;
    return (unsigned)(needed < 1 ? 1 : needed < most ? needed : most);
}

static __device__ __forceinline__ int32_t gbg_cuda_events_seen(const int32_t *p)
{
    return *(const volatile int32_t *)p;
}

static __device__ __forceinline__ int32_t gbg_cuda_events_root(const int32_t *parent, int32_t i)
{
    for (int32_t up; (up = gbg_cuda_events_seen(parent + i)) != i;) {
        i = up;
    }
    return i;
}

/* Joins the unions of p and q: the higher root is hung below the lower one, whoever comes first. */
static __device__ __forceinline__ void gbg_cuda_events_unite(int32_t *parent, int32_t p, int32_t q)
{
    for (;;) {
        p = gbg_cuda_events_root(parent, p);
        q = gbg_cuda_events_root(parent, q);
        if (p == q) {
            return;
        }
        int32_t above = p < q ? p : q, below = p < q ? q : p;
        if (atomicCAS(parent + below, below, above) == below) {
            return;
        }
    }
}

/* How many of an array are there: a count may run ahead of the capacity. */
static __device__ __forceinline__ int32_t gbg_cuda_events_count(const int32_t *count, int32_t most)
{
    return *count < most ? *count : most;
}

/* Notes that two clusters are to be joined. */
static __device__ __forceinline__ void
gbg_cuda_events_conflict(const struct gbg_cuda_events_arrays &arrays, int pass, int32_t p,
                         int32_t q)
{
    int32_t at = atomicAdd(&arrays.report->conflicts[pass], 1);
    if (at < arrays.conflicts) {
        arrays.conflict[at] = make_int2(p, q);
    } else {
        atomicOr(&arrays.report->failed, GBG_CUDA_FULL);
    }
}

/* The longest free move, with room for its rounding. */
static __device__ __forceinline__ double
gbg_cuda_events_moved(const struct gbg_cuda_events_call &call)
{
    double moved = sqrt((double)__uint_as_float(call.arrays.report->moved));
    return moved * (1.0 + 1e-6) + call.largest * 1e-6;
}

#endif
