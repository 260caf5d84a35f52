/* L4: the structure factor: its results and its file. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "analysis/analysis.h"
#include "core/memory.h"
#include "core/text.h"
#include "io/analysis_file.h"

int gbg_analysis_size(const struct gbg_analysis *analysis, int64_t *shells, int64_t *frames)
{
    if (!analysis) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "gbg_analysis_size: analysis is NULL");
    }
    if (shells) {
        *shells = analysis->shells.count;
    }
    if (frames) {
        *frames = analysis->frames;
    }
    return GBG_OK;
}

/* Checks what all the calls that return values have in common. */
static int check_reading(struct gbg_analysis *analysis, const char *call, int64_t capacity)
{
    if (!analysis) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "%s: analysis is NULL", call);
    }
    if (analysis->frames == 0) {
        return gbg_fail(analysis->context, GBG_E_ORDER,
                        "%s: there is no frame yet; "
                        "gbg_analysis_add_frame comes first",
                        call);
    }
    if (capacity < analysis->shells.count) {
        return gbg_fail(analysis->context, GBG_E_SPACE,
                        "%s: room for %lld values, and there are "
                        "%lld shells",
                        call, (long long)capacity, (long long)analysis->shells.count);
    }
    return GBG_OK;
}

enum quantity { K, K_LOW, K_HIGH, N_MODES, S, S_STDERR, S_NUMERR, S_NUMERR_TYP, S_STORAGE_ERR };

static double mean_k(const struct gbg_analysis *analysis, int64_t shell)
{
    const struct gbg_shells *shells = &analysis->shells;
    double k = gbg_analysis_mean(analysis, GBG_COLUMN_K, shell);
    return isnan(k) ? 0.5 * (gbg_shells_low(shells, shell) + gbg_shells_high(shells, shell)) : k;
}

static double value_of(const struct gbg_analysis *analysis, enum quantity quantity, int64_t shell)
{
    double independent, modes;
    switch (quantity) {
    case K:
        return mean_k(analysis, shell);
    case K_LOW:
        return gbg_shells_low(&analysis->shells, shell);
    case K_HIGH:
        return gbg_shells_high(&analysis->shells, shell);
    case N_MODES:
        modes = gbg_analysis_mean(analysis, GBG_COLUMN_MODES, shell);
        return isnan(modes) ? 0 : rint(modes);
    case S:
        return gbg_analysis_mean(analysis, GBG_COLUMN_S, shell);
    case S_STDERR:
        return gbg_analysis_error(analysis, 0, shell, &independent);
    case S_NUMERR:
        return gbg_analysis_mean(analysis, GBG_COLUMN_BOUND, shell);
    case S_NUMERR_TYP:
        return gbg_analysis_mean(analysis, GBG_COLUMN_TYPICAL, shell);
    case S_STORAGE_ERR:
        return gbg_analysis_mean(analysis, GBG_COLUMN_STORAGE, shell);
    }
    return NAN;
}

int gbg_analysis_get(struct gbg_analysis *analysis, const char *quantity, int64_t capacity,
                     double *values)
{
    static const char *const call = "gbg_analysis_get";
    static const char *const names[] = {
        "k",        "k_low",    "k_high",       "n_modes",       "S",
        "S_stderr", "S_numerr", "S_numerr_typ", "S_storage_err", NULL};
    int status = check_reading(analysis, call, capacity);
    if (status != GBG_OK) {
        return status;
    }
    if (!quantity || !values) {
        return gbg_fail(analysis->context, GBG_E_ARGUMENT, "%s: %s is NULL", call,
                        quantity ? "values" : "quantity");
    }
    int i = gbg_text_find(quantity, names);
    if (i < 0) {
        return gbg_fail(analysis->context, GBG_E_NAME,
                        "%s: there is no quantity \"%s\"; the "
                        "nearest is \"%s\"",
                        call, quantity, gbg_text_nearest(quantity, names));
    }
    for (int64_t s = 0; s < analysis->shells.count; s++) {
        values[s] = value_of(analysis, (enum quantity)i, s);
    }
    return GBG_OK;
}

int gbg_analysis_get_partial(struct gbg_analysis *analysis, int a, int b, int64_t capacity,
                             double *values, double *errors)
{
    static const char *const call = "gbg_analysis_get_partial";
    int status = check_reading(analysis, call, capacity);
    if (status != GBG_OK) {
        return status;
    }
    if (!analysis->pairs) {
        return gbg_fail(analysis->context, GBG_E_ORDER,
                        "%s: set \"partials\" to \"yes\" before the "
                        "first frame",
                        call);
    }
    int species = analysis->n_species;
    if (a < 0 || a >= species || b < 0 || b >= species) {
        return gbg_fail(analysis->context, GBG_E_ARGUMENT,
                        "%s: species %d and %d; they must be 0 "
                        "to %d",
                        call, a, b, species - 1);
    }
    int pair = gbg_analysis_pair(species, a < b ? a : b, a < b ? b : a);
    for (int64_t s = 0; s < analysis->shells.count; s++) {
        double independent;
        if (values) {
            values[s] = gbg_analysis_mean(analysis, GBG_COLUMN_PAIRS + 2 * pair, s);
        }
        if (errors) {
            errors[s] = gbg_analysis_error(analysis, 1 + pair, s, &independent);
        }
    }
    return GBG_OK;
}

