/* L1, CUDA: rule bridge: sweeps over the pairs until the pushes agree. All of them are one kernel,
 * whose thread blocks are all on the device at a time and wait for each other between the colours
 * of blocks: the host need not know how many sweeps there are. */
#include "cuda/bridge.h"

#include <cooperative_groups.h>

/* A pair, as a sweep wants it. */
struct held {
    int2 ends;
    float half_base, gap, quarter_draw, push, normal[3];
};

enum task { SWEEP_ALL, SWEEP_SHORT, PUSH_AGAIN, GO_ON };

struct relaxation {
    float omega, tolerance, stiff, share;
    const float *before; /* shifts of the solve before */
};

template <int dimension>
static __device__ __forceinline__ void load(const struct bridge_work &work, int64_t k,
                                            struct held &held)
{
    held.ends = work.pair.ends[k];
    held.half_base = work.pair.half_base[k];
    held.gap = work.pair.gap[k];
    held.quarter_draw = work.pair.quarter_draw[k];
    held.push = work.push[k];
    for (int a = 0; a < dimension; a++) {
        held.normal[a] = work.normal[a][k];
    }
}

template <int dimension>
static __device__ __forceinline__ void get_shift(const float *shift, int32_t i, float *out)
{
    if (dimension == 2) {
        float2 both = ((const float2 *)shift)[i];
        out[0] = both.x;
        out[1] = both.y;
    } else {
        for (int a = 0; a < dimension; a++) {
            out[a] = shift[(int64_t)dimension * i + a];
        }
    }
}

template <int dimension>
static __device__ __forceinline__ void put_shift(float *shift, int32_t i, const float *in)
{
    if (dimension == 2) {
        ((float2 *)shift)[i] = make_float2(in[0], in[1]);
    } else {
        for (int a = 0; a < dimension; a++) {
            shift[(int64_t)dimension * i + a] = in[a];
        }
    }
}

/* Moves the discs of a pair apart along half of its line, where they are now. */
template <int dimension>
static __device__ __forceinline__ void part_discs(float *shift, int2 ends, float *mine,
                                                  float *other, const float *normal, float change)
{
    for (int a = 0; a < dimension; a++) {
        float part = change * normal[a];
        mine[a] += part;
        other[a] -= part;
    }
    put_shift<dimension>(shift, ends.x, mine);
    put_shift<dimension>(shift, ends.y, other);
}

/* Solves a pair for its own push; returns by how much the push changed. */
template <int dimension>
static __device__ __forceinline__ float relax(const struct bridge_work &work, int64_t k,
                                              const struct held &held, float *shift,
                                              const struct relaxation &relaxation)
{
    float mine[3], other[3];
    get_shift<dimension>(shift, held.ends.x, mine);
    get_shift<dimension>(shift, held.ends.y, other);
    float along = held.normal[0] * (mine[0] - other[0]);
    for (int a = 1; a < dimension; a++) {
        along += held.normal[a] * (mine[a] - other[a]);
    }
    float push = bridge_relaxed(along, held.half_base, held.gap, held.quarter_draw, held.push,
                                relaxation.omega);
    float change = push - held.push;
    work.push[k] = push;
    part_discs<dimension>(shift, held.ends, mine, other, held.normal, change);
    return bridge_change(change, push, relaxation.stiff);
}

/* Moves the push of a pair on by a share of what it changed in a round, and its discs. */
template <int dimension>
static __device__ __forceinline__ void go_on(const struct bridge_work &work, int64_t k,
                                             const struct held &held, float *shift, float share)
{
    float mine[3], other[3];
    float push = bridge_gone_on(held.push, share > 0.0f ? work.last_push[k] : held.push, share);
    get_shift<dimension>(shift, held.ends.x, mine);
    get_shift<dimension>(shift, held.ends.y, other);
    work.last_push[k] = held.push;
    work.push[k] = push;
    part_discs<dimension>(shift, held.ends, mine, other, held.normal, push - held.push);
}

/* Draws a pair's line anew through the places that the solve before gave, and moves its discs by
 * the shifts that its push stands for on it. */
