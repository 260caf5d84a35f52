/* L1, CPU: hard cores: rounds of pair corrections until an exact check finds no overlap. */
#include "backend/cpu/contacts.h"

#include <math.h>
#include <string.h>

#include "backend/cpu/contacts_pair.h"
#include "backend/cpu/cpu.h"
#include "backend/cpu/list.h"
#include "core/memory.h"

/* Everything that a round reads. */
struct round {
    struct gbg_state *state;
    struct gbg_list *list;
    const struct gbg_push_rule *rule;
    gbg_cpu_screen screen;
    float limit;
};

static int reserve_work(struct gbg_context *context, const struct gbg_list *list,
                        struct gbg_chunk *chunk)
{
    int64_t most = (chunk->end_slice - chunk->first_slice) * GBG_SLICE;
    if (chunk->work_capacity >= most) {
        return GBG_OK;
    }
    int status = gbg_allocate(context, (void **)&chunk->look, most, sizeof *chunk->look,
                              "contact candidates");
    if (status == GBG_OK) {
        status = gbg_allocate(context, (void **)&chunk->move, most, sizeof *chunk->move,
                              "contact moves");
    }
    for (int a = 0; status == GBG_OK && a < list->dimension; a++) {
        status = gbg_allocate(context, (void **)&chunk->push[a], most, sizeof *chunk->push[a],
                              "contact pushes");
    }
    chunk->work_capacity = status == GBG_OK ? most : 0;
    return status;
}

/* Work arrays, at the first call for a list. */
static int reserve(struct gbg_device *device, struct gbg_list *list)
{
    int status = GBG_OK;
    if (!list->look) {
        status =
            gbg_allocate_zero(device->context, (void **)&list->look, list->n, 1, "contact marks");
    }
    for (int c = 0; status == GBG_OK && c < list->n_chunks; c++) {
        status = reserve_work(device->context, list, &list->chunk[c]);
    }
    return status;
}

/* First look of a step: particles with a neighbour inside the largest contact distance, by 32-bit
 * coordinates with room for their rounding; the exact check follows for these alone. */
static void screen(const struct round *round, struct gbg_chunk *chunk)
{
    const struct gbg_list *list = round->list;
    chunk->n_look = 0;
    for (int64_t slice = chunk->first_slice; slice < chunk->end_slice; slice++) {
        chunk->n_look += round->screen(list, slice, chunk->index + list->offset[slice],
                                       round->limit, chunk->look + chunk->n_look);
    }
}

static void look_at_all(const struct gbg_list *list, struct gbg_chunk *chunk)
{
    int64_t end = chunk->end_slice * GBG_SLICE < list->n ? chunk->end_slice * GBG_SLICE : list->n;
    chunk->n_look = 0;
    for (int64_t i = chunk->first_slice * GBG_SLICE; i < end; i++) {
        chunk->look[chunk->n_look++] = (int32_t)i;
    }
}

/* Collects the marks that the last round left in this chunk's range. */
static void look_at_marked(struct gbg_list *list, struct gbg_chunk *chunk)
{
    int64_t i = chunk->first_slice * GBG_SLICE;
    int64_t end = chunk->end_slice * GBG_SLICE < list->n ? chunk->end_slice * GBG_SLICE : list->n;
    chunk->n_look = 0;
    while (i < end) {
        uint64_t eight = 0;
        if (i + 8 <= end) {
            memcpy(&eight, list->look + i, 8);
            if (eight == 0) {
                i += 8;
                continue;
            }
        }
        if (list->look[i]) {
            list->look[i] = 0;
            chunk->look[chunk->n_look++] = (int32_t)i;
        }
        i++;
    }
}

/* Whether a particle may touch one of its list, by 32-bit coordinates with room for rounding. In
 * the plane the third axis is a copy of the first with scale 0: no branch for each pair. */
struct nearness {
    const uint32_t *local[3];
    float scale[3], limit;
};

static struct nearness make_nearness(const struct round *round)
{
    const struct gbg_list *list = round->list;
    struct nearness near = {.limit = round->limit};
    for (int a = 0; a < 3; a++) {
        near.local[a] = list->local[a < list->dimension ? a : 0];
        near.scale[a] = a < list->dimension ? list->scale[a] : 0.0f;
    }
    return near;
}

static inline int may_touch(const struct nearness *near, int64_t i, int64_t j)
{
    float x = (float)(int32_t)(near->local[0][i] - near->local[0][j]) * near->scale[0];
    float y = (float)(int32_t)(near->local[1][i] - near->local[1][j]) * near->scale[1];
    float z = (float)(int32_t)(near->local[2][i] - near->local[2][j]) * near->scale[2];
    return x * x + y * y + z * z < near->limit;
}

