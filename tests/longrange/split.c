/* Tests of prolate functions and of the near and far part of splits, against closed forms of the
 * Gaussian split, quadrature, and the power law itself in real space. */
#define _XOPEN_SOURCE 700 /* j0, j1 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "ewald/prolate.h"
#include "ewald/split.h"
#include "gamboge/status.h"

#define PI 3.141592653589793238462643383279502884L

/* Simpson's rule with Richardson's step taken three times: no nodes shared with the library. */
static long double romberg(long double (*f)(long double, const void *), const void *data,
                           long double low, long double high, int levels)
{
    long double row[24], width = high - low;
    row[0] = width * (f(low, data) + f(high, data)) / 2;
    for (int level = 1; level < levels; level++) {
        long double sum = 0, before = row[0];
        for (long n = 0; n < 1L << (level - 1); n++) {
            sum += f(low + width * (n + 0.5L) / (1L << (level - 1)), data);
        }
        row[0] = before / 2 + width * sum / (1L << level);
        long double factor = 4;
        for (int k = 1; k <= level; k++) {
            long double next = k < level ? row[k] : 0;
            row[k] = row[k - 1] + (row[k - 1] - before) / (factor - 1);
            before = next;
            factor *= 4;
        }
    }
    return row[levels - 1];
}

/* ---- prolate functions ---- */

struct wave {
    const struct gbg_prolate *prolate;
    long double k;
};

static long double times_wave(long double x, const void *data)
{
    const struct wave *wave = data;
    return gbg_prolate_value(wave->prolate, (double)x) * cosl(wave->k * x);
}

static void prolate_is_its_own_transform(void **state)
{
    (void)state;
    const double c[] = {0.3, 1, 5, 12, 24, 40, 80, 160};
    for (int i = 0; i < 8; i++) {
        struct gbg_prolate prolate;
        assert_int_equal(gbg_prolate_make(c[i], &prolate), GBG_OK);
        struct wave wave = {&prolate, 0};
        int levels = c[i] > 40 ? 14 : 12;
        double at_zero = (double)(2 * romberg(times_wave, &wave, 0, 1, levels)), own = 0, other = 0;
        for (int n = 0; n <= 10; n++) {
            double x = n / 10.0;
            wave.k = c[i] * x;
            double transform = (double)(2 * romberg(times_wave, &wave, 0, 1, levels));
            own = fmax(own, fabs(transform / at_zero - gbg_prolate_value(&prolate, x)));
            wave.k = c[i] * 3 * x;
            transform = (double)(2 * romberg(times_wave, &wave, 0, 1, levels));
            double given = gbg_prolate_transform(&prolate, (double)-wave.k);
            other = fmax(other, fabs(transform - given) / at_zero);
        }
        printf("prolate c %5.1f: transform in the band over psi - 1: %.1e, up to three times the "
               "band: %.1e, psi(1) %.1e\n",
               c[i], own, other, gbg_prolate_value(&prolate, 1));
        assert_true(own < 3e-15 && other < 3e-15);
        assert_true(fabs(gbg_prolate_value(&prolate, 0) - 1) < 2e-15);
    }
}

/* ((1-x^2) psi')' - c^2 x^2 psi = -chi psi, derivatives by differences of eighth order. */
static void prolate_obeys_its_equation(void **state)
{
    (void)state;
    static const double weight[] = {4 / 5.0, -1 / 5.0, 4 / 105.0, -1 / 280.0};
    for (double c = 1; c < 100; c *= 3) {
        struct gbg_prolate prolate;
        assert_int_equal(gbg_prolate_make(c, &prolate), GBG_OK);
        double h = 0.02 / sqrt(1 + c), chi = NAN, worst = 0, slopes = 0;
        for (double x = 0; x < 0.8; x += 0.05) {
            double flux = 0, slope = 0;
            for (int n = 1; n <= 4; n++) {
                double up = x + n * h, down = x - n * h;
                flux += weight[n - 1] * ((1 - up * up) * gbg_prolate_slope(&prolate, up) -
                                         (1 - down * down) * gbg_prolate_slope(&prolate, down));
                slope += weight[n - 1] *
                         (gbg_prolate_value(&prolate, up) - gbg_prolate_value(&prolate, down));
            }
            double value = gbg_prolate_value(&prolate, x);
            double rest = flux / h - c * c * x * x * value;
            chi = isnan(chi) ? -rest / value : chi;
            worst = fmax(worst, fabs(rest + chi * value) / chi);
            slopes = fmax(slopes, fabs(slope / h - gbg_prolate_slope(&prolate, x)));
        }
        printf(
            "prolate c %4.0f: chi %.12g (about c - 1/2 for large c), residual %.1e, slope %.1e\n",
            c, chi, worst, slopes);
        assert_true(worst < 1e-11 && slopes < 1e-11);
    }
    struct gbg_prolate prolate;
    assert_int_equal(gbg_prolate_make(0, &prolate), GBG_E_ARGUMENT);
    assert_int_equal(gbg_prolate_make(161, &prolate), GBG_E_ARGUMENT);
    assert_int_equal(gbg_prolate_make(NAN, &prolate), GBG_E_ARGUMENT);
}

