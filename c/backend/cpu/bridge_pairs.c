/* L1, CPU, per instruction set: rule bridge: which pairs a step has to solve, and their records. */
#include <math.h>
#include <string.h>

#include "backend/cpu/bridge.h"
#include "backend/cpu/noise.h"

/* Keeps the pairs (first + lane, j[lane]) of the lanes in `bits` that are met for the first time.
 */
static inline void note_pairs(struct bridge *bridge, int chunk, uint32_t bits, int64_t first,
                              const int32_t *j)
{
    struct bridge_found *found = bridge->found + chunk * bridge->found_capacity;
    for (; bits; bits &= bits - 1) {
        int lane = __builtin_ctz(bits);
        int64_t i = first + lane;
        if (i >= j[lane]) { /* rows are full: the other disc's row holds it too */
            continue;
        }
        int64_t n = bridge->found_count[chunk]++;
        if (n < bridge->found_capacity) {
            int32_t block = bridge_block_of(&bridge->plan, bridge->state, i, j[lane]);
            bridge->tally[chunk * bridge->plan.n_blocks + block]++;
            found[n] = (struct bridge_found){(int32_t)i, j[lane], block};
        }
    }
}

__attribute__((always_inline)) static inline void
find_in_slice(struct bridge *bridge, int chunk, int64_t slice, int part, vf limit, int dimension)
{
    const struct gbg_list *list = bridge->list;
    const int32_t *index = list->chunk[chunk].index + list->offset[slice] + part;
    int64_t first = slice * GBG_SLICE + part;
    vi own[3];
    vf scale[3];
    for (int a = 0; a < dimension; a++) {
        own[a] = vi_load(list->local[a] + first);
        scale[a] = vf_set(list->scale[a]);
    }
    for (int32_t k = 0; k < list->width[slice]; k++, index += GBG_SLICE) {
        vi j = vi_load(index);
        vf squared = vf_set(0.0f);
        for (int a = 0; a < dimension; a++) {
            vf r = vf_mul(vf_from_vi(vi_sub(own[a], vi_gather(list->local[a], j))), scale[a]);
            squared = vf_fma(r, r, squared);
        }
        uint32_t bits = vm_bits(vf_lt(squared, limit));
        if (bits) {
            note_pairs(bridge, chunk, bits, first, index);
        }
    }
}

void bridge_find(struct bridge *bridge, int chunk)
{
    const struct gbg_list *list = bridge->list;
    vf limit = vf_set(bridge->plan.limit);
    memset(bridge->tally + chunk * bridge->plan.n_blocks, 0,
           (size_t)bridge->plan.n_blocks * sizeof *bridge->tally);
    bridge->found_count[chunk] = 0;
    for (int64_t slice = list->chunk[chunk].first_slice; slice < list->chunk[chunk].end_slice;
         slice++) {
        for (int part = 0; part < GBG_SLICE; part += VF_LANES) {
            if (bridge->dimension == 2) {
                find_in_slice(bridge, chunk, slice, part, limit, 2);
            } else {
                find_in_slice(bridge, chunk, slice, part, limit, 3);
            }
        }
    }
}

/* Random words of up to VF_LANES pairs: the first for U, the second for the order of sweeps. */
static void draw(const struct bridge *bridge, struct bridge_raw *raw, bridge_key *key,
                 int64_t place, int lanes)
{
    const struct gbg_noise *noise = bridge->rule->noise;
    uint64_t step = bridge->rule->step;
    uint32_t min[VF_LANES] = {0}, max[VF_LANES] = {0};
    for (int l = 0; l < lanes; l++) {
        uint64_t a = bridge_id(bridge->state, raw[l].pair.i),
                 b = bridge_id(bridge->state, raw[l].pair.j);
        struct gbg_philox c = gbg_philox_pair(step, a < b ? a : b, a < b ? b : a, GBG_STREAM_BRIDGE,
                                              noise->seed, noise->run);
        min[l] = c.word[1];
        max[l] = c.word[2];
    }
    uint32_t high = ((uint32_t)(step >> 32) & 0xFFFFFFu) | (uint32_t)GBG_STREAM_BRIDGE << 24;
    vi word[4] = {vi_set((int32_t)(uint32_t)step), vi_load(min), vi_load(max),
                  vi_set((int32_t)high)};
    float exponential[VF_LANES];
    uint32_t order[VF_LANES];
    gbg_philox_lanes(word, noise->seed, noise->run);
    vf_store(exponential, vf_mul(gbg_noise_exponential(word[0]), vf_set(bridge->plan.squared)));
    vi_store(order, word[1]);
    for (int l = 0; l < lanes; l++) {
        raw[l].pair.quarter_draw = 0.25f * exponential[l];
        key[l] = (bridge_key)order[l] << 32 | (uint64_t)(place + l);
    }
}

