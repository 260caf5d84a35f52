/* Tests of a GPU that is lost in mid-run: every call answers with the first failure's sentence,
 * nothing hangs, finished frames are whole, and the CPU goes on. The loss is played: from some call
 * of the CUDA runtime on, all that can fail do (the linker puts the functions below in their
 * place), for every such call of a run. With GBG_TESTS_MAY_FAULT in the environment a kernel also
 * writes where there is no memory; on a card that others use nobody should. */
#include <cuda_runtime_api.h>
#include <sys/stat.h>
#include <unistd.h>

#include "both.h"
#include "gamboge/trajectory.h"

enum { PATIENCE = 240 }; /* seconds: a call that hangs ends the test */
enum { STEPS = 4, FRAMES = 6, FAILURE = cudaErrorLaunchFailure };

extern int64_t gbg_cuda_live(void); /* arrays on the GPU */

static struct made_particles made;
static int64_t calls, lost_at; /* calls so far; the one that finds no card any more, 0: none */

static int lost(void)
{
    int64_t call = __atomic_add_fetch(&calls, 1, __ATOMIC_RELAXED);
    int64_t at = __atomic_load_n(&lost_at, __ATOMIC_RELAXED);
    return at > 0 && call >= at;
}

static void lose_after(int64_t n)
{
    __atomic_store_n(&calls, 0, __ATOMIC_RELAXED);
    __atomic_store_n(&lost_at, n, __ATOMIC_RELAXED);
}

/* The card is there in truth: what waits for it still does, so that no memory is freed too early.
 */
#define WAITING(name, parameters, arguments)                                                       \
    cudaError_t __real_##name parameters;                                                          \
    cudaError_t __wrap_##name parameters;                                                          \
    cudaError_t __wrap_##name parameters                                                           \
    {                                                                                              \
        cudaError_t error = __real_##name arguments;                                               \
        return lost() ? (cudaError_t)FAILURE : error;                                              \
    }
#define ACTING(name, parameters, arguments)                                                        \
    cudaError_t __real_##name parameters;                                                          \
    cudaError_t __wrap_##name parameters;                                                          \
    cudaError_t __wrap_##name parameters                                                           \
    {                                                                                              \
        return lost() ? (cudaError_t)FAILURE : __real_##name arguments;                            \
    }

WAITING(cudaGetLastError, (void), ())
WAITING(cudaSetDevice, (int device), (device))
WAITING(cudaStreamSynchronize, (cudaStream_t stream), (stream))
WAITING(cudaEventSynchronize, (cudaEvent_t event), (event))
ACTING(cudaEventRecord, (cudaEvent_t event, cudaStream_t stream), (event, stream))
ACTING(cudaStreamWaitEvent, (cudaStream_t stream, cudaEvent_t event, unsigned flags),
       (stream, event, flags))
ACTING(cudaMalloc, (void **pointer, size_t bytes), (pointer, bytes))
ACTING(cudaMallocHost, (void **pointer, size_t bytes), (pointer, bytes))
ACTING(cudaMemsetAsync, (void *pointer, int value, size_t bytes, cudaStream_t stream),
       (pointer, value, bytes, stream))
ACTING(cudaMemcpyAsync,
       (void *to, const void *from, size_t bytes, enum cudaMemcpyKind kind, cudaStream_t stream),
       (to, from, bytes, kind, stream))
ACTING(cudaLaunchCooperativeKernel,
       (const void *kernel, struct dim3 grid, struct dim3 block, void **arguments, size_t shared,
        cudaStream_t stream),
       (kernel, grid, block, arguments, shared, stream))
ACTING(cudaLaunchKernelExC,
       (const cudaLaunchConfig_t *config, const void *kernel, void **arguments),
       (config, kernel, arguments))

static struct gbg_scene scene_of(struct gbg_context *context, int rule, int n_forces)
{
    double length[2] = {14.0, 13.0};
    struct gbg_scene scene = made_scene(context, 2, length);
    scene.rule = rule;
    scene.n_forces = n_forces;
    scene.force[0] = (struct gbg_force){.power = 6.0, .sum = GBG_SUM_CUTOFF, .cutoff = 2.5};
    scene.unwrapped = 1;
    scene.output_double = 1;
    made_lattice(&made, &scene, 10, 0.02);
    return scene;
}

static char directory[] = "/tmp/gbg_lost_XXXXXX";

