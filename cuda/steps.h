/* L1, CUDA: batches of steps: what the kernels of a step tell each other, without the host. */
#ifndef GBG_CUDA_STEPS_H
#define GBG_CUDA_STEPS_H

#include "backend/cpu/exact.h"
#include "backend/cpu/power.h"
#include "cuda/contacts.h"
#include "cuda/integrate.h"
#include "cuda/list.h"

enum { GBG_CUDA_BATCH = 128 }; /* steps that are started together, at most */

/* What became of one step. */
struct gbg_cuda_slot {
    struct gbg_cuda_extremes moves;
    unsigned long long farthest;  /* bits of the largest squared way of those corrected, by high
                                     words */
    unsigned long long virial;    /* sum modulo 2^64 */
    unsigned long long pairs;     /* pushes */
    unsigned long long displaced; /* the same since the lists were built, by high words */
    unsigned long long way;       /* since the start of the step, of the certificate */
    unsigned int rounds, faults;  /* faults: pairs that are too close */
    /* the same of the rule bridge, where it comes before the rounds */
    unsigned long long bridge_farthest, bridge_virial, bridge_pairs;
    unsigned int bridge_sweeps, unused;
};

struct gbg_cuda_control {
    int halt;    /* 1: nothing more is done */
    int stale;   /* 1: because lists are to be built */
    int done;    /* steps that are complete */
    int undo;    /* 1: the moves of the step after those are to be taken back */
    int spoiled; /* 1: they were made and there is no copy of the coordinates before it */
    int limit;   /* steps to be made */
    int turn;    /* which of the two arrays of places the first step reads */
    int parted;  /* 1: the rounds of this step have ended */
    uint64_t first;
    double displaced;                 /* nobody has come farther since the lists were built */
    unsigned long long found;         /* overlapping pairs of the present round */
    unsigned int ticket;              /* blocks that have finished a kernel */
    unsigned int arrived, generation; /* of blocks that wait for each other */
    struct gbg_cuda_slot slot[GBG_CUDA_BATCH];
};

/* What every kernel of a batch gets. */
struct gbg_cuda_work {
    struct gbg_state state;
    struct gbg_cuda_rows pairs, contacts; /* without particles: there is no such list */
    double slack;                         /* of both: how far particles may come from where they
                                             were built */
    struct gbg_cuda_euler euler;
    float unit_high[3]; /* length of a unit of a high word */
    double error;       /* of a distance by high words */
    /* a force that is computed with the move */
    struct gbg_cutoff_unit unit;
    double factor;
    void *place[2];
    /* hard cores */
    struct gbg_cuda_rounds rounds; /* sifted by high words */
    int64_t max_rounds;
    int bridge; /* 1: the rule bridge comes before the rounds */
    struct gbg_exact exact;
    float close; /* squared distance by high words beyond which the certificate need not look */
    double certificate_slack;
    struct gbg_cuda_control *control;
};

/* Where the force of a step comes from: nowhere, from the state's arrays, or from places with that
 * power. */
enum gbg_cuda_law { GBG_CUDA_FREE, GBG_CUDA_STORED, GBG_CUDA_POWER_2, GBG_CUDA_POWER_6 };

/* These start kernels (steps_kernels.cu). begin: for up to `limit` steps from number `first` on;
 * renew 0: places and displacements are those at which the last batch ended. */
int gbg_cuda_steps_begin(struct gbg_device *device, const struct gbg_cuda_work *work, int limit,
                         int turn, uint64_t first, int renew);
/* All steps in one kernel; not for GBG_CUDA_STORED. */
int gbg_cuda_steps_together(struct gbg_device *device, const struct gbg_cuda_work *work, int law);
/* Local coordinates of the list of forces, before stored forces are computed. */
int gbg_cuda_steps_follow(struct gbg_device *device, const struct gbg_cuda_work *work);
/* A step in two parts, between which the rule bridge may come: the move (GBG_CUDA_STORED: with the
 * forces that are there), then the rounds. */
int gbg_cuda_steps_move(struct gbg_device *device, const struct gbg_cuda_work *work, int law,
                        int step);
int gbg_cuda_steps_part(struct gbg_device *device, const struct gbg_cuda_work *work, int step);
struct bridge_results;
int gbg_cuda_steps_bridged(struct gbg_device *device, const struct gbg_cuda_work *work,
                           const struct bridge_results *results, int64_t capacity, int step);
/* The list's local coordinates from places. */
int gbg_cuda_steps_unpack(struct gbg_device *device, const struct gbg_cuda_work *work, int turn);
/* The coordinates before a step with hard cores. */
int gbg_cuda_steps_take_back(struct gbg_device *device, const struct gbg_cuda_work *work);

#endif