template <int dimension>
static __device__ __forceinline__ void push_again(const struct bridge_work &work, int64_t k,
                                                  struct held &held, const float *before,
                                                  float *now)
{
    float mine[3], other[3], start[3], free[3], shift[3];
    get_shift<dimension>(before, held.ends.x, mine);
    get_shift<dimension>(before, held.ends.y, other);
    for (int a = 0; a < dimension; a++) {
        start[a] = work.pair.start[a][k];
        free[a] = work.pair.free[a][k];
        shift[a] = mine[a] - other[a];
    }
    work.pair.half_base[k] = bridge_turned(dimension, start, free, work.pair.distance[k], shift,
                                           held.half_base, held.normal);
    for (int a = 0; a < dimension; a++) {
        work.normal[a][k] = held.normal[a];
    }
    if (held.push > 0.0f) {
        get_shift<dimension>(now, held.ends.x, mine);
        get_shift<dimension>(now, held.ends.y, other);
        part_discs<dimension>(now, held.ends, mine, other, held.normal, held.push);
    }
}

/* The task on pair k; `ahead` holds it if it was fetched ahead. Returns the change of its push. */
template <int dimension, task what>
static __device__ __forceinline__ float work_on(const struct bridge_work &work, int64_t k,
                                                struct held &held, bool ahead, float *shift,
                                                const struct relaxation &relaxation)
{
    if (what == SWEEP_SHORT && !ahead && !work.active[k]) {
        return 0.0f;
    }
    if (!ahead) {
        load<dimension>(work, k, held);
    }
    if (what == PUSH_AGAIN) {
        push_again<dimension>(work, k, held, relaxation.before, shift);
        return 0.0f;
    }
    if (what == GO_ON) {
        go_on<dimension>(work, k, held, shift, relaxation.share);
        return 0.0f;
    }
    float change = relax<dimension>(work, k, held, shift, relaxation);
    if (what == SWEEP_ALL) {
        work.active[k] = change > relaxation.tolerance;
    }
    return change;
}

/* A task on the pairs of a block, one colour after the other; a thread's first pair of the next
 * colour is fetched before the threads wait for each other. Pairs of the last possible colour may
 * share discs and go one by one. Returns the largest change that this thread made. */
template <int dimension, task what>
static __device__ float each_pair(const struct bridge_work &work, int64_t block, float *shift,
                                  const struct relaxation &relaxation)
{
    const uint32_t *ends = work.colour_end + block * BRIDGE_COLOURS;
    int64_t first = work.first[block];
    uint32_t begin = 0, end = 0;
    int colours = work.colours[block];
    struct held held;
    bool ahead = false;
    float largest = 0.0f;
    for (int colour = 0; colour < colours; colour++) {
        begin = end;
        end = ends[colour];
        uint32_t stride = blockDim.x, k = begin + threadIdx.x;
        if (colour == BRIDGE_COLOURS - 1) {
            k = threadIdx.x == 0 ? begin : end;
            stride = 1;
        }
        for (; k < end; k += stride, ahead = false) {
            float change =
                work_on<dimension, what>(work, first + k, held, ahead, shift, relaxation);
            largest = change > largest ? change : largest;
        }
        ahead = false;
        if (colour + 1 < colours && colour + 1 < BRIDGE_COLOURS - 1) {
            uint32_t next = end + threadIdx.x;
            if (next < ends[colour + 1] && (what != SWEEP_SHORT || work.active[first + next])) {
                load<dimension>(work, first + next, held);
                ahead = true;
            }
        }
        __syncthreads();
    }
    return largest;
}

/* A task on all blocks, one colour after the other. *changed: 1 if a push changed by more than the
 * tolerance. */
template <int dimension, task what>
static __device__ void each_block(const struct bridge_work &work, float *shift,
                                  const struct relaxation &relaxation, unsigned int *changed)
{
    cooperative_groups::grid_group grid = cooperative_groups::this_grid();
    int64_t blocks = bridge_of_colour(&work.plan);
    for (int colour = 0; colour < 1 << dimension; colour++) {
        if (!bridge_has_colour(&work.plan, colour)) {
            continue;
        }
        float largest = 0.0f;
        for (int64_t k = blockIdx.x; k < blocks; k += gridDim.x) {
            int64_t block = bridge_block(&work.plan, colour, k);
            float change = each_pair<dimension, what>(work, block, shift, relaxation);
            largest = change > largest ? change : largest;
        }
        if ((what == SWEEP_ALL || what == SWEEP_SHORT) &&
            __syncthreads_or(largest > relaxation.tolerance) && threadIdx.x == 0) {
            *changed = 1; /* by whom, and how often, does not show */
        }
        grid.sync();
    }
}

