/* Example: Brownian hard discs at area fraction 0.52. By how much do they slow each other down? */
#include <gamboge/gamboge.h>
#include <stdio.h>
#include <stdlib.h>

enum { DISCS = 1024, STEPS = 400 };

/* Every call returns a status; when it is not 0, the message says what is wrong and what to do. */
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
    must(gbg_scene_add_species(scene, "disc", 1.0, 0.0, 1.0, -1.0, DISCS, NULL), context);
    must(gbg_scene_set_real(scene, "box.packing", 0.52), context);
    must(gbg_scene_set_text(scene, "particles.start.lattice", "triangular"), context);
    must(gbg_scene_set_real(scene, "particles.start.jitter", 0.8), context);
    must(gbg_scene_set_text(scene, "excluded_volume.rule", "auto"), context);
    must(gbg_scene_set_real(scene, "dynamics.dt", 0.01), context);
    must(gbg_scene_set_real(scene, "dynamics.temperature", 0.01), context);
    must(gbg_scene_set_integer(scene, "run.seed", 7), context);
    must(gbg_scene_set_text(scene, "output.trajectory.unwrapped", "true"), context);
    return scene;
}

/* Mean squared displacement between two sets of x(2,n): consecutive discs are 2 elements apart. */
static double mean_squared_move(const double *from, const double *to)
{
    double sum = 0.0;
    for (int i = 0; i < 2 * DISCS; i++) {
        sum += (to[i] - from[i]) * (to[i] - from[i]);
    }
    return sum / DISCS;
}

int main(void)
{
    static double first[2 * DISCS], last[2 * DISCS], diameter[DISCS];
    double lengths[2], time;
    int64_t rounds, overlaps;
    char hash[65];
    struct gbg_context *context;
    struct gbg_engine *engine;
    must(gbg_context_create("auto", &context), NULL);
    struct gbg_scene *scene = make_scene(context);
    must(gbg_engine_create(scene, &engine), context);

    must(gbg_engine_positions(engine, 0, DISCS, first, first + 1, NULL, 2), context);
    must(gbg_engine_run(engine, STEPS), context);
    must(gbg_engine_positions(engine, 0, DISCS, last, last + 1, NULL, 2), context);
    must(gbg_engine_real(engine, "time", &time), context);
    must(gbg_engine_integer(engine, "contact_rounds", &rounds), context);
    must(gbg_engine_hash(engine, sizeof hash, hash), context);

    /* The same question to a kernel that knows nothing of the run. */
    for (int i = 0; i < DISCS; i++) {
        diameter[i] = 1.0;
    }
    must(gbg_engine_box(engine, lengths, NULL), context);
    must(gbg_overlaps_find(context, 2, lengths, DISCS, last, last + 1, NULL, 2, diameter, 1e-12, 0,
                           0, NULL, NULL, &overlaps),
         context);

    /* Free discs have D = temperature/2, so that their MSD is 4 D t. */
    printf("discs %d\n", DISCS);
    printf("box_length %.12f\n", lengths[0]);
    printf("contact_rounds_above_0 %d\n", rounds > 0);
    printf("overlaps_found %d\n", (int)overlaps);
    printf("msd_over_free %.9f\n", mean_squared_move(first, last) / (4.0 * 0.005 * time));
    printf("hash %s\n", hash);

    gbg_engine_destroy(&engine);
    gbg_scene_destroy(&scene);
    gbg_context_destroy(&context);
    return 0;
}
