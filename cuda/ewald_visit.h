/* L1, CUDA: particles within the reach of one, over runs of the cells that it touches. */
#ifndef GBG_CUDA_EWALD_VISIT_H
#define GBG_CUDA_EWALD_VISIT_H

#include "cuda/ewald.h"

/* Rows of cells along an axis that the reach touches. */
struct gbg_cuda_ewald_span {
    int32_t first, count, before; /* before: rows ahead of the particle's own */
    float inside;                 /* its place in its own row, in cells */
};

static __device__ __forceinline__ float gbg_cuda_ewald_difference(uint32_t p, uint32_t q)
{
    return __int2float_rn((int32_t)(p - q));
}
static __device__ __forceinline__ double gbg_cuda_ewald_difference(uint64_t p, uint64_t q)
{
    return __ll2double_rn((int64_t)(p - q));
}

/* Vector between places, in the units of the scale, and its square. */
template <int D, typename Real>
static __device__ __forceinline__ Real
gbg_cuda_ewald_squared(const gbg_cuda_ewald_record<D, Real> &own,
                       const gbg_cuda_ewald_record<D, Real> &other, const Real *scale, Real r[D])
{
    Real squared = 0;
    for (int a = 0; a < D; a++) {
        r[a] = gbg_cuda_ewald_difference(own.at[a], other.at[a]) * scale[a];
        squared = fma(r[a], r[a], squared);
    }
    return squared;
}

static __device__ __forceinline__ struct gbg_cuda_ewald_span
gbg_cuda_ewald_rows(const struct gbg_cuda_ewald_cells &cells, int a, uint32_t high)
{
    struct gbg_cuda_ewald_span span = {0, cells.cells[a], 0, 0.0f};
    if (!cells.all[a]) {
        uint32_t count = (uint32_t)cells.cells[a];
        int32_t own = (int32_t)__umulhi(high, count);
        span.first = (int32_t)__umulhi(high - cells.reach[a], count);
        span.count = (int32_t)__umulhi(high + cells.reach[a], count) - span.first;
        span.count += (span.count < 0 ? cells.cells[a] : 0) + 1;
        span.before = own - span.first + (own < span.first ? cells.cells[a] : 0);
        span.inside = __uint2float_rn(high * count) * 0x1p-32f;
    }
    return span;
}

/* Squared distance of the particle from row k of the span: 0 in its own, and where all are. */
static __device__ __forceinline__ float
gbg_cuda_ewald_away(const struct gbg_cuda_ewald_cells &cells, int a,
                    const struct gbg_cuda_ewald_span &span, int32_t k)
{
    float rows = (float)(k - span.before);
    float away = rows > 0.0f ? rows - span.inside : rows < 0.0f ? span.inside - rows - 1.0f : 0.0f;
    away = cells.all[a] ? 0.0f : away * cells.edge[a];
    return away * away;
}

/* Calls visit(slot) for the particles in a row of cells that what is left of the squared reach
 * touches: one run of them, two around the edge of the box. */
template <typename Visit>
static __device__ __forceinline__ void
gbg_cuda_ewald_visit_row(const struct gbg_cuda_ewald_cells &cells, uint32_t high, int64_t row,
                         float left, Visit visit)
{
    const int32_t *begin = cells.begin + row * cells.cells[0];
    int32_t first = 0, last = cells.cells[0] - 1;
    if (!cells.all[0]) {
        /* a little more than the half chord, at most the reach */
        float chord = __uint2float_rz(cells.reach[0]) * __fsqrt_rn(left) + 1024.0f;
        uint32_t words = min((uint32_t)chord, cells.reach[0]);
        first = (int32_t)__umulhi(high - words, (uint32_t)cells.cells[0]);
        last = (int32_t)__umulhi(high + words, (uint32_t)cells.cells[0]);
    }
    int parts = first <= last ? 1 : 2;
    for (int part = 0; part < parts; part++) {
        int32_t from = part == 0 ? first : 0;
        int32_t end = begin[parts == 2 && part == 0 ? cells.cells[0] : last + 1];
#pragma unroll 2
        for (int32_t k = begin[from]; k < end; k++) {
            visit(k);
        }
    }
}

template <int D, typename Visit>
static __device__ __forceinline__ void
gbg_cuda_ewald_visit(const struct gbg_cuda_ewald_cells &cells, const uint32_t *high, Visit visit)
{
    struct gbg_cuda_ewald_span y = gbg_cuda_ewald_rows(cells, 1, high[1]), z = {0, 1, 0, 0.0f};
    if (D == 3) {
        z = gbg_cuda_ewald_rows(cells, 2, high[2]);
    }
    for (int32_t l = 0; l < z.count; l++) {
        int32_t layer = z.first + l;
        layer -= layer >= cells.cells[2] ? cells.cells[2] : 0;
        float left = 1.0f + 1e-5f - (D == 3 ? gbg_cuda_ewald_away(cells, 2, z, l) : 0.0f);
        for (int32_t k = 0; k < y.count; k++) {
            float here = left - gbg_cuda_ewald_away(cells, 1, y, k);
            int32_t row = y.first + k;
            row -= row >= cells.cells[1] ? cells.cells[1] : 0;
            if (here > 0.0f) {
                gbg_cuda_ewald_visit_row(cells, high[0], (int64_t)layer * cells.cells[1] + row,
                                         here, visit);
            }
        }
    }
}

#endif
