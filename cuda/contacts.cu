/* L1, CUDA: hard cores: rounds of pair corrections until an exact check finds no overlap. */
#include "cuda/kernels.h"

#include "backend/cpu/contacts_pair.h"
#include "cuda/list.h"

/* Rounds are started a few at a time, so that the host seldom waits: those after the last return at
 * once. */
enum { FEWEST = 4, MOST = 16, BLOCKS = 16 };

/* What one round found and did; all zero: it has not been made. */
struct tally {
    unsigned long long pairs, virial;
    int stale, unused;
};
struct batch {
    unsigned long long largest; /* bits of the squared displacement */
    struct tally tally[MOST + 1];
};

/* Everything that a round reads but the particles. A warp works on a slice of the list: in `moved`
 * each has a word, whose bit l says that particle l of the slice has a push. */
struct work {
    struct gbg_push_rule rule;
    struct gbg_cuda_rows rows;
    float limit;
    double slack_squared; /* a list is stale when somebody has moved farther */
    unsigned char *look;
    uint32_t *moved;
    int64_t *push[3];
};

/* Whether two particles may touch, by 32-bit coordinates with room for their rounding. */
template <int dimension>
static __device__ __forceinline__ bool may_touch(const struct work &work, const uint32_t own[3],
                                                 int64_t j)
{
    float squared = 0.0f;
    for (int a = 0; a < dimension; a++) {
        float d = (float)(int32_t)(own[a] - work.rows.local[a][j]) * work.rows.scale[a];
        squared += d * d;
    }
    return squared < work.limit;
}

/* What all overlaps of particle i push it by; returns their number. The exact test is made after
 * 32 neighbours have been looked at, so that few threads wait for others in it. */
template <int dimension>
static __device__ __forceinline__ int find_push(const struct gbg_state &state,
                                                const struct work &work, int64_t i, int64_t push[3],
                                                unsigned long long *pairs, int64_t *virial)
{
    const struct gbg_cuda_rows &rows = work.rows;
    int64_t slice = i / GBG_CUDA_SLICE;
    const int32_t *row = rows.index + rows.offset[slice] + i % GBG_CUDA_SLICE;
    int32_t width = rows.width[slice];
    uint32_t own[3];
    int found = 0;
    for (int a = 0; a < dimension; a++) {
        own[a] = rows.local[a][i];
    }
    for (int32_t begin = 0; begin < width; begin += 32) {
        int32_t count = width - begin < 32 ? width - begin : 32;
        uint32_t near = 0;
#pragma unroll 4
        for (int32_t k = 0; k < count; k++) {
            int64_t j = row[(int64_t)(begin + k) * GBG_CUDA_SLICE];
            near |= (uint32_t)(may_touch<dimension>(work, own, j) && j != i) << k;
        }
        for (; near != 0; near &= near - 1) {
            int32_t k = begin + __ffs((int)near) - 1;
            int64_t j = row[(int64_t)k * GBG_CUDA_SLICE];
            if (gbg_push_pair(&work.rule, &state, dimension, i, j, push, virial)) {
                found++;
                *pairs += i < j;
            }
        }
    }
    return found;
}

static __device__ __forceinline__ void add_up(unsigned long long *sum, unsigned long long value)
{
    for (int lane = 16; lane > 0; lane /= 2) {
        value += __shfl_xor_sync(0xFFFFFFFFu, value, lane);
    }
    if ((threadIdx.x & 31) == 0 && value != 0) {
        atomicAdd(sum, value);
    }
}

/* Finds the pushes of all particles, or of those that the last round marked, from places that no
 * thread changes meanwhile. `last` is the round before in this batch: nothing is left to do if it
 * parted nobody, and nothing may be read of a list that it made stale. */
