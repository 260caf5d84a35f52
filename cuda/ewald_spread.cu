/* L1, CUDA: sources onto the mesh: a warp a tile of nodes, over the particles of all cells that
 * reach it, in their order. Every node is written once, by one thread: there are no atomics, and no
 * size of a block shows. */
#include "cuda/ewald_kernels.h"

namespace
{

enum { WARPS = 4 };
/* Nodes of a tile; a thread has two along y and, in space, four along z. */
enum { TILE = 8, DEEP = 4 };

template <int D, typename Real> struct spread_job {
    struct gbg_cuda_ewald_cells cells;
    int32_t mesh[3];
    int64_t pitch, tiles[3];
    const gbg_cuda_ewald_record<D, Real> *record;
    const uint32_t *top;
    Real *node;
    gbg_cuda_ewald_window<D, Real> window;
};

/* A row of the table of weights: those of 32 particles at one node of the tile, moved against the
 * next row so that threads of different nodes read different banks. */
template <typename Real> struct weights {
    enum { GROUP = 16 / sizeof(Real), STRIDE = 32 + GROUP };
};
template <int D, typename Real> struct staging {
    alignas(16) Real x[TILE][weights<Real>::STRIDE];
    alignas(16) Real y[TILE][weights<Real>::STRIDE]; /* times the source */
    alignas(16) Real z[D == 3 ? DEEP : 1][weights<Real>::STRIDE];
    int32_t start[32], end[32]; /* of runs: first slot; particles up to their end */
};

/* Cells along an axis whose particles reach some of the nodes from..to. */
struct range {
    int32_t first, count;
};

} // namespace

static __device__ __forceinline__ int64_t floor_ratio(int64_t p, int64_t q)
{
    return p >= 0 ? p / q : -((q - 1 - p) / q);
}

/* A particle at u spacings reaches nodes up to width/2 away. */
static __device__ __forceinline__ struct range cells_of(int32_t from, int32_t to, int32_t width,
                                                        int32_t mesh, int32_t cells)
{
    int64_t low = floor_ratio((2 * (int64_t)from - width) * cells, 2 * (int64_t)mesh);
    int64_t high = floor_ratio((2 * (int64_t)to + width) * cells, 2 * (int64_t)mesh);
    struct range range = {0, cells};
    if (high - low + 1 < cells) {
        range.first = (int32_t)(low < 0 ? low + cells : low);
        range.count = (int32_t)(high - low + 1);
    }
    return range;
}

static __device__ __forceinline__ int32_t wrapped(int32_t k, int32_t period)
{
    return k >= period ? k - period : k;
}

/* Run r of the tile: rows along y in layers along z; each of them in two parts, of which the second
 * is empty but at the edge of the box. */
template <int D>
static __device__ __forceinline__ int2 run_of(const struct gbg_cuda_ewald_cells &cells,
                                              const struct range *range, int32_t r)
{
    int32_t part = r & 1, row = r >> 1, layer = 0;
    if (D == 3) {
        layer = wrapped(range[2].first + row / range[1].count, cells.cells[2]);
        row %= range[1].count;
    }
    row = wrapped(range[1].first + row, cells.cells[1]);
    const int32_t *begin = cells.begin + ((int64_t)layer * cells.cells[1] + row) * cells.cells[0];
    int32_t end = range[0].first + range[0].count, over = max(end - cells.cells[0], 0);
    return part == 0 ? make_int2(begin[range[0].first], begin[end - over])
                     : make_int2(begin[0], begin[over]);
}

static __device__ __forceinline__ int32_t sum_up_to(int32_t value)
{
    int lane = (int)(threadIdx.x & 31);
    for (int step = 1; step < 32; step *= 2) {
        int32_t before = __shfl_up_sync(0xFFFFFFFFu, value, step);
        value += lane >= step ? before : 0;
    }
    return value;
}

/* The slot of the particle of that number in the runs. */
static __device__ __forceinline__ int32_t slot_of(const int32_t *start, const int32_t *end,
                                                  int32_t number)
{
    int run = 0;
    for (int step = 16; step > 0; step /= 2) {
        run += end[run + step - 1] <= number ? step : 0;
    }
    return start[run] + number - (run > 0 ? end[run - 1] : 0);
}

