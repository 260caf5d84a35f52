/* Free Brownian particles: the variance of a step and the mean squared displacement (A4).
 *
 * Noise convention: each component moves by sqrt(T dt) xi, so D = T/2 and the MSD is 2 d D t. The
 * squares of n independent components have a relative standard error sqrt((kurtosis - 1)/n); bounds
 * are four of those. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "gamboge/gamboge.h"

enum { N = 250000 };
static double before[3][N], after[3][N], start[3][N];

static const double temperature = 0.01, dt = 0.01, side = 100.0;

struct law {
    const char *limit_by;
    int rescale;
    double variance, kurtosis; /* of a limited deviate; kurtosis only enters the error bar */
    int seed;
};

static struct gbg_engine *gas(struct gbg_context *context, int dimension, const struct law *law)
{
    struct gbg_scene *scene;
    struct gbg_engine *engine = NULL;
    double lengths[3] = {side, side, side};
    int index, bad = 0;
    bad |= gbg_scene_create(context, dimension, &scene);
    bad |= gbg_scene_set_box(scene, lengths, NULL);
    bad |= gbg_scene_add_species(scene, "A", 0.0, 0.0, 1.0, 1.0, -1, &index);
    bad |= gbg_scene_set_integer(scene, "particles.count", N);
    bad |= gbg_scene_set_text(scene, "particles.start.random", "insertion");
    bad |= gbg_scene_set_real(scene, "dynamics.dt", dt);
    bad |= gbg_scene_set_real(scene, "dynamics.temperature", temperature);
    bad |= gbg_scene_set_text(scene, "dynamics.noise.limit_by", law->limit_by);
    if (strcmp(law->limit_by, "none") != 0) {
        bad |= gbg_scene_set_real(scene, "dynamics.noise.limit", 3.0);
        bad |= gbg_scene_set_integer(scene, "dynamics.noise.rescale", law->rescale);
    }
    bad |= gbg_scene_set_integer(scene, "output.trajectory.unwrapped", 1);
    bad |= gbg_scene_set_integer(scene, "run.seed", law->seed);
    bad |= gbg_engine_create(scene, &engine);
    gbg_scene_destroy(&scene);
    if (bad) {
        fail_msg("%s", gbg_message(context));
    }
    return engine;
}

static void read_out(struct gbg_engine *engine, int dimension, double r[3][N])
{
    assert_int_equal(
        gbg_engine_positions(engine, 0, N, r[0], r[1], dimension == 3 ? r[2] : NULL, 1), GBG_OK);
}

static double mean_square(int dimension, double a[3][N], double b[3][N])
{
    double sum = 0.0;
    for (int k = 0; k < dimension; k++) {
        for (int i = 0; i < N; i++) {
            double d = a[k][i] - b[k][i];
            sum += d * d;
        }
    }
    return sum / N;
}

static void displacement_law(int dimension, const struct law *law, int steps)
{
    struct gbg_context *context;
    assert_int_equal(gbg_context_create("cpu:threads=2", &context), GBG_OK);
    struct gbg_engine *engine = gas(context, dimension, law);
    double sum = 0.0;
    read_out(engine, dimension, start);
    read_out(engine, dimension, before);
    for (int k = 0; k < steps; k++) {
        assert_int_equal(gbg_engine_run(engine, 1), GBG_OK);
        read_out(engine, dimension, after);
        sum += mean_square(dimension, after, before);
        for (int a = 0; a < dimension; a++) {
            for (int i = 0; i < N; i++) {
                before[a][i] = after[a][i];
            }
        }
    }
    double per_step = dimension * temperature * dt * law->variance; /* 2 d D dt */
    double step_ratio = sum / steps / per_step;
    double long_ratio = mean_square(dimension, after, start) / (per_step * steps);
    double step_error = sqrt((law->kurtosis - 1.0) / ((double)N * dimension * steps));
    double long_error = sqrt(2.0 / ((double)N * dimension));
    print_message("%dD %s%s: MSD of a step / (2 d D dt) = 1 %+.2e (+- %.1e), after %d steps "
                  "1 %+.2e (+- %.1e)\n",
                  dimension, law->limit_by, law->rescale ? " rescaled" : "", step_ratio - 1.0,
                  step_error, steps, long_ratio - 1.0, long_error);
    assert_true(fabs(step_ratio - 1.0) < 4.0 * step_error);
    assert_true(fabs(long_ratio - 1.0) < 4.0 * long_error);
    gbg_engine_destroy(&engine);
    gbg_context_destroy(&context);
}

static void mean_squared_displacement(void **state)
{
    (void)state;
    static const struct law plain = {"none", 0, 1.0, 3.0, 1};
    displacement_law(2, &plain, 1000); /* 5e8 squares: 6e-5 */
    displacement_law(3, &plain, 60);
}

static void limited_noise(void **state)
{
    (void)state;
    static const struct law laws[] = {{"clamp", 0, 0.9950073, 2.92, 2},
                                      {"redraw", 0, 0.9733369, 2.83, 3},
                                      {"clamp", 1, 1.0, 2.92, 4},
                                      {"redraw", 1, 1.0, 2.83, 5}};
    for (int k = 0; k < 4; k++) {
        displacement_law(2, &laws[k], 60);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mean_squared_displacement),
        cmocka_unit_test(limited_noise),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
