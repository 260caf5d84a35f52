/* Analysis room: bins wave vectors into shells of |k|. */
#include <math.h>
#include <string.h>

#include "analysis/modes.h"
#include "core/context.h"
#include "core/memory.h"

static const double two_pi = 6.283185307179586477;

static int64_t index_of(const struct gbg_shells *shells, double k)
{
    double index = floor(k / shells->width + 0.5);
    return (int64_t)(index < 1e15 ? index : 1e15) - !shells->has_core;
}

double gbg_shells_low(const struct gbg_shells *shells, int64_t shell)
{
    double low = ((double)(shell + !shells->has_core) - 0.5) * shells->width;
    return low > 0 ? low : 0;
}

double gbg_shells_high(const struct gbg_shells *shells, int64_t shell)
{
    double high = ((double)(shell + !shells->has_core) + 0.5) * shells->width;
    return shell == shells->count - 1 && high > shells->k_max ? shells->k_max : high;
}

/* Lengths of the wave vectors; returns the smallest. */
static double set_k(struct gbg_shells *shells, const struct gbg_modes *modes, const double *lengths)
{
    double smallest = INFINITY;
    for (int64_t m = 0; m < modes->count; m++) {
        double square = 0;
        for (int a = 0; a < modes->dimension; a++) {
            double k = two_pi * modes->n[a][m] / lengths[a];
            square += k * k;
        }
        shells->k[m] = sqrt(square);
        smallest = shells->k[m] < smallest ? shells->k[m] : smallest;
    }
    memcpy(shells->lengths, lengths, (size_t)modes->dimension * sizeof *lengths);
    return smallest;
}

/* Counting sort of the modes by shell; in a shell they keep their order. */
static void sort_by_shell(struct gbg_shells *shells, const struct gbg_modes *modes)
{
    memset(shells->start, 0, (size_t)(shells->count + 1) * sizeof *shells->start);
    for (int64_t m = 0; m < modes->count; m++) {
        int64_t shell = index_of(shells, shells->k[m]);
        int inside = shell >= 0 && shell < shells->count;
        shells->shell_of[m] = inside ? (int32_t)shell : -1;
        if (inside) {
            shells->start[shell + 1]++;
        }
    }
    for (int64_t s = 0; s < shells->count; s++) {
        shells->start[s + 1] += shells->start[s];
    }
    for (int64_t m = 0; m < modes->count; m++) {
        if (shells->shell_of[m] >= 0) {
            shells->mode[shells->start[shells->shell_of[m]]++] = (uint32_t)m;
        }
    }
    for (int64_t s = shells->count; s > 0; s--) {
        shells->start[s] = shells->start[s - 1];
    }
    shells->start[0] = 0;
}

void gbg_shells_assign(struct gbg_shells *shells, const struct gbg_modes *modes,
                       const double *lengths)
{
    if (memcmp(shells->lengths, lengths, (size_t)modes->dimension * sizeof *lengths) != 0) {
        set_k(shells, modes, lengths);
        sort_by_shell(shells, modes);
    }
}

static int allocate(struct gbg_context *context, const struct gbg_modes *modes,
                    struct gbg_shells *shells)
{
    void *k = NULL, *mode = NULL, *shell_of = NULL;
    int status = gbg_allocate(context, &k, modes->count, sizeof(double), "wave numbers");
    if (status == GBG_OK) {
        status = gbg_allocate(context, &mode, modes->count, sizeof(uint32_t), "modes by shell");
    }
    if (status == GBG_OK) {
        status = gbg_allocate(context, &shell_of, modes->count, sizeof(int32_t), "shells of modes");
    }
    shells->k = k;
    shells->mode = mode;
    shells->shell_of = shell_of;
    return status;
}

int gbg_shells_make(struct gbg_context *context, const struct gbg_modes *modes,
                    const double *lengths, double k_max, double width, struct gbg_shells *shells)
{
    *shells = (struct gbg_shells){.width = width, .k_max = k_max};
    int status = allocate(context, modes, shells);
    if (status == GBG_OK) {
        shells->has_core = set_k(shells, modes, lengths) < 0.5 * width;
        int64_t last = 0;
        for (int64_t m = 0; m < modes->count; m++) {
            int64_t shell = index_of(shells, shells->k[m]);
            last = shell > last ? shell : last;
        }
        shells->count = last + 1;
        void *start;
        status = gbg_allocate(context, &start, shells->count + 1, sizeof(int64_t), "shells");
        shells->start = start;
    }
    if (status != GBG_OK) {
        gbg_shells_free(shells);
        return status;
    }
    sort_by_shell(shells, modes);
    return GBG_OK;
}

void gbg_shells_free(struct gbg_shells *shells)
{
    gbg_release(shells->k);
    gbg_release(shells->start);
    gbg_release(shells->mode);
    gbg_release(shells->shell_of);
    memset(shells, 0, sizeof *shells);
}
