/* L1, CUDA: the collisions of one cluster of particles, in the order of time and particles: a warp
 * a cluster. All threads of the warp keep the same account of the queue and see the same event;
 * they share out the queue when the next event is looked for, and the neighbours when what follows
 * is foreseen. */
#include "cuda/events.h"

enum {
    WARPS = GBG_CUDA_THREADS / 32,
    SHORT = 96, /* events in a queue in shared memory */
    LONG = GBG_CUDA_EVENTS_SLAB,
    MOST = 20000, /* events of a cluster that is worth a warp */
    NOBODY = -1
};
static const unsigned ALL = 0xFFFFFFFFu;

/* The cluster that a warp works on; the same in all of its threads. */
struct cluster {
    int32_t name;
    int pass, lane;
    bool stopped; /* it cannot be worked on to its end */
    struct gbg_cuda_queued *queue;
    int32_t used, capacity;
};

/* Ties go by the ranks of the particles, the lower one first: an order in memory must not show. */
static __device__ bool lower_ranks(const struct gbg_state *state, const struct gbg_cuda_queued &p,
                                   const struct gbg_cuda_queued &q)
{
    int32_t own[2] = {gbg_rank_of(state, p.first), gbg_rank_of(state, p.second)};
    int32_t its[2] = {gbg_rank_of(state, q.first), gbg_rank_of(state, q.second)};
    int32_t own_low = min(own[0], own[1]), its_low = min(its[0], its[1]);
    return own_low != its_low ? own_low < its_low : max(own[0], own[1]) < max(its[0], its[1]);
}

static __device__ __forceinline__ bool before(const struct gbg_state *state,
                                              const struct gbg_cuda_queued &p,
                                              const struct gbg_cuda_queued &q)
{
    return p.time != q.time ? p.time < q.time : lower_ranks(state, p, q);
}

static __device__ __forceinline__ bool is_mine(const struct gbg_cuda_events_arrays &arrays,
                                               const struct cluster &cluster, int32_t particle)
{
    return gbg_cuda_events_seen(arrays.claim + particle) == cluster.name + 1;
}

static __device__ __forceinline__ uint32_t events_of(const struct gbg_cuda_events_arrays &arrays,
                                                     const struct cluster &cluster,
                                                     int32_t particle)
{
    return is_mine(arrays, cluster, particle)
               ? (uint32_t)arrays.member[arrays.member_of[particle]].events
               : 0;
}

/* Whether both particles are still on the paths for which this was foreseen. */
static __device__ bool is_valid(const struct gbg_cuda_events_arrays &arrays,
                                const struct cluster &cluster, const struct gbg_cuda_queued &event)
{
    return (events_of(arrays, cluster, event.first) | events_of(arrays, cluster, event.second)
                                                          << 16) == event.events;
}

/* Gives up: the host is to work on this step, or the arrays must grow. */
static __device__ void give_up(const struct gbg_cuda_events_call &call, struct cluster *cluster,
                               unsigned why)
{
    if (cluster->lane == 0) {
        atomicOr(&call.arrays.report->failed, why);
    }
    cluster->stopped = true;
}

/* Drops outdated events. */
static __device__ void tidy(const struct gbg_cuda_events_call &call, struct cluster *cluster)
{
    int32_t kept = 0;
    for (int32_t base = 0; base < cluster->used; base += 32) {
        int32_t k = base + cluster->lane;
        struct gbg_cuda_queued event = {};
        bool keep = false;
        if (k < cluster->used) {
            event = cluster->queue[k];
            keep = is_valid(call.arrays, *cluster, event);
        }
        unsigned keeping = __ballot_sync(ALL, keep);
        __syncwarp(); /* everybody has read his before any writes */
        if (keep) {
            cluster->queue[kept + __popc(keeping & ((1u << cluster->lane) - 1))] = event;
        }
        kept += __popc(keeping);
        __syncwarp();
    }
    cluster->used = kept;
}

/* Room for `more` events, at most 32: without outdated ones, or in a slab. */
static __device__ void make_room(const struct gbg_cuda_events_call &call, struct cluster *cluster,
                                 int more)
{
    if (cluster->used + more <= cluster->capacity) {
        return;
    }
    tidy(call, cluster);
    if (cluster->capacity == SHORT && cluster->used > SHORT / 2) {
        int32_t slab = 0;
        if (cluster->lane == 0) {
            slab = atomicAdd(&call.arrays.report->slabs[cluster->pass], 1);
        }
        slab = __shfl_sync(ALL, slab, 0);
        if (slab >= call.arrays.slabs) {
            give_up(call, cluster, GBG_CUDA_LARGE);
            return;
        }
        struct gbg_cuda_queued *larger = call.arrays.slab + (int64_t)slab * LONG;
        for (int32_t k = cluster->lane; k < cluster->used; k += 32) {
            larger[k] = cluster->queue[k];
        }
        cluster->queue = larger;
        cluster->capacity = LONG;
        __syncwarp();
    }
    if (cluster->used + more > cluster->capacity) {
        give_up(call, cluster, GBG_CUDA_LARGE);
    }
}

