/* L1, CUDA: building pair lists from cells: rows of neighbours in ascending order of ranks. */
#include "cuda/list.h"

#include "backend/cpu/list_lengths.h"
#include "backend/cpu/list_square.h"
#include "cuda/network.h"

/* Threads of a block that has a row a thread; of one that sorts wide slices; rows of those that it
 * sorts in shared memory; neighbours of the longest row that a thread sorts by itself. */
enum { THREADS = GBG_CUDA_THREADS, SORTERS = 1024, SHARED = 256, NONE = INT32_MAX, WIDEST = 64 };

/* What a search for neighbours reads: lengths in units of the radius. */
struct search {
    struct gbg_state state;
    struct gbg_cuda_grid grid;
    float unit[3];
    float limit;    /* squared, with room for rounding */
    double squared; /* of the radius */
    int coarse; /* 1: high words are too coarse for the radius: neighbours are sifted by 64 bits */
};

/* The local coordinates, and those at which the list is built. */
template <int DIMENSION>
static __global__ void remember(const __grid_constant__ struct gbg_state state,
                                const struct gbg_cuda_rows rows, int64_t total)
{
    int64_t i = gbg_cuda_index();
    for (int a = 0; a < DIMENSION && i < total; a++) {
        uint32_t high = state.high[a][i];
        uint32_t local = gbg_cuda_local(high, state.low[a][i], rows.shift[a]);
        rows.local[a][i] = local;
        if (i < rows.n) {
            rows.built[a][i] = local;
            rows.built_high[a][i] = high;
        }
    }
}

/* Calls visit(j) for each neighbour of particle i, in any order. */
template <int DIMENSION, bool COARSE, typename Visit>
static __device__ __forceinline__ void for_neighbours(const struct search &search, int64_t i,
                                                      Visit visit)
{
    uint32_t own[DIMENSION];
    for (int a = 0; a < DIMENSION; a++) {
        own[a] = search.state.high[a][i];
    }
    gbg_cuda_visit(search.grid, search.grid.cell_of[i], [&](int32_t slot) {
        vf squared = 0.0f;
        for (int a = 0; a < DIMENSION; a++) {
            vi d = (vi)(own[a] - search.grid.high[a][slot]);
            squared = gbg_list_add_square(d, search.unit[a], squared);
        }
        if (vf_lt(squared, search.limit)) {
            int32_t j = search.grid.particle[slot];
            if (j != i && (!COARSE || gbg_list_holds(&search.state, i, j, search.squared))) {
                visit(j);
            }
        }
    });
}

/* What a pass over all slices found. */
struct totals {
    unsigned long long entries; /* of the index */
    unsigned int widest, unused;
};

static __global__ void invert(const int32_t *rank, int64_t n, int32_t *of_rank)
{
    int64_t i = gbg_cuda_index();
    if (i < n) {
        of_rank[rank[i]] = (int32_t)i;
    }
}

/* Notes the width of a slice, a warp's, where rows have `most` places: false if it is wider. */
static __device__ __forceinline__ bool note_width(const struct gbg_cuda_rows &rows, int most,
                                                  int64_t slice, unsigned count,
                                                  struct totals *totals)
{
    unsigned width = __reduce_max_sync(0xFFFFFFFFu, count);
    if (threadIdx.x % GBG_CUDA_SLICE == 0) {
        rows.width[slice] = width <= (unsigned)most ? (int32_t)width : 0;
        rows.offset[slice] = slice * most * GBG_CUDA_SLICE;
        if (width > *(volatile unsigned *)&totals->widest) { /* few come that far */
            atomicMax(&totals->widest, width);
        }
    }
    return width <= (unsigned)most;
}

