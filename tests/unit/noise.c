/* Tests of the noise tape: each deviate against libm, limits, instruction sets, bad arguments. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "backend/backend.h"
#include "core/context.h"
#include "core/random.h"
#include "gamboge/kernels.h"

static const long double HALF_TURN = 3.141592653589793238462643383279502884L;

static long double reference_radius(uint32_t word)
{
    return sqrtl(-2.0L * logl(((long double)(word >> 1) + 0.5L) * 0x1p-31L));
}

static long double reference_angle(uint32_t word)
{
    int64_t rest = (int32_t)(word << 2);
    return ((long double)(word >> 30) + (long double)rest * 0x1p-32L) * HALF_TURN / 2.0L;
}

/* The deviates that noise.h describes, with libm. */
static void reference(uint32_t seed, uint32_t run, uint64_t step, uint64_t id, uint32_t stream,
                      long double xi[3])
{
    struct gbg_philox w = gbg_philox(gbg_philox_counter(step, id, stream), seed, run);
    long double radius = reference_radius(w.word[0]), angle = reference_angle(w.word[1]);
    xi[0] = radius * cosl(angle);
    xi[1] = radius * sinl(angle);
    xi[2] = reference_radius(w.word[2]) * cosl(reference_angle(w.word[3]));
}

static struct gbg_context *open_context(const char *text)
{
    struct gbg_context *context = NULL;
    return gbg_context_create(text, &context) == GBG_OK ? context : NULL;
}

/* Largest error of n ids in units of the last place of the float nearest to the exact value. */
static double worst_error(struct gbg_context *context, int dimension, int64_t step, int64_t first,
                          int64_t n)
{
    double *values = malloc((size_t)(n * dimension) * sizeof *values), worst = 0.0;
    assert_int_equal(gbg_normals(context, 4000000000, 17, step, first, dimension, n, values), 0);
    for (int64_t i = 0; i < n; i++) {
        long double exact[3];
        reference(4000000000u, 17, (uint64_t)step, (uint64_t)(first + i), GBG_STREAM_NOISE, exact);
        for (int a = 0; a < dimension; a++) {
            double place = ldexp(1.0, ilogbl(exact[a]) - 23);
            worst = fmax(worst, fabs((double)(values[i * dimension + a] - exact[a])) / place);
        }
    }
    free(values);
    return worst;
}

static void deviates_are_those_of_libm(void **state)
{
    (void)state;
    static const char *const names[] = {"cpu:threads=1,isa=generic", "cpu:threads=2,isa=avx2",
                                        "cpu:threads=2,isa=avx512"};
    for (int k = 0; k < 3; k++) {
        struct gbg_context *context = open_context(names[k]);
        if (!context) {
            continue;
        }
        double two = worst_error(context, 2, 5, 0, 200003);
        double three =
            worst_error(context, 3, (INT64_C(1) << 40) + 7, (INT64_C(1) << 32) - 777, 100001);
        print_message("%s: largest error %.2f and %.2f ulp\n", names[k], two, three);
        assert_true(two > 0.4 && two < 5.0 && three < 5.0);
        gbg_context_destroy(&context);
    }
}

static void instruction_sets_and_threads_agree(void **state)
{
    (void)state;
    enum { N = 10007 };
    static double values[4][3 * N];
    static const char *const names[] = {"cpu:threads=1", "cpu:threads=7,isa=avx512",
                                        "cpu:threads=2,isa=avx2", "poison"};
    struct gbg_context *generic = open_context("cpu:isa=avx2");
    if (!generic) {
        skip();
    }
    gbg_context_destroy(&generic);
    int last = 0;
    for (int k = 0; k < 4; k++) {
        struct gbg_context *context = open_context(names[k]);
        if (context) {
            assert_int_equal(gbg_normals(context, 1, 2, 3, 4, 3, N, values[k]), 0);
            assert_memory_equal(values[0], values[k], sizeof values[0]);
            last = k;
        }
        gbg_context_destroy(&context);
    }
    assert_true(last > 0);
}

