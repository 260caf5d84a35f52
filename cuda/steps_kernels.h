/* L1, CUDA: the kernels of a batch of steps, for steps.cu. Each looks first at the flag that stops
 * the batch; what decides on it is found by the block that finishes a stage last. */
#ifndef GBG_CUDA_STEPS_KERNELS_H
#define GBG_CUDA_STEPS_KERNELS_H

#include <cooperative_groups.h>

#include "backend/cpu/certify_pair.h"
#include "backend/cpu/contacts_pair.h"
#include "backend/cpu/exact_pair.h"
#include "backend/cpu/list_square.h"
#include "cuda/steps.h"

namespace cg = cooperative_groups;

enum { PAIRS, CONTACTS };               /* lists */
enum { FOLLOWING, MOVING, CERTIFYING }; /* stages that decide whether to go on */
enum { THREADS = 256 };

/* What every kernel of a step gets. */
struct work {
    struct gbg_state state;
    struct gbg_cuda_rows pairs, contacts; /* without particles: there is no such list */
    double slack[2];                      /* of each list */
    struct gbg_cuda_euler euler;
    struct gbg_push_rule rule;
    float limit; /* squared distance below which a pair is looked at */
    int64_t max_rounds;
    struct gbg_exact exact;
    double certificate_slack, error; /* of the list; of high words */
    /* rounds: particles to look at, in turns; pushes */
    unsigned int *mark;
    int32_t *candidate[2], *mover;
    int64_t *push[3];
    struct gbg_cuda_control *control;
};

static __device__ __forceinline__ double of_bits(unsigned long long bits)
{
    return __longlong_as_double((long long)bits);
}

/* Maximum of non-negative floats over all threads. */
static __device__ __forceinline__ void largest_of(unsigned int *largest, float value)
{
    unsigned int bits = __reduce_max_sync(0xFFFFFFFFu, __float_as_uint(value));
    if ((threadIdx.x & 31) == 0 && bits > __ldcg(largest)) {
        atomicMax(largest, bits);
    }
}

/* True in one thread of the block that is the last to come here. */
static __device__ bool is_last(unsigned int *ticket)
{
    __shared__ bool last;
    __threadfence();
    __syncthreads();
    if (threadIdx.x == 0) {
        last = atomicAdd(ticket, 1u) == gridDim.x - 1;
        __threadfence();
    }
    __syncthreads();
    return last && threadIdx.x == 0;
}

/* Largest move of the step before. */
static __device__ double moved_before(const struct gbg_cuda_control *control, int step)
{
    if (step == 0) {
        return control->moved;
    }
    const struct gbg_cuda_slot *slot = &control->slot[step - 1];
    return fmax(sqrt(of_bits(slot->moves.total)), sqrt(of_bits(slot->farthest)));
}

template <int dimension>
static __device__ __forceinline__ float follow(const struct gbg_state &state,
                                               const struct gbg_cuda_rows &rows, int64_t i)
{
    vf squared = vf_set(0.0f);
    for (int a = 0; a < dimension; a++) {
        uint32_t local = gbg_cuda_local(state.high[a][i], state.low[a][i], rows.shift[a]);
        rows.local[a][i] = local;
        squared = gbg_list_add_square((vi)(local - rows.built[a][i]), rows.scale[a], squared);
    }
    return squared;
}

/* Local coordinates of the list of forces; stops where it has to be built again. */
template <int dimension>
static __global__ void begin_step(const __grid_constant__ struct work work, int step)
{
    struct gbg_cuda_control *control = work.control;
    struct gbg_cuda_slot *slot = &control->slot[step];
    if (__ldcg(&control->halt)) {
        return;
    }
    if (step >= control->limit) {
        control->halt = 1;
        return;
    }
    float moved = 0.0f;
    for (int64_t i = gbg_cuda_index(); i < work.pairs.n; i += (int64_t)gridDim.x * blockDim.x) {
        moved = fmaxf(moved, follow<dimension>(work.state, work.pairs, i));
    }
    if (work.pairs.n > 0) {
        largest_of(&slot->followed[PAIRS], moved);
        if (is_last(&slot->ticket[FOLLOWING])) {
            double squared = (double)__uint_as_float(__ldcg(&slot->followed[PAIRS]));
            double slack = work.slack[PAIRS];
            if (!(moved_before(control, step) <= slack) || squared > slack * slack) {
                control->halt = 1;
            }
        }
    }
}