/* ---- closed forms of the Gaussian split ---- */

static long double exponential(long double t, const void *data)
{
    return expl(-*(const long double *)data * expl(t));
}

/* Gamma(twice_a/2, y): from 1/2 or 0 (the exponential integral) by the recursion in a. */
static long double upper_gamma(int twice_a, long double y)
{
    int odd = twice_a & 1, twice = odd ? 1 : 0;
    long double value =
        odd ? sqrtl(PI) * erfcl(sqrtl(y)) : romberg(exponential, &y, 0, logl(1 + 60 / y), 12);
    if (!odd && twice_a > 0) {
        value = expl(-y);
        twice = 2;
    }
    for (; twice > twice_a; twice -= 2) {
        long double a = twice / 2.0L - 1;
        value = (value - powl(y, a) * expl(-y)) / a;
    }
    for (; twice < twice_a; twice += 2) {
        value = twice / 2.0L * value + powl(y, twice / 2.0L) * expl(-y);
    }
    return value;
}

static double gaussian_near(int power, double alpha, double r)
{
    long double y = (long double)(alpha * r) * (alpha * r);
    return (double)(upper_gamma(power + 1, y) / tgammal((power + 1) / 2.0L) * powl(r, -power - 1));
}

static double gaussian_far(int dimension, int power, double alpha, double k)
{
    int s = power - 1;
    long double y = (long double)(k / alpha) * (k / alpha) / 4;
    return (double)(powl(PI, dimension / 2.0L) / tgammal(s / 2.0L + 1) / 2 *
                    powl(k / 2.0L, s - dimension) * upper_gamma(dimension - s, y));
}

static void gaussian_is_that_of_closed_forms(void **state)
{
    (void)state;
    for (int dimension = 2; dimension <= 3; dimension++) {
        for (int power = dimension == 3 ? 2 : 1; power <= (dimension == 3 ? 2 : 6); power++) {
            double worst = 0, tail = 0, near = 0;
            static struct gbg_split split;
            for (double band = 5; band < 80; band *= 1.7) {
                assert_int_equal(
                    gbg_split_make(dimension, power, GBG_SPLIT_GAUSSIAN, 1.3, band, &split),
                    GBG_OK);
                double alpha = sqrt(band / 2) / 1.3;
                for (double k = band / 1.3 * 0.999; k > 1e-10; k *= 0.83) {
                    double exact = gaussian_far(dimension, power, alpha, k);
                    double uncut = gaussian_far(dimension, power, alpha, fmin(k, alpha));
                    double error = fabs(gbg_split_far(&split, k) - exact);
                    *(exact > 1e-3 * uncut ? &worst : &tail) = fmax(
                        exact > 1e-3 * uncut ? worst : tail, error / fmax(exact, 1e-3 * uncut));
                }
                for (double r = 0.05; r < 1.3; r += 0.02) {
                    near = fmax(
                        near, fabs(gbg_split_near(&split, r) / gaussian_near(power, alpha, r) - 1));
                }
            }
            printf("Gaussian %dD power %d: far %.1e, where it is cut %.1e, near %.1e\n", dimension,
                   power, worst, tail, near);
            assert_true(worst < 3e-14 && tail < 3e-14 && near < 1e-12);
        }
    }
}

