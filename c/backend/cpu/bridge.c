/* L1, CPU, per instruction set: the contact rule "bridge".
 *
 * A pair of discs at the gap g0 whose free moves change its distance by z in a step has, as a
 * Brownian path with these ends, the running minimum m = (z - sqrt(z^2 + E))/2 with
 * E = -2 S^2 ln U, U uniform and S the deviation of the noise of one component of their difference.
 * A path reflected at contact ends farther out by the depth that the free one reached: the pair is
 * pushed apart by p = max(0, -(g0 + m)), a half for each disc. In a crowd z is everything that
 * changes the distance but the pair's own push, so that the pushes of all pairs depend on each
 * other; they are found together, by sweeps of successive over-relaxation on fixed lines between
 * the discs, then once more on the lines that the first solution gave. Without noise E = 0 and this
 * is the complementarity of gaps and pushes. */
#include "backend/cpu/bridge.h"

#include <math.h>
#include <string.h>

#ifdef _OPENMP
#include <omp.h>
#endif

#include "backend/cpu/cpu.h"
#include "backend/cpu/variant.h"

/* Below this many pairs a second thread costs more than it brings. */
enum { FEW_PAIRS = 4096 };

static int this_thread(void)
{
#ifdef _OPENMP
    return omp_get_thread_num();
#else
    return 0;
#endif
}

/* Hands out `count` elements of `size` bytes of the workspace; counts only while base is NULL. */
static void *take(unsigned char *base, size_t *used, int64_t count, size_t size)
{
    void *part = base ? base + *used : NULL;
    *used += ((size_t)count * size + 63) / 64 * 64;
    return part;
}

static size_t lay_out(struct bridge *bridge, unsigned char *base)
{
    size_t used = 0, dimension = (size_t)bridge->dimension;
    int64_t chunks = bridge->list->n_chunks, n = bridge->list->n, blocks = bridge->plan.n_blocks;
    int64_t pairs = chunks * bridge->list->bridge_found;
    bridge->found_capacity = bridge->list->bridge_found;
    bridge->most = bridge->list->bridge_most;
    bridge->first = take(base, &used, blocks + 1, sizeof *bridge->first);
    bridge->count = take(base, &used, blocks, sizeof *bridge->count);
    bridge->active = take(base, &used, blocks, sizeof *bridge->active);
    bridge->depth = take(base, &used, blocks, sizeof *bridge->depth);
    bridge->tally = take(base, &used, chunks * blocks, sizeof *bridge->tally);
    bridge->order = take(base, &used, blocks, sizeof *bridge->order);
    bridge->found_count = take(base, &used, chunks, sizeof *bridge->found_count);
    bridge->shift = take(base, &used, n, dimension * sizeof *bridge->shift);
    bridge->quanta = take(base, &used, n, dimension * sizeof *bridge->quanta);
    bridge->used = take(base, &used, n, sizeof *bridge->used);
    bridge->found = take(base, &used, pairs, sizeof *bridge->found);
    bridge->sorted = take(base, &used, pairs, 2 * sizeof *bridge->sorted);
    bridge->pair = take(base, &used, pairs, sizeof *bridge->pair);
    bridge->normal = take(base, &used, pairs, dimension * sizeof *bridge->normal);
    bridge->shape = take(base, &used, pairs, (2 * dimension + 1) * sizeof *bridge->shape);
    bridge->short_list = take(base, &used, pairs, sizeof *bridge->short_list);
    bridge->last_push =
        take(base, &used, bridge->plan.momentum > 0.0f ? pairs : 0, sizeof *bridge->last_push);
    bridge->raw = take(base, &used, bridge->threads * bridge->most, sizeof *bridge->raw);
    bridge->key = take(base, &used, bridge->threads * bridge->most, 2 * sizeof *bridge->key);
    return used;
}

static int reserve(struct bridge *bridge)
{
    void *base;
    int status = gbg_cpu_workspace(bridge->device, lay_out(bridge, NULL), &base);
    if (status == GBG_OK) {
        lay_out(bridge, base);
    }
    return status;
}

