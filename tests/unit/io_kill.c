/* Test of writers that are killed at random instants: io_kill [KILLS]. A child appends frames and
 * saves restart files until it is killed; every file that it leaves is read. */
#include <dirent.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <sys/wait.h>
#include <time.h>

#include "io_made.h"

static int kills = 50; /* in all */
static struct gbg_context *context;
static const struct made standard = {2, 301, "double", 1, 1, 0, 0};
static const char old_content[] = "an older file";
/* later: the backend copies frames, which are written while the engine goes on; a restart file is
 * saved now and then, and at most two frames are in flight. */
static int later;

enum { SAVES = 3 }; /* frames to a restart file, with later */

static int save(struct gbg_trajectory *trajectory, struct gbg_engine *engine, const char *restart)
{
    int64_t step;
    int status = gbg_engine_integer(engine, "step", &step);
    if (later && step % SAVES != 0) {
        return status;
    }
    status = status ? status : gbg_trajectory_append_end(trajectory);
    return status ? status : gbg_engine_save(engine, restart);
}

/* Never returns; what it has finished goes into the pipe. */
static void write_until_killed(struct gbg_engine *engine, const char *path, const char *restart,
                               int report)
{
    struct gbg_trajectory *trajectory;
    if (gbg_trajectory_create(engine, path, &trajectory) != GBG_OK) {
        _exit(1);
    }
    for (int64_t step = 1;; step++) {
        made_set(engine, step);
        if ((later ? gbg_trajectory_append_begin : gbg_trajectory_append)(trajectory, engine) ||
            write(report, &step, sizeof step) != sizeof step || save(trajectory, engine, restart)) {
            _exit(1);
        }
    }
}

static uint64_t next_random(void)
{
    static uint64_t draws;
    struct gbg_philox r = gbg_philox(gbg_philox_counter(draws++, 0, 201), 77, 0);
    return (uint64_t)r.word[0] << 32 | r.word[1];
}

static long now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (long)(time.tv_sec % 1000000) * 1000000000L + time.tv_nsec;
}

/* Nanoseconds that a frame and a restart file take, so that kills fall on all parts of the work on
 * a slow machine as on a fast one. */
static long time_of_a_round(struct gbg_engine *engine, const char *path, const char *restart)
{
    struct gbg_trajectory *trajectory;
    long begin = now();
    made_good(context, gbg_trajectory_create(engine, path, &trajectory));
    for (int64_t step = 1; step <= 10; step++) {
        made_set(engine, step);
        made_good(context, gbg_trajectory_append(trajectory, engine));
        made_good(context, gbg_engine_save(engine, restart));
    }
    gbg_trajectory_destroy(&trajectory);
    unlink(restart);
    unlink(made_path("r.rst.previous"));
    return (now() - begin) / 10;
}

/* Kills the child within the time of ten rounds; the number of frames that it reported. */
static int64_t run_child(struct gbg_engine *engine, const char *path, const char *restart,
                         long round)
{
    int ends[2], status;
    assert_int_equal(pipe(ends), 0);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        write_until_killed(engine, path, restart, ends[1]);
    }
    close(ends[1]);
    long wait = (long)(next_random() % (uint64_t)(10 * round));
    nanosleep(&(struct timespec){wait / 1000000000, wait % 1000000000}, NULL);
    kill(child, SIGKILL);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFSIGNALED(status)); /* it did not end by itself */
    int64_t reported = 0, step;
    while (read(ends[0], &step, sizeof step) == sizeof step) {
        assert_int_equal(step, reported + 1);
        reported = step;
    }
    close(ends[0]);
    return reported;
}

static void check_frame(struct gbg_trajectory *trajectory, int64_t f)
{
    double time, length[3], x[301], y[301];
    int32_t image[301], other[301];
    int64_t step, n = standard.n;
    made_good(context, gbg_trajectory_frame(trajectory, f, &time, &step, length, NULL));
    assert_int_equal(step, f + 1);
    assert_true(length[0] == made_length[0] && fabs(time - 0.01 * (double)step) < 1e-12);
    made_good(context, gbg_trajectory_positions(trajectory, f, n, x, y, NULL, 1));
    made_good(context, gbg_trajectory_images(trajectory, f, n, image, other, NULL, 1));
    for (int64_t i = 0; i < n; i++) {
        assert_true(fabs(x[i] - made_coordinate(step, i, 0)) <= 3e-13);
        assert_true(fabs(y[i] - made_coordinate(step, i, 1)) <= 3e-13);
        assert_int_equal(image[i], made_image(step, i, 0));
        assert_int_equal(other[i], made_image(step, i, 1));
    }
    made_good(context, gbg_trajectory_overlapped(trajectory, f, n, image));
    for (int64_t i = 0; i < n; i++) {
        assert_int_equal(image[i], made_flag(step, i));
    }
}

