/* L1: the CPU backend: memory, and the choice of instruction set at run time. */
#include "backend/cpu/cpu.h"

#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "core/text.h"

extern const struct gbg_cpu_variant gbg_cpu_variant_generic;
#ifdef GBG_X86_VARIANTS
extern const struct gbg_cpu_variant gbg_cpu_variant_avx2, gbg_cpu_variant_avx512;
#endif

enum { MOST_VARIANTS = 3 };

/* The variants that this processor can run, best first. */
static int usable(const struct gbg_cpu_variant *list[MOST_VARIANTS])
{
    int n = 0;
#ifdef GBG_X86_VARIANTS
    __builtin_cpu_init();
    int avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    if (avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw")) {
        list[n++] = &gbg_cpu_variant_avx512;
    }
    if (avx2) {
        list[n++] = &gbg_cpu_variant_avx2;
    }
#endif
    list[n++] = &gbg_cpu_variant_generic;
    return n;
}

int gbg_cpu_probe(struct gbg_context *context)
{
    const struct gbg_cpu_variant *list[MOST_VARIANTS];
    int n = usable(list);
    if (!context->instructions[0]) {
        gbg_text_copy(context->instructions, sizeof context->instructions, list[0]->name);
        return GBG_OK;
    }
    char names[64] = "";
    for (int k = 0; k < n; k++) {
        if (strcmp(list[k]->name, context->instructions) == 0) {
            return GBG_OK;
        }
        strcat(strcat(names, k ? ", " : ""), list[k]->name);
    }
    return gbg_fail(context, GBG_E_NAME,
                    "isa=%s cannot be had; this build has on this processor: "
                    "%s",
                    context->instructions, names);
}

int gbg_cpu_create(struct gbg_context *context, struct gbg_device **device)
{
    void *body;
    int status = gbg_allocate_zero(context, &body, 1, sizeof **device, "CPU backend");
    if (status != GBG_OK) {
        return status;
    }
    *device = body;
    (*device)->context = context;
    (*device)->threads = context->threads;
    const struct gbg_cpu_variant *list[MOST_VARIANTS];
    int n = usable(list);
    for (int k = n - 1; k >= 0; k--) {
        if (k == n - 1 || strcmp(list[k]->name, context->instructions) == 0) {
            (*device)->variant = list[k];
            (*device)->kernels = list[k]->kernels;
        }
    }
    return GBG_OK;
}

void gbg_cpu_destroy(struct gbg_device *device)
{
    if (device) {
        gbg_release(device->workspace);
    }
    gbg_release(device);
}

int gbg_cpu_scratch(struct gbg_device *device, void **pointer, int64_t count, size_t size,
                    const char *what)
{
    int status = gbg_allocate(device->context, pointer, count, size, what);
    if (status == GBG_OK && device->poison) {
        memset(*pointer, 0xFF, (size_t)count * size);
    }
    return status;
}

int gbg_cpu_workspace(struct gbg_device *device, size_t bytes, void **pointer)
{
    if (bytes > device->workspace_bytes) {
        gbg_release(device->workspace);
        device->workspace_bytes = 0;
        int status = gbg_cpu_scratch(device, &device->workspace, (int64_t)bytes, 1, "workspace");
        if (status != GBG_OK) {
            return status;
        }
        device->workspace_bytes = bytes;
    }
    *pointer = device->workspace;
    return GBG_OK;
}

double gbg_cpu_scratch_bytes(const struct gbg_device *device)
{
    return (double)device->workspace_bytes;
}

static int allocate(struct gbg_device *device, void **pointer, int64_t count, size_t size,
                    const char *what)
{
    return gbg_allocate_zero(device->context, pointer, count, size, what);
}

void gbg_cpu_release(struct gbg_device *device, void *pointer)
{
    (void)device;
    gbg_release(pointer);
}

int gbg_cpu_copy(struct gbg_device *device, void *to, const void *from, size_t bytes)
{
    (void)device;
    memcpy(to, from, bytes);
    return GBG_OK;
}

int gbg_cpu_sync(struct gbg_device *device)
{
    (void)device;
    return GBG_OK;
}

/* Particles a thread in a short-range step below which another thread does not pay: starting the
 * team some ten times a step costs as much as 1000 to 2000 particles. */
enum { GRAIN = 1000 };

static void expect(struct gbg_device *device, int64_t n)
{
    int64_t most = n / GRAIN > 1 ? n / GRAIN : 1;
    if (!device->context->threads_given && device->threads > most) {
        device->threads = (int)most;
    }
}

const struct gbg_kernels *gbg_cpu_kernels(const struct gbg_device *device)
{
    return &device->kernels;
}

const struct gbg_backend gbg_backend_cpu = {
    .name = "cpu",
    .probe = gbg_cpu_probe,
    .create = gbg_cpu_create,
    .destroy = gbg_cpu_destroy,
    .allocate = allocate,
    .release = gbg_cpu_release,
    .upload = gbg_cpu_copy,
    .download = gbg_cpu_copy,
    .sync = gbg_cpu_sync,
    .expect = expect,
    .scratch_bytes = gbg_cpu_scratch_bytes,
    .kernels = gbg_cpu_kernels,
};
