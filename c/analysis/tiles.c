/* Analysis room: sorts particles into tiles of the mesh and spreads them. */
#include "analysis/tiles.h"

#include <math.h>
#include <string.h>

#ifdef _OPENMP
#include <omp.h>
#endif

#include "core/context.h"
#include "core/memory.h"

/* Smallest tile edges (nodes), by dimension and axis: the buffer of a tile stays in the first or
 * second level of cache. An edge is at least GBG_WINDOW_WIDEST, so that a window reaches no further
 * than the next tile. */
static const int32_t least_edge[2][3] = {{64, 32, 1}, {16, 16, 16}};

enum { LEAST_CHUNK = 8192 }; /* particles worth a thread */

static int thread_number(void)
{
#ifdef _OPENMP
    return omp_get_thread_num();
#else
    return 0;
#endif
}

/* Cuts an axis into tiles of nearly equal size. */
static void cut_axis(struct gbg_tiles *tiles, int a, int64_t *largest)
{
    int64_t cells = tiles->axis[a].cells;
    *largest = 0;
    for (int64_t t = 0; t <= tiles->per_axis[a]; t++) {
        tiles->start[a][t] = (int32_t)(t * cells / tiles->per_axis[a]);
    }
    for (int64_t t = 0; t < tiles->per_axis[a]; t++) {
        int32_t begin = tiles->start[a][t], end = tiles->start[a][t + 1];
        for (int32_t c = begin; c < end; c++) {
            tiles->tile_of[a][c] = (int32_t)t;
            tiles->place_of[a][c] = c - begin;
        }
        *largest = end - begin > *largest ? end - begin : *largest;
    }
}

/* Neighbours on a ring differ in colour: 0 and 1 in turn, and 2 for the last of an odd number. */
static int colour_on_axis(int64_t tile, int64_t tiles)
{
    return tiles > 1 && tiles % 2 && tile == tiles - 1 ? 2 : (int)(tile % 2);
}

static int colour_of(const struct gbg_tiles *tiles, int64_t tile)
{
    int colour = 0;
    for (int a = 0; a < tiles->dimension; a++) {
        colour = 3 * colour + colour_on_axis(tile % tiles->per_axis[a], tiles->per_axis[a]);
        tile /= tiles->per_axis[a];
    }
    return colour;
}

static void group_by_colour(struct gbg_tiles *tiles)
{
    int64_t filled = 0;
    for (int colour = 0; colour < 27; colour++) {
        tiles->colour_start[colour] = filled;
        for (int64_t t = 0; t < tiles->count; t++) {
            if (colour_of(tiles, t) == colour) {
                tiles->by_colour[filled++] = t;
            }
        }
    }
    tiles->colour_start[27] = filled;
}

static int allocate_axes(struct gbg_context *context, struct gbg_tiles *tiles)
{
    for (int a = 0; a < tiles->dimension; a++) {
        void *tile, *place, *start;
        int64_t cells = tiles->axis[a].cells;
        int status = gbg_allocate(context, &tile, cells, sizeof(int32_t), "tiles of nodes");
        tiles->tile_of[a] = tile;
        if (status == GBG_OK) {
            status = gbg_allocate(context, &place, cells, sizeof(int32_t), "places in tiles");
            tiles->place_of[a] = place;
        }
        if (status == GBG_OK) {
            status = gbg_allocate(context, &start, tiles->per_axis[a] + 1, sizeof(int32_t),
                                  "starts of tiles");
            tiles->start[a] = start;
        }
        if (status != GBG_OK) {
            return status;
        }
    }
    return GBG_OK;
}

static int allocate_bulk(struct gbg_context *context, struct gbg_tiles *tiles, int64_t n)
{
    int64_t keys = tiles->channels * tiles->count;
    struct {
        void **pointer;
        int64_t count;
        size_t size;
        const char *what;
    } list[] = {
        {(void **)&tiles->by_colour, tiles->count, sizeof(int64_t), "tiles by colour"},
        {(void **)&tiles->buffers, tiles->threads * tiles->buffer_size, sizeof(double), "tiles"},
        {(void **)&tiles->points, n, sizeof(struct gbg_spread_point), "sorted particles"},
        {(void **)&tiles->key, n, sizeof(int32_t), "tiles of particles"},
        {(void **)&tiles->first, keys + 1, sizeof(int64_t), "first particles of tiles"},
        {(void **)&tiles->chunk, tiles->chunks * keys, sizeof(int64_t), "particles per tile"},
    };
    for (size_t i = 0; i < sizeof list / sizeof *list; i++) {
        int status =
            gbg_allocate(context, list[i].pointer, list[i].count, list[i].size, list[i].what);
        if (status != GBG_OK) {
            return status;
        }
    }
    return GBG_OK;
}

