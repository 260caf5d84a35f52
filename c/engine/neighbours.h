/* L2: neighbour search on a caller's arrays: its state, and which method is taken. */
#ifndef GBG_ENGINE_NEIGHBOURS_H
#define GBG_ENGINE_NEIGHBOURS_H

#include "backend/backend.h"
#include "core/view.h"

struct gbg_context;

enum gbg_find_method {
    GBG_FIND_AUTO,
    GBG_FIND_BRUTE,
    GBG_FIND_GRID,
    GBG_FIND_OCTANT,
    GBG_FIND_OCCUPANCY
};

struct gbg_neighbours {
    struct gbg_context *context;
    const struct gbg_backend *backend;
    const struct gbg_kernels *kernels;
    struct gbg_device *device;
    struct gbg_box box;
    int method;    /* enum gbg_find_method */
    double number; /* of the method: cell edge in radii; least distance for occupancy */
    double radius, skin;
    int listed; /* 1: a list is kept; 0: the skin is not used */
    struct gbg_search *search;
    struct gbg_search_plan plan;     /* of the last update */
    struct gbg_search_report report; /* of the last update */
    int64_t n;
    int filled; /* 1: the last update succeeded */
    int64_t updates, searches;
    double crowding; /* neighbours found over those that evenly spread particles would have */
};

/* On failure nothing is left behind. */
int gbg_neighbours_make(struct gbg_context *context, int dimension, const double *lengths,
                        struct gbg_neighbours **neighbours);
void gbg_neighbours_free(struct gbg_neighbours *neighbours);
int gbg_neighbours_find(struct gbg_neighbours *neighbours, const struct gbg_points *points);
/* Calls batch with every pair. */
int gbg_neighbours_each(struct gbg_neighbours *neighbours, int base,
                        void (*batch)(void *user, int64_t n, const int32_t *first,
                                      const int32_t *second, const double *separation),
                        void *user);
void gbg_neighbours_text(const struct gbg_neighbours *neighbours, size_t capacity, char *text);

#endif
