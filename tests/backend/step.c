/* Tests of a GPU against the CPU: the noise tape and the Brownian step, to the last bit. */
#include "both.h"

static struct made_particles made;

static void noise_is_the_same(void **state)
{
    (void)state;
    enum { N = 4000 };
    static double value[2][3 * N];
    struct gbg_context *context[2] = {made_context("cpu"), made_context("cuda:0")};
    for (int limit_by = 0; limit_by < 3; limit_by++) {
        for (int dimension = 2; dimension <= 3; dimension++) {
            struct gbg_noise noise = {7, 3, limit_by, 1.5, 0.1};
            for (int b = 0; b < 2; b++) {
                const struct gbg_backend *backend = gbg_backend_find(b ? "cuda" : "cpu");
                struct gbg_device *device;
                assert_int_equal(backend->create(context[b], &device), GBG_OK);
                assert_int_equal(
                    backend->kernels(device)->normals(device, &noise, UINT64_C(0x123456789A),
                                                      UINT64_C(0xFFFFFF00), N, dimension, value[b]),
                    GBG_OK);
                backend->destroy(device);
            }
            for (int k = 0; k < N * dimension; k++) {
                both_same_real(value[0][k], value[1][k], "a deviate");
            }
        }
    }
    gbg_context_destroy(&context[0]);
    gbg_context_destroy(&context[1]);
}

static void step_is_the_same(void **state)
{
    (void)state;
    for (int dimension = 2; dimension <= 3; dimension++) {
        double length[3] = {20.0, 31.0, 17.0};
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = made_scene(context, dimension, length);
        scene.rule = GBG_RULE_NONE;
        scene.unwrapped = 1;
        scene.temperature = 40.0; /* moves across the edges */
        made_lattice(&made, &scene, dimension == 2 ? 50 : 13, 0.3);
        struct both both = both_make(scene, &made);
        for (int step = 0; step < 20; step++) {
            for (int b = 0; b < 2; b++) {
                assert_int_equal(gbg_engine_advance(both.engine[b], 1), GBG_OK);
            }
            both_same_state(&both);
            both_same_real(both.engine[0]->moves.total, both.engine[1]->moves.total,
                           "the largest move");
            both_same_real(both.engine[0]->moves.noise, both.engine[1]->moves.noise,
                           "the largest noise");
        }
        both_free(&both);
        gbg_context_destroy(&context);
    }
}

/* A move beyond half the box is refused by both, with the same particle. */
static void bad_moves_are_refused(void **state)
{
    (void)state;
    double length[2] = {20.0, 20.0};
    struct gbg_context *context = made_context("cpu");
    struct gbg_scene scene = made_scene(context, 2, length);
    scene.rule = GBG_RULE_NONE;
    scene.temperature = 1000.0;
    made_lattice(&made, &scene, 50, 0.3);
    struct both both = both_make(scene, &made);
    for (int b = 0; b < 2; b++) {
        assert_int_equal(gbg_engine_advance(both.engine[b], 1), GBG_E_STEP);
    }
    assert_int_equal(both.engine[0]->moves.bad, both.engine[1]->moves.bad);
    assert_true(both.engine[0]->moves.bad >= 0);
    both_same_state(&both);
    both_free(&both);
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_is_the_same),
        cmocka_unit_test(step_is_the_same),
        cmocka_unit_test(bad_moves_are_refused),
    };
    return both_missing() ? BOTH_SKIPPED : cmocka_run_group_tests(tests, NULL, NULL);
}
