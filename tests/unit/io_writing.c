/* Tests of trajectories being written: what goes wrong, going on after a restart, large files. */
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>

#include <netcdf.h>

#include "core/file.h"
#include "core/memory.h"
#include "io_made.h"

static const struct made standard = {2, 11, "double", 1, 1, 0, 0};
static struct gbg_context *context;

static void write_steps(struct gbg_engine *engine, const char *path, int first, int last)
{
    struct gbg_trajectory *trajectory;
    made_good(context, gbg_trajectory_create(engine, path, &trajectory));
    made_append(trajectory, engine, first, last);
    gbg_trajectory_destroy(&trajectory);
}

static void put_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static void frames_in(const char *path, int64_t expected)
{
    struct gbg_trajectory *trajectory;
    int64_t frames, n, step;
    double time, length[3], x[64], y[64], z[64];
    int dimension;
    made_good(context, gbg_trajectory_open(context, path, &trajectory));
    made_good(context, gbg_trajectory_size(trajectory, &frames, &n, &dimension, NULL));
    assert_int_equal(frames, expected);
    for (int64_t f = 0; f < frames; f++) {
        made_good(context, gbg_trajectory_frame(trajectory, f, &time, &step, length, NULL));
        made_good(context, gbg_trajectory_positions(trajectory, f, n, x, y, z, 1));
        for (int64_t i = 0; i < n; i++) {
            assert_true(fabs(x[i] - made_coordinate(step, i, 0)) <= 3e-13);
            assert_true(fabs(y[i] - made_coordinate(step, i, 1)) <= 3e-13);
        }
    }
    gbg_trajectory_destroy(&trajectory);
}

static void the_old_file_stays_until_the_first_frame(void **state)
{
    (void)state;
    struct gbg_trajectory *trajectory;
    struct gbg_engine *engine = made_engine(context, &standard);
    const char *path = made_path("old.nc");
    size_t bytes;
    put_text(path, "precious");
    made_good(context, gbg_trajectory_create(engine, path, &trajectory));
    gbg_trajectory_destroy(&trajectory);
    char *data = made_content(path, &bytes);
    assert_true(bytes == 8 && memcmp(data, "precious", 8) == 0);
    free(data);
    made_good(context, gbg_trajectory_create(engine, path, &trajectory));
    data = made_content(path, &bytes);
    assert_true(bytes == 8 && memcmp(data, "precious", 8) == 0);
    free(data);
    made_append(trajectory, engine, 1, 1);
    frames_in(path, 1);
    made_append(trajectory, engine, 2, 5);
    frames_in(path, 5); /* while it is still being written */
    gbg_trajectory_destroy(&trajectory);
    frames_in(path, 5);
    gbg_engine_destroy(&engine);
    unlink(path);
}

static void creating_is_refused(void **state)
{
    (void)state;
    struct gbg_trajectory *trajectory;
    struct gbg_engine *engine = made_engine(context, &standard);
    made_refused(context, gbg_trajectory_create(engine, made_path("none/x.nc"), &trajectory),
                 GBG_E_FILE, "No such file or directory");
    assert_null(trajectory);
    made_refused(context, gbg_trajectory_create(engine, made_directory, &trajectory), GBG_E_FILE,
                 "not a regular file");
    made_refused(context, gbg_trajectory_create(engine, "", &trajectory), GBG_E_ARGUMENT,
                 "path is empty");
    made_refused(context, gbg_trajectory_create(engine, NULL, &trajectory), GBG_E_ARGUMENT,
                 "path is NULL");
    assert_int_equal(gbg_trajectory_create(NULL, "x", &trajectory), GBG_E_ARGUMENT);
    assert_int_equal(gbg_trajectory_create(engine, "x", NULL), GBG_E_ARGUMENT);
    gbg_engine_destroy(&engine);
    struct made empty = standard;
    empty.n = 0;
    engine = made_engine(context, &empty);
    made_refused(context, gbg_trajectory_create(engine, made_path("0.nc"), &trajectory),
                 GBG_E_SCENE, "at least one particle");
    gbg_engine_destroy(&engine);
}

