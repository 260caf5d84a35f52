/* Tests of the scene file: what it says arrives, what is wrong is named with its line, and nothing
 * that a file can hold breaks the reader. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "core/memory.h"
#include "core/random.h"
#include "core/text.h"
#include "scene/options.h"
#include "scene/scene.h"

static struct gbg_context *context;
static char path[] = "/tmp/gamboge_scene_XXXXXX";

static int make_context(void **state)
{
    (void)state;
    int descriptor = mkstemp(path);
    return descriptor < 0 || close(descriptor) != 0 || gbg_context_create("cpu", &context);
}

static int drop_context(void **state)
{
    (void)state;
    unlink(path);
    return gbg_context_destroy(&context);
}

static void write_file(const char *text, size_t bytes)
{
    FILE *stream = fopen(path, "wb");
    assert_non_null(stream);
    assert_int_equal(fwrite(text, 1, bytes, stream), bytes);
    assert_int_equal(fclose(stream), 0);
}

static int read_text(const char *text, struct gbg_scene **scene)
{
    write_file(text, strlen(text));
    return gbg_scene_read(context, path, scene);
}

static const char *const lines[] = {
    "# a scene with every key",
    "dimension: 2",
    "box:",
    "  size: [60, 70.5]",
    "  origin: [-30, 1e1]",
    "  boundary: [periodic, periodic]",
    "particles:",
    "  count: 1000",
    "  species:",
    "    - {name: A, fraction: 0.25, diameter: 1, alpha: -1, mobility: 1}",
    "    - name: B",
    "      fraction: 0.75",
    "      diameter: 0.5",
    "  start: {lattice: triangular, jitter: 0.05}",
    "forces:",
    "  - {law: power, power: 2, sum: minimum_image, tolerance: 1e-4}",
    "  - {power: 6, cutoff: 2.5}",
    "excluded_volume: {rule: contact, neighbours: grid, max_rounds: 77, skin: 0.25}",
    "dynamics:",
    "  kind: brownian",
    "  dt: 0.01",
    "  temperature: 0.02",
    "  noise: {limit: 3, limit_by: clamp, rescale: true}",
    "precision: {mode: double}",
    "run: {steps: 10000, seed: 7, run: 2}",
    "output:",
    "  trajectory: {file: c3.nc, every: 50, precision: float, overlap: true, unwrapped: true}",
    "  restart: {file: c3.restart.nc, every: 500}",
    NULL};

/* The file above with line number `line` (from 1) replaced; 0: as it is. */
static char *file_with(int line, const char *replacement)
{
    static char text[8192];
    text[0] = 0;
    for (int i = 0; lines[i]; i++) {
        strcat(text, i + 1 == line ? replacement : lines[i]);
        strcat(text, "\n");
    }
    return text;
}

static void every_key_arrives(void **state)
{
    (void)state;
    struct gbg_scene *s;
    assert_int_equal(read_text(file_with(0, ""), &s), GBG_OK);
    assert_int_equal(s->dimension, 2);
    assert_true(s->length[0] == 60 && s->length[1] == 70.5);
    assert_true(s->origin[0] == -30 && s->origin[1] == 10);
    assert_int_equal(s->count, 1000);
    assert_int_equal(s->n_species, 2);
    assert_string_equal(s->species[1].name, "B");
    assert_true(s->species[0].fraction == 0.25 && s->species[0].alpha == -1);
    assert_true(s->species[1].diameter == 0.5 && s->species[1].mobility == 1);
    assert_int_equal(s->start, GBG_START_LATTICE);
    assert_true(s->jitter == 0.05);
    assert_int_equal(s->n_forces, 2);
    assert_true(s->force[0].power == 2 && s->force[0].tolerance == 1e-4);
    assert_int_equal(s->force[0].sum, GBG_SUM_MINIMUM_IMAGE);
    assert_int_equal(s->force[1].sum, GBG_SUM_CUTOFF);
    assert_int_equal(s->force[1].check, 1);
    assert_true(s->force[1].cutoff == 2.5);
    assert_int_equal(s->rule, GBG_RULE_CONTACT);
    assert_int_equal(s->neighbours, GBG_NEIGHBOURS_GRID);
    assert_int_equal(s->max_rounds, 77);
    assert_true(s->skin == 0.25);
    assert_int_equal(s->dynamics, GBG_DYNAMICS_BROWNIAN);
    assert_true(s->dt == 0.01 && s->temperature == 0.02 && s->noise_limit == 3);
    assert_int_equal(s->limit_by, GBG_LIMIT_CLAMP);
    assert_int_equal(s->rescale, 1);
    assert_int_equal(s->precision, GBG_PRECISION_DOUBLE);
    assert_true(s->steps == 10000 && s->seed == 7 && s->run == 2);
    assert_string_equal(s->trajectory_file, "c3.nc");
    assert_string_equal(s->restart_file, "c3.restart.nc");
    assert_true(s->trajectory_every == 50 && s->restart_every == 500);
    assert_true(!s->output_double && s->overlap && s->unwrapped);
    assert_string_equal(s->source, path);
    gbg_scene_destroy(&s);
}

