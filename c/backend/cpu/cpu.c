/* L1: the CPU backend: memory, and the choice of instruction set at run time. */
#include "backend/cpu/cpu.h"

#include <stdlib.h>
#include <string.h>

#include "core/memory.h"

int gbg_cpu_probe(struct gbg_context *context)
{
    strcpy(context->instructions, "generic");
    return GBG_OK;
}

static int create(struct gbg_context *context, struct gbg_device **device)
{
    void *body;
    int status = gbg_allocate_zero(context, &body, 1, sizeof **device, "CPU backend");
    if (status == GBG_OK) {
        *device = body;
        (*device)->context = context;
        (*device)->threads = context->threads;
    }
    return status;
}

static void destroy(struct gbg_device *device)
{
    gbg_release(device);
}

static int allocate(struct gbg_device *device, void **pointer, int64_t count, size_t size,
                    const char *what)
{
    return gbg_allocate_zero(device->context, pointer, count, size, what);
}

static void release(struct gbg_device *device, void *pointer)
{
    (void)device;
    gbg_release(pointer);
}

static int copy(struct gbg_device *device, void *to, const void *from, size_t bytes)
{
    (void)device;
    memcpy(to, from, bytes);
    return GBG_OK;
}

static int sync(struct gbg_device *device)
{
    (void)device;
    return GBG_OK;
}

const struct gbg_backend gbg_backend_cpu = {
    .name = "cpu",
    .probe = gbg_cpu_probe,
    .create = create,
    .destroy = destroy,
    .allocate = allocate,
    .release = release,
    .upload = copy,
    .download = copy,
    .sync = sync,
};
