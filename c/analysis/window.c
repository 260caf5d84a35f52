/* Analysis room: the Kaiser-Bessel window less its pedestal. Formulas: window.h. */
#include "analysis/window.h"

#include <math.h>
#include <string.h>

/* beta/width that makes the largest aliasing sum over |f| <= 1/4 smallest (tests/unit/
 * analysis_window.c searches it again). */
static const double best_beta[GBG_WINDOW_WIDEST + 1] = {
    [2] = 1.986, [3] = 2.231,  [4] = 2.248,  [5] = 2.278,  [6] = 2.320, [7] = 2.318,
    [8] = 2.333, [10] = 2.339, [12] = 2.346, [14] = 2.347, [16] = 2.328};

static const long double pi = 3.14159265358979323846264338327950288L;

/* I0(sqrt(square)) - 1 by its power series; square may be slightly negative. */
static long double bessel_less_one(long double square)
{
    long double quarter = square / 4, term = 1, sum = 0;
    for (int k = 1; k < 400; k++) {
        term *= quarter / ((long double)k * k);
        sum += term;
        if (fabsl(term) <= 1e-22L * fabsl(sum)) {
            break;
        }
    }
    return sum;
}

static long double window_value(const struct gbg_window *window, long double t)
{
    long double x = 2 * t / window->width, beta = window->beta;
    return bessel_less_one(beta * beta * (1 - x * x)) / bessel_less_one(beta * beta);
}

enum { MOST_TERMS = GBG_WINDOW_DEGREE(GBG_WINDOW_WIDEST) + 1 };

/* Powers of z from Chebyshev polynomials: T_{k+1} = 2 z T_k - T_{k-1}. */
static void to_powers(int terms, const long double *chebyshev, long double *power)
{
    long double before[MOST_TERMS] = {1}, now[MOST_TERMS] = {0, 1}, next[MOST_TERMS];
    memset(power, 0, (size_t)terms * sizeof *power);
    power[0] = chebyshev[0];
    for (int k = 1; k < terms; k++) {
        for (int j = 0; j <= k; j++) {
            power[j] += chebyshev[k] * now[j];
        }
        for (int j = 0; j < MOST_TERMS; j++) {
            next[j] = (j > 0 ? 2 * now[j - 1] : 0) - before[j];
        }
        memcpy(before, now, sizeof before);
        memcpy(now, next, sizeof now);
    }
}

/* The polynomial of one node, by interpolation at the Chebyshev points. */
static void fit_node(struct gbg_window *window, int node)
{
    int terms = GBG_WINDOW_DEGREE(window->width) + 1;
    long double value[MOST_TERMS] = {0}, chebyshev[MOST_TERMS] = {0}, power[MOST_TERMS];
    long double offset = node + 0.5L - window->width / 2.0L;
    for (int j = 0; j < terms; j++) {
        value[j] = window_value(window, offset - cosl(pi * (j + 0.5L) / terms) / 2);
    }
    for (int k = 0; k < terms; k++) {
        long double sum = 0;
        for (int j = 0; j < terms; j++) {
            sum += value[j] * cosl(pi * k * (j + 0.5L) / terms);
        }
        chebyshev[k] = sum * (k == 0 ? 1.0L : 2.0L) / terms;
    }
    to_powers(terms, chebyshev, power);
    for (int k = 0; k < terms; k++) {
        window->coefficient[k][GBG_WINDOW_LEAD(window->width) + node] = (double)power[k];
    }
}

/* Largest difference between the polynomial in double arithmetic and the window, over samples. */
static double measure_node(const struct gbg_window *window, int node)
{
    enum { SAMPLES = 64 };
    double largest = 0;
    long double offset = node + 0.5L - window->width / 2.0L;
    for (int i = 0; i <= SAMPLES; i++) {
        double z = 2.0 * i / SAMPLES - 1, sum = 0;
        for (int k = GBG_WINDOW_DEGREE(window->width); k >= 0; k--) {
            sum = sum * z + window->coefficient[k][GBG_WINDOW_LEAD(window->width) + node];
        }
        double error = (double)fabsl(sum - window_value(window, offset - z / 2.0L));
        largest = error > largest ? error : largest;
    }
    return largest;
}

void gbg_window_make_with(int width, double beta, struct gbg_window *window)
{
    memset(window, 0, sizeof *window);
    window->width = width;
    window->beta = beta;
    window->peak = (double)bessel_less_one((long double)beta * beta);
    for (int node = 0; node < width; node++) {
        fit_node(window, node);
    }
    for (int node = 0; node < width; node++) {
        double error = measure_node(window, node);
        window->polynomial_error =
            error > window->polynomial_error ? error : window->polynomial_error;
    }
    window->polynomial_error *= 1.25; /* extrema lie between the samples */
    window->transform_zero = gbg_window_transform(window, 0);
}

void gbg_window_make(int width, struct gbg_window *window)
{
    gbg_window_make_with(width, best_beta[width] * width, window);
}

/* Extended precision, because sinh(q) multiplies the rounding of q by q. */
double gbg_window_transform(const struct gbg_window *window, double f)
{
    long double x = pi * window->width * f, beta = window->beta;
    long double square = (beta - x) * (beta + x), q = sqrtl(fabsl(square)), bessel = 1;
    if (q > 0) {
        bessel = (square > 0 ? sinhl(q) : sinl(q)) / q;
    }
    long double pedestal = x != 0 ? sinl(x) / x : 1;
    return (double)(window->width * (bessel - pedestal) / bessel_less_one(beta * beta));
}

/* |transform(f)| for |f| > 1/2, times peak/width: no such care needed. */
static double alias_at(const struct gbg_window *window, double f)
{
    double x = (double)pi * window->width * f;
    double square = (x - window->beta) * (x + window->beta), q = sqrt(fabs(square)), bessel = 1;
    if (q > 0) {
        bessel = (square > 0 ? sin(q) : sinh(q)) / q;
    }
    return fabs(bessel - sin(x) / x);
}

void gbg_window_alias(const struct gbg_window *window, double f, double *sum, double *root)
{
    enum { ALIASES = 24 };
    double total = 0, squares = 0;
    for (int m = 1; m <= ALIASES; m++) {
        double above = alias_at(window, m + f), below = alias_at(window, m - f);
        total += above + below;
        squares += above * above + below * below;
    }
    /* The rest: for X >= 2 beta, |sin(q)/q - sin(X)/X| <= 0.62 (beta/X)^2. */
    double ratio = window->beta / ((double)pi * window->width);
    total += 2 * 0.62 * ratio * ratio / (ALIASES - 0.5);
    double here = gbg_window_transform(window, f) * window->peak / window->width;
    *sum = total / here;
    *root = sqrt(squares) / here;
}
