/* Tests of the sums over all pairs: against plain loops, in bits, and their bad arguments. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/memory.h"
#include "core/random.h"
#include "gamboge/kernels.h"

enum { MOST = 4096 };

/* A set of particles and the forces on them, each array blocked by axis. */
struct set {
    int dimension;
    int64_t n;
    double length[3], power, cutoff;
    double position[3 * MOST], alpha[MOST], mobility[MOST], force[3 * MOST];
};

static struct set set, other;

static double random_number(int64_t i, int which)
{
    struct gbg_philox w =
        gbg_philox(gbg_philox_counter(7, (uint64_t)i, GBG_STREAM_START), (uint32_t)which, 3);
    return gbg_uniform(w.word[0], w.word[1]);
}

/* Random positions in a part of the box. They are multiples of 2^-32 of the lengths, so that
 * fixed-point numbers and the loops below see the same places. */
static void make(struct set *s, int dimension, int64_t n, const double *length, double part)
{
    s->dimension = dimension;
    s->n = n;
    s->cutoff = 0.0;
    for (int a = 0; a < dimension; a++) {
        s->length[a] = length[a];
        for (int64_t i = 0; i < n; i++) {
            double fraction = floor(random_number(i, a) * part * 0x1p32) * 0x1p-32;
            s->position[a * n + i] = length[a] * fraction;
        }
    }
    for (int64_t i = 0; i < n; i++) {
        s->alpha[i] = random_number(i, 8) - 0.3;
        s->mobility[i] = random_number(i, 9) - 0.6;
    }
}

static int evaluate(const char *backend, const char *precision, struct set *s)
{
    struct gbg_context *context = NULL;
    if (gbg_context_create(backend, &context) != GBG_OK) {
        return 0;
    }
    int64_t n = s->n;
    double *x = s->position, *f = s->force;
    int deep = s->dimension == 3;
    int status = gbg_pair_forces(context, s->dimension, s->length, s->power, s->cutoff, precision,
                                 n, x, x + n, deep ? x + 2 * n : NULL, 1, s->alpha, s->mobility, f,
                                 f + n, deep ? f + 2 * n : NULL, 1);
    assert_int_equal(status, GBG_OK);
    gbg_context_destroy(&context);
    return 1;
}

/* r^-(power+1) */
static long double inverse(long double squared, double power)
{
    long double r = sqrtl(squared);
    return power == 2.0   ? 1.0L / (squared * r)
           : power == 6.0 ? 1.0L / (squared * squared * squared * r)
                          : powl(r, -(power + 1.0L));
}

/* Force on i by a plain loop in extended precision, and the sum of the sizes of its terms. */
static long double plain(const struct set *s, int64_t i, long double force[3])
{
    long double size = 0.0L;
    force[0] = force[1] = force[2] = 0.0L;
    for (int64_t k = 0; k < s->n; k++) {
        long double r[3], squared = 0.0L;
        for (int a = 0; a < s->dimension; a++) {
            r[a] = (long double)s->position[a * s->n + i] - s->position[a * s->n + k];
            r[a] -= s->length[a] * rintl(r[a] / s->length[a]);
            squared += r[a] * r[a];
        }
        if (squared > 0.0L && (s->cutoff == 0.0 || squared < (long double)s->cutoff * s->cutoff)) {
            long double strength = s->mobility[i] * s->alpha[k] * inverse(squared, s->power);
            for (int a = 0; a < s->dimension; a++) {
                force[a] += strength * r[a];
            }
            size += fabsl(strength) * sqrtl(squared);
        }
    }
    return size;
}

/* Largest |dF_i| over the sum of the sizes of the terms of F_i, for about 20 of the particles. */
static double worst_error(const struct set *s)
{
    double worst = 0.0;
    for (int64_t i = 0; i < s->n; i += 1 + s->n / 20) {
        long double exact[3], squared = 0.0L, size = plain(s, i, exact);
        for (int a = 0; a < s->dimension; a++) {
            long double d = s->force[a * s->n + i] - exact[a];
            squared += d * d;
        }
        double relative = squared == 0.0L ? 0.0 : (double)(sqrtl(squared) / size);
        worst = relative <= worst ? worst : relative;
    }
    return worst;
}

static const double SQUARE[3] = {16.0, 16.0, 16.0}, OBLONG[3] = {3.0, 40.0, 7.0},
                    THREAD[3] = {1000.0, 1.0, 1.0};

/* Any image may be taken of a pair at exactly half a box length; such pairs are rare and left out
 * by the choice of positions. */
