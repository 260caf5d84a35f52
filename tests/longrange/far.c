/* Tests of the far field on the CPU: particles on a mesh, its transforms and back, against sums over
 * waves one by one. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/ewald.h"
#include "core/memory.h"
#include "core/random.h"
#include "gamboge/gamboge.h"

#define M_PI 3.14159265358979323846
static double uniform(uint64_t i)
{
    struct gbg_philox w = gbg_philox(gbg_philox_counter(11, i, GBG_STREAM_START), 5, 9);
    return gbg_uniform(w.word[0], w.word[1]);
}

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

extern const struct gbg_backend gbg_backend_cpu;

int main(int argc, char **argv)
{
    struct gbg_context *context;
    struct gbg_device *device;
    if (gbg_context_create(argc > 1 ? argv[1] : "cpu:threads=1", &context)) { puts(gbg_message(NULL)); return 1; }
    gbg_backend_cpu.probe(context);
    gbg_backend_cpu.create(context, &device);
    int single = atoi(argv[2]), width = atoi(argv[3]); int32_t m = atoi(argv[4]); int64_t n = atol(argv[5]);
    int gradient = atoi(argv[6]); int dim = argc > 7 ? atoi(argv[7]) : 2;
    double L = 100.0;
    struct gbg_ewald_choice c = {.dimension = dim, .length = {L, L, L}, .power = 2, .gradient = gradient, .single = single, .cells = {m, m, m}, .width = width};
    double spacing = dim == 2 ? L / sqrt((double)n) : L / cbrt((double)n);
    c.reach = 3.6 * spacing; if (c.reach > L / 2) c.reach = L / 2;
    c.band = 3.14159265 * m / L * c.reach / 1.25;
    struct gbg_ewald_plan plan;
    int status = gbg_ewald_plan_make(&c, &plan);
    printf("plan %d reach %g band %g degree %d\n", status, c.reach, c.band, plan.window[0].degree);
    if (status) return 1;
    struct gbg_state s = {0};
    double len[3] = {L, L, L};
    s.box = gbg_box_make(dim, len, NULL);
    s.owned = n; s.n_species = 1; s.alpha[0] = 1; s.mobility[0] = 1;
    for (int a = 0; a < dim; a++) {
        s.high[a] = malloc(4 * n + 64); s.low[a] = malloc(4 * n + 64); s.force[a] = malloc(8 * n);
        for (int64_t i = 0; i < n; i++) { uint64_t f = (uint64_t)(uniform(3 * i + a) * 0x1p53) << 11; s.high[a][i] = f >> 32; s.low[a][i] = (uint32_t)f; }
    }
    struct gbg_ewald *sum;
    double t0 = seconds();
    if (gbg_ewald_create(device, &s, &plan, 0, &sum)) { puts(gbg_message(context)); return 1; }
    printf("create %.3f s; blocks %d %d patch %ld; order cells %d %d\n", seconds() - t0, sum->blocks[1], sum->blocks[2], (long)sum->patch, sum->order.cells[0], sum->order.cells[1]);
    const struct gbg_ewald_kernels *k = device->variant->ewald;
    int waves = gradient == GBG_GRADIENT_WAVES;
    for (int rep = 0; rep < 4; rep++) {
        double t[8]; t[0] = seconds(); gbg_ewald_sort(device, &s, sum);
        t[1] = seconds(); k->spread(device, sum);
        t[2] = seconds(); sum->fft->forward(sum->transform, sum->mesh[0]);
        t[3] = seconds(); k->multiply(device, sum, waves);
        t[4] = seconds(); for (int a = 0; a < (waves ? dim : 1); a++) sum->fft->backward(sum->transform, sum->mesh[waves ? a + 1 : 0]);
        t[5] = seconds(); k->gather(device, sum); t[6] = seconds();
        double ns = 1e9 / n;
        printf("sort %.2f spread %.2f forward %.2f multiply %.2f backward %.2f gather %.2f total %.2f ns/particle\n", ns * (t[1] - t[0]), ns * (t[2] - t[1]), ns * (t[3] - t[2]), ns * (t[4] - t[3]), ns * (t[5] - t[4]), ns * (t[6] - t[5]), ns * (t[6] - t[0]));
    }
    gbg_ewald_force(device, &s, sum, 0);
    /* direct sum over waves */
    if (n <= 4096) {
        double err = 0, size = 0; int nmax = (int)(c.band / c.reach * L / 6.2831853) + 1;
        double complex *S = calloc((size_t)(2 * nmax + 1) * (2 * nmax + 1) * (dim == 3 ? 2 * nmax + 1 : 1), sizeof *S);
        int side = 2 * nmax + 1, deep = dim == 3 ? side : 1;
        double vol = dim == 3 ? L * L * L : L * L;
        for (int64_t i = 0; i < n; i++) for (int z = 0; z < deep; z++) for (int y = 0; y < side; y++) {
            double ph = ((y - nmax) * (double)s.high[1][i] + (dim == 3 ? (z - nmax) * (double)s.high[2][i] : 0)) * 0x1p-32;
            double complex w = cexp(-2 * M_PI * I * (ph - nmax * (double)s.high[0][i] * 0x1p-32)), st = cexp(-2 * M_PI * I * (double)s.high[0][i] * 0x1p-32);
            for (int x = 0; x < side; x++, w *= st) S[((size_t)z * side + y) * side + x] += w; }
        for (int64_t i = 0; i < n; i += 1 + n / 50) {
            double f[3] = {0};
            for (int z = 0; z < deep; z++) for (int y = 0; y < side; y++) for (int x = 0; x < side; x++) {
                double kk[3] = {x - nmax, y - nmax, dim == 3 ? z - nmax : 0}, k2 = 0, ph = 0;
                for (int a = 0; a < dim; a++) { ph += kk[a] * s.high[a][i] * 0x1p-32; kk[a] *= 2 * M_PI / L; k2 += kk[a] * kk[a]; }
                double far = gbg_split_far(&plan.split, sqrt(k2)) / vol;
                if (far == 0) continue;
                double complex phi = far * S[((size_t)z * side + y) * side + x] * cexp(2 * M_PI * I * ph);
                for (int a = 0; a < dim; a++) f[a] += creal(-I * kk[a] * phi);
            }
            for (int a = 0; a < dim; a++) { double d = s.force[a][i] - f[a]; err += d * d; size += f[a] * f[a]; if (i < 1) printf("%g %g\n", s.force[a][i], f[a]); }
        }
        printf("relative rms error of far part %.3g\n", sqrt(err / size));
    }
    gbg_ewald_destroy(device, sum);
    return 0;
}
