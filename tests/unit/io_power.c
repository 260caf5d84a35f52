/* Test of the order of writes, against loss of power: the test's own pwrite, fdatasync, fsync and
 * rename keep a diary of what the library does. Of the writes since the last sync any part may be
 * on the disc; every such disc is built and read. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <math.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>

#include "io_made.h"

enum watch { OFF, ON_TRAJECTORY, ON_OTHERS };
enum { MOST_PENDING = 12, IMAGE_BYTES = 1 << 16 };

static struct {
    int on;    /* enum watch */
    int known; /* the image holds what is on the disc for certain */
    unsigned char image[IMAGE_BYTES];
    size_t size;
    int pending;
    struct {
        off_t at;
        size_t bytes;
        unsigned char data[4096];
    } write[MOST_PENDING];
    int renames, unsynced_renames, directory_syncs; /* since the last rename */
} diary;

static void check_discs(void);

ssize_t pwrite(int file, const void *data, size_t bytes, off_t at)
{
    if (diary.on) {
        assert_true(diary.pending < MOST_PENDING && bytes <= sizeof diary.write[0].data);
        diary.write[diary.pending].at = at;
        diary.write[diary.pending].bytes = bytes;
        memcpy(diary.write[diary.pending].data, data, bytes);
        diary.pending++;
    }
    struct iovec piece = {(void *)data, bytes};
    return pwritev(file, &piece, 1, at);
}

/* After a sync the disc holds what the file holds. */
static int synced(int file)
{
    struct stat about;
    if (diary.on && fstat(file, &about) == 0) {
        if (S_ISDIR(about.st_mode)) {
            diary.directory_syncs++;
            return 0;
        }
        if (diary.known) {
            check_discs();
        }
        assert_true(about.st_size <= IMAGE_BYTES);
        diary.size = (size_t)about.st_size;
        assert_int_equal(pread(file, diary.image, diary.size, 0), about.st_size);
        diary.pending = 0;
    }
    return 0;
}

int fdatasync(int file)
{
    synced(file);
    return (int)syscall(SYS_fdatasync, file);
}

int fsync(int file)
{
    synced(file);
    return (int)syscall(SYS_fsync, file);
}

int rename(const char *from, const char *to)
{
    if (diary.on) {
        diary.renames++;
        diary.unsynced_renames += diary.pending > 0;
        diary.directory_syncs = 0;
        diary.known =
            diary.on ==
            ON_TRAJECTORY; /* from now on the file has its name, and any disc must be readable */
    }
    return renameat(AT_FDCWD, from, AT_FDCWD, to);
}

static struct gbg_context *context;
static const struct made standard = {2, 5, "double", 1, 1, 0, 0};
static int64_t frames_done; /* frames whose append has returned */
static int discs;

static void put_disc(const char *path, unsigned subset, int torn)
{
    static unsigned char image[IMAGE_BYTES];
    size_t size = diary.size;
    memcpy(image, diary.image, sizeof image);
    memset(image + size, 0, sizeof image - size);
    for (int k = 0; k < diary.pending; k++) {
        size_t bytes = diary.write[k].bytes / (size_t)(torn == k ? 2 : 1);
        if (subset >> k & 1) {
            memcpy(image + diary.write[k].at, diary.write[k].data, bytes);
            size_t end = (size_t)diary.write[k].at + bytes;
            size = end > size ? end : size;
        }
    }
    FILE *file = fopen(path, "wb");
    assert_int_equal(fwrite(image, 1, size, file), size);
    fclose(file);
}

static void check_disc(const char *path)
{
    struct gbg_trajectory *trajectory;
    int64_t frames, n, step;
    double time, length[3], x[5], y[5];
    made_good(context, gbg_trajectory_open(context, path, &trajectory));
    made_good(context, gbg_trajectory_size(trajectory, &frames, &n, NULL, NULL));
    assert_true(frames == frames_done || frames == frames_done + 1);
    for (int64_t f = 0; f < frames; f++) {
        made_good(context, gbg_trajectory_frame(trajectory, f, &time, &step, length, NULL));
        made_good(context, gbg_trajectory_positions(trajectory, f, n, x, y, NULL, 1));
        assert_int_equal(step, f + 1);
        for (int64_t i = 0; i < n; i++) {
            assert_true(fabs(x[i] - made_coordinate(step, i, 0)) <= 3e-13);
            assert_true(fabs(y[i] - made_coordinate(step, i, 1)) <= 3e-13);
        }
    }
    gbg_trajectory_destroy(&trajectory);
    unlink(path);
    discs++;
}

/* Every subset of the pending writes, whole or one of them cut in half. Only the count of frames
 * lies inside the file as it was; a 4-byte word in one sector is written or not. */
static void check_discs(void)
{
    const char *path = made_path("disc.nc");
    diary.on = OFF;
    for (unsigned subset = 0; subset < 1U << diary.pending; subset++) {
        for (int torn = -1; torn < diary.pending; torn++) {
            int is_count = torn >= 0 && diary.write[torn].bytes == 4 && diary.write[torn].at == 4;
            if (torn < 0 || (subset == (1U << diary.pending) - 1 && !is_count)) {
                put_disc(path, subset, torn);
                check_disc(path);
            }
        }
    }
    diary.on = ON_TRAJECTORY;
}

static void every_disc_that_a_crash_leaves_is_right(void **state)
{
    (void)state;
    struct gbg_trajectory *trajectory;
    struct gbg_engine *engine = made_engine(context, &standard);
    const char *path = strdup(made_path("t.nc"));
    memset(&diary, 0, sizeof diary);
    diary.on = ON_TRAJECTORY;
    made_good(context, gbg_trajectory_create(engine, path, &trajectory));
    for (frames_done = 0; frames_done < 4; frames_done++) {
        made_set(engine, frames_done + 1);
        made_good(context, gbg_trajectory_append(trajectory, engine));
        assert_int_equal(diary.pending, 0);
        assert_int_equal(diary.renames, 1); /* with the first frame */
        assert_int_equal(diary.unsynced_renames, 0);
        assert_true(diary.directory_syncs > 0);
    }
    diary.on = OFF;
    print_message("%d discs\n", discs);
    assert_true(discs > 1500);
    gbg_trajectory_destroy(&trajectory);
    gbg_engine_destroy(&engine);
    unlink(path);
    free((char *)path);
}

static void a_restart_file_has_its_name_only_when_it_is_whole(void **state)
{
    (void)state;
    struct gbg_engine *engine = made_engine(context, &standard);
    const char *path = made_path("r.rst"), *forces = made_path("f.nc");
    for (int save = 0; save < 3; save++) {
        memset(&diary, 0, sizeof diary);
        diary.on = ON_OTHERS;
        made_good(context, save < 2 ? gbg_engine_save(engine, path)
                                    : gbg_engine_write_forces(engine, forces));
        diary.on = OFF;
        assert_int_equal(diary.renames, save == 1 ? 2 : 1); /* PATH.previous, PATH */
        assert_int_equal(diary.unsynced_renames, 0);
        assert_int_equal(diary.pending, 0);
        assert_true(diary.directory_syncs > 0);
    }
    gbg_engine_destroy(&engine);
    unlink(path);
    unlink(forces);
    unlink(made_path("r.rst.previous"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_disc_that_a_crash_leaves_is_right),
        cmocka_unit_test(a_restart_file_has_its_name_only_when_it_is_whole),
    };
    return made_run(tests, "cpu:threads=1", &context);
}
