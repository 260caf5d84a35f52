/* L1, CUDA: many steps without the host. What a batch cannot do itself (a second correction, a bad
 * move, a move longer than the skin of the lists) stops it with the state of before the step, and
 * the engine makes that step kernel by kernel: so a batch changes no bit. */
#include "cuda/steps.h"

#include <stdio.h>

#include "cuda/bridge.h"
#include "cuda/kernels.h"
#include "cuda/unlisted.h"

/* Particles up to which all steps are one kernel; steps that are started one by one; lists built
 * before the engine may look whether the order in memory is still good. */
enum { TOGETHER = 1 << 16, SINGLES = 32, BUILDS = 8 };

struct gbg_cuda_steps {
    struct gbg_cuda_control *control;
    struct gbg_cuda_control result; /* on the host */
    double pace; /* displacement a step, to foresee when lists are to be built; 0: not known */
    int64_t place_capacity; /* in words */
    void *places;
};

/* Where a call has got to. */
struct progress {
    int law, turn, renew, builds;
};

static int choose_law(const struct gbg_batch *batch)
{
    if (batch->n_forces == 0) {
        return GBG_CUDA_FREE;
    }
    double power = batch->power[0];
    return batch->n_forces > 1 || batch->use_double || (power != 2.0 && power != 6.0)
               ? GBG_CUDA_STORED
           : power == 2.0 ? GBG_CUDA_POWER_2
                          : GBG_CUDA_POWER_6;
}

static int has_places(int law)
{
    return law == GBG_CUDA_POWER_2 || law == GBG_CUDA_POWER_6;
}

static int64_t place_words(const struct gbg_state *state)
{
    return state->box.dimension == 2 && !state->source ? 2 : 4;
}

static double slack_of(const struct gbg_list *list)
{
    return 0.5 * (list->radius - list->reach) * 0.999;
}

static void describe_force(const struct gbg_state *state, const struct gbg_batch *batch, int law,
                           void *places, struct gbg_cuda_work *work)
{
    work->pairs = batch->pairs->rows;
    work->slack = fmin(work->slack, slack_of(batch->pairs));
    if (has_places(law)) {
        work->unit =
            gbg_cutoff_unit_make(state->box.dimension, batch->pairs->unit, batch->cutoff[0]);
        work->factor = pow(work->unit.unit, -batch->power[0]);
        work->place[0] = places;
        work->place[1] = (uint32_t *)places + place_words(state) * state->owned;
    }
}

static float squared_limit(double contact, double error)
{
    return (float)((contact + error) * (contact + error) * (1.0 + 1e-5));
}

static void describe_cores(const struct gbg_state *state, const struct gbg_batch *batch,
                           struct gbg_cuda_work *work)
{
    const struct gbg_list *list = batch->contacts;
    struct gbg_push_rule rule = gbg_push_rule_make(state, &batch->rule);
    struct gbg_cuda_sieve sieve = {{}, {}, squared_limit(rule.largest, work->error)};
    for (int a = 0; a < state->box.dimension; a++) {
        sieve.coordinate[a] = state->high[a];
        sieve.scale[a] = work->unit_high[a];
    }
    work->contacts = list->rows;
    work->slack = fmin(work->slack, slack_of(list));
    work->certificate_slack = 0.5 * (list->radius - list->reach);
    work->rounds = gbg_cuda_rounds_make(list, &rule, &sieve);
    work->max_rounds = batch->rule.max_rounds;
    work->bridge = batch->bridge;
    gbg_exact_make(state, batch->certified, &work->exact);
    work->close = squared_limit(work->exact.largest, work->error);
}

static void describe(const struct gbg_cuda_steps *steps, const struct gbg_state *state,
                     const struct gbg_batch *batch, int law, struct gbg_cuda_work *work)
{
    memset(work, 0, sizeof *work);
    work->state = *state;
    work->control = steps->control;
    work->euler = gbg_cuda_euler_make(&state->box, batch->noise, batch->dt, 1);
    work->slack = INFINITY;
    for (int a = 0; a < state->box.dimension; a++) {
        work->unit_high[a] = (float)(state->box.length[a] * 0x1p-32);
        work->error += state->box.length[a] * 0x1p-31;
    }
    if (batch->pairs) {
        describe_force(state, batch, law, steps->places, work);
    }
    if (batch->contacts) {
        describe_cores(state, batch, work);
    }
}

static int reserve_control(struct gbg_device *device)
{
    void *made;
    int status = GBG_OK;
    if (!device->steps) {
        status =
            gbg_allocate_zero(device->context, &made, 1, sizeof *device->steps, "batches of steps");
        device->steps = status ? NULL : (struct gbg_cuda_steps *)made;
    }
    struct gbg_cuda_steps *steps = device->steps;
    if (status == GBG_OK && !steps->control) {
        status = gbg_cuda_allocate(device, &made, 1, sizeof *steps->control, "batches of steps");
        if (status == GBG_OK) {
            steps->control = (struct gbg_cuda_control *)made;
            status = gbg_cuda_clear(device, made, sizeof *steps->control);
        }
    }
    return status;
}

