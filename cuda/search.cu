/* L1, CUDA: neighbour search: memory, and the order of the work. */
#include "cuda/search.h"

enum { PADDING = 16 };

static int use(struct gbg_device *device)
{
    return gbg_cuda_status(device, cudaSetDevice(device->number), "choosing the device");
}

int gbg_cuda_search_create(struct gbg_device *device, const struct gbg_box *box,
                           struct gbg_search **search)
{
    void *body, *totals;
    int status = use(device);
    status =
        status ? status : gbg_allocate_zero(device->context, &body, 1, sizeof **search, "search");
    if (status != GBG_OK) {
        return status;
    }
    status = gbg_cuda_allocate(device, &totals, 1, sizeof(struct gbg_cuda_totals), "search");
    if (status != GBG_OK) {
        gbg_release(body);
        return status;
    }
    struct gbg_search *made = (struct gbg_search *)body;
    made->frame.box = *box;
    made->totals = (struct gbg_cuda_totals *)totals;
    for (int k = 0; k < 2 && status == GBG_OK; k++) {
        status = gbg_cuda_status(device, cudaEventCreate(&made->event[k]), "making an event");
    }
    if (status != GBG_OK) {
        gbg_cuda_search_destroy(device, made);
        return status;
    }
    *search = made;
    return GBG_OK;
}

struct owned {
    void **array;
    size_t size;
};
enum { OWNED = 13 };

/* The arrays of n_capacity elements; those of lists come last. */
static void name_arrays(struct gbg_search *search, int listed, struct owned owned[OWNED])
{
    int deep = search->frame.box.dimension > 2;
    const struct owned all[OWNED] = {
        {(void **)&search->fraction[0], 8},
        {(void **)&search->fraction[1], 8},
        {deep ? (void **)&search->fraction[2] : NULL, 8},
        {(void **)&search->key, 4},
        {(void **)&search->key_sorted, 4},
        {(void **)&search->particle, 4},
        {(void **)&search->slot, 4},
        {(void **)&search->place, sizeof *search->place},
        {(void **)&search->out.offset, 8},
        {listed ? (void **)&search->list.offset : NULL, 8},
        {listed ? (void **)&search->built[0] : NULL, 8},
        {listed ? (void **)&search->built[1] : NULL, 8},
        {listed && deep ? (void **)&search->built[2] : NULL, 8},
    };
    memcpy(owned, all, sizeof all);
}

static void release_arrays(struct gbg_device *device, struct gbg_search *search, int64_t capacity)
{
    struct owned owned[OWNED];
    name_arrays(search, 1, owned);
    for (int k = 0; k < OWNED; k++) {
        if (owned[k].array) {
            gbg_cuda_release(device, *owned[k].array, capacity, owned[k].size);
            *owned[k].array = NULL;
        }
    }
    search->n_capacity = 0;
    search->listed_capacity = search->has_list = search->has_result = 0;
}

/* Memory for n particles. */
static int reserve(struct gbg_device *device, struct gbg_search *search, int64_t n)
{
    int listed = search->frame.plan.skin > 0.0, status = GBG_OK;
    if (n + 1 <= search->n_capacity && (!listed || search->listed_capacity)) {
        return GBG_OK;
    }
    struct owned owned[OWNED];
    release_arrays(device, search, search->n_capacity);
    name_arrays(search, listed, owned);
    int64_t room = n + n / 16 + PADDING;
    for (int k = 0; status == GBG_OK && k < OWNED; k++) {
        if (owned[k].array) {
            status = gbg_cuda_allocate(device, owned[k].array, room, owned[k].size,
                                       "particles of the search");
        }
    }
    if (status != GBG_OK) {
        release_arrays(device, search, room);
        return status;
    }
    search->n_capacity = room;
    search->listed_capacity = listed;
    return GBG_OK;
}

