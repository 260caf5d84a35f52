/* L1, CPU, per instruction set: minimum-image sums over all pairs, 32-bit pairs in 64-bit sums.
 *
 * Each pair is computed once and acts on both particles. Blocks of particles meet in phases
 * (direct.h). Within two blocks, vectors of particles i stay in registers while k runs over a tile
 * of the other block; the force on k collects in rows of lanes in the nearest cache. Sums over a
 * run of k (i) and over what shares a lane in a block (k) are in single precision, those over runs
 * and blocks in double: terms of one sign that cancel in the end would lose more in longer ones.
 *
 * A difference is that of the high words, wrapped as an integer: the nearest image; power laws are
 * those of direct_law.h. Pairs below GBG_DIRECT_NEAR get the weight of that
 * distance and, in double precision from all 64 bits, what is missing. */
#include <math.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/direct.h"
#include "backend/cpu/direct_law.h"
#include "backend/cpu/direct_pairs.h"
#include "backend/cpu/simd.h"
#include "backend/cpu/variant.h"

enum { LAW_GENERAL = 0, LAW_1 = 1, LAW_2 = 2, LAW_6 = 6 };

#define LANES GBG_DIRECT_LANES
#define TILE GBG_DIRECT_TILE
#define VECTORS 4 /* of particles i at a time */
#define GROUP (VECTORS * VF_LANES)
#define CHUNK (GROUP > LANES ? GROUP : LANES)
#define HIGH_WORD (-(INT64_C(1) << 32))
#define RUN 16 /* particles k whose forces on i are summed in single precision */
#define ALWAYS static inline __attribute__((always_inline))

struct constants {
    float near; /* squared, in units */
    float scale[3];
    struct gbg_law general;
};

ALWAYS vf weight(vf squared, const struct constants *c, int law)
{
    vf t, e, y;
    if (law == LAW_GENERAL) {
        return gbg_law_general(squared, c->general);
    }
    y = gbg_law_seed(squared, &t, &e);
    return law == LAW_1 ? gbg_law_1(t, e) : law == LAW_2 ? gbg_law_2(y, t, e) : gbg_law_6(y, t, e);
}

/* Vectors from k and their squared lengths, in units; `lowest` becomes the lowest integer met. */
ALWAYS vf differences(const struct gbg_direct *d, const struct constants *c, const vi own[3],
                      int64_t k, int dimension, int scaled, vf r[3], vi *lowest)
{
    vf squared = vf_set(0.0f);
    for (int a = 0; a < dimension; a++) {
        vi difference = vi_sub(own[a], vi_set(d->high[a][k]));
        *lowest = vi_min(*lowest, difference);
        r[a] = vf_from_vi(difference);
        r[a] = scaled ? vf_mul(r[a], vf_set(c->scale[a])) : r[a];
        squared = a == 0 ? vf_mul(r[a], r[a]) : vf_fma(r[a], r[a], squared);
    }
    return squared;
}

ALWAYS void clear(vf sum[VECTORS][3], int dimension)
{
    for (int v = 0; v < VECTORS; v++) {
        for (int a = 0; a < dimension; a++) {
            sum[v][a] = vf_set(0.0f);
        }
    }
}

ALWAYS void add_to_fields(const struct gbg_direct *d, int64_t i, vf sum[VECTORS][3], int dimension)
{
    for (int v = 0; v < VECTORS; v++) {
        for (int a = 0; a < dimension; a++) {
            double *field = d->field[a] + i + v * VF_LANES;
            vd_store(field, vd_add(vd_load(field), vd_low(sum[v][a])));
            vd_store(field + VD_LANES, vd_add(vd_load(field + VD_LANES), vd_high(sum[v][a])));
        }
    }
}

/* Lanes that need 64 bits: near pairs, and those whose nearest image the high words cannot tell
 * because they lie half a box apart. */
ALWAYS vm doubtful(vi least, vi near, vi lowest)
{
    return vm_or(vi_lt(least, near), vi_eq(lowest, vi_set(INT32_MIN)));
}

/* One group of particles i.. against the tile of particles k..: adds to the fields of the group and
 * to the rows (minus the force on k, per lane). Returns 1 when there were doubtful pairs. */
