/* Tests of the public interface: order of input, hard cases, refusals that change nothing. */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "gamboge/gamboge.h"

#define DONE(call)                                                                                 \
    do {                                                                                           \
        int status_ = (call);                                                                      \
        if (status_ != GBG_OK) {                                                                   \
            fail_msg("%s: %s: %s", #call, gbg_status_name(status_), gbg_message(context));         \
        }                                                                                          \
    } while (0)
#define REFUSED(call, status, words)                                                               \
    do {                                                                                           \
        assert_int_equal((call), (status));                                                        \
        if (!strstr(gbg_message(context), words)) {                                                \
            fail_msg("%s: \"%s\" lacks \"%s\"", #call, gbg_message(context), words);               \
        }                                                                                          \
    } while (0)

static struct gbg_context *context;

static int set_up(void **state)
{
    (void)state;
    return gbg_context_create("cpu:threads=2", &context);
}

static int tear_down(void **state)
{
    (void)state;
    return gbg_context_destroy(&context);
}

/* Brownian scene in a box of these lengths with hard cores by rule (NULL: none). */
static struct gbg_scene *brownian(int dimension, const double *lengths, const char *rule)
{
    struct gbg_scene *scene;
    DONE(gbg_scene_create(context, dimension, &scene));
    DONE(gbg_scene_set_box(scene, lengths, NULL));
    if (rule) {
        DONE(gbg_scene_set_text(scene, "excluded_volume.rule", rule));
    }
    DONE(gbg_scene_set_real(scene, "dynamics.dt", 0.01));
    DONE(gbg_scene_set_real(scene, "dynamics.temperature", 0.01));
    DONE(gbg_scene_set_integer(scene, "run.seed", 11));
    return scene;
}

static void add_species(struct gbg_scene *scene, const char *name, double diameter, double alpha,
                        double mobility)
{
    int index;
    DONE(gbg_scene_add_species(scene, name, diameter, alpha, mobility, -1, -1, &index));
}

enum { SIDE = 14, N = SIDE * SIDE };
static double x[N], y[N];
static int32_t species[N];
static int64_t ids[N];

/* Discs of spacing 1.2 with ids that are not consecutive; place k of the arrays holds number
 * order[k] of them. */
static void fill(const int *order)
{
    for (int k = 0; k < N; k++) {
        int i = order[k];
        x[k] = 1.2 * (i % SIDE) + 0.00019 * (i * 7919 % 1000); /* none exactly half a box apart */
        y[k] = 1.2 * (i / SIDE) + 0.00019 * (i * 6007 % 1000);
        species[k] = 1 + i % 2;
        ids[k] = INT64_C(10000000000) + 3 * i;
    }
}

static struct gbg_engine *active(void)
{
    double lengths[2] = {1.2 * SIDE, 1.2 * SIDE};
    struct gbg_engine *engine;
    struct gbg_scene *scene = brownian(2, lengths, "bounce");
    add_species(scene, "A", 1.0, 1.0, 1.0);
    add_species(scene, "B", 1.0, -1.0, -2.0);
    DONE(gbg_scene_add_force(scene, 6.0, "cutoff", 2.5, 0.0));
    DONE(gbg_scene_add_force(scene, 2.0, "minimum_image", 0.0, 0.0));
    DONE(gbg_scene_add_particles(scene, N / 2, x, y, NULL, 1, species, 1, ids));
    DONE(gbg_scene_add_particles(scene, N - N / 2, x + N / 2, y + N / 2, NULL, 1, species + N / 2,
                                 1, ids + N / 2));
    DONE(gbg_engine_create(scene, &engine));
    DONE(gbg_scene_destroy(&scene));
    return engine;
}

static void order_of_input_does_not_matter(void **state)
{
    (void)state;
    int order[N];
    static double end[2][2][N];
    char hash[2][65];
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < N; k++) {
            order[k] = pass ? (k * 45 + 17) % N : k; /* 45 and 196 have no common factor */
        }
        fill(order);
        struct gbg_engine *engine = active();
        DONE(gbg_engine_run(engine, 150));
        DONE(gbg_engine_hash(engine, 65, hash[pass]));
        DONE(gbg_engine_positions(engine, 1, N, x, y, NULL, 1));
        int64_t back[N];
        DONE(gbg_engine_ids(engine, N, back));
        assert_memory_equal(back, ids, sizeof back);
        for (int k = 0; k < N; k++) {
            end[pass][0][order[k]] = x[k];
            end[pass][1][order[k]] = y[k];
        }
        DONE(gbg_engine_destroy(&engine));
    }
    assert_string_equal(hash[0], hash[1]);
    assert_memory_equal(end[0], end[1], sizeof end[0]);
}

