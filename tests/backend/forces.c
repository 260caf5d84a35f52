/* Tests of a GPU against the CPU: cut-off sums to the last bit, sums over all pairs within a bound
 * on their errors, and the same bits twice. */
#include "both.h"

#include "gamboge/kernels.h"

static struct made_particles made;

/* --- cut-off sums -------------------------------------------------------------------------- */

/* A scene of so many species with a cut-off force, species at random. */
static struct gbg_scene cutoff_scene(struct gbg_context *context, int dimension,
                                     const double *length, int n_species, double cutoff)
{
    struct gbg_scene scene = made_scene(context, dimension, length);
    scene.n_species = n_species;
    for (int s = 0; s < n_species; s++) {
        scene.species[s] = (struct gbg_species){.diameter = 1.0, .count = 1};
        snprintf(scene.species[s].name, sizeof scene.species[s].name, "S%d", s);
        scene.species[s].alpha = 0.7 - 0.3 * s;
        scene.species[s].mobility = 1.1 - 0.5 * s;
    }
    scene.rule = GBG_RULE_NONE;
    scene.force[0] = (struct gbg_force){.power = 6.0, .sum = GBG_SUM_CUTOFF, .cutoff = cutoff};
    scene.n_forces = 1;
    return scene;
}

static void fill(const struct gbg_scene *scene, int64_t m, double jitter)
{
    made_lattice(&made, scene, m, jitter);
    for (int64_t i = 0; i < made.p.n; i++) {
        made.species[i] = (int32_t)(made_uniform((uint64_t)(i + 777)) * scene->n_species);
    }
}

/* One sum on both. */
static void cut_off(struct both *both, int in_double, double power, double cutoff, int add)
{
    for (int b = 0; b < 2; b++) {
        struct gbg_engine *e = both->engine[b];
        assert_int_equal(e->kernels->list_update(e->device, &e->state, e->pairs, 0.0), GBG_OK);
        assert_int_equal((in_double ? e->kernels->cutoff_double : e->kernels->cutoff_mixed)(
                             e->device, &e->state, e->pairs, power, cutoff, add),
                         GBG_OK);
    }
    for (int a = 0; a < both->engine[0]->state.box.dimension; a++) {
        both_same(both, both->engine[0]->state.force[a], both->engine[1]->state.force[a],
                  (size_t)both->engine[0]->state.owned * sizeof(double),
                  in_double ? "cut-off forces in double" : "cut-off forces, mixed");
    }
}

/* Some force is not 0, so that comparisons mean something. */
static int acts(struct both *both)
{
    int64_t n = both->engine[1]->state.owned;
    double *f =
        both_copy(both->engine[1], both->engine[1]->state.force[0], (size_t)n * sizeof(double));
    int any = 0;
    for (int64_t i = 0; i < n; i++) {
        any |= f[i] != 0.0;
    }
    free(f);
    return any;
}

static void cutoff_sums_are_the_same(void **state)
{
    (void)state;
    static const double boxes[3][3] = {{20.0, 31.0, 17.0}, {9.0, 9.0, 9.0}, {2e-8, 7e-9, 6e-9}};
    static const double cutoffs[3] = {2.5, 4.4, 2.5e-9};
    static const int species[3] = {1, 2, 10};
    for (int c = 0; c < 18; c++) {
        int dimension = 2 + c % 2, box = c / 2 % 3, kinds = species[c / 6];
        static const int64_t sides[2][3] = {{5, 33, 60}, {3, 9, 17}};
        for (int k = 0; k < 3; k++) {
            struct gbg_context *context = made_context("cpu");
            struct gbg_scene scene =
                cutoff_scene(context, dimension, boxes[box], kinds, cutoffs[box]);
            fill(&scene, sides[dimension - 2][k], 0.45);
            struct both both = both_make(scene, &made);
            for (int p = 0; p < 10; p++) {
                static const double powers[5] = {2.0, 6.0, 1.0, 3.0, 12.0};
                int in_double = p >= 5;
                cut_off(&both, in_double, powers[p % 5], cutoffs[box], p != 0);
            }
            assert_true(made.p.n < 30 || acts(&both));
            both_free(&both);
            gbg_context_destroy(&context);
        }
    }
}

