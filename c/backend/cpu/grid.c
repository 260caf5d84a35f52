/* L1, CPU: cells of a periodic box with the particles sorted into them. */
#include "backend/cpu/grid.h"

#include <string.h>

#include "core/context.h"
#include "core/memory.h"

static int reserve(struct gbg_context *context, struct gbg_grid *grid)
{
    int status = GBG_OK;
    if (grid->n_cells + 1 > grid->cell_capacity) {
        gbg_release(grid->first);
        grid->cell_capacity = 0;
        status = gbg_allocate(context, (void **)&grid->first, grid->n_cells + 1,
                              sizeof *grid->first, "cell starts");
        grid->cell_capacity = status == GBG_OK ? grid->n_cells + 1 : 0;
    }
    if (status == GBG_OK && grid->n > grid->particle_capacity) {
        gbg_release(grid->particle);
        gbg_release(grid->cell_of);
        grid->particle_capacity = 0;
        grid->cell_of = NULL;
        status = gbg_allocate(context, (void **)&grid->particle, grid->n, sizeof *grid->particle,
                              "cell members");
        if (status == GBG_OK) {
            status = gbg_allocate(context, (void **)&grid->cell_of, grid->n, sizeof *grid->cell_of,
                                  "cells of particles");
        }
        for (int a = 0; status == GBG_OK && a < grid->dimension; a++) {
            gbg_release(grid->high[a]);
            status = gbg_allocate(context, (void **)&grid->high[a], grid->n, sizeof *grid->high[a],
                                  "sorted positions");
        }
        grid->particle_capacity = status == GBG_OK ? grid->n : 0;
    }
    return status;
}

/* Cells are shared out to workers in equal ranges. Everybody reads all cells of particles and works
 * on those of his range: the order inside a cell is that of the indices whatever the threads. */
enum { WORKERS_MAX = 64, GRAIN = 8192 };

struct sorting {
    struct gbg_grid *grid;
    uint32_t *const *high;
    int workers;
    int64_t before[WORKERS_MAX + 1]; /* particles in the ranges before a worker's */
};

static int64_t range_begin(const struct sorting *sorting, int worker)
{
    return sorting->grid->n_cells * worker / sorting->workers;
}

static void find_cells(const struct sorting *sorting, int worker)
{
    struct gbg_grid *grid = sorting->grid;
    const uint32_t *x = sorting->high[0], *y = sorting->high[1];
    const uint32_t *z = grid->dimension == 3 ? sorting->high[2] : NULL;
    int64_t end = grid->n * (worker + 1) / sorting->workers;
    for (int64_t i = grid->n * worker / sorting->workers; i < end; i++) {
        int32_t cell = z ? gbg_grid_cell(z[i], grid->cells[2]) * grid->cells[1] : 0;
        cell = (cell + gbg_grid_cell(y[i], grid->cells[1])) * grid->cells[0];
        grid->cell_of[i] = cell + gbg_grid_cell(x[i], grid->cells[0]);
    }
}

/* Particles of each cell of the worker's range into first[cell + 1]; returns their sum. */
static int64_t count_range(const struct sorting *sorting, int worker)
{
    struct gbg_grid *grid = sorting->grid;
    int64_t begin = range_begin(sorting, worker), end = range_begin(sorting, worker + 1), sum = 0;
    memset(grid->first + begin + 1, 0, (size_t)(end - begin) * sizeof *grid->first);
    for (int64_t i = 0; i < grid->n; i++) {
        int64_t cell = grid->cell_of[i];
        if (cell >= begin && cell < end) {
            grid->first[cell + 1]++;
            sum++;
        }
    }
    return sum;
}

