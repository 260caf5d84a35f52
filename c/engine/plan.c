/* L2: the plan: which kernels run in which order, and what they cost in memory. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "engine/engine.h"
#include "engine/mesh_check.h"
#include "engine/steps.h"

static struct gbg_plan_step *add(struct gbg_engine *engine, const char *kernel, double bytes,
                                 int (*run)(struct gbg_engine *, const struct gbg_plan_step *),
                                 const char *format, ...)
{
    struct gbg_plan_step *step = &engine->plan[engine->n_plan++];
    va_list arguments;
    step->kernel = kernel;
    step->bytes = bytes;
    step->run = run;
    va_start(arguments, format);
    vsnprintf(step->what, sizeof step->what, format, arguments);
    va_end(arguments);
    return step;
}

/* A list of that reach, with the skin that the scene gives or a default, at most the reach. */
static int make_list(struct gbg_engine *engine, double reach, double default_skin,
                     struct gbg_list **list)
{
    double skin = engine->scene.skin > 0.0 ? engine->scene.skin : default_skin;
    return engine->kernels->list_create(engine->device, &engine->state, reach,
                                        reach + fmin(skin, reach), list);
}

/* Force on a particle at the rim of a packed cluster of all particles, over that of one neighbour
 * at contact: shells of half a plane or half the space. A cut-off force counts its nearest
 * neighbour. */
static double rim_pull(const struct gbg_engine *engine, const struct gbg_force *force)
{
    int dimension = engine->scene.dimension;
    double shells = pow((double)engine->state.owned, 1.0 / dimension), pull = 0.0;
    if (!gbg_force_is_far(force)) {
        return 1.0;
    }
    for (int k = 1; k <= (int)shells; k++) {
        pull += (dimension == 2 ? 2.0 : 4.0) * pow(k, dimension - 1 - force->power);
    }
    return fmax(pull, 1.0);
}

/* How far one neighbour in contact moves a particle in a step; at_rim: how far a packed cluster of
 * all particles moves one at its rim. */
static double drift_at_contact(const struct gbg_engine *engine, int at_rim)
{
    const struct gbg_scene *scene = &engine->scene;
    double strongest = 0.0, drift = 0.0;
    for (int s = 0; s < scene->n_species; s++) {
        for (int t = 0; t < scene->n_species; t++) {
            strongest = fmax(strongest, fabs(scene->species[s].mobility * scene->species[t].alpha));
        }
    }
    for (int f = 0; f < scene->n_forces; f++) {
        double pull = at_rim ? rim_pull(engine, &scene->force[f]) : 1.0;
        drift += pull * strongest * scene->dt / pow(engine->least_contact, scene->force[f].power);
    }
    return drift;
}

/* A skin that lasts for some 40 steps: the noise of those who go farthest, and the drift of a
 * neighbour in contact. */
static double lasting_skin(const struct gbg_engine *engine)
{
    const double steps = 40.0, farthest = 4.5;
    double drift = engine->contact > 0.0 ? drift_at_contact(engine, 0) : 0.0;
    return 2.0 * (farthest * engine->noise.scale * sqrt(steps) + drift * steps);
}

/* Where particles are few, a longer skin costs few neighbours and saves builds: the skin at which a
 * list would hold `expected` neighbours of a particle in a plane, twice as many in a volume, if
 * they were spread evenly. (C4 short on a core, 65536 particles, 300 steps: 6 builds instead of 36,
 * in the same time; a dilute suspension in which likes attract: 64 instead of 307 in 800 steps,
 * some 12 % faster. On a GPU a build costs more.) No longer than needed: where builds are rare
 * anyhow, each step would look at neighbours in vain, which made gases without cores some 20 %
 * slower. */
static double roomy_skin(const struct gbg_engine *engine, double reach, double expected)
{
    double density = (double)engine->state.owned, pi = acos(-1.0);
    for (int a = 0; a < engine->scene.dimension; a++) {
        density /= engine->scene.length[a];
    }
    if (!(density > 0.0)) {
        return 0.0;
    }
    double radius = engine->scene.dimension == 2 ? sqrt(expected / (pi * density))
                                                 : cbrt(2.0 * expected * 0.75 / (pi * density));
    return fmin(radius - reach, lasting_skin(engine));
}

/* Long-range forces pile up in clusters and move particles far in a step: a longer skin then saves
 * more rebuilds than its neighbours cost (measured on C3, 600 steps: 3.2 us a particle and step
 * with 0.4 of contact, 2.4 with 0.8, 2.6 with 1). */
