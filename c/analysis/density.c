/* Analysis room: chooses between mesh and direct sum, and between instruction sets. */
#include "analysis/density.h"

#include <math.h>
#include <string.h>

#include "analysis/kernels.h"
#include "core/context.h"
#include "core/memory.h"

extern const struct gbg_tensor_kernels gbg_tensor_kernels_generic;
#ifdef GBG_X86_VARIANTS
extern const struct gbg_tensor_kernels gbg_tensor_kernels_avx2, gbg_tensor_kernels_avx512;
#endif

const struct gbg_tensor_kernels *gbg_tensor_kernels_of(const char *instructions)
{
#ifdef GBG_X86_VARIANTS
    if (strcmp(instructions, "avx512") == 0) {
        return &gbg_tensor_kernels_avx512;
    }
    if (strcmp(instructions, "avx2") == 0) {
        return &gbg_tensor_kernels_avx2;
    }
#endif
    (void)instructions;
    return &gbg_tensor_kernels_generic;
}

#ifdef GBG_WITH_FFTW
extern const struct gbg_spread_kernels gbg_spread_kernels_generic;
#ifdef GBG_X86_VARIANTS
extern const struct gbg_spread_kernels gbg_spread_kernels_avx2, gbg_spread_kernels_avx512;
#endif

const struct gbg_spread_kernels *gbg_spread_kernels_of(const char *instructions)
{
#ifdef GBG_X86_VARIANTS
    if (strcmp(instructions, "avx512") == 0) {
        return &gbg_spread_kernels_avx512;
    }
    if (strcmp(instructions, "avx2") == 0) {
        return &gbg_spread_kernels_avx2;
    }
#endif
    (void)instructions;
    return &gbg_spread_kernels_generic;
}
#endif

/* The next even number without prime factors above 7. */
static int32_t friendly(double least)
{
    int64_t n = (int64_t)ceil(least);
    for (n += n % 2;; n += 2) {
        int64_t rest = n;
        static const int primes[] = {2, 3, 5, 7};
        for (int p = 0; p < 4; p++) {
            while (rest % primes[p] == 0) {
                rest /= primes[p];
            }
        }
        if (rest == 1) {
            return n < INT32_MAX ? (int32_t)n : INT32_MAX;
        }
    }
}

/* Times in seconds on one core of 2.6 GHz with 512-bit vectors, good to a factor of two. */
static void estimate_times(const struct gbg_modes *modes, struct gbg_density_plan *plan)
{
    double nodes = 1, window = 1, products = 1, phases = 0;
    double digits = log10(sqrt((double)plan->n) / plan->tolerance);
    double width = fmin(fmax(digits + 1.5, GBG_WINDOW_NARROWEST), GBG_WINDOW_WIDEST);
    for (int a = 0; a < plan->dimension; a++) {
        nodes *= plan->cells[a];
        window *= width;
        products *= 2.0 * (modes->reach[a] + 1.0);
        phases += modes->reach[a] + 1.0;
    }
    double n = (double)plan->n;
    double per_node = plan->dimension == 2 ? 0.2 : 0.4;
    plan->mesh_seconds = 1e-9 * (n * (15 + per_node * window) + plan->channels * nodes * 6);
    plan->direct_seconds = 1e-9 * n * (0.08 * products + 4 * phases);
}

void gbg_density_weigh(const struct gbg_modes *modes, struct gbg_density_plan *plan)
{
    double rows = 1;
    for (int a = 0; a < plan->dimension; a++) {
        /* Twice the band; never narrower than the widest window. */
        plan->cells[a] = friendly(fmax(4.0 * modes->reach[a], GBG_WINDOW_WIDEST));
        rows *= a > 0 ? plan->cells[a] : 1;
    }
    double lists = (double)modes->count * (12 + 16 + 16.0 * plan->channels);
    plan->mesh_bytes = 8 * rows * (plan->cells[0] + 16.0) + lists + 24 * (double)modes->count;
    plan->direct_bytes = gbg_density_direct_bytes(modes) + lists;
    estimate_times(modes, plan);
    if (plan->method == GBG_DENSITY_AUTO) {
        int mesh = plan->mesh_seconds < plan->direct_seconds;
#ifndef GBG_WITH_FFTW
        mesh = 0;
#endif
        plan->method = mesh ? GBG_DENSITY_MESH : GBG_DENSITY_DIRECT;
    }
}

int gbg_density_make(struct gbg_context *context, const struct gbg_modes *modes,
                     const struct gbg_density_plan *plan, struct gbg_density **density)
{
    void *body, *rho;
    *density = NULL;
    int status = gbg_allocate_zero(context, &body, 1, sizeof **density, "density modes");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_density *made = body;
    made->context = context;
    made->dimension = plan->dimension;
    made->channels = plan->channels;
    made->n = plan->n;
    made->modes = modes;
    status = gbg_allocate_zero(context, &rho, plan->channels * modes->count, 2 * sizeof(double),
                               "density modes");
    made->rho = rho;
    if (status == GBG_OK && plan->method == GBG_DENSITY_MESH) {
#ifdef GBG_WITH_FFTW
        status = gbg_density_mesh_make(made, plan);
#else
        status = gbg_fail(context, GBG_E_UNBUILT,
                          "structure factor: method mesh needs FFTW, which "
                          "this build was configured without (GBG_WITH_FFTW=OFF)");
#endif
    } else if (status == GBG_OK) {
        status = gbg_density_direct_make(made);
    }
    if (status != GBG_OK) {
        gbg_density_free(made);
        return status;
    }
    *density = made;
    return GBG_OK;
}

void gbg_density_run(struct gbg_density *density, const struct gbg_points *points,
                     const double *lengths, const int32_t *channel, int base)
{
#ifdef GBG_WITH_FFTW
    if (density->mesh) {
        gbg_density_mesh_run(density, points, lengths, channel, base);
        return;
    }
#endif
    gbg_density_direct_run(density, points, lengths, channel, base);
}

void gbg_density_free(struct gbg_density *density)
{
    if (!density) {
        return;
    }
#ifdef GBG_WITH_FFTW
    gbg_density_mesh_free(density->mesh);
#endif
    gbg_density_direct_free(density->direct);
    gbg_release(density->rho);
    gbg_release(density->alias);
    gbg_release(density->alias_root);
    gbg_release(density->gain);
    gbg_release(density);
}

double gbg_density_bound(const struct gbg_density *density)
{
    double largest = 0;
    for (int64_t m = 0; m < density->modes->count; m++) {
        double bound = density->alias[m] + density->gain[m] * density->rounding;
        largest = bound > largest ? bound : largest;
    }
    return sqrt((double)density->n) * largest;
}

int gbg_density_width(const struct gbg_density *density, int32_t *cells)
{
#ifdef GBG_WITH_FFTW
    if (density->mesh) {
        return gbg_density_mesh_width(density->mesh, cells);
    }
#endif
    (void)density;
    (void)cells;
    return 0;
}
