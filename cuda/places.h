/* L1, CUDA: the mixed cut-off force on one particle in a batch of steps, whose places (local
 * coordinates and the strength as a source) are packed so that a neighbour is one gather. The same
 * operations in the same order as in cutoff.cu. */
#ifndef GBG_CUDA_PLACES_H
#define GBG_CUDA_PLACES_H

#include "backend/cpu/power.h"
#include "cuda/list.h"

template <int dimension, bool sources> struct gbg_cuda_place {
    typedef uint4 type; /* x, y, z or nothing, bits of the strength */
};
template <> struct gbg_cuda_place<2, false> {
    typedef uint2 type;
};

static __device__ __forceinline__ uint32_t gbg_cuda_on_axis(const uint2 &place, int a)
{
    return a == 0 ? place.x : place.y;
}

static __device__ __forceinline__ uint32_t gbg_cuda_on_axis(const uint4 &place, int a)
{
    return a == 0 ? place.x : a == 1 ? place.y : place.z;
}

static __device__ __forceinline__ vf gbg_cuda_strength(const uint2 &, vf one)
{
    return one;
}

static __device__ __forceinline__ vf gbg_cuda_strength(const uint4 &place, vf)
{
    return __uint_as_float(place.w);
}

/* Where particle i is now. */
template <int dimension, bool sources>
static __device__ __forceinline__ void gbg_cuda_put_place(const struct gbg_state &state,
                                                          const struct gbg_cuda_rows &rows,
                                                          void *places, int64_t i)
{
    typedef typename gbg_cuda_place<dimension, sources>::type place;
    uint32_t local[3] = {0, 0, 0};
    for (int a = 0; a < dimension; a++) {
        local[a] = gbg_cuda_local(state.high[a][i], state.low[a][i], rows.shift[a]);
    }
    if constexpr (sizeof(place) == sizeof(uint2)) {
        ((place *)places)[i] = make_uint2(local[0], local[1]);
    } else {
        uint32_t strength = sources ? __float_as_uint(state.source[i]) : 0;
        ((place *)places)[i] = make_uint4(local[0], local[1], local[2], strength);
    }
}

/* Adds the field of one place at another, in units of the cut-off. */
template <int dimension, int power, bool sources, typename Place>
static __device__ __forceinline__ void gbg_cuda_add_field(const Place &own, const Place &other,
                                                          const struct gbg_cutoff_unit &unit,
                                                          vf one, vf sum[dimension])
{
    vf r[dimension], squared = vf_set(0.0f);
    for (int a = 0; a < dimension; a++) {
        vi d = (vi)(gbg_cuda_on_axis(own, a) - gbg_cuda_on_axis(other, a));
        r[a] = vf_mul(vf_from_vi(d), unit.scale[a]);
        squared = vf_fma(r[a], r[a], squared);
    }
    vm inside = vm_and(vf_lt(squared, unit.limit), vf_lt(vf_set(0.0f), squared));
    vf strength = sources ? gbg_cuda_strength(other, one) : one;
    vf f = vf_keep(inside, vf_mul(gbg_inverse_power(squared, power), strength));
    for (int a = 0; a < dimension; a++) {
        sum[a] = vf_fma(f, r[a], sum[a]);
    }
}

/* Adds the fields of `many` neighbours from the kth on; their loads are under way together. Behind
 * the end of the row stands the particle itself, which adds nothing. */
template <int dimension, int power, bool sources, int many>
static __device__ __forceinline__ void
gbg_cuda_add_fields(const typename gbg_cuda_place<dimension, sources>::type *at,
                    const typename gbg_cuda_place<dimension, sources>::type &own,
                    const int32_t *index, int32_t first, int32_t width, int64_t i,
                    const struct gbg_cutoff_unit &unit, vf one, vf sum[dimension])
{
    typename gbg_cuda_place<dimension, sources>::type other[many];
#pragma unroll
    for (int k = 0; k < many; k++) {
        int32_t j = (int32_t)i;
        if (first + k < width) {
            j = __ldg(index + (int64_t)(first + k) * GBG_CUDA_SLICE);
        }
        other[k] = at[j];
    }
#pragma unroll
    for (int k = 0; k < many; k++) {
        gbg_cuda_add_field<dimension, power, sources>(own, other[k], unit, one, sum);
    }
}

/* Field at particle i in units of the cut-off. */
template <int dimension, int power, bool sources>
static __device__ __forceinline__ void
gbg_cuda_field(const struct gbg_cuda_rows &rows, const void *places,
               const struct gbg_cutoff_unit &unit, vf one, int64_t i, vf sum[dimension])
{
    enum { MANY = 8 };
    typedef typename gbg_cuda_place<dimension, sources>::type place;
    const place *at = (const place *)places;
    int64_t slice = i / GBG_CUDA_SLICE;
    const int32_t *index = rows.index + rows.offset[slice] + i % GBG_CUDA_SLICE;
    int32_t width = rows.width[slice];
    place own = at[i];
    for (int a = 0; a < dimension; a++) {
        sum[a] = vf_set(0.0f);
    }
    int32_t k = 0;
    for (; k + MANY / 2 < width; k += MANY) {
        gbg_cuda_add_fields<dimension, power, sources, MANY>(at, own, index, k, width, i, unit, one,
                                                             sum);
    }
    if (k < width) {
        gbg_cuda_add_fields<dimension, power, sources, MANY / 2>(at, own, index, k, width, i, unit,
                                                                 one, sum);
    }
}

#endif
