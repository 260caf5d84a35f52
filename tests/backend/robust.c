/* Tests of a GPU that has no memory left, of bad numbers, and of two engines on it: a status and a
 * sentence, nothing lost, and the next attempt works. */
#include "core/memory.h"
#include "gamboge/kernels.h"

#include "both.h"

#ifdef GBG_WITH_CUDA
extern int64_t gbg_cuda_live(void); /* arrays on the GPU */
#else
static int64_t gbg_cuda_live(void)
{
    return 0;
}
#endif

static struct made_particles made;

static struct gbg_scene plain(struct gbg_context *context)
{
    double length[2] = {14.0, 13.0};
    struct gbg_scene scene = made_scene(context, 2, length);
    scene.rule = GBG_RULE_NONE;
    scene.unwrapped = 1;
    made_lattice(&made, &scene, 10, 0.02);
    return scene;
}

static struct gbg_scene active(struct gbg_context *context, int rule)
{
    struct gbg_scene scene = plain(context);
    scene.n_forces = 2;
    scene.force[0] = (struct gbg_force){.power = 6.0, .sum = GBG_SUM_CUTOFF, .cutoff = 2.5};
    scene.force[1] = (struct gbg_force){.power = 2.0, .sum = GBG_SUM_MINIMUM_IMAGE};
    scene.overlap = 1;
    scene.rule = rule;
    return scene;
}

/* Without sums over all pairs. */
static struct gbg_scene short_range(struct gbg_context *context, int rule)
{
    struct gbg_scene scene = active(context, rule);
    scene.n_forces = 1;
    return scene;
}

/* Makes an engine, runs it and reads it. */
static int attempt(struct gbg_scene scene)
{
    struct gbg_engine *engine = NULL;
    char text[65];
    int status = gbg_engine_make(&scene, &made.p, &engine);
    status = status ? status : gbg_engine_advance(engine, 3);
    status = status ? status : gbg_engine_digest(engine, text);
    gbg_engine_free(engine);
    return status;
}

static int attempt_plain(struct gbg_context *context)
{
    return attempt(plain(context));
}

static int attempt_bounce(struct gbg_context *context)
{
    return attempt(active(context, GBG_RULE_BOUNCE));
}

static int attempt_short(struct gbg_context *context)
{
    return attempt(short_range(context, GBG_RULE_BOUNCE));
}

static int attempt_bridge(struct gbg_context *context)
{
    return attempt(active(context, GBG_RULE_BRIDGE));
}

static int attempt_event(struct gbg_context *context)
{
    return attempt(active(context, GBG_RULE_EVENT));
}

static int attempt_kernels(struct gbg_context *context)
{
    static const double box[2] = {14.0, 13.0};
    double x[3] = {1.0, 1.5, 9.0}, y[3] = {1.0, 1.2, 4.0}, f[2][3], one[3] = {1, 1, 1};
    int status = gbg_overlaps_remove(context, 2, box, 3, x, y, NULL, 1, one, "bounce", 0, NULL);
    return status ? status
                  : gbg_pair_forces(context, 2, box, 2.0, 2.5, "mixed", 3, x, y, NULL, 1, one, one,
                                    f[0], f[1], NULL, 1);
}

/* With the 1st, 2nd, ... allocation failing, on the host or the GPU, until none is left to fail.
 * Up to `most` may be done without, as the index of a list, which has smaller forms. */
static void fail_each(int (*attempted)(struct gbg_context *), int64_t least, int most)
{
    struct gbg_context *context = made_context("cuda:0");
    int spared = 0;
    for (int64_t n = 1;; n++) {
        gbg_memory_fail_after(n);
        int status = attempted(context);
        int64_t left = gbg_memory_fail_after(0);
        assert_int_equal(gbg_cuda_live(), 0);
        if (left > 0) {
            assert_int_equal(status, GBG_OK);
            print_message("%lld allocations, %d of them spared\n", (long long)(n - 1), spared);
            assert_true(n > least);
            assert_true(spared <= most);
            break;
        }
        if (status == GBG_OK) {
            spared++;
            continue;
        }
        if (status != GBG_E_MEMORY) {
            fail_msg("allocation %lld: status %d: %s", (long long)n, status, gbg_message(context));
        }
        assert_non_null(strstr(gbg_message(context), "bytes"));
    }
    gbg_context_destroy(&context);
}

static void memory_of_engines(void **state)
{
    (void)state;
    fail_each(attempt_plain, 5, 0);
}

static void memory_of_rounds(void **state)
{
    (void)state;
    fail_each(attempt_bounce, 20, 4);
    fail_each(attempt_short, 20, 4);
}

static void memory_of_bridge(void **state)
{
    (void)state;
    fail_each(attempt_bridge, 20, 4);
}

static void memory_of_events(void **state)
{
    (void)state;
    fail_each(attempt_event, 20, 4);
}

static void memory_of_kernels(void **state)
{
    (void)state;
    fail_each(attempt_kernels, 5, 16);
}

