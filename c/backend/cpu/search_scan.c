/* L1, CPU, per instruction set: fractions and keys of coordinates, and the rows of neighbours.
 *
 * Candidates are sorted out by 32-bit coordinates and floats; where these cannot decide, the rule
 * on 64-bit coordinates does (gbg_search_within), so no rounding of a float shows. */
#include "backend/cpu/cpu.h"
#include "backend/cpu/search.h"
#include "backend/cpu/search_sort.h"
#include "backend/cpu/simd.h"
#include "backend/cpu/variant.h"

#define INLINE static inline __attribute__((always_inline))

enum { GROUP = 8, AHEAD = 16 };

static void encode(struct gbg_search *search, const struct gbg_points *points, int64_t begin,
                   int64_t end)
{
    for (int a = 0; a < search->frame.box.dimension; a++) {
        const struct gbg_box box = search->frame.box;
        const double *restrict from = points->base[a];
        uint64_t *restrict to = search->fraction[a];
        ptrdiff_t step = points->step;
        for (int64_t i = begin; i < end; i++) {
            to[i] = gbg_box_encode(&box, a, from[i * step], NULL);
        }
    }
}

INLINE void keys_of(struct gbg_search *search, int64_t begin, int64_t end, const int dimension,
                    const int sub)
{
    int32_t *restrict key = search->key;
    for (int64_t i = begin; i < end; i++) {
        key[i] = gbg_search_key(&search->frame, search->fraction, i, dimension, sub);
    }
}

static void keys(struct gbg_search *search, int64_t begin, int64_t end)
{
    int octants = search->frame.sub > 0;
    if (search->frame.box.dimension == 2) {
        octants ? keys_of(search, begin, end, 2, 2) : keys_of(search, begin, end, 2, 0);
    } else {
        octants ? keys_of(search, begin, end, 3, 3) : keys_of(search, begin, end, 3, 0);
    }
}

/* Stores the lanes of a whose bit is set one after the other; writes a whole vector; returns their
 * number. */
INLINE int pack(int32_t *to, vi a, uint32_t bits)
{
#if VF_LANES == 16
    _mm512_storeu_si512(to, _mm512_maskz_compress_epi32((__mmask16)bits, a));
    return __builtin_popcount(bits);
#else
    int32_t lane[VF_LANES];
    int n = 0;
    vi_store(lane, a);
    for (; bits; bits &= bits - 1) {
        to[n++] = lane[__builtin_ctz(bits)];
    }
    return n;
#endif
}

/* Which of the lanes in doubt are pairs. */
static uint32_t settle(const struct gbg_search *search, int32_t self, const int32_t *id,
                       uint32_t bits, uint32_t doubt)
{
    for (; doubt; doubt &= doubt - 1) {
        int lane = __builtin_ctz(doubt);
        if (!gbg_search_within(search, self, id[lane])) {
            bits &= ~(UINT32_C(1) << lane);
        }
    }
    return bits;
}

/* Neighbours of particle `self` among the candidates of its cell; returns their number. */
INLINE int64_t neighbours_of(const struct gbg_search *search,
                             const struct gbg_search_thread *thread, int64_t count, int32_t self,
                             const uint32_t *own_local, int32_t *row, const int dimension)
{
    vf scale[3], likely = vf_set(search->frame.likely), sure = vf_set(search->frame.sure);
    vi own[3], me = vi_set(self);
    int64_t found = 0;
    for (int a = 0; a < dimension; a++) {
        own[a] = vi_set((int32_t)own_local[a]);
        scale[a] = vf_set(search->frame.scale[a]);
    }
    for (int64_t k = 0; k < count; k += VF_LANES) {
        vf r = vf_mul(vf_from_vi(vi_sub(own[0], vi_load(thread->place[0] + k))), scale[0]);
        vf squared = vf_mul(r, r);
        for (int a = 1; a < dimension; a++) {
            r = vf_mul(vf_from_vi(vi_sub(own[a], vi_load(thread->place[a] + k))), scale[a]);
            squared = vf_fma(r, r, squared);
        }
        vi id = vi_load(thread->candidate + k);
        uint32_t bits = vm_bits(vf_le(squared, likely)) & ~vm_bits(vi_eq(id, me));
        if (count - k < VF_LANES) {
            bits &= (UINT32_C(1) << (count - k)) - 1;
        }
        uint32_t doubt = bits & ~vm_bits(vf_lt(squared, sure));
        if (__builtin_expect(doubt != 0, 0)) {
            bits = settle(search, self, thread->candidate + k, bits, doubt);
        }
        found += pack(row + found, id, bits);
    }
    return found;
}

