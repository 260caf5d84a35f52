/* The same bits (A7): the hash of the state after STEPS steps of 1024 discs for 1, 2 and 5 threads,
 * particles in another order, and a restart half way, for every contact rule.
 *
 * usage: same_bits STEPS. Scenes: packing 0.79 with the forces of C3 (short range), and passive
 * discs of packing 0.7. */
#include <unistd.h>

#include "gates.h"

enum { N = 1024 };
static int64_t steps;
static double x[N], y[N];
static int32_t species[N];
static int64_t ids[N];

struct variant {
    const char *context;
    int reversed, restart;
};
static const struct variant variants[] = {
    {"cpu:threads=1", 0, 0}, {"cpu:threads=2", 0, 0}, {"cpu:threads=5", 0, 0},
    {"cpu:threads=2", 1, 0}, {"cpu:threads=1", 0, 1},
};
enum { VARIANTS = sizeof variants / sizeof *variants };

/* The scene from arrays; an order is a matter of which end they are read from. */
static struct gbg_engine *made(struct gbg_context *context, const char *rule, int active,
                               double edge, int reversed)
{
    struct gbg_scene *scene;
    struct gbg_engine *engine = NULL;
    double lengths[2] = {edge, edge};
    int index, last = reversed ? N - 1 : 0, way = reversed ? -1 : 1;
    static int32_t kind[N];
    static int64_t name[N];
    for (int i = 0; i < N; i++) {
        kind[i] = species[last + way * i];
        name[i] = ids[last + way * i];
    }
    done(context, gbg_scene_create(context, 2, &scene));
    done(context, gbg_scene_set_box(scene, lengths, NULL));
    done(context, gbg_scene_add_species(scene, "A", 1.0, -1.0, 1.0, -1.0, -1, &index));
    done(context, gbg_scene_add_species(scene, "B", 1.0, 1.0, -2.0, -1.0, -1, &index));
    if (active) {
        done(context, gbg_scene_add_force(scene, 6.0, "cutoff", 2.5, 0.0));
    }
    done(context, gbg_scene_set_text(scene, "excluded_volume.rule", rule));
    done(context, gbg_scene_set_real(scene, "dynamics.dt", 0.01));
    done(context, gbg_scene_set_real(scene, "dynamics.temperature", active ? 0.01 : 0.09));
    done(context, gbg_scene_set_integer(scene, "run.seed", 31));
    done(context, gbg_scene_add_particles(scene, N, x + last, y + last, NULL, way, kind, 0, name));
    done(context, gbg_engine_create(scene, &engine));
    gbg_scene_destroy(&scene);
    return engine;
}

static void hash_of(const struct variant *variant, const char *rule, int active, double edge,
                    char text[65])
{
    struct gbg_context *context;
    assert_int_equal(gbg_context_create(variant->context, &context), GBG_OK);
    struct gbg_engine *engine = made(context, rule, active, edge, variant->reversed);
    int64_t before = variant->restart ? steps / 2 + 7 : 0;
    if (before) {
        char path[64];
        snprintf(path, sizeof path, "same_bits_%ld.restart", (long)getpid());
        done(context, gbg_engine_run(engine, before));
        done(context, gbg_engine_save(engine, path));
        gbg_engine_destroy(&engine);
        engine = made(context, rule, active, edge, 0);
        done(context, gbg_engine_load(engine, path));
        unlink(path);
    }
    done(context, gbg_engine_run(engine, steps - before));
    done(context, gbg_engine_hash(engine, 65, text));
    gbg_engine_destroy(&engine);
    gbg_context_destroy(&context);
}

/* One start for all rules of a scene. */
static double prepare(struct gbg_context *context, int active)
{
    double edge;
    done(context, gbg_discs_equilibrium(context, active ? 0.74 : 0.7, N, 8, x, y, &edge));
    for (int i = 0; i < N; i++) {
        species[i] = (i * 7 / 3) % 2;
        ids[i] = 3 * ((i * 389) % N); /* ids in no order of space or of the arrays */
    }
    return edge;
}

static void compare(struct gbg_context *context, const char *rule, int active, double edge)
{
    char expected[65], text[65];
    for (int k = 0; k < VARIANTS; k++) {
        hash_of(&variants[k], rule, active, edge, text);
        if (k == 0) {
            strcpy(expected, text);
            print_message("%s, %s, %lld steps: %s\n", rule, active ? "C3" : "passive",
                          (long long)steps, text);
        }
        assert_string_equal(text, expected);
    }
}

static void passive(void **state)
{
    (void)state;
    static const char *const rules[] = {"event", "bridge", "bounce", "contact", "carter"};
    struct gbg_context *context = opened_context();
    double edge = prepare(context, 0);
    for (int k = 0; k < 5; k++) {
        compare(context, rules[k], 0, edge);
    }
    gbg_context_destroy(&context);
}

static void active(void **state)
{
    (void)state;
    static const char *const rules[] = {"bridge", "bounce", "event"};
    struct gbg_context *context = opened_context();
    double edge = prepare(context, 1);
    for (int k = 0; k < 3; k++) {
        compare(context, rules[k], 1, edge);
    }
    gbg_context_destroy(&context);
}

int main(int argc, char **argv)
{
    steps = argc == 2 ? atoll(argv[1]) : 0;
    if (steps < 100) {
        fprintf(stderr, "usage: %s STEPS (from 100)\n", argv[0]);
        return 2;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(passive),
        cmocka_unit_test(active),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