int gbg_tiles_make(struct gbg_context *context, int dimension, const int32_t *cells, int width,
                   int channels, int64_t n, struct gbg_tiles *tiles)
{
    memset(tiles, 0, sizeof *tiles);
    tiles->dimension = dimension;
    tiles->channels = channels;
    tiles->capacity = n;
    tiles->threads = context->threads;
    tiles->chunks = (int)(n / LEAST_CHUNK) + 1;
    tiles->chunks = tiles->chunks < tiles->threads ? tiles->chunks : tiles->threads;
    tiles->kernels = gbg_spread_kernels_of(context->instructions);
    gbg_window_make(width, &tiles->window);
    tiles->count = 1;
    for (int a = 0; a < dimension; a++) {
        tiles->axis[a] = (struct gbg_mesh_axis){.cells = cells[a], .width = width};
        int64_t whole = cells[a] / least_edge[dimension - 2][a];
        tiles->per_axis[a] = whole > 0 ? whole : 1;
        tiles->count *= tiles->per_axis[a];
    }
    int status = allocate_axes(context, tiles);
    tiles->buffer_size = 1;
    for (int a = 0; a < dimension && status == GBG_OK; a++) {
        int64_t largest;
        cut_axis(tiles, a, &largest);
        tiles->pitch[a] = tiles->buffer_size;
        tiles->buffer_size *= largest + GBG_WINDOW_ROW;
    }
    if (status == GBG_OK) {
        status = allocate_bulk(context, tiles, n);
    }
    if (status != GBG_OK) {
        gbg_tiles_free(tiles);
        return status;
    }
    group_by_colour(tiles);
    return GBG_OK;
}

void gbg_tiles_free(struct gbg_tiles *tiles)
{
    for (int a = 0; a < 3; a++) {
        gbg_release(tiles->tile_of[a]);
        gbg_release(tiles->place_of[a]);
        gbg_release(tiles->start[a]);
    }
    gbg_release(tiles->by_colour);
    gbg_release(tiles->buffers);
    gbg_release(tiles->points);
    gbg_release(tiles->key);
    gbg_release(tiles->first);
    gbg_release(tiles->chunk);
    memset(tiles, 0, sizeof *tiles);
}

enum { BLOCK = GBG_PLACE_BLOCK };

/* Places of a block of particles on all axes. */
struct block {
    double z[3][BLOCK];
    int32_t first[3][BLOCK];
};

static void place_block(const struct gbg_tiles *tiles, const struct gbg_points *points,
                        const struct gbg_mesh_axis *axis, int64_t begin, int64_t n,
                        struct block *block)
{
    for (int a = 0; a < tiles->dimension; a++) {
        const double *from = points->base[a] + begin * points->step;
        tiles->kernels->place(&axis[a], n, from, points->step, block->first[a], block->z[a]);
    }
}

static int32_t tile_of(const struct gbg_tiles *tiles, const struct block *block, int64_t i)
{
    int64_t tile = 0;
    for (int a = tiles->dimension - 1; a >= 0; a--) {
        tile = tile * tiles->per_axis[a] + tiles->tile_of[a][block->first[a][i]];
    }
    return (int32_t)tile;
}

static struct gbg_spread_point point_of(const struct gbg_tiles *tiles, const struct block *block,
                                        int64_t i)
{
    struct gbg_spread_point point = {.offset = 0};
    for (int a = 0; a < tiles->dimension; a++) {
        point.z[a] = block->z[a][i];
        point.offset += tiles->pitch[a] * tiles->place_of[a][block->first[a][i]];
    }
    return point;
}

/* What the threads of one sort share. */
struct sorting {
    struct gbg_tiles *tiles;
    const struct gbg_points *points;
    const int32_t *channel;
    int base;
    struct gbg_mesh_axis axis[3];
};

static void count_chunk(const struct sorting *sort, int64_t begin, int64_t end, int64_t *count)
{
    struct gbg_tiles *tiles = sort->tiles;
    struct block block;
    memset(count, 0, (size_t)(tiles->channels * tiles->count) * sizeof *count);
    for (int64_t b = begin; b < end; b += BLOCK) {
        int64_t n = end - b < BLOCK ? end - b : BLOCK;
        place_block(tiles, sort->points, sort->axis, b, n, &block);
        for (int64_t i = 0; i < n; i++) {
            int32_t key = tile_of(tiles, &block, i);
            if (sort->channel) {
                key += (int32_t)((sort->channel[b + i] - sort->base) * tiles->count);
            }
            tiles->key[b + i] = key;
            count[key]++;
        }
    }
}

static void move_chunk(const struct sorting *sort, int64_t begin, int64_t end, int64_t *next)
{
    struct gbg_tiles *tiles = sort->tiles;
    struct block block;
    for (int64_t b = begin; b < end; b += BLOCK) {
        int64_t n = end - b < BLOCK ? end - b : BLOCK;
        place_block(tiles, sort->points, sort->axis, b, n, &block);
        for (int64_t i = 0; i < n; i++) {
            tiles->points[next[tiles->key[b + i]]++] = point_of(tiles, &block, i);
        }
    }
}

