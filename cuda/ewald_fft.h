/* L1, CUDA: transforms of meshes by cuFFT, whose library is opened when a sum by a mesh first needs
 * it. */
#ifndef GBG_CUDA_EWALD_FFT_H
#define GBG_CUDA_EWALD_FFT_H

#include "cuda/cuda.h"

struct gbg_ewald_choice;
struct gbg_cuda_fft_calls; /* functions of the library */

/* Transforms of one sum; their work area is the device's workspace. */
struct gbg_cuda_fft {
    const struct gbg_cuda_fft_calls *calls;
    int single;
    int made[3], plan[3]; /* enum gbg_cuda_transform */
    size_t bytes;         /* of the largest work area */
};

/* Real mesh to waves and back, in place, rows as in fft/fft.h; complex mesh back, in place, without
 * padding. Plain sums, forward with exp(-i k x). */
enum gbg_cuda_transform { GBG_CUDA_FORWARD, GBG_CUDA_BACKWARD, GBG_CUDA_WIDE };

/* Makes those that the sum needs. GBG_E_UNBUILT with a sentence if there is no cuFFT. */
int gbg_cuda_fft_make(struct gbg_device *device, const struct gbg_ewald_choice *choice,
                      struct gbg_cuda_fft *fft);
void gbg_cuda_fft_release(struct gbg_cuda_fft *fft);
int gbg_cuda_fft_run(struct gbg_device *device, const struct gbg_cuda_fft *fft, int transform,
                     void *mesh);

#endif
