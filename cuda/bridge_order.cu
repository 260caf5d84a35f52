/* L1, CUDA: rule bridge: the records of each block in the order of sweeps: sorted by key, coloured
 * greedily in that order, and laid down colour by colour. A thread block a block. */
#include "cuda/bridge.h"

enum {
    BINS_A_THREAD = 8,  /* of keys, spread by their top bits */
    SLOT_BYTES = 12,    /* of a table: a word and a mask */
    LEAST_SLOTS = 1024, /* that much fits everywhere */
    LOOKS = 64,         /* for a disc, in a table that may be too small */
    TOGETHER = 16,      /* thread blocks of 128 threads that a multiprocessor takes */
    KEPT_BACK = 2048    /* bytes a thread block: its other shared memory */
};
static const uint32_t NOBODY = 0xFFFFFFFFu;

/* A block's part of the arrays. */
struct part {
    int64_t first;
    uint32_t n;
    bridge_key *key, *other;
    const int2 *ends; /* unordered */
    int2 *slot;
};

/* The discs of a block, found by hashing. Their indices give way to claims (colour_pairs). */
struct table {
    uint32_t slots;
    uint32_t *word;
    unsigned long long *used; /* colours of a disc's pairs */
};

static __device__ __forceinline__ uint32_t bin_of(bridge_key key)
{
    return __umulhi((uint32_t)(key >> 32), BINS_A_THREAD * blockDim.x);
}

/* Where bins begin, from their counts. */
static __device__ void scan_bins(uint32_t *bin)
{
    __shared__ uint32_t of_warp[BRIDGE_MOST_THREADS / 32];
    uint32_t *own = bin + threadIdx.x * BINS_A_THREAD, sum = 0;
    for (int k = 0; k < BINS_A_THREAD; k++) {
        sum += own[k];
    }
    uint32_t upto = bridge_warp_upto(sum), begin = upto - sum;
    if ((threadIdx.x & 31u) == 31) {
        of_warp[threadIdx.x / 32] = upto;
    }
    __syncthreads();
    for (uint32_t warp = 0; warp < threadIdx.x / 32; warp++) {
        begin += of_warp[warp];
    }
    for (int k = 0; k < BINS_A_THREAD; k++) {
        uint32_t count = own[k];
        own[k] = begin;
        begin += count;
    }
    __syncthreads();
}

static __device__ bool precedes(const struct gbg_state &state, const int2 *ends, bridge_key a,
                                bridge_key b)
{
    if (a >> 32 != b >> 32) {
        return a >> 32 < b >> 32;
    }
    int2 first = ends[(uint32_t)a], second = ends[(uint32_t)b];
    return bridge_precedes(&state, first.x, first.y, second.x, second.y);
}

/* Sorts keys: into bins, in `other`, and from there to its place each, which is known from the
 * other keys of its bin. */
static __device__ void sort_keys(const struct gbg_state &state, const struct part &part,
                                 uint32_t *bin)
{
    for (uint32_t b = threadIdx.x; b < BINS_A_THREAD * blockDim.x; b += blockDim.x) {
        bin[b] = 0;
    }
    __syncthreads();
    for (uint32_t k = threadIdx.x; k < part.n; k += blockDim.x) {
        atomicAdd(&bin[bin_of(part.key[k])], 1u);
    }
    __syncthreads();
    scan_bins(bin);
    for (uint32_t k = threadIdx.x; k < part.n; k += blockDim.x) {
        bridge_key key = part.key[k];
        part.other[atomicAdd(&bin[bin_of(key)], 1u)] = key;
    }
    __syncthreads();
    for (uint32_t k = threadIdx.x; k < part.n; k += blockDim.x) {
        bridge_key own = part.other[k];
        uint32_t b = bin_of(own), end = bin[b]; /* now the ends of the bins */
        uint32_t begin = b > 0 ? bin[b - 1] : 0, place = begin;
        for (uint32_t q = begin; q < end; q++) {
            place += q != k && precedes(state, part.ends, part.other[q], own);
        }
        part.key[place] = own;
    }
    __syncthreads();
}

/* The slot of disc i, which is taken up if it is new; table.slots: none was found in that many
 * looks. */
static __device__ __forceinline__ uint32_t slot_of(const struct table &table, uint32_t looks,
                                                   uint32_t i)
{
    uint32_t slot = __umulhi(i * 2654435769u, table.slots); /* 2^32 over the golden ratio */
    for (uint32_t k = 0; k < looks; k++) {
        uint32_t there = atomicCAS(&table.word[slot], NOBODY, i);
        if (there == NOBODY || there == i) {
            return slot;
        }
        slot = slot + 1 < table.slots ? slot + 1 : 0;
    }
    return table.slots;
}

/* Puts the discs of a block into a table: the slots of all ends, in the order of keys; words and
 * masks are zero then. 0: they do not fit. */
