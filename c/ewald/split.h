/* Numbers of long-range sums: a power law as pairs of finite reach and a smooth rest made of waves.
 *
 * The force on a particle at distance r from a unit source is r_vec/r^(power+1), minus the gradient
 * of 1/((power-1) r^(power-1)), of -log r where the power is 1. The potential is a superposition of
 * one profile psi at all scales, r^-s ~ Int t^(s-1) psi(t r) dt with s = power-1; scales finer than
 * the unit of the split are the near part, the others the far part:
 *   near force = r_vec r^-(power+1) (1 - G(r/unit)),
 *   G(x) = Int_0^x u^s (-psi'(u)) du / Int_0^inf u^s (-psi'(u)) du,
 *   far(k) = k^(s-d) Int_{k unit}^inf q^(d-1-s) psi^(q) dq / (s Int u^(s-1) psi du), in d
 * dimensions, with psi^ the d-dimensional transform of psi(|x|); for s = 0 the divisor is psi(0).
 * The step with which a profile ends counts in G's divisor: G jumps to 1 there. Waves within the
 * band are exactly those of the power law, all of the error is in the others.
 *
 * PROLATE: psi is the prolate function of order zero,
 * as good as confined to [0, 1] and to waves below `band` at once; unit = reach. GAUSSIAN: psi =
 * exp(-u^2), Ewald's own; unit = reach/sqrt(band/2), so that both parts end at about the same
 * error. */
#ifndef GBG_EWALD_SPLIT_H
#define GBG_EWALD_SPLIT_H

#include "ewald/prolate.h"

enum gbg_split_kind { GBG_SPLIT_PROLATE, GBG_SPLIT_GAUSSIAN };

/* Far part: octaves below the band's end, equal panels in each, a polynomial in each panel. */
enum { GBG_SPLIT_DEGREE = 39, GBG_FAR_OCTAVES = 28, GBG_FAR_PANELS = 8, GBG_FAR_TERMS = 12 };

struct gbg_split {
    int dimension, kind; /* enum gbg_split_kind */
    double power;
    double reach; /* the near part is zero from here on */
    double band;  /* the far part has no waves beyond band/reach */
    double unit;
    /* near force / r_vec = r^-(power+1) - reach^-(power+1) sum_k near[k] z^k, z = 2 (r/reach)^2 -
     * 1, for 0 < r < reach. The same for the potential: r^-s/s - reach^-s sum_k potential[k] z^k,
     * with power 1: -log(r/reach) - sum. */
    int degree;
    double near[GBG_SPLIT_DEGREE + 1], potential[GBG_SPLIT_DEGREE + 1];
    double polynomial_error; /* largest of the force's sum, over its largest value */
    double self;             /* far potential at a source's own place; of -log r for power 1 */
    double far[GBG_FAR_OCTAVES][GBG_FAR_PANELS][GBG_FAR_TERMS];
    double loss;  /* square of the force of the waves left out, in the split's units */
    double scale; /* 1 over s Int u^(s-1) psi du */
    double far_rest, far_slope; /* below the table: the integral from its end on, psi^(0) */
    struct gbg_prolate profile; /* PROLATE */
};

/* dimension 2 or 3; power from 1 to 6 in 2D, 2 in 3D (others as far as the tables go); band 2
 * to 80. Status: GBG_E_ARGUMENT without a message if a number is outside of this. */
int gbg_split_make(int dimension, double power, int kind, double reach, double band,
                   struct gbg_split *split);
/* Near force over r_vec and near potential by the formulas above, to 1e-15 of their value at
 * reach/8, not by the polynomials: what these are measured against. */
double gbg_split_near(const struct gbg_split *split, double r);
double gbg_split_near_potential(const struct gbg_split *split, double r);
/* Transform of the far potential at wave number k: by the table; 0 for k = 0 and from band/reach
 * on. Relative error 1e-14 where it is not below 1e-3 of its size without cut, absolute so below.
 */
double gbg_split_far(const struct gbg_split *split, double k);
/* RMS error of the force on a particle among sources without order, one of strength 1 in a unit of
 * volume, before any mesh: the waves beyond the band, the GAUSSIAN's pairs beyond the reach. Times
 * the root of the density of the squares of their strengths it is the error in their midst; in a
 * lattice it is less, by up to 2. */
double gbg_split_loss(const struct gbg_split *split);
/* The same over the RMS force in a lattice jittered by a quarter of its spacing, equal sources, 41
 * of them within the reach: what splits are compared by. */
double gbg_split_error(const struct gbg_split *split);
/* The lowest degree at which near[] may be cut off: terms left out come to less than error times
 * the largest value. */
int gbg_split_degree(const struct gbg_split *split, double error);
/* near[] and potential[] become the best polynomials of the lowest degree with that error over the
 * largest value (some terms fewer than those cut off): for single precision. */
void gbg_split_shorten(struct gbg_split *split, double error);
/* Between split.c and split_far.c: the table of waves. */
void gbg_split_fill_far(struct gbg_split *split);

#endif
