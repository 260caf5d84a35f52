/* L1, CUDA: many steps without the host: a batch is recorded once as a graph of kernels. Whatever
 * needs more (a new list, a second correction, a bad move) stops the batch with the state of before
 * the step, and the engine makes that step kernel by kernel: so a batch changes no bit. */
#include "cuda/kernels.h"
#include "cuda/steps_kernels.h"

struct gbg_cuda_steps {
    struct gbg_cuda_control *control;
    struct gbg_cuda_control result; /* on the host */
    struct work work;               /* of the recorded batch */
    struct gbg_batch batch;         /* the same: forces */
    cudaGraphExec_t graph;
    int recorded;
    int64_t capacity; /* particles that the arrays of rounds are for */
    void *memory;
};

static unsigned few_blocks(const struct gbg_device *device, int64_t n)
{
    int64_t blocks = (n + THREADS - 1) / THREADS, most = 8 * (int64_t)device->multiprocessors;
    return (unsigned)(blocks < 1 ? 1 : blocks < most ? blocks : most);
}

/* Blocks of a kernel whose blocks wait for each other: all must be at work at once. */
static int cooperative_blocks(struct gbg_device *device, const void *kernel, int64_t n,
                              unsigned *blocks)
{
    int each = 0;
    int status = gbg_cuda_status(
        device, cudaOccupancyMaxActiveBlocksPerMultiprocessor(&each, kernel, THREADS, 0),
        "asking for room for contact rounds");
    int64_t most = (int64_t)each * device->multiprocessors, wanted = (n + THREADS - 1) / THREADS;
    *blocks = (unsigned)(wanted < 1 ? 1 : wanted < most ? wanted : most);
    return status;
}

template <int dimension>
static int start_part(struct gbg_device *device, struct work *work, int step)
{
    const void *kernel = (const void *)part<dimension>;
    unsigned blocks;
    void *arguments[] = {work, &step};
    int status = cooperative_blocks(device, kernel, work->contacts.n, &blocks);
    return status ? status
                  : gbg_cuda_status(device,
                                    cudaLaunchCooperativeKernel(kernel, dim3(blocks), dim3(THREADS),
                                                                arguments, 0, device->stream),
                                    "contact rounds");
}

static int start_forces(struct gbg_device *device, struct gbg_state *state,
                        const struct gbg_batch *batch)
{
    int status = GBG_OK;
    for (int f = 0; f < batch->n_forces && status == GBG_OK; f++) {
        status = (batch->use_double ? gbg_cuda_cutoff_double : gbg_cuda_cutoff_mixed)(
            device, state, batch->pairs, batch->power[f], batch->cutoff[f], f > 0);
    }
    return status;
}

template <int dimension>
static int start_step(struct gbg_device *device, struct gbg_cuda_steps *steps, int step)
{
    struct work *work = &steps->work;
    unsigned blocks = few_blocks(device, work->state.owned);
    cudaStream_t stream = device->stream;
    begin_step<dimension><<<blocks, THREADS, 0, stream>>>(*work, step);
    int status = start_forces(device, &work->state, &steps->batch);
    if (status != GBG_OK || work->contacts.n == 0) {
        move<dimension, false><<<blocks, THREADS, 0, stream>>>(*work, step);
        return status ? status : gbg_cuda_started(device, "a step");
    }
    move<dimension, true><<<blocks, THREADS, 0, stream>>>(*work, step);
    status = start_part<dimension>(device, work, step);
    certify<dimension><<<blocks, THREADS, 0, stream>>>(*work, step);
    take_back<dimension><<<blocks, THREADS, 0, stream>>>(*work, step);
    return status ? status : gbg_cuda_started(device, "a step with hard cores");
}

