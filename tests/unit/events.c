/* Tests of the rule event: collisions against formulas and against a plain simulation, the same
 * bits however the work is shared out, no overlap, exact momentum, guards. */
#include "backend/cpu/events.h"
#include "backend/cpu/cpu.h"
#include "made_scene.h"

static struct made_particles made;

/* An engine with particles at given places (axis by axis), rule event, no noise. */
static struct gbg_engine *place(struct gbg_scene *scene, int n, const double *const *r)
{
    made_lattice(&made, scene, scene->dimension == 2 ? 12 : 6, 0.0);
    made.p.n = n;
    for (int i = 0; i < n; i++) {
        for (int a = 0; a < scene->dimension; a++) {
            made.store[a][i] = r[i][a];
        }
        made.species[i] = i % 2;
    }
    scene->rule = GBG_RULE_EVENT;
    scene->temperature = 0.0;
    scene->unwrapped = scene->overlap = 1;
    return made_engine(scene, &made);
}

/* Keeps the coordinates and adds a free move to those of particle i, images too. */
static void shift(struct gbg_engine *engine, int64_t i, const double *w)
{
    struct gbg_state *state = &engine->state;
    for (int a = 0; a < state->box.dimension; a++) {
        int64_t quanta = (int64_t)rint(w[a] / state->box.quantum[a]);
        uint64_t old = (uint64_t)state->high[a][i] << 32 | state->low[a][i];
        uint64_t moved = old + (uint64_t)quanta;
        state->high[a][i] = (uint32_t)(moved >> 32);
        state->low[a][i] = (uint32_t)moved;
        if (state->image[a]) {
            state->image[a][i] += (quanta > 0 && moved < old) - (quanta < 0 && moved > old);
        }
    }
}

/* Free moves w(axis of particle i), then the rule alone; together: in one queue. */
static struct gbg_contacts collide(struct gbg_engine *engine, const double *const *w, int together)
{
    struct gbg_contacts contacts = {.tolerance = 1e-12};
    const struct gbg_kernels *kernels = engine->kernels;
    assert_int_equal(kernels->keep(engine->device, &engine->state), GBG_OK);
    for (int64_t i = 0; w && i < engine->state.owned; i++) {
        shift(engine, i, w[i]);
    }
    assert_int_equal(kernels->list_update(engine->device, &engine->state, engine->contacts, 1e300),
                     GBG_OK);
    assert_int_equal(
        gbg_events_make(engine->device, &engine->state, engine->contacts, &contacts, together),
        GBG_OK);
    return contacts;
}

static void unwrapped(struct gbg_engine *engine, double r[3][5000])
{
    for (int a = 0; a < engine->state.box.dimension; a++) {
        assert_int_equal(gbg_engine_decode(engine, 0, a, r[a], 1), GBG_OK);
    }
}

/* Two particles against the textbook: time of contact from the quadratic, exchange of the normal
 * parts, the rest of the step straight on. */
