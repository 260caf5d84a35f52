/* L1, CUDA: minimum-image sums over all pairs with the same bits as on the CPU
 * (backend/cpu/direct_strict.h): a thread a target, sources in tiles. */
#include "backend/cpu/direct_strict.h"

#include "cuda/direct.h"

namespace
{

enum { THREADS = 2 * GBG_STRICT_BLOCK }; /* of a block; also the sources of a tile */

/* Particles in the order of ids, padded with sources of strength 0. */
struct packed {
    int64_t n, padded;
    int64_t spans, segments; /* a segment is all spans, or one of them */
    int4 *source;            /* high words and the bits of the strength */
    uint64_t *position[3];
    double *alpha;
    double *partial; /* [segment][axis][target] */
};

/* Particles up to this many are so few that every span has threads of its own. */
const int64_t FEW = 32768;

} // namespace

static struct packed make(const struct gbg_state *state)
{
    struct packed p = {};
    p.n = state->owned + state->ghost;
    p.padded = (p.n + THREADS - 1) / THREADS * THREADS;
    p.spans = (p.padded + GBG_STRICT_SPAN - 1) / GBG_STRICT_SPAN;
    p.segments = p.padded <= FEW ? p.spans : 1;
    return p;
}

/* The arrays in a workspace; base NULL: only counts. */
static size_t lay_out(struct packed *p, int dimension, void *base)
{
    size_t used = 0;
    p->source = (int4 *)gbg_cuda_take(base, &used, p->padded, sizeof(int4));
    for (int a = 0; a < dimension; a++) {
        p->position[a] = (uint64_t *)gbg_cuda_take(base, &used, p->padded, 8);
    }
    p->alpha = (double *)gbg_cuda_take(base, &used, p->padded, 8);
    p->partial = (double *)gbg_cuda_take(base, &used, p->segments * dimension * p->padded, 8);
    return used;
}

size_t gbg_cuda_strict_bytes(const struct gbg_state *state)
{
    struct packed p = make(state);
    return lay_out(&p, state->box.dimension, NULL);
}

static __global__ void pack(const __grid_constant__ struct gbg_state state,
                            const __grid_constant__ struct gbg_strict s,
                            const __grid_constant__ struct packed p)
{
    int64_t i = gbg_cuda_index();
    if (i >= p.padded) {
        return;
    }
    bool real = i < p.n;
    int64_t k = real ? gbg_strict_place(&state, i) : i;
    double alpha = real ? gbg_strict_alpha(&s, &state, i) : 0.0;
    int32_t high[3] = {};
    for (int a = 0; a < s.dimension; a++) {
        p.position[a][k] = real ? gbg_cuda_position(state, a, i) : 0;
        high[a] = real ? (int32_t)state.high[a][i] : 0;
    }
    p.alpha[k] = alpha;
    p.source[k] = make_int4(high[0], high[1], high[2], __float_as_int((float)alpha));
}

/* A target and source k in double precision. */
template <int dimension>
static __device__ __forceinline__ void add_fine(const struct gbg_strict &s, const struct packed &p,
                                                const uint64_t own[dimension], int64_t k,
                                                double total[dimension])
{
    vl difference[dimension];
    for (int a = 0; a < dimension; a++) {
        difference[a] = (vl)(own[a] - p.position[a][k]);
    }
    gbg_strict_add_fine(&s, difference, p.alpha[k], true, dimension, total);
}

/* The differences of high words of a pair, its vector, and whether it is doubtful. */
template <int dimension>
static __device__ __forceinline__ bool look(const struct gbg_strict &s,
                                            const uint64_t own[dimension], const int4 &there,
                                            float r[dimension], float *squared)
{
    const int32_t high[3] = {there.x, there.y, there.z};
    vi difference[dimension];
    for (int a = 0; a < dimension; a++) {
        difference[a] = vi_sub((vi)(own[a] >> 32), high[a]);
    }
    *squared = gbg_strict_vector(s.scale, difference, dimension, r);
    return gbg_strict_doubtful(*squared, s.near, difference, dimension);
}

/* A target and a block of sources, of which `tile` holds the high words. */
template <int dimension, int law>
static __device__ __forceinline__ void add_block(const struct gbg_strict &s, const struct packed &p,
                                                 const uint64_t own[dimension], const int4 *tile,
                                                 int64_t first, double total[dimension])
{
    float sum[dimension] = {}, r[dimension], squared;
    bool doubts = false;
#pragma unroll 8
    for (int row = 0; row < GBG_STRICT_BLOCK; row++) {
        const int4 there = tile[row];
        bool doubtful = look<dimension>(s, own, there, r, &squared);
        float w = vf_mul(gbg_strict_weight(squared, s.general, law), __int_as_float(there.w));
        w = vf_keep(!doubtful, w);
        doubts |= doubtful;
        for (int a = 0; a < dimension; a++) {
            sum[a] = vf_fma(w, r[a], sum[a]);
        }
    }
    if (doubts) {
#pragma unroll 1
        for (int row = 0; row < GBG_STRICT_BLOCK; row++) {
            if (look<dimension>(s, own, tile[row], r, &squared)) {
                add_fine<dimension>(s, p, own, first + row, total);
            }
        }
    }
    for (int a = 0; a < dimension; a++) {
        total[a] = vd_add(total[a], (double)sum[a]);
    }
}