static char lost_path[64], whole_path[64], restart_path[64];

static unsigned char *content(const char *path, size_t *bytes)
{
    struct stat about;
    *bytes = 0;
    if (stat(path, &about) != 0) {
        return NULL;
    }
    *bytes = (size_t)about.st_size;
    unsigned char *data = malloc(*bytes + 1);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fread(data, 1, *bytes, file), *bytes);
    fclose(file);
    return data;
}

/* The frames of the file, which are the first of the whole one, byte for byte, and nothing else;
 * the whole one has FRAMES, and one record has as many bytes as two whole ones differ by. */
static int64_t finished_frames(const char *path, const unsigned char *whole, size_t bytes,
                               size_t record)
{
    size_t there;
    unsigned char *data = content(path, &there);
    if (!data) {
        return 0; /* it was lost before the first one */
    }
    int64_t frames = (int64_t)data[4] << 24 | data[5] << 16 | data[6] << 8 | data[7];
    assert_true(frames >= 1 && frames <= FRAMES);
    assert_int_equal(there, bytes - (size_t)(FRAMES - frames) * record);
    assert_memory_equal(data, whole, 4);
    assert_memory_equal(data + 8, whole + 8, there - 8);
    free(data);
    return frames;
}

static void good(const struct gbg_context *context, int status)
{
    if (status != GBG_OK) {
        fail_msg("%s: %s", gbg_status_name(status), gbg_message(context));
    }
}

/* Every call on an engine whose card is gone says so, all with the words of the first. */
static void all_calls_say(struct gbg_engine *gpu)
{
    char text[65], first[1024];
    double x[100];
    uint64_t step = gpu->step;
    for (int call = 0; call < 5; call++) {
        int status = call == 1   ? gbg_engine_decode(gpu, 1, 0, x, 1)
                     : call == 2 ? gbg_engine_digest(gpu, text)
                     : call == 3 ? gbg_engine_save(gpu, restart_path)
                                 : gbg_engine_advance(gpu, 1);
        const char *words = strstr(gbg_message(gpu->context), "cuda:0: ");
        assert_int_equal(status, GBG_E_DEVICE);
        assert_non_null(words);
        if (call == 0) {
            snprintf(first, sizeof first, "%s", words);
        }
        assert_string_equal(words, first);
    }
    assert_int_equal(gpu->step, step);
    assert_int_not_equal(access(restart_path, F_OK), 0);
}

/* A run with frames on a card that goes away at the n-th call. 1: it did not come to that. */
static int run_until_lost(struct gbg_scene scene, int64_t n, const char *path)
{
    struct gbg_context *context = scene.context;
    struct gbg_engine *engine = NULL;
    struct gbg_trajectory *trajectory = NULL;
    char first[1024] = "";
    lose_after(n);
    int status = gbg_engine_make(&scene, &made.p, &engine);
    status = status ? status : gbg_trajectory_create(engine, path, &trajectory);
    for (int f = 0; f < FRAMES && status == GBG_OK; f++) {
        status = gbg_trajectory_append_begin(trajectory, engine);
        status = status ? status : gbg_engine_advance(engine, STEPS);
    }
    status = status ? status : gbg_trajectory_append_end(trajectory);
    if (status != GBG_OK) {
        snprintf(first, sizeof first, "%s", gbg_message(context));
        /* CUB, which asks for the device's number itself, makes another error of it */
        if (status != GBG_E_DEVICE || !strstr(first, "cuda:0: ") ||
            (!strstr(first, "cudaErrorLaunchFailure") &&
             !strstr(first, "cudaErrorInvalidDevice"))) {
            fail_msg("call %lld: %s: %s", (long long)n, gbg_status_name(status), first);
        }
    }
    if (status != GBG_OK && engine) {
        all_calls_say(engine);
    }
    int ended = gbg_trajectory_destroy(&trajectory);
    assert_true(ended == GBG_OK || ended == GBG_E_DEVICE);
    gbg_engine_free(engine);
    lose_after(0);
    assert_int_equal(gbg_cuda_live(), 0);
    return status == GBG_OK;
}

