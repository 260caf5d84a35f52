/* Command: all pairs of a frame that are closer than a given distance, over cells or by brute
 * force. */
#include "command/verify_pairs.h"

#include <math.h>
#include <stdlib.h>

struct cells {
    int dimension;
    const double *length;
    int64_t n;
    double *const *r;
    double reach;
    gbg_pair_visitor visit;
    void *user;
    int64_t size[3]; /* cells an axis */
    int64_t total;
    int64_t *cell;  /* of each particle */
    int64_t *start; /* first place of each cell in `member`, total + 1 entries */
    int64_t *member;
};

double gbg_nearest_image(double difference, double length)
{
    return difference - length * rint(difference / length);
}

static void look_at(const struct cells *cells, int64_t i, int64_t j)
{
    double d[3] = {0, 0, 0}, square = 0;
    for (int a = 0; a < cells->dimension; a++) {
        d[a] = gbg_nearest_image(cells->r[a][j] - cells->r[a][i], cells->length[a]);
        square += d[a] * d[a];
    }
    double distance = sqrt(square);
    if (distance <= cells->reach) {
        cells->visit(cells->user, i, j, d, distance);
    }
}

static void visit_all(const struct cells *cells)
{
    for (int64_t i = 0; i < cells->n; i++) {
        for (int64_t j = i + 1; j < cells->n; j++) {
            look_at(cells, i, j);
        }
    }
}

/* Cells no smaller than the reach, and no more than about four a particle. */
static void choose_size(struct cells *cells)
{
    for (int a = 0; a < 3; a++) {
        double most = a < cells->dimension ? cells->length[a] / (cells->reach * 1.000001) : 1;
        cells->size[a] = most < 1 ? 1 : most > 1e6 ? 1000000 : (int64_t)most;
    }
    double limit = 4.0 * (double)cells->n + 64;
    while ((double)cells->size[0] * (double)cells->size[1] * (double)cells->size[2] > limit) {
        int largest = 0;
        for (int a = 1; a < 3; a++) {
            largest = cells->size[a] > cells->size[largest] ? a : largest;
        }
        cells->size[largest] = (cells->size[largest] + 1) / 2;
    }
    cells->total = cells->size[0] * cells->size[1] * cells->size[2];
}

static int64_t cell_of(const struct cells *cells, int64_t i)
{
    int64_t index = 0;
    for (int a = cells->dimension - 1; a >= 0; a--) {
        double fraction = cells->r[a][i] / cells->length[a];
        fraction -= floor(fraction);
        int64_t c = (int64_t)(fraction * (double)cells->size[a]);
        c = c >= cells->size[a] ? cells->size[a] - 1 : c;
        index = index * cells->size[a] + c;
    }
    return index;
}

/* Counting sort of the particles by cell. */
static int fill(struct cells *cells)
{
    cells->cell = malloc((size_t)(cells->n + 1) * sizeof *cells->cell);
    cells->start = calloc((size_t)cells->total + 2, sizeof *cells->start);
    cells->member = malloc((size_t)(cells->n + 1) * sizeof *cells->member);
    if (!cells->cell || !cells->start || !cells->member) {
        return -1;
    }
    for (int64_t i = 0; i < cells->n; i++) {
        cells->cell[i] = cell_of(cells, i);
        cells->start[cells->cell[i] + 2]++;
    }
    for (int64_t c = 0; c < cells->total; c++) {
        cells->start[c + 2] += cells->start[c + 1];
    }
    for (int64_t i = 0; i < cells->n; i++) {
        cells->member[cells->start[cells->cell[i] + 1]++] = i;
    }
    return 0;
}

static void visit_two_cells(const struct cells *cells, int64_t from, int64_t to)
{
    for (int64_t p = cells->start[from]; p < cells->start[from + 1]; p++) {
        for (int64_t q = cells->start[to]; q < cells->start[to + 1]; q++) {
            if (cells->member[p] < cells->member[q]) {
                look_at(cells, cells->member[p], cells->member[q]);
            }
        }
    }
}

/* Steps to the distinct neighbours on an axis of `size` cells: -1, 0, 1, fewer in a small box. */
static void neighbour_steps(int64_t size, int *low, int *high)
{
    *low = size >= 3 ? -1 : 0;
    *high = size >= 2 ? 1 : 0;
}

static void visit_cells(const struct cells *cells)
{
    const int64_t *size = cells->size;
    int low[3], high[3];
    for (int a = 0; a < 3; a++) {
        neighbour_steps(size[a], &low[a], &high[a]);
    }
    for (int64_t c = 0; c < cells->total; c++) {
        int64_t x = c % size[0], y = c / size[0] % size[1], z = c / (size[0] * size[1]);
        for (int dz = low[2]; dz <= high[2]; dz++) {
            for (int dy = low[1]; dy <= high[1]; dy++) {
                for (int dx = low[0]; dx <= high[0]; dx++) {
                    int64_t nx = (x + dx + size[0]) % size[0], ny = (y + dy + size[1]) % size[1];
                    int64_t nz = (z + dz + size[2]) % size[2];
                    visit_two_cells(cells, c, nx + size[0] * (ny + size[1] * nz));
                }
            }
        }
    }
}

int gbg_visit_pairs(int dimension, const double *length, int64_t n, double *const *r, double reach,
                    gbg_pair_visitor visit, void *user)
{
    enum { FEW = 64 };
    struct cells cells = {.dimension = dimension,
                          .length = length,
                          .n = n,
                          .r = r,
                          .reach = reach,
                          .visit = visit,
                          .user = user};
    choose_size(&cells);
    if (n <= FEW || cells.total == 1) {
        visit_all(&cells);
        return 0;
    }
    int status = fill(&cells);
    if (status == 0) {
        visit_cells(&cells);
    }
    free(cells.cell);
    free(cells.start);
    free(cells.member);
    return status;
}
