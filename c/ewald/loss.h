/* Numbers of long-range sums: the error that a mesh and its windows make, before it is made. */
#ifndef GBG_EWALD_LOSS_H
#define GBG_EWALD_LOSS_H

#include "ewald/split.h"
#include "ewald/window.h"

/* As gbg_split_loss, of the mesh alone: RMS error of the force on a particle among sources without
 * order, one of strength 1 in a unit of volume, particles anywhere between nodes. spacing: of the
 * mesh along each axis; gradient: enum gbg_ewald_gradient. By integration over the waves of what
 * their aliases add (Hockney and Eastwood); rounding is not in it. */
double gbg_ewald_mesh_loss(const struct gbg_split *split, const struct gbg_ewald_window *window,
                           const double *spacing, int gradient);
/* The shape of a prolate window that makes the least loss on a mesh of this spacing: narrower in
 * waves than the rule of gbg_ewald_window_make would have it, as strong waves are the long ones. */
double gbg_ewald_best_shape(const struct gbg_split *split, int width, double spacing, int gradient);

#endif