/* The best known ones once more, by formulas that are written down everywhere. */
static void gaussian_is_ewalds(void **state)
{
    (void)state;
    static struct gbg_split plane, space;
    double alpha = sqrt(10) / 2;
    assert_int_equal(gbg_split_make(2, 2, GBG_SPLIT_GAUSSIAN, 2, 20, &plane), GBG_OK);
    assert_int_equal(gbg_split_make(3, 2, GBG_SPLIT_GAUSSIAN, 2, 20, &space), GBG_OK);
    double worst = 0;
    for (double k = 0.01; k < 6; k *= 1.3) {
        double erfc_form = 2 * (double)PI / k * erfc(k / (2 * alpha));
        double exp_form = 4 * (double)PI / (k * k) * exp(-k * k / (4 * alpha * alpha));
        worst = fmax(worst, fabs(gbg_split_far(&plane, k) / erfc_form - 1));
        worst = fmax(worst, fabs(gbg_split_far(&space, k) / exp_form - 1));
    }
    assert_true(worst < 2e-14);
    assert_true(fabs(space.self - 2 * alpha / sqrt((double)PI)) < 1e-14);
    assert_true(gbg_split_far(&plane, 0) == 0 && gbg_split_far(&plane, 10) == 0);
}

/* ---- polynomials ---- */

static double horner(const double *power, int degree, double z)
{
    double sum = 0;
    for (int k = degree; k >= 0; k--) {
        sum = sum * z + power[k];
    }
    return sum;
}

static void check_polynomials(int dimension, double power, int kind, double band)
{
    static struct gbg_split split, small;
    const double reach = 1.7;
    double force = 0, potential = 0, shortened = 0, cut = 0, s = power - 1;
    assert_int_equal(gbg_split_make(dimension, power, kind, reach, band, &split), GBG_OK);
    small = split;
    gbg_split_shorten(&small, 1e-7);
    int degree = gbg_split_degree(&split, 1e-7);
    double peak = horner(split.near, split.degree, -1) * pow(reach, -power - 1);
    double peak_potential = pow(reach / 8, -s) / fmax(s, 1);
    for (double r = reach / 8; r < reach; r *= 1.02) {
        double z = 2 * (r / reach) * (r / reach) - 1, law = pow(r, -power - 1);
        double exact = law - gbg_split_near(&split, r), unit = pow(reach, -power - 1);
        double full = unit * horner(split.near, split.degree, z);
        force = fmax(force, fabs(full - exact) / (law + peak));
        shortened = fmax(shortened, fabs(unit * horner(small.near, small.degree, z) - full) / peak);
        cut = fmax(cut, fabs(unit * horner(split.near, degree, z) - full) / peak);
        double own = s == 0 ? -log(r / reach) : pow(r, -s) / s;
        double rest = own - pow(reach, -s) * horner(split.potential, split.degree, z);
        potential =
            fmax(potential, fabs(rest - gbg_split_near_potential(&split, r)) / peak_potential);
    }
    printf("%s %dD power %.1f band %4.1f: degree %2d, force %.1e, potential %.1e; 1e-7: degree %2d "
           "(%.1e), cut off %2d (%.1e)\n",
           kind == GBG_SPLIT_PROLATE ? "prolate " : "Gaussian", dimension, power, band,
           split.degree, force, potential, small.degree, shortened, degree, cut);
    assert_true(force < 2e-15 && potential < 5e-15 && split.polynomial_error < 1e-15);
    assert_true(small.degree <= degree && degree <= split.degree);
    assert_true(shortened < 1.5e-7 && cut < 1.5e-7);
}

static void polynomials_are_the_integrals(void **state)
{
    (void)state;
    for (int kind = 0; kind < 2; kind++) {
        for (int power = 1; power <= 6; power++) {
            for (double band = 3; band <= 80; band *= 2.9) {
                check_polynomials(2, power, kind, band);
            }
        }
        check_polynomials(2, 2.5, kind, 20);
        check_polynomials(3, 2, kind, 80);
    }
}

/* ---- near and far together: the power law ---- */

struct wave_sum {
    const struct gbg_split *split;
    double r;
    int force;
};

