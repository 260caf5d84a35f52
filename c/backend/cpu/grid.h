/* L1, CPU: cells of a periodic box with the particles sorted into them. */
#ifndef GBG_BACKEND_CPU_GRID_H
#define GBG_BACKEND_CPU_GRID_H

#include <stdint.h>

#include "core/box.h"

struct gbg_context;

/* Cells of edge >= the radius asked for; x varies fastest. Inside a cell particles stand in
 * ascending order. A cell's interval is half open and found by integer arithmetic alone. */
struct gbg_grid {
    int dimension;
    int cells[3];
    int64_t n, n_cells, cell_capacity, particle_capacity;
    int32_t *first;    /* n_cells + 1: where a cell begins */
    int32_t *particle; /* n: indices, sorted by cell */
    uint32_t *high[3]; /* n: high words of the coordinates in the same order */
    int32_t *cell_of;  /* n: cell of each particle, in the original order */
};

/* A run of sorted slots. */
struct gbg_run {
    int32_t begin, end;
};
enum { GBG_RUNS_MAX = 18 };

/* Sorts n particles into cells of edge >= radius, by the high words of their coordinates; may be
 * called again on the same grid. */
int gbg_grid_build(struct gbg_context *context, struct gbg_grid *grid, const struct gbg_box *box,
                   double radius, int64_t n, uint32_t *const *high);
void gbg_grid_release(struct gbg_grid *grid);

/* Runs of slots that hold every particle within the radius of somebody in this cell, each slot
 * once; returns their number. */
int gbg_grid_runs(const struct gbg_grid *grid, int32_t cell, struct gbg_run runs[GBG_RUNS_MAX]);

/* Cells an axis: as many as the radius allows, but not many more cells than particles in all,
 * and no more than an index can name. Returns their number. */
GBG_INLINE int64_t gbg_grid_choose(const struct gbg_box *box, double radius, int64_t n,
                                   int cells[3])
{
    double most = n < INT32_MAX / 2 - 64 ? 2.0 * (double)n + 64.0 : INT32_MAX - 1, product = 1.0;
    double wanted[3] = {1.0, 1.0, 1.0};
    for (int a = 0; a < box->dimension; a++) {
        /* a high word is 2^-32 of the box wide, so edges can be short by that much */
        double edge = radius * (1.0 + 1e-9) + box->length[a] * 0x1p-31;
        wanted[a] = floor(box->length[a] / edge);
        wanted[a] = wanted[a] < 1.0 ? 1.0 : wanted[a];
        product *= wanted[a];
    }
    while (product > most) {
        int longest = 0;
        for (int a = 1; a < box->dimension; a++) {
            longest = wanted[a] > wanted[longest] ? a : longest;
        }
        product /= wanted[longest];
        wanted[longest] = ceil(wanted[longest] / 2.0);
        product *= wanted[longest];
    }
    for (int a = 0; a < 3; a++) {
        cells[a] = (int)wanted[a];
    }
    return (int64_t)cells[0] * cells[1] * cells[2];
}

/* floor(fraction * cells): exact, so cells never disagree about a particle on a face. */
GBG_INLINE int32_t gbg_grid_cell(uint32_t high, int cells)
{
    return (int32_t)((uint64_t)high * (uint64_t)cells >> 32);
}

GBG_INLINE uint64_t gbg_join(uint32_t high, uint32_t low)
{
    return (uint64_t)high << 32 | low;
}

#endif
