/* L1, CUDA: cut-off forces without stored rows: neighbours are found in cells for each force. */
#ifndef GBG_CUDA_UNLISTED_H
#define GBG_CUDA_UNLISTED_H

#include "cuda/cutoff.h"
#include "cuda/list.h"

/* Neighbours up to which a thread sorts its row in registers, in the two kernels that there are. */
enum { GBG_CUDA_CLOSE_FEW = 32, GBG_CUDA_CLOSE_MANY = 64 };

/* What a list has instead of rows, beside its cells: a tenth of their memory, at a few times their
 * price a force. In the cells stand the present local coordinates in the place of high words. */
struct gbg_cuda_unlisted {
    double displaced;    /* nobody has come farther since the cells were built */
    int64_t place_words; /* words of places */
    int64_t n_ranks;
    void *places;     /* where everybody is, by index (places.h) */
    int32_t *of_rank; /* index of each rank; NULL: the same */
    unsigned *widest; /* longest row that was seen, on the device */
    int many;         /* 1: rows are longer than GBG_CUDA_CLOSE_FEW */
    int looked;       /* 1: `many` fits the rows found since the cells were built */
};

/* 1 if rows of a list of that reach and radius are not to be had of the memory that is free, and
 * the scene can do without: one without hard cores, dense enough for cells of about the reach. */
int gbg_cuda_unlisted_wanted(struct gbg_device *device, const struct gbg_state *state,
                             const struct gbg_list *list);

/* As gbg_cuda_list_update, which calls it. */
int gbg_cuda_unlisted_update(struct gbg_device *device, struct gbg_state *state,
                             struct gbg_list *list, double moved);
void gbg_cuda_unlisted_release(struct gbg_device *device, struct gbg_list *list);
double gbg_cuda_unlisted_bytes(const struct gbg_cuda_unlisted *unlisted);

/* The cut-off sums (power 2 or 6; any), with the bits of those with rows. */
int gbg_cuda_unlisted_mixed(struct gbg_device *device, const struct gbg_state *state,
                            const struct gbg_list *list, const struct gbg_cuda_cutoff *job);
int gbg_cuda_unlisted_double(struct gbg_device *device, const struct gbg_state *state,
                             const struct gbg_list *list, const struct gbg_cuda_cutoff *job);

#endif