/* This thread's particle into its column of one axis of the table. */
template <typename Real, int W, int NODES>
static __device__ __forceinline__ void stage_axis(Real (*table)[weights<Real>::STRIDE],
                                                  const Real weight[W], int32_t first, int32_t from,
                                                  int32_t mesh, Real factor)
{
    int lane = (int)(threadIdx.x & 31);
#pragma unroll
    for (int t = 0; t < NODES; t++) {
        table[t][lane] = 0;
    }
#pragma unroll
    for (int l = 0; l < W; l++) {
        uint32_t t = (uint32_t)(wrapped(first + l, mesh) - from);
        if (t < NODES) {
            table[t][lane] = weight[l] * factor;
        }
    }
}

/* The particle of this thread, none if the slot is -1. The zero behind a window of odd width meets
 * no node of its own around the box: the number of cells is even, and so above the width. */
template <int D, typename Real, int W>
static __device__ __forceinline__ void
stage(const spread_job<D, Real> &job, staging<D, Real> &table, const int32_t *from, int32_t slot)
{
    gbg_cuda_ewald_record<D, Real> record = {};
    uint64_t whole[D] = {};
    int32_t first[D];
    Real z[D], weight[D][W];
    if (slot >= 0) {
        record = job.record[slot];
        gbg_cuda_ewald_read(job.cells.shift, record, job.top, slot, whole);
    }
#pragma unroll
    for (int a = 0; a < D; a++) {
        first[a] = gbg_cuda_ewald_place(whole[a], job.mesh[a], job.window.width, &z[a]);
    }
    gbg_cuda_ewald_weights<D, Real, W>(job.window, z, weight, NULL);
    stage_axis<Real, W, TILE>(table.x, weight[0], first[0], from[0], job.mesh[0], (Real)1);
    stage_axis<Real, W, TILE>(table.y, weight[1], first[1], from[1], job.mesh[1], record.source);
    if (D == 3) {
        stage_axis<Real, W, DEEP>(table.z, weight[D - 1], first[D - 1], from[D - 1],
                                  job.mesh[D - 1], (Real)1);
    }
}

template <typename Real> struct group {
    Real value[weights<Real>::GROUP];
    __device__ __forceinline__ explicit group(const Real *from)
    {
        if constexpr (sizeof(Real) == 4) {
            float4 four = *(const float4 *)from;
            value[0] = four.x, value[1] = four.y, value[2] = four.z, value[3] = four.w;
        } else {
            double2 two = *(const double2 *)from;
            value[0] = two.x, value[1] = two.y;
        }
    }
};

/* Adds what the table's first `count` particles give to this thread's nodes. */
template <int D, typename Real, int NODES>
static __device__ __forceinline__ void add(const staging<D, Real> &table, int count,
                                           Real (*sum)[NODES])
{
    enum { GROUP = weights<Real>::GROUP };
    int tx = (int)(threadIdx.x & 7), ty = (int)(threadIdx.x >> 3 & 3);
    for (int p = 0; p < count; p += GROUP) {
        group<Real> x(&table.x[tx][p]), y0(&table.y[ty][p]), y1(&table.y[ty + 4][p]);
        Real xy[2][GROUP];
#pragma unroll
        for (int g = 0; g < GROUP; g++) {
            if (D == 2) {
                sum[0][0] = fma(x.value[g], y0.value[g], sum[0][0]);
                sum[1][0] = fma(x.value[g], y1.value[g], sum[1][0]);
            } else {
                xy[0][g] = x.value[g] * y0.value[g];
                xy[1][g] = x.value[g] * y1.value[g];
            }
        }
#pragma unroll
        for (int n = 0; n < NODES && D == 3; n++) {
            group<Real> z(&table.z[n][p]);
#pragma unroll
            for (int g = 0; g < GROUP; g++) {
                sum[0][n] = fma(xy[0][g], z.value[g], sum[0][n]);
                sum[1][n] = fma(xy[1][g], z.value[g], sum[1][n]);
            }
        }
    }
}

/* All particles of the runs from `run` on, up to 32 of them. */
template <int D, typename Real, int W, int NODES>
static __device__ __forceinline__ void
add_runs(const spread_job<D, Real> &job, staging<D, Real> &table, const struct range *range,
         const int32_t *from, int32_t run, int32_t runs, Real (*sum)[NODES])
{
    int lane = (int)(threadIdx.x & 31);
    int2 own = make_int2(0, 0);
    if (run + lane < runs) {
        own = run_of<D>(job.cells, range, run + lane);
    }
    int32_t end = sum_up_to(own.y - own.x), all = __shfl_sync(0xFFFFFFFFu, end, 31);
    table.start[lane] = own.x;
    table.end[lane] = end;
    __syncwarp();
    for (int32_t done = 0; done < all; done += 32) {
        int32_t number = done + lane;
        int32_t slot = number < all ? slot_of(table.start, table.end, number) : -1;
        stage<D, Real, W>(job, table, from, slot);
        __syncwarp();
        add<D, Real, NODES>(table, min(all - done, 32), sum);
        __syncwarp();
    }
}

