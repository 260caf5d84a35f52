/* Public: all pairs of particles within a radius, on the caller's arrays. */
#ifndef GAMBOGE_NEIGHBOURS_H
#define GAMBOGE_NEIGHBOURS_H

#include <stddef.h>
#include <stdint.h>

#include "context.h"

#ifdef __cplusplus
extern "C" {
#endif

struct gbg_neighbours;

/* A search for pairs within `radius` (above 0, at most half the shortest box length) in a periodic
 * box of dimension 2 or 3; lengths between 1e-100 and 1e100. A pair at a distance of exactly the
 * radius counts: d <= radius, d^2 = dx^2 (+ dy^2) + dz^2 summed in that order in doubles, each
 * difference being that of 64-bit fractions of the box, nearest image, times length/2^64. Every
 * method gives the same pairs to the last one, on any number of threads and instruction set.
 *
 * method: "auto" (a rule from measurements, docs/physics.md), or by name:
 *   "grid" or "grid:F"      cells of edge F radius, F from 0.5 (default 1), 3 (5) on each axis
 *   "grid2", "half"         the same with F = 2 and with F = 0.5
 *   "octant" or "octant:F"  cells of edge F radius, F from 2 (default): 2 on each axis
 *   "occupancy:D"           cells of edge D/sqrt(dimension), one particle each: for sets without a
 *                           pair closer than D; update refuses others (GBG_E_OVERLAP)
 *   "verlet"                auto, with a list: needs a skin
 *   "brute"                 every pair
 * skin (from 0): with "verlet" pairs up to radius + skin are listed, and update only sifts the list
 * while nobody has moved more than skin/2 since it was made. Results are the same. "auto" takes a
 * skin too and uses a list where that is faster: on CPUs it is not (docs/physics.md). */
GBG_API int gbg_neighbours_create(struct gbg_context *context, int dimension, const double *lengths,
                                  double radius, const char *method, double skin,
                                  struct gbg_neighbours **neighbours);
GBG_API int gbg_neighbours_destroy(struct gbg_neighbours **neighbours);

/* Finds the pairs of n particles (0 .. 2^31-1). Coordinates: three base addresses and one step in
 * elements (z NULL in two dimensions), any finite value, taken modulo the box. *searched (may be
 * NULL): 1 if cells were searched, 0 if a list was still good. When it fails after the check of its
 * arguments (memory, occupancy) there are no pairs to read until an update succeeds. */
GBG_API int gbg_neighbours_update(struct gbg_neighbours *neighbours, int64_t n, const double *x,
                                  const double *y, const double *z, ptrdiff_t step, int *searched);

/* Of the last update: particles and pairs (each counted once). Either may be NULL. */
GBG_API int gbg_neighbours_count(struct gbg_neighbours *neighbours, int64_t *n, int64_t *pairs);

/* Neighbours of every particle in ascending order, both directions: those of particle i (from 0)
 * are neighbour[offset[i] - base] .. neighbour[offset[i + 1] - base - 1]; indices count from base
 * (0 or 1), so that in Fortran they are neighbour(offset(i) : offset(i + 1) - 1). Room needed:
 * n_offsets >= n + 1, capacity >= 2 pairs, else GBG_E_SPACE with nothing written. */
GBG_API int gbg_neighbours_csr(struct gbg_neighbours *neighbours, int base, int64_t n_offsets,
                               int64_t *offset, int64_t capacity, int32_t *neighbour);

/* Every pair once, first < second, sorted; room needed: capacity >= pairs. */
GBG_API int gbg_neighbours_pairs(struct gbg_neighbours *neighbours, int base, int64_t capacity,
                                 int32_t *first, int32_t *second);

/* What receives n pairs at a time: separation(dimension, n) in Fortran's order is r_first -
 * r_second, nearest image. The arrays are gone after the call. */
typedef void (*gbg_neighbours_batch)(void *user, int64_t n, const int32_t *first,
                                     const int32_t *second, const double *separation);
/* Hands every pair to `batch`, in the order of gbg_neighbours_pairs, in blocks of up to 4096. */
GBG_API int gbg_neighbours_visit(struct gbg_neighbours *neighbours, int base,
                                 gbg_neighbours_batch batch, void *user);

/* Of the last update: "candidates" (distances looked at, both directions of a pair), "neighbours"
 * (mean of a particle), "cells", "device_seconds" (on a GPU, from coordinates there to rows there,
 * which stay; 0 on the processor); since create: "updates", "searches". */
GBG_API int gbg_neighbours_statistic(struct gbg_neighbours *neighbours, const char *name,
                                     double *value);
/* What the last update did: "grid, 31x31 cells of 1.03 radius". */
GBG_API int gbg_neighbours_describe(struct gbg_neighbours *neighbours, int64_t capacity,
                                    char *text);

#ifdef __cplusplus
}
#endif
#endif
