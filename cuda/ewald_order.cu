/* L1, CUDA: particles in the order of cells, in a cell by rank: counted, placed in any order by
 * integer atomics, then each put where its rank says, so that no order in memory shows. */
#include "cuda/ewald_kernels.h"

#include <cub/device/device_scan.cuh>

namespace
{

/* What is sorted. begin has two entries more than cells: counts of cell c are made in begin[c+2];
 * summed up, begin[c+1] is where c begins, and placing moves it to where c ends. */
template <int D, typename Real> struct sorting {
    struct gbg_cuda_ewald_cells cells;
    int64_t n;
    double strength; /* of sources */
    gbg_cuda_ewald_record<D, Real> *record, *placed;
    int32_t *index, *placed_index;
    uint32_t *top, *placed_top;
    const int32_t *rank; /* NULL: the index */
    void *scratch;       /* of the sum */
    size_t scratch_bytes;
};

/* Where a particle is, as its record will tell it. */
template <int D> struct spot {
    uint64_t whole[D];
    int32_t cell;
};

} // namespace

template <int D, typename Real>
static __device__ __forceinline__ spot<D> spot_of(const struct gbg_state &state,
                                                  const sorting<D, Real> &job, int64_t i)
{
    spot<D> spot = {};
    for (int a = D - 1; a >= 0; a--) {
        uint64_t whole = (uint64_t)state.high[a][i] << 32;
        if (sizeof(Real) == 8 || job.cells.shift[a] > 0) {
            whole |= state.low[a][i];
        }
        if (sizeof(Real) == 4) { /* what the record has no room for */
            whole = whole >> (32 - job.cells.shift[a]) << (32 - job.cells.shift[a]);
        }
        spot.whole[a] = whole;
        spot.cell = spot.cell * job.cells.cells[a] + gbg_cuda_ewald_cell(whole, job.cells.cells[a]);
    }
    return spot;
}

template <int D, typename Real>
static __global__ void count(const __grid_constant__ struct gbg_state state,
                             const __grid_constant__ sorting<D, Real> job)
{
    int64_t i = gbg_cuda_index();
    if (i < job.n) {
        atomicAdd(&job.cells.begin[spot_of(state, job, i).cell + 2], 1);
    }
}

template <int D, typename Real>
static __global__ void place(const __grid_constant__ struct gbg_state state,
                             const __grid_constant__ sorting<D, Real> job)
{
    int64_t i = gbg_cuda_index();
    if (i >= job.n) {
        return;
    }
    spot<D> spot = spot_of(state, job, i);
    gbg_cuda_ewald_record<D, Real> record = {};
    uint32_t top = 0;
    for (int a = 0; a < D; a++) {
        if constexpr (sizeof(Real) == 4) {
            int shift = job.cells.shift[a];
            record.at[a] = (uint32_t)(spot.whole[a] >> (32 - shift));
            top |= (uint32_t)(spot.whole[a] >> 1 >> (63 - shift)) << (a * gbg_cuda_ewald_top(D));
        } else {
            record.at[a] = spot.whole[a];
        }
    }
    double alpha =
        state.own_alpha ? state.own_alpha[i] : state.alpha[state.species ? state.species[i] : 0];
    record.source = (Real)(alpha * job.strength);
    int32_t slot = atomicAdd(&job.cells.begin[spot.cell + 1], 1);
    if constexpr (sizeof(Real) == 4 && D == 2) {
        record.top = top;
    } else if constexpr (sizeof(Real) == 4) {
        job.placed_top[slot] = top;
    }
    job.placed[slot] = record;
    job.placed_index[slot] = (int32_t)i;
}

template <int D, typename Real>
static __device__ __forceinline__ int32_t rank_in(const sorting<D, Real> &job, int32_t slot)
{
    int32_t index = job.placed_index[slot];
    return job.rank ? job.rank[index] : index;
}

template <int D, typename Real>
static __global__ void settle(const __grid_constant__ sorting<D, Real> job)
{
    int64_t slot = gbg_cuda_index();
    if (slot >= job.n) {
        return;
    }
    gbg_cuda_ewald_record<D, Real> record = job.placed[slot];
    uint64_t whole[D];
    gbg_cuda_ewald_read(job.cells.shift, record, job.placed_top, slot, whole);
    int32_t cell = 0, rank = rank_in(job, (int32_t)slot);
    for (int a = D - 1; a >= 0; a--) {
        cell = cell * job.cells.cells[a] + gbg_cuda_ewald_cell(whole[a], job.cells.cells[a]);
    }
    int32_t begin = job.cells.begin[cell], end = job.cells.begin[cell + 1], to = begin;
    for (int32_t other = begin; other < end; other++) {
        to += rank_in(job, other) < rank ? 1 : 0;
    }
    job.record[to] = record;
    job.index[to] = job.placed_index[slot];
    if (sizeof(Real) == 4 && D == 3) {
        job.top[to] = job.placed_top[slot];
    }
}

