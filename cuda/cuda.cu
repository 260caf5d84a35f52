/* L1, CUDA: the backend itself: choice of the device, memory, transfers, errors. */
#include "cuda/cuda.h"

#include <stdio.h>

#include "cuda/frame.h"
#include "cuda/kernels.h"
#include "cuda/list.h"

extern "C" {
#include "core/text.h"
}

#ifndef GBG_CUDA_OLDEST
#define GBG_CUDA_OLDEST 80
#endif
enum { OLDEST = GBG_CUDA_OLDEST }; /* compute capability times ten: what the kernels need */

static int64_t live; /* arrays on all devices, for tests */

extern "C" int64_t gbg_cuda_live(void)
{
    return __atomic_load_n(&live, __ATOMIC_RELAXED);
}

int gbg_cuda_status(struct gbg_device *device, cudaError_t error, const char *what)
{
    if (error == cudaSuccess && !device->failure[0]) {
        return GBG_OK;
    }
    cudaGetLastError(); /* what can be forgotten is */
    if (!device->failure[0]) {
        char sentence[sizeof device->failure];
        snprintf(sentence, sizeof sentence, "cuda:%d: %s: %s (%s)", device->number, what,
                 cudaGetErrorString(error), cudaGetErrorName(error));
        if (error == cudaErrorMemoryAllocation) {
            return gbg_fail(device->context, GBG_E_MEMORY, "%s", sentence);
        }
        memcpy(device->failure, sentence, sizeof sentence);
    }
    return gbg_fail(device->context, GBG_E_DEVICE, "%s", device->failure);
}

int gbg_cuda_started(struct gbg_device *device, const char *kernel)
{
    return gbg_cuda_status(device, cudaGetLastError(), kernel);
}

int gbg_cuda_use(struct gbg_device *device)
{
    return gbg_cuda_status(device, cudaSetDevice(device->number), "choosing the GPU");
}

/* GBG_OK if there is any GPU; their number. */
static int count_devices(struct gbg_context *context, int *count)
{
    int driver = 0;
    cudaError_t error = cudaGetDeviceCount(count);
    cudaGetLastError();
    if (error == cudaErrorInsufficientDriver) {
        cudaDriverGetVersion(&driver);
        if (driver == 0) {
            return gbg_fail(context, GBG_E_UNBUILT,
                            "backend cuda: no GPU can be used: no driver is installed");
        }
        return gbg_fail(context, GBG_E_UNBUILT,
                        "backend cuda: no GPU can be used: the driver is for CUDA %d.%d, this "
                        "build needs one for %d.%d",
                        driver / 1000, driver % 1000 / 10, CUDART_VERSION / 1000,
                        CUDART_VERSION % 1000 / 10);
    }
    if (error != cudaSuccess || *count == 0) {
        return gbg_fail(context, GBG_E_UNBUILT, "backend cuda: no GPU was found (%s)",
                        error == cudaSuccess ? "none is visible" : cudaGetErrorString(error));
    }
    return GBG_OK;
}

/* Why the device cannot be used, as the context's message; GBG_OK if it can. */
static int probe(struct gbg_context *context)
{
    int count = 0, mode = cudaComputeModeDefault;
    if (context->instructions[0]) {
        return gbg_fail(context, GBG_E_NAME,
                        "isa=%s: backend cuda has no instruction sets to choose from; leave isa "
                        "away",
                        context->instructions);
    }
    int status = count_devices(context, &count);
    if (status != GBG_OK) {
        return status;
    }
    if (context->device >= count) {
        return gbg_fail(context, GBG_E_UNBUILT,
                        "backend cuda: there is no GPU %d; there %s %d, counted from 0",
                        context->device, count == 1 ? "is" : "are", count);
    }
    cudaDeviceProp properties;
    cudaError_t error = cudaGetDeviceProperties(&properties, context->device);
    error = error ? error : cudaDeviceGetAttribute(&mode, cudaDevAttrComputeMode, context->device);
    cudaGetLastError();
    if (error != cudaSuccess) {
        return gbg_fail(context, GBG_E_DEVICE, "backend cuda: GPU %d does not answer: %s",
                        context->device, cudaGetErrorString(error));
    }
    if (10 * properties.major + properties.minor < OLDEST) {
        return gbg_fail(context, GBG_E_UNBUILT,
                        "backend cuda: GPU %d, %s, has compute capability %d.%d; this build needs "
                        "%d.%d or later (CMAKE_CUDA_ARCHITECTURES)",
                        context->device, properties.name, properties.major, properties.minor,
                        OLDEST / 10, OLDEST % 10);
    }
    if (mode == cudaComputeModeProhibited) {
        return gbg_fail(context, GBG_E_UNBUILT,
                        "backend cuda: GPU %d, %s, is set to compute nothing (compute mode "
                        "prohibited)",
                        context->device, properties.name);
    }
    snprintf(context->card, sizeof context->card, "%.63s", properties.name);
    snprintf(context->instructions, sizeof context->instructions, "sm_%d%d", properties.major,
             properties.minor);
    return GBG_OK;
}

