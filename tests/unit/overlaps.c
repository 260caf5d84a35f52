/* Tests of gbg_overlaps_find and gbg_overlaps_remove on a caller's arrays. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "core/random.h"
#include "gamboge/kernels.h"

enum { MOST = 2000 };
static double r[3][MOST], diameter[MOST];
static int32_t first[MOST * 20], second[MOST * 20];

static double uniform(uint64_t k)
{
    struct gbg_philox p = gbg_philox(gbg_philox_counter(k, 1, 98), 4, 2);
    return gbg_uniform(p.word[0], p.word[1]);
}

static double distance(int dimension, const double *length, int64_t i, int64_t j)
{
    double squared = 0.0;
    for (int a = 0; a < dimension; a++) {
        double d = r[a][i] - r[a][j];
        d -= length[a] * rint(d / length[a]);
        squared += d * d;
    }
    return sqrt(squared);
}

static void points(int64_t n, int dimension, const double *length, double smallest, double largest)
{
    for (int64_t i = 0; i < n; i++) {
        for (int a = 0; a < dimension; a++) { /* far outside the box too */
            r[a][i] = length[a] * (6.0 * uniform((uint64_t)(8 * i + a)) - 3.0);
        }
        diameter[i] = smallest + (largest - smallest) * uniform((uint64_t)(8 * i + 5));
    }
}

static void pairs_are_those_of_a_double_loop(void **state)
{
    (void)state;
    struct gbg_context *context;
    assert_int_equal(gbg_context_create("cpu", &context), GBG_OK);
    static const double boxes[][3] = {{20, 20, 20}, {2000, 2, 2}, {7, 11, 3}, {2, 2, 2}};
    for (int b = 0; b < 4; b++) {
        for (int dimension = 2; dimension <= 3; dimension++) {
            int64_t n = b == 3 ? 5 : 600, count, k = 0;
            points(n, dimension, boxes[b], 0.05, 1.0);
            double *z = dimension == 3 ? r[2] : NULL;
            assert_int_equal(gbg_overlaps_find(context, dimension, boxes[b], n, r[0], r[1], z, 1,
                                               diameter, 0.0, 1, MOST * 20, first, second, &count),
                             GBG_OK);
            for (int64_t i = 0; i < n; i++) {
                for (int64_t j = i + 1; j < n; j++) {
                    if (distance(dimension, boxes[b], i, j) < 0.5 * (diameter[i] + diameter[j])) {
                        assert_true(k < count && first[k] == i + 1 && second[k] == j + 1);
                        k++;
                    }
                }
            }
            assert_int_equal(k, count);
            int64_t few = count / 2, again;
            first[few] = -7; /* nothing is written past the capacity */
            assert_int_equal(gbg_overlaps_find(context, dimension, boxes[b], n, r[0], r[1], z, 1,
                                               diameter, 0.0, 1, few, first, second, &again),
                             GBG_OK);
            assert_int_equal(again, count);
            assert_int_equal(first[few], -7);
        }
    }
    gbg_context_destroy(&context);
}

static void removal_leaves_none(void **state)
{
    (void)state;
    struct gbg_context *context;
    assert_int_equal(gbg_context_create("cpu:threads=2", &context), GBG_OK);
    static const double length[3] = {40, 40, 12};
    static double old[3][MOST];
    for (int dimension = 2; dimension <= 3; dimension++) {
        int64_t rounds, count, n = 600, untouched = 0;
        points(n, dimension, length, 0.5, 1.0);
        memcpy(old, r, sizeof r);
        double *z = dimension == 3 ? r[2] : NULL;
        assert_int_equal(gbg_overlaps_remove(context, dimension, length, n, r[0], r[1], z, 1,
                                             diameter, "bounce", 0, &rounds),
                         GBG_OK);
        assert_true(rounds > 0);
        assert_int_equal(gbg_overlaps_find(context, dimension, length, n, r[0], r[1], z, 1,
                                           diameter, 1e-11, 0, 0, NULL, NULL, &count),
                         GBG_OK);
        assert_int_equal(count, 0);
        for (int64_t i = 0; i < n; i++) {
            double moved = 0.0;
            for (int a = 0; a < dimension; a++) {
                moved = fmax(moved, fabs(r[a][i] - old[a][i]));
            }
            untouched += moved == 0.0;
            assert_true(moved < 6.0); /* corrections, not jumps to another image */
        }
        assert_true(untouched > 0);
        print_message("%dD: %lld rounds, %lld of %lld particles untouched\n", dimension,
                      (long long)rounds, (long long)untouched, (long long)n);
    }
    gbg_context_destroy(&context);
}