template <int dimension, bool all>
static __global__ void __launch_bounds__(GBG_CUDA_THREADS, 8)
    find(const __grid_constant__ struct gbg_state state, const __grid_constant__ struct work work,
         struct tally *tally, const struct tally *last)
{
    if (last && (last->pairs == 0 || last->stale)) {
        return;
    }
    unsigned long long pairs = 0;
    int64_t virial = 0, step = (int64_t)gridDim.x * blockDim.x / GBG_CUDA_SLICE;
    int lane = threadIdx.x & 31;
    for (int64_t slice = gbg_cuda_index() / GBG_CUDA_SLICE; slice < work.rows.slices;
         slice += step) {
        int64_t i = slice * GBG_CUDA_SLICE + lane, push[3] = {0, 0, 0};
        bool looked_at = i < work.rows.n && (all || work.look[i]);
        int found = 0;
        if (looked_at) {
            work.look[i] = 0;
            found = find_push<dimension>(state, work, i, push, &pairs, &virial);
        }
        if (found > 0 && work.rule.parting == GBG_PARTING_CARTER) {
            gbg_push_cut(&work.rule, &state, dimension, i, push);
        }
        for (int a = 0; found > 0 && a < dimension; a++) {
            work.push[a][i] = push[a];
        }
        uint32_t moved = __ballot_sync(0xFFFFFFFFu, found > 0);
        if (lane == 0) {
            work.moved[slice] = moved;
        }
    }
    add_up(&tally->pairs, pairs);
    add_up(&tally->virial, (unsigned long long)virial);
}

/* Several threads may mark the same particle: all write the same. */
static __device__ __forceinline__ void mark_around(const struct work &work, int64_t i)
{
    int64_t slice = i / GBG_CUDA_SLICE;
    const int32_t *row = work.rows.index + work.rows.offset[slice] + i % GBG_CUDA_SLICE;
    int32_t width = work.rows.width[slice];
    work.look[i] = 1;
    for (int32_t k = 0; k < width; k++) {
        work.look[row[(int64_t)k * GBG_CUDA_SLICE]] = 1;
    }
}

/* Moves whoever has a push, and marks him and his neighbours for the next round. */
template <int dimension>
static __global__ void move(const __grid_constant__ struct gbg_state state,
                            const __grid_constant__ struct work work, struct tally *tally,
                            unsigned long long *largest)
{
    if (tally->pairs == 0) {
        return;
    }
    double farthest = 0.0;
    bool stale = false;
    int lane = threadIdx.x & 31;
    int64_t step = (int64_t)gridDim.x * blockDim.x / GBG_CUDA_SLICE;
    for (int64_t slice = gbg_cuda_index() / GBG_CUDA_SLICE; slice < work.rows.slices;
         slice += step) {
        if (!(work.moved[slice] >> lane & 1)) {
            continue;
        }
        int64_t i = slice * GBG_CUDA_SLICE + lane, push[3] = {0, 0, 0};
        for (int a = 0; a < dimension; a++) {
            push[a] = work.push[a][i];
        }
        double pushed = gbg_push_apply(&state, dimension, i, push);
        for (int a = 0; a < dimension; a++) {
            work.rows.local[a][i] =
                gbg_cuda_local(state.high[a][i], state.low[a][i], work.rows.shift[a]);
        }
        stale |= pushed > work.slack_squared ||
                 gbg_cuda_moved_squared(work.rows, i) > work.slack_squared;
        if (state.overlapped) {
            state.overlapped[i] = 1;
        }
        double far = state.start_high[0] ? gbg_push_displaced(&state, dimension, i) : 0.0;
        farthest = far > farthest ? far : farthest;
        mark_around(work, i);
    }
    if (stale) {
        tally->stale = 1;
    }
    gbg_cuda_max(largest, farthest);
}

static int reserve(struct gbg_device *device, struct gbg_list *list)
{
    int64_t n = list->rows.n;
    int status = GBG_OK;
    if (!list->look) {
        status = gbg_cuda_allocate(device, (void **)&list->look, n, 1, "contact marks");
    }
    if (status == GBG_OK && !list->moved) {
        status = gbg_cuda_allocate(device, (void **)&list->moved, list->rows.slices,
                                   sizeof *list->moved, "contact moves");
    }
    for (int a = 0; status == GBG_OK && a < list->rows.dimension; a++) {
        if (!list->push[a]) {
            status = gbg_cuda_allocate(device, (void **)&list->push[a], n, sizeof *list->push[a],
                                       "contact pushes");
        }
    }
    return status;
}

void gbg_cuda_contacts_release(struct gbg_device *device, struct gbg_list *list)
{
    int64_t n = list->rows.n;
    gbg_cuda_release(device, list->look, n, 1);
    gbg_cuda_release(device, list->moved, list->rows.slices, sizeof *list->moved);
    for (int a = 0; a < list->rows.dimension; a++) {
        gbg_cuda_release(device, list->push[a], n, sizeof *list->push[a]);
        list->push[a] = NULL;
    }
    list->look = NULL;
    list->moved = NULL;
}

