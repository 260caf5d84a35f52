/* Tests of the contact rule bridge: its numbers, its law for a pair, its limit without noise. */
#include "made_scene.h"

#include "backend/cpu/bridge_pair.h"
#include "backend/cpu/noise.h"

static struct made_particles made;

static struct gbg_scene bridge_scene(struct gbg_context *context, int dimension,
                                     const double *length)
{
    struct gbg_scene scene = made_scene(context, dimension, length);
    scene.rule = GBG_RULE_BRIDGE;
    return scene;
}

static void place(int64_t n, const double *x, const double *y)
{
    made.p =
        (struct gbg_particles){n, 2, {made.store[0], made.store[1], NULL}, made.species, made.id};
    for (int64_t i = 0; i < n; i++) {
        made.store[0][i] = x[i];
        made.store[1][i] = y[i];
        made.species[i] = 0;
        made.id[i] = i;
    }
}

static void get_places(struct gbg_engine *engine, double *x, double *y)
{
    assert_int_equal(gbg_engine_decode(engine, 1, 0, x, 1), GBG_OK);
    assert_int_equal(gbg_engine_decode(engine, 1, 1, y, 1), GBG_OK);
}

/* -2 ln u of noise.h for words over the whole range and close to both ends. */
static void logarithm(void **state)
{
    (void)state;
    double worst = 0.0;
    for (uint32_t k = 0; k < 2000000; k += VF_LANES) {
        uint32_t word[VF_LANES];
        float value[VF_LANES];
        for (uint32_t l = 0; l < VF_LANES; l++) {
            uint32_t part = k + l, kind = part % 4;
            word[l] = kind == 0   ? part * 2147u
                      : kind == 1 ? ~(part / 4 * 7u)
                      : kind == 2 ? part / 4
                                  : part * 2654435761u;
        }
        vf_store(value, gbg_noise_exponential(vi_load(word)));
        for (int l = 0; l < VF_LANES; l++) {
            double u = ((double)(word[l] >> 1) + 0.5) * 0x1p-31, exact = -2.0 * log(u);
            int exponent;
            frexp(exact, &exponent);
            worst = fmax(worst, fabs((double)value[l] - exact) / ldexp(1.0, exponent - 24));
        }
    }
    print_message("-2 ln u: at most %.2f units in the last place from libm\n", worst);
    assert_true(worst > 0.0 && worst < 5.0);
}

/* New difference of a free pair by the rule, written down once more in double precision. */
static void expected_pair(const double start[2], const double move[2], double draw, double out[2])
{
    double r0 = hypot(start[0], start[1]), normal[2] = {start[0] / r0, start[1] / r0};
    double free[2] = {start[0] + move[0], start[1] + move[1]};
    double z = hypot(free[0], free[1]) - r0, push = 0.0;
    for (int solve = 0; solve < 2; solve++) {
        double now[2] = {free[0] + push * normal[0], free[1] + push * normal[1]};
        if (solve == 1) {
            double r = hypot(now[0], now[1]);
            normal[0] = now[0] / r;
            normal[1] = now[1] / r;
            z = normal[0] * free[0] + normal[1] * free[1] - r0;
        }
        push = fmax(0.0, -(r0 - 1.0 + 0.5 * (z - sqrt(z * z + draw))));
    }
    out[0] = free[0] + push * normal[0];
    out[1] = free[1] + push * normal[1];
}

