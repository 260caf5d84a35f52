/* Tests of scenes made by calls: options, refusals, counts, boxes, digests, arrays. */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "core/memory.h"
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

/* The status expected, and a message that holds this text. */
static void expect(int status, int expected, const char *says)
{
    if (status != expected || !strstr(gbg_message(context), says)) {
        fail_msg("%s: %s; expected %s: %s", gbg_status_name(status), gbg_message(context),
                 gbg_status_name(expected), says);
    }
}

/* Ten discs of one species in a box of 20 x 10, started at random. */
static struct gbg_scene *small_scene(void)
{
    struct gbg_scene *scene;
    const double length[] = {20, 10};
    assert_int_equal(gbg_scene_create(context, 2, &scene), GBG_OK);
    assert_int_equal(gbg_scene_set_box(scene, length, NULL), GBG_OK);
    assert_int_equal(gbg_scene_add_species(scene, "A", 1, 1, 1, -1, 10, NULL), GBG_OK);
    assert_int_equal(gbg_scene_set_text(scene, "particles.start.random", "insertion"), GBG_OK);
    assert_int_equal(gbg_scene_check(scene), GBG_OK);
    return scene;
}

static void options_keep_their_values(void **state)
{
    (void)state;
    struct gbg_scene *scene = small_scene();
    double real;
    int64_t integer;
    char text[64];
    assert_int_equal(gbg_scene_set_real(scene, "dynamics.dt", 0.1), GBG_OK);
    assert_int_equal(gbg_scene_get_real(scene, "dynamics.dt", &real), GBG_OK);
    assert_true(real == 0.1);
    gbg_scene_get_text(scene, "dynamics.dt", sizeof text, text);
    assert_string_equal(text, "0.1");
    gbg_scene_get_text(scene, "dynamics.kind", sizeof text, text);
    assert_string_equal(text, "brownian");
    assert_int_equal(gbg_scene_set_integer(scene, "dynamics.temperature", 2), GBG_OK);
    assert_int_equal(gbg_scene_get_real(scene, "dynamics.temperature", &real), GBG_OK);
    assert_true(real == 2);
    assert_int_equal(gbg_scene_set_integer(scene, "run.seed", 4294967295), GBG_OK);
    assert_int_equal(gbg_scene_get_integer(scene, "run.seed", &integer), GBG_OK);
    assert_int_equal(integer, 4294967295);
    assert_int_equal(gbg_scene_set_integer(scene, "output.trajectory.unwrapped", 1), GBG_OK);
    gbg_scene_get_text(scene, "output.trajectory.unwrapped", sizeof text, text);
    assert_string_equal(text, "true");
    assert_int_equal(gbg_scene_set_text(scene, "output.trajectory.unwrapped", "false"), GBG_OK);
    gbg_scene_get_integer(scene, "output.trajectory.unwrapped", &integer);
    assert_int_equal(integer, 0);
    gbg_scene_get_text(scene, "particles.start.random", sizeof text, text);
    assert_string_equal(text, "insertion");
    expect(gbg_scene_get_text(scene, "particles.start.random", 4, text), GBG_E_SPACE, "4 bytes");
    gbg_scene_destroy(&scene);
}

