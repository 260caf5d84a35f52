/* Tests of frames that are written while the engine goes on, with the backend `poison`, whose
 * copies go the way of a GPU's: the same bytes as append, nothing lost, every failure reported. */
#include <signal.h>
#include <sys/resource.h>
#include <time.h>

#include "core/memory.h"
#include "io_made.h"

static const struct made standard = {2, 301, "double", 1, 1, 0, 0};
static struct gbg_context *context;

static void said(const char *words)
{
    if (!strstr(gbg_message(context), words)) {
        fail_msg("no \"%s\" in: %s", words, gbg_message(context));
    }
}

static struct gbg_trajectory *create(struct gbg_engine *engine, const char *path)
{
    struct gbg_trajectory *trajectory;
    made_good(context, gbg_trajectory_create(engine, path, &trajectory));
    return trajectory;
}

/* The state changes at once after each: what is written must not. */
static void begin_steps(struct gbg_trajectory *trajectory, struct gbg_engine *engine, int first,
                        int last)
{
    for (int step = first; step <= last; step++) {
        made_set(engine, step);
        made_good(context, gbg_trajectory_append_begin(trajectory, engine));
        made_set(engine, 1000 + step);
    }
}

static int64_t frames_of(const struct gbg_trajectory *trajectory)
{
    int64_t frames;
    made_good(context, gbg_trajectory_size(trajectory, &frames, NULL, NULL, NULL));
    return frames;
}

/* The file that append makes of these steps, under the name whole.nc. */
static const char *whole_file(struct gbg_engine *engine, int last)
{
    const char *path = made_path("whole.nc");
    struct gbg_trajectory *trajectory = create(engine, path);
    made_append(trajectory, engine, 1, last);
    made_good(context, gbg_trajectory_destroy(&trajectory));
    return path;
}

/* Particles at places that are not those of their ids. */
static void permute(struct gbg_engine *engine)
{
    struct gbg_state *state = &engine->state;
    int64_t n = state->owned;
    const struct gbg_backend *backend = engine->backend;
    if (!state->id) {
        made_good(context, backend->allocate(engine->device, (void **)&state->id, n, 8, "ids"));
    }
    made_good(context, backend->allocate(engine->device, (void **)&state->rank, n, 4, "ranks"));
    for (int64_t i = 0; i < n; i++) {
        state->rank[i] = (int32_t)((5 * i + 3) % n);
        state->id[i] = (uint64_t)state->rank[i];
    }
    state->epoch++;
}

static void check_same(const struct made *made, int permuted)
{
    enum { LAST = 7 };
    struct gbg_engine *engine = made_engine(context, made);
    const char *path = made_path("later.nc");
    if (permuted) {
        permute(engine);
    }
    const char *whole = whole_file(engine, LAST);
    struct gbg_trajectory *trajectory = create(engine, path);
    begin_steps(trajectory, engine, 1, 3);
    made_good(context, gbg_trajectory_append_end(trajectory));
    assert_int_equal(frames_of(trajectory), 3);
    made_append(trajectory, engine, 4, 4); /* both kinds in one file */
    begin_steps(trajectory, engine, 5, LAST);
    made_good(context, gbg_trajectory_destroy(&trajectory));
    made_same_content(path, whole);
    gbg_engine_destroy(&engine);
    unlink(path);
    unlink(whole);
}

static void same_bytes_as_append(void **state)
{
    (void)state;
    for (int set = 0; set < 16; set++) {
        struct made made = {.dimension = set & 1 ? 3 : 2,
                            .n = set & 2 ? 4097 : 1, /* more than a chunk of the writer */
                            .precision = set & 4 ? "float" : "double",
                            .unwrapped = set >> 3 & 1,
                            .overlap = set % 3 == 0,
                            .spread_ids = set % 5 == 0};
        check_same(&made, 0);
    }
    check_same(&standard, 1);
    check_same(&(struct made){3, 8193, "float", 1, 1, 0, 0}, 1);
}