/* Copies the candidates of a cell together. */
INLINE int64_t gather(const struct gbg_search *search, struct gbg_search_thread *thread,
                      const struct gbg_search_run *runs, int n_runs, const int dimension)
{
    int64_t count = 0;
    for (int r = 0; r < n_runs; r++) {
        int64_t length = runs[r].end - runs[r].begin;
        for (int64_t k = 0; k < length; k += VF_LANES) {
            for (int a = 0; a < dimension; a++) {
                vi_store(thread->place[a] + count + k,
                         vi_load(search->local[a] + runs[r].begin + k));
            }
            vi_store(thread->candidate + count + k, vi_load(search->particle + runs[r].begin + k));
        }
        count += length;
    }
    return count;
}

/* Appends the row of a particle. */
INLINE void append(struct gbg_device *device, struct gbg_search_row *rows,
                   struct gbg_search_store *store, struct gbg_search_thread *thread, int number,
                   int32_t particle, int32_t *row, int64_t n)
{
    if (__builtin_expect(store->used + n + GBG_SORT_SLACK > store->capacity, 0)) {
        thread->status = gbg_search_grow(device, store, n + GBG_SORT_SLACK);
        if (thread->status != GBG_OK) {
            return;
        }
    }
    sort_row(row, thread->other, n, store->index + store->used);
    rows[particle] = (struct gbg_search_row){
        (uint64_t)number << GBG_SEARCH_THREAD_SHIFT | (uint64_t)store->used, n};
    store->used += n;
    thread->found += n;
}

/* Rows of a few particles of one cell: first all are found, then all are sorted, so that no load
 * waits for a store. */
INLINE void make_rows(struct gbg_device *device, struct gbg_search *search, int number,
                      int64_t count, int32_t from, int32_t to, const int dimension)
{
    struct gbg_search_thread *thread = &search->thread[number];
    int listed = search->frame.plan.skin > 0.0;
    int64_t length[GROUP], room = count + GBG_SORT_SLACK + VF_LANES;
    for (int32_t slot = from; slot < to; slot++) {
        uint32_t own[3];
        for (int a = 0; a < dimension; a++) {
            own[a] = search->local[a][slot];
        }
        length[slot - from] = neighbours_of(search, thread, count, search->particle[slot], own,
                                            thread->row + (slot - from) * room, dimension);
    }
    for (int32_t slot = from; slot < to && thread->status == GBG_OK; slot++) {
        append(device, listed ? search->list : search->out, listed ? &thread->list : &thread->out,
               thread, number, search->particle[slot], thread->row + (slot - from) * room,
               length[slot - from]);
    }
}

/* Runs of slots with the candidates of a key: by a table inside the box, else axis by axis. */
INLINE int runs_of(const struct gbg_search *search, int64_t key, struct gbg_search_run *runs,
                   const int dimension)
{
    uint32_t cell = (uint32_t)(key >> search->frame.sub), cells = (uint32_t)search->frame.cells[0];
    uint32_t row = cell / cells, octant = (uint32_t)key & ((1u << search->frame.sub) - 1);
    int c[3] = {(int)(cell - row * cells), (int)row, 0}, inside = 1;
    if (dimension == 3) {
        c[2] = (int)(row / (uint32_t)search->frame.cells[1]);
        c[1] = (int)(row - (uint32_t)c[2] * (uint32_t)search->frame.cells[1]);
    }
    for (int a = 0; a < dimension; a++) {
        inside &= c[a] >= search->frame.around[a] &&
                  c[a] < search->frame.cells[a] - search->frame.around[a];
    }
    if (!inside) {
        return gbg_search_runs(search, c, (int)octant, runs);
    }
    const int32_t *first = search->first + ((int64_t)cell << search->frame.sub);
    const int64_t *from = search->row_from[octant];
    for (int k = 0; k < search->rows; k++) {
        runs[k].begin = first[from[k]];
        runs[k].end = first[from[k] + search->row_keys];
    }
    return search->rows;
}

INLINE void scan_keys(struct gbg_device *device, struct gbg_search *search, int number,
                      int64_t begin, int64_t end, const int dimension)
{
    struct gbg_search_thread *thread = &search->thread[number];
    struct gbg_search_run runs[GBG_SEARCH_RUNS];
    for (int64_t key = begin; key < end && thread->status == GBG_OK; key++) {
        int32_t from = search->first[key], to = search->first[key + 1];
        if (from == to) {
            continue;
        }
        int n_runs = runs_of(search, key, runs, dimension);
        int64_t count = 0;
        for (int r = 0; r < n_runs; r++) {
            count += runs[r].end - runs[r].begin;
        }
        thread->status = gbg_search_room(device, thread, dimension, count);
        if (thread->status != GBG_OK) {
            return;
        }
        gather(search, thread, runs, n_runs, dimension);
        thread->looked += (count - 1) * (to - from);
        for (int32_t slot = from; slot < to && thread->status == GBG_OK; slot += GROUP) {
            int32_t end_slot = to - slot < GROUP ? to : slot + GROUP;
            make_rows(device, search, number, count, slot, end_slot, dimension);
        }
    }
}