/* Uniform numbers belong to (seed, run), step and the two ids, whatever the order of the discs. */
static void numbers_are_keyed(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu");
    double length[2] = {8.0, 8.0}, x[2], y[2], worst = 0.0;
    uint64_t pushed = 0;
    for (int large = 0; large < 2; large++) {
        struct gbg_scene scene = bridge_scene(context, 2, length);
        scene.seed = 12345 + 100 * large;
        scene.run = 3;
        const double at_x[2] = {0.3, 1.3005}, at_y[2] = {0.1, 0.11};
        place(2, at_x, at_y);
        made.id[0] = large ? 3 : 5;
        made.id[1] = large ? ((int64_t)1 << 40) + 9 : 800; /* beyond 32 bits: folded */
        struct gbg_engine *engine = made_engine(&scene, &made);
        uint64_t id[2] = {engine->state.id[0], engine->state.id[1]};
        assert_true(id[0] < id[1]);
        for (uint64_t step = 0; step < 400; step++) {
            double xi[2][2], start[2], move[2], expected[2];
            get_places(engine, x, y);
            for (int k = 0; k < 2; k++) {
                assert_int_equal(engine->kernels->normals(engine->device, &engine->noise, step,
                                                          id[k], 1, 2, xi[k]),
                                 GBG_OK);
            }
            start[0] = x[0] - x[1] - 8.0 * rint((x[0] - x[1]) / 8.0);
            start[1] = y[0] - y[1] - 8.0 * rint((y[0] - y[1]) / 8.0);
            move[0] = xi[0][0] - xi[1][0];
            move[1] = xi[0][1] - xi[1][1];
            struct gbg_philox r = gbg_philox(
                gbg_philox_pair(step, id[0], id[1], GBG_STREAM_BRIDGE, (uint32_t)scene.seed, 3),
                (uint32_t)scene.seed, 3);
            double u = ((double)(r.word[0] >> 1) + 0.5) * 0x1p-31;
            expected_pair(start, move, -4.0 * 1e-4 * log(u), expected);
            int64_t before = engine->contact_pairs;
            assert_int_equal(gbg_engine_advance(engine, 1), GBG_OK);
            pushed += (uint64_t)(engine->contact_pairs - before);
            get_places(engine, x, y);
            worst = fmax(worst, fabs(x[0] - x[1] - expected[0] -
                                     8.0 * rint((x[0] - x[1] - expected[0]) / 8.0)));
            worst = fmax(worst, fabs(y[0] - y[1] - expected[1] -
                                     8.0 * rint((y[0] - y[1] - expected[1]) / 8.0)));
        }
        gbg_engine_free(engine);
    }
    print_message("%llu pushes of 800 steps, at most %.1e from the formula\n",
                  (unsigned long long)pushed, worst);
    assert_true(pushed >= 30);
    assert_true(worst < 2e-8);
    gbg_context_destroy(&context);
}

static double normal_cdf(double x)
{
    return 0.5 * erfc(-x / sqrt(2.0));
}

static int compare(const void *a, const void *b)
{
    double p = *(const double *)a, q = *(const double *)b;
    return (p > q) - (p < q);
}

enum { PAIRS = 2500, BATCHES = 40 };

/* Kolmogorov and Smirnov's distance between the gaps after one step of pairs that start at `gap`
 * and the law of a Brownian coordinate with a drift, reflected at contact. */
static double distance_from_law(struct gbg_context *context, int rule, double gap)
{
    static double sample[PAIRS * BATCHES], x[2 * PAIRS], y[2 * PAIRS];
    const int64_t side = 50, n = PAIRS * BATCHES;
    double length[2] = {5.0 * (double)side, 5.0 * (double)side}, worst = 0.0;
    struct gbg_scene scene = bridge_scene(context, 2, length);
    scene.rule = rule;
    scene.temperature = 1e-4;
    made_short_forces(&scene);
    double deviation = sqrt(2.0 * scene.temperature * scene.dt);
    scene.species[0].alpha = -0.9 * deviation / (2.0 * scene.dt); /* of a pair: a = -0.9 S */
    double drift = 2.0 * scene.species[0].alpha * scene.dt / pow(1.0 + gap, 6.0);
    for (int batch = 0; batch < BATCHES; batch++) {
        for (int64_t k = 0; k < PAIRS; k++) {
            x[2 * k] = 5.0 * (double)(k % side);
            x[2 * k + 1] = x[2 * k] + 1.0 + gap;
            y[2 * k] = y[2 * k + 1] = 5.0 * (double)(k / side);
        }
        place(2 * PAIRS, x, y);
        scene.seed = 1000 + batch;
        struct gbg_engine *engine = made_engine(&scene, &made);
        assert_int_equal(gbg_engine_advance(engine, 1), GBG_OK);
        get_places(engine, x, y);
        for (int64_t k = 0; k < PAIRS; k++) {
            double dx = x[2 * k] - x[2 * k + 1], dy = y[2 * k] - y[2 * k + 1];
            dx -= length[0] * rint(dx / length[0]);
            dy -= length[1] * rint(dy / length[1]);
            sample[batch * PAIRS + k] = hypot(dx, dy) - 1.0;
        }
        gbg_engine_free(engine);
    }
    qsort(sample, (size_t)n, sizeof *sample, compare);
    for (int64_t k = 0; k < n; k++) {
        double g = sample[k];
        double law = normal_cdf((g - gap - drift) / deviation) -
                     exp(2.0 * drift * g / (deviation * deviation)) *
                         normal_cdf((-g - gap - drift) / deviation);
        worst = fmax(worst, fmax(fabs(law - (double)k / (double)n),
                                 fabs(law - (double)(k + 1) / (double)n)));
    }
    return worst;
}

