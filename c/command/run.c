/* Command: gamboge run. */
#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "command/progress.h"
#include "command/report.h"
#include "command/session.h"
#include "core/file.h"

static volatile sig_atomic_t asked_to_stop;

static void note_signal(int number)
{
    asked_to_stop = number;
}

struct job {
    struct gbg_session session;
    struct gbg_trajectory *trajectory;
    char out[GBG_PATH_MOST];     /* trajectory, "": none */
    char partial[GBG_PATH_MOST]; /* name beside `out` while an older `out` must stay */
    int uses_partial;            /* frames go to `partial`, which becomes `out` at the end */
    char restart[GBG_PATH_MOST]; /* restart file to write, "": none */
    int64_t first, steps;        /* the run goes from step `first` to step `steps` */
    int64_t frame_every, restart_every;
    int64_t saved_at; /* step of the last restart file, -1: none */
    const char *json; /* file for the summary, NULL: none */
    int quiet;
    double seconds;
};

static int64_t present_step(const struct job *job)
{
    int64_t step = 0;
    gbg_engine_integer(job->session.engine, "step", &step);
    return step;
}

static int settle_json(const struct gbg_arguments *arguments, struct job *job)
{
    job->json = gbg_text_of(arguments, "json", NULL);
    if (!job->json) {
        return GBG_EXIT_DONE;
    }
    if (strcmp(job->json, job->out) == 0 || strcmp(job->json, job->restart) == 0) {
        return gbg_complain(GBG_EXIT_USE, "--json %s is another output of the run", job->json);
    }
    return gbg_check_output(job->json, arguments->operand);
}

/* Puts the command line's options over those of the scene and reads what the job needs of it. */
static int settle_options(const struct gbg_arguments *arguments, struct job *job)
{
    struct gbg_session *session = &job->session;
    if (gbg_given(arguments, "seed") &&
        gbg_scene_set_integer(session->scene, "run.seed", gbg_integer_of(arguments, "seed", 0)) !=
            GBG_OK) {
        return gbg_complain_library(GBG_EXIT_USE, session->context);
    }
    job->quiet = gbg_given(arguments, "quiet");
    job->steps = gbg_integer_of(arguments, "steps", gbg_session_integer(session, "run.steps", 0));
    snprintf(job->out, sizeof job->out, "%s",
             gbg_text_of(arguments, "out", gbg_session_text(session, "output.trajectory.file")));
    job->frame_every = gbg_session_integer(session, "output.trajectory.every", 0);
    if (job->frame_every < 1) {
        job->frame_every = job->steps > 100 ? job->steps / 100 : 1;
    }
    snprintf(job->restart, sizeof job->restart, "%s",
             gbg_session_text(session, "output.restart.file"));
    job->restart_every = gbg_session_integer(session, "output.restart.every", 0);
    int status = job->out[0] ? gbg_check_output(job->out, arguments->operand) : GBG_EXIT_DONE;
    if (!status && job->restart[0]) {
        status = gbg_check_output(job->restart, arguments->operand);
    }
    status = status ? status : settle_json(arguments, job);
    return status ? status : gbg_partial_name(job->out, job->partial);
}

static int load_restart(const struct gbg_arguments *arguments, struct job *job)
{
    const char *path = gbg_text_of(arguments, "restart", NULL);
    if (!path) {
        return GBG_EXIT_DONE;
    }
    int loaded = gbg_engine_load(job->session.engine, path);
    if (loaded != GBG_OK) {
        return gbg_complain_library(gbg_exit_of(loaded), job->session.context);
    }
    job->first = present_step(job);
    if (job->first >= job->steps) {
        return gbg_complain(GBG_EXIT_USE,
                            "%s is at step %lld already, and the run ends at step %lld: give "
                            "--steps a larger number",
                            path, (long long)job->first, (long long)job->steps);
    }
    return GBG_EXIT_DONE;
}

/* A fresh run leaves an existing trajectory alone until it is done; a restarted one goes on with
 * the frames of the run that was broken off, wherever these are. */
static int open_trajectory(struct job *job, int restarted)
{
    if (!job->out[0]) {
        return GBG_EXIT_DONE;
    }
    struct gbg_session *session = &job->session;
    int there = access(job->out, F_OK) == 0;
    int broken_off = access(job->partial, F_OK) == 0;
    job->uses_partial = restarted ? broken_off : there;
    const char *path = job->uses_partial ? job->partial : job->out;
    int status;
    if (restarted && (there || broken_off)) {
        status = gbg_trajectory_continue(session->engine, path, &job->trajectory);
    } else {
        status = gbg_trajectory_create(session->engine, path, &job->trajectory);
        status = status ? status : gbg_trajectory_append(job->trajectory, session->engine);
        if (status == GBG_OK && !job->uses_partial) {
            unlink(job->partial);
        }
    }
    return status ? gbg_complain_library(GBG_EXIT_FAILED, session->context) : GBG_EXIT_DONE;
}

