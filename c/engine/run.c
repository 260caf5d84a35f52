/* L2: advances the state by the plan, and puts it back when a step is refused. */
#include <stdio.h>
#include <time.h>

#include "engine/engine.h"
#include "engine/mesh_check.h"
#include "engine/steps.h"

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Undoes a refused step: from the coordinates kept before it if the scene has hard cores, otherwise
 * by the same move backwards (the noise comes from a counter, the forces are still there). */
static void undo(struct gbg_engine *engine)
{
    if (engine->contact > 0.0) {
        engine->kernels->put_back(engine->device, &engine->state);
    } else {
        struct gbg_moves ignored;
        engine->kernels->integrate(engine->device, &engine->state, &engine->noise, engine->step,
                                   engine->scene.dt, -1, &ignored);
    }
    engine->state.epoch++; /* lists are built anew */
    engine->forces_current = 0;
}

static int is_force(const struct gbg_plan_step *step)
{
    return step->run == gbg_step_cutoff || step->run == gbg_step_direct ||
           step->run == gbg_step_ewald;
}

static int make_forces(struct gbg_engine *engine)
{
    int status = GBG_OK;
    for (int k = 0; status == GBG_OK && k < engine->n_plan; k++) {
        const struct gbg_plan_step *step = &engine->plan[k];
        status = is_force(step) ? step->run(engine, step) : GBG_OK;
    }
    return status;
}

/* Between the forces and the move: sums that a measurement has made finer are summed again. */
static int watch(struct gbg_engine *engine)
{
    int measured = 0;
    double began = now();
    int status = gbg_engine_watch_sums(engine, &measured);
    engine->check_seconds += now() - began;
    return status == GBG_OK && measured ? make_forces(engine) : status;
}

static int make_step(struct gbg_engine *engine)
{
    int integrated = 0;
    int status = gbg_engine_tidy(engine);
    if (status != GBG_OK) {
        return status;
    }
    for (int k = 0; k < engine->n_plan; k++) {
        const struct gbg_plan_step *step = &engine->plan[k];
        if (step->run == gbg_step_integrate) {
            status = watch(engine);
            integrated = status == GBG_OK;
        }
        status = status ? status : step->run(engine, step);
        if (status != GBG_OK) {
            if (integrated) {
                undo(engine);
            }
            return status;
        }
    }
    engine->step++;
    engine->steps_made++;
    return GBG_OK;
}

int gbg_engine_advance(struct gbg_engine *engine, int64_t steps)
{
    double began = now(), checks;
    int status = steps > 0 ? gbg_engine_check_sums(engine) : GBG_OK;
    engine->check_seconds += now() - began;
    checks = engine->check_seconds;
    began = now();
    for (int64_t k = 0; k < steps && status == GBG_OK;) {
        int64_t made = 0;
        int more = 0;
        status = gbg_engine_batch(engine, steps - k, &made, &more);
        k += made;
        if (status == GBG_OK && k < steps && !more) {
            status = make_step(engine);
            k++;
        }
    }
    engine->seconds += now() - began - (engine->check_seconds - checks);
    return status;
}

int gbg_engine_evaluate_forces(struct gbg_engine *engine)
{
    if (engine->forces_current) {
        return GBG_OK;
    }
    int checked = gbg_engine_check_sums(engine);
    if (checked != GBG_OK) {
        return checked;
    }
    for (int k = 0; k < engine->n_plan; k++) {
        const struct gbg_plan_step *step = &engine->plan[k];
        if (step->run == gbg_step_pair_list || is_force(step)) {
            int status = step->run(engine, step);
            if (status != GBG_OK) {
                return status;
            }
        }
    }
    engine->forces_current = 1;
    return GBG_OK;
}
