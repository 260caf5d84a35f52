/* Tests of start configurations from text and restart files. */
#include <locale.h>

#include "core/memory.h"
#include "io/start_file.h"
#include "io_made.h"

static struct gbg_context *context;

static void put(const char *path, const char *text)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static struct gbg_scene *scene_of(int dimension, int n_species, const char *path)
{
    static const char *const name[3] = {"red", "blue", "3"};
    struct gbg_scene *scene;
    made_good(context, gbg_scene_create(context, dimension, &scene));
    for (int s = 0; s < n_species; s++) {
        made_good(context, gbg_scene_add_species(scene, name[s], 0.5, 1, 1, -1, -1, NULL));
    }
    made_good(context, gbg_scene_set_text(scene, "particles.start.file", path));
    return scene;
}

static void text_is_read(void **state)
{
    (void)state;
    const char *path = made_path("start.txt");
    put(path, "# x y species\n"
              "\n"
              "  1.5 -2e1 red # a comment\r\n"
              "\t.25\t1d0 2\n"
              "+3. 4D-2 3\n"
              "   # another\n"
              "1 2 1"); /* no end of line */
    struct gbg_scene *scene = scene_of(2, 3, path);
    made_good(context, gbg_io_read_start(scene));
    static const double expected[4][2] = {{1.5, -20.0}, {0.25, 1.0}, {3.0, 0.04}, {1.0, 2.0}};
    static const int species[4] = {0, 1, 2, 0};
    assert_int_equal(scene->arrays.n, 4);
    assert_int_equal(scene->start, GBG_START_ARRAYS);
    for (int i = 0; i < 4; i++) {
        assert_true(scene->arrays.position[0][i] == expected[i][0]);
        assert_true(scene->arrays.position[1][i] == expected[i][1]);
        assert_int_equal(scene->arrays.species[i], species[i]);
        assert_int_equal(scene->arrays.id[i], i);
    }
    assert_true(scene->length[0] == 0.0); /* a text has no box */
    gbg_scene_destroy(&scene);
    unlink(path);
}

static void one_species_may_be_left_out(void **state)
{
    (void)state;
    const char *path = made_path("start.txt");
    put(path, "1 2 3\n4 5 6 red\n7 8 9 1\n");
    struct gbg_scene *scene = scene_of(3, 1, path);
    made_good(context, gbg_io_read_start(scene));
    assert_int_equal(scene->arrays.n, 3);
    assert_true(scene->arrays.position[2][2] == 9.0);
    gbg_scene_destroy(&scene);
    unlink(path);
}

/* A locale with a decimal comma, if the machine has one, changes nothing. */
static void the_locale_does_not_matter(void **state)
{
    (void)state;
    static const char *const names[] = {"de_DE.UTF-8", "fr_FR.UTF-8", "es_CL.UTF-8", "de_DE.utf8"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        setlocale(LC_ALL, names[k]);
    }
    const char *path = made_path("start.txt");
    put(path, "1.5 2.5 red\n");
    struct gbg_scene *scene = scene_of(2, 1, path);
    made_good(context, gbg_io_read_start(scene));
    assert_true(scene->arrays.position[0][0] == 1.5);
    gbg_scene_destroy(&scene);
    setlocale(LC_ALL, "C");
    unlink(path);
}

static void refused(struct gbg_scene *scene, int expected, const char *words)
{
    int status = gbg_io_read_start(scene);
    if (status != expected || !strstr(gbg_message(context), words)) {
        fail_msg("%s instead of %s with \"%s\": %s", gbg_status_name(status),
                 gbg_status_name(expected), words, gbg_message(context));
    }
    assert_int_equal(scene->arrays.n, 0);
    assert_int_equal(scene->start, GBG_START_FILE);
}

static void bad_texts_are_refused_with_their_place(void **state)
{
    (void)state;
    static const struct {
        const char *text, *words;
    } bad[] = {
        {"1 2 red\n3 4x red\n", "start.txt, line 2, column 2: \"4x\" is not a number"},
        {"1 2 red\n\n# c\nnan 4 red\n", "line 4, column 1: \"nan\" is not a number"},
        {"inf 4 red\n", "line 1, column 1: \"inf\" is not a number"},
        {"1,5 4 red\n", "line 1, column 1: \"1,5\" is not a number"},
        {"0x10 4 red\n", "line 1, column 1: \"0x10\" is not a number"},
        {"1 -1e999 red\n", "line 1, column 2: \"-1e999\" is beyond the range"},
        {"1 e red\n", "line 1, column 2: \"e\" is not a number"},
        {"1 - red\n", "line 1, column 2: \"-\" is not a number"},
        {"1 2 green\n", "line 1, column 3: \"green\" is neither a species"},
        {"1 2 0\n", "line 1, column 3: \"0\" is neither"},
        {"1 2 4\n", "its number (1 to 3)"},
        {"1 2 1.5\n", "column 3: \"1.5\""},
        {"1 2 99999999999999999999\n", "column 3: \"99999999999999999999\""},
        {"1 2\n", "line 1: it has 2 columns"},
        {"1 2 3 1\n", "line 1: it has 4 columns"},
        {"1 2 3 4 5 6 7 8 9\n", "line 1: it has 9 columns"},
        {"", "no particle"},
        {"# nothing\n\n", "no particle"},
    };
    const char *path = made_path("start.txt");
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        put(path, bad[k].text);
        struct gbg_scene *scene = scene_of(2, 3, path);
        refused(scene, GBG_E_FORMAT, bad[k].words);
        gbg_scene_destroy(&scene);
    }
    FILE *file = fopen(path, "wb");
    fwrite("1 2 1\nab\0cd\n", 1, 12, file);
    fclose(file);
    struct gbg_scene *scene = scene_of(2, 3, path);
    refused(scene, GBG_E_FORMAT, "line 2: it is longer than 4094 bytes or holds a zero byte");
    file = fopen(path, "wb");
    for (int k = 0; k < 5000; k++) {
        fputc(' ', file);
    }
    fputs("1 2 1\n", file);
    fclose(file);
    refused(scene, GBG_E_FORMAT, "line 1: it is longer than 4094 bytes");
    unlink(path);
    refused(scene, GBG_E_FILE, "No such file or directory");
    gbg_scene_destroy(&scene);
    scene = scene_of(2, 3, made_directory);
    refused(scene, GBG_E_FILE, "Is a directory");
    gbg_scene_destroy(&scene);
}

