/* Tests of a GPU against the CPU: whole runs, in batches of steps and kernel by kernel: equal
 * digests, counters and largest moves. */
#include "both.h"

static struct made_particles made;

struct run {
    const char *what;
    int dimension, rule, n_species, m, steps;
    double spacing, power, cutoff, dt, temperature, diameter;
};

static const struct run runs[] = {
    {"free particles", 2, GBG_RULE_NONE, 1, 40, 100, 1.2, 0, 0, 0.01, 0.1, 1.0},
    {"cut-off forces", 2, GBG_RULE_NONE, 1, 64, 300, 1.25, 6, 2.5, 0.001, 0.01, 1.0},
    {"cut-off forces", 3, GBG_RULE_NONE, 1, 14, 100, 1.2, 6, 2.5, 0.001, 0.01, 1.0},
    {"power 2, two species", 2, GBG_RULE_NONE, 2, 50, 100, 1.3, 2, 3.0, 0.0002, 0.01, 1.0},
    {"hard discs", 2, GBG_RULE_BOUNCE, 1, 64, 200, 1.23, 0, 0, 0.01, 0.01, 1.0},
    {"hard discs, contact", 2, GBG_RULE_CONTACT, 1, 32, 50, 1.23, 0, 0, 0.01, 0.01, 1.0},
    {"S10", 2, GBG_RULE_BOUNCE, 1, 70, 400, 1.23, 6, 2.5, 0.001, 0.01, 1.0},
    {"C3 short", 2, GBG_RULE_BOUNCE, 2, 60, 200, 1.04, 6, 2.5, 0.01, 0.01, 1.0},
    {"C3 short, carter", 2, GBG_RULE_CARTER, 2, 40, 100, 1.04, 6, 2.5, 0.01, 0.01, 1.0},
    {"C4 short", 2, GBG_RULE_BOUNCE, 2, 60, 400, 3.0, 6, 2.5, 0.01, 0.01, 1.0},
    {"C3 short, bridge", 2, GBG_RULE_BRIDGE, 2, 60, 200, 1.04, 6, 2.5, 0.01, 0.01, 1.0},
    {"C4 short, bridge", 2, GBG_RULE_BRIDGE, 2, 60, 400, 3.0, 6, 2.5, 0.01, 0.01, 1.0},
    {"hard spheres, bridge", 3, GBG_RULE_BRIDGE, 2, 14, 60, 1.1, 6, 2.5, 0.01, 0.01, 1.0},
    {"two forces", 2, GBG_RULE_BOUNCE, 2, 40, 100, 1.2, 3, 2.5, 0.001, 0.01, 1.0},
    {"hard spheres", 3, GBG_RULE_BOUNCE, 2, 14, 60, 1.1, 6, 2.5, 0.01, 0.01, 1.0},
    {"discs of 1.3", 2, GBG_RULE_BOUNCE, 2, 40, 200, 1.6, 6, 2.5, 0.01, 0.01, 1.3},
    {"discs of 1.3, bridge", 2, GBG_RULE_BRIDGE, 2, 40, 200, 1.6, 6, 2.5, 0.01, 0.01, 1.3},
    /* so many that a batch has kernels for the parts of a step */
    {"free particles", 2, GBG_RULE_NONE, 1, 257, 20, 1.2, 0, 0, 0.01, 0.1, 1.0},
    {"cut-off forces", 2, GBG_RULE_NONE, 1, 257, 60, 1.25, 6, 2.5, 0.001, 0.01, 1.0},
    {"hard discs", 2, GBG_RULE_BOUNCE, 1, 257, 20, 1.23, 0, 0, 0.01, 0.01, 1.0},
    {"C3 short", 2, GBG_RULE_BOUNCE, 2, 257, 20, 1.04, 6, 2.5, 0.01, 0.01, 1.0},
    {"hard spheres", 3, GBG_RULE_BOUNCE, 2, 41, 10, 1.1, 6, 2.5, 0.01, 0.01, 1.0},
};