static void wrong_options_are_refused(void **state)
{
    (void)state;
    struct gbg_scene *scene = small_scene();
    double real = 1;
    int64_t integer = 1;
    char text[1100], before[65], after[65];
    gbg_scene_digest(scene, before);
    expect(gbg_scene_set_real(scene, "dynamics.tempurature", 1), GBG_E_NAME,
           "nearest is \"dynamics.temperature\"");
    expect(gbg_scene_set_real(scene, "seed", 1), GBG_E_NAME, "nearest is");
    expect(gbg_scene_set_real(scene, "dynamics.dt", 0), GBG_E_ARGUMENT, "0 given, allowed (0, ");
    expect(gbg_scene_set_real(scene, "dynamics.dt", -1), GBG_E_ARGUMENT,
           "gbg_scene_set_real: dynamics.dt: -1 given");
    expect(gbg_scene_set_real(scene, "dynamics.dt", NAN), GBG_E_ARGUMENT, "nan given");
    expect(gbg_scene_set_real(scene, "dynamics.dt", INFINITY), GBG_E_ARGUMENT, "inf given");
    expect(gbg_scene_set_real(scene, "dynamics.temperature", -DBL_MIN), GBG_E_ARGUMENT, "given");
    expect(gbg_scene_set_real(scene, "run.steps", 1), GBG_E_ARGUMENT, "is an integer");
    expect(gbg_scene_set_integer(scene, "run.seed", 4294967296), GBG_E_ARGUMENT,
           "4294967296 given");
    expect(gbg_scene_set_integer(scene, "excluded_volume.rule", 1), GBG_E_ARGUMENT, "is a choice");
    expect(gbg_scene_set_integer(scene, "output.trajectory.overlap", 2), GBG_E_ARGUMENT, "switch");
    expect(gbg_scene_set_text(scene, "dynamics.dt", "0.1"), GBG_E_ARGUMENT, "is a real");
    expect(gbg_scene_set_text(scene, "excluded_volume.rule", "boun"), GBG_E_NAME, "\"boun\" given");
    expect(gbg_scene_set_text(scene, "excluded_volume.rule", "a, b"), GBG_E_NAME, "given");
    expect(gbg_scene_set_text(scene, "excluded_volume.rule", ""), GBG_E_NAME, "given");
    memset(text, 'x', sizeof text - 1);
    text[sizeof text - 1] = 0;
    expect(gbg_scene_set_text(scene, "output.restart.file", text), GBG_E_ARGUMENT, "1099 bytes");
    expect(gbg_scene_set_text(scene, text, "a"), GBG_E_NAME, "no option");
    expect(gbg_scene_get_real(scene, "run.seed", &real), GBG_E_ARGUMENT, "is an integer");
    expect(gbg_scene_get_integer(scene, "dynamics.dt", &integer), GBG_E_ARGUMENT, "is a real");
    expect(gbg_scene_set_real(scene, NULL, 1), GBG_E_ARGUMENT, "option is NULL");
    expect(gbg_scene_set_text(scene, "run.seed", NULL), GBG_E_ARGUMENT, "value is NULL");
    assert_int_equal(gbg_scene_set_real(NULL, "dynamics.dt", 1), GBG_E_ARGUMENT);
    assert_non_null(strstr(gbg_message(NULL), "scene is NULL"));
    assert_true(real == 1 && integer == 1);
    gbg_scene_digest(scene, after);
    assert_string_equal(before, after);
    assert_int_equal(scene->dynamics, GBG_DYNAMICS_NONE);
    gbg_scene_destroy(&scene);
}

/* Every line of the table has five fields, its name is taken, and its default is what a fresh scene
 * holds. */
static void the_table_agrees_with_itself(void **state)
{
    (void)state;
    struct gbg_scene *scene;
    const char *line;
    int count = 0;
    assert_int_equal(gbg_scene_create(context, 3, &scene), GBG_OK);
    for (; gbg_scene_option(count, &line) == GBG_OK; count++) {
        char name[64], type[16], standard[32], value[1100];
        int bars = 0;
        for (const char *c = line; *c; c++) {
            bars += *c == '|';
        }
        assert_int_equal(bars, 4);
        assert_int_equal(sscanf(line, "%63[^|]|%15[^|]|%31[^|]|", name, type, standard), 3);
        assert_int_equal(gbg_scene_get_text(scene, name, sizeof value, value), GBG_OK);
        if (strcmp(standard, "not given") != 0 && strcmp(standard, "required") != 0) {
            assert_string_equal(value, standard);
        }
    }
    assert_true(count > 25);
    assert_int_equal(gbg_scene_option(-1, &line), GBG_E_ARGUMENT);
    assert_int_equal(gbg_scene_option(0, NULL), GBG_E_ARGUMENT);
    gbg_scene_destroy(&scene);
}

