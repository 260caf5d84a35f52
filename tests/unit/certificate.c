/* Tests of the certificate of a step against naive double loops, and of what follows when a step
 * does not get it: the second, gentle correction, the roll-back, the bound on what is put back. */
#include "backend/cpu/list.h"
#include "made_scene.h"

static uint64_t place(const struct gbg_state *state, int a, int64_t i, int before)
{
    return before ? (uint64_t)state->start_high[a][i] << 32 | state->start_low[a][i]
                  : (uint64_t)state->high[a][i] << 32 | state->low[a][i];
}

static void set_fraction(struct gbg_state *state, int a, int64_t i, uint64_t fraction)
{
    state->high[a][i] = (uint32_t)(fraction >> 32);
    state->low[a][i] = (uint32_t)fraction;
}

static long double between(const struct gbg_state *state, int a, int64_t i, int64_t j, int before)
{
    return (long double)(int64_t)(place(state, a, i, before) - place(state, a, j, before)) *
           (state->box.length[a] / 18446744073709551616.0L);
}

static long double contact_between(const struct gbg_state *state, int64_t i, int64_t j)
{
    return 0.5L *
           ((long double)state->diameter[state->species[i]] + state->diameter[state->species[j]]);
}

/* What the certificate must say, pair by pair. Passing: the straight path of i seen from j, from
 * before to now, in 2000 places: at the nearest the two are closer than contact/sqrt(2). */
struct expected {
    int64_t overlapping, passed, first, second;
};

static int path_is_blocked(const struct gbg_state *state, int64_t i, int64_t j)
{
    long double start[3], move[3], length = 0, distance = 0, nearest = INFINITY;
    for (int a = 0; a < state->box.dimension; a++) {
        start[a] = between(state, a, i, j, 1);
        long double quantum = state->box.length[a] / 18446744073709551616.0L;
        move[a] = (long double)(int64_t)(place(state, a, i, 0) - place(state, a, i, 1)) * quantum -
                  (long double)(int64_t)(place(state, a, j, 0) - place(state, a, j, 1)) * quantum;
        length += move[a] * move[a];
        distance += start[a] * start[a];
    }
    long double contact = contact_between(state, i, j);
    if (length < contact * contact || sqrtl(distance) > contact + sqrtl(length)) {
        return 0; /* too far apart before the step */
    }
    for (int k = 0; k <= 2000; k++) {
        long double squared = 0;
        for (int a = 0; a < state->box.dimension; a++) {
            long double d = start[a] + move[a] * k / 2000.0L;
            squared += d * d;
        }
        nearest = squared < nearest ? squared : nearest;
    }
    return nearest < 0.5L * contact * contact;
}

static struct expected expect(const struct gbg_state *state)
{
    struct expected expected = {0, 0, -1, -1};
    for (int64_t i = 0; i < state->owned; i++) {
        for (int64_t j = i + 1; j < state->owned; j++) {
            long double squared = 0, contact = contact_between(state, i, j);
            for (int a = 0; a < state->box.dimension; a++) {
                squared += between(state, a, i, j, 0) * between(state, a, i, j, 0);
            }
            int overlap = contact > 0 && sqrtl(squared) < contact * (1 - 1e-12L);
            int passed = contact > 0 && !overlap && path_is_blocked(state, i, j);
            expected.overlapping += overlap;
            expected.passed += passed;
            if ((overlap || passed) && expected.first < 0) {
                expected.first = i;
                expected.second = j;
            }
        }
    }
    return expected;
}

/* Particles jump by up to `jump` diameters on each axis. */
static void jump_about(struct gbg_engine *engine, double jump, uint64_t seed)
{
    struct gbg_state *state = &engine->state;
    for (int64_t i = 0; i < state->owned; i++) {
        for (int a = 0; a < state->box.dimension; a++) {
            double u = 2.0 * made_uniform(seed + (uint64_t)(3 * i + a)) - 1.0;
            uint64_t fraction = place(state, a, i, 1);
            fraction += (uint64_t)(int64_t)(u * jump / state->box.quantum[a]);
            set_fraction(state, a, i, fraction);
        }
    }
}