/* The file of a run on the CPU. */
static unsigned char *whole_file(int rule, int n_forces, int frames, size_t *bytes)
{
    struct gbg_context *context = made_context("cpu:threads=1");
    struct gbg_scene scene = scene_of(context, rule, n_forces);
    struct gbg_engine *engine = made_engine(&scene, &made);
    struct gbg_trajectory *trajectory;
    const char *path = whole_path;
    good(context, gbg_trajectory_create(engine, path, &trajectory));
    for (int f = 0; f < frames; f++) {
        good(context, gbg_trajectory_append(trajectory, engine));
        good(context, gbg_engine_advance(engine, STEPS));
    }
    good(context, gbg_trajectory_destroy(&trajectory));
    gbg_engine_free(engine);
    gbg_context_destroy(&context);
    unsigned char *data = content(path, bytes);
    unlink(path);
    return data;
}

static void lose_everywhere(int rule, int n_forces)
{
    size_t bytes, shorter;
    unsigned char *whole = whole_file(rule, n_forces, FRAMES, &bytes);
    free(whole_file(rule, n_forces, FRAMES - 1, &shorter));
    struct gbg_context *context = made_context("cuda:0");
    struct gbg_scene scene = scene_of(context, rule, n_forces);
    const char *path = lost_path;
    int64_t runs = 0, frames = 0, most = 0;
    /* every call of the first ones, later ones more and more rarely */
    for (int64_t n = 1, whole_run = 0; !whole_run; n += 1 + n / 24, runs++) {
        whole_run = run_until_lost(scene, n, path);
        frames = finished_frames(path, whole, bytes, bytes - shorter);
        most = frames > most && !whole_run ? frames : most;
        unlink(path);
    }
    assert_int_equal(frames, FRAMES); /* of the last run, which nothing befell */
    assert_true(runs > 30 && most >= FRAMES / 2);
    print_message("lost at each of %lld calls; up to %lld of %d frames were finished\n",
                  (long long)runs - 1, (long long)most, FRAMES);
    free(whole);
    gbg_context_destroy(&context);
}

static void a_lost_card_is_told_and_finished_frames_stay(void **state)
{
    (void)state;
    lose_everywhere(GBG_RULE_NONE, 0);
    lose_everywhere(GBG_RULE_BOUNCE, 1);
    lose_everywhere(GBG_RULE_BRIDGE, 1);
}

static void a_fault_in_a_kernel(void **state)
{
    (void)state;
    if (!getenv("GBG_TESTS_MAY_FAULT")) {
        print_message("skipped: it spoils the card for this process and is noted by the driver; "
                      "set GBG_TESTS_MAY_FAULT=1 to run it\n");
        skip();
    }
    char first[1024];
    struct gbg_engine *another = NULL;
    struct both both = both_make(scene_of(NULL, GBG_RULE_NONE, 0), &made);
    struct gbg_engine *gpu = both.engine[1];
    good(both.context[1], gbg_engine_advance(gpu, 2));
    uint32_t *high = gpu->state.high[0];
    gpu->state.high[0] = (uint32_t *)(uintptr_t)4096;
    assert_int_equal(gbg_engine_advance(gpu, 1), GBG_E_DEVICE);
    gpu->state.high[0] = high;
    snprintf(first, sizeof first, "%s", gbg_message(both.context[1]));
    print_message("%s\n", first);
    assert_non_null(strstr(first, "cuda:0: "));
    assert_non_null(strstr(first, "cudaError"));
    all_calls_say(gpu);
    struct gbg_scene scene = scene_of(both.context[1], GBG_RULE_NONE, 0);
    assert_int_equal(gbg_engine_make(&scene, &made.p, &another), GBG_E_DEVICE);
    assert_null(another);
    good(both.context[0], gbg_engine_advance(both.engine[0], 5));
    both_free(&both);
}

static int start(void **state)
{
    (void)state;
    char *made_folder = mkdtemp(directory);
    snprintf(lost_path, sizeof lost_path, "%s/lost.nc", directory);
    snprintf(whole_path, sizeof whole_path, "%s/whole.nc", directory);
    snprintf(restart_path, sizeof restart_path, "%s/r.restart", directory);
    return made_folder ? 0 : -1;
}

static int stop(void **state)
{
    (void)state;
    return rmdir(directory);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_lost_card_is_told_and_finished_frames_stay),
        cmocka_unit_test(a_fault_in_a_kernel), /* the last: no other could use the card */
    };
    if (both_missing()) {
        return BOTH_SKIPPED;
    }
    alarm(PATIENCE);
    return cmocka_run_group_tests(tests, start, stop);
}
