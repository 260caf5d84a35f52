/* Tests of the error that a split makes: sums over pairs and over waves without a mesh, against a
 * Gaussian split by closed forms that is carried on until nothing is left. Prints the table of
 * errors against the band, and holds the estimates of ewald/split.h against it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "ewald/split.h"
#include "gamboge/status.h"

#define PI 3.14159265358979323846

enum { MOST = 1000, TARGETS = 24, WAVES = 64 };

struct particles {
    int dimension, n;
    double length, power, position[MOST][3];
};

/* A number in (0, 1) by a generator of its own. */
static double draw(uint64_t *seed)
{
    *seed = *seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)((*seed >> 12) + 1) / 4503599627370498.0;
}

/* A square or cubic lattice of spacing 1 with jitter in units of it; 0 of it left: random. */
static void place(int dimension, int side, double jitter, double power, struct particles *set)
{
    uint64_t seed = 5;
    *set = (struct particles){.dimension = dimension, .length = side, .power = power};
    for (int i = 0; i < (dimension == 2 ? side * side : side * side * side); i++) {
        int cell[3] = {i % side, i / side % side, i / side / side};
        for (int a = 0; a < dimension; a++) {
            double random = draw(&seed);
            set->position[i][a] =
                jitter > 0 ? cell[a] + 0.5 + jitter * (2 * random - 1) : side * random;
        }
        set->n++;
    }
    for (int i = 0; i < TARGETS; i++) { /* targets, the first ones, from all over the box */
        int j = i + (int)(draw(&seed) * (set->n - i));
        double held[3];
        memcpy(held, set->position[i], sizeof held);
        memcpy(set->position[i], set->position[j], sizeof held);
        memcpy(set->position[j], held, sizeof held);
    }
}

typedef double factor(double x, int dimension, double power, const void *data);

static void add_pairs(const struct particles *set, double reach, factor *near, const void *data,
                      double (*force)[3])
{
    int images = (int)ceil(reach / set->length), d = set->dimension, side = 2 * images + 1;
    for (int64_t m = 0; m < (int64_t)TARGETS * set->n; m++) {
        int i = (int)(m / set->n), j = (int)(m % set->n);
        for (int image = 0; image < (d == 2 ? side * side : side * side * side); image++) {
            int shift[3] = {image % side, image / side % side, image / side / side};
            double r[3] = {0}, square = 0;
            for (int a = 0; a < d; a++) {
                r[a] =
                    set->position[i][a] - set->position[j][a] + (shift[a] - images) * set->length;
                square += r[a] * r[a];
            }
            if (square > 0 && square < reach * reach) {
                double value = near(sqrt(square), d, set->power, data);
                for (int a = 0; a < d; a++) {
                    force[i][a] += value * r[a];
                }
            }
        }
    }
}

/* cos and sin of n k x for all particles along one axis. */
static void fill_phases(const struct particles *set, int axis, int n, double (*phase)[2])
{
    for (int i = 0; i < set->n; i++) {
        double angle = 2 * PI * n * set->position[i][axis] / set->length;
        phase[i][0] = cos(angle);
        phase[i][1] = sin(angle);
    }
}

static void add_wave(const struct particles *set, const int *n, double strength, double (*force)[3])
{
    static double phase[3][2 * WAVES + 1][MOST][2], both[MOST][2];
    static const struct particles *known;
    static double known_place;
    int d = set->dimension;
    if (known != set || known_place != set->position[0][0]) {
        for (int m = 0; m < d * (2 * WAVES + 1); m++) {
            int axis = m / (2 * WAVES + 1), wave = m % (2 * WAVES + 1);
            fill_phases(set, axis, wave - WAVES, phase[axis][wave]);
        }
        known = set;
        known_place = set->position[0][0];
    }
    double sum[2] = {0};
    for (int i = 0; i < set->n; i++) {
        double re = 1, im = 0;
        for (int a = 0; a < d; a++) {
            const double *turn = phase[a][n[a] + WAVES][i];
            double next = re * turn[0] - im * turn[1];
            im = re * turn[1] + im * turn[0];
            re = next;
        }
        both[i][0] = re;
        both[i][1] = im;
        sum[0] += re;
        sum[1] += im;
    }
    for (int i = 0; i < TARGETS; i++) {
        double value = strength * (both[i][1] * sum[0] - both[i][0] * sum[1]);
        for (int a = 0; a < d; a++) {
            force[i][a] += value * 2 * PI * n[a] / set->length;
        }
    }
}

static void add_waves(const struct particles *set, double end, factor *far, const void *data,
                      double (*force)[3])
{
    double unit = 2 * PI / set->length, volume = pow(set->length, set->dimension);
    int most = (int)(end / unit), third = set->dimension == 3 ? most : 0;
    assert_true(most <= WAVES);
    for (int x = -most; x <= most; x++) {
        for (int y = -most; y <= most; y++) {
            for (int z = -third; z <= third; z++) {
                double k = unit * sqrt(x * x + y * y + z * z);
                if (k > 0 && k < end) {
                    const int n[3] = {x, y, z};
                    add_wave(set, n, far(k, set->dimension, set->power, data) / volume, force);
                }
            }
        }
    }
}

/* ---- the reference: closed forms ---- */

