/* Tests of the sums by a mesh on the CPU: against Ewald sums without a mesh, and in bits. */
#include "mesh_state.h"

#include <stdio.h>
#include <stdlib.h>

#include "core/memory.h"
#include "fft/fft.h"

static const struct recipe recipes[] = {
    {"prolate, single", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, 1, {6, 8}, 9.0, 1.25},
    {"prolate, single, finer", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, 1, {8, 9}, 12.0, 1.25},
    {"prolate, 1e-6", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, 0, {9, 11}, 15.0, 1.25},
    {"prolate, 1e-9", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, 0, {13, 15}, 22.0, 1.4},
    {"prolate, 1e-11", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, 0, {16, 16}, 28.0, 1.7},
    {"Gaussian, B-spline, single", GBG_SPLIT_GAUSSIAN, GBG_EWALD_BSPLINE, 1, {5, 6}, 16.0, 1.5},
    {"Gaussian, B-spline", GBG_SPLIT_GAUSSIAN, GBG_EWALD_BSPLINE, 0, {7, 8}, 24.0, 2.0},
};
enum { RECIPES = sizeof recipes / sizeof *recipes, TARGETS = 40 };
/* Largest errors allowed: twice what was measured on the sets below. */
static const double most[RECIPES] = {6e-3, 3e-4, 4e-5, 2e-8, 1.3e-10, 1.3e-2, 3e-5};

static struct gbg_context *reference_context;

struct answer {
    int64_t n;
    int32_t target[TARGETS];
    double force[3][TARGETS], potential[TARGETS];
};

static void ask(const struct particle_set *s, double power, int potential, struct answer *answer)
{
    struct gbg_ewald_sources sources = set_sources(s, power);
    double *force[3] = {answer->force[0], answer->force[1], answer->force[2]};
    answer->n = set_targets(s->n, TARGETS, 5, answer->target);
    if (gbg_ewald_reference(reference_context, &sources, 1.0, answer->n, answer->target, force,
                            potential ? answer->potential : NULL) != GBG_OK) {
        fail_msg("%s", gbg_message(reference_context));
    }
}

/* RMS error over the RMS of the force, or of one source's force at the mean distance where there is
 * next to none. */
static double error_of(const struct particle_set *s, const struct answer *answer, double power,
                       const struct particles *p)
{
    double wrong = 0.0, whole = 0.0, volume = s->length[0] * s->length[1] * s->length[2];
    for (int64_t t = 0; t < answer->n; t++) {
        for (int a = 0; a < s->dimension; a++) {
            double exact = answer->force[a][t];
            double difference = p->state.force[a][p->place[answer->target[t]]] - exact;
            wrong += difference * difference;
            whole += exact * exact;
        }
    }
    double spacing = pow(volume / (double)s->n, 1.0 / s->dimension);
    double least = pow(spacing, -power);
    return sqrt(wrong / (double)answer->n) / fmax(sqrt(whole / (double)answer->n), least);
}

struct box {
    int dimension;
    double length[3];
};
static const struct box boxes[] = {
    {2, {32.0, 32.0}}, {2, {20.0, 96.0}}, {3, {10.0, 10.0, 10.0}}, {3, {6.0, 14.0, 9.0}}};

static void forces_are_those_of_sums_without_a_mesh(void **state)
{
    (void)state;
    static const int64_t sizes[] = {1, 2, 100, 4096};
    struct bench b = bench_open("cpu:threads=2");
    double worst[RECIPES][2] = {{0.0}};
    for (size_t k = 0; k < 4 * 4; k++) {
        const struct box *box = &boxes[k % 4];
        struct particle_set s = {0};
        struct answer answer;
        assert_true(set_make(&s, k % 2 ? SET_RANDOM : SET_JITTERED, box->dimension, box->length,
                             sizes[k / 4], k % 3 == 0, 3));
        ask(&s, 2.0, 0, &answer);
        struct particles p = particles_of(&s, 0);
        for (int r = 0; r < RECIPES; r++) {
            for (int gradient = 0; gradient < 2; gradient++) {
                if (s.n > 1000 && (r + (int)k + gradient) % 2) {
                    continue;
                }
                struct gbg_ewald_plan plan = plan_of(&recipes[r], &s, 2.0, gradient);
                forces_by_mesh(&b, &plan, 1, &p);
                double error = error_of(&s, &answer, 2.0, &p);
                if (!(error <= most[r])) {
                    print_message("%s, gradient %d, %d dimensions, %d particles: %.3g\n",
                                  recipes[r].name, gradient, s.dimension, (int)s.n, error);
                }
                worst[r][gradient] = fmax(worst[r][gradient], error);
            }
        }
        particles_free(&p);
        set_free(&s);
    }
    for (int r = 0; r < RECIPES; r++) {
        print_message("%s: error %.2g by waves, %.2g by slopes of the window\n", recipes[r].name,
                      worst[r][0], worst[r][1]);
        assert_true(worst[r][0] <= most[r] && worst[r][1] <= most[r]);
    }
    bench_close(&b);
}

