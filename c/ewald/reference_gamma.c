/* Numbers of long-range sums: incomplete gamma functions and the reference's split of a power law.
 */
#include <math.h>

#include "ewald/reference_parts.h"

static const double pi = 3.14159265358979323846, euler = 0.57721566490153286061;

/* What is below exp(-DEPTH) of the largest value of an integrand is left out. */
static const double DEPTH = 55.0;

/* Zeros of the Legendre polynomial by Newton's method. */
void gbg_gamma_rule_make(struct gbg_gamma_rule *rule)
{
    const int n = GBG_GAMMA_NODES;
    for (int i = 0; i < n; i++) {
        long double z = cosl((long double)pi * (i + 0.75L) / (n + 0.5L)), slope = 1;
        for (int step = 0; step < 8; step++) {
            long double last = 1, value = z;
            for (int k = 2; k <= n; k++) {
                long double next = ((2 * k - 1) * z * value - (k - 1) * last) / k;
                last = value;
                value = next;
            }
            slope = n * (last - z * value) / (1 - z * z);
            z -= value / slope;
        }
        rule->node[i] = (double)z;
        rule->weight[i] = (double)(2 / ((1 - z * z) * slope * slope));
        rule->grown[i] = (double)expl(0.5L * (long double)GBG_GAMMA_PANEL * z);
    }
}

/* t = e^u: Int_0^inf exp(order u - x (e^u - 1)) du exp(-x), an integrand that falls from u = 0 on
 * where the order is below x. */
static double from_its_top(const struct gbg_gamma_rule *rule, double order, double x)
{
    double end = log1p(DEPTH / x), total = 0.0;
    int panels = (int)ceil(end / GBG_GAMMA_PANEL);
    panels = panels > 8 ? panels : 8;
    double half = 0.5 * end / panels;
    for (int p = panels; p-- > 0;) {
        double sum = 0.0;
        for (int i = 0; i < GBG_GAMMA_NODES; i++) {
            double u = half * (2 * p + 1 + rule->node[i]);
            sum += rule->weight[i] * exp(order * u - x * expm1(u));
        }
        total += sum;
    }
    return exp(-x) * half * total;
}

/* With its top inside, at t = order/x: t = order/x e^w. */
static double around_its_top(const struct gbg_gamma_rule *rule, double order, double x)
{
    double begin = fmax(log(x / order), -DEPTH / order), end = log1p(DEPTH / order), total = 0.0;
    const double half = 0.5 * GBG_GAMMA_PANEL;
    int panels = (int)ceil((end - begin) / GBG_GAMMA_PANEL);
    for (int p = 0; p < panels; p++) {
        double sum = 0.0, middle = begin + half * (2 * p + 1), scale = exp(middle);
        for (int i = 0; i < GBG_GAMMA_NODES; i++) {
            double w = middle + half * rule->node[i];
            sum += rule->weight[i] * exp(order * (w - scale * rule->grown[i]));
        }
        total += sum;
    }
    return pow(order / x, order) * half * total;
}

double gbg_gamma_tail(const struct gbg_gamma_rule *rule, double order, double x)
{
    return order > x ? around_its_top(rule, order, x) : from_its_top(rule, order, x);
}

/* Of the short potential over all space: what is left of the integral outside a small sphere of
 * radius e when its power (or, for s = dimension, its logarithm of volume^(1/dimension)/e) is
 * taken off. */
static double integral_of_short(int dimension, double s, double a, double volume)
{
    double d = dimension, unit = pow(pi, 0.5 * d);
    if (s == d) {
        double digamma = dimension == 2 ? -euler : 2.0 - euler - 2.0 * log(2.0); /* at d/2 */
        double scaled = a * pow(volume, 1.0 / d);
        return unit / tgamma(0.5 * d + 1.0) * (0.5 * digamma - log(scaled));
    }
    return unit * pow(a, s - d) / ((d - s) * tgamma(0.5 * s + 1.0));
}

void gbg_reference_law_make(int dimension, double power, double a, double volume,
                            struct gbg_reference_law *law)
{
    double s = power - 1.0;
    double gamma = (double)tgammal(0.5L * (long double)s + 1.0L); /* also of (power+1)/2 */
    *law = (struct gbg_reference_law){.dimension = dimension, .power = power, .a = a};
    law->force_unit = pow(a, power + 1.0) / gamma;
    law->potential_unit = 0.5 * pow(a, s) / gamma;
    law->wave_unit = 0.5 * pow(pi, 0.5 * dimension) * pow(a, s - dimension) / gamma;
    law->self = s > 0.0 ? pow(a, s) / (s * gamma) : 0.5 * euler + log(a);
    law->mean = integral_of_short(dimension, s, a, volume);
    gbg_gamma_rule_make(&law->rule);
}

double gbg_reference_short(const struct gbg_reference_law *law, double x)
{
    return law->force_unit * gbg_gamma_tail(&law->rule, 0.5 * (law->power + 1.0), x);
}

double gbg_reference_short_potential(const struct gbg_reference_law *law, double x)
{
    return law->potential_unit * gbg_gamma_tail(&law->rule, 0.5 * (law->power - 1.0), x);
}

double gbg_reference_wave(const struct gbg_reference_law *law, double squared_k)
{
    double order = 0.5 * (law->dimension + 1.0 - law->power);
    return law->wave_unit * gbg_gamma_tail(&law->rule, order, squared_k / (4.0 * law->a * law->a));
}

/* Powers of z in [-1, 1] from values at Chebyshev's nodes. */
static void fit(const double *value, double *term)
{
    enum { N = GBG_REFERENCE_TERMS };
    double before[N] = {1.0}, now[N] = {0.0, 1.0}, next[N];
    for (int k = 0; k < N; k++) {
        term[k] = 0.0;
    }
    for (int m = 0; m < N; m++) {
        double sum = 0.0;
        for (int i = 0; i < N; i++) {
            sum += value[i] * cos(pi * m * (i + 0.5) / N);
        }
        sum *= (m ? 2.0 : 1.0) / N;
        for (int k = 0; k < N; k++) {
            term[k] += sum * before[k]; /* before: polynomial m, now: the one after */
        }
        for (int k = 0; k < N; k++) {
            next[k] = (k ? 2.0 * now[k - 1] : 0.0) - before[k];
        }
        for (int k = 0; k < N; k++) {
            before[k] = now[k];
            now[k] = next[k];
        }
    }
}

void gbg_reference_table_make(const struct gbg_reference_law *law, int potential, int threads,
                              int64_t first, gbg_reference_panel *table)
{
    enum { N = GBG_REFERENCE_TERMS, EACH = 1 << GBG_REFERENCE_PANEL_BITS };
    (void)threads; /* without OpenMP */
#pragma omp parallel for num_threads(threads) schedule(dynamic, 16)
    for (int64_t p = first; p < GBG_REFERENCE_PANELS; p++) {
        double value[N];
        for (int i = 0; i < N; i++) {
            double place = ((double)(p % EACH) + 0.5 * (1.0 + cos(pi * (i + 0.5) / N))) / EACH;
            double x = ldexp(1.0 + place, GBG_REFERENCE_LOWEST + (int)(p / EACH));
            value[i] =
                potential ? gbg_reference_short_potential(law, x) : gbg_reference_short(law, x);
        }
        fit(value, table[p]);
    }
}
