/* Tests of a GPU against the CPU: the order of particles in memory, which no result depends on. */
#include "both.h"

static struct made_particles made;

static void arrange(struct gbg_engine *engine, int by_place)
{
    uint64_t epoch = engine->state.epoch;
    if (engine->kernels->arrange(engine->device, &engine->state, by_place) != GBG_OK) {
        fail_msg("%s", gbg_message(engine->context));
    }
    assert_int_equal(engine->state.epoch, epoch + (engine->state.rank ? 1 : 0));
}

static void same_order(struct both *both)
{
    const struct gbg_state *p = &both->engine[0]->state, *q = &both->engine[1]->state;
    size_t n = (size_t)p->owned;
    both_same_state(both);
    both_same(both, p->rank, q->rank, n * sizeof *p->rank, "ranks");
    both_same(both, p->id, q->id, n * sizeof *p->id, "ids");
    if (p->species) {
        both_same(both, p->species, q->species, n, "species");
    }
    if (p->source) {
        both_same(both, p->source, q->source, n * sizeof *p->source, "sources");
    }
}

static void same_digest(struct both *both, char text[65])
{
    char other[65];
    assert_int_equal(gbg_engine_digest(both->engine[0], text), GBG_OK);
    assert_int_equal(gbg_engine_digest(both->engine[1], other), GBG_OK);
    assert_string_equal(text, other);
}

/* Flags and sources that a scene of this test has no use for, all different. */
static void give_more_arrays(struct gbg_engine *engine)
{
    int64_t n = engine->state.owned;
    static unsigned char flag[5000];
    static float source[5000];
    void *made_flag, *made_source;
    const struct gbg_backend *backend = engine->backend;
    for (int64_t i = 0; i < n; i++) {
        flag[i] = (unsigned char)(i % 251);
        source[i] = (float)i + 0.5f;
    }
    assert_null(engine->state.overlapped);
    assert_null(engine->state.source);
    assert_int_equal(backend->allocate(engine->device, &made_flag, n, 1, "flags"), GBG_OK);
    assert_int_equal(backend->allocate(engine->device, &made_source, n, 4, "sources"), GBG_OK);
    assert_int_equal(backend->upload(engine->device, made_flag, flag, (size_t)n), GBG_OK);
    assert_int_equal(backend->upload(engine->device, made_source, source, (size_t)n * 4), GBG_OK);
    engine->state.overlapped = made_flag;
    engine->state.source = made_source;
}

static int64_t out_of_order(struct gbg_engine *engine)
{
    int64_t n = engine->state.owned, count = 0;
    int32_t *rank = both_copy(engine, engine->state.rank, (size_t)n * sizeof *rank);
    for (int64_t i = 0; i < n; i++) {
        count += rank[i] != i;
    }
    free(rank);
    return count;
}

static struct gbg_scene moving_scene(struct gbg_context *context, int dimension, int64_t m,
                                     int own_ids)
{
    double length[3] = {20.0, 31.0, 17.0};
    struct gbg_scene scene = made_scene(context, dimension, length);
    scene.rule = GBG_RULE_NONE;
    scene.unwrapped = 1;
    scene.temperature = 40.0;
    made_lattice(&made, &scene, m, 0.3);
    for (int64_t i = 0; own_ids && i < made.p.n; i++) {
        made.id[i] = 7 * i + 3;
    }
    return scene;
}

static void order_is_the_same(void **state)
{
    (void)state;
    for (int variant = 0; variant < 8; variant++) {
        int dimension = 2 + variant % 2, own_ids = variant / 2 % 2, few = variant / 4;
        char before[65], after[65];
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = moving_scene(context, dimension,
                                              few              ? 2
                                              : dimension == 2 ? 70
                                                               : 16,
                                              own_ids);
        made.p.n = few ? 3 : made.p.n;
        struct both both = both_make(scene, &made);
        same_digest(&both, before);
        for (int b = 0; b < 2; b++) {
            give_more_arrays(both.engine[b]);
            arrange(both.engine[b], 0); /* nothing to do yet */
            assert_null(both.engine[b]->state.rank);
            arrange(both.engine[b], 1);
        }
        same_order(&both);
        same_digest(&both, after);
        assert_string_equal(before, after);
        assert_true(few || out_of_order(both.engine[1]) > made.p.n / 2);
        for (int round = 0; round < 6; round++) {
            for (int b = 0; b < 2; b++) {
                assert_int_equal(gbg_engine_advance(both.engine[b], 2), GBG_OK);
                arrange(both.engine[b], round % 3 != 2);
            }
            same_order(&both);
            same_digest(&both, after);
        }
        assert_int_equal(out_of_order(both.engine[1]), 0);
        both_free(&both);
        gbg_context_destroy(&context);
    }
}

/* Particles in the same place keep their order among themselves. */
static void ties_keep_their_order(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu");
    struct gbg_scene scene = moving_scene(context, 2, 60, 0);
    for (int64_t i = 0; i < made.p.n; i++) {
        for (int a = 0; a < 2; a++) {
            made.store[a][i] =
                scene.origin[a] +
                0.25 * scene.length[a] * floor(4.0 * made_uniform((uint64_t)(2 * i + a)));
        }
    }
    struct both both = both_make(scene, &made);
    for (int b = 0; b < 2; b++) {
        arrange(both.engine[b], 1);
    }
    same_order(&both);
    both_free(&both);
    gbg_context_destroy(&context);
}

/* The GPU in a new order makes the same steps as the CPU in the old one. */
static void steps_do_not_depend_on_it(void **state)
{
    (void)state;
    for (int dimension = 2; dimension <= 3; dimension++) {
        char digest[65];
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = moving_scene(context, dimension, dimension == 2 ? 51 : 13, 1);
        struct both both = both_make(scene, &made);
        for (int step = 0; step < 12; step++) {
            if (step % 5 == 2) {
                arrange(both.engine[1], 1);
            }
            for (int b = 0; b < 2; b++) {
                assert_int_equal(gbg_engine_advance(both.engine[b], 1), GBG_OK);
            }
            same_digest(&both, digest);
        }
        assert_null(both.engine[0]->state.rank);
        arrange(both.engine[1], 0);
        both_same_state(&both);
        both_free(&both);
        gbg_context_destroy(&context);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(order_is_the_same),
        cmocka_unit_test(ties_keep_their_order),
        cmocka_unit_test(steps_do_not_depend_on_it),
    };
    return both_missing() ? BOTH_SKIPPED : cmocka_run_group_tests(tests, NULL, NULL);
}
