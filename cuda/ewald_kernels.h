/* L1, CUDA: the parts of a sum by a mesh, in the order in which they are started. */
#ifndef GBG_CUDA_EWALD_KERNELS_H
#define GBG_CUDA_EWALD_KERNELS_H

#include "cuda/ewald.h"

/* Particles into the order of cells (ewald_order.cu). */
int gbg_cuda_ewald_sort(struct gbg_device *device, const struct gbg_state *state,
                        struct gbg_ewald *sum);
/* Sum of all sources, over the largest |alpha|, in a fixed order; waits for it. */
int gbg_cuda_ewald_total(struct gbg_device *device, const struct gbg_ewald *sum, double *all);
/* Sources onto the mesh, each node once: it need not be cleared (ewald_spread.cu). */
int gbg_cuda_ewald_spread(struct gbg_device *device, struct gbg_ewald *sum);
/* Influence of all waves, once (ewald_wave.cu). */
int gbg_cuda_ewald_fill(struct gbg_device *device, struct gbg_ewald *sum);
/* Waves of the sources become those of the potential, or, by_waves, of the fields. */
int gbg_cuda_ewald_multiply(struct gbg_device *device, struct gbg_ewald *sum, int by_waves);
/* Fields, or potentials, of near pairs into the workspace (ewald_near.cu). */
int gbg_cuda_ewald_near(struct gbg_device *device, struct gbg_ewald *sum, int potential);
/* Both parts into forces or potentials in the state's order (ewald_gather.cu). */
int gbg_cuda_ewald_gather(struct gbg_device *device, const struct gbg_state *state,
                          struct gbg_ewald *sum, const struct gbg_cuda_ewald_output *output);
/* Single precision: adds the closest pairs, which near has left out, in double precision
 * (ewald_mend.cu). */
int gbg_cuda_ewald_mend(struct gbg_device *device, const struct gbg_state *state,
                        struct gbg_ewald *sum, const struct gbg_cuda_ewald_output *output);

#endif