static void coincident_particles_part_the_same_way(void **state)
{
    (void)state;
    static const double length[2] = {10, 10};
    double x[2][3], y[2][3], d[3] = {1, 1, 1};
    for (int k = 0; k < 2; k++) {
        struct gbg_context *context;
        assert_int_equal(gbg_context_create(k ? "cpu:threads=1" : "cpu:threads=2", &context),
                         GBG_OK);
        for (int i = 0; i < 3; i++) {
            x[k][i] = y[k][i] = 3.0;
        }
        assert_int_equal(
            gbg_overlaps_remove(context, 2, length, 3, x[k], y[k], NULL, 1, d, "bounce", 0, NULL),
            GBG_OK);
        gbg_context_destroy(&context);
    }
    assert_memory_equal(x[0], x[1], sizeof x[0]);
    assert_memory_equal(y[0], y[1], sizeof y[0]);
    assert_true(hypot(x[0][0] - x[0][1], y[0][0] - y[0][1]) >= 1.0 - 1e-12);
}

static void refusals(void **state)
{
    (void)state;
    struct gbg_context *context;
    assert_int_equal(gbg_context_create("cpu", &context), GBG_OK);
    double length[2] = {10, 10}, x[2] = {1, 2}, y[2] = {1, NAN}, d[2] = {1, 1};
    int64_t count;
#define FIND(l, xx, yy, dd, tol)                                                                   \
    gbg_overlaps_find(context, 2, l, 2, xx, yy, NULL, 1, dd, tol, 0, 0, NULL, NULL, &count)
    assert_int_equal(FIND(length, x, y, d, 0.0), GBG_E_ARGUMENT);
    assert_non_null(strstr(gbg_message(context), "particle 1 (from 0)"));
    y[1] = 2;
    assert_int_equal(FIND(length, x, y, d, -1.0), GBG_E_ARGUMENT);
    d[1] = 6;
    assert_int_equal(FIND(length, x, y, d, 0.0), GBG_E_ARGUMENT);
    assert_non_null(strstr(gbg_message(context), "half the shortest box"));
    d[1] = INFINITY;
    assert_int_equal(FIND(length, x, y, d, 0.0), GBG_E_ARGUMENT);
    d[1] = 1;
    length[1] = 0;
    assert_int_equal(FIND(length, x, y, d, 0.0), GBG_E_ARGUMENT);
    length[1] = 10;
    assert_int_equal(FIND(length, NULL, y, d, 0.0), GBG_E_ARGUMENT);
    /* more discs than fit: refused, arrays untouched */
    static const double small[2] = {2.2, 2.2};
    static double many_x[60], many_y[60], many_d[60], kept[60];
    for (int i = 0; i < 60; i++) {
        many_x[i] = kept[i] = 2.2 * uniform((uint64_t)i);
        many_y[i] = 2.2 * uniform((uint64_t)(100 + i));
        many_d[i] = 1.0;
    }
    assert_int_equal(gbg_overlaps_remove(context, 2, small, 60, many_x, many_y, NULL, 1, many_d,
                                         "bounce", 50, NULL),
                     GBG_E_STEP);
    assert_memory_equal(many_x, kept, sizeof kept);
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pairs_are_those_of_a_double_loop),
        cmocka_unit_test(removal_leaves_none),
        cmocka_unit_test(coincident_particles_part_the_same_way),
        cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
