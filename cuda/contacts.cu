/* L1, CUDA: hard cores: rounds of pair corrections until an exact check finds no overlap. */
#include "cuda/kernels.h"

#include "cuda/contacts.h"

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

/* What a round reads but the particles. */
struct work {
    struct gbg_cuda_rounds rounds;
    double slack_squared; /* a list is stale when somebody has moved farther */
};

static __device__ __forceinline__ void add_up(unsigned long long *sum, unsigned long long value)
{
    for (int lane = 16; lane > 0; lane /= 2) {
        value += __shfl_xor_sync(0xFFFFFFFFu, value, lane);
    }
    if ((threadIdx.x & 31) == 0 && value != 0) {
        atomicAdd(sum, value);
    }
}

/* Finds the pushes of all particles (their flags are then those of `turn`), or those that come of
 * the last moves. `last` is the round before in this batch: nothing is left to do if it parted
 * nobody, and nothing may be read of a list that it made stale. */
template <int dimension, bool all>
static __global__ void __launch_bounds__(GBG_CUDA_THREADS, 8)
    find(const __grid_constant__ struct gbg_state state, const __grid_constant__ struct work work,
         int turn, struct tally *tally, const struct tally *last)
{
    if (last && (last->pairs == 0 || last->stale)) {
        return;
    }
    unsigned long long pairs = 0;
    int64_t virial = 0;
    if (all) {
        gbg_cuda_find_all<dimension>(state, work.rounds, turn, &pairs, &virial);
    } else {
        gbg_cuda_find_moved<dimension>(state, work.rounds, turn, &pairs, &virial);
    }
    add_up(&tally->pairs, pairs);
    add_up(&tally->virial, (unsigned long long)virial);
}

/* Moves whoever has a push. */
template <int dimension>
static __global__ void move(const __grid_constant__ struct gbg_state state,
                            const __grid_constant__ struct work work, int turn, struct tally *tally,
                            unsigned long long *largest)
{
    if (tally->pairs == 0) {
        return;
    }
    double farthest = 0.0;
    bool stale = false;
    const struct gbg_cuda_rows &rows = work.rounds.rows;
    gbg_cuda_push_apart<dimension>(state, work.rounds, turn, [&](int64_t i, double pushed) {
        for (int a = 0; a < dimension; a++) {
            rows.local[a][i] = gbg_cuda_local(state.high[a][i], state.low[a][i], rows.shift[a]);
        }
        stale |=
            pushed > work.slack_squared || gbg_cuda_moved_squared(rows, i) > work.slack_squared;
        double far = state.start_high[0] ? gbg_push_displaced(&state, dimension, i) : 0.0;
        farthest = far > farthest ? far : farthest;
    });
    if (stale) {
        tally->stale = 1;
    }
    gbg_cuda_max(largest, farthest);
}

static int64_t flags_of(const struct gbg_list *list)
{
    return (list->rows.n + GBG_CUDA_FLAGS - 1) / GBG_CUDA_FLAGS * GBG_CUDA_FLAGS;
}

int gbg_cuda_contacts_reserve(struct gbg_device *device, struct gbg_list *list)
{
    int status = GBG_OK;
    for (int k = 0; k < 2 && status == GBG_OK; k++) {
        if (!list->moved[k]) {
            status = gbg_cuda_allocate(device, (void **)&list->moved[k], flags_of(list), 1,
                                       "contact marks");
            status =
                status ? status : gbg_cuda_clear(device, list->moved[k], (size_t)flags_of(list));
        }
    }
    if (status == GBG_OK && !list->push) {
        int64_t numbers = list->rows.n * list->rows.dimension;
        status = gbg_cuda_allocate(device, (void **)&list->push, numbers, sizeof *list->push,
                                   "contact pushes");
        status = status ? status
                        : gbg_cuda_clear(device, list->push, (size_t)numbers * sizeof *list->push);
    }
    return status;
}

void gbg_cuda_contacts_release(struct gbg_device *device, struct gbg_list *list)
{
    for (int k = 0; k < 2; k++) {
        gbg_cuda_release(device, list->moved[k], flags_of(list), 1);
        list->moved[k] = NULL;
    }
    gbg_cuda_release(device, list->push, list->rows.n * list->rows.dimension, sizeof *list->push);
    list->push = NULL;
}

