/* Estimators of the physics, for benchmarks and tests. They use the public interface alone.
 *
 * Units: diameter 1, mobility of the medium 1. A component of a free step has the deviation
 * s = sqrt(T dt). Every estimate carries one standard error. Calls return 0 or a status of the
 * library whose message is in the context. */
#ifndef GBG_BENCH_ESTIMATORS_H
#define GBG_BENCH_ESTIMATORS_H

#include <stdint.h>

#include "gamboge/gamboge.h"

struct gbg_estimate {
    double mean, error;
};

/* ---- statistics.c ---- */

/* Mean of n independent values (or block means). */
struct gbg_estimate gbg_estimate_mean(int n, const double *value);
/* Sum of above over sum of below, of n independent pairs of sums. */
struct gbg_estimate gbg_estimate_ratio(int n, const double *above, const double *below);
/* The order of an error: slope of log|bias| against log(dt), weighted by the errors of the biases,
 * which are taken as independent and small against the biases. */
struct gbg_estimate gbg_estimate_order(int n, const double *dt, const struct gbg_estimate *bias);
/* Intercept at x = 0 of the least-squares polynomial of the given degree (at most 5) through n
 * points of equal weight. */
double gbg_estimate_intercept(int n, const double *x, const double *y, int degree);

/* ---- run.c ---- */

/* What an engine is made of: one or two species in a square box, one force or none. */
struct gbg_sample {
    const char *rule; /* of excluded volume; NULL: no cores */
    double edge, dt, temperature;
    int species; /* 1 or 2 */
    double alpha[2], mobility[2];
    double power, cutoff;  /* of the force; power 0: none */
    const char *precision; /* of the force; NULL: auto */
    int64_t seed;
};

/* Steps made and what they cost. */
struct gbg_work {
    double particle_steps, wall, core; /* seconds; core: summed over the cores that worked */
};

int gbg_sample_engine(struct gbg_context *context, const struct gbg_sample *sample, int64_t n,
                      const double *x, const double *y, const int32_t *species,
                      struct gbg_engine **engine);
/* 1 if the rule exists in this build, 0 if it has its name only. */
int gbg_rule_is_built(struct gbg_context *context, const char *rule);
/* Runs and adds to the work. */
int gbg_work_run(struct gbg_engine *engine, int64_t steps, struct gbg_work *work);

/* ---- discs.c: passive hard discs ---- */

enum { GBG_LAGS = 3, GBG_BLOCKS = 20 };
extern const double
    gbg_disc_lags[GBG_LAGS]; /* free displacement of a component: 0.04, 0.16, 0.64 */

struct gbg_disc_plan {
    const char *rule;
    double packing, s;
    int64_t n, seed;
    double duration; /* of the measurement, as the free mean square of a component: steps s^2 */
};

struct gbg_disc_result {
    /* contact: g at contact, from the cubic through 80 bins of 0.00125 in the gaps 0 to 0.1,
     * normalised with N^2/V; virial: Z from the displacements of the contact pushes; ratio:
     * C = (1 + 2 packing g)/Z, 1 if the two agree, in which slow fluctuations of density cancel;
     * msd: over that of free particles, at gbg_disc_lags; pushes: contacts per particle and step */
    struct gbg_estimate contact, virial, ratio, msd[GBG_LAGS], pushes;
    double
        slow_error; /* of `contact`, from 5 blocks instead of 20: larger if blocks are correlated */
    struct gbg_work work;
};

/* n discs in equilibrium, up to the statistics of one run: from random insertion (packing to 0.5)
 * or a lattice (square to 0.75), by the rule "event" with large steps if it is built, else by
 * bounce with small ones. x, y: n coordinates each; edge: of the square box. */
int gbg_discs_equilibrium(struct gbg_context *context, double packing, int64_t n, int64_t seed,
                          double *x, double *y, double *edge);
/* Measures one rule from that start, after a tenth of the duration to forget it. */
int gbg_discs_measure(struct gbg_context *context, const struct gbg_disc_plan *plan, double edge,
                      const double *x, const double *y, struct gbg_disc_result *result);

/* ---- dimers.c: bound pairs, isolated or in a dense suspension ---- */

/* Two kinds of particles, and the species of the two partners of a bound pair. */
struct gbg_pair_law {
    const char *name;
    double alpha[2], mobility[2];
    int partner[2];
    double power;
};

enum { GBG_BOUND_PAIRS = 5 };
/* The bound pairs of the configurations C0 to C4 of Carter 2016 (those of C0 and C1 are the same),
 * with the short-range force r^-6. */
extern const struct gbg_pair_law gbg_bound_pairs[GBG_BOUND_PAIRS];

/* A = mu_1 alpha_2 + mu_2 alpha_1: radial drift A/r^n, bound if negative; and |mu_1 alpha_2 - mu_2
 * alpha_1|/2: speed along the axis at contact. */
double gbg_pair_drift(const struct gbg_pair_law *law);
double gbg_pair_speed(const struct gbg_pair_law *law);

struct gbg_pair_exact {
    double gap, speed; /* means over gaps below `below` */
};
/* Stationary law of an isolated pair in the plane, P(r) ~ r exp((A/T)(1 - r^(1-n))/(n - 1)) from
 * contact on, by quadrature over gaps from 0 to below (0: 0.3, beyond which is nothing). */
struct gbg_pair_exact gbg_pair_exact(const struct gbg_pair_law *law, double temperature,
                                     double below);

struct gbg_dimer_plan {
    const char *rule;
    double dt, temperature;
    int pairs;       /* independent pairs, far from each other */
    int generations; /* fresh starts */
    double duration; /* of a generation, time */
    int64_t seed;
};

struct gbg_dimer_result {
    struct gbg_estimate gap, near_gap, speed; /* near: gaps below 0.02 alone */
    struct gbg_work work;
};

int gbg_dimers_measure(struct gbg_context *context, const struct gbg_pair_law *law,
                       const struct gbg_dimer_plan *plan, struct gbg_dimer_result *result);

struct gbg_dense_plan {
    const char *rule;
    double dt, packing;
    int64_t n, seed;
    int starts;         /* independent equilibria */
    double from, until; /* window of time after the forces are switched on */
};

struct gbg_dense_result {
    /* unlike pairs closer than a gap of 0.02: mean gap; speed of the pair along its axis; density
     * of pairs in gaps 0 to 0.00125 over the uniform one */
    struct gbg_estimate gap, speed, first_bin;
    struct gbg_work work;
};

int gbg_dense_measure(struct gbg_context *context, const struct gbg_pair_law *law,
                      const struct gbg_dense_plan *plan, struct gbg_dense_result *result);

#endif