/* Forces by ids, of all axes one after the other. */
static double *forces_of(const char *text, const struct particle_set *s, const struct recipe *r,
                         int gradient, int shuffled, const double *shift)
{
    struct bench b = bench_open(text);
    struct particles p = particles_of(s, shuffled);
    struct gbg_ewald_plan plan = plan_of(r, s, 2.0, gradient);
    double *force = new_array(3 * s->n, sizeof *force);
    place_at(&p, s, shift);
    forces_by_mesh(&b, &plan, 1, &p);
    for (int a = 0; a < s->dimension; a++) {
        for (int64_t i = 0; i < s->n; i++) {
            force[a * s->n + i] = p.state.force[a][p.place[i]];
        }
    }
    particles_free(&p);
    bench_close(&b);
    return force;
}

static void bits_depend_neither_on_threads_nor_on_places_in_memory(void **state)
{
    (void)state;
    static const char *const texts[] = {"cpu:threads=1", "cpu:threads=2", "cpu:threads=3",
                                        "cpu:threads=5", "poison:threads=2"};
    static const int64_t sizes[] = {1, 2, 700, 6000};
    for (int k = 0; k < 16; k++) {
        const struct box *box = &boxes[k % 4];
        const struct recipe *r = &recipes[k / 2 % 2 ? 0 : 2];
        struct particle_set s = {0};
        assert_true(set_make(&s, k % 3 ? SET_CLUSTERED : SET_RANDOM, box->dimension, box->length,
                             sizes[k / 4], 0, 4));
        double *one = forces_of(texts[0], &s, r, k % 2, 0, NULL);
        for (int t = 0; t < 5; t++) {
            double *more = forces_of(texts[t], &s, r, k % 2, t % 2 == 0, NULL);
            assert_memory_equal(one, more, (size_t)(s.dimension * s.n) * sizeof *one);
            free(more);
        }
        free(one);
        set_free(&s);
    }
}

/* Largest difference over the RMS of the first. */
static double difference(const struct particle_set *s, const double *one, const double *other)
{
    double worst = 0.0, whole = 0.0;
    for (int64_t i = 0; i < s->dimension * s->n; i++) {
        worst = fmax(worst, fabs(one[i] - other[i]));
        whole += one[i] * one[i];
    }
    return worst / sqrt(whole / (double)s->n);
}

static void other_instruction_sets_are_right_too(void **state)
{
    (void)state;
    static const char *const texts[] = {"cpu:threads=1,isa=avx2", "cpu:threads=1,isa=generic"};
    for (int k = 0; k < 8; k++) {
        const struct box *box = &boxes[k % 4];
        const struct recipe *r = &recipes[k / 4 ? 3 : 1];
        struct particle_set s = {0};
        assert_true(set_make(&s, SET_RANDOM, box->dimension, box->length, 900, 0, 4));
        double *one = forces_of("cpu:threads=1", &s, r, k % 2, 0, NULL);
        for (int t = 0; t < 2; t++) {
            struct gbg_context *context;
            if (gbg_context_create(texts[t], &context) != GBG_OK) {
                continue;
            }
            gbg_context_destroy(&context);
            double *more = forces_of(texts[t], &s, r, k % 2, 0, NULL);
            double d = difference(&s, one, more);
            print_message("%s, %s: %.2g\n", texts[t], r->name, d);
            assert_true(d < (r->single ? 1e-5 : 1e-12));
            assert_true(d == 0.0 || !strstr(texts[t], "avx2"));
            free(more);
        }
        free(one);
        set_free(&s);
    }
}

/* Moves by whole spacings of the mesh and of the cells change nothing but the order of sums, others
 * the error of the mesh too. */
