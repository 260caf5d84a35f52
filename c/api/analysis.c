/* L4: the structure factor: its object, settings and frames. */
#include "analysis/analysis.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "core/text.h"

static const char *const call_create = "gbg_analysis_create";
static const double default_tolerance = 1e-6, default_memory_limit = 4294967296.0;

static int bad_length(const double *lengths, int dimension)
{
    for (int a = 0; a < dimension; a++) {
        /* Far from the limits of double, so that no product of lengths can leave them. */
        if (!(lengths[a] >= 1e-90 && lengths[a] <= 1e90)) {
            return a;
        }
    }
    return -1;
}

static int check_create(struct gbg_context *context, int dimension, const double *lengths,
                        int n_species, struct gbg_analysis **analysis)
{
    if (!context || !lengths || !analysis) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: %s is NULL", call_create,
                        !context   ? "context"
                        : !lengths ? "lengths"
                                   : "analysis");
    }
    if (dimension != 2 && dimension != 3) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: dimension is %d; it must be 2 or 3",
                        call_create, dimension);
    }
    if (n_species < 1 || n_species > GBG_MOST_SPECIES) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: n_species is %d; it must be 1 to %d",
                        call_create, n_species, GBG_MOST_SPECIES);
    }
    int axis = bad_length(lengths, dimension);
    if (axis >= 0) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: lengths[%d] is %g; it must be from 1e-90 to "
                        "1e90",
                        call_create, axis, lengths[axis]);
    }
    return GBG_OK;
}

int gbg_analysis_create(struct gbg_context *context, int dimension, const double *lengths,
                        int n_species, struct gbg_analysis **analysis)
{
    int status = check_create(context, dimension, lengths, n_species, analysis);
    if (analysis) {
        *analysis = NULL;
    }
    if (status != GBG_OK) {
        return status;
    }
    void *body;
    status = gbg_allocate_zero(context, &body, 1, sizeof **analysis, call_create);
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_analysis *made = body;
    made->context = context;
    made->dimension = dimension;
    made->n_species = n_species;
    memcpy(made->lengths, lengths, (size_t)dimension * sizeof *lengths);
    made->settings.tolerance = default_tolerance;
    made->settings.memory_limit = default_memory_limit;
    for (int a = 0; a < n_species; a++) {
        snprintf(made->species_name[a], GBG_SPECIES_NAME, "%c", 'A' + a);
    }
    *analysis = made;
    return GBG_OK;
}

int gbg_analysis_destroy(struct gbg_analysis **analysis)
{
    if (analysis && *analysis) {
        gbg_analysis_forget(*analysis);
        for (int i = 0; i < GBG_TEXTS; i++) {
            gbg_release((*analysis)->text[i]);
        }
        gbg_release(*analysis);
        *analysis = NULL;
    }
    return GBG_OK;
}

static int check_setting(struct gbg_analysis *analysis, const char *option, const char *call)
{
    if (!analysis || !option) {
        return gbg_fail(analysis ? analysis->context : NULL, GBG_E_ARGUMENT, "%s: %s is NULL", call,
                        analysis ? "option" : "analysis");
    }
    if (analysis->frames > 0) {
        return gbg_fail(analysis->context, GBG_E_ORDER,
                        "%s: \"%s\" must be set before the first "
                        "frame; there are %lld",
                        call, option, (long long)analysis->frames);
    }
    return GBG_OK;
}

static int unknown(struct gbg_analysis *analysis, const char *call, const char *what,
                   const char *name, const char *const *list)
{
    return gbg_fail(analysis->context, GBG_E_NAME,
                    "%s: there is no %s \"%s\"; the nearest is "
                    "\"%s\"",
                    call, what, name, gbg_text_nearest(name, list));
}

int gbg_analysis_set_real(struct gbg_analysis *analysis, const char *option, double value)
{
    static const char *const call = "gbg_analysis_set_real";
    static const char *const names[] = {"k_max", "tolerance", "shell_width", "memory_limit", NULL};
    static const double least[] = {1e-90, 1e-15, 1e-90, 1e6}, most[] = {1e90, 0.1, 1e90, 1e18};
    int status = check_setting(analysis, option, call);
    if (status != GBG_OK) {
        return status;
    }
    double *const place[] = {&analysis->settings.k_max, &analysis->settings.tolerance,
                             &analysis->settings.shell_width, &analysis->settings.memory_limit};
    int i = gbg_text_find(option, names);
    if (i < 0) {
        return unknown(analysis, call, "real option", option, names);
    }
    if (!(value >= least[i] && value <= most[i])) {
        return gbg_fail(analysis->context, GBG_E_ARGUMENT, "%s: %s is %g; it must be from %g to %g",
                        call, option, value, least[i], most[i]);
    }
    *place[i] = value;
    return GBG_OK;
}

