/* Tests of long-range sums on a caller's arrays: crystals whose energies are known, layouts, what
 * stays from call to call, refusals. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "fft/fft.h"
#include "gamboge/gamboge.h"

#define DONE(call)                                                                                 \
    do {                                                                                           \
        int status_ = (call);                                                                      \
        if (status_ != GBG_OK) {                                                                   \
            fail_msg("%s: %s: %s", #call, gbg_status_name(status_), gbg_message(context));         \
        }                                                                                          \
    } while (0)
#define REFUSED(call, status, words)                                                               \
    do {                                                                                           \
        assert_int_equal((call), (status));                                                        \
        if (!strstr(gbg_message(context), words)) {                                                \
            fail_msg("%s: \"%s\" lacks \"%s\"", #call, gbg_message(context), words);               \
        }                                                                                          \
    } while (0)

static struct gbg_context *context;
static const char *no_transforms;

static int set_up(void **state)
{
    (void)state;
    const char *why;
    no_transforms = gbg_fft_find(&why) ? NULL : why;
    return gbg_context_create("cpu:threads=2", &context);
}

static int tear_down(void **state)
{
    (void)state;
    return gbg_context_destroy(&context);
}

static void need_transforms(void)
{
    if (no_transforms) {
        printf("skipped: %s\n", no_transforms);
        skip();
    }
}

/* A crystal of alternating sources on the sites of a simple cubic or square lattice of spacing 1:
 * potential at a source of strength 1, and the largest force. */
static void crystal(int dimension, double tolerance, const double *shift, double *potential,
                    double *force)
{
    enum { SIDE = 8, MOST = SIDE * SIDE * SIDE };
    static double x[3 * MOST], f[3 * MOST], alpha[MOST], value[MOST];
    const double lengths[3] = {SIDE, SIDE, SIDE};
    int n = dimension == 3 ? MOST : SIDE * SIDE;
    struct gbg_sum *sum;
    for (int i = 0; i < n; i++) {
        const int site[3] = {i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE};
        for (int a = 0; a < dimension; a++) {
            x[dimension * i + a] = site[a] + shift[a];
        }
        alpha[i] = (site[0] + site[1] + site[2]) % 2 ? -3.0 : 3.0;
    }
    DONE(gbg_sum_create(context, dimension, lengths, 2.0, "lattice", tolerance, n, &sum));
    DONE(gbg_sum_set_option(sum, "hurry", "true"));
    DONE(gbg_sum_set_sources(sum, alpha));
    DONE(gbg_sum_set_positions(sum, x, x + 1, dimension == 3 ? x + 2 : NULL, dimension));
    DONE(gbg_sum_run(sum));
    DONE(gbg_sum_get_forces(sum, NULL, f, f + 1, dimension == 3 ? f + 2 : NULL, dimension));
    DONE(gbg_sum_get_potential(sum, value));
    gbg_sum_destroy(&sum);
    *potential = *force = 0.0;
    for (int i = 0; i < n; i++) {
        *potential += value[i] / alpha[i] / n;
        for (int a = 0; a < dimension; a++) {
            *force = fmax(*force, fabs(f[dimension * i + a]));
        }
    }
}

/* Madelung's constants of NaCl in space, and of the square lattice with 1/r. */
static void crystals_have_their_energies(void **state)
{
    (void)state;
    static const double known[] = {-1.6155426267128, -1.7475645946332};
    static const double tolerances[] = {1e-4, 1e-8, 1e-11};
    const double shifts[2][3] = {{0.0, 0.0, 0.0}, {0.37, 0.11, 0.73}};
    need_transforms();
    for (int dimension = 2; dimension < 4; dimension++) {
        for (int k = 0; k < 6; k++) {
            double potential, force, tolerance = tolerances[k / 2];
            crystal(dimension, tolerance, shifts[k % 2], &potential, &force);
            double error = fabs(potential / known[dimension - 2] - 1.0);
            printf("%dD, tolerance %.0e: Madelung's constant to %.1e, largest force %.1e\n",
                   dimension, tolerance, error, force / 3.0);
            assert_true(error < tolerance);
            assert_true(force / 3.0 < 10.0 * tolerance);
        }
    }
}