static void appending_is_refused(void **state)
{
    (void)state;
    struct gbg_trajectory *trajectory;
    struct made other = standard;
    other.n = 12;
    struct gbg_engine *engine = made_engine(context, &standard), *wrong;
    const char *path = made_path("a.nc");
    made_good(context, gbg_trajectory_create(engine, path, &trajectory));
    made_append(trajectory, engine, 7, 7);
    made_set(engine, 6);
    made_refused(context, gbg_trajectory_append(trajectory, engine), GBG_E_ORDER,
                 "already at step 7");
    wrong = made_engine(context, &other);
    made_refused(context, gbg_trajectory_append(trajectory, wrong), GBG_E_ARGUMENT, "12 particles");
    gbg_engine_destroy(&wrong);
    other = standard;
    other.overlap = 0;
    wrong = made_engine(context, &other);
    made_set(wrong, 8);
    made_refused(context, gbg_trajectory_append(trajectory, wrong), GBG_E_ARGUMENT,
                 "overlap flags");
    gbg_engine_destroy(&wrong);
    assert_int_equal(gbg_trajectory_append(NULL, engine), GBG_E_ARGUMENT);
    made_refused(context, gbg_trajectory_append(trajectory, NULL), GBG_E_ARGUMENT,
                 "engine is NULL");
    double r;
    made_refused(context, gbg_trajectory_diameters(trajectory, 11, &r), GBG_E_ORDER,
                 "being written");
    made_append(trajectory, engine, 7, 8);
    gbg_trajectory_destroy(&trajectory);
    frames_in(path, 3);
    made_good(context, gbg_trajectory_open(context, path, &trajectory));
    made_refused(context, gbg_trajectory_append(trajectory, engine), GBG_E_ORDER, "to be read");
    gbg_trajectory_destroy(&trajectory);
    gbg_engine_destroy(&engine);
    unlink(path);
}

/* Cut back to a step and gone on with, the file is that of the run without a break, byte for byte.
 */
static void going_on_after_a_restart(void **state)
{
    (void)state;
    struct gbg_trajectory *trajectory;
    struct gbg_engine *engine = made_engine(context, &standard);
    const char *whole = made_path("whole.nc"), *broken = made_path("broken.nc");
    write_steps(engine, whole, 1, 9);
    for (int at = 0; at <= 10; at++) {
        write_steps(engine, broken, 1, 7);
        FILE *file = fopen(broken, "ab");
        fputs("half a frame that a killed run left", file);
        fclose(file);
        made_set(engine, at);
        made_good(context, gbg_trajectory_continue(engine, broken, &trajectory));
        int kept = at < 7 ? at : 7;
        int64_t frames;
        made_good(context, gbg_trajectory_size(trajectory, &frames, NULL, NULL, NULL));
        assert_int_equal(frames, kept);
        frames_in(broken, kept);
        made_append(trajectory, engine, at < 7 ? at + 1 : 8, 9);
        gbg_trajectory_destroy(&trajectory);
        made_same_content(whole, broken);
        unlink(broken);
    }
    unlink(whole);
    gbg_engine_destroy(&engine);
}

static void continue_refused(const struct made *made, const char *path, int status,
                             const char *words)
{
    struct gbg_trajectory *trajectory;
    struct gbg_engine *engine = made_engine(context, made);
    made_refused(context, gbg_trajectory_continue(engine, path, &trajectory), status, words);
    assert_null(trajectory);
    gbg_engine_destroy(&engine);
}

static void going_on_is_refused(void **state)
{
    (void)state;
    const char *path = made_path("t.nc"), *copy = made_path("copy.nc");
    struct gbg_engine *engine = made_engine(context, &standard);
    write_steps(engine, path, 1, 3);
    write_steps(engine, copy, 1, 3);
    struct made other = standard;
    other.seed = 1;
    continue_refused(&other, path, GBG_E_FORMAT, "another scene");
    other = standard;
    other.n = 12;
    continue_refused(&other, path, GBG_E_FORMAT, "11 particles");
    other = standard;
    other.precision = "float";
    continue_refused(&other, path, GBG_E_FORMAT, "double coordinates");
    other = standard;
    other.unwrapped = 0;
    continue_refused(&other, path, GBG_E_FORMAT, "images: yes");
    continue_refused(&standard, made_path("nothing.nc"), GBG_E_FILE, "No such file");
    made_same_content(path, copy);
    assert_int_equal(truncate(path, 3000), 0);
    continue_refused(&standard, path, GBG_E_FORMAT, "cut short");
    put_text(path, "abc");
    continue_refused(&standard, path, GBG_E_FORMAT, "not a netCDF file");
    gbg_engine_destroy(&engine);
    unlink(path);
    unlink(copy);
}

/* A full disc, played by the limit of the size of files: the frames before stay, and when there is
 * room again the run goes on. */
