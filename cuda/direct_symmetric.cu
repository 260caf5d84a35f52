/* L1, CUDA: the mixed sum over all pairs, each pair computed once for both.
 *
 * Particles are sorted along a Hilbert curve (direct_order.cu), so that 32 `each` in a row (a
 * group: a warp's targets, `each` a lane) and 32 in a row (a chunk: its sources, one a lane) stand
 * close together. A group meets a chunk in 32 rounds; sources and what they have collected move
 * round the warp by a lane each. Where all of a group have one strength, and all of a chunk, pairs
 * do without: their sums are multiplied.
 *
 * Positions are taken from the middle of the group: one subtraction is then the nearest image for
 * all pairs of most chunks. Of a chunk that the group sees on both sides of the box, positions are
 * taken from the opposite point, and half a box is added or subtracted by the sign. Summed in
 * double precision from all 64 bits are chunks with a pair whose sign is in doubt, and those so
 * near that 32 bits of these positions would not do: gap below an eighth of the largest coordinate,
 * or below GBG_CUDA_DIRECT_NEAR quanta.
 *
 * 1/r is the unit's approximation (22.9 bits): r^-3 is good to 3.6e-7, r^-7 to 8.4e-7 at most. Sums
 * of a target over 128 sources, and of a source over a group, are in single precision, those above
 * in double. Blocks of four groups meet once each; what the sources of a pair of blocks collect
 * goes to rows of memory of their own and is added up afterwards in a fixed order. */
#include "cuda/direct_symmetric.h"

namespace
{

enum {
    WARPS = GBG_SYMMETRIC_WARPS,
    THREADS = GBG_SYMMETRIC_THREADS,
    CHUNKS = GBG_SYMMETRIC_CHUNKS,
    TOGETHER = 4, /* near pairs of a lane at a time */
    HELD = 4      /* tiles whose sums are held between barriers: warps meet near chunks in turn */
};

/* A chunk as a group sees it. */
template <int dimension> struct sight {
    bool near, across[dimension];
    float doubt[dimension]; /* across: positions nearer to opposite could be on either side */
};

/* The same of the chunks of a block, a bit each. */
template <int dimension> struct sights {
    uint32_t near, across[dimension];
};

/* The group of a warp: positions from its middle, strengths, sums. */
template <int dimension, int each> struct group {
    int64_t first; /* particle of lane 0 */
    uint32_t middle[dimension], extent[dimension];
    float x[each][dimension], alpha[each], sum[each][dimension];
    float scale;  /* what the sums are to be multiplied by: a strength of sources, or 1 */
    float common; /* strength of all particles, or NaN */
};

/* What is made of the fields in the end. */
struct result {
    double factor;
    int add, last; /* last: this pass is, and gives the forces */
};

/* Sources of a lane, and what they collect (less its sign). */
template <int dimension> struct source {
    float x[dimension], alpha, sum[dimension];
};

} // namespace

template <int dimension, int each>
static __device__ __forceinline__ void take_group(const struct gbg_cuda_symmetric &s, int64_t first,
                                                  struct group<dimension, each> *g)
{
    g->first = first;
    for (int a = 0; a < dimension; a++) {
        uint32_t high[each];
#pragma unroll
        for (int k = 0; k < each; k++) {
            high[k] = s.high[a][first + 32 * k + threadIdx.x % 32];
        }
        gbg_cuda_interval<each>(high, &g->middle[a], &g->extent[a]);
#pragma unroll
        for (int k = 0; k < each; k++) {
            g->x[k][a] = (float)(int32_t)(high[k] - g->middle[a]) * s.scale[a];
            g->sum[k][a] = 0.0f;
        }
    }
    float common = s.common[first / 32];
    bool same = true;
#pragma unroll
    for (int k = 0; k < each; k++) {
        g->alpha[k] = s.alpha[first + 32 * k + threadIdx.x % 32];
        same &= g->alpha[k] == common;
    }
    g->common = __all_sync(0xFFFFFFFFu, same) ? common : __int_as_float(0x7FC00000);
    g->scale = 1.0f;
}