/* Without hard cores nothing that a list takes need be had: forces then come straight from cells.
 */
static int attempt_free(struct gbg_context *context)
{
    return attempt(short_range(context, GBG_RULE_NONE));
}

static void memory_of_lists(void **state)
{
    (void)state;
    fail_each(attempt_free, 20, 24);
}

/* A run that memory failed in the middle goes on, to the same state. */
static void refused_steps_are_made_later(void **state)
{
    (void)state;
    enum { STEPS = 3 };
    static const int rules[] = {GBG_RULE_NONE, GBG_RULE_BOUNCE, GBG_RULE_BRIDGE, GBG_RULE_EVENT};
    struct gbg_context *context = made_context("cuda:0");
    for (int r = 0; r < 8; r++) {
        struct gbg_scene scene = (r < 4 ? active : short_range)(context, rules[r % 4]);
        struct gbg_engine *engine = made_engine(&scene, &made);
        char whole[65], text[65];
        assert_int_equal(gbg_engine_advance(engine, STEPS), GBG_OK);
        assert_int_equal(gbg_engine_digest(engine, whole), GBG_OK);
        gbg_engine_free(engine);
        int64_t left = 0;
        for (int64_t n = 1; left == 0; n++) {
            engine = made_engine(&scene, &made);
            gbg_memory_fail_after(n);
            int status = gbg_engine_advance(engine, STEPS);
            left = gbg_memory_fail_after(0);
            assert_true(status == GBG_OK || (status == GBG_E_MEMORY && left == 0));
            assert_int_equal(gbg_engine_advance(engine, STEPS - (int64_t)engine->step), GBG_OK);
            assert_int_equal(gbg_engine_digest(engine, text), GBG_OK);
            assert_string_equal(text, whole);
            gbg_engine_free(engine);
        }
    }
    gbg_context_destroy(&context);
}

/* More than any card has: refused with the bytes asked for and those that are free. */
static void too_large_arrays(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cuda:0");
    const struct gbg_backend *backend = gbg_backend_find("cuda");
    struct gbg_device *device;
    void *array;
    assert_int_equal(backend->create(context, &device), GBG_OK);
    const int64_t counts[] = {INT64_C(1) << 42, INT64_C(1) << 61, INT64_MAX, -1};
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
        assert_int_equal(backend->allocate(device, &array, counts[k], 8, "positions"),
                         GBG_E_MEMORY);
        assert_null(array);
        assert_non_null(strstr(gbg_message(context), "positions"));
        assert_non_null(strstr(gbg_message(context), k == 0 ? "are free" : "than memory can hold"));
    }
    assert_int_equal(backend->allocate(device, &array, 1000, 8, "positions"), GBG_OK);
    assert_int_equal(gbg_cuda_live(), 1);
    backend->release(device, array);
    backend->destroy(device);
    assert_int_equal(gbg_cuda_live(), 0);
    gbg_context_destroy(&context);
}

/* What a plan takes it takes before the first steps: afterwards any allocation would fail. */
static void running_allocates_nothing(void **state)
{
    (void)state;
    for (int all_pairs = 0; all_pairs < 2; all_pairs++) {
        struct gbg_context *context = made_context("cuda:0");
        struct gbg_scene scene =
            all_pairs ? active(context, GBG_RULE_BOUNCE) : short_range(context, GBG_RULE_BOUNCE);
        struct gbg_engine *engine = made_engine(&scene, &made);
        assert_int_equal(gbg_engine_advance(engine, 20), GBG_OK);
        gbg_memory_fail_after(1);
        int status = gbg_engine_advance(engine, 300);
        gbg_memory_fail_after(0);
        if (status != GBG_OK) {
            fail_msg("%s", gbg_message(context));
        }
        gbg_engine_free(engine);
        gbg_context_destroy(&context);
    }
}

/* Forces that are no numbers: the particle is named, nobody else is harmed. */
static void bad_forces_are_caught(void **state)
{
    (void)state;
    enum { WRONG = 37 };
    const double bad[] = {NAN, INFINITY, -INFINITY, 1e300};
    struct gbg_context *context = made_context("cpu");
    struct gbg_scene scene = plain(context);
    struct both both = both_make(scene, &made);
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        for (int b = 0; b < 2; b++) {
            struct gbg_engine *engine = both.engine[b];
            const struct gbg_backend *backend = engine->backend;
            struct gbg_state with = engine->state;
            struct gbg_moves moves;
            double force[100] = {0};
            for (int a = 0; a < 2; a++) {
                force[WRONG] = a == 1 ? bad[k] : 0.0;
                assert_int_equal(
                    backend->allocate(engine->device, (void **)&with.force[a], 100, 8, "forces"),
                    GBG_OK);
                assert_int_equal(
                    backend->upload(engine->device, with.force[a], force, sizeof force), GBG_OK);
            }
            assert_int_equal(engine->kernels->integrate(engine->device, &with, &engine->noise, k,
                                                        0.01, 1, &moves),
                             GBG_OK);
            assert_int_equal(moves.bad, WRONG);
            for (int a = 0; a < 2; a++) {
                backend->release(engine->device, with.force[a]);
            }
        }
        both_same_state(&both);
    }
    both_free(&both);
    gbg_context_destroy(&context);
}

