/* L1, CUDA: the contact rule "bridge". What it does: backend/cpu/bridge.c, with the same bits. */
#include "cuda/bridge.h"

#include <cub/cub.cuh>

#include "cuda/kernels.h"

enum {
    APPLY_THREADS = 256,
    MOST_PARTS = 32 /* thread blocks that add up the pushes of a block */
};

/* What the pushes of a block, one or more thread blocks', move its discs by, in quanta, opposite to
 * the last bit. */
template <int dimension>
static __global__ void __launch_bounds__(BRIDGE_THREADS)
    sum_quanta(const __grid_constant__ struct gbg_state state,
               const __grid_constant__ struct bridge_work work)
{
    typedef cub::BlockReduce<long long, BRIDGE_THREADS> reduction;
    __shared__ typename reduction::TempStorage scratch;
    if (bridge_idle(work)) {
        return;
    }
    int64_t first = work.first[blockIdx.x];
    uint32_t n = work.count[blockIdx.x], pairs = 0;
    long long virial = 0;
    for (uint32_t k = blockIdx.y * BRIDGE_THREADS + threadIdx.x; k < n;
         k += gridDim.y * BRIDGE_THREADS) {
        float push = work.push[first + k];
        if (push > 0.0f) {
            int2 ends = work.pair.ends[first + k];
            for (int a = 0; a < dimension; a++) {
                unsigned long long quanta = (unsigned long long)bridge_quanta(
                    push, work.normal[a][first + k], work.plan.quantum[a]);
                atomicAdd(&work.quanta[(int64_t)dimension * ends.x + a], quanta);
                atomicAdd(&work.quanta[(int64_t)dimension * ends.y + a], 0ull - quanta);
            }
            pairs++;
            virial += bridge_virial(&work.plan, &state, ends.x, ends.y, push);
        }
    }
    unsigned warp_pairs = __reduce_add_sync(0xFFFFFFFFu, pairs);
    if ((threadIdx.x & 31u) == 0 && warp_pairs > 0) {
        atomicAdd(&work.results->pairs, (unsigned long long)warp_pairs);
    }
    virial = reduction(scratch).Sum(virial);
    if (threadIdx.x == 0 && virial != 0) {
        atomicAdd(&work.results->virial, (unsigned long long)virial);
    }
}

/* Moves a particle that was pushed. Squares: of its way since the start of the step, in lengths,
 * and of its push. */
template <int dimension>
static __device__ void move(const struct gbg_state &state, const struct gbg_cuda_rows &rows,
                            int64_t i, const int64_t *quanta, double *way, double *push)
{
    double squared = 0.0, pushed = 0.0;
    for (int a = 0; a < dimension; a++) {
        uint64_t old = gbg_join(state.high[a][i], state.low[a][i]);
        uint64_t moved = old + (uint64_t)quanta[a];
        state.high[a][i] = (uint32_t)(moved >> 32);
        state.low[a][i] = (uint32_t)moved;
        rows.local[a][i] = gbg_cuda_local((uint32_t)(moved >> 32), (uint32_t)moved, rows.shift[a]);
        if (state.image[a]) {
            state.image[a][i] += (quanta[a] > 0 && moved < old) - (quanta[a] < 0 && moved > old);
        }
        double d = gbg_box_difference(&state.box, a, moved,
                                      gbg_join(state.start_high[a][i], state.start_low[a][i]));
        double p = (double)quanta[a] * state.box.quantum[a];
        squared += d * d;
        pushed += p * p;
    }
    if (state.overlapped) {
        state.overlapped[i] = 1;
    }
    *way = squared;
    *push = pushed;
}