template <int D, typename Real>
static cudaError_t sum_counts(struct gbg_device *device, const struct gbg_ewald *sum,
                              sorting<D, Real> *job)
{
    int32_t *begin = sum->cells.begin;
    return cub::DeviceScan::InclusiveSum(job->scratch, job->scratch_bytes, begin, begin,
                                         (int)(sum->n_cells + 2), device->stream);
}

/* Memory for one sort: that of the meshes, which hold nothing now, and the workspace. */
template <int D, typename Real>
static int take_sorting(struct gbg_device *device, struct gbg_ewald *sum, sorting<D, Real> *job)
{
    int64_t deep = sizeof(Real) == 4 && D == 3 ? sum->n : 0;
    bool fits = (size_t)sum->n * sizeof *job->placed <= sum->mesh_bytes;
    void *base = NULL;
    int status =
        gbg_cuda_status(device, sum_counts(device, sum, job), "asking for the memory of a sum");
    for (int pass = 0; status == GBG_OK && pass < 2; pass++) {
        size_t used = 0;
        void *placed = gbg_cuda_take(base, &used, fits ? 0 : sum->n, sizeof *job->placed);
        job->placed = (gbg_cuda_ewald_record<D, Real> *)(fits ? sum->mesh : placed);
        job->placed_index = (int32_t *)gbg_cuda_take(base, &used, sum->n, 4);
        job->placed_top = (uint32_t *)gbg_cuda_take(base, &used, deep, 4);
        /* never NULL when it sums, which would only ask for memory again */
        job->scratch = gbg_cuda_take(base, &used, (int64_t)job->scratch_bytes + 1, 1);
        status = pass ? status : gbg_cuda_workspace(device, used, &base);
    }
    return status;
}

template <int D, typename Real>
static int sort(struct gbg_device *device, const struct gbg_state *state, struct gbg_ewald *sum)
{
    sorting<D, Real> job = {};
    job.cells = sum->cells;
    job.n = sum->n;
    job.strength = 1.0 / sum->largest;
    job.record = (gbg_cuda_ewald_record<D, Real> *)sum->record;
    job.index = sum->index;
    job.top = sum->top;
    job.rank = state->rank;
    unsigned blocks = gbg_cuda_blocks(sum->n);
    int status = take_sorting(device, sum, &job);
    status =
        status ? status : gbg_cuda_clear(device, sum->cells.begin, (size_t)(sum->n_cells + 2) * 4);
    if (status == GBG_OK) {
        count<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, job);
        status = gbg_cuda_started(device, "counting particles of cells");
    }
    status = status ? status
                    : gbg_cuda_status(device, sum_counts(device, sum, &job), "beginnings of cells");
    if (status == GBG_OK) {
        place<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, job);
        status = gbg_cuda_started(device, "placing particles in cells");
    }
    if (status == GBG_OK) {
        settle<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(job);
        status = gbg_cuda_started(device, "order of particles in cells");
    }
    return status;
}

/* Cells of about two particles, as fine as a quarter of the reach: finer ones hold fewer that are
 * looked at in vain, coarser ones have longer runs. */
static double wanted_edge(const struct gbg_state *state, double reach, int64_t n)
{
    double density = (double)n;
    int d = state->box.dimension;
    for (int a = 0; a < d; a++) {
        density *= reach / state->box.length[a];
    }
    double parts = floor(pow(0.5 * density, 1.0 / d) + 0.5);
    return reach / fmin(fmax(parts, 1.0), 4.0);
}

/* Particles that are looked at together are at most a reach and a cell apart: bits of a place above
 * twice that tell them nothing. */
static int32_t shift_of(int dimension, double apart)
{
    int32_t shift = 0;
    while (shift < gbg_cuda_ewald_top(dimension) && ldexp(1.0, -shift - 2) > apart) {
        shift++;
    }
    return shift;
}

