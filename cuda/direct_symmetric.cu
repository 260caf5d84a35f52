/* L1, CUDA: the mixed sum over all pairs, each pair computed once for both.
 *
 * Particles are sorted along a Hilbert curve, so that 256 in a row (a group: a warp's targets, 8 a
 * lane) and 32 in a row (a chunk: its sources, one a lane) stand close together. A group meets a
 * chunk in 32 rounds; sources and what they have collected move round the warp by a lane each.
 * Positions are taken from the middle of the group: one subtraction is then the nearest image for
 * all pairs of most chunks. Of a chunk that the group sees on both sides of the box, positions are
 * taken from the opposite point, and half a box is added or subtracted by the sign. Summed in
 * double precision from all 64 bits are chunks with a pair whose sign is in doubt, and those so
 * near that 32 bits of these positions would not do: gap below an eighth of the largest coordinate,
 * or below GBG_CUDA_DIRECT_NEAR quanta.
 *
 * 1/r is the unit's approximation (22.9 bits): r^-3 is good to 3.6e-7, r^-7 to 8.4e-7 at most. Sums
 * of a target over 128 sources, and of a source over 256 targets, are in single precision, those
 * above in double. Blocks of 1024 meet once each; what the sources of a pair of blocks collect goes
 * to rows of memory of their own and is added up afterwards in a fixed order. */
#include "cuda/direct.h"
#include "cuda/hilbert.h"

#include <cub/device/device_radix_sort.cuh>

namespace
{

enum {
    EACH = 8,              /* targets of a lane */
    WARPS = 4,             /* of a block */
    THREADS = 32 * WARPS,  /* also the sources of a tile */
    GROUP = 32 * EACH,     /* targets of a warp */
    BLOCK = GROUP * WARPS, /* targets of a block */
    TILES = BLOCK / THREADS,
    CHUNKS = THREADS / 32 /* of a tile */
};

/* Rows of partial sums that are held at a time, in bytes; units of work that are started at a
 * time. Neither changes a bit of the result as long as it is the same everywhere. */
const int64_t ROOM = INT64_C(1) << 28;
const int64_t UNITS = 8192;

struct symmetric {
    int64_t n, padded, blocks;
    int64_t reach;         /* a block meets those 0 .. reach - 1 further on, modulo blocks */
    int64_t batch, splits; /* blocks of targets in a pass; parts of their sources */
    float scale[3];        /* of high words */
    float half[3];         /* of the box */
    double fine[3];        /* of 64-bit positions */
    double strength;
    /* sorted */
    int32_t *order;
    uint32_t *high[3], *low[3];
    float *alpha;
    uint32_t *middle[3], *extent[3]; /* of chunks: their intervals, half as long */
    double *field[3];
    float *row[3];  /* of a pass: [target block][distance][source] */
    double *own[3]; /* of a pass: [target block][split][target] */
    uint64_t *key[2];
    int32_t *index;
    void *scratch;
    size_t scratch_bytes;
};

/* A chunk as a group sees it. */
struct sight {
    bool near, across[3];
    float doubt[3]; /* across: positions nearer to opposite than this could be on either side */
};

} // namespace

