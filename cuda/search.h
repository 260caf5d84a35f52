/* L1, CUDA: neighbour search: cells, sorted particles, rows of neighbours. */
#ifndef GBG_CUDA_SEARCH_H
#define GBG_CUDA_SEARCH_H

#include "cuda/kernels.h"

extern "C" {
#include "backend/cpu/search_frame.h"
}

/* What kernels count; all zero is the start. */
struct gbg_cuda_totals {
    unsigned long long rows;    /* neighbours of all particles */
    unsigned long long looked;  /* candidates of all particles */
    unsigned long long longest; /* row */
    unsigned long long far;     /* 1: somebody has moved too far for the list that is kept */
    unsigned long long crowded; /* ~ of the lowest particle in a cell that was taken; 0: none */
    long long low[3], high[3];  /* differences of fractions to those of particle 0 */
    uint64_t first[3];          /* fractions of particle 0 */
    int64_t taken_by;           /* the particle in the cell of the crowded one */
    double squared;             /* their distance */
};

/* Rows of neighbours in the caller's order: of particle i from offset[i] to offset[i + 1]. */
struct gbg_cuda_rows {
    int64_t *offset;
    int32_t *index;
    int64_t capacity; /* of index */
    int64_t total, longest;
};

struct gbg_search {
    struct gbg_search_frame frame;
    int has_result, has_list, has_pairs;
    int base; /* that indices and offsets of `out` are counted from */
    int64_t n_capacity, key_capacity, pair_capacity;
    int listed_capacity; /* 1: the arrays for lists with a skin are there too */

    /* on the device */
    uint64_t *fraction[3], *built[3]; /* in the caller's order: now, and when the list was made */
    uint32_t *key, *key_sorted;       /* in the caller's order, and in theirs */
    int32_t *particle;                /* in the order of keys, inside a key ascending */
    int32_t *slot;                    /* of each particle */
    uint4 *place;   /* local coordinates and the particle, in the order of keys; occupancy: in the
                       caller's */
    int32_t *first; /* n_keys + 1: first slot of a key; occupancy: the particle of a cell or -1 */
    struct gbg_cuda_rows out, list; /* entries of the list are slots */
    int64_t *pair_offset;           /* n + 1: pairs before those with a first particle */
    struct gbg_cuda_totals *totals;
    cudaEvent_t event[2]; /* coordinates are there; rows are there */

    /* on the host */
    double *gathered; /* coordinates that stand far apart at the caller */
    int64_t gathered_capacity;
    void *batch; /* pairs batch_begin.. batch_end-1: separations, first, second */
    int64_t batch_begin, batch_end;
};

/* Rows of all particles: their lengths in rows->offset, or their entries behind these offsets. */
typedef int gbg_cuda_scan(struct gbg_device *device, const struct gbg_search *search,
                          const struct gbg_cuda_rows *rows, int fill);
gbg_cuda_scan gbg_cuda_scan_sorted, gbg_cuda_scan_occupied, gbg_cuda_scan_brute;
/* From the kept rows of the list. */
gbg_cuda_scan gbg_cuda_scan_list;

/* Fractions of the caller's coordinates. */
int gbg_cuda_search_encode(struct gbg_device *device, struct gbg_search *search,
                           const struct gbg_points *points);
/* Cells and keys for the fractions. A set for which there would be far more cells than particles
 * may stand in a small part of the box, which cells then cover alone. */
int gbg_cuda_search_place(struct gbg_device *device, struct gbg_search *search, double reach);
/* The particles in the order of keys. */
int gbg_cuda_search_sort(struct gbg_device *device, struct gbg_search *search);
/* Local coordinates for the order there is. */
int gbg_cuda_search_locate(struct gbg_device *device, struct gbg_search *search);
/* The particles in cells of one each; totals tell if that was not possible. */
int gbg_cuda_search_occupy(struct gbg_device *device, struct gbg_search *search);
/* Each element becomes the sum of those before it. */
int gbg_cuda_search_sum(struct gbg_device *device, int64_t *values, int64_t n);
/* The entries of each row in ascending order. */
int gbg_cuda_search_sort_rows(struct gbg_device *device, const struct gbg_cuda_rows *rows,
                              int64_t n);

#endif
