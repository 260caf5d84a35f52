/* Tests of hard cores: no overlap after any step, refusals, momentum, coincident particles. */
#include "made_scene.h"

static void no_overlap_after_any_step(void **state)
{
    (void)state;
    static struct made_particles made;
    struct gbg_context *context = made_context("cpu:threads=2");
    for (int rule = 0; rule < 2; rule++) {
        double square[2] = {30.0 * 1.06, 30.0 * 1.06}, cube[3] = {8.8, 9.0, 9.2};
        struct gbg_scene flat = made_scene(context, 2, square), deep = made_scene(context, 3, cube);
        flat.rule = deep.rule = rule ? GBG_RULE_CONTACT : GBG_RULE_BOUNCE;
        made_lattice(&made, &flat, 30, 0.01);
        struct gbg_engine *engine = made_engine(&flat, &made);
        run_without_overlap(engine, 30, "2D");
        assert_true(engine->contact_rounds > 0);
        print_message("2D rule %d: %.2f rounds a step\n", rule,
                      (double)engine->contact_rounds / 30.0);
        gbg_engine_free(engine);
        made_lattice(&made, &deep, 8, 0.01);
        engine = made_engine(&deep, &made);
        run_without_overlap(engine, 30, "3D");
        gbg_engine_free(engine);
    }
    gbg_context_destroy(&context);
}

static void unequal_diameters(void **state)
{
    (void)state;
    static struct made_particles made;
    struct gbg_context *context = made_context("cpu");
    double length[2] = {40.0, 40.0};
    for (int k = 0; k < 2; k++) {
        struct gbg_scene scene = made_scene(context, 2, length);
        scene.rule = k ? GBG_RULE_BRIDGE : GBG_RULE_BOUNCE;
        scene.species[0].diameter = 0.1; /* 1 : 20 */
        scene.species[1].diameter = 2.0;
        scene.temperature = 0.05;
        made_lattice(&made, &scene, 18, 0.01);
        struct gbg_engine *engine = made_engine(&scene, &made);
        run_without_overlap(engine, 80, k ? "bridge" : "bounce");
        gbg_engine_free(engine);
    }
    gbg_context_destroy(&context);
}

static void overlapping_and_coincident_starts_are_refused(void **state)
{
    (void)state;
    static struct made_particles made;
    struct gbg_context *context = made_context("cpu");
    double length[2] = {20.0, 20.0};
    struct gbg_scene scene = made_scene(context, 2, length);
    made_lattice(&made, &scene, 10, 0.0);
    made.store[0][57] = made.store[0][56];
    made.store[1][57] = made.store[1][56];
    struct gbg_engine *engine = NULL;
    assert_int_equal(gbg_engine_make(&scene, &made.p, &engine), GBG_E_OVERLAP);
    assert_non_null(strstr(gbg_message(context), "particles 56 and 57 coincide"));
    made.store[0][57] += 1.0 - 1e-6;
    assert_int_equal(gbg_engine_make(&scene, &made.p, &engine), GBG_E_OVERLAP);
    assert_non_null(strstr(gbg_message(context), "56 and 57 overlap"));
    made.store[0][57] = made.store[0][56] + 1.0 + 1e-15; /* touching to rounding is accepted */
    assert_int_equal(gbg_engine_make(&scene, &made.p, &engine), GBG_OK);
    gbg_engine_free(engine);
    gbg_context_destroy(&context);
}

/* A step so large that particles would jump over each other is refused, and nothing has changed. */
static void too_large_steps_are_refused(void **state)
{
    (void)state;
    static struct made_particles made;
    struct gbg_context *context = made_context("cpu");
    double length[2] = {24.0, 24.0};
    struct gbg_scene scene = made_scene(context, 2, length);
    scene.dt = 400.0; /* noise of 2 sigma a step */
    made_lattice(&made, &scene, 20, 0.01);
    struct gbg_engine *engine = made_engine(&scene, &made);
    char before[65], after[65];
    assert_int_equal(gbg_engine_digest(engine, before), GBG_OK);
    assert_int_equal(gbg_engine_advance(engine, 5), GBG_E_STEP);
    print_message("%s\n", gbg_message(context));
    assert_non_null(strstr(gbg_message(context), "largest dt estimated"));
    assert_int_equal(gbg_engine_digest(engine, after), GBG_OK);
    assert_string_equal(before, after);
    gbg_engine_free(engine);

    scene.rule = GBG_RULE_NONE; /* ideal gas: only moves beyond half the box are refused */
    scene.dt = 1e6;
    engine = made_engine(&scene, &made);
    assert_int_equal(gbg_engine_digest(engine, before), GBG_OK);
    assert_int_equal(gbg_engine_advance(engine, 1), GBG_E_STEP);
    assert_int_equal(gbg_engine_digest(engine, after), GBG_OK);
    assert_string_equal(before, after);
    gbg_engine_free(engine);
    gbg_context_destroy(&context);
}