static void strides_and_columns(void **state)
{
    (void)state;
    int order[N];
    static double rows[N][2], back[N][2];
    char hash[2][65];
    for (int k = 0; k < N; k++) {
        order[k] = k;
    }
    fill(order);
    for (int k = 0; k < N; k++) {
        rows[k][0] = x[k];
        rows[k][1] = y[k];
    }
    double lengths[2] = {1.2 * SIDE, 1.2 * SIDE};
    for (int pass = 0; pass < 2; pass++) {
        struct gbg_scene *scene = brownian(2, lengths, "bounce");
        struct gbg_engine *engine;
        add_species(scene, "A", 1.0, 0.0, 1.0);
        if (pass) { /* reversed rows with reversed ids */
            int64_t id[N];
            for (int k = 0; k < N; k++) {
                id[k] = N - 1 - k;
            }
            DONE(gbg_scene_add_particles(scene, N, &rows[N - 1][0], &rows[N - 1][1], NULL, -2, NULL,
                                         0, id));
        } else {
            DONE(gbg_scene_add_particles(scene, N, x, y, NULL, 1, NULL, 0, NULL));
        }
        DONE(gbg_engine_create(scene, &engine));
        DONE(gbg_engine_run(engine, 20));
        DONE(gbg_engine_hash(engine, 65, hash[pass]));
        DONE(gbg_engine_positions(engine, 1, N, &back[0][0], &back[0][1], NULL, 2));
        DONE(gbg_engine_destroy(&engine));
        DONE(gbg_scene_destroy(&scene));
    }
    assert_string_equal(hash[0], hash[1]);
}

/* F_total = sum_i mu_i sum_k alpha_k f(r_ik), zero by symmetry of f when mu is proportional to
 * alpha, and equal to the naive sum otherwise. */
static void momentum_identity(void **state)
{
    (void)state;
    int order[N];
    for (int k = 0; k < N; k++) {
        order[k] = k;
    }
    fill(order);
    double lengths[2] = {1.2 * SIDE, 1.2 * SIDE};
    for (int reciprocal = 0; reciprocal < 2; reciprocal++) {
        struct gbg_scene *scene = brownian(2, lengths, NULL);
        struct gbg_engine *engine;
        double mobility[2] = {reciprocal ? 2.0 : 1.0, reciprocal ? -2.0 : 3.0};
        add_species(scene, "A", 1.0, 1.0, mobility[0]);
        add_species(scene, "B", 1.0, -1.0, mobility[1]);
        DONE(gbg_scene_add_force(scene, 2.0, "minimum_image", 0.0, 0.0));
        DONE(gbg_scene_set_text(scene, "precision.mode", "double"));
        DONE(gbg_scene_add_particles(scene, N, x, y, NULL, 1, species, 1, NULL));
        DONE(gbg_engine_create(scene, &engine));
        double fx[N], fy[N], total[2] = {0, 0}, naive[2] = {0, 0}, size = 0;
        DONE(gbg_engine_forces(engine, N, fx, fy, NULL, 1));
        for (int i = 0; i < N; i++) {
            total[0] += fx[i];
            total[1] += fy[i];
            size += fabs(fx[i]);
            for (int k = 0; k < i; k++) { /* each pair once: mu_i alpha_k - mu_k alpha_i */
                double dx = x[i] - x[k], dy = y[i] - y[k];
                dx -= lengths[0] * rint(dx / lengths[0]);
                dy -= lengths[1] * rint(dy / lengths[1]);
                double alpha_i = species[i] == 1 ? 1.0 : -1.0, alpha_k = species[k] == 1 ? 1 : -1;
                double pair =
                    (mobility[species[i] - 1] * alpha_k - mobility[species[k] - 1] * alpha_i) /
                    pow(dx * dx + dy * dy, 1.5);
                naive[0] += pair * dx;
                naive[1] += pair * dy;
            }
        }
        print_message("sum of forces %g %g, naive %g %g, sum of sizes %g\n", total[0], total[1],
                      naive[0], naive[1], size);
        assert_true(fabs(total[0] - naive[0]) < 1e-12 * size);
        assert_true(fabs(total[1] - naive[1]) < 1e-12 * size);
        assert_true(!reciprocal || fabs(total[0]) < 1e-12 * size);
        DONE(gbg_engine_destroy(&engine));
        DONE(gbg_scene_destroy(&scene));
    }
}

