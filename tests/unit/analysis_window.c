/* Tests of c/analysis/window.c: polynomials, transform, aliasing sums, the best beta. */
#include "analysis_help.h"

#include "analysis/window.h"

/* The window as the polynomials have it, at a distance t from the particle. */
static double window_at(const struct gbg_window *window, double t)
{
    double from_left = t + window->width / 2.0;
    int node = (int)floor(from_left);
    node = node < 0 ? 0 : node >= window->width ? window->width - 1 : node;
    double z = 2 * (node + 0.5 - from_left), sum = 0;
    for (int k = GBG_WINDOW_DEGREE(window->width); k >= 0; k--) {
        sum = sum * z + window->coefficient[k][GBG_WINDOW_LEAD(window->width) + node];
    }
    return sum;
}

/* exp(-x) I0(x) by its integral over the circle: spectrally accurate. */
static long double bessel_0(long double x)
{
    long double sum = 0;
    for (int i = 0; i < 128; i++) {
        sum += expl(x * (cosl(3.14159265358979323846L * i / 64) - 1));
    }
    return sum / 128;
}

static void polynomials_are_the_window(void **state)
{
    (void)state;
    for (int width = GBG_WINDOW_NARROWEST; width <= GBG_WINDOW_WIDEST;
         width = GBG_WINDOW_NEXT(width)) {
        struct gbg_window window;
        gbg_window_make(width, &window);
        double worst = 0, sum, root;
        for (int i = 1; i < 200; i++) {
            double t = width * (i / 200.0 - 0.5);
            long double x = 2.0L * t / width, y = sqrtl(1 - x * x), beta = window.beta;
            long double exact = (bessel_0(beta * y) * expl(beta * (y - 1)) - expl(-beta)) /
                                (bessel_0(beta) - expl(-beta));
            worst = fmax(worst, (double)fabsl(window_at(&window, t) - exact));
        }
        gbg_window_alias(&window, 0.25, &sum, &root);
        print_message("width %2d: aliasing %.2e, polynomials off by %.1e (stated %.1e)\n", width,
                      sum, worst, window.polynomial_error);
        assert_true(worst <= window.polynomial_error + 1e-15);
        /* What the polynomials do to a mode, against aliasing: negligible down to rounding. */
        double effect = window.polynomial_error * width / gbg_window_transform(&window, 0.25);
        assert_true(effect < 0.08 * sum || effect < 2e-14);
    }
}

/* transform(f) against the trapezoidal rule, whose own aliases lie at f + 256 m. */
static void transform_is_the_integral(void **state)
{
    (void)state;
    for (int width = GBG_WINDOW_NARROWEST; width <= GBG_WINDOW_WIDEST;
         width = GBG_WINDOW_NEXT(width)) {
        struct gbg_window window;
        gbg_window_make(width, &window);
        for (double f = 0; f < 2; f += 0.37) {
            double sum = 0;
            for (int i = 1; i < 256 * width; i++) {
                double t = i / 256.0 - width / 2.0;
                sum += window_at(&window, t) * cos(two_pi * f * t) / 256;
            }
            assert_true(fabs(sum - gbg_window_transform(&window, f)) <
                        1e-5 * window.transform_zero / exp(0.8 * window.beta) +
                            width * window.polynomial_error + 1e-14);
        }
    }
}

/* Periodic sum over nodes of phi exp(-2 pi i f x) against transform(f): the difference is what the
 * aliases make, for any position of the particle. */
static void aliasing_sum_is_a_bound_that_is_nearly_reached(void **state)
{
    (void)state;
    for (int width = 3; width <= 12; width = GBG_WINDOW_NEXT(width)) {
        struct gbg_window window;
        gbg_window_make(width, &window);
        double worst_ratio = 0;
        for (double f = 0; f <= 0.25; f += 0.05) {
            double sum, root;
            gbg_window_alias(&window, f, &sum, &root);
            assert_true(root <= sum);
            for (double place = 0; place < 1; place += 0.03125) {
                double real = 0, imaginary = 0;
                for (int l = -9; l <= 9; l++) {
                    double t = l - place;
                    if (fabs(t) < width / 2.0) {
                        real += window_at(&window, t) * cos(two_pi * f * t);
                        imaginary += window_at(&window, t) * sin(two_pi * f * t);
                    }
                }
                double exact = gbg_window_transform(&window, f);
                double error = hypot(real - exact, imaginary) / exact;
                double rounding = (width * window.polynomial_error + 4e-15) / exact;
                assert_true(error <= sum + rounding);
                worst_ratio = fmax(worst_ratio, (error - rounding) / sum);
            }
        }
        print_message("width %2d: single particles reach %.2f of the aliasing sum\n", width,
                      worst_ratio);
        assert_true(worst_ratio > 0.3);
    }
}

static double worst_in_band(int width, double beta)
{
    struct gbg_window window;
    double worst = 0, sum, root;
    gbg_window_make_with(width, beta, &window);
    for (int i = 0; i <= 100; i++) {
        gbg_window_alias(&window, i / 400.0, &sum, &root);
        worst = fmax(worst, sum);
    }
    return worst;
}

/* No other beta has a smaller bound, to 6 %. */
static void beta_is_the_best(void **state)
{
    (void)state;
    for (int width = GBG_WINDOW_NARROWEST; width <= GBG_WINDOW_WIDEST;
         width = GBG_WINDOW_NEXT(width)) {
        struct gbg_window window;
        gbg_window_make(width, &window);
        double here = worst_in_band(width, window.beta), best = here;
        for (double change = 0.97; change < 1.03; change += 0.01) {
            best = fmin(best, worst_in_band(width, change * window.beta));
        }
        assert_true(here <= 1.06 * best);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(polynomials_are_the_window),
        cmocka_unit_test(transform_is_the_integral),
        cmocka_unit_test(aliasing_sum_is_a_bound_that_is_nearly_reached),
        cmocka_unit_test(beta_is_the_best),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
