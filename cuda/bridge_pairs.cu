/* L1, CUDA: rule bridge: which pairs a step has to solve, and their records in the order of sweeps.
 */
#include "cuda/bridge.h"

#include <cub/cub.cuh>

#include "backend/cpu/noise.h"

static const unsigned WARP = 0xFFFFFFFFu;

/* Bit k: slot base + k of this lane's row holds a pair that may be near, met for the first time. */
template <int dimension>
static __device__ unsigned near_bits(const struct gbg_cuda_rows &rows, const int32_t *index,
                                     int slots, const uint32_t own[3], int64_t i, float limit)
{
    unsigned bits = 0;
    for (int k = 0; k < slots; k++) {
        int32_t j = index[GBG_CUDA_SLICE * k];
        vf squared = vf_set(0.0f);
        for (int a = 0; a < dimension; a++) {
            vf r = vf_mul(vf_from_vi(vi_sub((vi)own[a], vi_gather(rows.local[a], j))),
                          vf_set(rows.scale[a]));
            squared = vf_fma(r, r, squared);
        }
        bits |= (unsigned)(vf_lt(squared, limit) && i < j) << k;
    }
    return bits;
}

/* Where this lane's `count` entries begin: one addition to the total a warp. */
static __device__ unsigned long long places(unsigned long long *total, unsigned count)
{
    int lane = (int)(threadIdx.x & 31u);
    unsigned upto = count;
    for (int step = 1; step < 32; step *= 2) {
        unsigned before = __shfl_up_sync(WARP, upto, (unsigned)step);
        upto += lane >= step ? before : 0u;
    }
    unsigned long long start = 0;
    if (lane == 31 && upto > 0) {
        start = atomicAdd(total, (unsigned long long)upto);
    }
    return __shfl_sync(WARP, start, 31) + (upto - count);
}

/* A thread a particle. Counts on where memory ends. */
template <int dimension>
static __global__ void __launch_bounds__(BRIDGE_THREADS)
    find(const __grid_constant__ struct gbg_cuda_rows rows,
         const __grid_constant__ struct gbg_state state,
         const __grid_constant__ struct bridge_work work)
{
    int64_t i = gbg_cuda_index(), slice = i / GBG_CUDA_SLICE;
    if (slice >= rows.slices || gbg_cuda_halted(work.halt)) {
        return;
    }
    bool here = i < rows.n;
    uint32_t own[3] = {0, 0, 0};
    for (int a = 0; a < dimension && here; a++) {
        own[a] = rows.local[a][i];
    }
    const int32_t *index = rows.index + rows.offset[slice] + i % GBG_CUDA_SLICE;
    int width = rows.width[slice];
    for (int base = 0; base < width; base += 32, index += 32 * GBG_CUDA_SLICE) {
        int slots = width - base < 32 ? width - base : 32;
        unsigned bits =
            here ? near_bits<dimension>(rows, index, slots, own, i, work.plan.limit) : 0u;
        unsigned long long to = places(&work.results->found, (unsigned)__popc(bits));
        for (; bits; bits &= bits - 1, to++) {
            if (to < (unsigned long long)work.capacity) {
                int32_t j = index[GBG_CUDA_SLICE * (__ffs((int)bits) - 1)];
                int32_t block = bridge_block_of(&work.plan, &state, i, j);
                work.found[to] = make_int2((int32_t)i, j);
                work.found_block[to] = block;
                atomicAdd(&work.tally[block], 1ull);
            }
        }
    }
}

/* Random words of a pair: the first for U, the second for the order of sweeps. */
static __device__ uint32_t draw(const struct bridge_work &work, const struct gbg_state &state,
                                struct bridge_pair *pair)
{
    uint64_t a = bridge_id(&state, pair->i), b = bridge_id(&state, pair->j);
    struct gbg_philox c = gbg_philox_pair(work.step, a < b ? a : b, a < b ? b : a,
                                          GBG_STREAM_BRIDGE, work.seed, work.run);
    vi word[4] = {(vi)c.word[0], (vi)c.word[1], (vi)c.word[2], (vi)c.word[3]};
    gbg_philox_lanes(word, work.seed, work.run);
    vf exponential = vf_mul(gbg_noise_exponential(word[0]), vf_set(work.plan.squared));
    pair->quarter_draw = 0.25f * exponential;
    return (uint32_t)word[1];
}