static void a_full_disc_costs_no_frame(void **state)
{
    (void)state;
    struct rlimit former, tight;
    struct gbg_trajectory *trajectory;
    struct gbg_engine *engine = made_engine(context, &standard);
    const char *path = made_path("full.nc"), *whole = made_path("whole.nc");
    size_t bytes, three;
    write_steps(engine, whole, 1, 3);
    free(made_content(whole, &three));
    write_steps(engine, whole, 1, 5);
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &former);
    made_good(context, gbg_trajectory_create(engine, path, &trajectory));
    made_append(trajectory, engine, 1, 3);
    for (rlim_t room = 0; room < 400; room += 57) {
        tight = former;
        tight.rlim_cur = three + room;
        made_set(engine, 4);
        setrlimit(RLIMIT_FSIZE, &tight);
        int status = gbg_trajectory_append(trajectory, engine);
        setrlimit(RLIMIT_FSIZE, &former);
        made_refused(context, status, GBG_E_FILE, "File too large");
        made_refused(context, status, GBG_E_FILE, path);
        free(made_content(path, &bytes));
        assert_int_equal(bytes, three);
        frames_in(path, 3);
    }
    made_append(trajectory, engine, 4, 5);
    gbg_trajectory_destroy(&trajectory);
    made_same_content(path, whole);
    put_text(path, "old");
    tight.rlim_cur = 1000; /* not even the header has room */
    setrlimit(RLIMIT_FSIZE, &tight);
    int status = gbg_trajectory_create(engine, path, &trajectory);
    setrlimit(RLIMIT_FSIZE, &former);
    made_refused(context, status, GBG_E_FILE, path);
    free(made_content(path, &bytes));
    assert_int_equal(bytes, 3);
    unlink(path);
    unlink(whole);
    gbg_engine_destroy(&engine);
}

/* A file of 12 GB with a hole in the place of its first million frames. */
static void frames_beyond_4_GiB(void **state)
{
    (void)state;
    struct gbg_trajectory *trajectory;
    struct made large = {3, 512, "double", 0, 0, 0, 0};
    struct gbg_engine *engine = made_engine(context, &large);
    const char *path = made_path("large.nc");
    size_t one, two;
    write_steps(engine, path, 1, 1);
    free(made_content(path, &one));
    write_steps(engine, path, 1, 2);
    free(made_content(path, &two));
    int64_t record = (int64_t)(two - one), frames = 1000000;
    assert_int_equal(record, 8 + 4 + 8 + 9 * 8 + 3 * 512 * 8);
    unsigned char count[4] = {0x00, 0x0f, 0x42, 0x40};
    int file = open(path, O_RDWR);
    assert_int_equal(gbg_file_write(file, count, 4, 4), 0);
    if (ftruncate(file, (off_t)((int64_t)one + (frames - 1) * record)) != 0) {
        close(file);
        unlink(path);
        skip(); /* this file system has no such large files */
    }
    close(file);
    made_set(engine, 3);
    made_good(context, gbg_trajectory_continue(engine, path, &trajectory));
    made_append(trajectory, engine, 3, 4);
    gbg_trajectory_destroy(&trajectory);
    double x[512], y[512], z[512];
    made_good(context, gbg_trajectory_open(context, path, &trajectory));
    for (int step = 3; step <= 4; step++) {
        int64_t at = frames + step - 3;
        made_good(context, gbg_trajectory_positions(trajectory, at, 512, x, y, z, 1));
        for (int64_t i = 0; i < 512; i++) {
            assert_true(fabs(x[i] - made_coordinate(step, i, 0)) <= 3e-13);
            assert_true(fabs(z[i] - made_coordinate(step, i, 2)) <= 3e-13);
        }
    }
    gbg_trajectory_destroy(&trajectory);
    gbg_engine_destroy(&engine);
    unlink(path);
}

/* Every allocation of a call fails once: the call is refused, and nothing is left behind. */
static void failing_allocations(void **state)
{
    (void)state;
    struct gbg_trajectory *trajectory;
    struct gbg_engine *engine = made_engine(context, &standard);
    const char *path = made_path("m.nc");
    int status, failures = 0;
    for (int call = 0; call < 3; call++) {
        int64_t n = 1;
        do {
            made_set(engine, 2);
            gbg_memory_fail_after(n++);
            status = call == 0   ? gbg_trajectory_create(engine, path, &trajectory)
                     : call == 1 ? gbg_trajectory_open(context, path, &trajectory)
                                 : gbg_trajectory_continue(engine, path, &trajectory);
            gbg_memory_fail_after(0);
            assert_true(status == GBG_OK || status == GBG_E_MEMORY);
            assert_true((status == GBG_OK) == (trajectory != NULL));
            failures += status != GBG_OK;
            if (status == GBG_OK && call == 0) {
                made_append(trajectory, engine, 1, 3);
            }
            gbg_trajectory_destroy(&trajectory);
        } while (status != GBG_OK);
    }
    assert_true(failures >= 9);
    frames_in(path, 2);
    gbg_engine_destroy(&engine);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_old_file_stays_until_the_first_frame),
        cmocka_unit_test(creating_is_refused),
        cmocka_unit_test(appending_is_refused),
        cmocka_unit_test(going_on_after_a_restart),
        cmocka_unit_test(going_on_is_refused),
        cmocka_unit_test(a_full_disc_costs_no_frame),
        cmocka_unit_test(frames_beyond_4_GiB),
        cmocka_unit_test(failing_allocations),
    };
    return made_run(tests, "cpu:threads=1", &context);
}
