/* The five suspensions of Carter 2016: no overlap after any step, by a check of its own. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "gamboge/gamboge.h"

enum { MOST = 4096, CELLS = 64 };
static double x[MOST], y[MOST];
static int head[CELLS][CELLS], next[MOST];

/* Smallest distance in a square box of edge >= CELLS discs of diameter 1: linked cells. */
static double smallest_distance(int n, double edge)
{
    int cells = (int)floor(edge) < CELLS ? (int)floor(edge) : CELLS;
    double least = INFINITY;
    for (int c = 0; c < CELLS * CELLS; c++) {
        head[c / CELLS][c % CELLS] = -1;
    }
    for (int i = 0; i < n; i++) {
        int cx = (int)(x[i] / edge * cells) % cells, cy = (int)(y[i] / edge * cells) % cells;
        for (int dx = -1; dx <= 1; dx++) {
            for (int dy = -1; dy <= 1; dy++) {
                int j = head[(cx + dx + cells) % cells][(cy + dy + cells) % cells];
                for (; j >= 0; j = next[j]) {
                    double rx = x[i] - x[j], ry = y[i] - y[j];
                    rx -= edge * rint(rx / edge);
                    ry -= edge * rint(ry / edge);
                    least = fmin(least, hypot(rx, ry));
                }
            }
        }
        /* particles already in the grid have been compared with all later ones */
        next[i] = head[cx][cy];
        head[cx][cy] = i;
    }
    return least;
}

static void run(const char *directory, int configuration, const char *range, int steps)
{
    struct gbg_context *context;
    struct gbg_scene *scene;
    struct gbg_engine *engine;
    char path[1024];
    snprintf(path, sizeof path, "%s/carter_c%d_%s.yaml", directory, configuration, range);
    assert_int_equal(gbg_context_create("cpu:threads=2", &context), GBG_OK);
    if (gbg_scene_read(context, path, &scene) || gbg_engine_create(scene, &engine)) {
        fail_msg("%s", gbg_message(context));
    }
    int64_t n, rounds;
    double lengths[2], least = INFINITY;
    gbg_engine_size(engine, &n, NULL);
    gbg_engine_box(engine, lengths, NULL);
    assert_true(n <= MOST && lengths[0] == lengths[1]);
    for (int k = 0; k < steps; k++) {
        if (gbg_engine_run(engine, 1)) {
            fail_msg("%s: %s", path, gbg_message(context));
        }
        gbg_engine_positions(engine, 1, n, x, y, NULL, 1);
        least = fmin(least, smallest_distance((int)n, lengths[0]));
    }
    gbg_engine_integer(engine, "contact_rounds", &rounds);
    double reverted;
    gbg_engine_real(engine, "reverted_fraction", &reverted);
    print_message("c%d %s: %d steps, %.2f rounds a step, smallest distance 1 %+.1e, %.1e of all "
                  "moves put back\n",
                  configuration, range, steps, (double)rounds / steps, least - 1.0, reverted);
    assert_true(reverted <= 1e-6);
    assert_true(least >= 1.0 - 1e-12 - 4.0 * lengths[0] * 1.2e-16);
    gbg_engine_destroy(&engine);
    gbg_scene_destroy(&scene);
    gbg_context_destroy(&context);
}

static const char *scenes;

static void short_range(void **state)
{
    (void)state;
    for (int c = 0; c < 5; c++) {
        run(scenes, c, "short", 400);
    }
}

static void long_range(void **state)
{
    (void)state;
    for (int c = 0; c < 5; c++) {
        run(scenes, c, "long", 50);
    }
}

int main(int argc, char **argv)
{
    if (argc != 2) {
        fprintf(stderr, "usage: %s DIRECTORY-OF-SCENES\n", argv[0]);
        return 2;
    }
    scenes = argv[1];
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(short_range),
        cmocka_unit_test(long_range),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
