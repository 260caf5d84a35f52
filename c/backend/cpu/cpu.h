/* L1: the CPU backend's body and the kernels that its instruction sets fill in. */
#ifndef GBG_BACKEND_CPU_CPU_H
#define GBG_BACKEND_CPU_CPU_H

#include "backend/backend.h"
#include "backend/cpu/certify.h"
#include "core/context.h"

/* Particles of a slice with a neighbour (slots at index) whose squared distance is below the limit;
 * returns their number. */
struct gbg_list;
struct gbg_search_kernels;
struct gbg_ewald_kernels;
typedef int64_t (*gbg_cpu_screen)(const struct gbg_list *list, int64_t slice, const int32_t *index,
                                  float squared_limit, int32_t *found);

/* Particles within the limit of i, of those in the runs of slots, in their order; returns their
 * number. found has room for all and a vector more. */
struct gbg_near;
struct gbg_run;
typedef int64_t (*gbg_cpu_find)(const struct gbg_near *near, int64_t i, const struct gbg_run *runs,
                                int n_runs, int32_t *found);
/* Writes index in ascending order of the (distinct) keys into every GBG_SLICE-th element of row;
 * key has room for a vector more. Time grows as the square of the count. */
typedef void (*gbg_cpu_lay_row)(const int32_t *index, int32_t *key, int64_t count, int32_t *row);
/* Local coordinates of particles first .. end-1 (first a multiple of every vector); returns the
 * largest squared displacement since the list was built. */
typedef float (*gbg_cpu_follow)(const struct gbg_state *state, struct gbg_list *list, int64_t first,
                                int64_t end);
/* For the rule event: free moves of particles first .. end-1 for the screen below, and squares of
 * the longest and of the largest distance from a start of the step to where the list was built. */
typedef void (*gbg_cpu_event_moves)(const struct gbg_state *state, const struct gbg_list *list,
                                    int64_t first, int64_t end, uint32_t *move, float *third,
                                    float *moved, float *started);
/* Pairs of a slice (two indices each) whose straight paths come nearer than the limit. */
typedef int64_t (*gbg_cpu_event_screen)(const struct gbg_list *list, int64_t slice,
                                        const int32_t *index, const uint32_t *move,
                                        const float *third, float limit, int32_t *pair);

/* The kernels of one instruction set (c/backend/cpu/kernels.c, compiled once for each). */
struct gbg_cpu_variant {
    const char *name;
    struct gbg_kernels kernels;
    gbg_cpu_screen screen;
    const struct gbg_search_kernels *search;
    const struct gbg_ewald_kernels *ewald;
    gbg_cpu_find find;
    gbg_cpu_lay_row lay_row;
    gbg_cpu_follow follow;
    gbg_cpu_certify_moves certify_moves;
    gbg_cpu_certify_screen certify_screen;
    gbg_cpu_event_moves event_moves;
    gbg_cpu_event_screen event_screen;
};

struct gbg_device {
    struct gbg_context *context;
    int threads;
    int poison; /* 1: fresh scratch memory is filled with NaN */
    const struct gbg_cpu_variant *variant;
    struct gbg_kernels kernels; /* of the variant, unless another backend puts its own in place */
    void *workspace;
    size_t workspace_bytes;
};

/* Scratch memory of kernels; undefined contents. Released by gbg_release. */
int gbg_cpu_scratch(struct gbg_device *device, void **pointer, int64_t count, size_t size,
                    const char *what);

/* Memory that the device keeps for its next kernels: grows at first use, undefined contents. */
int gbg_cpu_workspace(struct gbg_device *device, size_t bytes, void **pointer);
double gbg_cpu_scratch_bytes(const struct gbg_device *device);

/* Functions of the backend that the poison backend shares. */
int gbg_cpu_probe(struct gbg_context *context);
int gbg_cpu_create(struct gbg_context *context, struct gbg_device **device);
void gbg_cpu_destroy(struct gbg_device *device);
void gbg_cpu_release(struct gbg_device *device, void *pointer);
int gbg_cpu_copy(struct gbg_device *device, void *to, const void *from, size_t bytes);
int gbg_cpu_sync(struct gbg_device *device);
const struct gbg_kernels *gbg_cpu_kernels(const struct gbg_device *device);

#endif
