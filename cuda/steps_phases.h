/* L1, CUDA: the phases of a step in a batch. A phase is a function for all threads of a grid, and
 * what it decides is a function for one thread when all have finished it: so the phases serve
 * kernels of their own as well as one kernel that goes through all of them. */
#ifndef GBG_CUDA_STEPS_PHASES_H
#define GBG_CUDA_STEPS_PHASES_H

#include "backend/cpu/certify_pair.h"
#include "backend/cpu/exact_pair.h"
#include "cuda/bridge.h"
#include "cuda/places.h"
#include "cuda/steps.h"

typedef struct gbg_cuda_work work_t;
typedef struct gbg_cuda_control control_t;
typedef struct gbg_cuda_slot slot_t;

static __device__ __forceinline__ int64_t threads_in_all()
{
    return (int64_t)gridDim.x * blockDim.x;
}

static __device__ __forceinline__ double root_of_bits(unsigned long long bits)
{
    return sqrt(__longlong_as_double((long long)bits));
}

/* Largest of the numbers of a warp's lanes. */
static __device__ __forceinline__ unsigned long long largest_in_warp(unsigned long long bits)
{
    unsigned high = __reduce_max_sync(0xFFFFFFFFu, (unsigned)(bits >> 32));
    unsigned low =
        __reduce_max_sync(0xFFFFFFFFu, (unsigned)(bits >> 32) == high ? (unsigned)bits : 0u);
    return (unsigned long long)high << 32 | low;
}

/* Largest values of a block: all its threads note theirs, and after they have waited for each other
 * the first warp gives them on. */
static __device__ __forceinline__ unsigned long long *noted(int which)
{
    enum { VALUES = 4, WARPS = 32 };
    __shared__ unsigned long long of_warp[VALUES][WARPS];
    return of_warp[which];
}

static __device__ __forceinline__ void note(int which, double value)
{
    unsigned long long bits = largest_in_warp((unsigned long long)__double_as_longlong(value));
    if ((threadIdx.x & 31) == 0) {
        noted(which)[threadIdx.x / 32] = bits;
    }
}

static __device__ __forceinline__ void give_on(int which, unsigned long long *largest)
{
    unsigned long long bits =
        largest_in_warp(threadIdx.x < blockDim.x / 32 ? noted(which)[threadIdx.x] : 0);
    if (threadIdx.x == 0 && bits > 0) {
        atomicMax(largest, bits);
    }
}

static __device__ __forceinline__ void sum_of(unsigned long long *sum, unsigned long long value)
{
    if (!__any_sync(0xFFFFFFFFu, value != 0)) {
        return;
    }
    for (int lane = 16; lane > 0; lane /= 2) {
        value += __shfl_xor_sync(0xFFFFFFFFu, value, lane);
    }
    if ((threadIdx.x & 31) == 0) {
        atomicAdd(sum, value);
    }
}

static __device__ __forceinline__ float squared_high(const work_t &work, int a, uint32_t here,
                                                     uint32_t there, float sum)
{
    return gbg_certify_squared((vi)here, (vi)there, work.unit_high[a], sum);
}

/* Squared way of a particle since the lists were built, by high words. */
template <int dimension>
static __device__ __forceinline__ float displaced(const work_t &work,
                                                  const struct gbg_cuda_rows &rows, int64_t i)
{
    float squared = 0.0f;
    for (int a = 0; a < dimension; a++) {
        squared = squared_high(work, a, work.state.high[a][i], rows.built_high[a][i], squared);
    }
    return squared;
}

/* An upper bound of a length whose square was found by high words. */
static __device__ __forceinline__ double at_most(const work_t &work, unsigned long long bits)
{
    return root_of_bits(bits) * (1.0 + 1e-6) + work.error;
}

template <int dimension>
static __device__ __forceinline__ void put_place(const work_t &work, int turn, int64_t i)
{
    if (work.state.source) {
        gbg_cuda_put_place<dimension, true>(work.state, work.pairs, work.place[turn], i);
    } else {
        gbg_cuda_put_place<dimension, false>(work.state, work.pairs, work.place[turn], i);
    }
}

static __device__ __forceinline__ void halt(control_t *control, int undo, int stale)
{
    control->halt = 1;
    control->undo = undo;
    control->stale = stale;
}

