/* Numbers of long-range sums: reach, band, mesh and window from the tolerance. */
#include "ewald/model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "gamboge/status.h"

static const double pi = 3.14159265358979323846;

/* Tolerances that are taken, and the finest for which single precision serves. */
static const double loosest = 0.1, finest_single = 3e-6;

/* Closer to what the waves need, errors are up to twice what a mesh is expected to lose (seen in 3D
 * on lattices). */
static const double least_finer = 1.12;

/* Meshes beyond this are not looked for: shorter reaches only make them larger. */
static const double most_cells = 4e9;

/* What a plan aims at, over the tolerance: forces in a lattice that is less jittered than that of
 * `relative` are weaker. Shares of it: of the split and of the mesh, added as squares. */
static const double aim = 0.7, split_share = 0.6 * 0.7, mesh_share = 0.6 * 0.7;

/* Relative force error of a split, by the trend of gbg_split_error for power 2 in the plane; the
 * choice is held against the loss of its own plan. */
static double split_error(int split, double band)
{
    return split == GBG_SPLIT_PROLATE ? 0.7 * sqrt(band) * exp(-band) : 0.33 * exp(-0.5 * band);
}

/* Band for which the split makes that error. */
static double band_for(int split, double error)
{
    double band = 4.0;
    for (int k = 0; k < 8; k++) {
        double over = log(split_error(split, band) / error);
        band = fmax(band + (split == GBG_SPLIT_PROLATE ? over : 2.0 * over), 2.0);
    }
    return band;
}

/* Relative force error by windows of `width` nodes on a mesh `finer` than the waves need, by the
 * trend of gbg_ewald_mesh_loss. */
static double mesh_error(int window, int gradient, int width, double finer)
{
    double nodes = gradient == GBG_GRADIENT_WAVES ? width : width - 1.0;
    return window == GBG_EWALD_PROLATE ? exp(-1.05 * pi * nodes * (1.0 - 0.5 / finer))
                                       : 0.1 * pow(2.2 * (2.0 * finer - 1.0), -nodes);
}

static int width_for(int window, int gradient, double finer, double error)
{
    for (int width = GBG_EWALD_NARROWEST; width <= GBG_EWALD_WIDEST; width++) {
        if (mesh_error(window, gradient, width, finer) <= error) {
            return width;
        }
    }
    return 0;
}

/* ns a pair looked at, a mesh cell in all transforms, a node touched both ways: on a core of a
 * server of 2023 with AVX-512, in single and in double precision. */
static const double usual_cost[2][3] = {{0.9, 45.0, 1.6}, {0.45, 20.0, 0.8}};

/* Pairs that cells of half the reach make one look at, over those within it: cubes over spheres. */
static double looked_at(int dimension)
{
    return dimension == 2 ? 2.5 * 2.5 / pi : 2.5 * 2.5 * 2.5 * 0.75 / pi;
}

static double within(const struct gbg_ewald_wish *wish, double reach)
{
    double density = (double)wish->n;
    for (int a = 0; a < wish->dimension; a++) {
        density /= wish->length[a];
    }
    return density *
           (wish->dimension == 2 ? pi * reach * reach : 4.0 / 3.0 * pi * reach * reach * reach);
}

static double longest_reach(const struct gbg_ewald_wish *wish)
{
    double shortest = wish->length[0];
    for (int a = 1; a < wish->dimension; a++) {
        shortest = fmin(shortest, wish->length[a]);
    }
    return 0.5 * shortest;
}

static double cells_of(const struct gbg_ewald_choice *choice)
{
    return (double)choice->cells[0] * choice->cells[1] * choice->cells[2];
}

double gbg_ewald_finest(const struct gbg_ewald_wish *wish)
{
    return wish->single > 0 ? finest_single : 1e-12;
}

/* ns a particle. */
static double cost_of(const struct gbg_ewald_wish *wish, const struct gbg_ewald_choice *choice)
{
    const double *usual = usual_cost[choice->single];
    double n = fmax((double)wish->n, 1.0), cells = 1.0, nodes = 1.0;
    double pair = wish->pair_cost > 0.0 ? wish->pair_cost : usual[0];
    double wave = wish->wave_cost > 0.0 ? wish->wave_cost : usual[1];
    double node = wish->node_cost > 0.0 ? wish->node_cost : usual[2];
    int back = choice->gradient == GBG_GRADIENT_WAVES ? choice->dimension : 1;
    for (int a = 0; a < choice->dimension; a++) {
        cells *= choice->cells[a];
        nodes *= choice->width;
    }
    return pair * looked_at(choice->dimension) * within(wish, choice->reach) +
           wave * cells / n * (1.0 + back) / 3.0 + node * nodes;
}

