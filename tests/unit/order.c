/* Tests: the order of particles in memory is renewed without changing anything that can be seen:
 * state, forces, images, overlap flags, files, messages. */
#include "made_scene.h"

#include "backend/cpu/cpu.h"
#include "gamboge/gamboge.h"

enum { MOST = 20000 };

/* A start in which memory and space have nothing in common: a jittered lattice, shuffled. */
struct start {
    int dimension;
    int64_t n;
    double length[3], r[3][MOST];
    int32_t species[MOST];
    int64_t id[MOST];
};

static void swap_particles(struct start *start, int64_t i, int64_t j)
{
    for (int a = 0; a < 3; a++) {
        double r = start->r[a][i];
        start->r[a][i] = start->r[a][j];
        start->r[a][j] = r;
    }
    int32_t species = start->species[i];
    start->species[i] = start->species[j];
    start->species[j] = species;
    int64_t id = start->id[i];
    start->id[i] = start->id[j];
    start->id[j] = id;
}

static void shuffle(struct start *start, uint64_t key, int with_ids)
{
    for (int64_t i = start->n - 1; i > 0; i--) {
        int64_t j = (int64_t)(made_uniform(key + (uint64_t)i) * (double)(i + 1));
        swap_particles(start, i, j);
        if (!with_ids) { /* the ids stay where they are */
            int64_t id = start->id[i];
            start->id[i] = start->id[j];
            start->id[j] = id;
        }
    }
}

static void make_lattice(struct start *start, int dimension, int64_t m, int own_ids)
{
    start->dimension = dimension;
    start->n = dimension == 2 ? m * m : m * m * m;
    assert_true(start->n <= MOST);
    for (int64_t i = 0; i < start->n; i++) {
        int64_t cell[3] = {i % m, i / m % m, i / m / m};
        for (int a = 0; a < 3; a++) {
            double spacing = 1.23 + 0.05 * a;
            start->length[a] = spacing * (double)m;
            start->r[a][i] =
                spacing * ((double)cell[a] + 0.1 * made_uniform((uint64_t)(3 * i + a)));
        }
        start->species[i] = (int32_t)(made_uniform((uint64_t)(100000 + i)) < 0.5);
        start->id[i] = own_ids ? 7 * i + 3 : i;
    }
}

static void make_start(struct start *start, int dimension, int64_t m, int own_ids)
{
    make_lattice(start, dimension, m, own_ids);
    shuffle(start, 200000, 0);
}

static struct gbg_engine *make_engine(struct gbg_context *context, const struct start *start,
                                      const char *rule, int ordering)
{
    struct gbg_scene *scene;
    struct gbg_engine *engine = NULL;
    int index, cores = strcmp(rule, "none") != 0;
    assert_int_equal(gbg_scene_create(context, start->dimension, &scene), GBG_OK);
    assert_int_equal(
        gbg_scene_add_species(scene, "A", 1.0, cores ? -1.0 : 1.0, 1.0, -1.0, -1, &index), GBG_OK);
    assert_int_equal(
        gbg_scene_add_species(scene, "B", 1.1, 1.0, cores ? -2.0 : 2.0, -1.0, -1, &index), GBG_OK);
    assert_int_equal(gbg_scene_set_box(scene, start->length, NULL), GBG_OK);
    assert_int_equal(gbg_scene_add_particles(scene, start->n, start->r[0], start->r[1],
                                             start->dimension == 3 ? start->r[2] : NULL, 1,
                                             start->species, 0, start->id),
                     GBG_OK);
    assert_int_equal(gbg_scene_add_force(scene, 6.0, "cutoff", 2.2, 0.0), GBG_OK);
    assert_int_equal(gbg_scene_set_real(scene, "dynamics.dt", 0.002), GBG_OK);
    assert_int_equal(gbg_scene_set_real(scene, "dynamics.temperature", 0.5), GBG_OK);
    assert_int_equal(gbg_scene_set_integer(scene, "output.trajectory.unwrapped", 1), GBG_OK);
    if (cores) {
        assert_int_equal(gbg_scene_set_text(scene, "excluded_volume.rule", rule), GBG_OK);
        assert_int_equal(gbg_scene_set_integer(scene, "output.trajectory.overlap", 1), GBG_OK);
    }
    if (gbg_engine_create(scene, &engine) != GBG_OK) {
        fail_msg("%s", gbg_message(context));
    }
    assert_int_equal(gbg_scene_destroy(&scene), GBG_OK);
    engine->ordering = ordering;
    return engine;
}

