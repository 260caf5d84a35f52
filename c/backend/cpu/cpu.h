/* L1: the CPU backend's body and the kernels that its instruction sets fill in. */
#ifndef GBG_BACKEND_CPU_CPU_H
#define GBG_BACKEND_CPU_CPU_H

#include "backend/backend.h"
#include "core/context.h"

/* The kernels of one instruction set (c/backend/cpu/kernels.c, compiled once for each). */
struct gbg_cpu_variant {
    const char *name;
    struct gbg_kernels kernels;
};

struct gbg_device {
    struct gbg_context *context;
    int threads;
    const struct gbg_cpu_variant *variant;
};

/* Set-up functions shared with the poison backend. */
int gbg_cpu_probe(struct gbg_context *context);
int gbg_cpu_create(struct gbg_context *context, struct gbg_device **device);

#endif
