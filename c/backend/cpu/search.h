/* L1, CPU: neighbour search: cells, sorted particles, rows of neighbours. */
#ifndef GBG_BACKEND_CPU_SEARCH_H
#define GBG_BACKEND_CPU_SEARCH_H

#include <stdint.h>

#include "backend/backend.h"
#include "backend/cpu/search_frame.h"

enum { GBG_SEARCH_ROWS = 25, GBG_SEARCH_RUNS = 2 * GBG_SEARCH_ROWS, GBG_SEARCH_THREAD_SHIFT = 48 };

/* One thread's memory: rows one after the other, and what it needs to make one. */
struct gbg_search_store {
    int32_t *index;
    int64_t used, capacity;
};
struct gbg_search_thread {
    struct gbg_search_store list, out; /* kept rows of a list with a skin; rows of the result */
    int32_t *candidate, *row, *other;  /* ids of candidates, eight rows, and room to sort one */
    uint32_t *place[3];                /* local coordinates of the candidates */
    int64_t room;                      /* candidates that fit */
    int64_t looked;                    /* candidates of all particles */
    int64_t found;                     /* neighbours of all particles */
    int64_t crowded;                   /* a particle in a cell that was taken; -1 */
    int status;
};

/* Where the row of a particle begins, thread << 48 | offset, and its length. */
struct gbg_search_row {
    uint64_t begin;
    int64_t count;
};

struct gbg_search {
    struct gbg_search_frame frame;
    int64_t n_capacity;
    int has_result, has_list;

    int64_t key_capacity;
    int rows, row_keys; /* inside the box: rows of candidates of a key, and the keys of each */
    int64_t row_from[8][GBG_SEARCH_ROWS]; /* of an octant: first key of each, less the first of the
                                             cell */
    int32_t *first; /* n_keys + 1: first slot of a key; occupancy: the particle of a cell or -1 */

    uint64_t *fraction[3], *built[3];  /* in the caller's order: now, and when the list was made */
    int32_t *key;                      /* in the caller's order */
    uint32_t *record;                  /* scratch of the sort: key, particle, local coordinates */
    int32_t *particle;                 /* in the order of keys, inside a key ascending */
    uint32_t *local[3];                /* the same order; occupancy: the caller's */
    int32_t *slot;                     /* of each particle; lists with a skin only */
    struct gbg_search_row *list, *out; /* in the caller's order */

    int threads;
    struct gbg_search_thread *thread;
    int64_t *histogram; /* threads x buckets */
    int64_t histogram_capacity;
};

struct gbg_search_run {
    int32_t begin, end;
};

/* What is compiled once for each instruction set. */
struct gbg_search_kernels {
    /* Fractions of particles begin..end-1; their keys from the fractions. */
    void (*encode)(struct gbg_search *search, const struct gbg_points *points, int64_t begin,
                   int64_t end);
    void (*keys)(struct gbg_search *search, int64_t begin, int64_t end);
    /* Rows of all particles in keys begin..end-1: of the kept list if there is a skin, else of
     * the result. */
    void (*scan)(struct gbg_device *device, struct gbg_search *search, int thread, int64_t begin,
                 int64_t end);
    /* The same for cells of at most one particle. */
    void (*scan_occupied)(struct gbg_device *device, struct gbg_search *search, int thread,
                          int64_t begin, int64_t end);
    /* Rows of the result from the kept rows of slots begin..end-1. */
    void (*filter)(struct gbg_device *device, struct gbg_search *search, int thread, int64_t begin,
                   int64_t end);
    /* Rows of particles begin..end-1 to the caller, from element `at` on. */
    void (*hand_out)(const struct gbg_search *search, int64_t begin, int64_t end, int64_t at,
                     int base, int64_t *offset, int32_t *neighbour);
};

int gbg_search_create(struct gbg_device *device, const struct gbg_box *box,
                      struct gbg_search **search);
void gbg_search_destroy(struct gbg_device *device, struct gbg_search *search);
int gbg_search_update(struct gbg_device *device, struct gbg_search *search,
                      const struct gbg_search_plan *plan, const struct gbg_points *points,
                      struct gbg_search_report *report);
int gbg_search_csr(struct gbg_device *device, struct gbg_search *search, int base, int64_t *offset,
                   int32_t *neighbour);
int gbg_search_pairs(struct gbg_device *device, struct gbg_search *search, int base, int32_t *first,
                     int32_t *second);
int gbg_search_block(struct gbg_device *device, struct gbg_search *search,
                     struct gbg_search_block *block);

/* Cells for a reach (the radius, with a skin more), and memory for them. */
int gbg_search_choose_cells(struct gbg_device *device, struct gbg_search *search, double reach);
/* Cells for the part of the box that the particles take, where it is small; 0: it is not. */
int gbg_search_zoom(struct gbg_search *search);
/* Sorts the encoded particles by key into `particle` and `local`. */
int gbg_search_sort(struct gbg_device *device, struct gbg_search *search);
/* Memory for n particles. */
int gbg_search_reserve(struct gbg_device *device, struct gbg_search *search, int64_t n);
void gbg_search_release(struct gbg_search *search);
/* Room for `more` indices in a store. */
int gbg_search_grow(struct gbg_device *device, struct gbg_search_store *store, int64_t more);
/* Room for candidates of one cell. */
int gbg_search_room(struct gbg_device *device, struct gbg_search_thread *thread, int dimension,
                    int64_t candidates);

/* Runs of slots that hold all candidates of a key at cell c[3]; returns their number. */
int gbg_search_runs(const struct gbg_search *search, const int c[3], int octant,
                    struct gbg_search_run *runs);

/* Threads worth starting for n particles. */
int gbg_search_threads(const struct gbg_search *search, int64_t n);

static inline int32_t *gbg_search_row(const struct gbg_search *search, int64_t i)
{
    uint64_t at = search->out[i].begin;
    return search->thread[at >> GBG_SEARCH_THREAD_SHIFT].out.index +
           (at & ((UINT64_C(1) << GBG_SEARCH_THREAD_SHIFT) - 1));
}

static inline int gbg_search_within(const struct gbg_search *search, int64_t i, int64_t j)
{
    return gbg_search_rule(&search->frame, search->frame.box.dimension, search->fraction, i, j);
}

#endif