static void scan(struct gbg_device *device, struct gbg_search *search, int thread, int64_t begin,
                 int64_t end)
{
    if (search->frame.box.dimension == 2) {
        scan_keys(device, search, thread, begin, end, 2);
    } else {
        scan_keys(device, search, thread, begin, end, 3);
    }
}

/* Those of `count` listed places that are within the radius of the place `own`; ids: particle of a
 * place, NULL: the place itself. Keeps the order. */
INLINE int64_t sift(const struct gbg_search *search, const int32_t *listed, int64_t count,
                    int32_t own_place, int32_t self, const int32_t *ids, int32_t *row,
                    const int dimension)
{
    vf scale[3], likely = vf_set(search->frame.likely), sure = vf_set(search->frame.sure);
    vi own[3];
    int64_t found = 0;
    for (int a = 0; a < dimension; a++) {
        own[a] = vi_set((int32_t)search->local[a][own_place]);
        scale[a] = vf_set(search->frame.scale[a]);
    }
    for (int64_t k = 0; k < count; k += VF_LANES) {
        vi place = vi_load(listed + k);
        uint32_t valid = ~UINT32_C(0);
        if (count - k < VF_LANES) { /* what stands behind the list may be anything */
            int32_t lane[VF_LANES];
            valid = (UINT32_C(1) << (count - k)) - 1;
            for (int l = 0; l < VF_LANES; l++) {
                lane[l] = l < count - k ? listed[k + l] : own_place;
            }
            place = vi_load(lane);
        }
        vf squared = vf_set(0.0f);
        for (int a = 0; a < dimension; a++) {
            vf r = vf_mul(vf_from_vi(vi_sub(own[a], vi_gather(search->local[a], place))), scale[a]);
            squared = vf_fma(r, r, squared);
        }
        vi id = ids ? vi_gather(ids, place) : place;
        uint32_t bits = vm_bits(vf_le(squared, likely)) & valid;
        uint32_t doubt = bits & ~vm_bits(vf_lt(squared, sure));
        if (__builtin_expect(doubt != 0, 0)) {
            int32_t lane[VF_LANES];
            vi_store(lane, id);
            bits = settle(search, self, lane, bits, doubt);
        }
        found += pack(row + found, id, bits);
    }
    return found;
}

INLINE void filter_slots(struct gbg_device *device, struct gbg_search *search, int number,
                         int64_t begin, int64_t end, const int dimension)
{
    struct gbg_search_thread *thread = &search->thread[number];
    struct gbg_search_store *store = &thread->out;
    for (int64_t slot = begin; slot < end; slot++) {
        int32_t self = search->particle[slot];
        uint64_t at = search->list[self].begin;
        const int32_t *listed = search->thread[at >> GBG_SEARCH_THREAD_SHIFT].list.index +
                                (at & ((UINT64_C(1) << GBG_SEARCH_THREAD_SHIFT) - 1));
        int64_t count = search->list[self].count;
        if (store->used + count + VF_LANES > store->capacity) {
            thread->status = gbg_search_grow(device, store, count + VF_LANES);
            if (thread->status != GBG_OK) {
                return;
            }
        }
        int64_t n = sift(search, listed, count, (int32_t)slot, self, search->particle,
                         store->index + store->used, dimension);
        search->out[self] = (struct gbg_search_row){
            (uint64_t)number << GBG_SEARCH_THREAD_SHIFT | (uint64_t)store->used, n};
        store->used += n;
        thread->found += n;
        thread->looked += count;
    }
}

static void filter(struct gbg_device *device, struct gbg_search *search, int thread, int64_t begin,
                   int64_t end)
{
    if (search->frame.box.dimension == 2) {
        filter_slots(device, search, thread, begin, end, 2);
    } else {
        filter_slots(device, search, thread, begin, end, 3);
    }
}

/* Particles in the cells begin..end-1 of a row of cells. */
INLINE int64_t occupants(const int32_t *cell, int64_t begin, int64_t end, int32_t *to)
{
    int64_t found = 0;
    for (int64_t k = begin; k < end; k += VF_LANES) {
        vi particle = vi_load(cell + k);
        uint32_t bits =
            ~vm_bits(vi_lt(particle, vi_set(0))) & (uint32_t)((UINT64_C(1) << VF_LANES) - 1);
        if (end - k < VF_LANES) {
            bits &= (UINT32_C(1) << (end - k)) - 1;
        }
        found += pack(to + found, particle, bits);
    }
    return found;
}

