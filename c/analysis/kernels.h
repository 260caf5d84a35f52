/* Analysis room: the loops that are compiled once for each instruction set. */
#ifndef GBG_ANALYSIS_KERNELS_H
#define GBG_ANALYSIS_KERNELS_H

#include <stddef.h>
#include <stdint.h>

#include "analysis/window.h"
#include "core/view.h"

/* One axis of a mesh over `length`: `cells` nodes in tiles of 2^shift, the last of which takes the
 * rest; in a list of tiles and in a tile's buffer, neighbours on this axis are so far apart. */
struct gbg_mesh_axis {
    int32_t cells, width, shift, last_tile, tile_step, pitch;
    double length;
};

/* A particle in the buffer of its tile: where its window begins, and its place between nodes on
 * each axis, in [-1,1] up to rounding. */
struct gbg_spread_point {
    double z[3];
    int64_t offset;
};

enum { GBG_PLACE_BLOCK = 256 };

struct gbg_place_block {
    double z[3][GBG_PLACE_BLOCK];
    int32_t tile[GBG_PLACE_BLOCK], offset[GBG_PLACE_BLOCK];
};

/* A tile's buffer: row pitches in doubles. */
struct gbg_spread_buffer {
    double *value;
    ptrdiff_t pitch[3]; /* pitch[0] = 1 */
};

/* Nodes that the windows of a tile touch: `extent` many from `at` on, on rings of `cells` nodes; 1
 * node on an axis that is not there. */
struct gbg_tile_reach {
    int64_t at[3], extent[3], cells[3];
};

typedef void gbg_spread_function(const struct gbg_window *window, int64_t n,
                                 const struct gbg_spread_point *points,
                                 const struct gbg_spread_buffer *buffer);

struct gbg_spread_kernels {
    const char *name;
    /* n <= GBG_PLACE_BLOCK particles from `begin` on, with finite coordinates. z is good to 4 2^-53
     * of a spacing: coordinates are reduced and scaled without rounding. */
    void (*place)(const struct gbg_mesh_axis *axis, int dimension, const struct gbg_points *points,
                  int64_t begin, int64_t n, struct gbg_place_block *block);
    /* Adds the windows of n particles to the buffer, in their order; [dimension - 2][width], NULL
     * for widths that are not built. Writes whole rows of a window, of which the nodes before and
     * after it gain nothing. */
    gbg_spread_function *spread[2][GBG_WINDOW_WIDEST + 1];
    /* Adds a buffer to the mesh, whose rows are `pitch` doubles apart; value: the first node. */
    void (*add)(const struct gbg_tile_reach *reach, const struct gbg_spread_buffer *buffer,
                double *mesh, ptrdiff_t pitch);
};

enum { GBG_TENSOR_ROWS = 4, GBG_TENSOR_COLUMNS = 16 };

struct gbg_tensor_kernels {
    const char *name;
    /* For n coordinates |x| <= 2^30 length and k = 0..reach: phase[p*pitch + k] = cos(2 pi k
     * x/length) and phase[p*pitch + reach+1 + k] = sin(...), each good to 4 2^-53. */
    void (*phases)(double length, int32_t reach, int64_t n, const double *x, int64_t pitch,
                   double *phase);
    /* sum[r*pitch + c] += sum_p row[p*GBG_TENSOR_ROWS + r] column[p*pitch + c]: 4 rows, columns a
     * multiple of GBG_TENSOR_COLUMNS up to pitch. The sum over p is made before it is added. */
    void (*multiply)(int64_t n, const double *row, const double *column, int64_t pitch,
                     double *sum);
};

/* The best set for the instructions named in a context ("avx512", "avx2", other: generic). */
const struct gbg_spread_kernels *gbg_spread_kernels_of(const char *instructions);
const struct gbg_tensor_kernels *gbg_tensor_kernels_of(const char *instructions);

#define GBG_JOIN_EXPANDED(a, b) a##_##b
#define GBG_JOIN(a, b) GBG_JOIN_EXPANDED(a, b)
#define GBG_ISA_NAME(name) GBG_JOIN(name, GBG_ISA)

#endif
