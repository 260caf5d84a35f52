/* Tests of whole runs with sums over all images: scenes in the manner of Carter (2016), the check
 * of the error and what follows from it, the same bits, restarts, hard cases, refusals. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "fft/fft.h"
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
static const char *no_transforms; /* why there are none, NULL: there are some */
static char logged[4096];

static void note(void *user, int level, const char *line)
{
    (void)user;
    (void)level;
    size_t used = strlen(logged);
    snprintf(logged + used, sizeof logged - used, "%s\n", line);
}

static int set_up(void **state)
{
    (void)state;
    const char *why;
    no_transforms = gbg_fft_find(&why) ? NULL : why;
    int status = gbg_context_create("cpu:threads=2", &context);
    return status ? status : gbg_context_set_log(context, note, NULL);
}

static int tear_down(void **state)
{
    (void)state;
    return gbg_context_destroy(&context);
}

static void need_transforms(void)
{
    logged[0] = 0;
    if (no_transforms) {
        printf("skipped: %s\n", no_transforms);
        skip();
    }
}

/* Species of Carter (2016), table 5.1: fraction, source and mobility of both, area fraction. */
static const double table[5][7] = {{0.7, 1, 1, 0.3, 1, -1, 0.79},
                                   {0.5, 1, 1, 0.5, 1, -1, 0.52},
                                   {0.5, 1, 1, 0.5, -1, -2, 0.52},
                                   {0.5, -1, 1, 0.5, 1, -2, 0.79},
                                   {0.5, 1, 1, 0.5, -1, -4, 0.0873}};

static struct gbg_scene *suspension(int c, int64_t n, double tolerance)
{
    const double *row = table[c];
    struct gbg_scene *scene;
    DONE(gbg_scene_create(context, 2, &scene));
    for (int s = 0; s < 2; s++) {
        DONE(gbg_scene_add_species(scene, NULL, 1.0, row[3 * s + 1], row[3 * s + 2], row[3 * s], -1,
                                   NULL));
    }
    DONE(gbg_scene_add_force(scene, 2.0, "lattice", 0.0, tolerance));
    DONE(gbg_scene_set_integer(scene, "particles.count", n));
    DONE(gbg_scene_set_real(scene, "box.packing", row[6]));
    DONE(gbg_scene_set_text(scene, "particles.start.lattice", "triangular"));
    DONE(gbg_scene_set_real(scene, "particles.start.jitter", 0.5));
    DONE(gbg_scene_set_text(scene, "excluded_volume.rule", "auto"));
    DONE(gbg_scene_set_real(scene, "dynamics.dt", 0.01));
    DONE(gbg_scene_set_real(scene, "dynamics.temperature", 0.01));
    DONE(gbg_scene_set_real(scene, "dynamics.noise.limit", 3.0));
    DONE(gbg_scene_set_text(scene, "dynamics.noise.limit_by", "clamp"));
    DONE(gbg_scene_set_integer(scene, "run.seed", 5));
    return scene;
}

/* |sum_i alpha_i F_i/mobility_i| over the sum of the lengths: zero for forces of pairs. */
static double momentum(struct gbg_engine *engine, int c, int64_t n)
{
    double *f = calloc((size_t)n, 2 * sizeof *f), total[2] = {0.0, 0.0}, lengths = 0.0;
    int32_t *species = calloc((size_t)n, sizeof *species);
    DONE(gbg_engine_forces(engine, n, f, f + 1, NULL, 2));
    DONE(gbg_engine_species(engine, n, species, 0));
    for (int64_t i = 0; i < n; i++) {
        double weight = table[c][3 * species[i] + 1] / table[c][3 * species[i] + 2];
        total[0] += weight * f[2 * i];
        total[1] += weight * f[2 * i + 1];
        lengths += fabs(weight) * hypot(f[2 * i], f[2 * i + 1]);
    }
    free(f);
    free(species);
    return hypot(total[0], total[1]) / lengths;
}