/* Moves all particles; stale: somebody's way since the list was built is too long for the list. */
template <int dimension>
static __global__ void __launch_bounds__(APPLY_THREADS)
    apply(const __grid_constant__ struct gbg_state state,
          const __grid_constant__ struct gbg_cuda_rows rows,
          const __grid_constant__ struct bridge_work work, double slack)
{
    if (bridge_idle(work)) {
        return;
    }
    double largest = 0.0, farthest = 0.0;
    bool stale = false;
    int64_t stride = (int64_t)gridDim.x * blockDim.x;
    for (int64_t i = gbg_cuda_index(); i < work.n; i += stride) {
        int64_t quanta[3], any = 0;
        for (int a = 0; a < dimension; a++) {
            quanta[a] = (int64_t)work.quanta[dimension * i + a];
            any |= quanta[a];
        }
        if (any) {
            double squared, pushed;
            move<dimension>(state, rows, i, quanta, &squared, &pushed);
            largest = squared > largest ? squared : largest;
            farthest = pushed > farthest ? pushed : farthest;
            stale |=
                pushed > slack * slack || (double)gbg_cuda_moved_squared(rows, i) > slack * slack;
        }
    }
    gbg_cuda_max(&work.results->largest, largest);
    gbg_cuda_max(&work.results->farthest, farthest);
    if (stale) {
        work.results->stale = 1;
    }
}

/* Whether one of the found pairs overlaps now, where they are few. */
static __global__ void __launch_bounds__(BRIDGE_THREADS)
    look_again(const __grid_constant__ struct gbg_state state,
               const __grid_constant__ struct bridge_work work, double least)
{
    unsigned long long found = work.results->found;
    if (bridge_idle(work) || 8 * found > (unsigned long long)work.n) {
        return;
    }
    int64_t stride = (int64_t)gridDim.x * blockDim.x;
    for (int64_t k = gbg_cuda_index(); k < (int64_t)found; k += stride) {
        int2 ends = work.found[k];
        if (bridge_overlap(&state, ends.x, ends.y, least)) {
            work.results->overlapping = 1;
        }
    }
}

/* The parts of a workspace; counts only while base is NULL. */
static void lay_records(struct bridge_records *to, void *base, size_t *used, int64_t n,
                        int dimension)
{
    to->ends = (int2 *)gbg_cuda_take(base, used, n, sizeof *to->ends);
    float **const parts[4] = {&to->half_base, &to->gap, &to->quarter_draw, &to->distance};
    for (int k = 0; k < 4; k++) {
        *parts[k] = (float *)gbg_cuda_take(base, used, n, sizeof(float));
    }
    for (int a = 0; a < dimension; a++) {
        to->start[a] = (float *)gbg_cuda_take(base, used, n, sizeof(float));
        to->free[a] = (float *)gbg_cuda_take(base, used, n, sizeof(float));
    }
}

static size_t lay_out(struct bridge_work *work, void *base, void **scan, size_t scan_bytes)
{
    size_t used = 0;
    int dimension = work->plan.dimension;
    int64_t n = work->n, blocks = work->plan.n_blocks, pairs = work->capacity;
    work->results =
        (struct bridge_results *)gbg_cuda_take(base, &used, 1, sizeof(struct bridge_results));
    int sweeps = 0;
    for (int k = 0; k < work->plan.solves; k++) {
        sweeps += work->plan.rounds[k] * (1 + BRIDGE_SHORT_SWEEPS);
    }
    work->changed = (unsigned int *)gbg_cuda_take(base, &used, sweeps, sizeof *work->changed);
    work->tally = (unsigned long long *)gbg_cuda_take(base, &used, blocks + 1, sizeof *work->tally);
    work->count = (unsigned int *)gbg_cuda_take(base, &used, blocks, sizeof *work->count);
    work->quanta =
        (unsigned long long *)gbg_cuda_take(base, &used, n * dimension, sizeof *work->quanta);
    for (int k = 0; k < work->plan.solves; k++) {
        work->shift[k] = (float *)gbg_cuda_take(base, &used, n * dimension, sizeof(float));
    }
    work->zero_bytes = used;
    work->first = (int64_t *)gbg_cuda_take(base, &used, blocks + 1, sizeof *work->first);
    work->colours = (int32_t *)gbg_cuda_take(base, &used, blocks, sizeof *work->colours);
    work->colour_end =
        (uint32_t *)gbg_cuda_take(base, &used, blocks * BRIDGE_COLOURS, sizeof *work->colour_end);
    work->found = (int2 *)gbg_cuda_take(base, &used, pairs, sizeof *work->found);
    work->found_block = (int32_t *)gbg_cuda_take(base, &used, pairs, sizeof *work->found_block);
    lay_records(&work->raw, base, &used, pairs, dimension);
    work->key = (bridge_key *)gbg_cuda_take(base, &used, pairs, sizeof *work->key);
    work->other = (bridge_key *)gbg_cuda_take(base, &used, pairs, sizeof *work->other);
    work->sorted = (int2 *)gbg_cuda_take(base, &used, pairs, sizeof *work->sorted);
    work->used = (unsigned long long *)gbg_cuda_take(base, &used, 2 * pairs, sizeof *work->used);
    lay_records(&work->pair, base, &used, pairs, dimension);
    work->push = (float *)gbg_cuda_take(base, &used, pairs, sizeof *work->push);
    for (int a = 0; a < dimension; a++) {
        work->normal[a] = (float *)gbg_cuda_take(base, &used, pairs, sizeof(float));
    }
    work->last_push = (float *)gbg_cuda_take(base, &used, work->plan.momentum > 0.0f ? pairs : 0,
                                             sizeof *work->last_push);
    work->active = (unsigned char *)gbg_cuda_take(base, &used, pairs, 1);
    *scan = gbg_cuda_take(base, &used, (int64_t)scan_bytes, 1);
    return used;
}

