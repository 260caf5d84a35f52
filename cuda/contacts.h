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

/* Calls visit(j) for the neighbours that may touch particle i. Visits, in which the exact test is
 * made, follow after 32 neighbours have been looked at, so that few threads wait for others in
 * them.
 */
template <int dimension, typename Visit>
static __device__ __forceinline__ void gbg_cuda_for_near(const struct gbg_cuda_rows &rows,
                                                         const struct gbg_cuda_sieve &sieve,
                                                         int64_t i, Visit visit)
{
    int64_t slice = i / GBG_CUDA_SLICE;
    const int32_t *row = rows.index + rows.offset[slice] + i % GBG_CUDA_SLICE;
    int32_t width = rows.width[slice];
    uint32_t own[3];
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
            visit((int64_t)__ldg(row + (int64_t)k * GBG_CUDA_SLICE));
        }
    }
}

/* What rounds work on. Flags are a byte a particle, in whole pieces of GBG_CUDA_FLAGS. `moved` says
 * who has a push: one array is read in a round, the other is written for the next. Who has no flag
 * when others look for his push has one of zero. */
enum { GBG_CUDA_FLAGS = 256 };
struct gbg_cuda_rounds {
    struct gbg_push_rule rule;
    struct gbg_cuda_rows rows;
    struct gbg_cuda_sieve sieve;
    unsigned char *moved[2];
    int64_t *push; /* dimension a particle */
};

template <int dimension>
static __device__ __forceinline__ void gbg_cuda_put_push(const struct gbg_cuda_rounds &work,
                                                         int64_t i, const int64_t push[3])
{
    if constexpr (dimension == 2) { /* in one piece */
        ((longlong2 *)work.push)[i] = make_longlong2(push[0], push[1]);
    } else {
        for (int a = 0; a < dimension; a++) {
            work.push[dimension * i + a] = push[a];
        }
    }
}

template <int dimension>
static __device__ __forceinline__ void gbg_cuda_get_push(const struct gbg_cuda_rounds &work,
                                                         int64_t i, int64_t push[3])
{
    if constexpr (dimension == 2) {
        longlong2 both = ((const longlong2 *)work.push)[i];
        push[0] = both.x;
        push[1] = both.y;
    } else {
        for (int a = 0; a < dimension; a++) {
            push[a] = work.push[dimension * i + a];
        }
    }
}

/* Calls visit(particle) for every flag that is set, and clears those of `clear` unless it is NULL.
 * A warp takes many flags at a time, so that where few are set it still has a particle for each of
 * its lanes. */
template <typename flags, typename Visit>
static __device__ __forceinline__ void
gbg_cuda_visit_flags(const unsigned char *flag, unsigned char *clear, int64_t n, Visit visit)
{
    const unsigned everybody = 0xFFFFFFFFu;
    constexpr int many = (int)sizeof(flags); /* of a lane */
    int lane = threadIdx.x & 31;
    int64_t warps = (int64_t)gridDim.x * blockDim.x / 32;
    for (int64_t first = gbg_cuda_index() / 32 * 32 * many; first < n; first += warps * 32 * many) {
        int64_t mine = first + lane * many;
        flags bits = mine < n ? __ldcg((const flags *)(flag + mine)) : 0;
        if (clear && mine < n) {
            *(flags *)(clear + mine) = 0;
        }
        int own = __popcll((unsigned long long)bits), end = own;
        for (int apart = 1; apart < 32; apart *= 2) {
            int other = __shfl_up_sync(everybody, end, apart);
            end += lane >= apart ? other : 0;
        }
        int before = end - own, total = __shfl_sync(everybody, end, 31);
        for (int k = lane; k - lane < total; k += 32) {
            int of = 0; /* the last lane with no more than k flags before it */
            for (int half = 16; half > 0; half /= 2) {
                of += __shfl_sync(everybody, before, of + half) <= k ? half : 0;
            }
            unsigned long long rest = __shfl_sync(everybody, (unsigned long long)bits, of);
            for (int skip = k - __shfl_sync(everybody, before, of); skip > 0; skip--) {
                rest &= rest - 1;
            }
            if (k < total) {
                visit(first + of * many + (__ffsll((long long)rest) - 1) / 8);
            }
        }
    }
}