/* Queues the events of those threads that have one. */
static __device__ void push(const struct gbg_cuda_events_call &call, struct cluster *cluster,
                            bool has, const struct gbg_cuda_queued &event)
{
    unsigned having = __ballot_sync(ALL, has);
    if (having == 0 || cluster->stopped) {
        return;
    }
    make_room(call, cluster, __popc(having));
    if (cluster->stopped) {
        return;
    }
    if (has) {
        cluster->queue[cluster->used + __popc(having & ((1u << cluster->lane) - 1))] = event;
    }
    cluster->used += __popc(having);
    __syncwarp();
}

/* Takes the next event out of a queue that has one. */
static __device__ struct gbg_cuda_queued pop(const struct gbg_state *state, struct cluster *cluster)
{
    int32_t best = NOBODY;
    unsigned long long bits = ~0ull; /* of a time >= 0: in the order of the times */
    for (int32_t k = cluster->lane; k < cluster->used; k += 32) {
        if (best < 0 || before(state, cluster->queue[k], cluster->queue[best])) {
            best = k;
            bits = (unsigned long long)__double_as_longlong(cluster->queue[k].time);
        }
    }
    unsigned high = (unsigned)(bits >> 32);
    unsigned least = __reduce_min_sync(ALL, high);
    unsigned low = high == least ? (unsigned)bits : ~0u;
    unsigned least_low = __reduce_min_sync(ALL, low);
    unsigned first = __ballot_sync(ALL, best >= 0 && high == least && (unsigned)bits == least_low);
    int32_t winner = __shfl_sync(ALL, best, __ffs((int)first) - 1);
    for (unsigned rest = first & (first - 1); rest; rest &= rest - 1) {
        int32_t other = __shfl_sync(ALL, best, __ffs((int)rest) - 1);
        winner = before(state, cluster->queue[other], cluster->queue[winner]) ? other : winner;
    }
    struct gbg_cuda_queued event = cluster->queue[winner];
    struct gbg_cuda_queued last = cluster->queue[--cluster->used];
    __syncwarp();
    if (cluster->lane == 0) {
        cluster->queue[winner] = last;
    }
    __syncwarp();
    return event;
}

/* The leg that a particle is on. */
static __device__ __forceinline__ void leg_of(const struct gbg_cuda_events_call &call,
                                              const struct cluster &cluster, int32_t particle,
                                              struct gbg_leg *leg)
{
    if (is_mine(call.arrays, cluster, particle)) {
        *leg = call.arrays.leg[call.arrays.member[call.arrays.member_of[particle]].last];
    } else {
        gbg_events_free(&call.state, particle, leg);
    }
}

/* The place of a leg in the coordinates of the list, and the squared distance beyond which nobody
 * on his free path can be met on it. */
struct vicinity {
    uint32_t place[3];
    float limit;
};

static __device__ void look_around(const struct gbg_cuda_events_call &call,
                                   const struct gbg_leg *leg, struct vicinity *vicinity)
{
    double speed = 0.0;
    for (int a = 0; a < call.state.box.dimension; a++) {
        speed += leg->velocity[a] * leg->velocity[a];
        vicinity->place[a] = gbg_cuda_local((uint32_t)(leg->place[a] >> 32),
                                            (uint32_t)leg->place[a], call.rows.shift[a]);
    }
    double reach =
        call.largest + fmax(sqrt(speed), gbg_cuda_events_moved(call)) * (1.0 - leg->time);
    vicinity->limit = reach < call.range ? (float)(reach * reach * (1.0 + 1e-4)) : INFINITY;
}

/* Whether a particle on its free path, which ends at its local coordinates, stays out of reach. */
static __device__ __forceinline__ bool is_far(const struct gbg_cuda_rows &rows,
                                              const struct vicinity &vicinity, int32_t j)
{
    float squared = 0.0f;
    for (int a = 0; a < rows.dimension; a++) {
        float d = (float)(int32_t)(vicinity.place[a] - rows.local[a][j]) * rows.scale[a];
        squared += d * d;
    }
    return squared > vicinity.limit;
}

