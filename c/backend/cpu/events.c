/* L1, CPU: the contact rule event: everybody moves straight from the coordinates before the step to
 * those now, and pairs that meet on the way collide elastically. */
#include "backend/cpu/events.h"

#include <math.h>
#include <string.h>

#include "backend/cpu/cpu.h"
#include "core/memory.h"

/* Room in the screen for the rounding of 32-bit lengths, relative to contact; for that of moves,
 * which the screen reads with 8 bits, relative to the longest (it is 2^-8 for a pair). */
static const double length_room = 2e-5, move_room = 0x1p-7;

/* A list for long moves has room for paths longer than the longest known by this factor, and at
 * least for this part of contact: crowded particles get nowhere near the ends of their free moves.
 */
static const double excursion_room = 1.25, least_excursion = 0.2;

/* Entries of a list for long moves, at most: 1 GiB. */
static const double most_entries = 0x1p28;

int gbg_events_grow(struct gbg_device *device, void *array, struct gbg_room *room, int64_t more,
                    size_t size)
{
    if (room->used + more <= room->capacity) {
        return GBG_OK;
    }
    int64_t capacity = room->used + more + room->capacity / 2 + 1024;
    void *larger, *smaller;
    memcpy(&smaller, array, sizeof smaller);
    int status = gbg_cpu_scratch(device, &larger, capacity, size, "collisions of a step");
    if (status == GBG_OK) {
        if (room->used > 0) {
            memcpy(larger, smaller, (size_t)room->used * size);
        }
        gbg_release(smaller);
        memcpy(array, &larger, sizeof larger);
        room->capacity = capacity;
    }
    return status;
}

void gbg_events_destroy(struct gbg_device *device, struct gbg_events *events)
{
    if (!events) {
        return;
    }
    for (int c = 0; events->part && c < events->n_parts; c++) {
        struct gbg_events_part *part = &events->part[c];
        void *arrays[] = {part->leg,       part->member,   part->first_event, part->heap,
                          part->candidate, part->conflict, part->member_of};
        for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++) {
            gbg_release(arrays[k]);
        }
    }
    void *arrays[] = {events->part,    events->move,   events->third, events->owner,
                      events->root,    events->number, events->event, events->cluster,
                      events->changed, events->todo};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++) {
        gbg_release(arrays[k]);
    }
    gbg_list_destroy(device, events->wide);
    gbg_release(events);
}

double gbg_events_bytes(const struct gbg_events *events)
{
    double bytes = (double)events->n * (16.0 + (events->third ? 4.0 : 0.0)) +
                   (double)events->events.capacity * sizeof *events->event +
                   (double)events->clusters.capacity * sizeof *events->cluster +
                   (double)events->changes.capacity * sizeof *events->changed +
                   (double)events->todos.capacity * sizeof *events->todo;
    for (int c = 0; c < events->n_parts; c++) {
        const struct gbg_events_part *part = &events->part[c];
        bytes += (double)events->n * 4.0 + (double)part->legs.capacity * sizeof *part->leg +
                 (double)part->members.capacity * sizeof *part->member +
                 (double)part->first_events.capacity * sizeof *part->first_event +
                 (double)part->heaped.capacity * sizeof *part->heap +
                 (double)(part->candidates.capacity + part->conflicts.capacity) * 4.0;
    }
    return bytes + (events->wide ? gbg_list_bytes(events->wide) : 0.0);
}

/* An array of n indices, all of them -1. */
static int allocate_none(struct gbg_context *context, int32_t **array, int64_t n)
{
    int status = gbg_allocate(context, (void **)array, n, sizeof **array, "collisions of a step");
    if (status == GBG_OK) {
        memset(*array, 0xFF, (size_t)n * sizeof **array);
    }
    return status;
}