/* Turns the counts of all chunks into places: by key, then by chunk. */
static void places_from_counts(struct gbg_tiles *tiles)
{
    int64_t keys = tiles->channels * tiles->count, place = 0;
    tiles->fullest = 0;
    for (int64_t key = 0; key < keys; key++) {
        tiles->first[key] = place;
        for (int t = 0; t < tiles->chunks; t++) {
            int64_t count = tiles->chunk[t * keys + key];
            tiles->chunk[t * keys + key] = place;
            place += count;
        }
        int64_t here = place - tiles->first[key];
        tiles->fullest = here > tiles->fullest ? here : tiles->fullest;
    }
    tiles->first[keys] = place;
}

void gbg_tiles_sort(struct gbg_tiles *tiles, const struct gbg_points *points, const double *lengths,
                    const int32_t *channel, int base)
{
    struct sorting sort = {tiles, points, channel, base, {{0}}};
    for (int a = 0; a < tiles->dimension; a++) {
        sort.axis[a] = tiles->axis[a];
        sort.axis[a].length = lengths[a];
    }
    int64_t keys = tiles->channels * tiles->count, chunks = tiles->chunks, n = points->n;
#pragma omp parallel for num_threads(tiles->threads) schedule(static, 1)
    for (int64_t t = 0; t < chunks; t++) {
        count_chunk(&sort, n * t / chunks, n * (t + 1) / chunks, tiles->chunk + t * keys);
    }
    places_from_counts(tiles);
#pragma omp parallel for num_threads(tiles->threads) schedule(static, 1)
    for (int64_t t = 0; t < chunks; t++) {
        move_chunk(&sort, n * t / chunks, n * (t + 1) / chunks, tiles->chunk + t * keys);
    }
}

/* Adds one row of a buffer to a row of the mesh that is a ring of `cells` nodes. */
static void add_ring(double *restrict row, int64_t cells, int64_t at, const double *restrict value,
                     int64_t n)
{
    while (n > 0) {
        int64_t run = n < cells - at ? n : cells - at;
        for (int64_t i = 0; i < run; i++) {
            row[at + i] += value[i];
        }
        value += run;
        n -= run;
        at = 0;
    }
}

/* Adds a tile's buffer, the tile's nodes and width - 1 beyond, to the mesh. */
static void add_tile(const struct gbg_tiles *tiles, const int64_t *place, const double *buffer,
                     double *mesh, ptrdiff_t pitch)
{
    int64_t at[3] = {0, 0, 0}, extent[3] = {1, 1, 1}, cells[3] = {1, 1, 1};
    for (int a = 0; a < tiles->dimension; a++) {
        cells[a] = tiles->axis[a].cells;
        at[a] = tiles->start[a][place[a]];
        extent[a] = tiles->start[a][place[a] + 1] - at[a] + tiles->window.width - 1;
    }
    for (int64_t k = 0; k < extent[2]; k++) {
        for (int64_t j = 0; j < extent[1]; j++) {
            int64_t row = (at[2] + k) % cells[2] * cells[1] + (at[1] + j) % cells[1];
            add_ring(mesh + row * pitch, cells[0], at[0],
                     buffer + k * tiles->pitch[2] + j * tiles->pitch[1], extent[0]);
        }
    }
}

static void spread_tile(const struct gbg_tiles *tiles, int channel, int64_t tile, double *mesh,
                        ptrdiff_t pitch)
{
    int64_t key = channel * tiles->count + tile;
    int64_t begin = tiles->first[key], n = tiles->first[key + 1] - begin;
    if (n == 0) {
        return;
    }
    struct gbg_spread_buffer buffer = {tiles->buffers + thread_number() * tiles->buffer_size, {0}};
    memcpy(buffer.pitch, tiles->pitch, sizeof buffer.pitch);
    memset(buffer.value, 0, (size_t)tiles->buffer_size * sizeof *buffer.value);
    tiles->kernels->spread[tiles->dimension - 2][tiles->window.width](
        &tiles->window, n, tiles->points + begin, &buffer);
    int64_t place[3] = {0, 0, 0};
    for (int a = 0; a < tiles->dimension; a++) {
        place[a] = tile % tiles->per_axis[a];
        tile /= tiles->per_axis[a];
    }
    add_tile(tiles, place, buffer.value, mesh, pitch);
}

void gbg_tiles_spread(const struct gbg_tiles *tiles, int channel, double *mesh, ptrdiff_t pitch)
{
    for (int colour = 0; colour < 27; colour++) {
        int64_t begin = tiles->colour_start[colour], end = tiles->colour_start[colour + 1];
        if (begin == end) {
            continue;
        }
#pragma omp parallel for num_threads(tiles->threads) schedule(dynamic)
        for (int64_t i = begin; i < end; i++) {
            spread_tile(tiles, channel, tiles->by_colour[i], mesh, pitch);
        }
    }
}
