/* Tests: a directory for the files of a test, and what is in them. */
#ifndef GBG_TESTS_MADE_FILES_H
#define GBG_TESTS_MADE_FILES_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

/* Empty again at the end or the test fails. */
static char made_directory[] = "/tmp/gbg_files_XXXXXX";

static inline const char *made_path(const char *name)
{
    static char path[4][320];
    static int next;
    next = (next + 1) % 4;
    snprintf(path[next], sizeof path[next], "%s/%s", made_directory, name);
    return path[next];
}

static inline int made_start(void **state)
{
    (void)state;
    return mkdtemp(made_directory) ? 0 : -1;
}

static inline int made_stop(void **state)
{
    (void)state;
    return rmdir(made_directory);
}

/* Content of a file, to be freed; *bytes receives its length. */
static inline char *made_content(const char *path, size_t *bytes)
{
    struct stat about;
    assert_int_equal(stat(path, &about), 0);
    *bytes = (size_t)about.st_size;
    char *data = malloc(*bytes + 1);
    FILE *file = fopen(path, "rb");
    assert_non_null(data);
    assert_non_null(file);
    assert_int_equal(fread(data, 1, *bytes, file), *bytes);
    fclose(file);
    return data;
}

/* Fails unless two files have the same bytes. */
static inline void made_same_content(const char *a, const char *b)
{
    size_t na, nb;
    char *da = made_content(a, &na), *db = made_content(b, &nb);
    if (na != nb) {
        fail_msg("%s has %zu bytes, %s %zu", a, na, b, nb);
    }
    for (size_t k = 0; k < na; k++) {
        if (da[k] != db[k]) {
            fail_msg("%s and %s differ from byte %zu of %zu on", a, b, k, na);
        }
    }
    free(da);
    free(db);
}

#endif