enum { N = 600 };
static double x[3 * N], alpha[N], mobility[N], f[3 * N], g[3 * N];

static void fill(int dimension, const double *lengths)
{
    uint64_t seed = 7;
    for (int i = 0; i < N; i++) {
        for (int a = 0; a < dimension; a++) {
            seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
            x[dimension * i + a] = lengths[a] * (3.0 * (double)(seed >> 11) * 0x1p-53 - 1.0);
        }
        alpha[i] = i % 3 ? 1.0 : -2.5;
        mobility[i] = i % 2 ? 1.5 : -1.0;
    }
}

/* Every power, and the same numbers from arrays of another layout. */
static void errors_are_those_asked_for(void **state)
{
    (void)state;
    static const double powers[] = {1.0, 2.0, 3.0, 4.5, 6.0, 2.0};
    const double lengths[3] = {20.0, 15.0, 25.0};
    need_transforms();
    for (int k = 0; k < 6; k++) {
        int dimension = k < 5 ? 2 : 3;
        for (double tolerance = 1e-3; tolerance > 1e-8; tolerance *= 0.01) {
            struct gbg_sum *sum;
            double rms, median;
            char text[256];
            fill(dimension, lengths);
            DONE(gbg_sum_create(context, dimension, lengths, powers[k], "lattice", tolerance, N,
                                &sum));
            DONE(gbg_sum_set_option(sum, "hurry", "true"));
            DONE(gbg_sum_set_sources(sum, alpha));
            DONE(gbg_sum_set_positions(sum, x, x + 1, dimension == 3 ? x + 2 : NULL, dimension));
            DONE(gbg_sum_run(sum));
            DONE(gbg_sum_get_error(sum, N, &rms, &median));
            DONE(gbg_sum_describe(sum, sizeof text, text));
            printf("%dD: tolerance %.0e, rms(dF)/rms(F) %.1e, over median %.1e; %s\n", dimension,
                   tolerance, rms, median, text);
            assert_true(rms <= tolerance);
            gbg_sum_destroy(&sum);
        }
    }
}

static void layouts_and_mobilities(void **state)
{
    (void)state;
    const double lengths[2] = {20.0, 15.0};
    static double blocked[2 * N];
    struct gbg_sum *sum;
    need_transforms();
    fill(2, lengths);
    DONE(gbg_sum_create(context, 2, lengths, 2.0, "lattice", 1e-5, N, &sum));
    DONE(gbg_sum_set_option(sum, "hurry", "true"));
    DONE(gbg_sum_set_sources(sum, alpha));
    DONE(gbg_sum_set_positions(sum, x, x + 1, NULL, 2));
    DONE(gbg_sum_run(sum));
    DONE(gbg_sum_get_forces(sum, NULL, f, f + 1, NULL, 2));
    for (int i = 0; i < N; i++) {
        blocked[i] = x[2 * i];
        blocked[N + i] = x[2 * i + 1];
    }
    DONE(gbg_sum_set_positions(sum, blocked, blocked + N, NULL, 1));
    REFUSED(gbg_sum_get_forces(sum, NULL, f, f + 1, NULL, 2), GBG_E_ORDER, "gbg_sum_run comes");
    DONE(gbg_sum_run(sum));
    DONE(gbg_sum_get_forces(sum, mobility, g, g + N, NULL, 1));
    for (int i = 0; i < N; i++) {
        assert_true(g[i] == mobility[i] * f[2 * i] && g[N + i] == mobility[i] * f[2 * i + 1]);
    }
    for (int i = 0; i < N; i++) { /* huge sources scale and nothing else */
        alpha[i] *= 0x1p200;
    }
    DONE(gbg_sum_set_sources(sum, alpha));
    DONE(gbg_sum_run(sum));
    DONE(gbg_sum_get_forces(sum, NULL, g, g + 1, NULL, 2));
    for (int i = 0; i < 2 * N; i++) {
        assert_true(g[i] == 0x1p200 * f[i]);
    }
    gbg_sum_destroy(&sum);
}

