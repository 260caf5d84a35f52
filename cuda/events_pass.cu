/* L1, CUDA: the collisions of a step: who may meet on the free paths, which particles belong to
 * one cluster, which clusters are to be joined, and the results. See backend/cpu/events_pass.c for
 * why the way in which particles are shared out to clusters cannot change where they go. */
#include "cuda/events.h"

/* Room in the screen for the rounding of 32-bit lengths, relative to contact; for that of moves,
 * relative to the longest. */
static __device__ const double length_room = 2e-5, move_room = 0x1p-7;

/* All particles on their own, on their free paths. */
static __global__ void set_anew(const __grid_constant__ struct gbg_cuda_events_call call)
{
    int64_t i = gbg_cuda_index();
    if (i < call.state.owned) {
        call.arrays.parent[i] = (int32_t)i;
        call.arrays.head[i] = -1;
        call.arrays.due[i] = call.arrays.claim[i] = 0;
    }
}

static __device__ void forget(const struct gbg_cuda_events_arrays &arrays, int32_t i)
{
    arrays.parent[i] = i;
    arrays.head[i] = -1;
    arrays.due[i] = 0;
}

/* The same for those that the last step touched. */
static __global__ void forget_step(const __grid_constant__ struct gbg_cuda_events_call call)
{
    const struct gbg_cuda_events_arrays &arrays = call.arrays;
    int64_t stride = (int64_t)gridDim.x * blockDim.x;
    int32_t events = gbg_cuda_events_count(&arrays.report->events, arrays.events);
    int32_t members = gbg_cuda_events_count(&arrays.report->members, arrays.members);
    for (int64_t e = gbg_cuda_index(); e < events; e += stride) {
        forget(arrays, arrays.event[e].first);
        forget(arrays, arrays.event[e].second);
    }
    for (int64_t m = gbg_cuda_index(); m < members; m += stride) {
        arrays.claim[arrays.member[m].particle] = 0;
    }
}

/* The largest of a block's values >= 0 into *largest. All threads of a block must call it. */
static __device__ void largest_of_block(unsigned *largest, float value)
{
    unsigned bits = __reduce_max_sync(0xFFFFFFFFu, __float_as_uint(value));
    if ((threadIdx.x & 31) == 0 && bits > *(volatile unsigned *)largest) {
        atomicMax(largest, bits);
    }
}

/* Free moves of all particles, packed for the screen, and the longest of them. */
template <int D>
static __global__ void find_moves(const __grid_constant__ struct gbg_cuda_events_call call)
{
    int64_t i = gbg_cuda_index();
    float square = 0.0f, from_built = 0.0f;
    if (i < call.state.owned) {
        uint32_t end[3] = {0, 0, 0};
        float w[3] = {0.0f, 0.0f, 0.0f};
        for (int a = 0; a < D; a++) {
            int32_t d = (int32_t)(call.state.high[a][i] - call.state.start_high[a][i]);
            w[a] = (float)d * (float)(call.state.box.length[a] * 0x1p-32);
            end[a] = call.rows.local[a][i];
            float x = (float)(int32_t)(end[a] - call.rows.built[a][i]) * call.rows.scale[a] - w[a];
            square += w[a] * w[a];
            from_built += x * x;
        }
        if (D == 2) {
            call.arrays.path[i] =
                make_uint4(end[0], end[1], __float_as_uint(w[0]), __float_as_uint(w[1]));
        } else {
            call.arrays.path[2 * i] = make_uint4(end[0], end[1], end[2], 0);
            call.arrays.path[2 * i + 1] =
                make_uint4(__float_as_uint(w[0]), __float_as_uint(w[1]), __float_as_uint(w[2]), 0);
        }
    }
    largest_of_block(&call.arrays.report->moved, square);
    largest_of_block(&call.arrays.report->started, from_built);
}

template <int D> struct path {
    uint32_t end[D];
    float move[D];
};

template <int D>
static __device__ __forceinline__ struct path<D> load_path(const uint4 *paths, int64_t i) {
    uint4 word[D - 1];
    for (int k = 0; k < D - 1; k++) {
        word[k] = paths[(D - 1) * i + k];
    }
    if constexpr (D == 2) {
        return {{word[0].x, word[0].y}, {__uint_as_float(word[0].z), __uint_as_float(word[0].w)}};
    } else {
        return {
            {word[0].x, word[0].y, word[0].z},
            {__uint_as_float(word[1].x), __uint_as_float(word[1].y), __uint_as_float(word[1].z)}};
    }
}

