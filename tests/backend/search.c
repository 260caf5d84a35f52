/* Tests of a GPU against the CPU: neighbour search, the same pairs to the last one by all methods,
 * the same rows, the same separations to the last bit, the same counts. */
#include "both.h"
#include "engine/neighbours.h"
#include "neighbours_sets.h"

enum { METHODS = 10 };
static const char *const methods[METHODS] = {"brute",       "grid",     "grid2",    "half",
                                             "octant",      "octant:4", "grid:2.5", "octant:2.52",
                                             "grid:0.7301", "auto"};

struct answer {
    int64_t n, pairs;
    int64_t *offset;
    int32_t *row, *first, *second;
    double *separation;
    int64_t at; /* pairs that batches have brought */
};

static void *memory(int64_t count, size_t size)
{
    void *made = calloc((size_t)count + 1, size);
    assert_non_null(made);
    return made;
}

static void keep_batch(void *user, int64_t n, const int32_t *i, const int32_t *j,
                       const double *separation)
{
    struct answer *answer = user;
    assert_true(answer->at + n <= answer->pairs);
    for (int64_t k = 0; k < n; k++, answer->at++) {
        assert_int_equal(i[k], answer->first[answer->at]);
        assert_int_equal(j[k], answer->second[answer->at]);
    }
    (void)separation;
}

struct separations {
    double *value;
    int64_t at;
    int dimension;
};

static void keep_separations(void *user, int64_t n, const int32_t *i, const int32_t *j,
                             const double *separation)
{
    struct separations *kept = user;
    (void)i;
    (void)j;
    memcpy(kept->value + kept->at * kept->dimension, separation,
           (size_t)(n * kept->dimension) * sizeof *separation);
    kept->at += n;
}

/* Everything that a search can be asked for, from `base`. */
static struct answer ask(struct gbg_neighbours *neighbours, int base)
{
    struct answer answer = {.n = neighbours->n};
    assert_int_equal(gbg_neighbours_count(neighbours, NULL, &answer.pairs), GBG_OK);
    int64_t pairs = answer.pairs;
    int dimension = neighbours->box.dimension;
    answer.offset = memory(answer.n + 1, 8);
    answer.row = memory(2 * pairs, 4);
    answer.first = memory(pairs, 4);
    answer.second = memory(pairs, 4);
    answer.separation = memory(dimension * pairs, 8);
    answer.row[2 * pairs] = answer.first[pairs] = answer.second[pairs] = -9;
    assert_int_equal(
        gbg_neighbours_csr(neighbours, base, answer.n + 1, answer.offset, 2 * pairs, answer.row),
        GBG_OK);
    assert_int_equal(gbg_neighbours_pairs(neighbours, base, pairs, answer.first, answer.second),
                     GBG_OK);
    assert_int_equal(gbg_neighbours_visit(neighbours, base, keep_batch, &answer), GBG_OK);
    assert_int_equal(answer.at, pairs);
    struct separations kept = {answer.separation, 0, dimension};
    assert_int_equal(gbg_neighbours_visit(neighbours, base, keep_separations, &kept), GBG_OK);
    assert_true(answer.row[2 * pairs] == -9 && answer.first[pairs] == -9 &&
                answer.second[pairs] == -9);
    return answer;
}

static void forget(struct answer *answer)
{
    free(answer->offset);
    free(answer->row);
    free(answer->first);
    free(answer->second);
    free(answer->separation);
}

static void same(const struct answer *cpu, const struct answer *gpu, int dimension,
                 const char *what)
{
    size_t n = (size_t)cpu->n, pairs = (size_t)cpu->pairs;
    if (cpu->n != gpu->n || cpu->pairs != gpu->pairs) {
        fail_msg("%s: %lld pairs, %lld on the CPU", what, (long long)gpu->pairs,
                 (long long)cpu->pairs);
    }
    if (memcmp(cpu->offset, gpu->offset, (n + 1) * 8) != 0 ||
        memcmp(cpu->row, gpu->row, 2 * pairs * 4) != 0) {
        fail_msg("%s: other rows", what);
    }
    if (memcmp(cpu->first, gpu->first, pairs * 4) != 0 ||
        memcmp(cpu->second, gpu->second, pairs * 4) != 0) {
        fail_msg("%s: other pairs", what);
    }
    if (memcmp(cpu->separation, gpu->separation, pairs * (size_t)dimension * 8) != 0) {
        fail_msg("%s: other separations", what);
    }
}

