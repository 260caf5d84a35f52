/* Tests of c/core/file: files that are complete or absent. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "core/context.h"
#include "core/file.h"

static char directory[] = "/tmp/gbg_file_XXXXXX";
static char path[256], previous[300];

static void put(const char *name, const char *text)
{
    FILE *file = fopen(name, "wb");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static void holds(const char *name, const char *text)
{
    char got[64] = "";
    FILE *file = fopen(name, "rb");
    assert_non_null(file);
    size_t bytes = fread(got, 1, sizeof got - 1, file);
    fclose(file);
    assert_int_equal(bytes, strlen(text));
    assert_string_equal(got, text);
}

static void a_commit_replaces_and_may_keep(void **state)
{
    (void)state;
    struct gbg_context context = {0};
    char temporary[512];
    for (int round = 0; round < 3; round++) {
        char text[2] = {(char)('a' + round), 0};
        assert_int_equal(gbg_file_temporary(&context, path, temporary, sizeof temporary), GBG_OK);
        put(temporary, text);
        assert_int_equal(gbg_file_commit_keeping(&context, temporary, path), GBG_OK);
        holds(path, text);
        assert_int_equal(access(previous, F_OK), round == 0 ? -1 : 0);
        assert_int_equal(access(temporary, F_OK), -1);
    }
    holds(previous, "b");
    assert_int_equal(gbg_file_temporary(&context, path, temporary, sizeof temporary), GBG_OK);
    put(temporary, "d");
    assert_int_equal(gbg_file_commit(&context, temporary, path), GBG_OK);
    holds(path, "d");
    holds(previous, "b");
}

static void what_must_not_be_replaced_is_refused(void **state)
{
    (void)state;
    struct gbg_context context = {0};
    char temporary[512], lost[512];
    assert_int_equal(gbg_file_temporary(&context, directory, temporary, sizeof temporary),
                     GBG_E_FILE);
    assert_non_null(strstr(context.message, "not a regular file"));
    assert_string_equal(temporary, "");
    snprintf(lost, sizeof lost, "%s/none/x", directory);
    assert_int_equal(gbg_file_temporary(&context, lost, temporary, sizeof temporary), GBG_E_FILE);
    assert_non_null(strstr(context.message, "No such file or directory"));
    assert_int_equal(gbg_file_temporary(&context, path, temporary, 8), GBG_E_FILE);
    if (geteuid() != 0) {
        chmod(path, 0444);
        assert_int_equal(gbg_file_temporary(&context, path, temporary, sizeof temporary),
                         GBG_E_FILE);
        chmod(path, 0644);
    }
}

static void a_failed_commit_leaves_the_old_file(void **state)
{
    (void)state;
    struct gbg_context context = {0};
    put(path, "old");
    unlink(previous);
    assert_int_equal(gbg_file_commit_keeping(&context, "/nowhere/at/all", path), GBG_E_FILE);
    assert_int_equal(gbg_file_commit(&context, "/nowhere/at/all", path), GBG_E_FILE);
    holds(path, "old");
    assert_int_equal(access(previous, F_OK), -1);
    gbg_file_abandon("");
}

static int start(void **state)
{
    (void)state;
    if (!mkdtemp(directory)) {
        return -1;
    }
    snprintf(path, sizeof path, "%s/data", directory);
    snprintf(previous, sizeof previous, "%s.previous", path);
    return 0;
}

static int stop(void **state)
{
    (void)state;
    unlink(path);
    unlink(previous);
    return rmdir(directory); /* fails if a temporary file was left behind */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_commit_replaces_and_may_keep),
        cmocka_unit_test(what_must_not_be_replaced_is_refused),
        cmocka_unit_test(a_failed_commit_leaves_the_old_file),
    };
    return cmocka_run_group_tests(tests, start, stop);
}
