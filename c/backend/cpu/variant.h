/* L1: the kernels that are compiled once for every instruction set. Contracts: backend.h. */
#ifndef GBG_BACKEND_CPU_VARIANT_H
#define GBG_BACKEND_CPU_VARIANT_H

#include "backend/backend.h"
#include "backend/cpu/simd.h"

int GBG_ISA_NAME(gbg_cpu_normals)(struct gbg_device *device, const struct gbg_noise *noise,
                                  uint64_t step, uint64_t first, int64_t n, int dimension,
                                  double *values);

#endif