static void describe(const struct gbg_analysis *analysis, size_t capacity, char *text)
{
    int32_t cells[3] = {1, 1, 1};
    int width = gbg_density_width(analysis->density, cells), reach = 0, at = 0;
    if (width == 0) {
        snprintf(text, capacity, "direct, bound %.1e", analysis->largest_bound);
        return;
    }
    for (int a = 1; a < analysis->dimension; a++) {
        reach = analysis->modes.reach[a] > analysis->modes.reach[reach] ? a : reach;
    }
    double sigma = cells[reach] / (2.0 * analysis->modes.reach[reach]);
    char mesh[48] = "";
    for (int a = 0; a < analysis->dimension; a++) {
        at += snprintf(mesh + at, sizeof mesh - (size_t)at, "%s%d", a ? "x" : "", cells[a]);
    }
    snprintf(text, capacity, "mesh %s, Kaiser-Bessel w=%d, sigma %.1f, bound %.1e", mesh, width,
             sigma, analysis->largest_bound);
}

int gbg_analysis_describe(struct gbg_analysis *analysis, int64_t capacity, char *text)
{
    static const char *const call = "gbg_analysis_describe";
    char all[160];
    int status = check_reading(analysis, call, INT64_MAX);
    if (status != GBG_OK) {
        return status;
    }
    describe(analysis, sizeof all, all);
    if (!text || capacity <= (int64_t)strlen(all)) {
        return gbg_fail(analysis->context, text ? GBG_E_SPACE : GBG_E_ARGUMENT,
                        "%s: room for %lld bytes, and the text has %zu with its zero", call,
                        text ? (long long)capacity : 0LL, strlen(all) + 1);
    }
    strcpy(text, all);
    return GBG_OK;
}

/* Arrays and texts of a file; `block` holds all the numbers. */
struct package {
    struct gbg_analysis_content content;
    double *block;
    int64_t used;
    char estimator[320];
};

/* The next n numbers of the block. */
static double *take(struct package *package, int64_t n)
{
    double *part = package->block + package->used;
    package->used += n;
    return part;
}

static double *take_quantity(struct package *package, const struct gbg_analysis *analysis,
                             enum quantity quantity)
{
    double *part = take(package, analysis->shells.count);
    for (int64_t s = 0; s < analysis->shells.count; s++) {
        part[s] = value_of(analysis, quantity, s);
    }
    return part;
}

static const char *error_text(const struct gbg_analysis *analysis, int pairs)
{
    if (analysis->frames >= GBG_FEW_FRAMES) {
        return "blocking over frames (Flyvbjerg-Petersen), block length by B^3 > 2 n (s_B/s_1)^4";
    }
    return pairs ? "sqrt((S_ab^2 + S_aa S_bb)/(2 n_modes frames)): too few frames for blocking, "
                   "taken as independent"
                 : "S/sqrt(n_modes frames): too few frames for blocking, taken as independent";
}