/* Before the first step: places, and how far everybody is from where the lists were built. */
template <int dimension> static __device__ void begin(const work_t &work)
{
    const struct gbg_cuda_rows &rows = work.pairs.n > 0 ? work.pairs : work.contacts;
    control_t *control = work.control;
    float farthest = 0.0f;
    for (int64_t i = gbg_cuda_index(); i < rows.n; i += threads_in_all()) {
        farthest = fmaxf(farthest, displaced<dimension>(work, rows, i));
        if (work.place[0]) {
            put_place<dimension>(work, control->turn, i);
        }
    }
    note(0, (double)farthest);
    __syncthreads();
    if (threadIdx.x < 32) {
        give_on(0, &control->slot[0].displaced);
    }
}

static __device__ void decide_begun(const work_t &work)
{
    control_t *control = work.control;
    control->displaced = at_most(work, __ldcg(&control->slot[0].displaced));
    control->slot[0].displaced = 0;
    if (!(control->displaced <= work.slack)) {
        halt(control, 0, 1);
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

template <int dimension, int law>
static __device__ __forceinline__ void force_on(const work_t &work, int turn, int64_t i,
                                                double force[dimension])
{
    const struct gbg_state &state = work.state;
    if constexpr (law == GBG_CUDA_POWER_2 || law == GBG_CUDA_POWER_6) {
        constexpr int power = law == GBG_CUDA_POWER_2 ? 2 : 6;
        vf sum[dimension];
        if (state.source) {
            gbg_cuda_field<dimension, power, true>(work.pairs, work.place[turn], work.unit, 0.0f, i,
                                                   sum);
        } else {
            gbg_cuda_field<dimension, power, false>(work.pairs, work.place[turn], work.unit,
                                                    (float)state.alpha[0], i, sum);
        }
        double mobility = state.mobility[state.species ? state.species[i] : 0];
        for (int a = 0; a < dimension; a++) {
            force[a] = mobility * (work.factor * (double)sum[a]);
        }
    } else if constexpr (law == GBG_CUDA_STORED) {
        gbg_cuda_stored_force<dimension>(state, i, force);
    } else {
        for (int a = 0; a < dimension; a++) {
            force[a] = 0.0;
        }
    }
}

/* Forces and noise. With hard cores the coordinates before the step are kept. */
template <int dimension, int law, bool cores>
static __device__ void advance(const work_t &work, int step)
{
    control_t *control = work.control;
    slot_t *slot = &control->slot[step];
    struct gbg_cuda_move most = {0.0, 0.0, 0.0};
    float farthest = 0.0f;
    uint64_t number = control->first + (uint64_t)step;
    int turn = cores ? 0 : (control->turn + step) & 1;
    for (int64_t i = gbg_cuda_index(); i < work.state.owned; i += threads_in_all()) {
        double force[dimension];
        force_on<dimension, law>(work, turn, i, force);
        if (cores) {
            keep<dimension>(work.state, i);
        }
        struct gbg_cuda_move made =
            gbg_cuda_step<dimension>(work.state, work.euler, number, i, force, &slot->moves);
        if (cores && work.bridge) { /* its screen reads them */
            for (int a = 0; a < dimension; a++) {
                work.contacts.local[a][i] = gbg_cuda_local(
                    work.state.high[a][i], work.state.low[a][i], work.contacts.shift[a]);
            }
        }
        most.drift = fmax(most.drift, made.drift);
        most.noise = fmax(most.noise, made.noise);
        most.total = fmax(most.total, made.total);
        if (!cores && law != GBG_CUDA_FREE) {
            farthest = fmaxf(farthest, displaced<dimension>(work, work.pairs, i));
            if (law != GBG_CUDA_STORED) {
                put_place<dimension>(work, 1 - turn, i);
            }
        }
    }
    note(0, most.drift);
    note(1, most.noise);
    note(2, most.total);
    note(3, (double)farthest);
    __syncthreads();
    if (threadIdx.x < 32) {
        give_on(0, &slot->moves.drift);
        give_on(1, &slot->moves.noise);
        give_on(2, &slot->moves.total);
        give_on(3, &slot->displaced);
    }
}

/* What decisions need of a step, all of it at once: they would wait for each word else. */
static __device__ __forceinline__ slot_t seen(const work_t &work, int step)
{
    const slot_t *from = &work.control->slot[step];
    slot_t slot = {};
    slot.moves.total = __ldcg(&from->moves.total);
    slot.moves.bad = __ldcg(&from->moves.bad);
    slot.displaced = __ldcg(&from->displaced);
    slot.way = __ldcg(&from->way);
    slot.faults = __ldcg(&from->faults);
    return slot;
}

/* Whether the step may go on. With hard cores the list of contacts must hold all pairs within reach
 * after the move. */
template <bool cores>
static __device__ bool decide_advanced(const work_t &work, int step, const slot_t &slot)
{
    control_t *control = work.control;
    double total = root_of_bits(slot.moves.total);
    bool bad = slot.moves.bad != GBG_CUDA_NONE;
    if (cores) {
        bool listed = control->displaced + total <= work.slack;
        if (bad || !listed) {
            halt(control, 1, !bad);
            return false;
        }
    } else if (bad) {
        halt(control, 0, 0);
        control->spoiled = 1;
    } else {
        control->done = step + 1;
        control->displaced = at_most(work, slot.displaced);
        if (work.pairs.n > 0 && !(total <= work.slack && control->displaced <= work.slack)) {
            halt(control, 0, 1);
        }
    }
    return true;
}

/* What overlaps move particles by. Before round 1 all are looked at; `round` have been made. */
template <int dimension> static __device__ void find(const work_t &work, int step, int64_t round)
{
    unsigned long long pairs = 0;
    int64_t virial = 0;
    if (round == 0) {
        gbg_cuda_find_all<dimension>(work.state, work.rounds, 0, &pairs, &virial);
    } else {
        gbg_cuda_find_moved<dimension>(work.state, work.rounds, (int)(round - 1) & 1, &pairs,
                                       &virial);
    }
    sum_of(&work.control->found, pairs);
    sum_of(&work.control->slot[step].virial, (unsigned long long)virial);
}

static __device__ void decide_found(const work_t &work, int step, int64_t round,
                                    unsigned long long found)
{
    control_t *control = work.control;
    slot_t *slot = &control->slot[step];
    control->parted = 1;
    control->found = 0;
    if (found > 0 && round == work.max_rounds) {
        halt(control, 1, 0);
    } else if (found > 0) {
        control->parted = 0;
        slot->rounds++;
        slot->pairs += found;
    }
}

/* How far particle i is from where the step began, squared, by high words. */
template <int dimension>
static __device__ __forceinline__ float way_of(const work_t &work, int64_t i)
{
    float squared = 0.0f;
    for (int a = 0; a < dimension; a++) {
        squared =
            squared_high(work, a, work.state.high[a][i], work.state.start_high[a][i], squared);
    }
    return squared;
}

/* Moves those who have a push. */
template <int dimension> static __device__ void apply(const work_t &work, int step, int64_t round)
{
    float farthest = 0.0f;
    gbg_cuda_push_apart<dimension>(
        work.state, work.rounds, (int)(round - 1) & 1,
        [&](int64_t i, double) { farthest = fmaxf(farthest, way_of<dimension>(work, i)); });
    note(0, (double)farthest);
    __syncthreads();
    if (threadIdx.x < 32) {
        give_on(0, &work.control->slot[step].farthest);
    }
}

static __device__ void decide_applied(const work_t &work, int step)
{
    control_t *control = work.control;
    if (!(control->displaced + at_most(work, __ldcg(&control->slot[step].farthest)) <=
          work.slack)) {
        halt(control, 1, 1);
        control->parted = 1;
    }
}

/* After the rule bridge: it has done nothing if it found more pairs than it has memory for. */
static __device__ void decide_bridged(const work_t &work, const struct bridge_results *results,
                                      int64_t capacity, int step)
{
    control_t *control = work.control;
    slot_t *slot = &control->slot[step];
    slot->bridge_farthest = results->largest;
    slot->bridge_virial = results->virial;
    slot->bridge_pairs = results->pairs;
    slot->bridge_sweeps = results->sweeps;
    if (results->found > (unsigned long long)capacity) {
        halt(control, 1, 0);
    } else if (!(control->displaced + root_of_bits(results->largest) <= work.slack)) {
        halt(control, 1, 1);
    }
}

/* Pairs of particle i that are too close. */
template <int dimension>
static __device__ __forceinline__ unsigned int faults_of(const work_t &work, int64_t i)
{
    const struct gbg_state &state = work.state;
    int64_t slice = i / GBG_CUDA_SLICE;
    const int32_t *row = work.contacts.index + work.contacts.offset[slice] + i % GBG_CUDA_SLICE;
    int32_t width = work.contacts.width[slice];
    unsigned int faults = 0;
    uint32_t own[dimension];
    for (int a = 0; a < dimension; a++) {
        own[a] = state.high[a][i];
    }
    for (int32_t begin = 0; begin < width; begin += 32) {
        int32_t count = width - begin < 32 ? width - begin : 32;
        uint32_t near = 0;
#pragma unroll 4
        for (int32_t k = 0; k < count; k++) {
            int32_t j = __ldg(row + (int64_t)(begin + k) * GBG_CUDA_SLICE);
            float squared = 0.0f;
            for (int a = 0; a < dimension; a++) {
                squared = squared_high(work, a, own[a], state.high[a][j], squared);
            }
            near |= (uint32_t)(j > i && squared < work.close) << k;
        }
        for (; near != 0; near &= near - 1) {
            int64_t j = __ldg(row + (int64_t)(begin + __ffs((int)near) - 1) * GBG_CUDA_SLICE);
            faults += (unsigned)gbg_exact_pair_overlap(&work.exact, &state, dimension, i, j);
        }
    }
    return faults;
}

/* The certificate: the list holds all pairs in reach, nobody moved so far that a pair could have
 * passed, and no pair is too close by all 64 bits. Where it cannot say so the step is taken back
 * and made again by kernels that look closer. Also the places for the next step. */
template <int dimension> static __device__ void certify(const work_t &work, int step)
{
    slot_t *slot = &work.control->slot[step];
    float way = 0.0f, farthest = 0.0f;
    unsigned int faults = 0;
    for (int64_t i = gbg_cuda_index(); i < work.contacts.n; i += threads_in_all()) {
        way = fmaxf(way, way_of<dimension>(work, i));
        farthest = fmaxf(farthest, displaced<dimension>(work, work.contacts, i));
        faults += faults_of<dimension>(work, i);
        if (work.place[0]) {
            put_place<dimension>(work, 0, i);
        }
    }
    note(0, (double)way);
    note(1, (double)farthest);
    __syncthreads();
    if (threadIdx.x < 32) {
        give_on(0, &slot->way);
        give_on(1, &slot->displaced);
    }
    faults = __reduce_add_sync(0xFFFFFFFFu, faults);
    if ((threadIdx.x & 31) == 0 && faults > 0) {
        atomicAdd(&slot->faults, faults);
    }
}

/* If another move like this one might go beyond what the lists hold, they are built before it. */
static __device__ void decide_certified(const work_t &work, int step, const slot_t &slot)
{
    control_t *control = work.control;
    double drifted = at_most(work, slot.displaced);
    bool listed = drifted <= work.certificate_slack;
    bool near = at_most(work, slot.way) < 0.7 * work.exact.least;
    if (!listed || !near || slot.faults > 0) {
        halt(control, 1, !listed);
        return;
    }
    control->done = step + 1;
    control->displaced = drifted;
    if (drifted + root_of_bits(slot.moves.total) > work.slack) {
        halt(control, 0, 1);
    }
}

/* After a first look and a certificate made with it: if nobody overlaps that is the end of the
 * step, else it is void. */
static __device__ void decide_looked(const work_t &work, int step, const slot_t &slot,
                                     unsigned long long found)
{
    decide_found(work, step, 0, found);
    if (found == 0) {
        decide_certified(work, step, slot);
    } else {
        slot_t *all = &work.control->slot[step];
        all->way = all->displaced = 0;
        all->faults = 0;
    }
}

/* The same where the move was not yet judged, so that its blocks need not wait for that: if it is
 * void then so is the look. */
static __device__ void decide_moved_and_looked(const work_t &work, int step)
{
    control_t *control = work.control;
    slot_t slot = seen(work, step);
    unsigned long long found = __ldcg(&control->found);
    if (decide_advanced<true>(work, step, slot)) {
        decide_looked(work, step, slot, found);
    } else {
        control->parted = 1;
        control->found = 0;
    }
}

/* The coordinates before the step. */
template <int dimension> static __device__ void take_back(const work_t &work)
{
    const struct gbg_state &state = work.state;
    for (int64_t i = gbg_cuda_index(); i < state.owned; i += threads_in_all()) {
        for (int a = 0; a < dimension; a++) {
            state.high[a][i] = state.start_high[a][i];
            state.low[a][i] = state.start_low[a][i];
            if (state.image[a]) {
                state.image[a][i] = state.start_image[a][i];
            }
        }
    }
}

#endif