/* A run whose forces are no numbers, or too large for one step, ends alike on both: the same status
 * and sentence, in the state of the last good step, and nothing is spent. */
static void runs_with_bad_numbers_end_alike(void **state)
{
    (void)state;
    static const double bad[] = {NAN, INFINITY, 1e300, 1e30};
    static const int rules[] = {GBG_RULE_NONE, GBG_RULE_BOUNCE, GBG_RULE_BRIDGE};
    struct gbg_context *context = made_context("cpu");
    for (int k = 0; k < 4 * 3 * 2; k++) {
        if (!both_takes(k)) {
            continue;
        }
        struct gbg_scene scene = (k % 2 ? active : short_range)(context, rules[k / 2 % 3]);
        scene.species[1].alpha = bad[k / 6];
        struct both both = both_make(scene, &made);
        int status[2];
        for (int b = 0; b < 2; b++) {
            status[b] = gbg_engine_advance(both.engine[b], 2);
            assert_int_not_equal(status[b], GBG_OK);
            assert_true(status[b] > 0);
            assert_int_equal(both.engine[b]->step, 0);
        }
        assert_int_equal(status[0], status[1]);
        if (k / 6 == 0) {
            assert_string_equal(gbg_message(both.context[0]), gbg_message(both.context[1]));
            print_message("%s\n", gbg_message(both.context[1]));
        }
        both_same_state(&both);
        both_free(&both);
    }
    gbg_context_destroy(&context);
}

/* Engines side by side do not touch each other. */
static void engines_side_by_side(void **state)
{
    (void)state;
    struct gbg_context *context[2] = {made_context("cuda:0"), made_context("cuda")};
    struct gbg_engine *engine[3];
    char text[3][65];
    for (int k = 0; k < 3; k++) {
        struct gbg_scene scene = plain(context[k % 2]);
        engine[k] = made_engine(&scene, &made);
    }
    for (int step = 0; step < 10; step++) {
        assert_int_equal(gbg_engine_advance(engine[0], 1), GBG_OK);
        assert_int_equal(gbg_engine_advance(engine[1], 1), GBG_OK);
    }
    assert_int_equal(gbg_engine_advance(engine[2], 10), GBG_OK);
    for (int k = 2; k >= 0; k--) {
        assert_int_equal(gbg_engine_digest(engine[k], text[k]), GBG_OK);
        assert_string_equal(text[k], text[2]);
    }
    for (int k = 0; k < 3; k++) {
        gbg_engine_free(engine[k]);
    }
    gbg_context_destroy(&context[0]);
    gbg_context_destroy(&context[1]);
    assert_int_equal(gbg_cuda_live(), 0);
}

/* Which GPU: auto takes the first one, a number that is none is refused. */
static void devices_are_chosen(void **state)
{
    (void)state;
    const char *name, *instructions;
    struct gbg_context *context = made_context("auto");
    assert_int_equal(gbg_context_backend(context, &name, &instructions, NULL), GBG_OK);
    assert_string_equal(name, "cuda");
    assert_int_equal(strncmp(instructions, "sm_", 3), 0);
    assert_int_equal(strncmp(context->choice, "auto takes cuda:0, ", 19), 0);
    gbg_context_destroy(&context);
    context = made_context("auto:threads=1");
    assert_int_equal(gbg_context_backend(context, &name, NULL, NULL), GBG_OK);
    assert_string_equal(name, "cpu");
    gbg_context_destroy(&context);
    assert_int_equal(gbg_context_create("cuda:1000", &context), GBG_E_UNBUILT);
    assert_non_null(strstr(gbg_message(NULL), "no GPU 1000"));
    context = made_context("auto:1000");
    assert_int_equal(gbg_context_backend(context, &name, NULL, NULL), GBG_OK);
    assert_string_equal(name, "cpu");
    assert_non_null(strstr(context->choice, "no GPU 1000"));
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(devices_are_chosen),
        cmocka_unit_test(too_large_arrays),
        cmocka_unit_test(memory_of_engines),
        cmocka_unit_test(bad_forces_are_caught),
        cmocka_unit_test(engines_side_by_side),
        cmocka_unit_test(memory_of_rounds),
        cmocka_unit_test(memory_of_bridge),
        cmocka_unit_test(memory_of_events),
        cmocka_unit_test(memory_of_kernels),
        cmocka_unit_test(memory_of_lists),
        cmocka_unit_test(refused_steps_are_made_later),
        cmocka_unit_test(running_allocates_nothing),
        cmocka_unit_test(runs_with_bad_numbers_end_alike),
    };
    return both_missing() ? BOTH_SKIPPED : cmocka_run_group_tests(tests, NULL, NULL);
}
