/* Numbers of long-range sums: prolate and B-spline windows. */
#include "ewald/window.h"

#include <math.h>

#include "ewald/series.h"
#include "gamboge/status.h"

/* Chebyshev's series that polynomials are taken from, nodes of integrals over one spacing. */
enum { TERMS = 40, NODES = 24 };

/* Cardinal B-spline of this order at t from its middle, by the recursion in the order; slope: from
 * the order below. */
static long double spline(int order, int slope, long double t)
{
    long double value[GBG_EWALD_WIDEST + 1] = {0}, x = t + order / 2.0L;
    if (!(x >= 0 && x < order)) {
        return 0;
    }
    int interval = (int)x;
    value[interval] = 1; /* value[j]: of the spline that begins at j */
    for (int n = 2; n <= order - slope; n++) {
        for (int j = 0; j + n <= order; j++) {
            value[j] = ((x - j) * value[j] + (j + n - x) * value[j + 1]) / (n - 1);
        }
    }
    return slope ? value[0] - value[1] : value[0];
}

/* Window or, for slope, its derivative within -width/2 .. width/2. */
static long double evaluate(const struct gbg_ewald_window *window, int slope, long double t)
{
    if (window->kind == GBG_EWALD_BSPLINE) {
        return spline(window->width, slope, t);
    }
    long double value, derivative, scale = 2.0L / window->width;
    gbg_prolate_evaluate(&window->profile, scale * t, &value, &derivative);
    return slope ? scale * derivative : value;
}

/* Place in the window of node l of a particle at offset z. */
static long double place(const struct gbg_ewald_window *window, int l, long double z)
{
    return l + 0.5L - window->width / 2.0L - z / 2;
}

/* Chebyshev's series of the window over z at node l. Nodes stay within the spacing, so that each
 * piece of a spline is met by itself. */
static void node_series(const struct gbg_ewald_window *window, int l, long double *series)
{
    for (int m = 0; m < TERMS; m++) {
        series[m] = evaluate(window, 0, place(window, l, gbg_chebyshev_node(TERMS, m)));
    }
    gbg_chebyshev_fit(TERMS, series);
}

/* What the window leaves beyond its band, over its peak's transform: polynomials need not be much
 * better. */
static double leak(const struct gbg_ewald_window *window)
{
    return window->kind == GBG_EWALD_BSPLINE
               ? 0
               : fabs(gbg_prolate_transform(&window->profile, window->shape)) /
                     gbg_prolate_transform(&window->profile, 0);
}

/* The lowest degree that leaves terms of less than the error at every node. */
static int lowest_degree(long double (*series)[TERMS], int width, double error)
{
    int degree = 2;
    for (int l = 0; l < width; l++) {
        double left = 0;
        int k = TERMS - 1;
        while (k > degree && left + fabs((double)series[l][k]) <= error) {
            left += fabs((double)series[l][k--]);
        }
        degree = k;
    }
    return degree < GBG_EWALD_DEGREE ? degree : GBG_EWALD_DEGREE;
}

/* t = ... - z/2: the slope in t is -2 times that in z. */
static void store_powers(struct gbg_ewald_window *window, int l, const long double *series)
{
    long double power[TERMS];
    for (int k = 0; k <= window->degree; k++) {
        power[k] = series[k];
    }
    gbg_chebyshev_to_powers(window->degree + 1, power);
    for (int k = 0; k <= window->degree; k++) {
        window->value[k][l] = (double)power[k];
        if (k > 0) {
            window->slope[k - 1][l] = (double)(-2 * k * power[k]);
        }
    }
}

static double measured_error(const struct gbg_ewald_window *window)
{
    long double worst = 0;
    for (int l = 0; l < window->width; l++) {
        for (int m = 0; m < 64; m++) {
            double z = (2 * m + 1) / 64.0 - 1, sum = 0;
            for (int k = window->degree; k >= 0; k--) {
                sum = sum * z + window->value[k][l];
            }
            worst = fmaxl(worst, fabsl(sum - evaluate(window, 0, place(window, l, z))));
        }
    }
    return (double)(worst / evaluate(window, 0, 0));
}

/* Spacing by spacing, in which the window is smooth. */
static void fill_products(struct gbg_ewald_window *window)
{
    double node[NODES], weight[NODES];
    long double value[GBG_EWALD_WIDEST][2][NODES], sum;
    gbg_legendre_rule(NODES, node, weight);
    for (int l = 0; l < window->width; l++) {
        for (int m = 0; m < NODES; m++) {
            value[l][0][m] = evaluate(window, 0, place(window, l, node[m]));
            value[l][1][m] = evaluate(window, 1, place(window, l, node[m]));
        }
    }
    for (int j = 0; j < window->width; j++) {
        for (int slope = 0; slope < 2; slope++) {
            sum = 0;
            for (int l = 0; l + j < window->width; l++) {
                for (int m = 0; m < NODES; m++) {
                    sum += weight[m] * value[l][slope][m] * value[l + j][slope][m] / 2;
                }
            }
            (slope ? window->slope_product : window->product)[j] = (double)sum;
        }
    }
}