static double contact_skin(const struct gbg_engine *engine)
{
    double contact = engine->contact, skin = 0.4 * contact;
    skin += engine->kernels->skin_drifts * drift_at_contact(engine, 0);
    for (int f = 0; f < engine->scene.n_forces; f++) {
        if (gbg_force_is_far(&engine->scene.force[f])) {
            skin = 0.8 * contact;
        }
    }
    if (engine->scene.rule == GBG_RULE_EVENT) { /* the list must hold the whole paths */
        skin = fmax(skin, 20.0 * engine->noise.scale);
    }
    return fmin(fmax(skin, roomy_skin(engine, contact, 4.0)), contact);
}

/* With hard cores both lists are built at about the same time. */
static double force_skin(const struct gbg_engine *engine)
{
    double unit = engine->contact > 0.0 ? engine->contact : 0.4 * engine->cutoff;
    double skin = fmax(0.4 * unit, roomy_skin(engine, engine->cutoff, 12.0));
    if (engine->contact > 0.0) {
        skin += engine->kernels->skin_drifts * drift_at_contact(engine, 0);
        skin = fmin(skin, contact_skin(engine));
    }
    return skin;
}

static int plan_cutoff(struct gbg_engine *engine)
{
    const struct gbg_scene *scene = &engine->scene;
    int cut = 0;
    for (int f = 0; f < scene->n_forces; f++) {
        if (scene->force[f].sum == GBG_SUM_CUTOFF) {
            engine->cutoff = fmax(engine->cutoff, scene->force[f].cutoff);
            cut = 1;
        }
    }
    if (!cut) {
        return GBG_OK;
    }
    int status = make_list(engine, engine->cutoff, force_skin(engine), &engine->pairs);
    if (status == GBG_OK) {
        gbg_engine_describe_list(engine, add(engine, "list_update", 0.0, gbg_step_pair_list, " "));
    }
    return status;
}

void gbg_engine_describe_list(const struct gbg_engine *engine, struct gbg_plan_step *step)
{
    const struct gbg_kernels *kernels = engine->kernels;
    int kept = !kernels->list_is_kept || kernels->list_is_kept(engine->pairs);
    snprintf(step->what, sizeof step->what,
             kept ? "neighbours within %.4g, rebuilt when somebody moved half the skin"
                  : "cells for neighbours within %.4g, found for each force: too many to be kept",
             engine->cutoff);
}

static int plan_direct(struct gbg_engine *engine, int f, double bytes)
{
    const struct gbg_kernels *kernels = engine->kernels;
    const char *const name = engine->strict       ? "direct_strict"
                             : engine->use_double ? "direct_double"
                                                  : "direct_mixed";
    if (!(engine->strict       ? kernels->direct_strict
          : engine->use_double ? kernels->direct_double
                               : kernels->direct_mixed)) {
        return gbg_fail(engine->context, GBG_E_UNBUILT,
                        "forces[%d]: backend %s has no "
                        "direct sum",
                        f, engine->backend->name);
    }
    add(engine, name, bytes, gbg_step_direct, "r/r^%g over all pairs, nearest images",
        engine->scene.force[f].power + 1.0)
        ->force = f;
    return GBG_OK;
}

static int plan_lattice(struct gbg_engine *engine, int f, double bytes)
{
    int status = gbg_engine_make_mesh_sum(engine, f);
    if (status == GBG_OK) {
        struct gbg_plan_step *step = add(engine, "ewald", bytes, gbg_step_ewald, " ");
        step->force = f;
        step->mesh_bytes = gbg_engine_mesh_bytes(engine, f);
        step->bytes += step->mesh_bytes;
        gbg_mesh_sum_describe(gbg_engine_mesh_sum(engine, f), sizeof step->what, step->what);
    }
    return status;
}

static int plan_forces(struct gbg_engine *engine)
{
    const struct gbg_scene *scene = &engine->scene;
    int status = plan_cutoff(engine);
    for (int f = 0; status == GBG_OK && f < scene->n_forces; f++) {
        const struct gbg_force *force = &scene->force[f];
        double bytes = f == 0 ? 8.0 * scene->dimension : 0.0;
        if (force->sum == GBG_SUM_CUTOFF) {
            add(engine, engine->use_double ? "cutoff_double" : "cutoff_mixed", bytes,
                gbg_step_cutoff, "r/r^%g within %.4g", force->power + 1.0, force->cutoff)
                ->force = f;
        } else {
            status = (force->sum == GBG_SUM_LATTICE ? plan_lattice : plan_direct)(engine, f, bytes);
        }
    }
    return status;
}

