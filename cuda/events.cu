/* L1, CUDA: the contact rule event: everybody moves straight from the coordinates before the step
 * to those now, and pairs that meet on the way collide elastically.
 *
 * Steps that the device does not work on to their end (paths that leave the range of the list,
 * clusters that outgrow a queue) are done by the CPU's rule on the host: where everybody goes
 * follows from the free paths alone, so the bits are the same. */
#include "cuda/events.h"

#include "cuda/kernels.h"

enum { AT_ONCE = 3, MOST_WAIT = 32, MOST_TRIES = 8 };

static const char what[] = "collisions of a step";

/* Arrays whose length follows from what happens in a step, with room for `count` elements. */
static int grow(struct gbg_device *device, void *pointer, int32_t *capacity, int64_t count,
                size_t size)
{
    int64_t held = *capacity;
    void *array;
    memcpy(&array, pointer, sizeof array);
    int status = count > INT32_MAX ? gbg_fail(device->context, GBG_E_MEMORY,
                                              "%s: more than 2^31 would have to be kept", what)
                                   : gbg_cuda_grow(device, &array, &held, count, size, what);
    memcpy(pointer, &array, sizeof array);
    *capacity = (int32_t)held;
    return status;
}

/* Room for what was counted, and half as much again. */
static int64_t enough(int64_t counted, int64_t held)
{
    return counted > held ? counted + counted / 2 + 1024 : held;
}

static int reserve_counted(struct gbg_device *device, struct gbg_cuda_events *work,
                           const struct gbg_cuda_events_report *counted)
{
    struct gbg_cuda_events_arrays *arrays = &work->arrays;
    int32_t events = arrays->events, todos = arrays->events, conflicts = 0;
    for (int pass = 1; pass <= GBG_CUDA_PASSES; pass++) {
        conflicts = counted->conflicts[pass] > conflicts ? counted->conflicts[pass] : conflicts;
    }
    int64_t wanted = enough(counted->events, arrays->events);
    int status = grow(device, &arrays->candidate, &arrays->candidates,
                      enough(counted->candidates, arrays->candidates), sizeof *arrays->candidate);
    status = status ? status : grow(device, &arrays->todo, &todos, wanted, sizeof *arrays->todo);
    status = status ? status : grow(device, &arrays->next, &events, wanted, sizeof *arrays->next);
    status = status ? status
                    : grow(device, &arrays->event, &arrays->events, wanted, sizeof *arrays->event);
    status = status ? status
                    : grow(device, &arrays->member, &arrays->members,
                           enough(counted->members, arrays->members), sizeof *arrays->member);
    status = status ? status
                    : grow(device, &arrays->leg, &arrays->legs, enough(counted->legs, arrays->legs),
                           sizeof *arrays->leg);
    return status ? status
                  : grow(device, &arrays->conflict, &arrays->conflicts,
                         enough(conflicts, arrays->conflicts), sizeof *arrays->conflict);
}

static int fill(struct gbg_device *device, const struct gbg_list *list,
                struct gbg_cuda_events *work)
{
    struct gbg_cuda_events_arrays *arrays = &work->arrays;
    int64_t n = list->rows.n, words = list->rows.dimension == 2 ? n : 2 * n;
    int32_t **of_particles[] = {&arrays->parent, &arrays->head, &arrays->due, &arrays->claim,
                                &arrays->member_of};
    struct gbg_cuda_events_report share = {};
    int status = gbg_cuda_allocate(device, (void **)&arrays->path, words, sizeof(uint4), what);
    for (int k = 0; k < 5 && status == GBG_OK; k++) {
        status = gbg_cuda_allocate(device, (void **)of_particles[k], n, sizeof(int32_t), what);
    }
    status = status ? status
                    : gbg_cuda_allocate(device, (void **)&arrays->slab,
                                        (int64_t)GBG_CUDA_EVENTS_SLAB * GBG_CUDA_EVENTS_SLABS,
                                        sizeof *arrays->slab, what);
    arrays->slabs = GBG_CUDA_EVENTS_SLABS;
    status = status ? status
                    : gbg_cuda_allocate(device, (void **)&arrays->report, 1, sizeof *arrays->report,
                                        what);
    /* room for steps of 0.03 of contact */
    share.candidates = (int32_t)(n / 2);
    share.events = share.members = (int32_t)(n / 6) + 1;
    share.candidates += 1;
    share.legs = (int32_t)(n / 3) + 1;
    share.conflicts[1] = (int32_t)(n / 16) + 1;
    return status ? status : reserve_counted(device, work, &share);
}