static __host__ __device__ int64_t least(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static struct symmetric make(const struct gbg_state *state)
{
    struct symmetric s = {};
    int dimension = state->box.dimension;
    s.n = state->owned + state->ghost;
    s.blocks = (s.n + BLOCK - 1) / BLOCK;
    s.padded = s.blocks * BLOCK;
    s.reach = s.blocks / 2 + 1;
    int64_t row_bytes = s.reach * BLOCK * dimension * (int64_t)sizeof(float);
    s.batch = ROOM / row_bytes > 0 ? ROOM / row_bytes : 1;
    s.batch = least(s.batch, s.blocks);
    s.splits = least((UNITS + s.batch - 1) / (s.batch > 0 ? s.batch : 1), s.reach * TILES);
    return s;
}

/* The arrays in a workspace; base NULL: only counts. */
static size_t lay_out(struct symmetric *s, int dimension, void *base)
{
    size_t used = 0;
    for (int a = 0; a < dimension; a++) {
        s->high[a] = (uint32_t *)gbg_cuda_take(base, &used, s->padded, 4);
        s->low[a] = (uint32_t *)gbg_cuda_take(base, &used, s->padded, 4);
        s->middle[a] = (uint32_t *)gbg_cuda_take(base, &used, s->padded / 32, 4);
        s->extent[a] = (uint32_t *)gbg_cuda_take(base, &used, s->padded / 32, 4);
        s->field[a] = (double *)gbg_cuda_take(base, &used, s->padded, 8);
        s->row[a] = (float *)gbg_cuda_take(base, &used, s->batch * s->reach * BLOCK, 4);
        s->own[a] = (double *)gbg_cuda_take(base, &used, s->batch * s->splits * BLOCK, 8);
    }
    s->alpha = (float *)gbg_cuda_take(base, &used, s->padded, 4);
    s->order = (int32_t *)gbg_cuda_take(base, &used, s->padded, 4);
    s->index = (int32_t *)gbg_cuda_take(base, &used, s->padded, 4);
    for (int k = 0; k < 2; k++) {
        s->key[k] = (uint64_t *)gbg_cuda_take(base, &used, s->padded, 8);
    }
    s->scratch_bytes = 0;
    cub::DeviceRadixSort::SortPairs(NULL, s->scratch_bytes, s->key[0], s->key[1], s->index,
                                    s->order, s->n);
    s->scratch = gbg_cuda_take(base, &used, (int64_t)s->scratch_bytes, 1);
    return used;
}

size_t gbg_cuda_symmetric_bytes(const struct gbg_state *state)
{
    struct symmetric s = make(state);
    return s.n < GBG_CUDA_SYMMETRIC_FEWEST ? 0 : lay_out(&s, state->box.dimension, NULL);
}

/* Keys: the cell, then the rank, so that the order of a caller's arrays does not show. Cells are
 * squares whatever the box. */
template <int dimension>
static __global__ void make_keys(const __grid_constant__ struct gbg_state state,
                                 const __grid_constant__ struct symmetric s)
{
    int64_t i = gbg_cuda_index();
    if (i < s.n) {
        const int bits = dimension == 2 ? 16 : 10;
        uint32_t x[dimension];
        for (int a = 0; a < dimension; a++) {
            double part = (double)state.high[a][i] * (double)s.half[a] * 0x1p-5;
            x[a] = (uint32_t)least((int64_t)part, UINT32_MAX) >> (32 - bits);
        }
        s.key[0][i] =
            (uint64_t)gbg_cuda_hilbert<dimension>(x, bits) << 32 | (uint32_t)gbg_rank_of(&state, i);
        s.index[i] = (int32_t)i;
    }
}

/* Particles in their new order; those that fill up the last block have no strength. */
static __global__ void gather(const __grid_constant__ struct gbg_state state,
                              const __grid_constant__ struct symmetric s)
{
    int64_t p = gbg_cuda_index();
    if (p < s.padded) {
        int64_t i = s.order[p < s.n ? p : s.n - 1];
        s.alpha[p] = p < s.n ? (float)(gbg_cuda_alpha(state, i) * s.strength) : 0.0f;
        for (int a = 0; a < state.box.dimension; a++) {
            s.high[a][p] = state.high[a][i];
            s.low[a][p] = state.low[a][i];
            s.field[a][p] = 0.0;
        }
    }
}

/* Middle and half length of the interval of a warp's coordinates, count of them in each lane. */
template <int count>
static __device__ __forceinline__ void interval(const uint32_t high[count], uint32_t *middle,
                                                uint32_t *extent)
{
    uint32_t origin = __shfl_sync(0xFFFFFFFFu, high[0], 0);
    int32_t low = 0, top = 0;
    for (int k = 0; k < count; k++) {
        int32_t d = (int32_t)(high[k] - origin);
        low = d < low ? d : low;
        top = d > top ? d : top;
    }
    low = __reduce_min_sync(0xFFFFFFFFu, low);
    top = __reduce_max_sync(0xFFFFFFFFu, top);
    int64_t length = (int64_t)top - low;
    *middle = origin + (uint32_t)low + (uint32_t)(length / 2);
    *extent = (uint32_t)(length / 2) + 1;
}

static __global__ void bound_chunks(int dimension, const __grid_constant__ struct symmetric s)
{
    int64_t p = gbg_cuda_index(); /* whole warps: padded is a multiple of 32 */
    for (int a = 0; a < dimension && p < s.padded; a++) {
        uint32_t high = s.high[a][p], middle, extent;
        interval<1>(&high, &middle, &extent);
        if (p % 32 == 0) {
            s.middle[a][p / 32] = middle;
            s.extent[a][p / 32] = extent;
        }
    }
}

/* The group of a warp: positions from its middle, strengths, sums. */
template <int dimension> struct group {
    int64_t first; /* particle of lane 0 */
    uint32_t middle[dimension], extent[dimension];
    float x[EACH][dimension], alpha[EACH], sum[EACH][dimension];
};

/* Sources of a lane, and what they collect (less its sign). */
template <int dimension> struct source {
    float x[dimension], alpha, sum[dimension];
};

template <int dimension>
static __device__ __forceinline__ void take_group(const struct symmetric &s, int64_t first,
                                                  struct group<dimension> *g)
{
    g->first = first;
    for (int a = 0; a < dimension; a++) {
        uint32_t high[EACH];
#pragma unroll
        for (int k = 0; k < EACH; k++) {
            high[k] = s.high[a][first + 32 * k + threadIdx.x % 32];
        }
        interval<EACH>(high, &g->middle[a], &g->extent[a]);
#pragma unroll
        for (int k = 0; k < EACH; k++) {
            g->x[k][a] = (float)(int32_t)(high[k] - g->middle[a]) * s.scale[a];
            g->sum[k][a] = 0.0f;
        }
    }
#pragma unroll
    for (int k = 0; k < EACH; k++) {
        g->alpha[k] = s.alpha[first + 32 * k + threadIdx.x % 32];
    }
}

/* Bounds on the coordinates and differences of all pairs decide how they are summed. */
template <int dimension>
static __device__ __forceinline__ struct sight look(const struct symmetric &s,
                                                    const struct group<dimension> &g, int64_t chunk)
{
    struct sight seen = {};
    float gap_squared = 0.0f, farthest = (float)(GBG_CUDA_DIRECT_NEAR * 0x1p-23);
    for (int a = 0; a < dimension; a++) {
        int32_t d = (int32_t)(s.middle[a][chunk] - g.middle[a]);
        uint32_t apart = d < 0 ? 0u - (uint32_t)d : (uint32_t)d;
        uint64_t wide = (uint64_t)g.extent[a] + s.extent[a][chunk], reach = apart + wide;
        float gap = apart > wide ? (float)(apart - wide) * s.scale[a] : 0.0f;
        seen.across[a] = reach >= 0x80000000u;
        uint64_t opposite = wide + 0x80000000u - apart; /* bound from the opposite point */
        seen.doubt[a] = ((float)opposite * 0x1p-22f + 4.0f) * s.scale[a];
        seen.near |= seen.across[a] && opposite >= 0xF0000000u; /* all round the box */
        gap_squared += gap * gap;
        farthest = fmaxf(farthest, (float)reach * s.scale[a]);
    }
    seen.near |= !(gap_squared * 64.0f >= farthest * farthest);
    return seen;
}

/* One pair: adds to the target's sum and to the source's. Across: `least` becomes the least
 * distance from opposite points. */
template <int dimension, int whole, bool across>
static __device__ __forceinline__ void meet(const float half[dimension], const float x[dimension],
                                            float alpha, float sum[dimension],
                                            struct source<dimension> *j, float least[dimension])
{
    float r[dimension], squared, y;
    for (int a = 0; a < dimension; a++) {
        r[a] = x[a] - j->x[a];
        if (across) {
            least[a] = fminf(least[a], fabsf(r[a]));
            r[a] -= __int_as_float((__float_as_int(r[a]) & INT32_MIN) | __float_as_int(half[a]));
        }
        squared = a == 0 ? r[a] * r[a] : __fmaf_rn(r[a], r[a], squared);
    }
    asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(y) : "f"(squared));
    float w = gbg_cuda_raise<whole>(y), on_i = w * j->alpha, on_j = w * alpha;
    for (int a = 0; a < dimension; a++) {
        sum[a] = __fmaf_rn(on_i, r[a], sum[a]);
        j->sum[a] = __fmaf_rn(on_j, r[a], j->sum[a]);
    }
}

