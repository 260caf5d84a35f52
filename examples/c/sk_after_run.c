/* Example: the structure factor of hard discs, from frames that are taken while they run. */
#include <gamboge/gamboge.h>
#include <stdio.h>
#include <stdlib.h>

enum { DISCS = 256, FRAMES = 100, STEPS_BETWEEN = 50, SHELLS_SHOWN = 8 };

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
    must(gbg_scene_set_real(scene, "box.packing", 0.4), context);
    must(gbg_scene_set_text(scene, "particles.start.random", "insertion"), context);
    must(gbg_scene_set_text(scene, "excluded_volume.rule", "auto"), context);
    must(gbg_scene_set_real(scene, "dynamics.dt", 0.004), context);
    must(gbg_scene_set_real(scene, "dynamics.temperature", 1.0), context);
    must(gbg_scene_set_integer(scene, "run.seed", 3), context);
    return scene;
}

/* Shells of k: mean of |k|, S(k), its statistical error, and a hard bound of the numerical one. */
static void print_shells(struct gbg_analysis *analysis, struct gbg_context *context)
{
    static const char *const quantities[] = {"k", "S", "S_stderr", "S_numerr"};
    int64_t shells, frames;
    must(gbg_analysis_size(analysis, &shells, &frames), context);
    double *values = malloc((size_t)shells * sizeof *values);
    printf("frames %d\n", (int)frames);
    for (int q = 0; q < 4; q++) {
        must(gbg_analysis_get(analysis, quantities[q], shells, values), context);
        for (int s = 0; s < SHELLS_SHOWN && q < 3; s++) {
            printf("%s_%d %.9f\n", quantities[q], s + 1, values[s]);
        }
    }
    printf("numerical_error_below_1e-6 %d\n", values[0] < 1e-6);
    free(values);
}

int main(void)
{
    static double x[2 * DISCS];
    double lengths[2];
    struct gbg_context *context;
    struct gbg_engine *engine;
    struct gbg_analysis *analysis;
    must(gbg_context_create("cpu:threads=1", &context), NULL); /* so few discs are not worth more */
    struct gbg_scene *scene = make_scene(context);
    must(gbg_engine_create(scene, &engine), context);
    must(gbg_engine_box(engine, lengths, NULL), context);

    must(gbg_analysis_create(context, 2, lengths, 1, &analysis), context);
    must(gbg_analysis_set_real(analysis, "k_max", 8.0), context);
    must(gbg_analysis_set_real(analysis, "tolerance", 1e-8), context);
    must(gbg_engine_run(engine, 20 * STEPS_BETWEEN), context); /* from the random start to rest */
    for (int frame = 0; frame < FRAMES; frame++) {
        must(gbg_engine_run(engine, STEPS_BETWEEN), context);
        must(gbg_engine_positions(engine, 1, DISCS, x, x + 1, NULL, 2), context);
        must(gbg_analysis_add_frame(analysis, DISCS, x, x + 1, NULL, 2, NULL, 0, NULL, 0.0),
             context);
    }
    print_shells(analysis, context);

    gbg_analysis_destroy(&analysis);
    gbg_engine_destroy(&engine);
    gbg_scene_destroy(&scene);
    gbg_context_destroy(&context);
    return 0;
}
