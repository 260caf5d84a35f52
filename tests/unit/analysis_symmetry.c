/* Tests of c/analysis: what must not change the result, sums of partials, changing boxes. */
#include "analysis_help.h"

static struct points points, other;
static const double box[3] = {20, 17, 18};

static struct gbg_analysis *analyse(struct gbg_context *context, int dimension, double k_max,
                                    const char *method, int species, const struct points *from)
{
    struct gbg_analysis *analysis;
    MUST(context, gbg_analysis_create(context, dimension, box, species, &analysis));
    MUST(context, gbg_analysis_set_real(analysis, "k_max", k_max));
    MUST(context, gbg_analysis_set_text(analysis, "method", method));
    MUST(context, gbg_analysis_set_text(analysis, "partials", species > 1 ? "yes" : "no"));
    if (from) {
        MUST(context, add_points(analysis, from, species > 1 ? from->species : NULL, NULL));
    }
    return analysis;
}

/* Density modes and averages with 1, 2, 3 and 7 threads: the same bits. */
static void threads_do_not_change_a_bit(void **state)
{
    (void)state;
    static const char *const backend[] = {"cpu:threads=1", "cpu:threads=2", "cpu:threads=3",
                                          "cpu:threads=7"};
    const char *const methods[] = {"direct", "mesh"};
    fill_uniform(&points, 40000, 1, box);
    for (int i = 0; i < 2 + 2 * gbg_has_component("fftw"); i++) {
        int dimension = 2 + i % 2;
        double *rho = NULL, *frame = NULL;
        size_t rho_size = 0, frame_size = 0;
        points.n = i < 2 ? 1000 : 40000;
        for (int t = 0; t < 4; t++) {
            struct gbg_context *c = context_of(backend[t]);
            struct gbg_analysis *a =
                analyse(c, dimension, dimension == 2 ? 40 : 7, methods[i / 2], 3, &points);
            size_t count = 6 * (size_t)a->modes.count;
            size_t columns = (size_t)(a->columns * a->shells.count);
            if (t == 0) {
                rho_size = count * sizeof *rho;
                frame_size = columns * sizeof *frame;
                rho = malloc(rho_size);
                frame = malloc(frame_size);
                assert_true(rho && frame);
                memcpy(rho, a->density->rho, rho_size);
                memcpy(frame, a->frame, frame_size);
            }
            assert_memory_equal(rho, a->density->rho, rho_size);
            assert_memory_equal(frame, a->frame, frame_size);
            gbg_analysis_destroy(&a);
            gbg_context_destroy(&c);
        }
        free(rho);
        free(frame);
    }
}

/* Largest difference of S over the sum of the bounds. */
static double difference(struct gbg_analysis *a, struct gbg_analysis *b)
{
    double largest = 0;
    assert_int_equal(a->shells.count, b->shells.count);
    for (int64_t s = 0; s < a->shells.count; s++) {
        double bound =
            gbg_analysis_mean(a, GBG_COLUMN_BOUND, s) + gbg_analysis_mean(b, GBG_COLUMN_BOUND, s);
        double d =
            fabs(gbg_analysis_mean(a, GBG_COLUMN_S, s) - gbg_analysis_mean(b, GBG_COLUMN_S, s));
        largest = fmax(largest, d / bound);
    }
    return largest;
}

/* Order of particles, origin, images, layout of the caller's arrays. */
static void the_same_points_give_the_same_result(void **state)
{
    (void)state;
    struct gbg_context *c = context_of("cpu");
    fill_uniform(&points, 3000, 2, box);
    for (int64_t i = 0; i < 3 * points.n; i++) {
        /* Coordinates with few digits: shifts and images are then exact. */
        double *x = &points.x[i % 3][i / 3];
        *x = floor(*x * 0x1p20) * 0x1p-20;
    }
    for (int dimension = 2; dimension <= 3; dimension++) {
        double k_max = dimension == 2 ? 20 : 5;
        struct gbg_analysis *a = analyse(c, dimension, k_max, "auto", 1, &points), *b;
        for (int change = 0; change < 3; change++) {
            other = points;
            for (int64_t i = 0; i < points.n; i++) {
                int64_t j = change == 0 ? points.n - 1 - i : i;
                for (int axis = 0; axis < 3; axis++) {
                    double x = points.x[axis][j];
                    x += change == 1 ? -6.25 : 0;
                    x += change == 2 ? (double)((i * 7 + axis) % 11 - 5) * box[axis] : 0;
                    other.x[axis][i] = x;
                }
            }
            b = analyse(c, dimension, k_max, "auto", 1, &other);
            double largest = difference(a, b);
            print_message("%dD %s: difference/bound %.2g\n", dimension,
                          change == 0   ? "order reversed"
                          : change == 1 ? "box shifted"
                                        : "images",
                          largest);
            assert_true(largest <= 1);
            gbg_analysis_destroy(&b);
        }
        static double packed[3 * HELP_MOST];
        for (int64_t i = 0; i < points.n; i++) {
            for (int axis = 0; axis < 3; axis++) {
                packed[3 * (points.n - 1 - i) + axis] = points.x[axis][i];
            }
        }
        const double *last = packed + 3 * (points.n - 1);
        b = analyse(c, dimension, k_max, "auto", 1, NULL);
        MUST(c,
             gbg_analysis_add_frame(b, points.n, last, last + 1, last + 2, -3, NULL, 1, NULL, 0));
        assert_memory_equal(a->density->rho, b->density->rho, 16 * (size_t)a->modes.count);
        gbg_analysis_destroy(&a);
        gbg_analysis_destroy(&b);
    }
    gbg_context_destroy(&c);
}

