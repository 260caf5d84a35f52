/* L4: overlaps in the caller's arrays. */
#include <math.h>
#include <string.h>

#include "core/context.h"
#include "engine/overlaps.h"
#include "gamboge/kernels.h"

static int check_diameters(struct gbg_context *context, const char *call, int dimension,
                           const double *lengths, int64_t n, const double *diameter)
{
    double shortest = lengths[0], most = 0.0;
    for (int a = 1; a < dimension; a++) {
        shortest = fmin(shortest, lengths[a]);
    }
    if (n > 0 && !diameter) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: diameter is NULL", call);
    }
    for (int64_t i = 0; i < n; i++) {
        if (!(diameter[i] >= 0.0) || !isfinite(diameter[i])) {
            return gbg_fail(context, GBG_E_ARGUMENT,
                            "%s: diameter of particle %lld (from 0) is %g, allowed finite and "
                            "from 0",
                            call, (long long)i, diameter[i]);
        }
        most = fmax(most, diameter[i]);
    }
    if (2.0 * most > shortest) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: the largest diameter is %g, allowed up to half the shortest box "
                        "length, %g",
                        call, most, 0.5 * shortest);
    }
    return GBG_OK;
}

static int check(struct gbg_context *context, const char *call, int dimension,
                 const double *lengths, const struct gbg_points *points, const double *diameter)
{
    if (!context) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "%s: context is NULL", call);
    }
    int status = gbg_bare_check(context, call, dimension, lengths, points);
    return status ? status
                  : check_diameters(context, call, dimension, lengths, points->n, diameter);
}

int gbg_overlaps_find(struct gbg_context *context, int dimension, const double *lengths, int64_t n,
                      const double *x, const double *y, const double *z, ptrdiff_t step,
                      const double *diameter, double tolerance, int base, int64_t capacity,
                      int32_t *first, int32_t *second, int64_t *count)
{
    static const char call[] = "gbg_overlaps_find";
    struct gbg_points points = {n, {x, y, z}, step};
    int status = check(context, call, dimension, lengths, &points, diameter);
    if (status != GBG_OK) {
        return status;
    }
    if (!(tolerance >= 0.0 && tolerance < 1.0)) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: tolerance is %g, allowed from 0 to below 1",
                        call, tolerance);
    }
    if (!count || capacity < 0 || (capacity > 0 && (!first || !second))) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: count, first or second is NULL, or capacity (%lld) below 0", call,
                        (long long)capacity);
    }
    struct gbg_bare bare;
    status = gbg_bare_make(context, dimension, lengths, &points, &bare);
    if (status != GBG_OK) {
        return status;
    }
    status = gbg_caller_find_overlaps(&bare, diameter, tolerance, capacity, first, second, count);
    gbg_bare_free(&bare);
    for (int64_t k = 0; status == GBG_OK && base != 0 && k < *count && k < capacity; k++) {
        first[k] += base;
        second[k] += base;
    }
    return status;
}

int gbg_overlaps_remove(struct gbg_context *context, int dimension, const double *lengths,
                        int64_t n, double *x, double *y, double *z, ptrdiff_t step,
                        const double *diameter, const char *rule, int64_t max_rounds,
                        int64_t *rounds)
{
    static const char call[] = "gbg_overlaps_remove";
    struct gbg_points points = {n, {x, y, z}, step};
    double *const base[3] = {x, y, z};
    int64_t made = 0;
    int status = check(context, call, dimension, lengths, &points, diameter);
    if (status != GBG_OK) {
        return status;
    }
    int bounce = rule && strcmp(rule, "bounce") == 0;
    if (!bounce && (!rule || strcmp(rule, "contact") != 0)) {
        return gbg_fail(context, GBG_E_NAME, "%s: rule is \"%s\", allowed contact or bounce", call,
                        rule ? rule : "(NULL)");
    }
    if (max_rounds < 0) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: max_rounds is %lld, allowed from 0", call,
                        (long long)max_rounds);
    }
    struct gbg_bare bare;
    status = gbg_bare_make(context, dimension, lengths, &points, &bare);
    if (status != GBG_OK) {
        return status;
    }
    status = gbg_caller_remove_overlaps(&bare, diameter, bounce, max_rounds ? max_rounds : 10000,
                                        base, step, &made);
    gbg_bare_free(&bare);
    if (status == GBG_OK && rounds) {
        *rounds = made;
    }
    return status;
}
