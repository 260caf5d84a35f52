/* Numbers of long-range sums: what the files of the reference share. */
#ifndef GBG_EWALD_REFERENCE_PARTS_H
#define GBG_EWALD_REFERENCE_PARTS_H

#include <stdint.h>

/* Upper incomplete gamma functions by Gauss's rule. */
enum { GBG_GAMMA_NODES = 16 };
#define GBG_GAMMA_PANEL 0.75
struct gbg_gamma_rule {
    double node[GBG_GAMMA_NODES], weight[GBG_GAMMA_NODES]; /* on [-1, 1] */
    double grown[GBG_GAMMA_NODES];                         /* exp(node PANEL/2) */
};
void gbg_gamma_rule_make(struct gbg_gamma_rule *rule);
/* x^-order Gamma(order, x) = Int_1^inf t^(order-1) exp(-x t) dt for any real order and x > 0:
 * relative error below 2e-15 for orders from -3 to 4. */
double gbg_gamma_tail(const struct gbg_gamma_rule *rule, double order, double x);

/* Both parts of the potential of a unit source, r^-s/s with s = power-1 (-log r for s = 0): the
 * short one belongs to scales above a^2 in r^-s ~ Int t^(s/2-1) exp(-r^2 t) dt, the long one to
 * those below. */
struct gbg_reference_law {
    int dimension;
    double power, a;
    double force_unit, potential_unit, wave_unit;
    double self; /* long potential at the source's place */
    double mean; /* of the short potential, integral over all space (reference.h) */
    struct gbg_gamma_rule rule;
};
void gbg_reference_law_make(int dimension, double power, double a, double volume,
                            struct gbg_reference_law *law);
/* Short force over r_vec and short potential by a^2 r^2, transform of the long one by k^2. */
double gbg_reference_short(const struct gbg_reference_law *law, double x);
double gbg_reference_short_potential(const struct gbg_reference_law *law, double x);
double gbg_reference_wave(const struct gbg_reference_law *law, double squared_k);

/* Both parts end where exp(-a^2 r^2) and exp(-k^2/4a^2) are exp(-42). */
#define GBG_REFERENCE_END 42.0

/* Polynomials of the short part in x = a^2 r^2: equal panels in each octave, so that the leading
 * bits of x are the panel and the others the place in it. */
enum {
    GBG_REFERENCE_TERMS = 10,
    GBG_REFERENCE_PANEL_BITS = 4,
    GBG_REFERENCE_LOWEST = -26, /* exponent of the first octave */
    GBG_REFERENCE_OCTAVES = 32,
    GBG_REFERENCE_PANELS = GBG_REFERENCE_OCTAVES << GBG_REFERENCE_PANEL_BITS
};
typedef double gbg_reference_panel[GBG_REFERENCE_TERMS];
/* Panels from `first` on, those below are left as they are. */
void gbg_reference_table_make(const struct gbg_reference_law *law, int potential, int threads,
                              int64_t first, gbg_reference_panel *table);

/* Waves n >= 0 of three axes; axis 0 is the longest of the box. Waves of axis 0 stand in tiles of
 * 8: 8 cosines, then 8 sines. A group is 4 products of cosines and sines of the other axes: in the
 * plane cos, sin of wave y of axis 1, then of y + 1; in space cos cos, cos sin, sin cos, sin sin of
 * wave y of axis 1 and z of axis 2. */
enum {
    GBG_REFERENCE_BATCH = 64, /* sources at a time */
    GBG_REFERENCE_WAVES = 8,
    GBG_REFERENCE_TILE = 2 * GBG_REFERENCE_WAVES,
    GBG_REFERENCE_ROWS = 4,
    GBG_REFERENCE_BLOCK = 512 /* sources that are looked at for pairs at a time */
};
struct gbg_reference_group {
    int32_t y, z, tiles;
    int64_t first; /* of its sums: [tiles][ROWS][TILE] */
};
struct gbg_reference_waves {
    int dimension;
    int32_t tiles[3]; /* of phases, on each axis */
    double unit[3];   /* 2 pi/length */
    int64_t n_groups, n_sums;
    struct gbg_reference_group *group;
};

/* Everything about pairs; lengths and coordinates in the order of the waves' axes. */
struct gbg_reference_near {
    int dimension;
    double length[3];
    double cut, squared_a;
    const struct gbg_reference_law *law;
    const gbg_reference_panel *force, *potential;
    int64_t first; /* panel that the tables begin with; PANELS: there are none */
    int with_potential;
    const double *position[3], *alpha; /* in [0, length) */
};

/* Sums with what their rounding lost: force on each axis, potential. */
struct gbg_reference_field {
    double sum[4], rest[4];
};

/* Loops that are compiled once for each instruction set. */
struct gbg_reference_kernels {
    /* phase[tile][b][TILE] of n <= BATCH coordinates; high + low: the fractions of the length, high
     * in [-1/2, 1/2] a multiple of 2^-53. Good to 6e-16. */
    void (*phases)(int64_t n, const double *high, const double *low, int32_t tiles, double *phase);
    /* Adds the products of a batch to all sums. */
    void (*add)(const struct gbg_reference_waves *waves, int64_t n, const double *alpha,
                const double *const *phase, double *sum, double *rest);
    /* Minus the gradient of the sum of coefficient * product at place b of a batch, and the sum. */
    void (*evaluate)(const struct gbg_reference_waves *waves, const double *coefficient, int64_t b,
                     const double *const *phase, double *field);
    /* Adds the short part of sources begin..end-1 in one image, nearest or shifted from it. What
     * coincides with the target has no force and minus its long part as its potential. */
    void (*near)(const struct gbg_reference_near *near, int64_t begin, int64_t end,
                 const double *target, const double *shift, struct gbg_reference_field *field);
};
/* The best set for the instructions named in a context ("avx512", "avx2", other: generic). */
const struct gbg_reference_kernels *gbg_reference_kernels_of(const char *instructions);

#define GBG_REFERENCE_JOIN_EXPANDED(a, b) a##_##b
#define GBG_REFERENCE_JOIN(a, b) GBG_REFERENCE_JOIN_EXPANDED(a, b)
#define GBG_REFERENCE_NAME(name) GBG_REFERENCE_JOIN(name, GBG_ISA)

#endif
