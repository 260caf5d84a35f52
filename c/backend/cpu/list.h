/* L1, CPU: pair lists: for 16 particles at a time, their neighbours slot by slot. */
#ifndef GBG_BACKEND_CPU_LIST_H
#define GBG_BACKEND_CPU_LIST_H

#include <stdint.h>

#include "backend/backend.h"
#include "backend/cpu/grid.h"

enum { GBG_SLICE = 16 };

/* Neighbours of one particle while a list is built. */
struct gbg_row {
    int32_t *index;
    int64_t count, capacity;
};

/* What a search for neighbours reads: particles in cells, and lengths in units of the radius. */
struct gbg_near {
    const struct gbg_grid *grid;
    int dimension;
    const uint32_t *high[3]; /* coordinates in the order of indices */
    float unit[3];           /* length of a unit of the high word */
    float limit;             /* squared, with room for rounding */
};

/* A range of slices that one thread works on, with its own memory. */
struct gbg_chunk {
    int64_t first_slice, end_slice;
    struct gbg_row row[GBG_SLICE];
    int32_t *index; /* neighbour k of lane l of a slice: index[offset + k GBG_SLICE + l] */
    int64_t used, capacity;
    int32_t *key; /* of the row that is sorted */
    int64_t key_capacity;
    /* contact rounds: particles to look at, particles to move, and by how many quanta */
    int32_t *look, *move;
    int64_t *push[3];
    int64_t n_look, n_move, pairs, work_capacity;
    int64_t virial; /* in the unit of the call */
    int stale;
    int status;
    double largest;
};

/* Coordinates for 32-bit pair work: the top `shift` bits of a fraction are dropped and the next 32
 * kept, so that the resolution fits the reach and not the box; a difference read as a signed number
 * is the minimum image for every pair of the list, because the period stays >= 8 reach and the
 * radius is at most 2 reach. The shift follows from the reach alone: the skin must not change a bit
 * of the forces. */
struct gbg_list {
    int dimension;
    double reach, radius;
    int shift[3];
    double unit[3]; /* length of a unit of a local coordinate */
    float scale[3]; /* the same */
    int64_t n, slices;
    uint32_t *local[3];      /* present */
    uint32_t *built[3];      /* when the list was built */
    uint32_t *built_high[3]; /* high words then, for the certificate: no period but the box */
    int64_t *offset;         /* slices: into the chunk's index */
    int32_t *width;          /* slices: longest row */
    int n_chunks;
    struct gbg_chunk *chunk;
    struct gbg_grid grid;
    int64_t bridge_found, bridge_most; /* rule bridge: pairs of a chunk and of a block so far */
    unsigned char *look;               /* contact rounds: 1 = to be looked at in the next round */
    struct gbg_events *events;         /* rule event: work arrays and the paths of the last step */
    int64_t builds;
    uint64_t epoch; /* of the state when the list was built */
};

static inline uint32_t gbg_local(uint32_t high, uint32_t low, int shift)
{
    return (uint32_t)(gbg_join(high, low) << shift >> 32);
}

int gbg_list_create(struct gbg_device *device, const struct gbg_state *state, double reach,
                    double radius, struct gbg_list **list);
void gbg_list_destroy(struct gbg_device *device, struct gbg_list *list);
int gbg_list_update(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                    double moved);
/* Brings the local coordinates up to date; returns the largest squared displacement since the list
 * was built, folded into the period of the local coordinates. */
float gbg_list_follow(struct gbg_device *device, const struct gbg_state *state,
                      struct gbg_list *list);
/* Builds at the present positions, whatever the displacements. */
int gbg_list_build(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list);
int64_t gbg_list_builds(const struct gbg_list *list);
double gbg_list_bytes(const struct gbg_list *list);

/* Length of the displacement of particle i since the list was built. */
static inline float gbg_list_moved_squared(const struct gbg_list *list, int64_t i)
{
    float sum = 0.0f;
    for (int a = 0; a < list->dimension; a++) {
        float d = (float)(int32_t)(list->local[a][i] - list->built[a][i]) * list->scale[a];
        sum += d * d;
    }
    return sum;
}

#endif