static void forces_move_along_with_the_particles(void **state)
{
    (void)state;
    static const double whole[3] = {0.5, 0.25, 0.75}, any[3] = {0.3183, 0.7321, 0.1234};
    for (int k = 0; k < 8; k++) {
        const struct recipe *r = &recipes[k / 4 ? 3 : 1];
        const struct box *box = &boxes[k % 2 * 2];
        struct particle_set s = {0};
        assert_true(set_make(&s, SET_RANDOM, box->dimension, box->length, 1000, 0, 6));
        struct gbg_ewald_plan plan = plan_of(r, &s, 2.0, k / 2 % 2);
        double *one = forces_of("cpu:threads=1", &s, r, k / 2 % 2, 0, NULL);
        double *far = forces_of("cpu:threads=1", &s, r, k / 2 % 2, 0, any);
        double d = difference(&s, one, far);
        print_message("%s: %.2g by any shift", r->name, d);
        assert_true(d < 20.0 * most[k / 4 ? 3 : 1]);
        if (plan.choice.cells[0] % 4 == 0) {
            double *near = forces_of("cpu:threads=1", &s, r, k / 2 % 2, 0, whole);
            d = difference(&s, one, near);
            print_message(", %.2g by whole spacings", d);
            assert_true(d < (r->single ? 1e-5 : 1e-12));
            free(near);
        }
        print_message("\n");
        free(one);
        free(far);
        set_free(&s);
    }
}

/* On the nodes of the mesh, on their middles, on faces of cells, and beside the end of the box. */
static void places_on_the_mesh_are_like_any_other(void **state)
{
    (void)state;
    struct bench b = bench_open("cpu:threads=2");
    double worst[2] = {0.0, 0.0};
    for (int k = 0; k < 16; k++) {
        const struct recipe *r = &recipes[k / 2 % 2 ? 3 : 1];
        const struct box *box = &boxes[k % 4];
        struct particle_set s = {0};
        struct answer answer;
        assert_true(set_make(&s, SET_RANDOM, box->dimension, box->length, 300, 0, 8));
        struct gbg_ewald_plan plan = plan_of(r, &s, 2.0, k / 8);
        for (int a = 0; a < s.dimension; a++) {
            double halves = 2.0 * plan.choice.cells[a];
            for (int64_t i = 0; i < s.n; i++) {
                double x = floor(halves * s.position[a][i] / s.length[a]) / halves;
                x = i % 7 == 0 ? 1.0 - 0x1p-40 : i % 11 == 0 ? 0.0 : floor(x * 0x1p40) * 0x1p-40;
                s.position[a][i] =
                    i % 7 == 0 && (i / 7) % s.dimension != a ? s.position[a][i] : x * s.length[a];
            }
        }
        ask(&s, 2.0, 0, &answer);
        struct particles p = particles_of(&s, 0);
        forces_by_mesh(&b, &plan, 1, &p);
        double error = error_of(&s, &answer, 2.0, &p);
        worst[k / 2 % 2] = fmax(worst[k / 2 % 2], error);
        assert_true(error < most[k / 2 % 2 ? 3 : 1]);
        particles_free(&p);
        set_free(&s);
    }
    print_message("on the mesh: %.2g in single, %.2g in double precision\n", worst[0], worst[1]);
    bench_close(&b);
}

static void all_powers_and_potentials_are_right(void **state)
{
    (void)state;
    static const double powers[] = {1.0, 1.5, 2.0, 3.0, 4.0, 6.0};
    struct bench b = bench_open("cpu:threads=2");
    for (int k = 0; k < 14; k++) {
        const struct box *box = &boxes[k < 12 ? k % 2 : 2 + k % 2];
        double power = k < 12 ? powers[k / 2] : 2.0, error = 0.0, size = 0.0;
        struct particle_set s = {0};
        struct answer answer;
        struct gbg_ewald *sum;
        assert_true(set_make(&s, SET_JITTERED, box->dimension, box->length, 400, k % 3 == 0, 9));
        ask(&s, power, 1, &answer);
        struct particles p = particles_of(&s, 1);
        double *potential = new_array(s.n, sizeof *potential);
        struct gbg_ewald_plan plan = plan_of(&recipes[3], &s, power, k / 2 % 2);
        assert_int_equal(b.kernels->ewald_create(b.device, &p.state, &plan, 1, &sum), GBG_OK);
        assert_int_equal(b.kernels->ewald_force(b.device, &p.state, sum, 0), GBG_OK);
        assert_int_equal(b.kernels->ewald_potential(b.device, &p.state, sum, potential), GBG_OK);
        double once = p.state.force[0][3];
        double forces = error_of(&s, &answer, power, &p);
        assert_int_equal(b.kernels->ewald_force(b.device, &p.state, sum, 1), GBG_OK);
        assert_true(p.state.force[0][3] == 2.0 * once);
        for (int64_t t = 0; t < answer.n; t++) {
            double exact = answer.potential[t], d = potential[p.place[answer.target[t]]] - exact;
            error += d * d;
            size += exact * exact;
        }
        print_message("power %g, %d dimensions: forces %.2g, potentials %.2g\n", power, s.dimension,
                      forces, sqrt(error / size));
        assert_true(forces < 1e-7 && sqrt(error / size) < 1e-7);
        assert_true(b.kernels->ewald_bytes(sum) > 0.0);
        b.kernels->ewald_destroy(b.device, sum);
        free(potential);
        particles_free(&p);
        set_free(&s);
    }
    bench_close(&b);
}

