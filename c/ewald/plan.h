/* Numbers of long-range sums: all that a backend needs to know of a sum: the split, the window, the
 * mesh and what each of its waves is multiplied by. */
#ifndef GBG_EWALD_PLAN_H
#define GBG_EWALD_PLAN_H

#include <stdint.h>

#include "ewald/split.h"
#include "ewald/window.h"

enum gbg_ewald_gradient {
    GBG_GRADIENT_WAVES, /* each wave by i k: a transform back an axis */
    GBG_GRADIENT_WINDOW /* slope of the window: one transform back, wider windows */
};

/* Terms of the near part that single precision needs: left out is this much of its largest value.
 */
#define GBG_SINGLE_ERROR 3e-8

/* What is asked for. */
struct gbg_ewald_choice {
    int dimension;
    double length[3];
    double power;
    int split;    /* enum gbg_split_kind */
    int window;   /* enum gbg_ewald_window_kind */
    int gradient; /* enum gbg_ewald_gradient */
    int single;   /* 1: mesh, near pairs and their sums in single precision, from high words */
    double reach; /* of near pairs, at most half the shortest length */
    double band;
    int32_t cells[3]; /* even, no prime factor above 7, at least the width */
    int width;
};

struct gbg_ewald_plan {
    struct gbg_ewald_choice choice;
    struct gbg_split split;
    struct gbg_ewald_window window[3]; /* an axis, for meshes that are not equally fine */
};

/* Hidden from users, shared with the program's benchmarks. */
#pragma GCC visibility push(default)
/* Checks a choice and makes the tables; GBG_E_ARGUMENT (no message) if it cannot be. With single
 * the near part has the terms that single precision needs. */
int gbg_ewald_plan_make(const struct gbg_ewald_choice *choice, struct gbg_ewald_plan *plan);
#pragma GCC visibility pop
/* As gbg_split_loss, of split and mesh together: the error of the force that this plan is expected
 * to make, before rounding. */
double gbg_ewald_plan_loss(const struct gbg_ewald_plan *plan);
/* The next number of cells that a transform is fast for: even, factors 2, 3, 5, 7 only; 0 beyond
 * 2^30. */
int32_t gbg_ewald_cells(double least);

/* Factors of waves n_a = 0 .. cells[a]/2 of one axis, n and -n alike, of which every row is made;
 * f = n_a/cells[a]. Arrays of cells[a]/2 + 1. */
struct gbg_ewald_axis {
    double *square; /* transform(f)^2 */
    double *power;  /* sum over aliases of transform^2 */
    double *slope;  /* sum over aliases of slope^2, as waves: (2 pi cells/length)^2 */
};
void gbg_ewald_fill_axis(const struct gbg_ewald_plan *plan, int a, struct gbg_ewald_axis *axis);
/* Influence of waves n_0 = 0..cells[0]/2 at n_1, n_2 (each 0..cells/2): the real number that the
 * transform of spread sources is multiplied by to become that of the potential on the mesh; the
 * field is -i k times that (GBG_GRADIENT_WAVES). It holds the far part over the volume, over the
 * window's transforms both ways, so that aliases do least harm (Hockney and Eastwood). The
 * transforms are plain sums, forward with exp(-i k x); waves at cells/2 are zero. */
void gbg_ewald_fill_row(const struct gbg_ewald_plan *plan, const struct gbg_ewald_axis axis[3],
                        int32_t n1, int32_t n2, double *row);

#endif
