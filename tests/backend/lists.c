/* Tests of a GPU against the CPU: cells, pair lists and when they are built, entry by entry. */
#include "both.h"

#include "backend/cpu/list.h"
#include "core/memory.h"
#include "cuda/rows.h"

static struct made_particles made;

struct lists {
    struct both both;
    struct gbg_list *list[2];
};

static const struct gbg_kernels *kernels_of(const struct lists *lists, int b)
{
    return lists->both.engine[b]->kernels;
}

static struct lists make_lists(struct gbg_scene scene, double reach, double radius)
{
    struct lists lists = {.both = both_make(scene, &made)};
    for (int b = 0; b < 2; b++) {
        struct gbg_engine *engine = lists.both.engine[b];
        assert_int_equal(engine->kernels->list_create(engine->device, &engine->state, reach, radius,
                                                      &lists.list[b]),
                         GBG_OK);
    }
    return lists;
}

static void free_lists(struct lists *lists)
{
    for (int b = 0; b < 2; b++) {
        kernels_of(lists, b)->list_destroy(lists->both.engine[b]->device, lists->list[b]);
    }
    both_free(&lists->both);
}

static void update(struct lists *lists, double moved)
{
    for (int b = 0; b < 2; b++) {
        struct gbg_engine *engine = lists->both.engine[b];
        int status =
            engine->kernels->list_update(engine->device, &engine->state, lists->list[b], moved);
        if (status != GBG_OK) {
            fail_msg("%s", gbg_message(engine->context));
        }
    }
    assert_int_equal(kernels_of(lists, 0)->list_builds(lists->list[0]),
                     kernels_of(lists, 1)->list_builds(lists->list[1]));
}

static void same_cells(struct lists *lists)
{
    const struct gbg_grid *p = &lists->list[0]->grid;
    const struct gbg_cuda_grid *q = gbg_cuda_list_grid(lists->list[1]);
    size_t words = (size_t)p->n * 4;
    assert_int_equal(p->n, q->n);
    assert_int_equal(p->n_cells, q->n_cells);
    assert_memory_equal(p->cells, q->cells, sizeof p->cells);
    both_same(&lists->both, p->first, q->first, (size_t)(p->n_cells + 1) * 4, "starts of cells");
    both_same(&lists->both, p->particle, q->particle, words, "particles in cells");
    both_same(&lists->both, p->cell_of, q->cell_of, words, "cells of particles");
    for (int a = 0; a < p->dimension; a++) {
        both_same(&lists->both, p->high[a], q->high[a], words, "coordinates in cells");
    }
}

static void same_coordinates(struct lists *lists)
{
    const struct gbg_list *p = lists->list[0];
    const struct gbg_cuda_rows *q = gbg_cuda_list_rows(lists->list[1]);
    size_t words = (size_t)p->n * 4;
    assert_int_equal(p->n, q->n);
    for (int a = 0; a < p->dimension; a++) {
        assert_int_equal(p->shift[a], q->shift[a]);
        assert_memory_equal(&p->scale[a], &q->scale[a], sizeof p->scale[a]);
        both_same(&lists->both, p->local[a], q->local[a], words, "local coordinates");
        both_same(&lists->both, p->built[a], q->built[a], words, "coordinates of the list");
        both_same(&lists->both, p->built_high[a], q->built_high[a], words,
                  "high words of the list");
    }
}

/* Neighbours of particle i in the CPU's list: every 16th number from `row` on. */
static int64_t cpu_row(const struct gbg_list *list, int64_t i, const int32_t **row)
{
    int64_t slice = i / GBG_SLICE, count = 0;
    int c = 0;
    while (slice >= list->chunk[c].end_slice) {
        c++;
    }
    *row = list->chunk[c].index + list->offset[slice] + i % GBG_SLICE;
    while (count < list->width[slice] && (*row)[count * GBG_SLICE] != i) {
        count++;
    }
    return count;
}

