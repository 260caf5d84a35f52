/* A client of the package: a refusal with its message, then one step of two discs and their S(k). */
#include <gamboge/gamboge.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Prints the sentence of a call that failed and returns 1. */
static int failed(const struct gbg_context *context, int status)
{
    if (status == GBG_OK) {
        return 0;
    }
    printf("%s: %s\n", gbg_status_name(status), gbg_message(context));
    return 1;
}

/* One particle anywhere has S(k) = 1 in every shell. */
static int structure_factor_of_one(struct gbg_context *context)
{
    const double length[2] = {10.0, 8.0}, x = 3.7, y = 0.2;
    struct gbg_analysis *analysis = NULL;
    int64_t shells = 0;
    double s[4096];
    int bad = failed(context, gbg_analysis_create(context, 2, length, 1, &analysis)) ||
              failed(context, gbg_analysis_set_real(analysis, "k_max", 5.0)) ||
              failed(context, gbg_analysis_set_text(analysis, "method", "direct")) ||
              failed(context,
                     gbg_analysis_add_frame(analysis, 1, &x, &y, NULL, 1, NULL, 0, NULL, 0.0)) ||
              failed(context, gbg_analysis_size(analysis, &shells, NULL)) ||
              failed(context, gbg_analysis_get(analysis, "S", 4096, s));
    for (int64_t k = 0; !bad && k < shells; k++) {
        bad = !(fabs(s[k] - 1.0) < 1e-12);
    }
    gbg_analysis_destroy(&analysis);
    return bad || shells == 0;
}

/* Two discs with unlike sources drift as the formula says. */
static int step_of_two(struct gbg_context *context)
{
    const double length[2] = {100.0, 100.0}, x[2] = {40.0, 44.0}, y[2] = {50.0, 50.0};
    struct gbg_scene *scene = NULL;
    struct gbg_engine *engine = NULL;
    double fx[2], fy[2];
    int bad = failed(context, gbg_scene_create(context, 2, &scene)) ||
              failed(context, gbg_scene_set_box(scene, length, NULL)) ||
              failed(context, gbg_scene_add_species(scene, "A", 1.0, 2.0, 3.0, -1.0, -1, NULL)) ||
              failed(context, gbg_scene_add_force(scene, 2.0, "minimum_image", 0.0, 0.0)) ||
              failed(context, gbg_scene_add_particles(scene, 2, x, y, NULL, 1, NULL, 0, NULL)) ||
              failed(context, gbg_engine_create(scene, &engine)) ||
              failed(context, gbg_engine_forces(engine, 2, fx, fy, NULL, 1)) ||
              !(fabs(fx[0] + 3.0 * 2.0 / 16.0) < 1e-6) || !(fabs(fy[0]) < 1e-6);
    gbg_engine_destroy(&engine);
    gbg_scene_destroy(&scene);
    return bad;
}

int main(void)
{
    struct gbg_context *context = NULL;
    if (gbg_context_create("abacus", &context) != GBG_E_NAME || !strstr(gbg_message(NULL), "abacus")) {
        puts("an unknown backend was not refused");
        return 1;
    }
    if (failed(NULL, gbg_context_create("cpu:threads=1", &context))) {
        return 1;
    }
    int bad = step_of_two(context) + structure_factor_of_one(context);
    gbg_context_destroy(&context);
    printf("%s (headers %s): %s\n", gbg_version_text(), GBG_VERSION, bad ? "wrong" : "right");
    return bad;
}