/* Anew for every batch: a build may have moved the list's arrays. */
static struct work make_work(const struct gbg_list *list, const struct gbg_push_rule *rule)
{
    struct work work;
    double slack = 0.5 * (list->radius - list->reach) * 0.999;
    work.rule = *rule;
    work.rows = list->rows;
    work.limit = gbg_push_limit(rule);
    work.slack_squared = slack * slack;
    work.look = list->look;
    work.moved = (uint32_t *)list->moved;
    for (int a = 0; a < 3; a++) {
        work.push[a] = list->push[a];
    }
    return work;
}

/* `finds` looks, each but perhaps the last followed by a move. */
template <int dimension>
static int start(struct gbg_device *device, const struct gbg_state *state, const struct work *work,
                 int all, int finds, int moves, struct batch *batch)
{
    unsigned most = (unsigned)(BLOCKS * device->multiprocessors);
    unsigned blocks = gbg_cuda_blocks(work->rows.slices * GBG_CUDA_SLICE);
    blocks = blocks < most ? blocks : most;
    for (int r = 0; r < finds; r++) {
        struct tally *tally = &batch->tally[r], *last = r > 0 ? tally - 1 : NULL;
        if (all && r == 0) {
            find<dimension, true>
                <<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, *work, tally, last);
        } else {
            find<dimension, false>
                <<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, *work, tally, last);
        }
        if (r < moves) {
            move<dimension><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, *work, tally,
                                                                             &batch->largest);
        }
    }
    return gbg_cuda_started(device, "contacts");
}

static int run(struct gbg_device *device, const struct gbg_state *state, const struct work *work,
               int all, int finds, int moves, struct batch *batch)
{
    void *memory;
    int status = gbg_cuda_workspace(device, sizeof *batch, &memory);
    status = status ? status : gbg_cuda_clear(device, memory, sizeof *batch);
    if (status == GBG_OK) {
        status = state->box.dimension == 2
                     ? start<2>(device, state, work, all, finds, moves, (struct batch *)memory)
                     : start<3>(device, state, work, all, finds, moves, (struct batch *)memory);
    }
    return status ? status : gbg_cuda_fetch(device, batch, memory, sizeof *batch);
}

/* What a call has summed up so far. */
struct sums {
    unsigned long long virial;
    double largest; /* squared */
};
enum outcome { DONE, STALE, MORE };

/* Adds the rounds of a batch up, and says how it ended. */
static enum outcome take(struct gbg_contacts *contacts, const struct batch *batch, int finds,
                         int moves, struct sums *sums)
{
    double largest;
    memcpy(&largest, &batch->largest, sizeof largest);
    sums->largest = largest > sums->largest ? largest : sums->largest;
    for (int r = 0; r < finds; r++) {
        const struct tally *tally = &batch->tally[r];
        contacts->left = (int64_t)tally->pairs;
        if (tally->pairs == 0 || r == moves) {
            return DONE;
        }
        contacts->rounds++;
        contacts->pairs += (int64_t)tally->pairs;
        sums->virial += tally->virial;
        if (tally->stale) {
            return STALE;
        }
    }
    return MORE;
}

int gbg_cuda_contacts(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                      struct gbg_contacts *contacts)
{
    const struct gbg_push_rule rule = gbg_push_rule_make(state, contacts);
    struct sums sums = {0, 0.0};
    enum outcome outcome = STALE; /* all are looked at first */
    contacts->rounds = contacts->pairs = contacts->left = contacts->stopped = 0;
    contacts->largest = contacts->virial = 0.0;
    int status = reserve(device, list);
    if (status != GBG_OK || list->rows.n == 0) {
        return status;
    }
    for (int size = FEWEST; outcome != DONE; size = size < MOST ? 2 * size : MOST) {
        struct batch batch;
        const struct work work = make_work(list, &rule);
        int64_t left = contacts->max_rounds < 0 ? size : contacts->max_rounds - contacts->rounds;
        int moves = left < size ? (int)left : size;
        int finds = moves < size ? moves + 1 : size; /* the last only counts what is left */
        status = run(device, state, &work, outcome == STALE, finds, moves, &batch);
        if (status != GBG_OK) {
            return status;
        }
        outcome = take(contacts, &batch, finds, moves, &sums);
        if (outcome == STALE) {
            status = gbg_cuda_list_build(device, state, list);
        }
        if (status != GBG_OK) {
            return status;
        }
    }
    contacts->largest = sqrt(sums.largest);
    contacts->virial = (double)(int64_t)sums.virial * rule.virial_unit;
    return GBG_OK;
}
