/* L1, CUDA: the two halves of a contact round, for contacts.cu and for batches of steps. */
#ifndef GBG_CUDA_CONTACTS_H
#define GBG_CUDA_CONTACTS_H

#include "backend/cpu/contacts_pair.h"
#include "cuda/list.h"

/* 32-bit coordinates by which pairs are sifted before the exact test, and the squared distance,
 * with room for their rounding, beyond which a pair cannot touch. */
struct gbg_cuda_sieve {
    uint32_t *coordinate[3];
    float scale[3];
    float limit;
};

template <int dimension>
static __device__ __forceinline__ bool gbg_cuda_may_touch(const struct gbg_cuda_sieve &sieve,
                                                          const uint32_t own[3], int64_t j)
{
    float squared = 0.0f;
    for (int a = 0; a < dimension; a++) {
        float d = (float)(int32_t)(own[a] - sieve.coordinate[a][j]) * sieve.scale[a];
        squared += d * d;
    }
    return squared < sieve.limit;
}

/* What all overlaps of particle i push it by; returns their number. The exact test is made after
 * 32 neighbours have been looked at, so that few threads wait for others in it. */
template <int dimension>
static __device__ __forceinline__ int
gbg_cuda_find_push(const struct gbg_state &state, const struct gbg_push_rule &rule,
                   const struct gbg_cuda_rows &rows, const struct gbg_cuda_sieve &sieve, int64_t i,
                   int64_t push[3], unsigned long long *pairs, int64_t *virial)
{
    int64_t slice = i / GBG_CUDA_SLICE;
    const int32_t *row = rows.index + rows.offset[slice] + i % GBG_CUDA_SLICE;
    int32_t width = rows.width[slice];
    uint32_t own[3];
    int found = 0;
    for (int a = 0; a < dimension; a++) {
        own[a] = sieve.coordinate[a][i];
    }
    for (int32_t begin = 0; begin < width; begin += 32) {
        int32_t count = width - begin < 32 ? width - begin : 32;
        uint32_t near = 0;
#pragma unroll 4
        for (int32_t k = 0; k < count; k++) {
            int64_t j = __ldg(row + (int64_t)(begin + k) * GBG_CUDA_SLICE);
            near |= (uint32_t)(gbg_cuda_may_touch<dimension>(sieve, own, j) && j != i) << k;
        }
        for (; near != 0; near &= near - 1) {
            int32_t k = begin + __ffs((int)near) - 1;
            int64_t j = __ldg(row + (int64_t)k * GBG_CUDA_SLICE);
            if (gbg_push_pair(&rule, &state, dimension, i, j, push, virial)) {
                found++;
                *pairs += i < j;
            }
        }
    }
    return found;
}

/* What rounds work on. A warp works on a slice of the list: in `moved` each has a word, whose bit l
 * says that particle l of the slice has a push. */
struct gbg_cuda_rounds {
    struct gbg_push_rule rule;
    struct gbg_cuda_rows rows;
    struct gbg_cuda_sieve sieve;
    unsigned char *look; /* n: 1 = to be looked at in the next round */
    uint32_t *moved;
    int64_t *push[3];
};

/* Finds the pushes of all particles, or of those that the last round marked, from places that no
 * thread changes meanwhile. Adds what this thread found to *pairs and *virial. */
template <int dimension>
static __device__ __forceinline__ void
gbg_cuda_find_pushes(const struct gbg_state &state, const struct gbg_cuda_rounds &work, bool all,
                     unsigned long long *pairs, int64_t *virial)
{
    int64_t step = (int64_t)gridDim.x * blockDim.x / GBG_CUDA_SLICE;
    int lane = threadIdx.x & 31;
    for (int64_t slice = gbg_cuda_index() / GBG_CUDA_SLICE; slice < work.rows.slices;
         slice += step) {
        int64_t i = slice * GBG_CUDA_SLICE + lane, push[3] = {0, 0, 0};
        bool looked_at = i < work.rows.n && (all || work.look[i]);
        int found = 0;
        if (looked_at) {
            work.look[i] = 0;
            found = gbg_cuda_find_push<dimension>(state, work.rule, work.rows, work.sieve, i, push,
                                                  pairs, virial);
        }
        if (found > 0 && work.rule.parting == GBG_PARTING_CARTER) {
            gbg_push_cut(&work.rule, &state, dimension, i, push);
        }
        for (int a = 0; found > 0 && a < dimension; a++) {
            work.push[a][i] = push[a];
        }
        uint32_t moved = __ballot_sync(0xFFFFFFFFu, found > 0);
        if (lane == 0) {
            work.moved[slice] = moved;
        }
    }
}

/* Several threads may mark the same particle: all write the same. */
static __device__ __forceinline__ void gbg_cuda_mark_around(const struct gbg_cuda_rounds &work,
                                                            int64_t i)
{
    int64_t slice = i / GBG_CUDA_SLICE;
    const int32_t *row = work.rows.index + work.rows.offset[slice] + i % GBG_CUDA_SLICE;
    int32_t width = work.rows.width[slice];
    work.look[i] = 1;
    for (int32_t k = 0; k < width; k++) {
        work.look[__ldg(row + (int64_t)k * GBG_CUDA_SLICE)] = 1;
    }
}

/* Moves whoever has a push, and marks him and his neighbours for the next round. Calls
 * each(particle, squared push) after it. */
template <int dimension, typename Each>
static __device__ __forceinline__ void
gbg_cuda_push_apart(const struct gbg_state &state, const struct gbg_cuda_rounds &work, Each each)
{
    int lane = threadIdx.x & 31;
    int64_t step = (int64_t)gridDim.x * blockDim.x / GBG_CUDA_SLICE;
    for (int64_t slice = gbg_cuda_index() / GBG_CUDA_SLICE; slice < work.rows.slices;
         slice += step) {
        if (!(work.moved[slice] >> lane & 1)) {
            continue;
        }
        int64_t i = slice * GBG_CUDA_SLICE + lane, push[3] = {0, 0, 0};
        for (int a = 0; a < dimension; a++) {
            push[a] = work.push[a][i];
        }
        double pushed = gbg_push_apply(&state, dimension, i, push);
        if (state.overlapped) {
            state.overlapped[i] = 1;
        }
        each(i, pushed);
        gbg_cuda_mark_around(work, i);
    }
}

/* The arrays of rounds, made at the first call; of the list, what rounds read by that sieve. */
int gbg_cuda_contacts_reserve(struct gbg_device *device, struct gbg_list *list);
struct gbg_cuda_rounds gbg_cuda_rounds_make(const struct gbg_list *list,
                                            const struct gbg_push_rule *rule,
                                            const struct gbg_cuda_sieve *sieve);

#endif