static void pair_case(int dimension, const double *diameters, const double r[2][3],
                      const double w[2][3])
{
    static double end[3][5000];
    struct gbg_context *context = made_context("cpu");
    double length[3] = {8.0, 9.0, 7.0};
    struct gbg_scene scene = made_scene(context, dimension, length);
    scene.species[0].diameter = diameters[0];
    scene.species[1].diameter = diameters[1];
    const double *places[2] = {r[0], r[1]}, *moves[2] = {w[0], w[1]};
    struct gbg_engine *engine = place(&scene, 2, places);
    struct gbg_contacts contacts = collide(engine, moves, 0);

    double contact = 0.5 * (diameters[0] + diameters[1]), d[3], v[3], t = 2.0, u = 0.0;
    for (int image = 0; image < (dimension == 2 ? 9 : 27); image++) { /* whichever is met first */
        double way[3], b = 0.0, c = 0.0, v2 = 0.0;
        int box[3] = {image % 3 - 1, image / 3 % 3 - 1, image / 9 - 1};
        for (int a = 0; a < dimension; a++) {
            way[a] = r[0][a] - r[1][a] + box[a] * length[a];
            v[a] = w[0][a] - w[1][a];
            b += way[a] * v[a];
            c += way[a] * way[a];
            v2 += v[a] * v[a];
        }
        double root = b * b - v2 * (c - contact * contact);
        if (b < 0.0 && root > 0.0 && (-b - sqrt(root)) / v2 < t) {
            t = (-b - sqrt(root)) / v2;
            memcpy(d, way, sizeof d);
        }
    }
    assert_true(t > 0.0 && t < 1.0); /* of the case itself */
    for (int a = 0; a < dimension; a++) {
        u -= (d[a] + v[a] * t) / contact * v[a];
    }
    unwrapped(engine, end);
    for (int a = 0; a < dimension; a++) {
        double push = u * (d[a] + v[a] * t) / contact * (1.0 - t);
        assert_true(fabs(end[a][0] - (r[0][a] + w[0][a] + push)) < 1e-13);
        assert_true(fabs(end[a][1] - (r[1][a] + w[1][a] - push)) < 1e-13);
    }
    assert_int_equal(contacts.pairs, 1);
    assert_int_equal(contacts.rounds, 1);
    assert_true(fabs(contacts.virial - contact * u * (1.0 - t)) < 1e-11);
    assert_true(engine->state.overlapped[0] == 1 && engine->state.overlapped[1] == 1);
    gbg_engine_free(engine);
    gbg_context_destroy(&context);
}

static void pairs_against_formulas(void **state)
{
    (void)state;
    static const double equal[2] = {1.0, 1.0}, unequal[2] = {0.3, 1.9};
    pair_case(2, equal, (const double[2][3]){{1, 1}, {2.05, 1}},
              (const double[2][3]){{0.1, 0}, {-0.05, 0}});
    pair_case(2, equal, (const double[2][3]){{1, 1}, {2.05, 1.3}},
              (const double[2][3]){{0.15, 0.05}, {-0.1, 0.02}});
    pair_case(2, unequal, (const double[2][3]){{1, 1}, {2.0, 1.6}},
              (const double[2][3]){{0.15, 0.05}, {-0.1, 0.02}});
    /* across the edges, into a corner */
    pair_case(2, equal, (const double[2][3]){{5.9, 0}, {-1.1, 0.1}},
              (const double[2][3]){{0.09, 0.0}, {-0.05, 0.01}});
    pair_case(2, equal, (const double[2][3]){{5.6, 6.4}, {-1.6, -1.9}},
              (const double[2][3]){{0.09, 0.1}, {-0.05, -0.2}});
    pair_case(3, equal, (const double[2][3]){{1, 1, 1}, {1.7, 1.6, 1.5}},
              (const double[2][3]){{0.1, 0.1, 0.05}, {-0.1, 0.02, 0}});
    pair_case(3, unequal, (const double[2][3]){{1, 1, -1.7}, {1.8, 1.7, 4.7}},
              (const double[2][3]){{0.1, 0.1, -0.1}, {-0.1, 0.02, 0}});
    /* moves of several diameters, most of the way to the other side */
    pair_case(2, equal, (const double[2][3]){{-1.5, 1}, {3.0, 1.2}},
              (const double[2][3]){{3.9, 0.1}, {-3.6, 0.0}});
    pair_case(3, equal, (const double[2][3]){{-1.5, 1, 0}, {3.0, 1.2, 0.3}},
              (const double[2][3]){{-3.1, 0.1, 0}, {2.6, 0.0, 0.2}});
}

/* A row of touching discs: the move goes through to the last one, at once. */
static void cradle(void **state)
{
    (void)state;
    static double end[3][5000];
    struct gbg_context *context = made_context("cpu:threads=2");
    double length[2] = {16.0, 16.0}, r[7][2], w[7][2] = {{0}};
    const double *places[7], *moves[7];
    struct gbg_scene scene = made_scene(context, 2, length);
    for (int i = 0; i < 7; i++) {
        r[i][0] = 1.0 + i; /* exact in the box: they touch to the last bit */
        r[i][1] = 2.0;
        places[i] = r[i];
        moves[i] = w[i];
    }
    w[0][0] = 0.375;
    struct gbg_engine *engine = place(&scene, 7, places);
    struct gbg_contacts contacts = collide(engine, moves, 0);
    unwrapped(engine, end);
    for (int i = 0; i < 7; i++) {
        assert_true(end[0][i] == r[i][0] + (i == 6 ? 0.375 : 0.0) && end[1][i] == 2.0);
    }
    assert_int_equal(contacts.pairs, 6);
    assert_int_equal(contacts.rounds, 6);
    assert_true(contacts.left == 0 && contacts.stopped == 0);
    gbg_engine_free(engine);
    gbg_context_destroy(&context);
}