/* Every option of the table can be written in a file, and means there what it means in a call. */
static void every_option_has_its_key(void **state)
{
    (void)state;
    for (const struct gbg_option *o = gbg_scene_options; o->name; o++) {
        char text[1024], part[128], word[128];
        const char *value = o->type == GBG_REAL || o->type == GBG_INTEGER ? "0.5" : "true";
        value = o->type == GBG_INTEGER || strstr(o->name, "limit") ? "1" : value;
        if (o->type == GBG_CHOICE) {
            snprintf(word, sizeof word, "%.*s", (int)strcspn(o->range, ","), o->range);
            value = word;
        }
        text[0] = 0;
        gbg_text_copy(part, sizeof part, o->name);
        int closing = 0;
        for (char *key = strtok(part, "."); key; key = strtok(NULL, "."), closing++) {
            sprintf(text + strlen(text), "%s%s: ", closing ? "{" : "", key);
        }
        sprintf(text + strlen(text), "%s%.*s\n", value, closing - 1, "}}}}");
        struct gbg_scene *scene;
        int status = read_text(text, &scene);
        if (status != GBG_OK && status != GBG_E_SCENE) {
            fail_msg("%s: %s", text, gbg_message(context));
        }
        gbg_scene_destroy(&scene);
    }
}

static void short_files_mean_what_they_say(void **state)
{
    (void)state;
    struct gbg_scene *s;
    const char *species = "particles: {species: [{count: 40}], start: {random: insertion}}\n";
    char text[512];
    snprintf(text, sizeof text, "%sbox: {packing: 0.3}\ndimension: 3\nexcluded_volume: {}\n",
             species);
    assert_int_equal(read_text(text, &s), GBG_OK);
    assert_int_equal(s->dimension, 3);
    assert_int_equal(s->rule, GBG_RULE_AUTO);
    assert_int_equal(s->dynamics, GBG_DYNAMICS_NONE);
    assert_string_equal(s->species[0].name, "A");
    gbg_scene_destroy(&s);

    snprintf(text, sizeof text, "%sbox: {size: [5, 5, 5]}\n", species);
    assert_int_equal(read_text(text, &s), GBG_OK);
    assert_int_equal(s->dimension, 3);
    assert_int_equal(s->rule, GBG_RULE_NONE);
    gbg_scene_destroy(&s);

    assert_int_equal(
        read_text("particles: {species: [{}, {}], start: {file: a.nc, frame: 3}}\n", &s), GBG_OK);
    assert_int_equal(s->start, GBG_START_FILE);
    assert_int_equal(s->start_frame, 3);
    assert_int_equal(gbg_scene_check(s), GBG_OK);
    assert_int_equal(gbg_scene_resolve(s), GBG_E_ORDER);
    gbg_scene_destroy(&s);

    /* particles may come by calls; what is still wrong then is told with the file */
    double x[4] = {1, 2, 3, 4};
    const char *halves = "box: {size: [9, 9]}\n"
                         "particles: {species: [{fraction: 0.5}, {fraction: 0.5}]}\n";
    assert_int_equal(read_text(halves, &s), GBG_OK);
    assert_int_equal(gbg_scene_add_particles(s, 4, x, x, NULL, 1, NULL, 0, NULL), GBG_OK);
    assert_int_equal(gbg_scene_resolve(s), GBG_E_SCENE);
    assert_true(strncmp(gbg_message(context), path, strlen(path)) == 0);
    assert_non_null(strstr(gbg_message(context), "asks for 2 particles, but 4 were given"));
    gbg_scene_destroy(&s);
}

struct bad_line {
    int line;
    const char *replacement;
    int status, named; /* line in the message */
    const char *says;
};

