/* Tests of c/analysis/blocking.c: levels against a plain computation, and series whose error is
 * known: x_{t+1} = r x_t + sqrt(1 - r^2) g has Var(mean) = (1 + r)/(1 - r)/n up to O(1/n^2). */
#include "analysis_help.h"

#include "core/memory.h"

static void levels_are_the_plain_averages(void **state)
{
    (void)state;
    enum { N = 1000 };
    static double x[N];
    struct gbg_blocking blocking;
    MUST(NULL, gbg_blocking_make(NULL, 3, &blocking));
    for (int i = 0; i < N; i++) {
        x[i] = 5 + normal(1, (uint64_t)i);
        MUST(NULL, gbg_blocking_reserve(NULL, &blocking, i + 1));
        gbg_blocking_add(&blocking, 1, x[i]);
    }
    assert_int_equal(blocking.count[0], 0);
    for (int level = 0; level < blocking.levels; level++) {
        int size = 1 << level, blocks = N / size;
        double mean = 0, squares = 0;
        for (int b = 0; b < blocks; b++) {
            for (int i = 0; i < size; i++) {
                mean += x[b * size + i] / size / blocks;
            }
        }
        for (int b = 0; b < blocks; b++) {
            double own = 0;
            for (int i = 0; i < size; i++) {
                own += x[b * size + i] / size;
            }
            squares += (own - mean) * (own - mean);
        }
        assert_true(fabs(blocking.mean[level][1] - mean) < 1e-12);
        assert_true(fabs(blocking.squares[level][1] - squares) < 1e-10);
    }
    gbg_blocking_free(&blocking);
}

/* Mean of (estimated error)^2 over the true one, and how often the mean is within one and two. */
static void correlated_series(double r, int64_t n, int series, uint64_t seed, double *ratio,
                              double within[2], double *independent)
{
    struct gbg_blocking blocking;
    MUST(NULL, gbg_blocking_make(NULL, series, &blocking));
    MUST(NULL, gbg_blocking_reserve(NULL, &blocking, n));
    double truth = (1 + r) / (1 - r) / (double)n;
    *ratio = within[0] = within[1] = *independent = 0;
    for (int s = 0; s < series; s++) {
        double x = normal(seed, (uint64_t)(s * (n + 1)));
        for (int64_t t = 1; t <= n; t++) {
            gbg_blocking_add(&blocking, s, x);
            x = r * x + sqrt(1 - r * r) * normal(seed, (uint64_t)(s * (n + 1) + t));
        }
        double effective, error = gbg_blocking_error(&blocking, s, &effective);
        double z = fabs(blocking.mean[0][s]) / error;
        *ratio += error * error / truth / series;
        *independent += effective / series;
        within[0] += (z <= 1) / (double)series;
        within[1] += (z <= 2) / (double)series;
    }
    gbg_blocking_free(&blocking);
}

static void errors_of_correlated_series_are_right(void **state)
{
    (void)state;
    const double times[] = {0, 2, 10};
    for (int i = 0; i < 3; i++) {
        double r = times[i] > 0 ? exp(-1 / times[i]) : 0, ratio, within[2], independent;
        correlated_series(r, 4096, 300, 10 + (uint64_t)i, &ratio, within, &independent);
        double expected = 4096 * (1 - r) / (1 + r);
        print_message(
            "correlation time %2.0f: error^2 %.2f of the truth, %.0f %% within 1, %.0f %% "
            "within 2, independent values %.0f (exact %.0f)\n",
            times[i], ratio, 100 * within[0], 100 * within[1], independent, expected);
        assert_true(ratio > 0.9 && ratio < 1.25);
        assert_true(within[0] > 0.62 && within[0] < 0.77); /* 69 % +- 2.7 % for 300 series */
        assert_true(within[1] > 0.92 && within[1] < 0.985);
        assert_true(fabs(independent / expected - 1) < 0.25);
    }
}

static void constant_and_short_series(void **state)
{
    (void)state;
    struct gbg_blocking blocking;
    double independent;
    MUST(NULL, gbg_blocking_make(NULL, 1, &blocking));
    MUST(NULL, gbg_blocking_reserve(NULL, &blocking, 100));
    gbg_blocking_add(&blocking, 0, 3);
    assert_true(isnan(gbg_blocking_error(&blocking, 0, &independent)));
    for (int i = 1; i < 100; i++) {
        gbg_blocking_add(&blocking, 0, 3);
    }
    assert_true(gbg_blocking_error(&blocking, 0, &independent) == 0);
    assert_true(independent == 100);
    gbg_blocking_free(&blocking);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_are_the_plain_averages),
        cmocka_unit_test(errors_of_correlated_series_are_right),
        cmocka_unit_test(constant_and_short_series),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