/* Whether a pair may come nearer than the limit. With d at the end of the free moves and W the
 * relative move, the square of the distance at the time s before the end is d^2 - 2 s d.W + s^2
 * W^2.
 */
template <int D>
static __device__ __forceinline__ bool may_meet(const struct gbg_cuda_rows &rows,
                                                const struct path<D> &own,
                                                const struct path<D> &its, float limit)
{
    float end = 0.0f, closing = 0.0f, length = 0.0f;
#pragma unroll
    for (int a = 0; a < D; a++) {
        float d = (float)(int32_t)(own.end[a] - its.end[a]) * rows.scale[a];
        float relative = own.move[a] - its.move[a];
        end = __fmaf_rn(d, d, end);
        closing = __fmaf_rn(d, relative, closing);
        length = __fmaf_rn(relative, relative, length);
    }
    float start = (end - (closing + closing)) + length;
    float least = __fmaf_rn(-closing, closing, end * length); /* squared, times W^2 */
    bool within = 0.0f < closing && closing < length;
    return (within && least < limit * length) || end < limit || start < limit;
}

/* Pairs that may meet on their free paths, by the coordinates of the list: a thread a particle. */
template <int D>
static __global__ void screen(const __grid_constant__ struct gbg_cuda_events_call call)
{
    struct gbg_cuda_events_report *report = call.arrays.report;
    int64_t i = gbg_cuda_index(), slice = i / GBG_CUDA_SLICE;
    double moved = gbg_cuda_events_moved(call);
    double started = sqrt((double)__uint_as_float(report->started));
    if (!(started <= call.slack) || !(call.largest + 2.0 * moved < call.range)) {
        if (i == 0) {
            atomicOr(&report->failed, GBG_CUDA_NARROW);
        }
        return;
    }
    if (i >= call.state.owned) {
        return;
    }
    double reach = call.largest * (1.0 + length_room) + move_room * moved + call.longest * 0x1p-30;
    float limit = (float)(reach * reach);
    struct path<D> own = load_path<D>(call.arrays.path, i);
    const int32_t *index = call.rows.index + call.rows.offset[slice] + i % GBG_CUDA_SLICE;
    int32_t width = call.rows.width[slice];
    for (int32_t k = 0; k < width; k++) {
        int32_t j = index[(int64_t)k * GBG_CUDA_SLICE];
        if (j > i && may_meet<D>(call.rows, own, load_path<D>(call.arrays.path, j), limit)) {
            int32_t at = atomicAdd(&report->candidates, 1);
            if ((uint32_t)at < (uint32_t)call.arrays.candidates) {
                call.arrays.candidate[at] = make_int2((int32_t)i, j);
            } else {
                atomicOr(&report->failed, GBG_CUDA_FULL);
            }
        }
    }
}

/* Those of them that do meet, and the unions of their particles. */
static __global__ void find_events(const __grid_constant__ struct gbg_cuda_events_call call)
{
    const struct gbg_cuda_events_arrays &arrays = call.arrays;
    int32_t count = gbg_cuda_events_count(&arrays.report->candidates, arrays.candidates);
    for (int64_t k = gbg_cuda_index(); k < count; k += (int64_t)gridDim.x * blockDim.x) {
        int2 pair = arrays.candidate[k];
        struct gbg_leg first, second;
        gbg_events_free(&call.state, pair.x, &first);
        gbg_events_free(&call.state, pair.y, &second);
        double time =
            gbg_events_time(&call.state, call.per_quantum, pair.x, pair.y, &first, &second);
        if (time < 1.0) {
            int32_t at = atomicAdd(&arrays.report->events, 1);
            if (at < arrays.events) {
                arrays.event[at] = {time, pair.x, pair.y};
                gbg_cuda_events_unite(arrays.parent, pair.x, pair.y);
            } else {
                atomicOr(&arrays.report->failed, GBG_CUDA_FULL);
            }
        }
    }
}

/* Lets go of the members of clusters that are due in this pass and chains the events of each of
 * these to its root. */
