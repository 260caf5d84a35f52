/* Numbers of long-range sums: loops of the reference. Compiled once for each instruction set. */
#include <stdint.h>
#include <string.h>

#include "ewald/reference_parts.h"

/* Vectors of doubles, as long as the instruction set has them. */
#if defined(__AVX512F__)
#include <immintrin.h>
enum { LANES = 8 };
typedef __m512d vector;
static inline vector multiply_add(vector a, vector b, vector c)
{
    return _mm512_fmadd_pd(a, b, c);
}
#elif defined(__AVX2__) && defined(__FMA__)
#include <immintrin.h>
enum { LANES = 4 };
typedef __m256d vector;
static inline vector multiply_add(vector a, vector b, vector c)
{
    return _mm256_fmadd_pd(a, b, c);
}
#else
enum { LANES = 2 };
typedef double vector __attribute__((vector_size(16)));
static inline vector multiply_add(vector a, vector b, vector c)
{
    return a * b + c;
}
#endif

#ifdef __FP_FAST_FMA
#define FUSED(a, b, c) __builtin_fma(a, b, c)
#else
#define FUSED(a, b, c) ((a) * (b) + (c))
#endif

enum {
    BATCH = GBG_REFERENCE_BATCH,
    WAVES = GBG_REFERENCE_WAVES,
    TILE = GBG_REFERENCE_TILE,
    ROWS = GBG_REFERENCE_ROWS,
    BLOCK = GBG_REFERENCE_BLOCK
};

static inline vector load(const double *p)
{
    vector a;
    memcpy(&a, p, sizeof a);
    return a;
}

static inline void store(double *p, vector a)
{
    memcpy(p, &a, sizeof a);
}

/* To the nearest whole number, below 2^51. */
static inline double whole(double x)
{
    return (x + 0x1.8p52) - 0x1.8p52;
}

/* cos and sin of 2 pi (f + rest) for |f| <= 1/2 and a tiny rest, by Taylor's series around the
 * nearest quarter turn. */
static inline void turn(double f, double rest, double *cosine, double *sine)
{
    double quarter = whole(4.0 * f);
    double t = 6.283185307179586477 * ((f - 0.25 * quarter) + rest), z = t * t;
    double c = 4.779477332387385e-14, s = 2.8114572543455206e-15; /* 1/16!, 1/17! */
    static const double even[7] = {-1.0 / 87178291200.0,
                                   1.0 / 479001600.0,
                                   -1.0 / 3628800.0,
                                   1.0 / 40320.0,
                                   -1.0 / 720.0,
                                   1.0 / 24.0,
                                   -0.5};
    static const double odd[7] = {
        -1.0 / 1307674368000.0, 1.0 / 6227020800.0, -1.0 / 39916800.0, 1.0 / 362880.0,
        -1.0 / 5040.0,          1.0 / 120.0,        -1.0 / 6.0};
    for (int k = 0; k < 7; k++) {
        c = FUSED(c, z, even[k]);
        s = FUSED(s, z, odd[k]);
    }
    c = FUSED(c, z, 1.0);
    s = FUSED(s * z, t, t);
    /* quarter is -2..2 */
    double swapped = quarter * quarter, a = swapped == 1.0 ? s : c, b = swapped == 1.0 ? c : s;
    *cosine = quarter == 1.0 || swapped == 4.0 ? -a : a;
    *sine = quarter == -1.0 || swapped == 4.0 ? -b : b;
}

