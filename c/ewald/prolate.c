/* Numbers of long-range sums: the prolate function of order zero, by Legendre polynomials. */
#include "ewald/prolate.h"

#include <math.h>

#include "gamboge/status.h"

enum { TERMS = GBG_PROLATE_TERMS };

/* The differential operator -((1-x^2) f')' + c^2 x^2 f on normalised even Legendre polynomials: a
 * symmetric matrix of three diagonals, whose least eigenvalue is that of the function. */
struct operator
{
    long double diagonal[TERMS], beside[TERMS];
};

static void fill_operator(double c, struct operator* matrix)
{
    long double square = (long double)c * c;
    for (int j = 0; j < TERMS; j++) {
        long double k = 2 * j;
        matrix->diagonal[j] =
            k * (k + 1) + square * (2 * k * (k + 1) - 1) / ((2 * k + 3) * (2 * k - 1));
        matrix->beside[j] =
            square * (k + 2) * (k + 1) / ((2 * k + 3) * sqrtl((2 * k + 1) * (2 * k + 5)));
    }
}

/* Whether an eigenvalue lies below. */
static int below(const struct operator* matrix, long double value)
{
    long double pivot = 1;
    for (int j = 0; j < TERMS; j++) {
        long double side = j > 0 ? matrix->beside[j - 1] : 0;
        pivot = matrix->diagonal[j] - value - side * side / pivot;
        if (pivot <= 0) {
            return 1;
        }
    }
    return 0;
}

static long double least_eigenvalue(const struct operator* matrix)
{
    long double low = 0, high = matrix->diagonal[0];
    for (int step = 0; step < 80; step++) {
        long double middle = (low + high) / 2;
        if (below(matrix, middle)) {
            high = middle;
        } else {
            low = middle;
        }
    }
    return low;
}

/* One solution with a shift just below the least eigenvalue: all pivots are positive. */
static void solve(const struct operator* matrix, long double shift, long double *x)
{
    long double pivot[TERMS];
    for (int j = 0; j < TERMS; j++) {
        long double side = j > 0 ? matrix->beside[j - 1] / pivot[j - 1] : 0;
        pivot[j] = matrix->diagonal[j] - shift - (j > 0 ? side * matrix->beside[j - 1] : 0);
        x[j] -= j > 0 ? side * x[j - 1] : 0;
    }
    for (int j = TERMS - 1; j >= 0; j--) {
        x[j] = (x[j] - (j + 1 < TERMS ? matrix->beside[j] * x[j + 1] : 0)) / pivot[j];
    }
}

/* P_(2j)(0) for the sum that becomes 1. */
static long double sum_at_zero(const long double *coefficient)
{
    long double sum = 0, value = 1;
    for (int j = 0; j < TERMS; j++) {
        sum += coefficient[j] * value;
        value *= -(2 * j + 1.0L) / (2 * j + 2);
    }
    return sum;
}

int gbg_prolate_make(double c, struct gbg_prolate *prolate)
{
    if (!(c > 0 && c <= 160)) {
        return GBG_E_ARGUMENT;
    }
    struct operator matrix;
    fill_operator(c, &matrix);
    long double least = least_eigenvalue(&matrix), x[TERMS];
    for (int j = 0; j < TERMS; j++) {
        x[j] = j % 2 == 0 ? 1 : -1;
    }
    for (int step = 0; step < 4; step++) {
        solve(&matrix, least - 1e-6L, x);
        long double size = 1 / fabsl(x[0]);
        for (int j = 0; j < TERMS; j++) {
            x[j] *= size;
        }
    }
    for (int j = 0; j < TERMS; j++) {
        x[j] *= sqrtl(2 * j + 0.5L);
    }
    long double scale = 1 / sum_at_zero(x);
    prolate->c = c;
    prolate->terms = 0;
    for (int j = 0; j < TERMS; j++) {
        prolate->coefficient[j] = (double)(x[j] * scale);
        if (fabs(prolate->coefficient[j]) > 1e-22) {
            prolate->terms = j + 1;
        }
    }
    return GBG_OK;
}

/* Slopes by P'_(n+1) = P'_(n-1) + (2n+1) P_n. */
void gbg_prolate_evaluate(const struct gbg_prolate *prolate, long double x, long double *value,
                          long double *slope)
{
    long double before = 1, now = x, before_slope = 0, now_slope = 1;
    *value = *slope = 0;
    if (fabsl(x) > 1) {
        return;
    }
    *value = prolate->coefficient[0];
    for (int j = 1; j < prolate->terms; j++) {
        int n = 2 * j - 1;
        long double even = ((2 * n + 1) * x * now - n * before) / (n + 1);
        long double even_slope = before_slope + (2 * n + 1) * now;
        *value += prolate->coefficient[j] * even;
        *slope += prolate->coefficient[j] * even_slope;
        now_slope += (2 * n + 3) * even;
        now = ((2 * n + 3) * x * even - (n + 1) * now) / (n + 2);
        before = even;
        before_slope = even_slope;
    }
}

double gbg_prolate_value(const struct gbg_prolate *prolate, double x)
{
    long double value, slope;
    gbg_prolate_evaluate(prolate, x, &value, &slope);
    return (double)value;
}

double gbg_prolate_slope(const struct gbg_prolate *prolate, double x)
{
    long double value, slope;
    gbg_prolate_evaluate(prolate, x, &value, &slope);
    return (double)slope;
}

/* Spherical Bessel functions j_0 .. j_last at k: upwards as far as that is stable, else downwards
 * from where they vanish. */
static void bessel(double k, int last, double *j)
{
    j[0] = sin(k) / k;
    j[1] = sin(k) / (k * k) - cos(k) / k;
    int up = k > last ? last : (int)k;
    for (int n = 1; n < up; n++) {
        j[n + 1] = (2 * n + 1) / k * j[n] - j[n - 1];
    }
    if (up == last) {
        return;
    }
    double after = 0, now = 1e-280, down[2 * TERMS];
    for (int n = last + 60 + (int)(k / 4); n > 0; n--) {
        double before = (2 * n + 1) / k * now - after;
        after = now;
        now = before;
        if (n - 1 <= last) {
            down[n - 1] = now;
        }
        if (fabs(now) > 1e200) {
            now *= 1e-200;
            after *= 1e-200;
            for (int m = n - 1; m <= last; m++) {
                down[m] *= 1e-200;
            }
        }
    }
    /* joined where the function is not near a zero */
    int join = up > 0 && fabs(j[up]) < fabs(j[up - 1]) ? up - 1 : up;
    double scale = j[join] / down[join];
    for (int n = join + 1; n <= last; n++) {
        j[n] = down[n] * scale;
    }
}

/* Within the band the function is its own transform. */
double gbg_prolate_transform(const struct gbg_prolate *prolate, double k)
{
    k = fabs(k);
    if (k <= prolate->c) {
        return 2 * prolate->coefficient[0] * gbg_prolate_value(prolate, k / prolate->c);
    }
    double j[2 * TERMS], sum = 0;
    bessel(k, 2 * prolate->terms - 1, j);
    for (int n = 0; n < prolate->terms; n++) {
        sum += (n % 2 == 0 ? 2 : -2) * prolate->coefficient[n] * j[2 * n];
    }
    return sum;
}