/* The rule bridge looks at pairs whose gap after the free moves is below this: the noise of a step
 * passes 6 deviations once in 1e9, and what the pushes of others close is measured in the largest
 * drifts of a step (C3 short at packing 0.79: twice that or half of it makes no difference that is
 * seen). */
static double bridge_reach(const struct gbg_engine *engine)
{
    double noise = sqrt(2.0) * engine->noise.scale;
    return fmin(6.0 * noise + 2.0 * drift_at_contact(engine, 1), 0.5 * engine->contact);
}

static int plan_cores(struct gbg_engine *engine)
{
    static const char *const names[] = {[GBG_RULE_EVENT] = "event",
                                        [GBG_RULE_BRIDGE] = "bridge",
                                        [GBG_RULE_BOUNCE] = "bounce",
                                        [GBG_RULE_CONTACT] = "contact",
                                        [GBG_RULE_CARTER] = "carter"};
    const struct gbg_kernels *kernels = engine->kernels;
    int rule = engine->scene.rule;
    if ((rule == GBG_RULE_EVENT && !kernels->events) ||
        (rule == GBG_RULE_BRIDGE && !kernels->bridge)) {
        return gbg_fail(engine->context, GBG_E_UNBUILT,
                        "excluded_volume.rule: backend %s has no rule %s", engine->backend->name,
                        names[rule]);
    }
    double reach = engine->contact + (rule == GBG_RULE_BRIDGE ? bridge_reach(engine) : 0.0);
    int status = make_list(engine, reach, contact_skin(engine), &engine->contacts);
    if (status == GBG_OK) {
        add(engine, "contacts", engine->scene.overlap ? 1.0 : 0.0, gbg_step_contacts,
            "rule %s in rounds until no pair within %.4g overlaps", names[rule], engine->contact);
    }
    return status;
}

int gbg_engine_plan(struct gbg_engine *engine)
{
    const struct gbg_scene *scene = &engine->scene;
    double words = 8.0 * scene->dimension;
    engine->use_double = scene->precision == GBG_PRECISION_DOUBLE; /* auto: mixed, 1e-6 or better */
    engine->strict = scene->precision == GBG_PRECISION_STRICT;
    int status = plan_forces(engine);
    if (status == GBG_OK && engine->contact > 0.0) {
        add(engine, "keep", words, gbg_step_keep, "positions before the step");
    }
    if (status == GBG_OK && scene->dynamics == GBG_DYNAMICS_BROWNIAN) {
        add(engine, "integrate", words, gbg_step_integrate,
            "x += F dt + sqrt(T dt) xi, dt %g, T %g", scene->dt, scene->temperature);
    }
    if (status == GBG_OK && engine->contact > 0.0) {
        status = plan_cores(engine);
    }
    return status;
}

double gbg_engine_bytes(const struct gbg_engine *engine)
{
    const struct gbg_scene *scene = &engine->scene;
    const struct gbg_state *state = &engine->state;
    double axis = 8.0 + (state->image[0] ? 4.0 : 0.0) + (state->force[0] ? 8.0 : 0.0) +
                  (state->start_high[0] ? 8.0 : 0.0) + (state->start_image[0] ? 4.0 : 0.0);
    double bytes =
        axis * scene->dimension + (state->species ? 1.0 : 0.0) + (state->id ? 8.0 : 0.0) +
        (state->overlapped ? 1.0 : 0.0) + (state->source ? 4.0 : 0.0) + (engine->rank ? 8.0 : 0.0) +
        (state->rank ? 4.0 : 0.0) + (engine->place ? 4.0 : 0.0) + (engine->species ? 4.0 : 0.0) +
        (engine->id ? 8.0 : 0.0) + (engine->words ? 8.0 : 0.0);
    double n = state->owned > 0 ? (double)state->owned : 1.0;
    if (engine->pairs) {
        bytes += engine->kernels->list_bytes(engine->pairs) / n;
    }
    for (int f = 0; f < scene->n_forces; f++) {
        bytes += gbg_engine_mesh_bytes(engine, f);
    }
    bytes += engine->backend->scratch_bytes(engine->device) / n;
    if (engine->contacts) {
        bytes += engine->kernels->list_bytes(engine->contacts) / n;
    }
    return bytes;
}
