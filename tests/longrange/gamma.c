/* Tests of the incomplete gamma functions that the reference of long-range sums is made of. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>

#include "ewald/reference_parts.h"

static void at_most(double *worst, double value)
{
    *worst = value > *worst || isnan(value) ? value : *worst;
}

/* Upwards from order 1/2 or 1, where all terms are positive. */
static void positive_orders_are_right(void **state)
{
    (void)state;
    struct gbg_gamma_rule rule;
    double worst = 0.0;
    gbg_gamma_rule_make(&rule);
    for (double x = 1e-9; x < 45.0; x *= 1.0173) {
        long double z = x, fall = expl(-z), half = sqrtl(acosl(-1.0L)) * erfcl(sqrtl(z));
        for (int odd = 0; odd < 2; odd++) {
            long double order = odd ? 0.5L : 1.0L, value = odd ? half : fall;
            for (int k = 0; k < 4; k++) {
                double exact = (double)(value * powl(z, -order));
                at_most(&worst, fabs(gbg_gamma_tail(&rule, (double)order, x) / exact - 1.0));
                value = order * value + powl(z, order) * fall;
                order += 1.0L;
            }
        }
    }
    printf("orders 1/2 to 4: %.1e\n", worst);
    assert_true(worst < 2e-15);
}

/* Downwards from 1/2 and from E1: what cancels must not show in long double precision. */
static void other_orders_are_right(void **state)
{
    (void)state;
    struct gbg_gamma_rule rule;
    double worst = 0.0;
    gbg_gamma_rule_make(&rule);
    for (double x = 1e-9; x < 1.5; x *= 1.0173) {
        long double z = x, fall = expl(-z), term = -1.0L;
        long double value[2] = {-0.57721566490153286061L - logl(z),
                                sqrtl(acosl(-1.0L)) * erfcl(sqrtl(z))};
        for (int n = 1; n < 60; n++) {
            term *= -z / n;
            value[0] += term / n;
        }
        at_most(&worst, fabs(gbg_gamma_tail(&rule, 0.0, x) / (double)value[0] - 1.0));
        for (int half = 0; half < 2; half++) {
            for (int k = 1; k <= 3; k++) {
                long double order = 0.5L * half - k;
                value[half] = (value[half] - powl(z, order) * fall) / order;
                double exact = (double)(value[half] * powl(z, -order));
                at_most(&worst, fabs(gbg_gamma_tail(&rule, (double)order, x) / exact - 1.0));
            }
        }
    }
    printf("orders 0, -1/2 to -3: %.1e\n", worst);
    assert_true(worst < 2e-15);
}

/* x Gamma(order + 1) = order Gamma(order) + exp(-x), all scaled: any order, also where nothing is
 * elementary; over the largest of the three. */
static void orders_are_linked(void **state)
{
    (void)state;
    struct gbg_gamma_rule rule;
    double worst = 0.0;
    gbg_gamma_rule_make(&rule);
    for (double x = 1e-6; x < 45.0; x *= 1.7) {
        for (double order = -3.0; order < 3.0; order += 0.0723) {
            double above = x * gbg_gamma_tail(&rule, order + 1.0, x);
            double below = order * gbg_gamma_tail(&rule, order, x);
            double error = above - below - exp(-x);
            at_most(&worst, fabs(error) / fmax(fmax(above, fabs(below)), exp(-x)));
        }
    }
    printf("recurrence: %.1e\n", worst);
    assert_true(worst < 4e-15);
}

/* The polynomials of a table against the function between their nodes, relative to its value. */
static void tables_are_right(void **state)
{
    (void)state;
    static gbg_reference_panel table[GBG_REFERENCE_PANELS];
    for (double power = 1.0; power <= 6.0; power += 1.25) {
        struct gbg_reference_law law;
        double worst[2] = {0.0, 0.0};
        gbg_reference_law_make(2, power, 3.0, 1.0, &law);
        for (int potential = 0; potential < 2; potential++) {
            gbg_reference_table_make(&law, potential, 1, 0, table);
            for (double place = 0.5; place < GBG_REFERENCE_PANELS; place += 3.17) {
                int panel = (int)place, each = 1 << GBG_REFERENCE_PANEL_BITS;
                double z = 2.0 * (place - panel) - 1.0, value = 0.0;
                double x = ldexp(1.0 + (panel % each + 0.5 * (z + 1.0)) / each,
                                 GBG_REFERENCE_LOWEST + panel / each);
                for (int k = GBG_REFERENCE_TERMS; k-- > 0;) {
                    value = value * z + table[panel][k];
                }
                double exact = potential ? gbg_reference_short_potential(&law, x)
                                         : gbg_reference_short(&law, x);
                /* the smooth rest of the range is what counts: exp(-16) of the whole is left */
                at_most(&worst[x > 16.0], fabs(value / exact - 1.0) * (x > 16.0 ? exp(-16.0) : 1));
            }
        }
        printf("tables of power %g: %.1e up to x = 16, %.1e beyond\n", power, worst[0], worst[1]);
        assert_true(worst[0] < 1e-14 && worst[1] < 1e-14);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(positive_orders_are_right),
        cmocka_unit_test(other_orders_are_right),
        cmocka_unit_test(orders_are_linked),
        cmocka_unit_test(tables_are_right),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