static void whole_steps_keep_to_their_tolerance(void **state)
{
    (void)state;
    enum { N = 1024, STEPS = 120 };
    need_transforms();
    for (int c = 0; c < 5; c++) {
        struct gbg_scene *scene = suspension(c, N, 1e-4);
        struct gbg_engine *engine;
        double tolerance, predicted, measured, now, median, pairs;
        int64_t left = -1, reverted = -1;
        int refined, lines;
        char line[256];
        DONE(gbg_engine_create(scene, &engine));
        DONE(gbg_engine_get_sum(engine, 0, NULL, NULL, &measured, NULL));
        assert_true(measured == -1.0); /* nobody has asked for forces yet */
        DONE(gbg_engine_plan_size(engine, &lines));
        assert_true(lines > 0);
        DONE(gbg_engine_plan_line(engine, 0, sizeof line, line));
        assert_non_null(strstr(line, "ewald | r/r^3, all images: reach "));
        DONE(gbg_engine_run(engine, STEPS));
        DONE(gbg_engine_integer(engine, "overlaps_left", &left));
        DONE(gbg_engine_integer(engine, "reverted", &reverted));
        DONE(gbg_engine_get_sum(engine, 0, &tolerance, &predicted, &measured, &refined));
        DONE(gbg_engine_force_error(engine, N, &now, &median));
        pairs = momentum(engine, c, N);
        printf("C%d: error by the model %.1e, at the check %.1e, now %.1e (over median %.1e), "
               "refined %d, momentum %.1e, %s\n",
               c, predicted, measured, now, median, refined, pairs, line);
        assert_true(tolerance == 1e-4);
        assert_int_equal(left, 0);
        assert_true(measured >= 0.0 && measured <= tolerance);
        assert_true(now <= 1.5 * tolerance); /* a little may change between two looks */
        assert_true(pairs < 1e-6);           /* single precision */
        gbg_engine_destroy(&engine);
        gbg_scene_destroy(&scene);
    }
}

/* n points in the box [0, side)^2. */
static void scatter(int64_t n, double side, uint64_t seed, double *x)
{
    for (int64_t i = 0; i < 2 * n; i++) {
        seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        x[i] = side * (double)(seed >> 11) * 0x1p-53;
    }
}

enum { POINTS = 1500 };
static double places[2 * POINTS];

/* Points without cores; place k of the arrays holds number order(k). */
static struct gbg_engine *points(double tolerance, const char *backend, int reversed,
                                 struct gbg_context **own)
{
    static double x[2 * POINTS];
    static int32_t species[POINTS];
    static int64_t ids[POINTS];
    struct gbg_scene *scene;
    struct gbg_engine *engine;
    DONE(gbg_context_create(backend, own));
    gbg_context_set_log(*own, note, NULL);
    DONE(gbg_scene_create(*own, 2, &scene));
    DONE(gbg_scene_set_box(scene, (double[]){40.0, 30.0}, NULL));
    DONE(gbg_scene_add_species(scene, "A", 0.0, 1.0, 1.0, -1, -1, NULL));
    DONE(gbg_scene_add_species(scene, "B", 0.0, -1.0, -2.0, -1, -1, NULL));
    DONE(gbg_scene_add_force(scene, 2.0, NULL, 0.0, tolerance));
    DONE(gbg_scene_set_real(scene, "dynamics.dt", 1e-9));
    DONE(gbg_scene_set_real(scene, "dynamics.temperature", 0.01));
    for (int k = 0; k < POINTS; k++) {
        int i = reversed ? POINTS - 1 - k : k;
        x[2 * k] = places[2 * i];
        x[2 * k + 1] = places[2 * i + 1];
        species[k] = i % 2;
        ids[k] = i;
    }
    DONE(gbg_scene_add_particles(scene, POINTS, x, x + 1, NULL, 2, species, 0, ids));
    int status = gbg_engine_create(scene, &engine);
    if (status != GBG_OK) {
        fail_msg("%s", gbg_message(*own));
    }
    gbg_scene_destroy(&scene);
    return engine;
}

static void drop(struct gbg_engine **engine, struct gbg_context **own)
{
    gbg_engine_destroy(engine);
    gbg_context_destroy(own);
}

