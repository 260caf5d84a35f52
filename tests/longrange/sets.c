/* Tests of the sets of particles that long-range sums are measured on, and of their measures. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <stdio.h>

#include "sets.h"

static const double square[3] = {1, 1, 1}, flat[3] = {8, 1, 2};

/* Smallest distance of two particles, nearest images. */
static double closest(const struct particle_set *s)
{
    double least = INFINITY;
    for (int64_t i = 0; i < s->n; i++) {
        for (int64_t j = 0; j < i; j++) {
            double squared = 0.0;
            for (int a = 0; a < s->dimension; a++) {
                double d = s->position[a][i] - s->position[a][j];
                d -= s->length[a] * rint(d / s->length[a]);
                squared += d * d;
            }
            least = fmin(least, squared);
        }
    }
    return sqrt(least);
}

static void places_are_in_the_box_and_the_same_again(void **state)
{
    (void)state;
    for (int kind = 0; kind < SET_KINDS; kind++) {
        for (int dimension = 2; dimension <= 3; dimension++) {
            struct particle_set s, again;
            assert_true(set_make(&s, (enum set_kind)kind, dimension, flat, 1000, 0, 5));
            assert_true(set_make(&again, (enum set_kind)kind, dimension, flat, 1000, 0, 5));
            for (int a = 0; a < dimension; a++) {
                for (int64_t i = 0; i < s.n; i++) {
                    double units = s.position[a][i] / flat[a] * 0x1p40;
                    assert_true(s.position[a][i] >= 0.0 && s.position[a][i] < flat[a]);
                    assert_true(units == floor(units));
                }
                assert_memory_equal(s.position[a], again.position[a], 1000 * sizeof(double));
            }
            for (int64_t i = 0; i < s.n; i++) {
                assert_true(s.alpha[i] >= 0.5 && s.alpha[i] <= 1.5);
            }
            set_free(&s);
            set_free(&again);
        }
    }
}

/* Neither overlapping nor a lattice. */
static void discs_do_not_overlap(void **state)
{
    (void)state;
    const double pi = 3.14159265358979323846;
    for (int dimension = 2; dimension <= 3; dimension++) {
        struct particle_set s;
        assert_true(set_make(&s, SET_DISCS, dimension, square, 1000, 1, 5));
        double d = s.diameter, least = closest(&s);
        double packing = 1000.0 * (dimension == 2 ? pi / 4 * d * d : pi / 6 * d * d * d);
        double order = 0.0;
        for (int i = 0; i < 1000; i++) {
            order += cos(2.0 * pi * (dimension == 2 ? 32.0 : 10.0) * s.position[0][i]) / 1000.0;
        }
        printf("%dD: closest %.6f of a diameter, packing %.4f, order %.3f\n", dimension, least / d,
               packing, order);
        assert_true(least >= d && least < 1.05 * d);
        assert_true(fabs(packing - (dimension == 2 ? 0.4 : 0.2)) < 1e-9);
        assert_true(fabs(order) < 0.2);
        set_free(&s);
    }
}

static void clusters_are_tight(void **state)
{
    (void)state;
    struct particle_set s;
    assert_true(set_make(&s, SET_CLUSTERED, 2, square, 6400, 0, 5));
    double smallest = INFINITY, largest = 0.0;
    for (int blob = 0; blob < 64; blob++) {
        double sum = 0.0;
        for (int k = 1; k < 100; k++) {
            double d = s.position[0][blob + 64 * k] - s.position[0][blob];
            d -= rint(d);
            sum += d * d / 99.0;
        }
        smallest = fmin(smallest, sqrt(sum));
        largest = fmax(largest, sqrt(sum));
    }
    printf("blobs %.1e to %.1e wide\n", smallest, largest);
    assert_true(smallest > 7e-4 && smallest < 3e-3 && largest > 2e-2 && largest < 2e-1);
    set_free(&s);
}

static void targets_are_different(void **state)
{
    (void)state;
    int32_t target[100];
    for (int64_t n = 1; n < 300; n += 7) {
        int64_t m = set_targets(n, 100, 3, target);
        assert_int_equal(m, n < 100 ? n : 100);
        for (int64_t t = 0; t < m; t++) {
            assert_true(target[t] >= 0 && target[t] < n && (t == 0 || target[t] > target[t - 1]));
        }
    }
}

static void errors_are_measured(void **state)
{
    (void)state;
    double exact_x[4] = {3, 0, 0, 6}, exact_y[4] = {4, 1, -2, 8}, x[4], y[4];
    const double *exact[2] = {exact_x, exact_y}, *force[2] = {x, y};
    for (int i = 0; i < 4; i++) {
        x[i] = exact_x[i] + 0.1;
        y[i] = exact_y[i];
    }
    struct set_error error = set_error_of(2, 4, force, exact);
    assert_true(fabs(error.over_rms - 0.1 / sqrt(130.0 / 4.0)) < 1e-14);
    assert_true(fabs(error.over_median - 0.1 / 3.5) < 1e-14); /* sizes 1, 2, 5, 10 */
    x[2] = NAN;
    error = set_error_of(2, 4, force, exact);
    assert_true(isnan(error.over_rms) && isnan(error.over_median));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(places_are_in_the_box_and_the_same_again),
        cmocka_unit_test(discs_do_not_overlap),
        cmocka_unit_test(clusters_are_tight),
        cmocka_unit_test(targets_are_different),
        cmocka_unit_test(errors_are_measured),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