static void sums_are_those_of_a_plain_loop(void **state)
{
    (void)state;
    static const int64_t sizes[] = {0, 1, 2, 3, 5, 64, 127, 128, 129, 257, 300, 511};
    static const double powers[] = {2.0, 6.0, 3.5, 1.0, 2.3, 12.0, 24.0, 3.0, 4.0, 5.0, 7.7};
    enum { POWERS = sizeof powers / sizeof *powers };
    static const double *const boxes[] = {SQUARE, OBLONG, THREAD};
    double worst_mixed[POWERS] = {0.0}, worst_double[POWERS] = {0.0}, worst_strict[POWERS] = {0.0};
    for (int dimension = 2; dimension <= 3; dimension++) {
        for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
            for (size_t p = 0; p < POWERS; p++) {
                make(&set, dimension, sizes[k], boxes[(k + p) % 3], 1.0);
                set.power = powers[p];
                assert_true(evaluate("cpu", "mixed", &set));
                worst_mixed[p] = fmax(worst_mixed[p], worst_error(&set));
                assert_true(evaluate("cpu", "double", &set));
                worst_double[p] = fmax(worst_double[p], worst_error(&set));
                assert_true(evaluate("cpu", "strict", &set));
                worst_strict[p] = fmax(worst_strict[p], worst_error(&set));
            }
        }
    }
    for (int p = 0; p < POWERS; p++) {
        print_message(
            "power %4.1f, largest |dF|/sum|terms|: mixed %.2e, double %.2e, strict %.2e\n",
            powers[p], worst_mixed[p], worst_double[p], worst_strict[p]);
        assert_true(worst_strict[p] > 0.0 && worst_strict[p] < (powers[p] > 6.0 ? 1e-12 : 1e-6));
        assert_true(worst_mixed[p] < 1e-6);
        assert_true(worst_double[p] > 0.0 && worst_double[p] < 1e-15 * (powers[p] + 1.0));
    }
}

static void other_instruction_sets_are_right_too(void **state)
{
    (void)state;
    static const char *const names[] = {"cpu:isa=generic", "cpu:isa=avx2", "cpu:isa=avx512"};
    static const double powers[] = {2.0, 6.0, 1.7};
    for (int k = 0; k < 3; k++) {
        for (int p = 0; p < 6; p++) {
            make(&set, 2 + p / 3, 650, OBLONG, 1.0);
            set.power = powers[p % 3];
            if (!evaluate(names[k], "mixed", &set)) {
                continue;
            }
            assert_true(worst_error(&set) < 1e-6);
            assert_true(evaluate(names[k], "double", &set));
            assert_true(worst_error(&set) < 5e-15);
        }
    }
}

/* Everything within a thousandth of the box: all pairs are near ones, some coincide. */
static void dense_clusters_keep_their_precision(void **state)
{
    (void)state;
    for (int dimension = 2; dimension <= 3; dimension++) {
        for (double part = 0.01; part > 1e-9; part *= 0.03) {
            make(&set, dimension, 400, part < 1e-4 ? OBLONG : SQUARE, part);
            for (int a = 0; a < dimension; a++) {
                set.position[a * 400 + 399] = set.position[a * 400 + 7];
            }
            for (set.power = 2.0; set.power < 7.0; set.power += 2.0) {
                assert_true(evaluate("cpu", "mixed", &set));
                assert_true(worst_error(&set) < 1e-6);
                assert_true(evaluate("cpu", "strict", &set));
                assert_true(worst_error(&set) < 1e-6);
            }
        }
    }
}

/* Pairs so near to half a box that 32 bits of a position cannot tell on which side. */
static void the_nearest_image_follows_from_all_bits(void **state)
{
    (void)state;
    for (int dimension = 2; dimension <= 3; dimension++) {
        make(&set, dimension, 600, SQUARE, 0.5);
        for (int64_t i = 0; i < 300; i++) {
            for (int a = 0; a < dimension; a++) {
                double offset =
                    a == i % dimension ? 0.5 + (double)(2 * i - 301) * 0x1p-44 : 0.01 * a;
                set.position[a * 600 + i] = floor(set.position[a * 600 + i] * 0x1p20) * 0x1p-20;
                set.position[a * 600 + 300 + i] = set.position[a * 600 + i] + 16.0 * offset;
            }
        }
        for (set.power = 1.0; set.power < 3.0; set.power += 1.0) {
            assert_true(evaluate("cpu", "double", &set));
            assert_true(worst_error(&set) < 5e-15);
            assert_true(evaluate("cpu", "mixed", &set));
            assert_true(worst_error(&set) < 1e-6);
            assert_true(evaluate("cpu", "strict", &set));
            assert_true(worst_error(&set) < 1e-6);
        }
    }
}