/* Rows of up to `most` neighbours, as ranks in any order, filled up with NONE. */
template <int DIMENSION, bool COARSE>
static __global__ void __launch_bounds__(THREADS)
    find_rows(const __grid_constant__ struct search search,
              const __grid_constant__ struct gbg_cuda_rows rows, int most, struct totals *totals)
{
    int64_t i = gbg_cuda_index(), slice = i / GBG_CUDA_SLICE;
    if (slice >= rows.slices) {
        return;
    }
    int32_t *row = rows.index + slice * most * GBG_CUDA_SLICE + i % GBG_CUDA_SLICE;
    int count = 0;
    if (i < rows.n) {
        for_neighbours<DIMENSION, COARSE>(search, i, [&](int32_t j) {
            if (count < most) {
                row[count * GBG_CUDA_SLICE] = gbg_rank_of(&search.state, j);
            }
            count++;
        });
    }
    if (note_width(rows, most, slice, (unsigned)count, totals)) {
        int width = (int)__reduce_max_sync(0xFFFFFFFFu, (unsigned)count);
        for (; count < width; count++) {
            row[count * GBG_CUDA_SLICE] = NONE;
        }
    }
}

/* Their ranks sorted, and written as indices. */
template <int MOST>
static __global__ void __launch_bounds__(THREADS)
    sort_rows(const __grid_constant__ struct gbg_cuda_rows rows, const int32_t *of_rank)
{
    int64_t i = gbg_cuda_index(), slice = i / GBG_CUDA_SLICE;
    if (slice >= rows.slices) {
        return;
    }
    int32_t *row = rows.index + slice * MOST * GBG_CUDA_SLICE + i % GBG_CUDA_SLICE;
    int32_t key[MOST], self = (int32_t)(i < rows.n ? i : rows.n - 1), width = rows.width[slice];
#pragma unroll
    for (int k = 0; k < MOST; k++) {
        key[k] = k < width ? row[k * GBG_CUDA_SLICE] : (int32_t)NONE;
    }
    gbg_cuda_sort_step<MOST, 1, 1>(key);
#pragma unroll
    for (int k = 0; k < MOST; k++) {
        if (k < width) {
            row[k * GBG_CUDA_SLICE] = key[k] == NONE ? self : of_rank ? of_rank[key[k]] : key[k];
        }
    }
}

/* Rows of a list out of those of a longer one that was built at the same positions. */
template <int DIMENSION, bool COARSE>
static __global__ void __launch_bounds__(THREADS)
    sift_rows(const __grid_constant__ struct search search,
              const __grid_constant__ struct gbg_cuda_rows from,
              const __grid_constant__ struct gbg_cuda_rows rows, int most, struct totals *totals)
{
    int64_t i = gbg_cuda_index(), slice = i / GBG_CUDA_SLICE;
    if (slice >= rows.slices) {
        return;
    }
    const int32_t *other = from.index + from.offset[slice] + i % GBG_CUDA_SLICE;
    int32_t *row = rows.index + slice * most * GBG_CUDA_SLICE + i % GBG_CUDA_SLICE;
    int32_t n = i < rows.n ? from.width[slice] : 0, self = (int32_t)(i < rows.n ? i : rows.n - 1);
    int count = 0;
    uint32_t own[DIMENSION];
    for (int a = 0; a < DIMENSION; a++) {
        own[a] = search.state.high[a][self];
    }
#pragma unroll 4
    for (int32_t k = 0; k < n; k++) {
        int32_t j = other[(int64_t)k * GBG_CUDA_SLICE];
        vf squared = 0.0f;
        for (int a = 0; a < DIMENSION; a++) {
            vi d = (vi)(own[a] - search.state.high[a][j]);
            squared = gbg_list_add_square(d, search.unit[a], squared);
        }
        if (j != self && vf_lt(squared, search.limit) &&
            (!COARSE || gbg_list_holds(&search.state, i, j, search.squared))) {
            if (count < most) {
                row[count * GBG_CUDA_SLICE] = j;
            }
            count++;
        }
    }
    if (note_width(rows, most, slice, (unsigned)count, totals)) {
        int width = (int)__reduce_max_sync(0xFFFFFFFFu, (unsigned)count);
        for (; count < width; count++) {
            row[count * GBG_CUDA_SLICE] = self;
        }
    }
}

/* Rows longer than a thread sorts by itself: ranks in any order, filled up with NONE, for
 * sort_wide. The widths are known. */
