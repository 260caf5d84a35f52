/* Tests of the Ewald sums that all long-range errors are measured against: against themselves with
 * other splits, lattice sums known in closed form, and plain sums over images. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/context.h"
#include "gamboge/status.h"
#include "sets.h"

enum { MOST = 20000 };
static const double pi = 3.14159265358979323846, euler = 0.57721566490153286061;

struct result {
    double force[3][MOST], potential[MOST];
};
static struct result first, second;
static int32_t everyone[MOST];
static const char *backend = "cpu:threads=1";

static int run(const struct particle_set *s, double power, double balance, int64_t n_targets,
               const int32_t *target, struct result *result)
{
    struct gbg_context *context = NULL;
    assert_int_equal(gbg_context_create(backend, &context), GBG_OK);
    struct gbg_ewald_sources sources = set_sources(s, power);
    double *force[3] = {result->force[0], result->force[1], result->force[2]};
    int status = gbg_ewald_reference(context, &sources, balance, n_targets, target, force,
                                     result->potential);
    gbg_context_destroy(&context);
    return status;
}

/* At all particles. */
static void run_all(const struct particle_set *s, double power, double balance,
                    struct result *result)
{
    for (int64_t i = 0; i < s->n; i++) {
        everyone[i] = (int32_t)i;
    }
    assert_int_equal(run(s, power, balance, s->n, everyone, result), GBG_OK);
}

/* Largest of a number over all calls since it was 0. */
static void at_most(double *worst, double value)
{
    *worst = value > *worst || isnan(value) ? value : *worst;
}

static double force_size(int dimension, int64_t n, const struct result *r)
{
    double sum = 0.0;
    for (int64_t i = 0; i < n; i++) {
        for (int a = 0; a < dimension; a++) {
            sum += r->force[a][i] * r->force[a][i];
        }
    }
    return sqrt(sum / (double)n);
}

/* The second result against the first, forces and potentials: RMS over RMS, forces over `scale`
 * where the RMS is less. */
static void compare_over(double scale, int dimension, int64_t n, double *force, double *potential)
{
    const double *one[3] = {first.force[0], first.force[1], first.force[2]};
    const double *two[3] = {second.force[0], second.force[1], second.force[2]};
    double wrong = 0.0, whole = 0.0;
    for (int64_t i = 0; i < n; i++) {
        double difference = second.potential[i] - first.potential[i];
        wrong += difference * difference;
        whole += first.potential[i] * first.potential[i];
    }
    double size = force_size(dimension, n, &first);
    double error = set_error_of(dimension, n, two, one).over_rms;
    at_most(force, error * size / fmax(size, scale));
    at_most(potential, sqrt(wrong / whole));
}

static void compare(int dimension, int64_t n, double *force, double *potential)
{
    compare_over(0.0, dimension, n, force, potential);
}

/* Two or three particles may be so far apart in a long box that their forces are far below those of
 * a particle's own images, which cancel: the error is over one of these. */
static void splits_agree_for(int dimension, double power, const double *length, int64_t n,
                             double *force, double *potential)
{
    static const double balance[3] = {1.0, 1.6, 0.7};
    double image =
        pow(fmin(length[0], fmin(length[1], dimension == 3 ? length[2] : length[1])), -power);
    for (int kind = SET_JITTERED; kind <= SET_RANDOM; kind++) {
        struct particle_set s;
        assert_true(set_make(&s, (enum set_kind)kind, dimension, length, n, 0, 11));
        run_all(&s, power, balance[0], &first);
        for (int b = 1; b < 3; b++) {
            run_all(&s, power, balance[b], &second);
            compare_over(n < 4 ? image : 0.0, dimension, n, force, potential);
        }
        set_free(&s);
    }
}