static __global__ void link(const __grid_constant__ struct gbg_cuda_events_call call, int pass)
{
    const struct gbg_cuda_events_arrays &arrays = call.arrays;
    struct gbg_cuda_events_report *report = arrays.report;
    int64_t stride = (int64_t)gridDim.x * blockDim.x;
    if (report->failed || (pass > 1 && report->conflicts[pass - 1] == 0)) {
        return;
    }
    int32_t events = gbg_cuda_events_count(&report->events, arrays.events);
    int32_t members = gbg_cuda_events_count(&report->members, arrays.members);
    if (gbg_cuda_index() == 0) {
        report->begin[pass] = members;
    }
    for (int64_t m = gbg_cuda_index(); m < members; m += stride) {
        struct gbg_cuda_member *member = &arrays.member[m];
        if (member->cluster >= 0 &&
            arrays.due[gbg_cuda_events_root(arrays.parent, member->cluster)] == pass) {
            arrays.claim[member->particle] = 0;
            member->cluster = -1;
        }
    }
    for (int64_t e = gbg_cuda_index(); e < events; e += stride) {
        int32_t root = gbg_cuda_events_root(arrays.parent, arrays.event[e].first);
        if (pass == 1 || arrays.due[root] == pass) {
            int32_t before = atomicExch(arrays.head + root, (int32_t)e);
            arrays.next[e] = before;
            if (before < 0) {
                arrays.todo[atomicAdd(&report->todo[pass], 1)] = root;
            }
        }
    }
}

/* Whether two paths of several legs meet while both are as they are. */
static __device__ bool paths_meet(const struct gbg_cuda_events_call &call,
                                  const struct gbg_cuda_member *first,
                                  const struct gbg_cuda_member *second)
{
    const struct gbg_leg *legs = call.arrays.leg;
    int32_t p = first->first, q = second->first;
    for (;;) {
        const struct gbg_leg *a = &legs[p], *b = &legs[q];
        double a_end = a->next >= 0 ? legs[a->next].time : 1.0;
        double b_end = b->next >= 0 ? legs[b->next].time : 1.0;
        double end = a_end < b_end ? a_end : b_end;
        if (gbg_events_time(&call.state, call.per_quantum, first->particle, second->particle, a,
                            b) <= end) {
            return true;
        }
        if (a->next < 0 && b->next < 0) {
            return false;
        }
        if (b->next < 0 || (a->next >= 0 && a_end <= b_end)) {
            p = a->next;
        } else {
            q = b->next;
        }
    }
}

/* Clusters whose changed paths meet those of the members of this pass: a warp a member. */
static __global__ void find_conflicts(const __grid_constant__ struct gbg_cuda_events_call call,
                                      int pass)
{
    const struct gbg_cuda_events_arrays &arrays = call.arrays;
    const struct gbg_cuda_events_report *report = arrays.report;
    if (report->failed || report->todo[pass] == 0) {
        return;
    }
    int lane = threadIdx.x & 31;
    int32_t begin = report->begin[pass];
    int32_t members = gbg_cuda_events_count(&report->members, arrays.members);
    int64_t stride = (int64_t)gridDim.x * blockDim.x / 32;
    for (int64_t m = begin + gbg_cuda_index() / 32; m < members; m += stride) {
        const struct gbg_cuda_member *own = &arrays.member[m];
        int32_t i = own->particle, cluster = own->cluster;
        if (cluster < 0) {
            continue;
        }
        const int32_t *row =
            call.rows.index + call.rows.offset[i / GBG_CUDA_SLICE] + i % GBG_CUDA_SLICE;
        int32_t width = call.rows.width[i / GBG_CUDA_SLICE];
        for (int32_t k = lane; k < width; k += 32) {
            int32_t j = row[(int64_t)k * GBG_CUDA_SLICE], claim = arrays.claim[j];
            if (j == i || claim == 0 || claim == cluster + 1) {
                continue;
            }
            if (j < i && arrays.member_of[j] >= begin) {
                continue; /* that one looks at this pair */
            }
            const struct gbg_cuda_member *its = &arrays.member[arrays.member_of[j]];
            if (i < j ? paths_meet(call, own, its) : paths_meet(call, its, own)) {
                gbg_cuda_events_conflict(arrays, pass, cluster, claim - 1);
            }
        }
    }
}

