/* Analysis room: phases and products of the direct sum. Compiled once for each instruction set. */
#include <math.h>

#include "analysis/kernels.h"
#include "analysis/vector.h"

/* cos and sin of 2 pi f for |f| <= 1/2: the nearest quarter turn is taken off, then the Taylor
 * series on |t| <= pi/4, cut where the next term is below 2^-58. */
static inline void cos_sin(double f, double *cosine, double *sine)
{
    double quarter = rint(4 * f);
    double t = 6.283185307179586477 * __builtin_fma(-0.25, quarter, f), s = t * t;
    double c = 1 / 20922789888000.0;
    c = __builtin_fma(c, s, -1 / 87178291200.0);
    c = __builtin_fma(c, s, 1 / 479001600.0);
    c = __builtin_fma(c, s, -1 / 3628800.0);
    c = __builtin_fma(c, s, 1 / 40320.0);
    c = __builtin_fma(c, s, -1 / 720.0);
    c = __builtin_fma(c, s, 1 / 24.0);
    c = __builtin_fma(c, s, -0.5);
    c = __builtin_fma(c, s, 1.0);
    double d = 1 / 355687428096000.0;
    d = __builtin_fma(d, s, -1 / 1307674368000.0);
    d = __builtin_fma(d, s, 1 / 6227020800.0);
    d = __builtin_fma(d, s, -1 / 39916800.0);
    d = __builtin_fma(d, s, 1 / 362880.0);
    d = __builtin_fma(d, s, -1 / 5040.0);
    d = __builtin_fma(d, s, 1 / 120.0);
    d = __builtin_fma(d, s, -1 / 6.0);
    d = __builtin_fma(d * s, t, t);
    double odd = quarter - 2 * floor(0.5 * quarter); /* quarter is -2..2 */
    double a = odd != 0 ? d : c, b = odd != 0 ? c : d;
    *cosine = quarter == 1 || quarter == 2 || quarter == -2 ? -a : a;
    *sine = quarter == -1 || quarter == 2 || quarter == -2 ? -b : b;
}

/* k x/length modulo 1 from x/length in two pieces, so that the error does not grow with k. */
static void phases(double length, int32_t reach, int64_t n, const double *restrict x, int64_t pitch,
                   double *restrict phase)
{
    for (int64_t p = 0; p < n; p++) {
        double r = __builtin_fma(-rint(x[p] / length), length, x[p]);
        double high = r / length, low = __builtin_fma(-high, length, r) / length;
        double *restrict cosine = phase + p * pitch, *restrict sine = cosine + reach + 1;
        for (int32_t k = 0; k <= reach; k++) {
            double product = k * high;
            double rest = __builtin_fma((double)k, high, -product) + k * low;
            cos_sin((product - rint(product)) + rest, &cosine[k], &sine[k]);
        }
    }
}

static void multiply(int64_t n, const double *row, const double *column, int64_t pitch, double *sum)
{
    for (int64_t c = 0; c < pitch; c += 2 * VD_LANES) {
        vd total[GBG_TENSOR_ROWS][2];
#pragma GCC unroll 4
        for (int r = 0; r < GBG_TENSOR_ROWS; r++) {
            total[r][0] = total[r][1] = vd_set(0);
        }
        for (int64_t p = 0; p < n; p++) {
            vd left = vd_load(column + p * pitch + c);
            vd right = vd_load(column + p * pitch + c + VD_LANES);
#pragma GCC unroll 4
            for (int r = 0; r < GBG_TENSOR_ROWS; r++) {
                vd factor = vd_set(row[p * GBG_TENSOR_ROWS + r]);
                total[r][0] = vd_fma(factor, left, total[r][0]);
                total[r][1] = vd_fma(factor, right, total[r][1]);
            }
        }
#pragma GCC unroll 4
        for (int r = 0; r < GBG_TENSOR_ROWS; r++) {
            double *to = sum + r * pitch + c;
            vd_store(to, vd_add(vd_load(to), total[r][0]));
            vd_store(to + VD_LANES, vd_add(vd_load(to + VD_LANES), total[r][1]));
        }
    }
}

#define TEXT_OF(name) #name
#define TEXT(name) TEXT_OF(name)

const struct gbg_tensor_kernels GBG_ISA_NAME(gbg_tensor_kernels) = {
    .name = TEXT(GBG_ISA),
    .phases = phases,
    .multiply = multiply,
};
