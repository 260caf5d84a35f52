/* L4: restart files and the file of forces. */
#include "core/context.h"
#include "engine/view.h"
#include "gamboge/trajectory.h"
#include "io/forces_file.h"
#include "io/restart.h"

/* Pair interactions that measuring the error of the forces may take. */
static const int64_t error_pairs = INT64_C(2000000000);

static int named(struct gbg_context *context, int status, const char *call)
{
    if (status != GBG_OK) {
        gbg_message_prefix(context, "%s", call);
    }
    return status;
}

static int check(struct gbg_engine *engine, const char *path, const char *call,
                 struct gbg_engine_view *view)
{
    if (!engine) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "%s: engine is NULL", call);
    }
    int status = gbg_engine_look(engine, view);
    if (status != GBG_OK) {
        return named(view->context, status, call);
    }
    if (!path || !path[0]) {
        return gbg_fail(view->context, GBG_E_ARGUMENT, "%s: path is %s", call,
                        path ? "empty" : "NULL");
    }
    return GBG_OK;
}

int gbg_engine_save(struct gbg_engine *engine, const char *path)
{
    static const char call[] = "gbg_engine_save";
    struct gbg_engine_view view;
    int status = check(engine, path, call, &view);
    return status == GBG_OK ? named(view.context, gbg_restart_save(engine, &view, path), call)
                            : status;
}

int gbg_engine_load(struct gbg_engine *engine, const char *path)
{
    static const char call[] = "gbg_engine_load";
    struct gbg_engine_view view;
    int status = check(engine, path, call, &view);
    return status == GBG_OK ? named(view.context, gbg_restart_load(engine, &view, path), call)
                            : status;
}

/* Samples against a direct sum: 1000, or what the work allows for very many particles. */
static int measure(struct gbg_engine *engine, const struct gbg_engine_view *view,
                   struct gbg_force_error *error)
{
    if (view->scene->n_forces == 0 || view->n < 2) {
        return GBG_OK;
    }
    int64_t most = error_pairs / view->n;
    error->samples = most > 1000 ? 1000 : most < 10 ? 10 : most;
    error->samples = error->samples < view->n ? error->samples : view->n;
    return gbg_engine_force_error(engine, error->samples, &error->over_rms, &error->over_median);
}

int gbg_engine_write_forces(struct gbg_engine *engine, const char *path)
{
    static const char call[] = "gbg_engine_write_forces";
    struct gbg_engine_view view;
    struct gbg_force_error error = {0};
    int status = check(engine, path, call, &view);
    if (status == GBG_OK) {
        status = measure(engine, &view, &error);
    }
    return status == GBG_OK
               ? named(view.context, gbg_forces_write(engine, &view, &error, path), call)
               : status;
}