static int fill(struct gbg_device *device, const struct gbg_list *list, struct gbg_events *events)
{
    struct gbg_context *context = device->context;
    static const char what[] = "collisions of a step";
    int64_t n = list->n;
    int status = gbg_allocate_zero(context, (void **)&events->part, events->n_parts,
                                   sizeof *events->part, what);
    status = status ? status
                    : gbg_cpu_scratch(device, (void **)&events->move, n, sizeof(uint32_t), what);
    if (list->dimension == 3) {
        status = status ? status
                        : gbg_cpu_scratch(device, (void **)&events->third, n, sizeof(float), what);
    }
    status = status
                 ? status
                 : gbg_allocate_zero(context, (void **)&events->owner, n, sizeof(uint32_t), what);
    status = status ? status : allocate_none(context, &events->root, n);
    status = status ? status : allocate_none(context, &events->number, n);
    for (int c = 0; status == GBG_OK && c < events->n_parts; c++) {
        struct gbg_events_part *part = &events->part[c];
        int64_t share = n / events->n_parts / 8; /* room for steps of 0.03 of contact */
        status = allocate_none(context, &part->member_of, n);
        status =
            status ? status
                   : gbg_events_grow(device, &part->leg, &part->legs, 2 * share, sizeof *part->leg);
        status = status ? status
                        : gbg_events_grow(device, &part->member, &part->members, share,
                                          sizeof *part->member);
    }
    return status;
}

/* Work arrays, at the first call for a list. */
static int reserve(struct gbg_device *device, struct gbg_list *list)
{
    if (list->events) {
        return GBG_OK;
    }
    struct gbg_events *made;
    int status =
        gbg_allocate_zero(device->context, (void **)&made, 1, sizeof *made, "collisions of a step");
    if (status == GBG_OK) {
        made->n = list->n;
        made->n_parts = list->n_chunks;
        status = fill(device, list, made);
        if (status != GBG_OK) {
            gbg_events_destroy(device, made);
            return status;
        }
        list->events = made;
    }
    return status;
}

/* Free moves of all particles, rounded for the screen, and the longest of them. */
static void find_moves(const struct gbg_events_call *call)
{
    struct gbg_events *work = call->work;
    const struct gbg_list *list = call->list;
#pragma omp parallel for num_threads(call->device->threads) schedule(static, 1)
    for (int c = 0; c < work->n_parts; c++) {
        struct gbg_events_part *part = &work->part[c];
        int64_t first = list->chunk[c].first_slice * GBG_SLICE,
                end = list->chunk[c].end_slice * GBG_SLICE;
        part->moved = part->started = 0.0f;
        part->legs.used = part->members.used = part->first_events.used = 0;
        part->conflicts.used = 0;
        call->device->variant->event_moves(call->state, list, first, end < list->n ? end : list->n,
                                           work->move, work->third, &part->moved, &part->started);
    }
}

/* Differences of local coordinates as long as this are still those of the nearest image. */
static double range_of_locals(const struct gbg_events_call *call)
{
    double shortest = 8.0 * call->list->reach;
    for (int a = 0; a < call->state->box.dimension; a++) {
        shortest = fmin(shortest, call->state->box.length[a]);
    }
    return 0.49 * shortest;
}

/* Squared distance within which the screen must find every pair. */
static float screen_limit(const struct gbg_events_call *call)
{
    double longest = 0.0;
    for (int a = 0; a < call->state->box.dimension; a++) {
        longest = fmax(longest, call->state->box.length[a]);
    }
    double reach =
        call->largest * (1.0 + length_room) + move_room * call->moved + longest * 0x1p-30;
    return (float)(reach * reach);
}

static int64_t all_pairs(const struct gbg_list *list, int64_t slice, const int32_t *index,
                         int32_t *pair)
{
    int64_t n = 0;
    for (int64_t i = slice * GBG_SLICE; i < (slice + 1) * GBG_SLICE && i < list->n; i++) {
        for (int32_t k = 0; k < list->width[slice]; k++) {
            int32_t j = index[(int64_t)k * GBG_SLICE + i % GBG_SLICE];
            if (j > i) {
                pair[2 * n] = (int32_t)i;
                pair[2 * n++ + 1] = j;
            }
        }
    }
    return n;
}