static __device__ __forceinline__ void write_record(const struct bridge_records &to, int64_t k,
                                                    const struct bridge_raw &raw, int dimension)
{
    to.ends[k] = make_int2(raw.pair.i, raw.pair.j);
    to.half_base[k] = raw.pair.half_base;
    to.gap[k] = raw.pair.gap;
    to.quarter_draw[k] = raw.pair.quarter_draw;
    to.distance[k] = raw.distance;
    for (int a = 0; a < dimension; a++) {
        to.start[a][k] = raw.start[a];
        to.free[a][k] = raw.free[a];
    }
}

/* Measures the found pairs and puts those that count into their blocks, in any order. */
template <int dimension>
static __global__ void __launch_bounds__(BRIDGE_THREADS)
    measure(const __grid_constant__ struct gbg_state state,
            const __grid_constant__ struct bridge_work work)
{
    if (bridge_idle(work)) {
        return;
    }
    int64_t found = (int64_t)work.results->found, stride = (int64_t)gridDim.x * blockDim.x;
    for (int64_t k = gbg_cuda_index(); k < found; k += stride) {
        struct bridge_raw raw;
        int2 ends = work.found[k];
        if (bridge_measure(&work.plan, &state, ends.x, ends.y, &raw)) {
            int32_t block = work.found_block[k];
            uint32_t order = draw(work, state, &raw.pair);
            uint32_t place = atomicAdd(&work.count[block], 1u);
            int64_t to = work.first[block] + place;
            write_record(work.raw, to, raw, dimension);
            work.key[to] = (bridge_key)order << 32 | place;
        }
    }
}

/* A block's part of the arrays. */
struct part {
    int64_t first;
    uint32_t n;
    bridge_key *key, *other;
    const int2 *ends; /* unordered */
    int2 *sorted;
};

/* Keys are spread over bins by their top bits. */
enum { BIN_BITS = 10, BINS = 1 << BIN_BITS, BINS_A_THREAD = BINS / BRIDGE_THREADS };
typedef cub::BlockScan<uint32_t, BRIDGE_THREADS> bin_scan;

static __device__ __forceinline__ uint32_t bin_of(bridge_key key)
{
    return (uint32_t)(key >> (64 - BIN_BITS));
}