static void add_column(struct package *package, const char *name, const char *long_name,
                       const char *extra_name, const char *extra, const double *value)
{
    package->content.column[package->content.columns++] =
        (struct gbg_file_column){name, long_name, extra_name, extra, value};
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Median over the shells of the number of independent frames. */
static double median_independent(const struct gbg_analysis *analysis, const double *independent,
                                 double *work)
{
    int64_t n = 0;
    for (int64_t s = 0; s < analysis->shells.count; s++) {
        if (analysis->frames_of[s] > 0) {
            work[n++] = independent[s];
        }
    }
    qsort(work, (size_t)n, sizeof *work, ascending);
    return 0.5 * (work[(n - 1) / 2] + work[n / 2]);
}

static void pack_totals(struct package *package, const struct gbg_analysis *analysis)
{
    struct gbg_analysis_content *content = &package->content;
    int64_t shells = analysis->shells.count;
    double *bounds = take(package, 2 * shells), *independent = take(package, shells);
    for (int64_t s = 0; s < shells; s++) {
        bounds[2 * s] = value_of(analysis, K_LOW, s);
        bounds[2 * s + 1] = value_of(analysis, K_HIGH, s);
        gbg_analysis_error(analysis, 0, s, &independent[s]);
    }
    content->k = take_quantity(package, analysis, K);
    content->k_bounds = bounds;
    content->modes = take_quantity(package, analysis, N_MODES);
    add_column(package, "S", "static structure factor <|rho_k|^2>/N", NULL, NULL,
               take_quantity(package, analysis, S));
    add_column(package, "S_stderr", "statistical standard error of S", "method",
               error_text(analysis, 0), take_quantity(package, analysis, S_STDERR));
    add_column(package, "S_numerr", "upper bound of the numerical error of S", "comment",
               "holds for the coordinates as they were given; aliasing and rounding",
               take_quantity(package, analysis, S_NUMERR));
    add_column(package, "S_numerr_typ", "typical numerical error of S in one frame", NULL, NULL,
               take_quantity(package, analysis, S_NUMERR_TYP));
    add_column(package, "S_storage_err", "typical error of S from rounded stored coordinates", NULL,
               NULL, take_quantity(package, analysis, S_STORAGE_ERR));
    add_column(package, "n_effective", "independent frames", NULL, NULL, independent);
    content->n_effective = median_independent(analysis, independent, take(package, shells));
}

static void pack_pairs(struct package *package, const struct gbg_analysis *analysis)
{
    struct gbg_analysis_content *content = &package->content;
    int64_t shells = analysis->shells.count;
    double *value = take(package, analysis->pairs * shells);
    double *error = take(package, analysis->pairs * shells);
    double *bound = take(package, analysis->pairs * shells), independent;
    for (int p = 0; p < analysis->pairs; p++) {
        for (int64_t s = 0; s < shells; s++) {
            int64_t at = p * shells + s;
            value[at] = gbg_analysis_mean(analysis, GBG_COLUMN_PAIRS + 2 * p, s);
            bound[at] = gbg_analysis_mean(analysis, GBG_COLUMN_PAIRS + 2 * p + 1, s);
            error[at] = gbg_analysis_error(analysis, 1 + p, s, &independent);
        }
    }
    content->pairs = analysis->pairs;
    content->pair_columns = 3;
    content->pair_column[0] = (struct gbg_file_column){
        "S_partial", "<Re rho_a rho_b*>/sqrt(N_a N_b); NaN where a type has no particle",
        "convention", "Ashcroft-Langreth", value};
    content->pair_column[1] =
        (struct gbg_file_column){"S_partial_stderr", "statistical standard error of S_partial",
                                 "method", error_text(analysis, 1), error};
    content->pair_column[2] = (struct gbg_file_column){
        "S_partial_numerr", "upper bound of the numerical error of S_partial", NULL, NULL, bound};
}

static void pack_texts(struct package *package, const struct gbg_analysis *analysis)
{
    struct gbg_analysis_content *content = &package->content;
    char method[160];
    describe(analysis, sizeof method, method);
    snprintf(package->estimator, sizeof package->estimator,
             "%s; bound of |d rho|/sqrt(N) over all modes and frames; shells of |k| %s", method,
             "binned in the box of each frame");
    const char *const text[][2] = {
        {"title", analysis->text[GBG_TEXT_TITLE] ? analysis->text[GBG_TEXT_TITLE]
                                                 : "static structure factor"},
        {"input_files", analysis->text[GBG_TEXT_FILES]},
        {"input_sha256", analysis->text[GBG_TEXT_SHA256]},
        {"history", analysis->text[GBG_TEXT_HISTORY]},
        {"estimator", package->estimator},
        {"normalisation",
         "S = <|rho_k|^2>/N -> 1 at large k; S = sum_ab sqrt(c_a c_b) S_partial_ab"},
        {"references", "Ashcroft and Langreth, Phys. Rev. 156, 685 (1967); Flyvbjerg and Petersen, "
                       "J. Chem. Phys. 91, 461 (1989)"},
    };
    content->texts = (int)(sizeof text / sizeof *text);
    for (int i = 0; i < content->texts; i++) {
        content->text_name[i] = text[i][0];
        content->text[i] = text[i][1];
    }
}

static void pack(struct package *package, const struct gbg_analysis *analysis)
{
    struct gbg_analysis_content *content = &package->content;
    content->dimension = analysis->dimension;
    content->species = analysis->n_species;
    content->shells = analysis->shells.count;
    content->lengths = analysis->lengths;
    content->n = analysis->n;
    content->frames = analysis->frames;
    content->tolerance = analysis->settings.tolerance;
    content->bound = analysis->largest_bound;
    for (int a = 0; a < analysis->n_species; a++) {
        content->species_name[a] = analysis->species_name[a];
        content->particles[a] = analysis->n_of[a];
    }
    pack_totals(package, analysis);
    if (analysis->pairs) {
        pack_pairs(package, analysis);
    }
    pack_texts(package, analysis);
}

int gbg_analysis_write(struct gbg_analysis *analysis, const char *path)
{
    static const char *const call = "gbg_analysis_write";
    int status = check_reading(analysis, call, INT64_MAX);
    if (status != GBG_OK) {
        return status;
    }
    if (!path || !*path) {
        return gbg_fail(analysis->context, GBG_E_ARGUMENT, "%s: path is %s", call,
                        path ? "empty" : "NULL");
    }
    struct package package = {.used = 0};
    void *block;
    int64_t per_shell = 12 + 3 * analysis->pairs;
    status = gbg_allocate(analysis->context, &block, per_shell * analysis->shells.count,
                          sizeof(double), call);
    if (status == GBG_OK) {
        package.block = block;
        pack(&package, analysis);
        status = gbg_analysis_file_write(analysis->context, path, &package.content);
    }
    gbg_release(block);
    return status;
}