template <int dimension>
static __device__ __forceinline__ void keep(const struct gbg_state &state, int64_t i)
{
    for (int a = 0; a < dimension; a++) {
        state.start_high[a][i] = state.high[a][i];
        state.start_low[a][i] = state.low[a][i];
        if (state.image[a]) {
            state.start_image[a][i] = state.image[a][i];
        }
    }
    if (state.overlapped) {
        state.overlapped[i] = 0;
    }
}

/* Noise and forces; with hard cores the coordinates before it are kept and the list of contacts is
 * followed. */
template <int dimension, bool cores>
static __global__ void move(const __grid_constant__ struct work work, int step)
{
    struct gbg_cuda_control *control = work.control;
    struct gbg_cuda_slot *slot = &control->slot[step];
    if (__ldcg(&control->halt)) {
        return;
    }
    struct gbg_cuda_move most = {0.0, 0.0, 0.0};
    float moved = 0.0f;
    uint64_t number = control->first + (uint64_t)step;
    int64_t stride = (int64_t)gridDim.x * blockDim.x;
    for (int64_t i = gbg_cuda_index(); i < work.state.owned; i += stride) {
        if (cores) {
            keep<dimension>(work.state, i);
        }
        struct gbg_cuda_move made =
            gbg_cuda_step<dimension>(work.state, work.euler, number, i, &slot->moves);
        most.drift = fmax(most.drift, made.drift);
        most.noise = fmax(most.noise, made.noise);
        most.total = fmax(most.total, made.total);
        if (cores) {
            moved = fmaxf(moved, follow<dimension>(work.state, work.contacts, i));
        }
    }
    gbg_cuda_max(&slot->moves.drift, most.drift);
    gbg_cuda_max(&slot->moves.noise, most.noise);
    gbg_cuda_max(&slot->moves.total, most.total);
    if (cores) {
        largest_of(&slot->followed[CONTACTS], moved);
    }
    if (is_last(&slot->ticket[MOVING])) {
        double squared = (double)__uint_as_float(__ldcg(&slot->followed[CONTACTS]));
        double total = sqrt(of_bits(__ldcg(&slot->moves.total))), slack = work.slack[CONTACTS];
        bool bad = __ldcg(&slot->moves.bad) != GBG_CUDA_NONE;
        if (bad || (cores && (!(total <= slack) || squared > slack * slack))) {
            control->halt = 1;
            control->undo = cores ? step + 1 : 0;
            control->spoiled = !cores;
        }
        if (!cores && !bad) {
            control->done = step + 1;
        }
    }
}

template <int dimension>
static __device__ __forceinline__ bool may_touch(const struct work &work,
                                                 const uint32_t own[dimension], int32_t j)
{
    float squared = 0.0f;
    for (int a = 0; a < dimension; a++) {
        float d = (float)(int32_t)(own[a] - work.contacts.local[a][j]) * work.contacts.scale[a];
        squared += d * d;
    }
    return squared < work.limit;
}

static __device__ __forceinline__ const int32_t *row_of(const struct gbg_cuda_rows &rows, int64_t i,
                                                        int32_t *width)
{
    int64_t slice = i / GBG_CUDA_SLICE;
    *width = rows.width[slice];
    return rows.index + rows.offset[slice] + i % GBG_CUDA_SLICE;
}

/* What the overlaps of particle i move it by; it is noted with that. */
template <int dimension>
static __device__ void push_one(const struct work &work, struct gbg_cuda_slot *slot, int64_t i)
{
    struct gbg_cuda_control *control = work.control;
    int32_t width;
    const int32_t *row = row_of(work.contacts, i, &width);
    int64_t push[3] = {0, 0, 0}, virial = 0;
    unsigned int touched = 0, counted = 0;
    uint32_t own[dimension];
    for (int a = 0; a < dimension; a++) {
        own[a] = work.contacts.local[a][i];
    }
    for (int32_t k = 0; k < width; k++) {
        int32_t j = row[(int64_t)k * GBG_CUDA_SLICE];
        if (j != i && may_touch<dimension>(work, own, j) &&
            gbg_push_pair(&work.rule, &work.state, dimension, i, j, push, &virial)) {
            touched++;
            counted += i < j;
        }
    }
    if (touched > 0) {
        if (work.rule.parting == GBG_PARTING_CARTER) {
            gbg_push_cut(&work.rule, &work.state, dimension, i, push);
        }
        unsigned int place = atomicAdd(&control->movers, 1u);
        work.mover[place] = (int32_t)i;
        for (int a = 0; a < dimension; a++) {
            work.push[a][place] = push[a];
        }
        atomicAdd(&control->found, (unsigned long long)counted);
        atomicAdd(&slot->virial, (unsigned long long)virial);
    }
}

