/* Estimators: means, ratios, orders and intercepts with their errors. */
#include <math.h>

#include "bench/estimators/estimators.h"

struct gbg_estimate gbg_estimate_mean(int n, const double *value)
{
    double sum = 0.0, squares = 0.0;
    for (int k = 0; k < n; k++) {
        sum += value[k];
    }
    double mean = sum / n;
    for (int k = 0; k < n; k++) {
        squares += (value[k] - mean) * (value[k] - mean);
    }
    return (struct gbg_estimate){mean, n > 1 ? sqrt(squares / n / (n - 1)) : INFINITY};
}

struct gbg_estimate gbg_estimate_ratio(int n, const double *above, const double *below)
{
    double a = 0.0, b = 0.0, squares = 0.0;
    for (int k = 0; k < n; k++) {
        a += above[k];
        b += below[k];
    }
    double ratio = a / b;
    for (int k = 0; k < n; k++) {
        double residue = above[k] - ratio * below[k];
        squares += residue * residue;
    }
    return (struct gbg_estimate){ratio, n > 1 ? sqrt(squares * n / (n - 1)) / fabs(b) : INFINITY};
}

struct gbg_estimate gbg_estimate_order(int n, const double *dt, const struct gbg_estimate *bias)
{
    double w = 0.0, wx = 0.0, wy = 0.0, wxx = 0.0, wxy = 0.0;
    for (int k = 0; k < n; k++) {
        double relative = bias[k].error / fabs(bias[k].mean);
        double weight = 1.0 / (relative * relative), x = log(dt[k]), y = log(fabs(bias[k].mean));
        w += weight;
        wx += weight * x;
        wy += weight * y;
        wxx += weight * x * x;
        wxy += weight * x * y;
    }
    double spread = wxx - wx * wx / w;
    return (struct gbg_estimate){(wxy - wx * wy / w) / spread, 1.0 / sqrt(spread)};
}

/* Gaussian elimination of a system that is positive definite. */
static void solve(int n, double a[6][7])
{
    for (int i = 0; i < n; i++) {
        for (int k = i + 1; k < n; k++) {
            double f = a[k][i] / a[i][i];
            for (int j = i; j <= n; j++) {
                a[k][j] -= f * a[i][j];
            }
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++) {
            a[i][n] -= a[i][k] * a[k][n];
        }
        a[i][n] /= a[i][i];
    }
}

double gbg_estimate_intercept(int n, const double *x, const double *y, int degree)
{
    double a[6][7] = {{0.0}}, scale = 0.0;
    for (int k = 0; k < n; k++) {
        scale = fmax(scale, fabs(x[k]));
    }
    for (int k = 0; k < n; k++) {
        double power[6] = {1.0};
        for (int i = 1; i <= degree; i++) {
            power[i] = power[i - 1] * x[k] / scale;
        }
        for (int i = 0; i <= degree; i++) {
            for (int j = 0; j <= degree; j++) {
                a[i][j] += power[i] * power[j];
            }
            a[i][degree + 1] += power[i] * y[k];
        }
    }
    solve(degree + 1, a);
    return a[0][degree + 1];
}