/* Any part of the tape may be asked for by itself. */
static void parts_are_those_of_the_whole(void **state)
{
    (void)state;
    enum { N = 100 };
    struct gbg_context *context = open_context("cpu");
    double whole[2 * N], part[2 * N];
    assert_int_equal(gbg_normals(context, 1, 2, 3, 0, 2, N, whole), 0);
    for (int64_t first = 0; first < 40; first++) {
        for (int64_t n = 0; n < 40; n++) {
            part[2 * n] = 123.0;
            assert_int_equal(gbg_normals(context, 1, 2, 3, first, 2, n, part), 0);
            assert_memory_equal(part, whole + 2 * first, (size_t)(2 * n) * sizeof *part);
            assert_true(part[2 * n] == 123.0);
        }
    }
    gbg_context_destroy(&context);
}

static void limited(struct gbg_context *context, int limit_by, double limit, int64_t n,
                    double *values)
{
    const struct gbg_backend *backend = gbg_backend_find("cpu");
    struct gbg_device *device;
    struct gbg_noise noise = {9, 0, limit_by, limit, 0.25};
    assert_int_equal(backend->create(context, &device), 0);
    assert_int_equal(backend->kernels(device)->normals(device, &noise, 11, 0, n, 3, values), 0);
    backend->destroy(device);
}

static double nearest_float_below(double limit)
{
    float f = (float)limit;
    return f > limit ? nextafterf(f, 0.0f) : f;
}

static void limits_clamp_or_redraw(void **state)
{
    (void)state;
    enum { N = 20000 };
    static double free_values[3 * N], clamped[3 * N], redrawn[3 * N];
    struct gbg_context *context = open_context("cpu");
    for (double limit = 0.1; limit < 4.0; limit += 1.3) {
        double most = nearest_float_below(limit);
        int64_t changed = 0;
        limited(context, 0, limit, N, free_values);
        limited(context, 1, limit, N, clamped);
        limited(context, 2, limit, N, redrawn);
        for (int64_t i = 0; i < 3 * N; i++) {
            double value = free_values[i] / 0.25;
            assert_true(clamped[i] / 0.25 == fmax(-most, fmin(most, value)));
            double expected = value;
            for (uint32_t stream = 1; stream < 16 && fabs(expected) > most; stream++) {
                long double xi[3];
                reference(9, 0, 11, (uint64_t)(i / 3), stream, xi);
                expected = (double)xi[i % 3];
            }
            expected = fmax(-most, fmin(most, expected));
            assert_true(fabs(redrawn[i] / 0.25 - expected) <= 3e-7 * fabs(expected));
            changed += expected != value;
        }
        assert_true(changed > 0);
    }
    gbg_context_destroy(&context);
}

static void bad_arguments_are_refused(void **state)
{
    (void)state;
    struct gbg_context *context = open_context("cpu");
    double value[3] = {7.0, 7.0, 7.0};
    const int64_t most = INT64_C(1) << 56;
    static const int64_t bad[][6] = {{-1, 0, 0, 0, 2, 1}, {0, INT64_C(1) << 32, 0, 0, 2, 1},
                                     {0, 0, -1, 0, 2, 1}, {0, 0, 0, -1, 2, 1},
                                     {0, 0, 0, 0, 1, 1},  {0, 0, 0, 0, 4, 1},
                                     {0, 0, 0, 0, 2, -1}, {0, 0, 0, INT64_C(1) << 56, 2, 1}};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        const int64_t *b = bad[k];
        assert_int_equal(gbg_normals(context, b[0], b[1], b[2], b[3], (int)b[4], b[5], value),
                         GBG_E_ARGUMENT);
        assert_non_null(strstr(gbg_message(context), "gbg_normals: "));
    }
    assert_int_equal(gbg_normals(context, 0, 0, 0, 0, 2, 1, NULL), GBG_E_ARGUMENT);
    assert_int_equal(gbg_normals(NULL, 0, 0, 0, 0, 2, 1, value), GBG_E_ARGUMENT);
    assert_true(value[0] == 7.0);
    assert_int_equal(gbg_normals(context, 0, 0, 0, most - 1, 2, 1, value), GBG_OK);
    assert_int_equal(gbg_normals(context, 0, 0, 0, most, 2, 0, NULL), GBG_OK);
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(deviates_are_those_of_libm),
        cmocka_unit_test(instruction_sets_and_threads_agree),
        cmocka_unit_test(parts_are_those_of_the_whole),
        cmocka_unit_test(limits_clamp_or_redraw),
        cmocka_unit_test(bad_arguments_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