ALWAYS int sweep(const struct gbg_direct *d, const struct constants *c, int64_t i, int64_t k,
                 float *rows, int dimension, int law, int scaled)
{
    vi own[VECTORS][3];
    vf alpha[VECTORS];
    for (int v = 0; v < VECTORS; v++) {
        alpha[v] = vf_load(d->single_alpha + i + v * VF_LANES);
        for (int a = 0; a < dimension; a++) {
            own[v][a] = vi_load(d->high[a] + i + v * VF_LANES);
        }
    }
    const vi near = vi_of_bits(vf_set(c->near));
    vi least = near, lowest = vi_set(0);
    for (int64_t run = 0; run < TILE; run += RUN) {
        vf sum[VECTORS][3];
        clear(sum, dimension);
        for (int64_t row = run; row < run + RUN; row++) {
            const vf strength = vf_set(d->single_alpha[k + row]);
            for (int v = 0; v < VECTORS; v++) {
                vf r[3],
                    squared = differences(d, c, own[v], k + row, dimension, scaled, r, &lowest);
                /* Floats that are not negative are in the order of their bits. */
                least = vi_min(least, vi_of_bits(squared));
                vf w = weight(vf_of_bits(vi_max(vi_of_bits(squared), near)), c, law);
                vf on_i = vf_mul(w, strength), on_k = vf_mul(w, alpha[v]);
                for (int a = 0; a < dimension; a++) {
                    float *lane = rows + (row * dimension + a) * LANES + v * VF_LANES % LANES;
                    sum[v][a] = vf_fma(on_i, r[a], sum[v][a]);
                    vf_store(lane, vf_fma(on_k, r[a], vf_load(lane)));
                }
            }
        }
        add_to_fields(d, i, sum, dimension);
    }
    return vm_any(doubtful(least, near, lowest));
}

/* Doubtful pairs of LANES particles i.. with one k, in double precision: their force less what the
 * 32-bit sum has for them. both == 0: the force on i only. */
static void mend_pairs(const struct gbg_direct *d, int64_t i, int64_t k, uint32_t bits, int both)
{
    double lane[3][LANES];
    const double near = GBG_DIRECT_NEAR * d->quantum;
    for (int64_t j = 0; j < LANES; j += VD_LANES) {
        vdm these = vdm_from_bits(bits >> j);
        vd r[3], high_r[3];
        vd w = gbg_direct_weight(d, i + j, k, -1, 0.0, d->dimension, r);
        vd high_w = gbg_direct_weight(d, i + j, k, HIGH_WORD, near * near, d->dimension, high_r);
        for (int a = 0; a < d->dimension; a++) {
            vd missing = vd_keep(these, vd_fnma(high_w, high_r[a], vd_mul(w, r[a])));
            double *field = d->field[a] + i + j;
            vd_store(field, vd_fma(vd_set(d->alpha[k]), missing, vd_load(field)));
            vd_store(lane[a] + j, vd_mul(vd_load(d->alpha + i + j), missing));
        }
    }
    for (int a = 0; both && a < d->dimension; a++) {
        d->field[a][k] -= gbg_direct_sum_lanes(lane[a]);
    }
}

/* The doubtful pairs of LANES particles with a tile. */
ALWAYS void mend(const struct gbg_direct *d, const struct constants *c, int64_t i, int64_t k,
                 int both, int dimension, int scaled)
{
    const vi near = vi_of_bits(vf_set(c->near));
    for (int64_t row = 0; row < TILE; row++) {
        uint32_t bits = 0;
        for (int l = 0; l < LANES; l += VF_LANES) {
            vi own[3], lowest = vi_set(0);
            vf r[3];
            for (int a = 0; a < dimension; a++) {
                own[a] = vi_load(d->high[a] + i + l);
            }
            vf squared = differences(d, c, own, k + row, dimension, scaled, r, &lowest);
            bits |= vm_bits(doubtful(vi_of_bits(squared), near, lowest)) << l;
        }
        if (bits) {
            mend_pairs(d, i, k + row, bits, both);
        }
    }
}

/* Minus the sums of the rows, in a fixed tree, go to the fields of the tile. */
static void fold_rows(const struct gbg_direct *d, int64_t k, const float *rows)
{
    for (int64_t row = 0; row < TILE; row++) {
        for (int a = 0; a < d->dimension; a++) {
            const float *l = rows + (row * d->dimension + a) * LANES;
            float even = ((l[0] + l[8]) + (l[4] + l[12])) + ((l[2] + l[10]) + (l[6] + l[14]));
            float odd = ((l[1] + l[9]) + (l[5] + l[13])) + ((l[3] + l[11]) + (l[7] + l[15]));
            d->field[a][k + row] -= (double)(even + odd);
        }
    }
}