/* Returns the number of pairs that passed. */
static int64_t compare(struct gbg_engine *engine, int listed)
{
    struct expected expected = expect(&engine->state);
    struct gbg_certificate found = {.tolerance = 1e-12, .straight = 1};
    assert_int_equal(
        engine->kernels->certify(engine->device, &engine->state, engine->contacts, &found), GBG_OK);
    assert_false(found.undecided);
    assert_int_equal(found.listed, listed);
    assert_int_equal(found.overlapping, expected.overlapping);
    assert_int_equal(found.passed, expected.passed);
    assert_int_equal(found.lowest.first, expected.first);
    assert_int_equal(found.lowest.second, expected.second);
    print_message("%lld overlap, %lld passed\n", (long long)found.overlapping,
                  (long long)found.passed);
    return found.passed;
}

static void all_pairs_and_paths(void **unused)
{
    (void)unused;
    static struct made_particles made;
    static const double boxes[][3] = {{24, 24, 24}, {30, 19, 23}};
    static const double sizes[][2] = {{1, 1}, {0.2, 1.2}, {0, 1}};
    struct gbg_context *context = made_context("cpu:threads=3");
    int64_t passed = 0;
    for (int k = 0; k < 12; k++) {
        int dimension = 2 + k % 2;
        struct gbg_scene scene = made_scene(context, dimension, boxes[k / 2 % 2]);
        scene.species[0].diameter = sizes[k / 4][0];
        scene.species[1].diameter = sizes[k / 4][1];
        made_lattice(&made, &scene, dimension == 2 ? 15 : 9, 0.01);
        struct gbg_engine *engine = made_engine(&scene, &made);
        assert_int_equal(engine->kernels->keep(engine->device, &engine->state), GBG_OK);
        compare(engine, 1); /* nothing moved */
        jump_about(engine, 1.6, (uint64_t)k * 10000);
        compare(engine, 0); /* the list is too old: cells */
        assert_int_equal(
            engine->kernels->list_update(engine->device, &engine->state, engine->contacts, 1e300),
            GBG_OK);
        passed += compare(engine, 1);
        gbg_engine_free(engine);
    }
    assert_true(passed > 20);
    gbg_context_destroy(&context);
}

/* Two particles at contact (1 - 1e-12) and a little nearer or farther: 2e-15, or 4 quanta of the
 * box if that is more; in boxes with equal quanta, where integers decide, and with others. */
static void decides_at_the_tolerance(void **unused)
{
    (void)unused;
    static struct made_particles made;
    static const double boxes[][2] = {{24, 24}, {24, 10}, {1e6, 1e6}};
    struct gbg_context *context = made_context("cpu");
    for (int k = 0; k < 3; k++) {
        struct gbg_scene scene = made_scene(context, 2, boxes[k]);
        made_lattice(&made, &scene, 4, 0.0);
        struct gbg_engine *engine = made_engine(&scene, &made);
        assert_int_equal(engine->kernels->keep(engine->device, &engine->state), GBG_OK);
        for (int beyond = 0; beyond < 2; beyond++) {
            struct gbg_state *state = &engine->state;
            long double angle = 0.7L, step = 4 * state->box.quantum[0];
            step = step > 2e-15L ? step : 2e-15L;
            long double d = (1 - 1e-12L) * (beyond ? 1 + step : 1 - step);
            for (int a = 0; a < 2; a++) {
                long double offset = a ? sinl(angle) * d : cosl(angle) * d;
                uint64_t origin = a ? 0xFFFFFFFFFFFFFF00u : 3; /* across an edge of the box */
                set_fraction(state, a, 0, origin);
                set_fraction(state, a, 1,
                             origin + (uint64_t)(int64_t)llrintl(offset / state->box.length[a] *
                                                                 18446744073709551616.0L));
            }
            struct gbg_certificate found = {.tolerance = 1e-12};
            assert_int_equal(
                engine->kernels->certify(engine->device, &engine->state, engine->contacts, &found),
                GBG_OK);
            assert_int_equal(found.overlapping, !beyond);
            assert_true(beyond || fabs(found.lowest.distance - (double)d) < (double)step);
        }
        gbg_engine_free(engine);
    }
    gbg_context_destroy(&context);
}