static int set_method(struct gbg_analysis *analysis, const char *call, int method)
{
#ifndef GBG_WITH_FFTW
    if (method == GBG_DENSITY_MESH) {
        return gbg_fail(analysis->context, GBG_E_UNBUILT,
                        "%s: method mesh needs FFTW; configure "
                        "with -DGBG_WITH_FFTW=ON (Debian: libfftw3-dev), or take method direct",
                        call);
    }
#endif
    (void)call;
    analysis->settings.method = method;
    return GBG_OK;
}

int gbg_analysis_set_text(struct gbg_analysis *analysis, const char *option, const char *value)
{
    static const char *const call = "gbg_analysis_set_text";
    static const char *const names[] = {"method", "partials", NULL};
    static const char *const methods[] = {"auto", "mesh", "direct", NULL};
    static const char *const answers[] = {"no", "yes", NULL};
    int status = check_setting(analysis, option, call);
    if (status != GBG_OK) {
        return status;
    }
    int i = gbg_text_find(option, names);
    if (i < 0) {
        return unknown(analysis, call, "text option", option, names);
    }
    if (!value) {
        return gbg_fail(analysis->context, GBG_E_ARGUMENT, "%s: value of %s is NULL", call, option);
    }
    const char *const *values = i == 0 ? methods : answers;
    int choice = gbg_text_find(value, values);
    if (choice < 0) {
        return unknown(analysis, call, option, value, values);
    }
    if (i == 0) {
        return set_method(analysis, call, choice);
    }
    analysis->settings.partials = choice;
    return GBG_OK;
}

static const char *const call_frame = "gbg_analysis_add_frame";

static int check_shape(struct gbg_analysis *analysis, const struct gbg_analysis_frame *frame)
{
    struct gbg_context *context = analysis->context;
    const struct gbg_points *points = &frame->points;
    if (points->n < 1) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: n is %lld; a frame needs at least 1 particle",
                        call_frame, (long long)points->n);
    }
    for (int a = 0; a < analysis->dimension; a++) {
        if (!points->base[a]) {
            return gbg_fail(context, GBG_E_ARGUMENT, "%s: %c is NULL", call_frame, 'x' + a);
        }
    }
    if (points->step == 0 && points->n > 1) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: step is 0; it must be the number of elements "
                        "from one particle to the next",
                        call_frame);
    }
    if (frame->base != 0 && frame->base != 1) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: base is %d; it must be 0 or 1", call_frame,
                        frame->base);
    }
    if (!(frame->storage_error >= 0 && isfinite(frame->storage_error))) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: storage_error is %g; it must be 0 or a "
                        "positive length",
                        call_frame, frame->storage_error);
    }
    int axis = bad_length(frame->lengths, analysis->dimension);
    if (axis >= 0) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: lengths[%d] is %g; it must be from 1e-90 to "
                        "1e90",
                        call_frame, axis, frame->lengths[axis]);
    }
    return GBG_OK;
}

/* Counts the species and refuses one out of range or a count that differs from the first frame. */
static int count_species(struct gbg_analysis *analysis, const struct gbg_analysis_frame *frame,
                         int64_t *n_of)
{
    memset(n_of, 0, GBG_MOST_SPECIES * sizeof *n_of);
    n_of[0] = frame->species ? 0 : frame->points.n;
    for (int64_t i = 0; frame->species && i < frame->points.n; i++) {
        int64_t species = (int64_t)frame->species[i] - frame->base;
        if (species < 0 || species >= analysis->n_species) {
            return gbg_fail(analysis->context, GBG_E_ARGUMENT,
                            "%s: species of particle %lld is %d; "
                            "it must be %d to %d",
                            call_frame, (long long)i + frame->base, frame->species[i], frame->base,
                            analysis->n_species - 1 + frame->base);
        }
        n_of[species]++;
    }
    for (int a = 0; a < analysis->n_species && analysis->frames > 0; a++) {
        if (n_of[a] != analysis->n_of[a]) {
            return gbg_fail(analysis->context, GBG_E_ARGUMENT,
                            "%s: species %s has %lld particles "
                            "in this frame and %lld in the first; the numbers must not change",
                            call_frame, analysis->species_name[a], (long long)n_of[a],
                            (long long)analysis->n_of[a]);
        }
    }
    return GBG_OK;
}

