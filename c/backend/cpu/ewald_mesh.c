/* L1, CPU, per instruction set: particles onto the mesh and back, in both precisions. */
#include <string.h>

#ifdef _OPENMP
#include <omp.h>
#endif

#include "backend/cpu/cpu.h"
#include "backend/cpu/ewald.h"
#include "backend/cpu/ewald_blocks.h"
#include "backend/cpu/ewald_lanes.h"

#define ALWAYS static inline __attribute__((always_inline))

enum {
    BATCH = 32,  /* particles whose windows are made together */
    LANES = 8,   /* of a vector, in both precisions */
    WIDEST = 16, /* nodes of a window, padded by zeros */
    SPAN = 32,   /* a window along axis 0 with zeros on both sides */
    DEGREES = GBG_EWALD_DEGREE + 1
};

/* What is read at a particle: the field from a mesh for each axis, or by slopes of the window from
 * the potential; or the potential. */
enum reading { FIELDS, SLOPES, VALUE };

static int thread_number(void)
{
#ifdef _OPENMP
    return omp_get_thread_num();
#else
    return 0;
#endif
}

#define R(name) name##_single
#define REAL float
#define V f8
#define V_(name) f8_##name
#define WIDE uint64_t
#define FRACTION(order, a, i) ((WIDE)(order)->high[a][i])
#define BITS 32
#define OFFSET(bits) ((float)(int32_t)((uint32_t)(bits) ^ 0x80000000u) * 0x1p-31f)
#define SOURCE(order) (order)->source
#define DROPPED 1e-8
#include "backend/cpu/ewald_mesh_part.h"
#undef R
#undef REAL
#undef V
#undef V_
#undef WIDE
#undef FRACTION
#undef BITS
#undef OFFSET
#undef SOURCE
#undef DROPPED

#define R(name) name##_double
#define REAL double
#define V d8
#define V_(name) d8_##name
#define WIDE unsigned __int128
#define FRACTION(order, a, i) ((WIDE)((uint64_t)(order)->high[a][i] << 32 | (order)->low[a][i]))
#define BITS 64
#define OFFSET(bits) ((double)(int64_t)((uint64_t)(bits) ^ 0x8000000000000000u) * 0x1p-63)
#define SOURCE(order) (order)->source_double
#define DROPPED 0.0
#include "backend/cpu/ewald_mesh_part.h"

void GBG_ISA_NAME(gbg_ewald_spread)(struct gbg_device *device, struct gbg_ewald *sum)
{
    (sum->plan.choice.single ? spread_single : spread_double)(device, sum);
}

static void gather(struct gbg_device *device, struct gbg_ewald *sum, enum reading reading)
{
    (sum->plan.choice.single ? gather_single : gather_double)(device, sum, reading);
}

void GBG_ISA_NAME(gbg_ewald_gather)(struct gbg_device *device, struct gbg_ewald *sum)
{
    gather(device, sum, sum->plan.choice.gradient == GBG_GRADIENT_WAVES ? FIELDS : SLOPES);
}

void GBG_ISA_NAME(gbg_ewald_gather_potential)(struct gbg_device *device, struct gbg_ewald *sum)
{
    gather(device, sum, VALUE);
}

const struct gbg_ewald_kernels GBG_ISA_NAME(gbg_ewald_kernels) = {
    .near = GBG_ISA_NAME(gbg_ewald_near),
    .spread = GBG_ISA_NAME(gbg_ewald_spread),
    .gather = GBG_ISA_NAME(gbg_ewald_gather),
    .gather_potential = GBG_ISA_NAME(gbg_ewald_gather_potential),
    .multiply = GBG_ISA_NAME(gbg_ewald_multiply),
};