/* One source is 1e18 times as strong as the others: the force on it comes from the weak ones. */
static void weak_sources_are_not_lost(void **state)
{
    (void)state;
    make(&set, 2, 1000, SQUARE, 1.0);
    set.alpha[500] = 1e18;
    for (set.power = 1.0; set.power < 8.0; set.power += 1.0) {
        assert_true(evaluate("cpu", "mixed", &set));
        assert_true(worst_error(&set) < 1e-6);
        assert_true(evaluate("cpu", "strict", &set));
        assert_true(worst_error(&set) < 1e-6);
    }
}

static void cutoffs_leave_out_what_is_farther(void **state)
{
    (void)state;
    for (int dimension = 2; dimension <= 3; dimension++) {
        for (int64_t n = 0; n < 600; n = 3 * n + 1) {
            make(&set, dimension, n, SQUARE, 1.0);
            set.power = 6.0;
            set.cutoff = 8.0 - (double)(n % 7);
            assert_true(evaluate("cpu", "double", &set));
            assert_true(worst_error(&set) < 5e-15);
            assert_true(evaluate("cpu", "mixed", &set));
            assert_true(worst_error(&set) < 1e-6);
        }
    }
}

static void bits_do_not_depend_on_threads_or_instructions(void **state)
{
    (void)state;
    static const char *const names[] = {"cpu:threads=2", "cpu:threads=7", "poison:threads=3",
                                        "cpu:threads=2,isa=avx2", "cpu:threads=1,isa=avx512"};
    static const double powers[] = {2.0, 6.0, 2.3};
    struct gbg_context *context = NULL;
    int no_avx2 = gbg_context_create("cpu:isa=avx2", &context) != GBG_OK;
    gbg_context_destroy(&context);
    for (int p = 0; p < 12; p++) {
        make(&set, 2 + p % 2, 1500, p < 6 ? OBLONG : SQUARE, p % 4 ? 1.0 : 0.002);
        set.power = powers[p % 3];
        const char *precision = p % 5 == 4 ? "double" : "mixed";
        assert_true(evaluate("cpu:threads=1", precision, &set));
        for (int k = 0; k < 5; k++) {
            make(&other, set.dimension, 1500, p < 6 ? OBLONG : SQUARE, p % 4 ? 1.0 : 0.002);
            other.power = set.power;
            if ((k >= 3 && no_avx2) || !evaluate(names[k], precision, &other)) {
                continue;
            }
            assert_memory_equal(set.force, other.force,
                                (size_t)(set.dimension * set.n) * sizeof(double));
        }
    }
}

/* Whole and other powers, in single and in double precision, with doubtful pairs and without; every
 * set also with its particles in pieces of several spans. */
static void strict_bits_are_the_same_everywhere(void **state)
{
    (void)state;
    static const char *const names[] = {"cpu:threads=2",          "cpu:threads=5",
                                        "poison:threads=3",       "cpu:threads=2,isa=generic",
                                        "cpu:threads=5,isa=avx2", "cpu:threads=1,isa=avx512"};
    static const double powers[] = {2.0, 6.0, 2.3, 1.0, 3.0, 4.0, 5.0, 5.9, 7.0, 8.5, 12.0, 24.0};
    static const int64_t sizes[] = {1, 33, 64, 700, 1024, 1500};
    int compared[6] = {0};
    for (int c = 0; c < 48; c++) {
        int64_t n = sizes[c % 6];
        const double *box = c % 3 ? OBLONG : SQUARE;
        double part = c % 4 ? 1.0 : 0.002;
        make(&set, 2 + c / 2 % 2, n, box, part);
        set.power = powers[(c + c / 12) % 12];
        assert_true(evaluate("cpu:threads=1", "strict", &set));
        for (int k = 0; k < 6; k++) {
            make(&other, set.dimension, n, box, part);
            other.power = set.power;
            if (evaluate(names[k], "strict", &other)) {
                assert_memory_equal(set.force, other.force,
                                    (size_t)(set.dimension * n) * sizeof(double));
                compared[k]++;
            }
        }
    }
    assert_true(compared[0] == 48 && compared[3] == 48);
    print_message("strict: same bits; sets compared on generic %d, avx2 %d, avx512 %d\n",
                  compared[3], compared[4], compared[5]);
}

