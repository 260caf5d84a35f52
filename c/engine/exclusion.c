/* L2: the step that keeps hard cores apart: the rule, rounds for what it leaves, the certificate,
 * and the roll-back of what still violates it. */
#include <math.h>
#include <stdio.h>

#include "engine/engine.h"
#include "engine/steps.h"

/* Relative tolerance of the contact distance: far above the rounding of a distance (4e-16), below
 * what a caller could mean by touching. The certificate has the first; rules and starts keep to
 * smaller ones, so that they never differ over a pair by rounding. */
static const double certified = 1e-12, at_start = 0.95e-12, of_rules = 0.9e-12;

/* Largest part of contact by which a pair moves one of its discs in a round, and the smaller one
 * for the rare step in which pushes added up to carry a pair through each other. */
static const double cap = 0.25, gentle_cap = 0.02;

/* So many particles may be put back in a run whatever its length, and so many of 1. One event in a
 * dense place puts back some ten, and a small run must survive it. */
static const double spared_count = 32.0, spared_share = 1e-3;

/* Tolerance of bent paths: what rounding leaves between two collisions is far below. */
static const double path_tolerance = 1e-9;

typedef int (*gbg_corrector)(struct gbg_device *, struct gbg_state *, struct gbg_list *,
                             struct gbg_contacts *);

/* One kernel, and its work added to the engine's counters. */
static int apply(struct gbg_engine *engine, gbg_corrector kernel, struct gbg_contacts *contacts)
{
    int status = kernel(engine->device, &engine->state, engine->contacts, contacts);
    if (status == GBG_OK) {
        engine->contact_rounds += contacts->rounds;
        engine->contact_pairs += contacts->pairs;
        engine->events_left += kernel == engine->kernels->events ? contacts->stopped : 0;
        engine->contact_virial += contacts->virial;
        engine->moved = fmax(engine->moved, contacts->largest);
    }
    return status;
}

/* 1 if forces of many particles add up on one, so that pushes add up through a cluster. */
static int is_pressed(const struct gbg_scene *scene)
{
    for (int f = 0; f < scene->n_forces; f++) {
        if (gbg_force_is_far(&scene->force[f])) {
            return 1;
        }
    }
    return 0;
}

/* The rule, and rounds for what it leaves; what these leave is for the certificate to find. */
static int correct(struct gbg_engine *engine, int parting, double largest_push)
{
    const struct gbg_kernels *kernels = engine->kernels;
    int rule = engine->scene.rule;
    struct gbg_contacts contacts = {
        .parting = parting,
        .max_rounds = engine->scene.max_rounds,
        .tolerance = of_rules,
        .cap = largest_push,
        .noise = &engine->noise,
        .step = engine->step,
        .pressed = is_pressed(&engine->scene),
    };
    int status =
        kernels->list_update(engine->device, &engine->state, engine->contacts, engine->moved);
    engine->moved = engine->moves.total;
    if (status == GBG_OK && rule == GBG_RULE_EVENT) {
        status = apply(engine, kernels->events, &contacts);
    } else if (status == GBG_OK && rule == GBG_RULE_BRIDGE) {
        status = apply(engine, kernels->bridge, &contacts);
    }
    int unsettled = rule == GBG_RULE_BRIDGE && contacts.stopped;
    engine->unsettled += unsettled;
    if (status != GBG_OK || contacts.clear) {
        return status;
    }
    status = apply(engine, kernels->contacts, &contacts);
    engine->unsettled_pairs += unsettled && status == GBG_OK ? contacts.pairs : 0;
    return status;
}

/* 1 if the particles' paths may be taken for straight lines from the start of the step to its end.
 * A rule that knows its own paths and can show that they are clear belongs here. */
static int paths_are_straight(struct gbg_engine *engine)
{
    struct gbg_pair pair = {-1, -1, 0.0};
    /* a chord between two places at distance >= contact comes nearer than contact/sqrt(2) only if
     * it is longer than sqrt(2) contact */
    if (engine->scene.rule != GBG_RULE_EVENT || engine->moved < 0.69 * engine->least_contact) {
        return 1;
    }
    int status = engine->kernels->events_clear(engine->device, &engine->state, engine->contacts,
                                               path_tolerance, &pair);
    return status != GBG_OK || pair.first >= 0;
}

static int certify(struct gbg_engine *engine, struct gbg_certificate *certificate)
{
    *certificate =
        (struct gbg_certificate){.tolerance = certified, .straight = paths_are_straight(engine)};
    int status =
        engine->kernels->certify(engine->device, &engine->state, engine->contacts, certificate);
    if (status == GBG_OK && certificate->undecided) {
        status = gbg_step_refuse(engine, 0.5 * engine->least_contact,
                                 "particles moved so far that passing through each other "
                                 "cannot be excluded");
    }
    return status;
}

static int is_clean(const struct gbg_certificate *certificate)
{
    return certificate->overlapping == 0 && certificate->passed == 0;
}

