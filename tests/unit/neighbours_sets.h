/* Tests of neighbour search: sets of points, and their pairs by a double loop. */
#ifndef GBG_TESTS_NEIGHBOURS_SETS_H
#define GBG_TESTS_NEIGHBOURS_SETS_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "core/memory.h"
#include "core/random.h"
#include "core/sha256.h"
#include "gamboge/neighbours.h"

enum { MOST = 700, PAIRS = MOST * (MOST - 1) / 2 };
static double r[3][MOST];
static int32_t first[PAIRS + 1], second[PAIRS + 1], row[2 * PAIRS + 1];
static int64_t offset[MOST + 1];

static inline double uniform(uint64_t k)
{
    struct gbg_philox p = gbg_philox(gbg_philox_counter(k, 3, 97), 8, 2);
    return gbg_uniform(p.word[0], p.word[1]);
}

static inline struct gbg_context *context_of(const char *text)
{
    struct gbg_context *context;
    assert_int_equal(gbg_context_create(text, &context), GBG_OK);
    return context;
}

struct set {
    const char *name;
    double length[3], radius;
    double least; /* no pair is closer; 0: unknown */
    int kind;
};
enum { RANDOM, FACES, LATTICE, CLUSTER, COINCIDENT, SPREAD };

static const struct set sets[] = {
    {"random", {20, 20, 20}, 1.7, 0, RANDOM},
    {"random, R = L/2", {4, 4, 4}, 2.0, 0, RANDOM},
    {"random, one cell an axis", {4, 4.1, 4.3}, 1.99, 0, RANDOM},
    {"random, three cells", {3.01, 3.01, 3.01}, 1.0, 0, RANDOM},
    {"flat box", {2000, 2, 3}, 0.9, 0, RANDOM},
    {"flat box, R = L/2", {50, 1.5, 7}, 0.75, 0, RANDOM},
    {"tiny box", {1e-90, 2e-90, 1e-90}, 1.3e-91, 0, RANDOM},
    {"huge box", {1e80, 1e80, 3e80}, 1e79, 0, RANDOM},
    {"radius far below the box", {1e6, 1e6, 1e6}, 1e-9, 0, RANDOM},
    {"faces", {8, 8, 8}, 1.0, 0, FACES},
    {"faces, R = L/2", {8, 8, 16}, 4.0, 0, FACES},
    {"lattice at R", {8, 8, 8}, 1.0, 1.0, LATTICE},
    {"lattice at 2R", {8, 8, 8}, 0.5, 1.0, LATTICE},
    {"lattice, R just above", {8, 8, 8}, 1.0000001, 1.0, LATTICE},
    {"lattice, R = 2.5", {8, 8, 8}, 2.5, 1.0, LATTICE},
    {"cluster", {1e5, 1e5, 1e5}, 1.0, 0, CLUSTER},
    {"cluster in few units", {1, 1, 1}, 1e-12, 0, CLUSTER},
    {"coincident", {5, 5, 5}, 0.5, 0, COINCIDENT},
    {"spread over scales", {30, 30, 30}, 1.0, 0, SPREAD},
};
enum { SETS = sizeof sets / sizeof *sets };

static inline void make(const struct set *set, int dimension, int64_t n)
{
    for (int64_t i = 0; i < n; i++) {
        int64_t site = i;
        double size = pow(10.0, -6.0 * uniform((uint64_t)(9 * i + 8)));
        for (int a = 0; a < dimension; a++) {
            double u = uniform((uint64_t)(9 * i + a)), length = set->length[a];
            int64_t side = dimension == 2 ? 27 : 9;
            switch (set->kind) {
            case RANDOM: /* far outside the box too */
                r[a][i] = length * (6.0 * u - 3.0);
                break;
            case FACES: /* multiples of R/2, now and then a hair beside, or zero with a sign */
                r[a][i] = set->radius * 0.5 * floor(40.0 * u - 20.0);
                r[a][i] = i % 7 == 3 ? nextafter(r[a][i], INFINITY) : r[a][i];
                r[a][i] = i % 7 == 5 ? nextafter(r[a][i], -INFINITY) : r[a][i];
                r[a][i] = i % 11 == 4 ? -0.0 : i % 11 == 7 ? -1e-300 : r[a][i];
                break;
            case LATTICE: /* 8 sites an axis, taken from the far end too */
                side = 8;
                r[a][i] = (double)(site % side) - (i % 3 == 0 ? length : 0.0);
                break;
            case CLUSTER:
                r[a][i] = length * 0.999999 + set->radius * 6.0 * u;
                break;
            case COINCIDENT:
                r[a][i] = 2.5 + length * (double)(i % 3);
                break;
            default:
                r[a][i] = 3.0 * (double)(i % 5) + 9.0 * size * (u - 0.5);
            }
            site /= side;
        }
    }
}