static void wrong_parts_are_refused(void **state)
{
    (void)state;
    struct gbg_scene *scene = small_scene(), *none;
    const double bad[][2] = {{0, 1}, {1, -1}, {NAN, 1}, {1, INFINITY}, {1e101, 1}};
    expect(gbg_scene_create(context, 1, &none), GBG_E_ARGUMENT, "dimension: 1 given, allowed 2, 3");
    assert_null(none);
    for (int i = 0; i < 5; i++) {
        expect(gbg_scene_set_box(scene, bad[i], NULL), GBG_E_ARGUMENT, "box length");
    }
    expect(gbg_scene_set_box(scene, scene->length, bad[2]), GBG_E_ARGUMENT, "box origin nan");
    expect(gbg_scene_set_box(scene, NULL, NULL), GBG_E_ARGUMENT, "lengths is NULL");
    expect(gbg_scene_add_species(scene, "A", 1, 0, 0, -1, 1, NULL), GBG_E_ARGUMENT, "name \"A\"");
    expect(gbg_scene_add_species(scene, "x\n", 1, 0, 0, -1, 1, NULL), GBG_E_ARGUMENT, "control");
    expect(
        gbg_scene_add_species(scene, "a name that is longer than 31 bytes", 1, 0, 0, -1, 1, NULL),
        GBG_E_ARGUMENT, "35 bytes");
    expect(gbg_scene_add_species(scene, "B", -1, 0, 0, -1, 1, NULL), GBG_E_ARGUMENT,
           "diameter: -1");
    expect(gbg_scene_add_species(scene, "B", 1, NAN, 0, -1, 1, NULL), GBG_E_ARGUMENT, "alpha: nan");
    expect(gbg_scene_add_species(scene, "B", 1, 0, INFINITY, -1, 1, NULL), GBG_E_ARGUMENT,
           "mobility: inf");
    expect(gbg_scene_add_species(scene, "B", 1, 0, 0, 1.5, -1, NULL), GBG_E_ARGUMENT,
           "fraction: 1.5");
    expect(gbg_scene_add_species(scene, "B", 1, 0, 0, -1, -2, NULL), GBG_E_ARGUMENT, "count: -2");
    expect(gbg_scene_add_species(scene, "B", 1, 0, 0, 0.5, 3, NULL), GBG_E_ARGUMENT,
           "one of the two");
    expect(gbg_scene_add_force(scene, 0, NULL, 0, 0), GBG_E_ARGUMENT,
           "power: 0 given, allowed (0, 24]");
    expect(gbg_scene_add_force(scene, 25, NULL, 0, 0), GBG_E_ARGUMENT, "power: 25 given");
    expect(gbg_scene_add_force(scene, 2, "all", 0, 0), GBG_E_NAME, "sum: \"all\" given");
    expect(gbg_scene_add_force(scene, 2, "cutoff", 0, 0), GBG_E_ARGUMENT, "cutoff: 0 given");
    expect(gbg_scene_add_force(scene, 2, "minimum_image", 2, 0), GBG_E_ARGUMENT, "only with sum");
    expect(gbg_scene_add_force(scene, 2, NULL, 0, 1), GBG_E_ARGUMENT, "tolerance: 1 given");
    assert_int_equal(scene->n_species, 1);
    assert_int_equal(scene->n_forces, 0);
    for (int f = 0; f < GBG_MAX_FORCES; f++) {
        assert_int_equal(gbg_scene_add_force(scene, 2 + f, NULL, 0, 0), GBG_OK);
    }
    expect(gbg_scene_add_force(scene, 2, NULL, 0, 0), GBG_E_ARGUMENT, "at most 8");
    gbg_scene_destroy(&scene);
}

