/* L1: what the direct sums of all precisions share: the packed particles, the order of blocks, the
 * power law in double precision. */
#ifndef GBG_BACKEND_CPU_DIRECT_H
#define GBG_BACKEND_CPU_DIRECT_H

#include "backend/backend.h"

/* Lanes of one row of partial sums. The same for every instruction set, so that the order of a sum
 * is: over the particles of a block that share a lane, then over the lanes. */
enum { GBG_DIRECT_LANES = 16 };

/* Particles that act at a time, and rows of partial sums: 16 kB for two axes, in the nearest
 * cache. */
enum { GBG_DIRECT_TILE = 128 };

/* Vectors shorter than this many quanta of the longest axis are too coarse in high words for 32-bit
 * pairs (relative error above 2e-7): such pairs are summed in double precision. */
#define GBG_DIRECT_NEAR 0x1p21

/* r^-(power+1) for double precision. */
struct gbg_power {
    double power;
    int halves; /* 2 (power + 1) if that is a whole number, else 0 */
};

/* Particles padded with sources of strength 0 to whole blocks. A difference of high words times
 * scale[axis] is a length in the unit that gbg_direct_pack chose. */
struct gbg_direct {
    int dimension;
    int64_t n, padded, block, blocks;
    uint64_t *position[3];
    int32_t *high[3];
    double *alpha; /* over the largest |alpha|, times 1 or (not scaled) 2^60 */
    float *single_alpha;
    double *field[3]; /* sums: alpha r / |r|^(power+1) */
    double scale[3];  /* of high words */
    double quantum;   /* the largest scale */
    double factor;    /* field to sum in the user's units */
    struct gbg_power power;
};

/* Packs owned and ghost particles into the device's workspace. Unless `scaled`, the unit of length
 * is 2^-32 of the longest box side, else 2^-6 of it. */
int gbg_direct_pack(struct gbg_device *device, const struct gbg_state *state, double power,
                    int scaled, struct gbg_direct *direct);
/* force (+)= mobility factor field, for the owned. */
void gbg_direct_unpack(const struct gbg_direct *direct, struct gbg_state *state, int threads,
                       int add);

struct gbg_power gbg_power_make(double power);
/* r^-(power+1) from r^2 > 0 by the C library. */
double gbg_power_scalar(const struct gbg_power *power, double squared);

/* Every pair of blocks once, in `blocks` phases; in a phase each block occurs once, so that its
 * pairs may run in parallel and the order in which a block receives its terms is fixed. */
static inline int64_t gbg_direct_phase_pairs(int64_t blocks, int64_t phase)
{
    return phase / 2 + 1 + (phase + blocks) / 2 - phase;
}

/* The blocks first <= second of pair number k of a phase: first + second = phase modulo blocks. */
static inline void gbg_direct_pair(int64_t blocks, int64_t phase, int64_t k, int64_t *first,
                                   int64_t *second)
{
    int64_t without_wrap = phase / 2 + 1;
    *first = k < without_wrap ? k : phase + 1 + k - without_wrap;
    *second = (k < without_wrap ? phase : phase + blocks) - *first;
}

/* Adds lanes in a fixed tree; destroys them. */
static inline double gbg_direct_sum_lanes(double lane[GBG_DIRECT_LANES])
{
    for (int half = GBG_DIRECT_LANES / 2; half > 0; half /= 2) {
        for (int l = 0; l < half; l++) {
            lane[l] += lane[l + half];
        }
    }
    return lane[0];
}

int gbg_cpu_direct_reserve(struct gbg_device *device, const struct gbg_state *state);
int gbg_cpu_direct_targets(struct gbg_device *device, struct gbg_state *state, double power,
                           double cutoff, int64_t n_targets, const int32_t *target,
                           double *const *out);

#endif
