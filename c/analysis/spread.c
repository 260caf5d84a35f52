/* Analysis room: puts particles on the mesh. Compiled once for each instruction set. */
#include <math.h>
#include <string.h>

#include "analysis/kernels.h"
#include "analysis/vector.h"

/* Copies of coordinates; those further out than 2^30 boxes are brought in by the exact remainder. */
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
static void place(const struct gbg_mesh_axis *axis, int64_t n, const double *from, ptrdiff_t step,
                  int32_t *restrict first, double *restrict z)
{
    double x[GBG_PLACE_BLOCK];
    gather(n, from, step, axis->length, x);
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

#define VECTORS(width) (((width) + VD_LANES - 1) / VD_LANES)
enum { ROOM = GBG_WINDOW_ROW / VD_LANES };
#define INLINE static inline __attribute__((always_inline))

/* The window's values at the nodes of one axis, VECTORS(width) vectors. */
INLINE void window_row(const struct gbg_window *window, const int width, double at, vd *value)
{
    const vd z = vd_set(at);
    const int degree = GBG_WINDOW_DEGREE(width);
#pragma GCC unroll 8
    for (int v = 0; v < VECTORS(width); v++) {
        value[v] = vd_load(window->coefficient[degree] + v * VD_LANES);
    }
#pragma GCC unroll 32
    for (int k = degree - 1; k >= 0; k--) {
#pragma GCC unroll 8
        for (int v = 0; v < VECTORS(width); v++) {
            value[v] = vd_fma(value[v], z, vd_load(window->coefficient[k] + v * VD_LANES));
        }
    }
}

INLINE void add_row(double *to, const int width, vd factor, const vd *value)
{
#pragma GCC unroll 8
    for (int v = 0; v < VECTORS(width); v++) {
        double *at = to + v * VD_LANES;
        vd_store(at, vd_fma(factor, value[v], vd_load(at)));
    }
}

INLINE void store_row(const vd *value, const int width, double *to)
{
#pragma GCC unroll 8
    for (int v = 0; v < VECTORS(width); v++) {
        vd_store(to + v * VD_LANES, value[v]);
    }
}

INLINE void spread_2d(const int width, const struct gbg_window *window, int64_t n,
                      const struct gbg_spread_point *points, const struct gbg_spread_buffer *buffer)
{
    const ptrdiff_t pitch = buffer->pitch[1];
    for (int64_t i = 0; i < n; i++) {
        vd x[ROOM], y[ROOM];
        double factor[GBG_WINDOW_ROW];
        window_row(window, width, points[i].z[0], x);
        window_row(window, width, points[i].z[1], y);
        store_row(y, width, factor);
        double *to = buffer->value + points[i].offset;
#pragma GCC unroll 16
        for (int j = 0; j < width; j++) {
            add_row(to + j * pitch, width, vd_set(factor[j]), x);
        }
    }
}

INLINE void spread_3d(const int width, const struct gbg_window *window, int64_t n,
                      const struct gbg_spread_point *points, const struct gbg_spread_buffer *buffer)
{
    for (int64_t i = 0; i < n; i++) {
        vd x[ROOM], y[ROOM], z[ROOM];
        double factor_y[GBG_WINDOW_ROW], factor_z[GBG_WINDOW_ROW];
        window_row(window, width, points[i].z[0], x);
        window_row(window, width, points[i].z[1], y);
        window_row(window, width, points[i].z[2], z);
        store_row(y, width, factor_y);
        store_row(z, width, factor_z);
        double *plane = buffer->value + points[i].offset;
        for (int k = 0; k < width; k++, plane += buffer->pitch[2]) {
            double *to = plane;
            for (int j = 0; j < width; j++, to += buffer->pitch[1]) {
                add_row(to, width, vd_set(factor_z[k] * factor_y[j]), x);
            }
        }
    }
}

#define WIDTHS(X) X(2) X(3) X(4) X(5) X(6) X(7) X(8) X(9) X(10) X(11) X(12) X(13) X(14) X(15) X(16)
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
    .spread = {{WIDTHS(ENTRY_2D)}, {WIDTHS(ENTRY_3D)}},
};
