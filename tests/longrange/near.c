/* Tests of near pairs of sums by a mesh, and of the order they are found in: against loops over all
 * pairs in long double with the same coefficients, and in bits. */
#include "mesh_state.h"

#include <stdio.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/ewald.h"
#include "core/memory.h"

static const char *const instructions[] = {"cpu:isa=avx512,threads=1", "cpu:isa=avx2,threads=1",
                                           "cpu:isa=generic,threads=1"};

/* A context with these instructions; 0: this processor or build has none. */
static int bench_try(const char *text, struct bench *b)
{
    struct gbg_context *context = NULL;
    if (gbg_context_create(text, &context) != GBG_OK) {
        return 0;
    }
    gbg_context_destroy(&context);
    *b = bench_open(text);
    return 1;
}

/* What near pairs need of a plan. */
static struct gbg_ewald *sum_of(const struct gbg_state *state, double power, double reach,
                                int single)
{
    struct gbg_ewald *sum = new_array(1, sizeof *sum);
    struct gbg_ewald_choice *c = &sum->plan.choice;
    *c = (struct gbg_ewald_choice){.dimension = state->box.dimension,
                                   .power = power,
                                   .single = single,
                                   .reach = reach,
                                   .band = single ? 10.0 : 24.0};
    for (int a = 0; a < c->dimension; a++) {
        c->length[a] = state->box.length[a];
    }
    assert_int_equal(
        gbg_split_make(c->dimension, power, GBG_SPLIT_PROLATE, reach, c->band, &sum->plan.split),
        GBG_OK);
    if (single) {
        gbg_split_shorten(&sum->plan.split, 1e-8);
    }
    return sum;
}

static void sum_free(struct gbg_ewald *sum)
{
    gbg_ewald_order_release(&sum->order);
    free(sum);
}

static void near_of(const struct bench *b, const struct gbg_state *state, struct gbg_ewald *sum)
{
    if (gbg_ewald_sort(b->device, state, sum) != GBG_OK) {
        fail_msg("%s", gbg_message(b->context));
    }
    b->device->variant->ewald->near(b->device, state, sum);
}

static double alpha_of(const struct gbg_state *state, int64_t i)
{
    return state->own_alpha ? state->own_alpha[i]
                            : state->alpha[state->species ? state->species[i] : 0];
}

/* The field and the potential at particle i by a loop over all. */
static void by_loop(const struct gbg_state *state, const struct gbg_ewald *sum, int64_t i,
                    long double field[3], long double *potential)
{
    const struct gbg_split *split = &sum->plan.split;
    const long double reach = split->reach, s = (long double)split->power - 1;
    field[0] = field[1] = field[2] = *potential = 0;
    for (int64_t k = 0; k < state->owned; k++) {
        long double r[3] = {0, 0, 0}, squared = 0, force = 0, smooth = 0;
        for (int a = 0; a < state->box.dimension; a++) {
            uint64_t own = (uint64_t)state->high[a][i] << 32 | state->low[a][i];
            uint64_t other = (uint64_t)state->high[a][k] << 32 | state->low[a][k];
            r[a] =
                (long double)(int64_t)(own - other) * 0x1p-64L * (long double)state->box.length[a];
            squared += r[a] * r[a];
        }
        long double u = squared / (reach * reach);
        if (k == i || u >= 1) {
            continue;
        }
        for (int d = split->degree; d >= 0; d--) {
            force = force * (2 * u - 1) + split->near[d];
            smooth = smooth * (2 * u - 1) + split->potential[d];
        }
        long double alpha = alpha_of(state, k), law = s == 0 ? -logl(u) / 2 : powl(u, -s / 2) / s;
        *potential += alpha * powl(reach, -s) * ((u > 0 ? law : 0) - smooth);
        force = u > 0 ? powl(u, -(s + 2) / 2) - force : 0;
        for (int a = 0; a < state->box.dimension; a++) {
            field[a] += alpha * powl(reach, -(s + 2)) * force * r[a];
        }
    }
}

/* RMS error of the fields, and of potentials if there are any, over their RMS, at every stride-th
 * place; no field at all counts as a field of one. */
