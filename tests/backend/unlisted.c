/* Tests of a GPU against the CPU: cut-off forces straight from cells, where lists find no memory:
 * the same bits as with lists, and the same refusals. */
#include "both.h"

#include "core/memory.h"
#include "cuda/rows.h"

static struct made_particles made;

struct run {
    const char *what;
    int dimension, n_species, m, steps;
    double spacing, power, cutoff, dt, jitter;
    int precision, ordering, scattered;
};

enum { MIXED = GBG_PRECISION_MIXED, DOUBLE = GBG_PRECISION_DOUBLE };
enum { ALWAYS = GBG_ORDERING_ALWAYS };

static const struct run runs[] = {
    {"S10", 2, 1, 67, 60, 1.25, 6, 2.5, 0.001, 0.01, MIXED, 0, 0},
    {"S10, scattered in memory", 2, 1, 67, 60, 1.25, 6, 2.5, 0.001, 0.01, MIXED, 0, 1},
    {"S10, a new order each time", 2, 1, 67, 60, 1.25, 6, 2.5, 0.001, 0.01, MIXED, ALWAYS, 0},
    {"S10 in 3D", 3, 1, 19, 40, 1.2, 6, 2.5, 0.001, 0.01, MIXED, 0, 0},
    {"S10 in 3D, a new order each time", 3, 1, 14, 40, 1.2, 6, 2.5, 0.001, 0.01, MIXED, ALWAYS, 1},
    {"power 2, two species", 2, 2, 50, 60, 1.3, 2, 3.0, 0.0002, 0.01, MIXED, 0, 1},
    {"power 2, two species, ordered", 2, 2, 50, 60, 1.3, 2, 3.0, 0.0002, 0.01, MIXED, ALWAYS, 1},
    {"power 2, two species in 3D", 3, 2, 15, 30, 1.3, 2, 2.5, 0.0002, 0.01, MIXED, 0, 0},
    {"in double", 2, 1, 41, 40, 1.25, 6, 2.5, 0.001, 0.01, DOUBLE, 0, 1},
    {"in double, 3D, two species", 3, 2, 13, 20, 1.3, 4, 2.5, 0.0002, 0.01, DOUBLE, ALWAYS, 0},
    {"power 3, in double by itself", 2, 2, 33, 40, 1.3, 3, 2.5, 0.0002, 0.01, MIXED, 0, 0},
    {"41 neighbours", 2, 1, 70, 20, 1.25, 6, 4.5, 0.001, 0.01, MIXED, 0, 1},
    {"80 neighbours", 2, 1, 70, 20, 1.25, 6, 6.3, 0.001, 0.01, MIXED, 0, 1},
    {"65 and more neighbours in 3D", 3, 1, 16, 10, 1.2, 6, 3.1, 0.001, 0.01, MIXED, ALWAYS, 0},
    {"two cells an axis", 2, 1, 6, 40, 1.25, 6, 2.9, 0.001, 0.01, MIXED, 0, 0},
    {"one cell an axis", 3, 2, 5, 20, 1.4, 2, 3.4, 0.0002, 0.01, MIXED, 0, 1},
    {"66049 particles", 2, 1, 257, 25, 1.25, 6, 2.5, 0.001, 0.01, MIXED, 0, 0},
};

static struct gbg_scene make_scene(const struct run *run, struct gbg_context *context)
{
    double length[3];
    for (int a = 0; a < run->dimension; a++) {
        length[a] = run->spacing * run->m * (a == 1 ? 1.02 : 1.0);
    }
    struct gbg_scene scene = made_scene(context, run->dimension, length);
    scene.rule = GBG_RULE_NONE;
    scene.precision = run->precision;
    scene.dt = run->dt;
    scene.unwrapped = 1;
    if (run->n_species == 1) {
        scene.n_species = 1;
        scene.species[0].alpha = 1.0;
        scene.species[0].mobility = 1.0;
    }
    scene.n_forces = 1;
    scene.force[0] =
        (struct gbg_force){.power = run->power, .sum = GBG_SUM_CUTOFF, .cutoff = run->cutoff};
    if (run->power == 3.0) { /* and a shorter one */
        scene.n_forces = 2;
        scene.force[1] = (struct gbg_force){.power = 6.0, .sum = GBG_SUM_CUTOFF, .cutoff = 1.7};
    }
    return scene;
}