static void threads_and_order_do_not_show(void **state)
{
    (void)state;
    static const char *const backends[] = {"cpu:threads=1", "cpu:threads=2", "cpu:threads=3",
                                           "cpu:threads=2", "poison:threads=2"};
    char first[65], hash[65];
    need_transforms();
    for (int wide = 0; wide < 2; wide++) { /* single precision, then double */
        for (int k = 0; k < 5; k++) {
            struct gbg_context *own;
            scatter(POINTS, 30.0, 1, places);
            struct gbg_engine *engine = points(wide ? 1e-8 : 1e-3, backends[k], k == 3, &own);
            assert_int_equal(gbg_engine_run(engine, 12), GBG_OK);
            assert_int_equal(gbg_engine_hash(engine, 65, k ? hash : first), GBG_OK);
            if (k > 0) {
                assert_string_equal(hash, first);
            }
            drop(&engine, &own);
        }
    }
}

/* Nearly a square lattice: forces all but cancel. */
static void order_points(double amplitude)
{
    scatter(POINTS, 1.0, 2, places);
    for (int i = 0; i < POINTS; i++) {
        places[2 * i] = 40.0 / 50 * (i % 50 + amplitude * (places[2 * i] - 0.5));
        places[2 * i + 1] = 30.0 / 30 * (i / 50 + amplitude * (places[2 * i + 1] - 0.5));
    }
}

/* Every other one of them in a quarter of the box. */
static void gather_points(void)
{
    order_points(0.3);
    for (int i = 0; i < POINTS; i += 2) {
        places[2 * i] *= 0.5;
        places[2 * i + 1] = 0.5 * places[2 * i + 1] + 0.3;
    }
}

static void refinement(struct gbg_engine *engine, const char *what, double tolerance, int *refined)
{
    double measured, now;
    assert_int_equal(gbg_engine_get_sum(engine, 0, NULL, NULL, &measured, refined), GBG_OK);
    assert_int_equal(gbg_engine_force_error(engine, POINTS, &now, NULL), GBG_OK);
    printf("%s: measured %.1e, now %.1e, tolerance %.0e, refined %d\n", what, measured, now,
           tolerance, *refined);
    assert_true(measured >= 0.0 && measured <= tolerance);
    assert_true(now <= 1.2 * tolerance);
}

/* Forces that become weak, and particles that gather: both are seen within 100 steps. */
static void what_changes_is_measured_anew(void **state)
{
    (void)state;
    struct gbg_context *own;
    int before, after;
    need_transforms();
    scatter(POINTS, 30.0, 3, places);
    struct gbg_engine *engine = points(1e-3, "cpu:threads=2", 0, &own);
    assert_int_equal(gbg_engine_run(engine, 20), GBG_OK);
    refinement(engine, "random points", 1e-3, &before);
    order_points(0.15);
    assert_int_equal(gbg_engine_set_positions(engine, POINTS, places, places + 1, NULL, 2), GBG_OK);
    assert_int_equal(gbg_engine_run(engine, 81), GBG_OK);
    refinement(engine, "nearly a lattice", 1e-3, &after);
    assert_non_null(strstr(logged, "step 64: the RMS force has gone from"));
    assert_true(after > before);
    logged[0] = 0;
    gather_points();
    assert_int_equal(gbg_engine_set_positions(engine, POINTS, places, places + 1, NULL, 2), GBG_OK);
    assert_int_equal(gbg_engine_run(engine, 101), GBG_OK);
    refinement(engine, "gathered", 1e-3, &after);
    assert_non_null(strstr(logged, "step 200: the densest place in means has gone from"));
    drop(&engine, &own);
}

/* A run over a refinement, and the same with a restart behind it: the same bits. */
static void restarts_keep_what_was_refined(void **state)
{
    (void)state;
    struct gbg_context *own;
    char path[64], whole[65], broken[65];
    int refined[2];
    need_transforms();
    snprintf(path, sizeof path, "/tmp/gbg_longrange_%ld.rst", (long)getpid());
    for (int k = 0; k < 2; k++) {
        scatter(POINTS, 30.0, 3, places);
        struct gbg_engine *engine = points(1e-3, "cpu:threads=2", 0, &own);
        assert_int_equal(gbg_engine_run(engine, 20), GBG_OK);
        order_points(0.15);
        assert_int_equal(gbg_engine_set_positions(engine, POINTS, places, places + 1, NULL, 2),
                         GBG_OK);
        assert_int_equal(gbg_engine_run(engine, 100), GBG_OK);
        if (k == 1) {
            assert_int_equal(gbg_engine_save(engine, path), GBG_OK);
            drop(&engine, &own);
            scatter(POINTS, 30.0, 9, places); /* another start, which needs nothing finer */
            engine = points(1e-3, "cpu:threads=1", 0, &own);
            assert_int_equal(gbg_engine_forces(engine, POINTS, places, places + 1, NULL, 2),
                             GBG_OK);
            assert_int_equal(gbg_engine_load(engine, path), GBG_OK);
        }
        assert_int_equal(gbg_engine_run(engine, 90), GBG_OK);
        assert_int_equal(gbg_engine_get_sum(engine, 0, NULL, NULL, NULL, &refined[k]), GBG_OK);
        assert_int_equal(gbg_engine_hash(engine, 65, k ? broken : whole), GBG_OK);
        drop(&engine, &own);
    }
    unlink(path);
    assert_true(refined[0] > 0);
    assert_int_equal(refined[0], refined[1]);
    assert_string_equal(whole, broken);
}