static void splits_agree(void **state)
{
    (void)state;
    static const double length[4][3] = {{1, 1, 1}, {3, 1, 1}, {1, 100, 1}, {2, 5, 3}};
    static const double power[8] = {1, 2, 3, 4, 5, 6, 1.5, 3.25};
    static const int64_t n[3] = {2, 3, 200};
    for (int dimension = 2; dimension <= 3; dimension++) {
        for (int p = 0; p < 8; p++) {
            double force = 0.0, potential = 0.0;
            for (int k = 0; k < 12 && (dimension == 2 || p == 1 || p == 3); k++) {
                splits_agree_for(dimension, power[p], length[k % 4], n[k / 4], &force, &potential);
            }
            if (force > 0.0) {
                printf("splits, %dD, power %g: force %.1e, potential %.1e\n", dimension, power[p],
                       force, potential);
            }
            assert_true(force < 1e-13 && potential < 1e-13);
        }
    }
}

/* Many sources: tables, blocks of sources, all distributions. */
static void splits_agree_of_many(void **state)
{
    (void)state;
    static const double square[3] = {1, 1, 1};
    int32_t target[100];
    for (int kind = 0; kind < SET_KINDS; kind++) {
        for (int dimension = 2; dimension <= 3; dimension++) {
            struct particle_set s;
            double force = 0.0, potential = 0.0;
            assert_true(set_make(&s, (enum set_kind)kind, dimension, square, MOST, 0, 3));
            int64_t m = set_targets(MOST, 100, 1, target);
            assert_int_equal(run(&s, 2.0, 1.0, m, target, &first), GBG_OK);
            assert_int_equal(run(&s, 2.0, 1.3, m, target, &second), GBG_OK);
            compare(dimension, m, &force, &potential);
            printf("splits, %dD, 20000 %s: force %.1e, potential %.1e\n", dimension,
                   set_names[kind], force, potential);
            assert_true(force < 1e-13 && potential < 1e-13);
            set_free(&s);
        }
    }
}

/* Threads change no bit, instruction sets only the rounding. */
static void machines_agree(void **state)
{
    (void)state;
    static const double length[3] = {2, 1, 1};
    struct particle_set s;
    double force = 0.0, potential = 0.0;
    assert_true(set_make(&s, SET_RANDOM, 2, length, 5000, 1, 3));
    run_all(&s, 2.0, 1.0, &first);
    backend = "cpu:threads=3";
    run_all(&s, 2.0, 1.0, &second);
    for (int a = 0; a < 2; a++) {
        assert_memory_equal(first.force[a], second.force[a], 5000 * sizeof(double));
    }
    assert_memory_equal(first.potential, second.potential, 5000 * sizeof(double));
    backend = "cpu:threads=1,isa=generic";
    run_all(&s, 2.0, 1.0, &second);
    backend = "cpu:threads=1";
    compare(2, 5000, &force, &potential);
    printf("instruction sets: force %.1e, potential %.1e\n", force, potential);
    assert_true(force < 1e-13 && potential < 1e-13);
    set_free(&s);
}

/* Particles on rows of a box, every other row moved by `stagger` spacings; strength 1, or sign by
 * row or by row and column. */
static void make_rows(struct particle_set *s, int columns, int rows, double spacing, double height,
                      double stagger, int signs)
{
    double length[3] = {columns * spacing, rows * height, 1};
    assert_true(set_make(s, SET_RANDOM, 2, length, (int64_t)columns * rows, 0, 1));
    for (int i = 0; i < columns * rows; i++) {
        int row = i / columns, column = i % columns;
        s->position[0][i] = (column + (row & 1) * stagger + 0.1) * spacing;
        s->position[1][i] = (row + 0.2) * height;
        s->alpha[i] = signs && ((row + (signs - 1) * column) & 1) ? -1.0 : 1.0;
    }
}

static void force_is_zero_by_symmetry(void **state)
{
    (void)state;
    for (double power = 1.0; power <= 6.0; power += 1.0) {
        double worst = 0.0;
        for (int k = 0; k < 5; k++) {
            struct particle_set s;
            static const int count[5][2] = {{9, 9}, {8, 10}, {1, 1}, {1, 2}, {1, 1}};
            static const double height[5] = {1.0, 0.86602540378443865, 1.0, 0.5, 100.0};
            make_rows(&s, count[k][0], count[k][1], 1.0, height[k], k == 1 ? 0.5 : 0.0, 0);
            run_all(&s, power, 1.0, &first);
            at_most(&worst, force_size(2, s.n, &first) * pow(fmin(1.0, height[k]), power));
            set_free(&s);
        }
        printf("symmetric places, power %g: force %.1e of a neighbour's\n", power, worst);
        assert_true(worst < 1e-13);
    }
}