static __global__ void unite_conflicts(const __grid_constant__ struct gbg_cuda_events_call call,
                                       int pass)
{
    const struct gbg_cuda_events_arrays &arrays = call.arrays;
    int32_t count = gbg_cuda_events_count(&arrays.report->conflicts[pass], arrays.conflicts);
    for (int64_t k = gbg_cuda_index(); k < count; k += (int64_t)gridDim.x * blockDim.x) {
        gbg_cuda_events_unite(arrays.parent, arrays.conflict[k].x, arrays.conflict[k].y);
    }
}

/* The joined clusters are due in the next pass. */
static __global__ void make_due(const __grid_constant__ struct gbg_cuda_events_call call, int pass)
{
    const struct gbg_cuda_events_arrays &arrays = call.arrays;
    int32_t count = gbg_cuda_events_count(&arrays.report->conflicts[pass], arrays.conflicts);
    for (int64_t k = gbg_cuda_index(); k < count; k += (int64_t)gridDim.x * blockDim.x) {
        int32_t root = gbg_cuda_events_root(arrays.parent, arrays.conflict[k].x);
        arrays.due[root] = pass + 1;
        arrays.head[root] = -1;
    }
}

/* Whether the list was complete all along the paths of this member: legs are straight, so what is
 * between two corners lies nearer than one of them. */
static __device__ bool leaves_range(const struct gbg_cuda_events_call &call,
                                    const struct gbg_cuda_member *member)
{
    const struct gbg_state *state = &call.state;
    const struct gbg_leg *legs = call.arrays.leg;
    int64_t i = member->particle;
    double base[3], off[3] = {0.0, 0.0, 0.0};
    for (int a = 0; a < state->box.dimension; a++) {
        uint32_t start =
            gbg_cuda_local(state->start_high[a][i], state->start_low[a][i], call.rows.shift[a]);
        base[a] = (double)(int32_t)(start - call.rows.built[a][i]) * call.unit[a];
    }
    for (int32_t k = member->first; k >= 0; k = legs[k].next) {
        double end = legs[k].next >= 0 ? legs[legs[k].next].time : 1.0, squared = 0.0;
        for (int a = 0; a < state->box.dimension; a++) {
            off[a] += legs[k].velocity[a] * (end - legs[k].time);
            squared += (base[a] + off[a]) * (base[a] + off[a]);
        }
        if (squared > call.slack * call.slack) {
            return true;
        }
    }
    return false;
}

static __device__ bool is_settled(const struct gbg_cuda_events_report *report, int pass)
{
    for (int p = 1; p <= pass; p++) {
        if (report->conflicts[p] == 0) {
            return true;
        }
    }
    return false;
}

static __global__ void check_range(const __grid_constant__ struct gbg_cuda_events_call call,
                                   int pass)
{
    const struct gbg_cuda_events_arrays &arrays = call.arrays;
    if ((arrays.report->failed & ~GBG_CUDA_NARROW) || !is_settled(arrays.report, pass)) {
        return;
    }
    int32_t members = gbg_cuda_events_count(&arrays.report->members, arrays.members);
    for (int64_t m = gbg_cuda_index(); m < members; m += (int64_t)gridDim.x * blockDim.x) {
        if (arrays.member[m].cluster >= 0 && leaves_range(call, &arrays.member[m])) {
            atomicOr(&arrays.report->failed, GBG_CUDA_NARROW);
        }
    }
}

/* The new end of one particle's path; returns the square of its distance from the start. */
static __device__ double write_back(const struct gbg_cuda_events_call &call,
                                    const struct gbg_cuda_member *member)
{
    const struct gbg_state *state = &call.state;
    const struct gbg_leg *leg = &call.arrays.leg[member->last];
    int64_t i = member->particle;
    double squared = 0.0;
    for (int a = 0; a < state->box.dimension; a++) {
        double d = member->off[a] + leg->velocity[a] * (1.0 - leg->time);
        squared += d * d;
        state->high[a][i] = (uint32_t)(member->target[a] >> 32);
        state->low[a][i] = (uint32_t)member->target[a];
        call.rows.local[a][i] =
            gbg_cuda_local(state->high[a][i], state->low[a][i], call.rows.shift[a]);
        if (state->image[a]) {
            state->image[a][i] += member->image[a];
        }
    }
    if (state->overlapped) {
        state->overlapped[i] = 1;
    }
    return squared;
}

