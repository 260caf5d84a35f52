/* Tests of a GPU against the CPU: the contact rule bridge, to the last bit. */
#include "both.h"

#ifdef GBG_WITH_CUDA
#include "cuda/rows.h"
#endif

static struct made_particles made;

static struct gbg_scene bridge_scene(struct gbg_context *context, int dimension,
                                     const double *length)
{
    struct gbg_scene scene = made_scene(context, dimension, length);
    scene.rule = GBG_RULE_BRIDGE;
    scene.unwrapped = 1;
    return scene;
}

static void with_short_forces(struct gbg_scene *scene)
{
    scene->n_forces = 1;
    scene->force[0] = (struct gbg_force){.power = 6.0, .sum = GBG_SUM_CUTOFF, .cutoff = 2.5};
}

/* Moves what the state holds of particle order[k] to index k; ranks are written where they are. */
static void permute(struct gbg_engine *engine, const int64_t *order)
{
    struct gbg_state *state = &engine->state;
    size_t n = (size_t)state->owned;
    uint32_t *words = malloc(n * sizeof *words);
    uint64_t *ids = both_copy(engine, state->id, n * sizeof *ids), *new_ids = malloc(n * 8);
    int32_t *ranks = malloc(n * sizeof *ranks);
    assert_true(words && ids && new_ids && ranks);
    for (int a = 0; a < 2 * state->box.dimension; a++) {
        uint32_t *array = a % 2 ? state->low[a / 2] : state->high[a / 2];
        uint32_t *old = both_copy(engine, array, n * sizeof *old);
        for (size_t k = 0; k < n; k++) {
            words[k] = old[order[k]];
        }
        assert_int_equal(engine->backend->upload(engine->device, array, words, n * sizeof *words),
                         GBG_OK);
        free(old);
    }
    if (state->species) {
        unsigned char *old = both_copy(engine, state->species, n), *new_species = malloc(n);
        assert_non_null(new_species);
        for (size_t k = 0; k < n; k++) {
            new_species[k] = old[order[k]];
        }
        assert_int_equal(engine->backend->upload(engine->device, state->species, new_species, n),
                         GBG_OK);
        free(old);
        free(new_species);
    }
    for (size_t k = 0; k < n; k++) {
        new_ids[k] = ids[order[k]];
        ranks[k] = (int32_t)order[k];
    }
    assert_int_equal(engine->backend->upload(engine->device, state->id, new_ids, n * 8), GBG_OK);
    if (state->rank) {
        assert_int_equal(
            engine->backend->upload(engine->device, state->rank, ranks, n * sizeof *ranks), GBG_OK);
    }
    free(words);
    free(ids);
    free(new_ids);
    free(ranks);
    engine->moved = 1e300; /* the list knows the old order */
}

/* What the rule says of a step, on each of both. */
static void same_answers(const struct gbg_contacts *p, const struct gbg_contacts *q)
{
    assert_int_equal(p->rounds, q->rounds);
    assert_int_equal(p->pairs, q->pairs);
    assert_int_equal(p->clear, q->clear);
    assert_int_equal(p->left, q->left);
    assert_int_equal(p->stopped, q->stopped);
    both_same_real(p->virial, q->virial, "the virial");
    both_same_real(p->largest, q->largest, "the largest move");
}

static struct gbg_contacts one_call(struct gbg_engine *engine, uint64_t step, int pressed)
{
    const struct gbg_kernels *kernels = engine->kernels;
    struct gbg_contacts contacts = {.max_rounds = 1000,
                                    .tolerance = 0.9e-12,
                                    .cap = 0.25,
                                    .noise = &engine->noise,
                                    .step = step,
                                    .pressed = pressed};
    assert_int_equal(kernels->keep(engine->device, &engine->state), GBG_OK);
    assert_int_equal(kernels->integrate(engine->device, &engine->state, &engine->noise, step,
                                        engine->scene.dt, 1, &engine->moves),
                     GBG_OK);
    assert_int_equal(kernels->list_update(engine->device, &engine->state, engine->contacts, 1e300),
                     GBG_OK);
    assert_int_equal(kernels->bridge(engine->device, &engine->state, engine->contacts, &contacts),
                     GBG_OK);
    return contacts;
}

