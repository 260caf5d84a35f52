/* L1, CUDA: the order of the particles for the sum that computes each pair once: by species, so
 * that whole chunks have one strength, then along a Hilbert curve. */
#include "cuda/direct_symmetric.h"
#include "cuda/hilbert.h"

#include <cub/device/device_radix_sort.cuh>

/* Rows of partial sums that are held at a time, in bytes; units of work that are started at a
 * time. Neither changes a bit of the result as long as it is the same everywhere. */
static const int64_t ROOM = INT64_C(1) << 28;
static const int64_t UNITS = 8192;

/* Below so many particles, blocks of half the size fill the card better and are nearer to points.
 */
static const int64_t FEW = 1 << 17;

/* Bits of a cell on an axis; in a key they stand below the four of the species. */
enum { BITS_2D = 14, BITS_3D = 9, BITS = 28 };

static int64_t least(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

struct gbg_cuda_symmetric gbg_cuda_symmetric_make(const struct gbg_state *state)
{
    struct gbg_cuda_symmetric s = {};
    int dimension = state->box.dimension;
    s.n = state->owned + state->ghost;
    s.each = s.n < FEW ? 4 : 8;
    s.block = s.each * GBG_SYMMETRIC_THREADS;
    s.blocks = (s.n + s.block - 1) / s.block;
    s.padded = s.blocks * s.block;
    s.reach = s.blocks / 2 + 1;
    int64_t row_bytes = s.reach * s.block * dimension * (int64_t)sizeof(float);
    s.batch = ROOM / row_bytes > 0 ? ROOM / row_bytes : 1;
    s.batch = least(s.batch, s.blocks);
    s.splits = least((UNITS + s.batch - 1) / (s.batch > 0 ? s.batch : 1), s.reach * s.each);
    return s;
}

size_t gbg_cuda_symmetric_lay_out(struct gbg_cuda_symmetric *s, int dimension, void *base)
{
    size_t used = 0;
    for (int a = 0; a < dimension; a++) {
        s->high[a] = (uint32_t *)gbg_cuda_take(base, &used, s->padded, 4);
        s->low[a] = (uint32_t *)gbg_cuda_take(base, &used, s->padded, 4);
        s->middle[a] = (uint32_t *)gbg_cuda_take(base, &used, s->padded / 32, 4);
        s->extent[a] = (uint32_t *)gbg_cuda_take(base, &used, s->padded / 32, 4);
        s->field[a] = (double *)gbg_cuda_take(base, &used, s->padded, 8);
        s->row[a] = (float *)gbg_cuda_take(base, &used, s->batch * s->reach * s->block, 4);
        s->own[a] = (double *)gbg_cuda_take(base, &used, s->batch * s->splits * s->block, 8);
    }
    s->common = (float *)gbg_cuda_take(base, &used, s->padded / 32, 4);
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
    struct gbg_cuda_symmetric s = gbg_cuda_symmetric_make(state);
    return s.n < GBG_CUDA_SYMMETRIC_FEWEST
               ? 0
               : gbg_cuda_symmetric_lay_out(&s, state->box.dimension, NULL);
}

/* Keys: species, cell, then the rank, so that the order of a caller's arrays does not show. Cells
 * are squares whatever the box. */
template <int dimension>
static __global__ void make_keys(const __grid_constant__ struct gbg_state state,
                                 const __grid_constant__ struct gbg_cuda_symmetric s)
{
    int64_t i = gbg_cuda_index();
    if (i < s.n) {
        const int bits = dimension == 2 ? BITS_2D : BITS_3D;
        uint32_t x[dimension], kind = state.species ? state.species[i] : 0;
        for (int a = 0; a < dimension; a++) {
            double part = (double)state.high[a][i] * (double)s.half[a] * 0x1p-5;
            x[a] = (part < 0x1p32 ? (uint32_t)part : UINT32_MAX) >> (32 - bits);
        }
        uint32_t place = kind << BITS | gbg_cuda_hilbert<dimension>(x, bits);
        s.key[0][i] = (uint64_t)place << 32 | (uint32_t)gbg_rank_of(&state, i);
        s.index[i] = (int32_t)i;
    }
}

/* Particles in their new order; those that fill up the last block have no strength. Chunks: a warp
 * each, since padded is a multiple of 32. */
static __global__ void gather(const __grid_constant__ struct gbg_state state,
                              const __grid_constant__ struct gbg_cuda_symmetric s)
{
    int64_t p = gbg_cuda_index();
    if (p >= s.padded) {
        return;
    }
    int64_t i = s.order[p < s.n ? p : s.n - 1];
    float alpha = p < s.n ? (float)(gbg_cuda_alpha(state, i) * s.strength) : 0.0f;
    bool same = __all_sync(0xFFFFFFFFu, alpha == __shfl_sync(0xFFFFFFFFu, alpha, 0));
    s.alpha[p] = alpha;
    if (p % 32 == 0) {
        s.common[p / 32] = same ? alpha : __int_as_float(0x7FC00000);
    }
    for (int a = 0; a < state.box.dimension; a++) {
        uint32_t high = state.high[a][i], middle, extent;
        s.high[a][p] = high;
        s.low[a][p] = state.low[a][i];
        gbg_cuda_interval<1>(&high, &middle, &extent);
        if (p % 32 == 0) {
            s.middle[a][p / 32] = middle;
            s.extent[a][p / 32] = extent;
        }
    }
}

/* The lowest bit of a key that is worth sorting by: those of cells much smaller than the distance
 * of neighbours are not. */
static int lowest_bit(int64_t n, int dimension)
{
    int bits = dimension == 2 ? 2 * BITS_2D : 3 * BITS_3D, useful = 4;
    for (; n > 1; n >>= 1) {
        useful++;
    }
    return useful < bits ? 32 + bits - useful : 32;
}

/* Bits of a key up to the highest that any has. */
static int highest_bit(const struct gbg_state *state)
{
    int kinds = 0;
    while (state->species && 1 << kinds < state->n_species) {
        kinds++;
    }
    return 32 + BITS + kinds;
}

int gbg_cuda_symmetric_sort(struct gbg_device *device, const struct gbg_state *state,
                            const struct gbg_cuda_symmetric *s)
{
    int dimension = state->box.dimension, lowest = state->rank ? 0 : lowest_bit(s->n, dimension);
    unsigned blocks = gbg_cuda_blocks(s->padded);
    (dimension == 2 ? make_keys<2>
                    : make_keys<3>)<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, *s);
    size_t bytes = s->scratch_bytes;
    cudaError_t error =
        cub::DeviceRadixSort::SortPairs(s->scratch, bytes, s->key[0], s->key[1], s->index, s->order,
                                        s->n, lowest, highest_bit(state), device->stream);
    gather<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, *s);
    int status = gbg_cuda_status(device, error, "sorting particles");
    return status ? status : gbg_cuda_started(device, "direct sum, order");
}