/* The rounds of a spoilt engine: they work, but then let particle 0 and its neighbour 1 change
 * places, whenever pushes may be as large as `spoils_above`. */
static int (*sound_contacts)(struct gbg_device *, struct gbg_state *, struct gbg_list *,
                             struct gbg_contacts *);
static double spoils_above;

static int spoilt_contacts(struct gbg_device *device, struct gbg_state *state,
                           struct gbg_list *list, struct gbg_contacts *contacts)
{
    int status = sound_contacts(device, state, list, contacts);
    if (contacts->cap > spoils_above) {
        for (int a = 0; a < state->box.dimension; a++) {
            uint64_t first = place(state, a, 0, 0), second = place(state, a, 1, 0);
            set_fraction(state, a, 0, second);
            set_fraction(state, a, 1, first);
            state->image[a][0] += second < first && first - second > UINT64_MAX / 2;
            state->image[a][1] -= second < first && first - second > UINT64_MAX / 2;
        }
    }
    return status;
}

static struct gbg_engine *spoilt_engine(struct gbg_scene *scene, const struct made_particles *made,
                                        struct gbg_kernels *kernels, double above)
{
    struct gbg_engine *engine = made_engine(scene, made);
    *kernels = *engine->kernels;
    sound_contacts = kernels->contacts;
    kernels->contacts = spoilt_contacts;
    engine->kernels = kernels;
    spoils_above = above;
    return engine;
}

/* Pushes that carry a pair through each other are found and the step is made with small ones; if
 * that does not help either, the pair goes back. */
static void gentle_correction_and_roll_back(void **unused)
{
    (void)unused;
    static struct made_particles made;
    struct gbg_context *context = made_context("cpu:threads=2");
    double length[2] = {16.0, 16.0};
    struct gbg_scene scene = made_scene(context, 2, length);
    struct gbg_kernels kernels;
    scene.unwrapped = 1;
    made_lattice(&made, &scene, 13, 0.01);
    struct gbg_engine *engine = spoilt_engine(&scene, &made, &kernels, 0.1);
    struct gbg_engine *sound = made_engine(&scene, &made);
    assert_int_equal(gbg_engine_advance(engine, 1), GBG_OK);
    assert_int_equal(engine->repeated, 1);
    assert_int_equal(engine->reverted, 0);
    assert_true(naive_closest(engine) >= 1.0 - 1e-12);
    gbg_engine_free(engine);

    engine = spoilt_engine(&scene, &made, &kernels, 0.0);
    assert_int_equal(gbg_engine_advance(engine, 1), GBG_OK);
    assert_int_equal(gbg_engine_advance(sound, 1), GBG_OK);
    assert_int_equal(engine->repeated, 1);
    assert_int_equal(engine->reverted, 2);
    double fraction;
    assert_int_equal(gbg_engine_real(engine, "reverted_fraction", &fraction), GBG_OK);
    assert_true(fraction == 2.0 / 169.0);
    assert_true(naive_closest(engine) >= 1.0 - 1e-12);
    for (int64_t i = 0; i < 2; i++) {
        for (int a = 0; a < 2; a++) {
            assert_true(place(&engine->state, a, i, 0) == place(&engine->state, a, i, 1));
            assert_int_equal(engine->state.image[a][i], engine->state.start_image[a][i]);
        }
    }
    for (int64_t i = 30; i < 100; i++) { /* far from the two nothing differs */
        assert_true(place(&engine->state, 0, i, 0) == place(&sound->state, 0, i, 0));
    }

    /* 16 such steps put back 32, which a short run may; the 17th is refused as if never made */
    assert_int_equal(gbg_engine_advance(engine, 15), GBG_OK);
    assert_int_equal(engine->reverted, 32);
    char before[65], after[65];
    assert_int_equal(gbg_engine_digest(engine, before), GBG_OK);
    assert_int_equal(gbg_engine_advance(engine, 1), GBG_E_STEP);
    print_message("%s\n", gbg_message(context));
    assert_non_null(strstr(gbg_message(context), "excluded_volume.reverted"));
    assert_int_equal(gbg_engine_digest(engine, after), GBG_OK);
    assert_string_equal(before, after);
    assert_int_equal(engine->reverted, 32);
    gbg_engine_free(engine);

    scene.reverted = 0.0; /* none at all */
    engine = spoilt_engine(&scene, &made, &kernels, 0.0);
    assert_int_equal(gbg_engine_advance(engine, 1), GBG_E_STEP);
    gbg_engine_free(engine);
    gbg_engine_free(sound);
    gbg_context_destroy(&context);
}