/* The rule alone, step after step, without the rounds that would follow. Returns the sum of its
 * pushes. */
static int64_t compare_calls(struct both *both, int steps, int pressed, const char *what)
{
    int64_t pairs = 0, clear = 0, n = both->engine[0]->state.owned;
    for (int step = 0; step < steps; step++) {
        struct gbg_contacts contacts[2];
        for (int b = 0; b < 2; b++) {
            contacts[b] = one_call(both->engine[b], (uint64_t)step + (UINT64_C(1) << 33), pressed);
        }
        same_answers(&contacts[0], &contacts[1]);
        both_same_state(both);
        pairs += contacts[0].pairs;
        clear += contacts[0].clear;
    }
    print_message("%s: %lld particles, %.1f pushes a step, %lld of %d steps clear\n", what,
                  (long long)n, (double)pairs / steps, (long long)clear, steps);
    return pairs;
}

struct dense_case {
    const char *what;
    int dimension;
    int64_t m;      /* particles along an axis */
    double spacing; /* of the lattice that they start from */
    double temperature;
    int64_t id_stride, id_start;
    int permuted;
};

static const struct dense_case dense_cases[] = {
    {"2D, packing 0.52", 2, 60, 1.229, 0.1, 1, 0, 0},
    {"2D, packing 0.52, small", 2, 20, 1.229, 0.1, 1, 0, 0},
    {"2D, packing 0.75", 2, 60, 1.0233, 0.01, 1, 0, 0},
    {"2D, packing 0.75, odd", 2, 33, 1.0233, 0.01, 3, 1, 1},
    {"2D, large ids", 2, 40, 1.05, 0.04, 7, (int64_t)1 << 40, 1},
    {"2D, no noise", 2, 30, 1.02, 0.0, 1, 0, 0},
    {"2D, hot", 2, 40, 1.1, 0.5, 3, 0, 1},
    {"2D, dilute", 2, 60, 2.5, 2.0, 1, 0, 0},
    {"2D, one block", 2, 5, 1.05, 0.02, 1, 0, 0},
    {"3D", 3, 15, 1.08, 0.01, 1, 0, 0},
    {"3D, permuted, large ids", 3, 12, 1.05, 0.04, 5, (int64_t)1 << 33, 1},
    {"3D, one block", 3, 4, 1.1, 0.02, 1, 0, 0},
};

static void dense_suspensions(void **state)
{
    (void)state;
    static int64_t order[5000];
    struct gbg_context *context = made_context("cpu");
    for (size_t c = 0; c < sizeof dense_cases / sizeof *dense_cases; c++) {
        if (!both_takes((int)c)) {
            continue;
        }
        const struct dense_case *dense = &dense_cases[c];
        double edge = (double)dense->m * dense->spacing;
        double length[3] = {edge, edge * 1.004, edge * 1.01};
        struct gbg_scene scene = bridge_scene(context, dense->dimension, length);
        scene.temperature = dense->temperature;
        made_lattice(&made, &scene, dense->m, 0.45 * (1.0 - 1.0 / dense->spacing));
        for (int64_t i = 0; i < made.p.n; i++) {
            made.id[i] = dense->id_start + dense->id_stride * i;
            order[i] = (i * 1237 + 17) % made.p.n;
        }
        struct both both = both_make(scene, &made);
        if (dense->permuted) {
            permute(both.engine[0], order);
            permute(both.engine[1], order);
        }
        int64_t pairs = compare_calls(&both, 12, 0, dense->what);
        assert_true(pairs > 0 || dense->temperature == 0.0);
        both_free(&both);
    }
    gbg_context_destroy(&context);
}

