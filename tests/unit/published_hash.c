/* Test of a claim of docs/physics.md: the cell hash published by Perea and Cordero (2017), their
 * equation (1), gives many cells the same value, and a search by its buckets that does not look at
 * the cell again counts neighbours twice. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "core/random.h"

/* x, y, z: truncated coordinates; ex, ey, ez: subdivisions. */
static int64_t published(int64_t x, int64_t y, int64_t z, int64_t ex, int64_t ey, int64_t ez)
{
    return x * (ez - 1) + y * ey * ex + z * ex * ez;
}

static int64_t different_values(int64_t ex, int64_t ey, int64_t ez)
{
    int64_t most = published(ex - 1, ey - 1, ez - 1, ex, ey, ez), count = 0;
    unsigned char *seen = calloc((size_t)most + 1, 1);
    assert_non_null(seen);
    for (int64_t z = 0; z < ez; z++) {
        for (int64_t y = 0; y < ey; y++) {
            for (int64_t x = 0; x < ex; x++) {
                unsigned char *flag = &seen[published(x, y, z, ex, ey, ez)];
                count += !*flag;
                *flag = 1;
            }
        }
    }
    free(seen);
    return count;
}

static void cells_share_values(void **state)
{
    (void)state;
    for (int64_t n = 2; n <= 96; n++) {
        assert_int_equal(different_values(n, n, n), n * (2 * n - 1));
        assert_int_equal(different_values(n, n, 1), n); /* whole rows in two dimensions */
    }
    print_message("64^3: %lld values for %d cells; 64^2: %lld values for %d cells\n",
                  (long long)different_values(64, 64, 64), 64 * 64 * 64,
                  (long long)different_values(64, 64, 1), 64 * 64);
    assert_int_equal(different_values(64, 64, 64), 8128);
    assert_int_equal(different_values(64, 64, 1), 64);
    /* the perfect index of this library */
    for (int64_t cell = 0; cell < 7 * 5 * 3; cell++) {
        int64_t x = cell % 7, y = cell / 7 % 5, z = cell / 35;
        assert_int_equal(x + 7 * (y + 5 * z), cell);
    }
}

/* Buckets that a query for the 2^d cells of an octant opens. */
static void octants_open_the_same_bucket_again(void **state)
{
    (void)state;
    const int64_t n = 64;
    int64_t queries = 0, repeated = 0, most = 0;
    for (int64_t c = 0; c < n * n * n; c += 37) {
        int64_t x = c % n, y = c / n % n, z = c / n / n, value[8];
        int64_t again = 0;
        for (int k = 0; k < 8; k++) {
            int64_t x1 = (x + (k & 1)) % n, y1 = (y + (k >> 1 & 1)) % n, z1 = (z + (k >> 2)) % n;
            value[k] = published(x1, y1, z1, n, n, n);
            for (int l = 0; l < k; l++) {
                again += value[l] == value[k];
            }
        }
        queries++;
        repeated += again;
        most = again > most ? again : most;
        /* (y + 1, z) and (y, z + 1), for both x, unless one of them is beyond the edge */
        assert_true(again >= 2 || y == n - 1 || z == n - 1);
    }
    print_message("8 cells, 64^3: %.3f buckets opened twice in a query, at most %lld\n",
                  (double)repeated / (double)queries, (long long)most);
}

struct count {
    int64_t pairs, candidates;
};

/* Neighbours of every point by the 8 cells of its octant, found through buckets of the key. */
static struct count search(int64_t n, int points, const double (*r)[3], int by_published)
{
    struct count count = {0, 0};
    int64_t buckets = 4 * n * n * n, *start = calloc((size_t)buckets + 2, sizeof *start);
    int64_t *key = calloc((size_t)points, sizeof *key),
            *member = calloc((size_t)points, sizeof *key);
    assert_non_null(start);
    assert_non_null(key);
    assert_non_null(member);
#define KEY(x, y, z) (by_published ? published(x, y, z, n, n, n) : (x) + n * ((y) + n * (z)))
    for (int i = 0; i < points; i++) {
        key[i] = KEY((int64_t)(r[i][0] * n), (int64_t)(r[i][1] * n), (int64_t)(r[i][2] * n));
        start[key[i] + 2]++;
    }
    for (int64_t b = 0; b < buckets; b++) {
        start[b + 2] += start[b + 1];
    }
    for (int i = 0; i < points; i++) {
        member[start[key[i] + 1]++] = i;
    }
    double radius = 0.5 / (double)n;
    for (int i = 0; i < points; i++) {
        for (int k = 0; k < 8; k++) {
            int64_t c[3];
            for (int a = 0; a < 3; a++) {
                double at = r[i][a] * (double)n;
                int upper = at - floor(at) >= 0.5;
                c[a] = ((int64_t)at + ((k >> a & 1) ? (upper ? 1 : n - 1) : 0)) % n;
            }
            int64_t bucket = KEY(c[0], c[1], c[2]);
            for (int64_t m = start[bucket]; m < start[bucket + 1]; m++) {
                double squared = 0.0;
                for (int a = 0; a < 3; a++) {
                    double d = r[i][a] - r[member[m]][a];
                    d -= rint(d);
                    squared += d * d;
                }
                count.candidates += member[m] != i;
                count.pairs += member[m] != i && squared <= radius * radius;
            }
        }
    }
#undef KEY
    free(start);
    free(key);
    free(member);
    return count;
}

static void neighbours_are_counted_twice(void **state)
{
    enum { POINTS = 20000 };
    static double r[POINTS][3];
    (void)state;
    for (int i = 0; i < POINTS; i++) {
        struct gbg_philox p = gbg_philox(gbg_philox_counter(5, (uint64_t)i, 96), 1, 1);
        for (int a = 0; a < 3; a++) {
            r[i][a] = gbg_uniform(p.word[a], p.word[3]);
        }
    }
    struct count right = search(16, POINTS, r, 0), hashed = search(16, POINTS, r, 1);
    int64_t direct = 0;
    for (int i = 0; i < POINTS; i += 100) { /* the right one against plain loops on a sample */
        for (int j = 0; j < POINTS; j++) {
            double squared = 0.0;
            for (int a = 0; a < 3; a++) {
                double d = r[i][a] - r[j][a];
                d -= rint(d);
                squared += d * d;
            }
            direct += j != i && squared <= 0.25 / 256.0;
        }
    }
    assert_true(fabs((double)direct * 100.0 / (double)right.pairs - 1.0) < 0.15);
    print_message(
        "16^3 cells, %d points: %lld neighbours, by published buckets %lld (%.1f %% more); "
        "candidates %lld and %lld (%.1f times)\n",
        POINTS, (long long)right.pairs, (long long)hashed.pairs,
        100.0 * ((double)hashed.pairs / (double)right.pairs - 1.0), (long long)right.candidates,
        (long long)hashed.candidates, (double)hashed.candidates / (double)right.candidates);
    assert_true(hashed.pairs > right.pairs);
    assert_true(hashed.candidates > 5 * right.candidates);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cells_share_values),
        cmocka_unit_test(octants_open_the_same_bucket_again),
        cmocka_unit_test(neighbours_are_counted_twice),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
