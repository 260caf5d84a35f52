/* Tests of what a GPU that cannot be used is answered with, without any: the linker puts the
 * functions below in the place of the CUDA runtime's, which then tell of cards that are too old,
 * out of reach or full. Each time there is one sentence, and `auto` takes the CPU and says why. */
#include <cuda_runtime_api.h>

#include "made_scene.h"

static struct {
    cudaError_t counting, describing, choosing, loading, pinning, allocating;
    int driver, cards, major, minor, mode;
} machine;

/* A good one: two cards of compute capability 9.0. */
static void good_machine(void)
{
    memset(&machine, 0, sizeof machine);
    machine.driver = 13000;
    machine.cards = 2;
    machine.major = 9;
    machine.mode = cudaComputeModeDefault;
}

cudaError_t __wrap_cudaGetDeviceCount(int *count);
cudaError_t __wrap_cudaGetDeviceCount(int *count)
{
    *count = machine.counting ? 0 : machine.cards;
    return machine.counting;
}

cudaError_t __wrap_cudaDriverGetVersion(int *version);
cudaError_t __wrap_cudaDriverGetVersion(int *version)
{
    *version = machine.driver;
    return cudaSuccess;
}

/* Both names that the runtime has had. */
cudaError_t __wrap_cudaGetDeviceProperties(struct cudaDeviceProp *properties, int device);
cudaError_t __wrap_cudaGetDeviceProperties(struct cudaDeviceProp *properties, int device)
{
    memset(properties, 0, sizeof *properties);
    snprintf(properties->name, sizeof properties->name, "Card %d", device);
    properties->major = machine.major;
    properties->minor = machine.minor;
    return machine.describing;
}

cudaError_t __wrap_cudaGetDeviceProperties_v2(struct cudaDeviceProp *properties, int device);
cudaError_t __wrap_cudaGetDeviceProperties_v2(struct cudaDeviceProp *properties, int device)
{
    return __wrap_cudaGetDeviceProperties(properties, device);
}

cudaError_t __wrap_cudaDeviceGetAttribute(int *value, enum cudaDeviceAttr attribute, int device);
cudaError_t __wrap_cudaDeviceGetAttribute(int *value, enum cudaDeviceAttr attribute, int device)
{
    (void)device;
    *value = attribute == cudaDevAttrComputeMode ? machine.mode : 132;
    return cudaSuccess;
}

cudaError_t __wrap_cudaSetDevice(int device);
cudaError_t __wrap_cudaSetDevice(int device)
{
    assert_true(device >= 0 && device < machine.cards);
    return machine.choosing;
}

cudaError_t __wrap_cudaFuncGetAttributes(struct cudaFuncAttributes *attributes, const void *kernel);
cudaError_t __wrap_cudaFuncGetAttributes(struct cudaFuncAttributes *attributes, const void *kernel)
{
    (void)kernel;
    memset(attributes, 0, sizeof *attributes);
    return machine.loading;
}

static int pinned, streams; /* what is held */

cudaError_t __wrap_cudaStreamCreateWithFlags(cudaStream_t *stream, unsigned flags);
cudaError_t __wrap_cudaStreamCreateWithFlags(cudaStream_t *stream, unsigned flags)
{
    (void)flags;
    *stream = (cudaStream_t)(void *)&machine;
    streams++;
    return cudaSuccess;
}

cudaError_t __wrap_cudaStreamDestroy(cudaStream_t stream);
cudaError_t __wrap_cudaStreamDestroy(cudaStream_t stream)
{
    (void)stream;
    streams--;
    return cudaSuccess;
}

cudaError_t __wrap_cudaStreamSynchronize(cudaStream_t stream);
cudaError_t __wrap_cudaStreamSynchronize(cudaStream_t stream)
{
    (void)stream;
    return cudaSuccess;
}

cudaError_t __wrap_cudaMallocHost(void **pointer, size_t bytes);
cudaError_t __wrap_cudaMallocHost(void **pointer, size_t bytes)
{
    *pointer = machine.pinning ? NULL : malloc(bytes);
    pinned += *pointer != NULL;
    return machine.pinning;
}

cudaError_t __wrap_cudaFreeHost(void *pointer);
cudaError_t __wrap_cudaFreeHost(void *pointer)
{
    pinned -= pointer != NULL;
    free(pointer);
    return cudaSuccess;
}

cudaError_t __wrap_cudaMalloc(void **pointer, size_t bytes);
cudaError_t __wrap_cudaMalloc(void **pointer, size_t bytes)
{
    (void)bytes;
    *pointer = NULL;
    return machine.allocating;
}

cudaError_t __wrap_cudaMemGetInfo(size_t *free_bytes, size_t *all);
cudaError_t __wrap_cudaMemGetInfo(size_t *free_bytes, size_t *all)
{
    *free_bytes = 1024;
    *all = 4096;
    return cudaSuccess;
}

cudaError_t __wrap_cudaGetLastError(void);
cudaError_t __wrap_cudaGetLastError(void)
{
    return cudaSuccess;
}

