/* Test: the pairs of gamboge verify against a double loop over all pairs and images. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "command/verify_pairs.h"
#include "core/random.h"

enum { N = 300 };

struct seen {
    unsigned char pair[N][N];
    double largest_error;
    const double *length;
    double *const *r;
    int dimension;
};

/* Distance of the nearest image, by trying them: a box of the test is at least half as long as the
 * spread of its points. */
static double naive_distance(int dimension, const double *length, double *const *r, int64_t i,
                             int64_t j)
{
    double least = INFINITY;
    for (int k = 0; k < 729; k++) {
        int image[3] = {k % 9 - 4, k / 9 % 9 - 4, k / 81 - 4};
        double square = 0;
        for (int a = 0; a < dimension; a++) {
            double d = r[a][j] - r[a][i] + image[a] * length[a];
            square += d * d;
        }
        least = fmin(least, sqrt(square));
    }
    return least;
}

static void note(void *user, int64_t i, int64_t j, const double d[3], double distance)
{
    struct seen *seen = user;
    assert_true(i < j);
    seen->pair[i][j]++;
    double square = 0;
    for (int a = 0; a < seen->dimension; a++) {
        square += d[a] * d[a];
    }
    assert_true(fabs(sqrt(square) - distance) <= 1e-14 * (1 + distance));
    double truth = naive_distance(seen->dimension, seen->length, seen->r, i, j);
    seen->largest_error = fmax(seen->largest_error, fabs(distance - truth));
}

static void compare(int dimension, double lx, double ly, double lz, double reach, int64_t n)
{
    double length[3] = {lx, ly, lz}, values[3][N], *r[3] = {values[0], values[1], values[2]};
    for (int64_t i = 0; i < n; i++) {
        struct gbg_philox w = gbg_philox(gbg_philox_counter(1, (uint64_t)i, 0), 5, (uint32_t)n);
        for (int a = 0; a < 3; a++) { /* up to a box beyond either border */
            values[a][i] = length[a] * (3 * gbg_uniform(w.word[a], w.word[3]) - 1);
        }
    }
    struct seen *seen = calloc(1, sizeof *seen);
    assert_non_null(seen);
    seen->length = length;
    seen->r = r;
    seen->dimension = dimension;
    assert_int_equal(gbg_visit_pairs(dimension, length, n, r, reach, note, seen), 0);
    int64_t expected = 0;
    for (int64_t i = 0; i < n; i++) {
        for (int64_t j = i + 1; j < n; j++) {
            int near = naive_distance(dimension, length, r, i, j) <= reach;
            expected += near;
            assert_int_equal(seen->pair[i][j], near);
        }
    }
    assert_true(n < 3 || expected > 0);
    assert_true(seen->largest_error <= 1e-12 * reach);
    free(seen);
}

static void every_pair_once(void **state)
{
    (void)state;
    compare(2, 20, 20, 1, 1.5, N);   /* many cells */
    compare(2, 4, 4, 1, 1.5, N);     /* two cells an axis */
    compare(2, 4.6, 31, 1, 1.5, N);  /* three and twenty */
    compare(2, 2, 2000, 1, 3, N);    /* one cell on an axis, a long box */
    compare(2, 1000, 1, 1, 0.4, N);  /* the other way round */
    compare(2, 2.9, 2.9, 1, 1.5, N); /* one cell */
    compare(3, 7, 8, 9, 1.2, N);
    compare(3, 3, 3.7, 20, 1.2, N);
    compare(3, 2, 2, 2, 0.9, N);
}

static void few_points(void **state)
{
    (void)state;
    compare(2, 20, 20, 1, 1.5, 0);
    compare(2, 20, 20, 1, 1.5, 1);
    compare(2, 2, 2, 1, 1.5, 3);
    compare(2, 20, 20, 1, 4.0, 64); /* the last by brute force and the first by cells */
    compare(2, 20, 20, 1, 4.0, 65);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_pair_once),
        cmocka_unit_test(few_points),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