/* Work arrays, at the first call for a list. */
static int reserve(struct gbg_device *device, struct gbg_list *list)
{
    if (list->events) {
        return GBG_OK;
    }
    void *made;
    int status = gbg_allocate_zero(device->context, &made, 1, sizeof(struct gbg_cuda_events), what);
    if (status == GBG_OK) {
        list->events = (struct gbg_cuda_events *)made;
        list->events->n = list->rows.n;
        list->events->fresh = 1;
        status = fill(device, list, list->events);
        if (status != GBG_OK) {
            gbg_cuda_events_release(device, list);
        }
    }
    return status;
}

void gbg_cuda_events_release(struct gbg_device *device, struct gbg_list *list)
{
    struct gbg_cuda_events *work = list->events;
    if (!work) {
        return;
    }
    struct gbg_cuda_events_arrays *arrays = &work->arrays;
    int64_t words = list->rows.dimension == 2 ? work->n : 2 * work->n;
    gbg_cuda_release(device, arrays->path, words, sizeof *arrays->path);
    int32_t *of_particles[] = {arrays->parent, arrays->head, arrays->due, arrays->claim,
                               arrays->member_of};
    for (int k = 0; k < 5; k++) {
        gbg_cuda_release(device, of_particles[k], work->n, sizeof(int32_t));
    }
    gbg_cuda_release(device, arrays->slab, (int64_t)GBG_CUDA_EVENTS_SLAB * GBG_CUDA_EVENTS_SLABS,
                     sizeof *arrays->slab);
    gbg_cuda_release(device, arrays->report, 1, sizeof *arrays->report);
    gbg_cuda_release(device, arrays->candidate, arrays->candidates, sizeof *arrays->candidate);
    gbg_cuda_release(device, arrays->event, arrays->events, sizeof *arrays->event);
    gbg_cuda_release(device, arrays->next, arrays->events, sizeof *arrays->next);
    gbg_cuda_release(device, arrays->todo, arrays->events, sizeof *arrays->todo);
    gbg_cuda_release(device, arrays->member, arrays->members, sizeof *arrays->member);
    gbg_cuda_release(device, arrays->leg, arrays->legs, sizeof *arrays->leg);
    gbg_cuda_release(device, arrays->conflict, arrays->conflicts, sizeof *arrays->conflict);
    gbg_cuda_events_host_destroy(work->host);
    cudaFreeHost(work->copy);
    cudaGetLastError();
    gbg_release(work);
    list->events = NULL;
}

static double largest_contact(const struct gbg_state *state)
{
    double largest = 0.0;
    for (int s = 0; s < state->n_species; s++) {
        largest = fmax(largest, state->diameter[s]);
    }
    return largest;
}

static struct gbg_cuda_events_call make_call(const struct gbg_state *state,
                                             const struct gbg_list *list)
{
    struct gbg_cuda_events_call call = {};
    double shortest = 8.0 * list->reach;
    call.state = *state;
    call.rows = list->rows;
    call.arrays = list->events->arrays;
    call.largest = largest_contact(state);
    call.slack = 0.5 * (list->radius - list->reach) * 0.999;
    call.virial_unit = 0x1p-40 * call.largest * call.largest;
    for (int a = 0; a < state->box.dimension; a++) {
        call.unit[a] = list->unit[a];
        call.per_quantum[a] = 1.0 / state->box.quantum[a];
        call.longest = fmax(call.longest, state->box.length[a]);
        shortest = fmin(shortest, state->box.length[a]);
    }
    call.range = 0.49 * shortest;
    return call;
}

static bool is_settled(const struct gbg_cuda_events_report *report, int pass)
{
    for (int p = 1; p <= pass; p++) {
        if (report->conflicts[p] == 0) {
            return true;
        }
    }
    return false;
}

