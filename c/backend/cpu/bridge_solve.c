/* L1, CPU, per instruction set: rule bridge: sweeps over the pairs until the pushes agree. */
#include <math.h>
#include <string.h>

#include "backend/cpu/bridge.h"

struct relaxation {
    float omega, tolerance, stiff, share;
};

typedef float two __attribute__((vector_size(8)));

/* Solves a pair for its own push and moves its discs; returns by how much the push changed. Few
 * operations wait for each other: a processor has some eight pairs in flight, and the time of a
 * pair is the length of this chain by that number. Both axes of a flat box go through one register.
 */
__attribute__((always_inline)) static inline float relax(struct bridge_pair *pair,
                                                         const float *normal, float *shift,
                                                         const struct relaxation *relaxation,
                                                         int dimension)
{
    float *mine = shift + (int64_t)dimension * pair->i;
    float *other = shift + (int64_t)dimension * pair->j, along;
    two n, flat_mine, flat_other;
    if (dimension == 2) {
        memcpy(&n, normal, sizeof n);
        memcpy(&flat_mine, mine, sizeof n);
        memcpy(&flat_other, other, sizeof n);
        two product = n * (flat_mine - flat_other);
        along = product[0] + product[1];
    } else {
        along = normal[0] * (mine[0] - other[0]) + normal[1] * (mine[1] - other[1]) +
                normal[2] * (mine[2] - other[2]);
    }
    float old = pair->push;
    float push = bridge_relaxed(along, pair->half_base, pair->gap, pair->quarter_draw, old,
                                relaxation->omega);
    float change = push - old;
    pair->push = push;
    if (dimension == 2) {
        two part = n * (two){change, change};
        flat_mine += part;
        flat_other -= part;
        memcpy(mine, &flat_mine, sizeof n);
        memcpy(other, &flat_other, sizeof n);
        return bridge_change(change, push, relaxation->stiff);
    }
    for (int a = 0; a < dimension; a++) {
        mine[a] += change * normal[a];
        other[a] -= change * normal[a];
    }
    return bridge_change(change, push, relaxation->stiff);
}

__attribute__((always_inline)) static inline float
sweep_all(struct bridge *bridge, int64_t block, const struct relaxation *relaxation, int dimension)
{
    int64_t first = bridge->first[block], n = bridge->count[block], kept = 0;
    struct bridge_pair *pair = bridge->pair + first;
    const float *normal = bridge->normal + dimension * first;
    int32_t *list = bridge->short_list + first;
    float largest = 0.0f;
    for (int64_t k = 0; k < n; k++) {
        float change =
            relax(&pair[k], normal + dimension * k, bridge->shift, relaxation, dimension);
        largest = change > largest ? change : largest;
        list[kept] = (int32_t)k;
        kept += change > relaxation->tolerance;
    }
    bridge->active[block] = kept;
    return largest;
}

__attribute__((always_inline)) static inline float sweep_short(struct bridge *bridge, int64_t block,
                                                               const struct relaxation *relaxation,
                                                               int dimension)
{
    int64_t first = bridge->first[block], n = bridge->active[block];
    struct bridge_pair *pair = bridge->pair + first;
    const float *normal = bridge->normal + dimension * first;
    const int32_t *list = bridge->short_list + first;
    float largest = 0.0f;
    for (int64_t k = 0; k < n; k++) {
        float change = relax(&pair[list[k]], normal + dimension * list[k], bridge->shift,
                             relaxation, dimension);
        largest = change > largest ? change : largest;
    }
    return largest;
}

/* The shifts that a block's pushes stand for, on the present lines. */
static float push_again(struct bridge *bridge, int64_t block)
{
    int64_t first = bridge->first[block];
    int dimension = bridge->dimension;
    for (int64_t k = first; k < first + bridge->count[block]; k++) {
        const struct bridge_pair *pair = &bridge->pair[k];
        for (int a = 0; a < dimension && pair->push > 0.0f; a++) {
            float part = pair->push * bridge->normal[dimension * k + a];
            bridge->shift[(int64_t)dimension * pair->i + a] += part;
            bridge->shift[(int64_t)dimension * pair->j + a] -= part;
        }
    }
    return 0.0f;
}

/* Moves the pushes of a block on by a share of what they changed in a round, and their discs. */
__attribute__((always_inline)) static inline void
go_on(struct bridge *bridge, int64_t block, const struct relaxation *relaxation, int dimension)
{
    int64_t first = bridge->first[block], n = bridge->count[block];
    struct bridge_pair *pair = bridge->pair + first;
    const float *normal = bridge->normal + dimension * first;
    float *last = bridge->last_push + first;
    for (int64_t k = 0; k < n; k++) {
        float *mine = bridge->shift + (int64_t)dimension * pair[k].i;
        float *other = bridge->shift + (int64_t)dimension * pair[k].j;
        /* nothing is kept of a round before the first */
        float before = relaxation->share > 0.0f ? last[k] : pair[k].push;
        float push = bridge_gone_on(pair[k].push, before, relaxation->share);
        float change = push - pair[k].push;
        last[k] = pair[k].push;
        pair[k].push = push;
        for (int a = 0; a < dimension; a++) {
            float part = change * normal[dimension * k + a];
            mine[a] += part;
            other[a] -= part;
        }
    }
}