/* Rounds that run out leave pairs that overlap: these go back, and nothing else is wrong. */
static void rounds_that_run_out(void **unused)
{
    (void)unused;
    static struct made_particles made;
    char expected[65] = "", text[65];
    for (int threads = 1; threads <= 3; threads++) {
        struct gbg_context *context = made_context(threads == 1   ? "cpu:threads=1"
                                                   : threads == 2 ? "cpu:threads=2"
                                                                  : "cpu:threads=3");
        double length[3] = {20.5, 20.5, 0};
        struct gbg_scene scene = made_scene(context, 2, length);
        scene.max_rounds = 1;
        scene.reverted = 1.0;
        made_lattice(&made, &scene, 20, 0.01);
        struct gbg_engine *engine = made_engine(&scene, &made);
        for (int k = 0; k < 30; k++) {
            assert_int_equal(gbg_engine_advance(engine, 1), GBG_OK);
            assert_true(naive_closest(engine) >= 1.0 - 1e-12);
        }
        assert_true(engine->reverted > 100);
        print_message("%.3f of all moves put back\n", gbg_engine_reverted_fraction(engine));
        assert_int_equal(gbg_engine_digest(engine, text), GBG_OK);
        if (threads == 1) {
            strcpy(expected, text);
        }
        assert_string_equal(text, expected);
        gbg_engine_free(engine);
        gbg_context_destroy(&context);
    }
}

/* A run that stops names a dt; with that it goes on from where it stopped. */
static void the_dt_named_will_do(void **unused)
{
    (void)unused;
    static struct made_particles made;
    struct gbg_context *context = made_context("cpu:threads=2");
    double length[2] = {22.0, 22.0};
    static const double steps[] = {1.0, 10.0, 100.0, 400.0};
    for (int k = 0; k < 4; k++) {
        struct gbg_scene scene = made_scene(context, 2, length);
        scene.dt = steps[k];
        made_lattice(&made, &scene, 20, 0.01);
        struct gbg_engine *engine = made_engine(&scene, &made);
        char before[65], after[65];
        int64_t made_steps = 0;
        int status = GBG_OK;
        for (; made_steps < 50 && status == GBG_OK; made_steps++) {
            assert_int_equal(gbg_engine_digest(engine, before), GBG_OK);
            status = gbg_engine_advance(engine, 1);
        }
        print_message("dt %g: %lld steps, %lld put back; %s\n", scene.dt, (long long)made_steps,
                      (long long)engine->reverted, status ? gbg_message(context) : "");
        assert_true(naive_closest(engine) >= 1.0 - 1e-12);
        if (status != GBG_OK) {
            assert_int_equal(status, GBG_E_STEP);
            assert_int_equal(gbg_engine_digest(engine, after), GBG_OK);
            assert_string_equal(before, after);
            const char *named = strstr(gbg_message(context), "safe here: ");
            assert_non_null(named);
            scene.dt = strtod(named + strlen("safe here: "), NULL);
            gbg_engine_free(engine);
            engine = made_engine(&scene, &made);
            assert_int_equal(gbg_engine_advance(engine, 200), GBG_OK);
            assert_int_equal(engine->reverted, 0);
        }
        gbg_engine_free(engine);
    }
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_pairs_and_paths),
        cmocka_unit_test(decides_at_the_tolerance),
        cmocka_unit_test(gentle_correction_and_roll_back),
        cmocka_unit_test(rounds_that_run_out),
        cmocka_unit_test(the_dt_named_will_do),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
