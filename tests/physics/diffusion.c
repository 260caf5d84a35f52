/* Long-time diffusion of dilute hard discs under the rule event (A3): D_L/D_0 = 1 - 2 packing.
 *
 * A path R is the sum W of its noise, known from the tape, and of the pushes P. Time reversal turns
 * R into -R and leaves P as it is, so <R P> = 0 and <R^2> = <W^2> - <P^2>: the loss of diffusion is
 * <P^2>, whose error is a small part of itself, where that of <R^2> - <W^2> would be many times as
 * large. (Exact for short steps; a collision at a random time within a step leaves an error of
 * order s.) The loss is taken between half a window and a whole one, D_0 t = 4 to 8, when paths
 * have long forgotten their start; two packings remove the term of second order. */
#include "gates.h"

enum { N = 4096, WINDOWS = 12, HALF = 5000 };
static double x[N], y[N], rx[N], ry[N], wx[N], wy[N], noise[2 * N];
static const double s = 0.04;

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
    print_message(
        "packing %g: (1 - D_L/D_0)/packing %.3f +- %.3f by pushes, %.2f +- %.2f by paths\n",
        packing, pushes.mean, pushes.error, paths.mean, paths.error);
    assert_true(fabs(pushes.mean - paths.mean) < 4.0 * hypot(pushes.error, paths.error));
    return pushes;
}

static void slope(void **state)
{
    (void)state;
    struct gbg_context *context = opened_context();
    needs_rule(context, "event");
    struct gbg_estimate low = loss(context, 0.02), high = loss(context, 0.04);
    gbg_context_destroy(&context);
    struct gbg_estimate first = {2.0 * low.mean - high.mean, hypot(2.0 * low.error, high.error)};
    assert_true(gate("first order of 1 - D_L/D_0", first, 2.0, 0.1));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(slope),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
