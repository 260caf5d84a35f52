/* Tests of a GPU against the CPU: keeping coordinates, putting them back, and overlapping pairs. */
#include "both_state.h"
#include "gamboge/kernels.h"

static struct made_particles made;
static struct places places;

/* Coordinates, images and flags that were kept come back, whatever happened to them. */
static void kept_and_put_back(void **state)
{
    (void)state;
    static const int64_t counts[] = {0, 1, 3, 4, 33, 127, 400};
    for (int k = 0; k < 14; k++) {
        int dimension = 2 + k % 2;
        double length[3] = {26.0, 24.0, 23.0};
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = made_scene(context, dimension, length);
        scene.unwrapped = k % 4 < 2;
        scene.overlap = k % 3 < 2;
        made_lattice(&made, &scene, dimension == 2 ? 20 : 8, 0.01);
        made.p.n = counts[k / 2];
        struct both both = both_make(scene, &made);
        struct gbg_state *p = &both.engine[0]->state, *q = &both.engine[1]->state;
        static int32_t image[PLACES_MAX];
        static unsigned char flag[PLACES_MAX];
        size_t words = (size_t)made.p.n * 4;
        for (int64_t i = 0; i < made.p.n; i++) {
            image[i] = (int32_t)(i * 7 - 100);
            flag[i] = 1;
        }
        for (int a = 0; a < dimension && p->image[a]; a++) {
            both_upload(&both, p->image[a], q->image[a], image, words);
        }
        if (p->overlapped) {
            both_upload(&both, p->overlapped, q->overlapped, flag, (size_t)made.p.n);
        }
        both_read(&both, &places);
        both_keep(&both);
        both_same_state(&both); /* flags are cleared */
        memset(image, 3, sizeof image);
        for (int a = 0; a < dimension; a++) {
            both_same(&both, p->start_high[a], q->start_high[a], words, "kept high words");
            both_same(&both, p->start_low[a], q->start_low[a], words, "kept low words");
            if (p->image[a]) {
                both_same(&both, p->start_image[a], q->start_image[a], words, "kept images");
                both_upload(&both, p->image[a], q->image[a], image, words);
            }
        }
        if (p->overlapped) { /* stay as they are */
            both_upload(&both, p->overlapped, q->overlapped, flag, (size_t)made.p.n);
        }
        places_jump(&places, &p->box, 3.0, (uint64_t)k);
        both_place(&both, &places);
        for (int b = 0; b < 2; b++) {
            struct gbg_engine *engine = both.engine[b];
            assert_int_equal(engine->kernels->put_back(engine->device, &engine->state), GBG_OK);
        }
        both_same_state(&both);
        both_free(&both);
        gbg_context_destroy(&context);
    }
}

/* Number and lowest pair among particles of several species. */
static void lowest_pairs(void **state)
{
    (void)state;
    int64_t all = 0;
    double length[2][3] = {{26.0, 29.0}, {17.0, 15.0, 16.0}};
    for (int k = 0; k < 2 * MIXTURES; k++) {
        int dimension = 2 + k % 2;
        struct gbg_context *context = made_context("cpu");
        struct gbg_scene scene = made_scene(context, dimension, length[k % 2]);
        made_lattice(&made, &scene, dimension == 2 ? 17 : 11, 0.0);
        set_mixture(&scene, &made, k / 2);
        struct both both = both_make(scene, &made);
        for (int kind = 0; kind < 3; kind++) {
            static int32_t pair[2][2][8];
            struct gbg_pair lowest[2];
            int64_t count[2];
            if (kind > 0) {
                places_at_random(&places, made.p.n, dimension, (uint64_t)k, kind == 1 ? 0 : 40);
                both_place(&both, &places);
            }
            for (int b = 0; b < 2; b++) {
                struct gbg_engine *engine = both.engine[b];
                memset(pair[b], -1, sizeof pair[b]);
                assert_int_equal(engine->kernels->overlaps(engine->device, &engine->state, 1e-12,
                                                           kind == 2 ? 8 : 0, pair[b][0],
                                                           pair[b][1], &lowest[b], &count[b]),
                                 GBG_OK);
            }
            assert_int_equal(count[0], count[1]);
            assert_int_equal(lowest[0].first, lowest[1].first);
            assert_int_equal(lowest[0].second, lowest[1].second);
            both_same_real(lowest[0].distance, lowest[1].distance, "the lowest pair's distance");
            assert_memory_equal(pair[0], pair[1], sizeof pair[0]);
            all += count[0];
        }
        both_free(&both);
        gbg_context_destroy(&context);
    }
    assert_true(all > 1000);
}