/* Starts what moves the particles by their pushes. */
static int start_moves(struct gbg_device *device, const struct gbg_state *state,
                       const struct gbg_list *list, const struct bridge_work *work, double slack,
                       double least)
{
    bool flat = work->plan.dimension == 2;
    unsigned some = 4u * (unsigned)device->multiprocessors;
    unsigned all = gbg_cuda_blocks(work->n, APPLY_THREADS);
    unsigned grid = all < some ? all : some;
    unsigned blocks = (unsigned)work->plan.n_blocks, each = some / blocks;
    each = each < 1 ? 1 : each < MOST_PARTS ? each : MOST_PARTS;
    auto *summing = flat ? sum_quanta<2> : sum_quanta<3>;
    auto *applying = flat ? apply<2> : apply<3>;
    summing<<<dim3(blocks, each), BRIDGE_THREADS, 0, device->stream>>>(*state, *work);
    applying<<<grid, APPLY_THREADS, 0, device->stream>>>(*state, list->rows, *work, slack);
    look_again<<<some, BRIDGE_THREADS, 0, device->stream>>>(*state, *work, least);
    return gbg_cuda_started(device, "bridge: moving particles");
}

/* The workspace for as many pairs as are kept in mind. */
static int take_workspace(struct gbg_device *device, const struct gbg_list *list,
                          struct bridge_work *work, void **base, void **scan, size_t *scan_bytes)
{
    *scan_bytes = gbg_cuda_bridge_scan_bytes(work->plan.n_blocks);
    work->capacity = list->bridge->capacity;
    int status = gbg_cuda_workspace(device, lay_out(work, NULL, scan, *scan_bytes), base);
    if (status == GBG_OK) {
        lay_out(work, *base, scan, *scan_bytes);
    }
    return status;
}

/* The whole call. Nobody is moved if there is memory for fewer pairs than were found. */
static int attempt(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                   struct bridge_work *work, double slack, double least)
{
    void *base, *scan;
    size_t scan_bytes;
    int status = take_workspace(device, list, work, &base, &scan, &scan_bytes);
    if (status != GBG_OK) {
        return status;
    }
    status = gbg_cuda_clear(device, base, work->zero_bytes);
    status = status ? status : gbg_cuda_bridge_find(device, state, list, work, scan, scan_bytes);
    status = status ? status : gbg_cuda_bridge_order(device, list->bridge, state, work);
    status = status ? status : gbg_cuda_bridge_solve(device, list->bridge, work);
    return status ? status : start_moves(device, state, list, work, slack, least);
}

static int keep_work(struct gbg_device *device, struct gbg_list *list)
{
    if (list->bridge) {
        return GBG_OK;
    }
    void *kept;
    int status =
        gbg_allocate_zero(device->context, &kept, 1, sizeof(struct gbg_cuda_bridge), "rule bridge");
    if (status == GBG_OK) {
        list->bridge = (struct gbg_cuda_bridge *)kept;
        list->bridge->capacity = 2 * list->rows.n + 1024;
        list->bridge->slots = GBG_CUDA_BRIDGE_SLOTS;
    }
    return status;
}

int gbg_cuda_bridge_limit(struct gbg_device *device, struct gbg_list *list, int slots)
{
    int status = keep_work(device, list);
    if (status == GBG_OK) {
        list->bridge->slots = slots;
    }
    return status;
}

