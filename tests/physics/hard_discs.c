/* Passive hard discs under the rule event (A3): contact value, displacement virial, their ratio,
 * rate of collisions, long-time diffusion at low density.
 *
 * g at contact is the cubic through 80 bins of 0.00125 in the gaps 0 to 0.1; errors are those of 20
 * block means, each of 40 units of time (5 relaxation times of the longest wave of density) where Z
 * itself is gated. Exact: Z(0.52) = 4.464 (virial series), at any step s, since straight moves with
 * elastic collisions leave the ensemble of hard discs as it is. */
#include "gates.h"

enum { MOST = 4096 };
static double x[MOST], y[MOST], edge;

static const double pi = 3.14159265358979323846;

static struct gbg_disc_result measured(struct gbg_context *context, double packing, double s,
                                       int64_t n, double duration)
{
    struct gbg_disc_plan plan = {"event", packing, s, n, 100 + (int64_t)(1000.0 * s), duration};
    struct gbg_disc_result r;
    done(context, gbg_discs_measure(context, &plan, edge, x, y, &r));
    print_message("packing %g, N = %lld, s = %g: g %.4f +- %.4f (5 blocks: %.4f), Z %.4f +- %.4f, "
                  "C - 1 = %+.3f %% +- %.3f, displacements %.4f %.4f %.4f\n",
                  packing, (long long)n, s, r.contact.mean, r.contact.error, r.slow_error,
                  r.virial.mean, r.virial.error, 100.0 * (r.ratio.mean - 1.0),
                  100.0 * r.ratio.error, r.msd[0].mean, r.msd[1].mean, r.msd[2].mean);
    return r;
}

/* Collisions of a disc in a step: 2 sqrt(pi) rho g s, the rate in two dimensions with speeds of s a
 * component; each belongs to two discs. */
static int collisions(const struct gbg_disc_result *r, double packing, double s)
{
    double density = packing * 4.0 / pi;
    struct gbg_estimate over = r->pushes;
    double rate = sqrt(pi) * density * r->contact.mean * s;
    over.mean /= rate;
    over.error = hypot(over.error / rate, r->contact.error / r->contact.mean);
    return gate("collisions over the exact rate", over, 1.0, 0.01);
}

static void fluid(void **state)
{
    (void)state;
    struct gbg_context *context = opened_context();
    done(context, gbg_discs_equilibrium(context, 0.52, 1024, 5, x, y, &edge));
    int good = 1;
    for (int k = 0; k < 2; k++) {
        double s = k ? 0.04 : 0.02;
        struct gbg_disc_result r = measured(context, 0.52, s, 1024, k ? 800.0 : 100.0);
        struct gbg_estimate by_contact = {1.0 + 2.0 * 0.52 * r.contact.mean,
                                          2.0 * 0.52 * r.contact.error};
        good &= gate("C", r.ratio, 1.0, 1e-3);
        good &= collisions(&r, 0.52, s);
        if (k) { /* the larger step reaches the statistics */
            good &= gate("Z by contact", by_contact, 4.464, 1e-3 * 4.464);
            good &= gate("Z by displacements", r.virial, 4.464, 1e-3 * 4.464);
        }
    }
    gbg_context_destroy(&context);
    assert_true(good);
}

static void near_freezing(void **state)
{
    (void)state;
    struct gbg_context *context = opened_context();
    done(context, gbg_discs_equilibrium(context, 0.698, 1024, 5, x, y, &edge));
    struct gbg_disc_result r = measured(context, 0.698, 0.04, 1024, 100.0);
    int good = gate("C", r.ratio, 1.0, 1e-3);
    good &= collisions(&r, 0.698, 0.04);
    gbg_context_destroy(&context);
    assert_true(good);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fluid),
        cmocka_unit_test(near_freezing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
