/* L1, CPU: sums over all images by a mesh: the body, and what its parts do for each other. */
#ifndef GBG_BACKEND_CPU_EWALD_H
#define GBG_BACKEND_CPU_EWALD_H

#include "backend/backend.h"
#include "backend/cpu/simd.h"
#include "ewald/plan.h"
#include "fft/fft.h"

/* Particles in the order of cells, row after row of them along axis 0, in a cell by rank, so that
 * no order in memory shows. Cells have edges of at least reach/2 where the box is that long, so
 * that all within the reach are in the cell of a particle and the two on each side (fewer cells
 * than five on an axis: all of them, each once). */
struct gbg_ewald_order {
    int64_t n, capacity;
    int32_t cells[3];
    int64_t *begin;             /* of each cell, and n */
    int32_t *index;             /* in the state */
    uint32_t *high[3], *low[3]; /* low: double precision only */
    float *source;              /* alpha over the largest |alpha|; single precision */
    double *source_double;      /* double precision */
    double largest;             /* |alpha| */
    double *field[3];           /* of each, in the same order, of sources over the largest */
};

struct gbg_ewald {
    struct gbg_ewald_plan plan;
    struct gbg_ewald_order order;
    void *mesh[4]; /* sources and potential; with GBG_GRADIENT_WAVES a field for each axis beside */
    void *influence; /* (cells[0]/2 + 1) x ... x (cells[1]/2 + 1): of waves n_a >= 0 */
    const struct gbg_fft *fft;
    struct gbg_fft_plan *transform;
};

/* Sorts (ewald_order.c). */
int gbg_ewald_sort(struct gbg_device *device, const struct gbg_state *state, struct gbg_ewald *sum);
/* Fields of near pairs, stored in order.field (ewald_near.c, per instruction set). */
void GBG_ISA_NAME(gbg_ewald_near)(struct gbg_device *device, const struct gbg_state *state,
                                  struct gbg_ewald *sum);
/* Sources onto mesh[0], cleared before; meshes of the field, or of the potential, added to
 * order.field (ewald_mesh.c, per instruction set). */
void GBG_ISA_NAME(gbg_ewald_spread)(struct gbg_device *device, struct gbg_ewald *sum);
void GBG_ISA_NAME(gbg_ewald_gather)(struct gbg_device *device, struct gbg_ewald *sum);
/* The kernels (ewald.c). */
int gbg_ewald_create(struct gbg_device *device, const struct gbg_state *state,
                     const struct gbg_ewald_plan *plan, int hurry, struct gbg_ewald **sum);
void gbg_ewald_destroy(struct gbg_device *device, struct gbg_ewald *sum);
int gbg_ewald_force(struct gbg_device *device, struct gbg_state *state, struct gbg_ewald *sum,
                    int add);
int gbg_ewald_potential(struct gbg_device *device, struct gbg_state *state, struct gbg_ewald *sum,
                        double *potential);
double gbg_ewald_bytes(const struct gbg_ewald *sum);

#endif