/* The first wave of each tile is found from the fraction alone, the others in it by one product. */
static void phases(int64_t n, const double *high, const double *low, int32_t tiles, double *phase)
{
    double fine[BATCH][TILE], at[BATCH] = {0.0}, stride[BATCH], cosine[BATCH], sine[BATCH];
    for (int64_t b = 0; b < n; b++) {
        stride[b] = (double)WAVES * high[b];
        stride[b] -= whole(stride[b]);
    }
    for (int w = 0; w < WAVES; w++) {
        for (int64_t b = 0; b < n; b++) {
            turn(at[b], w * low[b], &cosine[b], &sine[b]);
            at[b] += high[b];
            at[b] -= whole(at[b]);
        }
        for (int64_t b = 0; b < n; b++) {
            fine[b][w] = cosine[b];
            fine[b][WAVES + w] = sine[b];
        }
    }
    memset(at, 0, sizeof at);
    for (int32_t t = 0; t < tiles; t++) {
        for (int64_t b = 0; b < n; b++) {
            turn(at[b], (double)WAVES * t * low[b], &cosine[b], &sine[b]);
            at[b] += stride[b];
            at[b] -= whole(at[b]);
        }
        for (int64_t b = 0; b < n; b++) {
            double *to = phase + ((int64_t)t * BATCH + b) * TILE;
            double c = cosine[b], s = sine[b];
            for (int w = 0; w < WAVES; w++) {
                to[w] = FUSED(c, fine[b][w], -(s * fine[b][WAVES + w]));
                to[WAVES + w] = FUSED(s, fine[b][w], c * fine[b][WAVES + w]);
            }
        }
    }
}

/* The sum over the batch is made before it is added. */
static inline void add_tile(int64_t n, const double *column, const double (*row)[ROWS], double *sum,
                            double *rest)
{
    for (int c = 0; c < TILE; c += 2 * LANES) {
        vector total[ROWS][2];
        memset(total, 0, sizeof total);
        for (int64_t b = 0; b < n; b++) {
            vector left = load(column + b * TILE + c), right = load(column + b * TILE + c + LANES);
#pragma GCC unroll 4
            for (int r = 0; r < ROWS; r++) {
                vector factor = row[b][r] - (vector){0};
                total[r][0] = multiply_add(factor, left, total[r][0]);
                total[r][1] = multiply_add(factor, right, total[r][1]);
            }
        }
#pragma GCC unroll 4
        for (int r = 0; r < ROWS; r++) {
#pragma GCC unroll 2
            for (int h = 0; h < 2; h++) {
                int at = r * TILE + c + h * LANES;
                vector old = load(sum + at), more = total[r][h], new = old + more;
                vector part = new - old, lost = (old - (new - part)) + (more - part);
                store(sum + at, new);
                store(rest + at, load(rest + at) + lost);
            }
        }
    }
}

/* A wave of a batch: its cosine at place b; the sine is WAVES further. */
static inline const double *at_wave(const double *phase, int32_t n, int64_t b)
{
    return phase + ((int64_t)(n / WAVES) * BATCH + b) * TILE + n % WAVES;
}

static inline void factors(const struct gbg_reference_waves *waves,
                           const struct gbg_reference_group *group, const double *const *phase,
                           int64_t b, double factor[ROWS])
{
    const double *y = at_wave(phase[1], group->y, b);
    if (waves->dimension == 2) {
        const double *next = at_wave(phase[1], group->y + 1, b);
        factor[0] = y[0];
        factor[1] = y[WAVES];
        factor[2] = next[0];
        factor[3] = next[WAVES];
    } else {
        const double *z = at_wave(phase[2], group->z, b);
        factor[0] = y[0] * z[0];
        factor[1] = y[0] * z[WAVES];
        factor[2] = y[WAVES] * z[0];
        factor[3] = y[WAVES] * z[WAVES];
    }
}

static void add(const struct gbg_reference_waves *waves, int64_t n, const double *alpha,
                const double *const *phase, double *sum, double *rest)
{
    double row[BATCH][ROWS];
    for (int64_t g = 0; g < waves->n_groups; g++) {
        const struct gbg_reference_group *group = &waves->group[g];
        for (int64_t b = 0; b < n; b++) {
            factors(waves, group, phase, b, row[b]);
            for (int r = 0; r < ROWS; r++) {
                row[b][r] *= alpha[b];
            }
        }
        for (int32_t t = 0; t < group->tiles; t++) {
            int64_t at = group->first + (int64_t)t * ROWS * TILE;
            add_tile(n, phase[0] + (int64_t)t * BATCH * TILE, row, sum + at, rest + at);
        }
    }
}