enum task { SWEEP_ALL, SWEEP_SHORT, PUSH_AGAIN, GO_ON };

static float work_on(struct bridge *bridge, int64_t block, enum task task,
                     const struct relaxation *relaxation)
{
    int flat = bridge->dimension == 2;
    switch (task) {
    case SWEEP_ALL:
        return flat ? sweep_all(bridge, block, relaxation, 2)
                    : sweep_all(bridge, block, relaxation, 3);
    case SWEEP_SHORT:
        return flat ? sweep_short(bridge, block, relaxation, 2)
                    : sweep_short(bridge, block, relaxation, 3);
    case GO_ON:
        if (flat) {
            go_on(bridge, block, relaxation, 2);
        } else {
            go_on(bridge, block, relaxation, 3);
        }
        return 0.0f;
    default:
        return push_again(bridge, block);
    }
}

/* A task on all blocks, one colour after the other. Returns the largest change of a push. */
static float each_block(struct bridge *bridge, enum task task, const struct relaxation *relaxation)
{
    float largest = 0.0f;
#pragma omp parallel num_threads(bridge->threads) reduction(max : largest)
    for (int colour = 0; colour < 1 << bridge->dimension; colour++) {
#pragma omp for schedule(dynamic, 1)
        for (int64_t k = bridge->colour_first[colour]; k < bridge->colour_first[colour + 1]; k++) {
            float change = work_on(bridge, bridge->order[k], task, relaxation);
            largest = change > largest ? change : largest;
        }
    }
    return largest;
}

/* Draws the lines of a block's pairs anew through the present places. */
static void turn_lines(struct bridge *bridge, int64_t block)
{
    int dimension = bridge->dimension;
    int64_t first = bridge->first[block];
    for (int64_t k = first; k < first + bridge->count[block]; k++) {
        struct bridge_pair *pair = &bridge->pair[k];
        const float *shape = bridge->shape + (2 * dimension + 1) * k;
        float *normal = bridge->normal + dimension * k;
        float shift[3];
        for (int a = 0; a < dimension; a++) {
            shift[a] = bridge->shift[(int64_t)dimension * pair->i + a] -
                       bridge->shift[(int64_t)dimension * pair->j + a];
        }
        pair->half_base = bridge_turned(dimension, shape, shape + dimension, shape[2 * dimension],
                                        shift, pair->half_base, normal);
    }
}

static void turn_all_lines(struct bridge *bridge)
{
#pragma omp parallel for num_threads(bridge->threads) schedule(dynamic, 1)
    for (int64_t k = 0; k < bridge->colour_first[1 << bridge->dimension]; k++) {
        turn_lines(bridge, bridge->order[k]);
    }
}

static void clear_shifts(struct bridge *bridge)
{
    int64_t n = bridge->list->n * bridge->dimension;
    memset(bridge->shift, 0, (size_t)n * sizeof *bridge->shift);
}

/* Rounds on the present lines: a sweep over all pairs, then short ones over those that changed, or,
 * in a pressed scene, a push on. *settled: 1 if it ended because nothing changed any more. */
static int64_t settle(struct bridge *bridge, float tolerance, int most, int *settled)
{
    const struct bridge_plan *plan = &bridge->plan;
    int64_t sweeps = 0;
    *settled = 0;
    for (int round = 0; round < most; round++) {
        /* the first push of a pair without neighbours is exact and must not be overdone */
        struct relaxation relaxation = {round == 0 ? 1.0f : plan->omega, tolerance, plan->stiff,
                                        bridge_share(plan, round)};
        sweeps++;
        *settled = each_block(bridge, SWEEP_ALL, &relaxation) <= tolerance;
        if (*settled) {
            break;
        }
        if (plan->momentum > 0.0f) {
            if (round + 1 < most) { /* what a solve ends with is what a sweep gave */
                each_block(bridge, GO_ON, &relaxation);
            }
            continue;
        }
        relaxation.omega = plan->omega;
        for (int k = 0; k < BRIDGE_SHORT_SWEEPS; k++) {
            sweeps++;
            if (each_block(bridge, SWEEP_SHORT, &relaxation) <= tolerance) {
                break;
            }
        }
    }
    return sweeps;
}

/* In parts of S, or of the deepest overlap where that is much larger (no noise: S = 0). */
static float tolerance_of(const struct bridge *bridge)
{
    float scale = (float)bridge->plan.deviation;
    for (int64_t k = 0; k < bridge->colour_first[8]; k++) {
        float depth = bridge->depth[bridge->order[k]] * 0x1p-4f;
        scale = depth > scale ? depth : scale;
    }
    return BRIDGE_TOLERANCE * scale;
}

int64_t bridge_solve(struct bridge *bridge, int64_t *stopped)
{
    int settled = 0;
    float tolerance = tolerance_of(bridge);
    int64_t sweeps = 0;
    clear_shifts(bridge);
    for (int solve = 0; solve < bridge->plan.solves; solve++) {
        if (solve > 0) {
            turn_all_lines(bridge);
            clear_shifts(bridge);
            each_block(bridge, PUSH_AGAIN, NULL);
        }
        sweeps += settle(bridge, tolerance, bridge->plan.rounds[solve], &settled);
    }
    *stopped = bridge->plan.momentum > 0.0f && !settled;
    return sweeps;
}
