/* Tests of the law of the noise: moments by integration over the grid of random words and by
 * sampling, the distribution function, independence.
 *
 * Sampling alone cannot confirm a variance to 1e-5: its standard error is sqrt(2/n), so that takes
 * n = 2e10 deviates. Integration does: a deviate is a fixed function of two words. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "backend/backend.h"
#include "backend/cpu/noise.h"
#include "core/context.h"

enum { RADII = 1 << 18, ANGLES = 1 << 10, BLOCK = 1 << 16, BINS = 4096 };

static float radius[RADII], direction[ANGLES];

/* The vector functions of noise.h at evenly spaced words (the middle of each part). */
static void tabulate(void)
{
    for (int64_t k = 0; k < RADII; k += VF_LANES) {
        int32_t word[VF_LANES];
        for (int l = 0; l < VF_LANES; l++) {
            word[l] = (int32_t)(uint32_t)((2 * (k + l) + 1) * ((INT64_C(1) << 31) / RADII));
        }
        vf_store(radius + k, gbg_noise_radius(vi_load(word)));
    }
    for (int64_t k = 0; k < ANGLES; k += VF_LANES) {
        int32_t word[VF_LANES];
        vf sine, cosine;
        for (int l = 0; l < VF_LANES; l++) {
            word[l] = (int32_t)(uint32_t)((2 * (k + l) + 1) * ((INT64_C(1) << 31) / ANGLES));
        }
        gbg_noise_direction(vi_load(word), &cosine, &sine);
        vf_store(direction + k, cosine);
    }
}

struct moments {
    double n, sum, second, fourth;
};

static void integration_gives_the_moments(void **state)
{
    (void)state;
    tabulate();
    struct moments all = {0}, clamped = {0}, inside = {0};
    for (int64_t i = 0; i < RADII; i++) {
        struct moments row[3] = {{0}};
        for (int64_t k = 0; k < ANGLES; k++) {
            double x = (double)(radius[i] * direction[k]), c = fmax(-3.0, fmin(3.0, x));
            row[0].sum += x;
            row[0].second += x * x;
            row[0].fourth += x * x * x * x;
            row[1].second += c * c;
            row[2].n += x == c;
            row[2].second += x == c ? x * x : 0.0;
        }
        all.sum += row[0].sum;
        all.second += row[0].second;
        all.fourth += row[0].fourth;
        clamped.second += row[1].second;
        inside.n += row[2].n;
        inside.second += row[2].second;
    }
    double n = (double)RADII * ANGLES;
    print_message("mean %.1e, variance %.7f, clamped at 3 %.7f, redrawn at 3 %.7f, fourth %.5f\n",
                  all.sum / n, all.second / n, clamped.second / n, inside.second / inside.n,
                  all.fourth / n);
    assert_true(fabs(all.sum / n) < 1e-9);
    assert_true(fabs(all.second / n - 1.0) < 3e-6);
    assert_true(fabs(clamped.second / n - 0.9950073) < 3e-6);
    assert_true(fabs(inside.second / inside.n - 0.9733369) < 3e-6);
    assert_true(fabs(all.fourth / n - 3.0) < 3e-4); /* the tail beyond the last radius */
}

static int64_t sample_size(void)
{
    const char *text = getenv("GBG_NOISE_SAMPLE");
    return text ? atoll(text) / BLOCK * BLOCK : 16 * BLOCK;
}

struct tape {
    struct gbg_context *context;
    const struct gbg_backend *backend;
    struct gbg_device *device;
};

static struct tape open_tape(void)
{
    struct tape tape = {0};
    assert_int_equal(gbg_context_create("cpu", &tape.context), 0);
    tape.backend = gbg_backend_find("cpu");
    assert_int_equal(tape.backend->create(tape.context, &tape.device), 0);
    return tape;
}

static void close_tape(struct tape *tape)
{
    tape->backend->destroy(tape->device);
    gbg_context_destroy(&tape->context);
}

static void read_tape(const struct tape *tape, int limit_by, uint32_t seed, uint64_t step,
                      uint64_t first, double *values)
{
    struct gbg_noise noise = {seed, 0, limit_by, 3.0, 1.0};
    const struct gbg_kernels *kernels = tape->backend->kernels(tape->device);
    assert_int_equal(kernels->normals(tape->device, &noise, step, first, BLOCK, 3, values), 0);
}