/* Bounds on the coordinates and differences of all pairs decide how they are summed. */
template <int dimension, int each>
static __device__ __forceinline__ struct sight<dimension>
look(const struct gbg_cuda_symmetric &s, const struct group<dimension, each> &g, int64_t chunk) {
    struct sight<dimension> seen;
    seen.near = false;
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

/* The chunks of a block, a lane each. */
template <int dimension, int each>
static __device__ __forceinline__ struct sights<dimension>
look_round(const struct gbg_cuda_symmetric &s, const struct group<dimension, each> &g,
           int64_t block) {
    const int lane = threadIdx.x % 32, chunks = CHUNKS * each;
    struct sights<dimension> all;
    struct sight<dimension> seen = look<dimension, each>(s, g, block *chunks + lane % chunks);
    all.near = __ballot_sync(0xFFFFFFFFu, seen.near);
    for (int a = 0; a < dimension; a++) {
        all.across[a] = __ballot_sync(0xFFFFFFFFu, seen.across[a]);
    }
    return all;
}

/* One pair: adds to the target's sum and to the source's. Across: `least` becomes the least
 * distance from opposite points. Plain: without strengths. */
template <int dimension, int whole, bool across, bool plain>
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
    float w = gbg_cuda_raise<whole>(y);
    float on_i = plain ? w : w * j->alpha, on_j = plain ? w : w * alpha;
    for (int a = 0; a < dimension; a++) {
        sum[a] = __fmaf_rn(on_i, r[a], sum[a]);
        j->sum[a] = __fmaf_rn(on_j, r[a], j->sum[a]);
    }
}

/* A group and a chunk, in single precision. */
template <int dimension, int whole, int each, bool across, bool plain>
static __device__ __forceinline__ void sweep(const float half[dimension],
                                             struct group<dimension, each> *g,
                                             struct source<dimension> *j, float least[dimension])
{
    const int next = (threadIdx.x + 1) % 32;
#pragma unroll 4
    for (int round = 0; round < 32; round++) {
#pragma unroll
        for (int k = 0; k < each; k++) {
            meet<dimension, whole, across, plain>(half, g->x[k], g->alpha[k], g->sum[k], j, least);
        }
        if (!plain) {
            j->alpha = __shfl_sync(0xFFFFFFFFu, j->alpha, next);
        }
        for (int a = 0; a < dimension; a++) {
            j->x[a] = __shfl_sync(0xFFFFFFFFu, j->x[a], next);
            j->sum[a] = __shfl_sync(0xFFFFFFFFu, j->sum[a], next);
        }
    }
}

/* The same in double precision, from all bits of the positions; TOGETHER targets at a time, since
 * what follows from one another takes long. */
template <int dimension, int whole, int each>
static __device__ __noinline__ void sweep_near(const struct gbg_cuda_symmetric &s, int64_t first,
                                               int64_t p, double (*total)[each][THREADS],
                                               float collected[dimension])
{
    const int next = (threadIdx.x + 1) % 32;
    uint64_t there[dimension];
    double alpha = s.alpha[p], sum[dimension] = {};
    for (int a = 0; a < dimension; a++) {
        there[a] = gbg_join(s.high[a][p], s.low[a][p]);
    }
#pragma unroll 1
    for (int begin = 0; begin < each; begin += TOGETHER) {
        uint64_t own[TOGETHER][dimension];
        double own_alpha[TOGETHER], own_sum[TOGETHER][dimension] = {};
#pragma unroll
        for (int k = 0; k < TOGETHER; k++) {
            int64_t i = first + 32 * (begin + k) + threadIdx.x % 32;
            own_alpha[k] = s.alpha[i];
            for (int a = 0; a < dimension; a++) {
                own[k][a] = gbg_join(s.high[a][i], s.low[a][i]);
            }
        }
#pragma unroll 1
        for (int round = 0; round < 32; round++) {
#pragma unroll
            for (int k = 0; k < TOGETHER; k++) {
                double r[dimension], squared = 0.0;
                for (int a = 0; a < dimension; a++) {
                    r[a] = (double)(int64_t)(own[k][a] - there[a]) * s.fine[a];
                    squared = __fma_rn(r[a], r[a], squared);
                }
                double w = gbg_cuda_raise<whole>(gbg_cuda_rsqrt(squared > 0.0 ? squared : 1.0));
                w = squared > 0.0 ? w : 0.0;
                for (int a = 0; a < dimension; a++) {
                    own_sum[k][a] = __fma_rn(w * alpha, r[a], own_sum[k][a]);
                    sum[a] = __fma_rn(w * own_alpha[k], r[a], sum[a]);
                }
            }
            for (int a = 0; a < dimension; a++) {
                there[a] = __shfl_sync(0xFFFFFFFFu, there[a], next);
                sum[a] = __shfl_sync(0xFFFFFFFFu, sum[a], next);
            }
            alpha = __shfl_sync(0xFFFFFFFFu, alpha, next);
        }
#pragma unroll
        for (int k = 0; k < TOGETHER; k++) {
            for (int a = 0; a < dimension; a++) {
                total[a][begin + k][threadIdx.x] += own_sum[k][a];
            }
        }
    }
    for (int a = 0; a < dimension; a++) {
        collected[a] = (float)sum[a];
    }
}

