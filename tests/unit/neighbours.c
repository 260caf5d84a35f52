/* Tests of gbg_neighbours_*: every method gives the pairs of a double loop, to the last one. */
#include "neighbours_sets.h"

struct visited {
    int64_t at, batches;
    int dimension, wrong;
    const struct set *set;
};

static void compare_batch(void *user, int64_t n, const int32_t *i, const int32_t *j,
                          const double *separation)
{
    struct visited *v = user;
    v->batches++;
    for (int64_t k = 0; k < n; k++, v->at++) {
        double sum = 0.0;
        for (int a = 0; a < v->dimension; a++) {
            double d = separation[k * v->dimension + a], length = v->set->length[a];
            double plain = r[a][i[k] - 1] - r[a][j[k] - 1];
            plain -= length * rint(plain / length);
            double off = fabs(d - plain); /* at half a box either sign is the nearest image */
            v->wrong += !(fmin(off, fabs(off - length)) <= 1e-14 * length);
            sum += d * d;
        }
        v->wrong += !(sum <= v->set->radius * v->set->radius);
        v->wrong += i[k] != first[v->at] + 1 || j[k] != second[v->at] + 1;
    }
}

/* The rows and the batches against the pairs in first, second. */
static void same_in_all_forms(struct gbg_neighbours *neighbours, const struct set *set,
                              int dimension, int64_t n, int64_t pairs)
{
    static int64_t seen[MOST];
    offset[n] = -9;
    row[2 * pairs] = -9;
    assert_int_equal(gbg_neighbours_csr(neighbours, 1, n + 1, offset, 2 * pairs, row), GBG_OK);
    assert_int_equal(row[2 * pairs], -9);
    assert_int_equal(offset[0], 1);
    assert_int_equal(offset[n], 2 * pairs + 1);
    for (int64_t i = 0; i < n; i++) {
        for (int64_t k = offset[i]; k < offset[i + 1] - 1; k++) {
            assert_true(row[k - 1] < row[k]);
        }
        seen[i] = offset[i] - 1;
    }
    for (int64_t k = 0; k < pairs;
         k++) { /* sorted pairs fill rows from the left: lower ones first */
        assert_int_equal(row[seen[second[k]]++], first[k] + 1);
    }
    for (int64_t k = 0; k < pairs; k++) {
        assert_int_equal(row[seen[first[k]]++], second[k] + 1);
    }
    struct visited visited = {.dimension = dimension, .set = set};
    assert_int_equal(gbg_neighbours_visit(neighbours, 1, compare_batch, &visited), GBG_OK);
    assert_int_equal(visited.wrong, 0);
    assert_int_equal(visited.at, pairs);
    assert_int_equal(visited.batches, (pairs + 4095) / 4096);
}

static void check_set(struct gbg_context *context, const struct set *set, int dimension, int64_t n)
{
    static const char *const methods[] = {"brute",       "grid",     "grid2",    "half",
                                          "octant",      "octant:4", "grid:2.5", "octant:2.52",
                                          "grid:0.7301", "auto"};
    char expected[65], text[65];
    n = size_of(set, dimension, n);
    make(set, dimension, n);
    int64_t pairs = reference(set, dimension, n, expected);
    for (size_t k = 0; k < sizeof methods / sizeof *methods + 2; k++) {
        char method[40] = "verlet";
        double skin = set->radius * 0.35;
        if (k < sizeof methods / sizeof *methods) {
            snprintf(method, sizeof method, "%s", methods[k]);
            skin = 0.0;
        } else if (k == sizeof methods / sizeof *methods + 1) {
            if (set->least == 0.0) {
                continue;
            }
            snprintf(method, sizeof method, "occupancy:%g", set->least);
            skin = 0.0;
        }
        struct gbg_neighbours *neighbours = found(context, set, dimension, method, skin, n);
        digest_of_pairs(neighbours, pairs, text);
        if (strcmp(text, expected) != 0) {
            fail_msg("%s, %s, %dD, n %lld: other pairs", set->name, method, dimension,
                     (long long)n);
        }
        same_in_all_forms(neighbours, set, dimension, n, pairs);
        gbg_neighbours_destroy(&neighbours);
    }
    if (n == MOST) {
        print_message("%dD %-26s %7lld pairs\n", dimension, set->name, (long long)pairs);
    }
}

static void every_method_equals_the_double_loop(void **state)
{
    static const int64_t sizes[] = {0, 1, 2, 3, 17, MOST};
    (void)state;
    struct gbg_context *context = context_of("cpu:threads=2");
    for (int s = 0; s < SETS; s++) {
        for (int k = 0; k < 6; k++) {
            check_set(context, &sets[s], 2, sizes[k]);
            check_set(context, &sets[s], 3, sizes[k]);
        }
    }
    gbg_context_destroy(&context);
}