static double error_of(const struct gbg_state *state, const struct gbg_ewald *sum, int64_t stride,
                       const double *potential)
{
    long double wrong = 0, whole = 0;
    for (int64_t k = 0; k < state->owned; k += stride) {
        long double exact[3], phi, difference;
        by_loop(state, sum, sum->order.index[k], exact, &phi);
        if (potential) {
            difference = potential[k] * sum->order.largest - phi;
            wrong += difference * difference;
            whole += phi * phi;
        }
        for (int a = 0; a < state->box.dimension && !potential; a++) {
            difference = sum->order.field[a][k] * sum->order.largest - exact[a];
            wrong += difference * difference;
            whole += exact[a] * exact[a];
        }
    }
    return (double)sqrtl(wrong / (whole > 0 ? whole : 1));
}

/* A reach with so many particles in it in the mean, at most half of the shortest length. */
static double reach_for(const struct particle_set *s, double neighbours)
{
    const double pi = 3.141592653589793;
    double each = neighbours * s->length[0] * s->length[1] * s->length[2] / (double)s->n, reach;
    reach = s->dimension == 2 ? sqrt(each / pi) : cbrt(0.75 * each / pi);
    for (int a = 0; a < s->dimension; a++) {
        reach = fmin(reach, 0.5 * s->length[a]);
    }
    return reach;
}

/* Largest errors allowed, in double and in single precision: a few units in the last place, and
 * what terms that are right to 2^-24 leave where they cancel. */
static const double allowed[2] = {2e-15, 3e-7};

/* The generic kernels have no fused multiply-add and round twice; in space the library offers power
 * 2 alone, and forces of power 1 cancel most. */
static double allowed_for(int single, int generic, int dimension, double power)
{
    double factor = generic ? 2.0 : dimension == 3 && power != 2.0 ? 1.5 : 1.0;
    return factor * allowed[single];
}

struct box {
    int dimension;
    double length[3];
};
static const struct box boxes[] = {
    {2, {32.0, 32.0}}, {2, {20.0, 97.0}}, {3, {10.0, 10.0, 10.0}}, {3, {6.0, 13.0, 9.0}}};

static void forces_are_those_of_a_loop(void **state)
{
    (void)state;
    static const double powers[] = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 2.5};
    for (int single = 0; single < 2; single++) {
        for (int p = 0; p < 7; p++) {
            double worst[3] = {0.0, 0.0, 0.0};
            for (int k = 0; k < 12; k++) {
                const struct box *box = &boxes[k % 4];
                struct particle_set s;
                static const enum set_kind kinds[] = {SET_JITTERED, SET_RANDOM, SET_CLUSTERED};
                assert_true(set_make(&s, kinds[k / 4], box->dimension, box->length, 900, k % 2, 7));
                struct particles particles = particles_of(&s, 0);
                struct gbg_ewald *sum =
                    sum_of(&particles.state, powers[p], reach_for(&s, 41.0), single);
                for (int v = 0; v < 3; v++) {
                    struct bench b;
                    if (!bench_try(instructions[v], &b)) {
                        continue;
                    }
                    near_of(&b, &particles.state, sum);
                    double error = error_of(&particles.state, sum, 7, NULL);
                    worst[v] = fmax(worst[v], error);
                    bench_close(&b);
                    if (!(error <= allowed_for(single, v == 2, box->dimension, powers[p]))) {
                        fail_msg("%s, power %g, %s, %s, %dD: error %.2e",
                                 single ? "single" : "double", powers[p], instructions[v],
                                 set_names[kinds[k / 4]], box->dimension, error);
                    }
                }
                sum_free(sum);
                particles_free(&particles);
                set_free(&s);
            }
            print_message("%s, power %g: largest error %.2e (avx512) %.2e (avx2) %.2e (generic)\n",
                          single ? "single" : "double", powers[p], worst[0], worst[1], worst[2]);
        }
    }
}

/* Fields in the order of the set, whatever the order in memory. */
static void fields_by_id(const struct particles *p, const struct gbg_ewald *sum, double *field)
{
    for (int64_t k = 0; k < p->state.owned; k++) {
        int64_t i = sum->order.index[k], id = p->state.id ? (int64_t)p->state.id[i] : i;
        for (int a = 0; a < p->state.box.dimension; a++) {
            field[3 * id + a] = sum->order.field[a][k];
        }
    }
}