/* 100 targets of 4096 in quadruple precision: nothing in it is shared with the kernels. */
static double quadruple_error(const struct set *s)
{
    double error = 0.0, size = 0.0;
    for (int64_t t = 0; t < 100; t++) {
        int64_t i = t * 40 + 17;
        __float128 force[3] = {0, 0, 0};
        for (int64_t k = 0; k < s->n; k++) {
            __float128 r[3], squared = 0;
            for (int a = 0; a < s->dimension; a++) {
                r[a] = (__float128)s->position[a * s->n + i] - s->position[a * s->n + k];
                r[a] -= r[a] > s->length[a] / 2 ? s->length[a] : 0;
                r[a] += r[a] < -s->length[a] / 2 ? s->length[a] : 0;
                squared += r[a] * r[a];
            }
            __float128 root = squared > 0 ? (__float128)sqrtl((long double)squared) : 1;
            root = (root + squared / root) / 2;
            for (int a = 0; a < s->dimension && k != i; a++) {
                force[a] += s->mobility[i] * s->alpha[k] * r[a] / (squared * root);
            }
        }
        for (int a = 0; a < s->dimension; a++) {
            double d = (double)(s->force[a * s->n + i] - force[a]), f = (double)force[a];
            error += d * d;
            size += f * f;
        }
    }
    return sqrt(error / size);
}

static void a_hundred_targets_in_quadruple_precision(void **state)
{
    (void)state;
    for (int dimension = 2; dimension <= 3; dimension++) {
        make(&set, dimension, 4096, OBLONG, 1.0);
        set.power = 2.0;
        assert_true(evaluate("cpu", "mixed", &set));
        double mixed = quadruple_error(&set);
        assert_true(evaluate("cpu", "double", &set));
        double full = quadruple_error(&set);
        assert_true(evaluate("cpu", "strict", &set));
        double strict = quadruple_error(&set);
        print_message("%dD, RMS(dF)/RMS(F): mixed %.2e, double %.2e, strict %.2e\n", dimension,
                      mixed, full, strict);
        assert_true(strict > 1e-10 && strict < 1e-6);
        assert_true(mixed > 1e-10 && mixed < 1e-6);
        assert_true(full < 1e-14);
    }
}

static struct set good;

static int refused(struct gbg_context *context, int status, const char *part, int dimension,
                   double power, double cutoff, const char *precision, int64_t n, ptrdiff_t step,
                   const double *length, const double *alpha)
{
    double *x = good.position, *f = good.force;
    int got = gbg_pair_forces(context, dimension, length, power, cutoff, precision, n, x, x + 10,
                              NULL, step, alpha, good.mobility, f, f + 10, NULL, 1);
    return got == status && strstr(gbg_message(context), "gbg_pair_forces: ") &&
           strstr(gbg_message(context), part);
}

static void bad_arguments_are_refused(void **state)
{
    (void)state;
    struct gbg_context *context = NULL;
    assert_int_equal(gbg_context_create("cpu", &context), GBG_OK);
    make(&good, 2, 10, SQUARE, 1.0);
    static const double flat[2] = {1.0, 0.0}, nan_length[2] = {1.0, NAN};
    const double *box = good.length, *alpha = good.alpha;
    good.force[0] = 77.0;
    const int bad = GBG_E_ARGUMENT;
    assert_true(refused(context, bad, "dimension is 1", 1, 2, 0, "mixed", 10, 1, box, alpha));
    assert_true(refused(context, bad, "z is NULL", 3, 2, 0, "mixed", 10, 1, SQUARE, alpha));
    assert_true(refused(context, bad, "power is 0", 2, 0, 0, "mixed", 10, 1, box, alpha));
    assert_true(refused(context, bad, "power is 25", 2, 25, 0, "mixed", 10, 1, box, alpha));
    assert_true(refused(context, bad, "power is nan", 2, NAN, 0, "mixed", 10, 1, box, alpha));
    assert_true(refused(context, bad, "cutoff is 8.1", 2, 2, 8.1, "mixed", 10, 1, box, alpha));
    assert_true(refused(context, bad, "cutoff is -1", 2, 2, -1, "mixed", 10, 1, box, alpha));
    assert_true(refused(context, GBG_E_NAME, "mixt", 2, 2, 0, "mixt", 10, 1, box, alpha));
    assert_true(refused(context, GBG_E_NAME, "NULL", 2, 2, 0, NULL, 10, 1, box, alpha));
    assert_true(refused(context, bad, "n is -1", 2, 2, 0, "mixed", -1, 1, box, alpha));
    assert_true(refused(context, bad, "step is 0", 2, 2, 0, "mixed", 10, 0, box, alpha));
    assert_true(refused(context, bad, "lengths[1] is 0", 2, 2, 0, "mixed", 10, 1, flat, alpha));
    assert_true(
        refused(context, bad, "lengths[1] is nan", 2, 2, 0, "mixed", 10, 1, nan_length, alpha));
    assert_true(refused(context, bad, "lengths is NULL", 2, 2, 0, "mixed", 10, 1, NULL, alpha));
    assert_true(refused(context, bad, "NULL", 2, 2, 0, "mixed", 10, 1, box, NULL));
    good.position[13] = INFINITY;
    assert_true(refused(context, bad, "particle 3", 2, 2, 0, "mixed", 10, 1, box, alpha));
    assert_true(good.force[0] == 77.0);
    assert_int_equal(gbg_pair_forces(NULL, 2, box, 2, 0, "mixed", 0, NULL, NULL, NULL, 1, NULL,
                                     NULL, NULL, NULL, NULL, 1),
                     GBG_E_ARGUMENT);
    gbg_context_destroy(&context);
}

