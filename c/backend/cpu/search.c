/* L1, CPU: neighbour search: memory, and the order of the work. */
#include "backend/cpu/search.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef _OPENMP
#include <omp.h>
#endif

#include "backend/cpu/cpu.h"
#include "core/memory.h"

enum { BLOCK = 2048, UNITS_A_THREAD = 8, PADDING = 16, ROW_PADDING = 96 };

static int thread_number(void)
{
#ifdef _OPENMP
    return omp_get_thread_num();
#else
    return 0;
#endif
}

int gbg_search_create(struct gbg_device *device, const struct gbg_box *box,
                      struct gbg_search **search)
{
    struct gbg_search *made;
    int status = gbg_allocate_zero(device->context, (void **)&made, 1, sizeof *made, "search");
    if (status != GBG_OK) {
        return status;
    }
    made->frame.box = *box;
    made->threads = device->threads;
    status = gbg_allocate_zero(device->context, (void **)&made->thread, made->threads,
                               sizeof *made->thread, "threads of the search");
    if (status != GBG_OK) {
        gbg_release(made);
        return status;
    }
    *search = made;
    return GBG_OK;
}

void gbg_search_release(struct gbg_search *search)
{
    for (int a = 0; a < 3; a++) {
        gbg_release(search->fraction[a]);
        gbg_release(search->built[a]);
        gbg_release(search->local[a]);
        search->fraction[a] = search->built[a] = NULL;
        search->local[a] = NULL;
    }
    void **const arrays[] = {(void **)&search->key,      (void **)&search->record,
                             (void **)&search->particle, (void **)&search->slot,
                             (void **)&search->list,     (void **)&search->out};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++) {
        gbg_release(*arrays[k]);
        *arrays[k] = NULL;
    }
    search->n_capacity = 0;
    search->has_result = search->has_list = 0;
}

void gbg_search_destroy(struct gbg_device *device, struct gbg_search *search)
{
    (void)device;
    if (!search) {
        return;
    }
    gbg_search_release(search);
    for (int t = 0; t < search->threads; t++) {
        struct gbg_search_thread *thread = &search->thread[t];
        gbg_release(thread->list.index);
        gbg_release(thread->out.index);
        gbg_release(thread->candidate);
        gbg_release(thread->row);
        gbg_release(thread->other);
        for (int a = 0; a < 3; a++) {
            gbg_release(thread->place[a]);
        }
    }
    gbg_release(search->first);
    gbg_release(search->histogram);
    gbg_release(search->thread);
    gbg_release(search);
}

int gbg_search_reserve(struct gbg_device *device, struct gbg_search *search, int64_t n)
{
    int dimension = search->frame.box.dimension, listed = search->frame.plan.skin > 0.0;
    if (n <= search->n_capacity && (!listed || search->slot)) {
        return GBG_OK;
    }
    gbg_search_release(search);
    struct wanted {
        void **array;
        size_t size;
    } const wanted[] = {
        {(void **)&search->key, 4},
        {(void **)&search->record, 4 * (2 + (size_t)dimension)},
        {(void **)&search->particle, 4},
        {(void **)&search->out, sizeof *search->out},
        {(void **)&search->fraction[0], 8},
        {(void **)&search->fraction[1], 8},
        {(void **)&search->local[0], 4},
        {(void **)&search->local[1], 4},
        {dimension > 2 ? (void **)&search->fraction[2] : NULL, 8},
        {dimension > 2 ? (void **)&search->local[2] : NULL, 4},
        {listed ? (void **)&search->slot : NULL, 4},
        {listed ? (void **)&search->list : NULL, sizeof *search->list},
        {listed ? (void **)&search->built[0] : NULL, 8},
        {listed ? (void **)&search->built[1] : NULL, 8},
        {listed && dimension > 2 ? (void **)&search->built[2] : NULL, 8},
    };
    int status = GBG_OK;
    int64_t room = n + n / 16 + PADDING;
    for (size_t k = 0; status == GBG_OK && k < sizeof wanted / sizeof *wanted; k++) {
        if (wanted[k].array) {
            status = gbg_cpu_scratch(device, wanted[k].array, room, wanted[k].size,
                                     "particles of the search");
        }
    }
    if (status == GBG_OK) {
        search->n_capacity = room;
    } else {
        gbg_search_release(search);
    }
    return status;
}

