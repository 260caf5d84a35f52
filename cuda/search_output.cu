/* L1, CUDA: the result of a neighbour search as rows, as pairs and block by block. */
#include "cuda/search.h"

/* Pairs that are made at once: for the caller's arrays, and for blocks. */
enum { PAIRS_AT_ONCE = 1 << 24, BATCH = 1 << 16 };

template <typename Number> static __global__ void shift(Number *values, int64_t count, Number more)
{
    int64_t k = gbg_cuda_index();
    if (k < count) {
        values[k] += more;
    }
}

/* Indices and offsets of the rows from another base. */
static int rebase(struct gbg_device *device, struct gbg_search *search, int base)
{
    struct gbg_cuda_rows *rows = &search->out;
    int more = base - search->base;
    int64_t n = search->frame.n;
    if (more == 0) {
        return GBG_OK;
    }
    shift<int64_t><<<gbg_cuda_blocks(n + 1), GBG_CUDA_THREADS, 0, device->stream>>>(rows->offset,
                                                                                    n + 1, more);
    if (rows->total > 0) {
        shift<int32_t><<<gbg_cuda_blocks(rows->total), GBG_CUDA_THREADS, 0, device->stream>>>(
            rows->index, rows->total, more);
    }
    search->base = base;
    return gbg_cuda_started(device, "base of rows");
}

static int check(struct gbg_device *device, const struct gbg_search *search)
{
    int status = gbg_cuda_status(device, cudaSetDevice(device->number), "choosing the device");
    return status || search->has_result
               ? status
               : gbg_fail(device->context, GBG_E_ORDER, "cuda:%d: there are no pairs to read",
                          device->number);
}

int gbg_cuda_search_rows(struct gbg_device *device, struct gbg_search *search, int base,
                         int64_t *offset, int32_t *neighbour)
{
    const struct gbg_cuda_rows *rows = &search->out;
    int status = check(device, search);
    status = status ? status : rebase(device, search, base);
    status = status ? status
                    : gbg_cuda_fetch(device, offset, rows->offset,
                                     (size_t)(search->frame.n + 1) * sizeof *offset);
    if (status == GBG_OK && rows->total > 0) {
        status =
            gbg_cuda_fetch(device, neighbour, rows->index, (size_t)rows->total * sizeof *neighbour);
    }
    return status;
}