static void law_of_one_pair(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu:threads=2");
    static const double gaps[] = {1e-6, 5e-4, 2e-3};
    double bounce = distance_from_law(context, GBG_RULE_BOUNCE, gaps[1]);
    for (int k = 0; k < 3; k++) {
        double found = distance_from_law(context, GBG_RULE_BRIDGE, gaps[k]);
        print_message("gap %g: Kolmogorov-Smirnov distance %.5f (1e5 pairs, 1 %%: 0.00515)\n",
                      gaps[k], found);
        assert_true(found < 0.00515);
    }
    print_message("bounce from %g: %.5f\n", gaps[1], bounce);
    assert_true(bounce > 0.05); /* the test can tell */
    gbg_context_destroy(&context);
}

/* Without noise: discs 0..4 in touch are pressed together, the pair 5, 6 far off drifts into
 * contact, and 7 stays alone. The pushes of a chain follow from where its free moves lead: every
 * disc of a closed chain ends at its place around the chain's free centre. */
static void without_noise(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu");
    double length[2] = {40.0, 10.0}, x[8], y[8], force[8];
    const double at_x[8] = {1.0, 2.0, 3.0, 4.0 + 1e-4, 5.0 + 1e-4, 12.0, 13.003, 20.0};
    const double at_y[8] = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
    struct gbg_scene scene = bridge_scene(context, 2, length);
    scene.temperature = 0.0;
    made_short_forces(&scene);
    place(8, at_x, at_y);
    made.species[1] = made.species[6] = 1; /* a faster one, so that the centre moves */
    scene.species[1].alpha = -1.0;
    scene.species[1].mobility = 1.4;
    struct gbg_engine *engine = made_engine(&scene, &made);
    assert_int_equal(gbg_engine_evaluate_forces(engine), GBG_OK);
    memcpy(force, engine->state.force[0], sizeof force);
    assert_int_equal(gbg_engine_advance(engine, 1), GBG_OK);
    get_places(engine, x, y);
    static const int first[4] = {0, 5, 7, 8};
    double worst = 0.0;
    for (int chain = 0; chain < 3; chain++) {
        int n = first[chain + 1] - first[chain];
        double centre = 0.0, load = 0.0;
        for (int k = first[chain]; k < first[chain + 1]; k++) {
            centre += (at_x[k] + force[k] * scene.dt) / n;
        }
        for (int k = first[chain]; k < first[chain + 1]; k++) {
            double place_k = centre + (double)(k - first[chain]) - 0.5 * (n - 1);
            load += place_k - (at_x[k] + force[k] * scene.dt);
            assert_true(k + 1 == first[chain + 1] ? fabs(load) < 1e-12 : load < 0.0);
            double off = x[k] - place_k;
            worst = fmax(worst, fabs(off - 40.0 * rint(off / 40.0)));
        }
    }
    print_message("no noise: at most %.1e from the places of the chains\n", worst);
    assert_true(worst < 1e-4); /* overlaps of 1e-2 are taken out */
    assert_true(naive_closest(engine) >= 1.0 - 1e-12);
    gbg_engine_free(engine);
    gbg_context_destroy(&context);
}

/* Ends a run, which must have come to the digest `expected`, or to any if that is empty yet. */
static void end_as(struct gbg_engine *engine, char expected[65])
{
    char text[65];
    assert_int_equal(gbg_engine_digest(engine, text), GBG_OK);
    gbg_engine_free(engine);
    if (!expected[0]) {
        strcpy(expected, text);
    }
    assert_string_equal(text, expected);
}