/* Ids are random in space: memory is in their order. */
static void scatter(int dimension)
{
    for (int64_t last = made.p.n - 1; last > 0; last--) {
        int64_t other = (int64_t)(made_uniform((uint64_t)last) * (double)(last + 1));
        for (int a = 0; a < dimension; a++) {
            double kept = made.store[a][last];
            made.store[a][last] = made.store[a][other];
            made.store[a][other] = kept;
        }
    }
}

static struct both start(const struct run *run, struct gbg_context *context)
{
    struct gbg_scene scene = make_scene(run, context);
    made_lattice(&made, &scene, run->m, run->jitter);
    for (int64_t i = 0; run->n_species == 1 && i < made.p.n; i++) {
        made.species[i] = 0;
    }
    if (run->scattered) {
        scatter(run->dimension);
    }
    struct both both = both_make(scene, &made);
    for (int b = 0; b < 2; b++) {
        both.engine[b]->ordering = run->ordering;
    }
    return both;
}

static int unlist(struct gbg_engine *engine)
{
    return gbg_cuda_list_unlist(engine->device, &engine->state, engine->pairs);
}

static int is_kept(const struct gbg_engine *engine)
{
    return engine->kernels->list_is_kept(engine->pairs);
}

static void advance(struct both *both, const char *what, int64_t steps)
{
    char text[2][65];
    for (int b = 0; b < 2; b++) {
        if (gbg_engine_advance(both->engine[b], steps) != GBG_OK) {
            fail_msg("%s: %s", what, gbg_message(both->context[b]));
        }
        assert_int_equal(gbg_engine_digest(both->engine[b], text[b]), GBG_OK);
    }
    assert_string_equal(text[0], text[1]);
    const struct gbg_engine *p = both->engine[0], *q = both->engine[1];
    both_same_real(p->moves.drift, q->moves.drift, "the largest drift");
    both_same_real(p->moves.total, q->moves.total, "the largest move");
}

/* Forces at the present positions, in the order of ids: the same bytes. */
static void same_forces(struct both *both)
{
    static double force[2][3][MADE_MOST];
    int64_t n = both->engine[0]->state.owned;
    for (int b = 0; b < 2; b++) {
        double *at[3] = {force[b][0], force[b][1], force[b][2]};
        both->engine[b]->forces_current = 0;
        assert_int_equal(gbg_engine_copy_forces(both->engine[b], at), GBG_OK);
    }
    for (int a = 0; a < both->engine[0]->state.box.dimension; a++) {
        for (int64_t i = 0; i < n; i++) {
            if (memcmp(&force[0][a][i], &force[1][a][i], sizeof(double)) != 0) {
                fail_msg("force on %d, axis %d: %.17g with a list, %.17g without", (int)i, a,
                         force[0][a][i], force[1][a][i]);
            }
        }
    }
}

/* With lists at first, then without: no bit shows it. */
static void runs_are_the_same(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu");
    for (size_t k = 0; k < sizeof runs / sizeof *runs; k++) {
        if (!both_takes((int)k)) {
            continue;
        }
        const struct run *run = &runs[k];
        struct both both = start(run, context);
        int64_t builds[2];
        assert_true(is_kept(both.engine[1]));
        advance(&both, run->what, 3);
        assert_int_equal(unlist(both.engine[1]), GBG_OK);
        assert_false(is_kept(both.engine[1]));
        gbg_engine_integer(both.engine[1], "list_builds", &builds[0]);
        same_forces(&both);
        advance(&both, run->what, 1);
        advance(&both, run->what, run->steps);
        same_forces(&both);
        gbg_engine_integer(both.engine[1], "list_builds", &builds[1]);
        print_message("%s: N = %d, cells built %d times in %d steps, %.1f bytes a particle\n",
                      run->what, (int)made.p.n, (int)(builds[1] - builds[0]), run->steps,
                      gbg_engine_bytes(both.engine[1]));
        assert_true(builds[1] > builds[0]);
        if (run->steps >= 60 && !run->ordering) {
            assert_true(builds[1] - builds[0] > 1 && builds[1] - builds[0] < run->steps / 2);
        }
        both_free(&both);
    }
    gbg_context_destroy(&context);
}

