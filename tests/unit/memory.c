/* Tests of allocations that fail: every one of them in turn, with a status and without a leak (the
 * sanitizer preset sees leaks). */
#include "core/memory.h"
#include "fft/fft.h"
#include "gamboge/kernels.h"
#include "gamboge/sum.h"
#include "made_scene.h"

static struct made_particles made;

static struct gbg_scene active(struct gbg_context *context)
{
    double length[2] = {14.0, 13.0};
    struct gbg_scene scene = made_scene(context, 2, length);
    scene.n_forces = 2;
    scene.force[0] = (struct gbg_force){.power = 6.0, .sum = GBG_SUM_CUTOFF, .cutoff = 2.5};
    scene.force[1] = (struct gbg_force){.power = 2.0, .sum = GBG_SUM_MINIMUM_IMAGE};
    scene.unwrapped = scene.overlap = 1;
    made_lattice(&made, &scene, 10, 0.02);
    return scene;
}

/* Calls attempt with the 1st, 2nd, ... allocation failing, until none is left to fail. */
static void fail_each(struct gbg_context *context, int (*attempt)(struct gbg_context *))
{
    for (int64_t n = 1;; n++) {
        gbg_memory_fail_after(n);
        int status = attempt(context);
        gbg_memory_fail_after(0);
        if (status == GBG_OK) {
            print_message("%lld allocations\n", (long long)(n - 1));
            assert_true(n > 5);
            return;
        }
        assert_int_equal(status, GBG_E_MEMORY);
        assert_non_null(strstr(gbg_message(context), "bytes"));
    }
}

static int make_and_read(struct gbg_context *context)
{
    struct gbg_scene scene = active(context);
    struct gbg_engine *engine = NULL;
    char text[65];
    double x[100], y[100];
    int status = gbg_engine_make(&scene, &made.p, &engine);
    status = status ? status : gbg_engine_digest(engine, text);
    status = status ? status : gbg_engine_forces(engine, 100, x, y, NULL, 1);
    status = status ? status : gbg_engine_force_error(engine, 10, NULL, NULL);
    gbg_engine_free(engine);
    return status;
}

static int call_kernels(struct gbg_context *context)
{
    static const double box[2] = {14.0, 13.0};
    double x[3] = {1.0, 1.5, 9.0}, y[3] = {1.0, 1.2, 4.0}, f[2][3], one[3] = {1, 1, 1};
    int status = gbg_overlaps_remove(context, 2, box, 3, x, y, NULL, 1, one, "bounce", 0, NULL);
    status = status ? status
                    : gbg_pair_forces(context, 2, box, 2.0, 2.5, "mixed", 3, x, y, NULL, 1, one,
                                      one, f[0], f[1], NULL, 1);
    return status ? status
                  : gbg_pair_forces(context, 2, box, 2.0, 0.0, "mixed", 3, x, y, NULL, 1, one, one,
                                    f[0], f[1], NULL, 1);
}

static struct gbg_scene far_reaching(struct gbg_context *context)
{
    struct gbg_scene scene = active(context);
    scene.species[0].count = scene.species[1].count = 50;
    scene.force[1] =
        (struct gbg_force){.power = 2.0, .sum = GBG_SUM_LATTICE, .tolerance = 1e-4, .check = 1};
    return scene;
}

static int make_sum_and_read(struct gbg_context *context)
{
    struct gbg_scene scene = far_reaching(context);
    struct gbg_engine *engine = NULL;
    double x[100], y[100];
    int status = gbg_engine_make(&scene, &made.p, &engine);
    status = status ? status : gbg_engine_forces(engine, 100, x, y, NULL, 1);
    status = status ? status : gbg_engine_force_error(engine, 10, NULL, NULL);
    gbg_engine_free(engine);
    return status;
}

static int call_sum(struct gbg_context *context)
{
    static const double box[2] = {14.0, 13.0};
    double x[3] = {1.0, 1.5, 9.0}, y[3] = {1.0, 1.2, 4.0}, f[2][3], one[3] = {1, 1, 1};
    struct gbg_sum *sum = NULL;
    int status = gbg_sum_create(context, 2, box, 2.0, "lattice", 1e-3, 3, &sum);
    status = status ? status : gbg_sum_set_option(sum, "hurry", "true");
    status = status ? status : gbg_sum_set_sources(sum, one);
    status = status ? status : gbg_sum_set_positions(sum, x, y, NULL, 1);
    status = status ? status : gbg_sum_run(sum);
    status = status ? status : gbg_sum_get_forces(sum, one, f[0], f[1], NULL, 1);
    status = status ? status : gbg_sum_get_potential(sum, f[0]);
    status = status ? status : gbg_sum_get_error(sum, 0, NULL, NULL);
    gbg_sum_destroy(&sum);
    return status;
}

static void sums(void **state)
{
    (void)state;
    const char *why;
    struct gbg_context *context = made_context("cpu:threads=2");
    if (gbg_fft_find(&why)) {
        fail_each(context, make_sum_and_read);
        fail_each(context, call_sum);
    }
    gbg_context_destroy(&context);
}

static void engines(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu:threads=2");
    fail_each(context, make_and_read);
    gbg_context_destroy(&context);
}

static void kernels(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu:threads=2");
    fail_each(context, call_kernels);
    gbg_context_destroy(&context);
}

/* What a plan takes it takes before the first step: any allocation in these steps would fail. */
static void running_allocates_nothing(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu:threads=2");
    struct gbg_scene scene = active(context);
    struct gbg_engine *engine = made_engine(&scene, &made);
    gbg_memory_fail_after(1);
    int status = gbg_engine_advance(engine, 300);
    gbg_memory_fail_after(0);
    if (status != GBG_OK) {
        fail_msg("%s", gbg_message(context));
    }
    gbg_engine_free(engine);
    gbg_context_destroy(&context);
}

/* Nor does a sum by a mesh, but for measuring its error, which steps before the 16th do not. */
static void sums_allocate_nothing(void **state)
{
    (void)state;
    const char *why;
    struct gbg_context *context = made_context("cpu:threads=2");
    if (gbg_fft_find(&why)) {
        struct gbg_scene scene = far_reaching(context);
        struct gbg_engine *engine = made_engine(&scene, &made);
        assert_int_equal(gbg_engine_check_sums(engine), GBG_OK);
        gbg_memory_fail_after(1);
        int status = gbg_engine_advance(engine, 15);
        gbg_memory_fail_after(0);
        if (status != GBG_OK) {
            fail_msg("%s", gbg_message(context));
        }
        gbg_engine_free(engine);
    }
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(engines),
        cmocka_unit_test(kernels),
        cmocka_unit_test(sums),
        cmocka_unit_test(sums_allocate_nothing),
        cmocka_unit_test(running_allocates_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
