/* Hard cases of excluded volume: dense and active, clustered, all in one cell, across the edge of
 * the box, coincident after an upload. */
#include "made_scene.h"

static struct gbg_scene *new_scene(struct gbg_context *context, int dimension)
{
    struct gbg_scene *scene;
    assert_int_equal(gbg_scene_create(context, dimension, &scene), GBG_OK);
    gbg_scene_set_text(scene, "excluded_volume.rule", "bounce");
    gbg_scene_set_real(scene, "dynamics.dt", 0.01);
    gbg_scene_set_real(scene, "dynamics.temperature", 0.01);
    return scene;
}

static struct gbg_engine *engine_of(struct gbg_scene *scene)
{
    struct gbg_engine *engine = NULL;
    if (gbg_engine_create(scene, &engine) != GBG_OK) {
        fail_msg("%s", gbg_message(scene->context));
    }
    return engine;
}

static void run_clean(struct gbg_engine *engine, int steps, const char *what)
{
    int64_t left;
    for (int k = 0; k < steps; k++) {
        if (gbg_engine_run(engine, 1) != GBG_OK) {
            fail_msg("%s: %s", what, gbg_message(engine->context));
        }
        assert_int_equal(gbg_engine_integer(engine, "overlaps_left", &left), GBG_OK);
        assert_int_equal(left, 0); /* by other code than the certificate's */
    }
    print_message("%s: %.1f rounds a step, %lld moves put back of %lld\n", what,
                  (double)engine->contact_rounds / steps, (long long)engine->reverted,
                  (long long)(engine->state.owned * steps));
}

/* Area fraction 0.88, forces of C3: likes attract, unlikes repel. */
static void dense_and_active(void **state)
{
    (void)state;
    static const char *const rules[] = {"bounce", "contact", "bridge", "event"};
    static const int steps[] = {6, 6, 300,
                                60}; /* bounce and contact take a second attempt a step */
    for (int k = 0; k < 4; k++) {
        struct gbg_context *context = made_context("cpu:threads=1");
        struct gbg_scene *scene = new_scene(context, 2);
        int index;
        gbg_scene_add_species(scene, "A", 1.0, -1.0, 1.0, 0.5, -1, &index);
        gbg_scene_add_species(scene, "B", 1.0, 1.0, -2.0, 0.5, -1, &index);
        gbg_scene_set_integer(scene, "particles.count", 400);
        gbg_scene_set_real(scene, "box.packing", 0.88);
        gbg_scene_set_text(scene, "box.shape", "lattice");
        gbg_scene_set_text(scene, "particles.start.lattice", "triangular");
        gbg_scene_set_real(scene, "particles.start.jitter", 0.5);
        gbg_scene_add_force(scene, 6.0, "cutoff", 2.5, 0.0);
        gbg_scene_set_text(scene, "excluded_volume.rule", rules[k]);
        struct gbg_engine *engine = NULL;
        int status = gbg_engine_create(scene, &engine);
        if (status == GBG_E_UNBUILT) {
            print_message("rule %s is not in this build\n", rules[k]);
        } else {
            assert_int_equal(status, GBG_OK);
            char what[64];
            snprintf(what, sizeof what, "packing 0.88, active, %s", rules[k]);
            run_clean(engine, steps[k], what);
            assert_true(gbg_engine_reverted_fraction(engine) <= 1e-6);
        }
        gbg_engine_destroy(&engine);
        gbg_scene_destroy(&scene);
        gbg_context_destroy(&context);
    }
}