/* The field of this thread's target from the spans of its segment: add(own, first, last, total)
 * adds the sources of a span to its total. */
template <int dimension, typename Add>
static __device__ __forceinline__ void sum_spans(const struct packed &p, Add add)
{
    int64_t i = gbg_cuda_index(), segment = blockIdx.y; /* i < padded: blocks are full */
    int64_t begin = p.segments > 1 ? segment : 0, end = p.segments > 1 ? segment + 1 : p.spans;
    uint64_t own[dimension];
    double field[dimension] = {};
    for (int a = 0; a < dimension; a++) {
        own[a] = p.position[a][i];
    }
    for (int64_t span = begin; span < end; span++) {
        double total[dimension] = {};
        int64_t first = span * GBG_STRICT_SPAN;
        add(own, first, first + GBG_STRICT_SPAN < p.padded ? first + GBG_STRICT_SPAN : p.padded,
            total);
        for (int a = 0; a < dimension; a++) {
            field[a] = vd_add(field[a], total[a]);
        }
    }
    for (int a = 0; a < dimension; a++) {
        p.partial[(segment * dimension + a) * p.padded + i] = field[a];
    }
}

template <int dimension, int law>
static __global__ void __launch_bounds__(THREADS)
    all_pairs(const __grid_constant__ struct gbg_strict s, const __grid_constant__ struct packed p)
{
    __shared__ int4 tile[THREADS];
    sum_spans<dimension>(p, [&](const uint64_t *own, int64_t first, int64_t last, double *total) {
        for (; first < last; first += THREADS) {
            tile[threadIdx.x] = p.source[first + threadIdx.x];
            __syncthreads();
            for (int k = 0; k < THREADS; k += GBG_STRICT_BLOCK) {
                add_block<dimension, law>(s, p, own, tile + k, first + k, total);
            }
            __syncthreads();
        }
    });
}

/* The same, every pair in double precision. */
template <int dimension>
static __global__ void __launch_bounds__(THREADS)
    all_pairs_fine(const __grid_constant__ struct gbg_strict s,
                   const __grid_constant__ struct packed p)
{
    sum_spans<dimension>(p, [&](const uint64_t *own, int64_t first, int64_t last, double *total) {
        for (int64_t k = first; k < last; k++) {
            add_fine<dimension>(s, p, own, k, total);
        }
    });
}

static __global__ void finish(const __grid_constant__ struct gbg_state state,
                              const __grid_constant__ struct gbg_strict s,
                              const __grid_constant__ struct packed p, int add)
{
    int64_t i = gbg_cuda_index();
    if (i >= state.owned) {
        return;
    }
    int64_t k = gbg_strict_place(&state, i);
    double mobility = state.mobility[state.species ? state.species[i] : 0] * s.factor;
    for (int a = 0; a < s.dimension; a++) {
        double field = 0.0;
        for (int64_t segment = 0; segment < p.segments; segment++) {
            field += p.partial[(segment * s.dimension + a) * p.padded + k];
        }
        double force = mobility * field, *target = &state.force[a][i];
        *target = add ? *target + force : force;
    }
}

typedef void (*kernel)(const struct gbg_strict, const struct packed);

template <int dimension> static kernel choose(int law)
{
    static const kernel all[GBG_STRICT_MOST + 2] = {
        all_pairs_fine<dimension>, all_pairs<dimension, GBG_STRICT_GENERAL>,
        all_pairs<dimension, 1>,   all_pairs<dimension, 2>,
        all_pairs<dimension, 3>,   all_pairs<dimension, 4>,
        all_pairs<dimension, 5>,   all_pairs<dimension, 6>};
    return all[law - GBG_STRICT_DOUBLE];
}

int gbg_cuda_direct_strict(struct gbg_device *device, struct gbg_state *state, double power,
                           int add)
{
    const struct gbg_strict s = gbg_strict_make(state, power);
    struct packed p = make(state);
    void *base;
    if (state->owned == 0) {
        return GBG_OK;
    }
    int status = gbg_cuda_workspace(device, lay_out(&p, s.dimension, NULL), &base);
    if (status != GBG_OK) {
        return status;
    }
    lay_out(&p, s.dimension, base);
    unsigned blocks = gbg_cuda_blocks(p.padded, THREADS);
    pack<<<blocks, THREADS, 0, device->stream>>>(*state, s, p);
    kernel chosen = s.dimension == 2 ? choose<2>(s.law) : choose<3>(s.law);
    chosen<<<dim3(blocks, (unsigned)p.segments), THREADS, 0, device->stream>>>(s, p);
    finish<<<gbg_cuda_blocks(state->owned), GBG_CUDA_THREADS, 0, device->stream>>>(*state, s, p,
                                                                                   add);
    return gbg_cuda_started(device, "direct sum, strict");
}