/* Species go by name, the box comes from the file, and 53 bits of each fraction survive. */
static void a_restart_file_is_a_start(void **state)
{
    (void)state;
    struct made made = {3, 11, "double", 1, 0, 1, 3};
    const char *path = made_path("r.rst");
    struct gbg_engine *engine = made_engine(context, &made), *again;
    struct gbg_scene *scene;
    made_set(engine, 41);
    made_good(context, gbg_engine_save(engine, path));
    gbg_engine_destroy(&engine);
    made_good(context, gbg_scene_create(context, 3, &scene));
    made_good(context, gbg_scene_add_species(scene, "small one", 0.1, 1, 1, -1, -1, NULL));
    made_good(context, gbg_scene_add_species(scene, "big", 0.2, 1, 1, -1, -1, NULL));
    made_good(context, gbg_scene_set_text(scene, "particles.start.file", path));
    made_good(context, gbg_scene_set_real(scene, "dynamics.dt", 0.01));
    made_good(context, gbg_engine_create(scene, &again));
    int32_t species[11];
    int64_t ids[11];
    made_good(context, gbg_engine_species(again, 11, species, 0));
    made_good(context, gbg_engine_ids(again, 11, ids));
    for (int a = 0; a < 3; a++) {
        uint64_t fraction[11];
        assert_true(again->state.box.length[a] == made_length[a]);
        assert_true(again->state.box.origin[a] == made_origin[a]);
        made_good(context, gbg_engine_copy_fractions(again, a, fraction));
        /* the coordinate is rounded to double: half an ulp of |origin| + length, in 2^-64 of it */
        double ulps = (fabs(made_origin[a]) + made_length[a]) / made_length[a];
        for (int64_t i = 0; i < 11; i++) {
            int64_t error = (int64_t)(fraction[i] - made_fraction(41, i, a));
            assert_true((double)llabs(error) <= 4096.0 * ulps);
        }
    }
    for (int64_t i = 0; i < 11; i++) {
        assert_int_equal(species[i], i % 3 == 1 ? 0 : 1);
        assert_int_equal(ids[i], made_id(&made, i));
    }
    gbg_engine_destroy(&again);
    gbg_scene_destroy(&scene);
    unlink(path);
}

static void starts_that_do_not_fit_are_refused(void **state)
{
    (void)state;
    struct made made = {3, 11, "double", 0, 0, 0, 3};
    const char *path = made_path("r.rst");
    struct gbg_engine *engine = made_engine(context, &made);
    made_good(context, gbg_engine_save(engine, path));
    gbg_engine_destroy(&engine);
    struct gbg_scene *scene = scene_of(2, 2, path);
    refused(scene, GBG_E_SCENE, "it has 3 dimensions, the scene 2");
    gbg_scene_destroy(&scene);
    scene = scene_of(3, 2, path);
    refused(scene, GBG_E_SCENE, "species 1 (big), which the scene");
    gbg_scene_destroy(&scene);
    unlink(path);
}

static void failing_allocations(void **state)
{
    (void)state;
    const char *path = made_path("start.txt");
    put(path, "1 2 red\n3 4 red\n");
    struct gbg_scene *scene = scene_of(2, 1, path);
    int64_t n = 1;
    int status;
    do {
        gbg_memory_fail_after(n++);
        status = gbg_io_read_start(scene);
        gbg_memory_fail_after(0);
        assert_true(status == GBG_OK || status == GBG_E_MEMORY);
        assert_int_equal(scene->arrays.n, status == GBG_OK ? 2 : 0);
    } while (status != GBG_OK);
    assert_true(n > 8);
    gbg_scene_destroy(&scene);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(text_is_read),
        cmocka_unit_test(one_species_may_be_left_out),
        cmocka_unit_test(the_locale_does_not_matter),
        cmocka_unit_test(bad_texts_are_refused_with_their_place),
        cmocka_unit_test(a_restart_file_is_a_start),
        cmocka_unit_test(starts_that_do_not_fit_are_refused),
        cmocka_unit_test(failing_allocations),
    };
    return made_run(tests, "cpu:threads=1", &context);
}