/* Forces are those of gbg_pair_forces; and the two kinds differ by what the images do. */
static void nearest_images(void **state)
{
    (void)state;
    const double lengths[2] = {20.0, 15.0};
    struct gbg_sum *sum;
    double rms;
    fill(2, lengths);
    for (int wide = 0; wide < 2; wide++) {
        DONE(gbg_sum_create(context, 2, lengths, 2.0, "minimum_image", wide ? 1e-9 : 0.0, N, &sum));
        DONE(gbg_sum_set_sources(sum, alpha));
        DONE(gbg_sum_set_positions(sum, x, x + 1, NULL, 2));
        DONE(gbg_sum_run(sum));
        DONE(gbg_sum_get_forces(sum, mobility, f, f + 1, NULL, 2));
        DONE(gbg_sum_get_error(sum, 0, &rms, NULL));
        DONE(gbg_pair_forces(context, 2, lengths, 2.0, 0.0, wide ? "double" : "mixed", N, x, x + 1,
                             NULL, 2, alpha, mobility, g, g + 1, NULL, 2));
        assert_true(rms < (wide ? 1e-12 : 1e-5));
        for (int i = 0; i < 2 * N; i++) {
            assert_true(fabs(f[i] - g[i]) <= 1e-12 * fabs(g[i]));
        }
        REFUSED(gbg_sum_get_potential(sum, f), GBG_E_ARGUMENT, "only lattice has");
        gbg_sum_destroy(&sum);
    }
}

static void refusals(void **state)
{
    (void)state;
    const double lengths[3] = {20.0, 15.0, 10.0}, flat[2] = {20.0, 0.0};
    struct gbg_sum *sum;
    char text[8];
    REFUSED(gbg_sum_create(context, 2, lengths, 2.0, "latice", 0.0, N, &sum), GBG_E_NAME,
            "no kind \"latice\" of sum");
    REFUSED(gbg_sum_create(context, 2, lengths, 6.5, "lattice", 0.0, N, &sum), GBG_E_ARGUMENT,
            "power is 6.5, allowed 1 to 6 with lattice in 2 dimensions");
    REFUSED(gbg_sum_create(context, 3, lengths, 3.0, "lattice", 0.0, N, &sum), GBG_E_ARGUMENT,
            "power is 3, allowed 2 with lattice in 3 dimensions");
    REFUSED(gbg_sum_create(context, 3, lengths, 25.0, "minimum_image", 0.0, N, &sum),
            GBG_E_ARGUMENT, "power is 25, allowed (0, 24]");
    REFUSED(gbg_sum_create(context, 2, lengths, 2.0, "lattice", 0.2, N, &sum), GBG_E_ARGUMENT,
            "tolerance is 0.2, allowed [0, 0.1]");
    REFUSED(gbg_sum_create(context, 2, lengths, 2.0, "lattice", 1e-15, N, &sum), GBG_E_ARGUMENT,
            "gbg_sum_create: tolerance: 1e-15 given; the finest");
    REFUSED(gbg_sum_create(context, 2, flat, 2.0, "lattice", 0.0, N, &sum), GBG_E_ARGUMENT,
            "lengths[1] is 0");
    REFUSED(gbg_sum_create(context, 2, lengths, 2.0, "lattice", 0.0, -1, &sum), GBG_E_ARGUMENT,
            "n is -1");
    assert_null(sum);
    DONE(gbg_sum_create(context, 2, lengths, 2.0, "lattice", 0.0, N, &sum));
    REFUSED(gbg_sum_run(sum), GBG_E_ORDER, "no positions yet; gbg_sum_set_positions comes first");
    fill(2, lengths);
    DONE(gbg_sum_set_positions(sum, x, x + 1, NULL, 2));
    REFUSED(gbg_sum_run(sum), GBG_E_ORDER, "no sources yet; gbg_sum_set_sources comes first");
    x[11] = NAN;
    REFUSED(gbg_sum_set_positions(sum, x, x + 1, NULL, 2), GBG_E_ARGUMENT, "particle 5 (from 0)");
    REFUSED(gbg_sum_set_positions(sum, x, NULL, NULL, 2), GBG_E_ARGUMENT, "y is NULL");
    alpha[3] = INFINITY;
    REFUSED(gbg_sum_set_sources(sum, alpha), GBG_E_ARGUMENT, "alpha of particle 3");
    REFUSED(gbg_sum_set_option(sum, "splitt", "gaussian"), GBG_E_NAME, "nearest is \"split\"");
    REFUSED(gbg_sum_set_option(sum, "split", "round"), GBG_E_NAME, "allowed prolate, gaussian");
    REFUSED(gbg_sum_describe(sum, sizeof text, text), GBG_E_SPACE, "capacity is 8");
    REFUSED(gbg_sum_get_error(sum, 0, NULL, NULL), GBG_E_ORDER, "gbg_sum_run comes first");
    gbg_sum_destroy(&sum);
    gbg_sum_destroy(&sum);
    assert_int_equal(gbg_sum_run(NULL), GBG_E_ARGUMENT);
}