/* Everything that can be seen of an engine, by id where the caller's order differs. */
struct seen {
    char hash[65];
    double r[3][MOST], f[3][MOST], error[2], virial;
    int32_t flag[MOST], species[MOST];
    int64_t id[MOST], rounds, overlaps;
};

static void look(struct gbg_engine *engine, const struct start *start, int cores, struct seen *seen)
{
    int64_t n = start->n;
    double *z = start->dimension == 3 ? seen->r[2] : NULL;
    double *fz = start->dimension == 3 ? seen->f[2] : NULL;
    memset(seen, 0, sizeof *seen);
    assert_int_equal(gbg_engine_hash(engine, 65, seen->hash), GBG_OK);
    assert_int_equal(gbg_engine_positions(engine, 0, n, seen->r[0], seen->r[1], z, 1), GBG_OK);
    assert_int_equal(gbg_engine_forces(engine, n, seen->f[0], seen->f[1], fz, 1), GBG_OK);
    assert_int_equal(gbg_engine_species(engine, n, seen->species, 0), GBG_OK);
    assert_int_equal(gbg_engine_ids(engine, n, seen->id), GBG_OK);
    if (cores) {
        assert_int_equal(gbg_engine_overlapped(engine, n, seen->flag), GBG_OK);
    }
    assert_int_equal(gbg_engine_force_error(engine, 100, &seen->error[0], &seen->error[1]), GBG_OK);
    assert_int_equal(gbg_engine_integer(engine, "contact_rounds", &seen->rounds), GBG_OK);
    assert_int_equal(gbg_engine_integer(engine, "overlaps_left", &seen->overlaps), GBG_OK);
    assert_int_equal(gbg_engine_real(engine, "contact_virial", &seen->virial), GBG_OK);
}

static void assert_same(const struct seen *a, const struct seen *b)
{
    assert_string_equal(a->hash, b->hash);
    assert_memory_equal(a, b, sizeof *a);
}

static int never_arranged(const struct gbg_engine *engine)
{
    return engine->state.rank == NULL;
}

/* Particles whose index is not their rank. */
static int64_t out_of_order(const struct gbg_engine *engine)
{
    int64_t count = 0;
    for (int64_t i = 0; engine->state.rank && i < engine->state.owned; i++) {
        count += engine->state.rank[i] != i;
    }
    return count;
}

static void every_view(void **state)
{
    (void)state;
    static const char *const contexts[] = {"cpu:threads=1", "cpu:threads=2", "cpu:threads=5",
                                           "poison:threads=2"};
    static struct start start;
    static struct seen expected, seen;
    for (int kase = 0; kase < 8; kase++) {
        const char *rule = kase & 4 ? "none" : "bounce";
        make_start(&start, kase & 1 ? 3 : 2, kase & 1 ? 7 : 20, kase & 2);
        for (int k = 0; k < 8; k++) {
            struct gbg_context *context = made_context(contexts[k / 2]);
            int ordering = k == 0  ? GBG_ORDERING_NEVER
                           : k % 2 ? GBG_ORDERING_ALWAYS
                                   : GBG_ORDERING_AUTO;
            struct gbg_engine *engine = make_engine(context, &start, rule, ordering);
            assert_int_equal(gbg_engine_run(engine, 30), GBG_OK);
            assert_int_equal(out_of_order(engine) > start.n / 2, k % 2);
            assert_int_equal(never_arranged(engine), !(k % 2));
            look(engine, &start, !(kase & 4), k == 0 ? &expected : &seen);
            if (k > 0) {
                assert_same(&expected, &seen);
            }
            assert_int_equal(gbg_engine_destroy(&engine), GBG_OK);
            gbg_context_destroy(&context);
        }
        print_message("%dD, %s: %s, %lld rounds\n", start.dimension, rule, expected.hash,
                      (long long)expected.rounds);
        assert_true(kase & 4 || expected.rounds > 0);
    }
}

