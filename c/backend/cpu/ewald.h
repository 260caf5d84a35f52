/* L1, CPU: sums over all images by a mesh: the body, and what its parts do for each other. */
#ifndef GBG_BACKEND_CPU_EWALD_H
#define GBG_BACKEND_CPU_EWALD_H

#include "backend/backend.h"
#include "backend/cpu/simd.h"
#include "ewald/plan.h"
#include "fft/fft.h"

/* Edges of cells are at least the reach over so many along axis 0, the reach along others. */
enum { GBG_EWALD_PARTS = 3 };

/* Particles in the order of cells, row after row of them along axis 0, in a cell by rank, so that
 * no order in memory shows. All within the reach of a particle are in its cell and in `around`
 * cells on each side (fewer cells than 2 around + 1 on an axis: all of them, each once). */
struct gbg_ewald_order {
    int64_t n, capacity;
    int32_t cells[3], around[3];
    int64_t cell_capacity;
    int64_t *begin;             /* of each cell, and n */
    int32_t *index;             /* in the state */
    uint32_t *high[3], *low[3]; /* low: double precision only */
    /* Single precision: 32 bits of a coordinate from bit `shift` below the top on: differences
     * between neighbours do not need the bits above, and gain as many below. */
    uint32_t *fine[3];
    int shift[3];
    float *source;         /* alpha over the largest |alpha|; single precision */
    double *source_double; /* double precision */
    double largest;        /* |alpha| */
    int uniform;           /* 1: all have the same alpha */
    double *field[3];      /* of each, in the same order, of sources over the largest */
};

struct gbg_ewald {
    struct gbg_ewald_plan plan;
    struct gbg_ewald_order order;
    void *mesh[4]; /* sources and potential; with GBG_GRADIENT_WAVES a field for each axis beside */
    void *influence; /* (cells[0]/2 + 1) x ... x (cells[1]/2 + 1): of waves n_a >= 0 */
    /* Powers of two that numbers on meshes are to be multiplied by. */
    double potential_unit, field_unit, wave_unit;
    const struct gbg_fft *fft;
    struct gbg_fft_plan *transform;
    int threads; /* that there is room for */
    /* Blocks of particles (ewald_blocks.h), and the cells of the order that they were made of. */
    int32_t blocks[3], divided[3];
    int64_t patch, patch_bytes; /* numbers of one; bytes of all */
    void *patches;              /* for each thread as many as meshes are read at a time */
};

/* Sorts (ewald_order.c). Memory is taken by reserve, for as many particles as the state owns now;
 * sort calls it again, which does nothing unless there are more. */
int gbg_ewald_sort(struct gbg_device *device, const struct gbg_state *state, struct gbg_ewald *sum);
int gbg_ewald_order_reserve(struct gbg_device *device, const struct gbg_state *state,
                            const struct gbg_ewald_plan *plan, struct gbg_ewald_order *order);
void gbg_ewald_order_release(struct gbg_ewald_order *order);
double gbg_ewald_order_bytes(const struct gbg_ewald_order *order);
/* Fields of near pairs, stored in order.field (ewald_near.c, per instruction set). */
void GBG_ISA_NAME(gbg_ewald_near)(struct gbg_device *device, const struct gbg_state *state,
                                  struct gbg_ewald *sum);
/* Potentials of near pairs, of sources over the largest, stored in the sorted order; in double
 * precision whatever the plan (ewald_near_potential.c). */
void gbg_ewald_near_potential(struct gbg_device *device, const struct gbg_state *state,
                              struct gbg_ewald *sum, double *potential);
/* Sources onto mesh[0], cleared before; meshes of the field, or of the potential, added to
 * order.field (ewald_mesh.c, per instruction set). */
void GBG_ISA_NAME(gbg_ewald_spread)(struct gbg_device *device, struct gbg_ewald *sum);
void GBG_ISA_NAME(gbg_ewald_gather)(struct gbg_device *device, struct gbg_ewald *sum);
/* Potential on mesh[0], added to order.field[0]. */
void GBG_ISA_NAME(gbg_ewald_gather_potential)(struct gbg_device *device, struct gbg_ewald *sum);
/* Waves of mesh[0] times the influence, in place, or, with `fields`, times -i k too, to the other
 * meshes (ewald_waves.c, per instruction set). */
void GBG_ISA_NAME(gbg_ewald_multiply)(struct gbg_device *device, struct gbg_ewald *sum, int fields);
/* These of one instruction set, for ewald.c. */
struct gbg_ewald_kernels {
    void (*near)(struct gbg_device *device, const struct gbg_state *state, struct gbg_ewald *sum);
    void (*spread)(struct gbg_device *device, struct gbg_ewald *sum);
    void (*gather)(struct gbg_device *device, struct gbg_ewald *sum);
    void (*gather_potential)(struct gbg_device *device, struct gbg_ewald *sum);
    void (*multiply)(struct gbg_device *device, struct gbg_ewald *sum, int fields);
};
extern const struct gbg_ewald_kernels GBG_ISA_NAME(gbg_ewald_kernels);
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
