/* Tests of a GPU against the CPU: sums over all images by a mesh. Both have the same plan, so that
 * what differs is rounding alone. Single precision: pairs are off by some 4 units of 2^-24 each,
 * nodes by the root of their some 20 to 40 terms, transforms by the logarithm of their size:
 * together below 16 units of the largest part of a force, 1e-6; doubled, because the parts can be
 * larger than their sum. Double precision: the same of 2^-53 is 2e-15, times what window
 * polynomials lose, which are good to 2e-16 of sums of terms some hundred times as large. */
#include "mesh_state.h"

#include <stdio.h>

enum { SKIPPED = 77 }; /* ctest's SKIP_RETURN_CODE */

static const double bound[2] = {1e-12, 2e-6}; /* double, single */

static const struct recipe recipes[] = {
    {"prolate, 6 and 8", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, 1, {6, 8}, 9.0, 1.25},
    {"prolate, 5 and 7", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, 1, {5, 7}, 8.0, 1.3},
    {"prolate, 8 and 9", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, 1, {8, 9}, 12.0, 1.25},
    {"B-spline, 5 and 6", GBG_SPLIT_GAUSSIAN, GBG_EWALD_BSPLINE, 1, {5, 6}, 16.0, 1.5},
    {"B-spline, 3 and 4", GBG_SPLIT_GAUSSIAN, GBG_EWALD_BSPLINE, 1, {3, 4}, 10.0, 2.0},
    {"prolate, 13 and 15", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, 1, {13, 15}, 14.0, 1.6},
    {"prolate, 9 and 11, double", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, 0, {9, 11}, 15.0, 1.25},
    {"prolate, 12 and 14, double", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, 0, {12, 14}, 22.0, 1.4},
    {"prolate, 16 and 16, double", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, 0, {16, 16}, 28.0, 1.7},
    {"B-spline, 7 and 8, double", GBG_SPLIT_GAUSSIAN, GBG_EWALD_BSPLINE, 0, {7, 8}, 24.0, 2.0},
};
enum { RECIPES = sizeof recipes / sizeof *recipes };

struct box {
    int dimension;
    double length[3];
};
/* A square, oblong ones, cubes, and units in which floats would not hold 1/r^6. */
static const struct box boxes[] = {{2, {32.0, 32.0, 1.0}},
                                   {3, {10.0, 10.0, 10.0}},
                                   {2, {20.0, 96.0, 1.0}},
                                   {3, {6.0, 14.0, 9.0}},
                                   {2, {0x1p-40, 0x1p-41, 1.0}}};
enum { BOXES = sizeof boxes / sizeof *boxes };

static struct bench side[2]; /* CPU, GPU */

static void open_side(int b, const char *name, const char *text)
{
    if (gbg_context_create(text, &side[b].context) != GBG_OK) {
        fail_msg("%s", gbg_message(NULL));
    }
    side[b].backend = gbg_backend_find(name);
    assert_int_equal(side[b].backend->create(side[b].context, &side[b].device), GBG_OK);
    side[b].kernels = side[b].backend->kernels(side[b].device);
}

static int open_sides(void **state)
{
    (void)state;
    open_side(0, "cpu", "cpu:threads=2");
    open_side(1, "cuda", "cuda:0");
    return 0;
}

static int close_sides(void **state)
{
    (void)state;
    bench_close(&side[0]);
    bench_close(&side[1]);
    return 0;
}

/* Under a sanitizer a part of the cases has to do (GBG_TESTS_PART, as in both.h). */
static int takes(int k)
{
    const char *part = getenv("GBG_TESTS_PART");
    int of = part ? atoi(part) : 1;
    return of < 2 || k % of == 0;
}

static void *put(const struct bench *b, const void *from, int64_t n, size_t size)
{
    void *there = NULL;
    if (from) {
        assert_int_equal(b->backend->allocate(b->device, &there, n, size, "test"), GBG_OK);
        assert_int_equal(b->backend->upload(b->device, there, from, (size_t)n * size), GBG_OK);
    }
    return there;
}