static void set_up(const struct run *run, struct gbg_scene *scene)
{
    scene->rule = run->rule;
    scene->dt = run->dt;
    scene->temperature = run->temperature;
    scene->unwrapped = scene->overlap = 1;
    for (int s = 0; s < scene->n_species; s++) {
        scene->species[s].diameter = run->diameter;
    }
    if (run->n_species == 1) {
        scene->n_species = 1;
        scene->species[0].alpha = 1.0;
        scene->species[0].mobility = 1.0;
    }
    if (run->cutoff > 0.0) {
        scene->n_forces = 1;
        scene->force[0] =
            (struct gbg_force){.power = run->power, .sum = GBG_SUM_CUTOFF, .cutoff = run->cutoff};
    }
    if (run->power == 3.0) { /* and a second one */
        scene->n_forces = 2;
        scene->force[1] = (struct gbg_force){.power = 6.0, .sum = GBG_SUM_CUTOFF, .cutoff = 2.0};
    }
}

static void same_counters(const struct both *both)
{
    const struct gbg_engine *p = both->engine[0], *q = both->engine[1];
    assert_int_equal(p->step, q->step);
    assert_int_equal(p->contact_rounds, q->contact_rounds);
    assert_int_equal(p->contact_pairs, q->contact_pairs);
    assert_int_equal(p->reverted, q->reverted);
    assert_int_equal(p->repeated, q->repeated);
    both_same_real(p->contact_virial, q->contact_virial, "the virial");
    both_same_real(p->moves.drift, q->moves.drift, "the largest drift");
    both_same_real(p->moves.noise, q->moves.noise, "the largest noise");
    both_same_real(p->moves.total, q->moves.total, "the largest move");
}

static void run_both(const struct run *run, int in_batches)
{
    double length[3];
    struct gbg_context *context = made_context("cpu");
    for (int a = 0; a < run->dimension; a++) {
        length[a] = run->spacing * run->m * (a == 1 ? 1.02 : 1.0);
    }
    struct gbg_scene scene = made_scene(context, run->dimension, length);
    set_up(run, &scene);
    made_lattice(&made, &scene, run->m, 0.01);
    for (int64_t i = 0; run->n_species == 1 && i < made.p.n; i++) {
        made.species[i] = 0;
    }
    struct both both = both_make(scene, &made);
    struct gbg_kernels single = *both.engine[1]->kernels;
    single.steps = NULL;
    if (!in_batches) {
        both.engine[1]->kernels = &single;
    }
    char text[2][65];
    for (int part = 0; part < 3;
         part++) { /* odd pieces, so that batches end before they are full */
        int64_t steps = part == 0 ? 1 : part == 1 ? run->steps / 3 : run->steps - run->steps / 3;
        for (int b = 0; b < 2; b++) {
            if (gbg_engine_advance(both.engine[b], steps) != GBG_OK) {
                fail_msg("%s: %s", run->what, gbg_message(both.context[b]));
            }
            assert_int_equal(gbg_engine_digest(both.engine[b], text[b]), GBG_OK);
        }
        assert_string_equal(text[0], text[1]);
        same_counters(&both);
    }
    int64_t builds[2] = {0, 0};
    for (int b = 0; b < 2; b++) {
        gbg_engine_integer(both.engine[b], "list_builds", &builds[b]);
    }
    print_message(
        "%s, %dD, N = %lld, %s: %d steps, %lld rounds, lists built %lld and %lld times, %s\n",
        run->what, run->dimension, (long long)made.p.n,
        in_batches ? "in batches" : "kernel by kernel", run->steps,
        (long long)both.engine[0]->contact_rounds, (long long)builds[0], (long long)builds[1],
        text[0]);
    both_free(&both);
    gbg_context_destroy(&context);
}

static void kernel_by_kernel(void **state)
{
    (void)state;
    for (size_t k = 0; k < sizeof runs / sizeof *runs; k++) {
        if (!both_takes((int)k)) {
            continue;
        }
        run_both(&runs[k], 0);
    }
}

static void in_batches(void **state)
{
    (void)state;
    for (size_t k = 0; k < sizeof runs / sizeof *runs; k++) {
        if (!both_takes((int)k)) {
            continue;
        }
        run_both(&runs[k], 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kernel_by_kernel),
        cmocka_unit_test(in_batches),
    };
    return both_missing() ? BOTH_SKIPPED : cmocka_run_group_tests(tests, NULL, NULL);
}