/* A change that makes the small scene contradict itself, and what is said of it. */
static void contradictions_are_named(void **state)
{
    (void)state;
    const double flat[] = {2000, 1.9}, crowded[] = {2, 3};
    struct gbg_scene *scene = small_scene();
    gbg_scene_set_text(scene, "excluded_volume.rule", "contact");
    gbg_scene_set_text(scene, "excluded_volume.neighbours", "delaunay");
    expect(gbg_scene_check(scene), GBG_E_SCENE, "delaunay is not in this version; take grid");
    gbg_scene_set_text(scene, "excluded_volume.neighbours", "auto");
    gbg_scene_set_box(scene, flat, NULL);
    expect(gbg_scene_check(scene), GBG_E_SCENE, "1.9 given, allowed at least 2 of the largest");
    gbg_scene_set_box(scene, crowded, NULL);
    expect(gbg_scene_check(scene), GBG_E_SCENE, "0.9069 = pi/(2 sqrt 3)");
    gbg_scene_set_real(scene, "box.packing", 0.9070);
    expect(gbg_scene_check(scene), GBG_E_SCENE, "box.packing: the hard cores fill 0.907");
    gbg_scene_set_real(scene, "box.packing", 0.9068);
    assert_int_equal(gbg_scene_check(scene), GBG_OK);
    gbg_scene_set_integer(scene, "particles.count", 11);
    expect(gbg_scene_check(scene), GBG_E_SCENE, "11 given, but the particles sum to 10");
    gbg_scene_set_integer(scene, "particles.count", 10);
    gbg_scene_set_text(scene, "dynamics.kind", "brownian");
    expect(gbg_scene_check(scene), GBG_E_SCENE, "dynamics.dt is missing");
    gbg_scene_set_real(scene, "dynamics.dt", 1e-3);
    gbg_scene_set_text(scene, "dynamics.noise.limit_by", "redraw");
    expect(gbg_scene_check(scene), GBG_E_SCENE, "dynamics.noise.limit is missing");
    gbg_scene_set_real(scene, "dynamics.noise.limit", 3);
    gbg_scene_set_text(scene, "dynamics.noise.limit_by", "none");
    expect(gbg_scene_check(scene), GBG_E_SCENE, "say clamp or redraw");
    gbg_scene_set_text(scene, "dynamics.noise.limit_by", "clamp");
    gbg_scene_set_text(scene, "particles.start.lattice", "cubic");
    expect(gbg_scene_check(scene), GBG_E_SCENE,
           "cubic in 2 dimensions, allowed triangular, square");
    gbg_scene_set_text(scene, "particles.start.lattice", "square");
    assert_int_equal(gbg_scene_check(scene), GBG_OK);
    gbg_scene_set_text(scene, "excluded_volume.rule", "none");
    gbg_scene_set_text(scene, "output.trajectory.overlap", "true");
    expect(gbg_scene_check(scene), GBG_E_SCENE, "needs an excluded_volume.rule");
    gbg_scene_set_text(scene, "output.trajectory.overlap", "false");
    gbg_scene_set_box(scene, (double[]){20, 10}, NULL);
    assert_int_equal(gbg_scene_add_force(scene, 6, "cutoff", 5, 0), GBG_OK);
    assert_int_equal(gbg_scene_check(scene), GBG_OK);
    assert_int_equal(gbg_scene_add_force(scene, 6, "cutoff", 5.001, 0), GBG_OK);
    expect(gbg_scene_check(scene), GBG_E_SCENE, "forces[1].cutoff: 5.001 given, allowed at most");
    gbg_scene_destroy(&scene);
}

