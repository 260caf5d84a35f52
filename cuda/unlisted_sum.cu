/* L1, CUDA: cut-off sums straight from cells: a thread a particle finds its neighbours, sorts them
 * by rank and adds them in that order, so that the bits are those of the sums over lists. */
#include "cuda/network.h"
#include "cuda/places.h"
#include "cuda/unlisted.h"

namespace
{

enum {
    THREADS = GBG_CUDA_THREADS,
    NONE = INT32_MAX,
    FEW = GBG_CUDA_CLOSE_FEW,
    MANY = GBG_CUDA_CLOSE_MANY
};

struct input {
    struct gbg_state state;
    struct gbg_cuda_grid grid; /* with local coordinates */
    struct gbg_cuda_cutoff job;
    float limit; /* of squared distances, with room; the sums look again */
    const void *places;
    const int32_t *of_rank;
    unsigned *widest;
};

/* Sums of one particle by 32-bit coordinates. */
template <int dimension, int power, bool sources> struct in_mixed {
    typedef typename gbg_cuda_place<dimension, sources>::type place;
    place own;
    vf one, sum[dimension];

    __device__ __forceinline__ in_mixed(const input &in, int32_t i)
    {
        own = ((const place *)in.places)[i];
        one = sources ? 0.0f : (float)in.state.alpha[0];
        for (int a = 0; a < dimension; a++) {
            sum[a] = vf_set(0.0f);
        }
    }
    __device__ __forceinline__ void add(const input &in, int32_t j)
    {
        place other = ((const place *)in.places)[j];
        gbg_cuda_add_field<dimension, power, sources>(own, other, in.job.unit, one, sum);
    }
    __device__ __forceinline__ double field(const input &in, int a) const
    {
        return in.job.factor * (double)sum[a];
    }
};

/* The same by all 64 bits. */
template <int dimension> struct in_double {
    uint64_t own[dimension];
    double sum[dimension];

    __device__ __forceinline__ in_double(const input &in, int32_t i)
    {
        for (int a = 0; a < dimension; a++) {
            own[a] = gbg_join(in.state.high[a][i], in.state.low[a][i]);
            sum[a] = 0.0;
        }
    }
    __device__ __forceinline__ void add(const input &in, int32_t j)
    {
        const struct gbg_state &state = in.state;
        auto strength = [&] {
            return state.own_alpha ? state.own_alpha[j]
                                   : state.alpha[state.species ? state.species[j] : 0];
        };
        auto inverse = [&](double squared) {
            return gbg_inverse_double(squared, in.job.power, in.job.whole);
        };
        gbg_cuda_add_in_double<dimension>(state, in.job.limit, own, j, strength, inverse, sum);
    }
    __device__ __forceinline__ double field(const input &, int a) const
    {
        return sum[a];
    }
};

} // namespace

/* Calls visit(rank) for everybody within the cut-off of particle i at that slot, in any order. */
template <int dimension, typename Visit>
static __device__ __forceinline__ void for_close(const input &in, int64_t slot, int32_t i,
                                                 Visit visit)
{
    uint32_t own[dimension];
    for (int a = 0; a < dimension; a++) {
        own[a] = in.grid.high[a][slot];
    }
    gbg_cuda_visit(in.grid, in.grid.cell_of[i], [&](int32_t other) {
        vf squared = 0.0f;
        for (int a = 0; a < dimension; a++) {
            vi d = (vi)(own[a] - in.grid.high[a][other]);
            vf r = vf_mul(vf_from_vi(d), in.job.unit.scale[a]);
            squared = vf_fma(r, r, squared);
        }
        if (vf_lt(squared, in.limit) && other != slot) {
            visit(gbg_rank_of(&in.state, in.grid.particle[other]));
        }
    });
}

/* Sorts `count` <= N numbers, each THREADS after the one before. */
template <int N> static __device__ __forceinline__ void sort_row(int32_t *row, int count)
{
    int32_t key[N];
#pragma unroll
    for (int k = 0; k < N; k++) {
        key[k] = k < count ? row[k * THREADS] : (int32_t)NONE;
    }
    gbg_cuda_sort_step<N, 1, 1>(key);
#pragma unroll
    for (int k = 0; k < N; k++) {
        if (k < count) {
            row[k * THREADS] = key[k];
        }
    }
}

/* By the network that the longest row of a warp needs; rows beyond MOST are left alone. */
template <int MOST>
static __device__ __forceinline__ void sort_rows(int32_t *row, int count, unsigned widest)
{
    if (widest <= 8) {
        sort_row<8>(row, count);
    } else if (widest <= 16) {
        sort_row<16>(row, count);
    } else if (widest <= 24) {
        sort_row<24>(row, count);
    } else if (MOST == FEW || widest <= FEW) {
        sort_row<FEW>(row, count > FEW ? 0 : count);
    } else {
        sort_row<MANY>(row, count > MANY ? 0 : count);
    }
}

/* The lowest ranks above `last`, up to MOST of them, in ascending order; returns their number. */
template <int dimension, int MOST>
static __device__ int lowest_above(const input &in, int64_t slot, int32_t i, int32_t last,
                                   int32_t *row)
{
    int held = 0;
    for_close<dimension>(in, slot, i, [&](int32_t rank) {
        if (rank <= last || (held == MOST && rank > row[(MOST - 1) * THREADS])) {
            return;
        }
        int k = held < MOST ? held++ : MOST - 1;
        for (; k > 0 && row[(k - 1) * THREADS] > rank; k--) {
            row[k * THREADS] = row[(k - 1) * THREADS];
        }
        row[k * THREADS] = rank;
    });
    return held;
}