/* The same, with as many flags a lane as leave few warps without any. */
template <typename Visit>
static __device__ __forceinline__ void
gbg_cuda_for_flags(const unsigned char *flag, unsigned char *clear, int64_t n, Visit visit)
{
    if (n / ((int64_t)gridDim.x * blockDim.x) < 4) {
        gbg_cuda_visit_flags<unsigned char>(flag, clear, n, visit);
    } else {
        gbg_cuda_visit_flags<unsigned long long>(flag, clear, n, visit);
    }
}

/* What overlaps push everybody by, from places that no thread changes meanwhile; flags of `turn`
 * say whom. Adds what this thread found to *pairs and *virial. */
template <int dimension>
static __device__ __forceinline__ void
gbg_cuda_find_all(const struct gbg_state &state, const struct gbg_cuda_rounds &work, int turn,
                  unsigned long long *pairs, int64_t *virial)
{
    for (int64_t i = gbg_cuda_index(); i < work.rows.n; i += (int64_t)gridDim.x * blockDim.x) {
        int64_t push[3] = {0, 0, 0};
        bool found = false, rest = work.moved[0][i] || work.moved[1][i]; /* of a step given up */
        gbg_cuda_for_near<dimension>(work.rows, work.sieve, i, [&](int64_t j) {
            if (gbg_push_pair(&work.rule, &state, dimension, i, j, push, virial)) {
                found = true;
                *pairs += i < j;
            }
        });
        if (found || rest) {
            gbg_cuda_put_push<dimension>(work, i, push);
        }
        work.moved[turn][i] = found;
        work.moved[1 - turn][i] = 0;
    }
}

/* The same where only those with a flag of `turn` have moved since the last look, the new flags are
 * the others. Of a pair that moved each finds its own push. Who stands still is not looked at: his
 * push is found with that of who came to him, and added in integers, so that no order can show. */
template <int dimension>
static __device__ __forceinline__ void
gbg_cuda_find_moved(const struct gbg_state &state, const struct gbg_cuda_rounds &work, int turn,
                    unsigned long long *pairs, int64_t *virial)
{
    const unsigned char *moved = work.moved[turn];
    unsigned char *next = work.moved[1 - turn];
    gbg_cuda_for_flags(moved, NULL, work.rows.n, [&](int64_t i) {
        int64_t push[3] = {0, 0, 0};
        bool found = false;
        gbg_cuda_for_near<dimension>(work.rows, work.sieve, i, [&](int64_t j) {
            if (!gbg_push_pair(&work.rule, &state, dimension, i, j, push, virial)) {
                return;
            }
            found = true;
            if (moved[j]) {
                *pairs += i < j;
                return;
            }
            int64_t other[3] = {0, 0, 0};
            gbg_push_pair(&work.rule, &state, dimension, j, i, other, virial);
            for (int a = 0; a < dimension; a++) {
                atomicAdd((unsigned long long *)&work.push[dimension * j + a],
                          (unsigned long long)other[a]);
            }
            next[j] = 1;
            *pairs += 1;
        });
        gbg_cuda_put_push<dimension>(work, i, push);
        if (found) {
            next[i] = 1;
        }
    });
}

/* Moves whoever has a flag of `turn`; the other flags are cleared. Calls each(particle, squared
 * push) after the move. */
template <int dimension, typename Each>
static __device__ __forceinline__ void gbg_cuda_push_apart(const struct gbg_state &state,
                                                           const struct gbg_cuda_rounds &work,
                                                           int turn, Each each)
{
    gbg_cuda_for_flags(work.moved[turn], work.moved[1 - turn], work.rows.n, [&](int64_t i) {
        int64_t push[3] = {0, 0, 0};
        gbg_cuda_get_push<dimension>(work, i, push);
        if (work.rule.parting == GBG_PARTING_CARTER) {
            gbg_push_cut(&work.rule, &state, dimension, i, push);
        }
        double pushed = gbg_push_apply(&state, dimension, i, push);
        if (state.overlapped) {
            state.overlapped[i] = 1;
        }
        each(i, pushed);
    });
}

/* The arrays of rounds, made at the first call; of the list, what rounds read by that sieve. */
int gbg_cuda_contacts_reserve(struct gbg_device *device, struct gbg_list *list);
struct gbg_cuda_rounds gbg_cuda_rounds_make(const struct gbg_list *list,
                                            const struct gbg_push_rule *rule,
                                            const struct gbg_cuda_sieve *sieve);

#endif
