/* Analysis room: puts particles on the mesh. Compiled once for each instruction set. */
#include <math.h>
#include <string.h>

#include "analysis/kernels.h"
#include "analysis/vector.h"

/* Copies of coordinates; those further out than 2^30 boxes are brought in by the exact remainder.
 */
static void gather(int64_t n, const double *x, ptrdiff_t step, double length, double *restrict copy)
{
    const double limit = 0x1p30 * length;
    int far = 0;
    if (step == 1) {
        memcpy(copy, x, (size_t)n * sizeof *x);
    } else {
        for (int64_t i = 0; i < n; i++) {
            copy[i] = x[i * step];
        }
    }
    for (int64_t i = 0; i < n; i++) {
        far |= fabs(copy[i]) > limit;
    }
    for (int64_t i = 0; i < n && far; i++) {
        copy[i] = remainder(copy[i], length);
    }
}

/* Nodes that the window covers: for the place u = x cells/length, even widths start at
 * floor(u) - width/2 + 1, odd ones at floor(u + 1/2) - (width-1)/2. */
static void place_on_axis(const struct gbg_mesh_axis *axis, int64_t n, const double *restrict x,
                          int32_t *restrict first, double *restrict z)
{
    const double length = axis->length, cells = axis->cells, inverse = 1 / length;
    const double half = axis->width % 2 ? 0.5 : 0.0;
    const double before = axis->width % 2 ? (axis->width - 1) / 2 : axis->width / 2 - 1;
    const double density = cells * inverse, turns = 1 / cells;
    for (int64_t i = 0; i < n; i++) {
        double r = __builtin_fma(-rint(x[i] * inverse), length, x[i]);
        double cell = floor(__builtin_fma(r, density, half));
        double centre = cell - half + 0.5;
        double high = r * cells, low = __builtin_fma(r, cells, -high);
        double taken = centre * length, rest = __builtin_fma(centre, length, -taken);
        z[i] = 2 * inverse * ((high - taken) + (low - rest));
        double start = cell - before;
        start = start - cells * floor(start * turns);
        start = start >= cells ? start - cells : start;
        start = start < 0 ? start + cells : start;
        first[i] = (int32_t)start;
    }
}

static void place(const struct gbg_mesh_axis *axis, int dimension, const struct gbg_points *points,
                  int64_t begin, int64_t n, struct gbg_place_block *block)
{
    double x[GBG_PLACE_BLOCK];
    int32_t first[GBG_PLACE_BLOCK], *restrict tile = block->tile, *restrict offset = block->offset;
    memset(tile, 0, (size_t)n * sizeof *tile);
    memset(offset, 0, (size_t)n * sizeof *offset);
    for (int a = 0; a < dimension; a++) {
        const int32_t shift = axis[a].shift, last = axis[a].last_tile, step = axis[a].tile_step;
        const int32_t pitch = axis[a].pitch;
        gather(n, points->base[a] + begin * points->step, points->step, axis[a].length, x);
        place_on_axis(&axis[a], n, x, first, block->z[a]);
        for (int64_t i = 0; i < n; i++) {
            int32_t own = first[i] >> shift;
            own = own < last ? own : last;
            tile[i] += own * step;
            offset[i] += (first[i] - (own << shift)) * pitch;
        }
    }
}

#define VECTORS(width) (GBG_WINDOW_LANES(width) / VD_LANES)
#define LEAD(width) GBG_WINDOW_LEAD(width)
enum { ROOM = GBG_WINDOW_ROW / VD_LANES, MOST_ROWS = 4 };
#define INLINE static inline __attribute__((always_inline))

/* The window's values for `rows` places between nodes, for widths up to 8. Several at a time share
 * the loads of the coefficients. */