/* A scene of points by hand. */
static struct gbg_scene *plain(const double *lengths, int64_t n, const double *x, double tolerance)
{
    struct gbg_scene *scene;
    DONE(gbg_scene_create(context, 2, &scene));
    DONE(gbg_scene_set_box(scene, lengths, NULL));
    DONE(gbg_scene_add_species(scene, "A", 0.0, 2.0, 1.5, -1, -1, NULL));
    DONE(gbg_scene_add_force(scene, 2.0, "lattice", 0.0, tolerance));
    if (n > 0) {
        DONE(gbg_scene_add_particles(scene, n, x, x + 1, NULL, 2, NULL, 0, NULL));
    }
    DONE(gbg_scene_set_real(scene, "dynamics.dt", 1e-9));
    return scene;
}

/* Few particles and long boxes; `size`: what forces are to be small or right against. */
static void few(const char *what, const double *lengths, int64_t n, const double *x, double *f)
{
    struct gbg_scene *scene = plain(lengths, n, x, 1e-4);
    struct gbg_engine *engine;
    double rms, measured;
    DONE(gbg_engine_create(scene, &engine));
    DONE(gbg_engine_forces(engine, n, f, f + 1, NULL, 2));
    DONE(gbg_engine_get_sum(engine, 0, NULL, NULL, &measured, NULL));
    DONE(gbg_engine_force_error(engine, 0, &rms, NULL));
    printf("%s: measured %.1e, relative error %.1e\n", what, measured, rms);
    assert_true(measured <= 1e-4);
    DONE(gbg_engine_run(engine, 3));
    gbg_engine_destroy(&engine);
    gbg_scene_destroy(&scene);
}

static void few_particles_and_long_boxes(void **state)
{
    (void)state;
    const double square[2] = {10.0, 10.0}, strip[2] = {500.0, 5.0};
    static double x[4000], f[4000];
    need_transforms();
    few("one particle", square, 1, (double[]){3.0, 9.9}, f);
    /* its images pull from all sides alike */
    assert_true(hypot(f[0], f[1]) < 1e-4 * 3.0 / 100.0);
    few("two particles", square, 2, (double[]){3.0, 9.9, 3.5, 0.2}, f);
    assert_true(fabs(f[0] + f[2]) + fabs(f[1] + f[3]) < 1e-5 * hypot(f[0], f[1]));
    assert_true(fabs(hypot(f[0], f[1]) / (3.0 / 0.34) - 1.0) < 0.01); /* alpha mobility/r^2 */
    scatter(2000, 1.0, 5, x);
    for (int i = 0; i < 2000; i++) {
        x[2 * i] *= strip[0];
        x[2 * i + 1] *= strip[1];
    }
    few("100:1", strip, 2000, x, f);
    for (int i = 0; i < 300; i++) {
        x[2 * i] = square[0] * (i + 0.3 * sin(3.0 * i)) / 300.0;
        x[2 * i + 1] = 5.0;
    }
    few("on a line", square, 300, x, f);
}