void gbg_cuda_search_destroy(struct gbg_device *device, struct gbg_search *search)
{
    if (!search) {
        return;
    }
    cudaSetDevice(device->number);
    cudaStreamSynchronize(device->stream);
    release_arrays(device, search, search->n_capacity);
    gbg_cuda_release(device, search->out.index, search->out.capacity, 4);
    gbg_cuda_release(device, search->list.index, search->list.capacity, 4);
    gbg_cuda_release(device, search->first, search->key_capacity, 4);
    gbg_cuda_release(device, search->pair_offset, search->pair_capacity, 8);
    gbg_cuda_release(device, search->totals, 1, sizeof *search->totals);
    for (int k = 0; k < 2; k++) {
        if (search->event[k]) {
            cudaEventDestroy(search->event[k]);
        }
    }
    gbg_release(search->gathered);
    gbg_release(search->batch);
    gbg_release(search);
    cudaGetLastError();
}

static int clear_totals(struct gbg_device *device, struct gbg_search *search)
{
    return gbg_cuda_clear(device, search->totals, sizeof *search->totals);
}

static int fetch_totals(struct gbg_device *device, struct gbg_search *search,
                        struct gbg_cuda_totals *totals)
{
    return gbg_cuda_fetch(device, totals, search->totals, sizeof *totals);
}

static __global__ void close_rows(const int64_t *end, struct gbg_cuda_totals *totals)
{
    totals->rows = (unsigned long long)*end;
}

/* Lengths of all rows and where each begins; what was counted comes to the host. */
static int count_rows(struct gbg_device *device, struct gbg_search *search,
                      struct gbg_cuda_rows *rows, gbg_cuda_scan *scan,
                      struct gbg_cuda_totals *totals)
{
    int64_t n = search->frame.n;
    int status = gbg_cuda_clear(device, rows->offset + n, sizeof *rows->offset);
    status = status ? status : scan(device, search, rows, 0);
    status = status ? status : gbg_cuda_search_sum(device, rows->offset, n + 1);
    if (status == GBG_OK) {
        close_rows<<<1, 1, 0, device->stream>>>(rows->offset + n, search->totals);
        status = gbg_cuda_started(device, "sum of rows");
    }
    status = status ? status : fetch_totals(device, search, totals);
    if (status == GBG_OK) {
        rows->total = (int64_t)totals->rows;
        rows->longest = (int64_t)totals->longest;
    }
    return status;
}

/* The rows that were counted; a little more room is taken than they need, if there is as much. */
static int fill_rows(struct gbg_device *device, struct gbg_search *search,
                     struct gbg_cuda_rows *rows, gbg_cuda_scan *scan, int ascending)
{
    void **index = (void **)&rows->index;
    int64_t wanted = rows->total;
    int status = GBG_OK;
    if (wanted > rows->capacity) {
        status = gbg_cuda_grow(device, index, &rows->capacity, wanted + wanted / 16 + PADDING, 4,
                               "rows of neighbours");
        if (status == GBG_E_MEMORY) {
            status = gbg_cuda_grow(device, index, &rows->capacity, wanted, 4, "rows of neighbours");
        }
    }
    if (status == GBG_OK && wanted > 0) {
        status = scan(device, search, rows, 1);
        if (status == GBG_OK && !ascending) {
            status = gbg_cuda_search_sort_rows(device, rows, search->frame.n);
        }
    }
    return status;
}

static int make_rows(struct gbg_device *device, struct gbg_search *search,
                     struct gbg_cuda_rows *rows, gbg_cuda_scan *scan, int ascending,
                     struct gbg_cuda_totals *totals)
{
    int status = clear_totals(device, search);
    status = status ? status : count_rows(device, search, rows, scan, totals);
    return status ? status : fill_rows(device, search, rows, scan, ascending);
}

/* Has anybody moved more than half the skin since the list was made? */
static __global__ void find_far(const __grid_constant__ struct gbg_search search, double limit)
{
    int64_t i = gbg_cuda_index();
    if (i < search.frame.n && !(gbg_search_squared(&search.frame, search.frame.box.dimension,
                                                   search.fraction, i, search.built, i) <= limit)) {
        search.totals->far = 1; /* all write the same */
    }
}