/* Finds the pairs to look at; memory that turns out too small grows and they are found again. */
static int find(struct bridge *bridge)
{
    struct gbg_list *list = bridge->list;
    if (list->bridge_found == 0) {
        list->bridge_found = 2 * list->n / list->n_chunks + 1024;
        list->bridge_most = 2048;
    }
    for (;;) {
        int64_t found = 0, most = 0;
        int status = reserve(bridge);
        if (status != GBG_OK) {
            return status;
        }
#pragma omp parallel for num_threads(bridge->device->threads) schedule(static, 1)
        for (int c = 0; c < list->n_chunks; c++) {
            bridge_find(bridge, c);
        }
        for (int c = 0; c < list->n_chunks; c++) {
            found = bridge->found_count[c] > found ? bridge->found_count[c] : found;
        }
        for (int64_t b = 0; b < bridge->plan.n_blocks; b++) {
            int64_t pairs = 0;
            for (int c = 0; c < list->n_chunks; c++) {
                pairs += bridge->tally[c * bridge->plan.n_blocks + b];
            }
            most = pairs > most ? pairs : most;
        }
        if (found <= list->bridge_found && most <= list->bridge_most) {
            return GBG_OK;
        }
        list->bridge_found = found > list->bridge_found ? found + found / 2 : list->bridge_found;
        list->bridge_most = most > list->bridge_most ? most + most / 2 : list->bridge_most;
    }
}

static int colour_of(const struct bridge *bridge, int64_t block)
{
    int colour = 0;
    for (int a = 0; a < bridge->dimension; a++) {
        colour |= (int)(block % bridge->plan.blocks[a] % 2) << a;
        block /= bridge->plan.blocks[a];
    }
    return colour;
}

/* Sorts the found pairs by block and the blocks by colour. Returns the number of pairs. */
static int64_t sort_by_block(struct bridge *bridge)
{
    int64_t place = 0, n = 0, blocks = bridge->plan.n_blocks;
    int chunks = bridge->list->n_chunks;
    for (int64_t b = 0; b < blocks; b++) {
        bridge->first[b] = place;
        for (int c = 0; c < chunks; c++) {
            int64_t pairs = bridge->tally[c * blocks + b];
            bridge->tally[c * blocks + b] = place;
            place += pairs;
        }
    }
    bridge->first[blocks] = place;
    for (int colour = 0; colour < 8; colour++) {
        bridge->colour_first[colour] = n;
        for (int64_t b = 0; b < blocks; b++) {
            if (bridge->first[b + 1] > bridge->first[b] && colour_of(bridge, b) == colour) {
                bridge->order[n++] = (int32_t)b;
            }
        }
    }
    bridge->colour_first[8] = n;
#pragma omp parallel for num_threads(bridge->threads) schedule(static, 1)
    for (int c = 0; c < chunks; c++) {
        const struct bridge_found *found = bridge->found + c * bridge->found_capacity;
        for (int64_t k = 0; k < bridge->found_count[c]; k++) {
            int64_t to = bridge->tally[c * blocks + found[k].block]++;
            bridge->sorted[2 * to] = found[k].i;
            bridge->sorted[2 * to + 1] = found[k].j;
        }
    }
    return place;
}

static void make_records(struct bridge *bridge)
{
    memset(bridge->used, 0, (size_t)bridge->list->n * sizeof *bridge->used);
#pragma omp parallel num_threads(bridge->threads)
    {
        int64_t thread = this_thread();
        struct bridge_raw *raw = bridge->raw + thread * bridge->most;
        bridge_key *key = bridge->key + thread * 2 * bridge->most;
        for (int colour = 0; colour < 8; colour++) {
#pragma omp for schedule(dynamic, 1)
            for (int64_t k = bridge->colour_first[colour]; k < bridge->colour_first[colour + 1];
                 k++) {
                bridge_make_records(bridge, bridge->order[k], raw, key);
            }
        }
    }
}

/* What the pushes of a block move its discs by, in quanta, opposite to the last bit. */
static void sum_quanta(struct bridge *bridge, int64_t block, int64_t *pairs, int64_t *virial)
{
    int dimension = bridge->dimension;
    int64_t first = bridge->first[block];
    for (int64_t k = first; k < first + bridge->count[block]; k++) {
        const struct bridge_pair *pair = &bridge->pair[k];
        if (pair->push > 0.0f) {
            for (int a = 0; a < dimension; a++) {
                int64_t quanta = bridge_quanta(pair->push, bridge->normal[dimension * k + a],
                                               bridge->plan.quantum[a]);
                bridge->quanta[(int64_t)dimension * pair->i + a] += quanta;
                bridge->quanta[(int64_t)dimension * pair->j + a] -= quanta;
            }
            *pairs += 1;
            *virial += bridge_virial(&bridge->plan, bridge->state, pair->i, pair->j, pair->push);
        }
    }
}

/* 1 if none of the found pairs overlaps now. Pairs that were not found are farther than `look`
 * beyond contact, but for what pushes have taken off that. Only where pairs are few: else a screen
 * of all particles costs less. */
static int is_clear(struct bridge *bridge, int64_t pairs, double farthest_push)
{
    double least = 1.0 - bridge->rule->tolerance;
    if (8 * pairs > bridge->list->n ||
        2.0 * farthest_push > 0.99 * bridge->plan.look * bridge->plan.unit) {
        return 0;
    }
    for (int64_t k = 0; k < pairs; k++) {
        if (bridge_overlap(bridge->state, bridge->sorted[2 * k], bridge->sorted[2 * k + 1],
                           least)) {
            return 0;
        }
    }
    return 1;
}

