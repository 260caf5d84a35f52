/* L4: all pairs within a radius in the caller's arrays. */
#include "gamboge/neighbours.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/context.h"
#include "core/text.h"
#include "engine/bare.h"
#include "engine/neighbours.h"

static const double LENGTH_LEAST = 1e-100, LENGTH_MOST = 1e100, EDGE_MOST = 1000.0;

/* Methods by name: what they are, the number behind the colon with its range (most 0: none). */
struct named_method {
    const char *name;
    int method, list;
    double number, least, most;
};
static const struct named_method methods[] = {
    {"auto", GBG_FIND_AUTO, 1, 0.0, 0.0, 0.0},
    {"verlet", GBG_FIND_AUTO, 1, 0.0, 0.0, 0.0},
    {"brute", GBG_FIND_BRUTE, 0, 0.0, 0.0, 0.0},
    {"grid", GBG_FIND_GRID, 0, 1.0, 0.5, EDGE_MOST},
    {"grid2", GBG_FIND_GRID, 0, 2.0, 0.0, 0.0},
    {"half", GBG_FIND_GRID, 0, 0.5, 0.0, 0.0},
    {"octant", GBG_FIND_OCTANT, 0, 2.0, 2.0, EDGE_MOST},
    {"occupancy", GBG_FIND_OCCUPANCY, 0, 0.0, LENGTH_LEAST, LENGTH_MOST},
};
enum { METHODS = sizeof methods / sizeof *methods };

static int find_method(struct gbg_context *context, const char *text,
                       const struct named_method **found, double *number)
{
    static const char call[] = "gbg_neighbours_create";
    const char *names[METHODS + 1] = {NULL};
    char name[32] = "";
    for (int k = 0; k < METHODS; k++) {
        names[k] = methods[k].name;
    }
    size_t length = text ? strcspn(text, ":") : 0;
    if (length < sizeof name && text) {
        memcpy(name, text, length);
        name[length] = 0;
    }
    int k = gbg_text_find(name, names);
    if (k < 0) {
        return gbg_fail(context, GBG_E_NAME,
                        "%s: there is no method \"%.40s\"; the nearest of auto, grid, grid2, half, "
                        "octant, occupancy, verlet and brute is %s",
                        call, text ? text : "(NULL)", gbg_text_nearest(name, names));
    }
    *found = &methods[k];
    *number = methods[k].number;
    char *end = (char *)text + length;
    if (*end == ':') {
        const char *digits = end + 1;
        *number = strtod(digits, &end);
        end = end == digits ? (char *)text : end;
    } else if (methods[k].method == GBG_FIND_OCCUPANCY) {
        end = (char *)text; /* its number has no default */
    }
    if (*end ||
        (text[length] == ':' && !(*number >= methods[k].least && *number <= methods[k].most))) {
        return methods[k].most == 0.0
                   ? gbg_fail(context, GBG_E_ARGUMENT, "%s: method \"%.40s\": %s takes no number",
                              call, text, name)
                   : gbg_fail(context, GBG_E_ARGUMENT,
                              "%s: method \"%.40s\": %s is followed by a colon and a number, "
                              "allowed %g to %g",
                              call, text, name, methods[k].least, methods[k].most);
    }
    return GBG_OK;
}

static int check_lengths(struct gbg_context *context, int dimension, const double *lengths,
                         double radius, double skin)
{
    static const char call[] = "gbg_neighbours_create";
    const struct gbg_points none = {0};
    int status = gbg_bare_check(context, call, dimension, lengths, &none);
    if (status != GBG_OK) {
        return status;
    }
    double shortest = INFINITY;
    for (int a = 0; a < dimension; a++) {
        shortest = fmin(shortest, lengths[a]);
        if (!(lengths[a] >= LENGTH_LEAST && lengths[a] <= LENGTH_MOST)) {
            return gbg_fail(context, GBG_E_ARGUMENT, "%s: lengths[%d] is %g, allowed %g to %g",
                            call, a, lengths[a], LENGTH_LEAST, LENGTH_MOST);
        }
    }
    if (!(radius > 0.0 && radius >= 1e-30 * shortest && radius <= 0.5 * shortest)) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: radius is %.17g, allowed above 0 (1e-30 of the shortest box length) "
                        "up to half the shortest box length, %.17g",
                        call, radius, 0.5 * shortest);
    }
    if (!(skin >= 0.0 && skin <= shortest)) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%s: skin is %g, allowed 0 to the shortest box length, %g", call, skin,
                        shortest);
    }
    return GBG_OK;
}