/* zeta(s, q) = sum over k of (k + q)^-s by Euler and Maclaurin, s not 1. */
static long double hurwitz(long double s, long double q)
{
    static const long double bernoulli[8] = {1.0L / 6,  -1.0L / 30,     1.0L / 42, -1.0L / 30,
                                             5.0L / 66, -691.0L / 2730, 7.0L / 6,  -3617.0L / 510};
    const int whole = 24;
    long double sum = 0, x = whole + q;
    for (int k = 0; k < whole; k++) {
        sum += powl(k + q, -s);
    }
    sum += powl(x, 1 - s) / (s - 1) + powl(x, -s) / 2;
    long double factor = s * powl(x, -s - 1) / 2;
    for (int k = 0; k < 8; k++) {
        sum += bernoulli[k] * factor;
        factor *= (s + 2 * k + 1) * (s + 2 * k + 2) / ((2 * k + 3) * (2 * k + 4) * x * x);
    }
    return sum;
}

/* Sum of r^-s/s over the square (continued: zeta(s/2) beta(s/2)) or the triangular lattice, both
 * with unit spacing; for s = 0 its limit, for s = 2 what Kronecker's formula leaves. */
static double lattice_sum(int triangular, double s)
{
    long double h = 0.5L * s, quarter = lgammal(0.25L);
    if (s == 0.0) {
        return (double)(logl(2 * acosl(-1.0L)) / -2 -
                        (2 * quarter - logl(2 * sqrtl(2.0L) * acosl(-1.0L))));
    }
    if (s == 2.0) {
        long double slope = pi / 4 * (euler + 2 * logl(2.0L) + 3 * logl(pi) - 4 * quarter);
        return (double)(2 * (euler * pi / 4 + slope));
    }
    long double zeta = hurwitz(h, 1.0L) / s;
    return triangular
               ? (double)(6 * zeta * powl(3, -h) * (hurwitz(h, 1 / 3.0L) - hurwitz(h, 2 / 3.0L)))
               : (double)(4 * zeta * powl(4, -h) * (hurwitz(h, 0.25L) - hurwitz(h, 0.75L)));
}

/* Lattices of equal particles: with the background (power up to 3) or as plain sums. */
static void equal_lattices_are_known(void **state)
{
    (void)state;
    for (int triangular = 0; triangular < 2; triangular++) {
        for (double power = 1.0; power <= 6.0; power += 0.5) {
            struct particle_set s;
            double exact = lattice_sum(triangular, power - 1.0), worst = 0.0;
            if (triangular && (power == 1.0 || power == 3.0)) {
                continue; /* depend on the unit of length */
            }
            make_rows(&s, 1, triangular ? 2 : 1, 1.0, triangular ? 0.86602540378443865 : 1.0,
                      triangular ? 0.5 : 0.0, 0);
            run_all(&s, power, 1.0, &first);
            for (int i = 0; i < s.n; i++) {
                at_most(&worst, fabs(first.potential[i] / exact - 1.0));
            }
            printf("%s lattice, power %g: potential %.15g, error %.1e\n",
                   triangular ? "triangular" : "square", power, exact, worst);
            assert_true(worst < 1e-13);
            set_free(&s);
        }
    }
}

/* K0(z) = Int_0^inf exp(-z cosh t) dt: equal steps are exact to all digits. */
static long double bessel_k0(long double z)
{
    long double sum = expl(-z) / 2, step = 1 / 32.0L;
    for (int k = 1; k < 160; k++) {
        sum += expl(-z * coshl(k * step));
    }
    return sum * step;
}

/* Rows `height` apart of particles at unit distance, signs by row, each row moved by `stagger`
 * against the last: potential 1/r at a particle, row by row (Lekner): the row's own sum and the
 * logarithms of the others add up to 2 gamma - 2 log(pi/height). */
