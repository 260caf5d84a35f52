/* Analysis room: the Fourier transform of the real mesh, for the modes that are kept. */
#ifndef GBG_ANALYSIS_TRANSFORM_H
#define GBG_ANALYSIS_TRANSFORM_H

#include <stdint.h>

struct gbg_context;
struct gbg_transform;

/* Rows of a mesh are this many doubles apart. */
int64_t gbg_transform_pitch(int32_t cells);

/* A transform in place of a mesh of cells[0] x cells[1] (x cells[2]) doubles, axis 0 contiguous,
 * that fills in |n_a| <= reach[a] (n_0 >= 0) only. 2 reach[a] < cells[a]. */
int gbg_transform_make(struct gbg_context *context, int dimension, const int32_t *cells,
                       const int32_t *reach, double *mesh, struct gbg_transform **transform);
/* mesh: the one of gbg_transform_make. Mode n is then the complex number at element
 * ((n_2 mod cells[2]) cells[1] + n_1 mod cells[1]) pitch/2 + n_0. Same bits for any thread count.
 */
void gbg_transform_run(const struct gbg_transform *transform);
void gbg_transform_free(struct gbg_transform *transform);

#endif
