/* L2: takes all memory that running needs before the first step. */
#include "engine/engine.h"
#include "engine/steps.h"

/* Builds the lists and takes the scratch memory of sums and contact rounds. The start has no
 * overlaps, so a round of contacts moves nobody. */
int gbg_engine_prepare(struct gbg_engine *engine)
{
    const struct gbg_kernels *kernels = engine->kernels;
    int status = GBG_OK;
    for (int k = 0; status == GBG_OK && k < engine->n_plan; k++) {
        const struct gbg_plan_step *step = &engine->plan[k];
        if (step->run == gbg_step_direct) {
            status = kernels->direct_reserve(engine->device, &engine->state);
        } else if (step->run == gbg_step_pair_list) {
            status = step->run(engine, step);
        } else if (step->run == gbg_step_contacts) {
            struct gbg_contacts none = {.bounce = 1, .tolerance = 1e-9};
            status = kernels->list_update(engine->device, &engine->state, engine->contacts, 0.0);
            if (status == GBG_OK) {
                status = kernels->contacts(engine->device, &engine->state, engine->contacts, &none);
            }
        }
    }
    engine->moved = 0.0;
    return status;
}
