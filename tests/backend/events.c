/* Tests of a GPU against the CPU: the rule event. The same bits and the same counters, after the
 * rule alone and after whole steps. */
#include "both.h"

static struct made_particles made;

/* Free moves from the kept coordinates, uniform up to `size` on the first axes, the same on both.
 */
static void shift_all(struct both *both, int64_t n, double size, int axes, uint64_t seed)
{
    static uint32_t high[5000], low[5000];
    static int32_t image[5000];
    for (int b = 0; b < 2; b++) {
        struct gbg_engine *engine = both->engine[b];
        const struct gbg_backend *backend = engine->backend;
        struct gbg_state *state = &engine->state;
        size_t bytes = (size_t)n * 4;
        assert_int_equal(engine->kernels->keep(engine->device, state), GBG_OK);
        for (int a = 0; n > 0 && a < axes; a++) {
            assert_int_equal(backend->download(engine->device, high, state->high[a], bytes),
                             GBG_OK);
            assert_int_equal(backend->download(engine->device, low, state->low[a], bytes), GBG_OK);
            if (state->image[a]) {
                assert_int_equal(backend->download(engine->device, image, state->image[a], bytes),
                                 GBG_OK);
            }
            for (int64_t i = 0; i < n; i++) {
                double u = made_uniform(seed + (uint64_t)(3 * i + a));
                int64_t quanta = (int64_t)rint(size * (2.0 * u - 1.0) / state->box.quantum[a]);
                uint64_t old = (uint64_t)high[i] << 32 | low[i], moved = old + (uint64_t)quanta;
                high[i] = (uint32_t)(moved >> 32);
                low[i] = (uint32_t)moved;
                image[i] += (quanta > 0 && moved < old) - (quanta < 0 && moved > old);
            }
            assert_int_equal(backend->upload(engine->device, state->high[a], high, bytes), GBG_OK);
            assert_int_equal(backend->upload(engine->device, state->low[a], low, bytes), GBG_OK);
            if (state->image[a]) {
                assert_int_equal(backend->upload(engine->device, state->image[a], image, bytes),
                                 GBG_OK);
            }
        }
        assert_int_equal(
            engine->kernels->list_update(engine->device, state, engine->contacts, 1e300), GBG_OK);
    }
}

/* The rule alone, some times over, each from where the last one ended; the first two times with
 * moves up to `melt`. */
static int64_t compare_rule(struct both *both, int64_t n, double melt, double size, int axes,
                            int steps, const char *name, int64_t *most_stopped)
{
    int64_t events = 0;
    *most_stopped = 0;
    for (int step = -2; step < steps; step++) {
        struct gbg_contacts contacts[2];
        struct gbg_pair pair[2];
        shift_all(both, n, step < 0 ? melt : size, axes, (uint64_t)(20000 * (step + 2) + 77));
        for (int b = 0; b < 2; b++) {
            struct gbg_engine *engine = both->engine[b];
            contacts[b] = (struct gbg_contacts){.tolerance = 1e-12};
            if (engine->kernels->events(engine->device, &engine->state, engine->contacts,
                                        &contacts[b]) != GBG_OK) {
                fail_msg("%s: %s", name, gbg_message(both->context[b]));
            }
        }
        both_same_state(both);
        if (contacts[0].pairs != contacts[1].pairs || contacts[0].rounds != contacts[1].rounds ||
            contacts[0].stopped != contacts[1].stopped || contacts[0].left != contacts[1].left) {
            fail_msg(
                "%s: %lld events, depth %lld, %lld stopped on the CPU, %lld, %lld, %lld on the "
                "GPU",
                name, (long long)contacts[0].pairs, (long long)contacts[0].rounds,
                (long long)contacts[0].stopped, (long long)contacts[1].pairs,
                (long long)contacts[1].rounds, (long long)contacts[1].stopped);
        }
        both_same_real(contacts[0].largest, contacts[1].largest, "the largest move");
        both_same_real(contacts[0].virial, contacts[1].virial, "the virial");
        *most_stopped = contacts[0].stopped > *most_stopped ? contacts[0].stopped : *most_stopped;
        for (int larger = 0; larger < 2; larger++) { /* nobody came too close, but nearly */
            for (int b = 0; b < 2; b++) {
                struct gbg_engine *engine = both->engine[b];
                struct gbg_state enlarged = engine->state;
                for (int s = 0; s < enlarged.n_species; s++) {
                    enlarged.diameter[s] *= larger ? 1.0 + 1e-6 : 1.0;
                }
                assert_int_equal(engine->kernels->events_clear(engine->device, &enlarged,
                                                               engine->contacts, 1e-9, &pair[b]),
                                 GBG_OK);
            }
            assert_int_equal(pair[0].first, pair[1].first);
            assert_int_equal(pair[0].second, pair[1].second);
            both_same_real(pair[0].distance, pair[1].distance, "the distance of a pair");
            if (*most_stopped == 0) { /* else they overlap, as they may */
                assert_int_equal(pair[1].first >= 0, larger && contacts[0].pairs > 0);
            }
        }
        events += step < 0 ? 0 : contacts[0].pairs;
    }
    print_message("%s: %.3f events a particle and step\n", name,
                  n ? (double)events / (double)n / steps : 0.0);
    return events;
}

