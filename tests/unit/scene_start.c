/* Tests of starts: every pair of cores is measured by a plain double loop. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "core/context.h"
#include "core/memory.h"
#include "scene/draws.h"
#include "scene/lattice.h"
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

static struct gbg_scene *scene_of(int dimension, int64_t count, double packing)
{
    struct gbg_scene *scene;
    assert_int_equal(gbg_scene_create(context, dimension, &scene), GBG_OK);
    assert_int_equal(gbg_scene_set_integer(scene, "particles.count", count), GBG_OK);
    assert_int_equal(gbg_scene_set_real(scene, "box.packing", packing), GBG_OK);
    assert_int_equal(gbg_scene_set_text(scene, "excluded_volume.rule", "bounce"), GBG_OK);
    return scene;
}

static void add_species(struct gbg_scene *scene, double diameter, double fraction)
{
    assert_int_equal(gbg_scene_add_species(scene, NULL, diameter, 1, 1, fraction, -1, NULL),
                     GBG_OK);
}

static void start_of(struct gbg_scene *scene, struct gbg_particles *particles)
{
    int status = gbg_scene_resolve(scene);
    if (status == GBG_OK) {
        status = gbg_scene_start(scene, particles);
    }
    if (status != GBG_OK) {
        fail_msg("%s", gbg_message(context));
    }
}

/* Smallest distance of two centres over the contact distance of the pair. */
static double closest(const struct gbg_scene *scene, const struct gbg_particles *particles)
{
    double least = INFINITY;
    for (int64_t i = 0; i < particles->n; i++) {
        for (int64_t j = 0; j < i; j++) {
            double square = 0;
            for (int a = 0; a < scene->dimension; a++) {
                double d = particles->position[a][i] - particles->position[a][j];
                d -= scene->length[a] * nearbyint(d / scene->length[a]);
                square += d * d;
            }
            double contact = (scene->species[particles->species[i]].diameter +
                              scene->species[particles->species[j]].diameter) /
                             2;
            least = fmin(least, square / (contact * contact));
        }
    }
    return sqrt(least);
}

/* What holds for every start: ids 0 .. n-1, inside the box, the counts of the species, no overlap.
 */
static void check_start(const struct gbg_scene *scene, const struct gbg_particles *particles)
{
    int64_t count[GBG_MAX_SPECIES] = {0};
    assert_int_equal(particles->n, scene->n);
    for (int64_t i = 0; i < particles->n; i++) {
        assert_int_equal(particles->id[i], i);
        count[particles->species[i]]++;
        for (int a = 0; a < scene->dimension; a++) {
            assert_true(particles->position[a][i] >= scene->origin[a]);
            assert_true(particles->position[a][i] < scene->origin[a] + scene->length[a]);
        }
    }
    for (int s = 0; s < scene->n_species; s++) {
        assert_int_equal(count[s], scene->species[s].count);
    }
    assert_true(closest(scene, particles) >= 1);
}

struct start_case {
    int dimension;
    int64_t count;
    double packing;
    const char *key, *kind, *shape;
};

static void starts_have_no_overlap(void **state)
{
    (void)state;
    static const char *const lattice = "particles.start.lattice",
                             *random = "particles.start.random";
    const struct start_case cases[] = {
        {2, 4096, 0.79, lattice, "triangular", "square"},
        {2, 4096, 0.88, lattice, "triangular", "square"},
        {2, 4096, 0.90, lattice, "triangular", "lattice"},
        {2, 2048, 0.52, lattice, "triangular", "square"},
        {2, 1024, 0.7, lattice, "square", "square"},
        {2, 2048, 0.52, random, "insertion", "square"},
        {2, 1000, 0.535, random, "insertion", "square"},
        {3, 2048, 0.40, lattice, "fcc", "square"},
        {3, 2000, 0.73, lattice, "fcc", "lattice"},
        {3, 1000, 0.5, lattice, "cubic", "square"},
        {3, 1024, 0.33, random, "insertion", "square"},
        {2, 13, 0.3, lattice, "triangular", "square"},
    };
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        struct gbg_particles particles;
        struct gbg_scene *scene = scene_of(cases[c].dimension, cases[c].count, cases[c].packing);
        add_species(scene, 1, 0.7);
        add_species(scene, 1, 0.3);
        assert_int_equal(gbg_scene_set_text(scene, cases[c].key, cases[c].kind), GBG_OK);
        assert_int_equal(gbg_scene_set_text(scene, "box.shape", cases[c].shape), GBG_OK);
        assert_int_equal(gbg_scene_set_real(scene, "particles.start.jitter", 1), GBG_OK);
        start_of(scene, &particles);
        check_start(scene, &particles);
        assert_true(fabs(gbg_scene_packing(scene) - cases[c].packing) < 1e-12);
        gbg_particles_release(&particles);
        gbg_scene_destroy(&scene);
    }
}