static int list_is_good(struct gbg_device *device, struct gbg_search *search, int *good)
{
    struct gbg_cuda_totals totals = {};
    int status = clear_totals(device, search);
    if (status == GBG_OK && search->frame.n > 0) {
        find_far<<<gbg_cuda_blocks(search->frame.n), GBG_CUDA_THREADS, 0, device->stream>>>(
            *search, gbg_search_frame_slack(&search->frame));
        status = gbg_cuda_started(device, "moves since the list");
        status = status ? status : fetch_totals(device, search, &totals);
    }
    *good = totals.far == 0;
    return status;
}

static __global__ void number_slots(const int32_t *particle, int32_t *slot, int64_t n)
{
    int64_t s = gbg_cuda_index();
    if (s < n) {
        slot[particle[s]] = (int32_t)s;
    }
}

static __global__ void turn_to_slots(int32_t *index, const int32_t *slot, int64_t total)
{
    int64_t k = gbg_cuda_index();
    if (k < total) {
        index[k] = slot[index[k]];
    }
}

/* Entries of the list turn from particles into slots; the coordinates that it was made for. */
static int keep_list(struct gbg_device *device, struct gbg_search *search)
{
    int64_t n = search->frame.n, total = search->list.total;
    int status = GBG_OK;
    if (n > 0) {
        number_slots<<<gbg_cuda_blocks(n), GBG_CUDA_THREADS, 0, device->stream>>>(search->particle,
                                                                                  search->slot, n);
        status = gbg_cuda_started(device, "slots");
    }
    if (status == GBG_OK && total > 0) {
        turn_to_slots<<<gbg_cuda_blocks(total), GBG_CUDA_THREADS, 0, device->stream>>>(
            search->list.index, search->slot, total);
        status = gbg_cuda_started(device, "slots of a list");
    }
    for (int a = 0; a < search->frame.box.dimension && status == GBG_OK && n > 0; a++) {
        status = gbg_cuda_status(device,
                                 cudaMemcpyAsync(search->built[a], search->fraction[a],
                                                 (size_t)n * sizeof *search->built[a],
                                                 cudaMemcpyDeviceToDevice, device->stream),
                                 "keeping coordinates");
    }
    return status;
}

/* Rows up to radius + skin. */
static int make_list(struct gbg_device *device, struct gbg_search *search)
{
    double reach = gbg_search_frame_reach(&search->frame);
    struct gbg_cuda_totals totals;
    search->has_list = 0;
    int status = gbg_cuda_search_place(device, search, reach);
    status = status ? status : gbg_cuda_search_sort(device, search);
    if (status != GBG_OK) {
        return status;
    }
    gbg_search_frame_radius(&search->frame, reach);
    status = make_rows(device, search, &search->list, gbg_cuda_scan_sorted, 0, &totals);
    status = status ? status : keep_list(device, search);
    search->has_list = status == GBG_OK;
    return status;
}

static int update_list(struct gbg_device *device, struct gbg_search *search, int *searched,
                       struct gbg_cuda_totals *totals)
{
    int good = 0;
    int status = search->has_list ? list_is_good(device, search, &good) : GBG_OK;
    *searched = !good;
    if (status == GBG_OK) {
        status = good ? gbg_cuda_search_locate(device, search) : make_list(device, search);
    }
    gbg_search_frame_radius(&search->frame, search->frame.plan.radius);
    return status ? status : make_rows(device, search, &search->out, gbg_cuda_scan_list, 1, totals);
}

/* The pair that shares a cell. */
static __global__ void look_at_crowded(const __grid_constant__ struct gbg_search search)
{
    int64_t second = (int64_t)~search.totals->crowded;
    int64_t first = search.first[search.key[second]];
    search.totals->taken_by = first;
    search.totals->squared = gbg_search_squared(&search.frame, search.frame.box.dimension,
                                                search.fraction, first, search.fraction, second);
}

static int name_crowded(struct gbg_device *device, struct gbg_search *search,
                        struct gbg_pair *crowded)
{
    struct gbg_cuda_totals totals;
    look_at_crowded<<<1, 1, 0, device->stream>>>(*search);
    int status = gbg_cuda_started(device, "crowded cell");
    status = status ? status : fetch_totals(device, search, &totals);
    if (status == GBG_OK) {
        crowded->first = totals.taken_by;
        crowded->second = (int64_t)~totals.crowded;
        crowded->distance = sqrt(totals.squared);
    }
    return status;
}

