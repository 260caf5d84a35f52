/* Tests of c/api/analysis*.c: what is refused and with which words, hard cases, failing memory. */
#include "analysis_help.h"

#include "core/memory.h"

static struct points points;
static const double box[3] = {10, 7, 8};

static struct gbg_analysis *fresh(struct gbg_context *context, int dimension, int species)
{
    struct gbg_analysis *analysis;
    MUST(context, gbg_analysis_create(context, dimension, box, species, &analysis));
    return analysis;
}

static void creation_checks_its_arguments(void **state)
{
    (void)state;
    struct gbg_context *c = context_of("cpu");
    struct gbg_analysis *a;
    const double bad[3] = {1, -2, 3}, infinite[3] = {1, INFINITY, 3};
    MUST_FAIL(NULL, GBG_E_ARGUMENT, "context", gbg_analysis_create(NULL, 2, box, 1, &a));
    MUST_FAIL(c, GBG_E_ARGUMENT, "lengths is NULL", gbg_analysis_create(c, 2, NULL, 1, &a));
    MUST_FAIL(c, GBG_E_ARGUMENT, "2 or 3", gbg_analysis_create(c, 4, box, 1, &a));
    MUST_FAIL(c, GBG_E_ARGUMENT, "lengths[1] is -2", gbg_analysis_create(c, 2, bad, 1, &a));
    MUST_FAIL(c, GBG_E_ARGUMENT, "lengths[1] is inf", gbg_analysis_create(c, 2, infinite, 1, &a));
    MUST_FAIL(c, GBG_E_ARGUMENT, "1 to 10", gbg_analysis_create(c, 2, box, 11, &a));
    MUST_FAIL(c, GBG_E_ARGUMENT, "1 to 10", gbg_analysis_create(c, 2, box, 0, &a));
    assert_null(a);
    assert_int_equal(gbg_analysis_destroy(&a), GBG_OK);
    assert_int_equal(gbg_analysis_destroy(NULL), GBG_OK);
    gbg_context_destroy(&c);
}

static void settings_are_named_and_bounded(void **state)
{
    (void)state;
    struct gbg_context *c = context_of("cpu");
    struct gbg_analysis *a = fresh(c, 2, 1);
    MUST_FAIL(c, GBG_E_NAME, "\"k_max\"", gbg_analysis_set_real(a, "kmax", 1));
    MUST_FAIL(c, GBG_E_ARGUMENT, "tolerance is 0", gbg_analysis_set_real(a, "tolerance", 0));
    MUST_FAIL(c, GBG_E_ARGUMENT, "nan", gbg_analysis_set_real(a, "k_max", NAN));
    MUST_FAIL(c, GBG_E_NAME, "\"direct\"", gbg_analysis_set_text(a, "method", "dirct"));
    MUST_FAIL(c, GBG_E_NAME, "\"partials\"", gbg_analysis_set_text(a, "partial", "yes"));
    MUST_FAIL(c, GBG_E_ARGUMENT, "NULL", gbg_analysis_set_text(a, "partials", NULL));
    MUST_FAIL(c, GBG_E_NAME, "\"title\"", gbg_analysis_set_attribute(a, "titel", "x"));
    MUST_FAIL(c, GBG_E_ARGUMENT, "0 to 0", gbg_analysis_set_species_name(a, 1, "x"));
    MUST_FAIL(c, GBG_E_ARGUMENT, "1 to 31 bytes", gbg_analysis_set_species_name(a, 0, ""));
#ifndef GBG_WITH_FFTW
    MUST_FAIL(c, GBG_E_UNBUILT, "GBG_WITH_FFTW", gbg_analysis_set_text(a, "method", "mesh"));
#endif
    fill_uniform(&points, 50, 1, box);
    MUST(c, add_points(a, &points, NULL, NULL));
    MUST_FAIL(c, GBG_E_ORDER, "before the first", gbg_analysis_set_real(a, "k_max", 1));
    gbg_analysis_destroy(&a);
    gbg_context_destroy(&c);
}

