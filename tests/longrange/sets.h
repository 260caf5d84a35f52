/* Sets of particles that long-range sums are measured on, and what an error is measured over. */
#ifndef GBG_TESTS_LONGRANGE_SETS_H
#define GBG_TESTS_LONGRANGE_SETS_H

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "core/random.h"
#include "ewald/reference.h"

enum set_kind { SET_JITTERED, SET_RANDOM, SET_DISCS, SET_CLUSTERED, SET_KINDS };
static const char *const set_names[SET_KINDS] = {"jittered", "random", "discs", "clustered"};

/* Coordinates are multiples of 2^-40 of the lengths, in [0, length): as fixed-point fractions they
 * are the same places, if the lengths have at most 13 significant bits. */
struct particle_set {
    int dimension;
    double length[3]; /* 1 beyond the dimension */
    int64_t n;
    double *position[3];
    double *alpha;
    double diameter; /* of hard cores, 0 in sets without */
};

static inline double set_uniform(uint32_t seed, int64_t i, uint64_t which)
{
    struct gbg_philox w =
        gbg_philox(gbg_philox_counter(which, (uint64_t)i, GBG_STREAM_START), seed, 0x5e75u);
    return gbg_uniform(w.word[0], w.word[1]);
}

static inline double set_normal(uint32_t seed, int64_t i, uint64_t which)
{
    return sqrt(-2.0 * log(set_uniform(seed, i, which))) *
           cos(6.283185307179586 * set_uniform(seed, i, which + 32));
}

/* Any coordinate over the length, into the box and onto the grid of 2^-40. */
static inline double set_fold(double length, double fraction)
{
    fraction = floor((fraction - floor(fraction)) * 0x1p40) * 0x1p-40;
    return fraction < 1.0 ? fraction * length : 0.0;
}

/* Sites of a rectangular lattice, at least n of them, about equally far apart on all axes. */
static inline void set_lattice(const struct particle_set *s, int64_t sites[3])
{
    double volume = s->length[0] * s->length[1] * s->length[2];
    double spacing = pow(volume / (double)(s->n > 0 ? s->n : 1), 1.0 / s->dimension);
    for (int a = 0; a < 3; a++) {
        sites[a] = a < s->dimension ? (int64_t)ceil(s->length[a] / spacing - 1e-9) : 1;
    }
    for (int a = 0; a < s->dimension; a++) {
        while (sites[a] > 1 && sites[0] * sites[1] * sites[2] / sites[a] * (sites[a] - 1) >= s->n) {
            sites[a]--;
        }
    }
}

/* Site p of n, spread evenly over the lattice, moved by up to half of `jitter` spacings an axis. */
static inline void set_on_lattice(struct particle_set *s, double jitter, uint32_t seed)
{
    int64_t sites[3];
    set_lattice(s, sites);
    double all = (double)(sites[0] * sites[1] * sites[2]);
    for (int64_t i = 0; i < s->n; i++) {
        int64_t left = (int64_t)floor(((double)i + 0.5) * all / (double)s->n);
        for (int a = 0; a < s->dimension; a++) {
            double cell = (double)(left % sites[a]) + 0.5;
            cell += jitter * (set_uniform(seed, i, (uint64_t)a) - 0.5);
            s->position[a][i] = set_fold(s->length[a], cell / (double)sites[a]);
            left /= sites[a];
        }
    }
}

static inline void set_at_random(struct particle_set *s, uint32_t seed)
{
    for (int a = 0; a < s->dimension; a++) {
        for (int64_t i = 0; i < s->n; i++) {
            s->position[a][i] = set_fold(s->length[a], set_uniform(seed, i, (uint64_t)a));
        }
    }
}

/* 64 normal blobs, of widths 1e-3 to 3e-2 of the shortest length, all logarithms equally likely. */
static inline void set_in_clusters(struct particle_set *s, uint32_t seed)
{
    double shortest = s->length[0];
    for (int a = 1; a < s->dimension; a++) {
        shortest = fmin(shortest, s->length[a]);
    }
    for (int64_t i = 0; i < s->n; i++) {
        int64_t blob = i % 64;
        double width = shortest * 1e-3 * pow(30.0, set_uniform(seed, blob, 16));
        for (int a = 0; a < s->dimension; a++) {
            double centre = set_uniform(seed, blob, 17 + (uint64_t)a);
            double x = width * set_normal(seed, i, (uint64_t)a);
            s->position[a][i] = set_fold(s->length[a], centre + x / s->length[a]);
        }
    }
}

