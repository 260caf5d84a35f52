/* Weak order of the contact rules: the error of the mean gap of an isolated bound pair over seven
 * steps, each half of the one before.
 *
 * Pair: A-B of C2 (A = -3, r^-6) at T = 0.01; the gap relaxes within T/A^2 = 0.0011. Slopes are
 * weighted fits of log|bias| against log dt. bounce: order 1, from dt = 0.01 on. contact: order
 * 1/2, and only once dt is far below T/A^2, since the gap of a projected pair is bounded by its
 * step. It is the maximum of a random walk, whose mean is known at any step (Spitzer), so it is
 * tested against that too. bridge: its own error, from the curvature of the motion and the change
 * of the drift within a step. */
#include "gates.h"

enum { STEPS = 7 };

static double exact;

/* Biases of a rule at dt, dt/2, ... dt/64 and their slope. */
static struct gbg_estimate order(struct gbg_context *context, const char *rule, double dt,
                                 int pairs, double duration, struct gbg_estimate bias[STEPS])
{
    double step[STEPS];
    const struct gbg_pair_law *law = &gbg_bound_pairs[1];
    exact = gbg_pair_exact(law, 0.01, 0.0).gap;
    for (int k = 0; k < STEPS; k++) {
        step[k] = ldexp(dt, -k);
        struct gbg_dimer_plan plan = {rule, step[k], 0.01, pairs, 1, duration, 70 + k};
        struct gbg_dimer_result result;
        done(context, gbg_dimers_measure(context, law, &plan, &result));
        bias[k] = (struct gbg_estimate){result.gap.mean - exact, result.gap.error};
        print_message("%-8s dt %.3e: error of the mean gap %+.3f %% +- %.3f\n", rule, step[k],
                      100.0 * bias[k].mean / exact, 100.0 * bias[k].error / exact);
    }
    struct gbg_estimate slope = gbg_estimate_order(STEPS, step, bias);
    print_message("%-8s order %.3f +- %.3f\n", rule, slope.mean, slope.error);
    return slope;
}

static void bounce(void **state)
{
    (void)state;
    struct gbg_context *context = opened_context();
    struct gbg_estimate bias[STEPS];
    struct gbg_estimate slope = order(context, "bounce", 0.01, 1024, 4.0, bias);
    gbg_context_destroy(&context);
    assert_true(gate("order of bounce", slope, 1.0, 0.1));
}

/* Mean of the maximum of a walk with steps of deviation 1 and mean -b: sum over n of the mean
 * positive part of its n-th position, over n. */
static double mean_of_maximum(double b)
{
    double sum = 0.0;
    for (int n = 1; n < 200.0 / (b * b); n++) {
        double z = b * sqrt((double)n);
        double positive = exp(-0.5 * z * z) / sqrt(8.0 * atan(1.0)) - 0.5 * z * erfc(z / sqrt(2.0));
        sum += positive / sqrt((double)n);
    }
    return sum;
}

static void contact(void **state)
{
    (void)state;
    struct gbg_context *context = opened_context();
    struct gbg_estimate bias[STEPS];
    struct gbg_estimate slope = order(context, "contact", 3.2e-4, 1024, 1.0, bias);
    int good = gate("order of contact", slope, 0.5, 0.1);
    for (int k = 0; k < STEPS; k++) {
        double dt = ldexp(3.2e-4, -k), deviation = sqrt(2.0 * 0.01 * dt), b = 3.0 * dt / deviation;
        double walk = deviation * (mean_of_maximum(b) - 0.5 / b);
        char what[64];
        snprintf(what, sizeof what, "contact, dt %.3g, reflected walk", dt);
        good &= gate(what, bias[k], walk, 0.02 * exact);
    }
    gbg_context_destroy(&context);
    assert_true(good);
}

static void bridge(void **state)
{
    (void)state;
    struct gbg_context *context = opened_context();
    struct gbg_estimate bias[STEPS];
    struct gbg_estimate slope = order(context, "bridge", 0.01, 4096, 4.0, bias);
    int good = 1;
    /* never worse than 2 %, and falling with the step */
    for (int k = 0; k < STEPS; k++) {
        good &= fabs(bias[k].mean) <= 0.02 * exact + 2.0 * bias[k].error;
    }
    good &= slope.mean - 2.0 * slope.error > 0.35 && slope.mean + 2.0 * slope.error < 1.1;
    gbg_context_destroy(&context);
    assert_true(good);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bounce),
        cmocka_unit_test(contact),
        cmocka_unit_test(bridge),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