/* The far part at r from all waves: force, or potential. */
static long double wave_term(long double wave, const void *data)
{
    const struct wave_sum *sum = data;
    double k = (double)wave, x = k * sum->r, far = gbg_split_far(sum->split, k);
    if (sum->split->dimension == 2) {
        return far * k / (2 * PI) * (sum->force ? k * j1(x) : j0(x));
    }
    double sinc = sin(x) / x;
    return far * k * k / (2 * PI * PI) * (sum->force ? k * (sinc - cos(x)) / x : sinc);
}

static double far_in_space(const struct gbg_split *split, double r, int force)
{
    struct wave_sum sum = {split, r, force};
    double end = split->band / split->reach, total = 0;
    for (int octave = 0; octave < 64; octave++) {
        long double high = ldexpl(end, -octave) * (octave == 0 ? 1 - 1e-15L : 1);
        int parts = octave < 6 ? 32 >> octave : 1;
        for (int n = 0; n < parts; n++) {
            long double low = ldexpl(end, -octave - 1), step = (high - low) / parts;
            total += (double)romberg(wave_term, &sum, low + n * step, low + (n + 1) * step, 8);
        }
    }
    return total;
}

static void parts_add_to_the_power_law(void **state)
{
    (void)state;
    for (int kind = 0; kind < 2; kind++) {
        for (int n = 1; n <= 7; n++) {
            int dimension = n == 7 ? 3 : 2, power = n == 7 ? 2 : n;
            static struct gbg_split split;
            double band = kind == GBG_SPLIT_PROLATE ? 36 : 80, worst = 0, other = 0;
            assert_int_equal(gbg_split_make(dimension, power, kind, 1, band, &split), GBG_OK);
            for (double r = 0.15; r < 3; r *= 1.4) {
                double force = r * gbg_split_near(&split, r) + far_in_space(&split, r, 1);
                double potential = gbg_split_near_potential(&split, r);
                potential += power > 1 ? far_in_space(&split, r, 0) : 0;
                double law = power > 1 ? pow(r, 1 - power) / (power - 1) : NAN;
                double most = fmax(pow(r, -power), 1), most_law = fmax(law, 1.0 / power);
                worst = fmax(worst, fabs(force - pow(r, -power)) / most);
                other = power > 1 ? fmax(other, fabs(potential - law) / most_law) : 0;
            }
            double self = power > 1 ? fabs(far_in_space(&split, 1e-9, 0) / split.self - 1) : 0;
            printf("%s %dD power %d: near + far against the power law, over it at r or at the "
                   "reach: force "
                   "%.1e, potential %.1e, own %.1e\n",
                   kind == GBG_SPLIT_PROLATE ? "prolate " : "Gaussian", dimension, power, worst,
                   other, self);
            assert_true(worst < 1e-12 && other < 1e-12 && self < 1e-13);
        }
    }
}

static void bad_splits_are_refused(void **state)
{
    (void)state;
    static struct gbg_split split;
    assert_int_equal(gbg_split_make(4, 2, 0, 1, 10, &split), GBG_E_ARGUMENT);
    assert_int_equal(gbg_split_make(2, 0.5, 0, 1, 10, &split), GBG_E_ARGUMENT);
    assert_int_equal(gbg_split_make(2, 6.5, 0, 1, 10, &split), GBG_E_ARGUMENT);
    assert_int_equal(gbg_split_make(2, 2, 2, 1, 10, &split), GBG_E_ARGUMENT);
    assert_int_equal(gbg_split_make(2, 2, 0, 0, 10, &split), GBG_E_ARGUMENT);
    assert_int_equal(gbg_split_make(2, 2, 0, INFINITY, 10, &split), GBG_E_ARGUMENT);
    assert_int_equal(gbg_split_make(2, 2, 0, 1, 1.9, &split), GBG_E_ARGUMENT);
    assert_int_equal(gbg_split_make(2, 2, 0, 1, 81, &split), GBG_E_ARGUMENT);
    assert_int_equal(gbg_split_make(2, NAN, 0, 1, NAN, &split), GBG_E_ARGUMENT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(prolate_is_its_own_transform),
        cmocka_unit_test(prolate_obeys_its_equation),
        cmocka_unit_test(gaussian_is_that_of_closed_forms),
        cmocka_unit_test(gaussian_is_ewalds),
        cmocka_unit_test(polynomials_are_the_integrals),
        cmocka_unit_test(parts_add_to_the_power_law),
        cmocka_unit_test(bad_splits_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