INLINE void narrow_rows(const struct gbg_window *window, const int width, const int rows,
                        const double *at, vd value[][ROOM])
{
    const int degree = GBG_WINDOW_DEGREE(width);
    for (int v = 0; v < VECTORS(width); v++) {
        vd sum[MOST_ROWS], top = vd_load(window->coefficient[degree] + v * VD_LANES);
#pragma GCC unroll 4
        for (int r = 0; r < rows; r++) {
            sum[r] = top;
        }
#pragma GCC unroll 16
        for (int k = degree - 1; k >= 0; k--) {
            vd next = vd_load(window->coefficient[k] + v * VD_LANES);
#pragma GCC unroll 4
            for (int r = 0; r < rows; r++) {
                sum[r] = vd_fma(sum[r], vd_set(at[r]), next);
            }
        }
#pragma GCC unroll 4
        for (int r = 0; r < rows; r++) {
            value[r][v] = sum[r];
        }
    }
}

/* The same for wider windows, of even width: mirror images have the same even powers of z and the
 * opposite odd ones, so that half of the nodes are enough. The degree is odd. */
INLINE void wide_rows(const struct gbg_window *window, const int width, const int rows,
                      const double *at, vd value[][ROOM])
{
    const int degree = GBG_WINDOW_DEGREE(width), half = VECTORS(width) / 2;
    for (int v = 0; v < half; v++) {
        vd odd[MOST_ROWS], even[MOST_ROWS];
        vd top = vd_load(window->coefficient[degree] + v * VD_LANES);
        vd below = vd_load(window->coefficient[degree - 1] + v * VD_LANES);
#pragma GCC unroll 4
        for (int r = 0; r < rows; r++) {
            odd[r] = top;
            even[r] = below;
        }
#pragma GCC unroll 16
        for (int k = degree - 2; k > 0; k -= 2) {
            top = vd_load(window->coefficient[k] + v * VD_LANES);
            below = vd_load(window->coefficient[k - 1] + v * VD_LANES);
#pragma GCC unroll 4
            for (int r = 0; r < rows; r++) {
                vd square = vd_set(at[r] * at[r]);
                odd[r] = vd_fma(odd[r], square, top);
                even[r] = vd_fma(even[r], square, below);
            }
        }
#pragma GCC unroll 4
        for (int r = 0; r < rows; r++) {
            vd z = vd_set(at[r]);
            value[r][v] = vd_fma(odd[r], z, even[r]);
            value[r][2 * half - 1 - v] = vd_reverse(vd_fnma(odd[r], z, even[r]));
        }
    }
}

INLINE void window_rows(const struct gbg_window *window, const int width, const int rows,
                        const double *at, vd value[][ROOM])
{
    if (width <= 8) {
        narrow_rows(window, width, rows, at, value);
    } else {
        wide_rows(window, width, rows, at, value);
    }
}

INLINE void add_row(double *to, const int width, vd factor, const vd *value)
{
    for (int v = 0; v < VECTORS(width); v++) {
        double *at = to + v * VD_LANES;
        vd_store(at, vd_fma(factor, value[v], vd_load(at)));
    }
}

INLINE void store_row(const vd *value, const int width, double *to)
{
    for (int v = 0; v < VECTORS(width); v++) {
        vd_store(to + v * VD_LANES, value[v]);
    }
}

/* Rows of x times values of y. */
INLINE void add_plane(const int width, double *to, ptrdiff_t pitch, const vd *x, const vd *y)
{
    double factor[GBG_WINDOW_ROW];
    store_row(y, width, factor);
#pragma GCC unroll 16
    for (int j = 0; j < width; j++) {
        add_row(to + j * pitch, width, vd_set(factor[LEAD(width) + j]), x);
    }
}

INLINE void spread_2d(const int width, const struct gbg_window *window, int64_t n,
                      const struct gbg_spread_point *points, const struct gbg_spread_buffer *buffer)
{
    const ptrdiff_t pitch = buffer->pitch[1];
    vd value[MOST_ROWS][ROOM];
    int64_t i = 0;
    for (; i + 1 < n; i += 2) {
        const struct gbg_spread_point *p = points + i;
        const double at[4] = {p[0].z[0], p[0].z[1], p[1].z[0], p[1].z[1]};
        window_rows(window, width, 4, at, value);
        add_plane(width, buffer->value + p[0].offset, pitch, value[0], value[1]);
        add_plane(width, buffer->value + p[1].offset, pitch, value[2], value[3]);
    }
    if (i < n) {
        window_rows(window, width, 2, points[i].z, value);
        add_plane(width, buffer->value + points[i].offset, pitch, value[0], value[1]);
    }
}

