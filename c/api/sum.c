/* L4: long-range forces and potentials on the caller's arrays. */
#include "gamboge/sum.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "core/context.h"
#include "core/text.h"
#include "engine/sum.h"

static const double LENGTH_LEAST = 1e-100, LENGTH_MOST = 1e100, MOST_POWER = 24.0;
static const double USUAL_TOLERANCE = 1e-4, LOOSEST = 0.1, MIXED_TOLERANCE = 1e-5;

static int check_box(struct gbg_context *context, int dimension, const double *lengths, int64_t n)
{
    static const char call[] = "gbg_sum_create";
    const struct gbg_points none = {0};
    int status = gbg_bare_check(context, call, dimension, lengths, &none);
    for (int a = 0; status == GBG_OK && a < dimension; a++) {
        if (!(lengths[a] >= LENGTH_LEAST && lengths[a] <= LENGTH_MOST)) {
            return gbg_fail(context, GBG_E_ARGUMENT, "%s: lengths[%d] is %g, allowed %g to %g",
                            call, a, lengths[a], LENGTH_LEAST, LENGTH_MOST);
        }
    }
    if (status == GBG_OK && (n < 0 || n > INT32_MAX)) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: n is %lld, allowed 0 to %d", call,
                        (long long)n, INT32_MAX);
    }
    return status;
}

static int check_law(struct gbg_context *context, int dimension, double power, int lattice,
                     double tolerance)
{
    static const char call[] = "gbg_sum_create";
    double least = dimension == 2 ? 1.0 : 2.0, most = dimension == 2 ? 6.0 : 2.0;
    if (lattice && !(power >= least && power <= most)) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: power is %.10g, allowed %s with lattice in %d dimensions", call, power,
                        dimension == 2 ? "1 to 6" : "2", dimension);
    }
    if (!(power > 0.0 && power <= MOST_POWER)) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: power is %.10g, allowed (0, %g]", call, power,
                        MOST_POWER);
    }
    if (!(tolerance >= 0.0 && tolerance <= LOOSEST)) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: tolerance is %.10g, allowed [0, %g]", call,
                        tolerance, LOOSEST);
    }
    return GBG_OK;
}

static int find_kind(struct gbg_context *context, const char *kind, int *lattice)
{
    static const char *const names[] = {"minimum_image", "lattice", NULL};
    *lattice = gbg_text_find(kind ? kind : "", names);
    if (*lattice < 0) {
        return gbg_fail(context, GBG_E_NAME,
                        "gbg_sum_create: there is no kind \"%.40s\" of sum, allowed lattice, "
                        "minimum_image",
                        kind ? kind : "(NULL)");
    }
    return GBG_OK;
}

static int named(struct gbg_context *context, const char *call, int status)
{
    if (status != GBG_OK) {
        gbg_message_prefix(context, "%s", call);
    }
    return status;
}

static int fill(struct gbg_sum *sum, const double *lengths, double power, double tolerance)
{
    const struct gbg_state *state = &sum->bare.state;
    sum->power = power;
    sum->tolerance = tolerance > 0.0 || !sum->lattice ? tolerance : USUAL_TOLERANCE;
    sum->use_double = tolerance > 0.0 && tolerance < MIXED_TOLERANCE;
    sum->check = 1;
    if (!sum->lattice) {
        return GBG_OK;
    }
    gbg_mesh_sum_begin(state->box.dimension, lengths, power, state->owned, sum->tolerance,
                       &sum->mesh);
    return gbg_mesh_sum_choose(sum->context, &sum->mesh);
}

int gbg_sum_create(struct gbg_context *context, int dimension, const double *lengths, double power,
                   const char *kind, double tolerance, int64_t n, struct gbg_sum **sum)
{
    static const char call[] = "gbg_sum_create";
    int lattice = 0;
    if (!context || !sum) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: %s is NULL", call,
                        context ? "sum" : "context");
    }
    *sum = NULL;
    int status = check_box(context, dimension, lengths, n);
    status = status ? status : find_kind(context, kind, &lattice);
    status = status ? status : check_law(context, dimension, power, lattice, tolerance);
    if (status != GBG_OK) {
        return status;
    }
    status = gbg_sum_make(context, dimension, lengths, n, sum);
    if (status == GBG_OK) {
        (*sum)->lattice = lattice;
        status = fill(*sum, lengths, power, tolerance);
    }
    if (status != GBG_OK) {
        gbg_sum_destroy(sum);
    }
    return named(context, call, status);
}

