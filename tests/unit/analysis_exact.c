/* Tests of c/analysis: density modes and shells against direct sums in quadruple precision. */
#include "analysis_help.h"

#include <quadmath.h>

struct exact {
    __float128 real, imaginary;
};

/* sum_j exp(-2 pi i n.x_j/L) over the particles of a species (-1: all), in quadruple precision. */
static inline struct exact exact_mode(const struct points *points, int dimension,
                                      const double *lengths, const int32_t *n, int species)
{
    struct exact sum = {0, 0};
    for (int64_t i = 0; i < points->n; i++) {
        if (species >= 0 && points->species[i] != species) {
            continue;
        }
        __float128 turns = 0;
        for (int a = 0; a < dimension; a++) {
            turns += (__float128)n[a] * points->x[a][i] / lengths[a];
        }
        turns -= floorq(turns);
        __float128 sine, cosine;
        sincosq(2 * M_PIq * turns, &sine, &cosine);
        sum.real += cosine;
        sum.imaginary -= sine;
    }
    return sum;
}

static struct points points;

/* Sets of points that are hard in one way each. */
enum { UNIFORM, LATTICE, COINCIDENT, EDGES, FAR, VERY_FAR, CLUSTER, ONE, TWO, SETS };

static void fill(int set, const double *lengths)
{
    fill_uniform(&points, set == ONE ? 1 : set == TWO ? 2 : 400, (uint64_t)set, lengths);
    for (int64_t i = 0; i < points.n; i++) {
        for (int a = 0; a < 3; a++) {
            double *x = &points.x[a][i];
            int64_t on_axis = a == 0 ? i % 20 : a == 1 ? i / 20 : i * 7 % 20;
            double u = uniform(77, (uint64_t)(3 * i + a));
            switch (set) {
            case LATTICE:
                *x = (double)on_axis * lengths[a] / 20;
                break;
            case COINCIDENT:
                *x = 0.3 * lengths[a];
                break;
            case EDGES:
                *x = (double)(on_axis % 5 - 2) * 0.5 * lengths[a];
                break;
            case FAR:
                *x += floor(2000 * u - 1000) * lengths[a];
                break;
            case VERY_FAR:
                *x += (u - 0.5) * 1e15 * lengths[a];
                break;
            case CLUSTER:
                *x = (0.1 * (double)(i % 5) + 1e-3 * u) * lengths[a];
                break;
            default:
                break;
            }
        }
    }
}

struct tally {
    double worst_ratio, worst_error, worst_bound;
    int64_t compared, violated;
};

static void compare(struct tally *tally, double error, double bound)
{
    tally->worst_ratio = fmax(tally->worst_ratio, error / bound);
    tally->worst_error = fmax(tally->worst_error, error);
    tally->worst_bound = fmax(tally->worst_bound, bound);
    tally->compared++;
    tally->violated += !(error <= bound);
}

static struct gbg_analysis *analyse(struct gbg_context *context, int dimension,
                                    const double *lengths, double k_max, double tolerance,
                                    const char *method, int partials)
{
    struct gbg_analysis *analysis;
    MUST(context, gbg_analysis_create(context, dimension, lengths, partials ? 3 : 1, &analysis));
    MUST(context, gbg_analysis_set_real(analysis, "k_max", k_max));
    MUST(context, gbg_analysis_set_real(analysis, "tolerance", tolerance));
    MUST(context, gbg_analysis_set_text(analysis, "method", method));
    MUST(context, gbg_analysis_set_text(analysis, "partials", partials ? "yes" : "no"));
    MUST(context, add_points(analysis, &points, partials ? points.species : NULL, NULL));
    return analysis;
}

