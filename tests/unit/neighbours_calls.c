/* Tests of gbg_neighbours_*: lists that are kept, handles used again, refusals, failing memory. */
#include "neighbours_sets.h"

static int updated(struct gbg_neighbours *neighbours, int64_t n)
{
    int searched = -1;
    assert_int_equal(gbg_neighbours_update(neighbours, n, r[0], r[1], NULL, 1, &searched), GBG_OK);
    return searched;
}

static void lists_are_made_again_when_they_must(void **state)
{
    (void)state;
    const struct set *set = &sets[0];
    const int64_t n = 300;
    const double skin = 0.4;
    char expected[65], text[65];
    struct gbg_context *context = context_of("cpu:threads=2");
    make(set, 2, n);
    struct gbg_neighbours *list = found(context, set, 2, "verlet", skin, n);
    assert_int_equal(updated(list, n), 0);
    for (int64_t i = 0; i < n; i++) { /* all a little less than half the skin, in all directions */
        r[0][i] += 0.4999 * skin * cos((double)i);
        r[1][i] += 0.4999 * skin * sin((double)i);
    }
    r[0][7] += 5.0 * set->length[0]; /* another image is the same place */
    assert_int_equal(updated(list, n), 0);
    digest_of_pairs(list, reference(set, 2, n, expected), text);
    assert_string_equal(text, expected);
    r[0][3] += 0.001 * skin * cos(3.0); /* one of them crosses the line */
    r[1][3] += 0.001 * skin * sin(3.0);
    assert_int_equal(updated(list, n), 1);
    digest_of_pairs(list, reference(set, 2, n, expected), text);
    assert_string_equal(text, expected);
    assert_int_equal(updated(list, n - 1), 1); /* another number of particles */
    digest_of_pairs(list, reference(set, 2, n - 1, expected), text);
    assert_string_equal(text, expected);
    double value;
    assert_int_equal(gbg_neighbours_statistic(list, "searches", &value), GBG_OK);
    assert_true(value == 3.0);
    assert_int_equal(gbg_neighbours_statistic(list, "updates", &value), GBG_OK);
    assert_true(value == 5.0);
    /* a long walk */
    int64_t kept = 0;
    for (int step = 0; step < 60; step++) {
        for (int64_t i = 0; i < n; i++) {
            r[0][i] += 0.04 * (uniform((uint64_t)(1000 * step + i)) - 0.5);
            r[1][i] += 0.04 * (uniform((uint64_t)(77777 + 1000 * step + i)) - 0.5);
        }
        kept += !updated(list, n);
        digest_of_pairs(list, reference(set, 2, n, expected), text);
        assert_string_equal(text, expected);
    }
    print_message("list kept in %lld of 60 steps\n", (long long)kept);
    assert_true(kept > 40 && kept < 60);
    gbg_neighbours_destroy(&list);
    gbg_context_destroy(&context);
}

static void one_handle_takes_sets_of_any_size(void **state)
{
    (void)state;
    static const int64_t sizes[] = {0, 300, 2, 700, 1, 650};
    struct gbg_context *context = context_of("poison:threads=2");
    for (int k = 0; k < 2; k++) {
        struct gbg_neighbours *neighbours =
            found(context, &sets[0], 2, k ? "verlet" : "auto", k ? 0.3 : 0.0, 0);
        for (int s = 0; s < 6; s++) {
            char expected[65], text[65];
            make(&sets[0], 2, sizes[s]);
            updated(neighbours, sizes[s]);
            digest_of_pairs(neighbours, reference(&sets[0], 2, sizes[s], expected), text);
            assert_string_equal(text, expected);
        }
        gbg_neighbours_destroy(&neighbours);
    }
    gbg_context_destroy(&context);
}

/* All particles in a small part of the box, across its edge: cells cover that part only. */
static void a_cluster_does_not_cost_all_pairs(void **state)
{
    (void)state;
    struct gbg_context *context = context_of("cpu");
    const struct set *set = &sets[15];
    assert_string_equal(set->name, "cluster");
    for (int dimension = 2; dimension <= 3; dimension++) {
        double candidates, each;
        char text[100];
        for (int64_t i = 0; i < dimension * MOST; i++) {
            r[i % dimension][i / dimension] = set->length[0] - 8.0 + 20.0 * uniform((uint64_t)i);
        }
        struct gbg_neighbours *neighbours = found(context, set, dimension, "auto", 0.0, MOST);
        assert_int_equal(gbg_neighbours_statistic(neighbours, "candidates", &candidates), GBG_OK);
        assert_int_equal(gbg_neighbours_statistic(neighbours, "neighbours", &each), GBG_OK);
        assert_int_equal(gbg_neighbours_describe(neighbours, 100, text), GBG_OK);
        print_message("%dD: %s; %.1f candidates for each of %.1f neighbours\n", dimension, text,
                      candidates / (each * MOST), each);
        assert_true(candidates < 0.15 * MOST * MOST);
        gbg_neighbours_destroy(&neighbours);
    }
    gbg_context_destroy(&context);
}

