/* Analysis room: the real mesh in tiles; particles sorted into them and spread, in a fixed order.
 */
#ifndef GBG_ANALYSIS_TILES_H
#define GBG_ANALYSIS_TILES_H

#include "analysis/kernels.h"
#include "core/view.h"

struct gbg_context;

/* Points are sorted by channel and tile; each tile is spread into a buffer of its own and the
 * buffer added to the mesh. Tiles are grouped by colour so that no two of a colour touch the same
 * nodes; colours go one after another. So each node sums in one order, whatever the threads. */
struct gbg_tiles {
    int dimension;
    struct gbg_mesh_axis axis[3];
    int64_t per_axis[3], count;
    int64_t buffer_size;
    int64_t *by_colour; /* tiles, grouped */
    int64_t colour_start[28];
    double *buffers; /* one a thread */
    int threads;
    const struct gbg_spread_kernels *kernels;
    struct gbg_window window;
    /* The sorted points of a frame */
    int channels;
    struct gbg_spread_point *points;
    int32_t *key;
    int64_t *first;  /* channels * count + 1 */
    int chunks;      /* pieces that are counted and moved at the same time */
    int64_t *chunk;  /* chunks * channels * count */
    int64_t fullest; /* most points in a tile and channel */
};

/* Mesh of `cells` nodes an axis (axis 0 contiguous) and a window of this width. n: particles. */
int gbg_tiles_make(struct gbg_context *context, int dimension, const int32_t *cells, int width,
                   int channels, int64_t n, struct gbg_tiles *tiles);
void gbg_tiles_free(struct gbg_tiles *tiles);

/* Sorts finite points in a box of these lengths; channel of each, or NULL: all in channel 0. */
void gbg_tiles_sort(struct gbg_tiles *tiles, const struct gbg_points *points, const double *lengths,
                    const int32_t *channel, int base);
/* Adds the points of a channel to the mesh; pitch: doubles from one row to the next. Planes follow
 * each other without a gap. */
void gbg_tiles_spread(const struct gbg_tiles *tiles, int channel, double *mesh, ptrdiff_t pitch);

#endif