/* The state changes here and nowhere before, so that a step that failed can be done again. */
static __global__ void finish(const __grid_constant__ struct gbg_cuda_events_call call, int pass)
{
    const struct gbg_cuda_events_arrays &arrays = call.arrays;
    struct gbg_cuda_events_report *report = arrays.report;
    if (report->failed || !is_settled(report, pass)) {
        return;
    }
    int32_t members = gbg_cuda_events_count(&report->members, arrays.members);
    int64_t stride = (int64_t)gridDim.x * blockDim.x;
    int64_t rounds = (members + stride - 1) / stride; /* the same for all threads of a warp */
    unsigned long long had = 0, stopped = 0, virial = 0;
    int depth = 0;
    double largest = 0.0;
    for (int64_t r = 0; r < rounds; r++) {
        int64_t m = r * stride + gbg_cuda_index();
        if (m < members && arrays.member[m].cluster >= 0) {
            const struct gbg_cuda_member *member = &arrays.member[m];
            double squared = write_back(call, member);
            largest = squared > largest ? squared : largest;
            had += (unsigned long long)member->events;
            stopped += member->events == GBG_EVENTS_MOST;
            virial += (unsigned long long)member->virial;
            depth = member->depth > depth ? member->depth : depth;
        }
    }
    gbg_cuda_max(&report->largest, largest);
    for (int lane = 16; lane > 0; lane /= 2) {
        had += __shfl_xor_sync(0xFFFFFFFFu, had, lane);
        stopped += __shfl_xor_sync(0xFFFFFFFFu, stopped, lane);
        virial += __shfl_xor_sync(0xFFFFFFFFu, virial, lane);
    }
    depth = __reduce_max_sync(0xFFFFFFFFu, depth);
    if ((threadIdx.x & 31) == 0 && had > 0) {
        atomicAdd(&report->events_had, had);
        atomicAdd(&report->stopped, stopped);
        atomicAdd(&report->virial, virial);
        atomicMax(&report->depth, depth);
    }
    if (gbg_cuda_index() == 0) {
        report->done = 1;
    }
}

int gbg_cuda_events_start(struct gbg_device *device, const struct gbg_cuda_events_call *call,
                          int fresh)
{
    int64_t n = call->state.owned;
    unsigned blocks = gbg_cuda_blocks(n), some = gbg_cuda_events_blocks(device, n);
    if (fresh) {
        set_anew<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*call);
    } else {
        forget_step<<<some, GBG_CUDA_THREADS, 0, device->stream>>>(*call);
    }
    int status = gbg_cuda_started(device, "events: forget_step");
    status =
        status ? status : gbg_cuda_clear(device, call->arrays.report, sizeof *call->arrays.report);
    if (status != GBG_OK) {
        return status;
    }
    if (call->state.box.dimension == 2) {
        find_moves<2><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*call);
        screen<2><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*call);
    } else {
        find_moves<3><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*call);
        screen<3><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*call);
    }
    find_events<<<some, GBG_CUDA_THREADS, 0, device->stream>>>(*call);
    return gbg_cuda_started(device, "events: screen");
}

int gbg_cuda_events_pass(struct gbg_device *device, const struct gbg_cuda_events_call *call,
                         int pass)
{
    unsigned blocks = gbg_cuda_events_blocks(device, call->state.owned);
    link<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*call, pass);
    int status = gbg_cuda_started(device, "events: link");
    status = status ? status : gbg_cuda_events_work(device, call, pass);
    if (status == GBG_OK) {
        unsigned warps = gbg_cuda_events_blocks(device, 32 * call->state.owned);
        find_conflicts<<<warps, GBG_CUDA_THREADS, 0, device->stream>>>(*call, pass);
        unite_conflicts<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*call, pass);
        make_due<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*call, pass);
        status = gbg_cuda_started(device, "events: find_conflicts");
    }
    return status;
}

int gbg_cuda_events_finish(struct gbg_device *device, const struct gbg_cuda_events_call *call,
                           int pass)
{
    unsigned blocks = gbg_cuda_events_blocks(device, call->state.owned);
    check_range<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*call, pass);
    finish<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*call, pass);
    return gbg_cuda_started(device, "events: finish");
}