/* Pairs of one slice that meet on their free paths. */
static int find_in_slice(const struct gbg_events_call *call, struct gbg_events_part *part,
                         const int32_t *index, int64_t slice, float limit)
{
    const struct gbg_events *work = call->work;
    int64_t most = (int64_t)call->list->width[slice] * GBG_SLICE;
    int status = gbg_events_grow(call->device, &part->candidate, &part->candidates, 2 * most,
                                 sizeof *part->candidate);
    if (status != GBG_OK) {
        return status;
    }
    int64_t n = !isfinite(call->moved)
                    ? all_pairs(call->list, slice, index, part->candidate)
                    : call->device->variant->event_screen(call->list, slice, index, work->move,
                                                          work->third, limit, part->candidate);
    status = gbg_events_grow(call->device, &part->first_event, &part->first_events, n,
                             sizeof *part->first_event);
    for (int64_t k = 0; status == GBG_OK && k < n; k++) {
        int32_t i = part->candidate[2 * k], j = part->candidate[2 * k + 1];
        struct gbg_leg first, second;
        gbg_events_free(call->state, i, &first);
        gbg_events_free(call->state, j, &second);
        double time = gbg_events_meet(call, i, j, &first, &second);
        if (time < 1.0) {
            part->first_event[part->first_events.used++] = (struct gbg_event){time, i, j, 0, 0};
        }
    }
    return status;
}

static int find_first_events(const struct gbg_events_call *call)
{
    struct gbg_events *work = call->work;
    const struct gbg_list *list = call->list;
    float limit = screen_limit(call);
    int status = GBG_OK;
#pragma omp parallel for num_threads(call->device->threads) schedule(static, 1)
    for (int c = 0; c < work->n_parts; c++) {
        struct gbg_events_part *part = &work->part[c];
        const struct gbg_chunk *chunk = &list->chunk[c];
        part->status = GBG_OK;
        for (int64_t slice = chunk->first_slice; part->status == GBG_OK && slice < chunk->end_slice;
             slice++) {
            part->status =
                find_in_slice(call, part, chunk->index + list->offset[slice], slice, limit);
        }
    }
    for (int c = 0; c < work->n_parts; c++) {
        status = work->part[c].status != GBG_OK ? work->part[c].status : status;
    }
    return status;
}

static void forget_changes(struct gbg_events *work)
{
    for (int64_t k = 0; k < work->changes.used; k++) {
        const struct gbg_changed *changed = &work->changed[k];
        work->owner[work->part[changed->part].member[changed->member].particle] = 0;
    }
    work->changes.used = 0;
}

/* Adds a place at `off` from the start of the step to what is known of the range. */
static void look(const struct gbg_events_call *call, struct gbg_events_part *part,
                 const double base[3], const double off[3])
{
    double from_built = 0.0, from_start = 0.0;
    for (int a = 0; a < call->state->box.dimension; a++) {
        from_built += (base[a] + off[a]) * (base[a] + off[a]);
        from_start += off[a] * off[a];
    }
    part->farthest = fmax(part->farthest, sqrt(from_start));
    part->stale |= from_built > call->slack * call->slack;
}

/* The corners of one particle's path: legs are straight, so the rest of it lies between. */
static void look_at_path(const struct gbg_events_call *call, struct gbg_events_part *part,
                         int64_t i)
{
    const struct gbg_events *work = call->work;
    const struct gbg_state *state = call->state;
    const struct gbg_list *list = call->list;
    double base[3], off[3] = {0.0, 0.0, 0.0};
    for (int a = 0; a < state->box.dimension; a++) {
        uint32_t start = gbg_local(state->start_high[a][i], state->start_low[a][i], list->shift[a]);
        base[a] = (double)(int32_t)(start - list->built[a][i]) * list->unit[a];
    }
    struct gbg_leg room;
    const struct gbg_leg *legs = NULL, *leg = &room;
    if (work->owner[i] == 0) {
        gbg_events_free(state, i, &room);
    } else {
        const struct gbg_changed *changed = &work->changed[work->owner[i] - 1];
        legs = work->part[changed->part].leg;
        leg = &legs[work->part[changed->part].member[changed->member].first];
    }
    for (; leg; leg = leg->next >= 0 ? &legs[leg->next] : NULL) {
        double end = leg->next >= 0 ? legs[leg->next].time : 1.0;
        for (int a = 0; a < state->box.dimension; a++) {
            off[a] += leg->velocity[a] * (end - leg->time);
        }
        look(call, part, base, off);
    }
}

/* Whether the list was complete all along everybody's path. Free moves that are short of its range
 * need not be looked at again: both their ends are known to lie in it. */
