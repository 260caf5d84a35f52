/* L1: normal deviates of the noise tape as an array. */
#include "backend/cpu/cpu.h"
#include "backend/cpu/noise.h"
#include "backend/cpu/variant.h"

int GBG_ISA_NAME(gbg_cpu_normals)(struct gbg_device *device, const struct gbg_noise *noise,
                                  uint64_t step, uint64_t first, int64_t n, int dimension,
                                  double *values)
{
    const double scale = noise->scale;
#pragma omp parallel for num_threads(device->threads) schedule(static)
    for (int64_t start = 0; start < n; start += VF_LANES) {
        vi id_low, id_high;
        vf xi[3];
        double lanes[3][VF_LANES];
        gbg_noise_ids(first + (uint64_t)start, &id_low, &id_high);
        gbg_noise_lanes(noise, step, id_low, id_high, dimension, xi);
        for (int a = 0; a < dimension; a++) {
            vd_store(lanes[a], vd_mul(vd_set(scale), vd_low(xi[a])));
            vd_store(lanes[a] + VD_LANES, vd_mul(vd_set(scale), vd_high(xi[a])));
        }
        for (int k = 0; k < VF_LANES && start + k < n; k++) {
            for (int a = 0; a < dimension; a++) {
                values[(start + k) * dimension + a] = lanes[a][k];
            }
        }
    }
    return GBG_OK;
}
