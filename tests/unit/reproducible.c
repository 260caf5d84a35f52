/* Tests of the promise: the same bits for any thread count, order of input and age of the lists. */
#include "made_scene.h"

/* A scene with a cut-off force and hard cores. */
static struct gbg_scene active(struct gbg_context *context, int dimension)
{
    double length[3] = {26.0, 24.0, 23.0};
    if (dimension == 3) {
        length[0] = 9.5, length[1] = 9.0, length[2] = 9.25;
    }
    struct gbg_scene scene = made_scene(context, dimension, length);
    made_short_forces(&scene);
    return scene;
}

static void hash_after(struct gbg_scene *scene, const struct made_particles *made, int64_t steps,
                       char text[65])
{
    struct gbg_engine *engine = made_engine(scene, made);
    if (gbg_engine_advance(engine, steps) != GBG_OK) {
        fail_msg("%s", gbg_message(engine->context));
    }
    assert_int_equal(gbg_engine_digest(engine, text), GBG_OK);
    gbg_engine_free(engine);
}

static void threads_and_instruction_sets(void **state)
{
    (void)state;
    static const char *const contexts[] = {"cpu:threads=1",          "cpu:threads=2",
                                           "cpu:threads=7",          "poison:threads=2",
                                           "cpu:threads=2,isa=avx2", "cpu:threads=3,isa=avx512"};
    static struct made_particles made;
    for (int dimension = 2; dimension <= 3; dimension++) {
        char expected[65] = "", text[65];
        for (size_t k = 0; k < sizeof contexts / sizeof *contexts; k++) {
            struct gbg_context *context;
            if (gbg_context_create(contexts[k], &context) != GBG_OK) {
                print_message("not on this processor: %s\n", contexts[k]);
                continue;
            }
            if (k >= 4 && strcmp(context->instructions, "generic") == 0) {
                gbg_context_destroy(&context);
                continue;
            }
            struct gbg_scene scene = active(context, dimension);
            made_lattice(&made, &scene, dimension == 2 ? 20 : 7, 0.01);
            hash_after(&scene, &made, 100, text);
            if (!expected[0]) {
                strcpy(expected, text);
            }
            assert_string_equal(text, expected);
            gbg_context_destroy(&context);
        }
        print_message("%dD: %s\n", dimension, expected);
    }
}

/* The skin decides when lists are built, and must decide nothing else. */
static void age_of_lists(void **state)
{
    (void)state;
    static struct made_particles made;
    static const double skins[] = {0.0, 0.05, 0.2, 1.5};
    struct gbg_context *context = made_context("cpu:threads=2");
    char expected[65] = "", text[65];
    for (int k = 0; k < 4; k++) {
        struct gbg_scene scene = active(context, 2);
        scene.skin = skins[k];
        made_lattice(&made, &scene, 20, 0.01);
        hash_after(&scene, &made, 100, text);
        if (k == 0) {
            strcpy(expected, text);
        }
        assert_string_equal(text, expected);
    }
    gbg_context_destroy(&context);
}

/* Restoring a state half way gives the same end as running through. */
static void restart(void **state)
{
    (void)state;
    static struct made_particles made;
    static uint64_t fraction[2][5000];
    struct gbg_context *context = made_context("cpu:threads=2");
    struct gbg_scene scene = active(context, 2);
    made_lattice(&made, &scene, 20, 0.01);
    struct gbg_engine *through = made_engine(&scene, &made), *resumed = made_engine(&scene, &made);
    assert_int_equal(gbg_engine_advance(through, 37), GBG_OK);
    for (int a = 0; a < 2; a++) {
        assert_int_equal(gbg_engine_copy_fractions(through, a, fraction[a]), GBG_OK);
    }
    assert_int_equal(gbg_engine_advance(through, 60), GBG_OK);
    const uint64_t *const saved[3] = {fraction[0], fraction[1], NULL};
    assert_int_equal(gbg_engine_restore(resumed, 37, saved, NULL), GBG_OK);
    assert_int_equal(gbg_engine_advance(resumed, 60), GBG_OK);
    char a[65], b[65];
    assert_int_equal(gbg_engine_digest(through, a), GBG_OK);
    assert_int_equal(gbg_engine_digest(resumed, b), GBG_OK);
    assert_string_equal(a, b);
    gbg_engine_free(through);
    gbg_engine_free(resumed);
    gbg_context_destroy(&context);
}

/* Cut-off forces against a naive double loop; the error is stated. */
static void cutoff_forces(void **state)
{
    (void)state;
    static struct made_particles made;
    static double force[3][5000];
    struct gbg_context *context = made_context("cpu:threads=2");
    for (int kase = 0; kase < 8; kase++) {
        int dimension = kase % 2 ? 3 : 2;
        struct gbg_scene scene = active(context, dimension);
        scene.precision = kase / 2 % 2 ? GBG_PRECISION_DOUBLE : GBG_PRECISION_MIXED;
        scene.force[0].power = kase / 4 ? 2.0 : 6.0;
        made_lattice(&made, &scene, dimension == 2 ? 20 : 7, 0.04);
        struct gbg_engine *engine = made_engine(&scene, &made);
        double *const out[3] = {force[0], force[1], force[2]};
        assert_int_equal(gbg_engine_copy_forces(engine, out), GBG_OK);
        double errors = 0.0, sizes = 0.0;
        for (int64_t i = 0; i < made.p.n; i++) {
            double sum[3] = {0.0, 0.0, 0.0};
            for (int64_t j = 0; j < made.p.n; j++) {
                double r[3] = {0.0, 0.0, 0.0}, squared = 0.0;
                for (int a = 0; a < dimension; a++) {
                    r[a] = made.store[a][i] - made.store[a][j];
                    r[a] -= scene.length[a] * rint(r[a] / scene.length[a]);
                    squared += r[a] * r[a];
                }
                if (i == j || squared >= 6.25) {
                    continue;
                }
                for (int a = 0; a < dimension; a++) {
                    sum[a] += scene.species[made.species[i]].mobility *
                              scene.species[made.species[j]].alpha * r[a] /
                              pow(squared, 0.5 * (scene.force[0].power + 1.0));
                }
            }
            for (int a = 0; a < dimension; a++) {
                double d = force[a][i] - sum[a];
                errors += d * d;
                sizes += sum[a] * sum[a];
            }
        }
        double error = sqrt(errors / sizes);
        print_message("%dD power %g %s: relative RMS error %.2e\n", dimension, scene.force[0].power,
                      engine->use_double ? "double" : "mixed", error);
        /* mixed: seven factors 1/|r| of 1.2e-7 at most, and the rounding of a coordinate */
        assert_true(error < (engine->use_double ? 1e-14 : 1e-6));
        gbg_engine_free(engine);
    }
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(threads_and_instruction_sets),
        cmocka_unit_test(age_of_lists),
        cmocka_unit_test(restart),
        cmocka_unit_test(cutoff_forces),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
