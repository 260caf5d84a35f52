/* L1, CPU: the collisions of one cluster of particles, in the order of time and particles. */
#include <math.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/events.h"
#include "backend/cpu/events_pair.h"

double gbg_events_meet(const struct gbg_events_call *call, int64_t i, int64_t j,
                       const struct gbg_leg *first, const struct gbg_leg *second)
{
    return gbg_events_time(call->state, call->per_quantum, i, j, first, second);
}

/* The queue: a binary heap, outdated events stay in it and are dropped when they come up. */

/* Events at the same time go by the ranks of their particles, the lower one first: an order in
 * memory must not show. */
static int lower_ranks(const struct gbg_state *state, const struct gbg_event *p,
                       const struct gbg_event *q)
{
    int32_t own[2] = {gbg_rank_of(state, p->first), gbg_rank_of(state, p->second)};
    int32_t its[2] = {gbg_rank_of(state, q->first), gbg_rank_of(state, q->second)};
    int own_low = own[1] < own[0], its_low = its[1] < its[0];
    return own[own_low] != its[its_low] ? own[own_low] < its[its_low]
                                        : own[!own_low] < its[!its_low];
}

static inline int before(const struct gbg_state *state, const struct gbg_event *p,
                         const struct gbg_event *q)
{
    return p->time != q->time ? p->time < q->time : lower_ranks(state, p, q);
}

static int push(const struct gbg_events_call *call, struct gbg_events_part *part,
                struct gbg_event event)
{
    int status = gbg_events_grow(call->device, &part->heap, &part->heaped, 1, sizeof *part->heap);
    if (status != GBG_OK) {
        return status;
    }
    int64_t k = part->heaped.used++;
    for (; k > 0 && before(call->state, &event, &part->heap[(k - 1) / 2]); k = (k - 1) / 2) {
        part->heap[k] = part->heap[(k - 1) / 2];
    }
    part->heap[k] = event;
    return GBG_OK;
}

static struct gbg_event pop(const struct gbg_state *state, struct gbg_events_part *part)
{
    struct gbg_event top = part->heap[0], moved = part->heap[--part->heaped.used];
    int64_t n = part->heaped.used, k = 0;
    for (int64_t child = 1; child < n; child = 2 * k + 1) {
        child += child + 1 < n && before(state, &part->heap[child + 1], &part->heap[child]);
        if (!before(state, &part->heap[child], &moved)) {
            break;
        }
        part->heap[k] = part->heap[child];
        k = child;
    }
    part->heap[k] = moved;
    return top;
}

static inline int32_t events_of(const struct gbg_events_part *part, int32_t particle)
{
    int32_t m = part->member_of[particle];
    return m < 0 ? 0 : part->member[m].events;
}

/* The leg that a particle is on; `room` holds that of one which has had no event. */
static inline const struct gbg_leg *leg_of(const struct gbg_events_call *call,
                                           const struct gbg_events_part *part, int32_t particle,
                                           struct gbg_leg *room)
{
    int32_t m = part->member_of[particle];
    if (m >= 0) {
        return &part->leg[part->member[m].last];
    }
    gbg_events_free(call->state, particle, room);
    return room;
}

/* The place of a leg in the coordinates of the list, and the squared distance beyond which nobody
 * on his free path can be met on it. */
struct vicinity {
    uint32_t place[3];
    float limit;
};

static void look_around(const struct gbg_events_call *call, const struct gbg_leg *leg,
                        struct vicinity *vicinity)
{
    double speed = 0.0;
    for (int a = 0; a < call->state->box.dimension; a++) {
        speed += leg->velocity[a] * leg->velocity[a];
        vicinity->place[a] = gbg_local((uint32_t)(leg->place[a] >> 32), (uint32_t)leg->place[a],
                                       call->list->shift[a]);
    }
    double reach = call->largest + fmax(sqrt(speed), call->moved) * (1.0 - leg->time);
    vicinity->limit = reach < call->range ? (float)(reach * reach * (1.0 + 1e-4)) : INFINITY;
}

/* Whether a particle on its free path, which ends at its local coordinates, stays out of reach. */
static inline int is_far(const struct gbg_list *list, const struct vicinity *vicinity, int32_t j)
{
    float squared = 0.0f;
    for (int a = 0; a < list->dimension; a++) {
        float d = (float)(int32_t)(vicinity->place[a] - list->local[a][j]) * list->scale[a];
        squared += d * d;
    }
    return squared > vicinity->limit;
}