static void frames_are_checked(void **state)
{
    (void)state;
    struct gbg_context *c = context_of("cpu");
    struct gbg_analysis *a = fresh(c, 2, 3);
    double *x = points.x[0], *y = points.x[1];
    int32_t *s = points.species;
    const double negative[2] = {10, -7};
    fill_uniform(&points, 60, 2, box);
    MUST_FAIL(c, GBG_E_ARGUMENT, "n is 0",
              gbg_analysis_add_frame(a, 0, x, y, NULL, 1, s, 0, NULL, 0));
    MUST_FAIL(c, GBG_E_ARGUMENT, "y is NULL",
              gbg_analysis_add_frame(a, 60, x, NULL, NULL, 1, s, 0, NULL, 0));
    MUST_FAIL(c, GBG_E_ARGUMENT, "step is 0",
              gbg_analysis_add_frame(a, 60, x, y, NULL, 0, s, 0, NULL, 0));
    MUST_FAIL(c, GBG_E_ARGUMENT, "base is 2",
              gbg_analysis_add_frame(a, 60, x, y, NULL, 1, s, 2, NULL, 0));
    MUST_FAIL(c, GBG_E_ARGUMENT, "species of particle 1 is 0",
              gbg_analysis_add_frame(a, 60, x, y, NULL, 1, s, 1, NULL, 0));
    MUST_FAIL(c, GBG_E_ARGUMENT, "lengths[1] is -7",
              gbg_analysis_add_frame(a, 60, x, y, NULL, 1, s, 0, negative, 0));
    MUST_FAIL(c, GBG_E_ARGUMENT, "storage_error is nan",
              gbg_analysis_add_frame(a, 60, x, y, NULL, 1, s, 0, NULL, NAN));
    y[17] = NAN;
    MUST_FAIL(c, GBG_E_ARGUMENT, "particle 17", add_points(a, &points, s, NULL));
    y[17] = -INFINITY;
    MUST_FAIL(c, GBG_E_ARGUMENT, "particle 18",
              gbg_analysis_add_frame(a, 60, x, y, NULL, 1, NULL, 1, NULL, 0));
    y[17] = 0;
    MUST(c, add_points(a, &points, s, NULL));
    s[0] = 1;
    MUST_FAIL(c, GBG_E_ARGUMENT, "species A has 19", add_points(a, &points, s, NULL));
    MUST_FAIL(c, GBG_E_ARGUMENT, "must not change", add_points(a, &points, NULL, NULL));
    int64_t shells, frames;
    MUST(c, gbg_analysis_size(a, &shells, &frames));
    assert_int_equal(frames, 1);
    gbg_analysis_destroy(&a);
    gbg_context_destroy(&c);
}

static void results_are_checked(void **state)
{
    (void)state;
    struct gbg_context *c = context_of("cpu");
    struct gbg_analysis *a = fresh(c, 2, 3);
    static double value[HELP_MOST];
    char text[200];
    int64_t shells, frames;
    MUST(c, gbg_analysis_size(a, &shells, &frames));
    assert_int_equal(shells, 0);
    MUST_FAIL(c, GBG_E_ORDER, "no frame", gbg_analysis_get(a, "S", HELP_MOST, value));
    MUST_FAIL(c, GBG_E_ORDER, "no frame", gbg_analysis_describe(a, 200, text));
    MUST_FAIL(c, GBG_E_ORDER, "no frame", gbg_analysis_write(a, "/tmp/never.nc"));
    fill_uniform(&points, 60, 2, box);
    MUST(c, add_points(a, &points, points.species, NULL));
    MUST(c, gbg_analysis_size(a, &shells, NULL));
    MUST_FAIL(c, GBG_E_NAME, "\"S_stderr\"", gbg_analysis_get(a, "S_stder", HELP_MOST, value));
    MUST_FAIL(c, GBG_E_SPACE, "shells", gbg_analysis_get(a, "S", shells - 1, value));
    MUST_FAIL(c, GBG_E_ARGUMENT, "values is NULL", gbg_analysis_get(a, "S", shells, NULL));
    MUST_FAIL(c, GBG_E_ORDER, "partials", gbg_analysis_get_partial(a, 0, 0, shells, value, NULL));
    MUST_FAIL(c, GBG_E_SPACE, "room for 3", gbg_analysis_describe(a, 3, text));
    MUST_FAIL(c, GBG_E_ARGUMENT, "path is empty", gbg_analysis_write(a, ""));
    gbg_analysis_destroy(&a);
    a = fresh(c, 2, 3);
    MUST(c, gbg_analysis_set_text(a, "partials", "yes"));
    MUST(c, add_points(a, &points, points.species, NULL));
    MUST_FAIL(c, GBG_E_ARGUMENT, "0 to 2", gbg_analysis_get_partial(a, 0, 3, shells, value, NULL));
    gbg_analysis_destroy(&a);
    gbg_context_destroy(&c);
}