int gbg_search_grow(struct gbg_device *device, struct gbg_search_store *store, int64_t more)
{
    int64_t capacity = store->used + more + store->capacity / 2 + 4096;
    void *larger;
    int status =
        gbg_cpu_scratch(device, &larger, capacity, sizeof *store->index, "rows of neighbours");
    if (status == GBG_OK) {
        if (store->used > 0) {
            memcpy(larger, store->index, (size_t)store->used * sizeof *store->index);
        }
        gbg_release(store->index);
        store->index = larger;
        store->capacity = capacity;
    }
    return status;
}

int gbg_search_room(struct gbg_device *device, struct gbg_search_thread *thread, int dimension,
                    int64_t candidates)
{
    if (candidates + ROW_PADDING <= thread->room) {
        return GBG_OK;
    }
    int64_t room = candidates + candidates / 2 + ROW_PADDING + 256;
    void **const arrays[] = {(void **)&thread->candidate, (void **)&thread->row,
                             (void **)&thread->other,     (void **)&thread->place[0],
                             (void **)&thread->place[1],  (void **)&thread->place[2]};
    int status = GBG_OK;
    thread->room = 0;
    for (int k = 0; k < 3 + dimension && status == GBG_OK; k++) {
        gbg_release(*arrays[k]);
        *arrays[k] = NULL;
        status = gbg_cpu_scratch(device, arrays[k], k == 1 ? 8 * room : room, 4,
                                 "candidates of the search");
    }
    thread->room = status == GBG_OK ? room : 0;
    return status;
}

static int worst(const struct gbg_search *search)
{
    int status = GBG_OK;
    for (int t = 0; t < search->threads; t++) {
        status = search->thread[t].status != GBG_OK ? search->thread[t].status : status;
    }
    return status;
}

/* Fractions, and keys if they are wanted, block by block while they are in the cache. */
static void encode(struct gbg_device *device, struct gbg_search *search,
                   const struct gbg_points *points, int with_keys)
{
    const struct gbg_search_kernels *kernels = device->variant->search;
    int64_t n = search->frame.n, blocks = (n + BLOCK - 1) / BLOCK;
    int threads = gbg_search_threads(search, n);
    (void)threads;
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int64_t b = 0; b < blocks; b++) {
        int64_t begin = b * BLOCK, end = begin + BLOCK < n ? begin + BLOCK : n;
        if (points) {
            kernels->encode(search, points, begin, end);
        }
        if (with_keys) {
            kernels->keys(search, begin, end);
        }
    }
}

/* Cells, fractions (unless there are no points, which says that they are there) and keys. A set for
 * which there would be far more cells than particles may stand in a small part of the box. */
static int place(struct gbg_device *device, struct gbg_search *search,
                 const struct gbg_points *points, double reach)
{
    gbg_search_frame_start(&search->frame);
    int status = gbg_search_choose_cells(device, search, reach);
    if (status != GBG_OK) {
        return status;
    }
    int with_keys = search->frame.plan.method != GBG_SEARCH_BRUTE;
    if (!search->frame.crowded) {
        encode(device, search, points, with_keys);
        return GBG_OK;
    }
    encode(device, search, points, 0);
    if (gbg_search_zoom(search)) {
        status = gbg_search_choose_cells(device, search, reach);
    }
    if (status == GBG_OK) {
        encode(device, search, NULL, 1);
    }
    return status;
}