/* Slopes of the factors along axes 1 and 2 over their wave numbers. */
static inline void slopes(const struct gbg_reference_waves *waves,
                          const struct gbg_reference_group *group, const double *const *phase,
                          int64_t b, double along[2][ROWS])
{
    const double *y = at_wave(phase[1], group->y, b);
    double k = waves->unit[1] * group->y;
    if (waves->dimension == 2) {
        const double *next = at_wave(phase[1], group->y + 1, b);
        double more = waves->unit[1] * (group->y + 1);
        along[0][0] = -k * y[WAVES];
        along[0][1] = k * y[0];
        along[0][2] = -more * next[WAVES];
        along[0][3] = more * next[0];
        memset(along[1], 0, sizeof along[1]);
    } else {
        const double *z = at_wave(phase[2], group->z, b);
        double q = waves->unit[2] * group->z;
        along[0][0] = -k * y[WAVES] * z[0];
        along[0][1] = -k * y[WAVES] * z[WAVES];
        along[0][2] = k * y[0] * z[0];
        along[0][3] = k * y[0] * z[WAVES];
        along[1][0] = -q * y[0] * z[WAVES];
        along[1][1] = q * y[0] * z[0];
        along[1][2] = -q * y[WAVES] * z[WAVES];
        along[1][3] = q * y[WAVES] * z[0];
    }
}

/* Sum over waves of axis 0 in one row, and of its slope. */
static inline void along_row(double unit, int32_t tiles, const double *coefficient,
                             const double *phase, double *value, double *slope)
{
    double u[WAVES] = {0.0}, v[WAVES] = {0.0};
    for (int32_t t = 0; t < tiles; t++) {
        const double *c = coefficient + (int64_t)t * ROWS * TILE;
        const double *x = phase + (int64_t)t * BATCH * TILE;
        for (int w = 0; w < WAVES; w++) {
            double k = unit * (double)(WAVES * t + w);
            u[w] = FUSED(c[w], x[w], FUSED(c[WAVES + w], x[WAVES + w], u[w]));
            v[w] += k * FUSED(c[WAVES + w], x[w], -(c[w] * x[WAVES + w]));
        }
    }
    *value = ((u[0] + u[1]) + (u[2] + u[3])) + ((u[4] + u[5]) + (u[6] + u[7]));
    *slope = ((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7]));
}

static void evaluate(const struct gbg_reference_waves *waves, const double *coefficient, int64_t b,
                     const double *const *phase, double *field)
{
    double total[4] = {0.0};
    for (int64_t g = 0; g < waves->n_groups; g++) {
        const struct gbg_reference_group *group = &waves->group[g];
        double factor[ROWS], along[2][ROWS];
        factors(waves, group, phase, b, factor);
        slopes(waves, group, phase, b, along);
        for (int r = 0; r < ROWS; r++) {
            double value, slope;
            along_row(waves->unit[0], group->tiles, coefficient + group->first + r * TILE,
                      phase[0] + b * TILE, &value, &slope);
            total[0] -= factor[r] * slope;
            total[1] -= along[0][r] * value;
            total[2] -= along[1][r] * value;
            total[3] += factor[r] * value;
        }
    }
    memcpy(field, total, sizeof total);
}

/* Sources of a block within the cut: r_vec, a^2 r^2, strength. */
struct found {
    int64_t n;
    double r[3][BLOCK], x[BLOCK], alpha[BLOCK];
};

/* The nearest image of a difference of two places in the box, moved by whole boxes. */
static inline double image(double difference, double length, double shift)
{
    double nearest = difference > 0.5 * length    ? difference - length
                     : difference < -0.5 * length ? difference + length
                                                  : difference;
    return nearest + shift;
}

static inline __attribute__((always_inline)) void find(const struct gbg_reference_near *near,
                                                       int dimension, int64_t begin, int64_t n,
                                                       const double *target, const double *shift,
                                                       struct found *found)
{
    double r[3][BLOCK], squared[BLOCK];
    memset(squared, 0, (size_t)n * sizeof *squared);
    for (int a = 0; a < dimension; a++) {
        const double *position = near->position[a] + begin;
        double here = target[a], length = near->length[a], moved = shift[a];
        for (int64_t j = 0; j < n; j++) {
            double d = image(here - position[j], length, moved);
            r[a][j] = d;
            squared[j] += d * d;
        }
    }
    int32_t list[BLOCK];
    int64_t m = 0;
    for (int64_t j = 0; j < n; j++) {
        list[m] = (int32_t)j;
        m += squared[j] < near->cut;
    }
    for (int64_t k = 0; k < m; k++) {
        for (int a = 0; a < dimension; a++) {
            found->r[a][k] = r[a][list[k]];
        }
        found->x[k] = squared[list[k]] * near->squared_a;
        found->alpha[k] = near->alpha[begin + list[k]];
    }
    found->n = m;
}