static void same_report(const struct gbg_neighbours *cpu, const struct gbg_neighbours *gpu,
                        const char *what)
{
    const struct gbg_search_report *p = &cpu->report, *q = &gpu->report;
    if (p->rows != q->rows || p->candidates != q->candidates || p->searched != q->searched) {
        fail_msg("%s: rows %lld %lld, candidates %lld %lld, searched %d %d", what,
                 (long long)p->rows, (long long)q->rows, (long long)p->candidates,
                 (long long)q->candidates, p->searched, q->searched);
    }
    assert_memory_equal(p->cells, q->cells, sizeof p->cells);
    both_same_real(p->edge, q->edge, what);
    assert_int_equal(q->crowded.first, -1);
}

/* One method on a set that `make` has made, against the CPU's double loop and its own method. */
static void check_method(struct gbg_context *const context[2], const struct set *set, int dimension,
                         int64_t n, const char *method, double skin,
                         const struct answer expected[2])
{
    char what[200];
    snprintf(what, sizeof what, "%s, %s, %dD, n %lld", set->name, method, dimension, (long long)n);
    struct gbg_neighbours *cpu = found(context[0], set, dimension, method, skin, n);
    struct gbg_neighbours *gpu = found(context[1], set, dimension, method, skin, n);
    same_report(cpu, gpu, what);
    for (int k = 0; k < 3; k++) { /* the base changes to and fro */
        struct answer answer = ask(gpu, k % 2);
        same(&expected[k % 2], &answer, dimension, what);
        forget(&answer);
    }
    gbg_neighbours_destroy(&cpu);
    gbg_neighbours_destroy(&gpu);
}

static void check_set(struct gbg_context *const context[2], const struct set *set, int dimension,
                      int64_t n)
{
    char occupancy[40];
    n = size_of(set, dimension, n);
    make(set, dimension, n);
    struct gbg_neighbours *brute = found(context[0], set, dimension, "brute", 0.0, n);
    struct answer expected[2] = {ask(brute, 0), ask(brute, 1)};
    for (int m = 0; m < METHODS; m++) {
        check_method(context, set, dimension, n, methods[m], 0.0, expected);
    }
    check_method(context, set, dimension, n, "verlet", 0.35 * set->radius, expected);
    if (set->least > 0.0) {
        snprintf(occupancy, sizeof occupancy, "occupancy:%g", set->least);
        check_method(context, set, dimension, n, occupancy, 0.0, expected);
    }
    forget(&expected[0]);
    forget(&expected[1]);
    gbg_neighbours_destroy(&brute);
}

static void every_method_is_the_same(void **state)
{
    static const int64_t sizes[] = {0, 1, 2, 3, 32, 33, 129, MOST};
    (void)state;
    struct gbg_context *context[2] = {context_of("cpu:threads=2"), context_of("cuda:0")};
    for (int s = 0; s < SETS; s++) {
        for (int k = 0; k < (int)(sizeof sizes / sizeof *sizes); k++) {
            if (!both_takes(k + s)) {
                continue;
            }
            check_set(context, &sets[s], 2, sizes[k]);
            check_set(context, &sets[s], 3, sizes[k]);
        }
    }
    gbg_context_destroy(&context[0]);
    gbg_context_destroy(&context[1]);
}

/* Updates with arrays of any step, against the CPU. */
static void check_many(struct gbg_context *const context[2], int dimension, const double *length,
                       double radius, const char *method, int64_t n, const double *const x[3],
                       int64_t step)
{
    struct gbg_neighbours *neighbours[2];
    struct answer answer[2];
    char what[100];
    snprintf(what, sizeof what, "%s, %dD, n %lld, step %lld", method, dimension, (long long)n,
             (long long)step);
    for (int b = 0; b < 2; b++) {
        double skin = strcmp(method, "verlet") == 0 ? 0.1 * radius : 0.0;
        assert_int_equal(gbg_neighbours_create(context[b], dimension, length, radius, method, skin,
                                               &neighbours[b]),
                         GBG_OK);
        if (gbg_neighbours_update(neighbours[b], n, x[0], x[1], dimension == 3 ? x[2] : NULL, step,
                                  NULL) != GBG_OK) {
            fail_msg("%s: %s", what, gbg_message(context[b]));
        }
        answer[b] = ask(neighbours[b], 1);
    }
    same_report(neighbours[0], neighbours[1], what);
    same(&answer[0], &answer[1], dimension, what);
    if (step == 1) {
        print_message("%s: %lld pairs\n", what, (long long)answer[0].pairs);
    }
    for (int b = 0; b < 2; b++) {
        forget(&answer[b]);
        gbg_neighbours_destroy(&neighbours[b]);
    }
}