/* Powers that are not whole use the libraries' pow: 2 units in its last place. */
static void other_powers_are_near(void **state)
{
    (void)state;
    double length[2] = {20.0, 31.0}, worst = 0.0;
    struct gbg_context *context = made_context("cpu");
    struct gbg_scene scene = cutoff_scene(context, 2, length, 2, 2.5);
    fill(&scene, 40, 0.4);
    struct both both = both_make(scene, &made);
    double *force[2];
    for (int b = 0; b < 2; b++) {
        struct gbg_engine *e = both.engine[b];
        assert_int_equal(e->kernels->cutoff_mixed(e->device, &e->state, e->pairs, 2.3, 2.5, 0),
                         GBG_OK);
        force[b] = both_copy(e, e->state.force[0], (size_t)made.p.n * sizeof(double));
    }
    double size = 0.0;
    for (int64_t i = 0; i < made.p.n; i++) {
        size += force[0][i] * force[0][i] / (double)made.p.n;
        worst = fmax(worst, fabs(force[0][i] - force[1][i]));
    }
    print_message("power 2.3, cut off: largest |dF|/RMS(F) %.2e\n", worst / sqrt(size));
    assert_true(size > 0.0 && worst < 1e-13 * sqrt(size));
    free(force[0]);
    free(force[1]);
    both_free(&both);
    gbg_context_destroy(&context);
}

static void steps_with_forces_are_the_same(void **state)
{
    (void)state;
    for (int c = 0; c < 4; c++) {
        double length[3] = {20.0, 31.0, 17.0};
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = cutoff_scene(context, 2 + c % 2, length, 2 + c, 2.5);
        scene.precision = c < 2 ? GBG_PRECISION_MIXED : GBG_PRECISION_DOUBLE;
        scene.dt = 1e-4;
        scene.temperature = 1.0;
        scene.force[1] = (struct gbg_force){.power = 2.0, .sum = GBG_SUM_CUTOFF, .cutoff = 1.5};
        scene.n_forces = 2;
        fill(&scene, c % 2 ? 11 : 20, 0.2);
        struct both both = both_make(scene, &made);
        for (int step = 0; step < 30; step++) {
            for (int b = 0; b < 2; b++) {
                assert_int_equal(gbg_engine_advance(both.engine[b], 1), GBG_OK);
            }
            both_same_state(&both);
        }
        both_free(&both);
        gbg_context_destroy(&context);
    }
}

/* --- sums over all pairs ------------------------------------------------------------------- */

enum { MOST = 20000 };

struct set {
    int dimension;
    int64_t n;
    double length[3], power;
    double position[3 * MOST], alpha[MOST], mobility[MOST];
};

static struct set set;
static double exact[3 * MOST], found[3 * MOST], again[3 * MOST];

static const double SQUARE[3] = {16.0, 16.0, 16.0}, OBLONG[3] = {3.0, 40.0, 7.0};

/* Random places in a part of the box. */
static void spread(int dimension, int64_t n, const double *length, double part)
{
    set.dimension = dimension;
    set.n = n;
    memcpy(set.length, length, sizeof set.length);
    for (int64_t i = 0; i < n; i++) {
        for (int a = 0; a < dimension; a++) {
            set.position[a * n + i] = part * length[a] * made_uniform((uint64_t)(4 * i + a));
        }
        set.alpha[i] = made_uniform((uint64_t)(4 * i + 3)) - 0.3;
        set.mobility[i] = made_uniform((uint64_t)(i + 1000000)) - 0.6;
    }
}