/* Cells so small that each holds the centre of one disc at most. */
struct set_cells {
    int64_t count[3];
    int32_t *disc; /* -1: none */
    double diameter;
};

static inline int64_t set_cell(const struct particle_set *s, const struct set_cells *c,
                               const double *x, int64_t place[3])
{
    int64_t index = 0;
    for (int a = s->dimension; a-- > 0;) {
        place[a] = (int64_t)floor(x[a] / s->length[a] * (double)c->count[a]);
        place[a] = place[a] < c->count[a] ? place[a] : c->count[a] - 1;
        index = index * c->count[a] + place[a];
    }
    return index;
}

/* 1: a disc at x overlaps none. Cells may be seen twice in tiny boxes. */
static inline int set_is_free(const struct particle_set *s, const struct set_cells *c,
                              const double *x)
{
    int64_t place[3] = {0, 0, 0};
    if (c->disc[set_cell(s, c, x, place)] >= 0) {
        return 0;
    }
    int deep = s->dimension == 3;
    for (int64_t dz = deep ? -2 : 0; dz <= (deep ? 2 : 0); dz++) {
        for (int64_t dy = -2; dy <= 2; dy++) {
            for (int64_t dx = -2; dx <= 2; dx++) {
                int64_t step[3] = {dx, dy, dz}, index = 0;
                for (int a = s->dimension; a-- > 0;) {
                    int64_t at = (place[a] + step[a]) % c->count[a];
                    index = index * c->count[a] + (at < 0 ? at + c->count[a] : at);
                }
                int32_t j = c->disc[index];
                if (j < 0) {
                    continue;
                }
                double squared = 0.0;
                for (int a = 0; a < s->dimension; a++) {
                    double d = x[a] - s->position[a][j];
                    d -= s->length[a] * rint(d / s->length[a]);
                    squared += d * d;
                }
                if (squared < c->diameter * c->diameter) {
                    return 0;
                }
            }
        }
    }
    return 1;
}

/* Random sequential insertion: each disc at the first random place where it overlaps none before
 * it. 0: a disc found none in many trials. */
static inline int set_insert(struct particle_set *s, struct set_cells *c, uint32_t seed)
{
    uint64_t trial = 0;
    for (int64_t i = 0; i < s->n; i++) {
        int placed = 0;
        for (int k = 0; k < 200000 && !placed; k++, trial++) {
            double x[3] = {0};
            int64_t place[3];
            for (int a = 0; a < s->dimension; a++) {
                double fraction = set_uniform(seed, (int64_t)trial, 64 + (uint64_t)a);
                x[a] = set_fold(s->length[a], fraction);
            }
            placed = set_is_free(s, c, x);
            for (int a = 0; a < s->dimension && placed; a++) {
                s->position[a][i] = x[a];
            }
            if (placed) {
                c->disc[set_cell(s, c, x, place)] = (int32_t)i;
            }
        }
        if (!placed) {
            return 0;
        }
    }
    return 1;
}

/* Hard discs at packing 0.4, hard balls at 0.2; less where a small box has no room for so few. 0:
 * no memory. */
static inline int set_of_discs(struct particle_set *s, uint32_t seed)
{
    const double pi = 3.141592653589793;
    double each = s->length[0] * s->length[1] * s->length[2] / (double)(s->n > 0 ? s->n : 1);
    int placed = 0;
    s->diameter = s->dimension == 2 ? sqrt(0.4 * each * 4.0 / pi) : cbrt(0.2 * each * 6.0 / pi);
    for (int a = 0; a < s->dimension; a++) {
        s->diameter = fmin(s->diameter, s->length[a]);
    }
    for (; !placed; s->diameter *= placed ? 1.0 : 0.95) {
        struct set_cells c = {.count = {1, 1, 1}, .diameter = s->diameter};
        int64_t all = 1;
        for (int a = 0; a < s->dimension; a++) {
            double cells = s->length[a] / s->diameter * sqrt(s->dimension) * 1.0001;
            c.count[a] = (int64_t)ceil(cells);
            all *= c.count[a];
        }
        c.disc = malloc((size_t)all * sizeof *c.disc);
        if (!c.disc) {
            return 0;
        }
        memset(c.disc, 0xff, (size_t)all * sizeof *c.disc);
        placed = set_insert(s, &c, seed);
        free(c.disc);
    }
    return 1;
}