static void bits_know_no_threads_and_no_order(void **state)
{
    (void)state;
    static const char *const contexts[] = {"cpu:threads=1", "cpu:threads=2", "cpu:threads=5",
                                           "poison:threads=3", "cpu:isa=avx2,threads=2"};
    enum { N = 6000 };
    static double expected[3 * N], field[3 * N];
    for (int k = 0; k < 8; k++) {
        const struct box *box = &boxes[k % 4];
        struct particle_set s;
        assert_true(set_make(&s, k % 3 ? SET_RANDOM : SET_CLUSTERED, box->dimension, box->length, N,
                             k % 2, 11));
        for (int c = 0; c < 10; c++) {
            struct particles p = particles_of(&s, c >= 5);
            struct gbg_ewald *sum = sum_of(&p.state, 2.0, reach_for(&s, 30.0), k / 4);
            struct bench b;
            if (bench_try(contexts[c % 5], &b)) {
                near_of(&b, &p.state, sum);
                fields_by_id(&p, sum, c == 0 ? expected : field);
                if (c > 0 && b.device->variant->name[0] == 'a') {
                    assert_memory_equal(expected, field, sizeof field);
                }
                bench_close(&b);
            }
            sum_free(sum);
            particles_free(&p);
        }
        set_free(&s);
    }
}

static void the_order_is_complete(void **state)
{
    (void)state;
    static const int64_t sizes[] = {0, 1, 2, 17, 5000, 30000};
    struct bench b = bench_open("cpu:threads=3");
    for (int k = 0; k < 24; k++) {
        const struct box *box = &boxes[k % 4];
        struct particle_set s;
        assert_true(set_make(&s, k % 3 ? SET_RANDOM : SET_CLUSTERED, box->dimension, box->length,
                             sizes[k / 4], 0, 5));
        struct particles p = particles_of(&s, s.n > 0 && k % 2);
        struct gbg_ewald *sum = sum_of(&p.state, 2.0, s.n ? reach_for(&s, 30.0) : 1.0, k % 5 != 0);
        const struct gbg_ewald_order *o = &sum->order;
        assert_int_equal(gbg_ewald_sort(b.device, &p.state, sum), GBG_OK);
        char *seen = new_array(s.n, 1);
        int64_t n_cells = (int64_t)o->cells[0] * o->cells[1] * o->cells[2];
        assert_int_equal(o->begin[0], 0);
        assert_int_equal(o->begin[n_cells], s.n);
        for (int64_t cell = 0; cell < n_cells; cell++) {
            for (int64_t j = o->begin[cell]; j < o->begin[cell + 1]; j++) {
                int64_t i = o->index[j], rest = cell;
                assert_true(i >= 0 && i < s.n && !seen[i]);
                seen[i] = 1;
                for (int a = 0; a < box->dimension; a++) {
                    double place = (double)p.state.high[a][i] * 0x1p-32 * o->cells[a];
                    assert_int_equal((int64_t)floor(place), rest % o->cells[a]);
                    rest /= o->cells[a];
                    assert_int_equal(o->high[a][j], p.state.high[a][i]);
                }
                assert_true(j == o->begin[cell] ||
                            gbg_rank_of(&p.state, o->index[j - 1]) < gbg_rank_of(&p.state, i));
                double source = o->source ? (double)o->source[j] : o->source_double[j];
                assert_true(fabs(source - p.state.own_alpha[i] / o->largest) < 1e-7);
            }
        }
        free(seen);
        sum_free(sum);
        particles_free(&p);
        set_free(&s);
    }
    bench_close(&b);
}

struct hard {
    const char *what;
    struct box box;
    int64_t n;
    double reach;
    double spread[3]; /* of the particles, over the lengths */
    int64_t stride;
};