static void evaluate(const char *backend, const char *precision, double *force)
{
    struct gbg_context *context = made_context(backend);
    double *x = set.position;
    int64_t n = set.n;
    int deep = set.dimension == 3;
    int status = gbg_pair_forces(context, set.dimension, set.length, set.power, 0.0, precision, n,
                                 x, x + n, deep ? x + 2 * n : NULL, 1, set.alpha, set.mobility,
                                 force, force + n, deep ? force + 2 * n : NULL, 1);
    if (status != GBG_OK) {
        fail_msg("%s", gbg_message(context));
    }
    gbg_context_destroy(&context);
}

/* RMS(dF)/RMS(F) of two results. */
static double distance(const double *p, const double *q)
{
    double error = 0.0, size = 0.0;
    for (int64_t k = 0; k < set.n * set.dimension; k++) {
        error += (p[k] - q[k]) * (p[k] - q[k]);
        size += q[k] * q[k];
    }
    return error == 0.0 ? 0.0 : sqrt(error / size);
}

/* Errors of the GPU's sums, against the CPU's double one. Mixed and double ones have the same bits
 * when they are made twice, strict ones the same bits as on the CPU. */
static void compare(const char *what)
{
    size_t bytes = (size_t)(set.n * set.dimension) * sizeof(double);
    double error[3];
    static const char *const precision[2] = {"mixed", "double"};
    evaluate("cpu", "double", exact);
    for (int k = 0; k < 2; k++) {
        evaluate("cuda:0", precision[k], found);
        evaluate("cuda:0", precision[k], again);
        assert_memory_equal(found, again, bytes);
        error[k] = distance(found, exact);
    }
    evaluate("cpu", "strict", again);
    evaluate("cuda:0", "strict", found);
    assert_memory_equal(found, again, bytes);
    error[2] = distance(found, exact);
    print_message(
        "%s, %dD, N = %lld, power %.1f: RMS(dF)/RMS(F) mixed %.2e, double %.2e, strict %.2e\n",
        what, set.dimension, (long long)set.n, set.power, error[0], error[1], error[2]);
    assert_true(error[0] < 1e-6);
    assert_true(error[2] < 1e-6);
    assert_true(error[1] < 1e-13);
}

static void direct_sums_are_right(void **state)
{
    (void)state;
    static const int64_t sizes[] = {0, 1, 2, 33, 255, 257, 1000, 8191, 8192, 9217, 16384, 20000};
    static const double powers[] = {2.0, 1.0, 6.0, 3.0, 2.3, 4.0, 5.0, 8.0};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        if (!both_takes((int)k)) {
            continue;
        }
        for (int c = 0; c < 4; c++) {
            spread(2 + c % 2, sizes[k], c < 2 ? SQUARE : OBLONG, 1.0);
            set.power = c % 2 == (int)(k % 2) ? 2.0 : powers[(k + (size_t)c) % 8];
            compare("random");
        }
    }
    for (int p = 0; p < 12; p++) {
        spread(2 + p % 2, 9000, SQUARE, 1.0);
        set.power = 1.0 + p / 2;
        compare("random");
    }
}

/* Everything in a small part of the box, in two parts far apart, and in one place. */
static void clusters_keep_their_precision(void **state)
{
    (void)state;
    for (int c = 0; c < 12; c++) {
        if (!both_takes(c)) {
            continue;
        }
        double part = c < 4 ? 0.4 : c < 8 ? 0.003 : 1e-8;
        spread(2 + c % 2, c / 2 % 2 ? 9000 : 1200, c < 6 ? SQUARE : OBLONG, part);
        for (int64_t i = 0; i < set.n / 3; i++) { /* the others far away */
            for (int a = 0; a < set.dimension; a++) {
                set.position[a * set.n + i] += 0.47 * set.length[a];
            }
        }
        for (int64_t i = 0; i < 50; i++) { /* some coincide */
            for (int a = 0; a < set.dimension; a++) {
                set.position[a * set.n + i] = set.position[a * set.n + 50];
            }
        }
        set.power = c % 3 ? 2.0 : 5.0;
        compare("clusters");
    }
}