/* m by m discs in a triangular lattice in which neighbours touch, in an empty box. */
static void cluster(int64_t m, double edge, int steps, const char *what)
{
    struct gbg_context *context = made_context("cpu:threads=1");
    struct gbg_scene *scene = new_scene(context, 2);
    double lengths[2] = {edge, edge}, *x = malloc((size_t)(2 * m * m) * sizeof *x);
    assert_non_null(x);
    for (int64_t i = 0; i < m * m; i++) {
        x[2 * i] = edge / 2 + (1.0 + 1e-9) * ((double)(i % m) + 0.5 * (double)(i / m % 2));
        x[2 * i + 1] = edge / 2 + (1.0 + 1e-9) * sqrt(0.75) * (double)(i / m);
    }
    int index;
    gbg_scene_add_species(scene, "A", 1.0, 0.0, 1.0, -1.0, -1, &index);
    assert_int_equal(gbg_scene_set_box(scene, lengths, NULL), GBG_OK);
    assert_int_equal(gbg_scene_add_particles(scene, m * m, x, x + 1, NULL, 2, NULL, 0, NULL),
                     GBG_OK);
    struct gbg_engine *engine = engine_of(scene);
    run_clean(engine, steps, what);
    gbg_engine_destroy(&engine);
    gbg_scene_destroy(&scene);
    gbg_context_destroy(&context);
    free(x);
}

static void clusters(void **state)
{
    (void)state;
    cluster(100, 1000.0, 3, "close-packed cluster of 1e4");
    cluster(20, 1e6, 10, "400 discs in one cell of an empty box");
}

/* A wall of touching discs over the edge of the box, closed around it, between crowded sides. */
static void wall_across_the_edge(void **state)
{
    (void)state;
    static struct made_particles made;
    struct gbg_context *context = made_context("cpu:threads=2");
    double length[2] = {20.0, 20.0};
    struct gbg_scene scene = made_scene(context, 2, length);
    made_lattice(&made, &scene, 18, 0.0);
    int64_t n = 0;
    for (int64_t i = 0; i < 18 * 18; i++) { /* leave a lane of 2 around the lower edge */
        double x = made.store[0][i] - scene.origin[0];
        if (x > 1.3 && x < 18.7) {
            made.store[0][n] = made.store[0][i];
            made.store[1][n++] = made.store[1][i];
        }
    }
    for (int64_t k = 0; k < 20; k++) {
        made.store[0][n] = scene.origin[0] + (k % 2 ? 1e-12 : -1e-12);
        made.store[1][n++] = scene.origin[1] + (double)k;
    }
    made.p.n = n;
    struct gbg_engine *engine = made_engine(&scene, &made);
    run_clean(engine, 100, "wall across the edge");
    assert_true(naive_closest(engine) >= 1.0 - 1e-12);
    gbg_engine_free(engine);
    gbg_context_destroy(&context);
}

static void coincident_after_an_upload(void **state)
{
    (void)state;
    static struct made_particles made;
    struct gbg_context *context = made_context("cpu:threads=2");
    double length[2] = {20.0, 20.0};
    struct gbg_scene scene = made_scene(context, 2, length);
    made_lattice(&made, &scene, 10, 0.0);
    char before[65], after[65];
    for (int k = 0; k < 2; k++) {
        scene.separate = k ? GBG_OVERLAPPING_RELAX : GBG_OVERLAPPING_REFUSE;
        made.store[0][56] = made.store[0][55] + 2.0;
        struct gbg_engine *engine = made_engine(&scene, &made);
        run_clean(engine, 5, "before an upload");
        assert_int_equal(gbg_engine_digest(engine, before), GBG_OK);
        made.store[0][56] = made.store[0][57];
        int status = gbg_engine_set_positions(engine, 100, made.store[0], made.store[1], NULL, 1);
        assert_int_equal(status, k ? GBG_OK : GBG_E_OVERLAP);
        assert_int_equal(gbg_engine_digest(engine, after), GBG_OK);
        assert_int_equal(strcmp(before, after) == 0, !k);
        assert_true(k || strstr(gbg_message(context), "particles 56 and 57 coincide"));
        assert_true(naive_closest(engine) >= 1.0 - 1e-12);
        run_clean(engine, 5, "after an upload");
        gbg_engine_free(engine);
    }
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(dense_and_active),
        cmocka_unit_test(clusters),
        cmocka_unit_test(wall_across_the_edge),
        cmocka_unit_test(coincident_after_an_upload),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