/* A slice of the GPU's list: rows like the CPU's, filled up to the longest of them. */
static int64_t same_slice(const struct gbg_list *list, int64_t slice, int32_t width,
                          const int32_t *index)
{
    int64_t longest = 0;
    for (int l = 0; l < GBG_CUDA_SLICE; l++) {
        int64_t i = slice * GBG_CUDA_SLICE + l, count = 0;
        const int32_t *row = NULL;
        int32_t self = (int32_t)(i < list->n ? i : list->n - 1);
        if (i < list->n) {
            count = cpu_row(list, i, &row);
        }
        assert_true(count <= width);
        for (int64_t k = 0; k < width; k++) {
            int32_t wanted = k < count ? row[k * GBG_SLICE] : self;
            if (index[k * GBG_CUDA_SLICE + l] != wanted) {
                fail_msg("neighbour %d of %d: %d, not %d", (int)k, (int)i,
                         index[k * GBG_CUDA_SLICE + l], wanted);
            }
        }
        longest = count > longest ? count : longest;
    }
    return longest;
}

/* Returns the longest row. */
static int64_t same_rows(struct lists *lists)
{
    struct gbg_engine *gpu = lists->both.engine[1];
    const struct gbg_cuda_rows *q = gbg_cuda_list_rows(lists->list[1]);
    int64_t *offset = both_copy(gpu, q->offset, (size_t)q->slices * 8), longest = 0, entries = 0;
    int32_t *width = both_copy(gpu, q->width, (size_t)q->slices * 4);
    for (int64_t s = 0; s < q->slices; s++) {
        int64_t end = offset[s] + (int64_t)width[s] * GBG_CUDA_SLICE;
        entries = end > entries ? end : entries;
    }
    char *taken = calloc((size_t)entries / GBG_CUDA_SLICE + 1, 1);
    for (int64_t s = 0; s < q->slices; s++) { /* in any order, but none over another */
        assert_true(offset[s] >= 0);
        assert_int_equal(offset[s] % GBG_CUDA_SLICE, 0);
        for (int32_t k = 0; k < width[s]; k++) {
            assert_int_equal(taken[offset[s] / GBG_CUDA_SLICE + k]++, 0);
        }
        int32_t *index =
            both_copy(gpu, q->index + offset[s], (size_t)width[s] * GBG_CUDA_SLICE * sizeof *index);
        int64_t here = same_slice(lists->list[0], s, width[s], index);
        free(index);
        assert_int_equal(here, width[s]);
        longest = here > longest ? here : longest;
    }
    free(taken);
    free(offset);
    free(width);
    return longest;
}

static int64_t same_lists(struct lists *lists)
{
    same_cells(lists);
    same_coordinates(lists);
    return same_rows(lists);
}

static struct gbg_scene plain_scene(struct gbg_context *context, int dimension,
                                    const double *length)
{
    struct gbg_scene scene = made_scene(context, dimension, length);
    scene.rule = GBG_RULE_NONE;
    return scene;
}

/* Builds once, in the order of ids and in a new one, and compares; the longest row. */
static int64_t compare_builds(struct gbg_scene scene, double reach, double radius)
{
    struct lists lists = make_lists(scene, reach, radius);
    update(&lists, 0.0);
    int64_t longest = same_lists(&lists);
    for (int b = 0; b < 2; b++) {
        struct gbg_engine *engine = lists.both.engine[b];
        assert_int_equal(engine->kernels->arrange(engine->device, &engine->state, 1), GBG_OK);
    }
    update(&lists, 0.0); /* another order: the list is built anew */
    assert_int_equal(kernels_of(&lists, 1)->list_builds(lists.list[1]), 2);
    assert_int_equal(same_lists(&lists), longest);
    assert_true(kernels_of(&lists, 1)->list_bytes(lists.list[1]) > 0.0);
    free_lists(&lists);
    return longest;
}

/* Rows of all lengths, each sorted in its own way: up to 32, 64 and 256 neighbours, and more; fewer
 * than 3 cells an axis with the last. */