/* Every particle has a partner so near to half a box away that 32 bits cannot tell the side. */
static void nearest_images_follow_from_all_bits(void **state)
{
    (void)state;
    for (int c = 0; c < 4; c++) {
        int64_t n = c < 2 ? 600 : 10000;
        spread(2 + c % 2, n, SQUARE, 0.5);
        for (int64_t i = 0; i < n / 2; i++) {
            for (int a = 0; a < set.dimension; a++) {
                double *x = set.position + a * n;
                double offset =
                    a == i % set.dimension ? 0.5 + (double)(2 * i - n / 2 + 1) * 0x1p-46 : 0.01 * a;
                x[i] = floor(x[i] * 0x1p20) * 0x1p-20;
                x[n / 2 + i] = x[i] + 16.0 * offset;
            }
        }
        set.power = 1.0 + c / 2;
        compare("half a box apart");
    }
}

/* A source 1e18 times as strong as the others: the force on it comes from the weak ones. */
static void weak_sources_are_not_lost(void **state)
{
    (void)state;
    for (int c = 0; c < 2; c++) {
        int64_t n = c ? 9000 : 1000;
        double error = 0.0, size = 0.0;
        spread(2, n, SQUARE, 1.0);
        set.alpha[500] = 1e18;
        set.power = 2.0;
        evaluate("cpu", "double", exact);
        evaluate("cuda:0", "mixed", found);
        for (int a = 0; a < 2; a++) {
            error = fmax(error, fabs(found[a * n + 500] - exact[a * n + 500]));
            size = fmax(size, fabs(exact[a * n + 500]));
        }
        print_message("weak sources, N = %lld: %.2e\n", (long long)n, error / size);
        assert_true(size > 0.0 && error < 1e-5 * size);
    }
}

/* --- sums over all pairs of many particles, which have kernels of their own ------------------- */

enum { SAMPLE = 100 };

struct many {
    int dimension, equal; /* equal: all strengths are */
    int64_t n;
    int power;
    const double *length;
    double *position, *alpha, *mobility, *force[2]; /* blocked by axes */
};

static void make_many(struct many *m)
{
    int64_t n = m->n;
    double *room = malloc((size_t)(11 * n) * sizeof *room);
    assert_non_null(room);
    m->position = room;
    m->alpha = room + 3 * n;
    m->mobility = room + 4 * n;
    m->force[0] = room + 5 * n;
    m->force[1] = room + 8 * n;
    for (int64_t i = 0; i < n; i++) {
        for (int a = 0; a < m->dimension; a++) {
            m->position[a * n + i] = m->length[a] * made_uniform((uint64_t)(4 * i + a));
        }
        m->alpha[i] = m->equal ? 0.7 : made_uniform((uint64_t)(4 * i + 3)) - 0.3;
        m->mobility[i] = made_uniform((uint64_t)(i + 2000000)) - 0.6;
    }
}

static void sum_many(const struct many *m, const char *backend, double *force)
{
    struct gbg_context *context = made_context(backend);
    int64_t n = m->n;
    int deep = m->dimension == 3;
    const double *x = m->position;
    int status = gbg_pair_forces(context, m->dimension, m->length, m->power, 0.0, "mixed", n, x,
                                 x + n, deep ? x + 2 * n : NULL, 1, m->alpha, m->mobility, force,
                                 force + n, deep ? force + 2 * n : NULL, 1);
    if (status != GBG_OK) {
        fail_msg("%s", gbg_message(context));
    }
    gbg_context_destroy(&context);
}

