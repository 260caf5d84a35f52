/* Numbers of long-range sums: the waves of the far part, and the error of leaving the others. */
#define _XOPEN_SOURCE 700 /* j0 */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "ewald/series.h"
#include "ewald/split.h"

/* Even Chebyshev polynomials of the profile's transform over the band; nodes in the profile. */
enum { SPECTRUM = 64, NODES = 96, STEPS = 5 };

/* The d-dimensional transform of the profile, tabulated where that costs. */
struct spectrum {
    int dimension, kind;
    double end; /* of the band, in 1/unit */
    double place[NODES], weight[NODES];
    int terms;
    long double series[SPECTRUM]; /* of a Gaussian only its peak */
};

/* By quadrature over the profile. */
static double direct(const struct spectrum *spectrum, double q)
{
    double sum = 0;
    for (int m = 0; m < NODES; m++) {
        double x = q * spectrum->place[m];
        double wave = spectrum->dimension == 2 ? j0(x) : sin(x) / x;
        sum += spectrum->weight[m] * (x > 0 ? wave : 1);
    }
    return sum;
}

static void make_spectrum(const struct gbg_split *split, struct spectrum *spectrum)
{
    const double pi = (double)GBG_PI_LONG;
    spectrum->dimension = split->dimension;
    spectrum->kind = split->kind;
    spectrum->end = split->band * split->unit / split->reach;
    if (split->kind == GBG_SPLIT_GAUSSIAN) {
        spectrum->series[0] = powl(GBG_PI_LONG, 0.5L * split->dimension);
        return;
    }
    gbg_legendre_rule(NODES, spectrum->place, spectrum->weight);
    for (int m = 0; m < NODES; m++) {
        double u = (1 + spectrum->place[m]) / 2, area = split->dimension == 2 ? 2 * u : 4 * u * u;
        spectrum->place[m] = u;
        spectrum->weight[m] *= pi * area / 2 * gbg_prolate_value(&split->profile, u);
    }
    for (int m = 0; m < SPECTRUM; m++) {
        long double z = gbg_chebyshev_node(SPECTRUM, m);
        spectrum->series[m] = direct(spectrum, spectrum->end * (double)sqrtl((1 + z) / 2));
    }
    gbg_chebyshev_fit(SPECTRUM, spectrum->series);
    spectrum->terms = SPECTRUM;
    while (spectrum->terms > 8 && fabsl(spectrum->series[spectrum->terms - 1]) < 1e-18L) {
        spectrum->terms--;
    }
}

static long double transform(const struct spectrum *spectrum, long double q)
{
    if (spectrum->kind == GBG_SPLIT_GAUSSIAN) {
        return spectrum->series[0] * expl(-q * q / 4);
    }
    long double x = q / spectrum->end;
    if (x > 1) {
        return direct(spectrum, (double)q);
    }
    return gbg_chebyshev_sum(spectrum->terms, spectrum->series, 2 * x * x - 1);
}

/* Int of q^(d-1-s) psi^ over a short range. */
static long double piece(const struct gbg_split *split, const struct spectrum *spectrum,
                         const double rule[2][STEPS], long double low, long double high)
{
    long double half = (high - low) / 2, sum = 0;
    for (int m = 0; m < STEPS; m++) {
        long double q = low + half * (1 + rule[0][m]);
        sum += rule[1][m] * powl(q, split->dimension - (long double)split->power) *
               transform(spectrum, q);
    }
    return half * sum;
}

/* Square of the force of a prolate profile's waves from q on, where only the step at its end is
 * left to make any. */
static double step_loss(const struct gbg_split *split, double q)
{
    double step = split->scale * gbg_prolate_value(&split->profile, 1);
    return (split->dimension == 2 ? 2 : 4) * step * step / q;
}

/* The integral beyond the band, from where nothing is left of it down: waves within the band are
 * then those of the exact power law. *loss: square of the force of the waves that are left out,
 * over all directions, in the units of the split.
 *
 * The prolate profile ends with a step, small as it is, so that its transform goes on for long as a
 * wave whose height falls slowly: it is faded out over the second half. */