/* The same state in a backend's memory. */
static struct gbg_state copy_state(const struct bench *b, const struct gbg_state *from)
{
    struct gbg_state to = *from;
    int64_t n = from->owned;
    for (int a = 0; a < from->box.dimension; a++) {
        to.high[a] = put(b, from->high[a], n, 4);
        to.low[a] = put(b, from->low[a], n, 4);
        to.force[a] = put(b, from->force[a], n, sizeof(double));
    }
    to.id = put(b, from->id, n, sizeof *to.id);
    to.rank = put(b, from->rank, n, sizeof *to.rank);
    to.species = put(b, from->species, n, 1);
    to.own_alpha = put(b, from->own_alpha, n, sizeof(double));
    return to;
}

static void free_state(const struct bench *b, struct gbg_state *state)
{
    for (int a = 0; a < state->box.dimension; a++) {
        b->backend->release(b->device, state->high[a]);
        b->backend->release(b->device, state->low[a]);
        b->backend->release(b->device, state->force[a]);
    }
    b->backend->release(b->device, state->id);
    b->backend->release(b->device, state->rank);
    b->backend->release(b->device, state->species);
    b->backend->release(b->device, state->own_alpha);
}

static void right(const struct bench *b, int status)
{
    if (status != GBG_OK) {
        fail_msg("%s", gbg_message(b->context));
    }
}

/* What one backend makes of particles: forces of all axes one after the other, then potentials, all
 * by ids. */
struct result {
    int64_t n;
    int dimension;
    double *force, *potential;
};

static void read_by_id(const struct bench *b, const struct particles *p, const double *there,
                       double *to)
{
    int64_t n = p->state.owned;
    double *copy = new_array(n, sizeof *copy);
    assert_int_equal(b->backend->download(b->device, copy, there, (size_t)n * sizeof *copy),
                     GBG_OK);
    for (int64_t i = 0; i < n; i++) {
        to[i] = copy[p->place[i]];
    }
    free(copy);
}

/* added: forces are made twice, the second time added. */
static struct result results_of(const struct bench *b, const struct gbg_ewald_plan *plan,
                                const struct particles *p, int added)
{
    struct gbg_state state = copy_state(b, &p->state);
    struct result r = {state.owned, state.box.dimension, NULL, NULL};
    struct gbg_ewald *sum;
    double *potential = put(b, p->state.force[0], r.n, sizeof *potential);
    r.force = new_array(3 * r.n, sizeof *r.force);
    r.potential = new_array(r.n, sizeof *r.potential);
    right(b, b->kernels->ewald_create(b->device, &state, plan, 1, &sum));
    assert_true(b->kernels->ewald_bytes(sum) > 0.0);
    right(b, b->kernels->ewald_force(b->device, &state, sum, 0));
    right(b, b->kernels->ewald_potential(b->device, &state, sum, potential));
    if (added) {
        right(b, b->kernels->ewald_force(b->device, &state, sum, 1));
    }
    for (int a = 0; a < r.dimension; a++) {
        read_by_id(b, p, state.force[a], r.force + a * r.n);
    }
    read_by_id(b, p, potential, r.potential);
    b->kernels->ewald_destroy(b->device, sum);
    b->backend->release(b->device, potential);
    free_state(b, &state);
    return r;
}

static void free_result(struct result *r)
{
    free(r->force);
    free(r->potential);
}

/* RMS of the difference over that of the values, or over `least` where there is next to none. */
static double distance(const double *p, const double *q, int64_t n, double least)
{
    double error = 0.0, size = 0.0;
    for (int64_t i = 0; i < n; i++) {
        error += (p[i] - q[i]) * (p[i] - q[i]);
        size += q[i] * q[i];
    }
    return n > 0 ? sqrt(error / (double)n) / fmax(sqrt(size / (double)n), least) : 0.0;
}