static void large_and_small_discs_are_inserted(void **state)
{
    (void)state;
    struct gbg_particles particles;
    struct gbg_scene *scene = scene_of(2, 3000, 0.45);
    add_species(scene, 1, 0.9);
    add_species(scene, 20, 0.005);
    add_species(scene, 3, 0.095);
    gbg_scene_set_text(scene, "particles.start.random", "insertion");
    start_of(scene, &particles);
    assert_int_equal(particles.species[0], 1);
    check_start(scene, &particles);
    gbg_particles_release(&particles);
    gbg_scene_destroy(&scene);
}

/* The lattice of a box of 1000:1 is found: its sites are as far apart as 0.9 of the densest. */
static void lattices_fit_long_boxes(void **state)
{
    (void)state;
    const double boxes[][2] = {{1000, 1}, {1, 1000}, {60, 60}, {10, 11}, {300, 1.3}};
    const int64_t numbers[] = {4096, 4096, 4096, 100, 500};
    for (int c = 0; c < 5; c++) {
        struct gbg_sites sites;
        gbg_lattice_fit(2, GBG_LATTICE_TRIANGULAR, boxes[c], numbers[c], &sites);
        double area = boxes[c][0] * boxes[c][1] / (double)numbers[c];
        assert_true(sites.n >= numbers[c]);
        assert_true(sites.distance > 0.9 * sqrt(area * 2 / sqrt(3.0)));
    }
}

/* Boxes far from any use end in a start or a refusal, soon. */
static void absurd_boxes_are_survived(void **state)
{
    (void)state;
    static const double lengths[][3] = {{1e100, 1e-100, 1}, {1e-100, 1e100, 1e100}, {1e100, 2, 2},
                                        {2, 1e100, 1e100},  {1e-99, 1e-99, 1e-99},  {3, 2, 1e5}};
    static const char *const kinds[2][3] = {{"triangular", "square", NULL}, {"fcc", "cubic", NULL}};
    for (int c = 0; c < 6 * 2 * 3 * 2; c++) {
        int dimension = 2 + c % 2, kind = c / 2 % 3, box = c / 6 % 6, cores = c / 36;
        struct gbg_particles particles;
        struct gbg_scene *scene;
        gbg_scene_create(context, dimension, &scene);
        add_species(scene, 1, 1);
        gbg_scene_set_integer(scene, "particles.count", 1000);
        gbg_scene_set_real(scene, "particles.start.jitter", 1);
        gbg_scene_set_text(scene, "excluded_volume.rule", cores ? "contact" : "none");
        assert_int_equal(gbg_scene_set_box(scene, lengths[box], NULL), GBG_OK);
        const char *lattice = kinds[dimension - 2][kind];
        gbg_scene_set_text(scene, lattice ? "particles.start.lattice" : "particles.start.random",
                           lattice ? lattice : "insertion");
        int status = gbg_scene_resolve(scene);
        if (status == GBG_OK) {
            status = gbg_scene_start(scene, &particles);
        }
        assert_true(status == GBG_OK || status == GBG_E_SCENE);
        assert_true(status == GBG_OK || cores);
        if (status == GBG_OK) {
            assert_int_equal(particles.n, 1000);
            assert_true(!cores || closest(scene, &particles) >= 1);
            gbg_particles_release(&particles);
        }
        gbg_scene_destroy(&scene);
    }
}