/* More blocks than a small system has. */
static void many_blocks(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu");
    for (int dimension = 2; dimension <= 3; dimension++) {
        const int64_t m = dimension == 2 ? 170 : 32, n = dimension == 2 ? m * m : m * m * m;
        double spacing = dimension == 2 ? 1.03 : 1.06, edge = spacing * (double)m;
        double length[3] = {edge, edge, edge}, *store = malloc((size_t)(3 * n) * sizeof *store);
        int32_t *species = calloc((size_t)n, sizeof *species);
        int64_t *id = malloc((size_t)n * sizeof *id);
        struct gbg_scene scene = bridge_scene(context, dimension, length);
        assert_true(store && species && id);
        made.p =
            (struct gbg_particles){n, dimension, {store, store + n, store + 2 * n}, species, id};
        for (int64_t i = 0; i < n; i++) {
            int64_t cell[3] = {i % m, i / m % m, i / m / m};
            for (int a = 0; a < dimension; a++) {
                double shift =
                    0.45 * (spacing - 1.0) * (2.0 * made_uniform((uint64_t)(3 * i + a)) - 1.0);
                store[a * n + i] = scene.origin[a] + spacing * ((double)cell[a] + 0.5) + shift;
            }
            species[i] = (int32_t)(i % 2);
            id[i] = i;
        }
        struct both both = both_make(scene, &made);
        assert_true(compare_calls(&both, 8, 0, dimension == 2 ? "2D" : "3D") > 100);
        both_free(&both);
        free(store);
        free(species);
        free(id);
    }
    gbg_context_destroy(&context);
}

/* Steps of a whole engine: forces, the rule, rounds and certificate. */
static void whole_runs(void **state)
{
    (void)state;
    for (int k = 0; k < 7; k++) {
        if (!both_takes(k)) {
            continue;
        }
        int dimension = k < 4 || k == 6 ? 2 : 3;
        int64_t m = k == 0   ? 60
                    : k == 1 ? 25
                    : k == 2 ? 60
                    : k == 3 ? 7
                    : k == 4 ? 14
                    : k == 5 ? 8
                             : 20;
        double spacing = k == 0 || k == 3 ? 1.229 : dimension == 2 ? 1.02 : 1.08;
        double edge = (double)m * spacing, length[3] = {edge, edge, edge};
        char text[2][65];
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = bridge_scene(context, dimension, length);
        scene.temperature = k == 6 ? 0.0 : 0.01; /* then only forces push */
        with_short_forces(&scene);
        made_lattice(&made, &scene, m, 0.005);
        struct both both = both_make(scene, &made);
        for (int b = 0; b < 2; b++) {
            if (gbg_engine_advance(both.engine[b], 100) != GBG_OK) {
                fail_msg("%s", gbg_message(both.engine[b]->context));
            }
            assert_int_equal(gbg_engine_digest(both.engine[b], text[b]), GBG_OK);
        }
        assert_int_equal(both.engine[0]->contact_rounds, both.engine[1]->contact_rounds);
        assert_int_equal(both.engine[0]->contact_pairs, both.engine[1]->contact_pairs);
        both_same_real(both.engine[0]->contact_virial, both.engine[1]->contact_virial,
                       "the virial");
        both_same_state(&both);
        print_message("%dD, %lld particles: %s\n", dimension, (long long)made.p.n, text[0]);
        assert_string_equal(text[0], text[1]);
        assert_true(both.engine[0]->contact_pairs > 0);
        both_free(&both);
        gbg_context_destroy(&context);
    }
}

/* The solve of pressed scenes: momentum, limits that grow with the layers, changes that count more
 * where pushes are large. First without forces, in one block and in many; then engines whose forces
 * over all pairs press a cluster together (strict: the same sum on both). */
static void pressed_calls(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu");
    for (int k = 0; k < 3; k++) {
        int dimension = k < 2 ? 2 : 3;
        int64_t m = k == 0 ? 5 : k == 1 ? 60 : 13;
        double spacing = dimension == 2 ? 1.0233 : 1.06, edge = (double)m * spacing;
        double length[3] = {edge, edge * 1.004, edge * 1.01};
        struct gbg_scene scene = bridge_scene(context, dimension, length);
        made_lattice(&made, &scene, m, 0.45 * (1.0 - 1.0 / spacing));
        struct both both = both_make(scene, &made);
        int64_t pairs = compare_calls(&both, 6, 1, dimension == 2 ? "2D, pressed" : "3D, pressed");
        assert_true(pairs > 0);
        both_free(&both);
    }
    gbg_context_destroy(&context);
}