/* All pairs of two blocks, or of one with itself: then every ordered pair, force on i only. */
ALWAYS void meet(const struct gbg_direct *d, const struct constants *c, int64_t first,
                 int64_t second, int dimension, int law, int scaled)
{
    _Alignas(64) float rows[TILE * 3 * LANES];
    int both = first != second;
    int64_t begin = first * d->block, end = begin + d->block;
    for (int64_t k = second * d->block; k < (second + 1) * d->block; k += TILE) {
        for (int n = 0; n < TILE * dimension * LANES; n++) {
            rows[n] = 0.0f;
        }
        for (int64_t chunk = begin; chunk < end; chunk += CHUNK) {
            int doubts = 0;
            for (int64_t i = chunk; i < chunk + CHUNK; i += GROUP) {
                doubts |= sweep(d, c, i, k, rows + (i - chunk), dimension, law, scaled);
            }
            for (int64_t i = chunk; doubts && i < chunk + CHUNK; i += LANES) {
                mend(d, c, i, k, both, dimension, scaled);
            }
        }
        if (both) {
            fold_rows(d, k, rows);
        }
    }
}

#define DEFINE_MEET(name, dimension, law, scaled)                                                  \
    static void name(const struct gbg_direct *d, const struct constants *c, int64_t first,         \
                     int64_t second)                                                               \
    {                                                                                              \
        meet(d, c, first, second, dimension, law, scaled);                                         \
    }

DEFINE_MEET(meet_2d_2_square, 2, LAW_2, 0)
DEFINE_MEET(meet_3d_2_square, 3, LAW_2, 0)
DEFINE_MEET(meet_2d_2, 2, LAW_2, 1)
DEFINE_MEET(meet_3d_2, 3, LAW_2, 1)
DEFINE_MEET(meet_2d_1, 2, LAW_1, 1)
DEFINE_MEET(meet_3d_1, 3, LAW_1, 1)
DEFINE_MEET(meet_2d_6, 2, LAW_6, 1)
DEFINE_MEET(meet_3d_6, 3, LAW_6, 1)
DEFINE_MEET(meet_2d, 2, LAW_GENERAL, 1)
DEFINE_MEET(meet_3d, 3, LAW_GENERAL, 1)

typedef void (*meet_function)(const struct gbg_direct *, const struct constants *, int64_t,
                              int64_t);

static meet_function choose(int dimension, double power, int scaled)
{
    static const meet_function all[5][2] = {{meet_2d_2_square, meet_3d_2_square},
                                            {meet_2d_2, meet_3d_2},
                                            {meet_2d_1, meet_3d_1},
                                            {meet_2d_6, meet_3d_6},
                                            {meet_2d, meet_3d}};
    int law = power == 2.0 ? scaled : power == 1.0 ? 2 : power == 6.0 ? 3 : 4;
    return all[law][dimension - 2];
}

static int equal_lengths(const struct gbg_box *box)
{
    int equal = 1;
    for (int a = 1; a < box->dimension; a++) {
        equal &= box->length[a] == box->length[0];
    }
    return equal;
}

static struct constants make_constants(const struct gbg_direct *d)
{
    double near = GBG_DIRECT_NEAR * d->quantum, q = 0.5 * (d->power.power + 1.0);
    struct constants c = {.near = (float)(near * near)};
    for (int a = 0; a < d->dimension; a++) {
        c.scale[a] = (float)d->scale[a];
    }
    c.general.high = (float)(rint(q * 0x1p8) * 0x1p-8);
    c.general.low = (float)(q - (double)c.general.high);
    return c;
}

/* Beyond power 6 the relative errors of 32-bit pairs exceed 1e-6; few particles are not worth it.
 */
enum { FEWEST = 256 };
static const double LARGEST_POWER = 6.0;

int GBG_ISA_NAME(gbg_cpu_direct_mixed)(struct gbg_device *device, struct gbg_state *state,
                                       double power, int add)
{
    if (power > LARGEST_POWER || state->owned + state->ghost <= FEWEST) {
        return GBG_ISA_NAME(gbg_cpu_direct_double)(device, state, power, add);
    }
    struct gbg_direct d;
    int scaled = power != 2.0 || !equal_lengths(&state->box);
    int status = gbg_direct_pack(device, state, power, scaled, &d);
    if (status != GBG_OK) {
        return status;
    }
    const struct constants c = make_constants(&d);
    const meet_function meet_blocks = choose(d.dimension, power, scaled);
#pragma omp parallel num_threads(device->threads)
    for (int64_t phase = 0; phase < d.blocks; phase++) {
        int64_t pairs = gbg_direct_phase_pairs(d.blocks, phase);
#pragma omp for schedule(dynamic)
        for (int64_t pair = 0; pair < pairs; pair++) {
            int64_t first, second;
            gbg_direct_pair(d.blocks, phase, pair, &first, &second);
            meet_blocks(&d, &c, first, second);
        }
    }
    gbg_direct_unpack(&d, state, device->threads, add);
    return GBG_OK;
}