/* Who is in reach of a contact of anybody at the first look of a step. */
template <int dimension> static __device__ void screen(const struct work &work, int64_t i)
{
    int32_t width;
    const int32_t *row = row_of(work.contacts, i, &width);
    uint32_t own[dimension];
    for (int a = 0; a < dimension; a++) {
        own[a] = work.contacts.local[a][i];
    }
    bool found = false;
    for (int32_t k = 0; k < width; k++) {
        int32_t j = __ldg(row + (int64_t)k * GBG_CUDA_SLICE);
        found |= j != i && may_touch<dimension>(work, own, j);
    }
    if (found) {
        work.candidate[0][atomicAdd(&work.control->candidates[0], 1u)] = (int32_t)i;
    }
}

static __device__ __forceinline__ void mark(const struct work &work, int turn, unsigned int number,
                                            int32_t i)
{
    if (atomicExch(&work.mark[i], number) != number) {
        work.candidate[turn][atomicAdd(&work.control->candidates[turn], 1u)] = i;
    }
}

/* Moves one of the movers, and notes it and its neighbours for the next round. */
template <int dimension>
static __device__ void apply_one(const struct work &work, struct gbg_cuda_slot *slot,
                                 unsigned int place, int turn, unsigned int number)
{
    /* its arrays are written, not itself */
    struct gbg_state &state = const_cast<struct gbg_state &>(work.state);
    int64_t i = work.mover[place], push[3] = {0, 0, 0};
    double slack = work.slack[CONTACTS];
    for (int a = 0; a < dimension; a++) {
        push[a] = work.push[a][place];
    }
    double pushed = gbg_push_apply(&state, dimension, i, push);
    for (int a = 0; a < dimension; a++) {
        work.contacts.local[a][i] =
            gbg_cuda_local(state.high[a][i], state.low[a][i], work.contacts.shift[a]);
    }
    if (pushed > slack * slack ||
        (double)gbg_cuda_moved_squared(work.contacts, i) > slack * slack) {
        work.control->stale = 1;
    }
    if (state.overlapped) {
        state.overlapped[i] = 1;
    }
    double far = gbg_push_displaced(&state, dimension, i);
    atomicMax(&slot->farthest, (unsigned long long)__double_as_longlong(far));
    int32_t width;
    const int32_t *row = row_of(work.contacts, i, &width);
    mark(work, turn, number, (int32_t)i);
    for (int32_t k = 0; k < width; k++) {
        mark(work, turn, number, row[(int64_t)k * GBG_CUDA_SLICE]);
    }
}

/* All rounds of a step, in one kernel whose blocks wait for each other. */
template <int dimension>
static __global__ void __launch_bounds__(THREADS)
    part(const __grid_constant__ struct work work, int step)
{
    struct gbg_cuda_control *control = work.control;
    struct gbg_cuda_slot *slot = &control->slot[step];
    cg::grid_group grid = cg::this_grid();
    if (__ldcg(&control->halt)) {
        return;
    }
    int64_t me = gbg_cuda_index(), stride = (int64_t)gridDim.x * blockDim.x;
    for (int64_t i = me; i < work.contacts.n; i += stride) {
        screen<dimension>(work, i);
    }
    for (int64_t round = 0;; round++) {
        int turn = (int)(round & 1);
        grid.sync();
        unsigned int n = __ldcg(&control->candidates[turn]);
        if (n == 0) {
            break;
        }
        unsigned int number = __ldcg(&control->mark) + 1;
        for (int64_t k = me; k < n; k += stride) {
            push_one<dimension>(work, slot, work.candidate[turn][k]);
        }
        grid.sync();
        unsigned long long found = __ldcg(&control->found);
        unsigned int movers = __ldcg(&control->movers);
        if (movers == 0) {
            break;
        }
        if (round == work.max_rounds) {
            grid.sync(); /* everybody has read the numbers */
            if (me == 0) {
                control->halt = 1;
                control->undo = step + 1;
            }
            break;
        }
        for (int64_t k = me; k < movers; k += stride) {
            apply_one<dimension>(work, slot, (unsigned int)k, 1 - turn, number);
        }
        grid.sync();
        if (me == 0) {
            slot->rounds++;
            slot->pairs += found;
            control->mark = number;
            control->found = 0;
            control->movers = 0;
            control->candidates[turn] = 0;
            if (control->stale) {
                control->halt = 1;
                control->undo = step + 1;
            }
        }
        grid.sync();
        if (__ldcg(&control->halt)) {
            break;
        }
    }
    /* nobody reads these after the last wait but this thread */
    if (me == 0) {
        control->candidates[0] = control->candidates[1] = 0;
        control->movers = 0;
    }
}