static __device__ __forceinline__ bool number_discs(const struct part &part,
                                                    const struct table &table, uint32_t looks)
{
    bool lost = false;
    for (uint32_t s = threadIdx.x; s < table.slots; s += blockDim.x) {
        table.word[s] = NOBODY;
        table.used[s] = 0;
    }
    __syncthreads();
    for (uint32_t k = threadIdx.x; k < part.n && !lost; k += blockDim.x) {
        int2 ends = part.ends[(uint32_t)part.key[k]];
        uint32_t i = slot_of(table, looks, (uint32_t)ends.x);
        uint32_t j = slot_of(table, looks, (uint32_t)ends.y);
        lost = i == table.slots || j == table.slots;
        part.slot[k] = make_int2((int)i, (int)j);
    }
    if (__syncthreads_or(lost)) {
        return false;
    }
    for (uint32_t s = threadIdx.x; s < table.slots; s += blockDim.x) {
        table.word[s] = 0;
    }
    return true;
}

/* The lowest colour that is free at both discs of a pair, or the last. */
static __device__ __forceinline__ int take_colour(unsigned long long *used, int2 slot)
{
    unsigned long long first = used[slot.x], second = used[slot.y], taken = first | second;
    int colour = ~taken ? __ffsll((long long)~taken) - 1 : BRIDGE_COLOURS - 1;
    used[slot.x] = first | 1ull << colour;
    used[slot.y] = second | 1ull << colour;
    return colour;
}

static __device__ __forceinline__ int2 slots_of(const struct part &part, uint32_t k)
{
    return k < part.n ? part.slot[k] : make_int2(0, 0);
}

/* The greedy colouring in the order of keys: a pair a thread at a time, in rounds. In each every
 * pair that has no colour yet claims its two discs; the claim of an earlier pair is the larger, and
 * so is one of a later round. Who has both has no uncoloured pair before it that shares a disc, and
 * takes its colour. `other` receives the colour and the place among its pairs, counted in
 * `counter`: pairs of one colour that share a disc, which only the last has, are in the order of
 * keys. */
static __device__ __forceinline__ void colour_pairs(const struct part &part,
                                                    const struct table &table, uint32_t *counter)
{
    int2 next = slots_of(part, threadIdx.x);
    for (uint32_t base = 0; base < part.n; base += blockDim.x) {
        uint32_t k = base + threadIdx.x, claim = blockDim.x - threadIdx.x;
        int2 slot = next;
        bool waits = k < part.n;
        next = slots_of(part, k + blockDim.x); /* fetched ahead */
        for (; __syncthreads_or(waits); claim += blockDim.x) {
            if (waits) {
                atomicMax(&table.word[slot.x], claim);
                atomicMax(&table.word[slot.y], claim);
            }
            __syncthreads();
            if (waits && table.word[slot.x] == claim && table.word[slot.y] == claim) {
                int colour = take_colour(table.used, slot);
                uint32_t place = atomicAdd(&counter[colour], 1u);
                part.other[k] = (bridge_key)(uint32_t)colour << 32 | place;
                waits = false;
            }
        }
        if (k < part.n) { /* for the next pairs; pairs that share a disc do the same */
            atomicExch(&table.word[slot.x], 0u);
            atomicExch(&table.word[slot.y], 0u);
        }
    }
}

/* Where colours begin; tables for the sweeps. Every colour below a used one is used. */
static __device__ void close_colours(const struct bridge_work &work, uint32_t *counter)
{
    uint32_t end = 0;
    int colour = 0;
    for (; colour < BRIDGE_COLOURS && counter[colour] > 0; colour++) {
        uint32_t begin = end;
        end += counter[colour];
        counter[colour] = begin;
        work.colour_end[(int64_t)blockIdx.x * BRIDGE_COLOURS + colour] = end;
    }
    work.colours[blockIdx.x] = colour;
}

/* Puts the records of a block into the order of sweeps. */
template <int dimension>
static __device__ void lay_records(const struct bridge_work &work, const struct part &part,
                                   const uint32_t *begin)
{
    float depth = 0.0f;
    for (uint32_t k = threadIdx.x; k < part.n; k += blockDim.x) {
        bridge_key place = part.other[k];
        int64_t from = part.first + (uint32_t)part.key[k];
        int64_t to = part.first + begin[place >> 32] + (uint32_t)place;
        float half_base = work.raw.half_base[from], gap = work.raw.gap[from];
        float distance = work.raw.distance[from], overlap = bridge_depth(gap, half_base);
        depth = overlap > depth ? overlap : depth;
        work.pair.ends[to] = work.raw.ends[from];
        work.pair.half_base[to] = half_base;
        work.pair.gap[to] = gap;
        work.pair.quarter_draw[to] = work.raw.quarter_draw[from];
        work.pair.distance[to] = distance;
        work.push[to] = 0.0f;
        for (int a = 0; a < dimension; a++) {
            float start = work.raw.start[a][from];
            work.pair.start[a][to] = start;
            work.pair.free[a][to] = work.raw.free[a][from];
            work.normal[a][to] = bridge_half_unit(start, distance);
        }
    }
    unsigned bits = __reduce_max_sync(BRIDGE_WARP, (unsigned)__float_as_int(depth));
    if ((threadIdx.x & 31u) == 0 && bits > 0) {
        atomicMax(&work.results->depth, bits);
    }
}

