/* Tests of frames that are copied from a GPU while the next steps run: the files of the CPU, byte
 * for byte; frames outlive their engine; without memory they are written at once. */
#include "both.h"
#include "core/memory.h"
#include "gamboge/trajectory.h"
#include "made_files.h"

#ifdef GBG_WITH_CUDA
extern int64_t gbg_cuda_live(void); /* arrays on the GPU */
#else
static int64_t gbg_cuda_live(void)
{
    return 0;
}
#endif

enum { FRAMES = 12, STEPS_BETWEEN = 7 };

static struct made_particles made;

static void same_files(const char *a, const char *b)
{
    made_same_content(a, b);
    assert_int_equal(unlink(a), 0);
    assert_int_equal(unlink(b), 0);
}

static void good(struct gbg_engine *engine, int status)
{
    if (status != GBG_OK) {
        fail_msg("%s: %s", gbg_status_name(status), gbg_message(engine->context));
    }
}

static struct gbg_scene discs(int dimension, int images, int overlap, int is_double)
{
    double length[3] = {1.3 * 16, 1.32 * 16, 1.31 * 16};
    struct gbg_scene scene = made_scene(NULL, dimension, length);
    int64_t m = dimension == 2 ? 64 : 16; /* 4096 particles */
    for (int a = 0; a < dimension && dimension == 2; a++) {
        scene.length[a] *= 4.0;
    }
    scene.n_forces = 1;
    scene.force[0] = (struct gbg_force){.power = 6.0, .sum = GBG_SUM_CUTOFF, .cutoff = 2.5};
    scene.dt = 0.01;
    scene.unwrapped = images;
    scene.overlap = overlap;
    scene.output_double = is_double;
    made_lattice(&made, &scene, m, 0.02);
    return scene;
}

typedef int (*add_frame)(struct gbg_trajectory *, struct gbg_engine *);

/* A frame each STEPS_BETWEEN steps, the first before any. */
static void write_frames(struct gbg_engine *engine, const char *path, add_frame add)
{
    struct gbg_trajectory *trajectory;
    good(engine, gbg_trajectory_create(engine, path, &trajectory));
    for (int f = 0; f < FRAMES; f++) {
        good(engine, add(trajectory, engine));
        good(engine, gbg_engine_advance(engine, STEPS_BETWEEN));
    }
    good(engine, gbg_trajectory_destroy(&trajectory));
}

static void compare(struct gbg_scene scene, int ordering, add_frame add)
{
    struct both both = both_make(scene, &made);
    const char *cpu = made_path("cpu.nc"), *gpu = made_path("gpu.nc");
    for (int b = 0; b < 2; b++) {
        both.engine[b]->ordering = ordering;
    }
    write_frames(both.engine[0], cpu, gbg_trajectory_append);
    write_frames(both.engine[1], gpu, add);
    assert_int_equal(both.engine[1]->state.rank != NULL, ordering == GBG_ORDERING_ALWAYS);
    same_files(cpu, gpu);
    both_free(&both);
    assert_int_equal(gbg_cuda_live(), 0);
}

static void the_files_of_the_cpu(void **state)
{
    (void)state;
    for (int set = 0; set < 16; set++) {
        compare(discs(set & 1 ? 3 : 2, set >> 1 & 1, set >> 2 & 1, set >> 3 & 1),
                GBG_ORDERING_NEVER, gbg_trajectory_append_begin);
    }
    for (int dimension = 2; dimension <= 3; dimension++) {
        struct gbg_scene scene = discs(dimension, 1, 1, 1);
        compare(scene, GBG_ORDERING_NEVER, gbg_trajectory_append);
        compare(scene, GBG_ORDERING_ALWAYS, gbg_trajectory_append);
        compare(scene, GBG_ORDERING_ALWAYS, gbg_trajectory_append_begin);
    }
}

/* One frame is on its way when the engine goes, another when the next engine of the same scene has
 * begun, which stands on the CPU. */
static void frames_outlive_their_engine(void **state)
{
    (void)state;
    struct gbg_scene scene = discs(2, 1, 1, 1);
    struct both both = both_make(scene, &made);
    struct gbg_trajectory *trajectory;
    const char *cpu = made_path("cpu.nc"), *gpu = made_path("gpu.nc");
    good(both.engine[0], gbg_trajectory_create(both.engine[0], cpu, &trajectory));
    good(both.engine[0], gbg_trajectory_append(trajectory, both.engine[0]));
    good(both.engine[0], gbg_engine_advance(both.engine[0], 10));
    good(both.engine[0], gbg_trajectory_append(trajectory, both.engine[0]));
    good(both.engine[0], gbg_trajectory_append(trajectory, both.engine[0]));
    good(both.engine[0], gbg_trajectory_destroy(&trajectory));

    struct gbg_engine *engine = both.engine[1];
    good(engine, gbg_trajectory_create(engine, gpu, &trajectory));
    good(engine, gbg_trajectory_append_begin(trajectory, engine));
    good(engine, gbg_engine_advance(engine, 10));
    good(engine, gbg_trajectory_append_begin(trajectory, engine));
    gbg_engine_free(engine);
    both.engine[1] = NULL;
    good(both.engine[0], gbg_trajectory_append_begin(trajectory, both.engine[0]));
    good(both.engine[0], gbg_trajectory_destroy(&trajectory));
    same_files(cpu, gpu);
    gbg_engine_free(both.engine[0]);
    gbg_context_destroy(&both.context[0]);
    gbg_context_destroy(&both.context[1]);
    assert_int_equal(gbg_cuda_live(), 0);
}

/* Each allocation of a frame's way fails once, on the host and on the GPU. */
static void without_memory_frames_are_written_at_once(void **state)
{
    (void)state;
    struct gbg_scene scene = discs(2, 1, 1, 1);
    for (int64_t n = 1; n <= 6; n++) {
        struct both both = both_make(scene, &made);
        struct gbg_trajectory *trajectory;
        const char *cpu = made_path("cpu.nc"), *gpu = made_path("gpu.nc");
        write_frames(both.engine[0], cpu, gbg_trajectory_append);
        struct gbg_engine *engine = both.engine[1];
        good(engine, gbg_trajectory_create(engine, gpu, &trajectory));
        for (int f = 0; f < FRAMES; f++) {
            gbg_memory_fail_after(f == n % 2 ? n : 0); /* in the first slot or in the second */
            int status = gbg_trajectory_append_begin(trajectory, engine);
            gbg_memory_fail_after(0);
            good(engine, status);
            good(engine, gbg_engine_advance(engine, STEPS_BETWEEN));
        }
        good(engine, gbg_trajectory_destroy(&trajectory));
        same_files(cpu, gpu);
        both_free(&both);
        assert_int_equal(gbg_cuda_live(), 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_files_of_the_cpu),
        cmocka_unit_test(frames_outlive_their_engine),
        cmocka_unit_test(without_memory_frames_are_written_at_once),
    };
    return both_missing() ? BOTH_SKIPPED : cmocka_run_group_tests(tests, made_start, made_stop);
}