static long double beyond(const struct gbg_split *split, const struct spectrum *spectrum,
                          const double rule[2][STEPS], double *loss)
{
    enum { PARTS = 64 };
    int prolate = split->kind == GBG_SPLIT_PROLATE, d = split->dimension;
    long double width = (prolate ? 40.0L : 14) / PARTS, sum = 0;
    double area = (d == 2 ? 1 : 1 / (double)GBG_PI_LONG) / (2 * (double)GBG_PI_LONG);
    *loss = prolate ? step_loss(split, spectrum->end + 20) : 0;
    for (int m = PARTS - 1; m >= 0; m--) {
        long double low = spectrum->end + m * width, fade = sinl(GBG_PI_LONG * m / PARTS);
        long double share = prolate && m > PARTS / 2 ? fade * fade : 1, middle = low + width / 2;
        long double upper = share * piece(split, spectrum, rule, middle, low + width);
        double far = split->scale * (double)(sum + upper) * pow(middle, split->power - 1 - d);
        if (m < PARTS / 2) {
            *loss += (double)width * area * pow((double)middle, d + 1) * far * far;
        }
        sum += upper + share * piece(split, spectrum, rule, low, middle);
    }
    return sum;
}

/* One panel, from its upper end down; *sum is the integral from there on, and goes to the lower
 * end. */
static void fill_panel(struct gbg_split *split, const struct spectrum *spectrum,
                       const double rule[2][STEPS], int octave, int panel, long double *sum)
{
    long double width = ldexpl(spectrum->end, -octave - 1) / GBG_FAR_PANELS;
    long double low = width * (GBG_FAR_PANELS + panel), from = low + width;
    long double s = (long double)split->power - 1, value[GBG_FAR_TERMS];
    for (int m = 0; m < GBG_FAR_TERMS; m++) {
        long double q = low + width * (1 + gbg_chebyshev_node(GBG_FAR_TERMS, m)) / 2;
        *sum += piece(split, spectrum, rule, q, from);
        value[m] = split->scale * powl(q / split->unit, s - split->dimension) * *sum;
        from = q;
    }
    *sum += piece(split, spectrum, rule, low, from);
    gbg_chebyshev_fit(GBG_FAR_TERMS, value);
    gbg_chebyshev_to_powers(GBG_FAR_TERMS, value);
    for (int m = 0; m < GBG_FAR_TERMS; m++) {
        split->far[octave][panel][m] = (double)value[m];
    }
}

void gbg_split_fill_far(struct gbg_split *split)
{
    struct spectrum spectrum;
    double rule[2][STEPS];
    make_spectrum(split, &spectrum);
    gbg_legendre_rule(STEPS, rule[0], rule[1]);
    long double sum = beyond(split, &spectrum, rule, &split->loss);
    for (int octave = 0; octave < GBG_FAR_OCTAVES; octave++) {
        for (int panel = GBG_FAR_PANELS - 1; panel >= 0; panel--) {
            fill_panel(split, &spectrum, rule, octave, panel, &sum);
        }
    }
    split->far_rest = (double)(split->scale * sum);
    split->far_slope = (double)(split->scale * transform(&spectrum, 0));
}

/* Below the table the profile's transform is that of q = 0. */
static double far_below(const struct gbg_split *split, double k)
{
    double power = split->dimension + 1 - split->power, q = k * split->unit;
    double first = ldexp(split->band * split->unit / split->reach, -GBG_FAR_OCTAVES);
    double rest = power == 0 ? log(first / q) : (pow(first, power) - pow(q, power)) / power;
    return pow(k, -power) * (split->far_rest + split->far_slope * rest);
}

double gbg_split_far(const struct gbg_split *split, double k)
{
    double x = k * split->reach / split->band;
    if (!(x > 0 && x < 1)) {
        return 0;
    }
    _Static_assert(GBG_FAR_PANELS == 8, "three bits say which panel");
    /* the exponent's bits are the octave, the first of the fraction's the panel */
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    int octave = 1022 - (int)(bits >> 52), panel = (int)(bits >> 49 & 7);
    if (octave >= GBG_FAR_OCTAVES) {
        return far_below(split, k);
    }
    bits = (bits & ((UINT64_C(1) << 49) - 1)) | UINT64_C(1023) << 52;
    memcpy(&x, &bits, sizeof x);
    const double *far = split->far[octave][panel];
    double z = 2 * GBG_FAR_PANELS * (x - 1) - 1, sum = 0;
    for (int m = GBG_FAR_TERMS - 1; m >= 0; m--) {
        sum = sum * z + far[m];
    }
    return sum;
}
