/* Numbers of long-range sums: near part of a split as polynomials, and what both parts share. */
#include "ewald/split.h"

#include <float.h>
#include <math.h>

#include "ewald/series.h"
#include "gamboge/status.h"

/* Chebyshev's series that polynomials are taken from. */
enum { TERMS = 80 };

/* The profile psi(u) or, for slope, its derivative. */
static long double profile(const struct gbg_split *split, int slope, long double u)
{
    long double value = expl(-u * u), derivative = -2 * u * value;
    if (split->kind == GBG_SPLIT_PROLATE) {
        gbg_prolate_evaluate(&split->profile, u, &value, &derivative);
    }
    return slope ? derivative : value;
}

/* Where the near part's integrals end, in units of the split. */
static double profile_end(const struct gbg_split *split, double from)
{
    return split->kind == GBG_SPLIT_PROLATE ? 1 : from + 9;
}

/* Chebyshev's series in z of f with order f + 2 (1+z) f' = right side: what Int_0^1 v^(order-1)
 * g(v x) dv obeys if g(x) is the right side, x^2 = (1+z) half the largest x^2. From the highest
 * term down, each from those above it: it is stable for any order > 0. */
static void solve(double order, const long double *right, long double *series)
{
    long double above = 0;
    for (int n = TERMS - 1; n >= 0; n--) {
        long double left = order + 2.0L * n;
        series[n] = left > 0 ? (right[n] - (n > 0 ? 4 : 2) * above) / left : 0;
        above += n * series[n];
    }
}

/* Sum for the force, without the scale: -psi'(x)/x integrated over scales. */
static void force_series(const struct gbg_split *split, long double *series)
{
    long double right[TERMS], ratio = split->reach / split->unit;
    for (int m = 0; m < TERMS; m++) {
        long double x = ratio * sqrtl((1 + gbg_chebyshev_node(TERMS, m)) / 2);
        right[m] = -profile(split, 1, x) / x;
    }
    gbg_chebyshev_fit(TERMS, right);
    solve(split->power + 1, right, series);
}

/* The same for the potential: psi over scales; with power 1, which needs no scale, (1 - psi(u))/u
 * from r/unit to 1, with -log(r/reach) for the power law. */
static void potential_series(const struct gbg_split *split, long double *series)
{
    long double right[TERMS], ratio = split->reach / split->unit;
    int logarithm = split->power == 1;
    for (int m = 0; m < TERMS; m++) {
        long double x = ratio * sqrtl((1 + gbg_chebyshev_node(TERMS, m)) / 2);
        right[m] = profile(split, 0, x) - logarithm;
    }
    gbg_chebyshev_fit(TERMS, right);
    solve(split->power - 1, right, series);
    if (logarithm) {
        const long double euler = 0.577215664901532860606512090082402431L;
        int gaussian = split->kind == GBG_SPLIT_GAUSSIAN;
        series[0] = gaussian ? euler / 2 + logl(ratio) - gbg_chebyshev_sum(TERMS, series, -1)
                             : -gbg_chebyshev_sum(TERMS, series, 1);
    }
}

/* s Int u^(s-1) psi du: what the superposition is normalised by; psi(0) for s = 0. */
static double normalisation(const struct gbg_split *split)
{
    double s = split->power - 1;
    if (split->kind == GBG_SPLIT_GAUSSIAN) {
        return tgamma(s / 2 + 1);
    }
    long double series[TERMS];
    force_series(split, series);
    return (double)(profile(split, 0, 1) + gbg_chebyshev_sum(TERMS, series, 1));
}

static void scaled_series(const struct gbg_split *split, int force, long double *series)
{
    long double ratio = split->reach / split->unit, s = split->power - 1;
    (force ? force_series : potential_series)(split, series);
    for (int n = 0; n < TERMS; n++) {
        series[n] *= split->scale * powl(ratio, force ? s + 2 : s);
    }
}

static long double largest_sum(const long double *series)
{
    long double largest = 0;
    for (int m = 0; m <= 256; m++) {
        largest = fmaxl(largest, fabsl(gbg_chebyshev_sum(TERMS, series, m / 128.0L - 1)));
    }
    return largest;
}

/* The lowest degree whose omitted terms stay below the error. */
static int lowest_degree(const long double *series, long double error)
{
    long double left = 0;
    int degree = TERMS - 1;
    while (degree > 1 && left + fabsl(series[degree]) <= error) {
        left += fabsl(series[degree--]);
    }
    return degree < GBG_SPLIT_DEGREE ? degree : GBG_SPLIT_DEGREE;
}

static void store_powers(const long double *series, int degree, double *power)
{
    long double sum[TERMS];
    for (int k = 0; k <= degree; k++) {
        sum[k] = series[k];
    }
    gbg_chebyshev_to_powers(degree + 1, sum);
    for (int k = 0; k <= GBG_SPLIT_DEGREE; k++) {
        power[k] = k <= degree ? (double)sum[k] : 0;
    }
}

/* Largest error of the sum in powers, over the largest value. */
static double measured_error(const long double *series, int degree, const double *power)
{
    long double worst = 0;
    for (int m = 0; m <= 512; m++) {
        double z = m / 256.0 - 1, sum = power[degree];
        for (int k = degree - 1; k >= 0; k--) {
            sum = sum * z + power[k];
        }
        worst = fmaxl(worst, fabsl(sum - gbg_chebyshev_sum(TERMS, series, z)));
    }
    return (double)(worst / largest_sum(series));
}