/* Moves a particle; returns the square of its way since the start of the step, in lengths, or -1
 * if nobody pushed it. *stale: its way since the list was built is too long for the list. */
static double move(struct bridge *bridge, int64_t i, double slack, int *stale, double *farthest)
{
    struct gbg_state *state = bridge->state;
    const int64_t *quanta = bridge->quanta + bridge->dimension * i;
    double squared = 0.0, pushed = 0.0;
    int64_t any = 0;
    for (int a = 0; a < bridge->dimension; a++) {
        any |= quanta[a];
    }
    if (!any) {
        return -1.0;
    }
    for (int a = 0; a < bridge->dimension; a++) {
        uint64_t old = gbg_join(state->high[a][i], state->low[a][i]);
        uint64_t moved = old + (uint64_t)quanta[a];
        state->high[a][i] = (uint32_t)(moved >> 32);
        state->low[a][i] = (uint32_t)moved;
        bridge->list->local[a][i] =
            gbg_local(state->high[a][i], state->low[a][i], bridge->list->shift[a]);
        if (state->image[a]) {
            state->image[a][i] += (quanta[a] > 0 && moved < old) - (quanta[a] < 0 && moved > old);
        }
        double d = gbg_box_difference(&state->box, a, moved,
                                      gbg_join(state->start_high[a][i], state->start_low[a][i]));
        double p = (double)quanta[a] * state->box.quantum[a];
        squared += d * d;
        pushed += p * p;
    }
    if (state->overlapped) {
        state->overlapped[i] = 1;
    }
    *farthest = pushed > *farthest ? pushed : *farthest;
    *stale |= pushed > slack * slack || gbg_list_moved_squared(bridge->list, i) > slack * slack;
    return squared;
}

static int apply_pushes(struct bridge *bridge, struct gbg_contacts *contacts)
{
    int64_t n = bridge->list->n, pairs = 0, virial = 0;
    double slack = 0.5 * (bridge->list->radius - bridge->list->reach) * 0.999, largest = 0.0;
    double farthest = 0.0; /* push */
    int stale = 0;
    memset(bridge->quanta, 0, (size_t)(n * bridge->dimension) * sizeof *bridge->quanta);
#pragma omp parallel num_threads(bridge->threads) reduction(+ : pairs, virial)
    for (int colour = 0; colour < 8; colour++) {
#pragma omp for schedule(dynamic, 1)
        for (int64_t k = bridge->colour_first[colour]; k < bridge->colour_first[colour + 1]; k++) {
            sum_quanta(bridge, bridge->order[k], &pairs, &virial);
        }
    }
#pragma omp parallel for num_threads(bridge->threads) reduction(max                                \
                                                                : largest, farthest)               \
    reduction(|                                                                                    \
              : stale)
    for (int64_t i = 0; i < n; i++) {
        double squared = move(bridge, i, slack, &stale, &farthest);
        largest = squared > largest ? squared : largest;
    }
    contacts->pairs = pairs;
    contacts->largest = sqrt(largest);
    contacts->virial = (double)virial * 0x1p-40 * bridge->plan.unit * bridge->plan.unit;
    if (stale) {
        return gbg_list_build(bridge->device, bridge->state, bridge->list);
    }
    contacts->clear = is_clear(bridge, bridge->first[bridge->plan.n_blocks], sqrt(farthest));
    return GBG_OK;
}

int GBG_ISA_NAME(gbg_cpu_bridge)(struct gbg_device *device, struct gbg_state *state,
                                 struct gbg_list *list, struct gbg_contacts *contacts)
{
    struct bridge bridge = {.device = device,
                            .state = state,
                            .list = list,
                            .rule = contacts,
                            .dimension = state->box.dimension,
                            .threads = device->threads};
    contacts->rounds = contacts->pairs = contacts->left = contacts->stopped = 0;
    contacts->largest = contacts->virial = 0.0;
    contacts->clear = 0;
    if (!bridge_make_plan(&bridge.plan, state, list->n, list->reach, contacts)) {
        return GBG_OK;
    }
    int status = find(&bridge);
    if (status != GBG_OK) {
        return status;
    }
    int64_t pairs = sort_by_block(&bridge);
    bridge.threads = pairs < FEW_PAIRS ? 1 : device->threads;
    if (pairs == 0) {
        contacts->clear = 1;
        return GBG_OK;
    }
    make_records(&bridge);
    contacts->rounds = bridge_solve(&bridge, &contacts->stopped);
    return apply_pushes(&bridge, contacts);
}