/* Records the kernels of a batch of steps as a graph. */
static int record(struct gbg_device *device, struct gbg_cuda_steps *steps)
{
    cudaGraph_t graph = NULL;
    if (steps->graph) {
        cudaGraphExecDestroy(steps->graph);
        steps->graph = NULL;
    }
    int status = gbg_cuda_status(
        device, cudaStreamBeginCapture(device->stream, cudaStreamCaptureModeThreadLocal),
        "recording steps");
    if (status != GBG_OK) {
        return status;
    }
    device->halt = &steps->control->halt;
    for (int k = 0; k < GBG_CUDA_BATCH && status == GBG_OK; k++) {
        status = steps->work.state.box.dimension == 2 ? start_step<2>(device, steps, k)
                                                      : start_step<3>(device, steps, k);
    }
    device->halt = NULL;
    cudaError_t ended = cudaStreamEndCapture(device->stream, &graph);
    status = status ? status : gbg_cuda_status(device, ended, "recording steps");
    if (status == GBG_OK) {
        status = gbg_cuda_status(device, cudaGraphInstantiate(&steps->graph, graph, 0),
                                 "making a graph of steps");
    }
    if (graph) {
        cudaGraphDestroy(graph);
    }
    return status;
}

/* What the kernels need; everything that is not set is zero, so that two may be compared as bytes.
 */
static void describe(const struct gbg_cuda_steps *steps, const struct gbg_state *state,
                     const struct gbg_batch *batch, struct work *work)
{
    memset(work, 0, sizeof *work);
    work->state = *state;
    work->control = steps->control;
    work->euler.noise = *batch->noise;
    work->euler.dt = batch->dt;
    work->euler.sign = 1;
    if (batch->pairs) {
        work->pairs = batch->pairs->rows;
        work->slack[PAIRS] = 0.5 * (batch->pairs->radius - batch->pairs->reach) * 0.999;
    }
    if (!batch->contacts) {
        return;
    }
    const struct gbg_list *list = batch->contacts;
    struct gbg_push_rule rule = gbg_push_rule_make(state, &batch->rule);
    work->contacts = list->rows;
    work->slack[CONTACTS] = 0.5 * (list->radius - list->reach) * 0.999;
    work->certificate_slack = 0.5 * (list->radius - list->reach);
    for (int s = 0; s < state->n_species; s++) {
        for (int t = 0; t < state->n_species; t++) {
            work->rule.contact[s][t] = rule.contact[s][t];
        }
    }
    work->rule.least = rule.least;
    work->rule.largest = rule.largest;
    work->rule.cap = rule.cap;
    work->rule.virial_unit = rule.virial_unit;
    work->rule.parting = rule.parting;
    work->limit = gbg_push_limit(&rule);
    work->max_rounds = batch->rule.max_rounds;
    gbg_exact_make(state, batch->certified, &work->exact);
    for (int a = 0; a < state->box.dimension; a++) {
        work->error += state->box.length[a] * 0x1p-31;
    }
    char *memory = (char *)steps->memory;
    size_t n = (size_t)steps->capacity;
    work->mark = (unsigned int *)memory;
    work->candidate[0] = (int32_t *)(memory + 4 * n);
    work->candidate[1] = (int32_t *)(memory + 8 * n);
    work->mover = (int32_t *)(memory + 12 * n);
    for (int a = 0; a < state->box.dimension; a++) {
        work->push[a] = (int64_t *)(memory + 16 * n) + (size_t)a * n;
    }
}

static int same_forces(const struct gbg_batch *p, const struct gbg_batch *q)
{
    int same = p->n_forces == q->n_forces && p->use_double == q->use_double;
    for (int f = 0; same && f < p->n_forces; f++) {
        same = p->power[f] == q->power[f] && p->cutoff[f] == q->cutoff[f];
    }
    return same && p->pairs == q->pairs && p->contacts == q->contacts;
}