static void few_particles(void **state)
{
    (void)state;
    double lengths[2] = {8.0, 6.0}, px[3] = {0.5, 2.0, 7.5}, py[3] = {0.5, 5.9, 3.0};
    for (int64_t n = 0; n <= 3; n++) {
        struct gbg_scene *scene = brownian(2, lengths, "contact");
        struct gbg_engine *engine;
        double fx[3], fy[3], error, median;
        add_species(scene, "A", 1.0, 1.0, 1.0);
        DONE(gbg_scene_add_force(scene, 2.0, "minimum_image", 0.0, 0.0));
        DONE(gbg_scene_add_force(scene, 6.0, "cutoff", 2.5, 0.0));
        DONE(gbg_scene_add_particles(scene, n, px, py, NULL, 1, NULL, 0, NULL));
        DONE(gbg_engine_create(scene, &engine));
        DONE(gbg_engine_forces(engine, n, fx, fy, NULL, 1));
        if (n == 1) {
            assert_true(fx[0] == 0.0 && fy[0] == 0.0);
        }
        if (n == 2) { /* the nearest image of the second lies below the first */
            double dx = px[0] - px[1], dy = py[0] - py[1] + 6.0, r = hypot(dx, dy);
            double f = dx * (pow(r, -3) + pow(r, -7));
            assert_true(fabs(fx[0] - f) < 1e-6 * fabs(f));
            assert_true(fabs(fx[0] + fx[1]) < 1e-6 * fabs(f));
        }
        DONE(gbg_engine_force_error(engine, 0, &error, &median));
        assert_true(error < 1e-6);
        DONE(gbg_engine_run(engine, 100));
        DONE(gbg_engine_destroy(&engine));
        DONE(gbg_scene_destroy(&scene));
    }
}

static void boxes_that_are_too_small(void **state)
{
    (void)state;
    double lengths[2] = {4.9, 20.0};
    struct gbg_engine *engine = NULL;
    struct gbg_scene *scene = brownian(2, lengths, NULL);
    add_species(scene, "A", 1.0, 1.0, 1.0);
    DONE(gbg_scene_add_force(scene, 6.0, "cutoff", 2.5, 0.0));
    DONE(gbg_scene_add_particles(scene, 0, NULL, NULL, NULL, 1, NULL, 0, NULL));
    REFUSED(gbg_engine_create(scene, &engine), GBG_E_SCENE, "2.45");
    assert_null(engine);
    DONE(gbg_scene_destroy(&scene));
    lengths[0] = 1.9;
    scene = brownian(2, lengths, "bounce");
    add_species(scene, "A", 1.0, 1.0, 1.0);
    DONE(gbg_scene_add_particles(scene, 0, NULL, NULL, NULL, 1, NULL, 0, NULL));
    assert_int_equal(gbg_engine_create(scene, &engine), GBG_E_SCENE);
    DONE(gbg_scene_destroy(&scene));
}

/* 1000 : 1, coordinates far outside, a cut-off close to half the short side. */
static void long_thin_box(void **state)
{
    (void)state;
    double lengths[2] = {6000.0, 6.0};
    enum { MANY = 3000 };
    static double px[MANY], py[MANY], fx[MANY], fy[MANY];
    struct gbg_scene *scene = brownian(2, lengths, "bounce");
    struct gbg_engine *engine;
    add_species(scene, "A", 1.0, 1.0, 1.0);
    DONE(gbg_scene_add_force(scene, 6.0, "cutoff", 2.9, 0.0));
    for (int i = 0; i < MANY; i++) {
        px[i] = 4.0 * (i / 2) + 0.3 * (i % 2) - 18e6; /* 3000 boxes away */
        py[i] = 2.5 * (i % 2) + 6e7;
    }
    DONE(gbg_scene_add_particles(scene, MANY, px, py, NULL, 1, NULL, 0, NULL));
    DONE(gbg_engine_create(scene, &engine));
    double error, median;
    DONE(gbg_engine_forces(engine, MANY, fx, fy, NULL, 1));
    DONE(gbg_engine_force_error(engine, 0, &error, &median));
    print_message("1000:1 box: force error %.2e of RMS\n", error);
    assert_true(error > 0.0 && error < 1e-6); /* zero: no pair within the cut-off, no test */
    DONE(gbg_engine_run(engine, 100));
    DONE(gbg_engine_destroy(&engine));
    DONE(gbg_scene_destroy(&scene));
}