static void too_much_is_refused(void **state)
{
    (void)state;
    struct gbg_context *c = context_of("cpu");
    struct gbg_analysis *a = fresh(c, 3, 1);
    fill_uniform(&points, 100, 3, box);
    MUST(c, gbg_analysis_set_real(a, "k_max", 5000));
    MUST_FAIL(c, GBG_E_MEMORY, "memory_limit", add_points(a, &points, NULL, NULL));
    MUST(c, gbg_analysis_set_real(a, "k_max", 0.1));
    MUST_FAIL(c, GBG_E_ARGUMENT, "smallest wave number", add_points(a, &points, NULL, NULL));
    MUST(c, gbg_analysis_set_real(a, "k_max", 1e80));
    MUST_FAIL(c, GBG_E_ARGUMENT, "2^30", add_points(a, &points, NULL, NULL));
    MUST(c, gbg_analysis_set_real(a, "k_max", 5));
    MUST(c, gbg_analysis_set_real(a, "shell_width", 1e-9));
    MUST_FAIL(c, GBG_E_ARGUMENT, "shells", add_points(a, &points, NULL, NULL));
    MUST(c, gbg_analysis_set_real(a, "shell_width", 1));
    MUST(c, add_points(a, &points, NULL, NULL));
    gbg_analysis_destroy(&a);
    /* The default k_max gives way to the limit. */
    a = fresh(c, 3, 1);
    fill_uniform(&points, 60000, 3, box);
    MUST(c, gbg_analysis_set_real(a, "memory_limit", 1e7));
    MUST(c, add_points(a, &points, NULL, NULL));
    assert_true(a->k_max < 4 * two_pi * cbrt(60000 / (10.0 * 7 * 8)));
    gbg_analysis_destroy(&a);
    gbg_context_destroy(&c);
}

/* One particle: S = 1 at every k. Two: S = 1 + cos(k.r12). */
static void one_and_two_particles(void **state)
{
    (void)state;
    struct gbg_context *c = context_of("cpu");
    for (int n = 1; n <= 2; n++) {
        for (int dimension = 2; dimension <= 3; dimension++) {
            struct gbg_analysis *a = fresh(c, dimension, 1);
            fill_uniform(&points, n, 4, box);
            MUST(c, add_points(a, &points, NULL, NULL));
            for (int64_t m = 0; m < a->modes.count; m++) {
                const double *rho = a->density->rho + 2 * m;
                double phase = 0, S = (rho[0] * rho[0] + rho[1] * rho[1]) / n;
                for (int axis = 0; axis < dimension; axis++) {
                    phase += two_pi * a->modes.n[axis][m] *
                             (points.x[axis][0] - points.x[axis][1]) / box[axis];
                }
                double expected = n == 1 ? 1 : 1 + cos(phase);
                assert_true(fabs(S - expected) < 4e-6);
            }
            gbg_analysis_destroy(&a);
        }
    }
    gbg_context_destroy(&c);
}

