/* L3: lattices that fit a periodic box: how many cells each way, and where the sites are. */
#ifndef GBG_SCENE_LATTICE_H
#define GBG_SCENE_LATTICE_H

#include <stdint.h>

struct gbg_scene;

/* Sites of a kind of lattice (enum gbg_lattice) in a box: cells[a] along axis a. In two dimensions
 * row j is shifted along the first axis by j shift/cells[1] of a cell, so that rows close up over
 * the boundary for any number of them. */
struct gbg_sites {
    int kind, dimension;
    double length[3];
    int64_t cells[3];
    int64_t shift;
    int64_t n;       /* sites in all */
    double distance; /* smallest distance between two sites */
};

/* The kind that the scene asks for, or the dense one of its dimension if its start is no lattice.
 */
int gbg_lattice_of(const struct gbg_scene *scene);
const char *gbg_lattice_name(int kind);

/* The lattice of at least n sites (n >= 1) in the box with the largest distance between sites. */
void gbg_lattice_fit(int dimension, int kind, const double *length, int64_t n,
                     struct gbg_sites *sites);
/* Lengths of a nearly square box of that volume which holds whole undistorted cells of the lattice,
 * with as few sites above n as its shape allows. */
void gbg_lattice_box(int dimension, int kind, int64_t n, double volume, double *length);
/* Site number s (0 .. n-1) relative to the box's lower corner. */
void gbg_lattice_site(const struct gbg_sites *sites, int64_t s, double *position);

#endif