/* Single-precision sums go to the double ones; those that follow are to be multiplied by `scale`.
 */
template <int dimension, int each>
static __device__ __forceinline__ void flush(struct group<dimension, each> *g,
                                             double (*total)[each][THREADS], float scale)
{
#pragma unroll
    for (int k = 0; k < each; k++) {
        for (int a = 0; a < dimension; a++) {
            total[a][k][threadIdx.x] += (double)g->sum[k][a] * (double)g->scale;
            g->sum[k][a] = 0.0f;
        }
    }
    g->scale = scale;
}

/* Positions of this lane's source for a group, from the opposite point where it is across. */
template <int dimension, int each>
static __device__ __forceinline__ void
take_source(const struct gbg_cuda_symmetric &s, int64_t p, const struct group<dimension, each> &g,
            const bool across[dimension], struct source<dimension> *j)
{
    j->alpha = s.alpha[p];
    for (int a = 0; a < dimension; a++) {
        uint32_t origin = g.middle[a] + (across[a] ? 0x80000000u : 0u);
        j->x[a] = (float)(int32_t)(s.high[a][p] - origin) * s.scale[a];
        j->sum[a] = 0.0f;
    }
}

/* Single precision across the box. Returns false, the sums of the group as they were, if 32 bits
 * cannot tell the nearest image of some pair. */
template <int dimension, int whole, int each, bool plain>
static __device__ __forceinline__ bool
sweep_across(const struct gbg_cuda_symmetric &s, int64_t chunk, struct group<dimension, each> *g,
             struct source<dimension> *j, double (*total)[each][THREADS])
{
    struct sight<dimension> seen = look<dimension, each>(s, *g, chunk);
    float half[dimension], least[dimension];
    bool doubtful = false;
    for (int a = 0; a < dimension; a++) {
        half[a] = seen.across[a] ? s.half[a] : 0.0f;
        least[a] = INFINITY;
    }
    flush(g, total, g->scale); /* so that the sums below can be thrown away */
    sweep<dimension, whole, each, true, plain>(half, g, j, least);
    for (int a = 0; a < dimension; a++) {
        doubtful |= seen.across[a] && least[a] < seen.doubt[a];
    }
    if (!__any_sync(0xFFFFFFFFu, doubtful)) {
        return true;
    }
#pragma unroll
    for (int k = 0; k < each; k++) {
        for (int a = 0; a < dimension; a++) {
            g->sum[k][a] = 0.0f;
        }
    }
    return false;
}

/* A group and a chunk that is not near, by pairs with strengths or without. Returns false if it is
 * to be summed as near ones are. */
template <int dimension, int whole, int each, bool plain>
static __device__ __forceinline__ bool
face_far(const struct gbg_cuda_symmetric &s, struct group<dimension, each> *g, int64_t chunk,
         const bool across[dimension], float common, double (*total)[each][THREADS],
         float collected[dimension])
{
    struct source<dimension> j;
    bool any = false, done = true;
    take_source(s, chunk * 32 + threadIdx.x % 32, *g, across, &j);
    for (int a = 0; a < dimension; a++) {
        any |= across[a];
    }
    float scale = plain ? common : 1.0f;
    if (scale != g->scale) {
        flush(g, total, scale);
    }
    if (any) {
        done = sweep_across<dimension, whole, each, plain>(s, chunk, g, &j, total);
    } else {
        sweep<dimension, whole, each, false, plain>(NULL, g, &j, NULL);
    }
    for (int a = 0; a < dimension; a++) {
        collected[a] = plain ? j.sum[a] * g->common : j.sum[a];
    }
    return done;
}

/* A group and a chunk of sources, the one of that number in its block: what this lane's source has
 * collected. */
