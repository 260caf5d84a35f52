/* L1, CUDA: transforms of meshes by cuFFT, opened at run time: it is larger than all the rest. */
#include "cuda/ewald_fft.h"

#include <cufft.h>
#include <dlfcn.h>
#include <pthread.h>
#include <stdio.h>

extern "C" {
#include "ewald/plan.h"
}

struct gbg_cuda_fft_calls {
    decltype(&cufftCreate) create;
    decltype(&cufftDestroy) destroy;
    decltype(&cufftSetAutoAllocation) allocate;
    decltype(&cufftMakePlanMany64) make;
    decltype(&cufftSetStream) stream;
    decltype(&cufftSetWorkArea) area;
    decltype(&cufftExecR2C) r2c;
    decltype(&cufftExecC2R) c2r;
    decltype(&cufftExecC2C) c2c;
    decltype(&cufftExecD2Z) d2z;
    decltype(&cufftExecZ2D) z2d;
    decltype(&cufftExecZ2Z) z2z;
};

static pthread_mutex_t opening = PTHREAD_MUTEX_INITIALIZER;
static struct gbg_cuda_fft_calls opened;

#define NAMED(number) NAMED_AGAIN(number)
#define NAMED_AGAIN(number) "libcufft.so." #number

/* The version that this was compiled with, where the loader looks, then where its toolkit was. */
static void *open_library()
{
    static const char *const path[] = {NAMED(CUFFT_VER_MAJOR),
#ifdef GBG_CUDA_LIBRARIES
                                       GBG_CUDA_LIBRARIES "/" NAMED(CUFFT_VER_MAJOR)
#endif
    };
    void *library = NULL;
    for (size_t k = 0; k < sizeof path / sizeof *path && !library; k++) {
        library = dlopen(path[k], RTLD_NOW | RTLD_LOCAL);
    }
    return library;
}

template <typename Call> static int find(void *library, const char *name, Call *call)
{
    *call = (Call)dlsym(library, name);
    return *call != NULL;
}

/* 1 if all are there. */
static int find_all(void *library, struct gbg_cuda_fft_calls *calls)
{
    return find(library, "cufftCreate", &calls->create) &&
           find(library, "cufftDestroy", &calls->destroy) &&
           find(library, "cufftSetAutoAllocation", &calls->allocate) &&
           find(library, "cufftMakePlanMany64", &calls->make) &&
           find(library, "cufftSetStream", &calls->stream) &&
           find(library, "cufftSetWorkArea", &calls->area) &&
           find(library, "cufftExecR2C", &calls->r2c) &&
           find(library, "cufftExecC2R", &calls->c2r) &&
           find(library, "cufftExecC2C", &calls->c2c) &&
           find(library, "cufftExecD2Z", &calls->d2z) &&
           find(library, "cufftExecZ2D", &calls->z2d) && find(library, "cufftExecZ2Z", &calls->z2z);
}

/* The library stays open: closing it would spoil the next use of its kernels. */
static const struct gbg_cuda_fft_calls *calls_of_library()
{
    pthread_mutex_lock(&opening);
    if (!opened.create) {
        struct gbg_cuda_fft_calls calls = {};
        void *library = open_library();
        if (library && find_all(library, &calls)) {
            opened = calls;
        }
    }
    const struct gbg_cuda_fft_calls *calls = opened.create ? &opened : NULL;
    pthread_mutex_unlock(&opening);
    return calls;
}

static const char *meaning(cufftResult result)
{
    return result == CUFFT_SETUP_FAILED     ? "CUFFT_SETUP_FAILED"
           : result == CUFFT_EXEC_FAILED    ? "CUFFT_EXEC_FAILED"
           : result == CUFFT_INTERNAL_ERROR ? "CUFFT_INTERNAL_ERROR"
           : result == CUFFT_INVALID_PLAN   ? "CUFFT_INVALID_PLAN"
           : result == CUFFT_INVALID_SIZE   ? "CUFFT_INVALID_SIZE"
                                            : "cuFFT";
}

/* As gbg_cuda_status. */
static int status_of(struct gbg_device *device, cufftResult result, const char *what)
{
    if (result == CUFFT_SUCCESS || device->failure[0]) {
        return gbg_cuda_status(device, cudaSuccess, what);
    }
    cudaError_t error =
        result == CUFFT_ALLOC_FAILED ? cudaErrorMemoryAllocation : cudaGetLastError();
    char sentence[128];
    snprintf(sentence, sizeof sentence, "%s: %s (%d)", what, meaning(result), (int)result);
    return gbg_cuda_status(device, error ? error : cudaErrorUnknown, sentence);
}

