/* L1, CUDA: cells of a periodic box with the particles sorted into them. */
#include "cuda/grid.h"

#include <cub/device/device_radix_sort.cuh>

/* Cells of particles that are not in the order of cells, and their indices. */
static __global__ void find_cells(const struct gbg_cuda_grid grid, const uint32_t *x,
                                  const uint32_t *y, const uint32_t *z, int32_t *index)
{
    int64_t i = gbg_cuda_index();
    if (i < grid.n) {
        int32_t cell = z ? gbg_grid_cell(z[i], grid.cells[2]) * grid.cells[1] : 0;
        cell = (cell + gbg_grid_cell(y[i], grid.cells[1])) * grid.cells[0];
        grid.cell_of[i] = cell + gbg_grid_cell(x[i], grid.cells[0]);
        index[i] = (int32_t)i;
    }
}

/* Cells from..to begin at the slot: found by one thread, written by its whole warp where they are
 * many, as in front of and behind a cluster in an empty box. */
static __device__ void begin_cells(int32_t *first, int32_t from, int32_t to, int32_t slot)
{
    enum { FEW = 8 };
    int lane = (int)(threadIdx.x & 31);
    bool many = to - from >= FEW;
    for (int32_t cell = from; cell <= to && !many; cell++) {
        first[cell] = slot;
    }
    for (unsigned left = __ballot_sync(0xFFFFFFFFu, many); left; left &= left - 1) {
        int finder = __ffs((int)left) - 1;
        int32_t end = __shfl_sync(0xFFFFFFFFu, to, finder);
        int32_t begin = __shfl_sync(0xFFFFFFFFu, from, finder);
        int32_t found = __shfl_sync(0xFFFFFFFFu, slot, finder);
        for (int32_t cell = begin + lane; cell <= end; cell += 32) {
            first[cell] = found;
        }
    }
}

/* Where cells begin, from the sorted cells, and the coordinates in their order. One thread more
 * than particles: the last begins all cells behind the last particle. */
static __global__ void lay_out(const struct gbg_cuda_grid grid, const int32_t *cell,
                               const uint32_t *x, const uint32_t *y, const uint32_t *z)
{
    int64_t slot = gbg_cuda_index();
    int32_t from = 0, to = -1;
    if (slot <= grid.n) {
        from = slot > 0 ? cell[slot - 1] + 1 : 0;
        to = slot < grid.n ? cell[slot] : (int32_t)grid.n_cells;
    }
    begin_cells(grid.first, from, to, (int32_t)slot);
    if (slot < grid.n) {
        int32_t i = grid.particle[slot];
        grid.high[0][slot] = x[i];
        grid.high[1][slot] = y[i];
        if (z) {
            grid.high[2][slot] = z[i];
        }
    }
}

static int reserve(struct gbg_device *device, struct gbg_cuda_grid *grid)
{
    int64_t held = grid->particle_capacity, all = 0;
    int status = gbg_cuda_grow(device, (void **)&grid->first, &grid->cell_capacity,
                               grid->n_cells + 1, sizeof *grid->first, "cell starts");
    if (status != GBG_OK || grid->n <= held) {
        return status;
    }
    void **array[5] = {(void **)&grid->particle, (void **)&grid->cell_of, (void **)&grid->high[0],
                       (void **)&grid->high[1], (void **)&grid->high[2]};
    for (int k = 0; k < 2 + grid->dimension; k++) {
        gbg_cuda_release(device, *array[k], held, sizeof *grid->particle);
        *array[k] = NULL;
    }
    grid->particle_capacity = 0;
    for (int k = 0; status == GBG_OK && k < 2 + grid->dimension; k++) {
        all = 0;
        status = gbg_cuda_grow(device, array[k], &all, grid->n, sizeof *grid->particle,
                               "particles in cells");
    }
    grid->particle_capacity = status == GBG_OK ? grid->n : 0;
    return status;
}

static int key_bits(int64_t n_cells)
{
    int bits = 1;
    while (INT64_C(1) << bits < n_cells) {
        bits++;
    }
    return bits;
}

/* Work of a sort: the cells in their order, indices before it, what the sort asks for. */
struct sorting {
    int32_t *cell, *index;
    void *scratch;
    size_t scratch_bytes;
};

static cudaError_t sort_cells(struct gbg_device *device, const struct gbg_cuda_grid *grid,
                              struct sorting *sorting)
{
    return cub::DeviceRadixSort::SortPairs(
        sorting->scratch, sorting->scratch_bytes, (const uint32_t *)grid->cell_of,
        (uint32_t *)sorting->cell, (const int32_t *)sorting->index, grid->particle, grid->n, 0,
        key_bits(grid->n_cells), device->stream);
}

static int take_sorting(struct gbg_device *device, const struct gbg_cuda_grid *grid,
                        struct sorting *sorting)
{
    void *base = NULL;
    memset(sorting, 0, sizeof *sorting);
    int status =
        gbg_cuda_status(device, sort_cells(device, grid, sorting), "asking for a sort's memory");
    for (int pass = 0; status == GBG_OK && pass < 2; pass++) {
        size_t used = 0;
        sorting->cell = (int32_t *)gbg_cuda_take(base, &used, grid->n, 4);
        sorting->index = (int32_t *)gbg_cuda_take(base, &used, grid->n, 4);
        /* never NULL when it sorts, which would only ask for memory again */
        sorting->scratch = gbg_cuda_take(base, &used, (int64_t)sorting->scratch_bytes + 1, 1);
        status = pass ? status : gbg_cuda_workspace(device, used, &base);
    }
    return status;
}

int gbg_cuda_grid_build(struct gbg_device *device, struct gbg_cuda_grid *grid,
                        const struct gbg_box *box, double radius, int64_t n, uint32_t *const *high)
{
    const uint32_t *z = box->dimension == 3 ? high[2] : NULL;
    struct sorting sorting;
    grid->dimension = box->dimension;
    grid->n = n;
    grid->n_cells = gbg_grid_choose(box, radius, n, grid->cells);
    int status = reserve(device, grid);
    status = status ? status : take_sorting(device, grid, &sorting);
    if (status != GBG_OK) {
        return status;
    }
    if (n > 0) {
        find_cells<<<gbg_cuda_blocks(n), GBG_CUDA_THREADS, 0, device->stream>>>(
            *grid, high[0], high[1], z, sorting.index);
        status = gbg_cuda_started(device, "cells of particles");
        status = status ? status
                        : gbg_cuda_status(device, sort_cells(device, grid, &sorting),
                                          "sorting into cells");
    }
    if (status == GBG_OK) {
        lay_out<<<gbg_cuda_blocks(n + 1), GBG_CUDA_THREADS, 0, device->stream>>>(
            *grid, sorting.cell, high[0], high[1], z);
        status = gbg_cuda_started(device, "cells");
    }
    return status;
}

void gbg_cuda_grid_release(struct gbg_device *device, struct gbg_cuda_grid *grid)
{
    gbg_cuda_release(device, grid->first, grid->cell_capacity, sizeof *grid->first);
    gbg_cuda_release(device, grid->particle, grid->particle_capacity, sizeof *grid->particle);
    gbg_cuda_release(device, grid->cell_of, grid->particle_capacity, sizeof *grid->cell_of);
    for (int a = 0; a < 3; a++) {
        gbg_cuda_release(device, grid->high[a], grid->particle_capacity, sizeof *grid->high[a]);
    }
    memset(grid, 0, sizeof *grid);
}
