/* L1, CPU, per instruction set: the two passes of the certificate over all particles: how far they
 * moved, and who may be too close to somebody. Both only decide where the exact tests look, and
 * leave room for their rounding. */
#include "backend/cpu/certify.h"
#include "backend/cpu/certify_pair.h"
#include "backend/cpu/list.h"
#include "backend/cpu/simd.h"
#include "backend/cpu/variant.h"

/* Lanes of particles that are there. */
static inline vm lanes_below(int64_t count)
{
    int32_t lane[VF_LANES];
    for (int l = 0; l < VF_LANES; l++) {
        lane[l] = l;
    }
    return vi_lt(vi_load(lane), vi_set(count < VF_LANES ? (int32_t)count : VF_LANES));
}

static float largest_lane(vf a)
{
    float lane[VF_LANES], largest = 0.0f;
    vf_store(lane, a);
    for (int l = 0; l < VF_LANES; l++) {
        largest = lane[l] > largest ? lane[l] : largest;
    }
    return largest;
}

__attribute__((always_inline)) static inline void moves(const struct gbg_certify_work *work,
                                                        int64_t first, int64_t end,
                                                        float largest[2], int dimension)
{
    const struct gbg_state *state = work->state;
    const struct gbg_list *list = work->list;
    vf step = vf_set(0.0f), build = vf_set(0.0f), unit[3];
    for (int a = 0; a < dimension; a++) {
        unit[a] = vf_set((float)(state->box.length[a] * 0x1p-32));
    }
    for (int64_t i = first; i < end; i += VF_LANES) {
        vf moved = vf_set(0.0f), drifted = vf_set(0.0f);
        for (int a = 0; a < dimension; a++) {
            vi high = vi_load(state->high[a] + i), low = vi_load(state->low[a] + i);
            int shift = list->shift[a];
            vi_store(work->local[a] + i, vi_or(vi_shl_by(high, shift), vi_shr_by(low, 32 - shift)));
            moved = gbg_certify_squared(high, vi_load(state->start_high[a] + i), unit[a], moved);
            drifted = gbg_certify_squared(high, vi_load(list->built_high[a] + i), unit[a], drifted);
        }
        vm there = lanes_below(end - i);
        step = vf_max(step, vf_keep(there, moved));
        build = vf_max(build, vf_keep(there, drifted));
    }
    largest[0] = largest_lane(step);
    largest[1] = largest_lane(build);
}

void GBG_ISA_NAME(gbg_cpu_certify_moves)(const struct gbg_certify_work *work, int64_t first,
                                         int64_t end, float largest[2])
{
    if (work->list->dimension == 2) {
        moves(work, first, end, largest, 2);
    } else {
        moves(work, first, end, largest, 3);
    }
}

/* Bits of the particles at `first` whose squared distance to a neighbour of higher index is below
 * the limit of the pair. A particle fills up short rows with itself: never higher. */
__attribute__((always_inline)) static inline uint32_t too_close(const struct gbg_certify_work *work,
                                                                const int32_t *index, int32_t width,
                                                                int64_t first, int dimension,
                                                                int sizes)
{
    const struct gbg_list *list = work->list;
    vi own[3];
    vf scale[3], limit = vf_set(work->limit), half = vf_set(0.0f);
    for (int a = 0; a < dimension; a++) {
        own[a] = vi_load(work->local[a] + first);
        scale[a] = vf_set(list->scale[a]);
    }
    if (sizes) {
        half = vf_load(work->half + first);
    }
    int32_t lane[VF_LANES];
    for (int l = 0; l < VF_LANES; l++) {
        lane[l] = (int32_t)(first + l);
    }
    vi self = vi_load(lane);
    vm found = vf_lt(limit, limit); /* none */
    for (int32_t k = 0; k < width; k++) {
        vi j = vi_load(index + (int64_t)k * GBG_SLICE);
        vf squared = vf_set(0.0f);
        for (int a = 0; a < dimension; a++) {
            squared = gbg_certify_squared(own[a], vi_gather(work->local[a], j), scale[a], squared);
        }
        if (sizes) {
            limit = vf_add(half, vf_gather(work->half, j));
            limit = vf_mul(limit, limit);
        }
        found = vm_or(found, vm_and(vi_lt(self, j), vf_lt(squared, limit)));
    }
    return vm_bits(found);
}

int64_t GBG_ISA_NAME(gbg_cpu_certify_screen)(const struct gbg_certify_work *work, int64_t slice,
                                             const int32_t *index, int32_t *found)
{
    const struct gbg_list *list = work->list;
    int32_t width = list->width[slice];
    int64_t base = slice * GBG_SLICE, n = 0;
    for (int part = 0; part < GBG_SLICE; part += VF_LANES) {
        const int32_t *row = index + part;
        int64_t first = base + part;
        uint32_t bits = list->dimension == 2 ? work->half ? too_close(work, row, width, first, 2, 1)
                                                          : too_close(work, row, width, first, 2, 0)
                        : work->half ? too_close(work, row, width, first, 3, 1)
                                             : too_close(work, row, width, first, 3, 0);
        for (int l = 0; bits && l < VF_LANES; l++) {
            if (bits >> l & 1 && first + l < list->n) {
                found[n++] = (int32_t)(first + l);
            }
        }
    }
    return n;
}
