/* L2: what side rooms may see. */
#include "engine/view.h"

#include "core/memory.h"
#include "engine/engine.h"

/* Species and ids in host memory, made when first asked for: a run without output has none. */
static int make_lists(struct gbg_engine *engine)
{
    const struct gbg_state *state = &engine->state;
    int64_t n = state->owned;
    if (engine->id) {
        return GBG_OK;
    }
    int status = gbg_allocate_zero(engine->context, (void **)&engine->species, n,
                                   sizeof *engine->species, "species");
    if (status == GBG_OK && state->species) {
        uint8_t *bytes = (uint8_t *)engine->species;
        status = engine->backend->download(engine->device, bytes, state->species, (size_t)n);
        for (int64_t i = n - 1; i >= 0; i--) { /* widens in place, from the end */
            engine->species[i] = bytes[i];
        }
    }
    if (status == GBG_OK) {
        status = gbg_allocate(engine->context, (void **)&engine->id, n, sizeof *engine->id, "ids");
    }
    if (status == GBG_OK && state->id) {
        status = engine->backend->download(engine->device, engine->id, state->id, (size_t)n * 8);
    } else {
        for (int64_t i = 0; status == GBG_OK && i < n; i++) {
            engine->id[i] = i;
        }
    }
    if (status != GBG_OK) {
        gbg_release(engine->species);
        gbg_release(engine->id);
        engine->species = NULL;
        engine->id = NULL;
    }
    return status;
}

int gbg_engine_look(struct gbg_engine *engine, struct gbg_engine_view *view)
{
    int status = make_lists(engine);
    *view = (struct gbg_engine_view){
        .context = engine->context,
        .scene = &engine->scene,
        .box = engine->state.box,
        .n = engine->state.owned,
        .step = engine->step,
        .time = (double)engine->step * engine->scene.dt,
        .has_images = engine->state.image[0] != NULL,
        .has_overlap = engine->state.overlapped != NULL,
        .species = engine->species,
        .id = engine->id,
    };
    return status;
}