/* The step on the device; most are settled after a few passes, so these are started at once and
 * their outcome is waited for once. */
static int on_device(struct gbg_device *device, const struct gbg_state *state,
                     struct gbg_list *list)
{
    struct gbg_cuda_events *work = list->events;
    struct gbg_cuda_events_report *report = &work->report;
    struct gbg_cuda_events_call call = make_call(state, list);
    int fresh = work->fresh, pass = 0, last = AT_ONCE;
    work->fresh = 1;
    int status = gbg_cuda_events_start(device, &call, fresh);
    do {
        while (status == GBG_OK && pass < last) {
            status = gbg_cuda_events_pass(device, &call, ++pass);
        }
        status = status ? status : gbg_cuda_events_finish(device, &call, pass);
        status =
            status ? status : gbg_cuda_fetch(device, report, call.arrays.report, sizeof *report);
        last++;
    } while (status == GBG_OK && !report->failed && !is_settled(report, pass) &&
             pass < GBG_CUDA_PASSES);
    if (status == GBG_OK) {
        work->fresh = (report->failed & GBG_CUDA_FULL) != 0;
        for (int p = 1; p <= pass; p++) {
            work->passes += report->todo[p] > 0;
        }
    }
    return status;
}

/* The same, again with longer arrays until they suffice. */
static int try_device(struct gbg_device *device, const struct gbg_state *state,
                      struct gbg_list *list)
{
    struct gbg_cuda_events *work = list->events;
    int status = on_device(device, state, list);
    for (int tries = 1; status == GBG_OK && work->report.failed == GBG_CUDA_FULL; tries++) {
        if (tries == MOST_TRIES) {
            break;
        }
        status = reserve_counted(device, work, &work->report);
        status = status ? status : on_device(device, state, list);
    }
    return status;
}

/* Where the arrays of the state stand in its copy on the host. */
struct copies {
    void *host[24];
    const void *device[24];
    size_t bytes[24];
    int written[24]; /* 1: the rule changes it */
    int count;
};

static void add(struct copies *copies, size_t *used, char *base, const void *from, int64_t count,
                size_t size, int written, void *to)
{
    void *at = NULL;
    if (from) {
        int k = copies->count++;
        at = base ? base + *used : NULL;
        copies->host[k] = at;
        copies->device[k] = from;
        copies->bytes[k] = (size_t)count * size;
        copies->written[k] = written;
        *used += ((size_t)count * size + 2 * GBG_ALIGNMENT - 1) / GBG_ALIGNMENT * GBG_ALIGNMENT;
    }
    memcpy(to, &at, sizeof at);
}

/* A state whose arrays lie in host memory from `base` on (NULL: only counts); the bytes needed. */
static size_t lay_out(const struct gbg_state *state, char *base, struct gbg_state *copy,
                      struct copies *copies)
{
    int64_t n = state->owned + state->ghost;
    size_t used = 0;
    copies->count = 0;
    *copy = *state;
    for (int a = 0; a < 3; a++) {
        copy->force[a] = NULL;
        copy->start_image[a] = NULL;
        add(copies, &used, base, state->high[a], n, 4, 1, &copy->high[a]);
        add(copies, &used, base, state->low[a], n, 4, 1, &copy->low[a]);
        add(copies, &used, base, state->image[a], state->owned, 4, 1, &copy->image[a]);
        add(copies, &used, base, state->start_high[a], state->owned, 4, 0, &copy->start_high[a]);
        add(copies, &used, base, state->start_low[a], state->owned, 4, 0, &copy->start_low[a]);
    }
    add(copies, &used, base, state->id, n, 8, 0, &copy->id);
    add(copies, &used, base, state->rank, n, 4, 0, &copy->rank);
    add(copies, &used, base, state->species, n, 1, 0, &copy->species);
    add(copies, &used, base, state->overlapped, state->owned, 1, 1, &copy->overlapped);
    add(copies, &used, base, state->own_diameter, n, 8, 0, &copy->own_diameter);
    copy->source = NULL;
    copy->own_alpha = NULL;
    return used;
}