/* After a failure the waits and releases return at once; what they say is of no use. */
static void destroy(struct gbg_device *device)
{
    if (device) {
        cudaSetDevice(device->number);
        if (device->stream) {
            cudaStreamSynchronize(device->stream);
        }
        gbg_cuda_steps_release(device);
        gbg_cuda_release(device, device->workspace, (int64_t)device->workspace_bytes, 1);
        if (device->staging) {
            cudaFreeHost(device->staging);
        }
        if (device->stream) {
            cudaStreamDestroy(device->stream);
        }
        cudaGetLastError();
    }
    gbg_release(device);
}

static __global__ void nothing()
{
}

static int ask(struct gbg_device *device)
{
    cudaError_t error = cudaDeviceGetAttribute(&device->multiprocessors,
                                               cudaDevAttrMultiProcessorCount, device->number);
    error =
        error ? error
              : cudaDeviceGetAttribute(&device->clusters, cudaDevAttrClusterLaunch, device->number);
    return gbg_cuda_status(device, error, "asking the GPU");
}

/* What a device needs besides its body. */
static int equip(struct gbg_device *device)
{
    cudaFuncAttributes attributes;
    int status = gbg_cuda_use(device);
    if (status == GBG_OK) { /* a build may lack machine code for this GPU */
        status = gbg_cuda_status(device, cudaFuncGetAttributes(&attributes, nothing),
                                 "loading this build's kernels (CMAKE_CUDA_ARCHITECTURES)");
    }
    if (status == GBG_OK) {
        status = gbg_cuda_status(device,
                                 cudaStreamCreateWithFlags(&device->stream, cudaStreamNonBlocking),
                                 "making a stream");
    }
    if (status == GBG_OK) {
        cudaError_t error = gbg_memory_told_to_fail()
                                ? cudaErrorMemoryAllocation
                                : cudaMallocHost(&device->staging, device->staging_bytes);
        char what[64];
        snprintf(what, sizeof what, "%zu bytes of pinned memory for results",
                 device->staging_bytes);
        status = gbg_cuda_status(device, error, what);
    }
    return status ? status : ask(device);
}

static int create(struct gbg_context *context, struct gbg_device **device)
{
    void *body;
    enum { STAGING = 65536 };
    int status = gbg_allocate_zero(context, &body, 1, sizeof **device, "CUDA backend");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_device *made = (struct gbg_device *)body;
    made->context = context;
    made->number = context->device;
    made->kernels = gbg_cuda_kernels;
    made->staging_bytes = STAGING;
    status = equip(made);
    if (status != GBG_OK) {
        destroy(made);
        return status;
    }
    *device = made;
    return GBG_OK;
}

/* Bytes of an array with the padding that vector loads want; 0: more than memory can hold. */
static size_t padded(int64_t count, size_t size)
{
    const uint64_t limit = (UINT64_C(1) << 62) / (size ? size : 1);
    return count < 0 || (uint64_t)count > limit
               ? 0
               : (count > 0 ? (size_t)count : 1) * size + GBG_ALIGNMENT;
}

int gbg_cuda_allocate(struct gbg_device *device, void **pointer, int64_t count, size_t size,
                      const char *what)
{
    size_t bytes = padded(count, size), free_bytes = 0, all = 0;
    *pointer = NULL;
    int status = gbg_cuda_use(device);
    if (status != GBG_OK) {
        return status;
    }
    if (bytes == 0) {
        return gbg_fail(device->context, GBG_E_MEMORY,
                        "%s: %lld elements of %zu bytes are more than memory can hold", what,
                        (long long)count, size);
    }
    cudaError_t error =
        gbg_memory_told_to_fail() ? cudaErrorMemoryAllocation : cudaMalloc(pointer, bytes);
    if (error == cudaErrorMemoryAllocation) {
        *pointer = NULL;
        cudaGetLastError();
        cudaMemGetInfo(&free_bytes, &all);
        return gbg_fail(device->context, GBG_E_MEMORY,
                        "%s: %zu bytes on cuda:%d could not be had; %zu of its %zu are free", what,
                        bytes, device->number, free_bytes, all);
    }
    if (error == cudaSuccess) {
        __atomic_fetch_add(&live, 1, __ATOMIC_RELAXED);
    } else {
        *pointer = NULL;
    }
    return gbg_cuda_status(device, error, what);
}

void gbg_cuda_free(int number, void *pointer)
{
    if (pointer) {
        cudaSetDevice(number);
        cudaFree(pointer);
        cudaGetLastError();
        __atomic_fetch_sub(&live, 1, __ATOMIC_RELAXED);
    }
}