/* Rounds on the present lines: a sweep over all pairs, then short ones over those that changed, or,
 * in a pressed scene, a push on. Returns the number of sweeps so far. *settled: 1 if it ended
 * because nothing changed any more. */
template <int dimension>
static __device__ int settle(const struct bridge_work &work, float *shift, float tolerance,
                             int rounds, int sweeps, int *settled)
{
    volatile unsigned int *changed = work.changed;
    *settled = 0;
    for (int round = 0; round < rounds; round++) {
        /* the first push of a pair without neighbours is exact and must not be overdone */
        struct relaxation relaxation = {round == 0 ? 1.0f : work.plan.omega, tolerance,
                                        work.plan.stiff, bridge_share(&work.plan, round), NULL};
        each_block<dimension, SWEEP_ALL>(work, shift, relaxation, work.changed + sweeps);
        if (!changed[sweeps++]) {
            *settled = 1;
            break;
        }
        if (work.plan.momentum > 0.0f) {
            if (round + 1 < rounds) { /* what a solve ends with is what a sweep gave */
                each_block<dimension, GO_ON>(work, shift, relaxation, NULL);
            }
            continue;
        }
        relaxation.omega = work.plan.omega;
        for (int k = 0; k < BRIDGE_SHORT_SWEEPS; k++) {
            each_block<dimension, SWEEP_SHORT>(work, shift, relaxation, work.changed + sweeps);
            if (!changed[sweeps++]) {
                break;
            }
        }
    }
    return sweeps;
}

/* In parts of S, or of the deepest overlap where that is much larger (no noise: S = 0). */
static __device__ float tolerance_of(const struct bridge_work &work)
{
    float scale = (float)work.plan.deviation;
    float depth = __int_as_float((int)work.results->depth) * 0x1p-4f;
    return BRIDGE_TOLERANCE * (depth > scale ? depth : scale);
}

template <int dimension>
static __global__ void __launch_bounds__(BRIDGE_MOST_THREADS)
    solve(const __grid_constant__ struct bridge_work work)
{
    if (bridge_idle(work)) { /* all thread blocks see the same */
        return;
    }
    int settled = 0, sweeps = 0;
    float tolerance = tolerance_of(work);
    for (int k = 0; k < work.plan.solves; k++) {
        if (k > 0) {
            struct relaxation none = {0.0f, 0.0f, 0.0f, 0.0f, work.shift[k - 1]};
            each_block<dimension, PUSH_AGAIN>(work, work.shift[k], none, NULL);
        }
        sweeps = settle<dimension>(work, work.shift[k], tolerance, work.plan.rounds[k], sweeps,
                                   &settled);
    }
    if (gbg_cuda_index() == 0) {
        work.results->sweeps = (unsigned)sweeps;
        work.results->stopped = work.plan.momentum > 0.0f && !settled;
    }
}

/* Thread blocks of the kernel that fit on the device. */
static int ask_resident(struct gbg_device *device, int *resident, const void *kernel, int threads)
{
    int each = 0;
    int status = gbg_cuda_status(
        device, cudaOccupancyMaxActiveBlocksPerMultiprocessor(&each, kernel, threads, 0),
        "bridge: asking the device");
    *resident = each * device->multiprocessors;
    return status;
}

int gbg_cuda_bridge_solve(struct gbg_device *device, struct gbg_cuda_bridge *kept,
                          const struct bridge_work *work)
{
    int flat = work->plan.dimension == 2;
    const void *kernel = flat ? (const void *)solve<2> : (const void *)solve<3>;
    int64_t blocks = bridge_of_colour(&work->plan);
    int wider = bridge_wider(device, work, blocks), threads = BRIDGE_THREADS << wider;
    int *resident = &kept->resident[flat ? 0 : 1][wider];
    int status = *resident > 0 ? GBG_OK : ask_resident(device, resident, kernel, threads);
    if (status != GBG_OK) {
        return status;
    }
    unsigned grid = (unsigned)(blocks < *resident ? blocks : *resident);
    struct bridge_work copy = *work;
    void *arguments[] = {&copy};
    return gbg_cuda_status(device,
                           cudaLaunchCooperativeKernel(kernel, dim3(grid), dim3((unsigned)threads),
                                                       arguments, 0, device->stream),
                           "bridge: sweeps");
}
