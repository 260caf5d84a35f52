/* Analysis room: density modes by the direct sum, as products of phases of the axes. */
#include <math.h>
#include <string.h>

#include "analysis/density.h"
#include "analysis/kernels.h"
#include "core/context.h"
#include "core/memory.h"

/* Particles that are summed before they are added to the rest: keeps their phases in the cache and
 * the rounding of long sums small. */
enum { BATCH = 128, WORTH_THREADS = 100000 }; /* the second: multiplications */

/* sum[outer][row][column] = sum_p outer-phase row-phase column-phase, where the phases of axis a
 * are cos(k_a x_a) for n = 0..reach, then sin. Columns belong to axis 0, rows to 1, outer to 2. */
struct gbg_density_direct {
    const struct gbg_tensor_kernels *kernels;
    int dimension, threads;
    int32_t reach[3];
    int64_t extent[3]; /* 2 (reach + 1), rounded up */
    double *phase[3];  /* BATCH * extent */
    double *sum;
    double *factor; /* threads * BATCH * GBG_TENSOR_ROWS */
    int64_t *order; /* particles by channel; NULL with one channel */
    double x[BATCH];
};

static int64_t round_up(int64_t n, int64_t unit)
{
    return (n + unit - 1) / unit * unit;
}

static void set_extents(const struct gbg_modes *modes, int64_t extent[3])
{
    static const int64_t unit[3] = {GBG_TENSOR_COLUMNS, GBG_TENSOR_ROWS, 1};
    for (int a = 0; a < 3; a++) {
        int64_t phases = a < modes->dimension ? 2 * ((int64_t)modes->reach[a] + 1) : 1;
        extent[a] = round_up(phases, unit[a]);
    }
}

double gbg_density_direct_bytes(const struct gbg_modes *modes)
{
    int64_t extent[3];
    set_extents(modes, extent);
    double sum = 8.0 * (double)extent[0] * (double)extent[1] * (double)extent[2];
    return sum + 8.0 * BATCH * (double)(extent[0] + extent[1] + extent[2]);
}

/* One bound for all modes: no aliasing, and a gain of 1. */
static int allocate_errors(struct gbg_density *density)
{
    double **list[] = {&density->alias, &density->alias_root, &density->gain};
    for (int i = 0; i < 3; i++) {
        void *array;
        int status = gbg_allocate_zero(density->context, &array, density->modes->count,
                                       sizeof(double), "error bounds of modes");
        *list[i] = array;
        if (status != GBG_OK) {
            return status;
        }
    }
    for (int64_t m = 0; m < density->modes->count; m++) {
        density->gain[m] = 1;
    }
    return GBG_OK;
}

int gbg_density_direct_make(struct gbg_density *density)
{
    void *body;
    struct gbg_context *context = density->context;
    int status = gbg_allocate_zero(context, &body, 1, sizeof *density->direct, "direct sum");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_density_direct *direct = density->direct = body;
    direct->kernels = gbg_tensor_kernels_of(context->host);
    direct->dimension = density->dimension;
    direct->threads = context->threads;
    memcpy(direct->reach, density->modes->reach, sizeof direct->reach);
    set_extents(density->modes, direct->extent);
    status = allocate_errors(density);
    struct {
        void **pointer;
        int64_t count;
    } list[] = {
        {(void **)&direct->phase[0], BATCH * direct->extent[0]},
        {(void **)&direct->phase[1], BATCH * direct->extent[1]},
        {(void **)&direct->phase[2], BATCH * direct->extent[2]},
        {(void **)&direct->sum, direct->extent[0] * direct->extent[1] * direct->extent[2]},
        {(void **)&direct->factor, direct->threads * BATCH * GBG_TENSOR_ROWS},
        {(void **)&direct->order, density->channels > 1 ? density->n : 0},
    };
    for (size_t i = 0; i < sizeof list / sizeof *list && status == GBG_OK; i++) {
        status = gbg_allocate_zero(context, list[i].pointer, list[i].count, sizeof(double),
                                   "direct sum");
    }
    return status;
}

void gbg_density_direct_free(struct gbg_density_direct *direct)
{
    if (direct) {
        for (int a = 0; a < 3; a++) {
            gbg_release(direct->phase[a]);
        }
        gbg_release(direct->sum);
        gbg_release(direct->factor);
        gbg_release(direct->order);
        gbg_release(direct);
    }
}

/* Coordinates of the particles order[begin..], on one axis and within 2^30 boxes. */
static void gather(struct gbg_density_direct *direct, const struct gbg_points *points, int a,
                   const int64_t *order, int64_t begin, int64_t n, double length)
{
    for (int64_t i = 0; i < n; i++) {
        double x = gbg_point(points, a, order ? order[begin + i] : begin + i);
        direct->x[i] = fabs(x) > 0x1p30 * length ? remainder(x, length) : x;
    }
}

static void set_phases(struct gbg_density_direct *direct, int a, int64_t n, double length)
{
    int64_t extent = direct->extent[a];
    int worth = n * direct->reach[a] >= WORTH_THREADS;
    (void)worth;
#pragma omp parallel for num_threads(direct->threads) schedule(static) if (worth)
    for (int64_t i = 0; i < n; i += 16) {
        int64_t part = n - i < 16 ? n - i : 16;
        direct->kernels->phases(length, direct->reach[a], part, direct->x + i, extent,
                                direct->phase[a] + i * extent);
    }
}