/* First key whose slots start at or after `slot`. */
static int64_t key_at(const struct gbg_search *search, int64_t slot)
{
    int64_t low = 0, high = search->frame.n_keys;
    while (low < high) {
        int64_t middle = (low + high) / 2;
        if (search->first[middle] < slot) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

static void scan_sorted(struct gbg_device *device, struct gbg_search *search)
{
    const struct gbg_search_kernels *kernels = device->variant->search;
    int threads = gbg_search_threads(search, search->frame.n);
    int64_t units = threads > 1 ? threads * UNITS_A_THREAD : 1;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
    for (int64_t u = 0; u < units; u++) {
        int64_t begin = u == 0 ? 0 : key_at(search, search->frame.n * u / units);
        int64_t end = u == units - 1 ? search->frame.n_keys
                                     : key_at(search, search->frame.n * (u + 1) / units);
        kernels->scan(device, search, thread_number(), begin, end);
    }
}

/* Puts the particles into cells of one each, a thread for each range of cells. */
static void occupy(struct gbg_search *search)
{
    int64_t n = search->frame.n, keys = search->frame.n_keys;
    int threads = gbg_search_threads(search, n);
#pragma omp parallel for num_threads(threads) schedule(static, 1)
    for (int t = 0; t < threads; t++) {
        int64_t begin = keys * t / threads, end = keys * (t + 1) / threads;
        search->thread[t].crowded = -1;
        for (int64_t c = begin; c < end; c++) {
            search->first[c] = -1;
        }
        for (int64_t i = 0; i < n; i++) {
            int32_t key = search->key[i];
            if (key < begin || key >= end) {
                continue;
            }
            if (search->first[key] >= 0 && search->thread[t].crowded < 0) {
                search->thread[t].crowded = i;
            }
            search->first[key] = search->first[key] >= 0 ? search->first[key] : (int32_t)i;
        }
    }
}

/* The first pair that shares a cell, if there is one. */
static int find_crowded(const struct gbg_search *search, struct gbg_pair *crowded)
{
    int threads = gbg_search_threads(search, search->frame.n);
    int64_t second = -1;
    for (int t = 0; t < threads; t++) {
        int64_t at = search->thread[t].crowded;
        second = at >= 0 && (second < 0 || at < second) ? at : second;
    }
    *crowded = (struct gbg_pair){-1, -1, 0.0};
    if (second < 0) {
        return 0;
    }
    crowded->first = search->first[search->key[second]];
    crowded->second = second;
    crowded->distance =
        sqrt(gbg_search_squared(&search->frame, search->frame.box.dimension, search->fraction,
                                crowded->first, search->fraction, second));
    return 1;
}

static void scan_occupied(struct gbg_device *device, struct gbg_search *search)
{
    const struct gbg_search_kernels *kernels = device->variant->search;
    int threads = gbg_search_threads(search, search->frame.n);
    int64_t units = threads > 1 ? threads * UNITS_A_THREAD : 1;
    for (int a = 0; a < search->frame.box.dimension; a++) {
#pragma omp parallel for num_threads(threads) schedule(static)
        for (int64_t i = 0; i < search->frame.n; i++) {
            search->local[a][i] = gbg_search_local(search->fraction[a][i], search->frame.shift[a]);
        }
    }
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
    for (int64_t u = 0; u < units; u++) {
        kernels->scan_occupied(device, search, thread_number(), search->frame.n_keys * u / units,
                               search->frame.n_keys * (u + 1) / units);
    }
}

/* Every pair by the rule itself. */
static void scan_brute(struct gbg_device *device, struct gbg_search *search)
{
    int64_t n = search->frame.n;
    int threads = gbg_search_threads(search, n * n / 64);
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int64_t i = 0; i < n; i++) {
        int number = thread_number();
        struct gbg_search_thread *thread = &search->thread[number];
        struct gbg_search_store *store = &thread->out;
        if (thread->status == GBG_OK && store->used + n > store->capacity) {
            thread->status = gbg_search_grow(device, store, n);
        }
        if (thread->status != GBG_OK) {
            continue;
        }
        int64_t begin = store->used;
        for (int64_t j = 0; j < n; j++) {
            if (j != i && gbg_search_within(search, i, j)) {
                store->index[store->used++] = (int32_t)j;
            }
        }
        search->out[i] = (struct gbg_search_row){
            (uint64_t)number << GBG_SEARCH_THREAD_SHIFT | (uint64_t)begin, store->used - begin};
        thread->found += store->used - begin;
        thread->looked += n - 1;
    }
}

static void start_counts(struct gbg_search *search, int list)
{
    for (int t = 0; t < search->threads; t++) {
        struct gbg_search_thread *thread = &search->thread[t];
        (list ? &thread->list : &thread->out)->used = 0;
        thread->looked = thread->found = 0;
        thread->status = GBG_OK;
    }
}

/* A list is good while nobody has moved more than half the skin since it was made. */
static int list_is_good(const struct gbg_search *search)
{
    double limit = gbg_search_frame_slack(&search->frame);
    int threads = gbg_search_threads(search, search->frame.n);
    int64_t far = 0;
    (void)threads;
#pragma omp parallel for num_threads(threads) schedule(static) reduction(+ : far)
    for (int64_t i = 0; i < search->frame.n; i++) {
        double squared = gbg_search_squared(&search->frame, search->frame.box.dimension,
                                            search->fraction, i, search->built, i);
        far += !(squared <= limit);
    }
    return far == 0;
}

/* Rows up to radius + skin, their entries turned from particles into slots. */
static int make_list(struct gbg_device *device, struct gbg_search *search)
{
    double reach = gbg_search_frame_reach(&search->frame);
    search->has_list = 0;
    int status = place(device, search, NULL, reach);
    status = status ? status : gbg_search_sort(device, search);
    if (status != GBG_OK) {
        return status;
    }
    gbg_search_frame_radius(&search->frame, reach);
    start_counts(search, 1);
    scan_sorted(device, search);
    status = worst(search);
    if (status != GBG_OK) {
        return status;
    }
    int threads = gbg_search_threads(search, search->frame.n);
    (void)threads;
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int64_t s = 0; s < search->frame.n; s++) {
        search->slot[search->particle[s]] = (int32_t)s;
    }
#pragma omp parallel for num_threads(threads) schedule(static, 1)
    for (int t = 0; t < search->threads; t++) {
        struct gbg_search_store *store = &search->thread[t].list;
        for (int64_t k = 0; k < store->used; k++) {
            store->index[k] = search->slot[store->index[k]];
        }
    }
    for (int a = 0; a < search->frame.box.dimension; a++) {
        memcpy(search->built[a], search->fraction[a], (size_t)search->frame.n * 8);
    }
    search->has_list = 1;
    return GBG_OK;
}