/* What happens to a particle after it got a new leg, but not with `other` (-1: with everybody). */
static int foresee(const struct gbg_events_call *call, struct gbg_events_part *part, int32_t i,
                   int32_t other)
{
    int32_t width;
    const int32_t *row = gbg_events_row(call->list, i, &width);
    const struct gbg_leg *own = &part->leg[part->member[part->member_of[i]].last];
    struct vicinity vicinity;
    look_around(call, own, &vicinity);
    for (int32_t k = 0; k < width; k++) {
        int32_t j = row[(int64_t)k * GBG_SLICE];
        if (j == i || j == other || (part->member_of[j] < 0 && is_far(call->list, &vicinity, j))) {
            continue;
        }
        struct gbg_leg room;
        const struct gbg_leg *its = leg_of(call, part, j, &room);
        double time =
            i < j ? gbg_events_meet(call, i, j, own, its) : gbg_events_meet(call, j, i, its, own);
        if (time < 1.0) {
            struct gbg_event event = i < j
                                         ? (struct gbg_event){time, i, j, own->events, its->events}
                                         : (struct gbg_event){time, j, i, its->events, own->events};
            int status = push(call, part, event);
            if (status != GBG_OK) {
                return status;
            }
        }
    }
    return GBG_OK;
}

/* The member for a particle, made when it has its first event. */
static int32_t join(const struct gbg_events_call *call, struct gbg_events_part *part,
                    int32_t particle)
{
    if (part->member_of[particle] >= 0) {
        return part->member_of[particle];
    }
    const struct gbg_state *state = call->state;
    struct gbg_leg *leg = &part->leg[part->legs.used];
    struct gbg_member *member = &part->member[part->members.used];
    *member = (struct gbg_member){.particle = particle};
    member->first = member->last = (int32_t)part->legs.used++;
    gbg_events_free(state, particle, leg);
    for (int a = 0; a < state->box.dimension; a++) {
        member->target[a] = gbg_join(state->high[a][particle], state->low[a][particle]);
    }
    return part->member_of[particle] = (int32_t)part->members.used++;
}

/* A new leg from `place` on; sign 1 adds the exchanged velocity, -1 takes it away. */
static void turn(const struct gbg_events_call *call, struct gbg_events_part *part,
                 struct gbg_member *member, double time, const uint64_t place[3],
                 const double exchanged[3], const int64_t pushed[3], const int32_t boxes[3],
                 int sign)
{
    const struct gbg_leg *old = &part->leg[member->last];
    struct gbg_leg *leg = &part->leg[part->legs.used];
    *leg = (struct gbg_leg){.time = time, .events = ++member->events, .next = -1};
    for (int a = 0; a < call->state->box.dimension; a++) {
        uint64_t before_push = member->target[a];
        int64_t push_a = sign * pushed[a];
        leg->place[a] = place[a];
        leg->velocity[a] = old->velocity[a] + sign * exchanged[a];
        member->off[a] += old->velocity[a] * (time - old->time);
        member->target[a] += (uint64_t)push_a;
        member->image[a] += sign * boxes[a] + (push_a > 0 && member->target[a] < before_push) -
                            (push_a < 0 && member->target[a] > before_push);
    }
    part->leg[member->last].next = (int32_t)part->legs.used;
    member->last = (int32_t)part->legs.used++;
}

/* Elastic collision of equal masses: the normal parts of the velocities are exchanged. */
static int collide(const struct gbg_events_call *call, struct gbg_events_part *part,
                   const struct gbg_event *event, struct gbg_cluster *cluster)
{
    const struct gbg_box *box = &call->state->box;
    int status = gbg_events_grow(call->device, &part->leg, &part->legs, 4, sizeof *part->leg);
    status = status ? status
                    : gbg_events_grow(call->device, &part->member, &part->members, 2,
                                      sizeof *part->member);
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_leg room[2];
    const struct gbg_leg *leg[2] = {leg_of(call, part, event->first, &room[0]),
                                    leg_of(call, part, event->second, &room[1])};
    uint64_t place[2][3];
    double d[3], exchanged[3], distance = 0.0, closing = 0.0;
    for (int a = 0; a < box->dimension; a++) {
        place[0][a] = gbg_events_place(call->per_quantum, leg[0], a, event->time);
        place[1][a] = gbg_events_place(call->per_quantum, leg[1], a, event->time);
        d[a] = gbg_box_difference(box, a, place[0][a], place[1][a]);
        distance += d[a] * d[a];
        closing += d[a] * (leg[0]->velocity[a] - leg[1]->velocity[a]);
    }
    if (closing >= 0.0) { /* grazing: no approach is left after rounding */
        return GBG_OK;
    }
    double rest = 1.0 - event->time, speed = -closing / sqrt(distance);
    int64_t pushed[3] = {0, 0, 0};
    int32_t boxes[3] = {0, 0, 0};
    for (int a = 0; a < box->dimension; a++) {
        exchanged[a] = d[a] * (-closing / distance);
        pushed[a] = gbg_events_quanta(exchanged[a] * rest * call->per_quantum[a], &boxes[a]);
    }
    struct gbg_member *first = &part->member[join(call, part, event->first)];
    struct gbg_member *second = &part->member[join(call, part, event->second)];
    int32_t depth = 1 + (first->depth > second->depth ? first->depth : second->depth);
    first->depth = second->depth = depth;
    turn(call, part, first, event->time, place[0], exchanged, pushed, boxes, 1);
    turn(call, part, second, event->time, place[1], exchanged, pushed, boxes, -1);
    double contact = gbg_events_contact(call->state, event->first, event->second);
    cluster->virial += (int64_t)llrint(contact * speed * rest / call->virial_unit);
    cluster->events++;
    cluster->depth = depth > cluster->depth ? depth : cluster->depth;
    cluster->stopped += first->events == GBG_EVENTS_MOST;
    cluster->stopped += second->events == GBG_EVENTS_MOST;
    status = foresee(call, part, event->first, -1); /* another image of the second may be met */
    return status ? status : foresee(call, part, event->second, event->first);
}