static inline void set_free(struct particle_set *s)
{
    for (int a = 0; a < 3; a++) {
        free(s->position[a]);
        s->position[a] = NULL;
    }
    free(s->alpha);
    s->alpha = NULL;
}

/* Makes n particles, n below 2^31; alpha: in [0.5, 1.5], or of alternating sign +1, -1 (ids even,
 * odd). The same arguments make the same set. 0: no memory. */
static inline int set_make(struct particle_set *s, enum set_kind kind, int dimension,
                           const double *length, int64_t n, int alternating, uint32_t seed)
{
    int made = 1;
    memset(s, 0, sizeof *s);
    s->dimension = dimension;
    s->n = n;
    s->alpha = malloc((size_t)(n + 1) * sizeof *s->alpha);
    for (int a = 0; a < 3; a++) {
        s->length[a] = a < dimension ? length[a] : 1.0;
        s->position[a] = a < dimension ? malloc((size_t)(n + 1) * sizeof(double)) : NULL;
        made = made && (s->position[a] || a >= dimension);
    }
    if (!s->alpha || !made) {
        set_free(s);
        return 0;
    }
    for (int64_t i = 0; i < n; i++) {
        s->alpha[i] = alternating ? (i & 1 ? -1.0 : 1.0) : 0.5 + set_uniform(seed, i, 48);
    }
    if (kind == SET_JITTERED) {
        set_on_lattice(s, 0.5, seed);
    } else if (kind == SET_RANDOM) {
        set_at_random(s, seed);
    } else if (kind == SET_CLUSTERED) {
        set_in_clusters(s, seed);
    } else if (!set_of_discs(s, seed)) {
        set_free(s);
        return 0;
    }
    return 1;
}

/* The set as sources of the reference. */
static inline struct gbg_ewald_sources set_sources(const struct particle_set *s, double power)
{
    struct gbg_ewald_sources sources = {
        .dimension = s->dimension, .power = power, .n = s->n, .alpha = s->alpha};
    for (int a = 0; a < s->dimension; a++) {
        sources.length[a] = s->length[a];
        sources.position[a] = s->position[a];
    }
    return sources;
}

/* Different particles that stand for all: fills `target` and returns how many, at most n. */
static inline int64_t set_targets(int64_t n, int64_t n_targets, uint32_t seed, int32_t *target)
{
    n_targets = n_targets < n ? n_targets : n;
    for (int64_t t = 0; t < n_targets; t++) {
        int64_t first = n / n_targets * t + n % n_targets * t / n_targets;
        int64_t end = n / n_targets * (t + 1) + n % n_targets * (t + 1) / n_targets;
        target[t] = (int32_t)(first + (int64_t)(set_uniform(seed, t, 49) * (double)(end - first)));
    }
    return n_targets;
}

/* An error over the root mean square of the force and over its median size. The first says little
 * where a few close pairs make most of the square. */
struct set_error {
    double over_rms, over_median;
};

static inline int set_compare(const void *a, const void *b)
{
    const double *x = (const double *)a, *y = (const double *)b;
    return (*x > *y) - (*x < *y);
}

/* Error of force[axis][i] against exact[axis][i]; NaN if a force is. */
static inline struct set_error set_error_of(int dimension, int64_t n, const double *const *force,
                                            const double *const *exact)
{
    struct set_error error = {NAN, NAN};
    double *size = malloc((size_t)(n + 1) * sizeof *size);
    double wrong = 0.0, whole = 0.0;
    for (int64_t i = 0; size && i < n; i++) {
        double squared = 0.0;
        for (int a = 0; a < dimension; a++) {
            double difference = force[a][i] - exact[a][i];
            wrong += difference * difference;
            squared += exact[a][i] * exact[a][i];
        }
        whole += squared;
        size[i] = sqrt(squared);
    }
    if (size && n > 0) {
        qsort(size, (size_t)n, sizeof *size, set_compare);
        double median = 0.5 * (size[(n - 1) / 2] + size[n / 2]);
        error.over_rms = sqrt(wrong / whole);
        error.over_median = sqrt(wrong / (double)n) / median;
    }
    free(size);
    return error;
}

#endif
