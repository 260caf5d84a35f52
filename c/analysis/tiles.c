/* Analysis room: sorts particles into tiles of the mesh and spreads them. */
#include "analysis/tiles.h"

#include <string.h>

#ifdef _OPENMP
#include <omp.h>
#endif

#include "core/context.h"
#include "core/memory.h"

enum { LEAST_CHUNK = 8192, BLOCK = GBG_PLACE_BLOCK }; /* the first: particles worth a thread */

/* Edges of tiles as powers of 2, by dimension and axis: the buffer of a tile stays in the first or
 * second level of cache. They are at least GBG_WINDOW_WIDEST, so that a window reaches no further
 * than the next tile. */
static const int32_t edge_shift[2][3] = {{6, 5, 0}, {5, 4, 4}};

static int thread_number(void)
{
#ifdef _OPENMP
    return omp_get_thread_num();
#else
    return 0;
#endif
}

static void lay_tiles(struct gbg_tiles *tiles, const int32_t *cells, int width)
{
    tiles->count = tiles->buffer_size = 1;
    for (int a = 0; a < tiles->dimension; a++) {
        struct gbg_mesh_axis *axis = &tiles->axis[a];
        axis->cells = cells[a];
        axis->width = width;
        axis->shift = edge_shift[tiles->dimension - 2][a];
        int32_t whole = cells[a] >> axis->shift;
        tiles->per_axis[a] = whole > 0 ? whole : 1;
        axis->last_tile = (int32_t)tiles->per_axis[a] - 1;
        axis->tile_step = (int32_t)tiles->count;
        axis->pitch = (int32_t)tiles->buffer_size;
        tiles->count *= tiles->per_axis[a];
        tiles->buffer_size *= cells[a] - (axis->last_tile << axis->shift) +
                              (a == 0 ? GBG_WINDOW_LANES(width) : width - 1);
    }
}

/* First node of a tile on an axis, and its nodes. */
static int64_t tile_start(const struct gbg_mesh_axis *axis, int64_t tile)
{
    return tile << axis->shift;
}

static int64_t tile_edge(const struct gbg_mesh_axis *axis, int64_t tile)
{
    return tile < axis->last_tile ? INT64_C(1) << axis->shift
                                  : axis->cells - tile_start(axis, tile);
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

static int allocate(struct gbg_context *context, struct gbg_tiles *tiles, int64_t n)
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
    tiles->threads = context->threads;
    tiles->chunks =
        n / LEAST_CHUNK + 1 < tiles->threads ? (int)(n / LEAST_CHUNK) + 1 : tiles->threads;
    tiles->kernels = gbg_spread_kernels_of(context->host);
    gbg_window_make(width, &tiles->window);
    lay_tiles(tiles, cells, width);
    int status = allocate(context, tiles, n);
    if (status != GBG_OK) {
        gbg_tiles_free(tiles);
        return status;
    }
    group_by_colour(tiles);
    return GBG_OK;
}

void gbg_tiles_free(struct gbg_tiles *tiles)
{
    gbg_release(tiles->by_colour);
    gbg_release(tiles->buffers);
    gbg_release(tiles->points);
    gbg_release(tiles->key);
    gbg_release(tiles->first);
    gbg_release(tiles->chunk);
    memset(tiles, 0, sizeof *tiles);
}

/* What the threads of one sort share. */
struct sorting {
    struct gbg_tiles *tiles;
    const struct gbg_points *points;
    const int32_t *channel;
    int base;
    struct gbg_mesh_axis axis[3];
};

static void place_block(const struct sorting *sort, int64_t begin, int64_t n,
                        struct gbg_place_block *block)
{
    sort->tiles->kernels->place(sort->axis, sort->tiles->dimension, sort->points, begin, n, block);
}

static void count_chunk(const struct sorting *sort, int64_t begin, int64_t end, int64_t *count)
{
    struct gbg_tiles *tiles = sort->tiles;
    struct gbg_place_block block;
    memset(count, 0, (size_t)(tiles->channels * tiles->count) * sizeof *count);
    for (int64_t b = begin; b < end; b += BLOCK) {
        int64_t n = end - b < BLOCK ? end - b : BLOCK;
        place_block(sort, b, n, &block);
        for (int64_t i = 0; i < n && sort->channel; i++) {
            block.tile[i] += (int32_t)((sort->channel[b + i] - sort->base) * tiles->count);
        }
        memcpy(tiles->key + b, block.tile, (size_t)n * sizeof *tiles->key);
        for (int64_t i = 0; i < n; i++) {
            count[block.tile[i]]++;
        }
    }
}

static void move_chunk(const struct sorting *sort, int64_t begin, int64_t end, int64_t *next)
{
    struct gbg_tiles *tiles = sort->tiles;
    struct gbg_place_block block = {.z = {{0}}};
    for (int64_t b = begin; b < end; b += BLOCK) {
        int64_t n = end - b < BLOCK ? end - b : BLOCK;
        place_block(sort, b, n, &block);
        for (int64_t i = 0; i < n; i++) {
            tiles->points[next[tiles->key[b + i]]++] = (struct gbg_spread_point){
                {block.z[0][i], block.z[1][i], block.z[2][i]}, block.offset[i]};
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
#pragma omp parallel for num_threads(chunks) schedule(static, 1)
    for (int64_t t = 0; t < chunks; t++) {
        count_chunk(&sort, n * t / chunks, n * (t + 1) / chunks, tiles->chunk + t * keys);
    }
    places_from_counts(tiles);
#pragma omp parallel for num_threads(chunks) schedule(static, 1)
    for (int64_t t = 0; t < chunks; t++) {
        move_chunk(&sort, n * t / chunks, n * (t + 1) / chunks, tiles->chunk + t * keys);
    }
}

static struct gbg_tile_reach reach_of(const struct gbg_tiles *tiles, int64_t tile)
{
    struct gbg_tile_reach reach = {{0, 0, 0}, {1, 1, 1}, {5, 4, 4}};
    for (int a = 0; a < tiles->dimension; a++) {
        const struct gbg_mesh_axis *axis = &tiles->axis[a];
        int64_t place = tile % tiles->per_axis[a];
        reach.at[a] = tile_start(axis, place);
        reach.extent[a] = tile_edge(axis, place) + tiles->window.width - 1;
        reach.cells[a] = axis->cells;
        tile /= tiles->per_axis[a];
    }
    return reach;
}

static void spread_tile(const struct gbg_tiles *tiles, int channel, int64_t tile, double *mesh,
                        ptrdiff_t pitch)
{
    int64_t key = channel * tiles->count + tile;
    int64_t begin = tiles->first[key], n = tiles->first[key + 1] - begin;
    if (n == 0) {
        return;
    }
    int last = tiles->dimension - 1;
    struct gbg_tile_reach reach = reach_of(tiles, tile);
    struct gbg_spread_buffer buffer = {
        tiles->buffers + thread_number() * tiles->buffer_size,
        {tiles->axis[0].pitch, tiles->axis[1].pitch, tiles->axis[2].pitch}};
    memset(buffer.value, 0,
           (size_t)(reach.extent[last] * tiles->axis[last].pitch) * sizeof *buffer.value);
    tiles->kernels->spread[last - 1][tiles->window.width](&tiles->window, n, tiles->points + begin,
                                                          &buffer);
    buffer.value += GBG_WINDOW_LEAD(tiles->window.width);
    tiles->kernels->add(&reach, &buffer, mesh, pitch);
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