/* What happens to a particle after it got a new leg, but not with `other` (NOBODY: with all). */
static __device__ void foresee(const struct gbg_cuda_events_call &call, struct cluster *cluster,
                               int32_t i, int32_t other)
{
    const int32_t *row =
        call.rows.index + call.rows.offset[i / GBG_CUDA_SLICE] + i % GBG_CUDA_SLICE;
    int32_t width = call.rows.width[i / GBG_CUDA_SLICE];
    struct gbg_leg own;
    struct vicinity vicinity;
    leg_of(call, *cluster, i, &own);
    look_around(call, &own, &vicinity);
    for (int32_t base = 0; base < width && !cluster->stopped; base += 32) {
        int32_t k = base + cluster->lane;
        int32_t j = k < width ? row[(int64_t)k * GBG_CUDA_SLICE] : i;
        struct gbg_cuda_queued event = {};
        bool has = false;
        if (j != i && j != other &&
            (is_mine(call.arrays, *cluster, j) || !is_far(call.rows, vicinity, j))) {
            struct gbg_leg its;
            leg_of(call, *cluster, j, &its);
            const struct gbg_leg *first = i < j ? &own : &its, *second = i < j ? &its : &own;
            event.first = min(i, j);
            event.second = max(i, j);
            event.time = gbg_events_time(&call.state, call.per_quantum, event.first, event.second,
                                         first, second);
            event.events = (uint32_t)first->events | (uint32_t)second->events << 16;
            has = event.time < 1.0;
        }
        push(call, cluster, has, event);
    }
}

/* Thread 0: makes the particle a member when it has its first event. False: another cluster has
 * changed it, or there is no room. */
static __device__ bool join(const struct gbg_cuda_events_call &call, const struct cluster &cluster,
                            int32_t particle)
{
    const struct gbg_cuda_events_arrays &arrays = call.arrays;
    const struct gbg_state *state = &call.state;
    if (is_mine(arrays, cluster, particle)) {
        return true;
    }
    int32_t m = atomicAdd(&arrays.report->members, 1), l = atomicAdd(&arrays.report->legs, 1);
    if (m >= arrays.members || l >= arrays.legs) {
        atomicOr(&arrays.report->failed, GBG_CUDA_FULL);
        return false;
    }
    struct gbg_cuda_member made = {};
    made.particle = particle;
    made.first = made.last = l;
    for (int a = 0; a < state->box.dimension; a++) {
        made.free[a] = made.target[a] = gbg_join(state->high[a][particle], state->low[a][particle]);
    }
    int32_t claim = atomicCAS(arrays.claim + particle, 0, cluster.name + 1);
    made.cluster = claim == 0 ? cluster.name : NOBODY;
    arrays.member[m] = made;
    if (claim != 0) {
        gbg_cuda_events_conflict(arrays, cluster.pass, cluster.name, claim - 1);
        return false;
    }
    struct gbg_leg leg = {};
    gbg_events_free(state, particle, &leg);
    arrays.leg[l] = leg;
    arrays.member_of[particle] = m;
    return true;
}

/* What two particles exchange in a collision. */
struct exchange {
    double time, velocity[3];
    int64_t pushed[3];
    int32_t boxes[3];
};

/* A new leg from `place` on; sign 1 adds the exchanged velocity, -1 takes it away. */
static __device__ void turn(const struct gbg_cuda_events_call &call, struct gbg_cuda_member *member,
                            const struct gbg_leg *old, int32_t l, const uint64_t place[3],
                            const struct exchange *exchange, int sign)
{
    struct gbg_leg leg = {};
    leg.time = exchange->time;
    leg.events = ++member->events;
    leg.next = -1;
    for (int a = 0; a < call.state.box.dimension; a++) {
        uint64_t before_push = member->target[a];
        int64_t push_a = sign * exchange->pushed[a];
        leg.place[a] = place[a];
        leg.velocity[a] = old->velocity[a] + sign * exchange->velocity[a];
        member->off[a] += old->velocity[a] * (exchange->time - old->time);
        member->target[a] += (uint64_t)push_a;
        member->image[a] += sign * exchange->boxes[a] +
                            (push_a > 0 && member->target[a] < before_push) -
                            (push_a < 0 && member->target[a] > before_push);
    }
    call.arrays.leg[l] = leg;
    call.arrays.leg[member->last].next = l;
    member->last = l;
}

/* Thread 0: both members on their new legs. False: see join. */
static __device__ bool turn_both(const struct gbg_cuda_events_call &call,
                                 const struct cluster &cluster, const struct gbg_cuda_queued &event,
                                 const struct gbg_leg leg[2], const uint64_t place[2][3],
                                 const struct exchange *exchange, int64_t virial)
{
    const struct gbg_cuda_events_arrays &arrays = call.arrays;
    if (!join(call, cluster, event.first) || !join(call, cluster, event.second)) {
        return false;
    }
    int32_t l = atomicAdd(&arrays.report->legs, 2);
    if (l + 2 > arrays.legs) {
        atomicOr(&arrays.report->failed, GBG_CUDA_FULL);
        return false;
    }
    struct gbg_cuda_member *first = &arrays.member[arrays.member_of[event.first]];
    struct gbg_cuda_member *second = &arrays.member[arrays.member_of[event.second]];
    first->depth = second->depth = 1 + max(first->depth, second->depth);
    first->virial += virial;
    turn(call, first, &leg[0], l, place[0], exchange, 1);
    turn(call, second, &leg[1], l + 1, place[1], exchange, -1);
    return true;
}