struct gbg_cuda_rounds gbg_cuda_rounds_make(const struct gbg_list *list,
                                            const struct gbg_push_rule *rule,
                                            const struct gbg_cuda_sieve *sieve)
{
    struct gbg_cuda_rounds rounds = {
        *rule, list->rows, *sieve, {list->moved[0], list->moved[1]}, list->push};
    return rounds;
}

/* Anew for every batch: a build may have moved the list's arrays. */
static struct work make_work(const struct gbg_list *list, const struct gbg_push_rule *rule)
{
    struct gbg_cuda_sieve sieve = {{}, {}, gbg_push_limit(rule)};
    double slack = 0.5 * (list->radius - list->reach) * 0.999;
    for (int a = 0; a < 3; a++) {
        sieve.coordinate[a] = list->rows.local[a];
        sieve.scale[a] = list->rows.scale[a];
    }
    return {gbg_cuda_rounds_make(list, rule, &sieve), slack * slack};
}

/* What a batch of rounds is to do: `finds` looks, each but perhaps the last followed by a move. */
struct order {
    int all;  /* 1: the first look is at all particles */
    int turn; /* the flags of the last move */
    int finds, moves;
};

template <int dimension>
static int start(struct gbg_device *device, const struct gbg_state *state, const struct work *work,
                 struct order *order, struct batch *batch)
{
    unsigned most = (unsigned)(BLOCKS * device->multiprocessors);
    unsigned blocks = gbg_cuda_blocks(work->rounds.rows.slices * GBG_CUDA_SLICE);
    blocks = blocks < most ? blocks : most;
    for (int r = 0; r < order->finds; r++) {
        struct tally *tally = &batch->tally[r], *last = r > 0 ? tally - 1 : NULL;
        if (order->all && r == 0) {
            find<dimension, true><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(
                *state, *work, order->turn, tally, last);
        } else {
            find<dimension, false><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(
                *state, *work, order->turn, tally, last);
            order->turn = 1 - order->turn;
        }
        if (r < order->moves) {
            move<dimension><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(
                *state, *work, order->turn, tally, &batch->largest);
        }
    }
    return gbg_cuda_started(device, "contacts");
}

static int run(struct gbg_device *device, const struct gbg_state *state, const struct work *work,
               struct order *order, struct batch *batch)
{
    void *memory;
    int status = gbg_cuda_workspace(device, sizeof *batch, &memory);
    status = status ? status : gbg_cuda_clear(device, memory, sizeof *batch);
    if (status == GBG_OK) {
        status = state->box.dimension == 2
                     ? start<2>(device, state, work, order, (struct batch *)memory)
                     : start<3>(device, state, work, order, (struct batch *)memory);
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
static enum outcome take(struct gbg_contacts *contacts, const struct batch *batch,
                         const struct order *order, struct sums *sums)
{
    double largest;
    memcpy(&largest, &batch->largest, sizeof largest);
    sums->largest = largest > sums->largest ? largest : sums->largest;
    for (int r = 0; r < order->finds; r++) {
        const struct tally *tally = &batch->tally[r];
        contacts->left = (int64_t)tally->pairs;
        if (tally->pairs == 0 || r == order->moves) {
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
    struct order order = {};
    enum outcome outcome = STALE; /* all are looked at first */
    contacts->rounds = contacts->pairs = contacts->left = contacts->stopped = 0;
    contacts->largest = contacts->virial = 0.0;
    int status = gbg_cuda_contacts_reserve(device, list);
    if (status != GBG_OK || list->rows.n == 0) {
        return status;
    }
    for (int size = FEWEST; outcome != DONE; size = size < MOST ? 2 * size : MOST) {
        struct batch batch;
        const struct work work = make_work(list, &rule);
        int64_t left = contacts->max_rounds < 0 ? size : contacts->max_rounds - contacts->rounds;
        order.all = outcome == STALE;
        order.moves = left < size ? (int)left : size;
        /* the last only counts what is left */
        order.finds = order.moves < size ? order.moves + 1 : size;
        status = run(device, state, &work, &order, &batch);
        if (status != GBG_OK) {
            return status;
        }
        outcome = take(contacts, &batch, &order, &sums);
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