/* The certificate: the list holds all pairs in reach, nobody moved so far that a pair could have
 * passed, and no pair is too close by all 64 bits. Where it cannot say so the step is taken back
 * and made again by kernels that look closer. */
template <int dimension>
static __global__ void certify(const __grid_constant__ struct work work, int step)
{
    struct gbg_cuda_control *control = work.control;
    struct gbg_cuda_slot *slot = &control->slot[step];
    const struct gbg_state &state = work.state;
    if (__ldcg(&control->halt)) {
        return;
    }
    float way = 0.0f, drift = 0.0f;
    unsigned int faults = 0;
    int64_t stride = (int64_t)gridDim.x * blockDim.x;
    for (int64_t i = gbg_cuda_index(); i < work.contacts.n; i += stride) {
        float since_start = 0.0f, since_built = 0.0f;
        for (int a = 0; a < dimension; a++) {
            float unit = (float)(state.box.length[a] * 0x1p-32);
            vi high = (vi)state.high[a][i];
            since_start = gbg_certify_squared(high, (vi)state.start_high[a][i], unit, since_start);
            since_built =
                gbg_certify_squared(high, (vi)work.contacts.built_high[a][i], unit, since_built);
        }
        way = fmaxf(way, since_start);
        drift = fmaxf(drift, since_built);
        int32_t width;
        const int32_t *row = row_of(work.contacts, i, &width);
        for (int32_t k = 0; k < width; k++) {
            int32_t j = __ldg(row + (int64_t)k * GBG_CUDA_SLICE);
            faults += j > i && gbg_exact_pair_overlap(&work.exact, &state, dimension, i, j);
        }
    }
    largest_of(&slot->way, way);
    largest_of(&slot->drift, drift);
    if (__syncthreads_or((int)faults) && threadIdx.x == 0) {
        atomicAdd(&slot->faults, 1u);
    }
    if (is_last(&slot->ticket[CERTIFYING])) {
        double farthest = sqrt((double)__uint_as_float(__ldcg(&slot->way)));
        double drifted = sqrt((double)__uint_as_float(__ldcg(&slot->drift)));
        bool listed = drifted * (1.0 + 1e-6) + work.error <= work.certificate_slack;
        bool near = farthest * (1.0 + 1e-6) + work.error < 0.7 * work.exact.least;
        if (!listed || !near || __ldcg(&slot->faults) > 0) {
            control->halt = 1;
            control->undo = step + 1;
        } else {
            control->done = step + 1;
        }
    }
}

/* Takes back the step in which the batch was stopped, where that was after its move. */
template <int dimension>
static __global__ void take_back(const __grid_constant__ struct work work, int step)
{
    const struct gbg_state &state = work.state;
    if (__ldcg(&work.control->undo) != step + 1) {
        return;
    }
    int64_t stride = (int64_t)gridDim.x * blockDim.x;
    for (int64_t i = gbg_cuda_index(); i < state.owned; i += stride) {
        for (int a = 0; a < dimension; a++) {
            state.high[a][i] = state.start_high[a][i];
            state.low[a][i] = state.start_low[a][i];
            if (state.image[a]) {
                state.image[a][i] = state.start_image[a][i];
            }
        }
    }
}

static __global__ void start(struct gbg_cuda_control *control, int limit, uint64_t first,
                             double moved)
{
    char *bytes = (char *)control->slot;
    for (unsigned int k = threadIdx.x; k < sizeof control->slot; k += blockDim.x) {
        bytes[k] = 0;
    }
    __syncthreads();
    if (threadIdx.x < GBG_CUDA_BATCH) {
        control->slot[threadIdx.x].moves.bad = GBG_CUDA_NONE;
    }
    if (threadIdx.x == 0) {
        control->halt = control->done = control->undo = control->spoiled = 0;
        control->limit = limit;
        control->first = first;
        control->moved = moved;
        control->candidates[0] = control->candidates[1] = control->movers = control->stale = 0;
        control->found = 0;
    }
}

#endif
