/* L1: the CPU backend's body and the kernels that its instruction sets fill in. */
#ifndef GBG_BACKEND_CPU_CPU_H
#define GBG_BACKEND_CPU_CPU_H

#include "backend/backend.h"
#include "core/context.h"

struct gbg_device {
    struct gbg_context *context;
    int threads;
};

/* Set-up functions shared with the poison backend. */
int gbg_cpu_probe(struct gbg_context *context);

#endif