/* A box of 1e6 diameters: neighbours at contact keep their resolution, by cut-off and direct. */
static void large_box(void **state)
{
    (void)state;
    double lengths[2] = {1e6, 1e6};
    enum { MANY = 2000 };
    static double px[MANY], py[MANY];
    for (int sum = 0; sum < 2; sum++) {
        struct gbg_scene *scene = brownian(2, lengths, "bounce");
        struct gbg_engine *engine;
        double error, median;
        add_species(scene, "A", 1.0, 1.0, 1.0);
        DONE(gbg_scene_add_force(scene, sum ? 2.0 : 6.0, sum ? "minimum_image" : "cutoff",
                                 sum ? 0.0 : 2.5, 0.0));
        for (int i = 0; i < MANY; i++) { /* touching pairs all over the box */
            px[i] = fmod(617.03 * (i / 2) * (i / 2 + 1), 1e6) + 1.000001 * (i % 2);
            py[i] = fmod(1000.7 * (i / 2), 1e6);
        }
        DONE(gbg_scene_add_particles(scene, MANY, px, py, NULL, 1, NULL, 0, NULL));
        DONE(gbg_engine_create(scene, &engine));
        DONE(gbg_engine_force_error(engine, 0, &error, &median));
        print_message("box of 1e6 diameters, %s: force error %.2e\n", sum ? "direct" : "cut-off",
                      error);
        assert_true(error < 1e-6);
        DONE(gbg_engine_run(engine, 10));
        DONE(gbg_engine_destroy(&engine));
        DONE(gbg_scene_destroy(&scene));
    }
}

static void bad_arguments_change_nothing(void **state)
{
    (void)state;
    int order[N];
    char before[65], after[65];
    for (int k = 0; k < N; k++) {
        order[k] = k;
    }
    fill(order);
    struct gbg_engine *engine = active();
    int64_t value;
    DONE(gbg_engine_run(engine, 3));
    DONE(gbg_engine_hash(engine, 65, before));
    REFUSED(gbg_engine_run(engine, -1), GBG_E_ARGUMENT, "-1");
    REFUSED(gbg_engine_positions(engine, 1, N - 1, x, y, NULL, 1), GBG_E_ARGUMENT, "195");
    REFUSED(gbg_engine_positions(engine, 1, N, x, NULL, NULL, 1), GBG_E_ARGUMENT, "y is NULL");
    REFUSED(gbg_engine_positions(engine, 0, N, x, y, NULL, 1), GBG_E_ORDER, "unwrapped");
    REFUSED(gbg_engine_integer(engine, "contact_round", &value), GBG_E_NAME, "contact_rounds");
    DONE(gbg_engine_positions(engine, 1, N, x, y, NULL, 1));
    double kept = x[5];
    x[5] = NAN;
    REFUSED(gbg_engine_set_positions(engine, N, x, y, NULL, 1), GBG_E_ARGUMENT, "particle 5");
    x[5] = x[6];
    y[5] = y[6];
    REFUSED(gbg_engine_set_positions(engine, N, x, y, NULL, 1), GBG_E_OVERLAP, "coincide");
    x[5] = kept;
    DONE(gbg_engine_hash(engine, 65, after));
    assert_string_equal(before, after);
    DONE(gbg_engine_destroy(&engine));
    assert_int_equal(gbg_engine_run(NULL, 1), GBG_E_ARGUMENT);
    DONE(gbg_engine_destroy(&engine)); /* again, and nothing happens */
    DONE(gbg_engine_destroy(NULL));
}

static void ideal_gas_holds_positions_only(void **state)
{
    (void)state;
    double lengths[3] = {10, 10, 10}, bytes;
    for (int dimension = 2; dimension <= 3; dimension++) {
        struct gbg_scene *scene = brownian(dimension, lengths, NULL);
        struct gbg_engine *engine;
        int lines, index;
        DONE(gbg_scene_set_integer(scene, "particles.count", 1000));
        DONE(gbg_scene_add_species(scene, "A", 0.0, 0.0, 1.0, 1.0, -1, &index));
        DONE(gbg_scene_set_text(scene, "particles.start.random", "insertion"));
        DONE(gbg_engine_create(scene, &engine));
        DONE(gbg_engine_run(engine, 10));
        DONE(gbg_engine_real(engine, "bytes_per_particle", &bytes));
        DONE(gbg_engine_plan_size(engine, &lines));
        assert_true(bytes == 8.0 * dimension);
        assert_int_equal(lines, 1);
        DONE(gbg_engine_destroy(&engine));
        DONE(gbg_scene_destroy(&scene));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(order_of_input_does_not_matter),
        cmocka_unit_test(strides_and_columns),
        cmocka_unit_test(momentum_identity),
        cmocka_unit_test(few_particles),
        cmocka_unit_test(boxes_that_are_too_small),
        cmocka_unit_test(long_thin_box),
        cmocka_unit_test(large_box),
        cmocka_unit_test(bad_arguments_change_nothing),
        cmocka_unit_test(ideal_gas_holds_positions_only),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