int gbg_neighbours_create(struct gbg_context *context, int dimension, const double *lengths,
                          double radius, const char *method, double skin,
                          struct gbg_neighbours **neighbours)
{
    static const char call[] = "gbg_neighbours_create";
    const struct named_method *found = methods;
    double number = 0.0;
    if (!context || !neighbours) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: %s is NULL", call,
                        context ? "neighbours" : "context");
    }
    *neighbours = NULL;
    int status = check_lengths(context, dimension, lengths, radius, skin);
    status = status ? status : find_method(context, method, &found, &number);
    if (status != GBG_OK) {
        return status;
    }
    if (skin > 0.0 && !found->list) {
        return gbg_fail(
            context, GBG_E_ARGUMENT,
            "%s: skin is %g; the method %s has none, it must be 0 (lists: verlet, auto)", call,
            skin, found->name);
    }
    if (skin == 0.0 && strcmp(found->name, "verlet") == 0) {
        return gbg_fail(
            context, GBG_E_ARGUMENT,
            "%s: skin is 0; the method verlet needs one above 0 (0.2 radius is a start)", call);
    }
    status = gbg_neighbours_make(context, dimension, lengths, neighbours);
    if (status == GBG_OK) {
        (*neighbours)->method = found->method;
        (*neighbours)->number = number;
        (*neighbours)->radius = radius;
        (*neighbours)->skin = skin;
        (*neighbours)->listed = strcmp(found->name, "verlet") == 0;
    }
    return status;
}

int gbg_neighbours_destroy(struct gbg_neighbours **neighbours)
{
    if (neighbours) {
        gbg_neighbours_free(*neighbours);
        *neighbours = NULL;
    }
    return GBG_OK;
}

int gbg_neighbours_update(struct gbg_neighbours *neighbours, int64_t n, const double *x,
                          const double *y, const double *z, ptrdiff_t step, int *searched)
{
    static const char call[] = "gbg_neighbours_update";
    if (!neighbours) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "%s: neighbours is NULL", call);
    }
    const struct gbg_points points = {n, {x, y, z}, step};
    int status = gbg_bare_check(neighbours->context, call, neighbours->box.dimension,
                                neighbours->box.length, &points);
    status = status ? status : gbg_neighbours_find(neighbours, &points);
    if (status == GBG_OK && searched) {
        *searched = neighbours->report.searched;
    }
    return status;
}

/* Is there a result to read? */
static int check_filled(struct gbg_neighbours *neighbours, const char *call)
{
    if (!neighbours) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "%s: neighbours is NULL", call);
    }
    if (!neighbours->filled) {
        return gbg_fail(neighbours->context, GBG_E_ORDER,
                        "%s: there are no pairs to read; a successful gbg_neighbours_update comes "
                        "first",
                        call);
    }
    return GBG_OK;
}

static int check_base(struct gbg_neighbours *neighbours, const char *call, int base)
{
    int status = check_filled(neighbours, call);
    if (status == GBG_OK && base != 0 && base != 1) {
        status = gbg_fail(neighbours->context, GBG_E_ARGUMENT, "%s: base is %d, allowed 0 or 1",
                          call, base);
    }
    return status;
}

int gbg_neighbours_count(struct gbg_neighbours *neighbours, int64_t *n, int64_t *pairs)
{
    int status = check_filled(neighbours, "gbg_neighbours_count");
    if (status == GBG_OK && n) {
        *n = neighbours->n;
    }
    if (status == GBG_OK && pairs) {
        *pairs = neighbours->report.rows / 2;
    }
    return status;
}