/* A plain simulation with no list, no queue and positions in doubles: at each event all pairs are
 * asked for their next contact. Coordinates without wrapping. */
static int plain_events(int dimension, const double *length, const double diameter[2], int n,
                        double (*r)[3], double (*v)[3])
{
    double now = 0.0;
    for (int events = 0;; events++) {
        double soonest = 1.0 - now;
        int p = -1, q = -1;
        for (int i = 0; i < n; i++) {
            for (int j = i + 1; j < n; j++) {
                double contact = 0.5 * (diameter[i % 2] + diameter[j % 2]);
                double b = 0.0, c = -contact * contact, v2 = 0.0;
                for (int a = 0; a < dimension; a++) {
                    double d = r[i][a] - r[j][a], w = v[i][a] - v[j][a];
                    d -= length[a] * rint(d / length[a]);
                    b += d * w;
                    c += d * d;
                    v2 += w * w;
                }
                double root = b * b - v2 * c;
                double t = b < 0.0 && root > 0.0 ? c / (sqrt(root) - b) : 2.0;
                if (t < soonest) {
                    soonest = t;
                    p = i;
                    q = j;
                }
            }
        }
        for (int i = 0; i < n; i++) {
            for (int a = 0; a < dimension; a++) {
                r[i][a] += v[i][a] * soonest;
            }
        }
        if (p < 0) {
            return events;
        }
        now += soonest;
        double d[3], normal = 0.0, d2 = 0.0;
        for (int a = 0; a < dimension; a++) {
            d[a] = r[p][a] - r[q][a];
            d[a] -= length[a] * rint(d[a] / length[a]);
            normal += d[a] * (v[p][a] - v[q][a]);
            d2 += d[a] * d[a];
        }
        for (int a = 0; a < dimension; a++) {
            v[p][a] -= d[a] * normal / d2;
            v[q][a] += d[a] * normal / d2;
        }
    }
}

/* A lattice of discs or spheres of two sizes with moves up to `size` on each axis: the same ends as
 * in the plain simulation, and paths that the check passes, unless the particles had been larger.
 */
static void many_case(struct gbg_context *context, int dimension, const double diameter[2],
                      double size)
{
    static double r[200][3], v[200][3], end[3][5000];
    int m = dimension == 2 ? 9 : 5, n = dimension == 2 ? 81 : 125;
    double length[3] = {1.2 * m, 1.15 * m, 1.13 * m}, worst = 0.0;
    struct gbg_scene scene = made_scene(context, dimension, length);
    const double *places[200], *moves[200];
    made_lattice(&made, &scene, m, 0.02);
    for (int i = 0; i < n; i++) {
        for (int a = 0; a < dimension; a++) {
            r[i][a] = made.store[a][i];
            v[i][a] = size * (2.0 * made_uniform((uint64_t)(7000 + 3 * i + a)) - 1.0);
        }
        places[i] = r[i];
        moves[i] = v[i];
    }
    scene.species[0].diameter = diameter[0];
    scene.species[1].diameter = diameter[1];
    struct gbg_engine *engine = place(&scene, n, places);
    struct gbg_contacts contacts = collide(engine, moves, 0);
    int expected = plain_events(dimension, length, diameter, n, r, v);
    unwrapped(engine, end);
    for (int i = 0; i < n; i++) {
        for (int a = 0; a < dimension; a++) {
            worst = fmax(worst, fabs(end[a][i] - r[i][a]));
        }
    }
    print_message("%dD, diameters %g and %g, moves to %.2f: %d events, largest difference %.2g\n",
                  dimension, diameter[0], diameter[1], size, expected, worst);
    assert_int_equal(contacts.pairs, expected);
    assert_true(worst < 1e-9); /* each collision multiplies differences by a few */
    for (int larger = 0; larger < 2; larger++) {
        struct gbg_pair pair;
        assert_int_equal(
            gbg_events_clear(engine->device, &engine->state, engine->contacts, 1e-9, &pair),
            GBG_OK);
        assert_int_equal(pair.first >= 0, larger && expected > 0);
        if (larger && expected > 0) { /* it is one that touched, or came as near */
            double contact = 0.5 * (diameter[pair.first % 2] + diameter[pair.second % 2]);
            assert_true(pair.distance > contact * (1.0 - 1e-9));
            assert_true(pair.distance < contact * (1.0 + 1e-6) * (1.0 - 1e-9));
        }
        for (int s = 0; s < engine->state.n_species; s++) {
            engine->state.diameter[s] *= 1.0 + 1e-6;
        }
    }
    gbg_engine_free(engine);
}

