/* Tests of examples/scenes: each file is read, holds what its name says, and starts without
 * overlap. */
#include <dirent.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "scene/scene.h"

static struct gbg_context *context;

static int make_context(void **state)
{
    (void)state;
    return gbg_context_create("cpu", &context);
}

static int drop_context(void **state)
{
    (void)state;
    return gbg_context_destroy(&context);
}

static struct gbg_scene *scene_of(const char *name)
{
    char path[1024];
    struct gbg_scene *scene;
    snprintf(path, sizeof path, "%s/%s", GBG_SCENES, name);
    int status = gbg_scene_read(context, path, &scene);
    if (status == GBG_OK) {
        status = gbg_scene_resolve(scene);
    }
    if (status != GBG_OK) {
        fail_msg("%s", gbg_message(context));
    }
    return scene;
}

/* Carter (2016), table 5.1: fraction, source and mobility of both species, area fraction. */
static void carter_scenes_hold_table_5_1(void **state)
{
    (void)state;
    static const double table[5][7] = {{0.7, 1, 1, 0.3, 1, -1, 0.79},
                                       {0.5, 1, 1, 0.5, 1, -1, 0.52},
                                       {0.5, 1, 1, 0.5, -1, -2, 0.52},
                                       {0.5, -1, 1, 0.5, 1, -2, 0.79},
                                       {0.5, 1, 1, 0.5, -1, -4, 0.0873}};
    for (int c = 0; c < 10; c++) {
        char name[64];
        const double *row = table[c / 2];
        snprintf(name, sizeof name, "carter_c%d_%s.yaml", c / 2, c % 2 ? "short" : "long");
        struct gbg_scene *scene = scene_of(name);
        for (int s = 0; s < 2; s++) {
            assert_true(scene->species[s].fraction == row[3 * s]);
            assert_true(scene->species[s].alpha == row[3 * s + 1]);
            assert_true(scene->species[s].mobility == row[3 * s + 2]);
            assert_true(scene->species[s].diameter == 1);
        }
        assert_true(fabs(gbg_scene_packing(scene) - row[6]) < 1e-12);
        assert_int_equal(scene->n, 4096);
        assert_int_equal(scene->n_forces, 1);
        assert_true(scene->force[0].power == (c % 2 ? 6 : 2));
        assert_true(scene->force[0].cutoff == (c % 2 ? 2.5 : 0));
        assert_true(scene->dt == 0.01 && scene->temperature == 0.01 && scene->noise_limit == 3);
        assert_int_equal(scene->limit_by, GBG_LIMIT_CLAMP);
        assert_int_equal(scene->rule, GBG_RULE_BRIDGE);
        gbg_scene_destroy(&scene);
    }
}

static void check_no_overlap(const struct gbg_scene *scene, const struct gbg_particles *particles)
{
    for (int64_t i = 0; i < particles->n; i++) {
        for (int64_t j = 0; j < i; j++) {
            double square = 0;
            for (int a = 0; a < scene->dimension; a++) {
                double d = particles->position[a][i] - particles->position[a][j];
                d -= scene->length[a] * nearbyint(d / scene->length[a]);
                square += d * d;
            }
            assert_true(square >= 1);
        }
    }
}

static void every_scene_starts(void **state)
{
    (void)state;
    int files = 0;
    DIR *folder = opendir(GBG_SCENES);
    assert_non_null(folder);
    for (struct dirent *entry; (entry = readdir(folder));) {
        struct gbg_particles particles;
        if (!strstr(entry->d_name, ".yaml")) {
            continue;
        }
        struct gbg_scene *scene = scene_of(entry->d_name);
        assert_int_equal(gbg_scene_start(scene, &particles), GBG_OK);
        assert_int_equal(particles.n, scene->n);
        if (scene->rule != GBG_RULE_NONE) {
            check_no_overlap(scene, &particles);
        }
        gbg_particles_release(&particles);
        gbg_scene_destroy(&scene);
        files++;
    }
    closedir(folder);
    assert_true(files >= 13);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(carter_scenes_hold_table_5_1),
        cmocka_unit_test(every_scene_starts),
    };
    return cmocka_run_group_tests(tests, make_context, drop_context);
}
