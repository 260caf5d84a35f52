/* L1, CUDA: the rule event by the CPU's kernels, for steps whose clusters outgrow the device's
 * queues or whose paths leave the list: the CPU's results are by design the same bits. */
#include "cuda/events_host.h"

#include <math.h>

extern "C" {
#include "core/memory.h"
}

struct gbg_cuda_events_host {
    struct gbg_context context; /* of the CPU's device: its messages are passed on */
    struct gbg_context *asked;
    const struct gbg_backend *backend;
    struct gbg_device *device;
    const struct gbg_kernels *kernels;
    struct gbg_list *list;
    double reach, radius;
    int64_t n;
};

static int pass_on(struct gbg_cuda_events_host *host, int status)
{
    return status == GBG_OK
               ? GBG_OK
               : gbg_fail(host->asked, status, "collisions on the host: %s", host->context.message);
}

int gbg_cuda_events_host_create(struct gbg_context *context, struct gbg_cuda_events_host **host)
{
    void *body;
    int status = gbg_allocate_zero(context, &body, 1, sizeof(struct gbg_cuda_events_host),
                                   "collisions on the host");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_cuda_events_host *made = (struct gbg_cuda_events_host *)body;
    made->asked = context;
    made->backend = gbg_backend_find("cpu");
    made->context.threads = context->threads > 0 ? context->threads : 1;
    made->context.sink = context->sink;
    made->context.sink_user = context->sink_user;
    status = made->backend->probe(&made->context);
    status = status ? status : made->backend->create(&made->context, &made->device);
    if (status != GBG_OK) {
        status = pass_on(made, status);
        gbg_release(made);
        return status;
    }
    made->kernels = made->backend->kernels(made->device);
    *host = made;
    return GBG_OK;
}

void gbg_cuda_events_host_destroy(struct gbg_cuda_events_host *host)
{
    if (host) {
        if (host->list) {
            host->kernels->list_destroy(host->device, host->list);
        }
        host->backend->destroy(host->device);
    }
    gbg_release(host);
}

/* A list of these lengths, built at the present coordinates. */
static int list_for(struct gbg_cuda_events_host *host, struct gbg_state *state, double reach,
                    double radius)
{
    int status = GBG_OK;
    if (host->list && (host->reach != reach || host->radius != radius || host->n != state->owned)) {
        host->kernels->list_destroy(host->device, host->list);
        host->list = NULL;
    }
    if (!host->list) {
        status = host->kernels->list_create(host->device, state, reach, radius, &host->list);
        host->reach = reach;
        host->radius = radius;
        host->n = state->owned;
    }
    return status ? status : host->kernels->list_update(host->device, state, host->list, INFINITY);
}

int gbg_cuda_events_host_run(struct gbg_cuda_events_host *host, struct gbg_state *state,
                             double reach, double radius, struct gbg_contacts *contacts)
{
    int status = list_for(host, state, reach, radius);
    status = status ? status : host->kernels->events(host->device, state, host->list, contacts);
    return pass_on(host, status);
}

int gbg_cuda_events_host_clear(struct gbg_cuda_events_host *host, struct gbg_state *state,
                               double tolerance, struct gbg_pair *first)
{
    int status = host->kernels->events_clear(host->device, state, host->list, tolerance, first);
    return pass_on(host, status);
}