int gbg_sum_destroy(struct gbg_sum **sum)
{
    if (sum) {
        gbg_sum_free(*sum);
        *sum = NULL;
    }
    return GBG_OK;
}

/* An option is one of two words: index 0 or 1 of an int of the solver. */
struct option {
    const char *words[3];
    size_t offset;
};
static const char *const option_names[] = {"split",     "window", "gradient", "check",
                                           "precision", "hurry",  NULL};
static const struct option options[] = {
    {{"prolate", "gaussian", NULL}, offsetof(struct gbg_sum, mesh.wish.split)},
    {{"prolate", "bspline", NULL}, offsetof(struct gbg_sum, mesh.wish.window)},
    {{"waves", "window", NULL}, offsetof(struct gbg_sum, mesh.wish.gradient)},
    {{"false", "true", NULL}, offsetof(struct gbg_sum, check)},
    {{"auto", "double", NULL}, offsetof(struct gbg_sum, precise)},
    {{"false", "true", NULL}, offsetof(struct gbg_sum, hurry)},
};

static int find_option(struct gbg_sum *sum, const char *option, const char *value, int **member,
                       int *chosen)
{
    static const char call[] = "gbg_sum_set_option";
    int k = gbg_text_find(option, option_names);
    if (k < 0) {
        return gbg_fail(sum->context, GBG_E_NAME, "%s: no option \"%.40s\"; the nearest is \"%s\"",
                        call, option, gbg_text_nearest(option, option_names));
    }
    *chosen = gbg_text_find(value, options[k].words);
    if (*chosen < 0) {
        return gbg_fail(sum->context, GBG_E_NAME, "%s: %s: \"%.40s\" given, allowed %s, %s", call,
                        option, value, options[k].words[0], options[k].words[1]);
    }
    *member = (int *)(void *)((char *)sum + options[k].offset);
    return GBG_OK;
}

int gbg_sum_set_option(struct gbg_sum *sum, const char *option, const char *value)
{
    static const char call[] = "gbg_sum_set_option";
    int *member = NULL, chosen = 0;
    if (!sum || !option || !value) {
        return gbg_fail(sum ? sum->context : NULL, GBG_E_ARGUMENT, "%s: %s is NULL", call,
                        !sum     ? "sum"
                        : option ? "value"
                                 : "option");
    }
    int status = find_option(sum, option, value, &member, &chosen);
    if (status != GBG_OK || !sum->lattice) {
        return status;
    }
    int before = *member;
    *member = chosen;
    sum->mesh.wish.single = sum->precise ? 0 : -1;
    struct gbg_mesh_sum tried = sum->mesh;
    status = gbg_mesh_sum_choose(sum->context, &tried);
    if (status != GBG_OK) {
        *member = before;
        sum->mesh.wish.single = sum->precise ? 0 : -1;
        return named(sum->context, call, status);
    }
    gbg_sum_drop_mesh(sum);
    sum->mesh.choice = tried.choice;
    sum->mesh.predicted = tried.predicted;
    sum->mesh.cost = tried.cost;
    return GBG_OK;
}

int gbg_sum_set_positions(struct gbg_sum *sum, const double *x, const double *y, const double *z,
                          ptrdiff_t step)
{
    static const char call[] = "gbg_sum_set_positions";
    if (!sum) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "%s: sum is NULL", call);
    }
    const struct gbg_state *state = &sum->bare.state;
    const struct gbg_points points = {state->owned, {x, y, z}, step};
    int status =
        gbg_bare_check(sum->context, call, state->box.dimension, state->box.length, &points);
    if (status == GBG_OK) {
        sum->current = sum->has_positions = 0;
        status = gbg_bare_move(&sum->bare, &points);
        sum->has_positions = status == GBG_OK;
    }
    return status;
}

int gbg_sum_set_sources(struct gbg_sum *sum, const double *alpha)
{
    static const char call[] = "gbg_sum_set_sources";
    if (!sum) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "%s: sum is NULL", call);
    }
    int64_t n = sum->bare.state.owned;
    if (n > 0 && !alpha) {
        return gbg_fail(sum->context, GBG_E_ARGUMENT, "%s: alpha is NULL", call);
    }
    for (int64_t i = 0; i < n; i++) {
        if (!isfinite(alpha[i])) {
            return gbg_fail(sum->context, GBG_E_ARGUMENT,
                            "%s: alpha of particle %lld (from 0) is not a finite number", call,
                            (long long)i);
        }
    }
    return gbg_sum_take_sources(sum, alpha);
}