static inline int64_t size_of(const struct set *set, int dimension, int64_t n)
{
    int64_t sites = dimension == 2 ? 64 : 512;
    return set->kind == LATTICE && n > sites ? sites : n;
}

/* The stated rule, written down again. */
static inline int is_pair(const struct set *set, int dimension, int64_t i, int64_t j)
{
    double sum = 0.0;
    for (int a = 0; a < dimension; a++) {
        uint64_t f[2];
        for (int k = 0; k < 2; k++) {
            double turns = r[a][k ? j : i] / set->length[a], part = turns - floor(turns);
            f[k] = part < 1.0 ? (uint64_t)(part * 0x1p64) : 0;
        }
        double d = (double)(int64_t)(f[0] - f[1]) * (set->length[a] / 0x1p64);
        sum += d * d;
    }
    return sum <= set->radius * set->radius;
}

/* Distance in units of the radius by another way: long double on the coordinates themselves. */
static inline long double distance(const struct set *set, int dimension, int64_t i, int64_t j)
{
    long double sum = 0.0L;
    for (int a = 0; a < dimension; a++) {
        long double length = set->length[a], d = (long double)r[a][i] - r[a][j];
        d = (d - length * rintl(d / length)) / set->radius;
        sum += d * d;
    }
    return sqrtl(sum);
}

static inline void add(struct gbg_sha256 *hash, int32_t i, int32_t j)
{
    const int32_t pair[2] = {i, j};
    gbg_sha256_add(hash, pair, sizeof pair);
}

/* Digest of the pairs by the double loop; checks the rule against the plain distance. */
static inline int64_t reference(const struct set *set, int dimension, int64_t n, char text[65])
{
    struct gbg_sha256 hash;
    unsigned char digest[32];
    int64_t count = 0;
    double widest = 0.0;
    for (int a = 0; a < dimension; a++) {
        widest = fmax(widest, set->length[a]);
    }
    /* what rounding coordinates of a few box lengths can do */
    long double slack = 1e-14L * widest / set->radius + 1e-14L;
    gbg_sha256_start(&hash);
    for (int64_t i = 0; i < n; i++) {
        for (int64_t j = i + 1; j < n; j++) {
            int pair = is_pair(set, dimension, i, j);
            long double d = distance(set, dimension, i, j);
            assert_true(pair ? d <= 1.0L + slack : d >= 1.0L - slack);
            if (pair) {
                add(&hash, (int32_t)i, (int32_t)j);
                count++;
            }
        }
    }
    gbg_sha256_finish(&hash, digest);
    gbg_sha256_text(digest, text);
    return count;
}

static inline struct gbg_neighbours *found(struct gbg_context *context, const struct set *set,
                                           int dimension, const char *method, double skin,
                                           int64_t n)
{
    struct gbg_neighbours *neighbours = NULL;
    int status = gbg_neighbours_create(context, dimension, set->length, set->radius, method, skin,
                                       &neighbours);
    status = status ? status
                    : gbg_neighbours_update(neighbours, n, r[0], r[1], dimension == 3 ? r[2] : NULL,
                                            1, NULL);
    if (status != GBG_OK) {
        fail_msg("%s, %s, %dD, n %lld: %s", set->name, method, dimension, (long long)n,
                 gbg_message(context));
    }
    return neighbours;
}

static inline void digest_of_pairs(struct gbg_neighbours *neighbours, int64_t expected,
                                   char text[65])
{
    struct gbg_sha256 hash;
    unsigned char digest[32];
    int64_t pairs = -1;
    assert_int_equal(gbg_neighbours_count(neighbours, NULL, &pairs), GBG_OK);
    assert_int_equal(pairs, expected);
    first[pairs] = second[pairs] = -9;
    assert_int_equal(gbg_neighbours_pairs(neighbours, 0, pairs, first, second), GBG_OK);
    assert_true(first[pairs] == -9 && second[pairs] == -9);
    gbg_sha256_start(&hash);
    for (int64_t k = 0; k < pairs; k++) {
        add(&hash, first[k], second[k]);
    }
    gbg_sha256_finish(&hash, digest);
    gbg_sha256_text(digest, text);
}

#endif