/* No mesh coarser than `finer` times what the waves need, or than its window. */
static void fit_cells(struct gbg_ewald_choice *choice, double finer)
{
    for (int a = 0; a < 3; a++) {
        double waves = choice->band / choice->reach * choice->length[a] / (2.0 * pi);
        double least = fmax(2.0 * waves * finer, choice->width);
        if (a >= choice->dimension) {
            choice->cells[a] = 1;
        } else if (choice->cells[a] < least) {
            choice->cells[a] = gbg_ewald_cells(least);
        }
    }
}

/* Fills in mesh and window for the reach and band of the choice; 0: no window is that good. */
static int lay_mesh(const struct gbg_ewald_wish *wish, double finer,
                    struct gbg_ewald_choice *choice)
{
    choice->width =
        width_for(choice->window, choice->gradient, finer, mesh_share * wish->tolerance);
    memset(choice->cells, 0, sizeof choice->cells);
    fit_cells(choice, finer);
    return choice->width > 0;
}

static void begin(const struct gbg_ewald_wish *wish, struct gbg_ewald_choice *choice)
{
    memset(choice, 0, sizeof *choice);
    choice->dimension = wish->dimension;
    memcpy(choice->length, wish->length, sizeof choice->length);
    choice->power = wish->power;
    choice->split = wish->split < 0 ? GBG_SPLIT_PROLATE : wish->split;
    choice->window = wish->window < 0 ? GBG_EWALD_PROLATE : wish->window;
    choice->gradient = wish->gradient < 0 ? GBG_GRADIENT_WAVES : wish->gradient;
    choice->single = wish->single < 0 ? wish->tolerance >= finest_single : wish->single;
    choice->band = band_for(choice->split, split_share * wish->tolerance);
}

/* Relative force error that a plan is expected to make: its loss over the RMS force in a jittered
 * lattice (gbg_split_error) of this density. */
static double relative(const struct gbg_ewald_wish *wish, double loss)
{
    double d = wish->dimension,
           spacing = pow(within(wish, 1.0) / (d == 2 ? pi : 4.0 / 3.0 * pi), -1.0 / d);
    double force = 0.93 * pow(1.68, wish->power - 1.0) * pow(spacing, -wish->power);
    return loss * pow(spacing, -0.5 * d) / force;
}

/* Makes the choice as good as it was meant to be: a wider band or wider windows, by what its plan
 * loses. */
static int settle(const struct gbg_ewald_wish *wish, struct gbg_ewald_choice *choice,
                  double *predicted)
{
    enum { TIMES = 12 };
    struct gbg_ewald_plan *plan = malloc(sizeof *plan);
    int status = plan ? GBG_OK : GBG_E_MEMORY;
    *predicted = INFINITY;
    for (int k = 0; k < TIMES && status == GBG_OK; k++) {
        status = gbg_ewald_plan_make(choice, plan);
        if (status != GBG_OK) {
            break;
        }
        *predicted = relative(wish, gbg_ewald_plan_loss(plan));
        if (*predicted <= aim * wish->tolerance) {
            break;
        }
        double split = relative(wish, gbg_split_loss(&plan->split));
        if (split > sqrt(0.5) * *predicted) { /* most of the error */
            double over = fmax(log(split / (split_share * wish->tolerance)), 0.1);
            choice->band += choice->split == GBG_SPLIT_PROLATE ? over : 2.0 * over;
            fit_cells(choice, least_finer);
        } else if (choice->width < GBG_EWALD_WIDEST) {
            choice->width++;
            fit_cells(choice, least_finer);
        } else {
            break;
        }
    }
    free(plan);
    return status;
}

int gbg_ewald_choose(const struct gbg_ewald_wish *wish, struct gbg_ewald_choice *choice,
                     double *predicted, double *cost)
{
    static const double finer[] = {1.15, 1.25, 1.4, 1.6, 2.0};
    struct gbg_ewald_choice tried;
    double longest = longest_reach(wish);
    *cost = INFINITY;
    if (!(wish->tolerance <= loosest) || !(wish->tolerance >= gbg_ewald_finest(wish)) ||
        (wish->reach > 0.0 && wish->reach > longest)) {
        return GBG_E_ARGUMENT;
    }
    begin(wish, &tried);
    for (double reach = wish->reach > 0.0 ? wish->reach : longest;; reach *= 0.95) {
        tried.reach = reach;
        for (size_t k = 0; k < sizeof finer / sizeof *finer; k++) {
            double price = lay_mesh(wish, finer[k], &tried) ? cost_of(wish, &tried) : INFINITY;
            if (price < *cost) {
                *cost = price;
                *choice = tried;
            }
        }
        if (wish->reach > 0.0 || within(wish, reach) < 4.0 || cells_of(&tried) > most_cells) {
            break;
        }
    }
    if (!(*cost < INFINITY)) {
        return GBG_E_ARGUMENT;
    }
    int status = settle(wish, choice, predicted);
    *cost = cost_of(wish, choice);
    return status;
}
