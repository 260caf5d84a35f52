/* L2: the engine's body. Side rooms read it through view.h only. */
#ifndef GBG_ENGINE_ENGINE_H
#define GBG_ENGINE_ENGINE_H

#include "backend/backend.h"
#include "core/context.h"
#include "core/view.h"
#include "engine/view.h"
#include "gamboge/engine.h"
#include "scene/scene.h"

enum { GBG_STEPS_MAX = 6 + GBG_MAX_FORCES };

/* Elements of a loop from which on it is shared out among threads. */
enum { GBG_WORTH_THREADS = 1 << 16 };

/* When particles get a new order in memory: by rule, or for tests. */
enum gbg_ordering { GBG_ORDERING_AUTO, GBG_ORDERING_NEVER, GBG_ORDERING_ALWAYS };

/* A step of the plan: what `gamboge check` prints and what run calls in this order. */
struct gbg_plan_step {
    const char *kernel;
    char what[160];
    double bytes; /* a particle, of the arrays that only this step needs */
    int (*run)(struct gbg_engine *engine, const struct gbg_plan_step *step);
    int force;         /* index of the scene's force, for force steps */
    double mesh_bytes; /* the part of `bytes` that a sum over all images takes */
};

struct gbg_engine {
    struct gbg_context *context;
    struct gbg_scene scene; /* resolved copy, without particle arrays */
    const struct gbg_backend *backend;
    const struct gbg_kernels *kernels;
    struct gbg_device *device;
    struct gbg_state state;
    struct gbg_list *pairs;          /* for cut-off forces */
    struct gbg_list *contacts;       /* for hard cores */
    struct gbg_mesh_sums *mesh_sums; /* sums over all images; NULL: none */

    struct gbg_plan_step plan[GBG_STEPS_MAX];
    int n_plan;
    int use_double; /* forces by the double kernels */
    int strict;     /* sums over all pairs by the kernel of the same bits everywhere */
    double cutoff;  /* largest of the cut-off forces */
    struct gbg_noise noise;
    double contact; /* largest contact distance; 0: no hard cores */
    double least_contact;

    uint64_t step;
    double seconds;
    double check_seconds; /* spent in measuring sums over all images, not in `seconds` */
    double moved;         /* largest move of a particle in the last step, for the lists */
    struct gbg_moves moves;
    int forces_current; /* 1: force[] belongs to the present positions */
    int64_t contact_rounds, contact_pairs, reverted, repeated, events_left; /* sums over steps */
    int64_t unsettled, unsettled_pairs; /* solves at their limit, and pushes on what they left */
    int64_t steps_made;    /* by this engine: what the reverted particles are a share of */
    double contact_virial; /* sum over steps of distance times the displacement of one disc */

    int ordering;                         /* enum gbg_ordering */
    int64_t seen_builds, arranged_builds; /* of the list that decides; at the last new order */
    int new_order;                        /* 1: no list has been built in it yet */
    double least_scatter;                 /* of the first list in the last new order */
    int32_t *place; /* by rank: the index in the state; see gbg_engine_places */
    uint64_t place_epoch;

    int64_t *rank;    /* rank in the order of ids of the k-th particle added; NULL: k */
    int32_t *species; /* for views: made when first asked for */
    int64_t *id;
    uint32_t *words; /* transfer buffer of one axis, made when first asked for */
};

/* Makes an engine from a resolved scene with its particles (sorted by id); takes nothing over. */
int gbg_engine_make(struct gbg_scene *scene, const struct gbg_particles *particles,
                    struct gbg_engine **engine);
void gbg_engine_free(struct gbg_engine *engine);

/* Fills engine->plan and makes the lists; refuses what the backend cannot do. */
int gbg_engine_plan(struct gbg_engine *engine);
/* The text of the step that looks for neighbours: whether they are kept shows when a list has been
 * built. */
void gbg_engine_describe_list(const struct gbg_engine *engine, struct gbg_plan_step *step);

/* Takes all memory that running needs: nothing is allocated in a step but when a list outgrows
 * every earlier one. */
int gbg_engine_prepare(struct gbg_engine *engine);

/* Advances; a refused step leaves the state of the last good one. */
int gbg_engine_advance(struct gbg_engine *engine, int64_t steps);
/* As many of these steps as the backend makes at once (batch.c); *more 0: the next is to be made
 * kernel by kernel. */
int gbg_engine_batch(struct gbg_engine *engine, int64_t steps, int64_t *made, int *more);
/* Forces at the present positions into state.force (made if the scene has none: zeros). */
int gbg_engine_evaluate_forces(struct gbg_engine *engine);
/* Error of the present forces on a sample of particles. */
int gbg_engine_measure_error(struct gbg_engine *engine, int64_t samples, double *rms_over_rms,
                             double *rms_over_median);

/* Particles put back over all moves that this engine made. */
double gbg_engine_reverted_fraction(const struct gbg_engine *engine);

/* 1 if all forces of the scene are cut off. */
int gbg_engine_is_short_range(const struct gbg_engine *engine);
/* 1 if a force is summed over all pairs, one by one, in the order of memory. */
int gbg_engine_has_direct_sums(const struct gbg_engine *engine);

/* 1 if forces of many particles, near and far, add up on one. */
static inline int gbg_force_is_far(const struct gbg_force *force)
{
    return force->sum == GBG_SUM_MINIMUM_IMAGE ||
           (force->sum == GBG_SUM_LATTICE && force->power < 4.0);
}

/* Gives the particles a new order in memory if the one they have has decayed; at the start of a
 * step, because forces and the coordinates before the step are void afterwards. */
int gbg_engine_tidy(struct gbg_engine *engine);
/* Back to the order of ids, for what depends on the order in memory. */
int gbg_engine_order_by_id(struct gbg_engine *engine);
/* place[k]: index in the state of the particle whose id is k-th; NULL: k. In host memory, valid
 * until the order changes. Uses engine->words. */
int gbg_engine_places(struct gbg_engine *engine, const int32_t **place);
/* Bytes of the backend's memory, at most 8 a particle, into engine->words. */
int gbg_engine_fetch(struct gbg_engine *engine, const void *from, size_t bytes);

static inline int64_t gbg_engine_place(const int32_t *place, int64_t k)
{
    return place ? place[k] : k;
}

/* Overlapping pairs of hard cores now. */
int gbg_engine_count_overlaps(struct gbg_engine *engine, int64_t *count);
/* GBG_E_OVERLAP with both ids if hard cores overlap now. */
int gbg_engine_check_overlaps(struct gbg_engine *engine, const char *call);

/* Encodes n coordinates (order of ids through rank) into the state. */
int gbg_engine_encode(struct gbg_engine *engine, const struct gbg_points *points);
/* The same for a running engine: refused, with everything as before, if hard cores would overlap.
 */
int gbg_engine_replace(struct gbg_engine *engine, const struct gbg_points *points);
int gbg_engine_decode(struct gbg_engine *engine, int wrapped, int axis, double *base,
                      ptrdiff_t step);

/* SHA-256 text of step, ids and fractions in the order of ids. */
int gbg_engine_digest(struct gbg_engine *engine, char text[65]);

/* Bytes a particle that the engine holds now. */
double gbg_engine_bytes(const struct gbg_engine *engine);

/* Id of the particle at index i of the state. */
int64_t gbg_engine_id(const struct gbg_engine *engine, int64_t i);

static inline int64_t gbg_engine_rank(const struct gbg_engine *engine, int64_t k)
{
    return engine->rank ? engine->rank[k] : k;
}

#endif
