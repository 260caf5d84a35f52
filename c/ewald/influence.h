/* Numbers of long-range sums: influence of one wave, the same lines on the CPU and on a GPU. */
#ifndef GBG_EWALD_INFLUENCE_H
#define GBG_EWALD_INFLUENCE_H

#include <math.h>

#include "core/inline.h"
#include "ewald/split.h"

/* What the far part's transform is made of (ewald/split.h). */
struct gbg_far {
    int dimension;
    double power, unit, reach, band, rest, slope;
    const double *table; /* octaves, panels, terms */
};

static inline struct gbg_far gbg_far_of(const struct gbg_split *split)
{
    struct gbg_far far = {split->dimension, split->power,        split->unit,
                          split->reach,     split->band,         split->far_rest,
                          split->far_slope, &split->far[0][0][0]};
    return far;
}

/* Below the table the profile's transform is that of q = 0. */
GBG_INLINE double gbg_far_below(const struct gbg_far *far, double k)
{
    double power = far->dimension + 1 - far->power, q = k * far->unit;
    double first = ldexp(far->band * far->unit / far->reach, -GBG_FAR_OCTAVES);
    double rest = power == 0 ? log(first / q) : (pow(first, power) - pow(q, power)) / power;
    return pow(k, -power) * (far->rest + far->slope * rest);
}

/* gbg_split_far. */
GBG_INLINE double gbg_far_at(const struct gbg_far *far, double k)
{
    double x = k * far->reach / far->band;
    if (!(x > 0 && x < 1)) {
        return 0;
    }
    int exponent;
    double z = (2 * frexp(x, &exponent) - 1) * (double)GBG_FAR_PANELS;
    if (-exponent >= GBG_FAR_OCTAVES) {
        return gbg_far_below(far, k);
    }
    int panel = (int)z;
    const double *term = far->table + (-exponent * GBG_FAR_PANELS + panel) * GBG_FAR_TERMS;
    double sum = 0;
    z = 2 * (z - panel) - 1;
    for (int m = GBG_FAR_TERMS - 1; m >= 0; m--) {
        sum = sum * z + term[m];
    }
    return sum;
}

/* What the windows make of a wave, both ways, by the factors of gbg_ewald_axis (1, 1, 0 for an axis
 * that is not there): Hockney and Eastwood's least harm by aliases. */
GBG_INLINE double gbg_ewald_both_ways(int by_waves, double squared_wave, const double square[3],
                                      const double power[3], const double slope[3])
{
    double all = power[0] * power[1] * power[2];
    double slopes =
        (slope[0] * power[1] + slope[1] * power[0]) * power[2] + slope[2] * power[0] * power[1];
    return square[0] * square[1] * square[2] *
           (by_waves ? 1 / (all * all) : squared_wave / (all * slopes));
}

#endif