/* Gamma(a, y) for a = 1/2 or 1 and whole steps up from there, over Gamma(a). */
static double gaussian_near(double r, int dimension, double power, const void *data)
{
    (void)dimension;
    double y = *(const double *)data * r, a = fmod(power, 2) == 0 ? 0.5 : 1;
    y *= y;
    double value = a == 1 ? exp(-y) : erfc(sqrt(y));
    for (; a < (power + 1) / 2 - 0.1; a += 1) {
        value += pow(y, a) * exp(-y) / tgamma(a + 1);
    }
    return value * pow(r, -power - 1);
}

/* Gamma(a, y), a = (dimension - power + 1)/2 of either sign, by Simpson's rule in log t. */
static double gaussian_far(double k, int dimension, double power, const void *data)
{
    enum { STEPS = 2000 };
    double y = k * k / (4 * *(const double *)data * *(const double *)data), sum = 0;
    double a = (dimension - power + 1) / 2, width = log((y + 40) / y) / STEPS;
    for (int n = 0; n <= STEPS; n++) {
        double t = y * exp(n * width);
        sum += (n == 0 || n == STEPS ? 1 : n % 2 == 1 ? 4 : 2) * pow(t, a) * exp(-t);
    }
    return pow(PI, dimension / 2.0) / tgamma((power + 1) / 2) / 2 *
           pow(k / 2, power - 1 - dimension) * sum * width / 3;
}

static void reference(const struct particles *set, double alpha, double (*force)[3])
{
    memset(force, 0, sizeof(double[TARGETS][3]));
    add_pairs(set, 6.2 / alpha, gaussian_near, &alpha, force);
    add_waves(set, 12.4 * alpha, gaussian_far, &alpha, force);
}

/* ---- the split ---- */

static double split_near(double r, int dimension, double power, const void *data)
{
    const struct gbg_split *split = data;
    double z = 2 * (r / split->reach) * (r / split->reach) - 1, sum = 0;
    (void)dimension;
    for (int k = split->degree; k >= 0; k--) {
        sum = sum * z + split->near[k];
    }
    return pow(r, -power - 1) - pow(split->reach, -power - 1) * sum;
}

static double split_far(double k, int dimension, double power, const void *data)
{
    (void)dimension;
    (void)power;
    return gbg_split_far(data, k);
}

/* RMS of the difference, or of the force itself. */
static double rms(int dimension, double (*force)[3], double (*other)[3])
{
    double sum = 0;
    for (int m = 0; m < TARGETS * dimension; m++) {
        int i = m / dimension, a = m % dimension;
        double value = force[i][a] - (other != NULL ? other[i][a] : 0);
        sum += value * value;
    }
    return sqrt(sum / TARGETS);
}

static const double bands[] = {5, 7, 8, 10, 12, 14, 16, 20, 24};

/* One line of the table; the estimates are within a factor of the error, a lattice's from above. */
static void check_line(const struct particles *set, int kind, double reach, int random,
                       double (*exact)[3])
{
    static struct gbg_split split;
    double size = rms(set->dimension, exact, NULL);
    printf("%s %dD power %.0f %s", kind == GBG_SPLIT_PROLATE ? "prolate " : "Gaussian",
           set->dimension, set->power, random ? "random " : "lattice");
    for (int b = 0; b < (int)(sizeof bands / sizeof *bands); b++) {
        double force[TARGETS][3] = {{0}};
        assert_int_equal(gbg_split_make(set->dimension, set->power, kind, reach, bands[b], &split),
                         GBG_OK);
        add_pairs(set, reach, split_near, &split, force);
        add_waves(set, bands[b] / reach, split_far, &split, force);
        double error = rms(set->dimension, force, exact) / size;
        double guess = random ? gbg_split_loss(&split) / size : gbg_split_error(&split);
        printf(" %.1e (%.2f)", error, guess / error);
        double least = error < 1e-13 ? 0 : random ? 0.6 : 0.6, most = random ? 1.6 : 2.6;
        assert_true(guess / error > least && guess / error < most);
    }
    printf("\n");
}

static void check_power(int dimension, double power, int random)
{
    static struct particles set;
    double exact[TARGETS][3], again[TARGETS][3];
    double reach = dimension == 2 ? 3.6 : 2.14;
    place(dimension, dimension == 2 ? 20 : 10, random ? 0 : 0.25, power, &set);
    reference(&set, 0.95, exact);
    reference(&set, 0.8, again);
    double own = rms(dimension, again, exact) / rms(dimension, exact, NULL);
    assert_true(own < 1e-13);
    check_line(&set, GBG_SPLIT_PROLATE, reach, random, exact);
    check_line(&set, GBG_SPLIT_GAUSSIAN, reach, random, exact);
}

static void errors_are_as_estimated(void **state)
{
    (void)state;
    printf("RMS error over RMS force, 41 neighbours in the reach (estimate over it); band");
    for (int b = 0; b < (int)(sizeof bands / sizeof *bands); b++) {
        printf(" %.0f", bands[b]);
    }
    printf("\n");
    for (int power = 1; power <= 6; power++) {
        check_power(2, power, 0);
    }
    check_power(3, 2, 0);
    check_power(2, 1, 1);
    check_power(2, 2, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(errors_are_as_estimated)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
