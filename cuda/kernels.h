/* L1, CUDA: the kernels of this backend. Contracts: backend/backend.h. */
#ifndef GBG_CUDA_KERNELS_H
#define GBG_CUDA_KERNELS_H

#include "cuda/cuda.h"

extern const struct gbg_kernels gbg_cuda_kernels;

int gbg_cuda_normals(struct gbg_device *device, const struct gbg_noise *noise, uint64_t step,
                     uint64_t first, int64_t n, int dimension, double *values);
int gbg_cuda_integrate(struct gbg_device *device, struct gbg_state *state,
                       const struct gbg_noise *noise, uint64_t step, double dt, int sign,
                       struct gbg_moves *moves);

/* Batches of steps. */
int gbg_cuda_steps(struct gbg_device *device, struct gbg_state *state, struct gbg_batch *batch);
void gbg_cuda_steps_release(struct gbg_device *device);
double gbg_cuda_steps_bytes(const struct gbg_device *device);

/* Forces. direct_targets: targets and results live on the host. */
int gbg_cuda_direct_mixed(struct gbg_device *device, struct gbg_state *state, double power,
                          int add);
int gbg_cuda_direct_double(struct gbg_device *device, struct gbg_state *state, double power,
                           int add);
int gbg_cuda_direct_strict(struct gbg_device *device, struct gbg_state *state, double power,
                           int add);
int gbg_cuda_direct_reserve(struct gbg_device *device, const struct gbg_state *state);
int gbg_cuda_direct_targets(struct gbg_device *device, struct gbg_state *state, double power,
                            double cutoff, int64_t n_targets, const int32_t *target,
                            double *const *out);
/* Design 0 (tiles in shared memory) or 1 (warp shuffle) of Carter (2016), for the benchmark. */
int gbg_cuda_direct_published(struct gbg_device *device, struct gbg_state *state, double power,
                              int design);
/* Sums over all images by a mesh. */
int gbg_cuda_ewald_create(struct gbg_device *device, const struct gbg_state *state,
                          const struct gbg_ewald_plan *plan, int hurry, struct gbg_ewald **sum);
void gbg_cuda_ewald_destroy(struct gbg_device *device, struct gbg_ewald *sum);
int gbg_cuda_ewald_force(struct gbg_device *device, struct gbg_state *state, struct gbg_ewald *sum,
                         int add);
int gbg_cuda_ewald_potential(struct gbg_device *device, struct gbg_state *state,
                             struct gbg_ewald *sum, double *potential);
double gbg_cuda_ewald_bytes(const struct gbg_ewald *sum);
/* The two mixed sums: every target by itself; every pair once for both (power 1 .. 6). */
int gbg_cuda_direct_simple(struct gbg_device *device, struct gbg_state *state, double power,
                           int add);
int gbg_cuda_direct_symmetric(struct gbg_device *device, struct gbg_state *state, double power,
                              int add);
int gbg_cuda_cutoff_mixed(struct gbg_device *device, struct gbg_state *state,
                          const struct gbg_list *list, double power, double cutoff, int add);
int gbg_cuda_cutoff_double(struct gbg_device *device, struct gbg_state *state,
                           const struct gbg_list *list, double power, double cutoff, int add);

int gbg_cuda_arrange(struct gbg_device *device, struct gbg_state *state, int by_place);

/* Hard cores. */
int gbg_cuda_keep(struct gbg_device *device, struct gbg_state *state);
int gbg_cuda_put_back(struct gbg_device *device, struct gbg_state *state);
int gbg_cuda_contacts(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                      struct gbg_contacts *contacts);
int gbg_cuda_bridge(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                    struct gbg_contacts *contacts);
int gbg_cuda_events(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                    struct gbg_contacts *contacts);
int gbg_cuda_events_clear(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                          double tolerance, struct gbg_pair *first);
/* first and second live on the host. */
int gbg_cuda_overlaps(struct gbg_device *device, struct gbg_state *state, double tolerance,
                      int64_t capacity, int32_t *first, int32_t *second, struct gbg_pair *lowest,
                      int64_t *count);
int gbg_cuda_certify(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                     struct gbg_certificate *certificate);
int gbg_cuda_roll_back(struct gbg_device *device, struct gbg_state *state, double tolerance,
                       int straight, int64_t *reverted);

/* Neighbour search: coordinates and results live on the host. */
int gbg_cuda_search_create(struct gbg_device *device, const struct gbg_box *box,
                           struct gbg_search **search);
void gbg_cuda_search_destroy(struct gbg_device *device, struct gbg_search *search);
int gbg_cuda_search_update(struct gbg_device *device, struct gbg_search *search,
                           const struct gbg_search_plan *plan, const struct gbg_points *points,
                           struct gbg_search_report *report);
int gbg_cuda_search_rows(struct gbg_device *device, struct gbg_search *search, int base,
                         int64_t *offset, int32_t *neighbour);
int gbg_cuda_search_pairs(struct gbg_device *device, struct gbg_search *search, int base,
                          int32_t *first, int32_t *second);
int gbg_cuda_search_block(struct gbg_device *device, struct gbg_search *search,
                          struct gbg_search_block *block);
/* Searches of earlier work, for the benchmark. */
int gbg_cuda_search_published(struct gbg_device *device, struct gbg_search *search, int octant,
                              double edge, double *seconds, int64_t *rows);

#endif