/* Packings 0.3 to 0.79, lengths of moves from far below to beyond the range of the list; one size,
 * several, and one of them nearly a point; edges that differ. */
static void rule_is_the_same(void **state)
{
    (void)state;
    static const struct {
        int dimension, m;
        double packing, size, diameter[2];
        int steps;
    } cases[] = {
        {2, 60, 0.30, 0.002, {1.0, 1.0}, 4}, {2, 60, 0.30, 0.05, {1.0, 1.0}, 6},
        {2, 60, 0.52, 0.02, {1.0, 1.0}, 8},  {2, 60, 0.52, 0.07, {1.0, 0.8}, 6},
        {2, 50, 0.52, 0.9, {1.0, 1.0}, 2},   {2, 40, 0.70, 0.001, {1.0, 1.0}, 4},
        {2, 60, 0.70, 0.02, {1.0, 1.0}, 6},  {2, 50, 0.70, 0.17, {0.9, 1.0}, 4},
        {2, 40, 0.78, 0.01, {1.0, 1.0}, 4},  {2, 40, 0.78, 0.05, {1.0, 0.06}, 4},
        {3, 15, 0.30, 0.03, {1.0, 1.0}, 6},  {3, 15, 0.45, 0.04, {1.0, 1.0}, 4},
        {3, 12, 0.45, 0.2, {1.0, 0.5}, 3},   {3, 6, 0.50, 0.8, {1.0, 1.0}, 2},
    };
    int64_t events = 0, stopped;
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        if (!both_takes((int)c)) {
            continue;
        }
        char name[96];
        int dimension = cases[c].dimension, m = cases[c].m;
        double volume = dimension == 2 ? acos(-1.0) / 4.0 : acos(-1.0) / 6.0;
        double spacing = pow(volume / cases[c].packing, 1.0 / dimension);
        /* edges as different as the lattice allows */
        double room = fmin(1.04, spacing * 0.9999), length[3];
        for (int a = 0; a < dimension; a++) {
            length[a] = m * spacing;
        }
        length[0] *= room;
        length[1] /= room;
        if (length[0] < m * 1.0001 || length[1] < m * 1.0001) {
            length[0] = length[1] = m * spacing;
        }
        snprintf(name, sizeof name, "%dD, packing %.2f, diameters %g and %g, moves to %g",
                 dimension, cases[c].packing, cases[c].diameter[0], cases[c].diameter[1],
                 cases[c].size);
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = made_scene(context, dimension, length);
        scene.rule = GBG_RULE_EVENT;
        scene.temperature = 0.0;
        scene.unwrapped = scene.overlap = 1;
        scene.species[0].diameter = cases[c].diameter[0];
        scene.species[1].diameter = cases[c].diameter[1];
        made_lattice(&made, &scene, m, 0.0);
        struct both both = both_make(scene, &made);
        events += compare_rule(&both, made.p.n, fmax(0.2, cases[c].size), cases[c].size, dimension,
                               cases[c].steps, name, &stopped);
        both_free(&both);
        gbg_context_destroy(&context);
    }
    assert_true(events > 10000 || both_part() > 1);
}

