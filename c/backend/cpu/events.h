/* L1, CPU: elastic collisions of the straight moves of a step: what its files share. */
#ifndef GBG_BACKEND_CPU_EVENTS_H
#define GBG_BACKEND_CPU_EVENTS_H

#include <stdint.h>

#include "backend/backend.h"
#include "backend/cpu/events_pair.h"
#include "backend/cpu/list.h"

/* A particle with events. Its target is moved by integers that sum to zero for every pair. */
struct gbg_member {
    int32_t particle, first, last; /* legs */
    int32_t events, depth;
    int32_t image[3];   /* box crossings by the pushes */
    uint64_t target[3]; /* at the end of the step */
    double off[3];      /* from the start of the step to the last leg's place */
};

struct gbg_event {
    double time;
    int32_t first, second;               /* particles, first < second */
    int32_t first_events, second_events; /* what they had had when this was foreseen */
};

/* What became of a cluster. */
struct gbg_cluster {
    int32_t part, pass;             /* who worked on it, and when last */
    int32_t again;                  /* to be done again */
    int32_t parent, next, last;     /* union of clusters: root, chain of its clusters */
    int64_t begin, end;             /* its first events */
    int64_t first_member, members;  /* in the part */
    int64_t events, depth, stopped; /* stopped: particles at the limit of events */
    int64_t virial;                 /* in the unit of the call */
};

/* A member that counts: the position of the particle in the step is this one's. */
struct gbg_changed {
    int32_t part, cluster;
    int64_t member;
};

/* An array that grows. */
struct gbg_room {
    int64_t used, capacity;
};

/* Memory of one thread. */
struct gbg_events_part {
    struct gbg_leg *leg;
    struct gbg_member *member;
    struct gbg_event *first_event; /* foreseen on the free paths */
    struct gbg_event *heap;
    int32_t *candidate; /* pairs that the screen found */
    int32_t *conflict;  /* pairs of clusters */
    struct gbg_room legs, members, first_events, heaped, candidates, conflicts;
    int32_t *member_of;   /* particles: member in the cluster being worked on; -1 */
    float moved, started; /* squares of the largest free move, and distance of a start from where
                             the list was built */
    double farthest;      /* largest distance from the start of the step on a path */
    int stale;            /* somebody left the range in which the list is complete */
    int status;
};

struct gbg_events {
    int64_t n;
    int n_parts;
    struct gbg_events_part *part;
    uint32_t *move;          /* free moves for the screen, x and y to 8 bits */
    float *third;            /* z */
    uint32_t *owner;         /* particles: changed[owner - 1]; 0: on its free path */
    int32_t *root;           /* particles: union of those with events; -1 */
    int32_t *number;         /* particles: cluster of a root */
    struct gbg_event *event; /* of all clusters, cluster by cluster */
    struct gbg_cluster *cluster;
    struct gbg_changed *changed;
    int32_t *todo;
    struct gbg_room events, clusters, changes, todos;
    int32_t pass;
    int64_t next_todo;     /* what threads take from */
    struct gbg_list *wide; /* for steps that leave the range of the list */
    double excursion;      /* the farthest that anybody was from the start of the last such step */
    int64_t passes, wide_steps; /* since it was made: for tests and notes */
};

/* What every function of a call reads. */
struct gbg_events_call {
    struct gbg_device *device;
    struct gbg_state *state;
    const struct gbg_list *list;
    struct gbg_events *work;
    double largest; /* contact distance */
    double slack;   /* distance from where the list was built up to which it is complete */
    double per_quantum[3];
    double range; /* of differences of local coordinates */
    double moved; /* the longest free move; infinite: too long for the local coordinates */
    double virial_unit;
    int together; /* all clusters as one: the plain algorithm, for tests */
};

int gbg_events(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
               struct gbg_contacts *contacts);
/* together: every event of the step in one queue on one thread, which must not change a bit. */
int gbg_events_make(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                    struct gbg_contacts *contacts, int together);
int gbg_events_clear(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                     double tolerance, struct gbg_pair *first);
void gbg_events_destroy(struct gbg_device *device, struct gbg_events *events);
double gbg_events_bytes(const struct gbg_events *events);

/* Room for `more` elements behind those in use; may move the array. */
int gbg_events_grow(struct gbg_device *device, void *array, struct gbg_room *room, int64_t more,
                    size_t size);

/* Every collision of the step; the results are the members that `changed` names. */
int gbg_events_passes(const struct gbg_events_call *call);

/* All events of a union of clusters in the order of (time, particles), from its free paths. */
int gbg_events_work(const struct gbg_events_call *call, struct gbg_events_part *part, int32_t root);
/* Clusters whose changed paths meet those of this cluster, as pairs in the part's conflicts. */
int gbg_events_conflicts(const struct gbg_events_call *call, struct gbg_events_part *part,
                         int32_t root);

/* The time at which a pair meets, infinite if never; first < second. */
double gbg_events_meet(const struct gbg_events_call *call, int64_t i, int64_t j,
                       const struct gbg_leg *first, const struct gbg_leg *second);

/* Neighbours of particle i: slots GBG_SLICE apart; short rows are filled up with i itself. */
static inline const int32_t *gbg_events_row(const struct gbg_list *list, int64_t i, int32_t *width)
{
    int64_t slice = i / GBG_SLICE;
    int c = 0;
    while (slice >= list->chunk[c].end_slice) {
        c++;
    }
    *width = list->width[slice];
    return list->chunk[c].index + list->offset[slice] + i % GBG_SLICE;
}

#endif