/* Threads, instruction set and skin leave every bit as it is. */
static void same_bits(void **state)
{
    (void)state;
    static const char *const contexts[] = {"cpu:threads=1", "cpu:threads=2", "cpu:threads=5",
                                           "poison:threads=2", "cpu:threads=2,isa=avx2"};
    for (int dimension = 2; dimension <= 3; dimension++) {
        char expected[65] = "";
        double length[3] = {64.5, 64.0, 13.5};
        if (dimension == 3) {
            length[0] = length[1] = 13.5;
        }
        for (size_t k = 0; k < 6; k++) {
            struct gbg_context *context;
            if (gbg_context_create(contexts[k % 5], &context) != GBG_OK) {
                continue;
            }
            if (k == 4 && strcmp(context->instructions, "generic") == 0) {
                gbg_context_destroy(&context);
                continue;
            }
            struct gbg_scene scene = bridge_scene(context, dimension, length);
            made_short_forces(&scene);
            scene.skin = k == 5 ? 0.07 : 0.0;
            made_lattice(&made, &scene, dimension == 2 ? 60 : 12, 0.005);
            struct gbg_engine *engine = made_engine(&scene, &made);
            assert_int_equal(gbg_engine_advance(engine, 40), GBG_OK);
            assert_true(engine->contact_pairs > 1000);
            end_as(engine, expected);
            gbg_context_destroy(&context);
        }
        print_message("%dD: %s\n", dimension, expected);
    }
}

/* A cluster that forces over all pairs press together: the same bits on any threads and any
 * instruction set (strict sums), and in parts, for nothing is kept from step to step. */
static void pressed_same_bits(void **state)
{
    (void)state;
    static const char *const contexts[] = {"cpu:threads=1", "cpu:threads=5", "poison:threads=2",
                                           "cpu:threads=2,isa=avx2"};
    for (int dimension = 2; dimension <= 3; dimension++) {
        char expected[65] = "";
        int64_t m = dimension == 2 ? 40 : 9;
        double length[3] = {4.0 * (double)m, 4.0 * (double)m, 4.0 * (double)m};
        for (size_t k = 0; k < 4; k++) {
            struct gbg_context *context;
            if (gbg_context_create(contexts[k], &context) != GBG_OK) {
                continue;
            }
            if (k == 3 && strcmp(context->instructions, "generic") == 0) {
                gbg_context_destroy(&context);
                continue;
            }
            struct gbg_scene scene = bridge_scene(context, dimension, length);
            made_pressed(&made, &scene, m);
            struct gbg_engine *engine = made_engine(&scene, &made);
            assert_int_equal(gbg_engine_advance(engine, k == 1 ? 7 : 20), GBG_OK);
            assert_int_equal(gbg_engine_advance(engine, k == 1 ? 13 : 0), GBG_OK);
            assert_true(engine->contact_pairs > 10 * made.p.n);
            assert_int_equal(engine->reverted, 0);
            end_as(engine, expected);
            gbg_context_destroy(&context);
        }
        print_message("%dD, pressed: %s\n", dimension, expected);
    }
}

/* Limits of rounds: grow with the layers, stay in what memory was laid out for; without pressure
 * there are the few rounds of short range. */
static void rounds_follow_layers(void **state)
{
    (void)state;
    struct bridge_plan plan = {.dimension = 2, .deviation = 0.01};
    int last = 0;
    for (int64_t n = 1; n < (int64_t)1 << 40; n *= 4) {
        bridge_choose_sweeps(&plan, n, 1);
        assert_true(plan.rounds[0] >= last && plan.rounds[2] <= BRIDGE_MOST_ROUNDS);
        assert_true(plan.momentum >= 0.8f && plan.momentum < 1.0f && plan.stiff > 0.0f);
        last = plan.rounds[0];
    }
    assert_true(last == BRIDGE_MOST_ROUNDS && plan.solves == BRIDGE_SOLVES);
    assert_int_equal(bridge_layers(2, 16384), 128);
    assert_int_equal(bridge_layers(2, 16385), 129);
    assert_int_equal(bridge_layers(3, 4096), 16);
    bridge_choose_sweeps(&plan, 16384, 0);
    assert_true(plan.momentum == 0.0f && plan.stiff == 0.0f);
    assert_int_equal(plan.solves, 2);
    assert_int_equal(plan.rounds[0], BRIDGE_ROUNDS_FIRST);
    assert_int_equal(plan.rounds[1], BRIDGE_ROUNDS_SECOND);
}

