/* L1: the table of kernels of one instruction set. */
#include "backend/cpu/cpu.h"
#include "backend/cpu/variant.h"

const struct gbg_cpu_variant GBG_ISA_NAME(gbg_cpu_variant) = {
    .name = GBG_SIMD_NAME,
    .kernels = {.normals = GBG_ISA_NAME(gbg_cpu_normals)},
};
