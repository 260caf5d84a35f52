/* Clusters that forces of long range press together: their gaps must not depend on dt, whatever the
 * number of layers. */
#include "gates.h"

enum { SIDE = 56, MOST = SIDE * SIDE };

struct cluster {
    double radius, spacing; /* of the start: a round piece of a triangular lattice */
    double from, every;     /* times */
};

static const struct cluster small = {9.5, 1.03, 1.0, 0.1}, large = {19.0, 1.01, 0.5, 0.1};

/* Returns the number of discs. */
static int64_t place(const struct cluster *cluster, double *x, double *y)
{
    double spacing = cluster->spacing, radius = cluster->radius, edge = 6.3 * radius;
    int64_t n = 0;
    for (int row = -SIDE / 2; row < SIDE / 2; row++) {
        for (int column = -SIDE / 2; column < SIDE / 2; column++) {
            double a = spacing * (column + 0.5 * (row & 1)), b = spacing * sqrt(0.75) * row;
            if (hypot(a, b) < radius) {
                x[n] = 0.5 * edge + a;
                y[n++] = 0.5 * edge + b;
            }
        }
    }
    return n;
}

static struct gbg_engine *make(struct gbg_context *context, const struct cluster *cluster,
                               double dt)
{
    static double x[MOST], y[MOST];
    static int32_t species[MOST];
    const double lengths[2] = {6.3 * cluster->radius, 6.3 * cluster->radius};
    int64_t n = place(cluster, x, y);
    int index;
    struct gbg_scene *scene;
    struct gbg_engine *engine;
    done(context, gbg_scene_create(context, 2, &scene));
    done(context, gbg_scene_set_box(scene, lengths, NULL));
    done(context, gbg_scene_add_species(scene, "A", 1.0, 1.0, -2.0, -1.0, -1, &index));
    done(context, gbg_scene_add_force(scene, 2.0, "minimum_image", 0.0, 0.0));
    done(context, gbg_scene_set_text(scene, "excluded_volume.rule", "bridge"));
    done(context, gbg_scene_set_real(scene, "dynamics.dt", dt));
    done(context, gbg_scene_set_real(scene, "dynamics.temperature", 0.01));
    done(context, gbg_scene_set_integer(scene, "run.seed", 5));
    done(context, gbg_scene_add_particles(scene, n, x, y, NULL, 1, species, 0, NULL));
    done(context, gbg_engine_create(scene, &engine));
    gbg_scene_destroy(&scene);
    return engine;
}

/* Mean gap of neighbours nearer than a gap of 0.25. */
static double mean_gap(struct gbg_context *context, struct gbg_engine *engine)
{
    static double x[MOST], y[MOST];
    int64_t n, pairs = 0;
    double sum = 0.0;
    done(context, gbg_engine_size(engine, &n, NULL));
    done(context, gbg_engine_positions(engine, 1, n, x, y, NULL, 1));
    for (int64_t i = 0; i < n; i++) {
        for (int64_t j = 0; j < i; j++) {
            double gap = hypot(x[i] - x[j], y[i] - y[j]) - 1.0;
            if (gap < 0.25) {
                sum += gap;
                pairs++;
            }
        }
    }
    return sum / (double)pairs;
}

/* Mean over ten times. */
static struct gbg_estimate gap_at(struct gbg_context *context, const struct cluster *cluster,
                                  double dt)
{
    enum { TIMES = 10 };
    double gap[TIMES];
    int64_t n, solves, pushes, parted;
    struct gbg_engine *engine = make(context, cluster, dt);
    done(context, gbg_engine_run(engine, lrint(cluster->from / dt)));
    for (int k = 0; k < TIMES; k++) {
        done(context, gbg_engine_run(engine, lrint(cluster->every / dt)));
        gap[k] = mean_gap(context, engine);
    }
    struct gbg_estimate mean = gbg_estimate_mean(TIMES, gap);
    done(context, gbg_engine_size(engine, &n, NULL));
    done(context, gbg_engine_integer(engine, "unsettled", &solves));
    done(context, gbg_engine_integer(engine, "unsettled_pairs", &parted));
    done(context, gbg_engine_integer(engine, "contact_pairs", &pushes));
    print_message("%lld discs, dt %g: mean gap %.3e +- %.0e; %lld solves at their limit of rounds "
                  "left %.2f %% of all pushes\n",
                  (long long)n, dt, mean.mean, mean.error, (long long)solves,
                  100.0 * (double)parted / (double)pushes);
    gbg_engine_destroy(&engine);
    return mean;
}

/* The rule claims its own limit of small steps at any step; a twentieth is what ten times can tell
 * from it. */
static int compare(struct gbg_context *context, const struct cluster *cluster, int steps,
                   const double *dt)
{
    struct gbg_estimate fine = gap_at(context, cluster, dt[0]);
    int right = 1;
    for (int k = 1; k < steps; k++) {
        char what[40];
        snprintf(what, sizeof what, "dt = %g", dt[k]);
        right &= gate(what, gap_at(context, cluster, dt[k]), fine.mean, 0.05 * fine.mean);
    }
    return right;
}

static void gap_does_not_depend_on_dt(void **state)
{
    (void)state;
    struct gbg_context *context = opened_context();
    const double dt[3] = {0.0005, 0.002, 0.01};
    assert_true(compare(context, &small, 3, dt));
    gbg_context_destroy(&context);
}

static void nor_on_the_layers(void **state)
{
    (void)state;
    struct gbg_context *context = opened_context();
    const double dt[2] = {0.001, 0.01};
    assert_true(compare(context, &large, 2, dt));
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(gap_does_not_depend_on_dt),
                                       cmocka_unit_test(nor_on_the_layers)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