/* Which of two records comes first: by random word, or by ids where those are equal. */
static inline int precedes(const struct bridge *bridge, const struct bridge_raw *raw, bridge_key a,
                           bridge_key b)
{
    if (a >> 32 != b >> 32) {
        return a >> 32 < b >> 32;
    }
    const struct bridge_pair *first = &raw[(uint32_t)a].pair, *second = &raw[(uint32_t)b].pair;
    return bridge_precedes(bridge->state, first->i, first->j, second->i, second->j);
}

/* Sorts keys: into 256 or fewer bins by their top bits, then by insertion over the nearly sorted
 * rest. The result is in `key`; `other` is scratch. */
static void sort_keys(const struct bridge *bridge, const struct bridge_raw *raw, bridge_key *key,
                      bridge_key *other, int64_t n)
{
    enum { BINS = 256 };
    uint32_t begin[BINS + 1] = {0};
    for (int64_t k = 0; k < n; k++) {
        begin[(key[k] >> 56) + 1]++;
    }
    for (int b = 0; b < BINS; b++) {
        begin[b + 1] += begin[b];
    }
    for (int64_t k = 0; k < n; k++) {
        other[begin[key[k] >> 56]++] = key[k];
    }
    for (int64_t k = 0; k < n; k++) {
        int64_t place = k;
        bridge_key own = other[k];
        while (place > 0 && precedes(bridge, raw, own, key[place - 1])) {
            key[place] = key[place - 1];
            place--;
        }
        key[place] = own;
    }
}

/* Orders the sorted keys by a colouring, given out greedily in their order, so that pairs that
 * follow each other share no disc and need not wait for each other. The discs' masks of used
 * colours are zero before and after; a pair that finds none free takes the last. */
static void order_by_colour(struct bridge *bridge, const struct bridge_raw *raw, bridge_key *key,
                            bridge_key *other, int64_t n)
{
    int64_t begin[BRIDGE_COLOURS + 1] = {0};
    uint64_t *used = bridge->used;
    for (int64_t k = 0; k < n; k++) {
        uint32_t place = (uint32_t)key[k];
        int32_t i = raw[place].pair.i, j = raw[place].pair.j;
        uint64_t free = ~(used[i] | used[j]);
        int colour = free ? __builtin_ctzll(free) : BRIDGE_COLOURS - 1;
        used[i] |= (uint64_t)1 << colour;
        used[j] |= (uint64_t)1 << colour;
        other[k] = (bridge_key)colour << 32 | place;
        begin[colour + 1]++;
    }
    for (int c = 0; c < BRIDGE_COLOURS; c++) {
        begin[c + 1] += begin[c];
    }
    for (int64_t k = 0; k < n; k++) {
        uint32_t place = (uint32_t)other[k];
        key[begin[other[k] >> 32]++] = place;
        used[raw[place].pair.i] = used[raw[place].pair.j] = 0;
    }
}

void bridge_make_records(struct bridge *bridge, int64_t block, struct bridge_raw *raw,
                         bridge_key *key)
{
    int64_t first = bridge->first[block], found = bridge->first[block + 1] - first, n = 0;
    const int32_t *sorted = bridge->sorted + 2 * first;
    int dimension = bridge->dimension;
    float depth = 0.0f;
    for (int64_t k = 0; k < found; k++) {
        n +=
            bridge_measure(&bridge->plan, bridge->state, sorted[2 * k], sorted[2 * k + 1], &raw[n]);
    }
    for (int64_t k = 0; k < n; k += VF_LANES) {
        draw(bridge, raw + k, key + k, k, (int)(n - k < VF_LANES ? n - k : VF_LANES));
    }
    sort_keys(bridge, raw, key, key + bridge->most, n);
    order_by_colour(bridge, raw, key, key + bridge->most, n);
    for (int64_t k = 0; k < n; k++) {
        const struct bridge_raw *from = &raw[(uint32_t)key[k]];
        float *normal = bridge->normal + dimension * (first + k);
        float *shape = bridge->shape + (2 * dimension + 1) * (first + k);
        float overlap = bridge_depth(from->pair.gap, from->pair.half_base);
        depth = overlap > depth ? overlap : depth;
        bridge->pair[first + k] = from->pair;
        for (int a = 0; a < dimension; a++) {
            normal[a] = bridge_half_unit(from->start[a], from->distance);
            shape[a] = from->start[a];
            shape[dimension + a] = from->free[a];
        }
        shape[2 * dimension] = from->distance;
    }
    bridge->count[block] = n;
    bridge->depth[block] = depth;
}
