/* L1, CUDA: normal deviates of the noise tape as an array. */
#include "cuda/kernels.h"

#include "backend/cpu/noise.h"

static __global__ void draw(const struct gbg_noise noise, uint64_t step, uint64_t first, int64_t n,
                            int dimension, double *values)
{
    int64_t k = gbg_cuda_index();
    if (k >= n) {
        return;
    }
    uint64_t id = first + (uint64_t)k;
    vf xi[3];
    gbg_noise_lanes(&noise, step, (vi)(uint32_t)id, (vi)(uint32_t)(id >> 32), dimension, xi);
    for (int a = 0; a < dimension; a++) {
        values[k * dimension + a] = noise.scale * (double)xi[a];
    }
}

int gbg_cuda_normals(struct gbg_device *device, const struct gbg_noise *noise, uint64_t step,
                     uint64_t first, int64_t n, int dimension, double *values)
{
    void *drawn;
    size_t bytes = (size_t)n * (size_t)dimension * sizeof *values;
    if (n == 0) {
        return GBG_OK;
    }
    int status = gbg_cuda_workspace(device, bytes, &drawn);
    if (status == GBG_OK) {
        draw<<<gbg_cuda_blocks(n), GBG_CUDA_THREADS, 0, device->stream>>>(
            *noise, step, first, n, dimension, (double *)drawn);
        status = gbg_cuda_started(device, "normals");
    }
    return status ? status : gbg_cuda_fetch(device, values, drawn, bytes);
}