/* Mean, variance and fourth moment of n triples against the exact law. */
static void check_sample(const struct tape *tape, int limit_by, double variance, double fourth)
{
    static double values[3 * BLOCK];
    struct moments m = {0};
    for (int64_t first = 0; first < sample_size(); first += BLOCK) {
        read_tape(tape, limit_by, 1, 2, (uint64_t)first, values);
        for (int64_t i = 0; i < 3 * BLOCK; i++) {
            double square = values[i] * values[i];
            m.n += 1.0;
            m.sum += values[i];
            m.second += square;
            m.fourth += square * square;
        }
    }
    double deviation = sqrt((fourth - variance * variance) / m.n);
    double kurtosis = m.fourth / m.n / pow(m.second / m.n, 2.0) - 3.0;
    print_message(
        "limit %d, n %.2g: mean %.1e, variance %.6f (standard error %.1e), excess kurtosis "
        "%.5f (%.1e)\n",
        limit_by, m.n, m.sum / m.n, m.second / m.n, deviation, kurtosis, sqrt(24.0 / m.n));
    assert_true(fabs(m.sum / m.n) < 4.5 * sqrt(variance / m.n));
    assert_true(fabs(m.second / m.n - variance) < 4.5 * deviation);
    assert_true(fabs(kurtosis - (fourth / (variance * variance) - 3.0)) < 4.5 * sqrt(24.0 / m.n));
}

static void samples_have_the_moments(void **state)
{
    (void)state;
    struct tape tape = open_tape();
    check_sample(&tape, 0, 1.0, 3.0);
    /* Fourth moments by parts of the integral of x^4 over the density within 3. */
    double density = exp(-4.5) / sqrt(2.0 * acos(-1.0)), inside = erf(3.0 / sqrt(2.0));
    double within = 3.0 * inside - 2.0 * density * (27.0 + 9.0);
    check_sample(&tape, 1, 0.9950073, within + 81.0 * (1.0 - inside));
    check_sample(&tape, 2, 0.9733369, within / inside);
    close_tape(&tape);
}

/* Kolmogorov-Smirnov distance over BINS + 1 points of equal probability. */
static void samples_follow_the_normal_law(void **state)
{
    (void)state;
    static double values[3 * BLOCK];
    static int64_t count[BINS];
    struct tape tape = open_tape();
    int64_t n = 0;
    memset(count, 0, sizeof count);
    for (int64_t first = 0; first < sample_size() / 4; first += BLOCK) {
        read_tape(&tape, 0, 5, 6, (uint64_t)first, values);
        for (int64_t i = 0; i < 3 * BLOCK; i++) {
            double p = 0.5 * erfc(-values[i] / sqrt(2.0));
            count[(int)fmin(p * BINS, BINS - 1)]++;
            n++;
        }
    }
    double distance = 0.0, below = 0.0, chi_squared = 0.0, expected = (double)n / BINS;
    for (int k = 0; k < BINS; k++) {
        below += (double)count[k];
        distance = fmax(distance, fabs(below / (double)n - (k + 1.0) / BINS));
        chi_squared += pow((double)count[k] - expected, 2.0) / expected;
    }
    double score = (chi_squared - (BINS - 1)) / sqrt(2.0 * (BINS - 1));
    print_message("Kolmogorov-Smirnov distance sqrt(n) D = %.3f; chi squared %.2f deviations off\n",
                  distance * sqrt((double)n), score);
    assert_true(distance * sqrt((double)n) < 2.0); /* exceeded by chance once in 1500 */
    assert_true(fabs(score) < 4.5);
    close_tape(&tape);
}

/* Correlation of values and of their squares, in standard errors. */
static void check_independent(const char *what, const double *a, const double *b, ptrdiff_t step,
                              int64_t n)
{
    double product = 0.0, squares = 0.0;
    for (int64_t i = 0; i < n; i++) {
        double x = a[i * step], y = b[i * step];
        product += x * y;
        squares += (x * x - 1.0) * (y * y - 1.0);
    }
    double values_score = product / sqrt((double)n),
           squares_score = squares / sqrt(4.0 * (double)n);
    print_message("%-22s %6.2f %6.2f deviations off\n", what, values_score, squares_score);
    assert_true(fabs(values_score) < 4.5 && fabs(squares_score) < 4.5);
}

static void deviates_are_independent(void **state)
{
    (void)state;
    static double values[3 * BLOCK], others[3 * BLOCK];
    struct tape tape = open_tape();
    read_tape(&tape, 0, 11, 100, 0, values);
    check_independent("x and y", values, values + 1, 3, BLOCK);
    check_independent("x and z", values, values + 2, 3, BLOCK);
    check_independent("y and z", values + 1, values + 2, 3, BLOCK);
    check_independent("neighbouring ids", values, values + 3, 3, BLOCK - 1);
    check_independent("ids 16 apart", values, values + 48, 3, BLOCK - 16);
    read_tape(&tape, 0, 11, 101, 0, others);
    check_independent("neighbouring steps", values, others, 1, 3 * BLOCK);
    read_tape(&tape, 0, 12, 100, 0, others);
    check_independent("neighbouring seeds", values, others, 1, 3 * BLOCK);
    read_tape(&tape, 0, 11, 100, UINT64_C(1) << 32, others);
    check_independent("ids 2^32 apart", values, others, 1, 3 * BLOCK);
    close_tape(&tape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(integration_gives_the_moments),
        cmocka_unit_test(samples_have_the_moments),
        cmocka_unit_test(samples_follow_the_normal_law),
        cmocka_unit_test(deviates_are_independent),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