/* What a sum over all images takes. */
static void lattice_sums_have_their_ranges(void **state)
{
    (void)state;
    struct gbg_scene *scene = small_scene(), resolved;
    char before[65], after[65];
    assert_int_equal(gbg_scene_add_force(scene, 2, NULL, 0, 0), GBG_OK);
    assert_int_equal(scene->force[0].sum, GBG_SUM_LATTICE);
    resolved = *scene;
    assert_int_equal(gbg_scene_resolve(&resolved), GBG_OK);
    assert_true(resolved.force[0].tolerance == 1e-4 && resolved.force[0].check == 1);
    gbg_scene_digest(&resolved, before);
    assert_int_equal(gbg_scene_set_force(scene, 0, "split", "gaussian"), GBG_OK);
    resolved = *scene;
    assert_int_equal(gbg_scene_resolve(&resolved), GBG_OK);
    gbg_scene_digest(&resolved, after);
    assert_string_not_equal(before, after);
    expect(gbg_scene_set_force(scene, 0, "sum", "minimum_image"), GBG_E_ARGUMENT,
           "split: gaussian given, allowed only with sum lattice");
    expect(gbg_scene_set_force(scene, 0, "split", "round"), GBG_E_NAME,
           "allowed prolate, gaussian");
    expect(gbg_scene_set_force(scene, 0, "splitt", "gaussian"), GBG_E_NAME, "nearest is \"split\"");
    expect(gbg_scene_set_force(scene, 1, "split", "gaussian"), GBG_E_ARGUMENT,
           "force 1 is not one of the 1");
    assert_int_equal(gbg_scene_set_force(scene, 0, "tolerance", "0.1"), GBG_OK);
    assert_int_equal(gbg_scene_check(scene), GBG_OK);
    assert_int_equal(gbg_scene_set_force(scene, 0, "tolerance", "0.11"), GBG_OK);
    expect(gbg_scene_check(scene), GBG_E_SCENE,
           "forces[0].tolerance: 0.11 given, allowed (0, 0.1] with sum lattice");
    gbg_scene_set_force(scene, 0, "tolerance", "1e-4");
    gbg_scene_set_force(scene, 0, "power", "6.5");
    expect(gbg_scene_check(scene), GBG_E_SCENE, "forces[0].power: 6.5 given, allowed 1 to 6");
    gbg_scene_set_force(scene, 0, "power", "0.5");
    expect(gbg_scene_check(scene), GBG_E_SCENE, "forces[0].power: 0.5 given, allowed 1 to 6");
    gbg_scene_set_force(scene, 0, "power", "2");
    gbg_scene_set_text(scene, "precision.mode", "strict");
    expect(gbg_scene_check(scene), GBG_E_SCENE, "strict given, but forces[0] has sum lattice");
    gbg_scene_set_text(scene, "precision.mode", "double");
    assert_int_equal(gbg_scene_check(scene), GBG_OK);
    gbg_scene_destroy(&scene);
}

/* In space Coulomb's law alone. */
static void lattice_sums_in_space_have_one_power(void **state)
{
    (void)state;
    struct gbg_scene *scene;
    gbg_scene_create(context, 3, &scene);
    gbg_scene_set_box(scene, (double[]){20, 20, 20}, NULL);
    gbg_scene_add_species(scene, NULL, 1, 1, 1, -1, 8, NULL);
    gbg_scene_set_text(scene, "particles.start.lattice", "cubic");
    gbg_scene_add_force(scene, 3, "lattice", 0, 0);
    expect(gbg_scene_check(scene), GBG_E_SCENE,
           "forces[0].power: 3 given, allowed 2 with sum lattice in 3 dimensions");
    gbg_scene_set_force(scene, 0, "power", "2");
    assert_int_equal(gbg_scene_check(scene), GBG_OK);
    gbg_scene_destroy(&scene);
}

static void what_is_missing_is_named(void **state)
{
    (void)state;
    struct gbg_scene *scene;
    gbg_scene_create(context, 2, &scene);
    expect(gbg_scene_check(scene), GBG_E_SCENE, "particles.species is missing");
    gbg_scene_add_species(scene, NULL, 1, 0, 0, 0.5, -1, NULL);
    gbg_scene_add_species(scene, NULL, 1, 0, 0, -1, 4, NULL);
    expect(gbg_scene_check(scene), GBG_E_SCENE, "\"B\" has no fraction but others");
    scene->species[1].asked = -1;
    scene->species[1].fraction = 0.6;
    expect(gbg_scene_check(scene), GBG_E_SCENE, "sum to 1.1, allowed 1 within 1e-9");
    scene->species[1].fraction = 0.5 + 1e-10;
    expect(gbg_scene_check(scene), GBG_E_SCENE, "particles.count is missing");
    gbg_scene_set_integer(scene, "particles.count", 5);
    expect(gbg_scene_check(scene), GBG_E_SCENE, "box is missing");
    gbg_scene_set_real(scene, "box.packing", 0.2);
    expect(gbg_scene_check(scene), GBG_E_SCENE, "particles.start is missing");
    gbg_scene_set_text(scene, "particles.start.random", "insertion");
    assert_int_equal(gbg_scene_check(scene), GBG_OK);
    scene->species[0].fraction = scene->species[1].fraction = -1;
    expect(gbg_scene_check(scene), GBG_E_SCENE, "\"A\" has neither a fraction nor a count");
    scene->species[0].asked = scene->species[1].asked = 0;
    gbg_scene_set_integer(scene, "particles.count", 0);
    expect(gbg_scene_check(scene), GBG_E_SCENE, "needs particles with diameters above 0");
    gbg_scene_set_box(scene, (double[]){1e-3, 1}, NULL);
    assert_int_equal(gbg_scene_check(scene), GBG_OK);
    gbg_scene_destroy(&scene);
}

