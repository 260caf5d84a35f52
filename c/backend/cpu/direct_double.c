/* L1, CPU, per instruction set: minimum-image sums over all pairs in double precision, all 64 bits
 * of the positions. Same order as the mixed sum (direct_mixed.c). */
#include "backend/cpu/cpu.h"
#include "backend/cpu/direct.h"
#include "backend/cpu/direct_pairs.h"
#include "backend/cpu/simd.h"
#include "backend/cpu/variant.h"

#define LANES GBG_DIRECT_LANES
#define TILE GBG_DIRECT_TILE
#define ALWAYS static inline __attribute__((always_inline))

/* VD_LANES particles i.. against a tile: adds to their fields and to the rows. */
ALWAYS void sweep(const struct gbg_direct *d, int64_t i, int64_t k, double *rows, int dimension)
{
    vd alpha = vd_load(d->alpha + i), sum[3];
    for (int a = 0; a < dimension; a++) {
        sum[a] = vd_set(0.0);
    }
    for (int64_t row = 0; row < TILE; row++) {
        vd r[3], w = gbg_direct_weight(d, i, k + row, -1, 0.0, dimension, r);
        vd on_i = vd_mul(w, vd_set(d->alpha[k + row])), on_k = vd_mul(w, alpha);
        for (int a = 0; a < dimension; a++) {
            double *lane = rows + (row * dimension + a) * LANES;
            sum[a] = vd_fma(on_i, r[a], sum[a]);
            vd_store(lane, vd_fma(on_k, r[a], vd_load(lane)));
        }
    }
    for (int a = 0; a < dimension; a++) {
        double *field = d->field[a] + i;
        vd_store(field, vd_add(vd_load(field), sum[a]));
    }
}

/* Minus the sums of the rows, in a fixed tree, go to the fields of the tile. */
static void fold_rows(const struct gbg_direct *d, int64_t k, double *rows)
{
    for (int64_t row = 0; row < TILE; row++) {
        for (int a = 0; a < d->dimension; a++) {
            d->field[a][k + row] -= gbg_direct_sum_lanes(rows + (row * d->dimension + a) * LANES);
        }
    }
}

ALWAYS void meet(const struct gbg_direct *d, int64_t first, int64_t second, int dimension)
{
    _Alignas(64) double rows[TILE * 3 * LANES];
    int64_t begin = first * d->block;
    for (int64_t k = second * d->block; k < (second + 1) * d->block; k += TILE) {
        for (int n = 0; n < TILE * dimension * LANES; n++) {
            rows[n] = 0.0;
        }
        for (int64_t i = begin; i < begin + d->block; i += VD_LANES) {
            sweep(d, i, k, rows + i % LANES, dimension);
        }
        if (first != second) {
            fold_rows(d, k, rows);
        }
    }
}

static void meet_2d(const struct gbg_direct *d, int64_t first, int64_t second)
{
    meet(d, first, second, 2);
}

static void meet_3d(const struct gbg_direct *d, int64_t first, int64_t second)
{
    meet(d, first, second, 3);
}

int GBG_ISA_NAME(gbg_cpu_direct_double)(struct gbg_device *device, struct gbg_state *state,
                                        double power, int add)
{
    struct gbg_direct d;
    int status = gbg_direct_pack(device, state, power, 1, &d);
    if (status != GBG_OK) {
        return status;
    }
#pragma omp parallel num_threads(device->threads)
    for (int64_t phase = 0; phase < d.blocks; phase++) {
        int64_t pairs = gbg_direct_phase_pairs(d.blocks, phase);
#pragma omp for schedule(dynamic)
        for (int64_t pair = 0; pair < pairs; pair++) {
            int64_t first, second;
            gbg_direct_pair(d.blocks, phase, pair, &first, &second);
            (d.dimension == 2 ? meet_2d : meet_3d)(&d, first, second);
        }
    }
    gbg_direct_unpack(&d, state, device->threads, add);
    return GBG_OK;
}
