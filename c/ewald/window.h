/* Numbers of long-range sums: the window by which a particle is spread over the mesh and read from
 * it. */
#ifndef GBG_EWALD_WINDOW_H
#define GBG_EWALD_WINDOW_H

#include "ewald/prolate.h"

enum gbg_ewald_window_kind { GBG_EWALD_PROLATE, GBG_EWALD_BSPLINE };
enum { GBG_EWALD_NARROWEST = 3, GBG_EWALD_WIDEST = 16, GBG_EWALD_DEGREE = 19 };

/* Node l = 0..width-1 of a particle at offset z in [-1,1] between nodes (z/2 = its place in a mesh
 * spacing, less 1/2; for an even width the spacing that it is in, for an odd width the one around
 * its nearest node): window(l + 1/2 - width/2 - z/2) = sum_k value[k][l] z^k; slope: d/dt of the
 * same, t in spacings. Columns from `width` on are zero. */
struct gbg_ewald_window {
    int kind; /* enum gbg_ewald_window_kind */
    int width, degree;
    double step;  /* PROLATE: value at the ends, where it stops */
    double shape; /* PROLATE: band of the window in t from -width/2 to width/2 */
    struct gbg_prolate profile;
    /* Int w(t) w(t+j) dt and the same of w': sums over aliases are their cosine sums. */
    double product[GBG_EWALD_WIDEST], slope_product[GBG_EWALD_WIDEST];
    double polynomial_error; /* largest |polynomial - window| over its peak */
    double value[GBG_EWALD_DEGREE + 1][GBG_EWALD_WIDEST];
    double slope[GBG_EWALD_DEGREE + 1][GBG_EWALD_WIDEST];
};

/* finer: cells of the mesh over those that the waves need at least, from 1 to 4: it decides the
 * shape of the prolate window, whose transform is small from the first alias of the waves on. */
int gbg_ewald_window_make(int kind, int width, double finer, struct gbg_ewald_window *window);
/* A prolate window of this shape, up to pi times the width. */
int gbg_ewald_window_shaped(int width, double shape, struct gbg_ewald_window *window);
/* Window at t spacings, and its transform at f cycles a spacing, by their definitions. */
double gbg_ewald_window_value(const struct gbg_ewald_window *window, double t);
double gbg_ewald_window_transform(const struct gbg_ewald_window *window, double f);
/* Transform of the window's slope over 2 pi i: f transform(f), less the share of the steps at a
 * prolate window's ends, which no slope has that is read from polynomials. */
double gbg_ewald_window_slope(const struct gbg_ewald_window *window, double f);
/* Sums over all aliases m of transform(f+m)^2 and of slope(f+m)^2. */
void gbg_ewald_window_alias(const struct gbg_ewald_window *window, double f, double *power,
                            double *slope_power);

#endif