template <int D, typename Real, int W>
static __global__
    __launch_bounds__(32 * WARPS) void spread(const __grid_constant__ spread_job<D, Real> job)
{
    enum { NODES = D == 3 ? DEEP : 1 };
    __shared__ staging<D, Real> tables[WARPS];
    int64_t tile = (int64_t)blockIdx.x * WARPS + threadIdx.x / 32;
    int64_t row = tile / job.tiles[0], layer = D == 3 ? row / job.tiles[1] : 0;
    if (tile >= job.tiles[0] * job.tiles[1] * job.tiles[2]) {
        return; /* a whole warp */
    }
    int32_t from[3] = {(int32_t)(tile % job.tiles[0]) * TILE, (int32_t)(row % job.tiles[1]) * TILE,
                       (int32_t)layer * DEEP};
    struct range range[D];
    Real sum[2][NODES];
    for (int a = 0; a < D; a++) {
        int32_t to = min(from[a] + (a == 2 ? DEEP : TILE), job.mesh[a]) - 1;
        range[a] = cells_of(from[a], to, job.window.width, job.mesh[a], job.cells.cells[a]);
    }
#pragma unroll
    for (int n = 0; n < NODES; n++) {
        sum[0][n] = sum[1][n] = 0;
    }
    int32_t runs = 2 * range[1].count * (D == 3 ? range[D - 1].count : 1);
    for (int32_t run = 0; run < runs; run += 32) {
        add_runs<D, Real, W, NODES>(job, tables[threadIdx.x / 32], range, from, run, runs, sum);
    }
    int32_t x = from[0] + (int32_t)(threadIdx.x & 7), y = from[1] + (int32_t)(threadIdx.x >> 3 & 3);
    for (int half = 0; half < 2; half++) {
#pragma unroll
        for (int n = 0; n < NODES; n++) {
            int32_t ny = y + 4 * half, nz = D == 3 ? from[2] + n : 0;
            if (x < job.mesh[0] && ny < job.mesh[1] && (D == 2 || nz < job.mesh[2])) {
                job.node[((int64_t)nz * job.mesh[1] + ny) * job.pitch + x] = sum[half][n];
            }
        }
    }
}

template <int D, typename Real, int W>
static void start(struct gbg_device *device, const spread_job<D, Real> &job)
{
    int64_t tiles = job.tiles[0] * job.tiles[1] * job.tiles[2];
    spread<D, Real, W><<<gbg_cuda_blocks(tiles, WARPS), 32 * WARPS, 0, device->stream>>>(job);
}

template <int D, typename Real> static int run(struct gbg_device *device, struct gbg_ewald *sum)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    spread_job<D, Real> job = {};
    job.cells = sum->cells;
    job.pitch = gbg_cuda_ewald_pitch(choice);
    job.record = (const gbg_cuda_ewald_record<D, Real> *)sum->record;
    job.top = sum->top;
    job.node = (Real *)sum->mesh;
    for (int a = 0; a < 3; a++) {
        int32_t nodes = a == 2 ? DEEP : TILE;
        job.mesh[a] = a < D ? choice->cells[a] : 1;
        job.tiles[a] = (job.mesh[a] + nodes - 1) / nodes;
    }
    gbg_cuda_ewald_fill_window(sum, &job.window);
    switch ((choice->width + 1) / 2) {
    case 2:
        start<D, Real, 4>(device, job);
        break;
    case 3:
        start<D, Real, 6>(device, job);
        break;
    case 4:
        start<D, Real, 8>(device, job);
        break;
    case 5:
        start<D, Real, 10>(device, job);
        break;
    case 6:
        start<D, Real, 12>(device, job);
        break;
    case 7:
        start<D, Real, 14>(device, job);
        break;
    default:
        start<D, Real, 16>(device, job);
        break;
    }
    return gbg_cuda_started(device, "sources onto the mesh");
}

int gbg_cuda_ewald_spread(struct gbg_device *device, struct gbg_ewald *sum)
{
    int d = sum->plan.choice.dimension, single = sum->plan.choice.single;
    return d == 2   ? single ? run<2, float>(device, sum) : run<2, double>(device, sum)
             : single ? run<3, float>(device, sum)
                    : run<3, double>(device, sum);
}
