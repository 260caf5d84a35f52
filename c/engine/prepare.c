/* L2: takes all memory that running needs before the first step. */
#include "engine/engine.h"
#include "engine/steps.h"

static double list_bytes(const struct gbg_engine *engine, const struct gbg_list *list)
{
    return engine->kernels->list_bytes(list) /
           (engine->state.owned > 0 ? (double)engine->state.owned : 1.0);
}

/* The first list shows whether the start is in good order in memory; if not, it is built anew. */
static int tidied(struct gbg_engine *engine, struct gbg_list *list)
{
    int status = gbg_engine_tidy(engine);
    return status ? status
                  : engine->kernels->list_update(engine->device, &engine->state, list, 0.0);
}

/* Builds the lists and takes the scratch memory of sums and contact rounds. The start has no
 * overlaps, so a round of contacts moves nobody. What the lists take is added to the plan's lines.
 */
static int prepare_step(struct gbg_engine *engine, struct gbg_plan_step *step)
{
    const struct gbg_kernels *kernels = engine->kernels;
    int status = GBG_OK;
    if (step->run == gbg_step_direct) {
        return kernels->direct_reserve(engine->device, &engine->state);
    }
    if (step->run == gbg_step_pair_list) {
        status = step->run(engine, step);
        status = status ? status : tidied(engine, engine->pairs);
        step->bytes += list_bytes(engine, engine->pairs);
        gbg_engine_describe_list(engine, step);
    } else if (step->run == gbg_step_contacts) {
        const struct gbg_noise still = {0};
        struct gbg_contacts none = {.parting = GBG_PARTING_BOUNCE, .tolerance = 1e-9, .cap = 0.25};
        status = kernels->list_update(engine->device, &engine->state, engine->contacts, 0.0);
        status = status ? status : tidied(engine, engine->contacts);
        if (status == GBG_OK) {
            status = kernels->contacts(engine->device, &engine->state, engine->contacts, &none);
        }
        if (status == GBG_OK && engine->scene.rule == GBG_RULE_EVENT) { /* nobody moves */
            status = kernels->keep(engine->device, &engine->state);
            status = status
                         ? status
                         : kernels->events(engine->device, &engine->state, engine->contacts, &none);
        }
        if (status == GBG_OK) { /* for its memory: there is no step yet to certify */
            struct gbg_certificate ignored = {.tolerance = 1e-9};
            status = kernels->certify(engine->device, &engine->state, engine->contacts, &ignored);
        }
        if (status == GBG_OK && engine->scene.rule == GBG_RULE_BRIDGE) {
            none.noise = &still; /* the start is made that of a step: nobody has moved */
            status = kernels->keep(engine->device, &engine->state);
            status = status
                         ? status
                         : kernels->bridge(engine->device, &engine->state, engine->contacts, &none);
        }
        step->bytes += list_bytes(engine, engine->contacts);
    }
    return status;
}

int gbg_engine_prepare(struct gbg_engine *engine)
{
    int status = GBG_OK;
    for (int k = 0; status == GBG_OK && k < engine->n_plan; k++) {
        status = prepare_step(engine, &engine->plan[k]);
    }
    engine->moved = 0.0;
    return status;
}