/* Counts by the largest remainder, from an exact list; ten species, one of them empty. */
static void fractions_become_counts(void **state)
{
    (void)state;
    struct gbg_scene *scene;
    gbg_scene_create(context, 2, &scene);
    const double fraction[] = {0.15, 0.15, 0.15, 0.15, 0.15, 0.05, 0.05, 0.1, 0.05, 0};
    /* of 13: parts 1.95 five times, 0.65, 0.65, 1.3, 0.65, 0 */
    const int64_t expected[] = {2, 2, 2, 2, 2, 1, 1, 1, 0, 0};
    for (int s = 0; s < GBG_MAX_SPECIES; s++) {
        int index;
        assert_int_equal(gbg_scene_add_species(scene, NULL, 1, 0, 1, fraction[s], -1, &index), 0);
        assert_int_equal(index, s);
    }
    expect(gbg_scene_add_species(scene, NULL, 1, 0, 1, 0, -1, NULL), GBG_E_ARGUMENT, "at most 10");
    gbg_scene_set_real(scene, "box.packing", 0.1);
    gbg_scene_set_text(scene, "particles.start.random", "insertion");
    for (int64_t count = 13; count < 2147483647; count = 3 * count + 1) {
        gbg_scene_set_integer(scene, "particles.count", count);
        assert_int_equal(gbg_scene_resolve(scene), GBG_OK);
        int64_t sum = 0;
        for (int s = 0; s < GBG_MAX_SPECIES; s++) {
            sum += scene->species[s].count;
            assert_true(fabs((double)scene->species[s].count - fraction[s] * (double)count) < 1);
            assert_true(count > 13 || scene->species[s].count == expected[s]);
        }
        assert_int_equal(sum, count);
        assert_true(fabs(gbg_scene_packing(scene) - 0.1) < 1e-12);
    }
    gbg_scene_destroy(&scene);
}

static void resolving_twice_changes_nothing(void **state)
{
    (void)state;
    struct gbg_scene *scene = small_scene();
    gbg_scene_set_text(scene, "excluded_volume.rule", "auto");
    gbg_scene_set_real(scene, "box.packing", 0.3);
    gbg_scene_set_text(scene, "box.shape", "lattice");
    assert_int_equal(gbg_scene_resolve(scene), GBG_OK);
    assert_int_equal(scene->rule, GBG_RULE_EVENT);
    assert_true(scene->length[0] != scene->length[1]);
    struct gbg_scene first = *scene;
    assert_int_equal(gbg_scene_resolve(scene), GBG_OK);
    assert_memory_equal(&first, scene, sizeof first);

    double length[2];
    int dimension;
    gbg_scene_set_real(scene, "box.packing", 0.1);
    assert_int_equal(gbg_scene_get_box(scene, &dimension, length, NULL), GBG_OK);
    assert_true(fabs(length[0] * length[1] * 0.1 - 10 * acos(-1) / 4) < 1e-9);
    gbg_scene_destroy(&scene);
}