/* Pushes of a pair are opposite to the last bit: the sum of all fractions moves by the free moves
 * alone, which a run without hard cores makes too. */
static void contacts_conserve_the_centre(void **state)
{
    (void)state;
    static struct made_particles made;
    static uint64_t fraction[5000];
    static const int rules[3] = {GBG_RULE_NONE, GBG_RULE_BOUNCE, GBG_RULE_BRIDGE};
    struct gbg_context *context = made_context("cpu:threads=2");
    double length[2] = {31.0, 31.0};
    uint64_t sums[3] = {0, 0, 0};
    for (int k = 0; k < 3; k++) {
        struct gbg_scene scene = made_scene(context, 2, length);
        scene.rule = rules[k];
        made_lattice(&made, &scene, 30, 0.01);
        struct gbg_engine *engine = made_engine(&scene, &made);
        assert_int_equal(gbg_engine_advance(engine, 20), GBG_OK);
        assert_true(k == 0 || engine->contact_pairs > 100);
        assert_int_equal(gbg_engine_copy_fractions(engine, 0, fraction), GBG_OK);
        for (int64_t i = 0; i < made.p.n; i++) {
            sums[k] += fraction[i];
        }
        gbg_engine_free(engine);
    }
    assert_true(sums[1] == sums[0] && sums[2] == sums[0]);
    gbg_context_destroy(&context);
}

static void set_place(struct gbg_engine *engine, int64_t i, double x, double y)
{
    const double r[2] = {x, y};
    for (int a = 0; a < 2; a++) {
        uint64_t fraction = gbg_box_encode(&engine->state.box, a, r[a], NULL);
        engine->state.high[a][i] = (uint32_t)(fraction >> 32);
        engine->state.low[a][i] = (uint32_t)fraction;
    }
}

/* After a step in which 0 and 1 changed places, 3 moved onto the old place of 1, and 4 away: the
 * pair goes back, then 3, which overlaps what was put back, and nobody else. */
static void rolling_back(void **state)
{
    (void)state;
    static struct made_particles made;
    struct gbg_context *context = made_context("cpu");
    double length[2] = {20.0, 20.0};
    struct gbg_scene scene = made_scene(context, 2, length);
    made_lattice(&made, &scene, 10, 0.0);
    made.p.n = 5;
    static const double start[5][2] = {{0, 0}, {1.1, 0}, {5, 5}, {2.3, 0}, {3.6, 0}};
    for (int i = 0; i < 5; i++) {
        made.store[0][i] = start[i][0];
        made.store[1][i] = start[i][1];
    }
    struct gbg_engine *engine = made_engine(&scene, &made);
    assert_int_equal(engine->kernels->keep(engine->device, &engine->state), GBG_OK);
    set_place(engine, 0, 1.4, 0.9);
    set_place(engine, 1, -0.2, -0.9);
    set_place(engine, 3, 1.9, -0.3);
    set_place(engine, 4, 3.6, 1.0);
    int64_t reverted = 0;
    assert_int_equal(
        engine->kernels->roll_back(engine->device, &engine->state, 1e-12, 1, &reverted), GBG_OK);
    assert_int_equal(reverted, 3);
    static const double end[5][2] = {{0, 0}, {1.1, 0}, {5, 5}, {2.3, 0}, {3.6, 1.0}};
    double r[2][5];
    for (int a = 0; a < 2; a++) {
        assert_int_equal(gbg_engine_decode(engine, 1, a, r[a], 1), GBG_OK);
        for (int i = 0; i < 5; i++) {
            assert_true(fabs(r[a][i] - end[i][a]) < 1e-12);
        }
    }
    assert_true(naive_closest(engine) >= 1.0 - 1e-12);
    gbg_engine_free(engine);
    gbg_context_destroy(&context);
}

static void small_systems(void **state)
{
    (void)state;
    static struct made_particles made;
    struct gbg_context *context = made_context("cpu:threads=2");
    double length[2] = {4.0, 4.0};
    for (int64_t n = 0; n <= 3; n++) {
        struct gbg_scene scene = made_scene(context, 2, length);
        made_lattice(&made, &scene, 3, 0.0);
        made.p.n = n;
        struct gbg_engine *engine = made_engine(&scene, &made);
        assert_int_equal(gbg_engine_advance(engine, 200), GBG_OK);
        assert_int_equal(engine->step, 200);
        assert_true(naive_closest(engine) >= 1.0 - 1e-12);
        gbg_engine_free(engine);
    }
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_overlap_after_any_step),
        cmocka_unit_test(unequal_diameters),
        cmocka_unit_test(overlapping_and_coincident_starts_are_refused),
        cmocka_unit_test(too_large_steps_are_refused),
        cmocka_unit_test(contacts_conserve_the_centre),
        cmocka_unit_test(rolling_back),
        cmocka_unit_test(small_systems),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
