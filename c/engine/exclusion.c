/* L2: the step that keeps hard cores apart: the rule, rounds for what it leaves, the checks. */
#include <math.h>
#include <stdio.h>

#include "engine/engine.h"
#include "engine/steps.h"

/* Tolerance of the contact distance: far above the rounding of the squared distance (4e-16), below
 * what a caller could mean by touching. */
static const double contact_tolerance = 1e-12;

/* Largest part of contact by which a pair moves one of its discs in a round, and the smaller one
 * for the rare step in which pushes added up to carry a pair through each other. */
static const double cap = 0.25, gentle_cap = 0.02;

typedef int (*gbg_corrector)(struct gbg_device *, struct gbg_state *, struct gbg_list *,
                             struct gbg_contacts *);

/* One kernel, and its work added to the engine's counters. */
static int apply(struct gbg_engine *engine, gbg_corrector kernel, struct gbg_contacts *contacts)
{
    int status = kernel(engine->device, &engine->state, engine->contacts, contacts);
    if (status == GBG_OK) {
        engine->contact_rounds += contacts->rounds;
        engine->contact_pairs += contacts->pairs;
        engine->contact_virial += contacts->virial;
        engine->moved = fmax(engine->moved, contacts->largest);
    }
    return status;
}

static int correct(struct gbg_engine *engine, double largest_push)
{
    const struct gbg_kernels *kernels = engine->kernels;
    int rule = engine->scene.rule;
    struct gbg_contacts contacts = {
        .parting = rule == GBG_RULE_CONTACT  ? GBG_PARTING_CONTACT
                   : rule == GBG_RULE_CARTER ? GBG_PARTING_CARTER
                                             : GBG_PARTING_BOUNCE,
        .max_rounds = engine->scene.max_rounds,
        .tolerance = contact_tolerance,
        .cap = largest_push,
        .noise = &engine->noise,
        .step = engine->step,
    };
    int status =
        kernels->list_update(engine->device, &engine->state, engine->contacts, engine->moved);
    engine->moved = engine->moves.total;
    if (status == GBG_OK && rule == GBG_RULE_EVENT) {
        status = apply(engine, kernels->events, &contacts);
    } else if (status == GBG_OK && rule == GBG_RULE_BRIDGE) {
        status = apply(engine, kernels->bridge, &contacts);
    }
    status = status ? status : apply(engine, kernels->contacts, &contacts);
    if (status != GBG_OK) {
        return status;
    }
    if (contacts.left > 0) {
        char why[128];
        snprintf(why, sizeof why, "%lld pairs still overlap after %lld rounds",
                 (long long)contacts.left, (long long)contacts.rounds);
        return gbg_step_refuse(engine, 0.1 * engine->least_contact, why);
    }
    return GBG_OK;
}

/* A pair that passed through each other, first = -1 if there is none. Two particles at distance >=
 * contact before and after can only have done so if their relative move was longer than sqrt(2)
 * contact: otherwise the straight path stays farther than contact/sqrt(2). So the search is needed
 * only after large moves. */
static int find_passed(struct gbg_engine *engine, double *reach, struct gbg_pair *pair)
{
    double limit = engine->least_contact / sqrt(2.0);
    *pair = (struct gbg_pair){-1, -1, 0.0};
    *reach = engine->contact + 2.0 * engine->moved;
    if (engine->moved <= limit) {
        return GBG_OK;
    }
    for (int a = 0; a < engine->state.box.dimension; a++) {
        if (*reach > 0.5 * engine->state.box.length[a]) {
            return gbg_step_refuse(engine, limit,
                                   "particles moved so far that passing through each other "
                                   "cannot be excluded");
        }
    }
    return engine->kernels->passed(engine->device, &engine->state, *reach, pair);
}

/* The step once more with small pushes; what then still passed through each other is put back. */
static int correct_gently(struct gbg_engine *engine)
{
    struct gbg_pair pair;
    double reach;
    int status = engine->kernels->put_back(engine->device, &engine->state);
    if (status == GBG_OK) {
        status = engine->kernels->integrate(engine->device, &engine->state, &engine->noise,
                                            engine->step, engine->scene.dt, 1, &engine->moves);
    }
    engine->moved = 1e300; /* lists do not know the way back */
    status = status ? status : correct(engine, gentle_cap);
    status = status ? status : find_passed(engine, &reach, &pair);
    if (status == GBG_OK && pair.first >= 0) {
        int64_t reverted;
        status = engine->kernels->roll_back(engine->device, &engine->state, reach,
                                            contact_tolerance, &reverted);
        engine->reverted += status == GBG_OK ? reverted : 0;
    }
    return status;
}

int gbg_step_contacts(struct gbg_engine *engine, const struct gbg_plan_step *step)
{
    (void)step;
    struct gbg_pair pair;
    double reach, limit = engine->least_contact / sqrt(2.0);
    int status = correct(engine, cap);
    status = status ? status : find_passed(engine, &reach, &pair);
    if (status != GBG_OK || pair.first < 0) {
        return status;
    }
    if (engine->moves.total > limit) { /* not pushes: the free moves are too long */
        char why[128];
        snprintf(why, sizeof why, "particles %lld and %lld passed through each other",
                 (long long)gbg_engine_id(engine, pair.first),
                 (long long)gbg_engine_id(engine, pair.second));
        return gbg_step_refuse(engine, limit, why);
    }
    engine->repeated++;
    return correct_gently(engine);
}

int gbg_engine_count_overlaps(struct gbg_engine *engine, int64_t *count)
{
    struct gbg_pair pair;
    *count = 0;
    return engine->contact == 0.0
               ? GBG_OK
               : engine->kernels->overlaps(engine->device, &engine->state, contact_tolerance, 0,
                                           NULL, NULL, &pair, count);
}

int gbg_engine_check_overlaps(struct gbg_engine *engine, const char *call)
{
    if (engine->contact == 0.0) {
        return GBG_OK;
    }
    struct gbg_pair pair;
    int64_t count;
    int status = engine->kernels->overlaps(engine->device, &engine->state, contact_tolerance, 0,
                                           NULL, NULL, &pair, &count);
    if (status == GBG_OK && count > 0) {
        const char *how = pair.distance == 0.0 ? "coincide" : "overlap";
        status = gbg_fail(engine->context, GBG_E_OVERLAP,
                          "%s: particles %lld and %lld %s: distance "
                          "%.17g is below contact; %lld pairs overlap in all",
                          call, (long long)gbg_engine_id(engine, pair.first),
                          (long long)gbg_engine_id(engine, pair.second), how, pair.distance,
                          (long long)count);
    }
    return status;
}