template <int dimension, int whole, int each>
static __device__ __forceinline__ void
face(const struct gbg_cuda_symmetric &s, struct group<dimension, each> *g, int64_t chunk,
     const struct sights<dimension> &seen, int number, double (*total)[each][THREADS],
     float collected[dimension])
{
    float common = s.common[chunk];
    bool across[dimension], done = false;
    for (int a = 0; a < dimension; a++) {
        across[a] = seen.across[a] >> number & 1;
    }
    if (!(seen.near >> number & 1)) {
        bool plain = common == common && g->common == g->common;
        done = plain ? face_far<dimension, whole, each, true>(s, g, chunk, across, common, total,
                                                              collected)
                     : face_far<dimension, whole, each, false>(s, g, chunk, across, common, total,
                                                               collected);
    }
    if (!done) {
        sweep_near<dimension, whole, each>(s, g->first, chunk * 32 + threadIdx.x % 32, total,
                                           collected);
    }
}

/* What the sources of some tiles in a row have collected from all warps goes to the rows. */
template <int dimension>
static __device__ __forceinline__ void put_rows(const struct gbg_cuda_symmetric &s,
                                                const float (*collected)[WARPS][dimension][THREADS],
                                                int held, int64_t place)
{
    for (int k = 0; k < held; k++) {
        for (int a = 0; a < dimension; a++) {
            const int i = threadIdx.x;
            s.row[a][place + k * THREADS + i] = (collected[k][0][a][i] + collected[k][1][a][i]) +
                                                (collected[k][2][a][i] + collected[k][3][a][i]);
        }
    }
}

/* Block blockIdx.x of the pass against part blockIdx.y of the blocks that it meets. */
template <int dimension, int whole, int each>
static __global__ void __launch_bounds__(THREADS, 4)
    all_pairs(const __grid_constant__ struct gbg_cuda_symmetric s, int64_t pass)
{
    const int block_size = THREADS * each, warp = threadIdx.x / 32, lane = threadIdx.x % 32;
    __shared__ double total[dimension][each][THREADS];
    __shared__ float collected[HELD][WARPS][dimension][THREADS];
    int64_t block = pass * s.batch + blockIdx.x, all = s.reach * each;
    struct group<dimension, each> g;
    struct sights<dimension> seen;
    take_group(s, block * block_size + warp * 32 * each, &g);
    for (int k = 0; k < each; k++) {
        for (int a = 0; a < dimension; a++) {
            total[a][k][threadIdx.x] = 0.0;
        }
    }
    const int64_t begin = all * blockIdx.y / s.splits;
    int64_t end = all * (blockIdx.y + 1) / s.splits;
    if (s.blocks % 2 == 0 && 2 * block >= s.blocks && end > all - each) {
        end = all - each; /* the farthest block meets this one */
    }
    int held = 0;
    for (int64_t tile = begin; tile < end; tile++) {
        int64_t distance = tile / each, other = block + distance;
        int part = (int)(tile % each); /* of the other block */
        other -= other >= s.blocks ? s.blocks : 0;
        if (part == 0 || tile == begin) {
            seen = look_round(s, g, other);
        }
#pragma unroll 1
        for (int c = 0; c < CHUNKS; c++) {
            int number = part * CHUNKS + c;
            float got[dimension];
            face<dimension, whole, each>(s, &g, other * each * CHUNKS + number, seen, number, total,
                                         got);
            for (int a = 0; a < dimension; a++) {
                collected[held][warp][a][32 * c + lane] = got[a];
            }
        }
        flush(&g, total, g.scale);
        held++;
        if (held == HELD || tile + 1 == end) {
            __syncthreads();
            put_rows<dimension>(s, collected, held,
                                (blockIdx.x * s.reach * each + tile + 1 - held) * THREADS);
            __syncthreads();
            held = 0;
        }
    }
    int64_t place = (blockIdx.x * s.splits + blockIdx.y) * block_size + warp * 32 * each + lane;
    for (int k = 0; k < each; k++) {
        for (int a = 0; a < dimension; a++) {
            s.own[a][place + 32 * k] = total[a][k][threadIdx.x];
        }
    }
}

/* Adds the rows of a pass on axis blockIdx.y: as a source of each of its blocks, in their order,
 * and as a target. The last pass gives the forces, so that small sums need no kernel more. */