static int parting_of(int rule)
{
    return rule == GBG_RULE_CONTACT  ? GBG_PARTING_CONTACT
           : rule == GBG_RULE_CARTER ? GBG_PARTING_CARTER
                                     : GBG_PARTING_BOUNCE;
}

/* The step once more: with small pushes if pushes had carried a pair through each other; with
 * pushes to contact if rounds ran out, because those to the mirror distance never end near close
 * packing, where what one pair gains another loses. */
static int correct_gently(struct gbg_engine *engine, struct gbg_certificate *certificate)
{
    int crowded = certificate->passed == 0;
    int parting = crowded ? GBG_PARTING_CONTACT : parting_of(engine->scene.rule);
    int status = engine->kernels->put_back(engine->device, &engine->state);
    if (status == GBG_OK) {
        status = engine->kernels->integrate(engine->device, &engine->state, &engine->noise,
                                            engine->step, engine->scene.dt, 1, &engine->moves);
    }
    engine->state.epoch++; /* lists do not know the way back */
    engine->repeated++;
    status = status ? status : correct(engine, parting, crowded ? cap : gentle_cap);
    return status ? status : certify(engine, certificate);
}

/* Refuses the step if more particles were put back than the scene allows. */
static int check_reverted(struct gbg_engine *engine, int64_t now)
{
    double n = (double)engine->state.owned, moves = n * (double)(engine->steps_made + 1);
    double bound = engine->scene.reverted, allowed = bound * moves;
    if (bound > 0.0) {
        allowed = fmax(allowed, fmax(spared_count, spared_share * n));
    }
    if ((double)(engine->reverted + now) <= allowed) {
        engine->reverted += now;
        return GBG_OK;
    }
    char why[256];
    snprintf(why, sizeof why,
             "%lld particles overlap or passed through each other and would have to be put back, "
             "%lld in all of %.4g moves, but excluded_volume.reverted = %g allows %.0f",
             (long long)now, (long long)(engine->reverted + now), moves, bound, floor(allowed));
    return gbg_step_refuse(engine, 0.2 * engine->least_contact, why);
}

static int roll_back(struct gbg_engine *engine, struct gbg_certificate *certificate)
{
    int64_t reverted = 0;
    int status = engine->kernels->roll_back(engine->device, &engine->state, certified,
                                            paths_are_straight(engine), &reverted);
    status = status ? status : check_reverted(engine, reverted);
    status = status ? status : certify(engine, certificate);
    if (status == GBG_OK && !is_clean(certificate)) {
        status = gbg_step_refuse(engine, 0.2 * engine->least_contact,
                                 "pairs overlap that did so before the step");
    }
    return status;
}

int gbg_step_contacts(struct gbg_engine *engine, const struct gbg_plan_step *step)
{
    (void)step;
    struct gbg_certificate certificate;
    int status = correct(engine, parting_of(engine->scene.rule), cap);
    status = status ? status : certify(engine, &certificate);
    if (status != GBG_OK || is_clean(&certificate)) {
        return status;
    }
    /* free moves so short cannot have carried a pair through each other: pushes did */
    if (engine->moves.total < engine->least_contact / sqrt(2.0)) {
        status = correct_gently(engine, &certificate);
    }
    if (status == GBG_OK && !is_clean(&certificate)) {
        status = roll_back(engine, &certificate);
    }
    return status;
}

void gbg_step_contacts_ask(const struct gbg_engine *engine, struct gbg_batch *batch)
{
    batch->contacts = engine->contacts;
    batch->certified = certified;
    batch->bridge = engine->scene.rule == GBG_RULE_BRIDGE;
    batch->rule = (struct gbg_contacts){.parting = parting_of(engine->scene.rule),
                                        .max_rounds = engine->scene.max_rounds,
                                        .tolerance = of_rules,
                                        .cap = cap,
                                        .noise = &engine->noise,
                                        .pressed = is_pressed(&engine->scene)};
}

int gbg_engine_count_overlaps(struct gbg_engine *engine, int64_t *count)
{
    struct gbg_pair pair;
    *count = 0;
    return engine->contact == 0.0
               ? GBG_OK
               : engine->kernels->overlaps(engine->device, &engine->state, certified, 0, NULL, NULL,
                                           &pair, count);
}

int gbg_engine_check_overlaps(struct gbg_engine *engine, const char *call)
{
    if (engine->contact == 0.0) {
        return GBG_OK;
    }
    struct gbg_pair pair;
    int64_t count;
    int status = engine->kernels->overlaps(engine->device, &engine->state, at_start, 0, NULL, NULL,
                                           &pair, &count);
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

double gbg_engine_reverted_fraction(const struct gbg_engine *engine)
{
    double moves = (double)engine->steps_made * (double)engine->state.owned;
    return moves > 0.0 ? (double)engine->reverted / moves : 0.0;
}