enum { MOST = 2000, ROOM = MOST * 40 };
static double r[3][MOST], diameter[MOST];
static int32_t first[2][ROOM], second[2][ROOM];

/* Lists of pairs of a caller's arrays, with any room for them. */
static void pairs_of_arrays(void **state)
{
    (void)state;
    static const double boxes[][3] = {{20, 20, 20}, {2000, 2, 2}, {7, 11, 3}, {2, 2, 2}};
    static const int64_t counts[] = {0, 1, 2, 33, 600, 1999};
    struct gbg_context *context[2] = {made_context("cpu"), made_context("cuda:0")};
    for (int k = 0; k < 48; k++) {
        int dimension = 2 + k % 2;
        int64_t n = counts[k / 8], count[2];
        for (int64_t i = 0; i < n; i++) {
            for (int a = 0; a < dimension; a++) {
                r[a][i] = boxes[k / 2 % 4][a] *
                          (6.0 * made_uniform((uint64_t)(8 * i + a + 100000 * k)) - 3.0);
            }
            diameter[i] = i % 50 == 0 ? 0.0 : 0.05 + 0.5 * made_uniform((uint64_t)(8 * i + 5));
        }
        int64_t room = ROOM;
        for (int part = 0; part < 4; part++) { /* all, half, one less than all, none */
            for (int b = 0; b < 2; b++) {
                memset(first[b], -1, sizeof first[b]);
                memset(second[b], -1, sizeof second[b]);
                assert_int_equal(gbg_overlaps_find(context[b], dimension, boxes[k / 2 % 4], n, r[0],
                                                   r[1], dimension == 3 ? r[2] : NULL, 1, diameter,
                                                   1e-12, part % 2, room, first[b], second[b],
                                                   &count[b]),
                                 GBG_OK);
            }
            assert_int_equal(count[0], count[1]);
            assert_memory_equal(first[0], first[1], sizeof first[0]);
            assert_memory_equal(second[0], second[1], sizeof second[0]);
            int64_t all = count[0] < ROOM ? count[0] : ROOM;
            room = part == 0 ? all / 2 : part == 1 && all > 0 ? all - 1 : 0;
        }
    }
    for (int b = 0; b < 2; b++) {
        gbg_context_destroy(&context[b]);
    }
}

/* Overlaps of a caller's arrays are removed by the same moves. */
static void removal(void **state)
{
    (void)state;
    static const double length[3] = {40, 40, 12};
    static double moved[2][3][MOST];
    for (int k = 0; k < 4; k++) {
        int dimension = 2 + k % 2;
        int64_t n = 600, rounds[2];
        for (int64_t i = 0; i < n; i++) {
            for (int a = 0; a < dimension; a++) {
                r[a][i] = length[a] * (6.0 * made_uniform((uint64_t)(8 * i + a)) - 3.0);
                r[a][i] = i % 30 == 1 ? r[a][i - 1] : r[a][i];
            }
            diameter[i] = 0.5 + 0.5 * made_uniform((uint64_t)(8 * i + 5));
        }
        for (int b = 0; b < 2; b++) {
            struct gbg_context *context = made_context(b ? "cuda:0" : "cpu");
            memcpy(moved[b], r, sizeof r);
            assert_int_equal(gbg_overlaps_remove(context, dimension, length, n, moved[b][0],
                                                 moved[b][1], dimension == 3 ? moved[b][2] : NULL,
                                                 1, diameter, k < 2 ? "bounce" : "contact", 0,
                                                 &rounds[b]),
                             GBG_OK);
            gbg_context_destroy(&context);
        }
        assert_int_equal(rounds[0], rounds[1]);
        assert_memory_equal(moved[0], moved[1], sizeof r);
        print_message("%dD: %lld rounds\n", dimension, (long long)rounds[0]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kept_and_put_back),
        cmocka_unit_test(lowest_pairs),
        cmocka_unit_test(pairs_of_arrays),
        cmocka_unit_test(removal),
    };
    return both_missing() ? BOTH_SKIPPED : cmocka_run_group_tests(tests, NULL, NULL);
}
