/* Numbers of long-range sums: the error that a mesh and its windows make, before it is made. */
#include "ewald/loss.h"

#include <math.h>

#include "ewald/plan.h"
#include "ewald/series.h"
#include "gamboge/status.h"

/* Waves along an axis, aliases on each side. */
enum { NODES = 32, ALIASES = 3 };

/* Of one axis at each node: the wave, the transforms of window and slope there, and sums of the
 * squares of their aliases'. */
struct axis {
    double weight[NODES], wave[NODES], here[NODES], alias[NODES], slope[NODES], slope_alias[NODES];
};

/* The aliases beyond those that are added one by one: what is left of a prolate window there comes
 * from the step at its ends, and of its slope from that slope's step. */
static void add_tails(const struct gbg_ewald_window *window, double f, double *value, double *slope)
{
    if (window->kind != GBG_EWALD_PROLATE) {
        return;
    }
    const double pi = (double)GBG_PI_LONG;
    double sum = 1 / (ALIASES + 0.5 + f) + 1 / (ALIASES + 0.5 - f), phase = pi * f * window->width;
    double steep = gbg_prolate_slope(&window->profile, 1) * 2 / window->width;
    double one = window->step * sin(phase) / pi, other = steep * cos(phase) / (2 * pi * pi);
    *value += one * one * sum;
    *slope += other * other * sum;
}

/* Nodes lie closer near no wave, where the far part is strong. */
static void fill_axis(const struct gbg_split *split, const struct gbg_ewald_window *window,
                      double spacing, struct axis *axis)
{
    const double turn = 2 * (double)GBG_PI_LONG;
    double end = split->band / split->reach;
    gbg_legendre_rule(NODES, axis->wave, axis->weight);
    for (int n = 0; n < NODES; n++) {
        double root = (1 + axis->wave[n]) / 2;
        axis->weight[n] *= 2 * root * end / turn; /* waves of both signs */
        axis->wave[n] = root * root * end;
        axis->alias[n] = axis->slope_alias[n] = 0;
        for (int m = -ALIASES; m <= ALIASES; m++) {
            double f = axis->wave[n] * spacing / turn + m;
            double value = gbg_ewald_window_transform(window, f);
            double step = window->step * sin(turn / 2 * f * window->width) / (turn / 2);
            double slope = (f * value - step) * turn / spacing;
            if (m == 0) {
                axis->here[n] = value;
                axis->slope[n] = slope;
            } else {
                axis->alias[n] += value * value;
                axis->slope_alias[n] += slope * slope;
            }
        }
        double tails[2] = {0};
        add_tails(window, axis->wave[n] * spacing / turn, &tails[0], &tails[1]);
        axis->alias[n] += tails[0];
        axis->slope_alias[n] += tails[1] * turn * turn / (spacing * spacing);
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

static double integrate(const struct gbg_split *split, const struct axis *const *axis, int gradient,
                        double least)
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
        if (k2 > least * least && k2 < end * end) {
            double far = gbg_split_far(split, sqrt(k2));
            sum += weight * k2 * far * far * share(axis, n, split->dimension, gradient);
        }
    }
    return sqrt(sum);
}

/* Where waves begin: the wave 0, which is none, has the room of one. */
static double least_wave(double length)
{
    return 2 * sqrt((double)GBG_PI_LONG) / length;
}

double gbg_ewald_mesh_loss(const struct gbg_split *split, const struct gbg_ewald_window *window,
                           const double *length, const int32_t *cells, int gradient)
{
    struct axis table[3];
    const struct axis *axis[3] = {&table[0], &table[1], &table[2]};
    double longest = 0;
    for (int a = 0; a < split->dimension; a++) {
        fill_axis(split, &window[a], length[a] / cells[a], &table[a]);
        longest = fmax(longest, length[a]);
    }
    return integrate(split, axis, gradient, least_wave(longest));
}

static double loss_of_shape(const struct gbg_split *split, int width, double length, int32_t cells,
                            int gradient, double shape)
{
    struct gbg_ewald_window window = {.kind = GBG_EWALD_PROLATE, .width = width, .shape = shape};
    struct axis table;
    const struct axis *axis[3] = {&table, &table, &table};
    gbg_prolate_make(shape, &window.profile);
    window.step = gbg_prolate_value(&window.profile, 1);
    fill_axis(split, &window, length / cells, &table);
    return integrate(split, axis, gradient, least_wave(length));
}

/* By the golden section: the loss has one minimum, between aliases and a window that is cut. */
double gbg_ewald_best_shape(const struct gbg_split *split, int width, double length, int32_t cells,
                            int gradient)
{
    const double golden = (sqrt(5) - 1) / 2, most = (double)GBG_PI_LONG * width;
    double low = 0.4 * most, high = most, place[2], loss[2];
    for (int i = 0; i < 2; i++) {
        place[i] = i == 0 ? high - golden * (high - low) : low + golden * (high - low);
        loss[i] = loss_of_shape(split, width, length, cells, gradient, place[i]);
    }
    while (high - low > 0.01 * most) {
        int better = loss[1] < loss[0];
        *(better ? &low : &high) = place[!better];
        place[!better] = place[better];
        loss[!better] = loss[better];
        place[better] = better ? low + golden * (high - low) : high - golden * (high - low);
        loss[better] = loss_of_shape(split, width, length, cells, gradient, place[better]);
    }
    return loss[0] < loss[1] ? place[0] : place[1];
}
