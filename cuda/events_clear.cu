/* L1, CUDA: the check that nobody came too close on the bent paths of the rule event. It is asked
 * for only after steps of the order of a diameter, which are rare and mostly done on the host: so
 * it is the CPU's check there. After a step on the device the host makes the same paths once more,
 * from the free ones. */
#include "cuda/events.h"

#include "cuda/kernels.h"

/* Puts back where the free paths of all particles with events ended. */
static int restore_free(struct gbg_device *device, const struct gbg_cuda_events *work,
                        struct gbg_state *copy)
{
    int64_t count = work->report.members;
    void *memory;
    int status = gbg_allocate(device->context, &memory, count, sizeof(struct gbg_cuda_member),
                              "paths of collisions");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_cuda_member *member = (struct gbg_cuda_member *)memory;
    if (count > 0) {
        status =
            gbg_cuda_fetch(device, member, work->arrays.member, (size_t)count * sizeof *member);
    }
    for (int64_t m = 0; status == GBG_OK && m < count; m++) {
        for (int a = 0; member[m].cluster >= 0 && a < copy->box.dimension; a++) {
            copy->high[a][member[m].particle] = (uint32_t)(member[m].free[a] >> 32);
            copy->low[a][member[m].particle] = (uint32_t)member[m].free[a];
        }
    }
    gbg_release(memory);
    return status;
}

int gbg_cuda_events_clear(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                          double tolerance, struct gbg_pair *first)
{
    struct gbg_cuda_events *work = list->events;
    struct gbg_state copy;
    first->first = first->second = -1;
    first->distance = 0.0;
    if (!work || state->owned == 0) {
        return GBG_OK;
    }
    int status = gbg_cuda_events_download(device, state, work, &copy);
    if (status == GBG_OK && !work->on_host && work->report.done) {
        struct gbg_contacts ignored = {};
        status = restore_free(device, work, &copy);
        status = status ? status
                        : gbg_cuda_events_host_run(work->host, &copy, list->reach, list->radius,
                                                   &ignored);
        work->on_host = status == GBG_OK;
        status = status ? status : gbg_cuda_events_download(device, state, work, &copy);
    }
    return status || !work->on_host
               ? status
               : gbg_cuda_events_host_clear(work->host, &copy, tolerance, first);
}