void gbg_split_shorten(struct gbg_split *split, double error)
{
    long double force[TERMS], potential[TERMS];
    scaled_series(split, 1, force);
    scaled_series(split, 0, potential);
    int degree = lowest_degree(force, error * largest_sum(force));
    int other = lowest_degree(potential, error * largest_sum(potential));
    split->degree = degree > other ? degree : other;
    store_powers(force, split->degree, split->near);
    store_powers(potential, split->degree, split->potential);
    split->polynomial_error = measured_error(force, split->degree, split->near);
    split->self = (double)gbg_chebyshev_sum(TERMS, potential, -1);
    split->self = split->power == 1 ? split->self - log(split->reach)
                                    : split->self * pow(split->reach, 1 - split->power);
}

int gbg_split_degree(const struct gbg_split *split, double error)
{
    double largest = 0, left = 0;
    for (int k = 0; k <= split->degree; k++) {
        largest += k % 2 == 0 ? split->near[k] : -split->near[k];
    }
    int degree = split->degree;
    while (degree > 1 && left + fabs(split->near[degree]) <= error * fabs(largest)) {
        left += fabs(split->near[degree--]);
    }
    return degree;
}

int gbg_split_make(int dimension, double power, int kind, double reach, double band,
                   struct gbg_split *split)
{
    if ((dimension != 2 && dimension != 3) || !(power >= 1 && power <= 6) ||
        (kind != GBG_SPLIT_PROLATE && kind != GBG_SPLIT_GAUSSIAN) || !(reach > 0) ||
        !(reach < DBL_MAX) || !(band >= 2 && band <= 80)) {
        return GBG_E_ARGUMENT;
    }
    *split = (struct gbg_split){.dimension = dimension,
                                .kind = kind,
                                .power = power,
                                .reach = reach,
                                .band = band,
                                .unit = reach};
    if (kind == GBG_SPLIT_PROLATE) {
        gbg_prolate_make(band, &split->profile);
    } else {
        split->unit = reach / sqrt(band / 2);
    }
    split->scale = 1 / normalisation(split);
    gbg_split_shorten(split, 2e-16);
    gbg_split_fill_far(split);
    return GBG_OK;
}

/* Int from x to the end of u^exponent psi(u) or psi'(u) du, in panels of which each starts at the
 * width of the one before, so that no power of u varies much in one. */
static double integral(const struct gbg_split *split, double x, double exponent, int slope)
{
    double node[24], weight[24], end = profile_end(split, x);
    long double sum = 0;
    gbg_legendre_rule(24, node, weight);
    for (double low = x; low < end;) {
        double high = fmin(fmin(2 * low, low + 0.25), end), half = (high - low) / 2;
        for (int m = 0; m < 24; m++) {
            long double u = low + (long double)half * (1 + node[m]);
            sum += half * weight[m] * powl(u, exponent) * profile(split, slope, u);
        }
        low = high;
    }
    return (double)sum;
}

/* Near force over r_vec, without the cut at the reach. */
static double near_force(const struct gbg_split *split, double r)
{
    double x = r / split->unit, s = split->power - 1;
    double step = split->kind == GBG_SPLIT_PROLATE ? (double)profile(split, 0, 1) : 0;
    return pow(r, -(s + 2)) * (step - integral(split, x, s, 1)) * split->scale;
}

double gbg_split_near(const struct gbg_split *split, double r)
{
    return r < split->reach ? near_force(split, r) : 0;
}

double gbg_split_near_potential(const struct gbg_split *split, double r)
{
    double x = r / split->unit, s = split->power - 1;
    return r < split->reach ? split->scale * pow(r, -s) * integral(split, x, s - 1, 0) : 0;
}

/* Square of the Gaussian near force that the cut leaves out, over all space. */
static double cut_off(const struct gbg_split *split)
{
    double node[24], weight[24], sum = 0, most = split->reach + 4 * split->unit;
    double half = (most - split->reach) / 2;
    gbg_legendre_rule(24, node, weight);
    for (int m = 0; m < 24; m++) {
        double r = split->reach + half * (1 + node[m]), force = r * near_force(split, r);
        double area = 2 * (double)GBG_PI_LONG * (split->dimension == 2 ? r : 2 * r * r);
        sum += half * weight[m] * area * force * force;
    }
    return sum;
}

double gbg_split_loss(const struct gbg_split *split)
{
    double far = split->loss * pow(split->unit, split->dimension - 2 * split->power);
    return sqrt(far + (split->kind == GBG_SPLIT_GAUSSIAN ? cut_off(split) : 0));
}

/* In spacings of the lattice, RMS forces as measured there for whole powers, by their trend. */
double gbg_split_error(const struct gbg_split *split)
{
    double neighbours = 41, ball = split->dimension == 2 ? 1 : 4 / 3.0;
    double reach = pow(neighbours / (ball * (double)GBG_PI_LONG), 1.0 / split->dimension);
    double spacing = split->reach / reach;
    double force = 0.93 * pow(1.68, split->power - 1) * pow(spacing, -split->power);
    return gbg_split_loss(split) * pow(spacing, -split->dimension / 2.0) / force;
}
