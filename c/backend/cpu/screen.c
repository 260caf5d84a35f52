/* L1, CPU, per instruction set: which particles have a neighbour inside a distance, by 32-bit
 * coordinates; the caller leaves room for their rounding. */
#include "backend/cpu/list.h"
#include "backend/cpu/simd.h"
#include "backend/cpu/variant.h"

/* Smallest squared distance to a neighbour, for one vector of particles. */
__attribute__((always_inline)) static inline vf closest(const struct gbg_list *list,
                                                        const int32_t *index, int32_t width,
                                                        int64_t first, vf limit, int dimension)
{
    vi own[3];
    vf scale[3], least = limit;
    for (int a = 0; a < dimension; a++) {
        own[a] = vi_load(list->local[a] + first);
        scale[a] = vf_set(list->scale[a]);
    }
    int32_t lane[VF_LANES];
    for (int l = 0; l < VF_LANES; l++) {
        lane[l] = (int32_t)(first + l < list->n ? first + l : list->n - 1);
    }
    vi self = vi_load(lane);
    for (int32_t k = 0; k < width; k++) {
        vi j = vi_load(index + (int64_t)k * GBG_SLICE);
        vf squared = vf_set(0.0f);
        for (int a = 0; a < dimension; a++) {
            vf r = vf_mul(vf_from_vi(vi_sub(own[a], vi_gather(list->local[a], j))), scale[a]);
            squared = vf_fma(r, r, squared);
        }
        least = vf_min(least, vf_select(vi_eq(j, self), limit, squared));
    }
    return least;
}

int64_t GBG_ISA_NAME(gbg_cpu_screen)(const struct gbg_list *list, int64_t slice,
                                     const int32_t *index, float squared_limit, int32_t *found)
{
    vf limit = vf_set(squared_limit);
    int64_t base = slice * GBG_SLICE, n = 0;
    for (int part = 0; part < GBG_SLICE; part += VF_LANES) {
        vf least = list->dimension == 2
                       ? closest(list, index + part, list->width[slice], base + part, limit, 2)
                       : closest(list, index + part, list->width[slice], base + part, limit, 3);
        uint32_t bits = vm_bits(vf_lt(least, limit));
        for (int l = 0; bits && l < VF_LANES; l++) {
            if (bits >> l & 1 && base + part + l < list->n) {
                found[n++] = (int32_t)(base + part + l);
            }
        }
    }
    return n;
}