int gbg_sum_run(struct gbg_sum *sum)
{
    static const char call[] = "gbg_sum_run";
    if (!sum) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "%s: sum is NULL", call);
    }
    if (sum->bare.state.owned > 0 && !(sum->has_positions && sum->has_sources)) {
        return gbg_fail(sum->context, GBG_E_ORDER, "%s: there are no %s yet; %s comes first", call,
                        sum->has_positions ? "sources" : "positions",
                        sum->has_positions ? "gbg_sum_set_sources" : "gbg_sum_set_positions");
    }
    return named(sum->context, call, gbg_sum_forces(sum));
}

/* Is there a result to read? */
static int check_current(const struct gbg_sum *sum, const char *call)
{
    if (!sum) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "%s: sum is NULL", call);
    }
    if (!sum->current) {
        return gbg_fail(sum->context, GBG_E_ORDER,
                        "%s: there are no forces for these positions and sources; gbg_sum_run "
                        "comes first",
                        call);
    }
    return GBG_OK;
}

int gbg_sum_get_forces(struct gbg_sum *sum, const double *mobility, double *fx, double *fy,
                       double *fz, ptrdiff_t step)
{
    static const char call[] = "gbg_sum_get_forces";
    int status = check_current(sum, call);
    if (status != GBG_OK || sum->bare.state.owned == 0) {
        return status;
    }
    int missing = !fx ? 0 : !fy ? 1 : (!fz && sum->bare.state.box.dimension == 3) ? 2 : -1;
    if (missing >= 0) {
        return gbg_fail(sum->context, GBG_E_ARGUMENT, "%s: f%c is NULL", call, "xyz"[missing]);
    }
    if (sum->bare.state.owned > 1 && step == 0) {
        return gbg_fail(sum->context, GBG_E_ARGUMENT,
                        "%s: step is 0: all particles would share one element", call);
    }
    double *const force[3] = {fx, fy, fz};
    return gbg_sum_give_forces(sum, mobility, force, step);
}

int gbg_sum_get_potential(struct gbg_sum *sum, double *values)
{
    static const char call[] = "gbg_sum_get_potential";
    int status = check_current(sum, call);
    if (status != GBG_OK || sum->bare.state.owned == 0) {
        return status;
    }
    if (!values) {
        return gbg_fail(sum->context, GBG_E_ARGUMENT, "%s: values is NULL", call);
    }
    if (!sum->lattice) {
        return gbg_fail(sum->context, GBG_E_ARGUMENT,
                        "%s: a sum of kind minimum_image has no potential, only lattice has", call);
    }
    return named(sum->context, call, gbg_sum_give_potential(sum, values));
}

int gbg_sum_get_error(struct gbg_sum *sum, int64_t samples, double *rms_over_rms,
                      double *rms_over_median)
{
    static const char call[] = "gbg_sum_get_error";
    double rms = 0.0, median = 0.0;
    int status = check_current(sum, call);
    if (status == GBG_OK && sum->bare.state.owned > 0) {
        status =
            named(sum->context, call,
                  gbg_sum_measure(sum, samples > 0 ? samples : GBG_MESH_SAMPLES, &rms, &median));
    }
    if (status == GBG_OK && rms_over_rms) {
        *rms_over_rms = rms;
    }
    if (status == GBG_OK && rms_over_median) {
        *rms_over_median = median;
    }
    return status;
}

int gbg_sum_describe(struct gbg_sum *sum, int64_t capacity, char *text)
{
    static const char call[] = "gbg_sum_describe";
    char line[160];
    if (!sum || !text) {
        return gbg_fail(sum ? sum->context : NULL, GBG_E_ARGUMENT, "%s: %s is NULL", call,
                        sum ? "text" : "sum");
    }
    if (sum->lattice) {
        gbg_mesh_sum_describe(&sum->mesh, sizeof line, line);
    } else {
        snprintf(line, sizeof line, "r/r^%g over all pairs, nearest images, %s", sum->power + 1.0,
                 sum->use_double ? "double" : "mixed");
    }
    if (capacity < 1 || !gbg_text_copy(text, (size_t)capacity, line)) {
        return gbg_fail(sum->context, GBG_E_SPACE, "%s: capacity is %lld, %zu needed", call,
                        (long long)capacity, strlen(line) + 1);
    }
    return GBG_OK;
}
