/* Analysis room: the loops that are compiled once for each instruction set. */
#ifndef GBG_ANALYSIS_KERNELS_H
#define GBG_ANALYSIS_KERNELS_H

#include <stddef.h>
#include <stdint.h>

#include "analysis/window.h"

/* One axis of a mesh: `cells` nodes over `length`, a window of `width` nodes. */
struct gbg_mesh_axis {
    int32_t cells;
    int32_t width;
    double length;
};

/* Where a particle goes: the first node of its window in the buffer of its tile, and its place
 * between nodes on each axis, in [-1,1] up to rounding. */
struct gbg_spread_point {
    double z[3];
    int64_t offset;
};

/* A tile's buffer: row pitches in doubles. */
struct gbg_spread_buffer {
    double *value;
    ptrdiff_t pitch[3]; /* pitch[0] = 1 */
};

enum { GBG_PLACE_BLOCK = 256 };

typedef void gbg_spread_function(const struct gbg_window *window, int64_t n,
                                 const struct gbg_spread_point *points,
                                 const struct gbg_spread_buffer *buffer);

struct gbg_spread_kernels {
    const char *name;
    /* Finite coordinates, `step` elements apart, to the first node (in [0, cells)) and the place z,
     * which is good to 4 2^-53 of a spacing: the coordinate is reduced and scaled without rounding.
     * n is at most GBG_PLACE_BLOCK. */
    void (*place)(const struct gbg_mesh_axis *axis, int64_t n, const double *x, ptrdiff_t step,
                  int32_t *first, double *z);
    /* Adds the windows of n particles to the buffer, in their order; [dimension - 2][width]. Writes
     * rows of GBG_WINDOW_ROW values, of which those past the width gain nothing. */
    gbg_spread_function *spread[2][GBG_WINDOW_WIDEST + 1];
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