template <typename Sum>
static __device__ __forceinline__ void add_row(const input &in, const int32_t *row, int count,
                                               Sum &sum)
{
#pragma unroll 4
    for (int k = 0; k < count; k++) {
        int32_t rank = row[k * THREADS];
        sum.add(in, in.of_rank ? in.of_rank[rank] : rank);
    }
}

/* A thread a slot, so that those of a warp look into the same cells. */
template <int dimension, int MOST, typename Sum>
static __global__ void __launch_bounds__(THREADS) sum_close(const __grid_constant__ input in)
{
    __shared__ int32_t close[MOST * THREADS];
    int64_t slot = gbg_cuda_index();
    int32_t *row = close + threadIdx.x, i = slot < in.grid.n ? in.grid.particle[slot] : 0;
    int count = 0;
    if (slot < in.grid.n) {
        for_close<dimension>(in, slot, i, [&](int32_t rank) {
            if (count < MOST) {
                row[count * THREADS] = rank;
            }
            count++;
        });
    }
    unsigned widest = __reduce_max_sync(0xFFFFFFFFu, (unsigned)count);
    if (threadIdx.x % 32 == 0 && widest > *(volatile unsigned *)in.widest) { /* few come that far */
        atomicMax(in.widest, widest);
    }
    sort_rows<MOST>(row, count, widest);
    if (slot >= in.grid.n) {
        return;
    }
    Sum sum(in, i);
    if (count <= MOST) {
        add_row(in, row, count, sum);
    } else { /* by so many at a time, each time by looking at all */
        int32_t last = -1;
        for (int left = count; left > 0; left -= MOST) {
            int held = lowest_above<dimension, MOST>(in, slot, i, last, row);
            add_row(in, row, held, sum);
            last = row[(held - 1) * THREADS];
        }
    }
    for (int a = 0; a < dimension; a++) {
        gbg_cuda_store_force(in.state, in.job.add, i, a, sum.field(in, a));
    }
}

typedef void (*kernel)(const input);

template <int dimension, int MOST> static kernel choose_mixed(const input &in)
{
    bool sources = in.state.source != NULL;
    if (in.job.power == 2.0) {
        return sources ? sum_close<dimension, MOST, in_mixed<dimension, 2, true>>
                       : sum_close<dimension, MOST, in_mixed<dimension, 2, false>>;
    }
    return sources ? sum_close<dimension, MOST, in_mixed<dimension, 6, true>>
                   : sum_close<dimension, MOST, in_mixed<dimension, 6, false>>;
}

/* Squared cut-off with room for rounding, and for local coordinates that are off by up to a unit
 * each, which a cut-off far below the reach of the list would see. */
static float roomy_limit(const struct gbg_list *list, const struct gbg_cutoff_unit &unit)
{
    double length = sqrt((double)unit.limit);
    for (int a = 0; a < list->rows.dimension; a++) {
        length += 2.0 * list->unit[a] / unit.unit;
    }
    return (float)(length * length * (1.0 + 1e-5));
}

static input make_input(const struct gbg_state *state, const struct gbg_list *list,
                        const struct gbg_cuda_cutoff *job)
{
    const struct gbg_cuda_unlisted *unlisted = list->unlisted;
    float limit = roomy_limit(list, job->unit);
    input in = {*state, list->grid, *job, limit, unlisted->places, NULL, NULL};
    in.of_rank = state->rank ? unlisted->of_rank : NULL;
    in.widest = unlisted->widest;
    return in;
}

static int run(struct gbg_device *device, kernel chosen, const input &in,
               const struct gbg_list *list, const char *name)
{
    struct gbg_cuda_unlisted *unlisted = list->unlisted;
    unsigned widest = 0;
    chosen<<<gbg_cuda_blocks(in.grid.n, THREADS), THREADS, 0, device->stream>>>(in);
    int status = gbg_cuda_started(device, name);
    if (status == GBG_OK && !unlisted->looked) {
        status = gbg_cuda_fetch(device, &widest, in.widest, sizeof widest);
        unlisted->many = widest > FEW;
        unlisted->looked = 1;
    }
    return status;
}

int gbg_cuda_unlisted_mixed(struct gbg_device *device, const struct gbg_state *state,
                            const struct gbg_list *list, const struct gbg_cuda_cutoff *job)
{
    input in = make_input(state, list, job);
    bool few = !list->unlisted->many;
    kernel chosen = state->box.dimension == 2
                        ? few ? choose_mixed<2, FEW>(in) : choose_mixed<2, MANY>(in)
                    : few ? choose_mixed<3, FEW>(in)
                          : choose_mixed<3, MANY>(in);
    return run(device, chosen, in, list, "cut-off forces from cells, mixed");
}

int gbg_cuda_unlisted_double(struct gbg_device *device, const struct gbg_state *state,
                             const struct gbg_list *list, const struct gbg_cuda_cutoff *job)
{
    input in = make_input(state, list, job);
    bool few = !list->unlisted->many;
    kernel chosen = state->box.dimension == 2
                        ? few ? sum_close<2, FEW, in_double<2>> : sum_close<2, MANY, in_double<2>>
                    : few ? sum_close<3, FEW, in_double<3>>
                          : sum_close<3, MANY, in_double<3>>;
    return run(device, chosen, in, list, "cut-off forces from cells, double");
}
