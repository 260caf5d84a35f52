/* L1, CUDA: what is in a pair list and its cells, in plain C: for kernels and for tests. */
#ifndef GBG_CUDA_ROWS_H
#define GBG_CUDA_ROWS_H

#include <stdint.h>

struct gbg_device;
struct gbg_list;
struct gbg_state;

enum { GBG_CUDA_SLICE = 32, GBG_CUDA_BRIDGE_SLOTS = 8192 };

/* What kernels read of a list: passed to them by value. Local coordinates, shift and scale are
 * those of backend/cpu/list.h, bit for bit, and so are the neighbours in a row and their order
 * (ascending ranks); a row shorter than its slice is filled up with the particle itself. */
struct gbg_cuda_rows {
    int dimension;
    int shift[3];
    float scale[3];
    int64_t n, slices;
    uint32_t *local[3];      /* present */
    uint32_t *built[3];      /* when the list was built */
    uint32_t *built_high[3]; /* high words then */
    int64_t *offset;         /* slices: into index, in any order, with room between;
                                behind them totals of a build */
    int32_t *width;          /* slices: longest row */
    int32_t *index;          /* neighbour k of particle 32 s + l: index[offset[s] + 32 k + l] */
};

struct gbg_cuda_grid {
    int dimension;
    int cells[3];
    int64_t n, n_cells, cell_capacity, particle_capacity;
    /* on the device */
    int32_t *first;    /* n_cells + 1: where a cell begins */
    int32_t *particle; /* n: indices, sorted by cell, ascending inside a cell */
    uint32_t *high[3]; /* n: high words of the coordinates in the same order */
    int32_t *cell_of;  /* n: cell of each particle, in the original order */
};

#ifdef __cplusplus
extern "C" {
#endif
/* Its arrays are on the device. */
const struct gbg_cuda_rows *gbg_cuda_list_rows(const struct gbg_list *list);
const struct gbg_cuda_grid *gbg_cuda_list_grid(const struct gbg_list *list);
/* Brings the local coordinates up to date; *largest: largest squared displacement since the list
 * was built. */
int gbg_cuda_list_follow(struct gbg_device *device, const struct gbg_state *state,
                         struct gbg_list *list, float *largest);
/* Builds the lists of forces and of contacts of an engine, either of which may be NULL, at the
 * present positions: the second is sifted out of the first if that is the longer. */
int gbg_cuda_lists_build(struct gbg_device *device, struct gbg_state *state, struct gbg_list *pairs,
                         struct gbg_list *contacts);
/* Gives the rows of a list of forces back: from now on it has none (unlisted.h). GBG_E_MEMORY, and
 * nothing is changed, if the scene cannot do without; the sentence is that of before. */
int gbg_cuda_list_unlist(struct gbg_device *device, const struct gbg_state *state,
                         struct gbg_list *list);
/* The slots of the tables that the rule bridge has in shared memory, for the discs of a block each:
 * at most so many from its next call on (at first GBG_CUDA_BRIDGE_SLOTS); and how many blocks of
 * its last call needed more and had their tables elsewhere. Results are the same. */
int gbg_cuda_bridge_limit(struct gbg_device *device, struct gbg_list *list, int slots);
int64_t gbg_cuda_bridge_spilled(const struct gbg_list *list);
#ifdef __cplusplus
}
#endif

#endif