/* Candidates of the particle in cell c: those in the cells around. */
INLINE int64_t collect(const struct gbg_search *search, const int c[3], int32_t *to)
{
    const int *cells = search->frame.cells, *around = search->frame.around;
    int64_t found = 0;
    int low[3], count[3];
    for (int a = 0; a < 3; a++) {
        int all = a >= search->frame.box.dimension || 2 * around[a] + 1 >= cells[a];
        count[a] = all ? cells[a] : 2 * around[a] + 1;
        low[a] = all ? 0 : c[a] - around[a];
    }
    for (int k = 0; k < count[2]; k++) {
        int z = low[2] + k, over = z >= cells[2];
        z += z < 0 ? cells[2] : over ? -cells[2] : 0;
        for (int l = 0; l < count[1]; l++) {
            int y = low[1] + l;
            y += y < 0 ? cells[1] : y >= cells[1] ? -cells[1] : 0;
            const int32_t *row = search->first + ((int64_t)z * cells[1] + y) * cells[0];
            int begin = low[0], end = low[0] + count[0];
            if (begin < 0) {
                found += occupants(row, begin + cells[0], cells[0], to + found);
                begin = 0;
            }
            if (end > cells[0]) {
                found += occupants(row, 0, end - cells[0], to + found);
                end = cells[0];
            }
            found += occupants(row, begin, end, to + found);
        }
    }
    return found;
}

INLINE void scan_cells(struct gbg_device *device, struct gbg_search *search, int number,
                       int64_t begin, int64_t end, const int dimension)
{
    struct gbg_search_thread *thread = &search->thread[number];
    int64_t most = VF_LANES;
    for (int a = 0; a < dimension; a++) {
        int wide = 2 * search->frame.around[a] + 1;
        most *= wide < search->frame.cells[a] ? wide : search->frame.cells[a];
    }
    most = most < search->frame.n + VF_LANES ? most : search->frame.n + VF_LANES;
    thread->status = gbg_search_room(device, thread, dimension, most);
    for (int64_t cell = begin; cell < end && thread->status == GBG_OK; cell++) {
        int32_t self = search->first[cell];
        if (self < 0) {
            continue;
        }
        int64_t row = cell / search->frame.cells[0];
        int c[3] = {(int)(cell - row * search->frame.cells[0]), (int)(row % search->frame.cells[1]),
                    dimension == 3 ? (int)(row / search->frame.cells[1]) : 0};
        int64_t count = collect(search, c, thread->candidate), kept = 0;
        for (int64_t k = 0; k < count; k++) { /* without itself */
            thread->other[kept] = thread->candidate[k];
            kept += thread->candidate[k] != self;
        }
        int64_t n = sift(search, thread->other, kept, self, self, NULL, thread->row, dimension);
        thread->looked += kept;
        append(device, search->out, &thread->out, thread, number, self, thread->row, n);
    }
}

static void scan_occupied(struct gbg_device *device, struct gbg_search *search, int thread,
                          int64_t begin, int64_t end)
{
    if (search->frame.box.dimension == 2) {
        scan_cells(device, search, thread, begin, end, 2);
    } else {
        scan_cells(device, search, thread, begin, end, 3);
    }
}

static void hand_out(const struct gbg_search *search, int64_t begin, int64_t end, int64_t at,
                     int base, int64_t *offset, int32_t *neighbour)
{
    vi more = vi_set(base);
    int64_t last = at; /* from here on, whole vectors would touch what others write */
    for (int64_t i = begin; i < end; i++) {
        last += search->out[i].count;
    }
    last -= VF_LANES;
    for (int64_t i = begin; i < end; i++) {
        const int32_t *row = gbg_search_row(search, i);
        int64_t count = search->out[i].count, k = 0;
        if (i + AHEAD < end) {
            __builtin_prefetch(gbg_search_row(search, i + AHEAD));
        }
        offset[i] = at + base;
        for (; k < count && at + k <= last; k += VF_LANES) {
            vi_store(neighbour + at + k, vi_add(vi_load(row + k), more));
        }
        for (; k < count; k++) {
            neighbour[at + k] = row[k] + base;
        }
        at += count;
    }
}

const struct gbg_search_kernels GBG_ISA_NAME(gbg_search_kernels) = {
    .encode = encode,
    .keys = keys,
    .scan = scan,
    .scan_occupied = scan_occupied,
    .filter = filter,
    .hand_out = hand_out,
};