/* Thousands, half of them in a corner, so that rows are of very different lengths. */
static void many_particles(void **state)
{
    enum { MANY = 20001, ROOM = 12 * MANY };
    static const char *const some[] = {"grid", "half", "octant", "auto", "verlet"};
    static const int64_t steps[] = {1, -1, 3, -3, 4, 11, -11};
    static double value[ROOM], apart[3][ROOM];
    static const double length[3] = {1.0, 1.1, 0.9};
    (void)state;
    struct gbg_context *context[2] = {context_of("cpu:threads=2"), context_of("cuda:0")};
    for (int dimension = 2; dimension <= 3; dimension++) {
        for (int s = 0; s < (int)(sizeof steps / sizeof *steps); s++) {
            int64_t step = steps[s], wide = step < 0 ? -step : step;
            int together = wide == 3 || wide == 4; /* x y z x y z, or three arrays */
            const double *x[3];
            for (int a = 0; a < 3; a++) {
                double *to = together ? value + a : apart[a];
                x[a] = step < 0 ? to + (MANY - 1) * wide : to;
                for (int64_t i = 0; i < MANY; i++) {
                    to[i * wide] = uniform((uint64_t)(3 * i + a)) * (i % 2 ? 0.3 : 1.0) - 0.1;
                }
            }
            for (int m = 0; m < (s == 0 ? 5 : 1); m++) {
                check_many(context, dimension, length, dimension == 2 ? 0.02 : 0.06, some[m], MANY,
                           x, step);
            }
        }
    }
    gbg_context_destroy(&context[0]);
    gbg_context_destroy(&context[1]);
}

/* Rows of all lengths that the sorting of rows tells apart. */
static void rows_of_any_length(void **state)
{
    enum { MANY = 3000 };
    static const int64_t sizes[] = {16, 17, 40, 70, 130, 260, 300, 1025, MANY};
    static double value[3][MANY];
    static const double length[3] = {10.0, 10.0, 10.0};
    (void)state;
    struct gbg_context *context[2] = {context_of("cpu:threads=2"), context_of("cuda:0")};
    const double *x[3] = {value[0], value[1], value[2]};
    for (int64_t i = 0; i < MANY; i++) {
        for (int a = 0; a < 3; a++) {
            value[a][i] = 3.0 + 1.1 * uniform((uint64_t)(3 * i + a)); /* most within R */
        }
    }
    for (int dimension = 2; dimension <= 3; dimension++) {
        for (int s = 0; s < (int)(sizeof sizes / sizeof *sizes); s++) {
            check_many(context, dimension, length, 1.0, "half", sizes[s], x, 1);
        }
    }
    gbg_context_destroy(&context[0]);
    gbg_context_destroy(&context[1]);
}

/* All are neighbours of all: rows longer than a multiprocessor holds, in no order when found. */
static void very_long_rows(void **state)
{
    enum { MANY = 9001 };
    static double value[2][MANY];
    static const double length[2] = {10.0, 10.0};
    (void)state;
    struct gbg_context *context = context_of("cuda:0");
    struct gbg_neighbours *neighbours;
    int64_t pairs;
    for (int64_t i = 0; i < MANY; i++) {
        value[0][i] = 9.8 + 0.7 * uniform((uint64_t)(2 * i));
        value[1][i] = 9.7 + 0.7 * uniform((uint64_t)(2 * i + 1));
    }
    int64_t *offsets = memory(MANY + 1, 8);
    int32_t *rows = memory((int64_t)MANY * (MANY - 1), 4);
    assert_int_equal(gbg_neighbours_create(context, 2, length, 1.0, "half", 0.0, &neighbours),
                     GBG_OK);
    assert_int_equal(gbg_neighbours_update(neighbours, MANY, value[0], value[1], NULL, 1, NULL),
                     GBG_OK);
    assert_int_equal(gbg_neighbours_count(neighbours, NULL, &pairs), GBG_OK);
    assert_int_equal(pairs, (int64_t)MANY * (MANY - 1) / 2);
    assert_int_equal(gbg_neighbours_csr(neighbours, 0, MANY + 1, offsets, 2 * pairs, rows), GBG_OK);
    int64_t wrong = 0;
    for (int64_t i = 0; i < MANY; i++) {
        wrong += offsets[i] != i * (MANY - 1);
        for (int64_t k = 0; k < MANY - 1; k++) {
            wrong += rows[i * (MANY - 1) + k] != k + (k >= i);
        }
    }
    assert_int_equal(wrong, 0);
    free(offsets);
    free(rows);
    gbg_neighbours_destroy(&neighbours);
    gbg_context_destroy(&context);
}

