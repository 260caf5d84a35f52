/* L1, CPU: hard cores: rounds of pair corrections until an exact check finds no overlap. */
#include "backend/cpu/contacts.h"

#include <math.h>
#include <string.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/list.h"
#include "core/memory.h"
#include "core/random.h"

/* The rule "contact" separates to this much more than contact, so that rounds end: each round
 * shrinks the overlaps that neighbours push back, but never to zero. */
static const double contact_margin = 1e-9;
/* Contact distances of all species pairs, made once a call. */
struct table {
    double contact[GBG_SPECIES_MAX][GBG_SPECIES_MAX];
    double least; /* a pair closer than contact times this overlaps */
    double largest;
};

static void make_table(const struct gbg_state *state, double tolerance, struct table *table)
{
    table->least = 1.0 - tolerance;
    table->largest = 0.0;
    for (int s = 0; s < state->n_species; s++) {
        for (int t = 0; t < state->n_species; t++) {
            double contact = 0.5 * (state->diameter[s] + state->diameter[t]);
            table->contact[s][t] = contact;
            table->largest = contact > table->largest ? contact : table->largest;
        }
    }
}

/* Everything that a round reads. */
struct round {
    struct gbg_state *state;
    struct gbg_list *list;
    const struct gbg_contacts *rule;
    const struct table *table;
    gbg_cpu_screen screen;
    float limit; /* squared: largest contact distance with room for the rounding of 32 bits */
    double virial_unit; /* virials are summed in integers, so that their order cannot show */
};

static inline double contact_of(const struct round *round, int64_t i, int64_t j)
{
    const struct gbg_state *state = round->state;
    if (state->own_diameter) {
        return 0.5 * (state->own_diameter[i] + state->own_diameter[j]);
    }
    return state->species ? round->table->contact[state->species[i]][state->species[j]]
                          : round->table->contact[0][0];
}

static inline double difference(const struct gbg_state *state, int64_t i, int64_t j,
                                int64_t quanta[3])
{
    double squared = 0.0;
    for (int a = 0; a < state->box.dimension; a++) {
        quanta[a] = (int64_t)(gbg_join(state->high[a][i], state->low[a][i]) -
                              gbg_join(state->high[a][j], state->low[a][j]));
        double d = (double)quanta[a] * state->box.quantum[a];
        squared += d * d;
    }
    return squared;
}

/* Unit vector in which the first of two coincident particles leaves, from their ids alone: points
 * of the counter generator until one falls well inside the unit disc or ball. */
static void parting_direction(int dimension, uint64_t first, uint64_t second, double unit[3])
{
    for (uint64_t attempt = 0;; attempt++) {
        struct gbg_philox r =
            gbg_philox(gbg_philox_counter(second, first, GBG_STREAM_CONTACT), (uint32_t)attempt, 0);
        double squared = 0.0;
        for (int a = 0; a < dimension; a++) {
            unit[a] = 2.0 * gbg_uniform(r.word[a], 0) - 1.0;
            squared += unit[a] * unit[a];
        }
        if (squared > 0.01 && squared <= 1.0) {
            for (int a = 0; a < dimension; a++) {
                unit[a] /= sqrt(squared);
            }
            return;
        }
    }
}

static void push_coincident(const struct gbg_state *state, int64_t i, int64_t j, double move,
                            int64_t push[3])
{
    uint64_t a = state->id ? state->id[i] : (uint64_t)i, b = state->id ? state->id[j] : (uint64_t)j;
    double unit[3];
    parting_direction(state->box.dimension, a < b ? a : b, a < b ? b : a, unit);
    double sign = a < b ? 1.0 : -1.0;
    for (int d = 0; d < state->box.dimension; d++) {
        push[d] += (int64_t)(sign * rint(unit[d] * move / state->box.quantum[d]));
    }
}

/* Adds what the overlap with j moves i by; both particles of a pair find the same numbers with
 * opposite signs, so the pair's sum is zero to the last bit. Returns 1 if they overlap. */
