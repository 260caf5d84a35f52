/* L1, CUDA: the rows of neighbours, a thread for each particle, first counted and then filled in.
 *
 * Candidates are sorted out by 32-bit coordinates and floats; where these cannot decide, the rule
 * on 64-bit coordinates does (gbg_search_rule), so no rounding of a float shows. */
#include "cuda/search.h"

enum { WARPS = GBG_CUDA_THREADS / 32 };

/* Adds up candidates and finds the longest row; every thread of a block calls it once. */
static __device__ void tally(struct gbg_cuda_totals *totals, unsigned long long looked,
                             unsigned found)
{
    __shared__ unsigned long long sum[WARPS];
    __shared__ unsigned most[WARPS];
    for (int lane = 16; lane > 0; lane /= 2) {
        looked += __shfl_xor_sync(0xFFFFFFFFu, looked, lane);
    }
    found = __reduce_max_sync(0xFFFFFFFFu, found);
    if ((threadIdx.x & 31) == 0) {
        sum[threadIdx.x / 32] = looked;
        most[threadIdx.x / 32] = found;
    }
    __syncthreads();
    if (threadIdx.x == 0) {
        for (int w = 1; w < WARPS; w++) {
            looked += sum[w];
            found = most[w] > found ? most[w] : found;
        }
        atomicAdd(&totals->looked, looked);
        atomicMax(&totals->longest, (unsigned long long)found);
    }
}

/* A row that is counted or filled in. */
template <bool FILL> struct growing {
    int32_t *at;
    unsigned found;

    __device__ growing(const struct gbg_cuda_rows &rows, int64_t i)
        : at(FILL ? rows.index + rows.offset[i] : NULL), found(0)
    {
    }
    __device__ void take(uint32_t particle)
    {
        if (FILL) {
            at[found] = (int32_t)particle;
        }
        found++;
    }
};

template <int D>
static __device__ __forceinline__ bool is_pair(const struct gbg_search &search, const uint4 &p,
                                               const uint4 &q)
{
    const struct gbg_search_frame &frame = search.frame;
    float r = __fmul_rn(__int2float_rn((int)(p.x - q.x)), frame.scale[0]);
    float squared = __fmul_rn(r, r);
    r = __fmul_rn(__int2float_rn((int)(p.y - q.y)), frame.scale[1]);
    squared = __fmaf_rn(r, r, squared);
    if (D == 3) {
        r = __fmul_rn(__int2float_rn((int)(p.z - q.z)), frame.scale[2]);
        squared = __fmaf_rn(r, r, squared);
    }
    return squared <= frame.likely &&
           (squared < frame.sure || gbg_search_rule(&frame, D, search.fraction, p.w, q.w));
}

/* Calls visit(row, begin, end) for all pieces of rows of cells around a key: cells begin..end-1 of
 * the row that starts at cell `row`. */
template <int D, typename Visit>
static __device__ __forceinline__ void visit_cells(const struct gbg_search_frame &frame,
                                                   uint32_t key, Visit visit)
{
    struct gbg_search_span span[3][2] = {{{0, 1}}, {{0, 1}}, {{0, 1}}};
    uint32_t cell = key >> frame.sub, octant = key & ((1u << frame.sub) - 1);
    uint32_t line = cell / (uint32_t)frame.cells[0];
    int c[3] = {(int)(cell % (uint32_t)frame.cells[0]), (int)line, 0}, count[3] = {1, 1, 1};
    if (D == 3) {
        c[1] = (int)(line % (uint32_t)frame.cells[1]);
        c[2] = (int)(line / (uint32_t)frame.cells[1]);
    }
#pragma unroll
    for (int a = 0; a < D; a++) {
        count[a] = gbg_search_spans(&frame, a, c[a], (int)octant, span[a]);
    }
    for (int k = 0; k < count[2]; k++) {
        for (int z = span[2][k].begin; z < span[2][k].end; z++) {
            for (int l = 0; l < count[1]; l++) {
                for (int y = span[1][l].begin; y < span[1][l].end; y++) {
                    int64_t row = ((int64_t)z * frame.cells[1] + y) * frame.cells[0];
                    for (int m = 0; m < count[0]; m++) {
                        visit(row, span[0][m].begin, span[0][m].end);
                    }
                }
            }
        }
    }
}

/* The row of particle i, which `look` finds candidates for and says how many; every thread of a
 * block calls it once, those without a particle to no effect. */
template <bool FILL, typename Look>
static __device__ __forceinline__ void
scan_row(const struct gbg_search &search, const struct gbg_cuda_rows &rows, int64_t i, Look look)
{
    unsigned long long looked = 0;
    unsigned found = 0;
    if (gbg_cuda_index() < search.frame.n) {
        growing<FILL> row(rows, i);
        looked = look(row);
        found = row.found;
        if (!FILL) {
            rows.offset[i] = found;
        }
    }
    if (!FILL) {
        tally(search.totals, looked, found);
    }
}

/* The particle of this thread in the order of cells. */
static __device__ __forceinline__ uint4 own_place(const struct gbg_search &search)
{
    int64_t slot = gbg_cuda_index();
    return slot < search.frame.n ? search.place[slot] : make_uint4(0, 0, 0, 0);
}