/* A list is kept and made again in the same steps as on the CPU. */
static void lists_are_kept_alike(void **state)
{
    (void)state;
    const struct set *set = &sets[0];
    struct gbg_context *context[2] = {context_of("cpu:threads=2"), context_of("cuda:0")};
    int64_t kept = 0;
    for (int dimension = 2; dimension <= 3; dimension++) {
        const int64_t n = 400;
        struct gbg_neighbours *neighbours[2];
        make(set, dimension, n);
        for (int b = 0; b < 2; b++) {
            neighbours[b] = found(context[b], set, dimension, "verlet", 0.4, n);
        }
        for (int step = 0; step < 60; step++) {
            int searched[2];
            struct answer answer[2];
            int64_t now = step == 40 ? n - 7 : n; /* another number of particles */
            for (int64_t i = 0; i < dimension * n; i++) {
                r[i % dimension][i / dimension] +=
                    0.04 * (uniform((uint64_t)(5000 * step + i)) - 0.5);
            }
            r[0][step] += 3.0 * set->length[0]; /* another image is the same place */
            for (int b = 0; b < 2; b++) {
                assert_int_equal(gbg_neighbours_update(neighbours[b], now, r[0], r[1],
                                                       dimension == 3 ? r[2] : NULL, 1,
                                                       &searched[b]),
                                 GBG_OK);
                answer[b] = ask(neighbours[b], 0);
            }
            assert_int_equal(searched[0], searched[1]);
            same_report(neighbours[0], neighbours[1], "a list");
            same(&answer[0], &answer[1], dimension, "a list");
            kept += !searched[0];
            forget(&answer[0]);
            forget(&answer[1]);
        }
        gbg_neighbours_destroy(&neighbours[0]);
        gbg_neighbours_destroy(&neighbours[1]);
    }
    print_message("lists kept in %lld of 120 steps\n", (long long)kept);
    assert_true(kept > 60 && kept < 118);
    gbg_context_destroy(&context[0]);
    gbg_context_destroy(&context[1]);
}

static void one_handle_takes_sets_of_any_size(void **state)
{
    static const int64_t sizes[] = {0, 300, 2, 700, 1, 650, 0, 33};
    (void)state;
    struct gbg_context *context[2] = {context_of("cpu"), context_of("cuda:0")};
    for (int k = 0; k < 3; k++) {
        static const char *const method[] = {"auto", "verlet", "brute"};
        struct gbg_neighbours *gpu =
            found(context[1], &sets[0], 2, method[k], k == 1 ? 0.3 : 0.0, 0);
        for (int s = 0; s < (int)(sizeof sizes / sizeof *sizes); s++) {
            make(&sets[0], 2, sizes[s]);
            struct gbg_neighbours *cpu = found(context[0], &sets[0], 2, "brute", 0.0, sizes[s]);
            assert_int_equal(gbg_neighbours_update(gpu, sizes[s], r[0], r[1], NULL, 1, NULL),
                             GBG_OK);
            struct answer p = ask(cpu, 0), q = ask(gpu, 0);
            same(&p, &q, 2, method[k]);
            forget(&p);
            forget(&q);
            gbg_neighbours_destroy(&cpu);
        }
        gbg_neighbours_destroy(&gpu);
    }
    gbg_context_destroy(&context[0]);
    gbg_context_destroy(&context[1]);
}

