/* Tests of c/analysis on systems whose structure factor is known exactly, and of the errors that it
 * states for them. */
#include "analysis_help.h"

static struct points points, rounded;

struct coverage {
    double shells, within_1, within_2, sum, squares;
};

static void count(struct coverage *coverage, double z)
{
    coverage->shells++;
    coverage->within_1 += fabs(z) <= 1;
    coverage->within_2 += fabs(z) <= 2;
    coverage->sum += z;
    coverage->squares += z * z;
}

/* Shares within one and two errors against those of a normal distribution; `slack` in per cent. */
static void judge(const char *what, const struct coverage *coverage, double slack_1, double slack_2)
{
    double n = coverage->shells, mean = coverage->sum / n;
    double one = 100 * coverage->within_1 / n, two = 100 * coverage->within_2 / n;
    print_message("%s: %.0f shells, z within 1: %.1f %%, within 2: %.1f %%, mean %.3f, variance "
                  "%.2f\n",
                  what, n, one, two, mean, coverage->squares / n - mean * mean);
    assert_true(fabs(one - 68.3) < slack_1);
    assert_true(fabs(two - 95.4) < slack_2);
    assert_true(fabs(mean) < 5 / sqrt(n));
}

static struct gbg_analysis *fresh(struct gbg_context *context, int dimension, const double *lengths,
                                  double k_max)
{
    struct gbg_analysis *a;
    MUST(context, gbg_analysis_create(context, dimension, lengths, 1, &a));
    MUST(context, gbg_analysis_set_real(a, "k_max", k_max));
    return a;
}

/* Independent points: E S = 1 and Var S = 1 - 1/N in each mode. */
static void independent_points(void **state)
{
    (void)state;
    static const double box[3] = {30, 30, 30};
    struct gbg_context *c = context_of("cpu");
    for (int dimension = 2; dimension <= 3; dimension++) {
        struct coverage exact = {0}, blocked = {0};
        for (uint64_t run = 0; run < 20; run++) {
            struct gbg_analysis *a = fresh(c, dimension, box, dimension == 2 ? 8 : 3);
            for (uint64_t f = 0; f < 64; f++) {
                fill_uniform(&points, 500, 1000 * run + f, box);
                MUST(c, add_points(a, &points, NULL, NULL));
                for (int64_t s = 5; s < a->shells.count; s++) {
                    double S = a->frame[GBG_COLUMN_S * a->shells.count + s];
                    double modes = a->frame[GBG_COLUMN_MODES * a->shells.count + s];
                    count(&exact, (S - 1) / sqrt((1 - 1 / 500.0) / modes));
                }
            }
            for (int64_t s = 0; s < a->shells.count; s++) {
                double independent, error = gbg_analysis_error(a, 0, s, &independent);
                count(&blocked, (gbg_analysis_mean(a, GBG_COLUMN_S, s) - 1) / error);
            }
            gbg_analysis_destroy(&a);
        }
        judge(dimension == 2 ? "2D Poisson, exact variance" : "3D Poisson, exact variance", &exact,
              2, 1.5);
        judge(dimension == 2 ? "2D Poisson, 64 frames blocked" : "3D Poisson, 64 frames blocked",
              &blocked, 10, 4);
    }
    gbg_context_destroy(&c);
}

/* A centred lattice of `per` cells an axis (triangular if the box is a : sqrt(3) a). */
static void fill_lattice(int dimension, const int *per, const double *lengths)
{
    int depth = dimension == 3 ? per[2] : 1;
    points.n = 0;
    for (int i = 0; i < per[0] * per[1] * depth; i++) {
        for (int basis = 0; basis < 2; basis++) {
            int cell[3] = {i % per[0], i / per[0] % per[1], i / (per[0] * per[1])};
            for (int a = 0; a < dimension; a++) {
                points.x[a][points.n] = (cell[a] + 0.5 * basis) * lengths[a] / per[a];
            }
            points.n++;
        }
    }
}

/* Centred lattices: S = N where every n_a is a multiple of its number of cells with an even sum of
 * the multiples, exactly 0 elsewhere. */