/* The state on the host; there is a device for the rule there afterwards. */
static int download(struct gbg_device *device, const struct gbg_state *state,
                    struct gbg_cuda_events *work, struct gbg_state *copy, struct copies *copies)
{
    size_t bytes = lay_out(state, NULL, copy, copies);
    int status = work->host ? GBG_OK : gbg_cuda_events_host_create(device->context, &work->host);
    if (status == GBG_OK && bytes > work->copy_bytes) {
        cudaFreeHost(work->copy);
        work->copy = NULL;
        work->copy_bytes = 0;
        status = gbg_cuda_status(device, cudaMallocHost(&work->copy, bytes),
                                 "pinned memory for collisions on the host");
        work->copy_bytes = status == GBG_OK ? bytes : 0;
    }
    if (status != GBG_OK) {
        return status;
    }
    lay_out(state, (char *)work->copy, copy, copies);
    for (int k = 0; status == GBG_OK && k < copies->count; k++) {
        status =
            gbg_cuda_status(device,
                            cudaMemcpyAsync(copies->host[k], copies->device[k], copies->bytes[k],
                                            cudaMemcpyDeviceToHost, device->stream),
                            "copying to the host");
    }
    cudaError_t error = cudaStreamSynchronize(device->stream);
    return status ? status : gbg_cuda_status(device, error, "waiting for the device");
}

int gbg_cuda_events_download(struct gbg_device *device, const struct gbg_state *state,
                             struct gbg_cuda_events *work, struct gbg_state *copy)
{
    struct copies copies;
    return download(device, state, work, copy, &copies);
}

static int upload(struct gbg_device *device, const struct copies *copies)
{
    int status = GBG_OK;
    for (int k = 0; status == GBG_OK && k < copies->count; k++) {
        if (copies->written[k]) {
            status = gbg_cuda_status(device,
                                     cudaMemcpyAsync((void *)copies->device[k], copies->host[k],
                                                     copies->bytes[k], cudaMemcpyHostToDevice,
                                                     device->stream),
                                     "copying to the device");
        }
    }
    return status;
}

/* The step on the host. Rounds that follow need a list that is complete where everybody is now. */
static int on_host(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                   struct gbg_contacts *contacts)
{
    struct gbg_cuda_events *work = list->events;
    struct gbg_state copy;
    struct copies copies;
    work->host_steps++;
    int status = download(device, state, work, &copy, &copies);
    status = status
                 ? status
                 : gbg_cuda_events_host_run(work->host, &copy, list->reach, list->radius, contacts);
    status = status ? status : upload(device, &copies);
    work->on_host = status == GBG_OK;
    return status ? status : gbg_cuda_list_build(device, state, list);
}

/* Crowded scenes have large clusters in every step: then the device is not asked every time. */
static void plan_next(struct gbg_cuda_events *work, int done)
{
    work->skip = done ? 0 : work->skip == 0 ? 1 : 2 * work->skip;
    work->skip = work->skip > MOST_WAIT ? MOST_WAIT : work->skip;
    work->wait = work->skip;
}

int gbg_cuda_events(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                    struct gbg_contacts *contacts)
{
    contacts->rounds = contacts->pairs = contacts->left = contacts->stopped = 0;
    contacts->largest = contacts->virial = 0.0;
    if (list->rows.n == 0) {
        return GBG_OK;
    }
    int status = reserve(device, list);
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_cuda_events *work = list->events;
    work->steps++;
    work->on_host = 0;
    work->report.done = 0;
    if (work->wait > 0) {
        work->wait--;
        return on_host(device, state, list, contacts);
    }
    status = try_device(device, state, list);
    if (status != GBG_OK) {
        return status;
    }
    const struct gbg_cuda_events_report *report = &work->report;
    if (!(report->failed & GBG_CUDA_NARROW)) {
        plan_next(work, (int)report->done);
    }
    if (!report->done) {
        return on_host(device, state, list, contacts);
    }
    double largest;
    memcpy(&largest, &report->largest, sizeof largest);
    contacts->pairs = (int64_t)(report->events_had / 2);
    contacts->rounds = report->depth;
    contacts->stopped = (int64_t)report->stopped;
    contacts->largest = sqrt(largest);
    contacts->virial = (double)(int64_t)report->virial *
                       (0x1p-40 * largest_contact(state) * largest_contact(state));
    return GBG_OK;
}