static double alternating_rows(long double height, long double stagger)
{
    long double turn = 2 * acosl(-1.0L), sum = 0;
    for (int row = 1; row < 10; row++) {
        for (int m = 1; m < 10; m++) {
            sum += (row & 1 ? -8 : 8) * bessel_k0(turn * m * row * height) *
                   cosl(turn * m * row * stagger);
        }
    }
    return (double)(2 * 0.57721566490153286061L - 2 * logl(acosl(-1.0L) / height) + sum);
}

static double madelung(struct particle_set *s, double exact, const char *name)
{
    double worst = 0.0;
    run_all(s, 2.0, 1.0, &first);
    for (int64_t i = 0; i < s->n; i++) {
        at_most(&worst, fabs(first.potential[i] * s->alpha[i] / exact - 1.0));
    }
    printf("%s: %.15f, error %.1e\n", name, exact, worst);
    set_free(s);
    return worst;
}

static void madelung_numbers_are_right(void **state)
{
    (void)state;
    static const double cube[3] = {2, 2, 2};
    struct particle_set s;
    assert_true(set_make(&s, SET_RANDOM, 3, cube, 8, 0, 1));
    for (int i = 0; i < 8; i++) {
        int place[3] = {i & 1, i >> 1 & 1, i >> 2};
        for (int a = 0; a < 3; a++) {
            s.position[a][i] = place[a];
        }
        s.alpha[i] = (place[0] + place[1] + place[2]) & 1 ? -1.0 : 1.0;
    }
    assert_true(madelung(&s, -1.7475645946331822, "NaCl") < 1e-14);
    make_rows(&s, 2, 2, 1.0, 1.0, 0.0, 2);
    assert_true(madelung(&s, -1.6155426267128247, "square lattice, alternating") < 1e-14);
    make_rows(&s, 1, 2, 1.0, 1.0, 0.0, 1);
    assert_true(madelung(&s, alternating_rows(1.0L, 0.0L), "square lattice, rows") < 1e-13);
    make_rows(&s, 1, 2, 1.0, sqrt(0.75), 0.5, 1);
    double rows = alternating_rows(sqrtl(0.75L), 0.5L);
    assert_true(madelung(&s, rows, "triangular lattice, rows") < 1e-13);
}

/* 1 up to half the radius, 0 from the radius on, all derivatives continuous. */
static long double window(long double u)
{
    if (u <= 0.5L || u >= 1.0L) {
        return u < 1.0L;
    }
    long double t = 2 * u - 1;
    return 1 / (1 + expl(1 / (1 - t) - 1 / t));
}

/* Forces on the first particle by plain sums over images within a radius. */
static void sum_images(const struct particle_set *s, double power, double radius, int smooth,
                       int64_t target, long double *force)
{
    int64_t most[2];
    force[0] = force[1] = 0;
    for (int a = 0; a < 2; a++) {
        most[a] = (int64_t)ceil(radius / s->length[a]) + 1;
    }
    for (int64_t j = 0; j < s->n; j++) {
        for (int64_t y = -most[1]; y <= most[1]; y++) {
            for (int64_t x = -most[0]; x <= most[0]; x++) {
                long double r[2] = {s->position[0][target] - s->position[0][j] + x * s->length[0],
                                    s->position[1][target] - s->position[1][j] + y * s->length[1]};
                long double distance = sqrtl(r[0] * r[0] + r[1] * r[1]);
                if (distance > 0 && distance < radius) {
                    long double w = smooth ? window(distance / radius) : 1;
                    w *= s->alpha[j] / (power == 2.0 ? distance * distance * distance
                                                     : powl(distance, power + 1));
                    force[0] += w * r[0];
                    force[1] += w * r[1];
                }
            }
        }
    }
}

