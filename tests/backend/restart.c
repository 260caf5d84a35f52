/* Tests of runs that change between the CPU and a GPU: half on one, saved, gone on with on the
 * other, they end in the state of a run on either, bit for bit. */
#include <unistd.h>

#include "both.h"
#include "gamboge/engine.h"

enum { HALF = 60 };

static struct made_particles made;
static char path[] = "/tmp/gbg_restart_XXXXXX/r.restart", previous[80];

static void good(struct gbg_engine *engine, int status)
{
    if (status != GBG_OK) {
        fail_msg("%s: %s", gbg_status_name(status), gbg_message(engine->context));
    }
}

struct run {
    const char *what;
    int dimension, rule, n_species, m;
    double spacing, power, dt;
};

static const struct run runs[] = {
    {"free particles", 2, GBG_RULE_NONE, 1, 40, 1.2, 0, 0.01},
    {"hard discs, event", 2, GBG_RULE_EVENT, 1, 40, 1.23, 0, 0.01},
    {"active discs, bounce", 2, GBG_RULE_BOUNCE, 2, 50, 1.1, 6, 0.01},
    {"active discs, bridge", 2, GBG_RULE_BRIDGE, 2, 50, 1.1, 6, 0.01},
    {"active spheres", 3, GBG_RULE_BOUNCE, 2, 12, 1.1, 6, 0.01},
};

static struct gbg_scene scene_of(const struct run *run)
{
    double length[3];
    for (int a = 0; a < 3; a++) {
        length[a] = run->spacing * run->m * (a == 1 ? 1.02 : 1.0);
    }
    struct gbg_scene scene = made_scene(NULL, run->dimension, length);
    scene.rule = run->rule;
    scene.dt = run->dt;
    scene.unwrapped = 1;
    scene.n_species = run->n_species;
    if (run->power > 0.0) {
        scene.n_forces = 1;
        scene.force[0] =
            (struct gbg_force){.power = run->power, .sum = GBG_SUM_CUTOFF, .cutoff = 2.5};
    }
    made_lattice(&made, &scene, run->m, 0.01);
    for (int64_t i = 0; run->n_species == 1 && i < made.p.n; i++) {
        made.species[i] = 0;
    }
    return scene;
}

static void same_images(struct gbg_engine *p, struct gbg_engine *q)
{
    static int32_t image[2][5000];
    for (int a = 0; a < p->state.box.dimension; a++) {
        good(p, gbg_engine_copy_images(p, a, image[0]));
        good(q, gbg_engine_copy_images(q, a, image[1]));
        assert_memory_equal(image[0], image[1], (size_t)p->state.owned * sizeof **image);
    }
}

/* From one backend to another: `from` makes the first half, a fresh engine of `to` the second. */
static void go_over(const struct run *run, int from, int to, char text[65], struct both *whole)
{
    struct both first = both_make(scene_of(run), &made), second = both_make(scene_of(run), &made);
    struct gbg_engine *one = first.engine[from], *other = second.engine[to];
    good(one, gbg_engine_advance(one, HALF));
    good(one, gbg_engine_save(one, path));
    good(other, gbg_engine_load(other, path));
    assert_int_equal(other->step, HALF);
    good(other, gbg_engine_advance(other, HALF));
    good(other, gbg_engine_digest(other, text));
    both_free(&first);
    same_images(whole->engine[to], other); /* the digest leaves them out */
    both_free(&second);
    unlink(path);
    unlink(previous);
}

static void halves_make_a_whole(void **state)
{
    (void)state;
    for (size_t k = 0; k < sizeof runs / sizeof *runs; k++) {
        if (!both_takes((int)k)) {
            continue;
        }
        struct both whole = both_make(scene_of(&runs[k]), &made);
        char text[2][65], halves[65];
        for (int b = 0; b < 2; b++) {
            good(whole.engine[b], gbg_engine_advance(whole.engine[b], 2 * HALF));
            good(whole.engine[b], gbg_engine_digest(whole.engine[b], text[b]));
        }
        assert_string_equal(text[0], text[1]);
        for (int way = 0; way < 4; way++) {
            go_over(&runs[k], way & 1, way >> 1, halves, &whole);
            assert_string_equal(halves, text[0]);
        }
        print_message("%s: %s\n", runs[k].what, text[0]);
        both_free(&whole);
    }
}

static int start(void **state)
{
    (void)state;
    char *slash = strrchr(path, '/');
    *slash = 0;
    char *made_folder = mkdtemp(path);
    *slash = '/';
    snprintf(previous, sizeof previous, "%s.previous", path);
    return made_folder ? 0 : -1;
}

static int stop(void **state)
{
    (void)state;
    *strrchr(path, '/') = 0;
    return rmdir(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(halves_make_a_whole),
    };
    return both_missing() ? BOTH_SKIPPED : cmocka_run_group_tests(tests, start, stop);
}