static void pressed_clusters(void **state)
{
    (void)state;
    int64_t steps = both_part() > 1 ? 2 : 40;
    for (int k = 0; k < 3; k++) {
        if (!both_takes(k)) {
            continue;
        }
        int dimension = k < 2 ? 2 : 3;
        int64_t m = k == 0 ? 30 : k == 1 ? 12 : 8;
        double edge = 4.0 * (double)m, length[3] = {edge, edge, edge};
        char text[2][65];
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = bridge_scene(context, dimension, length);
        scene.temperature = k == 1 ? 0.0 : 0.01;
        made_pressed(&made, &scene, m);
        struct both both = both_make(scene, &made);
        for (int b = 0; b < 2; b++) {
            if (gbg_engine_advance(both.engine[b], steps) != GBG_OK) {
                fail_msg("%s", gbg_message(both.engine[b]->context));
            }
            assert_int_equal(gbg_engine_digest(both.engine[b], text[b]), GBG_OK);
        }
        const struct gbg_engine *p = both.engine[0], *q = both.engine[1];
        assert_int_equal(p->contact_rounds, q->contact_rounds);
        assert_int_equal(p->contact_pairs, q->contact_pairs);
        assert_int_equal(p->unsettled, q->unsettled);
        assert_int_equal(p->unsettled_pairs, q->unsettled_pairs);
        both_same_real(p->contact_virial, q->contact_virial, "the virial");
        both_same_state(&both);
        print_message("%dD, pressed, %lld particles: %lld rounds, %lld solves unsettled, %s\n",
                      dimension, (long long)made.p.n, (long long)p->contact_rounds,
                      (long long)p->unsettled, text[0]);
        assert_string_equal(text[0], text[1]);
        assert_true(p->contact_pairs > 0);
        both_free(&both);
        gbg_context_destroy(&context);
    }
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

static void few_particles(void **state)
{
    (void)state;
    const double x[2] = {0.3, 1.3005}, y[2] = {0.1, 0.11};
    double length[2] = {8.0, 8.0};
    struct gbg_context *context = made_context("cpu");
    for (int n = 0; n <= 2; n++) {
        struct gbg_scene scene = bridge_scene(context, 2, length);
        place(n, x, y);
        if (n == 0) {
            scene.species[0].count = scene.species[1].count = 0;
        }
        struct both both = both_make(scene, &made);
        if (both.engine[0]->contacts) {
            int64_t pairs = compare_calls(&both, 60, 0, "few");
            assert_true(n < 2 || pairs > 0);
        }
        both_free(&both);
    }
    gbg_context_destroy(&context);
}

/* Diameters 20 : 1: a large disc shares more pairs than there are colours, and its neighbours'
 * pairs go one by one. */
static void one_large_disc(void **state)
{
    (void)state;
    enum { AROUND = 66, SMALL = 600 };
    static double x[AROUND + SMALL + 1], y[AROUND + SMALL + 1];
    double length[2] = {70.0, 70.0};
    struct gbg_context *context = made_context("cpu");
    struct gbg_scene scene = bridge_scene(context, 2, length);
    scene.temperature = 0.002;
    scene.species[0].diameter = 20.0;
    int64_t n = 0;
    x[n] = y[n] = 15.0;
    n++;
    for (int k = 0; k < AROUND - 1; k++, n++) { /* a ring of neighbours that nearly touch */
        double angle = 2.0 * 3.14159265358979 * k / (AROUND - 1);
        x[n] = 15.0 + 10.504 * cos(angle);
        y[n] = 15.0 + 10.504 * sin(angle);
    }
    for (int k = 0; k < SMALL; k++, n++) {
        x[n] = 32.0 + 1.02 * (k % 20);
        y[n] = -15.0 + 1.02 * (k / 20);
    }
    place(n, x, y);
    for (int64_t i = 0; i < n; i++) {
        made.species[i] = i > 0;
    }
    struct both both = both_make(scene, &made);
    int64_t pairs = compare_calls(&both, 20, 0, "one disc of diameter 20");
    assert_true(pairs > 0);
    both_free(&both);
    gbg_context_destroy(&context);
}

#ifdef GBG_WITH_CUDA
/* The GPU's tables of the discs of a block: in shared memory where they fit, else elsewhere, with
 * the same bits. */
struct table_case {
    const char *what;
    int dimension;
    int64_t m;
    int slots;
    int64_t spilled; /* blocks whose tables are elsewhere */
};

static const struct table_case table_cases[] = {
    {"2D, tables in shared memory", 2, 60, GBG_CUDA_BRIDGE_SLOTS, 0},
    {"2D, small tables in shared memory", 2, 60, 2000, 0},
    {"2D, tables that are too small", 2, 60, 300, 4},
    {"2D, one block, no tables", 2, 15, 0, 1},
    {"3D, tables in shared memory", 3, 15, GBG_CUDA_BRIDGE_SLOTS, 0},
    {"3D, tables that are too small", 3, 15, 100, 8},
};

static void limit_tables(struct both *both, int slots)
{
    struct gbg_engine *engine = both->engine[1];
    assert_int_equal(gbg_cuda_bridge_limit(engine->device, engine->contacts, slots), GBG_OK);
}

static void tables_of_discs(void **state)
{
    (void)state;
    struct gbg_context *context = made_context("cpu");
    for (size_t c = 0; c < sizeof table_cases / sizeof *table_cases; c++) {
        const struct table_case *table = &table_cases[c];
        double spacing = table->dimension == 2 ? 1.0233 : 1.06, edge = spacing * (double)table->m;
        double length[3] = {edge, edge, edge};
        struct gbg_scene scene = bridge_scene(context, table->dimension, length);
        made_lattice(&made, &scene, table->m, 0.45 * (1.0 - 1.0 / spacing));
        struct both both = both_make(scene, &made);
        limit_tables(&both, table->slots);
        assert_true(compare_calls(&both, 6, 0, table->what) > 0);
        assert_int_equal(gbg_cuda_bridge_spilled(both.engine[1]->contacts), table->spilled);
        both_free(&both);
    }
    gbg_context_destroy(&context);
}

/* A cluster in one corner, a few pairs in the others. */
static void one_table_spills(void **state)
{
    (void)state;
    enum { EDGE = 36, DENSE = EDGE * EDGE, PAIRS = 30 };
    static double x[DENSE + 6 * PAIRS], y[DENSE + 6 * PAIRS];
    const double corner[3][2] = {{50.0, 0.0}, {0.0, 50.0}, {50.0, 50.0}};
    double length[2] = {100.0, 100.0};
    struct gbg_context *context = made_context("cpu");
    struct gbg_scene scene = bridge_scene(context, 2, length);
    int64_t n = 0;
    for (; n < DENSE; n++) {
        x[n] = -20.0 + 1.02 * (double)(n % EDGE);
        y[n] = -20.0 + 1.02 * (double)(n / EDGE);
    }
    for (int64_t k = 0; k < 3 * PAIRS; k++) {
        for (int other = 0; other < 2; other++, n++) {
            x[n] = -20.0 + corner[k % 3][0] + 4.0 * (double)(k / 3 % 8) + 1.01 * other;
            y[n] = -20.0 + corner[k % 3][1] + 4.0 * (double)(k / 3 / 8);
        }
    }
    place(n, x, y);
    struct both both = both_make(scene, &made);
    limit_tables(&both, 256);
    assert_true(compare_calls(&both, 6, 0, "2D, one of four tables too small") > 0);
    assert_int_equal(gbg_cuda_bridge_spilled(both.engine[1]->contacts), 1);
    both_free(&both);
    gbg_context_destroy(&context);
}
#endif

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(few_particles),   cmocka_unit_test(dense_suspensions),
        cmocka_unit_test(one_large_disc),  cmocka_unit_test(many_blocks),
        cmocka_unit_test(whole_runs),
#ifdef GBG_WITH_CUDA
        cmocka_unit_test(tables_of_discs), cmocka_unit_test(one_table_spills),
#endif
        cmocka_unit_test(pressed_calls),   cmocka_unit_test(pressed_clusters),
    };
    return both_missing() ? BOTH_SKIPPED : cmocka_run_group_tests(tests, NULL, NULL);
}