static int reserve(struct gbg_device *device, const struct gbg_state *state,
                   const struct gbg_batch *batch, int law)
{
    int status = reserve_control(device);
    struct gbg_cuda_steps *steps = device->steps;
    if (status == GBG_OK && has_places(law)) {
        int64_t words = place_words(state) * state->owned * (batch->contacts ? 1 : 2);
        status = words <= steps->place_capacity
                     ? GBG_OK
                     : gbg_cuda_grow(device, &steps->places, &steps->place_capacity, words, 4,
                                     "places of batches");
    }
    if (status == GBG_OK && batch->contacts) {
        status = gbg_cuda_contacts_reserve(device, batch->contacts);
    }
    if (status == GBG_OK && batch->contacts && batch->bridge) {
        status = gbg_cuda_bridge_reserve(device, state, batch->contacts, &batch->rule);
    }
    return status;
}

double gbg_cuda_steps_bytes(const struct gbg_device *device)
{
    const struct gbg_cuda_steps *steps = device->steps;
    return steps ? 4.0 * (double)steps->place_capacity + (double)sizeof *steps->control : 0.0;
}

void gbg_cuda_steps_release(struct gbg_device *device)
{
    struct gbg_cuda_steps *steps = device->steps;
    if (steps) {
        gbg_cuda_release(device, steps->control, 1, sizeof *steps->control);
        gbg_cuda_release(device, steps->places, 0, 1);
        gbg_release(steps);
        device->steps = NULL;
    }
}

/* Adds what the steps of one start did. */
static void take(const struct gbg_cuda_control *control, const struct gbg_cuda_work *work,
                 struct gbg_batch *batch)
{
    double contact = work->rounds.rule.largest;

    for (int k = 0; k < control->done; k++) {
        const struct gbg_cuda_slot *slot = &control->slot[k];
        batch->rule.rounds += slot->bridge_sweeps + slot->rounds;
        batch->rule.pairs += (int64_t)(slot->bridge_pairs + slot->pairs);
        /* in the order of the rule itself, which rounds so */
        batch->rule.virial += (double)(int64_t)slot->bridge_virial * 0x1p-40 * contact * contact;
        batch->rule.virial += (double)(int64_t)slot->virial * work->rounds.rule.virial_unit;
        batch->moves.drift = gbg_cuda_root(slot->moves.drift);
        batch->moves.noise = gbg_cuda_root(slot->moves.noise);
        batch->moves.total = gbg_cuda_root(slot->moves.total);
        batch->moves.bad = -1;
        double corrected = gbg_cuda_root(slot->farthest) * (1.0 + 1e-6) + work->error;
        batch->moved =
            fmax(batch->moves.total, fmax(gbg_cuda_root(slot->bridge_farthest), corrected));
    }
    batch->done += control->done;
}

