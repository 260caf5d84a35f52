/* L1: lengths that decide which pairs a list holds and how fine its coordinates are, the same for
 * every backend. */
#ifndef GBG_BACKEND_CPU_LIST_LENGTHS_H
#define GBG_BACKEND_CPU_LIST_LENGTHS_H

#include "backend/backend.h"
#include "backend/cpu/grid.h"

/* Local coordinates: see struct gbg_list. */
GBG_INLINE void gbg_list_choose_shift(const struct gbg_box *box, double reach, int shift[3],
                                      double unit[3], float scale[3])
{
    for (int a = 0; a < box->dimension; a++) {
        double period = box->length[a];
        int count = 0;
        while (count < 31 && period * 0.5 >= 8.0 * reach) {
            period *= 0.5;
            count++;
        }
        shift[a] = count;
        unit[a] = period * 0x1p-32;
        scale[a] = (float)unit[a];
    }
}

/* The search runs on high words, each difference of which is off by less than a unit; the limit has
 * room for that and for the rounding. A row may so hold neighbours a little beyond the radius,
 * which nobody minds. Lengths are in units of the radius. Returns 1 if high words are too coarse
 * for the radius: rows are to be sifted afterwards. */
GBG_INLINE int gbg_list_choose_search(const struct gbg_box *box, double radius, float unit[3],
                                      float *limit)
{
    double error = 0.0;
    for (int a = 0; a < box->dimension; a++) {
        double length = box->length[a] * 0x1p-32 / radius;
        unit[a] = (float)length;
        error += length;
    }
    *limit = (float)((1.0 + error) * (1.0 + error) * (1.0 + 2e-6));
    return error > 1e-3;
}

/* 1 if two particles are within the root of `limit` by all 64 bits. */
GBG_INLINE int gbg_list_holds(const struct gbg_state *state, int64_t i, int64_t j, double limit)
{
    double squared = 0.0;
    for (int a = 0; a < state->box.dimension; a++) {
        double d = gbg_box_difference(&state->box, a, gbg_join(state->high[a][i], state->low[a][i]),
                                      gbg_join(state->high[a][j], state->low[a][j]));
        squared += d * d;
    }
    return squared <= limit;
}

/* How far apart in memory neighbours stand (list_scatter): of every STRIDE-th slice are counted the
 * places that are named and the lines they lie in. */
enum { GBG_SCATTER_STRIDE = 61, GBG_SCATTER_LINE = 16, GBG_SIEVE_PLACES = 16384 };

/* A number's place in a sieve, a set in which two rarely share a place. */
GBG_INLINE uint32_t gbg_sieve_place(uint32_t number)
{
    return number * UINT32_C(2654435769) >> 18;
}

#endif