/* Species in place of alphas of their own, and mobilities. */
static void give_species(struct particles *p)
{
    struct gbg_state *state = &p->state;
    static const double alpha[3] = {-1.7, 0.6, 2.5}, mobility[3] = {1.0, -0.4, 0.8};
    state->species = new_array(state->owned, 1);
    state->n_species = 3;
    for (int64_t i = 0; i < state->owned; i++) {
        state->species[i] = (uint8_t)(p->place[i] * 7 / 3 % 3);
    }
    memcpy(state->alpha, alpha, sizeof alpha);
    memcpy(state->mobility, mobility, sizeof mobility);
    free(state->own_alpha);
    state->own_alpha = NULL;
}

/* Single precision keeps 32 bits of a place, and each backend chooses from which one on: places are
 * made such that both have all of them. */
static void leave_high_words(struct particles *p)
{
    for (int a = 0; a < p->state.box.dimension; a++) {
        memset(p->state.low[a], 0, (size_t)p->state.owned * 4);
    }
}

static void free_particles(struct particles *p)
{
    free(p->state.species);
    particles_free(p);
}

/* Largest force and potential of the smooth part of one source: where the sums themselves are next
 * to nothing, as for a few particles, parts of this size cancel. */
static void far_sizes(const struct gbg_ewald_plan *plan, double scale[2])
{
    const struct gbg_split *split = &plan->split;
    double power = split->power, most = 0.0;
    for (int m = 1; m <= 64; m++) {
        double u = m / 64.0, z = 2.0 * u * u - 1.0, sum = 0.0;
        for (int k = split->degree; k >= 0; k--) {
            sum = sum * z + split->near[k];
        }
        most = fmax(most, fabs(u * sum));
    }
    scale[0] = most * pow(split->reach, -power);
    scale[1] = power == 1.0 ? 1.0 : fabs(split->self);
}

/* Errors of forces and potentials on the same particles, and the bound. */
static void compare(const struct particles *p, const struct gbg_ewald_plan *plan, const char *name,
                    double worst[2])
{
    const struct gbg_ewald_choice *choice = &plan->choice;
    struct result r[2];
    double scale[2];
    far_sizes(plan, scale);
    for (int b = 0; b < 2; b++) {
        r[b] = results_of(&side[b], plan, p, 0);
    }
    double error[2] = {distance(r[1].force, r[0].force, r[0].n * r[0].dimension, scale[0]),
                       distance(r[1].potential, r[0].potential, r[0].n, scale[1])};
    for (int k = 0; k < 2; k++) {
        if (!(error[k] < bound[choice->single])) {
            print_message("%s, %dD, %lld particles, power %.1f, gradient %d: %s off by %.2e\n",
                          name, choice->dimension, (long long)r[0].n, choice->power,
                          choice->gradient, k ? "potential" : "force", error[k]);
        }
        worst[k] = fmax(worst[k], error[k]);
    }
    free_result(&r[0]);
    free_result(&r[1]);
}

static void sums_agree(void **state)
{
    (void)state;
    static const int64_t sizes[] = {0, 1, 2, 100, 3000};
    double worst[RECIPES][2] = {{0.0}};
    for (int k = 0; k < 5 * BOXES * 2; k++) {
        const struct box *box = &boxes[k % BOXES];
        struct particle_set s = {0};
        if (!takes(k)) {
            continue;
        }
        assert_true(set_make(&s,
                             k % 3 == 0   ? SET_RANDOM
                             : k % 3 == 1 ? SET_JITTERED
                                          : SET_CLUSTERED,
                             box->dimension, box->length, sizes[k / BOXES % 5], 0, 3));
        struct particles p[2] = {particles_of(&s, k % 2), particles_of(&s, k % 2)};
        for (int b = 0; b < 2 && k >= 5 * BOXES; b++) {
            give_species(&p[b]);
        }
        leave_high_words(&p[1]);
        for (int r = 0; r < 2 * RECIPES; r++) {
            if ((r + k) % 4) {
                continue;
            }
            static const double powers[] = {2.0, 2.0, 1.0, 3.0, 2.5, 6.0, 4.0};
            double power = box->dimension == 3 ? 2.0 : powers[(r + k) % 7];
            const struct recipe *recipe = &recipes[r / 2];
            struct gbg_ewald_plan plan = plan_of(recipe, &s, power, r % 2);
            compare(&p[recipe->single], &plan, recipe->name, worst[r / 2]);
        }
        free_particles(&p[0]);
        free_particles(&p[1]);
        set_free(&s);
    }
    for (int r = 0; r < RECIPES; r++) {
        print_message("%s: forces of the GPU off by %.2e, potentials by %.2e\n", recipes[r].name,
                      worst[r][0], worst[r][1]);
    }
    for (int r = 0; r < RECIPES; r++) {
        assert_true(worst[r][0] < bound[recipes[r].single]);
        assert_true(worst[r][1] < bound[recipes[r].single]);
    }
}