static void bad_lines_are_named(void **state)
{
    (void)state;
    static const struct bad_line cases[] = {
        {2, "dimension: 4", GBG_E_ARGUMENT, 2, "dimension: \"4\" given, allowed 2, 3"},
        {2, "dimension: 3", GBG_E_ARGUMENT, 4, "box.size: 2 entries given, allowed 3"},
        {4, "  size: [60, -70]", GBG_E_ARGUMENT, 4, "box length -70"},
        {4, "  size: [60, inf]", GBG_E_ARGUMENT, 4, "box.size: inf given"},
        {4, "  size: [60, x]", GBG_E_ARGUMENT, 4, "box.size: \"x\" given"},
        {4, "  size: [60]", GBG_E_ARGUMENT, 4, "box.size: 1"},
        {4, "  size: 60", GBG_E_FORMAT, 4, "box.size: a single value given, allowed a list"},
        {4, "  size: [1, 2, 3, 4]", GBG_E_ARGUMENT, 4, "box.size: 4 entries given, allowed 2"},
        {4, "  size: []", GBG_E_SCENE, 4, "box.size: an empty list"},
        {4, "  size: [60, 0.9]", GBG_E_SCENE, 4, "box.size: the hard cores fill"},
        {4, "  size: [600000, 1.9]", GBG_E_SCENE, 4, "at least 2 of the largest diameter"},
        {4, "  packing: 0.3", GBG_OK, 0, NULL},
        {4, "  packing: 0", GBG_E_SCENE, 3, "box is missing"},
        {4, "  packing: 1.5", GBG_E_ARGUMENT, 4, "box.packing: 1.5 given, allowed [0, 1]"},
        {4, "  size: [60, 60]\n  packing: 0.3", GBG_E_SCENE, 5, "beside box.size"},
        {5, "  origin: [nan, 0]", GBG_E_ARGUMENT, 5, "box.origin: nan"},
        {6, "  boundary: [periodic, open]", GBG_E_NAME, 6, "\"open\" given, allowed periodic"},
        {6, "  bondary: [periodic, periodic]", GBG_E_NAME, 6, "nearest is \"boundary\""},
        {8, "  count: 1e3", GBG_E_ARGUMENT, 8, "particles.count: \"1e3\" given"},
        {8, "  count: -1", GBG_E_ARGUMENT, 8, "particles.count: -1 given"},
        {8, "  count: 99999999999999999999", GBG_E_ARGUMENT, 8, "particles.count"},
        {8, "  #", GBG_E_SCENE, 7, "particles.count is missing"},
        {8, "  count:", GBG_E_ARGUMENT, 8, "particles.count: \"\" given"},
        {10, "    - {name: A, fraction: 0.5}", GBG_E_SCENE, 9, "fractions sum to 1.25"},
        {10, "    - {name: B, fraction: 0.25}", GBG_E_ARGUMENT, 11, "name \"B\""},
        {10, "    - {name: A, count: 250}", GBG_E_SCENE, 10, "no fraction but others"},
        {10, "    - {name: A, count: 250, fraction: 0.25}", GBG_E_ARGUMENT, 10, "one of the two"},
        {10, "    - 5", GBG_E_FORMAT, 10, "particles.species[0]: a single value given"},
        {12, "      fractoin: 0.75", GBG_E_NAME, 12, "particles.species[1].fractoin: no such key"},
        {12, "      fraction: 7.5", GBG_E_ARGUMENT, 12, "particles.species[1].fraction: 7.5 given"},
        {13, "      diameter: -1", GBG_E_ARGUMENT, 13, "particles.species[1].diameter: -1 given"},
        {14, "  start: {lattice: fcc}", GBG_E_SCENE, 14, "fcc in 2 dimensions"},
        {14, "  start: {lattice: triangular, random: insertion}", GBG_E_SCENE, 14, "two kinds"},
        {14, "  start: {jitter: 2}", GBG_E_ARGUMENT, 14, "jitter: 2 given, allowed [0, 1]"},
        {16, "  - {power: 0}", GBG_E_ARGUMENT, 16, "forces[0].power: 0 given, allowed (0, 24]"},
        {16, "  - {law: power}", GBG_E_SCENE, 16, "forces[0]: power is missing"},
        {16, "  - {law: morse, power: 2}", GBG_E_NAME, 16, "forces[0].law: \"morse\" given"},
        {16, "  - {power: 7}", GBG_E_SCENE, 16, "forces[0].power: 7 given, allowed 1 to 6"},
        {16, "  - {power: 2, sum: lattice, tolerance: 0.2}", GBG_E_SCENE, 16,
         "forces[0].tolerance: 0.2 given, allowed (0, 0.1]"},
        {16, "  - {power: 2, sum: lattice, gradient: none}", GBG_E_NAME, 16,
         "forces[0].gradient: \"none\" given, allowed waves, window"},
        {16, "  - {power: 2, sum: minimum_image, window: bspline}", GBG_E_ARGUMENT, 16,
         "window: bspline given, allowed only with sum lattice"},
        {17, "  - {power: 6, cutoff: 30.5}", GBG_E_SCENE, 17,
         "at most half the shortest box length"},
        {17, "  - {power: 6, sum: cutoff}", GBG_E_ARGUMENT, 17, "cutoff: 0 given"},
        {18, "excluded_volume: {neighbours: delaunay}", GBG_E_SCENE, 18, "take grid"},
        {18, "excluded_volume: {rule: bouncy}", GBG_E_NAME, 18, "\"bouncy\" given, allowed none,"},
        {18, "excluded_volume: {rule: none}", GBG_E_SCENE, 27, "overlap: true needs"},
        {21, "  dt: 0", GBG_E_ARGUMENT, 21, "dynamics.dt: 0 given, allowed (0, 1e100]"},
        {21, "  #", GBG_E_SCENE, 19, "dynamics.dt is missing"},
        {22, "  temperature: -1", GBG_E_ARGUMENT, 22, "dynamics.temperature: -1 given"},
        {23, "  noise: {limit_by: clamp}", GBG_E_SCENE, 23, "dynamics.noise.limit is missing"},
        {23, "  noise: {limit: 3}", GBG_E_SCENE, 23, "say clamp or redraw"},
        {24, "precision: {mode: single}", GBG_E_NAME, 24, "allowed auto, mixed, double"},
        {25, "run: {steps: 10, seed: 4294967296}", GBG_E_ARGUMENT, 25, "run.seed: 4294967296"},
        {25, "run: {steps: 10, steps: 11}", GBG_E_FORMAT, 25, "run.steps: given twice"},
        {25, "runs: {steps: 10}", GBG_E_NAME, 25, "runs: no such key; the nearest is \"run\""},
        {27, "  trajectory: {every: 0}", GBG_E_ARGUMENT, 27, "output.trajectory.every: 0 given"},
        {27, "  trajectory: {overlap: maybe}", GBG_E_NAME, 27, "allowed false, true"},
        {27, "  trajectory: [1, 2]", GBG_E_FORMAT, 27, "a list given, allowed a block of keys"},
        {28, "  restart: {file: &a x}", GBG_E_FORMAT, 28, "anchors"},
        {28, "---\nrun: {steps: 1}", GBG_E_FORMAT, 28, "a second document"},
        {28, "  ? [a, b]\n  : c", GBG_E_FORMAT, 28, "not a word"},
        {28, "  restart: {file: x", GBG_E_FORMAT, 29, "not YAML"},
        {28, "  restart: {file: \"\\e[31m\", evry: 1}", GBG_E_NAME, 28, "evry"},
    };
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        struct gbg_scene *scene;
        char head[128];
        int status = read_text(file_with(cases[c].line, cases[c].replacement), &scene);
        if (!cases[c].says) {
            assert_int_equal(status, cases[c].status);
            gbg_scene_destroy(&scene);
            continue;
        }
        snprintf(head, sizeof head, "%s:%d: ", path, cases[c].named);
        const char *message = gbg_message(context);
        if (scene || status != cases[c].status || strncmp(message, head, strlen(head)) != 0 ||
            !strstr(message, cases[c].says)) {
            fail_msg("%s gives %s, %s", cases[c].replacement, gbg_status_name(status), message);
        }
    }
}