static const struct hard hard_cases[] = {
    {"none", {2, {5.0, 5.0}}, 0, 1.0, {1.0, 1.0, 1.0}, 1},
    {"one", {2, {5.0, 5.0}}, 1, 2.5, {1.0, 1.0, 1.0}, 1},
    {"two", {3, {5.0, 4.0, 5.0}}, 2, 2.0, {1.0, 1.0, 1.0}, 1},
    {"ten, reach half the box", {2, {5.0, 5.0}}, 10, 2.5, {1.0, 1.0, 1.0}, 1},
    {"reach half the box", {3, {5.0, 5.0, 8.0}}, 500, 2.5, {1.0, 1.0, 1.0}, 7},
    {"reach just below a quarter", {2, {5.0, 5.0}}, 700, 1.2499, {1.0, 1.0, 1.0}, 7},
    {"one cell", {2, {5.0, 5.0}}, 700, 1.0, {1e-3, 1e-3, 1e-3}, 7},
    {"one cell, more than a strip", {2, {5.0, 5.0}}, 9000, 0.5, {2e-3, 2e-3, 1.0}, 211},
    {"a few cells, more than a strip", {2, {5.0, 5.0}}, 9000, 0.5, {0.1, 0.2, 1.0}, 211},
    {"the same in 3D", {3, {5.0, 5.0, 5.0}}, 9000, 0.5, {0.1, 0.2, 0.15}, 211},
    {"a line along 0", {2, {5.0, 5.0}}, 600, 0.3, {1.0, 0.0, 0.0}, 7},
    {"a line along 1", {2, {5.0, 5.0}}, 600, 0.3, {0.0, 1.0, 0.0}, 7},
    {"a line across a corner", {3, {5.0, 5.0, 5.0}}, 600, 0.3, {1e-12, 1e-12, 1.0}, 7},
    {"100:1", {2, {500.0, 5.0}}, 4000, 2.5, {1.0, 1.0, 1.0}, 41},
    {"1:100", {2, {5.0, 500.0}}, 4000, 2.5, {1.0, 1.0, 1.0}, 41},
    {"1:1:100", {3, {2.0, 2.0, 200.0}}, 3000, 0.9, {1.0, 1.0, 1.0}, 41},
    {"tiny lengths", {2, {5e-100, 5e-100}}, 900, 5e-101, {1.0, 1.0, 1.0}, 7},
    {"huge lengths", {2, {5e60, 5e60}}, 900, 5e59, {1.0, 1.0, 1.0}, 7},
    {"two grains far apart", {2, {5.0, 5.0}}, 1000, 0.01, {1e-6, 1e-6, 1.0}, 7},
};

/* A tenth of the particles stands on the one before, or a few 2^-64 of the box beside. */
static void place_hard(const struct hard *h, struct particles *p, int coincident)
{
    for (int a = 0; a < h->box.dimension; a++) {
        for (int64_t i = 0; i < h->n; i++) {
            double x = h->spread[a] * (set_uniform(3, i, (uint64_t)a) - 0.5);
            x += i % 2 ? 0.0 : 0.5 * (h->spread[a] < 1e-5);
            uint64_t f = (uint64_t)(int64_t)(x * 0x1p63) << 1;
            if (coincident && i % 10 == 1) {
                f = (uint64_t)p->state.high[a][i - 1] << 32 | p->state.low[a][i - 1];
                f += i % 20 == 1 ? 0 : (uint64_t)(i / 20 % 5 * (1 + a));
            }
            p->state.high[a][i] = (uint32_t)(f >> 32);
            p->state.low[a][i] = (uint32_t)f;
        }
    }
}

static void hard_cases_are_met(void **state)
{
    (void)state;
    struct bench b = bench_open("cpu:threads=2");
    for (size_t k = 0; k < sizeof hard_cases / sizeof *hard_cases; k++) {
        const struct hard *h = &hard_cases[k];
        double worst[2] = {0.0, 0.0};
        for (int c = 0; c < 8; c++) {
            struct particle_set s;
            int single = c & 1, coincident = c >> 1 & 1;
            double power = c >> 2 ? 1.0 : 2.0;
            assert_true(set_make(&s, SET_RANDOM, h->box.dimension, h->box.length, h->n, 1, 1));
            struct particles p = particles_of(&s, 0);
            place_hard(h, &p, coincident);
            struct gbg_ewald *sum = sum_of(&p.state, power, h->reach, single);
            near_of(&b, &p.state, sum);
            double error = error_of(&p.state, sum, h->stride, NULL);
            worst[single] = fmax(worst[single], error);
            if (!(error <= allowed[single])) {
                fail_msg("%s, %s, coincident %d, power %g: error %.2e", h->what,
                         single ? "single" : "double", coincident, power, error);
            }
            sum_free(sum);
            particles_free(&p);
            set_free(&s);
        }
        print_message("%s: errors %.2e (double), %.2e (single)\n", h->what, worst[0], worst[1]);
    }
    bench_close(&b);
}

