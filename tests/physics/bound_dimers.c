/* Bound dimers at the step of Carter 2016 (dt = T = 0.01), rule bridge (A2).
 *
 * Isolated: mean gap and speed along the axis of every bound pair of C0 to C4 against the exact
 * stationary law, by quadrature. Sample: 2048 independent pairs, each looked at 400 times (the gap
 * forgets itself within a step), errors from the spread over pairs. Dense: unlike pairs closer than
 * a gap of 0.02 in a suspension of packing 0.52, N = 1024, from t = 1 to t = 4 after the forces are
 * switched on in an equilibrium of passive discs, 24 independent starts, against the limit of small
 * steps: the same rule and starts with a step 16 times smaller, from `gamboge bench
 * contact-rules-open` (a prototype found 4.03(4)e-3 and 2.96(1)e-3 with one start). */
#include "gates.h"

static void isolated(void **state)
{
    (void)state;
    struct gbg_context *context = opened_context();
    struct gbg_dimer_plan plan = {"bridge", 0.01, 0.01, 1024, 2, 4.0, 51};
    int good = 1;
    for (int k = 0; k < GBG_BOUND_PAIRS; k++) {
        const struct gbg_pair_law *law = &gbg_bound_pairs[k];
        struct gbg_pair_exact exact = gbg_pair_exact(law, plan.temperature, 0.0);
        struct gbg_dimer_result result;
        char what[64];
        done(context, gbg_dimers_measure(context, law, &plan, &result));
        snprintf(what, sizeof what, "%s, mean gap", law->name);
        good &= gate(what, result.gap, exact.gap, 0.02 * exact.gap);
        snprintf(what, sizeof what, "%s, speed", law->name);
        /* like partners have none, to the rounding of the forces */
        good &= gate(what, result.speed, exact.speed, 0.003 * fmax(exact.speed, 1e-3));
    }
    gbg_context_destroy(&context);
    assert_true(good);
}

/* The quadrature itself, against values found by other means. */
static void exact_law(void **state)
{
    (void)state;
    struct gbg_pair_exact c2 = gbg_pair_exact(&gbg_bound_pairs[1], 0.01, 0.0);
    struct gbg_pair_exact c4 = gbg_pair_exact(&gbg_bound_pairs[4], 0.01, 0.02);
    struct gbg_pair_exact all = gbg_pair_exact(&gbg_bound_pairs[4], 0.01, 0.0);
    assert_true(fabs(c2.gap - 3.489e-3) < 1e-6 && fabs(c2.speed - 0.4898) < 1e-4);
    assert_true(fabs(c4.gap - 2.052e-3) < 1e-6 && fabs(all.speed - 1.4818) < 1e-4);
    /* power 2, to first order in T: gap T/|A|, speed V0 (1 - 2 T/|A|) */
    struct gbg_pair_law slow = gbg_bound_pairs[1];
    slow.power = 2.0;
    struct gbg_pair_exact first = gbg_pair_exact(&slow, 1e-4, 0.0);
    assert_true(fabs(first.gap / (1e-4 / 3.0) - 1.0) < 3e-4);
    assert_true(fabs(first.speed / (0.5 * (1.0 - 2e-4 / 3.0)) - 1.0) < 1e-7);
}

static void dense(void **state)
{
    (void)state;
    struct gbg_context *context = opened_context();
    struct gbg_dense_plan plan = {"bridge", 0.01, 0.52, 1024, 61, 24, 1.0, 4.0};
    static const struct {
        int pair;
        double gap, uncertainty;
    } limit[2] = {{1, 3.997e-3, 0.010e-3}, {4, 2.957e-3, 0.010e-3}};
    int good = 1;
    for (int k = 0; k < 2; k++) {
        const struct gbg_pair_law *law = &gbg_bound_pairs[limit[k].pair];
        struct gbg_dense_result result;
        char what[64];
        done(context, gbg_dense_measure(context, law, &plan, &result));
        snprintf(what, sizeof what, "%s, dense, mean gap", law->name);
        print_message("%s: pairs at contact over uniform %.1f +- %.1f, speed %.3f +- %.3f\n",
                      law->name, result.first_bin.mean, result.first_bin.error, result.speed.mean,
                      result.speed.error);
        result.gap.error = hypot(result.gap.error, limit[k].uncertainty);
        good &= gate(what, result.gap, limit[k].gap, 0.02 * limit[k].gap);
    }
    gbg_context_destroy(&context);
    assert_true(good);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exact_law),
        cmocka_unit_test(isolated),
        cmocka_unit_test(dense),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