static void odd_files_are_refused(void **state)
{
    (void)state;
    struct gbg_scene *scene;
    assert_int_equal(gbg_scene_read(context, "/nowhere/at_all.yaml", &scene), GBG_E_FILE);
    assert_non_null(strstr(gbg_message(context), "/nowhere/at_all.yaml"));
    assert_int_equal(gbg_scene_read(context, "/tmp", &scene), GBG_E_FILE);
    assert_int_equal(read_text("", &scene), GBG_E_SCENE);
    assert_int_equal(read_text("# nothing\n", &scene), GBG_E_SCENE);
    assert_int_equal(read_text("5\n", &scene), GBG_E_FORMAT);
    assert_int_equal(read_text("[]\n", &scene), GBG_E_FORMAT);
    assert_int_equal(read_text("{}\n", &scene), GBG_E_SCENE);
    assert_int_equal(read_text("box: {size: [1, 2, 3, 4]}\n", &scene), GBG_E_ARGUMENT);
    assert_non_null(strstr(gbg_message(context), "box.size: 4 lengths given, allowed 2, 3"));
    assert_int_equal(gbg_scene_read(NULL, path, &scene), GBG_E_ARGUMENT);
    assert_int_equal(gbg_scene_read(context, NULL, &scene), GBG_E_ARGUMENT);
    assert_int_equal(gbg_scene_read(context, path, NULL), GBG_E_ARGUMENT);

    size_t bytes = 1200000;
    char *large = malloc(bytes);
    static const char fill[] = "[{x";
    for (int f = 0; f < 3; f++) {
        memset(large, fill[f], bytes);
        write_file(large, bytes);
        assert_int_equal(gbg_scene_read(context, path, &scene), GBG_E_FORMAT);
        write_file(large, 100000);
        assert_int_equal(gbg_scene_read(context, path, &scene), GBG_E_FORMAT);
    }
    for (size_t i = 0; i < bytes; i += 2) {
        memcpy(large + i, "0,", 2);
    }
    memcpy(large, "forces: [0", 10);
    write_file(large, 1000000);
    assert_int_equal(gbg_scene_read(context, path, &scene), GBG_E_FORMAT);
    assert_non_null(strstr(gbg_message(context), ":1: too many keys, allowed 4096"));
    memset(large, 'k', 200);
    memcpy(large + 200, ": 1\n", 4);
    write_file(large, 204);
    assert_int_equal(gbg_scene_read(context, path, &scene), GBG_E_FORMAT);
    assert_non_null(strstr(gbg_message(context), ":1: a key is no word or longer"));
    free(large);
}

