/* L1, CPU, per instruction set: the pairs whose straight paths in a step may meet, by 32-bit
 * coordinates; the caller leaves room for their rounding. */
#include "backend/cpu/list.h"
#include "backend/cpu/simd.h"
#include "backend/cpu/variant.h"

/* The upper 16 bits of a float, rounded, keep 8 bits of precision. */
static inline vi upper_half(vf a)
{
    return vi_shr(vi_add(vi_of_bits(a), vi_set(0x8000)), 16);
}

static inline vf larger(vf a, vf b)
{
    return vf_select(vf_lt(a, b), b, a);
}

static inline float largest_lane(vf a)
{
    float lane[VF_LANES], most = 0.0f;
    vf_store(lane, a);
    for (int l = 0; l < VF_LANES; l++) {
        most = lane[l] > most ? lane[l] : most;
    }
    return most;
}

void GBG_ISA_NAME(gbg_cpu_event_moves)(const struct gbg_state *state, const struct gbg_list *list,
                                       int64_t first, int64_t end, uint32_t *move, float *third,
                                       float *moved, float *started)
{
    vf most_moved = vf_set(0.0f), most_started = vf_set(0.0f);
    int32_t count[VF_LANES];
    for (int l = 0; l < VF_LANES; l++) {
        count[l] = l;
    }
    for (int64_t i = first; i < end; i += VF_LANES) {
        int64_t left = end - i < VF_LANES ? end - i : VF_LANES;
        vm inside = vi_lt(vi_load(count), vi_set((int32_t)left));
        vf w[3], square = vf_set(0.0f), from_built = vf_set(0.0f);
        for (int a = 0; a < list->dimension; a++) {
            vi d = vi_sub(vi_load(state->high[a] + i), vi_load(state->start_high[a] + i));
            w[a] = vf_mul(vf_from_vi(d), vf_set((float)(state->box.length[a] * 0x1p-32)));
            vi since = vi_sub(vi_load(list->local[a] + i), vi_load(list->built[a] + i));
            vf x = vf_sub(vf_mul(vf_from_vi(since), vf_set(list->scale[a])), w[a]);
            square = vf_fma(w[a], w[a], square);
            from_built = vf_fma(x, x, from_built);
        }
        most_moved = larger(most_moved, vf_keep(inside, square));
        most_started = larger(most_started, vf_keep(inside, from_built));
        vi_store(move + i, vi_or(vi_shl(upper_half(w[0]), 16), upper_half(w[1])));
        if (list->dimension == 3) {
            vf_store(third + i, w[2]);
        }
    }
    *moved = largest_lane(most_moved);
    *started = largest_lane(most_started);
}

static inline void unpack(vi word, vf w[2])
{
    w[0] = vf_of_bits(vi_and(word, vi_set((int32_t)0xffff0000)));
    w[1] = vf_of_bits(vi_shl(word, 16));
}

/* One vector of particles and what it compares its neighbours with. */
struct self {
    vi particle, end[3]; /* coordinates after the free move */
    vf move[3], scale[3], limit;
};

/* Bits of the lanes whose neighbour in this slot comes nearer than the limit, for lanes of lower
 * index than the neighbour. With d at the end of the free moves and W the relative move, the square
 * of the distance at the time s before the end is d^2 - 2 s d.W + s^2 W^2. */
__attribute__((always_inline)) static inline uint32_t
meeting(const struct gbg_list *list, const uint32_t *move, const float *third, vi j,
        const struct self *self, int dimension)
{
    vf w[3], end = vf_set(0.0f), closing = vf_set(0.0f), length = vf_set(0.0f);
    unpack(vi_gather(move, j), w);
    if (dimension == 3) {
        w[2] = vf_gather(third, j);
    }
    for (int a = 0; a < dimension; a++) {
        vi gap = vi_sub(self->end[a], vi_gather(list->local[a], j));
        vf d = vf_mul(vf_from_vi(gap), self->scale[a]), relative = vf_sub(self->move[a], w[a]);
        end = vf_fma(d, d, end);
        closing = vf_fma(d, relative, closing);
        length = vf_fma(relative, relative, length);
    }
    vf start = vf_add(vf_sub(end, vf_add(closing, closing)), length);
    vf least = vf_fnma(closing, closing, vf_mul(end, length)); /* squared, times W^2 */
    vm within = vm_and(vf_lt(vf_set(0.0f), closing), vf_lt(closing, length));
    vm near = vm_and(within, vf_lt(least, vf_mul(self->limit, length)));
    near = vm_or(near, vm_or(vf_lt(end, self->limit), vf_lt(start, self->limit)));
    return vm_bits(vm_and(near, vi_lt(self->particle, j)));
}

__attribute__((always_inline)) static inline int64_t
screen(const struct gbg_list *list, int64_t slice, const int32_t *index, const uint32_t *move,
       const float *third, float limit, int32_t *pair, int dimension)
{
    int64_t base = slice * GBG_SLICE, n = 0;
    for (int part = 0; part < GBG_SLICE; part += VF_LANES) {
        struct self self = {.limit = vf_set(limit)};
        int32_t particle[VF_LANES];
        for (int l = 0; l < VF_LANES; l++) {
            int64_t i = base + part + l;
            particle[l] = (int32_t)(i < list->n ? i : INT32_MAX);
        }
        self.particle = vi_load(particle);
        unpack(vi_load(move + base + part), self.move);
        if (dimension == 3) {
            self.move[2] = vf_load(third + base + part);
        }
        for (int a = 0; a < dimension; a++) {
            self.end[a] = vi_load(list->local[a] + base + part);
            self.scale[a] = vf_set(list->scale[a]);
        }
        for (int32_t k = 0; k < list->width[slice]; k++) {
            const int32_t *slot = index + (int64_t)k * GBG_SLICE + part;
            uint32_t bits = meeting(list, move, third, vi_load(slot), &self, dimension);
            for (; bits; bits &= bits - 1) {
                int l = __builtin_ctz(bits);
                pair[2 * n] = (int32_t)(base + part + l);
                pair[2 * n++ + 1] = slot[l];
            }
        }
    }
    return n;
}

int64_t GBG_ISA_NAME(gbg_cpu_event_screen)(const struct gbg_list *list, int64_t slice,
                                           const int32_t *index, const uint32_t *move,
                                           const float *third, float limit, int32_t *pair)
{
    return list->dimension == 2 ? screen(list, slice, index, move, third, limit, pair, 2)
                                : screen(list, slice, index, move, third, limit, pair, 3);
}