template <int DIMENSION, bool COARSE>
static __global__ void __launch_bounds__(THREADS)
    fill_wide(const __grid_constant__ struct search search, const struct gbg_cuda_rows rows)
{
    int64_t i = gbg_cuda_index(), slice = i / GBG_CUDA_SLICE;
    if (slice >= rows.slices) {
        return;
    }
    int32_t *row = rows.index + rows.offset[slice] + i % GBG_CUDA_SLICE;
    int32_t width = rows.width[slice], count = 0;
    if (i < rows.n) {
        for_neighbours<DIMENSION, COARSE>(search, i, [&](int32_t j) {
            row[(int64_t)count++ * GBG_CUDA_SLICE] = gbg_rank_of(&search.state, j);
        });
    }
    for (; count < width; count++) {
        row[(int64_t)count * GBG_CUDA_SLICE] = NONE;
    }
}

/* Widths only, and with them the parts of the index, in any order; widths are 0 where it is too
 * short. */
template <int DIMENSION, bool COARSE>
static __global__ void __launch_bounds__(THREADS)
    count_wide(const __grid_constant__ struct search search, const struct gbg_cuda_rows rows,
               int64_t capacity, struct totals *totals)
{
    int64_t i = gbg_cuda_index(), slice = i / GBG_CUDA_SLICE;
    unsigned count = 0;
    if (slice >= rows.slices) {
        return;
    }
    if (i < rows.n) {
        for_neighbours<DIMENSION, COARSE>(search, i, [&](int32_t) { count++; });
    }
    count = __reduce_max_sync(0xFFFFFFFFu, count);
    if (i % GBG_CUDA_SLICE == 0) {
        int64_t places = (int64_t)count * GBG_CUDA_SLICE;
        int64_t begin = (int64_t)atomicAdd(&totals->entries, (unsigned long long)places);
        bool fits = begin + places <= capacity;
        rows.width[slice] = fits ? (int32_t)count : 0;
        rows.offset[slice] = fits ? begin : 0;
        atomicMax(&totals->widest, count);
    }
}

/* Puts the smaller number of each lane at the lower place. */
static __device__ __forceinline__ void compare(int32_t *key, int64_t low, int64_t high,
                                               int64_t count)
{
    if (high < count) {
        int lane = (int)(threadIdx.x & 31);
        int32_t *p = key + low * GBG_CUDA_SLICE + lane, *q = key + high * GBG_CUDA_SLICE + lane;
        int32_t a = *p, b = *q;
        if (a > b) {
            *p = b;
            *q = a;
        }
    }
}

/* Sorts the 32 rows of a slice side by side, each warp a comparison of all of them: a bitonic
 * network in which every comparison puts the smaller number lower, so that places behind the end
 * count as larger than all and are left away. */
static __device__ void sort_slice(int32_t *key, int64_t count)
{
    int64_t warp = threadIdx.x / 32, warps = blockDim.x / 32, pairs = 1;
    while (2 * pairs < count) {
        pairs *= 2;
    }
    for (int64_t half = 1; half <= pairs; half *= 2) { /* a power of two */
        for (int64_t c = warp; c < pairs; c += warps) {
            int64_t place = c & (half - 1), first = 2 * (c - place);
            compare(key, first + place, first + 2 * half - 1 - place, count);
        }
        __syncthreads();
        for (int64_t apart = half / 2; apart > 0; apart /= 2) {
            for (int64_t c = warp; c < pairs; c += warps) {
                int64_t low = 2 * c - (c & (apart - 1));
                compare(key, low, low + apart, count);
            }
            __syncthreads();
        }
    }
}