/* Nobody, one, two that meet, 33; and boxes so small that a pair meets in several images. */
static void few_are_the_same(void **state)
{
    (void)state;
    static const int counts[] = {0, 1, 2, 3, 33};
    for (int dimension = 2; dimension <= 3; dimension++) {
        for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
            for (int large = 0; large < 2; large++) {
                double length[3] = {7.0, 6.7, 7.3};
                struct gbg_context *context = made_context("cpu");
                struct gbg_scene scene = made_scene(context, dimension, length);
                scene.rule = GBG_RULE_EVENT;
                scene.temperature = 0.0;
                scene.overlap = 1;
                made_lattice(&made, &scene, dimension == 2 ? 6 : 4, 0.0);
                made.p.n = counts[c];
                struct both both = both_make(scene, &made);
                int64_t stopped;
                compare_rule(&both, made.p.n, 0.2, large ? 0.9 : 0.15, dimension, 4, "few",
                             &stopped);
                both_free(&both);
                gbg_context_destroy(&context);
            }
        }
    }
}

/* Two discs that hit each other until they are let go at the limit of events. */
static void limit_is_the_same(void **state)
{
    (void)state;
    double length[2] = {2.00002, 4.0};
    struct gbg_context *context = made_context("cpu");
    struct gbg_scene scene = made_scene(context, 2, length);
    scene.rule = GBG_RULE_EVENT;
    scene.temperature = 0.0;
    scene.overlap = 1;
    made_lattice(&made, &scene, 2, 0.0);
    made.p.n = 2;
    made.store[0][0] = scene.origin[0] + 0.1;
    made.store[0][1] = scene.origin[0] + 1.10001;
    made.store[1][0] = made.store[1][1] = scene.origin[1] + 1.0;
    struct both both = both_make(scene, &made);
    int64_t stopped;
    compare_rule(&both, 2, 0.45, 0.45, 1, 4, "two in a line", &stopped);
    assert_int_equal(stopped, 2);
    both_free(&both);
    gbg_context_destroy(&context);
}

/* Whole steps, with the ids of a caller in another order than the particles; the digest holds all
 * there is. */
static void runs_are_the_same(void **state)
{
    (void)state;
    static const struct {
        int dimension, m, steps;
        double length, s;
    } cases[] = {
        {2, 40, 50, 40.0 * 1.229, 0.01}, {2, 40, 50, 40.0 * 1.229, 0.03},
        {2, 32, 50, 32.0 * 1.06, 0.02},  {2, 30, 50, 30.0 * 1.0013, 0.001},
        {2, 24, 6, 29.5, 0.1},           {2, 20, 5, 20.9, 0.5},
        {3, 12, 50, 12.0 * 1.06, 0.02},  {3, 8, 6, 8.42, 0.1},
    };
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        if (!both_takes((int)c)) {
            continue;
        }
        double length[3] = {cases[c].length, cases[c].length, cases[c].length};
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = made_scene(context, cases[c].dimension, length);
        scene.rule = GBG_RULE_EVENT;
        scene.dt = 1.0;
        scene.temperature = cases[c].s * cases[c].s;
        scene.unwrapped = 1;
        made_lattice(&made, &scene, cases[c].m, 0.0);
        for (int64_t i = 0; i < made.p.n; i++) {
            made.id[i] = (7 * i + 3) % made.p.n; /* m is no multiple of 7 */
        }
        struct both both = both_make(scene, &made);
        char digest[2][65];
        for (int b = 0; b < 2; b++) {
            both.engine[b]->ordering = c % 2 ? GBG_ORDERING_ALWAYS : GBG_ORDERING_NEVER;
            if (gbg_engine_advance(both.engine[b], cases[c].steps) != GBG_OK) {
                fail_msg("%s", gbg_message(both.context[b]));
            }
            assert_int_equal(gbg_engine_digest(both.engine[b], digest[b]), GBG_OK);
        }
        print_message("%dD, s %g: %lld and %lld events\n", cases[c].dimension, cases[c].s,
                      (long long)both.engine[0]->contact_pairs,
                      (long long)both.engine[1]->contact_pairs);
        assert_true(both.engine[0]->contact_pairs > 0);
        assert_int_equal(both.engine[0]->contact_pairs, both.engine[1]->contact_pairs);
        assert_string_equal(digest[0], digest[1]);
        both_free(&both);
        gbg_context_destroy(&context);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(few_are_the_same),
        cmocka_unit_test(limit_is_the_same),
        cmocka_unit_test(rule_is_the_same),
        cmocka_unit_test(runs_are_the_same),
    };
    return both_missing() ? BOTH_SKIPPED : cmocka_run_group_tests(tests, NULL, NULL);
}