static void many_against_plain(void **state)
{
    (void)state;
    static const double size[] = {0.05, 0.3, 0.9};
    static const double diameter[][2] = {{1.0, 1.0}, {1.07, 0.5}, {0.06, 1.07}};
    struct gbg_context *context = made_context("cpu:threads=2");
    for (int dimension = 2; dimension <= 3; dimension++) {
        for (int k = 0; k < 9; k++) {
            many_case(context, dimension, diameter[k / 3], size[k % 3]);
        }
    }
    gbg_context_destroy(&context);
}

/* Steps with noise s per component after two large ones that melt the lattice; the digest of the
 * end; returns the smallest distance of a pair after any step. */
static double run(const char *device, int dimension, int64_t m, double length, double s, int steps,
                  int together, int reorder, char text[65])
{
    struct gbg_context *context = made_context(device);
    double lengths[3] = {length, length, length}, closest = INFINITY;
    struct gbg_scene scene = made_scene(context, dimension, lengths);
    scene.rule = GBG_RULE_EVENT;
    scene.dt = 1.0;
    scene.temperature = s * s;
    scene.unwrapped = 1;
    made_lattice(&made, &scene, m, 0.0);
    struct gbg_engine *engine = made_engine(&scene, &made);
    const struct gbg_kernels *kernels = engine->kernels;
    engine->ordering = reorder ? GBG_ORDERING_ALWAYS : GBG_ORDERING_NEVER;
    for (int k = -2; k < steps; k++) {
        if (k <= 0) {
            engine->noise.scale = k < 0 ? fmin(0.4, 20.0 * s) : s;
            engine->contact_pairs = 0;
        }
        if (!together) {
            if (gbg_engine_advance(engine, 1) != GBG_OK) {
                fail_msg("%s", gbg_message(context));
            }
        } else { /* the same step by hand, all events in one queue */
            struct gbg_contacts contacts = {.tolerance = 1e-12, .cap = 0.25, .max_rounds = 1000};
            assert_int_equal(kernels->keep(engine->device, &engine->state), GBG_OK);
            assert_int_equal(kernels->integrate(engine->device, &engine->state, &engine->noise,
                                                engine->step, scene.dt, 1, &engine->moves),
                             GBG_OK);
            assert_int_equal(
                kernels->list_update(engine->device, &engine->state, engine->contacts, 1e300),
                GBG_OK);
            assert_int_equal(
                gbg_events_make(engine->device, &engine->state, engine->contacts, &contacts, 1),
                GBG_OK);
            engine->contact_pairs += contacts.pairs;
            assert_int_equal(
                kernels->contacts(engine->device, &engine->state, engine->contacts, &contacts),
                GBG_OK);
            assert_int_equal(contacts.rounds, 0);
            engine->step++;
        }
        closest = fmin(closest, naive_closest(engine));
    }
    assert_int_equal(gbg_engine_digest(engine, text), GBG_OK);
    const struct gbg_events *work = engine->contacts->events;
    print_message("%s, %dD, s %g%s: %.3f events a particle and step, %.1f passes, %lld of %d steps "
                  "with a wide list\n",
                  device, dimension, s, together ? ", one queue" : "",
                  (double)engine->contact_pairs / (double)made.p.n / steps,
                  (double)work->passes / steps, (long long)work->wide_steps, steps);
    gbg_engine_free(engine);
    gbg_context_destroy(&context);
    return closest;
}