template <int D, bool FILL>
static __global__ void scan_sorted(const __grid_constant__ struct gbg_search search,
                                   const __grid_constant__ struct gbg_cuda_rows rows)
{
    const int64_t slot = gbg_cuda_index();
    const uint4 *place = search.place, own = own_place(search);
    scan_row<FILL>(search, rows, own.w, [&](growing<FILL> &row) {
        unsigned long long looked = 0;
        visit_cells<D>(search.frame, search.key_sorted[slot],
                       [&](int64_t line, int64_t begin, int64_t end) {
                           int32_t from = search.first[(line + begin) << search.frame.sub];
                           int32_t to = search.first[(line + end) << search.frame.sub];
                           looked += (unsigned)(to - from);
                           for (int32_t s = from; s < to; s++) {
                               const uint4 other = __ldg(&place[s]);
                               if (s != slot && is_pair<D>(search, own, other)) {
                                   row.take(other.w);
                               }
                           }
                       });
        return looked - 1; /* without itself */
    });
}

template <int D, bool FILL>
static __global__ void scan_occupied(const __grid_constant__ struct gbg_search search,
                                     const __grid_constant__ struct gbg_cuda_rows rows)
{
    const int64_t i = gbg_cuda_index();
    const uint4 own = own_place(search);
    scan_row<FILL>(search, rows, i, [&](growing<FILL> &row) {
        unsigned long long looked = 0;
        visit_cells<D>(search.frame, search.key[i], [&](int64_t line, int64_t begin, int64_t end) {
            for (int64_t cell = line + begin; cell < line + end; cell++) {
                int32_t j = __ldg(&search.first[cell]);
                if (j < 0 || j == i) {
                    continue;
                }
                looked++;
                if (is_pair<D>(search, own, __ldg(&search.place[j]))) {
                    row.take((uint32_t)j);
                }
            }
        });
        return looked;
    });
}

/* Every pair by the rule itself. */
template <int D, bool FILL>
static __global__ void scan_brute(const __grid_constant__ struct gbg_search search,
                                  const __grid_constant__ struct gbg_cuda_rows rows)
{
    const int64_t i = gbg_cuda_index(), n = search.frame.n;
    scan_row<FILL>(search, rows, i, [&](growing<FILL> &row) {
        uint64_t own[D];
        for (int a = 0; a < D; a++) {
            own[a] = search.fraction[a][i];
        }
        for (int64_t j = 0; j < n; j++) {
            double sum = 0.0;
#pragma unroll
            for (int a = 0; a < D; a++) {
                double d =
                    gbg_box_difference(&search.frame.box, a, own[a], __ldg(&search.fraction[a][j]));
                sum += d * d;
            }
            if (sum <= search.frame.squared && j != i) {
                row.take((uint32_t)j);
            }
        }
        return (unsigned long long)(n - 1);
    });
}

/* Rows of the list hold slots in ascending order of their particles. */
template <int D, bool FILL>
static __global__ void scan_list(const __grid_constant__ struct gbg_search search,
                                 const __grid_constant__ struct gbg_cuda_rows rows)
{
    const uint4 own = own_place(search);
    scan_row<FILL>(search, rows, own.w, [&](growing<FILL> &row) {
        const int64_t *offset = search.list.offset + own.w;
        const int32_t *listed = search.list.index + offset[0];
        const unsigned long long looked = (unsigned long long)(offset[1] - offset[0]);
        for (unsigned k = 0; k < looked; k++) {
            const uint4 other = __ldg(&search.place[listed[k]]);
            if (is_pair<D>(search, own, other)) {
                row.take(other.w);
            }
        }
        return looked;
    });
}

/* A thread for each particle: the kernel for the dimension, to count or to fill in. */
#define GBG_CUDA_SCAN(name, kernel, what)                                                          \
    int name(struct gbg_device *device, const struct gbg_search *search,                           \
             const struct gbg_cuda_rows *rows, int fill)                                           \
    {                                                                                              \
        unsigned blocks = gbg_cuda_blocks(search->frame.n);                                        \
        int flat = search->frame.box.dimension == 2;                                               \
        auto *chosen = flat   ? fill ? kernel<2, true> : kernel<2, false>                          \
                         : fill ? kernel<3, true>                                                  \
                              : kernel<3, false>;                                                  \
        if (blocks == 0) {                                                                         \
            return GBG_OK;                                                                         \
        }                                                                                          \
        chosen<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*search, *rows);                   \
        return gbg_cuda_started(device, what);                                                     \
    }
GBG_CUDA_SCAN(gbg_cuda_scan_sorted, scan_sorted, "neighbours in cells")
GBG_CUDA_SCAN(gbg_cuda_scan_occupied, scan_occupied, "neighbours in cells of one")
GBG_CUDA_SCAN(gbg_cuda_scan_brute, scan_brute, "neighbours among all")
GBG_CUDA_SCAN(gbg_cuda_scan_list, scan_list, "neighbours in a list")