static void perfect_lattices(void **state)
{
    (void)state;
    static const double box[3] = {32, 28, 24};
    static const int per[3] = {16, 16, 8};
    struct gbg_context *c = context_of("cpu");
    const char *const methods[] = {"direct", "mesh"};
    for (int i = 0; i < 2 + 2 * gbg_has_component("fftw"); i++) {
        int dimension = 2 + i % 2;
        struct gbg_analysis *a = fresh(c, dimension, box, dimension == 2 ? 15 : 7);
        double worst = 0, peak = 0;
        int64_t peaks = 0;
        fill_lattice(dimension, per, box);
        MUST(c, gbg_analysis_set_text(a, "method", methods[i / 2]));
        MUST(c, add_points(a, &points, NULL, NULL));
        for (int64_t m = 0; m < a->modes.count; m++) {
            const double *rho = a->density->rho + 2 * m;
            double S = (rho[0] * rho[0] + rho[1] * rho[1]) / (double)points.n, sum = 0;
            double e = sqrt((double)points.n) *
                       (a->density->alias[m] + a->density->gain[m] * a->density->rounding);
            int bragg = 1;
            for (int axis = 0; axis < dimension; axis++) {
                bragg = bragg && a->modes.n[axis][m] % per[axis] == 0;
                sum += a->modes.n[axis][m] / per[axis];
            }
            bragg = bragg && fmod(sum, 2) == 0;
            if (bragg) {
                double off = fabs(S - (double)points.n);
                assert_true(off <= 2 * sqrt((double)points.n) * e + e * e + 1e-15 * S);
                peak = fmax(peak, off / (double)points.n);
                peaks++;
            } else {
                assert_true(S <= e * e);
                worst = fmax(worst, S);
            }
        }
        print_message("%dD lattice, %s: %lld Bragg peaks off by %.1e of N, elsewhere S <= %.1e\n",
                      dimension, methods[i / 2], (long long)peaks, peak, worst);
        assert_true(peaks >= 10);
        gbg_analysis_destroy(&a);
    }
    gbg_context_destroy(&c);
}

/* Mean over the modes of a shell of 1 - exp(-k^2 u^2) + exp(-k^2 u^2) S_0 for the centred lattice.
 */
static double displaced(const struct gbg_analysis *a, const int *per, double u, int64_t shell)
{
    double sum = 0;
    for (int64_t i = a->shells.start[shell]; i < a->shells.start[shell + 1]; i++) {
        int64_t m = a->shells.mode[i];
        double k = a->shells.k[m], damping = exp(-k * k * u * u);
        int x = a->modes.n[0][m], y = a->modes.n[1][m];
        int bragg = x % per[0] == 0 && y % per[1] == 0 && (x / per[0] + y / per[1]) % 2 == 0;
        sum += 1 - damping + (bragg ? damping * (double)a->n : 0);
    }
    return sum / (double)(a->shells.start[shell + 1] - a->shells.start[shell]);
}

/* A lattice whose particles do Ornstein-Uhlenbeck motion about their sites, with relaxation time
 * `time` (frames): S is that of independent Gaussian displacements at any instant. */
static void trapped_particles(const char *what, double time, int frames, int runs, double slack_1,
                              double slack_2)
{
    static const double box[3] = {12, 16, 1};
    static const int per[3] = {6, 8, 1};
    static double site[2][HELP_MOST], offset[2][HELP_MOST];
    const double u = 0.35, r = time > 0 ? exp(-1 / time) : 0;
    struct gbg_context *c = context_of("cpu:threads=1");
    struct coverage coverage = {0};
    fill_lattice(2, per, box);
    memcpy(site[0], points.x[0], sizeof site[0]);
    memcpy(site[1], points.x[1], sizeof site[1]);
    for (int run = 0; run < runs; run++) {
        struct gbg_analysis *a = fresh(c, 2, box, 8);
        for (int f = 0; f < frames; f++) {
            for (int64_t i = 0; i < 2 * points.n; i++) {
                uint64_t at = (uint64_t)(f * 2 * points.n + i);
                double g = normal(500 + (uint64_t)run, at), *x = &offset[i % 2][i / 2];
                *x = f == 0 ? u * g : r * *x + u * sqrt(1 - r * r) * g;
                points.x[i % 2][i / 2] = site[i % 2][i / 2] + *x;
            }
            MUST(c, add_points(a, &points, NULL, NULL));
        }
        for (int64_t s = 0; s < a->shells.count; s++) {
            double independent, error = gbg_analysis_error(a, 0, s, &independent);
            double S = gbg_analysis_mean(a, GBG_COLUMN_S, s);
            count(&coverage, (S - displaced(a, per, u, s)) / error);
        }
        gbg_analysis_destroy(&a);
    }
    judge(what, &coverage, slack_1, slack_2);
    gbg_context_destroy(&c);
}