/* Looking between steps, changing positions back and forth, and another order of the caller. */
static void in_between(void **state)
{
    (void)state;
    static struct start start;
    static struct seen expected, seen;
    struct gbg_context *context = made_context("cpu:threads=2");
    make_start(&start, 2, 22, 1);
    struct gbg_engine *engine = make_engine(context, &start, "bounce", GBG_ORDERING_NEVER);
    assert_int_equal(gbg_engine_run(engine, 30), GBG_OK);
    look(engine, &start, 1, &expected);
    assert_int_equal(gbg_engine_destroy(&engine), GBG_OK);

    engine = make_engine(context, &start, "bounce", GBG_ORDERING_ALWAYS);
    for (int k = 0; k < 6; k++) {
        assert_int_equal(gbg_engine_run(engine, 5), GBG_OK);
        look(engine, &start, 1, &seen);
    }
    assert_same(&expected, &seen);
    assert_int_equal(gbg_engine_destroy(&engine), GBG_OK);

    static char message[2][500];
    for (int k = 0; k < 2; k++) { /* refused: the message names the pair of the lowest ids */
        engine = make_engine(context, &start, "bounce", k ? GBG_ORDERING_ALWAYS : 0);
        assert_int_equal(gbg_engine_run(engine, 15), GBG_OK);
        static double x[MOST], y[MOST];
        assert_int_equal(gbg_engine_positions(engine, 1, start.n, x, y, NULL, 1), GBG_OK);
        x[17] = x[400], y[17] = y[400] + 0.5, x[200] = x[100], y[200] = y[100];
        assert_int_equal(gbg_engine_set_positions(engine, start.n, x, y, NULL, 1), GBG_E_OVERLAP);
        snprintf(message[k], sizeof message[k], "%s", gbg_message(context));
        assert_int_equal(gbg_engine_run(engine, 15), GBG_OK);
        look(engine, &start, 1, &seen);
        assert_same(&expected, &seen);
        assert_int_equal(gbg_engine_destroy(&engine), GBG_OK);
    }
    assert_string_equal(message[0], message[1]);

    shuffle(&start, 300000, 1); /* the same particles, given in another order */
    engine = make_engine(context, &start, "bounce", GBG_ORDERING_ALWAYS);
    assert_int_equal(gbg_engine_run(engine, 30), GBG_OK);
    look(engine, &start, 1, &seen);
    assert_string_equal(expected.hash, seen.hash);
    assert_memory_equal(start.id, seen.id, (size_t)start.n * sizeof *start.id);
    assert_memory_equal(start.species, seen.species, (size_t)start.n * sizeof *start.species);
    assert_int_equal(gbg_engine_destroy(&engine), GBG_OK);
    gbg_context_destroy(&context);
}

static int64_t read_file(const char *path, char *bytes, int64_t most)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    int64_t n = (int64_t)fread(bytes, 1, (size_t)most, file);
    fclose(file);
    return n;
}

static int write_frames(struct gbg_engine *engine, const char *path)
{
    struct gbg_trajectory *trajectory;
    int status = gbg_trajectory_create(engine, path, &trajectory);
    for (int k = 0; status == GBG_OK && k < 3; k++) {
        assert_int_equal(gbg_engine_run(engine, 10), GBG_OK);
        assert_int_equal(gbg_trajectory_append(trajectory, engine), GBG_OK);
    }
    if (status == GBG_OK) {
        assert_int_equal(gbg_trajectory_destroy(&trajectory), GBG_OK);
    }
    return status;
}

/* Restart files are the same bytes, and a run resumed from one ends as one that went through. */
static void files(void **state)
{
    (void)state;
    static struct start start;
    static struct seen expected, seen;
    enum { BYTES = 1 << 20 };
    static char first[BYTES], second[BYTES];
    struct gbg_context *context = made_context("cpu:threads=2");
    for (int dimension = 2; dimension <= 3; dimension++) {
        make_start(&start, dimension, dimension == 2 ? 22 : 8, 1);
        struct gbg_engine *never = make_engine(context, &start, "bounce", GBG_ORDERING_NEVER);
        struct gbg_engine *always = make_engine(context, &start, "bounce", GBG_ORDERING_ALWAYS);
        assert_int_equal(gbg_engine_run(never, 25), GBG_OK);
        assert_int_equal(gbg_engine_run(always, 25), GBG_OK);
        assert_int_equal(gbg_engine_save(never, "order_never.restart"), GBG_OK);
        assert_int_equal(gbg_engine_save(always, "order_always.restart"), GBG_OK);
        int64_t n = read_file("order_never.restart", first, BYTES);
        assert_true(n > 0 && n < BYTES);
        assert_int_equal(read_file("order_always.restart", second, BYTES), n);
        assert_memory_equal(first, second, (size_t)n);
        int status = write_frames(never, "order_never.nc");
        assert_int_equal(write_frames(always, "order_always.nc"), status);
        if (status == GBG_OK) {
            n = read_file("order_never.nc", first, BYTES);
            assert_true(n > 0 && n < BYTES);
            assert_int_equal(read_file("order_always.nc", second, BYTES), n);
            assert_memory_equal(first, second, (size_t)n);
        } else {
            assert_int_equal(gbg_engine_run(never, 30), GBG_OK);
        }
        look(never, &start, 1, &expected);
        for (int k = 0; k < 2; k++) { /* into an engine in order, and into one out of order */
            struct gbg_engine *resumed = make_engine(context, &start, "bounce", 0);
            resumed->ordering = GBG_ORDERING_ALWAYS;
            assert_int_equal(gbg_engine_run(resumed, 40 * k), GBG_OK);
            assert_int_equal(gbg_engine_load(resumed, "order_always.restart"), GBG_OK);
            assert_int_equal(gbg_engine_run(resumed, 30), GBG_OK);
            look(resumed, &start, 1, &seen);
            assert_string_equal(expected.hash, seen.hash);
            assert_memory_equal(expected.r, seen.r, sizeof seen.r);
            assert_memory_equal(expected.f, seen.f, sizeof seen.f);
            assert_int_equal(gbg_engine_destroy(&resumed), GBG_OK);
        }
        assert_int_equal(gbg_engine_destroy(&never), GBG_OK);
        assert_int_equal(gbg_engine_destroy(&always), GBG_OK);
    }
    gbg_context_destroy(&context);
}

