/* Tests of the choice of backend, threads and instruction set. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "gamboge/context.h"

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
    assert_int_equal(gbg_context_create("auto", &context), 0);
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(options_are_read),
        cmocka_unit_test(wrong_options_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
