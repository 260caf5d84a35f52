/* L1, CPU, per instruction set: the vector parts of building a pair list and of keeping it. */
#include "backend/cpu/list.h"
#include "backend/cpu/list_square.h"
#include "backend/cpu/simd.h"
#include "backend/cpu/variant.h"

static inline vi lanes_from_zero(void)
{
    int32_t lane[VF_LANES];
    for (int l = 0; l < VF_LANES; l++) {
        lane[l] = l;
    }
    return vi_load(lane);
}

__attribute__((always_inline)) static inline int64_t find(const struct gbg_near *near, int64_t i,
                                                          const struct gbg_run *runs, int n_runs,
                                                          int32_t *found, int dimension)
{
    const struct gbg_grid *grid = near->grid;
    vi own[3], self = vi_set((int32_t)i), lane = lanes_from_zero();
    vf unit[3], limit = vf_set(near->limit);
    int64_t n = 0;
    for (int a = 0; a < dimension; a++) {
        own[a] = vi_set((int32_t)near->high[a][i]);
        unit[a] = vf_set(near->unit[a]);
    }
    for (int r = 0; r < n_runs; r++) {
        for (int32_t slot = runs[r].begin; slot < runs[r].end; slot += VF_LANES) {
            vf squared = vf_set(0.0f);
            for (int a = 0; a < dimension; a++) {
                vi d = vi_sub(own[a], vi_load(grid->high[a] + slot));
                squared = gbg_list_add_square(d, unit[a], squared);
            }
            vi j = vi_load(grid->particle + slot);
            vm there = vi_lt(lane, vi_set(runs[r].end - slot));
            vm kept = vm_and(vm_and(there, vf_lt(squared, limit)), vm_not(vi_eq(j, self)));
            n += vi_store_kept(found + n, kept, j);
        }
    }
    return n;
}

int64_t GBG_ISA_NAME(gbg_cpu_find)(const struct gbg_near *near, int64_t i,
                                   const struct gbg_run *runs, int n_runs, int32_t *found)
{
    return near->dimension == 2 ? find(near, i, runs, n_runs, found, 2)
                                : find(near, i, runs, n_runs, found, 3);
}

/* The place of a neighbour is the number of those with a smaller key: no branch, and a row has few
 * vectors. */
void GBG_ISA_NAME(gbg_cpu_lay_row)(const int32_t *index, int32_t *key, int64_t count, int32_t *row)
{
    vi one = vi_set(1), none = vi_set(0);
    for (int l = 0; l < VF_LANES; l++) {
        key[count + l] = INT32_MAX;
    }
    for (int64_t first = 0; first < count; first += VF_LANES) {
        vi keys = vi_load(key + first), place = none;
        for (int64_t k = 0; k < count; k++) {
            place = vi_add(place, vi_select(vi_lt(vi_set(key[k]), keys), one, none));
        }
        int32_t to[VF_LANES];
        vi_store(to, place);
        int64_t lanes = count - first < VF_LANES ? count - first : VF_LANES;
        for (int64_t l = 0; l < lanes; l++) {
            row[(int64_t)to[l] * GBG_SLICE] = index[first + l];
        }
    }
}

__attribute__((always_inline)) static inline float follow(const struct gbg_state *state,
                                                          struct gbg_list *list, int64_t first,
                                                          int64_t end, int dimension)
{
    vf scale[3], largest = vf_set(0.0f);
    vi lane = lanes_from_zero();
    for (int a = 0; a < dimension; a++) {
        scale[a] = vf_set(list->scale[a]);
    }
    for (int64_t i = first; i < end; i += VF_LANES) {
        vf squared = vf_set(0.0f);
        for (int a = 0; a < dimension; a++) {
            int shift = list->shift[a];
            vi local = vi_or(vi_shl_by(vi_load(state->high[a] + i), shift),
                             vi_shr_by(vi_load(state->low[a] + i), 32 - shift));
            vi_store(list->local[a] + i, local);
            vi d = vi_sub(local, vi_load(list->built[a] + i));
            squared = gbg_list_add_square(d, scale[a], squared);
        }
        vm there = vi_lt(lane, vi_set(end - i < VF_LANES ? (int32_t)(end - i) : VF_LANES));
        largest = vf_max(largest, vf_keep(there, squared));
    }
    float squares[VF_LANES], most = 0.0f;
    vf_store(squares, largest);
    for (int l = 0; l < VF_LANES; l++) {
        most = squares[l] > most ? squares[l] : most;
    }
    return most;
}

float GBG_ISA_NAME(gbg_cpu_follow)(const struct gbg_state *state, struct gbg_list *list,
                                   int64_t first, int64_t end)
{
    return list->dimension == 2 ? follow(state, list, first, end, 2)
                                : follow(state, list, first, end, 3);
}