/* Sharing the collisions out to clusters and threads changes nothing, nor does a new order in
 * memory: packing 0.52 and 0.79 in 2D, 0.45 in 3D. No step leaves an overlap. */
static void same_bits(void **state)
{
    (void)state;
    static const char *const devices[] = {"cpu:threads=1", "cpu:threads=2", "cpu:threads=5",
                                          "poison:threads=2", "cpu:threads=2,isa=avx2"};
    static const struct {
        int dimension, m, steps;
        double length, s;
    } cases[] = {
        {2, 32, 15, 39.33, 0.01}, {2, 24, 6, 29.5, 0.1}, {2, 32, 10, 32.0 * 1.0013, 0.001},
        {2, 30, 10, 31.3, 0.01},  {2, 20, 5, 20.9, 0.1}, {3, 10, 6, 10.52, 0.02},
        {3, 8, 4, 8.42, 0.1},     {2, 14, 3, 17.2, 1.0}, {3, 6, 2, 6.4, 0.5},
    };
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        char expected[65], text[65];
        double closest = run("cpu", cases[c].dimension, cases[c].m, cases[c].length, cases[c].s,
                             cases[c].steps, 1, 0, expected);
        for (size_t k = 0; k < sizeof devices / sizeof *devices; k++) {
            closest = fmin(closest, run(devices[k], cases[c].dimension, cases[c].m, cases[c].length,
                                        cases[c].s, cases[c].steps, 0, k == 1, text));
            assert_string_equal(text, expected);
        }
        print_message("closest %.17g\n", closest);
        assert_true(closest >= 1.0 - 1e-12);
    }
}

/* The same moves of the same particles, numbered from the other end. */
static void order_of_particles(void **state)
{
    (void)state;
    static double r[400][2], w[400][2], end[2][3][5000];
    struct gbg_context *context = made_context("cpu:threads=2");
    double length[2] = {20.0 * 1.1, 20.0 * 1.1};
    struct gbg_scene scene = made_scene(context, 2, length);
    made_lattice(&made, &scene, 20, 0.02);
    for (int i = 0; i < 400; i++) {
        for (int a = 0; a < 2; a++) {
            r[i][a] = made.store[a][i];
            w[i][a] = 0.4 * (2.0 * made_uniform((uint64_t)(9000 + 2 * i + a)) - 1.0);
        }
    }
    for (int reversed = 0; reversed < 2; reversed++) {
        const double *places[400], *moves[400];
        for (int i = 0; i < 400; i++) {
            places[i] = r[reversed ? 399 - i : i];
            moves[i] = w[reversed ? 399 - i : i];
        }
        struct gbg_engine *engine = place(&scene, 400, places);
        struct gbg_contacts contacts = collide(engine, moves, 0);
        assert_true(contacts.pairs > 400);
        unwrapped(engine, end[reversed]);
        gbg_engine_free(engine);
    }
    for (int i = 0; i < 400; i++) {
        assert_true(end[0][0][i] == end[1][0][399 - i] && end[0][1][i] == end[1][1][399 - i]);
    }
    gbg_context_destroy(&context);
}

/* The integers that events add to two targets are opposite: the sum of all fractions moves by the
 * free moves alone. */
static void exact_momentum(void **state)
{
    (void)state;
    static uint64_t fraction[5000];
    struct gbg_context *context = made_context("cpu:threads=2");
    double length[2] = {31.0, 33.0};
    uint64_t sums[2][2] = {{0, 0}, {0, 0}};
    for (int cores = 0; cores < 2; cores++) {
        struct gbg_scene scene = made_scene(context, 2, length);
        scene.rule = cores ? GBG_RULE_EVENT : GBG_RULE_NONE;
        scene.temperature = 0.25;
        made_lattice(&made, &scene, 30, 0.01);
        struct gbg_engine *engine = made_engine(&scene, &made);
        assert_int_equal(gbg_engine_advance(engine, 20), GBG_OK);
        assert_true(cores == 0 || engine->contact_pairs > 1000);
        for (int a = 0; a < 2; a++) {
            assert_int_equal(gbg_engine_copy_fractions(engine, a, fraction), GBG_OK);
            for (int64_t i = 0; i < made.p.n; i++) {
                sums[cores][a] += fraction[i];
            }
        }
        gbg_engine_free(engine);
    }
    assert_true(sums[0][0] == sums[1][0] && sums[0][1] == sums[1][1]);
    gbg_context_destroy(&context);
}

