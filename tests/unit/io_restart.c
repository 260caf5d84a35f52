/* Tests of restart files: bit for bit, and no damage goes unnoticed. */
#include <signal.h>
#include <sys/resource.h>

#include "core/memory.h"
#include "io_made.h"

static const struct made standard = {2, 11, "double", 1, 0, 1, 3};
static struct gbg_context *context;

static void put(const char *path, const char *data, size_t bytes)
{
    unlink(path); /* a new file, because some file systems sync one that is overwritten */
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, bytes, file), bytes);
    fclose(file);
}

static void hash_of(struct gbg_engine *engine, char text[65])
{
    made_good(context, gbg_engine_hash(engine, 65, text));
}

static void state_comes_back(void **state)
{
    (void)state;
    for (int set = 0; set < 8; set++) {
        struct made made = {set & 1 ? 3 : 2, 11, "double", set >> 1 & 1, 0, set >> 2, 3};
        struct gbg_engine *engine = made_engine(context, &made);
        const char *path = made_path("r.rst");
        char before[65], after[65];
        made_set(engine, INT64_C(12345678901));
        hash_of(engine, before);
        made_good(context, gbg_engine_save(engine, path));
        made_set(engine, 5);
        made_good(context, gbg_engine_load(engine, path));
        hash_of(engine, after);
        assert_string_equal(before, after);
        for (int64_t i = 0; made.unwrapped && i < made.n; i++) {
            assert_int_equal(engine->state.image[1][i], made_image(INT64_C(12345678901), i, 1));
        }
        gbg_engine_destroy(&engine);
        unlink(path);
    }
}

/* A run of 40 steps, and one of 15 that is saved, loaded by another engine and gone on with. */
static void a_run_goes_on_bit_for_bit(void **state)
{
    (void)state;
    struct made made = {2, 400, "double", 1, 1, 0, 9};
    const char *path = made_path("r.rst");
    char whole[65], broken[65];
    struct gbg_engine *engine = made_engine(context, &made);
    made_good(context, gbg_engine_run(engine, 40));
    hash_of(engine, whole);
    gbg_engine_destroy(&engine);
    engine = made_engine(context, &made);
    made_good(context, gbg_engine_run(engine, 15));
    made_good(context, gbg_engine_save(engine, path));
    gbg_engine_destroy(&engine);
    engine = made_engine(context, &made);
    made_good(context, gbg_engine_load(engine, path));
    made_good(context, gbg_engine_run(engine, 25));
    hash_of(engine, broken);
    assert_string_equal(whole, broken);
    gbg_engine_destroy(&engine);
    unlink(path);
}

static void two_files_are_kept(void **state)
{
    (void)state;
    const char *path = made_path("r.rst"), *previous = made_path("r.rst.previous");
    char hash[3][65], text[65];
    struct gbg_engine *engine = made_engine(context, &standard);
    for (int step = 0; step < 3; step++) {
        made_set(engine, step);
        hash_of(engine, hash[step]);
        made_good(context, gbg_engine_save(engine, path));
        assert_int_equal(access(previous, F_OK), step == 0 ? -1 : 0);
    }
    made_good(context, gbg_engine_load(engine, previous));
    hash_of(engine, text);
    assert_string_equal(text, hash[1]);
    made_good(context, gbg_engine_load(engine, path));
    hash_of(engine, text);
    assert_string_equal(text, hash[2]);
    gbg_engine_destroy(&engine);
    unlink(path);
    unlink(previous);
}

/* All 255 other values of each byte would take long; these change every bit, alone and together. */
static void every_damaged_byte_is_noticed(void **state)
{
    (void)state;
    static const unsigned char flips[] = {0x01, 0x02, 0x04, 0x08, 0x10, 0x20, 0x40, 0x80, 0xff};
    struct made small = {2, 3, "double", 1, 0, 0, 3};
    const char *path = made_path("r.rst"), *previous = made_path("r.rst.previous");
    char before[65], after[65];
    size_t bytes, head = 488;
    struct gbg_engine *engine = made_engine(context, &small);
    made_set(engine, 77);
    made_good(context, gbg_engine_save(engine, path));
    made_good(context, gbg_engine_save(engine, path));
    char *data = made_content(path, &bytes);
    assert_int_equal(bytes, head + 3 * (8 + 4 + 2 * (8 + 4)) + 32);
    made_set(engine, 78);
    hash_of(engine, before);
    for (size_t at = 0; at < bytes; at++) {
        for (size_t k = 0; k < sizeof flips; k++) {
            data[at] = (char)(data[at] ^ flips[k]);
            put(path, data, bytes);
            made_refused(context, gbg_engine_load(engine, path), GBG_E_FORMAT, previous);
            data[at] = (char)(data[at] ^ flips[k]);
        }
    }
    for (size_t length = 0; length < bytes; length++) {
        put(path, data, length);
        made_refused(context, gbg_engine_load(engine, path), GBG_E_FORMAT, previous);
    }
    char *longer = calloc(1, bytes + 40);
    memcpy(longer, data, bytes);
    for (size_t more = 1; more <= 40; more++) {
        put(path, longer, bytes + more);
        made_refused(context, gbg_engine_load(engine, path), GBG_E_FORMAT, "length");
    }
    hash_of(engine, after);
    assert_string_equal(before, after);
    put(path, data, bytes);
    made_good(context, gbg_engine_load(engine, path));
    free(data);
    free(longer);
    gbg_engine_destroy(&engine);
    unlink(path);
    unlink(previous);
}