/* Freed memory may be had by other streams at once: nothing may still work on it. */
void gbg_cuda_release(struct gbg_device *device, void *pointer, int64_t count, size_t size)
{
    (void)count;
    (void)size;
    if (pointer) {
        cudaSetDevice(device->number);
        cudaStreamSynchronize(device->stream);
        gbg_cuda_free(device->number, pointer);
    }
}

int gbg_cuda_grow(struct gbg_device *device, void **pointer, int64_t *capacity, int64_t count,
                  size_t size, const char *what)
{
    if (count <= *capacity) {
        return GBG_OK;
    }
    gbg_cuda_release(device, *pointer, *capacity, size);
    *pointer = NULL;
    *capacity = 0;
    int status = gbg_cuda_allocate(device, pointer, count, size, what);
    *capacity = status == GBG_OK ? count : 0;
    return status;
}

int gbg_cuda_workspace(struct gbg_device *device, size_t bytes, void **pointer)
{
    int64_t held = (int64_t)device->workspace_bytes;
    int status = gbg_cuda_grow(device, &device->workspace, &held, (int64_t)bytes, 1, "workspace");
    device->workspace_bytes = (size_t)held;
    *pointer = device->workspace;
    return status;
}

void *gbg_cuda_take(void *base, size_t *used, int64_t count, size_t size)
{
    void *part = base ? (char *)base + *used : NULL;
    *used += ((size_t)count * size + 255) / 256 * 256;
    return part;
}

int gbg_cuda_fetch(struct gbg_device *device, void *to, const void *from, size_t bytes)
{
    void *by_way_of = bytes <= device->staging_bytes ? device->staging : to;
    int status = gbg_cuda_status(
        device, cudaMemcpyAsync(by_way_of, from, bytes, cudaMemcpyDeviceToHost, device->stream),
        "copying from the GPU");
    if (status == GBG_OK) {
        status =
            gbg_cuda_status(device, cudaStreamSynchronize(device->stream), "waiting for the GPU");
    }
    if (status == GBG_OK && by_way_of != to) {
        memcpy(to, by_way_of, bytes);
    }
    return status;
}

int gbg_cuda_clear(struct gbg_device *device, void *pointer, size_t bytes)
{
    return gbg_cuda_status(device, cudaMemsetAsync(pointer, 0, bytes, device->stream), "clearing");
}

static int allocate(struct gbg_device *device, void **pointer, int64_t count, size_t size,
                    const char *what)
{
    int status = gbg_cuda_allocate(device, pointer, count, size, what);
    if (status == GBG_OK) {
        status = gbg_cuda_clear(device, *pointer, padded(count, size));
    }
    if (status != GBG_OK) {
        gbg_cuda_release(device, *pointer, count, size);
        *pointer = NULL;
    }
    return status;
}

static void release(struct gbg_device *device, void *pointer)
{
    if (device) {
        gbg_cuda_release(device, pointer, 0, 0);
    }
}

/* Also before a first kernel call may the thread have used another GPU. */
static int upload(struct gbg_device *device, void *to, const void *from, size_t bytes)
{
    int status = gbg_cuda_use(device);
    if (status != GBG_OK || bytes == 0) {
        return status;
    }
    cudaError_t error = cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, device->stream);
    error = error == cudaSuccess ? cudaStreamSynchronize(device->stream) : error;
    return gbg_cuda_status(device, error, "copying to the GPU");
}

static int download(struct gbg_device *device, void *to, const void *from, size_t bytes)
{
    int status = gbg_cuda_use(device);
    return status || bytes == 0 ? status : gbg_cuda_fetch(device, to, from, bytes);
}

static int sync(struct gbg_device *device)
{
    return gbg_cuda_status(device, cudaStreamSynchronize(device->stream), "waiting for the GPU");
}

static double free_bytes(const struct gbg_context *context)
{
    size_t free_now = 0, all = 0;
    cudaSetDevice(context->device);
    cudaMemGetInfo(&free_now, &all);
    cudaGetLastError();
    return (double)free_now;
}

static double scratch_bytes(const struct gbg_device *device)
{
    return (double)device->workspace_bytes + gbg_cuda_steps_bytes(device);
}

static const struct gbg_kernels *kernels(const struct gbg_device *device)
{
    return &device->kernels;
}

extern "C" const struct gbg_backend gbg_backend_cuda = {
    .name = "cuda",
    .probe = probe,
    .create = create,
    .destroy = destroy,
    .allocate = allocate,
    .release = release,
    .upload = upload,
    .download = download,
    .sync = sync,
    .frame_begin = gbg_cuda_frame_begin,
    .frame_wait = gbg_cuda_frame_wait,
    .frame_release = gbg_cuda_frame_release,
    .expect = NULL,
    .free_bytes = free_bytes,
    .scratch_bytes = scratch_bytes,
    .kernels = kernels,
};
