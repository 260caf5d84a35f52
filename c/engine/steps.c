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

/* Two particles at distance >= contact before and after can only have passed through each other if
 * their relative move was longer than sqrt(2) contact; otherwise the straight path stays farther
 * than contact/sqrt(2). So the search is needed only after large moves. */
static int check_passed(struct gbg_engine *engine)
{
    double relative = 2.0 * engine->moved, reach = engine->contact + relative;
    if (relative <= sqrt(2.0) * engine->least_contact) {
        return GBG_OK;
    }
    double allowed = engine->least_contact / sqrt(2.0);
    for (int a = 0; a < engine->state.box.dimension; a++) {
        if (reach > 0.5 * engine->state.box.length[a]) {
            return refuse(engine, allowed,
                          "particles moved so far that passing through each other "
                          "cannot be excluded");
        }
    }
    struct gbg_pair pair;
    int status = engine->kernels->passed(engine->device, &engine->state, reach, &pair);
    if (status == GBG_OK && pair.first >= 0) {
        char why[128];
        snprintf(why, sizeof why, "particles %lld and %lld passed through each other",
                 (long long)id_of(engine, pair.first), (long long)id_of(engine, pair.second));
        status = refuse(engine, allowed, why);
    }
    return status;
}

int gbg_step_contacts(struct gbg_engine *engine, const struct gbg_plan_step *step)
{
    (void)step;
    struct gbg_contacts contacts = {
        .bounce = engine->scene.rule != GBG_RULE_CONTACT,
        .max_rounds = engine->scene.max_rounds,
        .tolerance = contact_tolerance,
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
    engine->moved = fmax(engine->moved, contacts.largest);
    status = check_passed(engine);
    if (status == GBG_OK) {
        engine->contact_rounds += contacts.rounds;
        engine->contact_pairs += contacts.pairs;
    }
    return status;
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