static void load_refused(const struct made *made, const char *path, int status, const char *words)
{
    char before[65], after[65];
    struct gbg_engine *engine = made_engine(context, made);
    hash_of(engine, before);
    made_refused(context, gbg_engine_load(engine, path), status, words);
    hash_of(engine, after);
    assert_string_equal(before, after);
    gbg_engine_destroy(&engine);
}

static void other_scenes_are_refused(void **state)
{
    (void)state;
    const char *path = made_path("r.rst");
    struct gbg_engine *engine = made_engine(context, &standard);
    made_good(context, gbg_engine_save(engine, path));
    gbg_engine_destroy(&engine);
    struct made other = standard;
    other.seed = 4;
    load_refused(&other, path, GBG_E_FORMAT, "another scene");
    other = standard;
    other.n = 10;
    load_refused(&other, path, GBG_E_FORMAT, "11 particles");
    other = standard;
    other.spread_ids = 0;
    load_refused(&other, path, GBG_E_FORMAT, "its particles are not those");
    other = standard;
    other.unwrapped = 0;
    engine = made_engine(context, &other);
    made_good(context, gbg_engine_load(engine, path)); /* more than is needed */
    made_good(context, gbg_engine_save(engine, path));
    gbg_engine_destroy(&engine);
    load_refused(&standard, path, GBG_E_FORMAT, "no image counts");
    load_refused(&standard, made_path("none"), GBG_E_FILE, "No such file");
    put(path, "x y species", 11);
    load_refused(&standard, path, GBG_E_FORMAT, "no restart file");
    unlink(path);
    unlink(made_path("r.rst.previous"));
}

static void bad_arguments_are_refused(void **state)
{
    (void)state;
    struct gbg_engine *engine = made_engine(context, &standard);
    assert_int_equal(gbg_engine_save(NULL, "x"), GBG_E_ARGUMENT);
    assert_int_equal(gbg_engine_load(NULL, "x"), GBG_E_ARGUMENT);
    made_refused(context, gbg_engine_save(engine, NULL), GBG_E_ARGUMENT,
                 "gbg_engine_save: path is NULL");
    made_refused(context, gbg_engine_load(engine, ""), GBG_E_ARGUMENT,
                 "gbg_engine_load: path is empty");
    made_refused(context, gbg_engine_save(engine, made_path("none/r")), GBG_E_FILE,
                 "No such file or directory");
    made_refused(context, gbg_engine_save(engine, made_directory), GBG_E_FILE,
                 "not a regular file");
    gbg_engine_destroy(&engine);
}

static void a_failed_save_keeps_the_old_file(void **state)
{
    (void)state;
    struct rlimit former, tight;
    const char *path = made_path("r.rst"), *previous = made_path("r.rst.previous");
    char before[65], after[65];
    struct gbg_engine *engine = made_engine(context, &standard);
    made_set(engine, 1);
    hash_of(engine, before);
    made_good(context, gbg_engine_save(engine, path));
    made_set(engine, 2);
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &former);
    for (rlim_t room = 0; room < 900; room += 100) {
        tight = former;
        tight.rlim_cur = room;
        setrlimit(RLIMIT_FSIZE, &tight);
        int status = gbg_engine_save(engine, path);
        setrlimit(RLIMIT_FSIZE, &former);
        made_refused(context, status, GBG_E_FILE, "File too large");
    }
    for (int64_t n = 1; n < 3; n++) {
        gbg_memory_fail_after(n);
        int status = gbg_engine_save(engine, path);
        gbg_memory_fail_after(0);
        assert_int_equal(status, n == 1 ? GBG_E_MEMORY : GBG_OK);
        if (n == 1) {
            assert_int_equal(access(previous, F_OK), -1);
            made_good(context, gbg_engine_load(engine, path));
            hash_of(engine, after);
            assert_string_equal(before, after);
        }
    }
    int status;
    int64_t n = 1;
    do {
        gbg_memory_fail_after(n++);
        status = gbg_engine_load(engine, path);
        gbg_memory_fail_after(0);
        assert_true(status == GBG_OK || status == GBG_E_MEMORY);
    } while (status != GBG_OK);
    assert_true(n >= 7); /* ids, species, two axes, two images */
    gbg_engine_destroy(&engine);
    unlink(path);
    unlink(previous);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(state_comes_back),
        cmocka_unit_test(a_run_goes_on_bit_for_bit),
        cmocka_unit_test(two_files_are_kept),
        cmocka_unit_test(every_damaged_byte_is_noticed),
        cmocka_unit_test(other_scenes_are_refused),
        cmocka_unit_test(bad_arguments_are_refused),
        cmocka_unit_test(a_failed_save_keeps_the_old_file),
    };
    return made_run(tests, "cpu:threads=1", &context);
}
