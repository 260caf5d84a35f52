/* Tests of a GPU against the CPU: the certificate of a step and the roll-back, to the last bit. */
#include "both_state.h"

static struct made_particles made;
static struct places places;

static const double boxes[2][2][3] = {{{24.0, 24.0}, {30.0, 19.0}},
                                      {{15.0, 15.0, 15.0}, {17.0, 14.0, 15.5}}};

/* What both certify. */
static struct gbg_certificate certify_both(struct both *both, double tolerance, int straight)
{
    struct gbg_certificate found[2];
    for (int b = 0; b < 2; b++) {
        struct gbg_engine *engine = both->engine[b];
        found[b] = (struct gbg_certificate){.tolerance = tolerance, .straight = straight};
        assert_int_equal(
            engine->kernels->certify(engine->device, &engine->state, engine->contacts, &found[b]),
            GBG_OK);
    }
    assert_int_equal(found[0].listed, found[1].listed);
    assert_int_equal(found[0].undecided, found[1].undecided);
    assert_int_equal(found[0].overlapping, found[1].overlapping);
    assert_int_equal(found[0].passed, found[1].passed);
    assert_int_equal(found[0].lowest.first, found[1].lowest.first);
    assert_int_equal(found[0].lowest.second, found[1].lowest.second);
    both_same_real(found[0].lowest.distance, found[1].lowest.distance,
                   "the lowest pair's distance");
    both_same_real(found[0].largest, found[1].largest, "the largest move");
    return found[0];
}

/* What is seen of jumps by lists, by cells and along paths. */
struct seen {
    int64_t overlapping, passed, undecided, listed, cells;
};

static void add(struct seen *seen, struct gbg_certificate found)
{
    seen->overlapping += found.overlapping;
    seen->passed += found.passed;
    seen->undecided += found.undecided;
    seen->listed += found.listed;
    seen->cells += !found.listed;
}

static void jumps(void **state)
{
    (void)state;
    struct seen seen = {0};
    static const double jump[] = {0.0, 1e-9, 0.05, 0.4, 0.9, 1.6, 6.0};
    for (int k = 0; k < 4 * MIXTURES; k++) {
        if (!both_takes(k)) {
            continue;
        }
        int dimension = 2 + k % 2;
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = made_scene(context, dimension, boxes[dimension - 2][k / 2 % 2]);
        made_lattice(&made, &scene, dimension == 2 ? 15 : 11, 0.01);
        set_mixture(&scene, &made, k / 4);
        struct both both = both_make(scene, &made);
        if (k % 3 == 1) {
            both_permute(&both);
        }
        for (size_t m = 0; m < sizeof jump / sizeof *jump; m++) {
            both_read(&both, &places);
            both_keep(&both);
            both_list(&both);
            places_jump(&places, &both.engine[0]->state.box, jump[m], 10000 * (uint64_t)k);
            both_place(&both, &places);
            add(&seen, certify_both(&both, 1e-12, 1)); /* with the list of before the step */
            both_list(&both);
            add(&seen, certify_both(&both, 1e-12, 1));
            add(&seen, certify_both(&both, 0.3, 0));
        }
        both_free(&both);
        gbg_context_destroy(&context);
    }
    print_message("%lld overlap, %lld passed, %lld undecided, %lld by lists, %lld by cells\n",
                  (long long)seen.overlapping, (long long)seen.passed, (long long)seen.undecided,
                  (long long)seen.listed, (long long)seen.cells);
    assert_true(seen.overlapping > 100 / both_part() && seen.passed > 20 / both_part());
    assert_true(seen.undecided > 0 || both_part() > 1);
    assert_true(seen.listed > 100 / both_part() && seen.cells > 20 / both_part());
}

