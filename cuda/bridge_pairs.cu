/* L1, CUDA: rule bridge: which pairs a step has to solve, and their records, by block. */
#include "cuda/bridge.h"

#include <cub/cub.cuh>

#include "backend/cpu/noise.h"

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
    unsigned upto = bridge_warp_upto(count);
    unsigned long long start = 0;
    if ((threadIdx.x & 31u) == 31 && upto > 0) {
        start = atomicAdd(total, (unsigned long long)upto);
    }
    return __shfl_sync(BRIDGE_WARP, start, 31) + (upto - count);
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
