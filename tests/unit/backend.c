/* Tests of the choice of backend, threads and instruction set. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "core/context.h"
#include "gamboge/engine.h"
#include "gamboge/scene.h"

static void assert_refused(const char *text, int status, const char *part)
{
    struct gbg_context *context = NULL;
    assert_int_equal(gbg_context_create(text, &context), status);
    assert_null(context);
    assert_non_null(strstr(gbg_message(NULL), part));
}

static void options_are_read(void **state)
{
    (void)state;
    struct gbg_context *context;
    const char *name, *instructions;
    char best[16], text[64];
    int threads;
    assert_int_equal(gbg_context_create("cpu", &context), 0);
    assert_int_equal(gbg_context_backend(context, NULL, &instructions, NULL), 0);
    assert_true(strlen(instructions) > 0 && strlen(instructions) < sizeof best);
    strcpy(best, instructions);
    gbg_context_destroy(&context);
    strcat(strcpy(text, "cpu:threads=3,isa="), best);
    assert_int_equal(gbg_context_create(text, &context), 0);
    assert_int_equal(gbg_context_backend(context, &name, &instructions, &threads), 0);
    assert_string_equal(name, "cpu");
    assert_string_equal(instructions, best);
    assert_int_equal(threads, 3);
    gbg_context_destroy(&context);
}

static void wrong_options_are_refused(void **state)
{
    (void)state;
    assert_refused("cpu:threads=0", GBG_E_ARGUMENT, "threads=N with N from 1");
    assert_refused("cpu:threads=2x", GBG_E_ARGUMENT, "threads=N");
    assert_refused("cpu:", GBG_E_ARGUMENT, "isa=NAME");
    assert_refused("cpu:threads=2,", GBG_E_ARGUMENT, "isa=NAME");
    assert_refused("cpu:isa=mmx", GBG_E_NAME, "isa=mmx");
    assert_refused("cpu:isa=", GBG_E_ARGUMENT, "isa=NAME");
    assert_refused("cpu:isa=aninstructionsetname", GBG_E_ARGUMENT, "isa=NAME");
    assert_refused("gpu", GBG_E_NAME, "cuda");
    assert_refused(":threads=1", GBG_E_NAME, "cpu");
}

/* auto takes a GPU or the CPU and says which; what is the CPU's takes the CPU. */
static void auto_takes_what_works(void **state)
{
    (void)state;
    static const char *const texts[] = {NULL, "auto", "auto:1"};
    static const char *const for_cpu[] = {"auto:threads=2", "auto:isa=generic"};
    struct gbg_context *context;
    const char *name;
    for (size_t k = 0; k < sizeof texts / sizeof *texts; k++) {
        assert_int_equal(gbg_context_create(texts[k], &context), 0);
        assert_int_equal(gbg_context_backend(context, &name, NULL, NULL), 0);
        assert_string_equal(gbg_message(context), "");
        assert_true(strcmp(name, "cpu") == 0 || strcmp(name, "cuda") == 0);
        if (gbg_has_component("cuda")) {
            char expected[64] = "auto takes ";
            strcat(expected, name);
            assert_int_equal(strncmp(context->choice, expected, strlen(expected)), 0);
            assert_true(strlen(context->choice) > strlen(expected) + 2);
        } else {
            assert_string_equal(context->choice, "");
            assert_string_equal(name, "cpu");
        }
        gbg_context_destroy(&context);
    }
    for (size_t k = 0; k < sizeof for_cpu / sizeof *for_cpu; k++) {
        assert_int_equal(gbg_context_create(for_cpu[k], &context), 0);
        assert_int_equal(gbg_context_backend(context, &name, NULL, NULL), 0);
        assert_string_equal(name, "cpu");
        assert_string_equal(context->choice, "");
        gbg_context_destroy(&context);
    }
}

/* Without a GPU, or without the backend, the sentence says so and what works instead. */
static void a_missing_gpu_is_named(void **state)
{
    (void)state;
    static const char *const texts[] = {"cuda", "cuda:0", "cuda:7", "cuda:threads=2"};
    struct gbg_context *context;
    const char *name;
    assert_int_equal(gbg_context_create("auto", &context), 0);
    gbg_context_backend(context, &name, NULL, NULL);
    int there = strcmp(name, "cuda") == 0;
    gbg_context_destroy(&context);
    for (size_t k = 0; !there && k < sizeof texts / sizeof *texts; k++) {
        assert_refused(texts[k], GBG_E_UNBUILT, "cpu and auto work without it");
        assert_non_null(
            strstr(gbg_message(NULL), gbg_has_component("cuda") ? "no GPU" : "GBG_WITH_CUDA"));
    }
    if (gbg_has_component("cuda")) {
        assert_refused("cuda:isa=avx2", GBG_E_NAME, "leave isa away");
    }
}

/* What is not the backend's runs with an instruction set of the processor. */
static void the_host_has_its_own_set(void **state)
{
    (void)state;
    static const char *const texts[] = {"cpu", "cpu:isa=generic", "poison", "auto"};
    struct gbg_context *context;
    for (size_t k = 0; k < sizeof texts / sizeof *texts; k++) {
        assert_int_equal(gbg_context_create(texts[k], &context), 0);
        int known = strcmp(context->host, "generic") == 0 || strcmp(context->host, "avx2") == 0 ||
                    strcmp(context->host, "avx512") == 0;
        assert_true(known);
        gbg_context_destroy(&context);
    }
}

/* A line of the log for each engine that auto chose a backend for. */
static int lines;

static void count_line(void *user, int level, const char *line)
{
    (void)user;
    lines += level == GBG_LOG_INFO && strncmp(line, "auto takes ", 11) == 0;
}

static void engines_log_the_choice(void **state)
{
    (void)state;
    static const char *const texts[] = {"cpu", "auto"};
    const double length[2] = {10.0, 10.0}, x[1] = {1.0};
    for (int k = 0; k < 2; k++) {
        struct gbg_context *context;
        struct gbg_scene *scene;
        struct gbg_engine *engine;
        lines = 0;
        assert_int_equal(gbg_context_create(texts[k], &context), 0);
        assert_int_equal(gbg_context_set_log(context, count_line, NULL), 0);
        assert_int_equal(gbg_scene_create(context, 2, &scene), 0);
        assert_int_equal(gbg_scene_set_box(scene, length, NULL), 0);
        assert_int_equal(gbg_scene_add_species(scene, "A", 1.0, 0.0, 0.0, -1.0, -1, NULL), 0);
        assert_int_equal(gbg_scene_add_particles(scene, 1, x, x, NULL, 1, NULL, 0, NULL), 0);
        assert_int_equal(gbg_engine_create(scene, &engine), 0);
        assert_int_equal(lines, k == 1 && gbg_has_component("cuda"));
        gbg_engine_destroy(&engine);
        gbg_scene_destroy(&scene);
        gbg_context_destroy(&context);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(options_are_read),         cmocka_unit_test(wrong_options_are_refused),
        cmocka_unit_test(auto_takes_what_works),    cmocka_unit_test(a_missing_gpu_is_named),
        cmocka_unit_test(the_host_has_its_own_set), cmocka_unit_test(engines_log_the_choice),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