/* Two discs that fill a line but for 2e-4 hit each other 4500 times in a step: they are let go at
 * the limit, their momentum is kept, and the rounds part them. */
static void endless_events(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu:threads=2");
    double length[2] = {2.0002, 4.0}, sum[2] = {0.0, 0.0};
    static double end[3][5000];
    struct gbg_scene scene = made_scene(context, 2, length);
    static const double r[2][2] = {{0.0, 0.0}, {1.0001, 0.0}},
                        w[2][2] = {{0.5, 0.01}, {-0.4, 0.01}};
    const double *places[2] = {r[0], r[1]}, *moves[2] = {w[0], w[1]};
    struct gbg_engine *engine = place(&scene, 2, places);
    struct gbg_contacts contacts = collide(engine, moves, 0);
    assert_int_equal(contacts.pairs, GBG_EVENTS_MOST);
    assert_int_equal(contacts.stopped, 2);
    contacts.max_rounds = 1000;
    contacts.cap = 0.25;
    assert_int_equal(
        engine->kernels->contacts(engine->device, &engine->state, engine->contacts, &contacts),
        GBG_OK);
    assert_int_equal(contacts.left, 0);
    assert_true(contacts.rounds > 0);
    unwrapped(engine, end);
    for (int a = 0; a < 2; a++) {
        sum[a] = end[a][0] + end[a][1] - r[0][a] - r[1][a] - w[0][a] - w[1][a];
        sum[a] -= length[a] * rint(sum[a] / length[a]);
        assert_true(fabs(sum[a]) < 1e-14);
    }
    gbg_engine_free(engine);
    gbg_context_destroy(&context);
}

/* Strong forces without noise on a triangular lattice of packing 0.88: ends, without overlaps. */
static void dense_with_forces(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu:threads=2");
    double spacing = sqrt(acos(-1.0) / (2.0 * sqrt(3.0) * 0.88));
    double length[2] = {30.0 * spacing, 30.0 * spacing * sqrt(0.75)};
    for (int k = 0; k < 2; k++) {
        struct gbg_scene scene = made_scene(context, 2, length);
        scene.rule = GBG_RULE_EVENT;
        scene.temperature = 0.0;
        scene.dt = k == 0 ? 0.01 : 0.1;
        scene.n_forces = 1;
        scene.force[0] = (struct gbg_force){.power = 2.0, .sum = GBG_SUM_CUTOFF, .cutoff = 2.5};
        made_lattice(&made, &scene, 30, 0.0);
        for (int i = 0; i < 900; i++) {
            made.store[0][i] = scene.origin[0] + spacing * (i % 30 + 0.5 * (i / 30 % 2) + 0.25);
        }
        struct gbg_engine *engine = made_engine(&scene, &made);
        for (int step = 0; step < 3; step++) {
            if (gbg_engine_advance(engine, 1) != GBG_OK) {
                fail_msg("%s", gbg_message(context));
            }
            assert_true(naive_closest(engine) >= 1.0 - 1e-12);
        }
        print_message("packing 0.88, T = 0, dt %g: %.2f events and pushes a particle and step\n",
                      scene.dt, (double)engine->contact_pairs / 900.0 / 3.0);
        gbg_engine_free(engine);
    }
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pairs_against_formulas), cmocka_unit_test(cradle),
        cmocka_unit_test(many_against_plain),     cmocka_unit_test(same_bits),
        cmocka_unit_test(order_of_particles),     cmocka_unit_test(exact_momentum),
        cmocka_unit_test(endless_events),         cmocka_unit_test(dense_with_forces),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