/* Turns the counts into starts, and each start, as its cell fills, into the start of the next. */
static void fill_range(const struct sorting *sorting, int worker)
{
    struct gbg_grid *grid = sorting->grid;
    int64_t begin = range_begin(sorting, worker), end = range_begin(sorting, worker + 1);
    int32_t start = (int32_t)sorting->before[worker];
    for (int64_t cell = begin; cell < end; cell++) {
        int32_t count = grid->first[cell + 1];
        grid->first[cell + 1] = start;
        start += count;
    }
    for (int64_t i = 0; i < grid->n; i++) {
        int64_t cell = grid->cell_of[i];
        if (cell < begin || cell >= end) {
            continue;
        }
        int32_t slot = grid->first[cell + 1]++;
        grid->particle[slot] = (int32_t)i;
        for (int a = 0; a < grid->dimension; a++) {
            grid->high[a][slot] = sorting->high[a][i];
        }
    }
}

int gbg_grid_build(struct gbg_context *context, struct gbg_grid *grid, const struct gbg_box *box,
                   double radius, int64_t n, uint32_t *const *high)
{
    grid->dimension = box->dimension;
    grid->n = n;
    grid->n_cells = gbg_grid_choose(box, radius, n, grid->cells);
    int status = reserve(context, grid);
    if (status != GBG_OK) {
        return status;
    }
    int64_t most = n / GRAIN + 1;
    most = most < WORKERS_MAX ? most : WORKERS_MAX;
    struct sorting sorting = {.grid = grid, .high = high};
    sorting.workers = context->threads < most ? context->threads : (int)most;
    grid->first[0] = 0;
#pragma omp parallel num_threads(sorting.workers)
    {
#pragma omp for schedule(static, 1)
        for (int w = 0; w < sorting.workers; w++) {
            find_cells(&sorting, w);
        }
#pragma omp for schedule(static, 1)
        for (int w = 0; w < sorting.workers; w++) {
            sorting.before[w + 1] = count_range(&sorting, w);
        }
#pragma omp single
        for (int w = 0; w < sorting.workers; w++) {
            sorting.before[w + 1] += sorting.before[w];
        }
#pragma omp for schedule(static, 1)
        for (int w = 0; w < sorting.workers; w++) {
            fill_range(&sorting, w);
        }
    }
    return GBG_OK;
}

void gbg_grid_release(struct gbg_grid *grid)
{
    gbg_release(grid->first);
    gbg_release(grid->particle);
    gbg_release(grid->cell_of);
    for (int a = 0; a < 3; a++) {
        gbg_release(grid->high[a]);
    }
    memset(grid, 0, sizeof *grid);
}

/* The distinct cells c-1, c, c+1 of a periodic axis. */
static int around(int c, int cells, int out[3])
{
    if (cells < 3) {
        for (int k = 0; k < cells; k++) {
            out[k] = k;
        }
        return cells;
    }
    out[0] = c == 0 ? cells - 1 : c - 1;
    out[1] = c;
    out[2] = c == cells - 1 ? 0 : c + 1;
    return 3;
}

static int add_row(const struct gbg_grid *grid, int64_t row, int x, struct gbg_run *runs)
{
    int columns[3], count = around(x, grid->cells[0], columns), made = 0;
    const int32_t *first = grid->first + row * grid->cells[0];
    if (count == 3 && x > 0 && x < grid->cells[0] - 1) { /* three neighbours in one run */
        runs[0] = (struct gbg_run){first[x - 1], first[x + 2]};
        return 1;
    }
    for (int k = 0; k < count; k++) {
        struct gbg_run run = {first[columns[k]], first[columns[k] + 1]};
        if (made > 0 && runs[made - 1].end == run.begin) {
            runs[made - 1].end = run.end;
        } else {
            runs[made++] = run;
        }
    }
    return made;
}

int gbg_grid_runs(const struct gbg_grid *grid, int32_t cell, struct gbg_run runs[GBG_RUNS_MAX])
{
    int x = cell % grid->cells[0], y = cell / grid->cells[0] % grid->cells[1];
    int z = cell / grid->cells[0] / grid->cells[1];
    int rows[3], layers[3], made = 0;
    int n_rows = around(y, grid->cells[1], rows), n_layers = around(z, grid->cells[2], layers);
    for (int l = 0; l < n_layers; l++) {
        for (int r = 0; r < n_rows; r++) {
            made += add_row(grid, (int64_t)layers[l] * grid->cells[1] + rows[r], x, runs + made);
        }
    }
    return made;
}
