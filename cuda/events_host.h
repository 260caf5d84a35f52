/* L1, CUDA: the rule event by the CPU's kernels on a copy of the state in host memory. It shares no
 * struct with this backend but the state's: a device and a list are the CPU's in there. */
#ifndef GBG_CUDA_EVENTS_HOST_H
#define GBG_CUDA_EVENTS_HOST_H

extern "C" {
#include "backend/backend.h"
#include "core/context.h"
}

struct gbg_cuda_events_host;
int gbg_cuda_events_host_create(struct gbg_context *context, struct gbg_cuda_events_host **host);
void gbg_cuda_events_host_destroy(struct gbg_cuda_events_host *host);
int gbg_cuda_events_host_run(struct gbg_cuda_events_host *host, struct gbg_state *state,
                             double reach, double radius, struct gbg_contacts *contacts);
int gbg_cuda_events_host_clear(struct gbg_cuda_events_host *host, struct gbg_state *state,
                               double tolerance, struct gbg_pair *first);

#endif