/* The distance that a fit claims is the smallest distance of its sites. */
static void lattices_keep_the_distance_they_claim(void **state)
{
    (void)state;
    const double length[3] = {9, 11, 8};
    for (int kind = GBG_LATTICE_TRIANGULAR; kind <= GBG_LATTICE_CUBIC; kind++) {
        int dimension = kind <= GBG_LATTICE_SQUARE ? 2 : 3;
        for (int64_t n = 30; n < 150; n += 7) {
            struct gbg_sites sites;
            double site[400][3], least = INFINITY;
            gbg_lattice_fit(dimension, kind, length, n, &sites);
            assert_true(sites.n >= n && sites.n <= 400);
            for (int64_t s = 0; s < sites.n; s++) {
                gbg_lattice_site(&sites, s, site[s]);
                for (int64_t t = 0; t < s; t++) {
                    double square = 0;
                    for (int a = 0; a < dimension; a++) {
                        double d = site[s][a] - site[t][a];
                        d -= length[a] * nearbyint(d / length[a]);
                        square += d * d;
                    }
                    least = fmin(least, sqrt(square));
                }
            }
            assert_true(fabs(least - sites.distance) < 1e-12);
        }
    }
}

static void starts_follow_the_seed(void **state)
{
    (void)state;
    static const char *const keys[][2] = {{"particles.start.lattice", "triangular"},
                                          {"particles.start.random", "insertion"}};
    for (int k = 0; k < 2; k++) {
        struct gbg_particles start[3];
        for (int run = 0; run < 3; run++) {
            struct gbg_scene *scene = scene_of(2, 500, 0.45);
            add_species(scene, 1, 0.5);
            add_species(scene, 1, 0.5);
            gbg_scene_set_text(scene, keys[k][0], keys[k][1]);
            gbg_scene_set_real(scene, "particles.start.jitter", 0.5);
            gbg_scene_set_integer(scene, "run.seed", run == 2 ? 8 : 7);
            start_of(scene, &start[run]);
            gbg_scene_destroy(&scene);
        }
        size_t bytes = 500 * sizeof(double);
        assert_memory_equal(start[0].position[0], start[1].position[0], bytes);
        assert_memory_equal(start[0].position[1], start[1].position[1], bytes);
        assert_memory_equal(start[0].species, start[1].species, 500 * sizeof(int32_t));
        assert_memory_not_equal(start[0].position[0], start[2].position[0], bytes);
        for (int run = 0; run < 3; run++) {
            gbg_particles_release(&start[run]);
        }
    }
}

/* Vacancies and species are uniform over the sites: each half of the box has its share. */
static void vacancies_and_species_are_spread(void **state)
{
    (void)state;
    struct gbg_particles particles;
    struct gbg_scene *scene = scene_of(2, 10000, 0.6);
    add_species(scene, 1, 0.25);
    add_species(scene, 1, 0.75);
    gbg_scene_set_text(scene, "particles.start.lattice", "triangular");
    start_of(scene, &particles);
    int low = 0, low_first = 0;
    for (int64_t i = 0; i < particles.n; i++) {
        if (particles.position[1][i] < scene->length[1] / 2) {
            low++;
            low_first += particles.species[i] == 0;
        }
    }
    assert_in_range(low, 4800, 5200);
    assert_in_range(low_first, 1100, 1400);
    gbg_particles_release(&particles);
    gbg_scene_destroy(&scene);
}

/* More than are chosen before they are placed: each at the site that a plain loop over the sites
 * gives it, whatever the threads. */