/* A block for each slice: ranks in any order to sorted indices. */
static __global__ void __launch_bounds__(SORTERS)
    sort_wide(const struct gbg_cuda_rows rows, const int32_t *of_rank)
{
    __shared__ int32_t near[SHARED * GBG_CUDA_SLICE];
    int64_t slice = blockIdx.x, width = rows.width[slice];
    int32_t *row = rows.index + rows.offset[slice];
    int32_t *key = width <= SHARED ? near : row;
    int64_t self = slice * GBG_CUDA_SLICE + threadIdx.x % 32;
    self = self < rows.n ? self : rows.n - 1;
    for (int64_t k = threadIdx.x; k < width * GBG_CUDA_SLICE && key != row; k += SORTERS) {
        key[k] = row[k];
    }
    __syncthreads();
    sort_slice(key, width);
    for (int64_t k = threadIdx.x; k < width * GBG_CUDA_SLICE; k += SORTERS) {
        int32_t rank = key[k];
        row[k] = rank == NONE ? (int32_t)self : of_rank ? of_rank[rank] : rank;
    }
}

/* Places of a row, for those up to `widest`: of the kernels that sort them, or 0: any. */
static int places_for(unsigned widest)
{
    static const int made[] = {8, 16, 24, 32, 40, 48, WIDEST};
    for (int places : made) {
        if (widest <= (unsigned)places) {
            return places;
        }
    }
    return 0;
}

static void start_sort(struct gbg_device *device, const struct gbg_cuda_rows &rows, int places,
                       const int32_t *of_rank)
{
    (places == 8    ? sort_rows<8>
     : places == 16 ? sort_rows<16>
     : places == 24 ? sort_rows<24>
     : places == 32 ? sort_rows<32>
     : places == 40 ? sort_rows<40>
     : places == 48 ? sort_rows<48>
                    : sort_rows<WIDEST>)<<<gbg_cuda_blocks(rows.slices * GBG_CUDA_SLICE, THREADS),
                                           THREADS, 0, device->stream>>>(rows, of_rank);
}

int gbg_cuda_invert_ranks(struct gbg_device *device, const struct gbg_state *state, int64_t n,
                          int32_t *of_rank)
{
    invert<<<gbg_cuda_blocks(n), GBG_CUDA_THREADS, 0, device->stream>>>(state->rank, n, of_rank);
    return gbg_cuda_started(device, "order of ranks");
}

/* The same in the workspace; NULL: ranks are indices. */
static int find_ranks(struct gbg_device *device, const struct gbg_state *state, int64_t n,
                      int32_t **of_rank)
{
    void *memory = NULL;
    *of_rank = NULL;
    if (!state->rank) {
        return GBG_OK;
    }
    int status = gbg_cuda_workspace(device, (size_t)n * sizeof **of_rank, &memory);
    if (status == GBG_OK) {
        *of_rank = (int32_t *)memory;
        status = gbg_cuda_invert_ranks(device, state, n, *of_rank);
    }
    return status;
}

static int reserve_index(struct gbg_device *device, struct gbg_list *list, int64_t needed)
{
    return gbg_cuda_grow(device, (void **)&list->rows.index, &list->index_capacity, needed,
                         sizeof *list->rows.index, "pair list");
}

/* Entries of an index that are much memory. */
static const int64_t MUCH = INT64_C(1) << 28;

/* Rows of so many places. Where that is not much, the first build takes half more, so that the
 * index rarely grows while an engine runs; in a large system the longest row changes little. */
static int reserve_places(struct gbg_device *device, struct gbg_list *list, int places)
{
    int64_t rows = list->rows.slices * GBG_CUDA_SLICE, needed = rows * places, wanted = needed;
    int room = places_for((unsigned)(places + places / 2));
    if (room > 0 && needed < MUCH) {
        wanted = rows * room;
    }
    if ((list->builds > 0 ? needed : wanted) <= list->index_capacity) {
        return GBG_OK;
    }
    return reserve_index(device, list, wanted);
}

/* The totals of a pass, where they stand on the device. */
static struct totals *totals_of(const struct gbg_cuda_rows *rows)
{
    return (struct totals *)(rows->offset + rows->slices);
}

static int end_pass(struct gbg_device *device, const struct gbg_list *list, struct totals *found)
{
    int status = gbg_cuda_started(device, "filling the pair list");
    return status ? status : gbg_cuda_fetch(device, found, totals_of(&list->rows), sizeof *found);
}

