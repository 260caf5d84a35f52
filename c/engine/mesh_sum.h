/* L2: sums over all images by a mesh: chosen by the tolerance, made, refined. */
#ifndef GBG_ENGINE_MESH_SUM_H
#define GBG_ENGINE_MESH_SUM_H

#include <stddef.h>

#include "backend/backend.h"
#include "ewald/model.h"

struct gbg_context;

/* What a sum works on. */
struct gbg_mesh_place {
    struct gbg_context *context;
    const struct gbg_backend *backend;
    const struct gbg_kernels *kernels;
    struct gbg_device *device;
    const struct gbg_state *state;
    int hurry;        /* 1: few sums will be made */
    const char *name; /* of the sum, in the log */
};

/* Refinements at most, and particles on which an error is measured. */
enum { GBG_MESH_REFINEMENTS = 4, GBG_MESH_SAMPLES = 1000 };

struct gbg_mesh_sum {
    struct gbg_ewald_wish wish; /* its tolerance is finer than the user's after refinements */
    struct gbg_ewald_choice choice;
    double predicted, cost; /* relative RMS force error, and ns a particle, by the model */
    struct gbg_ewald *body; /* NULL: none */
    double tolerance;       /* the user's */
    double measured;        /* relative RMS force error at the last check; -1: none was made */
    int refined;            /* times */
    int symmetric;          /* 1: at the last check forces all but cancelled, and it took that of a
                               neighbour for their size */
};

/* A wish with everything open but what a sum over all images is: wish->tolerance, split, window,
 * gradient and single may be changed before it is made. */
void gbg_mesh_sum_begin(int dimension, const double *length, double power, int64_t n,
                        double tolerance, struct gbg_mesh_sum *sum);
/* The numbers alone; refusals are GBG_E_ARGUMENT. */
int gbg_mesh_sum_choose(struct gbg_context *context, struct gbg_mesh_sum *sum);
/* Chooses and makes; refusals as before. */
int gbg_mesh_sum_make(const struct gbg_mesh_place *place, struct gbg_mesh_sum *sum);
void gbg_mesh_sum_free(const struct gbg_mesh_place *place, struct gbg_mesh_sum *sum);
/* As it is after `times` refinements (0: none); GBG_E_ARGUMENT if the model has nothing so fine.
 * What fails leaves it as it was. */
int gbg_mesh_sum_refine(const struct gbg_mesh_place *place, int times, struct gbg_mesh_sum *sum);

/* Puts the error of a sample's forces into sum->measured, relative to rms, the RMS force on all
 * particles, or, where forces cancel, to that of a typical neighbour. */
struct gbg_sample;
void gbg_mesh_sum_judge(struct gbg_mesh_sum *sum, const struct gbg_sample *sample, double rms,
                        double typical);

/* Measures, and refines until the tolerance is kept; each refinement is a line of the log.
 * GBG_E_ARGUMENT with a sentence that begins with "tolerance" if it cannot be kept. */
typedef int (*gbg_mesh_measure)(void *user, struct gbg_mesh_sum *sum);
int gbg_mesh_sum_settle(const struct gbg_mesh_place *place, int64_t samples,
                        gbg_mesh_measure measure, void *user, struct gbg_mesh_sum *sum);

/* "r/r^3, all images: reach 3.7, mesh 128x128, width 6, float, error 9.1e-05, 64 ns a particle". */
void gbg_mesh_sum_describe(const struct gbg_mesh_sum *sum, size_t capacity, char *text);

#endif
