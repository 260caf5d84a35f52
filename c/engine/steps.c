/* L2: the steps that a plan is made of, and the refusal of a step that is too large. */
#include "engine/steps.h"

#include <math.h>
#include <stdio.h>

#include "engine/engine.h"
#include "engine/mesh_check.h"

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
    return (engine->strict       ? kernels->direct_strict
            : engine->use_double ? kernels->direct_double
                                 : kernels->direct_mixed)(engine->device, &engine->state,
                                                          force->power, step->force > 0);
}

int gbg_step_ewald(struct gbg_engine *engine, const struct gbg_plan_step *step)
{
    return engine->kernels->ewald_force(engine->device, &engine->state,
                                        gbg_engine_mesh_sum(engine, step->force)->body,
                                        step->force > 0);
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

int64_t gbg_engine_id(const struct gbg_engine *engine, int64_t i)
{
    uint64_t id = (uint64_t)i;
    if (engine->state.id) {
        engine->backend->download(engine->device, &id, engine->state.id + i, sizeof id);
    }
    return (int64_t)id;
}

int gbg_step_refuse(struct gbg_engine *engine, double allowed, const char *why)
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
                 (long long)gbg_engine_id(engine, engine->moves.bad));
        double least = engine->state.box.length[0];
        for (int a = 1; a < engine->state.box.dimension; a++) {
            least = fmin(least, engine->state.box.length[a]);
        }
        status = gbg_step_refuse(
            engine, engine->contact > 0.0 ? 0.5 * engine->least_contact : 0.25 * least, why);
    }
    return status;
}
