/* Diffusion of dilute hard discs under the rule event (A3): D_L/D_0 = 1 - 2 packing at long times,
 * and the exact law of two discs for the times that a test can wait for.
 *
 * A path R is the sum W of its noise, known from the tape, and of the pushes P. Time reversal turns
 * R into -R and leaves P as it is, so <R P> = 0 and <R^2> = <W^2> - <P^2>: the loss of diffusion is
 * <P^2>, whose error is a small part of itself, where that of <R^2> - <W^2> would be many times as
 * large. (Exact for short steps; a collision at a random time within a step leaves an error of
 * order s.) The loss is taken between half a window and a whole one, D_0 t = 4 to 8; two packings
 * remove the term of second order. */
#include "gates.h"

enum { N = 4096, WINDOWS = 16, HALF = 5000 };
static double x[N], y[N], rx[N], ry[N], wx[N], wy[N], noise[2 * N];
static const double s = 0.04;

/* To first order in the packing only pairs count: one disc diffuses with 2 D_0 relative to the
 * other outside a reflecting circle. The push that it meets decays as the dipole (l = 1) of that
 * problem, whose spectrum at the circle is 1/(k (J_1'(k)^2 + Y_1'(k)^2)), decay rate 2 D_0 k^2, k
 * in units of 1/diameter. This is what is still to come of the loss at the time t (in
 * diameter^2/D_0), as a part of the whole; without the exponential the integral is pi^2/4. */
static double still_to_come(double t)
{
    double sum = 0.0;
    for (double u = -14.0, h = 1e-3; u < 12.0; u += h) { /* u = ln k */
        double k = exp(u + 0.5 * h), a = j0(k) - j1(k) / k, b = y0(k) - y1(k) / k;
        sum += h * exp(-2.0 * k * k * t) / (k * k * (a * a + b * b));
    }
    return sum / (acos(-1.0) * acos(-1.0) / 4.0);
}

/* Mean over D_0 t = first .. last of the loss over the packing: 2 at long times. */
static double exact_loss(double first, double last)
{
    enum { POINTS = 64 };
    double mean = 0.0;
    for (int k = 0; k < POINTS; k++) {
        mean += 2.0 * (1.0 - still_to_come(first + (last - first) * (k + 0.5) / POINTS)) / POINTS;
    }
    return mean;
}

/* Adds the noise of the next steps to w and makes them. */
static void advance(struct gbg_context *context, struct gbg_engine *engine, int64_t seed)
{
    int64_t step;
    done(context, gbg_engine_integer(engine, "step", &step));
    for (int k = 0; k < HALF; k++) {
        done(context, gbg_normals(context, seed, 0, step + k, 0, 2, N, noise));
        for (int i = 0; i < N; i++) {
            wx[i] += s * noise[2 * i];
            wy[i] += s * noise[2 * i + 1];
        }
    }
    done(context, gbg_engine_run(engine, HALF));
    done(context, gbg_engine_positions(engine, 0, N, rx, ry, NULL, 1));
}

/* Means over the particles of P^2 and R^2 - W^2 since the start of the window. */
static void squares(double *pushes, double *paths)
{
    *pushes = *paths = 0.0;
    for (int i = 0; i < N; i++) {
        double dx = rx[i] - x[i], dy = ry[i] - y[i], px = dx - wx[i], py = dy - wy[i];
        *pushes += (px * px + py * py) / N;
        *paths += (dx * dx + dy * dy - wx[i] * wx[i] - wy[i] * wy[i]) / N;
    }
}

/* The loss 1 - D_L/D_0 over the packing. */
static struct gbg_estimate loss(struct gbg_context *context, double packing)
{
    struct gbg_sample sample = {.rule = "event",
                                .dt = s * s,
                                .temperature = 1.0,
                                .species = 1,
                                .mobility = {1.0},
                                .seed = 900 + (int64_t)(1000.0 * packing)};
    struct gbg_engine *engine;
    double by_pushes[WINDOWS], by_paths[WINDOWS], free_path = 2.0 * s * s * HALF;
    done(context, gbg_discs_equilibrium(context, packing, N, 6, x, y, &sample.edge));
    done(context, gbg_sample_engine(context, &sample, N, x, y, NULL, &engine));
    for (int k = 0; k < WINDOWS; k++) {
        double half[2], whole[2];
        done(context, gbg_engine_positions(engine, 0, N, x, y, NULL, 1));
        memset(wx, 0, sizeof wx);
        memset(wy, 0, sizeof wy);
        advance(context, engine, sample.seed);
        squares(&half[0], &half[1]);
        advance(context, engine, sample.seed);
        squares(&whole[0], &whole[1]);
        by_pushes[k] = (whole[0] - half[0]) / free_path / packing;
        by_paths[k] = -(whole[1] - half[1]) / free_path / packing;
    }
    gbg_engine_destroy(&engine);
    struct gbg_estimate pushes = gbg_estimate_mean(WINDOWS, by_pushes);
    struct gbg_estimate paths = gbg_estimate_mean(WINDOWS, by_paths);
    print_message("packing %g: (1 - D/D_0)/packing %.3f +- %.3f by pushes, %.2f +- %.2f by paths\n",
                  packing, pushes.mean, pushes.error, paths.mean, paths.error);
    assert_true(fabs(pushes.mean - paths.mean) < 4.0 * hypot(pushes.error, paths.error));
    return pushes;
}

static void slope(void **state)
{
    (void)state;
    struct gbg_context *context = opened_context();
    struct gbg_estimate low = loss(context, 0.03), high = loss(context, 0.06);
    gbg_context_destroy(&context);
    struct gbg_estimate first = {2.0 * low.mean - high.mean, hypot(2.0 * low.error, high.error)};
    assert_true(fabs(still_to_come(0.0) - 1.0) < 1e-5);
    double exact = exact_loss(0.5 * s * s * HALF, s * s * HALF);
    assert_true(gate("first order of 1 - D(4..8)/D_0", first, exact, 0.05 * exact));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(slope),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
