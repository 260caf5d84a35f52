/* L2: long-range forces on a caller's arrays: what a solver holds from one call to the next. */
#ifndef GBG_ENGINE_SUM_H
#define GBG_ENGINE_SUM_H

#include "engine/bare.h"
#include "engine/mesh_sum.h"

struct gbg_sum {
    struct gbg_context *context;
    struct gbg_bare bare;
    int lattice; /* 1: all images by a mesh; 0: nearest images, pair by pair */
    double power, tolerance;
    int use_double;     /* of nearest images */
    int check;          /* 1: the first run measures the error of a lattice sum and refines it */
    int precise, hurry; /* 1: mesh in double precision; few runs will be made */
    struct gbg_mesh_sum mesh;
    double *alpha;     /* n, the caller's */
    double unit;       /* the largest of them: the state has them over it */
    double *buffer;    /* n, on its way to the caller */
    double *potential; /* n, the backend's; NULL until it is asked for */
    int has_positions, has_sources;
    int current; /* 1: the state's forces are those of its positions and sources */
    int checked;
};

/* On failure nothing is left behind; refusals of the model are GBG_E_ARGUMENT. */
int gbg_sum_make(struct gbg_context *context, int dimension, const double *lengths, int64_t n,
                 struct gbg_sum **sum);
void gbg_sum_free(struct gbg_sum *sum);

int gbg_sum_take_sources(struct gbg_sum *sum, const double *alpha);
/* Makes the mesh if there is none, measures it if this was not done, and sums. */
int gbg_sum_forces(struct gbg_sum *sum);
/* mobility NULL: 1. */
int gbg_sum_give_forces(struct gbg_sum *sum, const double *mobility, double *const force[3],
                        ptrdiff_t step);
int gbg_sum_give_potential(struct gbg_sum *sum, double *values);
int gbg_sum_measure(struct gbg_sum *sum, int64_t samples, double *rms_over_rms,
                    double *rms_over_median);
/* The mesh no longer fits the wish. */
void gbg_sum_drop_mesh(struct gbg_sum *sum);

#endif