/* A plain double loop for one particle; returns the sum of the sizes of terms. */
static double sum_plainly(const struct many *m, int64_t i, double sum[3])
{
    double sizes = 0.0;
    sum[0] = sum[1] = sum[2] = 0.0;
    for (int64_t k = 0; k < m->n; k++) {
        double r[3], squared = 0.0, weight = k == i ? 0.0 : m->alpha[k] * m->mobility[i];
        for (int a = 0; a < m->dimension; a++) {
            r[a] = m->position[a * m->n + i] - m->position[a * m->n + k];
            r[a] -= m->length[a] * rint(r[a] / m->length[a]);
            squared += r[a] * r[a];
        }
        double inverse = k == i ? 0.0 : 1.0 / sqrt(squared);
        for (int p = 0; p <= m->power; p++) {
            weight *= inverse;
        }
        for (int a = 0; a < m->dimension; a++) {
            sum[a] += weight * r[a];
        }
        sizes += fabs(weight) * sqrt(squared);
    }
    return sizes;
}

/* Against the RMS, which a close pair may make large, and every particle against the sum of the
 * sizes of its terms: distances are good to 8 x 2^-24 (direct_symmetric.cu), so r^-7 to 4e-6. */
static void compare_many(int dimension, int64_t n, int power, int equal)
{
    struct many m = {dimension, equal, n, power, equal ? OBLONG : SQUARE, 0, 0, 0, {0, 0}};
    double error = 0.0, size = 0.0, worst = 0.0;
    make_many(&m);
    sum_many(&m, "cuda:0", m.force[0]);
    sum_many(&m, "cuda:0", m.force[1]);
    assert_memory_equal(m.force[0], m.force[1], (size_t)(n * dimension) * sizeof(double));
    for (int64_t t = 0; t < SAMPLE; t++) {
        double sum[3], squared = 0.0;
        int64_t i = (n - 1) * t / (SAMPLE - 1);
        double sizes = sum_plainly(&m, i, sum);
        for (int a = 0; a < dimension; a++) {
            squared += pow(m.force[0][a * n + i] - sum[a], 2.0);
            size += sum[a] * sum[a];
        }
        error += squared;
        worst = fmax(worst, sqrt(squared) / sizes);
    }
    print_message("%dD, N = %lld, power %d, strengths %s: RMS(dF)/RMS(F) %.2e, of terms %.2e\n",
                  dimension, (long long)n, power, equal ? "equal" : "of their own",
                  sqrt(error / size), worst);
    /* where a far shell counts no less than a near one they all but cancel: there the error is held
     * against the sizes of terms alone, below one rounding of them */
    int cancels = power < dimension;
    assert_true(size > 0.0 && (cancels || sqrt(error / size) < 1e-6));
    assert_true(worst < (cancels ? 0x1p-24 : 5e-6));
    free(m.position);
}

/* From 2^17 on blocks are twice as large; 300001 take two passes and an odd number of blocks, 2^17
 * fill an even number. */
static void sums_of_many_are_right(void **state)
{
    (void)state;
    for (int c = 0; c < 4; c++) {
        int dimension = 2 + c % 2, equal = c / 2;
        for (int power = 1; power <= 6; power++) {
            if (!both_takes(power)) {
                continue;
            }
            compare_many(dimension, 1 << 17, power, equal);
        }
        compare_many(dimension, 20000, 2, equal);
        compare_many(dimension, 300001, 2, equal);
    }
}

struct run {
    int dimension, m, steps, n_species, n_forces;
    double power[2], spacing;
};

/* Forces over all pairs in strict precision, hard cores, noise: equal digests on the way and at the
 * end. */