static void frames_outlive_their_engine(void **state)
{
    (void)state;
    struct gbg_engine *engine = made_engine(context, &standard), *other;
    const char *path = made_path("later.nc"), *whole = whole_file(engine, 5);
    struct gbg_trajectory *trajectory = create(engine, path);
    begin_steps(trajectory, engine, 1, 2);
    gbg_engine_destroy(&engine);
    struct gbg_context *cpu; /* an engine that is read at any time, then one with copies again */
    made_good(NULL, gbg_context_create("cpu:threads=1", &cpu));
    other = made_engine(cpu, &standard);
    begin_steps(trajectory, other, 3, 3);
    gbg_engine_destroy(&other);
    engine = made_engine(context, &standard);
    begin_steps(trajectory, engine, 4, 5);
    gbg_engine_destroy(&engine);
    made_good(context, gbg_trajectory_destroy(&trajectory));
    gbg_context_destroy(&cpu);
    made_same_content(path, whole);
    unlink(path);
    unlink(whole);
}

static void refusals(void **state)
{
    (void)state;
    struct gbg_engine *engine = made_engine(context, &standard);
    const char *path = made_path("later.nc");
    struct gbg_trajectory *trajectory = create(engine, path);
    made_refused(context, gbg_trajectory_append_begin(trajectory, NULL), GBG_E_ARGUMENT,
                 "engine is NULL");
    assert_int_equal(gbg_trajectory_append_begin(NULL, engine), GBG_E_ARGUMENT);
    assert_int_equal(gbg_trajectory_append_end(NULL), GBG_E_ARGUMENT);
    made_good(context, gbg_trajectory_append_end(trajectory)); /* nothing to wait for */
    begin_steps(trajectory, engine, 7, 7);
    made_set(engine, 6); /* also against a frame that is not in the file yet */
    made_refused(context, gbg_trajectory_append_begin(trajectory, engine), GBG_E_ORDER,
                 "already at step 7");
    made_refused(context, gbg_trajectory_append(trajectory, engine), GBG_E_ORDER,
                 "already at step 7");
    made_good(context, gbg_trajectory_append_end(trajectory));
    assert_int_equal(frames_of(trajectory), 1);
    made_good(context, gbg_trajectory_destroy(&trajectory));
    made_good(context, gbg_trajectory_open(context, path, &trajectory));
    made_refused(context, gbg_trajectory_append_begin(trajectory, engine), GBG_E_ORDER,
                 "to be read");
    made_refused(context, gbg_trajectory_append_end(trajectory), GBG_E_ORDER, "to be read");
    gbg_trajectory_destroy(&trajectory);
    gbg_engine_destroy(&engine);
    unlink(path);
}

/* Whichever call comes next hears of the failure, once, and adds nothing. */
static int next_call(int call, struct gbg_trajectory **trajectory, struct gbg_engine *engine)
{
    made_set(engine, 9);
    return call == 0   ? gbg_trajectory_append_end(*trajectory)
           : call == 1 ? gbg_trajectory_append(*trajectory, engine)
                       : gbg_trajectory_destroy(trajectory);
}

/* A full disc, played by the limit of the size of files: frames behind the first that found no room
 * are dropped, those before stay, and with room again the file grows as if nothing had been. */
static void a_full_disc_is_reported(void **state)
{
    (void)state;
    struct rlimit former, tight;
    struct gbg_engine *engine = made_engine(context, &standard);
    const char *path = made_path("later.nc"), *whole = whole_file(engine, 3);
    size_t three, bytes;
    free(made_content(whole, &three));
    whole_file(engine, 6);
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &former);
    for (int call = 0; call < 3; call++) {
        struct gbg_trajectory *trajectory = create(engine, path);
        begin_steps(trajectory, engine, 1, 3);
        made_good(context, gbg_trajectory_append_end(trajectory));
        tight = former;
        tight.rlim_cur = three + 57;
        setrlimit(RLIMIT_FSIZE, &tight);
        made_set(engine, 4);
        made_good(context, gbg_trajectory_append_begin(trajectory, engine));
        made_set(engine, 5); /* dropped, or told of the failure */
        int dropped = gbg_trajectory_append_begin(trajectory, engine) == GBG_OK;
        if (dropped) {
            made_refused(context, next_call(call, &trajectory, engine), GBG_E_FILE,
                         "cannot write frame 3");
        }
        setrlimit(RLIMIT_FSIZE, &former);
        said("File too large");
        free(made_content(path, &bytes));
        assert_int_equal(bytes, three);
        if (trajectory && call < 2) {
            assert_int_equal(frames_of(trajectory), 3);
            begin_steps(trajectory, engine, 4, 6);
            made_good(context, gbg_trajectory_destroy(&trajectory));
            made_same_content(path, whole);
        }
        gbg_trajectory_destroy(&trajectory);
        unlink(path);
    }
    unlink(whole);
    gbg_engine_destroy(&engine);
}

