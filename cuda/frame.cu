/* L1, CUDA: copies of the state for output: put in the order of ids on the engine's stream, brought
 * to the host on one of their own, so that the next steps wait for the first part only. A slot is
 * bound to a GPU and to no engine; whoever waits for it touches nothing of the engine's. */
#include "cuda/frame.h"

#include <stdio.h>

struct gbg_slot {
    int number; /* of the GPU */
    int64_t n;
    int dimension, images, overlapped;
    size_t bytes;
    void
        *block; /* on the GPU: fractions, then image counts, then flags, each in the order of ids */
    void *host; /* the same, pinned */
    cudaStream_t stream;
    cudaEvent_t taken, copied; /* the state may change; the host may read */
    char failure[256];
};

/* Arrays of a block, wherever it lies. */
struct parts {
    uint64_t *fraction;
    int32_t *image, *overlapped; /* NULL: not asked for */
};

static struct parts parts_of(const struct gbg_slot *slot, void *block)
{
    struct parts parts;
    int64_t axes = slot->dimension * slot->n;
    parts.fraction = (uint64_t *)block;
    int32_t *words = (int32_t *)(parts.fraction + axes);
    parts.image = slot->images ? words : NULL;
    parts.overlapped = slot->overlapped ? words + (slot->images ? axes : 0) : NULL;
    return parts;
}

template <int dimension>
static __global__ void take(const __grid_constant__ struct gbg_state state, struct parts to)
{
    int64_t i = gbg_cuda_index(), n = state.owned;
    if (i >= n) {
        return;
    }
    int64_t k = state.rank ? state.rank[i] : i;
    for (int a = 0; a < dimension; a++) {
        to.fraction[a * n + k] = (uint64_t)state.high[a][i] << 32 | state.low[a][i];
        if (to.image) {
            to.image[a * n + k] = state.image[a][i];
        }
    }
    if (to.overlapped) {
        to.overlapped[k] = state.overlapped[i];
    }
}

/* After a failure of the GPU the waits return at once. */
void gbg_cuda_frame_release(struct gbg_slot *slot)
{
    if (!slot) {
        return;
    }
    cudaSetDevice(slot->number);
    if (slot->taken) {
        cudaEventSynchronize(slot->taken);
        cudaEventDestroy(slot->taken);
    }
    if (slot->stream) {
        cudaStreamSynchronize(slot->stream);
        cudaStreamDestroy(slot->stream);
    }
    if (slot->copied) {
        cudaEventDestroy(slot->copied);
    }
    gbg_cuda_free(slot->number, slot->block);
    if (slot->host) {
        cudaFreeHost(slot->host);
    }
    cudaGetLastError();
    gbg_release(slot);
}

static int make_host(struct gbg_device *device, struct gbg_slot *slot)
{
    char what[80];
    snprintf(what, sizeof what, "%zu bytes of pinned memory for a frame", slot->bytes);
    cudaError_t error = gbg_memory_told_to_fail() ? cudaErrorMemoryAllocation
                                                  : cudaMallocHost(&slot->host, slot->bytes + 1);
    slot->host = error == cudaSuccess ? slot->host : NULL;
    return gbg_cuda_status(device, error, what);
}

/* Who waits for a copy sleeps: the processor is for the engine. */
static int make_stream(struct gbg_device *device, struct gbg_slot *slot)
{
    cudaError_t error = cudaStreamCreateWithFlags(&slot->stream, cudaStreamNonBlocking);
    error = error ? error : cudaEventCreateWithFlags(&slot->taken, cudaEventDisableTiming);
    error = error ? error
                  : cudaEventCreateWithFlags(&slot->copied,
                                             cudaEventDisableTiming | cudaEventBlockingSync);
    return gbg_cuda_status(device, error, "making a stream for frames");
}

static int make(struct gbg_device *device, const struct gbg_state *state, int images,
                int overlapped, struct gbg_slot **slot)
{
    void *body;
    int status =
        gbg_allocate_zero(device->context, &body, 1, sizeof **slot, "a frame's way to the host");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_slot *made = (struct gbg_slot *)body;
    made->number = device->number;
    made->n = state->owned;
    made->dimension = state->box.dimension;
    made->images = images;
    made->overlapped = overlapped;
    made->bytes =
        (size_t)made->n * (size_t)(made->dimension * (8 + (images ? 4 : 0)) + (overlapped ? 4 : 0));
    status = gbg_cuda_allocate(device, &made->block, (int64_t)made->bytes, 1, "a frame");
    status = status ? status : make_host(device, made);
    status = status ? status : make_stream(device, made);
    if (status != GBG_OK) {
        gbg_cuda_frame_release(made);
        return status;
    }
    *slot = made;
    return GBG_OK;
}

static bool fits(const struct gbg_slot *slot, const struct gbg_device *device,
                 const struct gbg_state *state, int images, int overlapped)
{
    return slot && slot->number == device->number && slot->n == state->owned &&
           slot->dimension == state->box.dimension && slot->images == images &&
           slot->overlapped == overlapped;
}

static int start_taking(struct gbg_device *device, const struct gbg_state *state,
                        struct gbg_slot *slot)
{
    unsigned blocks = gbg_cuda_blocks(slot->n);
    if (blocks == 0) {
        return GBG_OK;
    }
    struct parts parts = parts_of(slot, slot->block);
    if (slot->dimension == 2) {
        take<2><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, parts);
    } else {
        take<3><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, parts);
    }
    return gbg_cuda_started(device, "taking a frame");
}

int gbg_cuda_frame_begin(struct gbg_device *device, const struct gbg_state *state, int images,
                         int overlapped, struct gbg_slot **slot)
{
    int status = gbg_cuda_use(device);
    if (status == GBG_OK && !fits(*slot, device, state, images, overlapped)) {
        gbg_cuda_frame_release(*slot);
        *slot = NULL;
        status = gbg_cuda_use(device); /* the old slot may have been another GPU's */
        status = status ? status : make(device, state, images, overlapped, slot);
    }
    status = status ? status : start_taking(device, state, *slot);
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_slot *s = *slot;
    cudaError_t error = cudaEventRecord(s->taken, device->stream);
    error = error ? error : cudaStreamWaitEvent(s->stream, s->taken, 0);
    error = error ? error
                  : cudaMemcpyAsync(s->host, s->block, s->bytes, cudaMemcpyDeviceToHost, s->stream);
    error = error ? error : cudaEventRecord(s->copied, s->stream);
    return gbg_cuda_status(device, error, "copying a frame from the GPU");
}

const char *gbg_cuda_frame_wait(struct gbg_slot *slot, struct gbg_frame *frame)
{
    cudaError_t error = cudaSetDevice(slot->number);
    error = error ? error : cudaEventSynchronize(slot->copied);
    if (error != cudaSuccess) {
        cudaGetLastError();
        snprintf(slot->failure, sizeof slot->failure,
                 "cuda:%d: waiting for a frame from the GPU: %s (%s)", slot->number,
                 cudaGetErrorString(error), cudaGetErrorName(error));
        return slot->failure;
    }
    struct parts parts = parts_of(slot, slot->host);
    *frame = {};
    for (int a = 0; a < slot->dimension; a++) {
        frame->fraction[a] = parts.fraction + a * slot->n;
        frame->image[a] = parts.image ? parts.image + a * slot->n : NULL;
    }
    frame->overlapped = parts.overlapped;
    return NULL;
}