INLINE void spread_3d(const int width, const struct gbg_window *window, int64_t n,
                      const struct gbg_spread_point *points, const struct gbg_spread_buffer *buffer)
{
    for (int64_t i = 0; i < n; i++) {
        vd value[3][ROOM];
        double factor_y[GBG_WINDOW_ROW], factor_z[GBG_WINDOW_ROW];
        window_rows(window, width, 3, points[i].z, value);
        store_row(value[1], width, factor_y);
        store_row(value[2], width, factor_z);
        double *plane = buffer->value + points[i].offset;
        for (int k = 0; k < width; k++, plane += buffer->pitch[2]) {
            double *to = plane;
            for (int j = 0; j < width; j++, to += buffer->pitch[1]) {
                double factor = factor_z[LEAD(width) + k] * factor_y[LEAD(width) + j];
                add_row(to, width, vd_set(factor), value[0]);
            }
        }
    }
}

/* Adds a row of n values to a ring of `cells` nodes, from node `at` on. */
INLINE void add_ring(double *restrict row, int64_t cells, int64_t at, const double *restrict value,
                     int64_t n)
{
    while (n > 0) {
        int64_t run = n < cells - at ? n : cells - at, i = 0;
        double *to = row + at;
        for (; i + VD_LANES <= run; i += VD_LANES) {
            vd_store(to + i, vd_add(vd_load(to + i), vd_load(value + i)));
        }
        for (; i < run; i++) {
            to[i] += value[i];
        }
        value += run;
        n -= run;
        at = 0;
    }
}

static void add(const struct gbg_tile_reach *reach, const struct gbg_spread_buffer *buffer,
                double *mesh, ptrdiff_t pitch)
{
    int64_t z = reach->at[2];
    for (int64_t k = 0; k < reach->extent[2]; k++) {
        int64_t y = reach->at[1];
        for (int64_t j = 0; j < reach->extent[1]; j++) {
            add_ring(mesh + (z * reach->cells[1] + y) * pitch, reach->cells[0], reach->at[0],
                     buffer->value + k * buffer->pitch[2] + j * buffer->pitch[1], reach->extent[0]);
            y = y + 1 < reach->cells[1] ? y + 1 : 0;
        }
        z = z + 1 < reach->cells[2] ? z + 1 : 0;
    }
}

#define WIDTHS(X) X(2) X(3) X(4) X(5) X(6) X(7) X(8) X(10) X(12) X(14) X(16)
#define INSTANCE(w)                                                                                \
    static void spread_2d_##w(const struct gbg_window *window, int64_t n,                          \
                              const struct gbg_spread_point *points,                               \
                              const struct gbg_spread_buffer *buffer)                              \
    {                                                                                              \
        spread_2d(w, window, n, points, buffer);                                                   \
    }                                                                                              \
    static void spread_3d_##w(const struct gbg_window *window, int64_t n,                          \
                              const struct gbg_spread_point *points,                               \
                              const struct gbg_spread_buffer *buffer)                              \
    {                                                                                              \
        spread_3d(w, window, n, points, buffer);                                                   \
    }
WIDTHS(INSTANCE)

#define ENTRY_2D(w) [w] = spread_2d_##w,
#define ENTRY_3D(w) [w] = spread_3d_##w,
#define TEXT_OF(name) #name
#define TEXT(name) TEXT_OF(name)

const struct gbg_spread_kernels GBG_ISA_NAME(gbg_spread_kernels) = {
    .name = TEXT(GBG_ISA),
    .place = place,
    .add = add,
    .spread = {{WIDTHS(ENTRY_2D)}, {WIDTHS(ENTRY_3D)}},
};
