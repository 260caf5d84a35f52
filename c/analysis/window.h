/* Analysis room: the spreading window, its transform and its aliasing sums. */
#ifndef GBG_ANALYSIS_WINDOW_H
#define GBG_ANALYSIS_WINDOW_H

enum { GBG_WINDOW_NARROWEST = 2, GBG_WINDOW_WIDEST = 16, GBG_WINDOW_ROW = 16 };

/* Degree of the polynomials that replace a window of this width between two mesh nodes: their error
 * is below 6 % of the aliasing of a mesh twice as fine as the modes need (below 1 % from width 7).
 */
#define GBG_WINDOW_DEGREE(width) ((width) + 1)

/* Widths 2..8, 10, 12, 14 and 16 are built. A row has 8 values up to width 8, else 16 with the
 * window in their middle: node l is value GBG_WINDOW_LEAD(width) + l. */
#define GBG_WINDOW_LANES(width) ((width) <= 8 ? 8 : 16)
#define GBG_WINDOW_LEAD(width) ((width) <= 8 ? 0 : (16 - (width)) / 2)
#define GBG_WINDOW_NEXT(width) ((width) < 8 ? (width) + 1 : (width) + 2)

/* Kaiser-Bessel window less its value at the edge, so that it is continuous there and its aliasing
 * sums converge absolutely: with x = 2 t/width,
 *   phi(t) = (I0(beta sqrt(1 - x^2)) - 1)/(I0(beta) - 1),  |x| <= 1,
 *   transform(f) = width (sinh(q)/q - sin(X)/X)/(I0(beta) - 1), X = pi width f, q^2 = beta^2 - X^2,
 * t in mesh spacings, f in cycles per spacing. */
struct gbg_window {
    int width; /* nodes that a particle touches on an axis */
    double beta;
    double peak;             /* I0(beta) - 1 */
    double transform_zero;   /* transform(0) */
    double polynomial_error; /* largest |polynomial - phi|, rounding included */
    /* Node l = 0..width-1 of a particle at z (in [-1,1]) between nodes:
     * phi(l + 1/2 - width/2 - z/2) = sum_k coefficient[k][lead + l] z^k; other columns are zero. */
    double coefficient[GBG_WINDOW_DEGREE(GBG_WINDOW_WIDEST) + 1][GBG_WINDOW_ROW];
};

/* width: one that is built. */
void gbg_window_make(int width, struct gbg_window *window);
/* The same with another beta; gbg_window_make takes the best one for a mesh twice as fine. */
void gbg_window_make_with(int width, double beta, struct gbg_window *window);
double gbg_window_transform(const struct gbg_window *window, double f);
/* Sums over the aliases m != 0 of |transform(f+m)| / transform(f), as they are and as the root of
 * the sum of squares; the first is an upper bound. 0 <= f <= 1/2. */
void gbg_window_alias(const struct gbg_window *window, double f, double *sum, double *root);

#endif