static int search_occupied(struct gbg_device *device, struct gbg_search *search,
                           struct gbg_pair *crowded, struct gbg_cuda_totals *totals)
{
    int status = clear_totals(device, search);
    status = status ? status : gbg_cuda_search_occupy(device, search);
    status =
        status ? status : count_rows(device, search, &search->out, gbg_cuda_scan_occupied, totals);
    if (status == GBG_OK && totals->crowded != 0) {
        return name_crowded(device, search, crowded);
    }
    return status ? status : fill_rows(device, search, &search->out, gbg_cuda_scan_occupied, 0);
}

static int search_anew(struct gbg_device *device, struct gbg_search *search,
                       struct gbg_pair *crowded, struct gbg_cuda_totals *totals)
{
    int status = gbg_cuda_search_place(device, search, search->frame.plan.radius);
    if (status != GBG_OK) {
        return status;
    }
    gbg_search_frame_radius(&search->frame, search->frame.plan.radius);
    if (search->frame.plan.method == GBG_SEARCH_BRUTE) {
        return make_rows(device, search, &search->out, gbg_cuda_scan_brute, 1, totals);
    }
    if (search->frame.plan.method == GBG_SEARCH_OCCUPANCY) {
        return search_occupied(device, search, crowded, totals);
    }
    status = gbg_cuda_search_sort(device, search);
    return status ? status
                  : make_rows(device, search, &search->out, gbg_cuda_scan_sorted, 0, totals);
}

static int same_plan(const struct gbg_search_plan *a, const struct gbg_search_plan *b)
{
    return a->method == b->method && a->radius == b->radius && a->skin == b->skin &&
           a->edge == b->edge;
}

static int mark(struct gbg_device *device, struct gbg_search *search, int which)
{
    return gbg_cuda_status(device, cudaEventRecord(search->event[which], device->stream),
                           "an event");
}

static int time_between(struct gbg_device *device, struct gbg_search *search, double *seconds)
{
    float ms = 0.0f;
    int status = gbg_cuda_status(
        device, cudaEventElapsedTime(&ms, search->event[0], search->event[1]), "an event");
    *seconds = 1e-3 * ms;
    return status;
}

int gbg_cuda_search_update(struct gbg_device *device, struct gbg_search *search,
                           const struct gbg_search_plan *plan, const struct gbg_points *points,
                           struct gbg_search_report *report)
{
    struct gbg_cuda_totals totals = {};
    *report = {};
    report->searched = 1;
    report->crowded = {-1, -1, 0.0};
    if (!same_plan(&search->frame.plan, plan) || search->frame.n != points->n) {
        search->has_list = 0;
    }
    search->has_result = search->has_pairs = search->base = 0;
    search->batch_begin = search->batch_end = 0;
    search->frame.plan = *plan;
    search->frame.n = points->n;
    int status = use(device);
    status = status ? status : reserve(device, search, points->n);
    status = status ? status : gbg_cuda_search_encode(device, search, points);
    status = status ? status : mark(device, search, 0);
    if (status == GBG_OK && plan->skin > 0.0) {
        status = update_list(device, search, &report->searched, &totals);
    } else if (status == GBG_OK) {
        status = search_anew(device, search, &report->crowded, &totals);
    }
    status = status ? status : mark(device, search, 1);
    if (status == GBG_OK) { /* whatever went wrong on the device belongs to this call */
        status = gbg_cuda_status(device, cudaStreamSynchronize(device->stream), "neighbour search");
    } else {
        cudaStreamSynchronize(device->stream); /* the caller's arrays are the caller's again */
        cudaGetLastError();
    }
    if (status != GBG_OK || report->crowded.first >= 0) {
        return status;
    }
    status = time_between(device, search, &report->device_seconds);
    report->rows = search->out.total;
    report->candidates = (int64_t)totals.looked;
    gbg_search_frame_report(&search->frame, report);
    search->has_result = 1;
    return status;
}
