/* L2: the steps that a plan is made of, and the refusal of a step that is too large. */
#include "engine/steps.h"

#include <math.h>
#include <stdio.h>

#include "engine/engine.h"

/* Tolerance of the contact distance: far above the rounding of the squared distance (4e-16), below
 * what a caller could mean by touching. */
static const double contact_tolerance = 1e-12;

int gbg_step_pair_list(struct gbg_engine *engine, const struct gbg_plan_step *step)
{
    (void)step;
    return engine->kernels->list_update(engine->device, &engine->state, engine->pairs,
                                        engine->moved);
}

int gbg_step_cutoff(struct gbg_engine *engine, const struct gbg_plan_step *step)
{
    const struct gbg_force *force = &engine->scene.force[step->force];
    const struct gbg_kernels *kernels = engine->kernels;
    return (engine->use_double ? kernels->cutoff_double : kernels->cutoff_mixed)(
        engine->device, &engine->state, engine->pairs, force->power, force->cutoff,
        step->force > 0);
}

int gbg_step_direct(struct gbg_engine *engine, const struct gbg_plan_step *step)
{
    const struct gbg_force *force = &engine->scene.force[step->force];
    const struct gbg_kernels *kernels = engine->kernels;
    return (engine->use_double ? kernels->direct_double : kernels->direct_mixed)(
        engine->device, &engine->state, force->power, step->force > 0);
}

int gbg_step_keep(struct gbg_engine *engine, const struct gbg_plan_step *step)
{
    (void)step;
    return engine->kernels->keep(engine->device, &engine->state);
}

/* Largest dt for which the drift and noise of this step would move nobody by more than `allowed`:
 * drift grows as dt, noise as its root. */
static double safe_dt(const struct gbg_engine *engine, double allowed)
{
    double a = engine->moves.drift, b = engine->moves.noise;
    if (!isfinite(a) || !isfinite(b)) {
        return 0.0;
    }
    double root = a > 0.0 ? (sqrt(b * b + 4.0 * a * allowed) - b) / (2.0 * a)
                          : allowed / (b > 0.0 ? b : allowed);
    return engine->scene.dt * fmin(root * root, 0.5);
}

static int64_t id_of(const struct gbg_engine *engine, int64_t i)
{
    uint64_t id = (uint64_t)i;
    if (engine->state.id) {
        engine->backend->download(engine->device, &id, engine->state.id + i, sizeof id);
    }
    return (int64_t)id;
}

static int refuse(struct gbg_engine *engine, double allowed, const char *why)
{
    return gbg_fail(engine->context, GBG_E_STEP,
                    "step %llu: %s; dt is %g, largest dt estimated to "
                    "be safe here: %.2g; the state is that before this step",
                    (unsigned long long)engine->step + 1, why, engine->scene.dt,
                    safe_dt(engine, allowed));
}

int gbg_step_integrate(struct gbg_engine *engine, const struct gbg_plan_step *step)
{
    (void)step;
    int status = engine->kernels->integrate(engine->device, &engine->state, &engine->noise,
                                            engine->step, engine->scene.dt, 1, &engine->moves);
    engine->moved = engine->moves.total;
    engine->forces_current = 0;
    if (status == GBG_OK && engine->moves.bad >= 0) {
        char why[128];
        snprintf(why, sizeof why,
                 "particle %lld moves by more than half the box, or its force is "
                 "not finite",
                 (long long)id_of(engine, engine->moves.bad));
        double least = engine->state.box.length[0];
        for (int a = 1; a < engine->state.box.dimension; a++) {
            least = fmin(least, engine->state.box.length[a]);
        }
        status =
            refuse(engine, engine->contact > 0.0 ? 0.5 * engine->least_contact : 0.25 * least, why);
    }
    return status;
}

/* Largest part of contact by which a pair moves one of its discs in a round, and the smaller one
 * for the rare step in which pushes added up to carry a pair through each other. */
static const double cap = 0.25, gentle_cap = 0.02;

static int correct(struct gbg_engine *engine, double largest_push)
{
    struct gbg_contacts contacts = {
        .bounce = engine->scene.rule != GBG_RULE_CONTACT,
        .max_rounds = engine->scene.max_rounds,
        .tolerance = contact_tolerance,
        .cap = largest_push,
    };
    int status = engine->kernels->list_update(engine->device, &engine->state, engine->contacts,
                                              engine->moved);
    if (status == GBG_OK) {
        status =
            engine->kernels->contacts(engine->device, &engine->state, engine->contacts, &contacts);
    }
    if (status != GBG_OK) {
        return status;
    }
    if (contacts.left > 0) {
        char why[128];
        snprintf(why, sizeof why, "%lld pairs still overlap after %lld rounds",
                 (long long)contacts.left, (long long)contacts.rounds);
        return refuse(engine, 0.1 * engine->least_contact, why);
    }
    engine->contact_rounds += contacts.rounds;
    engine->contact_pairs += contacts.pairs;
    engine->moved = fmax(engine->moves.total, contacts.largest);
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
            return refuse(engine, limit,
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
                 (long long)id_of(engine, pair.first), (long long)id_of(engine, pair.second));
        return refuse(engine, limit, why);
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
        status =
            gbg_fail(engine->context, GBG_E_OVERLAP,
                     "%s: particles %lld and %lld %s: distance "
                     "%.17g is below contact; %lld pairs overlap in all",
                     call, (long long)id_of(engine, pair.first),
                     (long long)id_of(engine, pair.second), how, pair.distance, (long long)count);
    }
    return status;
}
