/* L1, CPU: what near pairs of sums by a mesh share whatever their precision. Included by kernel
 * files only. */
#ifndef GBG_BACKEND_CPU_EWALD_NEAR_H
#define GBG_BACKEND_CPU_EWALD_NEAR_H

#include <math.h>
#include <string.h>

#include "backend/cpu/ewald.h"
#include "backend/cpu/ewald_cells.h"
#include "backend/cpu/ewald_law.h"
#include "backend/cpu/ewald_squeeze.h"
#include "backend/cpu/power.h"

/* Sums have as many lanes whatever the instruction set: pair number j of a particle goes to lane
 * j % GBG_NEAR_LANES, all from a piece of its candidates. A strip holds the particles around a run
 * of cells of a row; a batch the pairs within the reach of some of them. */
enum {
    GBG_NEAR_LANES = 16,
    GBG_NEAR_RUN = 4,      /* terms that a lane adds in single precision */
    GBG_NEAR_PIECE = 1024, /* candidates */
    GBG_NEAR_STRIP = 4096, /* particles; whole pieces */
    GBG_NEAR_BATCH = 2048, /* pairs */
    GBG_NEAR_SEGMENTS = 256,
    GBG_NEAR_COLUMNS = 32, /* cells a task */
    GBG_NEAR_BLOCK = 4,    /* vectors whose polynomials run side by side */
    GBG_NEAR_SPARE = 80    /* elements written or read beyond the end of an array */
};

/* Pairs closer than so many units of their words are summed in double precision (relative error
 * of the others from their words below 1e-7 a power). */
#define GBG_NEAR_FINEST 0x1p23

#define GBG_ALWAYS static inline __attribute__((always_inline))

/* One sum. Differences are in words of the coarsest axis, squared distances in the law in units of
 * the largest power of two of them that the reach is not below, so that nothing is rounded. */
struct gbg_near_sum {
    const struct gbg_state *state;
    const struct gbg_ewald_order *order;
    int uniform;          /* 1: all sources are alike */
    int dimension, power; /* power 0: not a whole one */
    double exponent;      /* -(power + 1)/2 */
    int degree;
    double near[GBG_SPLIT_DEGREE + 1];  /* coefficients of the polynomial in z, in reaches */
    double minus[GBG_SPLIT_DEGREE + 1]; /* the same in units, the other sign */
    float single[GBG_SPLIT_DEGREE + 1];
    double ratio[3]; /* words of an axis over the coarsest */
    double length;   /* the reach */
    double limit;    /* its square in words */
    double inverse;  /* 1/unit^2 in words */
    double slope;    /* z = slope u - 1 */
    double finest;   /* square of GBG_NEAR_FINEST */
    double factor;   /* from sums to fields */
};

/* Pairs `at`.. of a batch: those of particle k (sorted) with the candidates from number `from` on
 * of its own. */
struct gbg_near_segment {
    int32_t k, at, count, from, candidates;
};

#endif
