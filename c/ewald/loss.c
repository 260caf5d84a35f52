/* Numbers of long-range sums: the error that a mesh and its windows make, before it is made. */
#include "ewald/loss.h"

#include <math.h>

#include "ewald/plan.h"
#include "ewald/series.h"
#include "gamboge/status.h"

/* Waves along an axis, aliases on each side. */
enum { NODES = 24, ALIASES = 3 };

/* Of one axis at each node: the wave, the transforms of window and slope there, and sums of the
 * squares of their aliases'. */
struct axis {
    double weight[NODES], wave[NODES], here[NODES], alias[NODES], slope[NODES], slope_alias[NODES];
};

static void fill_axis(const struct gbg_split *split, const struct gbg_ewald_window *window,
                      double spacing, struct axis *axis)
{
    const double turn = 2 * (double)GBG_PI_LONG;
    double half = split->band / split->reach / 2;
    gbg_legendre_rule(NODES, axis->wave, axis->weight);
    for (int n = 0; n < NODES; n++) {
        axis->weight[n] *= 2 * half / turn; /* waves of both signs */
        axis->wave[n] = half * (1 + axis->wave[n]);
        axis->alias[n] = axis->slope_alias[n] = 0;
        for (int m = -ALIASES; m <= ALIASES; m++) {
            double f = axis->wave[n] * spacing / turn + m;
            double value = gbg_ewald_window_transform(window, f);
            double slope = gbg_ewald_window_slope(window, f) * turn / spacing;
            if (m == 0) {
                axis->here[n] = value;
                axis->slope[n] = slope;
            } else {
                axis->alias[n] += value * value;
                axis->slope_alias[n] += slope * slope;
            }
        }
    }
}

/* Product over axes of squares, and what aliases add to it. */
struct product {
    double here, added;
};

static struct product times(struct product left, double here, double added)
{
    return (struct product){left.here * here,
                            left.here * added + left.added * here + left.added * added};
}

/* Slopes of the windows' product and what aliases add to them, over that of the waves alone where
 * slopes point: how far they miss the direction of the wave counts as added. */
static struct product slope_product(const struct axis *const *axis, const int *n, int dimension)
{
    struct product all = {0, 0};
    double slope[3] = {0}, k2 = 0, cross = 0;
    for (int a = 0; a < dimension; a++) {
        struct product one = {1, 0};
        slope[a] = axis[a]->slope[n[a]];
        for (int b = 0; b < dimension; b++) {
            double here = b == a ? slope[a] : axis[b]->here[n[b]];
            one = times(one, here * here, (b == a ? axis[b]->slope_alias : axis[b]->alias)[n[b]]);
            slope[a] *= b == a ? 1 : axis[b]->here[n[b]];
        }
        all.here += one.here;
        all.added += one.added;
        k2 += axis[a]->wave[n[a]] * axis[a]->wave[n[a]];
    }
    for (int a = 0; a < dimension; a++) {
        int b = (a + 1) % dimension;
        double turned = axis[a]->wave[n[a]] * slope[b] - axis[b]->wave[n[b]] * slope[a];
        cross += (dimension == 2 ? 0.5 : 1) * turned * turned;
    }
    return (struct product){all.here - cross / k2, all.added + cross / k2};
}

/* The share of a wave's square that is error with the best influence: each node of each axis. */
static double share(const struct axis *const *axis, const int *n, int dimension, int gradient)
{
    struct product square = {1, 0};
    for (int a = 0; a < dimension; a++) {
        double here = axis[a]->here[n[a]];
        square = times(square, here * here, axis[a]->alias[n[a]]);
    }
    struct product other =
        gradient == GBG_GRADIENT_WINDOW ? slope_product(axis, n, dimension) : square;
    double all = (square.here + square.added) * (other.here + other.added);
    return all > 0 ? times(square, other.here, other.added).added / all : 0;
}

static double integrate(const struct gbg_split *split, const struct axis *const *axis, int gradient)
{
    double sum = 0, end = split->band / split->reach;
    int third = split->dimension == 3 ? NODES : 1;
    for (int m = 0; m < NODES * NODES * third; m++) {
        int n[3] = {m % NODES, m / NODES % NODES, m / NODES / NODES};
        double k2 = 0, weight = 1;
        for (int a = 0; a < split->dimension; a++) {
            k2 += axis[a]->wave[n[a]] * axis[a]->wave[n[a]];
            weight *= axis[a]->weight[n[a]];
        }
        if (k2 < end * end) {
            double far = gbg_split_far(split, sqrt(k2));
            sum += weight * k2 * far * far * share(axis, n, split->dimension, gradient);
        }
    }
    return sqrt(sum);
}

double gbg_ewald_mesh_loss(const struct gbg_split *split, const struct gbg_ewald_window *window,
                           const double *spacing, int gradient)
{
    struct axis table[3];
    const struct axis *axis[3] = {&table[0], &table[1], &table[2]};
    for (int a = 0; a < split->dimension; a++) {
        fill_axis(split, &window[a], spacing[a], &table[a]);
    }
    return integrate(split, axis, gradient);
}

static double loss_of_shape(const struct gbg_split *split, int width, double spacing, int gradient,
                            double shape)
{
    struct gbg_ewald_window window = {.kind = GBG_EWALD_PROLATE, .width = width, .shape = shape};
    struct axis table;
    const struct axis *axis[3] = {&table, &table, &table};
    gbg_prolate_make(shape, &window.profile);
    window.step = gbg_prolate_value(&window.profile, 1);
    fill_axis(split, &window, spacing, &table);
    return integrate(split, axis, gradient);
}

/* By the golden section: the loss has one minimum, between aliases and a window that is cut. */
double gbg_ewald_best_shape(const struct gbg_split *split, int width, double spacing, int gradient)
{
    const double golden = (sqrt(5) - 1) / 2, most = (double)GBG_PI_LONG * width;
    double low = 0.4 * most, high = most, place[2], loss[2];
    for (int i = 0; i < 2; i++) {
        place[i] = i == 0 ? high - golden * (high - low) : low + golden * (high - low);
        loss[i] = loss_of_shape(split, width, spacing, gradient, place[i]);
    }
    while (high - low > 0.01 * most) {
        int better = loss[1] < loss[0];
        *(better ? &low : &high) = place[!better];
        place[!better] = place[better];
        loss[!better] = loss[better];
        place[better] = better ? low + golden * (high - low) : high - golden * (high - low);
        loss[better] = loss_of_shape(split, width, spacing, gradient, place[better]);
    }
    return loss[0] < loss[1] ? place[0] : place[1];
}