static void no_particles(void **state)
{
    (void)state;
    const double square[2] = {10.0, 10.0};
    struct gbg_scene *scene = plain(square, 0, NULL, 1e-4);
    struct gbg_engine *engine;
    double rms, median;
    need_transforms();
    DONE(gbg_scene_set_text(scene, "particles.start.random", "insertion"));
    DONE(gbg_scene_set_integer(scene, "particles.count", 0));
    gbg_scene_destroy(&scene);
    DONE(gbg_scene_create(context, 2, &scene));
    DONE(gbg_scene_set_box(scene, square, NULL));
    DONE(gbg_scene_add_species(scene, "A", 0.0, 2.0, 1.5, -1, 0, NULL));
    DONE(gbg_scene_add_force(scene, 2.0, "lattice", 0.0, 1e-4));
    DONE(gbg_scene_set_real(scene, "dynamics.dt", 0.001));
    DONE(gbg_engine_create(scene, &engine));
    DONE(gbg_engine_run(engine, 3));
    DONE(gbg_engine_force_error(engine, 0, &rms, &median));
    gbg_engine_destroy(&engine);
    gbg_scene_destroy(&scene);
}

/* Two laws at once, each with its own sum; beside them one that is cut off. */
static void sums_add_up(void **state)
{
    (void)state;
    struct gbg_scene *scene = suspension(1, 512, 1e-5);
    struct gbg_engine *engine;
    double tolerance, measured, rms, median;
    need_transforms();
    DONE(gbg_scene_add_force(scene, 6.0, "cutoff", 2.5, 0.0));
    DONE(gbg_scene_add_force(scene, 3.0, "lattice", 0.0, 1e-6));
    DONE(gbg_scene_set_force(scene, 2, "split", "gaussian"));
    DONE(gbg_scene_set_force(scene, 2, "gradient", "window"));
    DONE(gbg_engine_create(scene, &engine));
    DONE(gbg_engine_run(engine, 5));
    for (int f = 0; f < 3; f += 2) {
        DONE(gbg_engine_get_sum(engine, f, &tolerance, NULL, &measured, NULL));
        printf("forces[%d]: tolerance %.0e, measured %.1e\n", f, tolerance, measured);
        assert_true(measured >= 0.0 && measured <= tolerance);
    }
    REFUSED(gbg_engine_get_sum(engine, 1, NULL, NULL, NULL, NULL), GBG_E_ARGUMENT,
            "force 1 has another sum than lattice");
    DONE(gbg_engine_force_error(engine, 0, &rms, &median));
    assert_true(rms < 1.5e-5);
    gbg_engine_destroy(&engine);
    gbg_scene_destroy(&scene);
}

static void what_cannot_be_reached_is_refused(void **state)
{
    (void)state;
    struct gbg_scene *scene = suspension(1, 512, 1e-15);
    struct gbg_engine *engine;
    need_transforms();
    REFUSED(gbg_engine_create(scene, &engine), GBG_E_SCENE,
            "forces[0].tolerance: 1e-15 given; the finest that a sum over all images reaches here "
            "is ");
    assert_null(engine);
    gbg_scene_destroy(&scene);
}

static void checks_can_be_left_out(void **state)
{
    (void)state;
    struct gbg_scene *scene = suspension(1, 512, 1e-4);
    struct gbg_engine *engine;
    double measured;
    need_transforms();
    DONE(gbg_scene_set_force(scene, 0, "check", "false"));
    DONE(gbg_engine_create(scene, &engine));
    DONE(gbg_engine_run(engine, 3));
    DONE(gbg_engine_get_sum(engine, 0, NULL, NULL, &measured, NULL));
    assert_true(measured == -1.0);
    gbg_engine_destroy(&engine);
    gbg_scene_destroy(&scene);
}

/* A build without transforms names what is missing. */
static void without_transforms(void **state)
{
    (void)state;
    struct gbg_scene *scene = suspension(1, 512, 1e-4);
    struct gbg_engine *engine;
    if (no_transforms) {
        REFUSED(gbg_engine_create(scene, &engine), GBG_E_UNBUILT, "forces[0].sum: lattice: ");
        assert_non_null(strstr(gbg_message(context), "fft"));
    }
    gbg_scene_destroy(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whole_steps_keep_to_their_tolerance),
        cmocka_unit_test(threads_and_order_do_not_show),
        cmocka_unit_test(what_changes_is_measured_anew),
        cmocka_unit_test(restarts_keep_what_was_refined),
        cmocka_unit_test(few_particles_and_long_boxes),
        cmocka_unit_test(no_particles),
        cmocka_unit_test(sums_add_up),
        cmocka_unit_test(what_cannot_be_reached_is_refused),
        cmocka_unit_test(checks_can_be_left_out),
        cmocka_unit_test(without_transforms),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