static int reserve(struct gbg_device *device, const struct gbg_state *state,
                   const struct gbg_batch *batch)
{
    struct gbg_cuda_steps *steps = device->steps;
    int status = GBG_OK;
    if (!steps) {
        void *made;
        status = gbg_allocate_zero(device->context, &made, 1, sizeof *steps, "batches of steps");
        steps = device->steps = status ? NULL : (struct gbg_cuda_steps *)made;
    }
    if (status == GBG_OK && !steps->control) {
        void *control;
        status = gbg_cuda_allocate(device, &control, 1, sizeof *steps->control, "batches of steps");
        if (status == GBG_OK) {
            steps->control = (struct gbg_cuda_control *)control;
            status = gbg_cuda_clear(device, control, sizeof *steps->control);
        }
    }
    int64_t n = batch->contacts ? (state->owned + 63) / 64 * 64 : 0;
    if (status == GBG_OK && (n > steps->capacity || steps->result.mark > 0x80000000u)) {
        size_t each = 16 + 8 * (size_t)state->box.dimension;
        status = gbg_cuda_grow(device, &steps->memory, &steps->capacity, n, each,
                               "contact rounds of batches");
        if (status == GBG_OK) { /* no marks */
            status = gbg_cuda_clear(device, steps->memory, 4 * (size_t)steps->capacity);
        }
        if (status == GBG_OK) {
            status = gbg_cuda_clear(device, &steps->control->mark, sizeof steps->control->mark);
        }
        steps->recorded = 0;
    }
    return status;
}

void gbg_cuda_steps_release(struct gbg_device *device)
{
    struct gbg_cuda_steps *steps = device->steps;
    if (steps) {
        if (steps->graph) {
            cudaGraphExecDestroy(steps->graph);
        }
        gbg_cuda_release(device, steps->control, 1, sizeof *steps->control);
        gbg_cuda_release(device, steps->memory, 0, 1);
        cudaGetLastError();
        gbg_release(steps);
        device->steps = NULL;
    }
}

/* Adds what the steps of one start of the graph did. */
static void take(const struct gbg_cuda_control *control, double virial_unit,
                 struct gbg_batch *batch)
{
    for (int k = 0; k < control->done; k++) {
        const struct gbg_cuda_slot *slot = &control->slot[k];
        batch->rule.rounds += slot->rounds;
        batch->rule.pairs += (int64_t)slot->pairs;
        batch->rule.virial += (double)(int64_t)slot->virial * virial_unit;
        batch->moves.drift = gbg_cuda_root(slot->moves.drift);
        batch->moves.noise = gbg_cuda_root(slot->moves.noise);
        batch->moves.total = gbg_cuda_root(slot->moves.total);
        batch->moves.bad = -1;
        batch->moved = fmax(batch->moves.total, gbg_cuda_root(slot->farthest));
    }
    batch->done += control->done;
    batch->spoiled = control->spoiled;
}

int gbg_cuda_steps(struct gbg_device *device, struct gbg_state *state, struct gbg_batch *batch)
{
    struct work described;
    batch->done = batch->spoiled = 0;
    int unlisted = (batch->pairs && batch->pairs->epoch != state->epoch) ||
                   (batch->contacts && batch->contacts->epoch != state->epoch);
    if (state->owned == 0 || unlisted) {
        return GBG_OK; /* lists are first to be built */
    }
    int status = reserve(device, state, batch);
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_cuda_steps *steps = device->steps;
    describe(steps, state, batch, &described);
    if (!steps->recorded || memcmp(&described, &steps->work, sizeof described) != 0 ||
        !same_forces(batch, &steps->batch)) {
        steps->work = described;
        steps->batch = *batch;
        status = record(device, steps);
        steps->recorded = status == GBG_OK;
    }
    while (status == GBG_OK && batch->done < batch->steps) {
        int64_t left = batch->steps - batch->done;
        int limit = left < GBG_CUDA_BATCH ? (int)left : GBG_CUDA_BATCH;
        start<<<1, THREADS, 0, device->stream>>>(
            steps->control, limit, batch->first + (uint64_t)batch->done, batch->moved);
        status = gbg_cuda_status(device, cudaGraphLaunch(steps->graph, device->stream), "steps");
        if (status == GBG_OK) {
            status = gbg_cuda_fetch(device, &steps->result, steps->control, sizeof steps->result);
        }
        if (status == GBG_OK) {
            take(&steps->result, steps->work.rule.virial_unit, batch);
            if (steps->result.done < limit) {
                break;
            }
        }
    }
    return status;
}