/* x(3, n) with forces into f(2, n), the y axis read backwards in memory by a negative step. */
static void strides_and_images_do_not_matter(void **state)
{
    (void)state;
    enum { N = 50 };
    struct gbg_context *context = NULL;
    double x[3 * N], f[2 * N], fx[N], fy[N];
    assert_int_equal(gbg_context_create("cpu", &context), GBG_OK);
    make(&set, 2, N, SQUARE, 1.0);
    set.power = 2.0;
    assert_true(evaluate("cpu", "double", &set));
    for (int64_t i = 0; i < N; i++) {
        x[3 * i] = set.position[i] + 16.0 * (double)(i - 20);
        x[3 * i + 1] = set.position[N + i] - 48.0;
    }
    assert_int_equal(gbg_pair_forces(context, 2, set.length, 2.0, 0.0, "double", N, x, x + 1, NULL,
                                     3, set.alpha, set.mobility, f, f + 1, NULL, 2),
                     GBG_OK);
    for (int64_t i = 0; i < N; i++) {
        assert_true(f[2 * i] == set.force[i] && f[2 * i + 1] == set.force[N + i]);
    }
    for (int64_t i = 0; i < N; i++) {
        x[N - 1 - i] = set.position[i];
        x[2 * N - 1 - i] = set.position[N + i];
    }
    assert_int_equal(gbg_pair_forces(context, 2, set.length, 2.0, 0.0, "double", N, x + N - 1,
                                     x + 2 * N - 1, NULL, -1, set.alpha, set.mobility, fx + N - 1,
                                     fy + N - 1, NULL, -1),
                     GBG_OK);
    for (int64_t i = 0; i < N; i++) {
        assert_true(fx[N - 1 - i] == set.force[i] && fy[N - 1 - i] == set.force[N + i]);
    }
    gbg_context_destroy(&context);
}

/* Each allocation of a call fails in turn: the call says so, the forces stay, and (under the
 * address sanitizer) nothing leaks. */
static void failing_allocations_are_reported(void **state)
{
    (void)state;
    enum { N = 300 };
    struct gbg_context *context = NULL;
    assert_int_equal(gbg_context_create("cpu", &context), GBG_OK);
    make(&set, 2, N, SQUARE, 1.0);
    for (int with_cutoff = 0; with_cutoff < 2; with_cutoff++) {
        int status = GBG_E_MEMORY, k = 0;
        for (set.force[0] = 77.0; status != GBG_OK; k++) {
            gbg_memory_fail_after(k + 1);
            status = gbg_pair_forces(context, 2, set.length, 6.0, with_cutoff, "mixed", N,
                                     set.position, set.position + N, NULL, 1, set.alpha,
                                     set.mobility, set.force, set.force + N, NULL, 1);
            assert_true(status == GBG_OK || (status == GBG_E_MEMORY && set.force[0] == 77.0));
            assert_true(k < 200);
        }
        gbg_memory_fail_after(0);
        assert_true(k > 5);
    }
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sums_are_those_of_a_plain_loop),
        cmocka_unit_test(other_instruction_sets_are_right_too),
        cmocka_unit_test(dense_clusters_keep_their_precision),
        cmocka_unit_test(the_nearest_image_follows_from_all_bits),
        cmocka_unit_test(weak_sources_are_not_lost),
        cmocka_unit_test(cutoffs_leave_out_what_is_farther),
        cmocka_unit_test(bits_do_not_depend_on_threads_or_instructions),
        cmocka_unit_test(strict_bits_are_the_same_everywhere),
        cmocka_unit_test(a_hundred_targets_in_quadruple_precision),
        cmocka_unit_test(bad_arguments_are_refused),
        cmocka_unit_test(failing_allocations_are_reported),
        cmocka_unit_test(strides_and_images_do_not_matter),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
