/* Analysis room: what the first frame decides: modes, shells, method, mesh. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "analysis/analysis.h"
#include "core/memory.h"

static const double two_pi = 6.283185307179586477;

enum { MOST_SHELLS = 10000000 };

/* 8 pi over the mean distance of particles. */
static double default_k_max(const struct gbg_analysis *analysis, int64_t n)
{
    double volume = 1;
    for (int a = 0; a < analysis->dimension; a++) {
        volume *= analysis->lengths[a];
    }
    return 4 * two_pi / pow(volume / (double)n, 1.0 / analysis->dimension);
}

/* Modes as their numbers only, to weigh a k_max by. */
static void sketch(const struct gbg_analysis *analysis, double k_max, struct gbg_modes *modes,
                   struct gbg_density_plan *plan)
{
    *modes = (struct gbg_modes){.dimension = analysis->dimension};
    double count = 0.5;
    for (int a = 0; a < analysis->dimension; a++) {
        modes->reach[a] = gbg_modes_reach(analysis->lengths[a], k_max);
        count *= 2.0 * modes->reach[a] + 1;
    }
    modes->count = (int64_t)fmin(count, 0x1p62);
    gbg_density_weigh(modes, plan);
}

static double bytes_of(const struct gbg_density_plan *plan)
{
    return plan->method == GBG_DENSITY_MESH ? plan->mesh_bytes : plan->direct_bytes;
}

static int refuse_size(const struct gbg_analysis *analysis, double k_max,
                       const struct gbg_density_plan *plan)
{
    char what[96] = "tables of the direct sum", hint[64] = "";
    if (plan->method == GBG_DENSITY_MESH) {
        int third = analysis->dimension == 3 ? plan->cells[2] : 1;
        snprintf(what, sizeof what, "a mesh of %d x %d x %d nodes", plan->cells[0], plan->cells[1],
                 third);
        snprintf(hint, sizeof hint, ", or take method direct (slower, less memory)");
    }
    return gbg_fail(
        analysis->context, GBG_E_MEMORY,
        "gbg_analysis_add_frame: k_max %g needs %s, %.3g bytes in all, and memory_limit "
        "is %.3g: lower k_max or raise memory_limit%s",
        k_max, what, bytes_of(plan), analysis->settings.memory_limit, hint);
}

/* Settles k_max and the method. A default k_max gives way until the mesh fits. */
static int settle(struct gbg_analysis *analysis, int64_t n, struct gbg_density_plan *plan)
{
    const struct gbg_analysis_settings *set = &analysis->settings;
    struct gbg_density_plan fresh = {.dimension = analysis->dimension,
                                     .channels = set->partials ? analysis->n_species : 1,
                                     .n = n,
                                     .tolerance = set->tolerance,
                                     .method = set->method};
    double longest = 0, k_max = set->k_max > 0 ? set->k_max : default_k_max(analysis, n);
    for (int a = 0; a < analysis->dimension; a++) {
        longest = fmax(longest, analysis->lengths[a]);
    }
    for (;; k_max *= 0.95) {
        struct gbg_modes modes;
        if (gbg_modes_reach(longest, k_max) < 0) {
            return gbg_fail(analysis->context, GBG_E_ARGUMENT,
                            "gbg_analysis_add_frame: k_max %g in "
                            "a box of length %g has more than 2^30 modes on an axis",
                            k_max, longest);
        }
        *plan = fresh;
        sketch(analysis, k_max, &modes, plan);
        if (bytes_of(plan) <= set->memory_limit && modes.count < INT32_MAX) {
            break;
        }
        if (set->k_max > 0 || gbg_modes_reach(longest, 0.95 * k_max) < 1) {
            return refuse_size(analysis, k_max, plan);
        }
    }
    if (gbg_modes_reach(longest, k_max) < 1) {
        return gbg_fail(analysis->context, GBG_E_ARGUMENT,
                        "gbg_analysis_add_frame: k_max %g lies "
                        "below the smallest wave number of the box, %g",
                        k_max, two_pi / longest);
    }
    if (set->k_max <= 0 && k_max < default_k_max(analysis, n)) {
        gbg_log(analysis->context, GBG_LOG_INFO,
                "structure factor: k_max lowered from %g to %g so "
                "that the mesh fits into memory_limit",
                default_k_max(analysis, n), k_max);
    }
    analysis->k_max = k_max;
    return GBG_OK;
}

static int make_shells(struct gbg_analysis *analysis)
{
    double width = analysis->settings.shell_width;
    if (!(width > 0)) {
        double longest = 0;
        for (int a = 0; a < analysis->dimension; a++) {
            longest = fmax(longest, analysis->lengths[a]);
        }
        width = two_pi / longest;
    }
    if (analysis->k_max / width > MOST_SHELLS) {
        return gbg_fail(analysis->context, GBG_E_ARGUMENT,
                        "gbg_analysis_add_frame: shell_width %g "
                        "cuts k_max %g into more than %d shells",
                        width, analysis->k_max, MOST_SHELLS);
    }
    return gbg_shells_make(analysis->context, &analysis->modes, analysis->lengths, analysis->k_max,
                           width, &analysis->shells);
}

static int allocate_sums(struct gbg_analysis *analysis)
{
    struct gbg_context *context = analysis->context;
    int species = analysis->n_species;
    int64_t shells = analysis->shells.count;
    analysis->pairs = analysis->settings.partials ? species * (species + 1) / 2 : 0;
    analysis->columns = GBG_COLUMN_PAIRS + 2 * analysis->pairs;
    void *values, *frames;
    int status = gbg_allocate_zero(context, &values, 3 * analysis->columns * shells, sizeof(double),
                                   "sums of shells");
    analysis->frame = values;
    if (status == GBG_OK) {
        analysis->sum = analysis->frame + analysis->columns * shells;
        analysis->carry = analysis->sum + analysis->columns * shells;
        status = gbg_allocate_zero(context, &frames, shells, sizeof(int64_t), "frames of shells");
        analysis->frames_of = frames;
    }
    if (status == GBG_OK) {
        status = gbg_blocking_make(context, (1 + analysis->pairs) * shells, &analysis->blocking);
    }
    return status;
}

int gbg_analysis_begin(struct gbg_analysis *analysis, const struct gbg_analysis_frame *frame)
{
    struct gbg_density_plan plan;
    int64_t n = frame->points.n;
    int status = settle(analysis, n, &plan);
    if (status == GBG_OK) {
        status = gbg_modes_make(analysis->context, analysis->dimension, analysis->lengths,
                                analysis->k_max, &analysis->modes);
    }
    if (status == GBG_OK) {
        status = make_shells(analysis);
    }
    if (status == GBG_OK) {
        status = gbg_density_make(analysis->context, &analysis->modes, &plan, &analysis->density);
    }
    if (status == GBG_OK) {
        status = allocate_sums(analysis);
    }
    if (status != GBG_OK) {
        gbg_analysis_forget(analysis);
        return status;
    }
    analysis->n = n;
    return GBG_OK;
}

void gbg_analysis_forget(struct gbg_analysis *analysis)
{
    gbg_density_free(analysis->density);
    analysis->density = NULL;
    gbg_shells_free(&analysis->shells);
    gbg_modes_free(&analysis->modes);
    gbg_blocking_free(&analysis->blocking);
    gbg_release(analysis->frame);
    gbg_release(analysis->frames_of);
    analysis->frame = analysis->sum = analysis->carry = NULL;
    analysis->frames_of = NULL;
    analysis->frames = analysis->n = 0;
    analysis->largest_bound = 0;
}