/* S = sum sqrt(c_a c_b) S_ab, and the matrix of partials of a shell is positive semidefinite:
 * its 2 x 2 minors and its determinant are not negative. The fourth species is empty. */
static void partials_are_consistent(void **state)
{
    (void)state;
    struct gbg_context *c = context_of("cpu");
    fill_uniform(&points, 2000, 3, box);
    struct gbg_analysis *a = analyse(c, 2, 25, "auto", 4, &points);
    static double S[HELP_MOST], P[10][HELP_MOST], E[HELP_MOST];
    MUST(c, gbg_analysis_get(a, "S", HELP_MOST, S));
    for (int i = 0; i < 4; i++) {
        for (int j = i; j < 4; j++) {
            MUST(c, gbg_analysis_get_partial(a, j, i, HELP_MOST, P[gbg_analysis_pair(4, i, j)], E));
        }
    }
    double worst = 0;
    for (int64_t s = 0; s < a->shells.count; s++) {
        double M[3][3], sum = 0;
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) {
                M[i][j] = P[gbg_analysis_pair(4, i < j ? i : j, i < j ? j : i)][s];
                double weight = (double)a->n_of[i] * (double)a->n_of[j];
                sum += sqrt(weight) / (double)a->n * M[i][j];
            }
        }
        worst = fmax(worst, fabs(sum - S[s]) / S[s]);
        assert_true(M[0][0] * M[1][1] >= M[0][1] * M[0][1] * (1 - 1e-12));
        assert_true(M[1][1] * M[2][2] >= M[1][2] * M[1][2] * (1 - 1e-12));
        assert_true(M[0][0] * M[2][2] >= M[0][2] * M[0][2] * (1 - 1e-12));
        double determinant = M[0][0] * (M[1][1] * M[2][2] - M[1][2] * M[1][2]) -
                             M[0][1] * (M[0][1] * M[2][2] - M[1][2] * M[0][2]) +
                             M[0][2] * (M[0][1] * M[1][2] - M[1][1] * M[0][2]);
        assert_true(determinant >= -1e-12 * M[0][0] * M[1][1] * M[2][2]);
        for (int i = 0; i < 4; i++) {
            assert_true(isnan(P[gbg_analysis_pair(4, i, 3)][s]));
        }
        assert_true(isfinite(S[s]));
    }
    print_message("sum of partials: largest relative difference from S %.1e\n", worst);
    assert_true(worst < 1e-13);
    gbg_analysis_destroy(&a);
    gbg_context_destroy(&c);
}

/* The same fractions of a box that grows: rho does not change, k does. */
static void frames_may_bring_their_own_box(void **state)
{
    (void)state;
    struct gbg_context *c = context_of("cpu");
    fill_uniform(&points, 500, 4, box);
    struct gbg_analysis *a = analyse(c, 2, 8, "auto", 1, &points);
    struct gbg_analysis *b = analyse(c, 2, 8, "auto", 1, &points);
    other = points;
    double larger[3];
    for (int axis = 0; axis < 3; axis++) {
        larger[axis] = 1.25 * box[axis];
        for (int64_t i = 0; i < points.n; i++) {
            other.x[axis][i] *= 1.25;
        }
    }
    MUST(c, add_points(a, &points, NULL, NULL));
    MUST(c, add_points(b, &other, NULL, larger));
    for (int64_t m = 0; m < a->modes.count; m++) {
        for (int part = 0; part < 2; part++) {
            double d = a->density->rho[2 * m + part] - b->density->rho[2 * m + part];
            assert_true(fabs(d) < 1e-6 * sqrt(500));
        }
        assert_true(fabs(b->shells.k[m] * 1.25 / a->shells.k[m] - 1) < 1e-14);
    }
    /* The second frame of b by hand. */
    for (int64_t s = 0; s < b->shells.count; s++) {
        double low = gbg_shells_low(&b->shells, s), high = gbg_shells_high(&b->shells, s);
        double sum = 0, first = a->frame[GBG_COLUMN_S * a->shells.count + s], modes = 0;
        for (int64_t m = 0; m < b->modes.count; m++) {
            double k =
                hypot(two_pi * b->modes.n[0][m] / larger[0], two_pi * b->modes.n[1][m] / larger[1]);
            const double *rho = b->density->rho + 2 * m;
            if (k >= low && k < high) {
                sum += (rho[0] * rho[0] + rho[1] * rho[1]) / 500;
                modes++;
            }
        }
        int both = modes > 0;
        double expected = both ? 0.5 * (first + sum / modes) : first;
        assert_int_equal(b->frames_of[s], 1 + both);
        assert_true(fabs(gbg_analysis_mean(b, GBG_COLUMN_S, s) - expected) < 1e-12 * expected);
    }
    gbg_analysis_destroy(&a);
    gbg_analysis_destroy(&b);
    gbg_context_destroy(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(threads_do_not_change_a_bit),
        cmocka_unit_test(the_same_points_give_the_same_result),
        cmocka_unit_test(partials_are_consistent),
        cmocka_unit_test(frames_may_bring_their_own_box),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