static int check_coordinates(struct gbg_analysis *analysis, const struct gbg_analysis_frame *frame)
{
    int64_t bad = gbg_points_first_bad(&frame->points, analysis->dimension);
    if (bad >= 0) {
        return gbg_fail(analysis->context, GBG_E_ARGUMENT,
                        "%s: particle %lld has a coordinate "
                        "that is not finite",
                        call_frame, (long long)bad + frame->base);
    }
    return GBG_OK;
}

static int add_frame(struct gbg_analysis *analysis, const struct gbg_analysis_frame *frame)
{
    int64_t n_of[GBG_MOST_SPECIES];
    int first = analysis->frames == 0;
    int status = check_shape(analysis, frame);
    if (status == GBG_OK) {
        status = count_species(analysis, frame, n_of);
    }
    if (status == GBG_OK) {
        status = check_coordinates(analysis, frame);
    }
    if (status == GBG_OK && first) {
        status = gbg_analysis_begin(analysis, frame);
    }
    if (status != GBG_OK) {
        return status;
    }
    memcpy(analysis->n_of, n_of, sizeof n_of);
    status = gbg_analysis_accumulate(analysis, frame);
    if (status != GBG_OK && first) {
        gbg_analysis_forget(analysis);
    }
    return status;
}

int gbg_analysis_add_frame(struct gbg_analysis *analysis, int64_t n, const double *x,
                           const double *y, const double *z, ptrdiff_t step, const int32_t *species,
                           int base, const double *lengths, double storage_error)
{
    if (!analysis) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "%s: analysis is NULL", call_frame);
    }
    struct gbg_analysis_frame frame = {.points = {n, {x, y, z}, step},
                                       .species = species,
                                       .base = base,
                                       .storage_error = storage_error};
    memcpy(frame.lengths, lengths ? lengths : analysis->lengths,
           (size_t)analysis->dimension * sizeof *lengths);
    return add_frame(analysis, &frame);
}

int gbg_analysis_set_species_name(struct gbg_analysis *analysis, int species, const char *name)
{
    static const char *const call = "gbg_analysis_set_species_name";
    if (!analysis || !name) {
        return gbg_fail(analysis ? analysis->context : NULL, GBG_E_ARGUMENT, "%s: %s is NULL", call,
                        analysis ? "name" : "analysis");
    }
    if (species < 0 || species >= analysis->n_species) {
        return gbg_fail(analysis->context, GBG_E_ARGUMENT, "%s: species is %d; it must be 0 to %d",
                        call, species, analysis->n_species - 1);
    }
    if (strlen(name) < 1 || strlen(name) >= GBG_SPECIES_NAME) {
        return gbg_fail(analysis->context, GBG_E_ARGUMENT,
                        "%s: a name has 1 to %d bytes, this one "
                        "%zu",
                        call, GBG_SPECIES_NAME - 1, strlen(name));
    }
    gbg_text_copy(analysis->species_name[species], GBG_SPECIES_NAME, name);
    return GBG_OK;
}

int gbg_analysis_set_attribute(struct gbg_analysis *analysis, const char *name, const char *value)
{
    static const char *const call = "gbg_analysis_set_attribute";
    static const char *const names[] = {[GBG_TEXT_TITLE] = "title",
                                        [GBG_TEXT_FILES] = "input_files",
                                        [GBG_TEXT_SHA256] = "input_sha256",
                                        [GBG_TEXT_HISTORY] = "history",
                                        [GBG_TEXTS] = NULL};
    if (!analysis || !name || !value) {
        return gbg_fail(analysis ? analysis->context : NULL, GBG_E_ARGUMENT, "%s: %s is NULL", call,
                        !analysis ? "analysis"
                        : !name   ? "name"
                                  : "value");
    }
    int i = gbg_text_find(name, names);
    if (i < 0) {
        return unknown(analysis, call, "attribute", name, names);
    }
    void *copy;
    size_t length = strlen(value);
    int status = gbg_allocate(analysis->context, &copy, (int64_t)length + 1, 1, call);
    if (status == GBG_OK) {
        memcpy(copy, value, length + 1);
        gbg_release(analysis->text[i]);
        analysis->text[i] = copy;
    }
    return status;
}