/* The panel of x in the table, below 0 if x is too small for it, and the place in it in [-1,1). */
static inline int64_t panel_of(double x, double *place)
{
    uint64_t bits, one = UINT64_C(1023) << 52;
    memcpy(&bits, &x, sizeof bits);
    int64_t panel = (int64_t)(bits >> (52 - GBG_REFERENCE_PANEL_BITS)) -
                    ((1023 + GBG_REFERENCE_LOWEST) * (1 << GBG_REFERENCE_PANEL_BITS));
    bits = (bits << GBG_REFERENCE_PANEL_BITS & UINT64_C(0xFFFFFFFFFFFFF)) | one;
    memcpy(place, &bits, sizeof bits);
    *place = 2.0 * *place - 3.0;
    return panel;
}

static inline double polynomial(const double *term, double z)
{
    double sum = term[GBG_REFERENCE_TERMS - 1];
#pragma GCC unroll 16
    for (int k = GBG_REFERENCE_TERMS - 2; k >= 0; k--) {
        sum = FUSED(sum, z, term[k]);
    }
    return sum;
}

/* Short part over r_vec (or the potential) of all found, times the strength. */
static inline void weigh(const struct gbg_reference_near *near, const gbg_reference_panel *table,
                         int potential, const struct found *found, double *weight)
{
    for (int64_t k = 0; k < found->n; k++) {
        double z, x = found->x[k];
        int64_t panel = panel_of(x, &z);
        if (panel >= near->first) {
            weight[k] = found->alpha[k] * polynomial(table[panel], z);
        } else if (x > 0.0) {
            weight[k] = found->alpha[k] * (potential ? gbg_reference_short_potential(near->law, x)
                                                     : gbg_reference_short(near->law, x));
        } else {
            weight[k] = potential ? -found->alpha[k] * near->law->self : 0.0;
        }
    }
}

static inline void accumulate(struct gbg_reference_field *field, int which, int64_t n,
                              const double *weight, const double *factor)
{
    double lane[8] = {0.0};
    int64_t k = 0;
    for (; k + 8 <= n; k += 8) {
        for (int l = 0; l < 8; l++) {
            lane[l] = FUSED(weight[k + l], factor[k + l], lane[l]);
        }
    }
    for (; k < n; k++) {
        lane[k & 7] = FUSED(weight[k], factor[k], lane[k & 7]);
    }
    double more =
        ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]));
    double old = field->sum[which], new = old + more, part = new - old;
    field->sum[which] = new;
    field->rest[which] += (old - (new - part)) + (more - part);
}

static void near_block(const struct gbg_reference_near *near, int64_t begin, int64_t n,
                       const double *target, const double *shift, struct gbg_reference_field *field)
{
    struct found found;
    double weight[BLOCK];
    if (near->dimension == 2) {
        find(near, 2, begin, n, target, shift, &found);
    } else {
        find(near, 3, begin, n, target, shift, &found);
    }
    weigh(near, near->force, 0, &found, weight);
    for (int a = 0; a < near->dimension; a++) {
        accumulate(field, a, found.n, weight, found.r[a]);
    }
    if (near->with_potential) {
        weigh(near, near->potential, 1, &found, weight);
        for (int64_t k = 0; k < found.n; k++) {
            found.x[k] = 1.0;
        }
        accumulate(field, 3, found.n, weight, found.x);
    }
}

static void near(const struct gbg_reference_near *pairs, int64_t begin, int64_t end,
                 const double *target, const double *shift, struct gbg_reference_field *field)
{
    for (int64_t b = begin; b < end; b += BLOCK) {
        near_block(pairs, b, end - b < BLOCK ? end - b : BLOCK, target, shift, field);
    }
}

const struct gbg_reference_kernels GBG_REFERENCE_NAME(gbg_reference_kernels) = {
    .phases = phases,
    .add = add,
    .evaluate = evaluate,
    .near = near,
};
