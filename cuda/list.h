/* L1, CUDA: pair lists: for 32 particles at a time, a warp's, their neighbours slot by slot. */
#ifndef GBG_CUDA_LIST_H
#define GBG_CUDA_LIST_H

#include "cuda/cuda.h"
#include "cuda/grid.h"
#include "cuda/rows.h"

struct gbg_list {
    struct gbg_device *device;
    struct gbg_cuda_rows rows;
    double reach, radius;
    double unit[3]; /* length of a unit of a local coordinate */
    int64_t total, index_capacity;
    struct gbg_cuda_grid grid;
    int64_t builds;
    unsigned widest; /* row of the last build */
    uint64_t epoch;  /* of the state when the list was built */
    int64_t refused; /* entries of an index that could not be had; 0: never yet */
    uint64_t moment; /* number of the build; lists built at the same positions share it */
    /* work arrays of contact rounds (contacts.cu), made at the first call; on the device */
    unsigned char *moved[2];            /* n: 1 = has a push in this round, in the next */
    int64_t *push;                      /* dimension n */
    struct gbg_cuda_bridge *bridge;     /* work of the rule bridge; NULL: none yet (bridge.cu) */
    struct gbg_cuda_events *events;     /* of the rule event (events.cu) */
    struct gbg_cuda_unlisted *unlisted; /* NULL: the list has rows (unlisted.cu) */
};

static __device__ __forceinline__ uint32_t gbg_cuda_local(uint32_t high, uint32_t low, int shift)
{
    return (uint32_t)((((uint64_t)high << 32) | low) << shift >> 32);
}

/* Squared displacement of particle i since the list was built, by the operations of
 * gbg_list_moved_squared. */
static __device__ __forceinline__ float gbg_cuda_moved_squared(const struct gbg_cuda_rows &rows,
                                                               int64_t i)
{
    float sum = 0.0f;
    for (int a = 0; a < rows.dimension; a++) {
        float d = __fmul_rn((float)(int32_t)(rows.local[a][i] - rows.built[a][i]), rows.scale[a]);
        sum = __fadd_rn(sum, __fmul_rn(d, d));
    }
    return sum;
}

int gbg_cuda_list_create(struct gbg_device *device, const struct gbg_state *state, double reach,
                         double radius, struct gbg_list **list);
void gbg_cuda_list_destroy(struct gbg_device *device, struct gbg_list *list);
int gbg_cuda_list_update(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                         double moved);
int64_t gbg_cuda_list_builds(const struct gbg_list *list);
double gbg_cuda_list_bytes(const struct gbg_list *list);
int gbg_cuda_list_is_kept(const struct gbg_list *list);
double gbg_cuda_list_scatter(const struct gbg_list *list);
/* Index of each of n ranks. */
int gbg_cuda_invert_ranks(struct gbg_device *device, const struct gbg_state *state, int64_t n,
                          int32_t *of_rank);
/* Builds at the present positions, whatever the displacements. */
int gbg_cuda_list_build(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list);
/* Of the rooms that own them. */
void gbg_cuda_contacts_release(struct gbg_device *device, struct gbg_list *list);
void gbg_cuda_bridge_release(struct gbg_device *device, struct gbg_list *list);
void gbg_cuda_events_release(struct gbg_device *device, struct gbg_list *list);

#endif