/* A group and a chunk, in single precision. */
template <int dimension, int whole, bool across>
static __device__ __forceinline__ void sweep(const float half[dimension],
                                             struct group<dimension> *g,
                                             struct source<dimension> *j, float least[dimension])
{
    const int next = (threadIdx.x + 1) % 32;
#pragma unroll 2
    for (int round = 0; round < 32; round++) {
#pragma unroll
        for (int k = 0; k < EACH; k++) {
            meet<dimension, whole, across>(half, g->x[k], g->alpha[k], g->sum[k], j, least);
        }
        j->alpha = __shfl_sync(0xFFFFFFFFu, j->alpha, next);
        for (int a = 0; a < dimension; a++) {
            j->x[a] = __shfl_sync(0xFFFFFFFFu, j->x[a], next);
            j->sum[a] = __shfl_sync(0xFFFFFFFFu, j->sum[a], next);
        }
    }
}

/* The same in double precision, from all bits of the positions. */
template <int dimension, int whole>
static __device__ __noinline__ void sweep_near(const struct symmetric &s, int64_t first, int64_t p,
                                               double (*total)[EACH][THREADS],
                                               float collected[dimension])
{
    const int next = (threadIdx.x + 1) % 32;
    uint64_t there[dimension];
    double alpha = s.alpha[p], sum[dimension] = {};
    for (int a = 0; a < dimension; a++) {
        there[a] = gbg_join(s.high[a][p], s.low[a][p]);
    }
#pragma unroll 1
    for (int k = 0; k < EACH; k++) {
        int64_t i = first + 32 * k + threadIdx.x % 32;
        uint64_t own[dimension];
        double own_alpha = s.alpha[i], own_sum[dimension] = {};
        for (int a = 0; a < dimension; a++) {
            own[a] = gbg_join(s.high[a][i], s.low[a][i]);
        }
#pragma unroll 1
        for (int round = 0; round < 32; round++) {
            double r[dimension], squared = 0.0;
            for (int a = 0; a < dimension; a++) {
                r[a] = (double)(int64_t)(own[a] - there[a]) * s.fine[a];
                squared = __fma_rn(r[a], r[a], squared);
            }
            double w = squared > 0.0 ? gbg_cuda_raise<whole>(gbg_cuda_rsqrt(squared)) : 0.0;
            for (int a = 0; a < dimension; a++) {
                own_sum[a] = __fma_rn(w * alpha, r[a], own_sum[a]);
                sum[a] = __fma_rn(w * own_alpha, r[a], sum[a]);
                there[a] = __shfl_sync(0xFFFFFFFFu, there[a], next);
                sum[a] = __shfl_sync(0xFFFFFFFFu, sum[a], next);
            }
            alpha = __shfl_sync(0xFFFFFFFFu, alpha, next);
        }
        for (int a = 0; a < dimension; a++) {
            total[a][k][threadIdx.x] += own_sum[a];
        }
    }
    for (int a = 0; a < dimension; a++) {
        collected[a] = (float)sum[a];
    }
}

