/* L1: neighbour search: which cells, the key of a particle, and the rule that decides about a pair:
 * what every backend has in common. */
#ifndef GBG_BACKEND_CPU_SEARCH_FRAME_H
#define GBG_BACKEND_CPU_SEARCH_FRAME_H

#include <stdint.h>

#include "backend/backend.h"
#include "core/box.h"

struct gbg_context;

struct gbg_search_frame {
    struct gbg_box box;
    struct gbg_search_plan plan; /* of what is stored */
    int64_t n;

    /* Cells: key = cell << sub | octant, x fastest. A key's interval is half open and found from
     * the fraction by integers alone. */
    /* Where all particles stand in a part of an axis, cells cover only that: fractions are counted
     * from `origin` and their top `zoom` bits, which are zero, dropped. */
    uint64_t origin[3];
    int zoom[3], crowded; /* crowded: larger cells were taken than asked for */
    int cells[3], around[3], sub;
    int64_t n_keys;

    /* 32-bit coordinates: the top `shift` bits of a fraction are dropped and the next 32 kept; the
     * period is more than twice the largest distance of a candidate. */
    int shift[3];
    float scale[3];     /* unit of a local coordinate over the radius in question */
    float sure, likely; /* squared distance below which a pair is one, and above which not */
    double squared;     /* radius radius */
};

/* The whole box again, before cells are chosen for a new set. */
void gbg_search_frame_start(struct gbg_search_frame *frame);
/* Cells for a reach (the radius, with a skin more) and the shifts of local coordinates. */
int gbg_search_frame_choose(struct gbg_context *context, struct gbg_search_frame *frame,
                            double reach);
/* Cells only for the part of axis `a` that the particles take, if it is less than half: a power of
 * two. `first` is the fraction of any particle; low <= 0 and high >= 0 are the least and the
 * largest difference to it. 0: the axis is taken as it is. */
int gbg_search_frame_zoom(struct gbg_search_frame *frame, int a, uint64_t first, int64_t low,
                          int64_t high);
/* Squared distances in units of the radius: below `sure` a float says yes, above `likely` no. */
void gbg_search_frame_radius(struct gbg_search_frame *frame, double radius);
/* The largest squared move for which a list with this skin is good. */
double gbg_search_frame_slack(const struct gbg_search_frame *frame);
/* The reach of a list: a part in 10^12 more, so that a rounded sum of two roundings cannot lose a
 * pair. */
double gbg_search_frame_reach(const struct gbg_search_frame *frame);
/* Numbers of cells and shortest edge of one, for a report. */
void gbg_search_frame_report(const struct gbg_search_frame *frame,
                             struct gbg_search_report *report);

/* Key of a particle; dimension and sub are those of the frame, as constants where it matters. */
GBG_INLINE int32_t gbg_search_key(const struct gbg_search_frame *frame, uint64_t *const fraction[3],
                                  int64_t i, int dimension, int sub)
{
    uint32_t cell = 0, octant = 0;
    for (int a = dimension - 1; a >= 0; a--) {
        uint64_t high = (fraction[a][i] - frame->origin[a]) << frame->zoom[a] >> 32;
        uint64_t halves = high * (uint64_t)(frame->cells[a] << (sub > 0)) >> 32;
        cell = cell * (uint32_t)frame->cells[a] + (uint32_t)(halves >> (sub > 0));
        octant |= sub ? (uint32_t)(halves & 1) << a : 0;
    }
    return (int32_t)(cell << sub | octant);
}

/* Squared length of a difference of places, p[i] - q[j]: exact differences, each turned into a
 * length by one rounding of the integer and one of the product, squares summed in order. */
GBG_INLINE double gbg_search_squared(const struct gbg_search_frame *frame, int dimension,
                                     uint64_t *const p[3], int64_t i, uint64_t *const q[3],
                                     int64_t j)
{
    double sum = 0.0;
    for (int a = 0; a < dimension; a++) {
        double d = gbg_box_difference(&frame->box, a, p[a][i], q[a][j]);
        sum += d * d;
    }
    return sum;
}

/* The rule that decides about a pair, the same for every method. */
GBG_INLINE int gbg_search_rule(const struct gbg_search_frame *frame, int dimension,
                               uint64_t *const fraction[3], int64_t i, int64_t j)
{
    return gbg_search_squared(frame, dimension, fraction, i, fraction, j) <= frame->squared;
}

GBG_INLINE uint32_t gbg_search_local(uint64_t fraction, int shift)
{
    return (uint32_t)(fraction << shift >> 32);
}

struct gbg_search_span {
    int begin, end;
};

/* Cells c - around .. c + around of a periodic axis, each once, in ascending order. */
GBG_INLINE int gbg_search_spans(const struct gbg_search_frame *frame, int a, int c, int octant,
                                struct gbg_search_span out[2])
{
    int cells = frame->cells[a], low = c - frame->around[a], high = c + frame->around[a];
    if (frame->sub) { /* the half of the cell says which neighbour the ball can touch */
        int upper = octant >> a & 1;
        low = upper ? c : c - 1;
        high = upper ? c + 1 : c;
    }
    if (high - low + 1 >= cells) {
        out[0].begin = 0;
        out[0].end = cells;
        return 1;
    }
    if (low >= 0 && high < cells) {
        out[0].begin = low;
        out[0].end = high + 1;
        return 1;
    }
    out[0].begin = 0;
    out[0].end = low < 0 ? high + 1 : high - cells + 1;
    out[1].begin = low < 0 ? low + cells : low;
    out[1].end = cells;
    return 2;
}

#endif