/* Frames whose copies come; the one after them is lost, when the next was begun too. */
static int lost_after, next_begun;

static const char *wait_in_vain(struct gbg_slot *slot, struct gbg_frame *frame)
{
    if (lost_after-- != 0) {
        return gbg_backend_find("poison")->frame_wait(slot, frame);
    }
    while (!__atomic_load_n(&next_begun, __ATOMIC_ACQUIRE)) {
        nanosleep(&(struct timespec){0, 1000000}, NULL);
    }
    return "the card went away";
}

/* A GPU that is lost while a frame is on its way: the frame behind it is dropped, though its copy
 * came. */
static void a_lost_copy_is_reported(void **state)
{
    (void)state;
    struct gbg_engine *engine = made_engine(context, &standard);
    const char *path = made_path("later.nc"), *whole = whole_file(engine, 2);
    const struct gbg_backend *backend = engine->backend;
    struct gbg_backend failing = *backend;
    failing.frame_wait = wait_in_vain;
    engine->backend = &failing;
    lost_after = 2;
    struct gbg_trajectory *trajectory = create(engine, path);
    begin_steps(trajectory, engine, 1, 4);
    __atomic_store_n(&next_begun, 1, __ATOMIC_RELEASE);
    made_refused(context, gbg_trajectory_append_end(trajectory), GBG_E_DEVICE,
                 "the card went away");
    said("frame 2 is lost");
    made_good(context, gbg_trajectory_append_end(trajectory)); /* told once */
    assert_int_equal(frames_of(trajectory), 2);
    made_good(context, gbg_trajectory_destroy(&trajectory));
    made_same_content(path, whole);
    engine->backend = backend;
    gbg_engine_destroy(&engine);
    unlink(path);
    unlink(whole);
}

/* Without memory for copies frames are written at once, and the file is the same. */
static void without_memory_it_is_append(void **state)
{
    (void)state;
    struct gbg_engine *engine = made_engine(context, &standard);
    const char *path = made_path("later.nc"), *whole = whole_file(engine, 4);
    for (int64_t n = 1; n <= 6; n++) {
        struct gbg_trajectory *trajectory = create(engine, path);
        for (int step = 1; step <= 4; step++) {
            made_set(engine, step);
            gbg_memory_fail_after(step == 2 ? n : 0); /* the 2nd makes slot 1; the 1st all else */
            int status = gbg_trajectory_append_begin(trajectory, engine);
            gbg_memory_fail_after(0);
            made_good(context, status);
        }
        made_good(context, gbg_trajectory_destroy(&trajectory));
        made_same_content(path, whole);
        trajectory = create(engine, path);
        made_set(engine, 1);
        gbg_memory_fail_after(n);
        int status = gbg_trajectory_append_begin(trajectory, engine);
        gbg_memory_fail_after(0);
        made_good(context, status);
        begin_steps(trajectory, engine, 2, 4);
        made_good(context, gbg_trajectory_destroy(&trajectory));
        made_same_content(path, whole);
    }
    gbg_engine_destroy(&engine);
    unlink(path);
    unlink(whole);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_bytes_as_append),
        cmocka_unit_test(frames_outlive_their_engine),
        cmocka_unit_test(refusals),
        cmocka_unit_test(a_full_disc_is_reported),
        cmocka_unit_test(a_lost_copy_is_reported),
        cmocka_unit_test(without_memory_it_is_append),
    };
    return made_run(tests, "poison:threads=1", &context);
}