/* Two in a cell of one, and too many cells: the same sentence; then the handle works. */
static void refusals_are_the_same(void **state)
{
    (void)state;
    char said[2][2][1024];
    struct gbg_context *context[2] = {context_of("cpu"), context_of("cuda:0")};
    const struct set *set = &sets[11];
    for (int b = 0; b < 2; b++) {
        struct gbg_neighbours *neighbours;
        static const double wide[2] = {1e4, 1e4};
        int64_t pairs;
        assert_int_equal(gbg_neighbours_create(context[b], 2, set->length, set->radius,
                                               "occupancy:1", 0.0, &neighbours),
                         GBG_OK);
        make(set, 2, 64);
        r[0][41] = r[0][17] + 0.01; /* two pairs: the one of lowest indices is named */
        r[1][41] = r[1][17] - 0.02;
        r[0][63] = r[0][5];
        r[1][63] = r[1][5] + 0.03;
        assert_int_equal(gbg_neighbours_update(neighbours, 64, r[0], r[1], NULL, 1, NULL),
                         GBG_E_OVERLAP);
        snprintf(said[0][b], sizeof said[0][b], "%s", gbg_message(context[b]));
        assert_int_equal(gbg_neighbours_count(neighbours, NULL, &pairs), GBG_E_ORDER);
        make(set, 2, 64);
        assert_int_equal(gbg_neighbours_update(neighbours, 64, r[0], r[1], NULL, 1, NULL), GBG_OK);
        assert_int_equal(gbg_neighbours_count(neighbours, NULL, &pairs), GBG_OK);
        assert_int_equal(pairs, 128);
        assert_int_equal(gbg_neighbours_csr(neighbours, 0, 65, offset, 256, row), GBG_OK);
        assert_int_equal(offset[64], 256);
        for (int k = 1; k < 4; k++) { /* a lattice: four neighbours each */
            assert_true(offset[k] == 4 * k && row[k - 1] < row[k]);
        }
        gbg_neighbours_destroy(&neighbours);
        assert_int_equal(
            gbg_neighbours_create(context[b], 2, wide, 1.0, "occupancy:1", 0.0, &neighbours),
            GBG_OK);
        assert_int_equal(gbg_neighbours_update(neighbours, 5, r[0], r[1], NULL, 1, NULL),
                         GBG_E_ARGUMENT);
        snprintf(said[1][b], sizeof said[1][b], "%s", gbg_message(context[b]));
        gbg_neighbours_destroy(&neighbours);
    }
    print_message("%s\n%s\n", said[0][1], said[1][1]);
    assert_string_equal(said[0][0], said[0][1]);
    assert_string_equal(said[1][0], said[1][1]);
    gbg_context_destroy(&context[0]);
    gbg_context_destroy(&context[1]);
}

/* Everything in one place: 9e10 entries do not fit, which is said; then the handle works. */
static void too_many_rows_are_refused(void **state)
{
    enum { MANY = 300000 };
    static double value[MANY];
    static const double length[3] = {5.0, 5.0, 5.0};
    (void)state;
    struct gbg_context *context = context_of("cuda:0");
    struct gbg_neighbours *neighbours;
    int64_t pairs;
    for (int64_t i = 0; i < MANY; i++) {
        value[i] = 2.5;
    }
    assert_int_equal(gbg_neighbours_create(context, 3, length, 0.5, "grid", 0.0, &neighbours),
                     GBG_OK);
    assert_int_equal(gbg_neighbours_update(neighbours, MANY, value, value, value, 1, NULL),
                     GBG_E_MEMORY);
    print_message("%s\n", gbg_message(context));
    assert_non_null(strstr(gbg_message(context), "rows of neighbours"));
    assert_int_equal(gbg_neighbours_count(neighbours, NULL, &pairs), GBG_E_ORDER);
    assert_int_equal(gbg_neighbours_update(neighbours, 1000, value, value, value, 1, NULL), GBG_OK);
    assert_int_equal(gbg_neighbours_count(neighbours, NULL, &pairs), GBG_OK);
    assert_int_equal(pairs, 1000 * 999 / 2);
    gbg_neighbours_destroy(&neighbours);
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_method_is_the_same),
        cmocka_unit_test(many_particles),
        cmocka_unit_test(rows_of_any_length),
        cmocka_unit_test(very_long_rows),
        cmocka_unit_test(lists_are_kept_alike),
        cmocka_unit_test(one_handle_takes_sets_of_any_size),
        cmocka_unit_test(refusals_are_the_same),
        cmocka_unit_test(too_many_rows_are_refused),
    };
    return both_missing() ? BOTH_SKIPPED : cmocka_run_group_tests(tests, NULL, NULL);
}