/* Hundreds within the cut-off of each other, some in the same place, beside an even rest. */
static void crowds_are_summed_the_same(void **state)
{
    (void)state;
    int64_t crowd = both_part() > 1 ? 100 : 700;
    struct gbg_context *context = made_context("cpu");
    for (int dimension = 2; dimension <= 3; dimension++) {
        struct run run = {
            "", dimension, 2, dimension == 2 ? 64 : 16, 0, 1.25, 6, 2.5, 0.001, 0.1, MIXED, 0, 1};
        struct gbg_scene scene = make_scene(&run, context);
        for (int precision = 0; precision < 2; precision++) {
            scene.precision = precision ? DOUBLE : MIXED;
            made_lattice(&made, &scene, run.m, run.jitter);
            scatter(dimension);
            for (int64_t i = 0; i < crowd; i++) {
                int64_t same = i % 10 == 9 ? i - 1 : i;
                for (int a = 0; a < dimension; a++) {
                    made.store[a][i] = scene.origin[a] + 0.3 * scene.length[a] +
                                       3.0 * made_uniform((uint64_t)(3 * same + a));
                }
            }
            struct both both = both_make(scene, &made);
            assert_int_equal(unlist(both.engine[1]), GBG_OK);
            same_forces(&both);
            for (int b = 0; b < 2; b++) { /* ranks that are no indices */
                struct gbg_engine *engine = both.engine[b];
                assert_int_equal(engine->kernels->arrange(engine->device, &engine->state, 1),
                                 GBG_OK);
            }
            same_forces(&both);
            both_free(&both);
        }
    }
    gbg_context_destroy(&context);
}

/* Two and three particles, and one. */
static void few_are_summed_the_same(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu");
    for (int64_t n = 1; n <= 3; n++) {
        struct run run = {"few", 2, 1, 3, 10, 2.0, 6, 2.5, 0.001, 0.05, MIXED, 0, 0};
        struct gbg_scene scene = make_scene(&run, context);
        made_lattice(&made, &scene, run.m, run.jitter);
        memset(made.species, 0, sizeof made.species);
        made.p.n = n;
        struct both both = both_make(scene, &made);
        assert_int_equal(unlist(both.engine[1]), GBG_OK);
        same_forces(&both);
        advance(&both, run.what, run.steps);
        both_free(&both);
    }
    gbg_context_destroy(&context);
}

/* Positions that are set anew, and a refused step: both as with lists. */
static void states_change_the_same(void **state)
{
    (void)state;
    static double x[2][MADE_MOST];
    struct gbg_context *context = made_context("cpu");
    struct both both = start(&runs[0], context);
    assert_int_equal(unlist(both.engine[1]), GBG_OK);
    advance(&both, "before", 5);
    for (int64_t i = 0; i < made.p.n; i++) {
        x[0][i] = made.store[0][i] + 0.3 * made_uniform((uint64_t)i);
        x[1][i] = made.store[1][i] + 0.3 * made_uniform((uint64_t)(i + 100000));
    }
    for (int b = 0; b < 2; b++) {
        assert_int_equal(gbg_engine_set_positions(both.engine[b], made.p.n, x[0], x[1], NULL, 1),
                         GBG_OK);
    }
    advance(&both, "after", 12);
    x[0][7] = x[0][8] + 1e-4; /* a force that moves it by more than half the box */
    x[1][7] = x[1][8];
    for (int b = 0; b < 2; b++) {
        assert_int_equal(gbg_engine_set_positions(both.engine[b], made.p.n, x[0], x[1], NULL, 1),
                         GBG_OK);
        assert_int_equal(gbg_engine_advance(both.engine[b], 3), GBG_E_STEP);
    }
    both_same_state(&both);
    same_forces(&both);
    both_free(&both);
    gbg_context_destroy(&context);
}

