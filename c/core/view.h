/* L0: views: the caller's coordinates as base addresses and one step in elements; a frame. */
#ifndef GBG_CORE_VIEW_H
#define GBG_CORE_VIEW_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

struct gbg_points {
    int64_t n;
    const double *base[3];
    ptrdiff_t step;
};

/* A copy of a state for output, in host memory: n values an axis, in the order of ids. */
struct gbg_frame {
    const uint64_t *fraction[3]; /* coordinates as fractions of the box */
    const int32_t *image[3];     /* NULL: not asked for */
    const int32_t *overlapped;   /* NULL: not asked for */
};

static inline double gbg_point(const struct gbg_points *points, int axis, int64_t i)
{
    return points->base[axis][i * points->step];
}

/* Index of the first particle with a coordinate that is not finite, -1 if there is none. */
static inline int64_t gbg_points_first_bad(const struct gbg_points *points, int dimension)
{
    for (int64_t i = 0; i < points->n; i++) {
        for (int a = 0; a < dimension; a++) {
            if (!isfinite(gbg_point(points, a, i))) {
                return i;
            }
        }
    }
    return -1;
}

#endif
