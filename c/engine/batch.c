/* L2: many steps at once, where the backend can make them and the scene has nothing in between. */
#include <math.h>

#include "engine/engine.h"
#include "engine/steps.h"

/* Whether every step of the plan is one that a batch knows. */
static int has_batches(const struct gbg_engine *engine)
{
    return engine->kernels->steps && engine->scene.rule != GBG_RULE_EVENT &&
           gbg_engine_is_short_range(engine) && engine->scene.dynamics == GBG_DYNAMICS_BROWNIAN &&
           engine->scene.n_forces <= GBG_BATCH_FORCES;
}

static struct gbg_batch make_batch(const struct gbg_engine *engine, int64_t steps)
{
    struct gbg_batch batch = {.steps = steps,
                              .first = engine->step,
                              .dt = engine->scene.dt,
                              .noise = &engine->noise,
                              .pairs = engine->pairs,
                              .n_forces = engine->scene.n_forces,
                              .use_double = engine->use_double,
                              .moved = engine->moved};
    for (int f = 0; f < batch.n_forces; f++) {
        batch.power[f] = engine->scene.force[f].power;
        batch.cutoff[f] = engine->scene.force[f].cutoff;
    }
    if (engine->contact > 0.0) {
        gbg_step_contacts_ask(engine, &batch);
        batch.rule.virial = engine->contact_virial;
    }
    return batch;
}

int gbg_engine_batch(struct gbg_engine *engine, int64_t steps, int64_t *made, int *more)
{
    *made = *more = 0;
    if (!has_batches(engine)) {
        return GBG_OK;
    }
    int status = gbg_engine_tidy(engine);
    struct gbg_batch batch = make_batch(engine, steps);
    status = status ? status : engine->kernels->steps(engine->device, &engine->state, &batch);
    if (batch.done > 0) { /* also before a failure: these steps are made */
        engine->step += (uint64_t)batch.done;
        engine->steps_made += batch.done;
        engine->contact_rounds += batch.rule.rounds;
        engine->contact_pairs += batch.rule.pairs;
        engine->contact_virial = batch.rule.virial;
        engine->moved = batch.moved;
        engine->moves = batch.moves;
        engine->forces_current = 0;
    }
    if (status == GBG_OK && batch.spoiled) {
        struct gbg_moves ignored;
        status = engine->kernels->integrate(engine->device, &engine->state, &engine->noise,
                                            engine->step, engine->scene.dt, -1, &ignored);
        engine->forces_current = 0;
    }
    *made = batch.done;
    *more = batch.more;
    return status;
}