static void find_pushes(const struct round *round, struct gbg_chunk *chunk)
{
    const struct gbg_list *list = round->list;
    const struct gbg_state *state = round->state;
    const struct nearness near = make_nearness(round);
    chunk->n_move = 0;
    chunk->pairs = 0;
    chunk->virial = 0;
    for (int64_t m = 0; m < chunk->n_look; m++) {
        int64_t i = chunk->look[m], slice = i / GBG_SLICE, pairs = 0;
        const int32_t *index = chunk->index + list->offset[slice] + i % GBG_SLICE;
        int64_t push[3] = {0, 0, 0};
        for (int32_t k = 0; k < list->width[slice]; k++) {
            int64_t j = index[(int64_t)k * GBG_SLICE];
            if (may_touch(&near, i, j) && j != i &&
                gbg_push_pair(round->rule, state, state->box.dimension, i, j, push,
                              &chunk->virial)) {
                pairs++;
                chunk->pairs += i < j;
            }
        }
        if (pairs > 0) {
            if (round->rule->parting == GBG_PARTING_CARTER) {
                gbg_push_cut(round->rule, state, state->box.dimension, i, push);
            }
            for (int a = 0; a < list->dimension; a++) {
                chunk->push[a][chunk->n_move] = push[a];
            }
            chunk->move[chunk->n_move++] = (int32_t)i;
        }
    }
}

static double apply_push(const struct round *round, int64_t i, const int64_t push[3])
{
    struct gbg_state *state = round->state;
    double squared = gbg_push_apply(state, state->box.dimension, i, push);
    for (int a = 0; a < state->box.dimension; a++) {
        round->list->local[a][i] =
            gbg_local(state->high[a][i], state->low[a][i], round->list->shift[a]);
    }
    return squared;
}

static inline void mark(struct gbg_list *list, int64_t i)
{
    __atomic_store_n(&list->look[i], 1, __ATOMIC_RELAXED); /* several threads may mark the same */
}

static void move_and_mark(const struct round *round, struct gbg_chunk *chunk)
{
    struct gbg_list *list = round->list;
    struct gbg_state *state = round->state;
    double slack = 0.5 * (list->radius - list->reach) * 0.999;
    chunk->stale = 0;
    for (int64_t m = 0; m < chunk->n_move; m++) {
        int64_t i = chunk->move[m], slice = i / GBG_SLICE;
        int64_t push[3] = {0, 0, 0};
        for (int a = 0; a < list->dimension; a++) {
            push[a] = chunk->push[a][m];
        }
        double pushed = apply_push(round, i, push);
        if (pushed > slack * slack || gbg_list_moved_squared(list, i) > slack * slack) {
            chunk->stale = 1;
        }
        if (state->overlapped) {
            state->overlapped[i] = 1;
        }
        double far =
            state->start_high[0] ? gbg_push_displaced(state, state->box.dimension, i) : 0.0;
        chunk->largest = far > chunk->largest ? far : chunk->largest;
        const int32_t *index = chunk->index + list->offset[slice] + i % GBG_SLICE;
        mark(list, i);
        for (int32_t k = 0; k < list->width[slice]; k++) {
            mark(list, index[(int64_t)k * GBG_SLICE]);
        }
    }
}

/* Candidates of the next round; a list that has become stale is built anew and all are looked at.
 */
static int next_candidates(struct gbg_device *device, const struct round *round, int *all)
{
    struct gbg_list *list = round->list;
    *all = 0;
    for (int c = 0; c < list->n_chunks; c++) {
        *all |= list->chunk[c].stale;
    }
    if (*all) {
        memset(list->look, 0, (size_t)list->n);
        return gbg_list_build(device, round->state, list);
    }
    return GBG_OK;
}

int gbg_contacts(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                 struct gbg_contacts *contacts)
{
    const struct gbg_push_rule rule = gbg_push_rule_make(state, contacts);
    struct round round = {state, list, &rule, device->variant->screen, gbg_push_limit(&rule)};
    int status = reserve(device, list), all = 0;
    int64_t virial = 0;
    contacts->rounds = contacts->pairs = contacts->left = contacts->stopped = 0;
    contacts->largest = contacts->virial = 0.0;
    if (status != GBG_OK || list->n == 0) {
        return status;
    }
    for (int first = 1;; first = 0) {
        int64_t pairs = 0;
#pragma omp parallel for num_threads(device->threads) schedule(static, 1) reduction(+ : pairs)
        for (int c = 0; c < list->n_chunks; c++) {
            struct gbg_chunk *chunk = &list->chunk[c];
            if (first) {
                chunk->largest = 0.0;
                screen(&round, chunk);
            } else if (all) {
                look_at_all(list, chunk);
            } else {
                look_at_marked(list, chunk);
            }
            find_pushes(&round, chunk);
            pairs += chunk->pairs;
        }
        contacts->left = pairs;
        if (pairs == 0 || contacts->rounds == contacts->max_rounds) {
            break;
        }
#pragma omp parallel for num_threads(device->threads) schedule(static, 1)
        for (int c = 0; c < list->n_chunks; c++) {
            move_and_mark(&round, &list->chunk[c]);
        }
        contacts->rounds++;
        contacts->pairs += pairs;
        for (int c = 0; c < list->n_chunks; c++) {
            virial += list->chunk[c].virial;
        }
        status = next_candidates(device, &round, &all);
        if (status != GBG_OK) {
            return status;
        }
    }
    for (int c = 0; c < list->n_chunks; c++) {
        double largest = sqrt(list->chunk[c].largest);
        contacts->largest = largest > contacts->largest ? largest : contacts->largest;
    }
    contacts->virial = (double)virial * rule.virial_unit;
    return GBG_OK;
}
