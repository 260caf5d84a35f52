/* L1, CUDA: particles in the order of cells, in a cell by rank: counted, placed in any order by
 * integer atomics, then each put where its rank says, so that no order in memory shows. */
#include "cuda/ewald_kernels.h"

#include <cub/device/device_scan.cuh>

namespace
{

/* What is sorted. begin has two entries more than cells: counts of cell c are made in begin[c+2];
 * summed up, begin[c+1] is where c begins, and placing moves it to where c ends. */
template <typename Real> struct sorting {
    struct gbg_cuda_ewald_cells cells;
    int64_t n;
    double strength; /* of sources */
    gbg_cuda_ewald_record<Real> *record, *placed;
    int32_t *index, *placed_index; /* 3D */
    int32_t *placed_rank;          /* NULL: the index */
    void *scratch;                 /* of the sum */
    size_t scratch_bytes;
};

} // namespace

static __device__ __forceinline__ void read_place(const struct gbg_state &state, int a, int64_t i,
                                                  uint32_t *at)
{
    *at = state.high[a][i];
}
static __device__ __forceinline__ void read_place(const struct gbg_state &state, int a, int64_t i,
                                                  uint64_t *at)
{
    *at = gbg_join(state.high[a][i], state.low[a][i]);
}

template <int D, typename Word>
static __device__ __forceinline__ int32_t cell_of(const struct gbg_cuda_ewald_cells &cells,
                                                  const Word *at)
{
    int32_t cell = D == 3 ? gbg_cuda_ewald_cell(at[2], cells.cells[2]) * cells.cells[1] : 0;
    cell = (cell + gbg_cuda_ewald_cell(at[1], cells.cells[1])) * cells.cells[0];
    return cell + gbg_cuda_ewald_cell(at[0], cells.cells[0]);
}

template <int D, typename Real>
static __global__ void count(const __grid_constant__ struct gbg_state state,
                             const __grid_constant__ sorting<Real> job)
{
    int64_t i = gbg_cuda_index();
    typename gbg_cuda_ewald_word<Real>::type at[D];
    if (i >= job.n) {
        return;
    }
    for (int a = 0; a < D; a++) {
        read_place(state, a, i, &at[a]);
    }
    atomicAdd(&job.cells.begin[cell_of<D>(job.cells, at) + 2], 1);
}

template <int D, typename Real>
static __global__ void place(const __grid_constant__ struct gbg_state state,
                             const __grid_constant__ sorting<Real> job)
{
    int64_t i = gbg_cuda_index();
    gbg_cuda_ewald_record<Real> record;
    if (i >= job.n) {
        return;
    }
    for (int a = 0; a < D; a++) {
        read_place(state, a, i, &record.at[a]);
    }
    if (D == 2) {
        record.at[2] = (uint32_t)i;
    }
    double alpha =
        state.own_alpha ? state.own_alpha[i] : state.alpha[state.species ? state.species[i] : 0];
    record.source = (Real)(alpha * job.strength);
    int32_t slot = atomicAdd(&job.cells.begin[cell_of<D>(job.cells, record.at) + 1], 1);
    job.placed[slot] = record;
    if (D == 3) {
        job.placed_index[slot] = (int32_t)i;
    }
    if (job.placed_rank) {
        job.placed_rank[slot] = state.rank[i];
    }
}

template <int D, typename Real>
static __device__ __forceinline__ int32_t rank_in(const sorting<Real> &job, int32_t slot)
{
    return job.placed_rank ? job.placed_rank[slot]
           : D == 2        ? (int32_t)job.placed[slot].at[2]
                           : job.placed_index[slot];
}

template <int D, typename Real>
static __global__ void settle(const __grid_constant__ sorting<Real> job)
{
    int64_t slot = gbg_cuda_index();
    if (slot >= job.n) {
        return;
    }
    gbg_cuda_ewald_record<Real> record = job.placed[slot];
    int32_t cell = cell_of<D>(job.cells, record.at), rank = rank_in<D>(job, (int32_t)slot);
    int32_t begin = job.cells.begin[cell], end = job.cells.begin[cell + 1], to = begin;
    for (int32_t other = begin; other < end; other++) {
        to += rank_in<D>(job, other) < rank ? 1 : 0;
    }
    job.record[to] = record;
    if (D == 3) {
        job.index[to] = job.placed_index[slot];
    }
}

template <typename Real>
static cudaError_t sum_counts(struct gbg_device *device, const struct gbg_ewald *sum,
                              sorting<Real> *job)
{
    int32_t *begin = sum->cells.begin;
    return cub::DeviceScan::InclusiveSum(job->scratch, job->scratch_bytes, begin, begin,
                                         (int)(sum->n_cells + 2), device->stream);
}

