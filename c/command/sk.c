/* Command: gamboge sk. */
#include <stdlib.h>

#include "command/frames.h"
#include "command/progress.h"
#include "core/sha256.h"

struct sk_job {
    struct gbg_frames frames;
    struct gbg_analysis *analysis;
    int64_t first, last, stride;
};

static int fail_library(const struct sk_job *job, int exit_status)
{
    return gbg_complain_library(exit_status, job->frames.context);
}

static int make_analysis(const struct gbg_arguments *arguments, struct sk_job *job)
{
    struct gbg_frames *frames = &job->frames;
    int status = gbg_analysis_create(frames->context, frames->dimension, frames->length,
                                     frames->n_species, &job->analysis);
    if (status == GBG_OK && gbg_given(arguments, "kmax")) {
        status = gbg_analysis_set_real(job->analysis, "k_max", gbg_real_of(arguments, "kmax", 0));
    }
    if (status == GBG_OK && gbg_given(arguments, "tolerance")) {
        status = gbg_analysis_set_real(job->analysis, "tolerance",
                                       gbg_real_of(arguments, "tolerance", 0));
    }
    if (status == GBG_OK && gbg_given(arguments, "method")) {
        status = gbg_analysis_set_text(job->analysis, "method",
                                       gbg_text_of(arguments, "method", "auto"));
    }
    if (status == GBG_OK && gbg_given(arguments, "types")) {
        status = gbg_analysis_set_text(job->analysis, "partials", "yes");
    }
    return status ? fail_library(job, GBG_EXIT_USE) : GBG_EXIT_DONE;
}

static int name_contents(const struct gbg_arguments *arguments, struct sk_job *job)
{
    const struct gbg_frames *frames = &job->frames;
    char digest[65], history[2 * GBG_PATH_MOST], title[GBG_PATH_MOST];
    if (gbg_sha256_file(frames->path, digest) != 0) {
        return gbg_complain(GBG_EXIT_FAILED, "%s cannot be read", frames->path);
    }
    snprintf(title, sizeof title, "Structure factor of %s", gbg_base_name(frames->path));
    snprintf(history, sizeof history, "gamboge sk %s --out %s: frames %lld to %lld, every %lld",
             frames->path, gbg_text_of(arguments, "out", ""), (long long)job->first,
             (long long)job->last, (long long)job->stride);
    int status = gbg_analysis_set_attribute(job->analysis, "title", title);
    status =
        status ? status : gbg_analysis_set_attribute(job->analysis, "input_files", frames->path);
    status = status ? status : gbg_analysis_set_attribute(job->analysis, "input_sha256", digest);
    status = status ? status : gbg_analysis_set_attribute(job->analysis, "history", history);
    for (int s = 0; s < frames->n_species && status == GBG_OK; s++) {
        char name[GBG_TEXT_MOST];
        gbg_frames_species_name(frames, s, sizeof name, name);
        status = gbg_analysis_set_species_name(job->analysis, s, name);
    }
    return status ? fail_library(job, GBG_EXIT_FAILED) : GBG_EXIT_DONE;
}

static int add_frames(struct sk_job *job)
{
    struct gbg_frames *frames = &job->frames;
    struct gbg_progress progress;
    gbg_progress_start(&progress, "frame", job->first, job->last, 0);
    int status = GBG_EXIT_DONE;
    for (int64_t f = job->first; f <= job->last && !status; f += job->stride) {
        status = gbg_frames_load(frames, f);
        double stored = frames->is_double ? 0 : gbg_frames_storage_error(frames);
        if (!status &&
            gbg_analysis_add_frame(job->analysis, frames->n, frames->r[0], frames->r[1],
                                   frames->dimension == 3 ? frames->r[2] : NULL, 1, frames->species,
                                   0, frames->length, stored) != GBG_OK) {
            gbg_progress_end(&progress);
            return fail_library(job, GBG_EXIT_FAILED);
        }
        gbg_progress_show(&progress, f);
    }
    gbg_progress_end(&progress);
    return status;
}

enum { TABLE_ROWS = 8 };

/* A few shells, evenly over the range, with all that is known of their errors. */
static int print_table(const struct sk_job *job, int64_t shells)
{
    static const char *const column[] = {"k", "n_modes", "S", "S_stderr", "S_numerr"};
    double *value[5] = {NULL};
    int status = GBG_OK;
    for (int c = 0; c < 5; c++) {
        value[c] = calloc((size_t)shells + 1, sizeof *value[c]);
        status = status ? status
                        : (value[c] ? gbg_analysis_get(job->analysis, column[c], shells, value[c])
                                    : GBG_E_MEMORY);
    }
    if (status == GBG_OK) {
        printf("%10s %8s %12s %12s %12s\n", "k sigma", "modes", "S(k)", "stat. error",
               "num. bound");
        int64_t rows = shells < TABLE_ROWS ? shells : TABLE_ROWS;
        for (int64_t i = 0; i < rows; i++) {
            int64_t s = rows > 1 ? i * (shells - 1) / (rows - 1) : 0;
            printf("%10.4f %8.0f %12.5g %12.2g %12.2g\n", value[0][s], value[1][s], value[2][s],
                   value[3][s], value[4][s]);
        }
    }
    for (int c = 0; c < 5; c++) {
        free(value[c]);
    }
    return status ? fail_library(job, GBG_EXIT_FAILED) : GBG_EXIT_DONE;
}

static int report(const struct gbg_arguments *arguments, const struct sk_job *job)
{
    int64_t shells, frames;
    char chosen[GBG_TEXT_MOST];
    if (gbg_analysis_size(job->analysis, &shells, &frames) != GBG_OK ||
        gbg_analysis_describe(job->analysis, sizeof chosen, chosen) != GBG_OK) {
        return fail_library(job, GBG_EXIT_FAILED);
    }
    printf("method         %s\n", chosen);
    printf("frames         %s of %s (%s particles, coordinates %s)\n", gbg_count_text(frames),
           job->frames.path, gbg_count_text(job->frames.n),
           job->frames.is_double ? "double" : "float");
    int status = print_table(job, shells);
    printf("written        %s, %s shells\n", gbg_text_of(arguments, "out", ""),
           gbg_count_text(shells));
    return status;
}

static int structure_factor(const struct gbg_arguments *arguments, struct sk_job *job)
{
    const char *out = gbg_text_of(arguments, "out", NULL);
    int status = gbg_check_output(out, arguments->operand);
    status = status ? status : gbg_frames_open(arguments, &job->frames);
    status = status
                 ? status
                 : gbg_frames_range(arguments, &job->frames, &job->first, &job->last, &job->stride);
    status = status ? status : gbg_frames_load(&job->frames, job->first);
    status = status ? status : make_analysis(arguments, job);
    status = status ? status : name_contents(arguments, job);
    status = status ? status : add_frames(job);
    if (!status && gbg_analysis_write(job->analysis, out) != GBG_OK) {
        return fail_library(job, GBG_EXIT_FAILED);
    }
    return status ? status : report(arguments, job);
}

int gbg_command_sk(const struct gbg_arguments *arguments)
{
    struct sk_job job = {0};
    int status = structure_factor(arguments, &job);
    gbg_analysis_destroy(&job.analysis);
    gbg_frames_close(&job.frames);
    return status;
}