/* Both lists as they would be built here and now; or the batch's only one. */
static int lists_are_good(const struct gbg_state *state, const struct gbg_batch *batch)
{
    const struct gbg_list *p = batch->pairs, *q = batch->contacts;
    return (!p || (p->builds > 0 && p->epoch == state->epoch)) &&
           (!q || (q->builds > 0 && q->epoch == state->epoch)) &&
           (!p || !q || p->moment == q->moment);
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

static int start_bridge(struct gbg_device *device, struct gbg_state *state,
                        const struct gbg_batch *batch, const struct gbg_cuda_work *work, int step)
{
    struct bridge_results *results;
    int64_t capacity;
    uint64_t number = batch->first + (uint64_t)(batch->done + step);
    int status = gbg_cuda_bridge_start(device, state, batch->contacts, &batch->rule, number,
                                       &work->control->halt, &results, &capacity);
    return status || !results ? status
                              : gbg_cuda_steps_bridged(device, work, results, capacity, step);
}

static int start_single(struct gbg_device *device, struct gbg_state *state,
                        const struct gbg_batch *batch, const struct gbg_cuda_work *work, int law,
                        int step)
{
    int status = GBG_OK;
    if (law == GBG_CUDA_STORED) {
        status = gbg_cuda_steps_follow(device, work);
        status = status ? status : start_forces(device, state, batch);
    }
    status = status ? status : gbg_cuda_steps_move(device, work, law, step);
    if (status == GBG_OK && batch->bridge) {
        status = start_bridge(device, state, batch, work, step);
    }
    return status || !batch->contacts ? status : gbg_cuda_steps_part(device, work, step);
}

static int start_singles(struct gbg_device *device, struct gbg_state *state,
                         const struct gbg_batch *batch, const struct gbg_cuda_work *work, int law,
                         int steps)
{
    int status = GBG_OK;
    device->halt = &work->control->halt;
    for (int k = 0; k < steps && status == GBG_OK; k++) {
        status = start_single(device, state, batch, work, law, k);
    }
    device->halt = NULL;
    if (status == GBG_E_MEMORY) { /* the driver wanted some: a part of a step may have been made */
        snprintf(device->failure, sizeof device->failure,
                 "cuda:%d: no memory to start a kernel in the middle of a step", device->number);
        status = gbg_cuda_started(device, "a batch of steps");
    }
    return status;
}

/* Steps to be started: together any number will do; kernels of steps behind one that stops the
 * batch are started in vain. */
static int choose_limit(const struct progress *at, const struct gbg_cuda_steps *steps,
                        const struct gbg_cuda_work *work, int64_t left, int together)
{
    int64_t most = together ? (int)GBG_CUDA_BATCH : (int)SINGLES;
    if (!together && steps->pace > 0.0 && work->slack < INFINITY) {
        double room = work->slack - (at->builds > 0 && at->renew ? 0.0 : steps->result.displaced);
        double foreseen = room / steps->pace;
        most = foreseen < 4.0 ? 4 : foreseen < (double)most ? (int64_t)foreseen : most;
    }
    return (int)(left < most ? left : most);
}

/* Starts up to a batch of steps and waits for them. */
static int go_on(struct gbg_device *device, struct gbg_state *state, struct gbg_batch *batch,
                 struct progress *at, int *limit)
{
    struct gbg_cuda_steps *steps = device->steps;
    struct gbg_cuda_control *result = &steps->result;
    struct gbg_cuda_work work;
    describe(steps, state, batch, at->law, &work);
    int together = state->owned <= TOGETHER && at->law != GBG_CUDA_STORED && !batch->bridge;
    double before = at->renew && at->builds > 0 ? 0.0 : result->displaced;
    *limit = choose_limit(at, steps, &work, batch->steps - batch->done, together);
    int status =
        gbg_cuda_steps_begin(device, &work, *limit, at->turn, batch->first + (uint64_t)batch->done,
                             at->renew && (batch->pairs || batch->contacts));
    if (status == GBG_OK) {
        status = together ? gbg_cuda_steps_together(device, &work, at->law)
                          : start_singles(device, state, batch, &work, at->law, *limit);
    }
    status = status ? status
                    : gbg_cuda_fetch(device, result, steps->control,
                                     offsetof(struct gbg_cuda_control, slot) +
                                         (size_t)*limit * sizeof *result->slot);
    if (status != GBG_OK) {
        return status;
    }
    take(result, &work, batch);
    at->turn = batch->contacts ? 0 : (at->turn + result->done) & 1;
    if (result->done > 0) {
        steps->pace = (result->displaced - before) / result->done;
    }
    at->renew = 0;
    if (result->undo) {
        status = gbg_cuda_steps_take_back(device, &work);
    }
    if (status == GBG_OK && result->spoiled) { /* the engine takes the move back */
        batch->spoiled = 1;
        if (has_places(at->law)) {
            status = gbg_cuda_steps_unpack(device, &work, at->turn);
            status = status ? status : start_forces(device, state, batch);
        }
    }
    return status;
}

int gbg_cuda_steps(struct gbg_device *device, struct gbg_state *state, struct gbg_batch *batch)
{
    struct progress at = {choose_law(batch), 0, 1, 0};
    batch->done = batch->spoiled = batch->more = 0;
    if (batch->pairs && batch->pairs->unlisted) {
        return GBG_OK; /* without rows a batch saves nothing */
    }
    int status = state->owned > 0 ? reserve(device, state, batch, at.law) : GBG_OK;
    int build = !lists_are_good(state, batch), limit = 0;
    while (status == GBG_OK && state->owned > 0 && batch->done < batch->steps) {
        int64_t done = batch->done;
        if (build) {
            if (at.builds == BUILDS) {
                batch->more = 1;
                break;
            }
            status = gbg_cuda_lists_build(device, state, batch->pairs, batch->contacts);
            at.builds++;
            at.turn = 0;
            at.renew = 1;
        }
        status = status ? status : go_on(device, state, batch, &at, &limit);
        if (status == GBG_OK && batch->done - done < limit) {
            /* not if that was a step from new lists: it moves somebody by more than the skin */
            if (!device->steps->result.stale || (build && batch->done == done)) {
                break;
            }
            build = 1;
        } else {
            build = 0;
        }
    }
    /* lists and places of batches may outgrow memory: then the engine goes on without rows */
    return status == GBG_E_MEMORY && batch->pairs
               ? gbg_cuda_list_unlist(device, state, batch->pairs)
               : status;
}