static void shells_follow_their_definition(void **state)
{
    (void)state;
    struct gbg_context *c = context_of("cpu");
    static double low[HELP_MOST], high[HELP_MOST], k[HELP_MOST], modes[HELP_MOST];
    const double widths[] = {0.1, two_pi / 10, 2.5, 40};
    fill_uniform(&points, 100, 3, box);
    for (int w = 0; w < 4; w++) {
        struct gbg_analysis *a = fresh(c, 2, 1);
        int64_t shells, total = 0;
        double k_max = two_pi / 10 * 12;
        MUST(c, gbg_analysis_set_real(a, "k_max", k_max));
        MUST(c, gbg_analysis_set_real(a, "shell_width", widths[w]));
        MUST(c, add_points(a, &points, NULL, NULL));
        MUST(c, gbg_analysis_size(a, &shells, NULL));
        MUST(c, gbg_analysis_get(a, "k_low", HELP_MOST, low));
        MUST(c, gbg_analysis_get(a, "k_high", HELP_MOST, high));
        MUST(c, gbg_analysis_get(a, "k", HELP_MOST, k));
        MUST(c, gbg_analysis_get(a, "n_modes", HELP_MOST, modes));
        for (int64_t s = 0; s < shells; s++) {
            int64_t count = 0;
            double sum = 0;
            for (int i = -13; i <= 13; i++) {
                for (int j = -13; j <= 13; j++) {
                    double length = hypot(two_pi * i / 10, two_pi * j / 7);
                    int last = s == shells - 1;
                    int in = length >= low[s] && (length < high[s] || (last && length <= high[s]));
                    if ((i || j) && in) {
                        count++;
                        sum += length;
                    }
                }
            }
            assert_int_equal(count, 2 * (int64_t)modes[s]);
            assert_true(count == 0 || fabs(k[s] - sum / (double)count) < 1e-12 * k[s]);
            assert_true(s == 0 || low[s] == high[s - 1]);
            total += count;
        }
        assert_true(high[shells - 1] <= k_max);
        assert_int_equal(total, 2 * a->modes.count);
        gbg_analysis_destroy(&a);
    }
    gbg_context_destroy(&c);
}

/* Every allocation of a first frame fails once: refused with a sentence, and then it works. */
static void failing_memory_changes_nothing(void **state)
{
    (void)state;
    static double before[HELP_MOST], after[HELP_MOST];
    struct gbg_context *c = context_of("cpu:threads=2");
    fill_uniform(&points, 300, 3, box);
    const char *const methods[] = {"direct", "mesh"};
    for (int method = 0; method < 1 + gbg_has_component("fftw"); method++) {
        struct gbg_analysis *reference = fresh(c, 3, 3), *a = fresh(c, 3, 3);
        MUST(c, gbg_analysis_set_text(reference, "method", methods[method]));
        MUST(c, gbg_analysis_set_text(reference, "partials", "yes"));
        MUST(c, gbg_analysis_set_real(reference, "k_max", 6));
        MUST(c, add_points(reference, &points, points.species, NULL));
        MUST(c, gbg_analysis_get(reference, "S", HELP_MOST, before));
        MUST(c, gbg_analysis_set_text(a, "method", methods[method]));
        MUST(c, gbg_analysis_set_text(a, "partials", "yes"));
        MUST(c, gbg_analysis_set_real(a, "k_max", 6));
        int failures = 0, status = GBG_E_MEMORY;
        while (status != GBG_OK) {
            gbg_memory_fail_after(failures + 1);
            status = add_points(a, &points, points.species, NULL);
            gbg_memory_fail_after(0);
            assert_true(status == GBG_OK || status == GBG_E_MEMORY);
            failures += status != GBG_OK;
            assert_int_equal(a->frames, status == GBG_OK);
        }
        print_message("method %s: %d allocations failed in turn\n", methods[method], failures);
        assert_true(failures > 10);
        MUST(c, gbg_analysis_get(a, "S", HELP_MOST, after));
        int64_t shells = a->shells.count;
        assert_memory_equal(before, after, (size_t)shells * sizeof *after);
        gbg_memory_fail_after(1);
        MUST_FAIL(c, GBG_E_MEMORY, "could not be had", gbg_analysis_write(a, "/tmp/never.nc"));
        gbg_memory_fail_after(0);
        gbg_analysis_destroy(&a);
        gbg_analysis_destroy(&reference);
    }
    gbg_context_destroy(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(creation_checks_its_arguments),
        cmocka_unit_test(settings_are_named_and_bounded),
        cmocka_unit_test(frames_are_checked),
        cmocka_unit_test(results_are_checked),
        cmocka_unit_test(too_much_is_refused),
        cmocka_unit_test(one_and_two_particles),
        cmocka_unit_test(shells_follow_their_definition),
        cmocka_unit_test(failing_memory_changes_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