/* Entries of a row above its particle, which are the last ones. */
static __global__ void count_larger(const __grid_constant__ struct gbg_search search)
{
    int64_t i = gbg_cuda_index();
    if (i >= search.frame.n) {
        return;
    }
    int64_t begin = search.out.offset[i] - search.base;
    int64_t end = search.out.offset[i + 1] - search.base, low = begin, high = end;
    while (low < high) {
        int64_t middle = low + (high - low) / 2;
        if (search.out.index[middle] - search.base < i) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    search.pair_offset[i] = end - low;
}

/* Numbers of pairs before those of each first particle. */
static int number_pairs(struct gbg_device *device, struct gbg_search *search)
{
    int64_t n = search->frame.n;
    if (search->has_pairs) {
        return GBG_OK;
    }
    int status = gbg_cuda_grow(device, (void **)&search->pair_offset, &search->pair_capacity,
                               search->n_capacity, sizeof *search->pair_offset, "numbers of pairs");
    status = status ? status : gbg_cuda_clear(device, search->pair_offset + n, 8);
    if (status == GBG_OK && n > 0) {
        count_larger<<<gbg_cuda_blocks(n), GBG_CUDA_THREADS, 0, device->stream>>>(*search);
        status = gbg_cuda_started(device, "numbers of pairs");
    }
    status = status ? status : gbg_cuda_search_sum(device, search->pair_offset, n + 1);
    search->has_pairs = status == GBG_OK;
    return status;
}

/* Pairs from..from+count-1: the first particle of one is found by bisection. */
static __global__ void list_pairs(const __grid_constant__ struct gbg_search search, int64_t from,
                                  int64_t count, int base, int32_t *first, int32_t *second,
                                  double *separation)
{
    int64_t k = gbg_cuda_index(), pair = from + k;
    if (k >= count) {
        return;
    }
    const int64_t *offset = search.pair_offset;
    int64_t low = 0, high = search.frame.n; /* offset[low] <= pair < offset[high] */
    while (high - low > 1) {
        int64_t middle = (low + high) / 2;
        if (offset[middle] <= pair) {
            low = middle;
        } else {
            high = middle;
        }
    }
    int64_t at = search.out.offset[low + 1] - search.base - (offset[low + 1] - pair);
    int64_t other = search.out.index[at] - search.base;
    first[k] = (int32_t)(low + base);
    second[k] = (int32_t)(other + base);
    for (int a = 0; separation && a < search.frame.box.dimension; a++) {
        separation[k * search.frame.box.dimension + a] = gbg_box_difference(
            &search.frame.box, a, search.fraction[a][low], search.fraction[a][other]);
    }
}

static int make_pairs(struct gbg_device *device, const struct gbg_search *search, int64_t from,
                      int64_t count, int base, int32_t *first, int32_t *second, double *separation)
{
    list_pairs<<<gbg_cuda_blocks(count), GBG_CUDA_THREADS, 0, device->stream>>>(
        *search, from, count, base, first, second, separation);
    return gbg_cuda_started(device, "pairs");
}

int gbg_cuda_search_pairs(struct gbg_device *device, struct gbg_search *search, int base,
                          int32_t *first, int32_t *second)
{
    int64_t pairs = search->out.total / 2;
    int status = check(device, search);
    status = status ? status : number_pairs(device, search);
    for (int64_t from = 0; from < pairs && status == GBG_OK; from += PAIRS_AT_ONCE) {
        int64_t count = pairs - from < PAIRS_AT_ONCE ? pairs - from : PAIRS_AT_ONCE;
        size_t bytes = (size_t)count * sizeof *first;
        void *made;
        status = gbg_cuda_workspace(device, 2 * bytes, &made);
        int32_t *some = (int32_t *)made;
        status = status ? status
                        : make_pairs(device, search, from, count, base, some, some + count, NULL);
        status = status ? status : gbg_cuda_fetch(device, first + from, some, bytes);
        status = status ? status : gbg_cuda_fetch(device, second + from, some + count, bytes);
    }
    return status;
}

/* The pairs from..., as many as a batch holds, to the host. */
static int fetch_batch(struct gbg_device *device, struct gbg_search *search, int64_t from,
                       int64_t pairs)
{
    int64_t dimension = search->frame.box.dimension, each = 8 * dimension + 8;
    int64_t count = pairs - from < BATCH ? pairs - from : BATCH;
    void *made;
    search->batch_begin = search->batch_end = 0;
    int status = GBG_OK;
    if (!search->batch) {
        status =
            gbg_allocate(device->context, &search->batch, BATCH, (size_t)each, "pairs of a batch");
    }
    status = status ? status : number_pairs(device, search);
    status = status ? status : gbg_cuda_workspace(device, (size_t)(count * each), &made);
    if (status == GBG_OK) {
        double *separation = (double *)made;
        int32_t *first = (int32_t *)(separation + count * dimension);
        status = make_pairs(device, search, from, count, 0, first, first + count, separation);
    }
    status = status ? status : gbg_cuda_fetch(device, search->batch, made, (size_t)(count * each));
    if (status == GBG_OK) {
        search->batch_begin = from;
        search->batch_end = from + count;
    }
    return status;
}

/* block->entry is the number of the next pair. */
int gbg_cuda_search_block(struct gbg_device *device, struct gbg_search *search,
                          struct gbg_search_block *block)
{
    int64_t dimension = search->frame.box.dimension, pairs = search->out.total / 2;
    int status = check(device, search);
    block->count = 0;
    while (status == GBG_OK && block->count < block->capacity && block->entry < pairs) {
        if (block->entry < search->batch_begin || block->entry >= search->batch_end) {
            status = fetch_batch(device, search, block->entry, pairs);
            continue;
        }
        int64_t held = search->batch_end - search->batch_begin;
        int64_t at = block->entry - search->batch_begin, count = search->batch_end - block->entry;
        int64_t room = block->capacity - block->count;
        count = count < room ? count : room;
        const double *separation = (const double *)search->batch;
        const int32_t *first = (const int32_t *)(separation + held * dimension);
        memcpy(block->first + block->count, first + at, (size_t)count * sizeof *first);
        memcpy(block->second + block->count, first + held + at, (size_t)count * sizeof *first);
        memcpy(block->separation + block->count * dimension, separation + at * dimension,
               (size_t)(count * dimension) * sizeof *separation);
        block->count += count;
        block->entry += count;
    }
    return status;
}