/* Sums over a tile go to the double ones. */
template <int dimension>
static __device__ __forceinline__ void flush(struct group<dimension> *g,
                                             double (*total)[EACH][THREADS])
{
#pragma unroll
    for (int k = 0; k < EACH; k++) {
        for (int a = 0; a < dimension; a++) {
            total[a][k][threadIdx.x] += (double)g->sum[k][a];
            g->sum[k][a] = 0.0f;
        }
    }
}

/* Positions of this lane's source for a group, from the opposite point where it is across. */
template <int dimension>
static __device__ __forceinline__ void
take_source(const struct symmetric &s, int64_t p, const struct group<dimension> &g,
            const struct sight &seen, struct source<dimension> *j)
{
    j->alpha = s.alpha[p];
    for (int a = 0; a < dimension; a++) {
        uint32_t origin = g.middle[a] + (seen.across[a] ? 0x80000000u : 0u);
        j->x[a] = (float)(int32_t)(s.high[a][p] - origin) * s.scale[a];
        j->sum[a] = 0.0f;
    }
}

/* Single precision across the box. Returns false, the sums of the group as they were, if 32 bits
 * cannot tell the nearest image of some pair. */
template <int dimension, int whole>
static __device__ __forceinline__ bool
sweep_across(const struct symmetric &s, const struct sight &seen, struct group<dimension> *g,
             struct source<dimension> *j, double (*total)[EACH][THREADS])
{
    float half[dimension], least[dimension];
    bool doubtful = false;
    for (int a = 0; a < dimension; a++) {
        half[a] = seen.across[a] ? s.half[a] : 0.0f;
        least[a] = INFINITY;
    }
    flush(g, total); /* so that the sums below can be thrown away */
    sweep<dimension, whole, true>(half, g, j, least);
    for (int a = 0; a < dimension; a++) {
        doubtful |= seen.across[a] && least[a] < seen.doubt[a];
    }
    if (!__any_sync(0xFFFFFFFFu, doubtful)) {
        return true;
    }
#pragma unroll
    for (int k = 0; k < EACH; k++) {
        for (int a = 0; a < dimension; a++) {
            g->sum[k][a] = 0.0f;
        }
    }
    return false;
}