static void lists_are_the_same(void **state)
{
    (void)state;
    static const double radius[4][2] = {{1.4, 1.6}, {3.0, 2.6}, {4.9, 4.5}, {15.0, 8.0}};
    static const int64_t least[4] = {4, 33, 65, 257};
    for (int dimension = 2; dimension <= 3; dimension++) {
        double length[3] = {50.0, dimension == 2 ? 70.0 : 22.0, 17.0};
        length[0] = dimension == 2 ? length[0] : 15.0;
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = plain_scene(context, dimension, length);
        made_lattice(&made, &scene, dimension == 2 ? 67 : 16, 0.4);
        for (int k = 0; k < 4; k++) {
            double reach = radius[k][dimension - 2];
            int64_t longest = compare_builds(scene, 0.9 * reach, reach);
            printf("%dD, radius %g: up to %d neighbours\n", dimension, reach, (int)longest);
            assert_true(longest >= least[k]);
        }
        gbg_context_destroy(&context);
    }
}

/* Slices that are not full, and rows without neighbours. */
static void few_particles_are_listed(void **state)
{
    (void)state;
    static const int64_t numbers[] = {1, 2, 31, 32, 33, 65, 127, 129, 1000};
    for (int dimension = 2; dimension <= 3; dimension++) {
        double length[3] = {40.0, 40.0, 12.0};
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = plain_scene(context, dimension, length);
        for (size_t k = 0; k < sizeof numbers / sizeof numbers[0]; k++) {
            made_lattice(&made, &scene, dimension == 2 ? 33 : 10, 0.4);
            made.p.n = numbers[k];
            compare_builds(scene, 1.0, 1.3);
            compare_builds(scene, 3.0, 30.0);
        }
        gbg_context_destroy(&context);
    }
}

static void nobody_is_listed(void **state)
{
    (void)state;
    double length[2] = {40.0, 40.0};
    struct gbg_context *context = made_context("cpu");
    struct gbg_scene scene = plain_scene(context, 2, length);
    made_lattice(&made, &scene, 3, 0.4);
    struct both both = both_make(scene, &made);
    for (int b = 0; b < 2; b++) {
        struct gbg_engine *engine = both.engine[b];
        struct gbg_state none = engine->state;
        struct gbg_list *list;
        none.owned = 0;
        assert_int_equal(engine->kernels->list_create(engine->device, &none, 1.0, 1.3, &list),
                         GBG_OK);
        for (int k = 0; k < 3; k++) {
            assert_int_equal(engine->kernels->list_update(engine->device, &none, list, 0.0),
                             GBG_OK);
        }
        assert_int_equal(engine->kernels->list_builds(list), 1);
        engine->kernels->list_destroy(engine->device, list);
    }
    both_free(&both);
    gbg_context_destroy(&context);
}

/* A cluster in a corner of a box that is empty but for it, and for one particle: many cells that
 * begin at the same slot; a long row, and a slice with no neighbours at all. */
static void make_cluster(const struct gbg_scene *scene, double spacing)
{
    int64_t m = scene->dimension == 2 ? 60 : 15, n = scene->dimension == 2 ? m * m : m * m * m;
    made_lattice(&made, scene, m, 0.0);
    for (int64_t i = 0; i < n; i++) {
        int64_t cell[3] = {i % m, i / m % m, i / m / m};
        for (int a = 0; a < scene->dimension; a++) {
            double shift = made_uniform((uint64_t)(7 * i + a));
            made.store[a][i] =
                scene->origin[a] + 0.4 * scene->length[a] + spacing * ((double)cell[a] + shift);
        }
    }
    for (int64_t i = n - 40; i < n; i++) {
        made.store[0][i] = scene->origin[0] + 0.9 * scene->length[0] + 50.0 * (double)(i - n);
    }
}

