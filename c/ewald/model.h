/* Numbers of long-range sums: from the error that is asked for to reach, band, mesh and window. */
#ifndef GBG_EWALD_MODEL_H
#define GBG_EWALD_MODEL_H

#include <stdint.h>

#include "ewald/plan.h"

/* What the choice depends on, and what the caller has settled himself (0 or -1: not). */
struct gbg_ewald_wish {
    int dimension;
    double length[3];
    double power;
    int64_t n;
    double tolerance;            /* relative RMS force error */
    int split, window, gradient; /* as in gbg_ewald_choice; -1: prolate, prolate, waves */
    int single;                  /* -1: by the tolerance */
    double reach;                /* 0: the cheapest */
    double pair_cost, wave_cost,
        node_cost; /* ns a pair looked at, a mesh cell (all transforms), a
                      node touched (both ways): 0: those of this machine class */
};

/* Hidden from users, shared with the program's benchmarks. */
#pragma GCC visibility push(default)

/* The finest tolerance that gbg_ewald_choose takes. */
double gbg_ewald_finest(const struct gbg_ewald_wish *wish);

/* Chooses; *predicted: relative RMS force error by the model, *cost: ns a particle. GBG_E_ARGUMENT
 * (no message) for a tolerance above 0.1 or below what double precision reaches for this power. */
int gbg_ewald_choose(const struct gbg_ewald_wish *wish, struct gbg_ewald_choice *choice,
                     double *predicted, double *cost);

#pragma GCC visibility pop

#endif
