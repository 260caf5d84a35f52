/* Command: the summary of a run as JSON. */
#include "command/report.h"

#include <math.h>

#include "bench/machine.h"
#include "core/context.h"
#include "core/file.h"

static void put_name(FILE *file, const char *name)
{
    fprintf(file, "%s\n \"%s\": ", ftell(file) > 1 ? "," : "", name);
}

static void put_text(FILE *file, const char *name, const char *text)
{
    put_name(file, name);
    fputc('"', file);
    for (; *text; text++) {
        unsigned char letter = (unsigned char)*text;
        if (letter < 0x20) {
            fprintf(file, "\\u%04x", letter);
        } else {
            fprintf(file, letter == '"' || letter == '\\' ? "\\%c" : "%c", letter);
        }
    }
    fputc('"', file);
}

static void put_integer(FILE *file, const char *name, int64_t value)
{
    put_name(file, name);
    fprintf(file, "%lld", (long long)value);
}

static void put_real(FILE *file, const char *name, double value)
{
    put_name(file, name);
    fprintf(file, isfinite(value) ? "%.9g" : "null", value);
}

/* Counters of the engine, all sums over the steps of this run. */
static void put_counters(FILE *file, const struct gbg_run_report *report)
{
    static const char *const names[] = {"contact_rounds",  "contact_pairs", "reverted",
                                        "repeated",        "events_left",   "unsettled",
                                        "unsettled_pairs", "list_builds",   "overlaps_left"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        int64_t value;
        if (gbg_engine_integer(report->session->engine, names[k], &value) == GBG_OK) {
            put_integer(file, names[k], value);
        }
    }
}

static void put_error(FILE *file, const struct gbg_session *session)
{
    int n_forces = 0;
    double over_rms = NAN, over_median = NAN;
    gbg_scene_size(session->scene, NULL, &n_forces);
    if (n_forces == 0 ||
        gbg_engine_force_error(session->engine, 0, &over_rms, &over_median) != GBG_OK) {
        over_rms = over_median = NAN;
    }
    put_real(file, "force_error_over_rms", over_rms);
    put_real(file, "force_error_over_median", over_median);
}

/* Of sums over all images, one number a force; null for others. */
static void put_sums(FILE *file, const struct gbg_session *session)
{
    static const char *const names[] = {"force_tolerance", "force_error_predicted",
                                        "force_error_measured", "force_refined"};
    int n_forces = 0, sums = 0, refined = 0;
    double value[3];
    gbg_scene_size(session->scene, NULL, &n_forces);
    for (int f = 0; f < n_forces; f++) {
        sums += gbg_engine_get_sum(session->engine, f, value, NULL, NULL, NULL) == GBG_OK;
    }
    double seconds = 0;
    gbg_engine_real(session->engine, "check_seconds", &seconds);
    if (sums > 0) {
        put_real(file, "check_seconds", seconds);
    }
    for (int k = 0; k < 4 && sums > 0; k++) {
        put_name(file, names[k]);
        for (int f = 0; f < n_forces; f++) {
            int there = gbg_engine_get_sum(session->engine, f, &value[0], &value[1], &value[2],
                                           &refined) == GBG_OK;
            fputs(f ? ", " : "[", file);
            if (!there || (k < 3 && value[k] < 0)) {
                fputs("null", file);
            } else {
                fprintf(file, "%.9g", k < 3 ? value[k] : refined);
            }
        }
        fputs("]", file);
    }
}

static void put_speed(FILE *file, const struct gbg_run_report *report)
{
    struct gbg_engine *engine = report->session->engine;
    int64_t n = 0, rounds = 0;
    int dimension = 0;
    double dt = NAN, busy = NAN, packing = NAN, steps = (double)(report->last - report->first);
    gbg_engine_size(engine, &n, &dimension);
    gbg_engine_integer(engine, "contact_rounds", &rounds);
    gbg_engine_real(engine, "dt", &dt);
    gbg_engine_real(engine, "seconds", &busy);
    gbg_engine_real(engine, "packing", &packing);
    put_integer(file, "particles", n);
    put_integer(file, "dimension", dimension);
    put_real(file, "packing", packing);
    put_real(file, "dt", dt);
    put_real(file, "time", dt * (double)report->last);
    put_real(file, "wall_seconds", report->seconds);
    put_real(file, "step_seconds", busy);
    put_real(file, "ns_per_particle_step", 1e9 * busy / (steps * (double)n));
    put_real(file, "rounds_per_step", (double)rounds / steps);
}

static void put_all(FILE *file, const struct gbg_run_report *report)
{
    const struct gbg_session *session = report->session;
    const char *backend, *instructions;
    int threads;
    char hash[65] = "";
    gbg_context_backend(session->context, &backend, &instructions, &threads);
    gbg_engine_hash(session->engine, sizeof hash, hash);
    fputc('{', file);
    put_text(file, "scene", report->scene);
    put_text(file, "rule", gbg_session_text(session, "excluded_volume.rule"));
    put_integer(file, "seed", gbg_session_integer(session, "run.seed", 0));
    put_integer(file, "first_step", report->first);
    put_integer(file, "steps", report->last - report->first);
    put_speed(file, report);
    put_counters(file, report);
    put_error(file, session);
    put_sums(file, session);
    put_text(file, "backend", backend);
    put_text(file, "instructions", instructions);
    if (session->context->card[0]) {
        put_text(file, "gpu", session->context->card);
    }
    put_integer(file, "threads", threads);
    put_text(file, "state", hash);
    put_text(file, "commit", gbg_machine_commit());
    fputs("\n}\n", file);
}

int gbg_report_write(const struct gbg_run_report *report, const char *path)
{
    struct gbg_context *context = report->session->context;
    char temporary[GBG_PATH_MOST];
    if (gbg_file_temporary(context, path, temporary, sizeof temporary) != GBG_OK) {
        return gbg_complain_library(GBG_EXIT_FAILED, context);
    }
    FILE *file = fopen(temporary, "w");
    int failed = !file;
    if (file) {
        put_all(file, report);
        failed = ferror(file) != 0;
        failed |= fclose(file) != 0;
    }
    if (failed) {
        gbg_file_abandon(temporary);
        return gbg_complain(GBG_EXIT_FAILED, "%s could not be written", path);
    }
    if (gbg_file_commit(context, temporary, path) != GBG_OK) {
        gbg_file_abandon(temporary);
        return gbg_complain_library(GBG_EXIT_FAILED, context);
    }
    return GBG_EXIT_DONE;
}
