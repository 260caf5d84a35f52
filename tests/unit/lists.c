/* Tests: pair lists hold every pair: forces over them against a double loop, in boxes and crowds
 * that make cells few, rows long, or the words of a coordinate coarse. */
#include "made_scene.h"

#include "gamboge/kernels.h"

enum { MOST = 1600 };

struct crowd {
    const char *what;
    int dimension;
    int64_t n;
    double length[3], extent[3]; /* of the box, and of the part around the origin that is filled */
    double cutoff;
};

/* Lengths and coordinates are dyadic, so that no image is rounded in the reference. */
static const struct crowd crowds[] = {
    {"many cells", 2, 1500, {64, 32, 0}, {64, 32, 0}, 2.5},
    {"many cells", 3, 1500, {16, 8, 16}, {16, 8, 16}, 1.75},
    {"long rows", 2, 1500, {16, 16, 0}, {16, 16, 0}, 4.5},
    {"long rows", 3, 1500, {16, 16, 16}, {8, 8, 8}, 4.0},
    {"all in one cell", 2, 900, {1024, 1024, 0}, {0.5, 0.5, 0}, 1.0},
    {"two cells", 2, 300, {8, 8, 0}, {8, 8, 0}, 3.9},
    {"one cell", 3, 300, {4, 4, 4}, {4, 4, 4}, 1.999},
    {"a coarse word", 2, 200, {0x1p37, 0x1p36, 0}, {16, 16, 0}, 2.5},
    {"a coarse word", 3, 200, {0x1p40, 8, 0x1p30}, {8, 8, 8}, 2.5},
    {"a thin box", 2, 1000, {4096, 4, 0}, {1024, 4, 0}, 1.5},
};

static double made_coordinate(const struct crowd *crowd, int64_t i, int axis)
{
    double u = made_uniform((uint64_t)(3 * i + axis)) - 0.5;
    return rint(u * crowd->extent[axis] * 4096.0) / 4096.0;
}

static void reference(const struct crowd *crowd, double r[3][MOST], double sum[3][MOST])
{
    memset(sum, 0, 3 * sizeof sum[0]);
    for (int64_t i = 0; i < crowd->n; i++) {
        for (int64_t j = 0; j < crowd->n; j++) {
            double d[3] = {0.0, 0.0, 0.0}, squared = 0.0;
            for (int a = 0; a < crowd->dimension; a++) {
                d[a] = r[a][i] - r[a][j];
                d[a] -= crowd->length[a] * rint(d[a] / crowd->length[a]);
                squared += d[a] * d[a];
            }
            if (squared == 0.0 || squared >= crowd->cutoff * crowd->cutoff) {
                continue;
            }
            for (int a = 0; a < crowd->dimension; a++) {
                sum[a][i] += d[a] / squared;
            }
        }
    }
}

static void every_pair(void **state)
{
    (void)state;
    static double r[3][MOST], f[3][MOST], expected[3][MOST], one[MOST];
    static const char *const contexts[] = {"cpu:threads=1", "cpu:threads=3", "poison:threads=2",
                                           "cpu:threads=1,isa=avx2", "cpu:threads=1,isa=generic"};
    for (int i = 0; i < MOST; i++) {
        one[i] = 1.0;
    }
    for (size_t k = 0; k < sizeof crowds / sizeof *crowds; k++) {
        const struct crowd *crowd = &crowds[k];
        for (int64_t i = 0; i < crowd->n; i++) {
            for (int a = 0; a < crowd->dimension; a++) {
                r[a][i] = made_coordinate(crowd, i, a);
            }
        }
        reference(crowd, r, expected);
        for (size_t c = 0; c < sizeof contexts / sizeof *contexts; c++) {
            struct gbg_context *context;
            if (gbg_context_create(contexts[c], &context) != GBG_OK) {
                continue; /* not on this processor */
            }
            double *z = crowd->dimension == 3 ? r[2] : NULL, *fz = z ? f[2] : NULL;
            if (gbg_pair_forces(context, crowd->dimension, crowd->length, 1.0, crowd->cutoff,
                                "double", crowd->n, r[0], r[1], z, 1, one, one, f[0], f[1], fz,
                                1) != GBG_OK) {
                fail_msg("%s", gbg_message(context));
            }
            gbg_context_destroy(&context);
            double error = 0.0;
            for (int a = 0; a < crowd->dimension; a++) {
                for (int64_t i = 0; i < crowd->n; i++) {
                    error = fmax(error, fabs(f[a][i] - expected[a][i]));
                }
            }
            if (c == 0) {
                print_message("%dD, %s: largest error %.1e of sums\n", crowd->dimension,
                              crowd->what, error);
            }
            assert_true(error < 1e-9); /* a pair that is missing: 0.1 or more */
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_pair)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