static void long_range_runs_are_the_same(void **state)
{
    (void)state;
    static const struct run runs[] = {{2, 32, 300, 2, 1, {2.0, 0.0}, 1.3},
                                      {3, 10, 200, 2, 1, {2.0, 0.0}, 1.3},
                                      {2, 37, 200, 1, 2, {1.0, 6.0}, 1.6},
                                      {2, 33, 100, 2, 2, {2.5, 9.0}, 1.4}};
    for (size_t k = 0; k < sizeof runs / sizeof *runs; k++) {
        if (!both_takes((int)k)) {
            continue;
        }
        const struct run *run = &runs[k];
        double length[3];
        struct gbg_context *context = made_context("cpu");
        for (int a = 0; a < run->dimension; a++) {
            length[a] = run->spacing * (double)run->m * (a == 1 ? 1.02 : 1.0);
        }
        struct gbg_scene scene = made_scene(context, run->dimension, length);
        scene.precision = GBG_PRECISION_STRICT;
        scene.dt = 0.001;
        scene.n_species = run->n_species;
        scene.n_forces = run->n_forces;
        for (int f = 0; f < run->n_forces; f++) {
            scene.force[f] =
                (struct gbg_force){.power = run->power[f], .sum = GBG_SUM_MINIMUM_IMAGE};
        }
        made_lattice(&made, &scene, run->m, 0.01);
        for (int64_t i = 0; run->n_species == 1 && i < made.p.n; i++) {
            made.species[i] = 0;
        }
        struct both both = both_make(scene, &made);
        char text[2][65];
        for (int part = 0; part < 4; part++) {
            for (int b = 0; b < 2; b++) {
                if (gbg_engine_advance(both.engine[b], run->steps / 4) != GBG_OK) {
                    fail_msg("%s", gbg_message(both.context[b]));
                }
                assert_int_equal(gbg_engine_digest(both.engine[b], text[b]), GBG_OK);
            }
            assert_string_equal(text[0], text[1]);
        }
        print_message("long range, strict, %dD, N = %lld, %d steps: %s\n", run->dimension,
                      (long long)made.p.n, run->steps, text[0]);
        both_free(&both);
        gbg_context_destroy(&context);
    }
}

static void reference_sums_are_the_same(void **state)
{
    (void)state;
    enum { TARGETS = 100 };
    static double sum[2][3][TARGETS];
    int32_t target[TARGETS];
    double worst = 0.0, size = 0.0;
    for (int c = 0; c < 8; c++) {
        double length[3] = {20.0, 31.0, 17.0}, power = 1.0 + 0.7 * c;
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = cutoff_scene(context, 2 + c % 2, length, 2, 2.5);
        fill(&scene, c % 2 ? 10 : 33, 0.3);
        struct both both = both_make(scene, &made);
        for (int t = 0; t < TARGETS; t++) {
            target[t] = (int32_t)((37 * t + 5) % made.p.n);
        }
        for (int b = 0; b < 2; b++) {
            struct gbg_engine *e = both.engine[b];
            double *out[3] = {sum[b][0], sum[b][1], sum[b][2]};
            assert_int_equal(e->kernels->direct_targets(e->device, &e->state, power,
                                                        c < 4 ? 0.0 : 2.5, TARGETS, target, out),
                             GBG_OK);
        }
        for (int a = 0; a < scene.dimension; a++) {
            for (int t = 0; t < TARGETS; t++) {
                worst = fmax(worst, fabs(sum[0][a][t] - sum[1][a][t]));
                size = fmax(size, fabs(sum[0][a][t]));
            }
        }
        assert_true(size > 0.0 && worst < 1e-14 * size);
        both_free(&both);
        gbg_context_destroy(&context);
    }
    print_message("reference sums: largest |dF|/|F| %.2e\n", worst / size);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cutoff_sums_are_the_same),
        cmocka_unit_test(other_powers_are_near),
        cmocka_unit_test(steps_with_forces_are_the_same),
        cmocka_unit_test(direct_sums_are_right),
        cmocka_unit_test(clusters_keep_their_precision),
        cmocka_unit_test(nearest_images_follow_from_all_bits),
        cmocka_unit_test(weak_sources_are_not_lost),
        cmocka_unit_test(sums_of_many_are_right),
        cmocka_unit_test(reference_sums_are_the_same),
        cmocka_unit_test(long_range_runs_are_the_same),
    };
    return both_missing() ? BOTH_SKIPPED : cmocka_run_group_tests(tests, NULL, NULL);
}
