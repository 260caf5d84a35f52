/* Tests of excluded_volume.start: relax: overlapping starts are parted, the same way on any number
 * of threads, or refused with a sentence that says how far it came. */
#include "made_scene.h"

static struct gbg_scene *random_scene(struct gbg_context *context, int dimension, double packing,
                                      int64_t n, double smaller, double share)
{
    struct gbg_scene *scene;
    int index;
    assert_int_equal(gbg_scene_create(context, dimension, &scene), GBG_OK);
    gbg_scene_add_species(scene, "A", 1.0, 0.0, 1.0, 1.0 - share, -1, &index);
    gbg_scene_add_species(scene, "B", smaller, 0.0, 1.0, share, -1, &index);
    gbg_scene_set_real(scene, "box.packing", packing);
    gbg_scene_set_integer(scene, "particles.count", n);
    gbg_scene_set_text(scene, "particles.start.random", "uniform");
    gbg_scene_set_text(scene, "excluded_volume.rule", "bounce");
    gbg_scene_set_real(scene, "dynamics.dt", 0.01);
    gbg_scene_set_real(scene, "dynamics.temperature", 0.01);
    return scene;
}

static void relaxed(int dimension, double packing, int64_t n, double smaller, double share)
{
    char expected[65] = "", text[65];
    for (int k = 0; k < 2; k++) {
        struct gbg_context *context = made_context(k ? "cpu:threads=3" : "cpu:threads=1");
        struct gbg_scene *scene = random_scene(context, dimension, packing, n, smaller, share);
        struct gbg_engine *engine = NULL;
        assert_int_equal(gbg_engine_create(scene, &engine), GBG_E_OVERLAP); /* refused so far */
        assert_int_equal(gbg_scene_set_text(scene, "excluded_volume.start", "relax"), GBG_OK);
        if (gbg_engine_create(scene, &engine) != GBG_OK) {
            fail_msg("%s", gbg_message(context));
        }
        assert_true(naive_closest(engine) >= 1.0 - 1e-12);
        assert_int_equal(gbg_engine_digest(engine, text), GBG_OK);
        if (k == 0) {
            strcpy(expected, text);
        }
        assert_string_equal(text, expected);
        assert_int_equal(gbg_engine_advance(engine, 20), GBG_OK);
        assert_true(naive_closest(engine) >= 1.0 - 1e-12);
        gbg_engine_free(engine);
        gbg_scene_destroy(&scene);
        gbg_context_destroy(&context);
    }
    print_message("%dD, packing %g, %lld particles, diameters 1 and %g: relaxed\n", dimension,
                  packing, (long long)n, smaller);
}

static void random_points_are_parted(void **state)
{
    (void)state;
    relaxed(2, 0.3, 1000, 0.7, 0.5);
    relaxed(2, 0.79, 1000, 1.0, 0.5);
    relaxed(2, 0.84, 250, 1.0, 0.5);
    relaxed(2, 0.7, 250, 0.05, 0.8); /* 1 : 20 */
    relaxed(3, 0.5, 1000, 1.0, 0.5);
    relaxed(3, 0.6, 1000, 0.8, 0.5);
}

/* Three in one place, two overlapping deeply, the rest apart: those keep every bit. */
static void coincident_particles(void **state)
{
    (void)state;
    static struct made_particles made;
    struct gbg_context *context = made_context("cpu:threads=2");
    double length[2] = {20.0, 20.0};
    struct gbg_scene scene = made_scene(context, 2, length);
    made_lattice(&made, &scene, 10, 0.0);
    for (int a = 0; a < 2; a++) {
        made.store[a][56] = made.store[a][57] = made.store[a][58];
        made.store[a][11] = made.store[a][12] + (a ? 1e-13 : 0.0);
    }
    struct gbg_engine *engine = NULL;
    assert_int_equal(gbg_engine_make(&scene, &made.p, &engine), GBG_E_OVERLAP);
    assert_non_null(strstr(gbg_message(context), "11 and 12 overlap"));
    scene.separate = GBG_OVERLAPPING_RELAX;
    engine = made_engine(&scene, &made);
    assert_true(naive_closest(engine) >= 1.0 - 1e-12);
    static double x[5000];
    assert_int_equal(gbg_engine_decode(engine, 1, 0, x, 1), GBG_OK);
    int64_t moved = 0;
    for (int64_t i = 0; i < made.p.n; i++) {
        double d = x[i] - made.store[0][i];
        d -= length[0] * rint(d / length[0]);
        moved += fabs(d) > 1e-12;
    }
    assert_true(moved >= 4 && moved < 15);
    gbg_engine_free(engine);
    gbg_context_destroy(&context);
}

/* Positions given to a running engine are relaxed too, and where that fails all is as before. */
static void new_positions(void **state)
{
    (void)state;
    static double x[400], y[400];
    struct gbg_context *context = made_context("cpu:threads=2");
    struct gbg_scene *scene = random_scene(context, 2, 0.6, 400, 1.0, 0.5);
    struct gbg_engine *engine = NULL;
    char before[65], after[65];
    gbg_scene_set_text(scene, "excluded_volume.start", "relax");
    gbg_scene_set_integer(scene, "output.trajectory.unwrapped", 1);
    assert_int_equal(gbg_engine_create(scene, &engine), GBG_OK);
    assert_int_equal(gbg_engine_digest(engine, before), GBG_OK);
    double edge = engine->state.box.length[0];
    for (int i = 0; i < 400; i++) {
        x[i] = edge * made_uniform((uint64_t)i);
        y[i] = edge * made_uniform((uint64_t)(1000 + i));
    }
    assert_int_equal(gbg_engine_set_positions(engine, 400, x, y, NULL, 1), GBG_OK);
    assert_true(naive_closest(engine) >= 1.0 - 1e-12);
    assert_int_equal(gbg_engine_digest(engine, after), GBG_OK);
    assert_string_not_equal(before, after);
    assert_int_equal(gbg_engine_set_positions(engine, 400, x, x, NULL, 1), GBG_OK); /* a line */
    assert_true(naive_closest(engine) >= 1.0 - 1e-12);
    gbg_engine_free(engine);
    gbg_scene_destroy(&scene);
    gbg_context_destroy(&context);
}

static void what_cannot_be_parted_is_refused(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu:threads=2");
    struct gbg_engine *engine = NULL;
    for (int dimension = 2; dimension <= 3; dimension++) { /* denser than close packing */
        struct gbg_scene *scene =
            random_scene(context, dimension, dimension == 2 ? 0.91 : 0.75, 100, 1.0, 0.5);
        gbg_scene_set_text(scene, "excluded_volume.start", "relax");
        assert_int_equal(gbg_engine_create(scene, &engine), GBG_E_SCENE);
        assert_non_null(strstr(gbg_message(context), "at most 0."));
        gbg_scene_destroy(&scene);
    }
    /* below it, but no arrangement of 7 discs in this box is so dense */
    struct gbg_scene *scene = random_scene(context, 2, 0.9, 7, 1.0, 0.5);
    gbg_scene_set_text(scene, "excluded_volume.start", "relax");
    assert_int_equal(gbg_engine_create(scene, &engine), GBG_E_OVERLAP);
    print_message("%s\n", gbg_message(context));
    assert_non_null(strstr(gbg_message(context), "excluded_volume.start: relax"));
    assert_non_null(strstr(gbg_message(context), "of their diameters"));
    gbg_scene_destroy(&scene);
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_points_are_parted),
        cmocka_unit_test(coincident_particles),
        cmocka_unit_test(new_positions),
        cmocka_unit_test(what_cannot_be_parted_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
