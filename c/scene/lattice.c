/* L3: lattices that fit a periodic box. */
#include "scene/lattice.h"

#include <math.h>
#include <string.h>

#include "scene/scene.h"

/* Below this number every shift of the rows is tried, above it those next to half a cell. */
enum { MOST_TRIALS = 200000, MOST_ROWS = 1000000, SITES_OF_FCC = 4 };

/* Ratio of the lengths of a box made to fit a lattice. */
#define WIDEST 1.3

int gbg_lattice_of(const struct gbg_scene *scene)
{
    if (scene->start == GBG_START_LATTICE) {
        return scene->lattice;
    }
    return scene->dimension == 2 ? GBG_LATTICE_TRIANGULAR : GBG_LATTICE_FCC;
}

const char *gbg_lattice_name(int kind)
{
    static const char *const names[] = {"triangular", "square", "fcc", "cubic"};
    return names[kind];
}

/* Length of the shortest vector of the plane lattice (a, 0), (s, h): Gauss's reduction. */
static double shortest_vector(double a, double s, double h)
{
    double u[2] = {a, 0}, v[2] = {s, h};
    for (;;) {
        double uu = u[0] * u[0] + u[1] * u[1], vv = v[0] * v[0] + v[1] * v[1];
        if (vv < uu) {
            double swap[2] = {u[0], u[1]};
            u[0] = v[0], u[1] = v[1], v[0] = swap[0], v[1] = swap[1];
            double value = uu;
            uu = vv, vv = value;
        }
        double steps = nearbyint((u[0] * v[0] + u[1] * v[1]) / uu);
        if (steps == 0) {
            return sqrt(uu);
        }
        v[0] -= steps * u[0];
        v[1] -= steps * u[1];
        if (!(v[0] * v[0] + v[1] * v[1] < vv)) {
            return sqrt(uu);
        }
    }
}

static int64_t ceiling(int64_t n, int64_t divisor)
{
    return (n + divisor - 1) / divisor;
}

/* A number of cells: whole, from 1, and never beyond what an int64_t holds. */
static int64_t whole_cells(double value)
{
    return value > 1 ? (int64_t)fmin(value, 1e15) : 1;
}

static void take_rows(struct gbg_sites *best, int64_t n, int64_t rows, int64_t shift)
{
    int64_t columns = ceiling(n, rows);
    double a = best->length[0] / (double)columns, h = best->length[1] / (double)rows;
    double distance = shortest_vector(a, a * (double)shift / (double)rows, h);
    if (distance > best->distance) {
        best->cells[0] = columns;
        best->cells[1] = rows;
        best->shift = shift;
        best->distance = distance;
    }
}

/* Every lattice of n sites that is periodic in the box has the form of struct gbg_sites, with some
 * number of rows and some shift. Rows along a close-packed direction number `usual`; four times as
 * many reach the other orientations. */
static void fit_triangular(struct gbg_sites *best, int64_t n)
{
    double usual = sqrt((double)n * best->length[1] / best->length[0] * 2 / sqrt(3.0));
    int64_t first = whole_cells(0.6 * usual), last = whole_cells(4 * usual + 3);
    last = last < n ? last : n;
    first = first < last ? first : last;
    int all = (double)last * (double)last < 2.0 * MOST_TRIALS;
    for (int64_t rows = first; rows <= last; rows += 1 + (last - first) / MOST_ROWS) {
        int64_t half = rows / 2;
        for (int64_t shift = all ? 0 : half; shift <= (rows + 1) / 2; shift++) {
            take_rows(best, n, rows, shift);
        }
    }
}

static void fit_square(struct gbg_sites *best, int64_t n)
{
    double usual = sqrt((double)n * best->length[1] / best->length[0]);
    int64_t first = whole_cells(0.5 * usual), last = whole_cells(2 * usual + 3);
    last = last < n ? last : n;
    first = first < last ? first : last;
    for (int64_t rows = first; rows <= last; rows += 1 + (last - first) / MOST_ROWS) {
        double a = best->length[0] / (double)ceiling(n, rows);
        double distance = fmin(a, best->length[1] / (double)rows);
        if (distance > best->distance) {
            best->cells[0] = ceiling(n, rows);
            best->cells[1] = rows;
            best->distance = distance;
        }
    }
}

/* Smallest distance for cells of edges e: along an edge, and in fcc across half a face. */
static double distance_in_cells(int kind, const double *e)
{
    double least = fmin(e[0], fmin(e[1], e[2]));
    if (kind == GBG_LATTICE_FCC) {
        double face = fmin(hypot(e[0], e[1]), fmin(hypot(e[1], e[2]), hypot(e[2], e[0])));
        least = fmin(least, face / 2);
    }
    return least;
}

static int64_t sites_in_cell(int kind)
{
    return kind == GBG_LATTICE_FCC ? SITES_OF_FCC : 1;
}

static void take_cells(struct gbg_sites *best, const int64_t *cells)
{
    double edge[3];
    for (int a = 0; a < 3; a++) {
        edge[a] = best->length[a] / (double)cells[a];
    }
    double distance = distance_in_cells(best->kind, edge);
    if (distance > best->distance) {
        best->distance = distance;
        for (int a = 0; a < 3; a++) {
            best->cells[a] = cells[a];
        }
    }
}

/* Edge of cubic cells that would fill the box; axes shorter than that have one cell. */
static double cubic_edge(const double *length, double cells)
{
    int thin[3] = {0};
    double edge = 0;
    for (int pass = 0; pass < 3; pass++) {
        double volume = 1;
        int axes = 0;
        for (int a = 0; a < 3; a++) {
            volume *= thin[a] ? 1 : length[a];
            axes += !thin[a];
        }
        edge = pow(volume / cells, 1.0 / axes);
        for (int a = 0; a < 3; a++) {
            thin[a] |= length[a] < edge;
        }
    }
    return edge;
}

