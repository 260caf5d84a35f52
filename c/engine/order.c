/* L2: the order of particles in memory: renewed now and then, and invisible from outside. */
#include "engine/engine.h"

/* A list whose rows are scattered more than this is worth a new order; when even a new order is not
 * much better than that, only one that has become twice as bad. */
static const double scattered = 0.4;

/* Builds of a list between two orders: one costs about half a build. */
enum { PATIENCE = 20 };

int gbg_engine_is_short_range(const struct gbg_engine *engine)
{
    for (int f = 0; f < engine->scene.n_forces; f++) {
        if (engine->scene.force[f].sum != GBG_SUM_CUTOFF) {
            return 0;
        }
    }
    return 1;
}

int gbg_engine_has_direct_sums(const struct gbg_engine *engine)
{
    for (int f = 0; f < engine->scene.n_forces; f++) {
        if (engine->scene.force[f].sum == GBG_SUM_MINIMUM_IMAGE) {
            return 1;
        }
    }
    return 0;
}

/* Direct sums add in the order of memory, so that scenes with one keep it. */
static int may_arrange(const struct gbg_engine *engine)
{
    return !gbg_engine_has_direct_sums(engine) && engine->kernels->arrange &&
           engine->ordering != GBG_ORDERING_NEVER;
}

static int worth_it(struct gbg_engine *engine, const struct gbg_list *list, int64_t builds)
{
    if (engine->ordering == GBG_ORDERING_ALWAYS) {
        return 1;
    }
    double scatter = engine->kernels->list_scatter(list);
    if (engine->new_order) { /* the first list in it */
        engine->least_scatter = scatter;
        engine->new_order = 0;
    }
    return scatter > scattered && scatter > 2.0 * engine->least_scatter &&
           (engine->arranged_builds == 0 || builds - engine->arranged_builds >= PATIENCE);
}

int gbg_engine_tidy(struct gbg_engine *engine)
{
    const struct gbg_list *list = engine->pairs ? engine->pairs : engine->contacts;
    if (!list || !may_arrange(engine)) {
        return GBG_OK;
    }
    int64_t builds = engine->kernels->list_builds(list);
    if (builds == engine->seen_builds) {
        return GBG_OK;
    }
    engine->seen_builds = builds;
    if (!worth_it(engine, list, builds)) {
        return GBG_OK;
    }
    engine->arranged_builds = builds;
    engine->new_order = 1;
    engine->forces_current = 0;
    return engine->kernels->arrange(engine->device, &engine->state, 1);
}

int gbg_engine_order_by_id(struct gbg_engine *engine)
{
    if (!engine->state.rank) {
        return GBG_OK;
    }
    engine->forces_current = 0;
    return engine->kernels->arrange(engine->device, &engine->state, 0);
}