static void smooth_windows_come_near(void **state)
{
    (void)state;
    static const double square[3] = {1, 1, 1};
    struct particle_set s;
    double last = 1.0;
    assert_true(set_make(&s, SET_RANDOM, 2, square, 5, 0, 21));
    run_all(&s, 2.0, 1.0, &first);
    double size = force_size(2, 5, &first);
    for (double radius = 10.0; radius <= 80.0; radius *= 2.0) {
        double sum = 0.0;
        for (int64_t i = 0; i < 5; i++) {
            long double force[2];
            sum_images(&s, 2.0, radius, 1, i, force);
            for (int a = 0; a < 2; a++) {
                double difference = (double)(force[a] - first.force[a][i]);
                sum += difference * difference;
            }
        }
        double error = sqrt(sum / 5.0) / size;
        printf("smooth window of %g boxes: %.1e of the RMS force\n", radius, error);
        assert_true(error < 0.3 * last);
        last = error;
    }
    assert_true(last < 1e-9);
    set_free(&s);
}

static void high_powers_are_plain_sums(void **state)
{
    (void)state;
    static const double length[3] = {1.5, 1, 1};
    struct particle_set s;
    double sum = 0.0;
    assert_true(set_make(&s, SET_JITTERED, 2, length, 6, 0, 4));
    run_all(&s, 6.0, 1.0, &first);
    for (int64_t i = 0; i < 6; i++) {
        long double force[2];
        sum_images(&s, 6.0, 120.0, 0, i, force);
        for (int a = 0; a < 2; a++) {
            double difference = (double)(force[a] - first.force[a][i]);
            sum += difference * difference;
        }
    }
    double error = sqrt(sum / 6.0) / force_size(2, 6, &first);
    printf("power 6, plain sum: %.1e of the RMS force\n", error);
    assert_true(error < 1e-13);
    set_free(&s);
}

/* Central differences, of fourth order. */
static void potential_has_the_force_as_slope(void **state)
{
    (void)state;
    static const double length[3] = {1, 1.25, 1};
    const double step = 0x1p-11;
    for (int dimension = 2; dimension <= 3; dimension++) {
        for (double power = 1.0; power <= (dimension == 2 ? 6.0 : 2.0); power += 1.0) {
            struct particle_set s;
            double wrong = 0.0, whole = 0.0;
            assert_true(set_make(&s, SET_JITTERED, dimension, length, 12, 0, 8));
            run_all(&s, power, 1.0, &first);
            for (int32_t i = 0; i < 12; i++) {
                for (int a = 0; a < dimension; a++) {
                    double *x = &s.position[a][i], at = *x, value[4];
                    for (int k = 0; k < 4; k++) {
                        *x = at + step * (k < 2 ? k - 2 : k - 1);
                        assert_int_equal(run(&s, power, 1.0, 1, &i, &second), GBG_OK);
                        value[k] = second.potential[0];
                    }
                    *x = at;
                    double slope = (8 * (value[2] - value[1]) - (value[3] - value[0])) / 12 / step;
                    wrong += (slope + first.force[a][i]) * (slope + first.force[a][i]);
                    whole += first.force[a][i] * first.force[a][i];
                }
            }
            printf("slope of the potential, %dD, power %g: %.1e\n", dimension, power,
                   sqrt(wrong / whole));
            assert_true(sqrt(wrong / whole) < 1e-7);
            set_free(&s);
        }
    }
}

static void strengths_times_forces_add_to_zero(void **state)
{
    (void)state;
    static const double length[3] = {1, 3, 1};
    for (int dimension = 2; dimension <= 3; dimension++) {
        for (double power = 1.0; power <= (dimension == 2 ? 6.0 : 2.0); power += 1.0) {
            struct particle_set s;
            double worst = 0.0, size = 0.0;
            assert_true(set_make(&s, SET_JITTERED, dimension, length, 300, 0, 8));
            run_all(&s, power, 1.0, &first);
            for (int a = 0; a < dimension; a++) {
                double sum = 0.0;
                for (int i = 0; i < 300; i++) {
                    sum += s.alpha[i] * first.force[a][i];
                }
                worst = fmax(worst, fabs(sum));
            }
            size = sqrt(300.0) * force_size(dimension, 300, &first);
            printf("sum of alpha F, %dD, power %g: %.1e\n", dimension, power, worst / size);
            assert_true(worst / size < 1e-13);
            set_free(&s);
        }
    }
}