/* On nodes of the mesh, halves of its spacings and edges of the box, and a hair beside them. */
static void places_on_nodes_and_edges_agree(void **state)
{
    (void)state;
    double worst[2][2] = {{0.0}};
    for (int k = 0; k < 2 * BOXES; k++) {
        const struct box *box = &boxes[k % BOXES];
        const struct recipe *recipe = &recipes[k < BOXES ? k % 3 : 6];
        struct particle_set s = {0};
        if (!takes(k)) {
            continue;
        }
        assert_true(set_make(&s, SET_RANDOM, box->dimension, box->length, 500, 0, 8));
        struct particles p = particles_of(&s, 1);
        struct gbg_ewald_plan plan = plan_of(recipe, &s, 2.0, k % 2);
        for (int64_t i = 0; i < s.n; i++) {
            uint64_t place = (uint64_t)i * 7; /* of a lattice twice as fine as the mesh */
            for (int a = 0; a < box->dimension; a++) {
                static const int64_t beside[4] = {0, -1, 1, -(INT64_C(1) << 33)};
                uint64_t lines = 2 * (uint64_t)plan.choice.cells[a];
                uint64_t at = (UINT64_MAX / lines + 1) * (place % lines);
                at += (uint64_t)beside[(i / 4 + a) % 4];
                p.state.high[a][i] = (uint32_t)(at >> 32);
                p.state.low[a][i] = (uint32_t)at;
                place /= lines;
            }
        }
        compare(&p, &plan, "on nodes and edges", worst[recipe->single]);
        free_particles(&p);
        set_free(&s);
    }
    print_message("on nodes and edges: forces off by %.2e in single, %.2e in double precision\n",
                  worst[1][0], worst[0][0]);
    for (int k = 0; k < 2; k++) {
        assert_true(worst[k][0] < bound[k] && worst[k][1] < bound[k]);
    }
}

/* The order in memory is not seen in any bit, nor is a second sum; what is added is added. */
static void bits_are_the_same(void **state)
{
    (void)state;
    for (int k = 0; k < 4 * BOXES; k++) {
        const struct box *box = &boxes[k % BOXES];
        struct particle_set s = {0};
        struct result r[3];
        if (!takes(k)) {
            continue;
        }
        assert_true(set_make(&s, k % 3 ? SET_CLUSTERED : SET_RANDOM, box->dimension, box->length,
                             k % 2 ? 700 : 4999, 0, 4));
        struct gbg_ewald_plan plan =
            plan_of(&recipes[k / BOXES % 2 ? 0 : 6], &s, 2.0, k / BOXES / 2);
        for (int c = 0; c < 3; c++) {
            struct particles p = particles_of(&s, c == 1);
            r[c] = results_of(&side[1], &plan, &p, c == 2);
            free_particles(&p);
        }
        size_t bytes = (size_t)s.n * sizeof(double);
        assert_memory_equal(r[0].force, r[1].force, (size_t)box->dimension * bytes);
        assert_memory_equal(r[0].potential, r[1].potential, bytes);
        assert_memory_equal(r[0].potential, r[2].potential, bytes);
        for (int64_t i = 0; i < s.n * box->dimension; i++) {
            double twice = r[0].force[i] + r[0].force[i];
            assert_memory_equal(&twice, &r[2].force[i], sizeof twice);
        }
        for (int c = 0; c < 3; c++) {
            free_result(&r[c]);
        }
        set_free(&s);
    }
}