/* The rule: a shuffled start gets a new order, one in good order and a small one carry nothing for
 * it, and a scene with a direct sum is left alone. */
static void pays_per_use(void **state)
{
    (void)state;
    static struct start start;
    static struct seen seen;
    struct gbg_context *context = made_context("cpu:threads=2");
    static const int64_t side[] = {22, 100, 10, 22};
    static const int dimensions[] = {2, 2, 3, 3};
    for (int k = 0; k < 4; k++) {
        char hash[65];
        make_start(&start, dimensions[k], side[k], 0);
        struct gbg_engine *engine = make_engine(context, &start, "none", GBG_ORDERING_AUTO);
        assert_int_equal(gbg_engine_run(engine, 10), GBG_OK);
        int moved = out_of_order(engine) > 0;
        print_message("%dD, %lld shuffled: %s\n", start.dimension, (long long)start.n,
                      moved ? "new order" : "as it was");
        assert_int_equal(moved, start.n > 8192);
        assert_true(engine->least_scatter < 0.3);
        look(engine, &start, 0, &seen);
        strcpy(hash, seen.hash);
        assert_int_equal(gbg_engine_destroy(&engine), GBG_OK);

        struct gbg_context *plain = made_context("cpu:threads=1");
        engine = make_engine(plain, &start, "none", GBG_ORDERING_NEVER);
        assert_int_equal(gbg_engine_order_by_id(engine), GBG_OK);
        assert_int_equal(gbg_engine_run(engine, 10), GBG_OK);
        assert_int_equal(out_of_order(engine), 0);
        look(engine, &start, 0, &seen);
        assert_string_equal(hash, seen.hash);
        assert_int_equal(gbg_engine_destroy(&engine), GBG_OK);
        gbg_context_destroy(&plain);
    }
    make_lattice(&start, 2, 130, 0);
    struct gbg_engine *engine = make_engine(context, &start, "none", GBG_ORDERING_AUTO);
    assert_int_equal(gbg_engine_run(engine, 10), GBG_OK);
    assert_true(never_arranged(engine) && !engine->state.id && !engine->place);
    assert_int_equal(gbg_engine_destroy(&engine), GBG_OK);
    gbg_context_destroy(&context);
}

/* Unless a number is named, few particles get few threads: the results are the same. */
static void threads_are_chosen(void **state)
{
    (void)state;
    static struct start start;
    static const char *const contexts[] = {"cpu:threads=3", "cpu"};
    char hash[2][65];
    make_start(&start, 2, 22, 0);
    for (int k = 0; k < 2; k++) {
        struct gbg_context *context = made_context(contexts[k]);
        struct gbg_engine *engine = make_engine(context, &start, "bounce", GBG_ORDERING_AUTO);
        assert_int_equal(engine->device->threads, k ? 1 : 3);
        assert_int_equal(gbg_engine_run(engine, 10), GBG_OK);
        assert_int_equal(gbg_engine_hash(engine, 65, hash[k]), GBG_OK);
        assert_int_equal(gbg_engine_destroy(&engine), GBG_OK);
        gbg_context_destroy(&context);
    }
    assert_string_equal(hash[0], hash[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_view),
        cmocka_unit_test(in_between),
        cmocka_unit_test(files),
        cmocka_unit_test(pays_per_use),
        cmocka_unit_test(threads_are_chosen),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