static void clusters_are_listed(void **state)
{
    (void)state;
    for (int dimension = 2; dimension <= 3; dimension++) {
        double length[3] = {20000.0, 30000.0, 20000.0};
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = plain_scene(context, dimension, length);
        make_cluster(&scene, 1.0);
        compare_builds(scene, 1.5, 2.0);
        assert_true(compare_builds(scene, 1.5, dimension == 2 ? 25.0 : 7.0) > 500);
        gbg_context_destroy(&context);
    }
}

/* High words that are coarse for the radius: rows are sifted by 64 bits. */
static void coarse_boxes_are_listed(void **state)
{
    (void)state;
    for (int dimension = 2; dimension <= 3; dimension++) {
        double length[3] = {3e9, 2e9, 4e9};
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = plain_scene(context, dimension, length);
        make_cluster(&scene, 0.7);
        assert_true(compare_builds(scene, 1.0, 1.5) > 4);
        gbg_context_destroy(&context);
    }
}

/* The same steps are followed with the same results, and the lists built anew at the same ones. */
static void lists_follow_the_same(void **state)
{
    (void)state;
    for (int dimension = 2; dimension <= 3; dimension++) {
        double length[3] = {50.0, 61.0, 17.0};
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = plain_scene(context, dimension, length);
        scene.temperature = 0.1;
        made_lattice(&made, &scene, dimension == 2 ? 67 : 16, 0.4);
        struct lists lists = make_lists(scene, 1.5, 2.3);
        int64_t builds = 0;
        for (int step = 0; step < 30; step++) {
            struct gbg_engine **engine = lists.both.engine;
            float largest;
            for (int b = 0; b < 2; b++) {
                assert_int_equal(gbg_engine_advance(engine[b], 1), GBG_OK);
            }
            update(&lists, step == 20 ? INFINITY : engine[0]->moves.total);
            same_coordinates(&lists);
            builds = kernels_of(&lists, 1)->list_builds(lists.list[1]);
            assert_int_equal(
                gbg_cuda_list_follow(engine[1]->device, &engine[1]->state, lists.list[1], &largest),
                GBG_OK);
            assert_true(largest ==
                        gbg_list_follow(engine[0]->device, &engine[0]->state, lists.list[0]));
            assert_true(step > 0 || largest == 0.0f);
        }
        same_rows(&lists);
        printf("%dD: %d builds in 30 steps\n", dimension, (int)builds);
        assert_true(builds > 2 && builds < 25);
        free_lists(&lists);
        gbg_context_destroy(&context);
    }
}

/* Contacts of the GPU's engine sifted out of its pairs, against those the CPU builds: entry by
 * entry. `whence` 1: out of the pairs; 0: from cells, because the pairs reach less far. */
static void same_sifted(struct gbg_scene scene, double pairs_radius, double radius, int whence)
{
    struct lists contacts = make_lists(scene, 0.9 * radius, radius);
    struct gbg_engine *cpu = contacts.both.engine[0], *gpu = contacts.both.engine[1];
    struct gbg_list *pairs;
    assert_int_equal(gpu->kernels->list_create(gpu->device, &gpu->state, 0.8 * pairs_radius,
                                               pairs_radius, &pairs),
                     GBG_OK);
    for (int arranged = 0; arranged < 2; arranged++) {
        if (arranged) {
            assert_int_equal(cpu->kernels->arrange(cpu->device, &cpu->state, 1), GBG_OK);
            assert_int_equal(gpu->kernels->arrange(gpu->device, &gpu->state, 1), GBG_OK);
        }
        assert_int_equal(cpu->kernels->list_update(cpu->device, &cpu->state, contacts.list[0], 0.0),
                         GBG_OK);
        assert_int_equal(gbg_cuda_lists_build(gpu->device, &gpu->state, pairs, contacts.list[1]),
                         GBG_OK);
        assert_int_equal(gbg_cuda_list_grid(contacts.list[1])->n == 0, whence);
        same_coordinates(&contacts);
        assert_true(same_rows(&contacts) > 1);
    }
    gpu->kernels->list_destroy(gpu->device, pairs);
    free_lists(&contacts);
}