/* Two particles at contact (1 - 1e-12) and a few quanta nearer or farther, across an edge. */
static void decisions_at_the_tolerance(void **state)
{
    (void)state;
    static const double lengths[][2] = {{24, 24}, {24, 10}, {1e6, 1e6}, {10, 24}};
    int overlapping = 0, all = 0;
    for (int k = 0; k < 4; k++) {
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = made_scene(context, 2, lengths[k]);
        made_lattice(&made, &scene, 4, 0.0);
        struct both both = both_make(scene, &made);
        both_keep(&both);
        both_read(&both, &places);
        for (int step = -40; step <= 40; step++) {
            long double angle = 0.7L + 0.01L * step, d = 1 - 1e-12L;
            for (int a = 0; a < 2; a++) {
                long double offset = a ? sinl(angle) * d : cosl(angle) * d;
                places.fraction[a][0] = a ? 0xFFFFFFFFFFFFFF00u : 3;
                places.fraction[a][1] =
                    places.fraction[a][0] +
                    (uint64_t)(int64_t)llrintl(offset / scene.length[a] * 18446744073709551616.0L) +
                    (uint64_t)(int64_t)(step / 8);
            }
            both_place(&both, &places);
            both_list(&both);
            overlapping += certify_both(&both, 1e-12, 0).overlapping > 0;
            all++;
        }
        both_free(&both);
        gbg_context_destroy(&context);
    }
    print_message("%d of %d overlap\n", overlapping, all);
    assert_true(overlapping > all / 10 && overlapping < all - all / 10);
}

/* Jumps that violate many pairs: the same particles go back, wave after wave. */
static void roll_backs(void **state)
{
    (void)state;
    int64_t all = 0, not_all = 0;
    static const double jump[] = {0.0, 0.1, 0.4, 1.3};
    for (int k = 0; k < 4 * MIXTURES; k++) {
        if (!both_takes(k)) {
            continue;
        }
        int dimension = 2 + k % 2;
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = made_scene(context, dimension, boxes[dimension - 2][k / 2 % 2]);
        scene.unwrapped = k % 3 != 0;
        scene.overlap = k % 3 != 1;
        made_lattice(&made, &scene, dimension == 2 ? 15 : 11, 0.01);
        set_mixture(&scene, &made, k / 4);
        struct both both = both_make(scene, &made);
        for (size_t m = 0; m < 2 * (sizeof jump / sizeof *jump); m++) {
            int64_t reverted[2];
            both_read(&both, &places); /* no overlaps: from the start or the last roll-back */
            both_keep(&both);
            places_jump(&places, &both.engine[0]->state.box, jump[m / 2],
                        10000 * (uint64_t)k + 77 * m);
            both_place(&both, &places);
            for (int b = 0; b < 2; b++) {
                struct gbg_engine *engine = both.engine[b];
                assert_int_equal(engine->kernels->roll_back(engine->device, &engine->state, 1e-12,
                                                            m % 2 == 0, &reverted[b]),
                                 GBG_OK);
            }
            assert_int_equal(reverted[0], reverted[1]);
            both_same_state(&both);
            both_list(&both);
            struct gbg_certificate found = certify_both(&both, 1e-12, m % 2 == 0);
            assert_true(found.undecided || (found.overlapping == 0 && found.passed == 0));
            all += reverted[0];
            not_all += reverted[0] > 0 && reverted[0] < places.n;
        }
        both_free(&both);
        gbg_context_destroy(&context);
    }
    print_message("%lld put back\n", (long long)all);
    assert_true(all > 1000 / both_part() && not_all > 10 / both_part());
}

static void small_numbers(void **state)
{
    (void)state;
    double length[3] = {4.4, 4.6, 4.4}; /* fewer than three cells an axis */
    for (int k = 0; k < 10; k++) {
        if (!both_takes(k)) {
            continue;
        }
        int dimension = 2 + k % 2;
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = made_scene(context, dimension, length);
        scene.unwrapped = scene.overlap = 1;
        made_lattice(&made, &scene, 3, 0.0);
        made.p.n = k / 2;
        struct both both = both_make(scene, &made);
        for (int jump = 0; jump < 8; jump++) {
            int64_t reverted[2];
            both_read(&both, &places);
            both_keep(&both);
            both_list(&both);
            places_jump(&places, &both.engine[0]->state.box, 0.15 * jump,
                        (uint64_t)(100 * k + jump));
            both_place(&both, &places);
            certify_both(&both, 1e-12, 1);
            for (int b = 0; b < 2; b++) {
                struct gbg_engine *engine = both.engine[b];
                assert_int_equal(engine->kernels->roll_back(engine->device, &engine->state, 1e-12,
                                                            1, &reverted[b]),
                                 GBG_OK);
            }
            assert_int_equal(reverted[0], reverted[1]);
            both_same_state(&both);
        }
        both_free(&both);
        gbg_context_destroy(&context);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(jumps),
        cmocka_unit_test(decisions_at_the_tolerance),
        cmocka_unit_test(roll_backs),
        cmocka_unit_test(small_numbers),
    };
    return both_missing() ? BOTH_SKIPPED : cmocka_run_group_tests(tests, NULL, NULL);
}