/* Numbers of cells near those of cubic cells; the third follows from the first two. */
static void fit_cells(struct gbg_sites *best, int64_t n)
{
    int64_t needed = ceiling(n, sites_in_cell(best->kind)), first[2], last[2], cells[3];
    double edge = cubic_edge(best->length, (double)needed);
    for (int a = 0; a < 2; a++) {
        double usual = best->length[a] / edge;
        last[a] = whole_cells(1.5 * usual + 2);
        last[a] = last[a] < needed ? last[a] : needed;
        first[a] = whole_cells(0.7 * usual);
        first[a] = first[a] < last[a] ? first[a] : last[a];
    }
    for (cells[0] = first[0]; cells[0] <= last[0]; cells[0]++) {
        for (cells[1] = first[1]; cells[1] <= last[1]; cells[1]++) {
            cells[2] = ceiling(needed, cells[0] * cells[1]);
            take_cells(best, cells);
        }
    }
}

void gbg_lattice_fit(int dimension, int kind, const double *length, int64_t n,
                     struct gbg_sites *sites)
{
    *sites = (struct gbg_sites){.kind = kind, .dimension = dimension, .cells = {1, 1, 1}};
    for (int a = 0; a < dimension; a++) {
        sites->length[a] = length[a];
    }
    if (kind == GBG_LATTICE_TRIANGULAR) {
        fit_triangular(sites, n);
    } else if (kind == GBG_LATTICE_SQUARE) {
        fit_square(sites, n);
    } else {
        fit_cells(sites, n);
    }
    sites->n = sites_in_cell(kind) * sites->cells[0] * sites->cells[1] * sites->cells[2];
}

/* What is wrong with a block of cells, the less the better: empty sites first, then the ratio of
 * its longest to its shortest length; blocks that are too long come last. */
static double cost_of(int dimension, const double *unit, const int64_t *cells, int64_t vacancies)
{
    double low = INFINITY, high = 0;
    for (int a = 0; a < dimension; a++) {
        low = fmin(low, (double)cells[a] * unit[a]);
        high = fmax(high, (double)cells[a] * unit[a]);
    }
    return (double)vacancies + high / low + (high > WIDEST * low ? 1e20 : 0);
}

/* The best block of at least n sites in cells of edges `unit` with `per` sites each. The number
 * along the last axis follows from the others. */
static void smallest_block(int dimension, const double *unit, int64_t per, int64_t n,
                           int64_t *cells)
{
    int64_t needed = ceiling(n, per), last[2] = {1, 1}, first[2] = {1, 1}, k[3] = {1, 1, 1};
    double volume = unit[0] * unit[1] * unit[2], least = INFINITY;
    double side = pow((double)needed * volume, 1.0 / dimension);
    for (int a = 0; a < dimension - 1; a++) {
        first[a] = whole_cells(side / unit[a] / WIDEST);
        last[a] = whole_cells(WIDEST * side / unit[a] + 1);
    }
    for (k[0] = first[0]; k[0] <= last[0]; k[0]++) {
        for (k[1] = first[1]; k[1] <= last[1]; k[1]++) {
            int64_t layer = dimension == 2 ? k[0] : k[0] * k[1];
            int64_t block[3] = {k[0], k[1], 1};
            block[dimension - 1] = ceiling(needed, layer);
            int64_t sites = per * layer * block[dimension - 1];
            double cost = cost_of(dimension, unit, block, sites - n);
            if (cost < least) {
                least = cost;
                memcpy(cells, block, sizeof block);
            }
        }
    }
}

void gbg_lattice_box(int dimension, int kind, int64_t n, double volume, double *length)
{
    double unit[3] = {1, 1, 1};
    int64_t cells[3] = {1, 1, 1}, per = sites_in_cell(kind);
    if (kind == GBG_LATTICE_TRIANGULAR) {
        unit[1] = sqrt(3.0);
        per = 2;
    }
    smallest_block(dimension, unit, per, n, cells);
    double block = 1;
    for (int a = 0; a < dimension; a++) {
        block *= (double)cells[a] * unit[a];
    }
    double scale = pow(volume / block, 1.0 / dimension);
    for (int a = 0; a < dimension; a++) {
        length[a] = (double)cells[a] * unit[a] * scale;
    }
}

void gbg_lattice_site(const struct gbg_sites *sites, int64_t s, double *position)
{
    static const double corner[SITES_OF_FCC][3] = {
        {0, 0, 0}, {0, .5, .5}, {.5, 0, .5}, {.5, .5, 0}};
    int64_t per = sites_in_cell(sites->kind), cell = s / per;
    double within[3] = {0};
    int64_t index[3] = {cell % sites->cells[0], cell / sites->cells[0] % sites->cells[1],
                        cell / sites->cells[0] / sites->cells[1]};
    if (sites->kind == GBG_LATTICE_TRIANGULAR) {
        double shifted = (double)index[1] * (double)sites->shift / (double)sites->cells[1];
        within[0] = shifted - floor(shifted);
    } else if (per > 1) {
        for (int a = 0; a < 3; a++) {
            within[a] = corner[s % per][a];
        }
    }
    /* a quarter of a cell off the corner, so that no site lies on the boundary of the box */
    for (int a = 0; a < sites->dimension; a++) {
        double cells = (double)sites->cells[a];
        position[a] = fmod((double)index[a] + within[a] + 0.25, cells) / cells * sites->length[a];
    }
}