/* Sources of species and of one species, and ghosts that nobody looks at. */
static void sources_are_those_of_species(void **state)
{
    (void)state;
    struct bench b = bench_open("cpu:threads=2");
    for (int c = 0; c < 6; c++) {
        struct particle_set s;
        assert_true(set_make(&s, SET_RANDOM, 2, boxes[0].length, 1000, 1, 1));
        struct particles p = particles_of(&s, 0);
        struct gbg_state own = p.state;
        own.own_alpha = NULL;
        own.species = new_array(s.n, 1);
        own.n_species = c / 2 == 0 ? 1 : 3;
        own.owned = 900;
        own.ghost = 100;
        for (int64_t i = 0; i < s.n; i++) {
            own.species[i] = (uint8_t)(i % own.n_species);
        }
        for (int k = 0; k < own.n_species; k++) {
            own.alpha[k] = c / 2 == 2 ? 0.0 : k - 2.5;
        }
        struct gbg_ewald *sum = sum_of(&own, 2.0, reach_for(&s, 40.0), c % 2);
        near_of(&b, &own, sum);
        double error = error_of(&own, sum, 1, NULL);
        assert_true(error <= allowed[c % 2]);
        assert_true(sum->order.largest == (c / 2 == 2 ? 0.0 : 2.5));
        sum_free(sum);
        free(own.species);
        particles_free(&p);
        set_free(&s);
    }
    bench_close(&b);
}

static void potentials_are_those_of_a_loop(void **state)
{
    (void)state;
    struct bench b = bench_open("cpu:threads=2");
    double worst = 0.0;
    for (int c = 0; c < 24; c++) {
        struct particle_set s;
        const struct box *box = &boxes[c % 4];
        assert_true(set_make(&s, SET_RANDOM, box->dimension, box->length, 600, 0, 1));
        struct particles p = particles_of(&s, c % 2);
        struct gbg_ewald *sum = sum_of(&p.state, 1 + c / 4, reach_for(&s, 40.0), c % 3 == 0);
        double *potential = new_array(s.n, sizeof *potential);
        assert_int_equal(gbg_ewald_sort(b.device, &p.state, sum), GBG_OK);
        gbg_ewald_near_potential(b.device, &p.state, sum, potential);
        double error = error_of(&p.state, sum, 1, potential);
        worst = fmax(worst, error);
        assert_true(error <= (c % 3 ? allowed[0] : allowed[1]));
        free(potential);
        sum_free(sum);
        particles_free(&p);
        set_free(&s);
    }
    print_message("potentials: largest error %.2e\n", worst);
    bench_close(&b);
}

/* No memory is a status, after which the sum works; none is taken the second time. */
static void memory_is_taken_once(void **state)
{
    (void)state;
    struct particle_set s;
    assert_true(set_make(&s, SET_RANDOM, 2, boxes[0].length, 3000, 0, 1));
    struct particles p = particles_of(&s, 0);
    for (int single = 0; single < 2; single++) {
        int failures = 0;
        for (int64_t n = 1; n < 100; n++) {
            struct bench b = bench_open("cpu:threads=2");
            struct gbg_ewald *sum = sum_of(&p.state, 2.0, reach_for(&s, 40.0), single);
            gbg_memory_fail_after(n);
            int status = gbg_ewald_sort(b.device, &p.state, sum);
            int64_t left = gbg_memory_fail_after(0);
            assert_int_equal(status, left > 0 ? GBG_OK : GBG_E_MEMORY);
            failures += status != GBG_OK;
            near_of(&b, &p.state, sum);
            assert_true(error_of(&p.state, sum, 50, NULL) <= allowed[single]);
            gbg_memory_fail_after(1);
            assert_int_equal(gbg_ewald_sort(b.device, &p.state, sum), GBG_OK);
            assert_int_equal(gbg_memory_fail_after(0), 1);
            sum_free(sum);
            bench_close(&b);
        }
        assert_true(failures >= 8 && failures < 90);
    }
    particles_free(&p);
    set_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_order_is_complete),
        cmocka_unit_test(forces_are_those_of_a_loop),
        cmocka_unit_test(bits_know_no_threads_and_no_order),
        cmocka_unit_test(hard_cases_are_met),
        cmocka_unit_test(sources_are_those_of_species),
        cmocka_unit_test(potentials_are_those_of_a_loop),
        cmocka_unit_test(memory_is_taken_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