int gbg_neighbours_csr(struct gbg_neighbours *neighbours, int base, int64_t n_offsets,
                       int64_t *offset, int64_t capacity, int32_t *neighbour)
{
    static const char call[] = "gbg_neighbours_csr";
    int status = check_base(neighbours, call, base);
    if (status != GBG_OK) {
        return status;
    }
    const struct gbg_search_report *report = &neighbours->report;
    if (n_offsets < neighbours->n + 1 || capacity < report->rows) {
        return gbg_fail(neighbours->context, GBG_E_SPACE,
                        "%s: room for %lld offsets and %lld neighbours, needed: %lld and %lld",
                        call, (long long)n_offsets, (long long)capacity,
                        (long long)neighbours->n + 1, (long long)report->rows);
    }
    if (!offset || (report->rows > 0 && !neighbour)) {
        return gbg_fail(neighbours->context, GBG_E_ARGUMENT, "%s: %s is NULL", call,
                        offset ? "neighbour" : "offset");
    }
    return neighbours->kernels->search_rows(neighbours->device, neighbours->search, base, offset,
                                            neighbour);
}

int gbg_neighbours_pairs(struct gbg_neighbours *neighbours, int base, int64_t capacity,
                         int32_t *first, int32_t *second)
{
    static const char call[] = "gbg_neighbours_pairs";
    int status = check_base(neighbours, call, base);
    if (status != GBG_OK) {
        return status;
    }
    int64_t pairs = neighbours->report.rows / 2;
    if (capacity < pairs) {
        return gbg_fail(neighbours->context, GBG_E_SPACE, "%s: room for %lld pairs, needed: %lld",
                        call, (long long)capacity, (long long)pairs);
    }
    if (pairs > 0 && (!first || !second)) {
        return gbg_fail(neighbours->context, GBG_E_ARGUMENT, "%s: %s is NULL", call,
                        first ? "second" : "first");
    }
    return neighbours->kernels->search_pairs(neighbours->device, neighbours->search, base, first,
                                             second);
}

int gbg_neighbours_visit(struct gbg_neighbours *neighbours, int base, gbg_neighbours_batch batch,
                         void *user)
{
    static const char call[] = "gbg_neighbours_visit";
    int status = check_base(neighbours, call, base);
    if (status == GBG_OK && !batch) {
        status = gbg_fail(neighbours->context, GBG_E_ARGUMENT, "%s: batch is NULL", call);
    }
    return status ? status : gbg_neighbours_each(neighbours, base, batch, user);
}

int gbg_neighbours_statistic(struct gbg_neighbours *neighbours, const char *name, double *value)
{
    static const char call[] = "gbg_neighbours_statistic";
    static const char *const names[] = {"candidates", "neighbours",     "cells", "updates",
                                        "searches",   "device_seconds", NULL};
    int status = check_filled(neighbours, call);
    if (status != GBG_OK) {
        return status;
    }
    if (!name || !value) {
        return gbg_fail(neighbours->context, GBG_E_ARGUMENT, "%s: %s is NULL", call,
                        name ? "value" : "name");
    }
    const struct gbg_search_report *report = &neighbours->report;
    double n = (double)neighbours->n;
    const double values[] = {(double)report->candidates,
                             n > 0.0 ? (double)report->rows / n : 0.0,
                             (double)report->cells[0] * (double)report->cells[1] *
                                 (double)report->cells[2],
                             (double)neighbours->updates,
                             (double)neighbours->searches,
                             report->device_seconds};
    int k = gbg_text_find(name, names);
    if (k < 0) {
        return gbg_fail(neighbours->context, GBG_E_NAME,
                        "%s: there is no statistic \"%.40s\"; the nearest is \"%s\"", call, name,
                        gbg_text_nearest(name, names));
    }
    *value = values[k];
    return GBG_OK;
}

int gbg_neighbours_describe(struct gbg_neighbours *neighbours, int64_t capacity, char *text)
{
    static const char call[] = "gbg_neighbours_describe";
    char made[256];
    int status = check_filled(neighbours, call);
    if (status != GBG_OK) {
        return status;
    }
    gbg_neighbours_text(neighbours, sizeof made, made);
    if (capacity <= 0 || !text || !gbg_text_copy(text, (size_t)capacity, made)) {
        return gbg_fail(neighbours->context, GBG_E_SPACE,
                        "%s: room for %lld bytes, needed: %zu with the final zero", call,
                        (long long)capacity, strlen(made) + 1);
    }
    return GBG_OK;
}
