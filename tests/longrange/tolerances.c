/* Test A5: whoever asks for a tolerance gets it: every method on every distribution, the plan
 * chosen from the tolerance alone, against Ewald sums without a mesh. */
#include "mesh_state.h"

#include <stdio.h>
#include <stdlib.h>

#include "ewald/model.h"

static const struct {
    const char *name;
    int split, window, gradient;
} methods[] = {
    {"prolate, waves", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, GBG_GRADIENT_WAVES},
    {"prolate, window", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, GBG_GRADIENT_WINDOW},
    {"Gaussian, B-spline", GBG_SPLIT_GAUSSIAN, GBG_EWALD_BSPLINE, GBG_GRADIENT_WAVES},
    {"Gaussian, B-spline, window", GBG_SPLIT_GAUSSIAN, GBG_EWALD_BSPLINE, GBG_GRADIENT_WINDOW},
};
enum { METHODS = sizeof methods / sizeof *methods, TARGETS = 1000 };

static const double tolerances[] = {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10, 1e-12};
enum { TOLERANCES = sizeof tolerances / sizeof *tolerances };

/* What is asked for beside the tolerance. */
struct asked {
    int dimension;
    double power, length[3];
    int64_t n;
    int neutral; /* alternating sources, else 0.5 to 1.5 */
    int methods; /* the first so many */
};

/* Plans of all tolerances and methods; band 0: no window of this method is that good. */
static struct gbg_ewald_plan plans[TOLERANCES * METHODS];

static int choose(const struct asked *asked, int m, double tolerance, struct gbg_ewald_plan *plan)
{
    struct gbg_ewald_wish wish = {.dimension = asked->dimension,
                                  .power = asked->power,
                                  .n = asked->n,
                                  .tolerance = tolerance,
                                  .split = methods[m].split,
                                  .window = methods[m].window,
                                  .gradient = methods[m].gradient,
                                  .single = -1};
    struct gbg_ewald_choice choice;
    double predicted, cost;
    memcpy(wish.length, asked->length, sizeof wish.length);
    return gbg_ewald_choose(&wish, &choice, &predicted, &cost) == GBG_OK &&
           gbg_ewald_plan_make(&choice, plan) == GBG_OK;
}

static void choose_all(const struct asked *asked)
{
    for (int k = 0; k < TOLERANCES * asked->methods; k++) {
        int m = k % asked->methods;
        double tolerance = tolerances[k / asked->methods];
        if (!choose(asked, m, tolerance, &plans[k])) {
            assert_true(methods[m].window == GBG_EWALD_BSPLINE && tolerance < 1e-6);
            plans[k].choice.band = 0.0;
        }
    }
}

/* 1 if all tolerances are met; prints the largest error over its tolerance. */
static int meets(const struct bench *b, const struct asked *asked, enum set_kind kind)
{
    static int32_t target[TARGETS];
    static double exact[3][TARGETS], found[3][TARGETS];
    struct particle_set s = {0};
    double *exact_of[3] = {exact[0], exact[1], exact[2]}, worst = 0.0;
    const double *found_of[3] = {found[0], found[1], found[2]};
    char where[80] = "";
    assert_true(set_make(&s, kind, asked->dimension, asked->length, asked->n, asked->neutral, 11));
    struct gbg_ewald_sources sources = set_sources(&s, asked->power);
    int64_t n = set_targets(s.n, TARGETS, 5, target);
    assert_int_equal(gbg_ewald_reference(b->context, &sources, 1.0, n, target, exact_of, NULL),
                     GBG_OK);
    struct particles p = particles_of(&s, 0);
    for (int k = 0; k < TOLERANCES * asked->methods; k++) {
        int m = k % asked->methods;
        double tolerance = tolerances[k / asked->methods];
        if (plans[k].choice.band == 0.0) {
            continue;
        }
        forces_by_mesh(b, &plans[k], 1, &p);
        for (int a = 0; a < s.dimension; a++) {
            for (int64_t t = 0; t < n; t++) {
                found[a][t] = p.state.force[a][target[t]];
            }
        }
        struct set_error error =
            set_error_of(s.dimension, n, found_of, (const double *const *)exact_of);
        if (error.over_rms / tolerance > worst) {
            worst = error.over_rms / tolerance;
            snprintf(where, sizeof where, "%s, %g", methods[m].name, tolerance);
        }
    }
    print_message("%dD, power %g, %s, %lld particles%s: largest error %.2f of the tolerance (%s)\n",
                  s.dimension, asked->power, set_names[kind], (long long)s.n,
                  asked->neutral ? ", neutral" : "", worst, where);
    particles_free(&p);
    set_free(&s);
    return worst <= 1.0;
}

static void every_tolerance_is_met(void **state)
{
    (void)state;
    static const struct asked asked[] = {
        {2, 2.0, {64.0, 64.0}, 4096, 0, METHODS}, {2, 2.0, {64.0, 64.0}, 4096, 1, 2},
        {2, 1.0, {40.0, 20.0}, 800, 0, 2},        {2, 3.0, {40.0, 20.0}, 800, 0, 2},
        {2, 4.0, {40.0, 20.0}, 800, 0, 2},        {2, 5.0, {40.0, 20.0}, 800, 0, 2},
        {2, 6.0, {40.0, 20.0}, 800, 0, 2},        {3, 2.0, {13.0, 13.0, 13.0}, 2197, 0, METHODS},
    };
    struct bench b = bench_open("cpu:threads=2");
    int good = 1;
    for (size_t k = 0; k < sizeof asked / sizeof *asked; k++) {
        choose_all(&asked[k]);
        for (int kind = 0; kind < SET_KINDS; kind++) {
            good &= meets(&b, &asked[k], (enum set_kind)kind);
        }
    }
    assert_true(good);
    bench_close(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_tolerance_is_met),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
