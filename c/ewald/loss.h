/* Numbers of long-range sums: the error that a mesh and its windows make, before it is made. */
#ifndef GBG_EWALD_LOSS_H
#define GBG_EWALD_LOSS_H

#include <stdint.h>

#include "ewald/split.h"
#include "ewald/window.h"

/* As gbg_split_loss, of the mesh alone: RMS error of the force on a particle among sources without
 * order, one of strength 1 in a unit of volume, particles anywhere between nodes. gradient: enum
 * gbg_ewald_gradient. By integration over the waves of what their aliases add (Hockney and
 * Eastwood). Rounding is not in it.
 *
 * With GBG_GRADIENT_WINDOW it grows with the box for low powers: slopes of a prolate window do not
 * add to zero where the mesh is even, so that each long wave pulls a little by its height alone. */
double gbg_ewald_mesh_loss(const struct gbg_split *split, const struct gbg_ewald_window *window,
                           const double *length, const int32_t *cells, int gradient);
/* The shape of a prolate window that makes the least loss on a mesh of that many cells over the
 * length: narrower in waves than the rule of gbg_ewald_window_make would have it, as strong waves
 * are the long ones. */
double gbg_ewald_best_shape(const struct gbg_split *split, int width, double length, int32_t cells,
                            int gradient);

#endif