/* Moves what the state holds of particle order[k] to index k. */
static void permute(struct gbg_state *state, const int64_t *order)
{
    static uint64_t old[5000];
    for (int what = 0; what <= 2 * state->box.dimension + 1; what++) {
        int a = what / 2;
        uint32_t *word = a == state->box.dimension ? NULL
                         : what % 2                ? state->low[a]
                                                   : state->high[a];
        for (int64_t k = 0; k < state->owned; k++) {
            old[k] = word ? word[k] : what % 2 ? state->id[k] : state->species[k];
        }
        for (int64_t k = 0; k < state->owned; k++) {
            if (word) {
                word[k] = (uint32_t)old[order[k]];
            } else if (what % 2) {
                state->id[k] = old[order[k]];
            } else {
                state->species[k] = (uint8_t)old[order[k]];
            }
        }
    }
}

/* Particles that stand elsewhere in memory move by the same bits (without forces: those are summed
 * in the order of indices). */
static void any_order_in_memory(void **state)
{
    (void)state;
    static int64_t order[5000];
    struct gbg_context *context = made_context("cpu:threads=2");
    for (int dimension = 2; dimension <= 3; dimension++) {
        struct gbg_engine *engine[2];
        double length[3] = {dimension == 2 ? 64.0 : 13.0, dimension == 2 ? 64.0 : 13.0, 13.0};
        for (int k = 0; k < 2; k++) {
            struct gbg_scene scene = bridge_scene(context, dimension, length);
            scene.dt = 0.1;
            made_lattice(&made, &scene, dimension == 2 ? 60 : 12, 0.005);
            for (int64_t i = 0; i < made.p.n; i++) {
                made.id[i] = 3 * i + 1; /* ids that are no indices */
                order[i] = k ? (i * 1237 + 17) % made.p.n : i;
            }
            engine[k] = made_engine(&scene, &made);
            permute(&engine[k]->state, order);
            engine[k]->moved = 1e300; /* the list knows the old order */
            assert_int_equal(gbg_engine_advance(engine[k], 40), GBG_OK);
        }
        for (int64_t i = 0; i < made.p.n; i++) {
            for (int a = 0; a < dimension; a++) {
                assert_true(engine[1]->state.high[a][i] == engine[0]->state.high[a][order[i]]);
                assert_true(engine[1]->state.low[a][i] == engine[0]->state.low[a][order[i]]);
            }
        }
        assert_true(engine[0]->contact_pairs > 1000);
        gbg_engine_free(engine[0]);
        gbg_engine_free(engine[1]);
    }
    gbg_context_destroy(&context);
}

static void no_overlap_after_any_step(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu:threads=2");
    static const double mobility[3] = {-2.0, -2.0, -4.0}, sign[3] = {-1.0, 1.0, -1.0};
    static const char *const names[3] = {"C2, 2D", "C3, 2D", "C4, 2D"};
    double square[2] = {30.0 * 0.9971, 30.0 * 0.9971}, cube[3] = {8.5, 8.6, 8.7};
    for (int k = 0; k < 4; k++) { /* area fraction 0.755; in 3D 0.42 */
        struct gbg_scene scene = bridge_scene(context, k < 3 ? 2 : 3, k < 3 ? square : cube);
        int c = k < 3 ? k : 2;
        made_short_forces(&scene);
        scene.species[0].alpha = -sign[c];
        scene.species[1].alpha = sign[c];
        scene.species[1].mobility = mobility[c];
        if (k < 3) { /* a jittered square lattice needs room; forces close it */
            scene.length[0] = scene.length[1] = 30.0 * 1.02;
        }
        made_lattice(&made, &scene, k < 3 ? 30 : 8, 0.005);
        struct gbg_engine *engine = made_engine(&scene, &made);
        run_without_overlap(engine, 60, k < 3 ? names[k] : "C4, 3D");
        gbg_engine_free(engine);
    }
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(logarithm),
        cmocka_unit_test(numbers_are_keyed),
        cmocka_unit_test(law_of_one_pair),
        cmocka_unit_test(without_noise),
        cmocka_unit_test(same_bits),
        cmocka_unit_test(pressed_same_bits),
        cmocka_unit_test(rounds_follow_layers),
        cmocka_unit_test(any_order_in_memory),
        cmocka_unit_test(no_overlap_after_any_step),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