/* Adds GBG_TENSOR_ROWS rows of one outer phase for a batch. */
static void add_rows(struct gbg_density_direct *direct, int64_t job, int64_t n, double *factor)
{
    int64_t row_jobs = direct->extent[1] / GBG_TENSOR_ROWS;
    int64_t outer = job / row_jobs, row = job % row_jobs * GBG_TENSOR_ROWS;
    for (int64_t p = 0; p < n; p++) {
        double scale = direct->dimension == 3 ? direct->phase[2][p * direct->extent[2] + outer] : 1;
        for (int r = 0; r < GBG_TENSOR_ROWS; r++) {
            factor[p * GBG_TENSOR_ROWS + r] =
                scale * direct->phase[1][p * direct->extent[1] + row + r];
        }
    }
    double *sum = direct->sum + (outer * direct->extent[1] + row) * direct->extent[0];
    direct->kernels->multiply(n, factor, direct->phase[0], direct->extent[0], sum);
}

static void add_batch(struct gbg_density_direct *direct, int64_t n)
{
    int64_t jobs = direct->extent[2] * (direct->extent[1] / GBG_TENSOR_ROWS);
    int threads = direct->threads, worth = jobs * n * direct->extent[0] >= WORTH_THREADS;
    (void)worth;
#pragma omp parallel for num_threads(threads) schedule(static, 1) if (worth)
    for (int t = 0; t < threads; t++) {
        double *factor = direct->factor + (int64_t)t * BATCH * GBG_TENSOR_ROWS;
        for (int64_t job = jobs * t / threads; job < jobs * (t + 1) / threads; job++) {
            add_rows(direct, job, n, factor);
        }
    }
}

/* Mode n from the sums over cosines and sines: prod_a (cos - i sign(n_a) sin). */
static void pick(const struct gbg_density_direct *direct, const struct gbg_modes *modes,
                 double *rho)
{
    int corners = 1 << modes->dimension;
    for (int64_t m = 0; m < modes->count; m++) {
        double part[4] = {0, 0, 0, 0}; /* by the power of -i */
        for (int corner = 0; corner < corners; corner++) {
            int64_t at = 0;
            int power = 0;
            double sign = 1;
            for (int a = modes->dimension - 1; a >= 0; a--) {
                int32_t n = modes->n[a][m];
                int sine = corner >> a & 1;
                at = at * direct->extent[a] + (n < 0 ? -n : n) + sine * (modes->reach[a] + 1);
                power += sine;
                sign = sine && n < 0 ? -sign : sign;
            }
            part[power] += sign * direct->sum[at];
        }
        rho[2 * m] = part[0] - part[2];
        rho[2 * m + 1] = part[3] - part[1];
    }
}

/* Particles of each channel one after another, in their order; first[c] is where channel c starts.
 */
static void order_by_channel(const struct gbg_density *density, int64_t n, const int32_t *channel,
                             int base, int64_t *first)
{
    int64_t *order = density->direct->order, place = 0;
    for (int c = 0; c < density->channels; c++) {
        first[c] = place;
        for (int64_t i = 0; i < n; i++) {
            if ((channel ? channel[i] - base : 0) == c) {
                order[place++] = i;
            }
        }
    }
    first[density->channels] = place;
}

enum { MOST_CHANNELS = 64 };

void gbg_density_direct_run(struct gbg_density *density, const struct gbg_points *points,
                            const double *lengths, const int32_t *channel, int base)
{
    struct gbg_density_direct *direct = density->direct;
    int64_t first[MOST_CHANNELS + 1] = {0, points->n}, longest = 0;
    const int64_t *order = NULL;
    if (density->channels > 1) {
        order_by_channel(density, points->n, channel, base, first);
        order = direct->order;
    }
    for (int c = 0; c < density->channels; c++) {
        size_t size = (size_t)(direct->extent[0] * direct->extent[1] * direct->extent[2]);
        memset(direct->sum, 0, size * sizeof *direct->sum);
        for (int64_t begin = first[c]; begin < first[c + 1]; begin += BATCH) {
            int64_t n = first[c + 1] - begin < BATCH ? first[c + 1] - begin : BATCH;
            for (int a = 0; a < density->dimension; a++) {
                gather(direct, points, a, order, begin, n, lengths[a]);
                set_phases(direct, a, n, lengths[a]);
            }
            add_batch(direct, n);
        }
        pick(direct, density->modes, density->rho + 2 * c * density->modes->count);
        int64_t count = first[c + 1] - first[c];
        longest = count > longest ? count : longest;
    }
    /* A sum of at most BATCH terms, then of batches; real and imaginary parts with up to sqrt(2) of
     * absolute weight each; phases to 6 u an axis. */
    double terms = (double)(longest < BATCH ? longest : BATCH) + (double)(longest / BATCH);
    density->rounding = GBG_UNIT_ROUNDOFF * (2 * terms + 20 * density->dimension + 8);
    density->rounding_typical = 4 * GBG_UNIT_ROUNDOFF;
}
