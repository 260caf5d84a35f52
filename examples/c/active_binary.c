/* Example: a binary mixture of chemically active particles that pair up. A makes a substance that B
 * consumes; each moves in the other's field, F_i = mobility_i sum_k alpha_k r_ik/|r_ik|^3, so that
 * like particles part and unlike ones meet. Action is not reaction: a bound pair swims. */
#include <gamboge/gamboge.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { PARTICLES = 512, STEPS = 300 };

static void must(int status, const struct gbg_context *context)
{
    if (status != GBG_OK) {
        fprintf(stderr, "%s: %s\n", gbg_status_name(status), gbg_message(context));
        exit(1);
    }
}

static struct gbg_scene *make_scene(struct gbg_context *context)
{
    struct gbg_scene *scene;
    must(gbg_scene_create(context, 2, &scene), context);
    must(gbg_scene_set_integer(scene, "particles.count", PARTICLES), context);
    must(gbg_scene_add_species(scene, "A", 1.0, 1.0, 1.0, 0.5, -1, NULL), context);
    must(gbg_scene_add_species(scene, "B", 1.0, -1.0, -2.0, 0.5, -1, NULL), context);
    must(gbg_scene_add_force(scene, 2.0, "minimum_image", 0.0, 0.0), context);
    must(gbg_scene_set_real(scene, "box.packing", 0.52), context);
    must(gbg_scene_set_text(scene, "particles.start.lattice", "triangular"), context);
    must(gbg_scene_set_real(scene, "particles.start.jitter", 0.5), context);
    must(gbg_scene_set_text(scene, "excluded_volume.rule", "auto"), context);
    must(gbg_scene_set_real(scene, "dynamics.dt", 0.01), context);
    must(gbg_scene_set_real(scene, "dynamics.temperature", 0.01), context);
    must(gbg_scene_set_integer(scene, "run.seed", 11), context);
    return scene;
}

/* Mean distance from the surface of an A to that of the nearest B. */
static double mean_gap(const double *x, const int32_t *species, const double *lengths)
{
    double sum = 0.0;
    int count = 0;
    for (int i = 0; i < PARTICLES; i++) {
        double nearest = INFINITY;
        for (int k = 0; species[i] == 0 && k < PARTICLES; k++) {
            double dx = x[2 * i] - x[2 * k], dy = x[2 * i + 1] - x[2 * k + 1];
            dx -= lengths[0] * rint(dx / lengths[0]);
            dy -= lengths[1] * rint(dy / lengths[1]);
            nearest = species[k] == 1 ? fmin(nearest, hypot(dx, dy)) : nearest;
        }
        if (species[i] == 0) {
            sum += nearest - 1.0;
            count++;
        }
    }
    return sum / count;
}

int main(void)
{
    static double x[2 * PARTICLES], f[2 * PARTICLES];
    static int32_t species[PARTICLES];
    double lengths[2], sum[2] = {0.0, 0.0}, error, relative;
    char hash[65];
    struct gbg_context *context;
    struct gbg_engine *engine;
    must(gbg_context_create("auto", &context), NULL);
    struct gbg_scene *scene = make_scene(context);
    must(gbg_engine_create(scene, &engine), context);
    must(gbg_engine_species(engine, PARTICLES, species, 0), context);
    must(gbg_engine_box(engine, lengths, NULL), context);

    must(gbg_engine_positions(engine, 1, PARTICLES, x, x + 1, NULL, 2), context);
    printf("particles %d\n", PARTICLES);
    printf("gap_at_start %.9f\n", mean_gap(x, species, lengths));
    must(gbg_engine_run(engine, STEPS), context);
    must(gbg_engine_positions(engine, 1, PARTICLES, x, x + 1, NULL, 2), context);
    printf("gap_at_end %.9f\n", mean_gap(x, species, lengths));

    /* The sum of all forces is not 0; the library measures the error of the forces itself. */
    must(gbg_engine_forces(engine, PARTICLES, f, f + 1, NULL, 2), context);
    for (int i = 0; i < PARTICLES; i++) {
        sum[0] += f[2 * i];
        sum[1] += f[2 * i + 1];
    }
    must(gbg_engine_force_error(engine, 0, &error, &relative), context);
    must(gbg_engine_hash(engine, sizeof hash, hash), context);
    printf("sum_of_forces %.6f\n", hypot(sum[0], sum[1]));
    printf("force_error_below_1e-5 %d\n", error < 1e-5);
    printf("hash %s\n", hash);

    gbg_engine_destroy(&engine);
    gbg_scene_destroy(&scene);
    gbg_context_destroy(&context);
    return 0;
}