/* Coordinates of other boxes are the same places; one beyond the box by rounding is at its edge. */
static void places_are_taken_modulo_the_box(void **state)
{
    (void)state;
    static const double square[3] = {1, 1, 1};
    struct particle_set s;
    double force = 0.0, potential = 0.0;
    assert_true(set_make(&s, SET_JITTERED, 2, square, 50, 0, 8));
    s.position[0][7] = s.position[1][9] = 0.0;
    run_all(&s, 2.0, 1.0, &first);
    for (int i = 0; i < 50; i++) {
        s.position[0][i] += i % 5 - 2;
        s.position[1][i] += 1000 * (i % 3 - 1);
    }
    s.position[0][7] = -1e-300;
    s.position[1][9] = nextafter(1.0, 0.0);
    run_all(&s, 2.0, 1.0, &second);
    compare(2, 50, &force, &potential);
    printf("other boxes: force %.1e, potential %.1e\n", force, potential);
    assert_true(force < 1e-13 && potential < 1e-13);
    set_free(&s);
}

/* Two at one place: neither sees the other, each feels twice what one of them would. */
static void coincidence_is_no_force(void **state)
{
    (void)state;
    static const double square[3] = {1, 1, 1};
    struct particle_set s;
    assert_true(set_make(&s, SET_JITTERED, 2, square, 3, 0, 8));
    s.alpha[0] = s.alpha[1] = s.alpha[2] = 1.0;
    for (int a = 0; a < 2; a++) {
        s.position[a][1] = s.position[a][0];
    }
    run_all(&s, 2.0, 1.0, &first);
    s.position[0][1] = s.position[0][2];
    s.position[1][1] = s.position[1][2];
    run_all(&s, 2.0, 1.0, &second);
    double error = 0.0;
    for (int a = 0; a < 2; a++) {
        at_most(&error, fabs(first.force[a][2] + second.force[a][0]));
        at_most(&error, fabs(first.force[a][0] - first.force[a][1]));
    }
    printf("two at one place: %.1e\n", error / force_size(2, 3, &first));
    assert_true(error < 1e-13 * force_size(2, 3, &first));
    set_free(&s);
}

static void bad_arguments_are_refused(void **state)
{
    (void)state;
    static const double square[3] = {1, 1, 1};
    const int32_t outside[2] = {0, 4};
    struct particle_set s, bad;
    assert_true(set_make(&s, SET_JITTERED, 2, square, 4, 0, 8));
    assert_int_equal(run(&s, 0.99, 1.0, 1, outside, &first), GBG_E_ARGUMENT);
    assert_int_equal(run(&s, 6.01, 1.0, 1, outside, &first), GBG_E_ARGUMENT);
    assert_int_equal(run(&s, NAN, 1.0, 1, outside, &first), GBG_E_ARGUMENT);
    assert_int_equal(run(&s, 2.0, 0.0, 1, outside, &first), GBG_E_ARGUMENT);
    assert_int_equal(run(&s, 2.0, 1.0, 2, outside, &first), GBG_E_ARGUMENT);
    bad = s;
    bad.dimension = 1;
    assert_int_equal(run(&bad, 2.0, 1.0, 1, outside, &first), GBG_E_ARGUMENT);
    bad = s;
    bad.length[1] = 0.0;
    assert_int_equal(run(&bad, 2.0, 1.0, 1, outside, &first), GBG_E_ARGUMENT);
    s.position[1][3] = INFINITY;
    assert_int_equal(run(&s, 2.0, 1.0, 1, outside, &first), GBG_E_ARGUMENT);
    set_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(splits_agree),
        cmocka_unit_test(splits_agree_of_many),
        cmocka_unit_test(machines_agree),
        cmocka_unit_test(force_is_zero_by_symmetry),
        cmocka_unit_test(equal_lattices_are_known),
        cmocka_unit_test(madelung_numbers_are_right),
        cmocka_unit_test(smooth_windows_come_near),
        cmocka_unit_test(high_powers_are_plain_sums),
        cmocka_unit_test(potential_has_the_force_as_slope),
        cmocka_unit_test(strengths_times_forces_add_to_zero),
        cmocka_unit_test(places_are_taken_modulo_the_box),
        cmocka_unit_test(coincidence_is_no_force),
        cmocka_unit_test(bad_arguments_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