static cufftType type_of(int single, int transform)
{
    static const cufftType type[2][3] = {{CUFFT_D2Z, CUFFT_Z2D, CUFFT_Z2Z},
                                         {CUFFT_R2C, CUFFT_C2R, CUFFT_C2C}};
    return type[single][transform];
}

/* Axis 0 is contiguous here, the last one there. */
static int make_one(struct gbg_device *device, const struct gbg_ewald_choice *choice, int transform,
                    struct gbg_cuda_fft *fft)
{
    long long cells[3], real[3], complex[3], half = choice->cells[0] / 2 + 1;
    int d = choice->dimension;
    for (int a = 0; a < d; a++) {
        cells[d - 1 - a] = real[d - 1 - a] = complex[d - 1 - a] = choice->cells[a];
    }
    real[d - 1] = transform == GBG_CUDA_WIDE ? cells[d - 1] : 2 * half;
    complex[d - 1] = transform == GBG_CUDA_WIDE ? cells[d - 1] : half;
    long long *in = transform == GBG_CUDA_FORWARD ? real : complex;
    long long *out = transform == GBG_CUDA_BACKWARD ? real : complex;
    long long input = 1, output = 1;
    for (int a = 0; a < d; a++) {
        input *= in[a];
        output *= out[a];
    }
    size_t bytes = 0;
    const char *what = "planning a Fourier transform";
    int status = status_of(device, fft->calls->create(&fft->plan[transform]), what);
    if (status != GBG_OK) {
        return status;
    }
    fft->made[transform] = 1;
    cufftHandle plan = fft->plan[transform];
    cufftResult result = fft->calls->allocate(plan, 0);
    result = result ? result
                    : fft->calls->make(plan, d, cells, in, 1, input, out, 1, output,
                                       type_of(choice->single, transform), 1, &bytes);
    result = result ? result : fft->calls->stream(plan, device->stream);
    fft->bytes = bytes > fft->bytes ? bytes : fft->bytes;
    return status_of(device, result, what);
}

int gbg_cuda_fft_make(struct gbg_device *device, const struct gbg_ewald_choice *choice,
                      struct gbg_cuda_fft *fft)
{
    int by_waves = choice->gradient == GBG_GRADIENT_WAVES;
    fft->calls = calls_of_library();
    fft->single = choice->single;
    if (!fft->calls) {
        return gbg_fail(device->context, GBG_E_UNBUILT,
                        "backend cuda: sums by a mesh need cuFFT: %s of the CUDA toolkit was not "
                        "found (LD_LIBRARY_PATH)",
                        NAMED(CUFFT_VER_MAJOR));
    }
    int status = make_one(device, choice, GBG_CUDA_FORWARD, fft);
    status = status ? status : make_one(device, choice, GBG_CUDA_BACKWARD, fft);
    return status || !by_waves ? status : make_one(device, choice, GBG_CUDA_WIDE, fft);
}

void gbg_cuda_fft_release(struct gbg_cuda_fft *fft)
{
    for (int k = 0; k < 3; k++) {
        if (fft->made[k]) {
            fft->calls->destroy(fft->plan[k]);
        }
        fft->made[k] = 0;
    }
    cudaGetLastError();
}

int gbg_cuda_fft_run(struct gbg_device *device, const struct gbg_cuda_fft *fft, int transform,
                     void *mesh)
{
    const struct gbg_cuda_fft_calls *calls = fft->calls;
    cufftHandle plan = fft->plan[transform];
    void *area;
    int status = gbg_cuda_workspace(device, fft->bytes, &area);
    if (status != GBG_OK) {
        return status;
    }
    cufftResult result = calls->area(plan, area);
    if (result != CUFFT_SUCCESS) {
        return status_of(device, result, "giving a Fourier transform its memory");
    }
    if (fft->single) {
        cufftComplex *complex = (cufftComplex *)mesh;
        result = transform == GBG_CUDA_FORWARD ? calls->r2c(plan, (cufftReal *)mesh, complex)
                 : transform == GBG_CUDA_BACKWARD
                     ? calls->c2r(plan, complex, (cufftReal *)mesh)
                     : calls->c2c(plan, complex, complex, CUFFT_INVERSE);
    } else {
        cufftDoubleComplex *complex = (cufftDoubleComplex *)mesh;
        result = transform == GBG_CUDA_FORWARD ? calls->d2z(plan, (cufftDoubleReal *)mesh, complex)
                 : transform == GBG_CUDA_BACKWARD
                     ? calls->z2d(plan, complex, (cufftDoubleReal *)mesh)
                     : calls->z2z(plan, complex, complex, CUFFT_INVERSE);
    }
    return status_of(device, result, "a Fourier transform");
}