static void lay_cells(const struct gbg_state *state, struct gbg_ewald *sum)
{
    double reach = sum->plan.choice.reach;
    int d = state->box.dimension;
    struct gbg_cuda_ewald_cells *cells = &sum->cells;
    sum->n_cells =
        gbg_grid_choose(&state->box, wanted_edge(state, reach, sum->n), sum->n, cells->cells);
    for (int a = 0; a < d; a++) {
        double part = reach / state->box.length[a], words = part * 0x1p32 * (1.0 + 2e-5) + 4096.0;
        double cell = 1.0 / cells->cells[a];
        cells->all[a] = 2.0 * words + 0x1p32 * cell + 1.0 >= 0x1p32;
        cells->reach[a] = cells->all[a] ? 0 : (uint32_t)words;
        cells->edge[a] = (float)(cell / part);
        cells->shift[a] =
            cells->all[a] ? 0 : shift_of(d, words * 0x1p-32 + cell + 0x1p-24 * part + 0x1p-30);
    }
}

int gbg_cuda_ewald_sort(struct gbg_device *device, const struct gbg_state *state,
                        struct gbg_ewald *sum)
{
    int d = state->box.dimension, single = sum->plan.choice.single;
    size_t size =
        single ? sizeof(gbg_cuda_ewald_record<3, float>) : sizeof(gbg_cuda_ewald_record<3, double>);
    const char *what = "particles of a sum by a mesh";
    sum->n = state->owned + state->ghost;
    lay_cells(state, sum);
    int status = gbg_cuda_grow(device, (void **)&sum->cells.begin, &sum->begin_capacity,
                               sum->n_cells + 2, 4, "cells of a sum by a mesh");
    status = status
                 ? status
                 : gbg_cuda_grow(device, &sum->record, &sum->record_capacity, sum->n, size, what);
    status =
        status ? status
               : gbg_cuda_grow(device, (void **)&sum->index, &sum->index_capacity, sum->n, 4, what);
    if (status == GBG_OK && d == 3 && single) {
        status = gbg_cuda_grow(device, (void **)&sum->top, &sum->top_capacity, sum->n, 4, what);
    }
    if (status != GBG_OK || sum->n == 0) {
        return status;
    }
    return d == 2
               ? single ? sort<2, float>(device, state, sum) : sort<2, double>(device, state, sum)
           : single ? sort<3, float>(device, state, sum)
                    : sort<3, double>(device, state, sum);
}

enum { TOTAL_BLOCKS = 64, TOTAL_THREADS = 256 };

/* Sources in a fixed order: each thread's, then those of a block, one after the other. */
template <int D, typename Real>
static __global__ void total(const gbg_cuda_ewald_record<D, Real> *record, int64_t n,
                             double *block_total)
{
    __shared__ double part[TOTAL_THREADS];
    double sum = 0.0;
    for (int64_t k = gbg_cuda_index(); k < n; k += TOTAL_BLOCKS * TOTAL_THREADS) {
        sum += (double)record[k].source;
    }
    part[threadIdx.x] = sum;
    __syncthreads();
    if (threadIdx.x == 0) {
        for (int k = 1; k < TOTAL_THREADS; k++) {
            sum += part[k];
        }
        block_total[blockIdx.x] = sum;
    }
}

template <int D, typename Real>
static void start_total(struct gbg_device *device, const struct gbg_ewald *sum, double *parts)
{
    total<<<TOTAL_BLOCKS, TOTAL_THREADS, 0, device->stream>>>(
        (const gbg_cuda_ewald_record<D, Real> *)sum->record, sum->n, parts);
}

int gbg_cuda_ewald_total(struct gbg_device *device, const struct gbg_ewald *sum, double *all)
{
    int d = sum->plan.choice.dimension, single = sum->plan.choice.single;
    double part[TOTAL_BLOCKS];
    void *there;
    int status = gbg_cuda_workspace(device, sizeof part, &there);
    if (status != GBG_OK) {
        return status;
    }
    (d == 2   ? single ? start_total<2, float> : start_total<2, double>
       : single ? start_total<3, float>
              : start_total<3, double>)(device, sum, (double *)there);
    status = gbg_cuda_started(device, "sum of all sources");
    status = status ? status : gbg_cuda_fetch(device, part, there, sizeof part);
    *all = 0.0;
    for (int k = 0; k < TOTAL_BLOCKS && status == GBG_OK; k++) {
        *all += part[k];
    }
    return status;
}