static int update_list(struct gbg_device *device, struct gbg_search *search, int *searched)
{
    int status = GBG_OK;
    *searched = !search->has_list || !list_is_good(search);
    if (*searched) {
        status = make_list(device, search);
    }
    if (status != GBG_OK) {
        return status;
    }
    int threads = gbg_search_threads(search, search->frame.n);
    for (int a = 0; a < search->frame.box.dimension && !*searched; a++) {
#pragma omp parallel for num_threads(threads) schedule(static)
        for (int64_t s = 0; s < search->frame.n; s++) {
            search->local[a][s] =
                gbg_search_local(search->fraction[a][search->particle[s]], search->frame.shift[a]);
        }
    }
    gbg_search_frame_radius(&search->frame, search->frame.plan.radius);
    start_counts(search, 0);
#pragma omp parallel for num_threads(threads) schedule(static, 1)
    for (int t = 0; t < threads; t++) {
        device->variant->search->filter(device, search, thread_number(),
                                        search->frame.n * t / threads,
                                        search->frame.n * (t + 1) / threads);
    }
    return worst(search);
}

static int search_anew(struct gbg_device *device, struct gbg_search *search,
                       const struct gbg_points *points, struct gbg_pair *crowded)
{
    int brute = search->frame.plan.method == GBG_SEARCH_BRUTE;
    int status = place(device, search, points, search->frame.plan.radius);
    if (status != GBG_OK) {
        return status;
    }
    gbg_search_frame_radius(&search->frame, search->frame.plan.radius);
    start_counts(search, 0);
    if (brute) {
        scan_brute(device, search);
    } else if (search->frame.plan.method == GBG_SEARCH_OCCUPANCY) {
        occupy(search);
        if (find_crowded(search, crowded)) {
            return GBG_OK;
        }
        scan_occupied(device, search);
    } else {
        status = gbg_search_sort(device, search);
        if (status == GBG_OK) {
            scan_sorted(device, search);
        }
    }
    return status ? status : worst(search);
}

static int same_plan(const struct gbg_search_plan *a, const struct gbg_search_plan *b)
{
    return a->method == b->method && a->radius == b->radius && a->skin == b->skin &&
           a->edge == b->edge;
}

int gbg_search_update(struct gbg_device *device, struct gbg_search *search,
                      const struct gbg_search_plan *plan, const struct gbg_points *points,
                      struct gbg_search_report *report)
{
    *report = (struct gbg_search_report){.searched = 1, .crowded = {-1, -1, 0.0}};
    if (!same_plan(&search->frame.plan, plan) || search->frame.n != points->n) {
        search->has_list = 0;
    }
    search->has_result = 0;
    search->frame.plan = *plan;
    search->frame.n = points->n;
    int status = gbg_search_reserve(device, search, points->n);
    if (status == GBG_OK && plan->skin > 0.0) {
        encode(device, search, points, 0);
        status = update_list(device, search, &report->searched);
    } else if (status == GBG_OK) {
        status = search_anew(device, search, points, &report->crowded);
    }
    if (status != GBG_OK || report->crowded.first >= 0) {
        return status;
    }
    for (int t = 0; t < search->threads; t++) {
        report->rows += search->thread[t].found;
        report->candidates += search->thread[t].looked;
    }
    gbg_search_frame_report(&search->frame, report);
    search->has_result = 1;
    return GBG_OK;
}