/* Changes a few bytes, cuts, doubles and swaps pieces of the good file, the same for all runs. */
static size_t mutate(uint64_t number, char *text, size_t bytes)
{
    static const char alphabet[] = "{}[]:,-#&*!|>'\"%@\n\t \\~0e.\x80\xff\x01";
    size_t length = bytes;
    for (uint64_t k = 0; k < 1 + number % 6; k++) {
        struct gbg_philox w = gbg_philox(gbg_philox_counter(number, k, 0), 1, 2);
        size_t at = w.word[0] % length, piece = 1 + w.word[1] % 40;
        piece = piece < length - at ? piece : length - at;
        switch (w.word[2] % 4) {
        case 0:
            text[at] = alphabet[w.word[3] % (sizeof alphabet - 1)];
            break;
        case 1:
            text[at] = (char)w.word[3];
            break;
        case 2:
            memmove(text + at, text + at + piece, length - at - piece);
            length = length - piece > 1 ? length - piece : 1;
            break;
        default:
            memmove(text + at + piece, text + at, length - at);
            length += piece;
        }
    }
    return length;
}

static void mutated_files_have_a_clean_end(void **state)
{
    (void)state;
    int accepted = 0, refused = 0;
    for (uint64_t number = 0; number < 1500; number++) {
        char text[8192];
        gbg_text_copy(text, sizeof text, file_with(0, ""));
        size_t bytes = mutate(number, text, strlen(text));
        struct gbg_scene *scene;
        write_file(text, bytes);
        int status = gbg_scene_read(context, path, &scene);
        if (status == GBG_OK) {
            accepted++;
            gbg_scene_destroy(&scene);
            continue;
        }
        refused++;
        assert_true(status > 0);
        assert_null(scene);
        const char *message = gbg_message(context);
        assert_true(strncmp(message, path, strlen(path)) == 0 && message[strlen(path)] == ':');
        for (const char *c = message; *c; c++) {
            assert_true((unsigned char)*c >= ' ');
        }
    }
    if (accepted < 5 || refused < 500) {
        fail_msg("%d accepted, %d refused", accepted, refused);
    }
}

static void failing_allocations_are_refused(void **state)
{
    (void)state;
    struct gbg_scene *scene;
    int status = GBG_E_MEMORY, failures = -1;
    write_file(file_with(0, ""), strlen(file_with(0, "")));
    for (int n = 1; status == GBG_E_MEMORY; n++, failures++) {
        gbg_memory_fail_after(n);
        status = gbg_scene_read(context, path, &scene);
        gbg_memory_fail_after(0);
    }
    assert_int_equal(status, GBG_OK);
    assert_true(failures > 20);
    gbg_scene_destroy(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_key_arrives),
        cmocka_unit_test(every_option_has_its_key),
        cmocka_unit_test(short_files_mean_what_they_say),
        cmocka_unit_test(bad_lines_are_named),
        cmocka_unit_test(odd_files_are_refused),
        cmocka_unit_test(mutated_files_have_a_clean_end),
        cmocka_unit_test(failing_allocations_are_refused),
    };
    return cmocka_run_group_tests(tests, make_context, drop_context);
}