/* The old file, or all finished frames and at most the one in flight. */
static int64_t check_trajectory(const char *path, int64_t reported)
{
    struct gbg_trajectory *trajectory;
    char text[sizeof old_content] = "";
    int64_t frames;
    int file = open(path, O_RDONLY);
    assert_int_equal(read(file, text, sizeof text - 1), sizeof text - 1);
    close(file);
    if (strcmp(text, old_content) == 0) {
        assert_true(reported <= (later ? 2 : 0));
        return 0;
    }
    made_good(context, gbg_trajectory_open(context, path, &trajectory));
    made_good(context, gbg_trajectory_size(trajectory, &frames, NULL, NULL, NULL));
    assert_true(frames >= reported - (later ? 2 : 0) && frames <= reported + 1);
    for (int64_t f = 0; f < frames; f++) {
        check_frame(trajectory, f);
    }
    gbg_trajectory_destroy(&trajectory);
    return frames;
}

/* PATH is never missing once it was there, and always whole. */
static void check_restart(struct gbg_engine *engine, const char *restart, int64_t reported,
                          int64_t frames)
{
    if (access(restart, F_OK) != 0) {
        assert_true(reported <= (later ? SAVES : 1));
        return;
    }
    int64_t step;
    made_good(context, gbg_engine_load(engine, restart));
    made_good(context, gbg_engine_integer(engine, "step", &step));
    assert_true(step <= reported && step >= reported - (later ? SAVES : 1));
    assert_true(step <= frames); /* the run that goes on lacks none */
}

/* The run goes on from its restart file, and the trajectory with it. */
static void check_going_on(struct gbg_engine *engine, const char *path, int64_t frames)
{
    struct gbg_trajectory *trajectory;
    int64_t step;
    made_good(context, gbg_engine_integer(engine, "step", &step));
    made_good(context, gbg_trajectory_continue(engine, path, &trajectory));
    made_set(engine, step + 1);
    made_good(context, gbg_trajectory_append(trajectory, engine));
    gbg_trajectory_destroy(&trajectory);
    int64_t kept = step < frames ? step : frames;
    assert_int_equal(check_trajectory(path, kept + 1), kept + 1);
}

static int remove_partial_files(void)
{
    int removed = 0;
    DIR *directory = opendir(made_directory);
    for (struct dirent *entry; (entry = readdir(directory));) {
        if (strstr(entry->d_name, ".partial")) {
            removed += unlink(made_path(entry->d_name)) == 0;
        }
    }
    closedir(directory);
    return removed;
}

static void kill_writers(int times)
{
    struct gbg_engine *engine = made_engine(context, &standard);
    const char *path = strdup(made_path("t.nc")), *restart = strdup(made_path("r.rst"));
    int64_t total = 0;
    long round = time_of_a_round(engine, path, restart);
    int without = 0, partial = 0;
    for (int k = 0; k < times; k++) {
        FILE *file = fopen(path, "wb");
        fputs(old_content, file);
        fclose(file);
        made_set(engine, 0);
        int64_t reported = run_child(engine, path, restart, round);
        int64_t frames = check_trajectory(path, reported);
        check_restart(engine, restart, reported, frames);
        if (frames > 0 && access(restart, F_OK) == 0) {
            check_going_on(engine, path, frames);
        }
        total += frames;
        without += frames == 0;
        partial += remove_partial_files();
        unlink(restart);
        unlink(made_path("r.rst.previous"));
    }
    print_message("%d kills, %lld frames survived, all right; %d kills before the first frame, "
                  "%d temporary files left behind\n",
                  times, (long long)total, without, partial);
    assert_true(total > 0 && without < times); /* else it has tested nothing */
    unlink(path);
    free((char *)path);
    free((char *)restart);
    gbg_engine_destroy(&engine);
}

static void killed_writers_lose_at_most_the_frame_in_flight(void **state)
{
    (void)state;
    later = 0;
    made_good(NULL, gbg_context_create("cpu:threads=1", &context));
    kill_writers(kills - kills / 2);
    gbg_context_destroy(&context);
}

static void killed_while_the_engine_goes_on(void **state)
{
    (void)state;
    later = 1;
    made_good(NULL, gbg_context_create("poison:threads=1", &context));
    kill_writers(kills / 2);
    gbg_context_destroy(&context);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(killed_writers_lose_at_most_the_frame_in_flight),
        cmocka_unit_test(killed_while_the_engine_goes_on),
    };
    kills = argc > 1 ? atoi(argv[1]) : kills;
    return cmocka_run_group_tests(tests, made_start, made_stop);
}