/* Numbers the discs and colours the pairs: in the table in shared memory, or, if that is too small,
 * in one with two slots a pair, which has room for all: in the block's part of `used`, and of
 * records that are not laid down yet. */
static __device__ void number_and_colour(const struct bridge_work &work, const struct part &part,
                                         unsigned long long *shared, uint32_t *counter)
{
    uint32_t slots = work.slots;
    struct table small = {slots, (uint32_t *)(shared + slots), shared};
    if (number_discs(part, small, slots < LOOKS ? slots : LOOKS)) {
        colour_pairs(part, small, counter);
        return;
    }
    struct table large = {2 * part.n, (uint32_t *)(work.pair.ends + part.first),
                          work.used + 2 * part.first};
    number_discs(part, large, large.slots);
    colour_pairs(part, large, counter);
    if (threadIdx.x == 0) {
        atomicAdd(&work.results->spilled, 1u);
    }
}

/* Shared memory holds the bins of keys first, then the table of discs. */
template <int dimension>
static __global__ void __launch_bounds__(BRIDGE_MOST_THREADS)
    order(const __grid_constant__ struct gbg_state state,
          const __grid_constant__ struct bridge_work work)
{
    extern __shared__ unsigned long long shared[];
    __shared__ uint32_t counter[BRIDGE_COLOURS];
    if (bridge_idle(work)) {
        return;
    }
    int64_t first = work.first[blockIdx.x];
    struct part part = {first,
                        work.count[blockIdx.x],
                        work.key + first,
                        work.other + first,
                        work.raw.ends + first,
                        work.sorted + first};
    if (part.n == 0) {
        if (threadIdx.x == 0) {
            work.colours[blockIdx.x] = 0;
        }
        return;
    }
    if (threadIdx.x < BRIDGE_COLOURS) {
        counter[threadIdx.x] = 0;
    }
    sort_keys(state, part, (uint32_t *)shared); /* waits for all threads, at its end too */
    number_and_colour(work, part, shared, counter);
    __syncthreads();
    if (threadIdx.x == 0) {
        close_colours(work, counter);
    }
    __syncthreads();
    lay_records<dimension>(work, part, counter);
}

/* Asks once how much shared memory a thread block can have, and asks for all of it, so that no
 * other engine's kernel finds less. */
static int ask_shared(struct gbg_device *device, struct gbg_cuda_bridge *kept, int *room,
                      const void *kernel)
{
    cudaFuncAttributes own = {};
    int most = 0;
    cudaError_t error = cudaDeviceGetAttribute(
        &kept->shared, cudaDevAttrMaxSharedMemoryPerMultiprocessor, device->number);
    error = error ? error
                  : cudaDeviceGetAttribute(&most, cudaDevAttrMaxSharedMemoryPerBlockOptin,
                                           device->number);
    error = error ? error : cudaFuncGetAttributes(&own, kernel);
    most -= (int)own.sharedSizeBytes;
    error = error ? error
                  : cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, most);
    int status = gbg_cuda_status(device, error, "bridge: asking for shared memory");
    *room = status == GBG_OK ? most : 0;
    return status;
}

/* Slots of the tables in shared memory: many, but so that as many thread blocks are at work as
 * there are, or as fit on a multiprocessor. */
static unsigned choose_slots(const struct gbg_device *device, const struct gbg_cuda_bridge *kept,
                             const struct bridge_work *work, int room)
{
    int64_t each = (work->plan.n_blocks + device->multiprocessors - 1) / device->multiprocessors;
    int64_t bytes = kept->shared / (each < TOGETHER ? each : TOGETHER) - KEPT_BACK;
    int64_t slots = bytes / SLOT_BYTES, least = 3 * work->n / (2 * work->plan.n_blocks);
    least = least > LEAST_SLOTS ? least : LEAST_SLOTS;
    slots = slots > least ? slots : least;
    slots = slots < room / SLOT_BYTES ? slots : room / SLOT_BYTES;
    return (unsigned)(slots < kept->slots ? slots : kept->slots);
}

int gbg_cuda_bridge_order(struct gbg_device *device, struct gbg_cuda_bridge *kept,
                          const struct gbg_state *state, struct bridge_work *work)
{
    bool flat = work->plan.dimension == 2;
    auto *ordering = flat ? order<2> : order<3>;
    int *room = &kept->room[flat ? 0 : 1];
    int status = *room > 0 ? GBG_OK : ask_shared(device, kept, room, (const void *)ordering);
    if (status != GBG_OK) {
        return status;
    }
    unsigned blocks = (unsigned)work->plan.n_blocks;
    unsigned threads = BRIDGE_THREADS << bridge_wider(device, work, blocks);
    work->slots = choose_slots(device, kept, work, *room);
    size_t bins = BINS_A_THREAD * threads * sizeof(uint32_t);
    size_t table = SLOT_BYTES * work->slots, bytes = bins > table ? bins : table;
    ordering<<<blocks, threads, bytes, device->stream>>>(*state, *work);
    return gbg_cuda_started(device, "bridge: ordering pairs");
}
