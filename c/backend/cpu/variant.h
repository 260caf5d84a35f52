/* L1: the kernels that are compiled once for every instruction set. Contracts: backend.h. */
#ifndef GBG_BACKEND_CPU_VARIANT_H
#define GBG_BACKEND_CPU_VARIANT_H

#include "backend/backend.h"
#include "backend/cpu/simd.h"

int GBG_ISA_NAME(gbg_cpu_normals)(struct gbg_device *device, const struct gbg_noise *noise,
                                  uint64_t step, uint64_t first, int64_t n, int dimension,
                                  double *values);
int GBG_ISA_NAME(gbg_cpu_integrate)(struct gbg_device *device, struct gbg_state *state,
                                    const struct gbg_noise *noise, uint64_t step, double dt,
                                    int sign, struct gbg_moves *moves);
int GBG_ISA_NAME(gbg_cpu_cutoff_mixed)(struct gbg_device *device, struct gbg_state *state,
                                       const struct gbg_list *list, double power, double cutoff,
                                       int add);
int GBG_ISA_NAME(gbg_cpu_cutoff_double)(struct gbg_device *device, struct gbg_state *state,
                                        const struct gbg_list *list, double power, double cutoff,
                                        int add);
struct gbg_list;
struct gbg_near;
struct gbg_run;
int64_t GBG_ISA_NAME(gbg_cpu_find)(const struct gbg_near *near, int64_t i,
                                   const struct gbg_run *runs, int n_runs, int32_t *found);
void GBG_ISA_NAME(gbg_cpu_lay_row)(const int32_t *index, int32_t *key, int64_t count, int32_t *row);
float GBG_ISA_NAME(gbg_cpu_follow)(const struct gbg_state *state, struct gbg_list *list,
                                   int64_t first, int64_t end);
struct gbg_certify_work;
int64_t GBG_ISA_NAME(gbg_cpu_screen)(const struct gbg_list *list, int64_t slice,
                                     const int32_t *index, float squared_limit, int32_t *found);
void GBG_ISA_NAME(gbg_cpu_event_moves)(const struct gbg_state *state, const struct gbg_list *list,
                                       int64_t first, int64_t end, uint32_t *move, float *third,
                                       float *moved, float *started);
int64_t GBG_ISA_NAME(gbg_cpu_event_screen)(const struct gbg_list *list, int64_t slice,
                                           const int32_t *index, const uint32_t *move,
                                           const float *third, float limit, int32_t *pair);

void GBG_ISA_NAME(gbg_cpu_certify_moves)(const struct gbg_certify_work *work, int64_t first,
                                         int64_t end, float largest[2]);
int64_t GBG_ISA_NAME(gbg_cpu_certify_screen)(const struct gbg_certify_work *work, int64_t slice,
                                             const int32_t *index, int32_t *found);

extern const struct gbg_search_kernels GBG_ISA_NAME(gbg_search_kernels);

int GBG_ISA_NAME(gbg_cpu_direct_mixed)(struct gbg_device *device, struct gbg_state *state,
                                       double power, int add);
int GBG_ISA_NAME(gbg_cpu_direct_double)(struct gbg_device *device, struct gbg_state *state,
                                        double power, int add);
int GBG_ISA_NAME(gbg_cpu_direct_strict)(struct gbg_device *device, struct gbg_state *state,
                                        double power, int add);

int GBG_ISA_NAME(gbg_cpu_bridge)(struct gbg_device *device, struct gbg_state *state,
                                 struct gbg_list *list, struct gbg_contacts *contacts);

#endif