/* A group and a chunk of sources: what this lane's source has collected. */
template <int dimension, int whole>
static __device__ __forceinline__ void face(const struct symmetric &s, struct group<dimension> *g,
                                            int64_t chunk, double (*total)[EACH][THREADS],
                                            float collected[dimension])
{
    int64_t p = chunk * 32 + threadIdx.x % 32;
    struct sight seen = look(s, *g, chunk);
    bool across = false, done = false;
    for (int a = 0; a < dimension; a++) {
        across |= seen.across[a];
    }
    struct source<dimension> j;
    take_source(s, p, *g, seen, &j);
    if (!seen.near && !across) {
        sweep<dimension, whole, false>(NULL, g, &j, NULL);
        done = true;
    } else if (!seen.near) {
        done = sweep_across<dimension, whole>(s, seen, g, &j, total);
    }
    for (int a = 0; a < dimension; a++) {
        collected[a] = j.sum[a];
    }
    if (!done) {
        sweep_near<dimension, whole>(s, g->first, p, total, collected);
    }
}

/* Block blockIdx.x of the pass against part blockIdx.y of the blocks that it meets. */
template <int dimension, int whole>
static __global__ void __launch_bounds__(THREADS, 4)
    all_pairs(const __grid_constant__ struct symmetric s, int64_t pass)
{
    __shared__ double total[dimension][EACH][THREADS];
    __shared__ float collected[2][WARPS][dimension][THREADS];
    const int warp = threadIdx.x / 32, lane = threadIdx.x % 32;
    int64_t block = pass * s.batch + blockIdx.x, all = s.reach * TILES;
    struct group<dimension> g;
    take_group(s, block * BLOCK + warp * GROUP, &g);
    for (int k = 0; k < EACH; k++) {
        for (int a = 0; a < dimension; a++) {
            total[a][k][threadIdx.x] = 0.0;
        }
    }
    int64_t end = all * (blockIdx.y + 1) / s.splits;
    for (int64_t tile = all * blockIdx.y / s.splits; tile < end; tile++) {
        int64_t distance = tile / TILES, other = block + distance;
        if (2 * distance == s.blocks && 2 * block >= s.blocks) {
            continue; /* the other meets this one */
        }
        other -= other >= s.blocks ? s.blocks : 0;
        int64_t first = other * BLOCK + tile % TILES * THREADS;
        float(*mine)[dimension][THREADS] = collected[tile % 2];
#pragma unroll 1
        for (int c = 0; c < CHUNKS; c++) {
            float got[dimension];
            face<dimension, whole>(s, &g, first / 32 + c, total, got);
            for (int a = 0; a < dimension; a++) {
                mine[warp][a][32 * c + lane] = got[a];
            }
        }
        flush(&g, total);
        __syncthreads(); /* one is enough: the next tile fills the other half of `collected` */
        int64_t place = (blockIdx.x * s.reach + distance) * BLOCK + tile % TILES * THREADS;
        for (int a = 0; a < dimension; a++) {
            s.row[a][place + threadIdx.x] = (mine[0][a][threadIdx.x] + mine[1][a][threadIdx.x]) +
                                            (mine[2][a][threadIdx.x] + mine[3][a][threadIdx.x]);
        }
    }
    int64_t place = (blockIdx.x * s.splits + blockIdx.y) * BLOCK + warp * GROUP + lane;
    for (int k = 0; k < EACH; k++) {
        for (int a = 0; a < dimension; a++) {
            s.own[a][place + 32 * k] = total[a][k][threadIdx.x];
        }
    }
}