static int left_range(const struct gbg_events_call *call, int all, double *farthest)
{
    struct gbg_events *work = call->work;
    int stale = 0;
    *farthest = 0.0;
#pragma omp parallel for num_threads(call->device->threads) schedule(static, 1)
    for (int c = 0; c < work->n_parts; c++) {
        struct gbg_events_part *part = &work->part[c];
        int64_t n = all ? work->n : work->changes.used;
        part->farthest = 0.0;
        part->stale = 0;
        for (int64_t k = n * c / work->n_parts; k < n * (c + 1) / work->n_parts; k++) {
            if (all) {
                look_at_path(call, part, k);
            } else if (work->changed[k].cluster >= 0) {
                const struct gbg_changed *changed = &work->changed[k];
                look_at_path(call, part,
                             work->part[changed->part].member[changed->member].particle);
            }
        }
    }
    for (int c = 0; c < work->n_parts; c++) {
        stale |= work->part[c].stale;
        *farthest = fmax(*farthest, work->part[c].farthest);
    }
    return stale;
}

/* The collisions of the step, with one list. *narrow: the list did not hold all pairs that could
 * meet; *farthest: of anybody from the start of the step. */
static int attempt(struct gbg_events_call *call, int *narrow, double *farthest)
{
    struct gbg_events *work = call->work;
    double moved = 0.0, started = 0.0;
    forget_changes(work);
    find_moves(call);
    for (int c = 0; c < work->n_parts; c++) {
        moved = fmax(moved, sqrt((double)work->part[c].moved));
        started = fmax(started, sqrt((double)work->part[c].started));
    }
    *farthest = moved;
    moved = moved * (1.0 + 1e-6) + call->largest * 1e-6;
    *narrow = !(started <= call->slack);
    if (*narrow) {
        return GBG_OK;
    }
    call->range = range_of_locals(call);
    call->moved = call->largest + 2.0 * moved < call->range ? moved : INFINITY;
    int status = find_first_events(call);
    status = status ? status : gbg_events_passes(call);
    if (status == GBG_OK) {
        *narrow = left_range(call, call->list == work->wide && moved > call->slack, farthest);
    }
    return status;
}

/* Whether a list of this radius would hold too many pairs. */
static int too_wide(const struct gbg_state *state, double radius)
{
    double volume = 1.0, ball = state->box.dimension == 2 ? 3.2 : 4.2 * radius,
           n = (double)state->owned;
    for (int a = 0; a < state->box.dimension; a++) {
        volume *= state->box.length[a];
    }
    return n * fmin(n, 1.5 * n * ball * radius * radius / volume + GBG_SLICE) > most_entries;
}

/* A list around the coordinates before the step for paths of up to `excursion` from there. */
static int widen(struct gbg_events_call *call, double excursion, int *refused)
{
    struct gbg_events *work = call->work;
    struct gbg_state start = *call->state;
    double radius = call->largest + 2.0 * excursion, diagonal = 0.0;
    for (int a = 0; a < start.box.dimension; a++) {
        diagonal += 0.2501 * start.box.length[a] * start.box.length[a];
    }
    radius = fmin(radius, sqrt(diagonal)); /* that far, all pairs are in it */
    *refused = too_wide(&start, radius);
    if (*refused) {
        return GBG_OK;
    }
    if (work->wide && work->wide->reach < radius) {
        gbg_list_destroy(call->device, work->wide);
        work->wide = NULL;
    }
    int status = work->wide
                     ? GBG_OK
                     : gbg_list_create(call->device, call->state, radius, radius, &work->wide);
    if (status != GBG_OK) {
        return status;
    }
    for (int a = 0; a < start.box.dimension; a++) {
        start.high[a] = start.start_high[a];
        start.low[a] = start.start_low[a];
    }
    struct gbg_list *wide = work->wide;
    wide->radius = radius; /* it may have been made for more */
    status = gbg_list_build(call->device, &start, wide);
    for (int a = 0; a < start.box.dimension; a++) {
        for (int64_t i = 0; i < wide->n; i++) {
            wide->local[a][i] =
                gbg_local(call->state->high[a][i], call->state->low[a][i], wide->shift[a]);
        }
    }
    call->list = wide;
    call->slack = radius >= sqrt(diagonal) ? INFINITY : 0.5 * (radius - call->largest) * 0.999;
    return status;
}