/* The backend is refused with these words, and auto passes the reason on. */
static void refused(const char *name, int status, const char *words)
{
    struct gbg_context *context;
    const char *backend;
    int got = gbg_context_create(name, &context);
    if (got != status || !strstr(gbg_message(NULL), words)) {
        fail_msg("%s instead of %s with \"%s\": %s", gbg_status_name(got), gbg_status_name(status),
                 words, gbg_message(NULL));
    }
    assert_null(context);
    char again[32];
    snprintf(again, sizeof again, "auto%s", name + strlen("cuda"));
    assert_int_equal(gbg_context_create(again, &context), GBG_OK);
    assert_int_equal(gbg_context_backend(context, &backend, NULL, NULL), GBG_OK);
    assert_string_equal(backend, "cpu");
    assert_int_equal(strncmp(context->choice, "auto takes cpu: ", 16), 0);
    assert_non_null(strstr(context->choice, words));
    assert_null(strchr(context->choice, '\n'));
    gbg_context_destroy(&context);
}

static void cards_that_cannot_be_used(void **state)
{
    (void)state;
    good_machine();
    machine.counting = cudaErrorInsufficientDriver;
    machine.driver = 0;
    refused("cuda", GBG_E_UNBUILT, "no driver is installed");
    machine.driver = 11040;
    refused("cuda", GBG_E_UNBUILT, "the driver is for CUDA 11.4, this build needs one for");
    machine.counting = cudaErrorNoDevice;
    refused("cuda:0", GBG_E_UNBUILT, "no GPU was found (no CUDA-capable device is detected)");
    good_machine();
    machine.cards = 0;
    refused("cuda", GBG_E_UNBUILT, "no GPU was found (none is visible)");
    machine.cards = 1;
    refused("cuda:1", GBG_E_UNBUILT, "there is no GPU 1; there is 1, counted from 0");
    machine.cards = 2;
    refused("cuda:2", GBG_E_UNBUILT, "there is no GPU 2; there are 2, counted from 0");
    machine.describing = cudaErrorUnknown;
    refused("cuda:1", GBG_E_DEVICE, "GPU 1 does not answer: unknown error");
    good_machine();
    machine.major = 7;
    machine.minor = 5;
    refused("cuda:1", GBG_E_UNBUILT, "GPU 1, Card 1, has compute capability 7.5; this build needs");
    good_machine();
    machine.mode = cudaComputeModeProhibited;
    refused("cuda", GBG_E_UNBUILT, "compute mode prohibited");
}

static void a_card_that_can_be_used(void **state)
{
    (void)state;
    struct gbg_context *context = NULL;
    const char *name, *instructions;
    good_machine();
    assert_int_equal(gbg_context_create("auto:1", &context), GBG_OK);
    assert_int_equal(gbg_context_backend(context, &name, &instructions, NULL), GBG_OK);
    assert_string_equal(name, "cuda");
    assert_string_equal(instructions, "sm_90");
    assert_string_equal(context->choice, "auto takes cuda:1, Card 1");
    gbg_context_destroy(&context);
}

/* A card that looks good and fails when an engine is made for it: nothing is left behind. */
static void engine_refused(int status, const char *words)
{
    static struct made_particles made;
    double length[2] = {14.0, 13.0};
    struct gbg_context *context = made_context("cuda:1");
    struct gbg_scene scene = made_scene(context, 2, length);
    struct gbg_engine *engine = NULL;
    made_lattice(&made, &scene, 10, 0.02);
    int got = gbg_engine_make(&scene, &made.p, &engine);
    if (got != status || !strstr(gbg_message(context), words)) {
        fail_msg("%s instead of %s with \"%s\": %s", gbg_status_name(got), gbg_status_name(status),
                 words, gbg_message(context));
    }
    assert_null(engine);
    assert_int_equal(pinned, 0);
    assert_int_equal(streams, 0);
    gbg_context_destroy(&context);
}

static void cards_that_fail_at_first_use(void **state)
{
    (void)state;
    good_machine();
    machine.choosing = cudaErrorDevicesUnavailable;
    engine_refused(GBG_E_DEVICE, "cuda:1: choosing the GPU: ");
    good_machine();
    machine.loading = cudaErrorNoKernelImageForDevice;
    engine_refused(GBG_E_DEVICE, "(CMAKE_CUDA_ARCHITECTURES): no kernel image is available");
    good_machine();
    machine.pinning = cudaErrorMemoryAllocation;
    engine_refused(GBG_E_MEMORY, "bytes of pinned memory");
    good_machine();
    machine.allocating = cudaErrorMemoryAllocation;
    engine_refused(GBG_E_MEMORY, "on cuda:1 could not be had; 1024 of its 4096 are free");
    machine.allocating = cudaErrorECCUncorrectable;
    engine_refused(GBG_E_DEVICE, "cudaErrorECCUncorrectable");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cards_that_cannot_be_used),
        cmocka_unit_test(a_card_that_can_be_used),
        cmocka_unit_test(cards_that_fail_at_first_use),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
