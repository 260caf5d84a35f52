/* Numbers of long-range sums: quadrature and polynomials that the tables are made with. */
#include "ewald/series.h"

#include <math.h>

/* P_n and its derivative. */
static long double legendre(int n, long double x, long double *slope)
{
    long double before = 1, now = x;
    for (int k = 1; k < n; k++) {
        long double next = ((2 * k + 1) * x * now - k * before) / (k + 1);
        before = now;
        now = next;
    }
    *slope = n * (before - x * now) / (1 - x * x);
    return now;
}

void gbg_legendre_rule(int n, double *node, double *weight)
{
    for (int m = 0; m < n; m++) {
        long double x = cosl(GBG_PI_LONG * (m + 0.75L) / (n + 0.5L)), slope = 1;
        for (int step = 0; step < 6; step++) {
            x -= legendre(n, x, &slope) / slope;
        }
        legendre(n, x, &slope);
        node[m] = (double)x;
        weight[m] = (double)(2 / ((1 - x * x) * slope * slope));
    }
}

long double gbg_chebyshev_node(int n, int m)
{
    return cosl(GBG_PI_LONG * (m + 0.5L) / n);
}

void gbg_chebyshev_fit(int n, long double *value)
{
    long double cosine[4 * GBG_SERIES_MOST], sum[GBG_SERIES_MOST];
    for (int j = 0; j < 4 * n; j++) {
        cosine[j] = cosl(GBG_PI_LONG * j / (2 * n));
    }
    for (int k = 0; k < n; k++) {
        sum[k] = 0;
        for (int m = 0; m < n; m++) {
            sum[k] += value[m] * cosine[k * (2 * m + 1) % (4 * n)];
        }
    }
    for (int k = 0; k < n; k++) {
        value[k] = sum[k] * (k == 0 ? 1 : 2) / n;
    }
}

long double gbg_chebyshev_sum(int n, const long double *coefficient, long double z)
{
    long double after = 0, now = 0;
    for (int k = n - 1; k > 0; k--) {
        long double next = coefficient[k] + 2 * z * now - after;
        after = now;
        now = next;
    }
    return coefficient[0] + z * now - after;
}

/* T_k by powers, for one k after the other: T_(k+1) = 2 z T_k - T_(k-1). */
static void next_polynomial(int k, long double *before, long double *now)
{
    for (int j = k + 1; j >= 0; j--) {
        long double next = (j > 0 ? (k == 0 ? 1 : 2) * now[j - 1] : 0) - (k == 0 ? 0 : before[j]);
        before[j] = now[j];
        now[j] = next;
    }
}

void gbg_chebyshev_to_powers(int n, long double *coefficient)
{
    long double sum[GBG_SERIES_MOST + 1] = {0};
    long double before[GBG_SERIES_MOST + 1] = {0}, now[GBG_SERIES_MOST + 1] = {1};
    for (int k = 0; k < n; k++) {
        for (int j = 0; j <= k; j++) {
            sum[j] += coefficient[k] * now[j];
        }
        next_polynomial(k, before, now);
    }
    for (int j = 0; j < n; j++) {
        coefficient[j] = sum[j];
    }
}

/* By Horner's rule, each product by z in Chebyshev's polynomials. */
void gbg_chebyshev_from_powers(int n, long double *coefficient)
{
    long double sum[GBG_SERIES_MOST + 2] = {0};
    for (int k = n - 1; k >= 0; k--) {
        long double old[GBG_SERIES_MOST + 2];
        for (int j = 0; j <= n; j++) {
            old[j] = sum[j];
        }
        sum[0] = old[1] / 2 + coefficient[k];
        sum[1] = old[0] + old[2] / 2;
        for (int j = 2; j < n; j++) {
            sum[j] = (old[j - 1] + old[j + 1]) / 2;
        }
    }
    for (int j = 0; j < n; j++) {
        coefficient[j] = sum[j];
    }
}