/* Where bins begin, from their counts. */
static __device__ void scan_bins(uint32_t *bin)
{
    __shared__ typename bin_scan::TempStorage scratch;
    uint32_t own[BINS_A_THREAD];
    for (int k = 0; k < BINS_A_THREAD; k++) {
        own[k] = bin[threadIdx.x * BINS_A_THREAD + k];
    }
    bin_scan(scratch).ExclusiveSum(own, own);
    for (int k = 0; k < BINS_A_THREAD; k++) {
        bin[threadIdx.x * BINS_A_THREAD + k] = own[k];
    }
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

/* Sorts keys into `other`: into bins, and each bin by insertion. */
static __device__ void sort_keys(const struct gbg_state &state, const struct part &part)
{
    __shared__ uint32_t bin[BINS];
    for (uint32_t b = threadIdx.x; b < BINS; b += BRIDGE_THREADS) {
        bin[b] = 0;
    }
    __syncthreads();
    for (uint32_t k = threadIdx.x; k < part.n; k += BRIDGE_THREADS) {
        atomicAdd(&bin[bin_of(part.key[k])], 1u);
    }
    __syncthreads();
    scan_bins(bin);
    __syncthreads();
    for (uint32_t k = threadIdx.x; k < part.n; k += BRIDGE_THREADS) {
        bridge_key key = part.key[k];
        part.other[atomicAdd(&bin[bin_of(key)], 1u)] = key;
    }
    __syncthreads();
    for (uint32_t b = threadIdx.x; b < BINS; b += BRIDGE_THREADS) {
        uint32_t begin = b > 0 ? bin[b - 1] : 0, end = bin[b]; /* now the ends of the bins */
        for (uint32_t k = begin + 1; k < end; k++) {
            bridge_key own = part.other[k];
            uint32_t place = k;
            while (place > begin && precedes(state, part.ends, own, part.other[place - 1])) {
                part.other[place] = part.other[place - 1];
                place--;
            }
            part.other[place] = own;
        }
    }
    __syncthreads();
}

/* For every 32 pairs in the order of keys, which of the earlier ones among them share a disc with
 * a pair: a mask in `key`. Also lays the ends down in this order. */
static __device__ void note_conflicts(const struct part &part)
{
    uint32_t lane = threadIdx.x & 31u;
    for (uint32_t base = threadIdx.x - lane; base < part.n; base += BRIDGE_THREADS) {
        uint32_t k = base + lane, mask = 0;
        int2 ends = k < part.n ? part.ends[(uint32_t)part.other[k]] : make_int2(-1, -1);
        for (uint32_t other = 0; other < 31; other++) {
            int i = __shfl_sync(WARP, ends.x, (int)other),
                j = __shfl_sync(WARP, ends.y, (int)other);
            bool shared = i == ends.x || i == ends.y || j == ends.x || j == ends.y;
            mask |= (uint32_t)(shared && other < lane) << other;
        }
        if (k < part.n) {
            part.sorted[k] = ends;
            part.key[k] = mask;
        }
    }
    __syncthreads();
}

/* The lowest colour that is free at both discs of a pair, or the last. */
static __device__ int take_colour(unsigned long long *used, int2 ends)
{
    unsigned long long first = used[ends.x], second = used[ends.y], taken = first | second;
    int colour = ~taken ? __ffsll((long long)~taken) - 1 : BRIDGE_COLOURS - 1;
    used[ends.x] = first | 1ull << colour;
    used[ends.y] = second | 1ull << colour;
    return colour;
}

/* The greedy colouring in the order of keys, by one warp: 32 pairs at a time, each as soon as no
 * earlier one of them that shares a disc is left. `key` receives the colour and the place among
 * the pairs of that colour, counted in `counter`. */
static __device__ void colour_pairs(const struct part &part, unsigned long long *used,
                                    uint32_t *counter)
{
    uint32_t lane = threadIdx.x & 31u;
    int2 next = make_int2(0, 0);
    uint32_t next_mask = 0;
    if (lane < part.n) {
        next = part.sorted[lane];
        next_mask = (uint32_t)part.key[lane];
    }
    for (uint32_t base = 0; base < part.n; base += 32) {
        uint32_t k = base + lane, mask = next_mask;
        bool here = k < part.n;
        int2 ends = next;
        int colour = -1;
        if (k + 32 < part.n) { /* fetched ahead */
            next = part.sorted[k + 32];
            next_mask = (uint32_t)part.key[k + 32];
        }
        unsigned pending = __ballot_sync(WARP, here);
        while (pending) {
            bool ready = (pending >> lane & 1u) && !(mask & pending);
            if (ready) {
                colour = take_colour(used, ends);
            }
            __syncwarp();
            pending &= ~__ballot_sync(WARP, ready);
        }
        unsigned same = __match_any_sync(WARP, colour);
        uint32_t before = here ? counter[colour] : 0;
        __syncwarp();
        unsigned earlier = same & ((1u << lane) - 1u);
        if (here && !earlier) {
            counter[colour] = before + (uint32_t)__popc(same);
        }
        __syncwarp();
        if (here) {
            part.key[k] = (bridge_key)(uint32_t)colour << 32 | (before + (uint32_t)__popc(earlier));
        }
    }
}

/* Where colours begin; tables for the sweeps. Every colour below a used one is used. */
static __device__ void close_colours(const struct bridge_work &work, int64_t block,
                                     uint32_t *counter)
{
    uint32_t end = 0;
    int colour = 0;
    for (; colour < BRIDGE_COLOURS && counter[colour] > 0; colour++) {
        uint32_t begin = end;
        end += counter[colour];
        counter[colour] = begin;
        work.colour_end[block * BRIDGE_COLOURS + colour] = end;
    }
    work.colours[block] = colour;
}

/* Puts the records of a block into the order of sweeps. */
template <int dimension>
static __device__ void lay_records(const struct bridge_work &work, const struct part &part,
                                   const uint32_t *begin)
{
    float depth = 0.0f;
    for (uint32_t k = threadIdx.x; k < part.n; k += BRIDGE_THREADS) {
        bridge_key place = part.key[k];
        int64_t from = part.first + (uint32_t)part.other[k];
        int64_t to = part.first + begin[place >> 32] + (uint32_t)place;
        int2 ends = part.sorted[k];
        float half_base = work.raw.half_base[from], gap = work.raw.gap[from];
        float distance = work.raw.distance[from], overlap = bridge_depth(gap, half_base);
        depth = overlap > depth ? overlap : depth;
        work.pair.ends[to] = ends;
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
        work.used[ends.x] = work.used[ends.y] = 0;
    }
    unsigned bits = __reduce_max_sync(WARP, (unsigned)__float_as_int(depth));
    if ((threadIdx.x & 31u) == 0 && bits > 0) {
        atomicMax(&work.results->depth, bits);
    }
}

/* The records of the blocks of one colour, a thread block each: they share no disc. */
template <int dimension>
static __global__ void __launch_bounds__(BRIDGE_THREADS)
    order(const __grid_constant__ struct gbg_state state,
          const __grid_constant__ struct bridge_work work, int colour)
{
    __shared__ uint32_t counter[BRIDGE_COLOURS];
    int64_t block = bridge_block(&work.plan, colour, blockIdx.x);
    if (bridge_idle(work)) {
        return;
    }
    int64_t first = work.first[block];
    struct part part = {first,
                        work.count[block],
                        work.key + first,
                        work.other + first,
                        work.raw.ends + first,
                        work.sorted + first};
    if (part.n == 0) {
        if (threadIdx.x == 0) {
            work.colours[block] = 0;
        }
        return;
    }
    if (threadIdx.x < BRIDGE_COLOURS) {
        counter[threadIdx.x] = 0;
    }
    sort_keys(state, part); /* waits for all threads */
    note_conflicts(part);
    if (threadIdx.x < 32) {
        colour_pairs(part, work.used, counter);
        __syncwarp();
        if (threadIdx.x == 0) {
            close_colours(work, block, counter);
        }
    }
    __syncthreads();
    lay_records<dimension>(work, part, counter);
}

size_t gbg_cuda_bridge_scan_bytes(int64_t n_blocks)
{
    size_t bytes = 0;
    cub::DeviceScan::ExclusiveSum(NULL, bytes, (const unsigned long long *)NULL, (int64_t *)NULL,
                                  (int)(n_blocks + 1));
    return bytes;
}

int gbg_cuda_bridge_find(struct gbg_device *device, const struct gbg_state *state,
                         const struct gbg_list *list, const struct bridge_work *work, void *scan,
                         size_t scan_bytes)
{
    bool flat = work->plan.dimension == 2;
    unsigned blocks = gbg_cuda_blocks(list->rows.slices * GBG_CUDA_SLICE, BRIDGE_THREADS);
    unsigned enough = (unsigned)device->multiprocessors * 16u;
    unsigned most = gbg_cuda_blocks(work->capacity, BRIDGE_THREADS);
    unsigned some = most < enough ? most : enough;
    auto *finding = flat ? find<2> : find<3>;
    auto *measuring = flat ? measure<2> : measure<3>;
    finding<<<blocks, BRIDGE_THREADS, 0, device->stream>>>(list->rows, *state, *work);
    int status = gbg_cuda_started(device, "bridge: finding pairs");
    if (status == GBG_OK) {
        status = gbg_cuda_status(device,
                                 cub::DeviceScan::ExclusiveSum(
                                     scan, scan_bytes, (const unsigned long long *)work->tally,
                                     work->first, (int)(work->plan.n_blocks + 1), device->stream),
                                 "bridge: summing up blocks");
    }
    if (status == GBG_OK) {
        measuring<<<some, BRIDGE_THREADS, 0, device->stream>>>(*state, *work);
        status = gbg_cuda_started(device, "bridge: measuring pairs");
    }
    return status;
}

int gbg_cuda_bridge_order(struct gbg_device *device, const struct gbg_state *state,
                          const struct bridge_work *work)
{
    auto *ordering = work->plan.dimension == 2 ? order<2> : order<3>;
    unsigned blocks = (unsigned)bridge_of_colour(&work->plan);
    for (int colour = 0; colour < 8; colour++) {
        if (bridge_has_colour(&work->plan, colour)) {
            ordering<<<blocks, BRIDGE_THREADS, 0, device->stream>>>(*state, *work, colour);
        }
    }
    return gbg_cuda_started(device, "bridge: ordering pairs");
}