/* Every mode of an analysis against exact[mode]: the amplitude and S. */
static void compare_modes(struct tally *tally, const struct gbg_analysis *analysis,
                          const struct exact *exact, int64_t stride)
{
    const struct gbg_density *density = analysis->density;
    double n = (double)analysis->n;
    for (int64_t m = 0; m < analysis->modes.count; m += stride) {
        const double *rho = density->rho + 2 * m;
        __float128 x = rho[0] - exact[m].real, y = rho[1] - exact[m].imaginary;
        double e = sqrt(n) * (density->alias[m] + density->gain[m] * density->rounding);
        compare(tally, (double)sqrtq((x * x + y * y) / n), e);
        double S = (rho[0] * rho[0] + rho[1] * rho[1]) / n;
        __float128 S_exact =
            exact[m].real * exact[m].real + exact[m].imaginary * exact[m].imaginary;
        compare(tally, (double)fabsq(S - S_exact / n), 2 * sqrt(S) * e + e * e + 16 * 0x1p-53 * S);
    }
}

static void get(struct gbg_analysis *analysis, const char *quantity, double *value)
{
    MUST(analysis->context, gbg_analysis_get(analysis, quantity, HELP_MOST, value));
}

static void compare_shells(struct tally *tally, struct gbg_analysis *analysis,
                           const struct exact *exact)
{
    static double S[HELP_MOST], bound[HELP_MOST];
    get(analysis, "S", S);
    get(analysis, "S_numerr", bound);
    const struct gbg_shells *shells = &analysis->shells;
    for (int64_t s = 0; s < shells->count; s++) {
        __float128 sum = 0;
        int64_t modes = shells->start[s + 1] - shells->start[s];
        for (int64_t i = shells->start[s]; i < shells->start[s + 1]; i++) {
            const struct exact *mode = &exact[shells->mode[i]];
            sum += mode->real * mode->real + mode->imaginary * mode->imaginary;
        }
        if (modes > 0) {
            sum /= modes * analysis->n;
            compare(tally, (double)fabsq(S[s] - sum), bound[s]);
        }
    }
}

static void report(const char *what, const struct tally *tally)
{
    print_message("%s: %lld comparisons, %lld beyond the bound; largest error %.2e, largest bound "
                  "%.2e, largest error/bound %.2g\n",
                  what, (long long)tally->compared, (long long)tally->violated, tally->worst_error,
                  tally->worst_bound, tally->worst_ratio);
    assert_true(tally->compared > 100);
    assert_int_equal(tally->violated, 0);
}

static const double tolerances[] = {1e-3, 1e-6, 1e-9, 1e-12};

/* One set of points in one box, all tolerances and methods. */
static void try_set(struct gbg_context *context, int dimension, const double *lengths, double k_max,
                    struct tally *total)
{
    static struct exact exact[HELP_MOST];
    for (int method = 0; method < 2; method++) {
#ifndef GBG_WITH_FFTW
        if (method == 0) {
            continue;
        }
#endif
        for (size_t t = 0; t < sizeof tolerances / sizeof *tolerances; t++) {
            struct gbg_analysis *analysis = analyse(context, dimension, lengths, k_max,
                                                    tolerances[t], method ? "direct" : "mesh", 0);
            int made = method == 1 && t == 0;
#ifdef GBG_WITH_FFTW
            made = method == 0 && t == 0;
#endif
            for (int64_t m = 0; made && m < analysis->modes.count; m++) {
                int32_t n[3] = {analysis->modes.n[0][m], analysis->modes.n[1][m],
                                dimension == 3 ? analysis->modes.n[2][m] : 0};
                exact[m] = exact_mode(&points, dimension, lengths, n, -1);
            }
            compare_modes(&total[2 * t + (size_t)method], analysis, exact, 1);
            compare_shells(&total[2 * t + (size_t)method], analysis, exact);
            gbg_analysis_destroy(&analysis);
        }
    }
}