/* All in one place, and in two: cells of a thousand. */
static void places_may_coincide(void **state)
{
    (void)state;
    double worst[2][2] = {{0.0}};
    for (int k = 0; k < 4; k++) {
        const struct box *box = &boxes[k % 2];
        const struct recipe *recipe = &recipes[k < 2 ? 0 : 6];
        struct particle_set s = {0};
        assert_true(set_make(&s, SET_RANDOM, box->dimension, box->length, 1500, 0, 8));
        struct particles p = particles_of(&s, 0);
        struct gbg_ewald_plan plan = plan_of(recipe, &s, 2.0, k % 2);
        for (int a = 0; a < box->dimension; a++) {
            for (int64_t i = 1; i < s.n; i++) {
                uint32_t moved = i % 3 ? 0 : 0x3000000u;
                p.state.high[a][i] = p.state.high[a][0] + moved;
                p.state.low[a][i] = p.state.low[a][0];
            }
        }
        compare(&p, &plan, "coincident", worst[recipe->single]);
        free_particles(&p);
        set_free(&s);
    }
    print_message("coincident: forces off by %.2e in single, %.2e in double precision\n",
                  worst[1][0], worst[0][0]);
    for (int k = 0; k < 2; k++) {
        assert_true(worst[k][0] < bound[k] && worst[k][1] < bound[k]);
    }
}

/* Pairs so close that 32 bits of a place would not do: distances from 2^-30 to 2^-50 of the box,
 * each particle's own all but alone in what acts on it. */
static void closest_pairs_have_all_bits(void **state)
{
    (void)state;
    double worst = 0.0;
    for (int k = 0; k < 2 * BOXES; k++) {
        const struct box *box = &boxes[k % BOXES];
        struct particle_set s = {0};
        double power = box->dimension == 2 && k % 3 == 0 ? 3.0 : 2.0;
        assert_true(set_make(&s, SET_RANDOM, box->dimension, box->length, 400, 0, 9));
        struct particles p = particles_of(&s, 0);
        struct gbg_ewald_plan plan = plan_of(&recipes[0], &s, power, k % 2);
        for (int a = 0; a < box->dimension; a++) {
            for (int64_t i = 0; i < s.n / 2; i++) {
                uint64_t at = (uint64_t)p.state.high[a][i] << 32 | (uint32_t)(i * 0x9e3779b9u);
                uint64_t beside = at + ((uint64_t)(1 + (i + a) % 5) << (14 + i % 20));
                p.state.low[a][i] = (uint32_t)at;
                p.state.high[a][s.n / 2 + i] = (uint32_t)(beside >> 32);
                p.state.low[a][s.n / 2 + i] = (uint32_t)beside;
            }
        }
        struct result r[2] = {results_of(&side[0], &plan, &p, 0),
                              results_of(&side[1], &plan, &p, 0)};
        for (int64_t i = 0; i < s.n * box->dimension;
             i++) { /* forces of all sizes: each by itself */
            double size = fabs(r[0].force[i]) + pow(plan.choice.reach, -power);
            worst = fmax(worst, fabs(r[1].force[i] - r[0].force[i]) / size);
        }
        free_result(&r[0]);
        free_result(&r[1]);
        free_particles(&p);
        set_free(&s);
    }
    print_message("closest pairs: single precision off by %.2e of a force at most\n", worst);
    assert_true(worst < bound[1]);
}

/* 1, with the reason on standard output, if there is no GPU to test. */
static int missing(void)
{
    struct gbg_context *context = NULL;
    if (gbg_context_create("cuda:0", &context) == GBG_OK) {
        gbg_context_destroy(&context);
        return 0;
    }
    printf("skipped: %s\n", gbg_message(NULL));
    return 1;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sums_agree),
        cmocka_unit_test(places_on_nodes_and_edges_agree),
        cmocka_unit_test(bits_are_the_same),
        cmocka_unit_test(places_may_coincide),
        cmocka_unit_test(closest_pairs_have_all_bits),
    };
    return missing() ? SKIPPED : cmocka_run_group_tests(tests, open_sides, close_sides);
}
