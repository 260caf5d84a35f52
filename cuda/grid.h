/* L1, CUDA: cells of a periodic box with the particles sorted into them: the same cells, and the
 * same order inside them, as those of backend/cpu/grid.h. */
#ifndef GBG_CUDA_GRID_H
#define GBG_CUDA_GRID_H

#include "backend/cpu/grid.h"
#include "cuda/cuda.h"
#include "cuda/rows.h"

/* As gbg_grid_build. Uses the device's workspace. */
int gbg_cuda_grid_build(struct gbg_device *device, struct gbg_cuda_grid *grid,
                        const struct gbg_box *box, double radius, int64_t n, uint32_t *const *high);
void gbg_cuda_grid_release(struct gbg_device *device, struct gbg_cuda_grid *grid);

/* The k-th of the distinct cells c-1, c, c+1 of a periodic axis. */
static __device__ __forceinline__ int gbg_cuda_beside(int c, int cells, int k)
{
    int at = c + k - 1;
    if (cells < 3) {
        return k;
    }
    return at < 0 ? cells - 1 : at == cells ? 0 : at;
}

/* Runs of slots in the cells of a row that are x or beside it. */
static __device__ __forceinline__ int gbg_cuda_runs(int x, int cells)
{
    return cells > 3 && (x == 0 || x == cells - 1) ? 2 : 1;
}

static __device__ __forceinline__ int2 gbg_cuda_run(const int32_t *first, int x, int cells, int k)
{
    if (cells <= 3) { /* all of them */
        return make_int2(first[0], first[cells]);
    }
    if (k > 0) { /* at the far end */
        return make_int2(first[x == 0 ? cells - 1 : cells - 2], first[cells]);
    }
    bool inside = x > 0 && x < cells - 1;
    return make_int2(first[inside ? x - 1 : 0], first[inside ? x + 2 : x == 0 ? 2 : 1]);
}

/* Calls visit(slot) for every particle in the cells around a cell, each once. */
template <typename Visit>
static __device__ __forceinline__ void gbg_cuda_visit(const struct gbg_cuda_grid &grid,
                                                      int32_t cell, Visit visit)
{
    int x = cell % grid.cells[0], y = cell / grid.cells[0] % grid.cells[1];
    int z = cell / grid.cells[0] / grid.cells[1];
    int n_rows = min(grid.cells[1], 3), n_layers = min(grid.cells[2], 3);
    int n_runs = gbg_cuda_runs(x, grid.cells[0]);
    for (int l = 0; l < n_layers; l++) {
        for (int r = 0; r < n_rows; r++) {
            int64_t row = (int64_t)gbg_cuda_beside(z, grid.cells[2], l) * grid.cells[1] +
                          gbg_cuda_beside(y, grid.cells[1], r);
            for (int k = 0; k < n_runs; k++) {
                int2 run = gbg_cuda_run(grid.first + row * grid.cells[0], x, grid.cells[0], k);
                for (int32_t slot = run.x; slot < run.y; slot++) {
                    visit(slot);
                }
            }
        }
    }
}

#endif
