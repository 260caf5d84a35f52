/* L1, CPU, per instruction set: rule bridge: sweeps over the pairs until the pushes agree. */
#include <math.h>
#include <string.h>

#include "backend/cpu/bridge.h"

/* Sweeps and their parameters, chosen on C3 short at packing 0.79 (dt = T = 0.01, N = 2048), where
 * the mean gap of bound pairs is 3.181(10)e-3 when solved to 1e-4 S in some 120 sweeps. Two solves
 * of 12 sweeps give the same, of 3 and 12 sweeps 0.3 % more, of 3 and 9 sweeps 0.5 %
 * more. The first solve only has to find the lines. Factors of 1.5
 * and 1.6 do as well, 1.7 leaves twice as many pairs overlapping. Tolerances of 1e-2 and 1e-3 of S
 * do not differ here, 3e-2 costs another 0.1 %. */
static const float omega = 1.5f;
static const float relative_tolerance = 1e-2f;
enum { SOLVES = 2, SHORT_SWEEPS = 2 };
static const int rounds[SOLVES] = {1, 4}; /* of a sweep over all pairs and some short ones */

struct relaxation {
    float omega, tolerance;
};

typedef float two __attribute__((vector_size(8)));

/* Solves a pair for its own push, the others being as they are; returns by how much the push
 * changed. All in halves, h = z/2: p = sqrt(h^2 + E/4) - h - g0. Written without branches, for
 * whether a pair is pushed cannot be foreseen, and so that few operations wait for each other: a
 * processor has some eight pairs in flight, and the time of a pair is the length of this chain by
 * that number. Both axes of a flat box go through one register. */
__attribute__((always_inline)) static inline float
relax(struct bridge_pair *pair, const float *normal, float *shift, float factor, int dimension)
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
    float old = pair->push, h = along + (pair->half_base - 0.5f * old);
    float wanted = sqrtf(h * h + pair->quarter_draw) - (h + pair->gap);
    wanted = wanted > 0.0f ? wanted : 0.0f;
    float push = factor * wanted + (1.0f - factor) * old;
    push = push > 0.0f ? push : 0.0f;
    float change = push - old;
    pair->push = push;
    if (dimension == 2) {
        two part = n * (two){change, change};
        flat_mine += part;
        flat_other -= part;
        memcpy(mine, &flat_mine, sizeof n);
        memcpy(other, &flat_other, sizeof n);
        return fabsf(change);
    }
    for (int a = 0; a < dimension; a++) {
        mine[a] += change * normal[a];
        other[a] -= change * normal[a];
    }
    return fabsf(change);
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
            relax(&pair[k], normal + dimension * k, bridge->shift, relaxation->omega, dimension);
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
                             relaxation->omega, dimension);
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

enum task { SWEEP_ALL, SWEEP_SHORT, PUSH_AGAIN };

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
        float shift[3], now[3], squared = 0.0f, change = 0.0f, along = 0.0f;
        for (int a = 0; a < dimension; a++) {
            shift[a] = bridge->shift[(int64_t)dimension * pair->i + a] -
                       bridge->shift[(int64_t)dimension * pair->j + a];
            float move = shape[dimension + a] + shift[a];
            now[a] = shape[a] + move;
            squared += now[a] * now[a];
            change += (2.0f * shape[a] + move) * move;
        }
        float distance = sqrtf(squared);
        if (!(distance > 0.1f * shape[2 * dimension])) {
            continue; /* nearly through each other: the line says nothing, the old one stays */
        }
        for (int a = 0; a < dimension; a++) {
            normal[a] = 0.5f * now[a] / distance;
            along += normal[a] * shift[a];
        }
        pair->half_base = 0.5f * change / (distance + shape[2 * dimension]) - along;
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

/* Sweeps on the present lines: one over all pairs, then short ones over those that changed. */
static int64_t settle(struct bridge *bridge, float tolerance, int most)
{
    int64_t sweeps = 0;
    for (int round = 0; round < most; round++) {
        /* the first push of a pair without neighbours is exact and must not be overdone */
        struct relaxation relaxation = {round == 0 ? 1.0f : omega, tolerance};
        sweeps++;
        if (each_block(bridge, SWEEP_ALL, &relaxation) <= tolerance) {
            break;
        }
        relaxation.omega = omega;
        for (int k = 0; k < SHORT_SWEEPS; k++) {
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
    float scale = (float)bridge->deviation;
    for (int64_t k = 0; k < bridge->colour_first[8]; k++) {
        float depth = bridge->depth[bridge->order[k]] * 0x1p-4f;
        scale = depth > scale ? depth : scale;
    }
    return relative_tolerance * scale;
}

int64_t bridge_solve(struct bridge *bridge)
{
    float tolerance = tolerance_of(bridge);
    int64_t sweeps = 0;
    clear_shifts(bridge);
    for (int solve = 0; solve < SOLVES; solve++) {
        if (solve > 0) {
            turn_all_lines(bridge);
            clear_shifts(bridge);
            each_block(bridge, PUSH_AGAIN, NULL);
        }
        sweeps += settle(bridge, tolerance, rounds[solve]);
    }
    return sweeps;
}
