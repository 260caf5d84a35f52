/* Tests of a GPU against the CPU: rounds of contact corrections, to the last bit. */
#include "both_state.h"

static struct made_particles made;
static struct places places;

static const double boxes[2][2][3] = {{{26.0, 26.0}, {29.0, 23.0}},
                                      {{15.0, 15.0, 15.0}, {16.0, 14.5, 15.5}}};

/* What one call did on both. Returns the rounds. */
static int64_t correct_both(struct both *both, int parting, int64_t max_rounds, double cap)
{
    struct gbg_contacts contacts[2];
    for (int b = 0; b < 2; b++) {
        struct gbg_engine *engine = both->engine[b];
        contacts[b] = (struct gbg_contacts){
            .parting = parting, .max_rounds = max_rounds, .tolerance = 0.9e-12, .cap = cap};
        assert_int_equal(engine->kernels->contacts(engine->device, &engine->state, engine->contacts,
                                                   &contacts[b]),
                         GBG_OK);
    }
    assert_int_equal(contacts[0].rounds, contacts[1].rounds);
    assert_int_equal(contacts[0].pairs, contacts[1].pairs);
    assert_int_equal(contacts[0].left, contacts[1].left);
    assert_int_equal(contacts[0].stopped, contacts[1].stopped);
    both_same_real(contacts[0].largest, contacts[1].largest, "the largest move");
    both_same_real(contacts[0].virial, contacts[1].virial, "the virial");
    both_same_state(both);
    return contacts[0].rounds;
}

static int64_t builds_of(const struct gbg_engine *engine)
{
    return engine->kernels->list_builds(engine->contacts);
}

/* The same places in both, parted by each rule in few and in many rounds. Returns how many lists
 * became stale in rounds. */
static int64_t part_in_all_ways(struct both *both, const struct places *from)
{
    static const int64_t rounds[] = {0, 1, 3, 4, 5, 25};
    int64_t stale = 0;
    for (int parting = GBG_PARTING_BOUNCE; parting <= GBG_PARTING_CARTER; parting++) {
        for (size_t k = 0; k < sizeof rounds / sizeof *rounds; k++) {
            both_place(both, from);
            both_keep(both);
            both_list(both);
            int64_t before = builds_of(both->engine[0]);
            int64_t made_rounds = correct_both(both, parting, rounds[k], k % 2 ? 0.25 : 0.02);
            assert_true(made_rounds <= rounds[k]);
            stale += builds_of(both->engine[0]) - before;
            /* once more from there, with the list as it is */
            correct_both(both, parting, 1, 0.25);
            assert_int_equal(builds_of(both->engine[0]), builds_of(both->engine[1]));
        }
    }
    return stale;
}

static void crowds(void **state)
{
    (void)state;
    int64_t stale = 0;
    for (int k = 0; k < 4 * MIXTURES; k++) {
        if (!both_takes(k)) {
            continue;
        }
        int dimension = 2 + k % 2, mixture = k / 4;
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = made_scene(context, dimension, boxes[dimension - 2][k / 2 % 2]);
        scene.unwrapped = k % 3 != 0;
        scene.overlap = k % 3 != 1;
        made_lattice(&made, &scene, dimension == 2 ? 17 : 11, 0.0);
        set_mixture(&scene, &made, mixture);
        struct both both = both_make(scene, &made);
        if (k % 5 >= 2) {
            both_permute(&both);
        }
        places_at_random(&places, made.p.n, dimension, (uint64_t)k, k % 4 == 0 ? 0 : 21);
        stale += part_in_all_ways(&both, &places);
        both_free(&both);
        gbg_context_destroy(&context);
    }
    print_message("%lld lists became stale in rounds\n", (long long)stale);
    assert_true(stale > 20 / both_part());
}

/* Free moves in a suspension, parted until nobody overlaps: more rounds than are started at a time.
 */
static void rounds_that_end(void **state)
{
    (void)state;
    int64_t most = 0;
    for (int k = 0; k < 8; k++) {
        if (!both_takes(k)) {
            continue;
        }
        int dimension = 2 + k % 2;
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = made_scene(context, dimension, boxes[dimension - 2][k / 2 % 2]);
        scene.unwrapped = scene.overlap = 1;
        made_lattice(&made, &scene, dimension == 2 ? 19 : 12, 0.01);
        struct both both = both_make(scene, &made);
        both_read(&both, &places);
        for (int jump = 0; jump < 6; jump++) {
            both_keep(&both);
            places_jump(&places, &both.engine[0]->state.box, 0.02 + 0.08 * jump, (uint64_t)k);
            both_place(&both, &places);
            both_list(&both);
            int64_t rounds = correct_both(
                &both, k % 4 < 2 ? GBG_PARTING_BOUNCE : GBG_PARTING_CONTACT, 3000, 0.25);
            most = rounds > most ? rounds : most;
            both_read(&both, &places);
        }
        both_free(&both);
        gbg_context_destroy(&context);
    }
    print_message("up to %lld rounds\n", (long long)most);
    assert_true(most > 20 / both_part());
}