static __global__ void collect(const __grid_constant__ struct gbg_state state,
                               const __grid_constant__ struct gbg_cuda_symmetric s, int64_t pass,
                               int count, struct result result)
{
    int64_t p = gbg_cuda_index();
    if (p >= s.padded) {
        return;
    }
    const int a = (int)blockIdx.y, blocks = (int)s.blocks, begin = (int)(pass * s.batch);
    const int mine = (int)(p / s.block), inside = (int)(p % s.block);
    double field = pass > 0 ? s.field[a][p] : 0.0;
#pragma unroll 8
    for (int b = 0; b < count; b++) {
        int block = begin + b, distance = mine - block + (mine < block ? blocks : 0);
        bool met =
            distance > 0 && distance < s.reach && !(2 * distance == blocks && 2 * block >= blocks);
        int64_t place = (b * s.reach + (met ? distance : 0)) * s.block + inside;
        float got = s.row[a][place]; /* there always is one: loads need not wait for each other */
        field -= met ? (double)got : 0.0;
    }
    if (mine >= begin && mine < begin + count) {
        const double *own = s.own[a] + (mine - begin) * s.splits * s.block + inside;
#pragma unroll 8
        for (int64_t k = 0; k < s.splits; k++) {
            field += own[k * s.block];
        }
    }
    if (!result.last) {
        s.field[a][p] = field;
        return;
    }
    int64_t i = p < s.n ? s.order[p] : state.owned;
    if (i < state.owned) {
        double mobility = state.mobility[state.species ? state.species[i] : 0] * result.factor;
        double force = mobility * field, *target = &state.force[a][i];
        *target = result.add ? *target + force : force;
    }
}

typedef void (*kernel)(const struct gbg_cuda_symmetric, int64_t);

template <int dimension, int each> static kernel choose(int whole)
{
    return whole == 1   ? all_pairs<dimension, 1, each>
           : whole == 2 ? all_pairs<dimension, 2, each>
           : whole == 3 ? all_pairs<dimension, 3, each>
           : whole == 4 ? all_pairs<dimension, 4, each>
           : whole == 5 ? all_pairs<dimension, 5, each>
                        : all_pairs<dimension, 6, each>;
}

static int sum(struct gbg_device *device, const struct gbg_state *state,
               const struct gbg_cuda_symmetric *s, int whole, struct result result)
{
    int dimension = state->box.dimension;
    kernel chosen = dimension == 2 ? (s->each == 4 ? choose<2, 4>(whole) : choose<2, 8>(whole))
                                   : (s->each == 4 ? choose<3, 4>(whole) : choose<3, 8>(whole));
    for (int64_t pass = 0; pass * s->batch < s->blocks; pass++) {
        int64_t left = s->blocks - pass * s->batch, count = left < s->batch ? left : s->batch;
        dim3 units((unsigned)count, (unsigned)s->splits);
        chosen<<<units, THREADS, 0, device->stream>>>(*s, pass);
        dim3 rows(gbg_cuda_blocks(s->padded), (unsigned)dimension);
        result.last = left <= s->batch;
        collect<<<rows, GBG_CUDA_THREADS, 0, device->stream>>>(*state, *s, pass, (int)count,
                                                               result);
    }
    return gbg_cuda_started(device, "direct sum, symmetric");
}

int gbg_cuda_direct_symmetric(struct gbg_device *device, struct gbg_state *state, double power,
                              int add)
{
    struct gbg_cuda_direct direct = gbg_cuda_direct_make(state, power);
    struct gbg_cuda_symmetric s = gbg_cuda_symmetric_make(state);
    void *base;
    if (state->owned == 0) {
        return GBG_OK;
    }
    int status = gbg_cuda_workspace(
        device, gbg_cuda_symmetric_lay_out(&s, state->box.dimension, NULL), &base);
    if (status != GBG_OK) {
        return status;
    }
    gbg_cuda_symmetric_lay_out(&s, state->box.dimension, base);
    for (int a = 0; a < state->box.dimension; a++) {
        s.scale[a] = (float)direct.scale[a];
        s.half[a] = (float)(direct.scale[a] * 0x1p31);
        s.fine[a] = direct.scale[a] * 0x1p-32;
    }
    s.strength = direct.strength;
    status = gbg_cuda_symmetric_sort(device, state, &s);
    struct result result = {direct.factor, add, 0};
    return status ? status : sum(device, state, &s, direct.whole, result);
}