static void arrays_that_are_too_small(void **state)
{
    (void)state;
    struct gbg_context *context = context_of("cpu");
    make(&sets[0], 2, 100);
    struct gbg_neighbours *neighbours = found(context, &sets[0], 2, "grid", 0.0, 100);
    int64_t pairs;
    char needed[40];
    assert_int_equal(gbg_neighbours_count(neighbours, NULL, &pairs), GBG_OK);
    offset[0] = row[0] = first[0] = second[0] = -9;
    assert_int_equal(gbg_neighbours_csr(neighbours, 0, 101, offset, 2 * pairs - 1, row),
                     GBG_E_SPACE);
    snprintf(needed, sizeof needed, "needed: 101 and %lld", (long long)(2 * pairs));
    assert_non_null(strstr(gbg_message(context), needed));
    assert_int_equal(gbg_neighbours_csr(neighbours, 0, 100, offset, 2 * pairs, row), GBG_E_SPACE);
    assert_int_equal(gbg_neighbours_pairs(neighbours, 0, pairs - 1, first, second), GBG_E_SPACE);
    snprintf(needed, sizeof needed, "needed: %lld", (long long)pairs);
    assert_non_null(strstr(gbg_message(context), needed));
    assert_true(offset[0] == -9 && row[0] == -9 && first[0] == -9 && second[0] == -9);
    char text[100];
    assert_int_equal(gbg_neighbours_describe(neighbours, 5, text), GBG_E_SPACE);
    assert_int_equal(gbg_neighbours_describe(neighbours, 100, text), GBG_OK);
    print_message("%s\n", text);
    gbg_neighbours_destroy(&neighbours);
    gbg_context_destroy(&context);
}

static void refusals(void **state)
{
    (void)state;
    struct gbg_context *context = context_of("cpu");
    static const double length[3] = {10, 8, 12};
    struct gbg_neighbours *neighbours = NULL;
#define REFUSE(status, dimension, radius, method, skin, words)                                     \
    do {                                                                                           \
        assert_int_equal(                                                                          \
            gbg_neighbours_create(context, dimension, length, radius, method, skin, &neighbours),  \
            status);                                                                               \
        assert_null(neighbours);                                                                   \
        assert_non_null(strstr(gbg_message(context), words));                                      \
    } while (0)
    REFUSE(GBG_E_ARGUMENT, 4, 1.0, "grid", 0.0, "dimension is 4");
    REFUSE(GBG_E_ARGUMENT, 2, 4.0001, "grid", 0.0, "half the shortest box length");
    REFUSE(GBG_E_ARGUMENT, 2, 0.0, "grid", 0.0, "radius is 0");
    REFUSE(GBG_E_ARGUMENT, 2, NAN, "grid", 0.0, "radius is nan");
    REFUSE(GBG_E_NAME, 2, 1.0, "gird", 0.0, "is grid");
    REFUSE(GBG_E_NAME, 2, 1.0, NULL, 0.0, "(NULL)");
    REFUSE(GBG_E_ARGUMENT, 2, 1.0, "octant:1.9", 0.0, "allowed 2 to");
    REFUSE(GBG_E_ARGUMENT, 2, 1.0, "octant:", 0.0, "allowed 2 to");
    REFUSE(GBG_E_ARGUMENT, 2, 1.0, "grid:0.4", 0.0, "allowed 0.5 to");
    REFUSE(GBG_E_ARGUMENT, 2, 1.0, "grid:2x", 0.0, "allowed 0.5 to");
    REFUSE(GBG_E_ARGUMENT, 2, 1.0, "half:2", 0.0, "takes no number");
    REFUSE(GBG_E_ARGUMENT, 2, 1.0, "occupancy", 0.0, "followed by a colon");
    REFUSE(GBG_E_ARGUMENT, 2, 1.0, "grid", 0.1, "the method grid has none");
    REFUSE(GBG_E_ARGUMENT, 2, 1.0, "verlet", 0.0, "needs one above 0");
    REFUSE(GBG_E_ARGUMENT, 2, 1.0, "verlet", -1.0, "skin is -1");
#undef REFUSE
    assert_int_equal(
        gbg_neighbours_create(context, 2, length, 4.0, "occupancy:1", 0.0, &neighbours), GBG_OK);
    int64_t pairs;
    assert_int_equal(gbg_neighbours_count(neighbours, NULL, &pairs), GBG_E_ORDER);
    double x[3] = {1, 2.1, 3}, y[3] = {1, 2.2, NAN}, value;
    assert_int_equal(gbg_neighbours_update(neighbours, 3, x, y, NULL, 1, NULL), GBG_E_ARGUMENT);
    assert_non_null(strstr(gbg_message(context), "particle 2 (from 0)"));
    y[2] = 2.3;
    x[2] = 2.2;
    assert_int_equal(gbg_neighbours_update(neighbours, 3, x, y, NULL, 1, NULL), GBG_E_OVERLAP);
    assert_non_null(strstr(gbg_message(context), "particles 1 and 2"));
    assert_int_equal(gbg_neighbours_pairs(neighbours, 0, 3, first, second), GBG_E_ORDER);
    assert_int_equal(gbg_neighbours_update(neighbours, 2, x, y, NULL, 1, NULL), GBG_OK);
    assert_int_equal(gbg_neighbours_count(neighbours, NULL, &pairs), GBG_OK);
    assert_int_equal(pairs, 1); /* sqrt(1.1^2 + 1.2^2) apart */
    assert_int_equal(gbg_neighbours_pairs(neighbours, 2, 3, first, second), GBG_E_ARGUMENT);
    assert_int_equal(gbg_neighbours_statistic(neighbours, "cell", &value), GBG_E_NAME);
    assert_int_equal(gbg_neighbours_visit(neighbours, 0, NULL, NULL), GBG_E_ARGUMENT);
    /* a refused update leaves the last result */
    assert_int_equal(gbg_neighbours_update(neighbours, -1, x, y, NULL, 1, NULL), GBG_E_ARGUMENT);
    assert_int_equal(gbg_neighbours_pairs(neighbours, 1, 1, first, second), GBG_OK);
    assert_true(first[0] == 1 && second[0] == 2);
    gbg_neighbours_destroy(&neighbours);
    gbg_neighbours_destroy(&neighbours);
    assert_int_equal(gbg_neighbours_count(NULL, NULL, NULL), GBG_E_ARGUMENT);
    /* a box of 1e8 cells for five particles */
    static const double wide[2] = {1e4, 1e4};
    assert_int_equal(gbg_neighbours_create(context, 2, wide, 1.0, "occupancy:1", 0.0, &neighbours),
                     GBG_OK);
    assert_int_equal(gbg_neighbours_update(neighbours, 2, x, y, NULL, 1, NULL), GBG_E_ARGUMENT);
    assert_non_null(strstr(gbg_message(context), "take grid"));
    gbg_neighbours_destroy(&neighbours);
    gbg_context_destroy(&context);
}