/* All that the dynamics depend on changes the digest, and what they do not depend on does not. */
static void digests_tell_scenes_apart(void **state)
{
    (void)state;
    char plain[65], other[65];
    struct gbg_scene *scene = small_scene();
    gbg_scene_resolve(scene);
    struct gbg_scene changed = *scene;
    gbg_scene_digest(scene, plain);
    assert_int_equal(strlen(plain), 64);
#define DIFFERS(change)                                                                            \
    do {                                                                                           \
        changed = *scene;                                                                          \
        change;                                                                                    \
        gbg_scene_digest(&changed, other);                                                         \
        assert_string_not_equal(plain, other);                                                     \
    } while (0)
    DIFFERS(changed.length[1] = nextafter(10, 11));
    DIFFERS(changed.origin[0] = 1);
    DIFFERS(changed.species[0].diameter = 2);
    DIFFERS(changed.species[0].alpha = -1);
    DIFFERS(changed.species[0].count = 11);
    DIFFERS(changed.n_forces = 1);
    DIFFERS(changed.rule = GBG_RULE_CONTACT);
    DIFFERS(changed.dt = 1);
    DIFFERS(changed.temperature = 1);
    DIFFERS(changed.limit_by = GBG_LIMIT_CLAMP);
    DIFFERS(changed.seed = 1);
    DIFFERS(changed.run = 1);
    DIFFERS(changed.precision = GBG_PRECISION_DOUBLE);
    DIFFERS(changed.max_rounds = 7);
    changed = *scene;
    changed.steps = 5;
    changed.origin[0] = -0.0;
    changed.trajectory_file[0] = 'x';
    changed.start = GBG_START_LATTICE;
    gbg_scene_digest(&changed, other);
    assert_string_equal(plain, other);
    gbg_scene_destroy(&scene);
}

static void wrong_arrays_are_refused(void **state)
{
    (void)state;
    struct gbg_scene *scene = small_scene();
    double x[3] = {1, 2, 3}, bad[3] = {1, NAN, 3};
    int32_t species[3] = {0, 1, 2}, negative[3] = {0, -1, 0};
    int64_t twice[3] = {5, 6, 5}, below[3] = {0, -1, 2}, later[1] = {6}, distinct[3] = {9, 6, 5};
    expect(gbg_scene_add_particles(scene, -1, x, x, NULL, 1, NULL, 0, NULL), GBG_E_ARGUMENT,
           "n: -1");
    expect(gbg_scene_add_particles(scene, 3, x, NULL, NULL, 1, NULL, 0, NULL), GBG_E_ARGUMENT,
           "y is");
    expect(gbg_scene_add_particles(scene, 3, x, x, NULL, 0, NULL, 0, NULL), GBG_E_ARGUMENT,
           "step: 0");
    expect(gbg_scene_add_particles(scene, 3, x, x, NULL, 1, NULL, 2, NULL), GBG_E_ARGUMENT,
           "base: 2");
    expect(gbg_scene_add_particles(scene, 3, x, bad, NULL, 1, NULL, 0, NULL), GBG_E_ARGUMENT,
           "particle 1 is not finite");
    expect(gbg_scene_add_particles(scene, 3, x, bad, NULL, 1, NULL, 1, NULL), GBG_E_ARGUMENT,
           "particle 2 is not finite");
    expect(gbg_scene_add_particles(scene, 3, x, x, NULL, 1, negative, 0, NULL), GBG_E_ARGUMENT,
           "species -1 of particle 1");
    expect(gbg_scene_add_particles(scene, 3, x, x, NULL, 1, species, 1, NULL), GBG_E_ARGUMENT,
           "species 0 of particle 1 given, allowed 1..10");
    expect(gbg_scene_add_particles(scene, 3, x, x, NULL, 1, NULL, 0, twice), GBG_E_ARGUMENT,
           "id 5 is given twice");
    expect(gbg_scene_add_particles(scene, 3, x, x, NULL, 1, NULL, 0, below), GBG_E_ARGUMENT,
           "id -1");
    assert_int_equal(scene->arrays.n, 0);
    assert_int_equal(scene->start, GBG_START_INSERTION);
    assert_int_equal(gbg_scene_add_particles(scene, 3, x, x, NULL, 1, species, 0, distinct),
                     GBG_OK);
    expect(gbg_scene_add_particles(scene, 1, x, x, NULL, 1, NULL, 0, later), GBG_E_ARGUMENT,
           "id 6 is given twice");
    expect(gbg_scene_check(scene), GBG_E_SCENE,
           "particle 6 is of species 1 (from 0), but there are 1");
    gbg_scene_add_species(scene, NULL, 1, 0, 0, -1, 1, NULL);
    gbg_scene_add_species(scene, NULL, 1, 0, 0, -1, -1, NULL);
    expect(gbg_scene_check(scene), GBG_E_SCENE, "\"A\" asks for 10 particles, but 1 were given");
    scene->species[0].asked = 1;
    assert_int_equal(gbg_scene_check(scene), GBG_OK);
    for (int s = 0; s < 3; s++) {
        scene->species[s].asked = -1;
        scene->species[s].fraction = s ? 0.3 : 0.4;
    }
    assert_int_equal(gbg_scene_check(scene), GBG_OK);
    scene->species[0].fraction = 0.5;
    expect(gbg_scene_check(scene), GBG_E_SCENE, "sum to 1.1");
    scene->species[0].fraction = 0.4;
    gbg_scene_set_integer(scene, "particles.count", 4);
    expect(gbg_scene_check(scene), GBG_E_SCENE, "4 given, but the particles sum to 3");
    int64_t highest[1] = {(INT64_C(1) << 48) - 1};
    assert_int_equal(gbg_scene_add_particles(scene, 1, x, x, NULL, 1, NULL, 0, highest), GBG_OK);
    expect(gbg_scene_add_particles(scene, 1, x, x, NULL, 1, NULL, 0, NULL), GBG_E_ARGUMENT,
           "no 1 ids are left");
    scene->arrays.n = 2147483640;
    expect(gbg_scene_add_particles(scene, 8, x, x, NULL, 1, NULL, 0, NULL), GBG_E_ARGUMENT,
           "8 particles more than");
    scene->arrays.n = 4;
    assert_int_equal(gbg_scene_add_particles(scene, 0, NULL, NULL, NULL, 0, NULL, 0, NULL), GBG_OK);
    gbg_scene_destroy(&scene);
}