/* All but the shape and its profile. */
static void fill_window(struct gbg_ewald_window *window)
{
    int width = window->width;
    long double series[GBG_EWALD_WIDEST][TERMS];
    for (int l = 0; l < width; l++) {
        node_series(window, l, series[l]);
    }
    window->degree = window->kind == GBG_EWALD_BSPLINE
                         ? width - 1
                         : lowest_degree(series, width, fmax(2e-16, 0.05 * leak(window)));
    for (int l = 0; l < width; l++) {
        store_powers(window, l, series[l]);
    }
    window->polynomial_error = measured_error(window);
    fill_products(window);
}

int gbg_ewald_window_shaped(int width, double shape, struct gbg_ewald_window *window)
{
    if (width < GBG_EWALD_NARROWEST || width > GBG_EWALD_WIDEST ||
        !(shape > 0 && shape <= (double)GBG_PI_LONG * width)) {
        return GBG_E_ARGUMENT;
    }
    *window = (struct gbg_ewald_window){.kind = GBG_EWALD_PROLATE, .width = width, .shape = shape};
    gbg_prolate_make(shape, &window->profile);
    window->step = gbg_prolate_value(&window->profile, 1);
    fill_window(window);
    return GBG_OK;
}

int gbg_ewald_window_make(int kind, int width, double finer, struct gbg_ewald_window *window)
{
    if ((kind != GBG_EWALD_PROLATE && kind != GBG_EWALD_BSPLINE) || width < GBG_EWALD_NARROWEST ||
        width > GBG_EWALD_WIDEST || !(finer >= 1 && finer <= 4)) {
        return GBG_E_ARGUMENT;
    }
    if (kind == GBG_EWALD_PROLATE) {
        double shape = (double)GBG_PI_LONG * width * (1 - 1 / (2 * finer));
        return gbg_ewald_window_shaped(width, shape, window);
    }
    *window = (struct gbg_ewald_window){.kind = kind, .width = width};
    fill_window(window);
    return GBG_OK;
}

double gbg_ewald_window_value(const struct gbg_ewald_window *window, double t)
{
    return (double)evaluate(window, 0, t);
}

double gbg_ewald_window_transform(const struct gbg_ewald_window *window, double f)
{
    double phase = (double)GBG_PI_LONG * f;
    if (window->kind == GBG_EWALD_PROLATE) {
        return window->width / 2.0 * gbg_prolate_transform(&window->profile, phase * window->width);
    }
    return phase == 0 ? 1 : pow(sin(phase) / phase, window->width);
}

double gbg_ewald_window_slope(const struct gbg_ewald_window *window, double f)
{
    const double pi = (double)GBG_PI_LONG;
    return f * gbg_ewald_window_transform(window, f) -
           window->step * sin(pi * f * window->width) / pi;
}

/* Sum over m >= 0 of (m + x)^-n, x > 0: terms one by one, then Euler and Maclaurin's formula. */
static double zeta(int n, double x)
{
    double sum = 0;
    for (int m = 0; m < 16; m++) {
        sum += pow(m + x, -n);
    }
    double y = x + 16, last = pow(y, -n);
    return sum + last * (y / (n - 1) + 0.5 +
                         n / (12 * y) *
                             (1 - (n + 1) * (n + 2) / (60 * y * y) *
                                      (1 - (n + 3) * (n + 4) / (42 * y * y))));
}

/* All aliases of a spline have the same sine. */
static void spline_alias(const struct gbg_ewald_window *window, double f, double *power,
                         double *slope_power)
{
    const double pi = (double)GBG_PI_LONG;
    f -= floor(f);
    int n = 2 * window->width;
    if (f == 0) {
        *power = 1;
        *slope_power = 0;
        return;
    }
    double sine = pow(sin(pi * f) / pi, n);
    *power = sine * (zeta(n, f) + zeta(n, 1 - f));
    *slope_power = sine * (zeta(n - 2, f) + zeta(n - 2, 1 - f));
}

/* Term by term: what a prolate window without much of a step at its ends leaves out so is less
 * than cosines lose by cancelling. */
static void few_aliases(const struct gbg_ewald_window *window, double f, double *power,
                        double *slope_power)
{
    *power = *slope_power = 0;
    for (int m = -3; m <= 3; m++) {
        double value = gbg_ewald_window_transform(window, f + m);
        *power += value * value;
        double slope = gbg_ewald_window_slope(window, f + m);
        *slope_power += slope * slope;
    }
}

/* All of them, from products of the window with itself. */
static void all_aliases(const struct gbg_ewald_window *window, double f, double *power,
                        double *slope_power)
{
    const double two_pi = 2 * (double)GBG_PI_LONG;
    *power = window->product[0];
    *slope_power = window->slope_product[0];
    for (int j = 1; j < window->width; j++) {
        double cosine = 2 * cos(two_pi * j * f);
        *power += cosine * window->product[j];
        *slope_power += cosine * window->slope_product[j];
    }
    *slope_power /= two_pi * two_pi;
}

void gbg_ewald_window_alias(const struct gbg_ewald_window *window, double f, double *power,
                            double *slope_power)
{
    if (window->kind == GBG_EWALD_BSPLINE) {
        spline_alias(window, f, power, slope_power);
        return;
    }
    int steps = window->step > 1e-7;
    if (steps) {
        all_aliases(window, f, power, slope_power);
    }
    if (!steps || *power < 1e-8 * window->product[0]) {
        few_aliases(window, f, power, slope_power);
    }
}
