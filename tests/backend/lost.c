/* Tests of a GPU that is lost in mid-run: every call answers with the first failure's sentence,
 * nothing hangs, and the CPU goes on. Tools that watch memory accesses report this program, which
 * makes a kernel write where there is no memory. */
#include <unistd.h>

#include "both.h"

enum { PATIENCE = 60 }; /* seconds: a call that hangs ends the test */

static struct made_particles made;

static void all_calls_name_the_first_failure(void **state)
{
    (void)state;
    char first[512], text[65];
    double length[2] = {14.0, 13.0}, x[100];
    struct gbg_context *context = made_context("cpu");
    struct gbg_scene scene = made_scene(context, 2, length);
    scene.rule = GBG_RULE_NONE;
    scene.unwrapped = 1;
    made_lattice(&made, &scene, 10, 0.02);
    struct both both = both_make(scene, &made);
    struct gbg_engine *gpu = both.engine[1], *another = NULL;
    assert_int_equal(gbg_engine_advance(gpu, 2), GBG_OK);

    uint32_t *high = gpu->state.high[0];
    gpu->state.high[0] = (uint32_t *)(uintptr_t)4096;
    assert_int_equal(gbg_engine_advance(gpu, 1), GBG_E_DEVICE);
    gpu->state.high[0] = high;
    snprintf(first, sizeof first, "%s", gbg_message(both.context[1]));
    print_message("%s\n", first);
    assert_non_null(strstr(first, "cuda:0: "));
    assert_non_null(strstr(first, "cudaError"));

    assert_int_equal(gbg_engine_advance(gpu, 1), GBG_E_DEVICE);
    assert_string_equal(gbg_message(both.context[1]), first);
    assert_int_equal(gbg_engine_decode(gpu, 1, 0, x, 1), GBG_E_DEVICE);
    assert_non_null(strstr(gbg_message(both.context[1]), first));
    assert_int_equal(gbg_engine_digest(gpu, text), GBG_E_DEVICE);
    assert_non_null(strstr(gbg_message(both.context[1]), first));
    assert_int_equal(gpu->step, 2);
    scene.context = both.context[1];
    assert_int_equal(gbg_engine_make(&scene, &made.p, &another), GBG_E_DEVICE);
    assert_null(another);

    assert_int_equal(gbg_engine_advance(both.engine[0], 5), GBG_OK);
    both_free(&both);
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_calls_name_the_first_failure),
    };
    if (both_missing()) {
        return BOTH_SKIPPED;
    }
    alarm(PATIENCE);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