/* Elastic collision of equal masses: the normal parts of the velocities are exchanged. */
static __device__ void collide(const struct gbg_cuda_events_call &call, struct cluster *cluster,
                               const struct gbg_cuda_queued &event)
{
    const struct gbg_box *box = &call.state.box;
    struct gbg_leg leg[2];
    leg_of(call, *cluster, event.first, &leg[0]);
    leg_of(call, *cluster, event.second, &leg[1]);
    uint64_t place[2][3];
    struct exchange exchange = {};
    double d[3], distance = 0.0, closing = 0.0;
    for (int a = 0; a < box->dimension; a++) {
        place[0][a] = gbg_events_place(call.per_quantum, &leg[0], a, event.time);
        place[1][a] = gbg_events_place(call.per_quantum, &leg[1], a, event.time);
        d[a] = gbg_box_difference(box, a, place[0][a], place[1][a]);
        distance += d[a] * d[a];
        closing += d[a] * (leg[0].velocity[a] - leg[1].velocity[a]);
    }
    if (closing >= 0.0) { /* grazing: no approach is left after rounding */
        return;
    }
    double rest = 1.0 - event.time, speed = -closing / sqrt(distance);
    exchange.time = event.time;
    for (int a = 0; a < box->dimension; a++) {
        exchange.velocity[a] = d[a] * (-closing / distance);
        exchange.pushed[a] = gbg_events_quanta(exchange.velocity[a] * rest * call.per_quantum[a],
                                               &exchange.boxes[a]);
    }
    double contact = gbg_events_contact(&call.state, event.first, event.second);
    int64_t virial = (int64_t)llrint(contact * speed * rest / call.virial_unit);
    bool turned = false;
    __syncwarp(); /* everybody has read the legs */
    if (cluster->lane == 0) {
        turned = turn_both(call, *cluster, event, leg, place, &exchange, virial);
    }
    __syncwarp();
    if (!__shfl_sync(ALL, turned, 0)) {
        cluster->stopped = true;
        return;
    }
    foresee(call, cluster, event.first, NOBODY); /* another image of the second may be met */
    foresee(call, cluster, event.second, event.first);
}

/* The events of the cluster's free paths. */
static __device__ void fill(const struct gbg_cuda_events_call &call, struct cluster *cluster)
{
    int32_t e = call.arrays.head[cluster->name];
    for (int32_t count = 0; e >= 0 && !cluster->stopped; count++) {
        const struct gbg_cuda_first *event = &call.arrays.event[e];
        struct gbg_cuda_queued queued = {event->time, event->first, event->second, 0};
        push(call, cluster, cluster->lane == 0, queued);
        e = call.arrays.next[e];
    }
}

static __global__ void __launch_bounds__(GBG_CUDA_THREADS)
    work(const __grid_constant__ struct gbg_cuda_events_call call, int pass)
{
    __shared__ struct gbg_cuda_queued queue[WARPS][SHORT];
    struct gbg_cuda_events_report *report = call.arrays.report;
    int32_t todo = report->todo[pass], lane = threadIdx.x & 31;
    int32_t warps = (int32_t)(gridDim.x * WARPS);
    int32_t k = (int32_t)(gbg_cuda_index() / 32);
    while (k < todo) {
        unsigned failed = lane == 0 ? *(volatile unsigned *)&report->failed : 0;
        if (__shfl_sync(ALL, failed, 0)) {
            return;
        }
        struct cluster cluster = {call.arrays.todo[k],     pass, lane, false,
                                  queue[threadIdx.x / 32], 0,    SHORT};
        fill(call, &cluster);
        for (int events = 0; cluster.used > 0 && !cluster.stopped; events++) {
            struct gbg_cuda_queued event = pop(&call.state, &cluster);
            if (is_valid(call.arrays, cluster, event)) {
                collide(call, &cluster, event);
            }
            if (events > MOST) {
                give_up(call, &cluster, GBG_CUDA_LARGE);
            }
        }
        if (lane == 0) { /* the next one that nobody has */
            k = warps + atomicAdd(&report->next[pass], 1);
        }
        k = __shfl_sync(ALL, k, 0);
        __syncwarp();
    }
}

int gbg_cuda_events_work(struct gbg_device *device, const struct gbg_cuda_events_call *call,
                         int pass)
{
    unsigned blocks = gbg_cuda_events_blocks(device, 8 * call->state.owned);
    work<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*call, pass);
    return gbg_cuda_started(device, "events: work");
}