/* Of the longest row, before the first build: where memory matters too low, at the price of a pass,
 * rather than too high. */
static unsigned first_guess(const struct gbg_list *list)
{
    return list->rows.slices * GBG_CUDA_SLICE * places_for(12) < MUCH ? 12 : 1;
}

/* What was refused once is not asked for again, which would give up the index that there is;
 * *places 0: it cannot be had. */
static int reserve_even(struct gbg_device *device, struct gbg_list *list, int *places)
{
    int64_t needed = list->rows.slices * GBG_CUDA_SLICE * *places;
    if (list->refused > 0 && needed >= list->refused && needed > list->index_capacity) {
        *places = 0;
    }
    int status = *places > 0 ? reserve_places(device, list, *places) : GBG_OK;
    if (status == GBG_E_MEMORY) { /* rows of their own lengths take less */
        list->refused = needed;
        *places = 0;
        status = GBG_OK;
    }
    return status;
}

/* Rows of as many places each as the longest needs: first as many as last time, then as many as
 * were missing. *places 0: they are too long for that, or take more
 * memory than there is. */
template <typename Start>
static int build_even(struct gbg_device *device, struct gbg_list *list, int *places, Start start)
{
    struct totals found = {0, list->widest > 0 ? list->widest : first_guess(list), 0};
    int status = GBG_OK;
    for (int done = 0; status == GBG_OK && !done;) {
        *places = places_for(found.widest);
        status = reserve_even(device, list, places);
        if (status != GBG_OK || *places == 0) {
            break;
        }
        status = gbg_cuda_clear(device, totals_of(&list->rows), sizeof found);
        if (status == GBG_OK) {
            start(*places, totals_of(&list->rows));
            status = end_pass(device, list, &found);
            done = found.widest <= (unsigned)*places;
        }
    }
    /* slowly down: a row that is a little longer again would cost a pass */
    list->widest = found.widest + 1 > list->widest ? found.widest : list->widest - 1;
    return status;
}

/* By half more, so that it rarely grows again, or by what there is room for. */
static int reserve_wide(struct gbg_device *device, struct gbg_list *list, int64_t needed)
{
    int status = reserve_index(device, list, needed + needed / 2);
    return status == GBG_E_MEMORY ? reserve_index(device, list, needed + needed / 32) : status;
}

/* Rows of any length. */
template <int DIMENSION, bool COARSE>
static int build_wide(struct gbg_device *device, const struct search &search, struct gbg_list *list,
                      const int32_t *of_rank)
{
    const struct gbg_cuda_rows *rows = &list->rows;
    unsigned blocks = gbg_cuda_blocks(rows->slices * GBG_CUDA_SLICE, THREADS);
    struct totals found = {};
    int status = GBG_OK;
    for (int done = 0; status == GBG_OK && !done;) {
        status = gbg_cuda_clear(device, totals_of(rows), sizeof found);
        if (status == GBG_OK) {
            count_wide<DIMENSION, COARSE><<<blocks, THREADS, 0, device->stream>>>(
                search, *rows, list->index_capacity, totals_of(rows));
            status = end_pass(device, list, &found);
        }
        done = (int64_t)found.entries <= list->index_capacity;
        if (status == GBG_OK && !done) {
            status = reserve_wide(device, list, (int64_t)found.entries);
        }
    }
    list->widest = found.widest;
    if (status == GBG_OK) {
        fill_wide<DIMENSION, COARSE><<<blocks, THREADS, 0, device->stream>>>(search, *rows);
        sort_wide<<<(unsigned)rows->slices, SORTERS, 0, device->stream>>>(*rows, of_rank);
        status = gbg_cuda_started(device, "sorting the pair list");
    }
    return status;
}

