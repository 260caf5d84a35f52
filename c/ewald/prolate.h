/* Numbers of long-range sums: the prolate spheroidal function of order zero, of all functions on
 * [-1, 1] the one whose transform leaves least outside of [-c, c]. */
#ifndef GBG_EWALD_PROLATE_H
#define GBG_EWALD_PROLATE_H

enum { GBG_PROLATE_TERMS = 96 };

struct gbg_prolate {
    double c;
    int terms;
    double coefficient[GBG_PROLATE_TERMS]; /* of the even Legendre polynomials P_0, P_2, ... */
};

/* 0 < c <= 160; psi(0) = 1. */
int gbg_prolate_make(double c, struct gbg_prolate *prolate);
/* psi and psi' at |x| <= 1; 0 outside. */
/* Both in long double, whose rounding leaves nothing in the last terms of a series. */
void gbg_prolate_evaluate(const struct gbg_prolate *prolate, long double x, long double *value,
                          long double *slope);
double gbg_prolate_value(const struct gbg_prolate *prolate, double x);
double gbg_prolate_slope(const struct gbg_prolate *prolate, double x);
/* Int_{-1}^{1} psi(x) cos(k x) dx, any k. */
double gbg_prolate_transform(const struct gbg_prolate *prolate, double k);

#endif