/* Options make the mesh anew and leave the numbers, to the tolerance. */
static void options_change_the_way(void **state)
{
    (void)state;
    const double lengths[2] = {20.0, 15.0};
    static const char *const option[] = {"split",    "window",    "gradient", "check",
                                         "gradient", "precision", "hurry"};
    static const char *const value[] = {"gaussian", "bspline", "window", "false",
                                        "waves",    "double",  "true"};
    struct gbg_sum *sum;
    char before[256], after[256];
    need_transforms();
    fill(2, lengths);
    DONE(gbg_sum_create(context, 2, lengths, 2.0, "lattice", 1e-5, N, &sum));
    DONE(gbg_sum_set_sources(sum, alpha));
    DONE(gbg_sum_set_positions(sum, x, x + 1, NULL, 2));
    for (int k = 0; k < 7; k++) {
        double rms;
        DONE(gbg_sum_describe(sum, sizeof before, before));
        DONE(gbg_sum_set_option(sum, option[k], value[k]));
        DONE(gbg_sum_describe(sum, sizeof after, after));
        DONE(gbg_sum_run(sum));
        DONE(gbg_sum_get_error(sum, N, &rms, NULL));
        printf("%s %s: %.1e; %s\n", option[k], value[k], rms, after);
        assert_true(rms <= 1e-5);
        assert_true((strcmp(before, after) == 0) == (k == 3 || k == 6));
    }
    gbg_sum_destroy(&sum);
}

static void few_particles(void **state)
{
    (void)state;
    const double lengths[2] = {20.0, 15.0};
    struct gbg_sum *sum;
    double none = 0.0, rms = 1.0;
    need_transforms();
    DONE(gbg_sum_create(context, 2, lengths, 2.0, "lattice", 0.0, 0, &sum));
    DONE(gbg_sum_run(sum));
    DONE(gbg_sum_get_forces(sum, NULL, &none, &none, NULL, 1));
    DONE(gbg_sum_get_error(sum, 0, &rms, NULL));
    assert_true(rms == 0.0);
    gbg_sum_destroy(&sum);
    DONE(gbg_sum_create(context, 2, lengths, 2.0, "lattice", 0.0, 1, &sum));
    DONE(gbg_sum_set_sources(sum, (double[]){0.0}));
    DONE(gbg_sum_set_positions(sum, (double[]){1.0}, (double[]){2.0}, NULL, 1));
    DONE(gbg_sum_run(sum));
    DONE(gbg_sum_get_forces(sum, NULL, f, g, NULL, 1));
    assert_true(f[0] == 0.0 && g[0] == 0.0);
    gbg_sum_destroy(&sum);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(crystals_have_their_energies),
        cmocka_unit_test(errors_are_those_asked_for),
        cmocka_unit_test(layouts_and_mobilities),
        cmocka_unit_test(nearest_images),
        cmocka_unit_test(refusals),
        cmocka_unit_test(options_change_the_way),
        cmocka_unit_test(few_particles),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
