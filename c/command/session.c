/* Command: a scene file read, the options of the command line put over it, and its engine. */
#include "command/session.h"

#include <math.h>

int gbg_session_open(const struct gbg_arguments *arguments, struct gbg_session *session)
{
    *session = (struct gbg_session){0};
    int status = gbg_open_context(gbg_text_of(arguments, "backend", NULL),
                                  gbg_integer_of(arguments, "threads", 0), &session->context);
    if (status) {
        return status;
    }
    if (gbg_scene_read(session->context, arguments->operand, &session->scene) != GBG_OK ||
        gbg_scene_check(session->scene) != GBG_OK) {
        return gbg_complain_library(GBG_EXIT_USE, session->context);
    }
    return GBG_EXIT_DONE;
}

int gbg_session_start(struct gbg_session *session)
{
    int status = gbg_engine_create(session->scene, &session->engine);
    if (status == GBG_OK) {
        return GBG_EXIT_DONE;
    }
    return gbg_complain_library(gbg_exit_of(status), session->context);
}

void gbg_session_close(struct gbg_session *session)
{
    gbg_engine_destroy(&session->engine);
    gbg_scene_destroy(&session->scene);
    gbg_context_destroy(&session->context);
}

double gbg_session_real(const struct gbg_session *session, const char *option, double fallback)
{
    double value;
    return gbg_scene_get_real(session->scene, option, &value) == GBG_OK ? value : fallback;
}

int64_t gbg_session_integer(const struct gbg_session *session, const char *option, int64_t fallback)
{
    int64_t value;
    return gbg_scene_get_integer(session->scene, option, &value) == GBG_OK ? value : fallback;
}

const char *gbg_session_text(const struct gbg_session *session, const char *option)
{
    static char text[GBG_PATH_MOST];
    text[0] = 0;
    gbg_scene_get_text(session->scene, option, sizeof text, text);
    return text;
}

/* Of sums over all images: what was asked for, and what the check at the start of the run found. */
static void print_sums(const struct gbg_session *session, int n_forces)
{
    for (int f = 0; f < n_forces; f++) {
        double tolerance, predicted, measured;
        int refined;
        if (gbg_engine_get_sum(session->engine, f, &tolerance, &predicted, &measured, &refined) !=
            GBG_OK) {
            continue;
        }
        printf("forces[%d]      tolerance %.2g, ", f, tolerance);
        printf(measured >= 0 ? "measured %.2g" : "not measured", measured);
        printf(", by the model %.2g", predicted);
        if (refined > 0) {
            printf(", refined %d time%s", refined, refined > 1 ? "s" : "");
        }
        printf("\n");
    }
}

void gbg_session_print_error(const struct gbg_session *session)
{
    int n_forces = 0;
    double over_rms, over_median;
    gbg_scene_size(session->scene, NULL, &n_forces);
    if (n_forces == 0) {
        printf("force error    none: no forces\n");
    } else if (gbg_engine_force_error(session->engine, 0, &over_rms, &over_median) != GBG_OK) {
        printf("force error    not measured: %s\n", gbg_message(session->context));
    } else if (isfinite(over_median)) {
        printf("force error    rms(dF)/rms(F) %.2g, rms(dF)/median|F| %.2g\n", over_rms,
               over_median);
    } else {
        printf("force error    rms(dF)/rms(F) %.2g; most forces are zero\n", over_rms);
    }
    print_sums(session, n_forces);
}