int64_t gbg_cuda_bridge_spilled(const struct gbg_list *list)
{
    return list->bridge ? list->bridge->spilled : 0;
}

void gbg_cuda_bridge_release(struct gbg_device *device, struct gbg_list *list)
{
    (void)device;
    gbg_release(list->bridge);
    list->bridge = NULL;
}

static double of_bits(unsigned long long bits)
{
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* 1 if no pair overlaps, as far as that is known from the found ones. */
static int is_clear(const struct bridge_work *work, const struct bridge_results *seen)
{
    double farthest_push = sqrt(of_bits(seen->farthest));
    if (8 * (int64_t)seen->found > work->n ||
        2.0 * farthest_push > 0.99 * work->plan.look * work->plan.unit) {
        return 0;
    }
    return !seen->overlapping;
}

static double slack_of(const struct gbg_list *list)
{
    return 0.5 * (list->radius - list->reach) * 0.999;
}

/* What a step is solved with; 0: there is nothing to do. */
static int describe(const struct gbg_state *state, const struct gbg_list *list,
                    const struct gbg_contacts *contacts, uint64_t step, struct bridge_work *work)
{
    work->n = list->rows.n;
    work->seed = contacts->noise->seed;
    work->run = contacts->noise->run;
    work->step = step;
    return bridge_make_plan(&work->plan, state, work->n, list->reach, contacts);
}

int gbg_cuda_bridge_reserve(struct gbg_device *device, const struct gbg_state *state,
                            struct gbg_list *list, const struct gbg_contacts *contacts)
{
    struct bridge_work work = {};
    void *base, *scan;
    size_t scan_bytes;
    if (!describe(state, list, contacts, 0, &work)) {
        return GBG_OK;
    }
    int status = keep_work(device, list);
    return status ? status : take_workspace(device, list, &work, &base, &scan, &scan_bytes);
}

int gbg_cuda_bridge_start(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                          const struct gbg_contacts *contacts, uint64_t step, const int *halt,
                          struct bridge_results **results, int64_t *capacity)
{
    struct bridge_work work = {};
    *results = NULL;
    *capacity = 0;
    if (!describe(state, list, contacts, step, &work)) {
        return GBG_OK;
    }
    work.halt = halt;
    int status = keep_work(device, list);
    status = status
                 ? status
                 : attempt(device, state, list, &work, slack_of(list), 1.0 - contacts->tolerance);
    *results = work.results;
    *capacity = work.capacity;
    return status;
}

int gbg_cuda_bridge(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                    struct gbg_contacts *contacts)
{
    struct bridge_work work = {};
    struct bridge_results seen = {};
    contacts->rounds = contacts->pairs = contacts->left = contacts->stopped = 0;
    contacts->largest = contacts->virial = 0.0;
    contacts->clear = 0;
    if (!describe(state, list, contacts, contacts->step, &work)) {
        return GBG_OK;
    }
    double slack = slack_of(list);
    int status = keep_work(device, list);
    for (int fits = 0; status == GBG_OK && !fits;) {
        status = attempt(device, state, list, &work, slack, 1.0 - contacts->tolerance);
        status = status ? status : gbg_cuda_fetch(device, &seen, work.results, sizeof seen);
        fits = status != GBG_OK || (int64_t)seen.found <= work.capacity;
        if (!fits) {
            list->bridge->capacity = (int64_t)(seen.found + seen.found / 2);
        }
    }
    if (status != GBG_OK) {
        return status;
    }
    list->bridge->spilled = seen.spilled;
    if (seen.found == 0) {
        contacts->clear = 1;
        return GBG_OK;
    }
    contacts->rounds = (int64_t)seen.sweeps;
    contacts->stopped = (int64_t)seen.stopped;
    contacts->pairs = (int64_t)seen.pairs;
    contacts->largest = sqrt(of_bits(seen.largest));
    contacts->virial = (double)(int64_t)seen.virial * 0x1p-40 * work.plan.unit * work.plan.unit;
    if (seen.stale) {
        return gbg_cuda_list_build(device, state, list);
    }
    contacts->clear = is_clear(&work, &seen);
    return GBG_OK;
}