/* Waits for frames that are still being written. */
static int settle(struct job *job)
{
    if (job->trajectory && gbg_trajectory_append_end(job->trajectory) != GBG_OK) {
        return gbg_complain_library(GBG_EXIT_FAILED, job->session.context);
    }
    return GBG_EXIT_DONE;
}

/* A run that goes on from the file finds every frame up to it. */
static int save_restart(struct job *job, int64_t step)
{
    if (!job->restart[0] || job->saved_at == step) {
        return GBG_EXIT_DONE;
    }
    int status = settle(job);
    if (status) {
        return status;
    }
    if (gbg_engine_save(job->session.engine, job->restart) != GBG_OK) {
        return gbg_complain_library(GBG_EXIT_FAILED, job->session.context);
    }
    job->saved_at = step;
    return GBG_EXIT_DONE;
}

static int64_t next_multiple(int64_t step, int64_t every, int64_t limit)
{
    int64_t next = every > 0 ? (step / every + 1) * every : limit;
    return next < limit ? next : limit;
}

static int write_outputs(struct job *job, int64_t step)
{
    if (job->trajectory && step % job->frame_every == 0 &&
        gbg_trajectory_append_begin(job->trajectory, job->session.engine) != GBG_OK) {
        return gbg_complain_library(GBG_EXIT_FAILED, job->session.context);
    }
    if (job->restart_every > 0 && step % job->restart_every == 0) {
        return save_restart(job, step);
    }
    return GBG_EXIT_DONE;
}

static int interrupted(struct job *job, int64_t step)
{
    int status = save_restart(job, step);
    if (status) {
        return status;
    }
    return gbg_complain(GBG_EXIT_FAILED, "stopped by signal %d after step %lld%s%s",
                        (int)asked_to_stop, (long long)step,
                        job->restart[0] ? "; go on with --restart "
                                        : "; nothing to restart from: "
                                          "the scene has no output.restart",
                        job->restart);
}

/* Runs in bites of about a tenth of a second, so that signals and the bar are served. */
static int advance(struct job *job)
{
    struct gbg_progress progress;
    gbg_progress_start(&progress, "step", job->first, job->steps, job->quiet);
    int64_t step = job->first, bite = 1;
    int status = GBG_EXIT_DONE;
    while (status == GBG_EXIT_DONE && step < job->steps && !asked_to_stop) {
        int64_t stop = next_multiple(step, job->trajectory ? job->frame_every : 0, job->steps);
        stop = next_multiple(step, job->restart[0] ? job->restart_every : 0, stop);
        stop = stop < step + bite ? stop : step + bite;
        double before = gbg_clock();
        int made = gbg_engine_run(job->session.engine, stop - step);
        double spent = gbg_clock() - before;
        if (spent < 0.05 && stop - step == bite) { /* an output did not end it earlier */
            bite *= 2;
        } else if (spent > 0.2 && bite > 1) {
            bite /= 2;
        }
        step = present_step(job);
        if (made != GBG_OK) {
            gbg_progress_end(&progress);
            gbg_complain_library(GBG_EXIT_FAILED, job->session.context);
            settle(job);
            return GBG_EXIT_FAILED;
        }
        status = write_outputs(job, step);
        gbg_progress_show(&progress, step);
    }
    gbg_progress_end(&progress);
    int written = settle(job);
    status = status ? status : written;
    job->seconds = gbg_clock() - progress.started;
    if (status == GBG_EXIT_DONE && step < job->steps) {
        return interrupted(job, step);
    }
    return status ? status : save_restart(job, step);
}

/* What became of pairs that were hard to part. */
static void print_cores(struct gbg_engine *engine)
{
    int64_t reverted = 0, repeated = 0, unfinished = 0, unsettled = 0, parted = 0, pushes = 0;
    double fraction = 0;
    gbg_engine_integer(engine, "reverted", &reverted);
    gbg_engine_integer(engine, "repeated", &repeated);
    gbg_engine_integer(engine, "events_left", &unfinished);
    gbg_engine_integer(engine, "unsettled", &unsettled);
    gbg_engine_integer(engine, "unsettled_pairs", &parted);
    gbg_engine_integer(engine, "contact_pairs", &pushes);
    gbg_engine_real(engine, "reverted_fraction", &fraction);
    printf("put back       %lld moves, %.1e of all", (long long)reverted, fraction);
    if (repeated > 0) {
        printf("; %lld steps were corrected twice", (long long)repeated);
    }
    if (unfinished > 0) {
        printf("; %lld times a particle had too many collisions in a step and went on straight",
               (long long)unfinished);
    }
    printf("\n");
    if (unsettled > 0) {
        printf("unsettled      %lld solves of pressed contacts came to their limit of rounds; "
               "%.2g %% of all pushes parted what they left\n",
               (long long)unsettled, pushes > 0 ? 100.0 * (double)parted / (double)pushes : 0.0);
    }
}