/* Memory for one sort, in the workspace. */
template <typename Real>
static int take_sorting(struct gbg_device *device, const struct gbg_state *state,
                        const struct gbg_ewald *sum, sorting<Real> *job)
{
    int64_t deep = state->box.dimension == 3 ? sum->n : 0;
    void *base = NULL;
    int status =
        gbg_cuda_status(device, sum_counts(device, sum, job), "asking for the memory of a sum");
    for (int pass = 0; status == GBG_OK && pass < 2; pass++) {
        size_t used = 0;
        job->placed =
            (gbg_cuda_ewald_record<Real> *)gbg_cuda_take(base, &used, sum->n, sizeof *job->placed);
        job->placed_index = (int32_t *)gbg_cuda_take(base, &used, deep, 4);
        job->placed_rank = (int32_t *)gbg_cuda_take(base, &used, state->rank ? sum->n : 0, 4);
        /* never NULL when it sums, which would only ask for memory again */
        job->scratch = gbg_cuda_take(base, &used, (int64_t)job->scratch_bytes + 1, 1);
        status = pass ? status : gbg_cuda_workspace(device, used, &base);
    }
    job->placed_rank = state->rank ? job->placed_rank : NULL;
    return status;
}

template <int D, typename Real>
static int sort(struct gbg_device *device, const struct gbg_state *state, struct gbg_ewald *sum)
{
    sorting<Real> job = {};
    job.cells = sum->cells;
    job.n = sum->n;
    job.strength = 1.0 / sum->largest;
    job.record = (gbg_cuda_ewald_record<Real> *)sum->record;
    job.index = sum->index;
    unsigned blocks = gbg_cuda_blocks(sum->n);
    int status = take_sorting(device, state, sum, &job);
    status =
        status ? status : gbg_cuda_clear(device, sum->cells.begin, (size_t)(sum->n_cells + 2) * 4);
    if (status == GBG_OK) {
        count<D><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, job);
        status = gbg_cuda_started(device, "counting particles of cells");
    }
    status = status ? status
                    : gbg_cuda_status(device, sum_counts(device, sum, &job), "beginnings of cells");
    if (status == GBG_OK) {
        place<D><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, job);
        status = gbg_cuda_started(device, "placing particles in cells");
    }
    if (status == GBG_OK) {
        settle<D><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(job);
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

static void lay_cells(const struct gbg_state *state, struct gbg_ewald *sum)
{
    double reach = sum->plan.choice.reach;
    struct gbg_cuda_ewald_cells *cells = &sum->cells;
    sum->n_cells =
        gbg_grid_choose(&state->box, wanted_edge(state, reach, sum->n), sum->n, cells->cells);
    for (int a = 0; a < state->box.dimension; a++) {
        double part = reach / state->box.length[a], words = part * 0x1p32 * (1.0 + 2e-5) + 4096.0;
        cells->all[a] = 2.0 * words + 0x1p32 / cells->cells[a] + 1.0 >= 0x1p32;
        cells->reach[a] = cells->all[a] ? 0 : (uint32_t)words;
        cells->edge[a] = (float)(1.0 / (cells->cells[a] * part));
    }
}

int gbg_cuda_ewald_sort(struct gbg_device *device, const struct gbg_state *state,
                        struct gbg_ewald *sum)
{
    int d = state->box.dimension, single = sum->plan.choice.single;
    size_t size =
        single ? sizeof(gbg_cuda_ewald_record<float>) : sizeof(gbg_cuda_ewald_record<double>);
    sum->n = state->owned + state->ghost;
    lay_cells(state, sum);
    int status = gbg_cuda_grow(device, (void **)&sum->cells.begin, &sum->begin_capacity,
                               sum->n_cells + 2, 4, "cells of a sum by a mesh");
    status = status ? status
                    : gbg_cuda_grow(device, &sum->record, &sum->record_capacity, sum->n, size,
                                    "particles of a sum by a mesh");
    if (status == GBG_OK && d == 3) {
        status = gbg_cuda_grow(device, (void **)&sum->index, &sum->index_capacity, sum->n, 4,
                               "particles of a sum by a mesh");
    }
    if (status != GBG_OK || sum->n == 0) {
        return status;
    }
    return d == 2
               ? single ? sort<2, float>(device, state, sum) : sort<2, double>(device, state, sum)
           : single ? sort<3, float>(device, state, sum)
                    : sort<3, double>(device, state, sum);
}