static void displaced_lattices(void **state)
{
    (void)state;
    trapped_particles("displaced lattice, 1024 independent frames", 0, 1024, 25, 5, 3);
    trapped_particles("displaced lattice, 2048 frames correlated over 10", 10, 2048, 25, 5, 4);
    trapped_particles("displaced lattice, 10 independent frames, unblocked", 0, 10, 150, 12, 6);
}

/* Root mean square of (difference of two results)/(stated typical error). */
static double typical_ratio(struct gbg_analysis *a, struct gbg_analysis *b, int column)
{
    double sum = 0;
    for (int64_t s = 0; s < a->shells.count; s++) {
        double d = gbg_analysis_mean(a, GBG_COLUMN_S, s) - gbg_analysis_mean(b, GBG_COLUMN_S, s);
        double ratio = d / gbg_analysis_mean(a, column, s);
        sum += ratio * ratio / (double)a->shells.count;
    }
    return sqrt(sum);
}

/* The typical numerical error against the direct sum, on points of a fluid. */
static void typical_errors_are_typical(void **state)
{
    (void)state;
    static const double box[3] = {30, 25, 28};
    if (!gbg_has_component("fftw")) {
        return;
    }
    struct gbg_context *c = context_of("cpu");
    for (int i = 0; i < 8; i++) {
        int dimension = 2 + i % 2;
        double tolerance = pow(10, -3 * (1 + i / 2));
        struct gbg_analysis *a = fresh(c, dimension, box, dimension == 2 ? 30 : 4);
        struct gbg_analysis *b = fresh(c, dimension, box, dimension == 2 ? 30 : 4);
        fill_uniform(&points, 2000, 5, box);
        MUST(c, gbg_analysis_set_text(a, "method", "mesh"));
        MUST(c, gbg_analysis_set_real(a, "tolerance", tolerance));
        MUST(c, gbg_analysis_set_text(b, "method", "direct"));
        MUST(c, add_points(a, &points, NULL, NULL));
        MUST(c, add_points(b, &points, NULL, NULL));
        double ratio = typical_ratio(a, b, GBG_COLUMN_TYPICAL);
        print_message("%dD tolerance %.0e: error/S_numerr_typ %.2f (rms over %lld shells)\n",
                      dimension, tolerance, ratio, (long long)a->shells.count);
        assert_true(ratio > 0.3 && ratio < 2);
        gbg_analysis_destroy(&a);
        gbg_analysis_destroy(&b);
    }
    gbg_context_destroy(&c);
}

/* Coordinates rounded to a grid of 1/64. */
static void storage_errors_are_typical(void **state)
{
    (void)state;
    static const double box[3] = {32, 32, 32};
    struct gbg_context *c = context_of("cpu");
    for (int dimension = 2; dimension <= 3; dimension++) {
        double k_max = dimension == 2 ? 15 : 3;
        struct gbg_analysis *a = fresh(c, dimension, box, k_max);
        struct gbg_analysis *b = fresh(c, dimension, box, k_max);
        fill_uniform(&points, 3000, 6, box);
        rounded = points;
        for (int64_t i = 0; i < 3 * points.n; i++) {
            double *x = &rounded.x[i % 3][i / 3];
            *x = rint(*x * 64) / 64;
        }
        MUST(c, add_points(b, &points, NULL, NULL));
        MUST(c, gbg_analysis_add_frame(a, rounded.n, rounded.x[0], rounded.x[1], rounded.x[2], 1,
                                       NULL, 0, NULL, 1 / 128.0));
        double ratio = typical_ratio(a, b, GBG_COLUMN_STORAGE);
        print_message("%dD coordinates rounded to 1/64: change of S/S_storage_err %.2f (rms over "
                      "%lld shells)\n",
                      dimension, ratio, (long long)a->shells.count);
        assert_true(ratio > 0.5 && ratio < 2);
        gbg_analysis_destroy(&a);
        gbg_analysis_destroy(&b);
    }
    gbg_context_destroy(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(independent_points),         cmocka_unit_test(perfect_lattices),
        cmocka_unit_test(displaced_lattices),         cmocka_unit_test(typical_errors_are_typical),
        cmocka_unit_test(storage_errors_are_typical),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