static inline int push_pair(const struct round *round, int64_t i, int64_t j, int64_t push[3],
                            int64_t *virial)
{
    const struct gbg_state *state = round->state;
    int64_t quanta[3];
    double squared = difference(state, i, j, quanta);
    double contact = contact_of(round, i, j), least = contact * round->table->least;
    if (squared >= least * least) {
        return 0;
    }
    double distance = sqrt(squared);
    double depth = contact - distance;
    int parting = round->rule->parting;
    double move = parting == GBG_PARTING_CONTACT ? 0.5 * (depth + contact_margin * contact) : depth;
    /* the cap is taken from a pair and not from the sum of pushes: that conserves momentum */
    if (parting != GBG_PARTING_CARTER && move > round->rule->cap * contact) {
        move = round->rule->cap * contact;
    }
    /* distance half way: the push of a bounce from r to 2 contact - r counts with contact, and the
     * virial of an equilibrium is that of its pair distribution */
    *virial += i < j ? (int64_t)rint((distance + move) * move / round->virial_unit) : 0;
    if (distance < 1e-12 * contact) {
        push_coincident(state, i, j, move, push);
        return 1;
    }
    for (int a = 0; a < state->box.dimension; a++) {
        push[a] += (int64_t)rint((double)quanta[a] * (move / distance));
    }
    return 1;
}

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

/* The sum of all pushes on particle i, cut to a quarter of its diameter. */
static void cut_sum(const struct round *round, int64_t i, int64_t push[3])
{
    const struct gbg_state *state = round->state;
    double squared = 0.0, most = 0.25 * contact_of(round, i, i);
    for (int a = 0; a < state->box.dimension; a++) {
        double d = (double)push[a] * state->box.quantum[a];
        squared += d * d;
    }
    for (int a = 0; squared > most * most && a < state->box.dimension; a++) {
        push[a] = (int64_t)rint((double)push[a] * (most / sqrt(squared)));
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
            if (may_touch(&near, i, j) && j != i && push_pair(round, i, j, push, &chunk->virial)) {
                pairs++;
                chunk->pairs += i < j;
            }
        }
        if (pairs > 0) {
            if (round->rule->parting == GBG_PARTING_CARTER) {
                cut_sum(round, i, push);
            }
            for (int a = 0; a < list->dimension; a++) {
                chunk->push[a][chunk->n_move] = push[a];
            }
            chunk->move[chunk->n_move++] = (int32_t)i;
        }
    }
}

static double displaced(const struct gbg_state *state, int64_t i)
{
    double squared = 0.0;
    for (int a = 0; a < state->box.dimension; a++) {
        double d = gbg_box_difference(&state->box, a, gbg_join(state->high[a][i], state->low[a][i]),
                                      gbg_join(state->start_high[a][i], state->start_low[a][i]));
        squared += d * d;
    }
    return squared;
}

static double apply_push(const struct round *round, int64_t i, const int64_t push[3])
{
    struct gbg_state *state = round->state;
    double squared = 0.0;
    for (int a = 0; a < state->box.dimension; a++) {
        uint64_t old = gbg_join(state->high[a][i], state->low[a][i]),
                 moved = old + (uint64_t)push[a];
        state->high[a][i] = (uint32_t)(moved >> 32);
        state->low[a][i] = (uint32_t)moved;
        round->list->local[a][i] =
            gbg_local(state->high[a][i], state->low[a][i], round->list->shift[a]);
        if (state->image[a]) {
            state->image[a][i] += (push[a] > 0 && moved < old) - (push[a] < 0 && moved > old);
        }
        double d = (double)push[a] * state->box.quantum[a];
        squared += d * d;
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
        if (round->state->overlapped) {
            round->state->overlapped[i] = 1;
        }
        double far = round->state->start_high[0] ? displaced(round->state, i) : 0.0;
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
    struct table table;
    make_table(state, contacts->tolerance, &table);
    struct round round = {state,
                          list,
                          contacts,
                          &table,
                          device->variant->screen,
                          (float)(table.largest * table.largest * (1.0 + 1e-5)),
                          0x1p-40 * table.largest * table.largest};
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
    contacts->virial = (double)virial * round.virial_unit;
    return GBG_OK;
}