static void small_numbers(void **state)
{
    (void)state;
    static const int64_t counts[] = {0, 1, 2, 3, 31, 32, 33, 65};
    double length[3] = {4.4, 4.4, 4.4}; /* fewer than three cells an axis */
    for (int k = 0; k < 16; k++) {
        if (!both_takes(k)) {
            continue;
        }
        int dimension = 2 + k % 2;
        double wide[3] = {11.0, 9.5, 12.0};
        int64_t n = counts[k / 2];
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = made_scene(context, dimension, n <= 3 ? length : wide);
        scene.unwrapped = scene.overlap = 1;
        made_lattice(&made, &scene, n <= 3 ? 3 : dimension == 2 ? 9 : 5, 0.0);
        made.p.n = n;
        struct both both = both_make(scene, &made);
        places_at_random(&places, n, dimension, (uint64_t)k, k % 4 < 2 ? 2 : 0);
        part_in_all_ways(&both, &places);
        both_free(&both);
        gbg_context_destroy(&context);
    }
}

/* Whole runs end at the same places, having counted the same. */
static void run_both(struct gbg_scene scene, int64_t steps, int ordering)
{
    struct both both = both_make(scene, &made);
    char digest[2][65];
    for (int b = 0; b < 2; b++) {
        both.engine[b]->ordering = ordering;
        if (gbg_engine_advance(both.engine[b], steps) != GBG_OK) {
            fail_msg("%s", gbg_message(both.context[b]));
        }
        assert_int_equal(gbg_engine_digest(both.engine[b], digest[b]), GBG_OK);
    }
    const struct gbg_engine *p = both.engine[0], *q = both.engine[1];
    print_message("%lld rounds, %lld put back, %s\n", (long long)p->contact_rounds,
                  (long long)p->reverted, digest[0]);
    assert_string_equal(digest[0], digest[1]);
    assert_int_equal(p->contact_rounds, q->contact_rounds);
    assert_int_equal(p->contact_pairs, q->contact_pairs);
    assert_int_equal(p->reverted, q->reverted);
    assert_int_equal(p->repeated, q->repeated);
    both_same_real(p->contact_virial, q->contact_virial, "the virial");
    both_same_real(p->moved, q->moved, "the largest move");
    assert_true(p->contact_pairs > 0);
    both_free(&both);
}

static void whole_runs(void **state)
{
    (void)state;
    static const int rules[] = {GBG_RULE_BOUNCE, GBG_RULE_CONTACT, GBG_RULE_CARTER};
    for (int k = 0; k < 6; k++) {
        if (!both_takes(k)) {
            continue;
        }
        int dimension = 2 + k % 2;
        double length[3] = {26.0, 24.0, 23.0};
        if (dimension == 3) {
            length[0] = 9.5, length[1] = 9.0, length[2] = 9.25;
        }
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = made_scene(context, dimension, length);
        scene.rule = rules[k / 2];
        scene.reverted = 1e-2;
        scene.unwrapped = scene.overlap = k % 4 < 2;
        scene.n_forces = 1;
        scene.force[0] = (struct gbg_force){.power = 6.0, .sum = GBG_SUM_CUTOFF, .cutoff = 2.5};
        made_lattice(&made, &scene, dimension == 2 ? 20 : 7, 0.01);
        run_both(scene, 100, k < 2 ? GBG_ORDERING_ALWAYS : GBG_ORDERING_AUTO);
        scene.n_forces = 0; /* noise alone, in a crowd */
        made_lattice(&made, &scene, dimension == 2 ? 22 : 8, 0.0);
        run_both(scene, 100, k < 2 ? GBG_ORDERING_AUTO : GBG_ORDERING_ALWAYS);
        gbg_context_destroy(&context);
    }
}

/* Rounds that run out: the same particles go back. */
static void runs_with_roll_backs(void **state)
{
    (void)state;
    for (int dimension = 2; dimension <= 3; dimension++) {
        double length[3] = {20.5, 20.5, 20.5};
        struct gbg_context *context = made_context("cpu");
        if (dimension == 3) {
            length[0] = length[1] = length[2] = 9.2;
        }
        struct gbg_scene scene = made_scene(context, dimension, length);
        scene.max_rounds = 1;
        scene.reverted = 1.0;
        scene.unwrapped = scene.overlap = 1;
        made_lattice(&made, &scene, dimension == 2 ? 20 : 9, 0.005);
        run_both(scene, 30, GBG_ORDERING_AUTO);
        gbg_context_destroy(&context);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(crowds),
        cmocka_unit_test(rounds_that_end),
        cmocka_unit_test(small_numbers),
        cmocka_unit_test(whole_runs),
        cmocka_unit_test(runs_with_roll_backs),
    };
    return both_missing() ? BOTH_SKIPPED : cmocka_run_group_tests(tests, NULL, NULL);
}