static void all_sets(int dimension, const double *lengths, double k_max, const char *isa)
{
    struct gbg_context *context = context_of(isa);
    struct tally total[8] = {{0}};
    for (int set = 0; set < SETS; set++) {
        fill(set, lengths);
        try_set(context, dimension, lengths, k_max, total);
    }
    for (int i = 0; i < 8; i++) {
        char what[64];
        snprintf(what, sizeof what, "%dD tolerance %.0e %s", dimension, tolerances[i / 2],
                 i % 2 ? "direct" : "mesh");
#ifndef GBG_WITH_FFTW
        if (i % 2 == 0) {
            continue;
        }
#endif
        report(what, &total[i]);
    }
    gbg_context_destroy(&context);
}

static void plane_modes_are_within_their_bounds(void **state)
{
    (void)state;
    static const double lengths[3] = {10, 7, 1};
    all_sets(2, lengths, two_pi / 10 * 10.5, "cpu:threads=1");
}

static void space_modes_are_within_their_bounds(void **state)
{
    (void)state;
    static const double lengths[3] = {10, 8, 12.3};
    all_sets(3, lengths, two_pi / 10 * 3.8, "cpu:threads=1");
}

static void portable_loops_are_within_their_bounds(void **state)
{
    (void)state;
    static const double lengths[3] = {10, 7, 1};
    all_sets(2, lengths, two_pi / 10 * 6.5, "cpu:isa=generic");
}

/* Many tiles and a fine mesh: a sample of the modes. */
static void sample_of_many_modes(int dimension, const double *lengths, double k_max, int64_t n,
                                 const char *method)
{
    struct gbg_context *context = context_of("cpu:threads=1");
    fill_uniform(&points, n, 5, lengths);
    for (size_t t = 0; t < sizeof tolerances / sizeof *tolerances; t++) {
        struct gbg_analysis *analysis =
            analyse(context, dimension, lengths, k_max, tolerances[t], method, 0);
        static struct exact exact[HELP_MOST];
        struct tally tally = {0};
        char what[128];
        int64_t stride = analysis->modes.count / 103;
        assert_true(analysis->modes.count < HELP_MOST);
        for (int64_t m = 0; m < analysis->modes.count && t == 0; m += stride) {
            int32_t mode[3] = {analysis->modes.n[0][m], analysis->modes.n[1][m],
                               dimension == 3 ? analysis->modes.n[2][m] : 0};
            exact[m] = exact_mode(&points, dimension, lengths, mode, -1);
        }
        compare_modes(&tally, analysis, exact, stride);
        MUST(context, gbg_analysis_describe(analysis, sizeof what, what));
        report(what, &tally);
        gbg_analysis_destroy(&analysis);
    }
    gbg_context_destroy(&context);
}

static void fine_meshes_are_within_their_bounds(void **state)
{
    (void)state;
    static const double plane[3] = {31, 29, 1}, space[3] = {9, 11, 10}, strip[3] = {1000, 1, 1};
#ifdef GBG_WITH_FFTW
    sample_of_many_modes(2, plane, two_pi / 31 * 150, 1500, "mesh");
    sample_of_many_modes(3, space, two_pi / 9 * 20, 1500, "mesh");
    sample_of_many_modes(2, strip, two_pi * 3.5, 1500, "mesh");
#endif
    sample_of_many_modes(2, plane, two_pi / 31 * 70, 1500, "direct");
    sample_of_many_modes(3, space, two_pi / 9 * 12, 200, "direct");
    sample_of_many_modes(2, strip, two_pi * 2.5, 1500, "direct");
}