/* Lengths of 1e-9 and 1e9: single precision keeps in its range. */
static void units_do_not_matter(void **state)
{
    (void)state;
    for (int k = 0; k < 8; k++) {
        const double unit = k % 2 ? 0x1p30 : 0x1p-30, power = k / 2 % 2 ? 6.0 : 2.0;
        struct bench b = bench_open("cpu:threads=1");
        double worst = 0.0, whole = 0.0;
        struct particle_set s = {0}, t = {0};
        const double length[3] = {20.0, 96.0, 1.0};
        const double scaled[3] = {20.0 * unit, 96.0 * unit, 1.0};
        assert_true(set_make(&s, SET_JITTERED, 2, length, 200, 0, 9));
        assert_true(set_make(&t, SET_JITTERED, 2, scaled, 200, 0, 9));
        struct particles p = particles_of(&s, 0), q = particles_of(&t, 0);
        struct gbg_ewald_plan plan = plan_of(&recipes[1], &s, power, k / 4);
        forces_by_mesh(&b, &plan, 1, &p);
        plan = plan_of(&recipes[1], &t, power, k / 4);
        forces_by_mesh(&b, &plan, 1, &q);
        for (int64_t i = 0; i < s.n; i++) {
            double f = p.state.force[1][i];
            worst = fmax(worst, fabs(q.state.force[1][i] * pow(unit, power) - f));
            whole += f * f;
        }
        assert_true(worst < 1e-5 * sqrt(whole / (double)s.n));
        particles_free(&p);
        particles_free(&q);
        set_free(&s);
        set_free(&t);
        bench_close(&b);
    }
}

static void failing_allocations_are_reported(void **state)
{
    (void)state;
    struct bench b = bench_open("cpu:threads=2");
    struct particle_set s = {0};
    assert_true(set_make(&s, SET_RANDOM, 2, boxes[0].length, 50, 0, 4));
    struct particles p = particles_of(&s, 0);
    struct gbg_ewald_plan plan = plan_of(&recipes[0], &s, 2.0, 0);
    struct gbg_ewald *sum = NULL;
    int status = GBG_E_MEMORY, k = 0;
    while (status != GBG_OK) {
        gbg_memory_fail_after(++k);
        status = b.kernels->ewald_create(b.device, &p.state, &plan, 1, &sum);
        assert_true(status == GBG_OK || (status == GBG_E_MEMORY && !sum));
        assert_true(k < 200);
    }
    gbg_memory_fail_after(0);
    assert_true(k > 10);
    b.kernels->ewald_destroy(b.device, sum);
    b.kernels->ewald_destroy(b.device, NULL);
    particles_free(&p);
    set_free(&s);
    bench_close(&b);
}

int main(void)
{
    const char *why;
    if (!gbg_fft_find(&why)) {
        printf("skipped: %s\n", why);
        return 77;
    }
    if (gbg_context_create("cpu:threads=2", &reference_context) != GBG_OK) {
        return 1;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(forces_are_those_of_sums_without_a_mesh),
        cmocka_unit_test(bits_depend_neither_on_threads_nor_on_places_in_memory),
        cmocka_unit_test(other_instruction_sets_are_right_too),
        cmocka_unit_test(forces_move_along_with_the_particles),
        cmocka_unit_test(places_on_the_mesh_are_like_any_other),
        cmocka_unit_test(all_powers_and_potentials_are_right),
        cmocka_unit_test(units_do_not_matter),
        cmocka_unit_test(failing_allocations_are_reported),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    gbg_context_destroy(&reference_context);
    return failed;
}
