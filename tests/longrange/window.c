/* Tests of the windows of long-range sums: polynomials, transforms and sums over aliases, each
 * against its definition. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "ewald/window.h"
#include "gamboge/status.h"

#define PI 3.14159265358979323846

static double node_sum(const double (*power)[GBG_EWALD_WIDEST], int degree, int l, double z)
{
    double sum = 0;
    for (int k = degree; k >= 0; k--) {
        sum = sum * z + power[k][l];
    }
    return sum;
}

static const char *name(int kind)
{
    return kind == GBG_EWALD_PROLATE ? "prolate " : "B-spline";
}

/* Value and slope of all nodes at places that are none of the fit's. */
static void check_polynomials(int kind, int width, double finer)
{
    struct gbg_ewald_window window;
    assert_int_equal(gbg_ewald_window_make(kind, width, finer, &window), GBG_OK);
    double peak = gbg_ewald_window_value(&window, 0), value = 0, slope = 0, h = 1e-5;
    for (int m = 0; m < 97; m++) {
        double z = -0.999 + 1.998 * m / 96;
        for (int l = 0; l < width; l++) {
            double t = l + 0.5 - width / 2.0 - z / 2;
            double exact = gbg_ewald_window_value(&window, t);
            value = fmax(value, fabs(node_sum(window.value, window.degree, l, z) - exact) / peak);
            /* the slope is that of the polynomial, t running against z/2 */
            double before = node_sum(window.value, window.degree, l, z + 2 * h);
            double after = node_sum(window.value, window.degree, l, z - 2 * h);
            double own = node_sum(window.slope, window.degree, l, z);
            slope = fmax(slope, fabs((after - before) / (2 * h) - own) / peak);
        }
    }
    for (int l = width; l < GBG_EWALD_WIDEST; l++) {
        for (int k = 0; k <= GBG_EWALD_DEGREE; k++) {
            assert_true(window.value[k][l] == 0 && window.slope[k][l] == 0);
        }
    }
    double step = fabs(gbg_ewald_window_value(&window, width / 2.0 * (1 - 1e-15))) / peak;
    printf(
        "%s width %2d finer %.2f: degree %2d, polynomial %.1e (says %.1e, step at the end %.1e), "
        "slope %.1e\n",
        name(kind), width, finer, window.degree, value, window.polynomial_error, step, slope);
    assert_true(value <= 1.05 * window.polynomial_error + 4e-16);
    assert_true(value <= fmax(0.1 * step, 5e-16) && slope < 1e-8);
}

static void polynomials_are_the_window(void **state)
{
    (void)state;
    for (int width = GBG_EWALD_NARROWEST; width <= GBG_EWALD_WIDEST; width++) {
        check_polynomials(GBG_EWALD_PROLATE, width, 1);
        check_polynomials(GBG_EWALD_PROLATE, width, 1.3);
        check_polynomials(GBG_EWALD_PROLATE, width, 4);
        check_polynomials(GBG_EWALD_BSPLINE, width, 1);
    }
}

/* Splines add to one everywhere and their slopes to nothing; known values at nodes. */
static void splines_are_splines(void **state)
{
    (void)state;
    struct gbg_ewald_window window;
    double worst = 0;
    for (int width = GBG_EWALD_NARROWEST; width <= GBG_EWALD_WIDEST; width++) {
        assert_int_equal(gbg_ewald_window_make(GBG_EWALD_BSPLINE, width, 1, &window), GBG_OK);
        for (double z = -1; z <= 1; z += 0.01) {
            double sum = 0, slopes = 0;
            for (int l = 0; l < width; l++) {
                sum += node_sum(window.value, width - 1, l, z);
                slopes += node_sum(window.slope, width - 1, l, z);
            }
            worst = fmax(worst, fmax(fabs(sum - 1), fabs(slopes)));
        }
    }
    printf("B-splines: sum over nodes - 1, sum of slopes: %.1e\n", worst);
    assert_true(worst < 2e-15);
    assert_int_equal(gbg_ewald_window_make(GBG_EWALD_BSPLINE, 4, 1, &window), GBG_OK);
    assert_true(fabs(gbg_ewald_window_value(&window, 0) - 2 / 3.0) < 1e-15);
    assert_true(fabs(gbg_ewald_window_value(&window, -1) - 1 / 6.0) < 1e-15);
    assert_int_equal(gbg_ewald_window_make(GBG_EWALD_BSPLINE, 3, 1, &window), GBG_OK);
    assert_true(fabs(gbg_ewald_window_value(&window, 0) - 0.75) < 1e-15);
    assert_true(gbg_ewald_window_value(&window, 1.5) == 0);
}

/* Int w cos(2 pi f t) dt by Boole's rule, spacing by spacing. */
static double transform(const struct gbg_ewald_window *window, double f)
{
    enum { PARTS = 256 };
    static const double weight[] = {7, 32, 12, 32, 7};
    double h = 1.0 / PARTS;
    long double total = 0;
    for (int n = 0; n < window->width * PARTS; n++) {
        for (int m = 0; m < 5; m++) {
            double t = -window->width / 2.0 + (n + m / 4.0) * h;
            total +=
                (long double)weight[m] * gbg_ewald_window_value(window, t) * cos(2 * PI * f * t);
        }
    }
    return (double)(total * h / 90);
}

