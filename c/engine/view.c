/* L2: what side rooms may see. */
#include "engine/view.h"

#include <math.h>

#include "core/memory.h"
#include "engine/engine.h"
#include "engine/mesh_check.h"

/* Species and ids in host memory, made when first asked for: a run without output has none. */
static int make_lists(struct gbg_engine *engine)
{
    const struct gbg_state *state = &engine->state;
    const int32_t *place = NULL;
    int64_t n = state->owned;
    if (engine->id) {
        return GBG_OK;
    }
    int status = gbg_allocate_zero(engine->context, (void **)&engine->species, n,
                                   sizeof *engine->species, "species");
    if (status == GBG_OK) {
        status = gbg_allocate(engine->context, (void **)&engine->id, n, sizeof *engine->id, "ids");
    }
    status = status ? status : gbg_engine_places(engine, &place);
    if (status == GBG_OK && state->species) {
        status = gbg_engine_fetch(engine, state->species, (size_t)n);
        for (int64_t k = 0; status == GBG_OK && k < n; k++) {
            engine->species[k] = ((const uint8_t *)engine->words)[gbg_engine_place(place, k)];
        }
    }
    if (status == GBG_OK && state->id) {
        status = gbg_engine_fetch(engine, state->id, (size_t)n * 8);
    }
    for (int64_t k = 0; status == GBG_OK && k < n; k++) {
        const int64_t *ids = (const int64_t *)(const void *)engine->words;
        engine->id[k] = state->id ? ids[gbg_engine_place(place, k)] : k;
    }
    if (status != GBG_OK) {
        gbg_release(engine->species);
        gbg_release(engine->id);
        engine->species = NULL;
        engine->id = NULL;
    }
    return status;
}

static void look_at_sums(const struct gbg_engine *engine, struct gbg_engine_view *view)
{
    for (int f = 0; f < engine->scene.n_forces; f++) {
        const struct gbg_mesh_sum *sum = gbg_engine_mesh_sum(engine, f);
        view->has_sums |= sum != NULL;
        view->force_tolerance[f] = sum ? sum->tolerance : (double)NAN;
        view->force_error[f] = sum && sum->measured >= 0.0 ? sum->measured : (double)NAN;
    }
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
    look_at_sums(engine, view);
    return status;
}

int gbg_engine_copies_ahead(const struct gbg_engine *engine)
{
    return engine->backend->frame_begin != NULL;
}

int gbg_engine_copy_begin(struct gbg_engine *engine, int images, int overlap, struct gbg_copy *copy)
{
    if (copy->backend != engine->backend) {
        gbg_copy_release(copy);
        copy->backend = engine->backend;
    }
    return engine->backend->frame_begin(engine->device, &engine->state, images, overlap,
                                        &copy->slot);
}

const char *gbg_copy_wait(const struct gbg_copy *copy, struct gbg_frame *frame)
{
    return copy->backend->frame_wait(copy->slot, frame);
}

void gbg_copy_release(struct gbg_copy *copy)
{
    if (copy->slot) {
        copy->backend->frame_release(copy->slot);
    }
    copy->slot = NULL;
}
