/* Numbers of long-range sums: quadrature and polynomials that the tables are made with. */
#ifndef GBG_EWALD_SERIES_H
#define GBG_EWALD_SERIES_H

#define GBG_PI_LONG 3.141592653589793238462643383279502884L

enum { GBG_SERIES_MOST = 96 };

/* Gauss and Legendre's nodes in (-1, 1) and weights; n up to GBG_SERIES_MOST. */
void gbg_legendre_rule(int n, double *node, double *weight);

/* Chebyshev's nodes: cos(pi (m + 1/2)/n), m = 0 .. n-1, descending. */
long double gbg_chebyshev_node(int n, int m);
/* value[m] at these nodes becomes the coefficients of T_0 .. T_(n-1), in place. */
void gbg_chebyshev_fit(int n, long double *value);
long double gbg_chebyshev_sum(int n, const long double *coefficient, long double z);
/* Coefficients of T_0 .. T_(n-1) become those of z^0 .. z^(n-1), in place, and back. */
void gbg_chebyshev_to_powers(int n, long double *coefficient);
void gbg_chebyshev_from_powers(int n, long double *coefficient);

#endif