template <int DIMENSION, bool COARSE>
static int build_rows(struct gbg_device *device, const struct search &search, struct gbg_list *list)
{
    struct gbg_cuda_rows *rows = &list->rows;
    unsigned blocks = gbg_cuda_blocks(rows->slices * GBG_CUDA_SLICE, THREADS);
    int32_t *of_rank;
    int places = 0, status = find_ranks(device, &search.state, rows->n, &of_rank);
    status =
        status ? status : build_even(device, list, &places, [&](int most, struct totals *totals) {
            find_rows<DIMENSION, COARSE>
                <<<blocks, THREADS, 0, device->stream>>>(search, *rows, most, totals);
            start_sort(device, *rows, most, of_rank);
        });
    return status || places > 0 ? status
                                : build_wide<DIMENSION, COARSE>(device, search, list, of_rank);
}

static int note_places(struct gbg_device *device, const struct gbg_state *state,
                       const struct gbg_cuda_rows *rows)
{
    int64_t total = state->owned + state->ghost;
    (state->box.dimension == 2
         ? remember<2>
         : remember<3>)<<<gbg_cuda_blocks(total), GBG_CUDA_THREADS, 0, device->stream>>>(
        *state, *rows, total);
    return gbg_cuda_started(device, "coordinates of the pair list");
}

/* Marks a list as built at the present positions. */
static void finish(struct gbg_device *device, const struct gbg_state *state, struct gbg_list *list)
{
    list->builds++;
    list->epoch = state->epoch;
    list->moment = ++device->moments;
}

int gbg_cuda_list_build(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list)
{
    struct search search = {*state, {}, {}, 0.0f, list->radius * list->radius, 0};
    list->epoch = state->epoch - 1; /* a build that fails is done again */
    if (list->rows.n > 0) {
        int status = gbg_cuda_grid_build(device, &list->grid, &state->box, list->radius,
                                         state->owned + state->ghost, state->high);
        search.grid = list->grid;
        search.coarse =
            gbg_list_choose_search(&state->box, list->radius, search.unit, &search.limit);
        status = status ? status : note_places(device, state, &list->rows);
        if (status != GBG_OK) {
            return status;
        }
        if (state->box.dimension == 2) {
            status = search.coarse ? build_rows<2, true>(device, search, list)
                                   : build_rows<2, false>(device, search, list);
        } else {
            status = search.coarse ? build_rows<3, true>(device, search, list)
                                   : build_rows<3, false>(device, search, list);
        }
        if (status != GBG_OK) {
            return status;
        }
    }
    finish(device, state, list);
    return GBG_OK;
}

/* *fits 0: some row is too long. */
static int sift(struct gbg_device *device, const struct gbg_state *state,
                const struct gbg_list *from, struct gbg_list *list, int *fits)
{
    struct search search = {*state, {}, {}, 0.0f, list->radius * list->radius, 0};
    unsigned blocks = gbg_cuda_blocks(list->rows.slices * GBG_CUDA_SLICE, THREADS);
    search.coarse = gbg_list_choose_search(&state->box, list->radius, search.unit, &search.limit);
    auto *sifting = state->box.dimension == 2
                        ? search.coarse ? sift_rows<2, true> : sift_rows<2, false>
                    : search.coarse ? sift_rows<3, true>
                                    : sift_rows<3, false>;
    int status = note_places(device, state, &list->rows);
    return status ? status : build_even(device, list, fits, [&](int most, struct totals *totals) {
        sifting<<<blocks, THREADS, 0, device->stream>>>(search, from->rows, list->rows, most,
                                                        totals);
    });
}

int gbg_cuda_lists_build(struct gbg_device *device, struct gbg_state *state, struct gbg_list *pairs,
                         struct gbg_list *contacts)
{
    int fits = 0, status = pairs ? gbg_cuda_list_build(device, state, pairs) : GBG_OK;
    if (status == GBG_OK && pairs && contacts && contacts->radius <= pairs->radius &&
        contacts->rows.n > 0) {
        contacts->epoch = state->epoch - 1;
        status = sift(device, state, pairs, contacts, &fits);
        if (status == GBG_OK && fits) {
            finish(device, state, contacts);
        }
    }
    if (status == GBG_OK && contacts && !fits) {
        status = gbg_cuda_list_build(device, state, contacts);
    }
    if (status == GBG_OK && pairs && contacts) {
        contacts->moment = pairs->moment;
    }
    return status;
}