static void contacts_are_sifted(void **state)
{
    (void)state;
    static const double large[3] = {3e9, 2e9, 4e9};
    for (int dimension = 2; dimension <= 3; dimension++) {
        double length[3] = {50.0, dimension == 2 ? 70.0 : 22.0, 17.0};
        length[0] = dimension == 2 ? length[0] : 15.0;
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = plain_scene(context, dimension, length);
        made_lattice(&made, &scene, dimension == 2 ? 67 : 16, 0.4);
        same_sifted(scene, 2.9, 1.4, 1);
        same_sifted(scene, 2.2, 2.2, 1);
        same_sifted(scene, 2.0, 2.1, 0);
        made.p.n = 1001; /* the last slice is not full */
        same_sifted(scene, 2.9, 1.7, 1);
        scene = plain_scene(context, dimension, large); /* sifted by 64 bits */
        make_cluster(&scene, dimension == 2 ? 0.7 : 1.0);
        same_sifted(scene, 2.5, 1.5, 1);
        gbg_context_destroy(&context);
    }
}

/* 1 if slices do not take the same room each. */
static int is_uneven(struct lists *lists)
{
    const struct gbg_cuda_rows *rows = gbg_cuda_list_rows(lists->list[1]);
    int64_t *offset = both_copy(lists->both.engine[1], rows->offset, (size_t)rows->slices * 8);
    int uneven = 0;
    for (int64_t s = 0; s < rows->slices; s++) {
        uneven |= offset[s] != s * offset[1];
    }
    free(offset);
    return uneven;
}

/* An index of even rows that cannot be had is replaced by one of rows of their own lengths;
 * whatever else is missing, by no rows at all. */
static void lists_without_memory_are_compact(void **state)
{
    (void)state;
    double length[2] = {50.0, 70.0};
    struct gbg_context *context = made_context("cpu");
    struct gbg_scene scene = plain_scene(context, 2, length);
    int uneven = 0, unlisted = 0;
    int64_t left = 0;
    made_short_forces(&scene); /* without any there would be no use for a list without rows */
    made_lattice(&made, &scene, 67, 0.4);
    for (int64_t n = 1; left == 0; n++) {
        struct lists lists = make_lists(scene, 1.4, 1.6);
        struct gbg_engine *gpu = lists.both.engine[1], *cpu = lists.both.engine[0];
        for (int build = 0; build < 2; build++) { /* what was refused is not asked for again */
            assert_int_equal(
                cpu->kernels->list_update(cpu->device, &cpu->state, lists.list[0], INFINITY),
                GBG_OK);
            gbg_memory_fail_after(build == 0 ? n : 0);
            assert_int_equal(
                gpu->kernels->list_update(gpu->device, &gpu->state, lists.list[1], INFINITY),
                GBG_OK);
            left = build == 0 ? gbg_memory_fail_after(0) : left;
            if (gpu->kernels->list_is_kept(lists.list[1])) {
                same_lists(&lists);
                uneven += is_uneven(&lists);
            } else {
                unlisted++;
            }
        }
        free_lists(&lists);
    }
    print_message("%d lists of uneven rows, %d without rows\n", uneven, unlisted);
    assert_true(uneven >= 1); /* the room that it took may be enough for even ones the next time */
    assert_true(unlisted >= 6);
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lists_are_the_same),
        cmocka_unit_test(few_particles_are_listed),
        cmocka_unit_test(nobody_is_listed),
        cmocka_unit_test(clusters_are_listed),
        cmocka_unit_test(coarse_boxes_are_listed),
        cmocka_unit_test(lists_follow_the_same),
        cmocka_unit_test(contacts_are_sifted),
        cmocka_unit_test(lists_without_memory_are_compact),
    };
    return both_missing() ? BOTH_SKIPPED : cmocka_run_group_tests(tests, NULL, NULL);
}