/* Partials of three species, one of them of two particles: each shell within its bound. */
static void partials_are_within_their_bounds(void **state)
{
    (void)state;
    static const double lengths[3] = {10, 7, 8};
    struct tally tally = {0};
    struct gbg_context *context = context_of("cpu:threads=1");
    for (int dimension = 2; dimension <= 3; dimension++) {
        fill_uniform(&points, 200, 9, lengths);
        for (int64_t i = 6; i < points.n; i++) {
            points.species[i] = points.species[i] == 2 ? 0 : points.species[i];
        }
        struct gbg_analysis *analysis =
            analyse(context, dimension, lengths, two_pi / 10 * 4, 1e-4, "auto", 1);
        const struct gbg_shells *shells = &analysis->shells;
        for (int pair = 0, a = 0; a < 3; a++) {
            for (int b = a; b < 3; b++, pair++) {
                assert_int_equal(pair, gbg_analysis_pair(3, a, b));
                for (int64_t s = 0; s < shells->count; s++) {
                    __float128 sum = 0;
                    for (int64_t i = shells->start[s]; i < shells->start[s + 1]; i++) {
                        int32_t n[3] = {0, 0, 0};
                        for (int axis = 0; axis < dimension; axis++) {
                            n[axis] = analysis->modes.n[axis][shells->mode[i]];
                        }
                        struct exact u = exact_mode(&points, dimension, lengths, n, a);
                        struct exact v = exact_mode(&points, dimension, lengths, n, b);
                        sum += u.real * v.real + u.imaginary * v.imaginary;
                    }
                    __float128 counts = (__float128)analysis->n_of[a] * analysis->n_of[b];
                    sum /= sqrtq(counts) * (shells->start[s + 1] - shells->start[s]);
                    int column = GBG_COLUMN_PAIRS + 2 * pair;
                    compare(&tally, (double)fabsq(gbg_analysis_mean(analysis, column, s) - sum),
                            gbg_analysis_mean(analysis, column + 1, s));
                }
            }
        }
        gbg_analysis_destroy(&analysis);
    }
    assert_true(tally.compared > 40);
    assert_int_equal(tally.violated, 0);
    print_message("partials: %lld shells, largest error/bound %.2g\n", (long long)tally.compared,
                  tally.worst_ratio);
    gbg_context_destroy(&context);
}

/* Columns of particles, 49..60 in a box whose mesh has 64 nodes: the first Bragg peak aliases onto
 * n = 64 - columns, where S is exactly zero. The bound must hold and not be far away. */
static void bound_is_reached_by_aliased_bragg_peaks(void **state)
{
    (void)state;
#ifdef GBG_WITH_FFTW
    static const double lengths[3] = {1, 1, 1};
    struct gbg_context *context = context_of("cpu:threads=1");
    for (size_t t = 0; t < 3; t++) {
        double largest = 0;
        for (int columns = 49; columns <= 60; columns++) {
            points.n = columns;
            for (int64_t i = 0; i < columns; i++) {
                points.x[0][i] = (double)i / columns;
                points.x[1][i] = 0.25;
            }
            struct gbg_analysis *analysis =
                analyse(context, 2, lengths, two_pi * 16, tolerances[t], "mesh", 0);
            for (int64_t m = 0; m < analysis->modes.count; m++) {
                if (analysis->modes.n[0][m] == 64 - columns) {
                    const double *rho = analysis->density->rho + 2 * m;
                    double e = hypot(rho[0], rho[1]) / columns;
                    double bound = analysis->density->alias[m] +
                                   analysis->density->gain[m] * analysis->density->rounding;
                    assert_true(e <= bound);
                    largest = fmax(largest, e / bound);
                }
            }
            gbg_analysis_destroy(&analysis);
        }
        print_message("tolerance %.0e: aliased Bragg peaks reach %.2f of the bound\n",
                      tolerances[t], largest);
        assert_true(largest > 0.3);
    }
    gbg_context_destroy(&context);
#endif
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(plane_modes_are_within_their_bounds),
        cmocka_unit_test(space_modes_are_within_their_bounds),
        cmocka_unit_test(portable_loops_are_within_their_bounds),
        cmocka_unit_test(fine_meshes_are_within_their_bounds),
        cmocka_unit_test(partials_are_within_their_bounds),
        cmocka_unit_test(bound_is_reached_by_aliased_bragg_peaks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