/* The same with wider and wider lists; `moved` is the longest free move. */
static int attempt_wide(struct gbg_events_call *call, double moved, int *refused)
{
    struct gbg_events *work = call->work;
    double excursion = fmax(excursion_room * work->excursion, least_excursion * call->largest);
    int status = GBG_OK, narrow = 1;
    excursion = fmin(excursion, excursion_room * moved);
    *refused = 0;
    work->wide_steps++;
    while (status == GBG_OK && narrow && !*refused) {
        double farthest;
        status = widen(call, excursion, refused);
        if (status == GBG_OK && !*refused) {
            status = attempt(call, &narrow, &farthest);
            work->excursion = farthest;
            excursion = fmax(1.5 * excursion, fmin(excursion_room * farthest, 3.0 * excursion));
        }
    }
    return status;
}

/* The new end of one particle's path; returns the square of its distance from the start. */
static double write_back(const struct gbg_events_call *call, struct gbg_list *list,
                         const struct gbg_changed *changed)
{
    struct gbg_state *state = call->state;
    const struct gbg_events_part *part = &call->work->part[changed->part];
    const struct gbg_member *member = &part->member[changed->member];
    const struct gbg_leg *leg = &part->leg[member->last];
    int64_t i = member->particle;
    double squared = 0.0;
    for (int a = 0; a < state->box.dimension; a++) {
        double d = member->off[a] + leg->velocity[a] * (1.0 - leg->time);
        squared += d * d;
        state->high[a][i] = (uint32_t)(member->target[a] >> 32);
        state->low[a][i] = (uint32_t)member->target[a];
        list->local[a][i] = gbg_local(state->high[a][i], state->low[a][i], list->shift[a]);
        if (state->image[a]) {
            state->image[a][i] += member->image[a];
        }
    }
    if (state->overlapped) {
        state->overlapped[i] = 1;
    }
    return squared;
}

static void finish(const struct gbg_events_call *call, struct gbg_list *list,
                   struct gbg_contacts *contacts)
{
    const struct gbg_events *work = call->work;
    double largest = 0.0;
    int64_t virial = 0;
#pragma omp parallel for num_threads(call->device->threads) schedule(static) reduction(max         \
                                                                                       : largest)
    for (int64_t k = 0; k < work->changes.used; k++) {
        if (work->changed[k].cluster >= 0) {
            double squared = write_back(call, list, &work->changed[k]);
            largest = squared > largest ? squared : largest;
        }
    }
    for (int64_t c = 0; c < work->clusters.used; c++) {
        const struct gbg_cluster *cluster = &work->cluster[c];
        if (cluster->parent == c) {
            contacts->pairs += cluster->events;
            contacts->stopped += cluster->stopped;
            contacts->rounds =
                cluster->depth > contacts->rounds ? cluster->depth : contacts->rounds;
            virial += cluster->virial;
        }
    }
    contacts->largest = sqrt(largest);
    contacts->virial = (double)virial * call->virial_unit;
}

static double largest_contact(const struct gbg_state *state)
{
    double largest = 0.0;
    for (int s = 0; s < state->n_species; s++) {
        largest = fmax(largest, state->diameter[s]);
    }
    return largest;
}

int gbg_events_make(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                    struct gbg_contacts *contacts, int together)
{
    contacts->rounds = contacts->pairs = contacts->left = contacts->stopped = 0;
    contacts->largest = contacts->virial = 0.0;
    int status = reserve(device, list), refused = 0;
    if (status != GBG_OK || list->n == 0) {
        return status;
    }
    struct gbg_events_call call = {.device = device,
                                   .state = state,
                                   .list = list,
                                   .work = list->events,
                                   .largest = largest_contact(state),
                                   .slack = 0.5 * (list->radius - list->reach) * 0.999,
                                   .together = together};
    double farthest;
    int narrow;
    call.virial_unit = 0x1p-40 * call.largest * call.largest;
    for (int a = 0; a < state->box.dimension; a++) {
        call.per_quantum[a] = 1.0 / state->box.quantum[a];
    }
    status = attempt(&call, &narrow, &farthest);
    if (status == GBG_OK && narrow) {
        status = attempt_wide(&call, farthest, &refused);
    }
    if (status != GBG_OK) {
        return status;
    }
    if (refused) {
        forget_changes(call.work);
        contacts->stopped = state->owned;
        return GBG_OK;
    }
    finish(&call, list, contacts);
    /* rounds that follow need a list that is complete where everybody is now */
    return call.list == list ? GBG_OK : gbg_list_build(device, state, list);
}

int gbg_events(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
               struct gbg_contacts *contacts)
{
    return gbg_events_make(device, state, list, contacts, 0);
}