/* Threads are worth starting from a few thousand particles on. */
static void same_bits_for_threads_and_instructions(void **state)
{
    enum { MANY = 20000, ROOM = MANY * 60 };
    static const char *const contexts[] = {"cpu:threads=1",          "cpu:threads=2",
                                           "cpu:threads=5",          "poison:threads=3",
                                           "cpu:threads=2,isa=avx2", "cpu:threads=2,isa=generic"};
    static const char *const methods[] = {"grid", "half",   "octant",
                                          "auto", "verlet", "occupancy:0.001"};
    (void)state;
    double *x;
    int64_t *offsets, *kept_offsets;
    int32_t *rows, *kept;
    assert_int_equal(gbg_allocate(NULL, (void **)&x, 3 * MANY, 8, "x"), GBG_OK);
    assert_int_equal(gbg_allocate(NULL, (void **)&offsets, MANY + 1, 8, "offsets"), GBG_OK);
    assert_int_equal(gbg_allocate(NULL, (void **)&kept_offsets, MANY + 1, 8, "offsets"), GBG_OK);
    assert_int_equal(gbg_allocate(NULL, (void **)&rows, ROOM, 4, "rows"), GBG_OK);
    assert_int_equal(gbg_allocate(NULL, (void **)&kept, ROOM, 4, "rows"), GBG_OK);
    for (int dimension = 2; dimension <= 3; dimension++) {
        double length[3] = {1.0, 1.1, 0.9}, radius = dimension == 2 ? 0.013 : 0.05;
        int64_t pairs = -1;
        for (int64_t i = 0; i < MANY; i++) { /* half of them in a corner; steps of 3 */
            for (int a = 0; a < 3; a++) {
                x[3 * i + a] = uniform((uint64_t)(3 * i + a)) * (i % 2 ? 0.4 : 1.0);
            }
        }
        for (int c = 0; c < 6; c++) {
            struct gbg_context *context;
            if (gbg_context_create(contexts[c], &context) != GBG_OK) {
                print_message("%s: not here\n", contexts[c]);
                continue;
            }
            for (int m = 0; m < 6; m++) {
                struct gbg_neighbours *neighbours;
                int64_t count;
                int skin = strcmp(methods[m], "verlet") == 0;
                assert_int_equal(gbg_neighbours_create(context, dimension, length, radius,
                                                       methods[m], skin ? 0.1 * radius : 0.0,
                                                       &neighbours),
                                 GBG_OK);
                int status = gbg_neighbours_update(neighbours, MANY, x, x + 1,
                                                   dimension == 3 ? x + 2 : NULL, 3, NULL);
                if (strncmp(methods[m], "occupancy", 9) == 0) {
                    /* not a set with a least distance: refused, the same pair named by all */
                    static char said[2][1024];
                    assert_true(status == GBG_E_OVERLAP || status == GBG_E_ARGUMENT);
                    if (c == 0) {
                        snprintf(said[dimension - 2], sizeof said[0], "%s", gbg_message(context));
                        print_message("%s\n", gbg_message(context));
                    }
                    assert_string_equal(said[dimension - 2], gbg_message(context));
                    gbg_neighbours_destroy(&neighbours);
                    continue;
                }
                assert_int_equal(status, GBG_OK);
                assert_int_equal(gbg_neighbours_count(neighbours, NULL, &count), GBG_OK);
                assert_int_equal(gbg_neighbours_csr(neighbours, 0, MANY + 1, offsets, ROOM, rows),
                                 GBG_OK);
                if (pairs < 0) {
                    pairs = count;
                    memcpy(kept, rows, (size_t)(2 * pairs) * 4);
                    memcpy(kept_offsets, offsets, (MANY + 1) * 8);
                    print_message("%dD: %lld pairs of %d\n", dimension, (long long)pairs, MANY);
                }
                assert_int_equal(count, pairs);
                assert_memory_equal(kept, rows, (size_t)(2 * pairs) * 4);
                assert_memory_equal(kept_offsets, offsets, (MANY + 1) * 8);
                gbg_neighbours_destroy(&neighbours);
            }
            gbg_context_destroy(&context);
        }
    }
    gbg_release(x);
    gbg_release(offsets);
    gbg_release(kept_offsets);
    gbg_release(rows);
    gbg_release(kept);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_method_equals_the_double_loop),
        cmocka_unit_test(same_bits_for_threads_and_instructions),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