/* Every allocation fails in turn; the same handle then works. */
static void allocations_that_fail(void **state)
{
    (void)state;
    static const char *const methods[] = {"brute", "grid", "octant", "occupancy:1", "verlet"};
    struct gbg_context *context = context_of("cpu:threads=2");
    char expected[65], text[65];
    const struct set *set = &sets[11];
    make(set, 2, 64);
    int64_t pairs = reference(set, 2, 64, expected), n = 1;
    for (int m = 0; m < 5; m++) {
        struct gbg_neighbours *neighbours = NULL;
        int status = GBG_E_MEMORY;
        for (n = 1; status != GBG_OK; n++) {
            gbg_memory_fail_after(n);
            gbg_neighbours_destroy(&neighbours);
            status = gbg_neighbours_create(context, 2, set->length, set->radius, methods[m],
                                           m == 4 ? 0.2 : 0.0, &neighbours);
            status =
                status ? status : gbg_neighbours_update(neighbours, 64, r[0], r[1], NULL, 1, NULL);
            status =
                status ? status : gbg_neighbours_csr(neighbours, 0, 65, offset, 2 * pairs, row);
            gbg_memory_fail_after(0);
            assert_true(status == GBG_OK || status == GBG_E_MEMORY);
            if (neighbours) {
                assert_int_equal(gbg_neighbours_update(neighbours, 64, r[0], r[1], NULL, 1, NULL),
                                 GBG_OK);
                digest_of_pairs(neighbours, pairs, text);
                assert_string_equal(text, expected);
            }
        }
        assert_true(n > 8);
        print_message("%s: %lld allocations\n", methods[m], (long long)(n - 2));
        /* once made, nothing more is asked for */
        gbg_memory_fail_after(1);
        status = gbg_neighbours_update(neighbours, 64, r[0], r[1], NULL, 1, NULL);
        gbg_memory_fail_after(0);
        assert_int_equal(status, GBG_OK);
        gbg_neighbours_destroy(&neighbours);
    }
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lists_are_made_again_when_they_must),
        cmocka_unit_test(one_handle_takes_sets_of_any_size),
        cmocka_unit_test(a_cluster_does_not_cost_all_pairs),
        cmocka_unit_test(arrays_that_are_too_small),
        cmocka_unit_test(refusals),
        cmocka_unit_test(allocations_that_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