static void large_lattices_are_made_by_threads(void **state)
{
    (void)state;
    enum { N = 1100000 };
    for (int threads = 1; threads <= 3; threads += 2) {
        for (int vacant = 0; vacant < 2; vacant++) {
            struct gbg_scene *scene = scene_of(2, N, 0.4);
            struct gbg_particles particles;
            struct gbg_sites sites;
            int64_t i = 0;
            add_species(scene, 1.0, 1.0);
            scene->context->threads = threads;
            assert_int_equal(gbg_scene_set_text(scene, "particles.start.lattice", "triangular"),
                             GBG_OK);
            assert_int_equal(gbg_scene_set_real(scene, "particles.start.jitter", 0.0), GBG_OK);
            assert_int_equal(
                gbg_scene_set_real(scene, "particles.start.vacancies", vacant ? 0.03 : 0.0),
                GBG_OK);
            start_of(scene, &particles);
            int64_t wanted = (int64_t)ceil(N / (1 - scene->vacancies) - 1e-9);
            gbg_lattice_fit(2, GBG_LATTICE_TRIANGULAR, scene->length, wanted, &sites);
            for (int64_t s = 0; s < sites.n && i < N; s++) {
                double site[3];
                if (gbg_draw_below(scene, GBG_DRAW_SITE, s, sites.n - s) >= N - i) {
                    continue;
                }
                gbg_lattice_site(&sites, s, site);
                assert_true(particles.position[0][i] == site[0]);
                assert_true(particles.position[1][i] == site[1]);
                assert_int_equal(particles.id[i], i);
                assert_int_equal(particles.species[i], 0);
                i++;
            }
            assert_int_equal(i, N);
            gbg_particles_release(&particles);
            gbg_scene_destroy(&scene);
        }
    }
}

static void what_cannot_be_placed_is_refused(void **state)
{
    (void)state;
    struct gbg_particles particles;
    struct gbg_scene *scene = scene_of(2, 101, 0.9);
    add_species(scene, 1, 1);
    gbg_scene_set_text(scene, "particles.start.lattice", "triangular");
    assert_int_equal(gbg_scene_resolve(scene), GBG_OK);
    assert_int_equal(gbg_scene_start(scene, &particles), GBG_E_SCENE);
    const char *named = strstr(gbg_message(context), "up to ");
    double fits;
    assert_non_null(named);
    assert_int_equal(sscanf(named, "up to %lf", &fits), 1);
    gbg_scene_set_real(scene, "box.packing", fits);
    start_of(scene, &particles);
    check_start(scene, &particles);
    gbg_particles_release(&particles);

    gbg_scene_set_text(scene, "particles.start.random", "insertion");
    gbg_scene_set_real(scene, "box.packing", 0.6);
    assert_int_equal(gbg_scene_resolve(scene), GBG_OK);
    assert_int_equal(gbg_scene_start(scene, &particles), GBG_E_SCENE);
    assert_non_null(strstr(gbg_message(context), "lattice"));
    assert_null(particles.id);
    gbg_scene_destroy(&scene);
}

/* Insertion goes on until no place is left: the packing it reaches is that of random sequential
 * adsorption, 0.54707 in the plane (here within 4 standard deviations, 0.002 each for 6000 discs).
 */
static void insertion_saturates_where_it_must(void **state)
{
    (void)state;
    struct gbg_particles particles;
    struct gbg_scene *scene = scene_of(2, 6000, 0.6);
    double reached;
    add_species(scene, 1, 0.5);
    add_species(scene, 1, 0.5);
    gbg_scene_set_text(scene, "particles.start.random", "insertion");
    assert_int_equal(gbg_scene_resolve(scene), GBG_OK);
    assert_int_equal(gbg_scene_start(scene, &particles), GBG_E_SCENE);
    const char *named = strstr(gbg_message(context), "at packing ");
    assert_non_null(named);
    assert_int_equal(sscanf(named, "at packing %lf", &reached), 1);
    assert_true(fabs(reached - 0.54707) < 0.008);
    gbg_scene_destroy(&scene);
}

static void points_without_cores_are_placed_anyhow(void **state)
{
    (void)state;
    struct gbg_particles particles;
    struct gbg_scene *scene;
    const double length[3] = {4, 0.004, 2}, origin[3] = {-2, 5, 0};
    const int64_t numbers[] = {0, 1, 2, 3, 1000};
    gbg_scene_create(context, 3, &scene);
    assert_int_equal(gbg_scene_set_box(scene, length, origin), GBG_OK);
    add_species(scene, 1, 1);
    for (int c = 0; c < 10; c++) {
        gbg_scene_set_integer(scene, "particles.count", numbers[c / 2]);
        gbg_scene_set_text(scene, c % 2 ? "particles.start.lattice" : "particles.start.random",
                           c % 2 ? "fcc" : "insertion");
        gbg_scene_set_real(scene, "particles.start.jitter", 0.9);
        start_of(scene, &particles);
        assert_int_equal(particles.n, numbers[c / 2]);
        assert_true(particles.n < 2 || closest(scene, &particles) > 0);
        gbg_particles_release(&particles);
    }
    gbg_scene_destroy(&scene);
}