/* Many small blocks, in an order of ids that is not ascending, with every allocation failing once.
 */
static void blocks_add_up(void **state)
{
    (void)state;
    struct gbg_scene *scene = small_scene();
    scene->species[0].asked = -1;
    int failures = 0;
    for (int64_t i = 0; i < 300; i++) {
        double x = (double)i;
        int64_t id = 1000 - i;
        int status = GBG_E_MEMORY;
        for (int n = 1; status == GBG_E_MEMORY; n++) {
            gbg_memory_fail_after(n);
            status = gbg_scene_add_particles(scene, 1, &x, &x, NULL, 1, NULL, 0, &id);
            gbg_memory_fail_after(0);
            failures += status == GBG_E_MEMORY;
            assert_int_equal(scene->arrays.n, status == GBG_OK ? i + 1 : i);
        }
        assert_int_equal(status, GBG_OK);
    }
    assert_true(failures > 300);
    struct gbg_particles particles;
    assert_int_equal(gbg_scene_resolve(scene), GBG_OK);
    for (int n = 1; n <= 5; n++) {
        gbg_memory_fail_after(n);
        assert_int_equal(gbg_scene_start(scene, &particles), GBG_E_MEMORY);
        assert_null(particles.id);
    }
    assert_int_equal(gbg_scene_start(scene, &particles), GBG_OK);
    for (int64_t i = 0; i < 300; i++) {
        assert_int_equal(particles.id[i], 701 + i);
        assert_true(particles.position[0][i] == fmod((double)(299 - i), 20));
    }
    gbg_particles_release(&particles);
    gbg_scene_destroy(&scene);

    gbg_memory_fail_after(1);
    expect(gbg_scene_create(context, 2, &scene), GBG_E_MEMORY, "a scene: ");
    gbg_memory_fail_after(0);
    assert_null(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(options_keep_their_values),
        cmocka_unit_test(wrong_options_are_refused),
        cmocka_unit_test(the_table_agrees_with_itself),
        cmocka_unit_test(wrong_parts_are_refused),
        cmocka_unit_test(contradictions_are_named),
        cmocka_unit_test(lattice_sums_have_their_ranges),
        cmocka_unit_test(lattice_sums_in_space_have_one_power),
        cmocka_unit_test(what_is_missing_is_named),
        cmocka_unit_test(fractions_become_counts),
        cmocka_unit_test(resolving_twice_changes_nothing),
        cmocka_unit_test(digests_tell_scenes_apart),
        cmocka_unit_test(wrong_arrays_are_refused),
        cmocka_unit_test(blocks_add_up),
    };
    return cmocka_run_group_tests(tests, make_context, drop_context);
}