static void print_summary(const struct job *job)
{
    int64_t n = 0, rounds = 0, left = -1;
    double dt = 0, busy = 0, checks = 0;
    int cores = strcmp(gbg_session_text(&job->session, "excluded_volume.rule"), "none") != 0;
    int dimension;
    int64_t steps = job->steps - job->first;
    gbg_engine_size(job->session.engine, &n, &dimension);
    gbg_engine_integer(job->session.engine, "contact_rounds", &rounds);
    gbg_engine_integer(job->session.engine, "overlaps_left", &left);
    gbg_engine_real(job->session.engine, "dt", &dt);
    gbg_engine_real(job->session.engine, "seconds", &busy);
    gbg_engine_real(job->session.engine, "check_seconds", &checks);
    printf("done           %s steps of %s particles, to time %g\n", gbg_count_text(steps),
           gbg_count_text(n), dt * (double)job->steps);
    printf("backend        %s\n", gbg_backend_text(job->session.context));
    printf("wall time      %s, of it %s in steps", gbg_duration_text(job->seconds),
           gbg_duration_text(busy));
    if (checks > 0) {
        printf(", %s in measuring long-range forces", gbg_duration_text(checks));
    }
    printf("\n");
    if (steps > 0 && n > 0) {
        printf("speed          %.1f ns per particle-step\n",
               1e9 * busy / ((double)steps * (double)n));
        printf("overlap rounds %.2f a step\n", (double)rounds / (double)steps);
    }
    printf("overlaps left  %lld\n", (long long)left);
    if (cores) {
        print_cores(job->session.engine);
    }
    gbg_session_print_error(&job->session);
    if (job->out[0]) {
        printf("trajectory     %s\n", job->out);
    }
    if (job->restart[0]) {
        printf("restart        %s\n", job->restart);
    }
}

static int finish(struct job *job, const struct gbg_arguments *arguments)
{
    int64_t left = 0;
    char hash[65];
    gbg_trajectory_destroy(&job->trajectory);
    if (job->uses_partial &&
        gbg_file_commit(job->session.context, job->partial, job->out) != GBG_OK) {
        return gbg_complain_library(GBG_EXIT_FAILED, job->session.context);
    }
    if (!job->quiet) {
        print_summary(job);
    }
    if (gbg_given(arguments, "hash") &&
        gbg_engine_hash(job->session.engine, sizeof hash, hash) == GBG_OK) {
        printf("state          %s\n", hash);
    }
    const struct gbg_run_report report = {&job->session, arguments->operand, job->first, job->steps,
                                          job->seconds};
    int status = job->json ? gbg_report_write(&report, job->json) : GBG_EXIT_DONE;
    gbg_engine_integer(job->session.engine, "overlaps_left", &left);
    if (status) {
        return status;
    }
    return left == 0 ? GBG_EXIT_DONE
                     : gbg_complain(GBG_EXIT_FAILED, "%lld overlaps are left", (long long)left);
}

static void watch_signals(void)
{
    struct sigaction action = {.sa_handler = note_signal, .sa_flags = SA_RESTART | SA_RESETHAND};
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
}

static int run(const struct gbg_arguments *arguments, struct job *job)
{
    int status = gbg_session_open(arguments, &job->session);
    status = status ? status : settle_options(arguments, job);
    status = status ? status : gbg_session_start(&job->session);
    status = status ? status : load_restart(arguments, job);
    if (status) {
        return status;
    }
    watch_signals();
    status = open_trajectory(job, gbg_given(arguments, "restart"));
    status = status ? status : advance(job);
    if (status && job->uses_partial && access(job->partial, F_OK) == 0) {
        return gbg_complain(status, "%s is as it was; the frames of this run are in %s", job->out,
                            job->partial);
    }
    return status ? status : finish(job, arguments);
}

int gbg_command_run(const struct gbg_arguments *arguments)
{
    struct job job = {.saved_at = -1};
    int status = run(arguments, &job);
    gbg_trajectory_destroy(&job.trajectory);
    gbg_session_close(&job.session);
    return status;
}
