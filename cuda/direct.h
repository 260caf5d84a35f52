/* L1, CUDA: what the sums over all pairs share: the layout of their work arrays, pairs in double
 * precision, the power law. */
#ifndef GBG_CUDA_DIRECT_H
#define GBG_CUDA_DIRECT_H

#include "backend/cpu/grid.h"
#include "cuda/kernels.h"

/* Sources that act at a time; sums over a tile are in the precision of a pair, those over tiles in
 * double. Also the threads of a block. */
enum { GBG_CUDA_TILE = 128 };

/* Vectors shorter than this many quanta of the longest axis are too coarse in high words, as in
 * backend/cpu/direct.h. */
#define GBG_CUDA_DIRECT_NEAR 0x1p21

/* Fewer particles are not worth a sort. */
enum { GBG_CUDA_SYMMETRIC_FEWEST = 8192 };

/* Powers up to this one have 32-bit pairs; beyond it their relative errors exceed 1e-6. */
enum { GBG_CUDA_DIRECT_POWER = 6 };

struct gbg_cuda_direct {
    int64_t targets, n;      /* owned; with ghosts: sources */
    int64_t tiles, segments; /* of sources; a segment is summed by one block for its targets */
    int whole;               /* the power, if it has code of its own, else 0 */
    double power;
    double scale[3]; /* of differences of high words; the unit is 2^-6 of the longest side */
    float near;      /* squared distance below which pairs of the simple sum take all 64 bits */
    double strength; /* alpha times this is at most 1 */
    double factor;   /* fields to forces in the user's units */
    double *partial; /* [segment][axis][target] */
};

struct gbg_cuda_direct gbg_cuda_direct_make(const struct gbg_state *state, double power);
/* Its work arrays, in the device's workspace; `more` bytes beyond them at *rest. */
int gbg_cuda_direct_room(struct gbg_device *device, const struct gbg_state *state,
                         struct gbg_cuda_direct *direct, size_t more, void **rest);
typedef void (*gbg_cuda_direct_kernel)(const struct gbg_state, const struct gbg_cuda_direct);
/* Starts a kernel for all targets and segments, then force (+)= mobility factor sum of the
 * segments' fields. */
int gbg_cuda_direct_run(struct gbg_device *device, const struct gbg_state *state,
                        struct gbg_cuda_direct *direct, gbg_cuda_direct_kernel kernel, int add,
                        const char *what);
/* Workspace of the symmetric and the strict sum, for direct_reserve. */
size_t gbg_cuda_symmetric_bytes(const struct gbg_state *state);
size_t gbg_cuda_strict_bytes(const struct gbg_state *state);

static __device__ __forceinline__ double gbg_cuda_alpha(const struct gbg_state &state, int64_t i)
{
    return state.own_alpha ? state.own_alpha[i] : state.alpha[state.species ? state.species[i] : 0];
}

static __device__ __forceinline__ uint64_t gbg_cuda_position(const struct gbg_state &state,
                                                             int axis, int64_t i)
{
    return gbg_join(state.high[axis][i], state.low[axis][i]);
}

/* The target of a thread and the tiles of sources of its block. */
template <int dimension> struct gbg_cuda_target {
    int64_t i, segment, begin, end;
    uint64_t own[dimension];
    double total[dimension];

    __device__ gbg_cuda_target(const struct gbg_state &state, const struct gbg_cuda_direct &direct)
        : i(gbg_cuda_index()), segment(blockIdx.y), begin(direct.tiles * segment / direct.segments),
          end(direct.tiles * (segment + 1) / direct.segments)
    {
        for (int a = 0; a < dimension; a++) {
            own[a] = i < direct.targets ? gbg_cuda_position(state, a, i) : 0;
            total[a] = 0.0;
        }
    }
    __device__ void store(const struct gbg_cuda_direct &direct) const
    {
        for (int a = 0; a < dimension && i < direct.targets; a++) {
            direct.partial[(segment * dimension + a) * direct.targets + i] = total[a];
        }
    }
};

/* 1/sqrt(a) for normal a > 0, relative error below 4e-16: the unit's seed of 20 bits and a step of
 * order 3. */
static __device__ __forceinline__ double gbg_cuda_rsqrt(double a)
{
    double y;
    asm("rsqrt.approx.ftz.f64 %0, %1;" : "=d"(y) : "d"(a));
    double e = __fma_rn(-(y * y), a, 1.0);
    return __fma_rn(y * e, __fma_rn(e, 0.375, 0.5), y);
}

/* y^(whole+1), whole 1 .. 6. */
template <int whole, typename real> static __device__ __forceinline__ real gbg_cuda_raise(real y)
{
    real second = y * y;
    return whole == 1   ? second
           : whole == 2 ? second * y
           : whole == 3 ? second * second
           : whole == 4 ? second * second * y
           : whole == 5 ? second * second * second
                        : second * second * second * y;
}

/* |r|^-(power+1) of r^2 > 0. */
template <int whole>
static __device__ __forceinline__ double gbg_cuda_weight(double squared, double power)
{
    return whole ? gbg_cuda_raise<whole>(gbg_cuda_rsqrt(squared))
                 : pow(squared, -0.5 * (power + 1.0));
}

/* Adds alpha r/|r|^(power+1) from a source, by its position; nothing where both coincide. */
template <int dimension, int whole>
static __device__ __forceinline__ void
gbg_cuda_add_pair(const struct gbg_cuda_direct &direct, const uint64_t own[dimension],
                  const uint64_t there[dimension], double alpha, double sum[dimension])
{
    double r[dimension], squared = 0.0;
    for (int a = 0; a < dimension; a++) {
        r[a] = (double)(int64_t)(own[a] - there[a]) * (direct.scale[a] * 0x1p-32);
        squared = __fma_rn(r[a], r[a], squared);
    }
    double w = squared > 0.0
                   ? alpha * gbg_cuda_weight<whole>(squared > 0.0 ? squared : 1.0, direct.power)
                   : 0.0;
    for (int a = 0; a < dimension; a++) {
        sum[a] = __fma_rn(w, r[a], sum[a]);
    }
}

/* A kernel of two template numbers, dimension and whole power (0: any). */
#define GBG_CUDA_CHOOSE(kernel, dimension, whole)                                                  \
    ((dimension) == 2 ? (whole) == 1   ? kernel<2, 1>                                              \
                        : (whole) == 2 ? kernel<2, 2>                                              \
                        : (whole) == 3 ? kernel<2, 3>                                              \
                        : (whole) == 4 ? kernel<2, 4>                                              \
                        : (whole) == 5 ? kernel<2, 5>                                              \
                        : (whole) == 6 ? kernel<2, 6>                                              \
                                       : kernel<2, 0>                                              \
     : (whole) == 1 ? kernel<3, 1>                                                                 \
     : (whole) == 2   ? kernel<3, 2>                                                               \
     : (whole) == 3   ? kernel<3, 3>                                                               \
     : (whole) == 4   ? kernel<3, 4>                                                               \
     : (whole) == 5   ? kernel<3, 5>                                                               \
     : (whole) == 6   ? kernel<3, 6>                                                               \
                      : kernel<3, 0>)

#endif