/* Sum of terms m = -most .. most; the slope without the steps at the window's ends, whose
 * transform is that of two impulses. */
static void alias_terms(const struct gbg_ewald_window *window, double f, int most, double *sum)
{
    double end = window->width / 2.0, step = gbg_ewald_window_value(window, end);
    sum[0] = sum[1] = 0;
    for (int m = -most; m <= most; m++) {
        double value = gbg_ewald_window_transform(window, f + m);
        double slope = (f + m) * value - step * sin(2 * PI * (f + m) * end) / PI;
        sum[0] += value * value;
        sum[1] += slope * slope;
    }
}

static void check_transform(int kind, int width, double finer)
{
    struct gbg_ewald_window window;
    assert_int_equal(gbg_ewald_window_make(kind, width, finer, &window), GBG_OK);
    double peak = gbg_ewald_window_transform(&window, 0), worst = 0, power = 0, slope = 0;
    for (double f = 0; f < 2.6; f += 0.07) {
        double given = gbg_ewald_window_transform(&window, f);
        assert_true(given == gbg_ewald_window_transform(&window, -f));
        worst = fmax(worst, fabs(given - transform(&window, f)) / peak);
    }
    /* steps make terms that fall as 1/m^2: a finite sum of them is right to the step's square */
    double step = kind == GBG_EWALD_PROLATE ? gbg_ewald_window_value(&window, width / 2.0) : 0;
    for (double f = 0; f <= 0.5 / finer; f += 0.06) {
        double sums[2], terms[2];
        gbg_ewald_window_alias(&window, f, &sums[0], &sums[1]);
        alias_terms(&window, f, kind == GBG_EWALD_BSPLINE ? 2000 : width < 8 ? 200 : 20, terms);
        power = fmax(power, fabs(sums[0] / terms[0] - 1));
        assert_true(fabs(sums[0] - terms[0]) < 1e-12 * terms[0] + 0.1 * step * step);
        slope = fmax(slope, fabs(sums[1] - terms[1]) / (peak * peak));
    }
    printf("%s width %2d finer %.2f: transform %.1e, sums over aliases %.1e, of slopes %.1e (step "
           "%.1e)\n",
           name(kind), width, finer, worst, power, slope, step);
    assert_true(worst < 1e-14);
    assert_true(slope < 1e-12 + step * step);
}

static void transforms_and_aliases_are_right(void **state)
{
    (void)state;
    for (int width = GBG_EWALD_NARROWEST; width <= GBG_EWALD_WIDEST; width += width < 8 ? 1 : 4) {
        check_transform(GBG_EWALD_PROLATE, width, 1.1);
        check_transform(GBG_EWALD_PROLATE, width, 1.5);
        check_transform(GBG_EWALD_PROLATE, width, 3);
        check_transform(GBG_EWALD_BSPLINE, width, 1);
    }
}

/* The sum of a window over nodes is the sum of its transform at whole numbers. */
static void sums_over_nodes_obey_poisson(void **state)
{
    (void)state;
    double worst = 0;
    for (int width = 5; width <= GBG_EWALD_WIDEST; width++) {
        struct gbg_ewald_window window;
        assert_int_equal(gbg_ewald_window_make(GBG_EWALD_PROLATE, width, 1.25, &window), GBG_OK);
        double step = gbg_ewald_window_value(&window, width / 2.0);
        for (double z = -0.95; z < 1; z += 0.1) {
            double sum = 0, waves = 0;
            for (int l = 0; l < width; l++) {
                sum += gbg_ewald_window_value(&window, l + 0.5 - width / 2.0 - z / 2);
            }
            for (int m = -8; m <= 8; m++) {
                double t = 0.5 - width / 2.0 - z / 2;
                waves += gbg_ewald_window_transform(&window, m) * cos(2 * PI * m * t);
            }
            worst = fmax(worst, fabs(sum / waves - 1));
            assert_true(fabs(sum / waves - 1) < 1e-14 + 0.1 * step);
        }
    }
    printf("prolate windows: sum over nodes against that of waves, at most (width 5): %.1e\n",
           worst);
}

static void bad_windows_are_refused(void **state)
{
    (void)state;
    struct gbg_ewald_window window;
    assert_int_equal(gbg_ewald_window_make(0, 2, 1.25, &window), GBG_E_ARGUMENT);
    assert_int_equal(gbg_ewald_window_make(0, 17, 1.25, &window), GBG_E_ARGUMENT);
    assert_int_equal(gbg_ewald_window_make(2, 6, 1.25, &window), GBG_E_ARGUMENT);
    assert_int_equal(gbg_ewald_window_make(0, 6, 0.99, &window), GBG_E_ARGUMENT);
    assert_int_equal(gbg_ewald_window_make(0, 6, 4.01, &window), GBG_E_ARGUMENT);
    assert_int_equal(gbg_ewald_window_make(0, 6, NAN, &window), GBG_E_ARGUMENT);
    assert_int_equal(gbg_ewald_window_shaped(6, 20, &window), GBG_E_ARGUMENT);
    assert_int_equal(gbg_ewald_window_shaped(6, 0, &window), GBG_E_ARGUMENT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(polynomials_are_the_window),
        cmocka_unit_test(splines_are_splines),
        cmocka_unit_test(transforms_and_aliases_are_right),
        cmocka_unit_test(sums_over_nodes_obey_poisson),
        cmocka_unit_test(bad_windows_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