int gbg_events_work(const struct gbg_events_call *call, struct gbg_events_part *part, int32_t root)
{
    struct gbg_events *work = call->work;
    struct gbg_cluster *cluster = &work->cluster[root];
    int status = GBG_OK;
    part->heaped.used = 0;
    cluster->part = (int32_t)(part - work->part);
    cluster->pass = work->pass;
    cluster->first_member = part->members.used;
    cluster->events = cluster->depth = cluster->stopped = cluster->virial = 0;
    for (int32_t c = root; status == GBG_OK && c >= 0; c = work->cluster[c].next) {
        for (int64_t e = work->cluster[c].begin; status == GBG_OK && e < work->cluster[c].end;
             e++) {
            status = push(call, part, work->event[e]);
        }
    }
    while (status == GBG_OK && part->heaped.used > 0) {
        struct gbg_event event = pop(call->state, part);
        if (events_of(part, event.first) == event.first_events &&
            events_of(part, event.second) == event.second_events) {
            status = collide(call, part, &event, cluster);
        }
    }
    cluster->members = part->members.used - cluster->first_member;
    for (int64_t m = cluster->first_member; m < part->members.used; m++) {
        part->member_of[part->member[m].particle] = -1;
    }
    return status;
}

/* Whether two paths of several legs meet while both are as they are. */
static int paths_meet(const struct gbg_events_call *call, const struct gbg_events_part *first_part,
                      const struct gbg_member *first, const struct gbg_events_part *second_part,
                      const struct gbg_member *second)
{
    int32_t p = first->first, q = second->first;
    for (;;) {
        const struct gbg_leg *a = &first_part->leg[p], *b = &second_part->leg[q];
        double a_end = a->next >= 0 ? first_part->leg[a->next].time : 1.0;
        double b_end = b->next >= 0 ? second_part->leg[b->next].time : 1.0;
        double end = a_end < b_end ? a_end : b_end;
        if (gbg_events_meet(call, first->particle, second->particle, a, b) <= end) {
            return 1;
        }
        if (a->next < 0 && b->next < 0) {
            return 0;
        }
        if (b->next < 0 || (a->next >= 0 && a_end <= b_end)) {
            p = a->next;
        } else {
            q = b->next;
        }
    }
}

int gbg_events_conflicts(const struct gbg_events_call *call, struct gbg_events_part *part,
                         int32_t root)
{
    struct gbg_events *work = call->work;
    const struct gbg_cluster *cluster = &work->cluster[root];
    const struct gbg_events_part *own = &work->part[cluster->part];
    for (int64_t m = cluster->first_member; m < cluster->first_member + cluster->members; m++) {
        const struct gbg_member *member = &own->member[m];
        int32_t width, i = member->particle;
        const int32_t *row = gbg_events_row(call->list, i, &width);
        for (int32_t k = 0; k < width; k++) {
            int32_t j = row[(int64_t)k * GBG_SLICE];
            uint32_t owner = work->owner[j];
            if (j == i || owner == 0 || work->changed[owner - 1].cluster == root) {
                continue;
            }
            const struct gbg_changed *changed = &work->changed[owner - 1];
            if (j < i && work->cluster[changed->cluster].pass == cluster->pass) {
                continue; /* that one looks at this pair */
            }
            const struct gbg_events_part *its = &work->part[changed->part];
            const struct gbg_member *other = &its->member[changed->member];
            int met = i < j ? paths_meet(call, own, member, its, other)
                            : paths_meet(call, its, other, own, member);
            if (met) {
                int status = gbg_events_grow(call->device, &part->conflict, &part->conflicts, 2,
                                             sizeof *part->conflict);
                if (status != GBG_OK) {
                    return status;
                }
                part->conflict[part->conflicts.used++] = root;
                part->conflict[part->conflicts.used++] = changed->cluster;
            }
        }
    }
    return GBG_OK;
}
