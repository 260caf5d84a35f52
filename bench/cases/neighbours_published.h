/* Benchmark: the searches of Perea and Cordero (2017) and Green (2010) as they are described, in
 * plain C: particles sorted by cell, each looks into whole cells, one candidate after the other. */
#ifndef GBG_BENCH_NEIGHBOURS_PUBLISHED_H
#define GBG_BENCH_NEIGHBOURS_PUBLISHED_H

#include <stdint.h>

struct gbg_context;

/* How far the search goes: the containing cell; the neighbour in x too; those in y; those in z,
 * which are all 8 cells of the octant; or all 27 around. */
enum {
    GBG_PUBLISHED_OWN,
    GBG_PUBLISHED_X,
    GBG_PUBLISHED_Y,
    GBG_PUBLISHED_OCTANT,
    GBG_PUBLISHED_ALL
};

struct gbg_published {
    int64_t n, capacity;
    double length[3], radius;
    int cells[3]; /* the index of a cell is x + cells[0] (y + cells[1] z): x fastest */
    double *const *position;
    int64_t *start, *row; /* of a cell: where it begins; of a particle: where its row begins */
    int32_t *cell, *member;
    double *sorted[3];
    int32_t *neighbour;
    int64_t found, looked; /* neighbours and candidates of all particles in the last search */
};

/* Cells of edges length/cells >= 2 radius, at least 3 of them on each axis. */
int gbg_published_create(struct gbg_context *context, int64_t n, const double *length,
                         const int *cells, double radius, double *const *position, int64_t capacity,
                         struct gbg_published **search);
void gbg_published_destroy(struct gbg_published *search);
/* Sorts and searches. */
void gbg_published_search(struct gbg_published *search, int stage);

#endif