/* Adds the rows of a pass: as a source of each of its blocks, in their order, and as a target. */
static __global__ void collect(int dimension, const __grid_constant__ struct symmetric s,
                               int64_t pass, int64_t count)
{
    int64_t p = gbg_cuda_index();
    if (p >= s.padded) {
        return;
    }
    int64_t mine = p / BLOCK, inside = p % BLOCK, begin = pass * s.batch;
    for (int a = 0; a < dimension; a++) {
        double field = s.field[a][p];
        for (int64_t b = 0; b < count; b++) {
            int64_t block = begin + b, distance = mine - block + (mine < block ? s.blocks : 0);
            bool met = distance > 0 && distance < s.reach &&
                       !(2 * distance == s.blocks && 2 * block >= s.blocks);
            field -= met ? (double)s.row[a][(b * s.reach + distance) * BLOCK + inside] : 0.0;
        }
        for (int64_t k = 0; k < s.splits && mine >= begin && mine < begin + count; k++) {
            field += s.own[a][((mine - begin) * s.splits + k) * BLOCK + inside];
        }
        s.field[a][p] = field;
    }
}

static __global__ void put(const __grid_constant__ struct gbg_state state,
                           const __grid_constant__ struct symmetric s, double factor, int add)
{
    int64_t p = gbg_cuda_index();
    int64_t i = p < s.n ? s.order[p] : state.owned;
    if (i < state.owned) {
        double mobility = state.mobility[state.species ? state.species[i] : 0] * factor;
        for (int a = 0; a < state.box.dimension; a++) {
            double force = mobility * s.field[a][p], *target = &state.force[a][i];
            *target = add ? *target + force : force;
        }
    }
}

static int sort(struct gbg_device *device, const struct gbg_state *state, const struct symmetric *s)
{
    int dimension = state->box.dimension, lowest = state->rank ? 0 : 32;
    unsigned blocks = gbg_cuda_blocks(s->padded);
    (dimension == 2 ? make_keys<2>
                    : make_keys<3>)<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, *s);
    size_t bytes = s->scratch_bytes;
    cudaError_t error =
        cub::DeviceRadixSort::SortPairs(s->scratch, bytes, s->key[0], s->key[1], s->index, s->order,
                                        s->n, lowest, 64, device->stream);
    gather<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, *s);
    bound_chunks<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(dimension, *s);
    int status = gbg_cuda_status(device, error, "sorting particles");
    return status ? status : gbg_cuda_started(device, "direct sum, order");
}

typedef void (*kernel)(const struct symmetric, int64_t);

template <int dimension> static kernel choose(int whole)
{
    return whole == 1   ? all_pairs<dimension, 1>
           : whole == 2 ? all_pairs<dimension, 2>
           : whole == 3 ? all_pairs<dimension, 3>
           : whole == 4 ? all_pairs<dimension, 4>
           : whole == 5 ? all_pairs<dimension, 5>
                        : all_pairs<dimension, 6>;
}

static int sum(struct gbg_device *device, int dimension, const struct symmetric *s, int whole)
{
    kernel chosen = dimension == 2 ? choose<2>(whole) : choose<3>(whole);
    for (int64_t pass = 0; pass * s->batch < s->blocks; pass++) {
        int64_t count = least(s->batch, s->blocks - pass * s->batch);
        dim3 units((unsigned)count, (unsigned)s->splits);
        chosen<<<units, THREADS, 0, device->stream>>>(*s, pass);
        collect<<<gbg_cuda_blocks(s->padded), GBG_CUDA_THREADS, 0, device->stream>>>(dimension, *s,
                                                                                     pass, count);
    }
    return gbg_cuda_started(device, "direct sum, symmetric");
}

int gbg_cuda_direct_symmetric(struct gbg_device *device, struct gbg_state *state, double power,
                              int add)
{
    struct gbg_cuda_direct direct = gbg_cuda_direct_make(state, power);
    struct symmetric s = make(state);
    void *base;
    if (state->owned == 0) {
        return GBG_OK;
    }
    int status = gbg_cuda_workspace(device, lay_out(&s, state->box.dimension, NULL), &base);
    if (status != GBG_OK) {
        return status;
    }
    lay_out(&s, state->box.dimension, base);
    for (int a = 0; a < state->box.dimension; a++) {
        s.scale[a] = (float)direct.scale[a];
        s.half[a] = (float)(direct.scale[a] * 0x1p31);
        s.fine[a] = direct.scale[a] * 0x1p-32;
    }
    s.strength = direct.strength;
    status = sort(device, state, &s);
    status = status ? status : sum(device, state->box.dimension, &s, direct.whole);
    if (status == GBG_OK) {
        put<<<gbg_cuda_blocks(s.n), GBG_CUDA_THREADS, 0, device->stream>>>(*state, s, direct.factor,
                                                                           add);
        status = gbg_cuda_started(device, "direct sum, forces");
    }
    return status;
}
