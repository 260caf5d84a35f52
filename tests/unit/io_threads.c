/* Test of files in several threads, each with a context of its own: netCDF itself knows no threads.
 */
#include <math.h>
#include <pthread.h>

#include "io_made.h"

enum { THREADS = 4, ROUNDS = 12, FRAMES = 3, N = 33 };

/* What a thread works on; nothing is asserted in a thread, `failures` is looked at afterwards. */
struct worker {
    int number, failures;
    struct gbg_context *context;
    struct gbg_engine *engine;
    char path[320], restart[320], forces[320];
};

static int write_frames(struct worker *worker, int round)
{
    struct gbg_trajectory *trajectory;
    int status = gbg_trajectory_create(worker->engine, worker->path, &trajectory);
    for (int f = 0; f < FRAMES && status == GBG_OK; f++) {
        made_set(worker->engine, 100 * worker->number + 10 * round + f);
        status = gbg_trajectory_append(trajectory, worker->engine);
    }
    gbg_trajectory_destroy(&trajectory);
    return status;
}

static int read_frames(struct worker *worker, int round)
{
    struct gbg_trajectory *trajectory;
    double x[N], y[N];
    int wrong = 0;
    int status = gbg_trajectory_open(worker->context, worker->path, &trajectory);
    for (int f = 0; f < FRAMES && status == GBG_OK; f++) {
        int64_t step = 100 * worker->number + 10 * round + f;
        status = gbg_trajectory_positions(trajectory, f, N, x, y, NULL, 1);
        for (int64_t i = 0; i < N; i++) {
            wrong += fabs(x[i] - made_coordinate(step, i, 0)) > 3e-13;
        }
    }
    gbg_trajectory_destroy(&trajectory);
    return status != GBG_OK || wrong > 0;
}

static void *work(void *argument)
{
    struct worker *worker = argument;
    for (int round = 0; round < ROUNDS; round++) {
        worker->failures += write_frames(worker, round) != GBG_OK;
        worker->failures += read_frames(worker, round);
        worker->failures += gbg_engine_save(worker->engine, worker->restart) != GBG_OK;
        worker->failures += gbg_engine_load(worker->engine, worker->restart) != GBG_OK;
        worker->failures += gbg_engine_write_forces(worker->engine, worker->forces) != GBG_OK;
    }
    return NULL;
}

static void threads_do_not_disturb_each_other(void **state)
{
    (void)state;
    static struct worker worker[THREADS];
    static const struct made made = {2, N, "double", 1, 0, 0, 0};
    pthread_t thread[THREADS];
    for (int k = 0; k < THREADS; k++) {
        char name[32];
        worker[k].number = k;
        snprintf(name, sizeof name, "%d", k);
        snprintf(worker[k].path, sizeof worker[k].path, "%s.nc", made_path(name));
        snprintf(worker[k].restart, sizeof worker[k].restart, "%s.rst", made_path(name));
        snprintf(worker[k].forces, sizeof worker[k].forces, "%s.forces.nc", made_path(name));
        made_good(NULL, gbg_context_create("cpu:threads=1", &worker[k].context));
        worker[k].engine = made_engine(worker[k].context, &made);
    }
    for (int k = 0; k < THREADS; k++) {
        assert_int_equal(pthread_create(&thread[k], NULL, work, &worker[k]), 0);
    }
    for (int k = 0; k < THREADS; k++) {
        char previous[340];
        assert_int_equal(pthread_join(thread[k], NULL), 0);
        if (worker[k].failures > 0) {
            fail_msg("thread %d: %s", k, gbg_message(worker[k].context));
        }
        gbg_engine_destroy(&worker[k].engine);
        gbg_context_destroy(&worker[k].context);
        snprintf(previous, sizeof previous, "%s.previous", worker[k].restart);
        unlink(previous);
        unlink(worker[k].path);
        unlink(worker[k].restart);
        unlink(worker[k].forces);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(threads_do_not_disturb_each_other),
    };
    return cmocka_run_group_tests(tests, made_start, made_stop);
}