static void arrays_come_back_sorted_and_wrapped(void **state)
{
    (void)state;
    struct gbg_particles particles;
    struct gbg_scene *scene;
    const double length[2] = {10, 4}, origin[2] = {-5, 1};
    const double xy[] = {1, 2, 1e300, -1e300, 27.5, 1, -5, 5, 0, 0};
    const int64_t ids[] = {40, 7, 9};
    const int32_t species[] = {1, 2, 1};
    gbg_scene_create(context, 2, &scene);
    add_species(scene, 1, -1);
    add_species(scene, 1, -1);
    assert_int_equal(gbg_scene_set_box(scene, length, origin), GBG_OK);
    assert_int_equal(gbg_scene_add_particles(scene, 3, xy, xy + 1, NULL, 2, species, 1, ids), 0);
    assert_int_equal(gbg_scene_add_particles(scene, 2, xy + 6, xy + 7, NULL, 2, NULL, 0, NULL), 0);
    start_of(scene, &particles);
    const int64_t sorted[] = {7, 9, 40, 41, 42};
    assert_memory_equal(particles.id, sorted, sizeof sorted);
    assert_true(particles.position[0][1] == -2.5 && particles.position[1][1] == 1);
    assert_true(particles.position[0][3] == -5 && particles.position[1][3] == 1);
    assert_true(particles.position[0][4] == 0 && particles.position[1][4] == 4);
    assert_true(particles.position[0][0] >= -5 && particles.position[0][0] < 5);
    assert_int_equal(particles.species[0], 1);
    assert_int_equal(particles.species[2], 0);
    assert_int_equal(scene->species[0].count, 4);
    gbg_particles_release(&particles);
    gbg_scene_destroy(&scene);
}

/* Every allocation of a start fails in turn; nothing is left behind and the next try succeeds. */
static void failing_allocations_are_refused(void **state)
{
    (void)state;
    static const char *const keys[][2] = {{"particles.start.lattice", "triangular"},
                                          {"particles.start.random", "insertion"}};
    for (int k = 0; k < 2; k++) {
        struct gbg_scene *scene = scene_of(2, 50, 0.3);
        add_species(scene, 1, 1);
        gbg_scene_set_text(scene, keys[k][0], keys[k][1]);
        assert_int_equal(gbg_scene_resolve(scene), GBG_OK);
        int status = GBG_E_MEMORY, failures = -1;
        for (int n = 1; status == GBG_E_MEMORY; n++, failures++) {
            struct gbg_particles particles;
            gbg_memory_fail_after(n);
            status = gbg_scene_start(scene, &particles);
            gbg_memory_fail_after(0);
            if (status == GBG_OK) {
                gbg_particles_release(&particles);
            } else {
                assert_null(particles.id);
            }
        }
        assert_int_equal(status, GBG_OK);
        assert_true(failures >= 4);
        gbg_scene_destroy(&scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(starts_have_no_overlap),
        cmocka_unit_test(large_and_small_discs_are_inserted),
        cmocka_unit_test(lattices_fit_long_boxes),
        cmocka_unit_test(absurd_boxes_are_survived),
        cmocka_unit_test(lattices_keep_the_distance_they_claim),
        cmocka_unit_test(starts_follow_the_seed),
        cmocka_unit_test(vacancies_and_species_are_spread),
        cmocka_unit_test(large_lattices_are_made_by_threads),
        cmocka_unit_test(what_cannot_be_placed_is_refused),
        cmocka_unit_test(insertion_saturates_where_it_must),
        cmocka_unit_test(points_without_cores_are_placed_anyhow),
        cmocka_unit_test(arrays_come_back_sorted_and_wrapped),
        cmocka_unit_test(failing_allocations_are_refused),
    };
    return cmocka_run_group_tests(tests, make_context, drop_context);
}