/* What a list takes need not be had: with each of its allocations failing the engine is made and
 * goes on. */
static void lists_without_memory_are_done_without(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu");
    struct both both = start(&runs[0], context);
    struct gbg_scene scene = make_scene(&runs[0], context);
    char wanted[65], text[65];
    int without = 0, refused = 0;
    assert_int_equal(gbg_engine_advance(both.engine[0], 20), GBG_OK);
    assert_int_equal(gbg_engine_digest(both.engine[0], wanted), GBG_OK);
    scene.context = both.context[1];
    int64_t left = 0;
    for (int64_t n = 1; left == 0; n++) {
        struct gbg_engine *engine = NULL;
        gbg_memory_fail_after(n);
        int status = gbg_engine_make(&scene, &made.p, &engine);
        status = status ? status : gbg_engine_advance(engine, 20);
        left = gbg_memory_fail_after(0);
        if (status == GBG_OK) {
            assert_int_equal(gbg_engine_digest(engine, text), GBG_OK);
            assert_string_equal(text, wanted);
            int kept = is_kept(engine);
            without += !kept;
            gbg_engine_describe_list(engine, &engine->plan[0]);
            assert_int_equal(strstr(engine->plan[0].what, "found for each force") == NULL, kept);
        } else {
            assert_int_equal(status, GBG_E_MEMORY);
            assert_non_null(strstr(gbg_message(scene.context), "bytes"));
            refused++;
        }
        gbg_engine_free(engine);
    }
    print_message("%d allocations refuse the scene, %d lists are done without\n", refused, without);
    assert_true(without >= 8);
    both_free(&both);
    gbg_context_destroy(&context);
}

/* Hard cores need lists; so do gases in which cells of the reach would be far more than particles.
 * What cannot be is refused, and nothing is changed. */
static void some_keep_their_lists(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu");
    for (int dilute = 0; dilute < 2; dilute++) {
        struct run run = {"", 2, 1, 20, 10, dilute ? 40.0 : 1.25, 6, 2.5, 0.001, 0.01, MIXED, 0, 0};
        struct gbg_scene scene = make_scene(&run, context);
        scene.rule = dilute ? GBG_RULE_NONE : GBG_RULE_BOUNCE;
        made_lattice(&made, &scene, run.m, run.jitter);
        memset(made.species, 0, sizeof made.species);
        struct both both = both_make(scene, &made);
        assert_int_equal(unlist(both.engine[1]), GBG_E_MEMORY);
        assert_true(is_kept(both.engine[1]));
        advance(&both, "as before", run.steps);
        same_forces(&both);
        both_free(&both);
    }
    gbg_context_destroy(&context);
}

/* Bytes a particle of a plane of one species, as docs/architecture.md states them. */
static void memory_is_small(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu");
    struct run run = runs[sizeof runs / sizeof *runs - 1];
    struct gbg_scene scene = make_scene(&run, context);
    scene.unwrapped = 0;
    made_lattice(&made, &scene, run.m, run.jitter);
    memset(made.species, 0, sizeof made.species);
    struct both both = both_make(scene, &made);
    double with = gbg_engine_bytes(both.engine[1]);
    assert_int_equal(unlist(both.engine[1]), GBG_OK);
    assert_int_equal(gbg_engine_advance(both.engine[1], 5), GBG_OK);
    double without = gbg_engine_bytes(both.engine[1]);
    print_message("%.1f bytes a particle with a list, %.1f without\n", with, without);
    assert_true(without < 80.0);
    assert_true(with > 1.5 * without);
    both_free(&both);
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(runs_are_the_same),
        cmocka_unit_test(crowds_are_summed_the_same),
        cmocka_unit_test(few_are_summed_the_same),
        cmocka_unit_test(states_change_the_same),
        cmocka_unit_test(lists_without_memory_are_done_without),
        cmocka_unit_test(some_keep_their_lists),
        cmocka_unit_test(memory_is_small),
    };
    return both_missing() ? BOTH_SKIPPED : cmocka_run_group_tests(tests, NULL, NULL);
}
