/* Numbers of long-range sums: sums of the reference over sources, wave by wave. */
#include "ewald/reference_waves.h"

#include <math.h>
#include <string.h>
#ifdef _OPENMP
#include <omp.h>
#endif

#include "core/context.h"
#include "core/memory.h"
#include "gamboge/status.h"

enum {
    BATCH = GBG_REFERENCE_BATCH,
    WAVES = GBG_REFERENCE_WAVES,
    TILE = GBG_REFERENCE_TILE,
    ROWS = GBG_REFERENCE_ROWS,
    BLOCKS = 64 /* of sources: each is summed by one thread, then all in their order */
};

static int this_thread(void)
{
#ifdef _OPENMP
    return omp_get_thread_num();
#else
    return 0;
#endif
}

/* The next group after the sums so far: waves of axis 0 while they are within k_max. */
static void list_group(int32_t y, int32_t z, double squared_left, struct gbg_reference_waves *waves)
{
    int32_t most = (int32_t)(sqrt(squared_left) / waves->unit[0]);
    struct gbg_reference_group group = {y, z, most / WAVES + 1, waves->n_sums};
    if (waves->group) {
        waves->group[waves->n_groups] = group;
    }
    int32_t other = waves->dimension == 2 ? y + 1 : y;
    int32_t tiles[3] = {group.tiles, other / WAVES + 1, z / WAVES + 1};
    for (int a = 0; a < waves->dimension; a++) {
        waves->tiles[a] = waves->tiles[a] > tiles[a] ? waves->tiles[a] : tiles[a];
    }
    waves->n_groups++;
    waves->n_sums += (int64_t)group.tiles * ROWS * TILE;
}

void gbg_reference_list_waves(int dimension, const double *length, double k_max,
                              struct gbg_reference_waves *waves)
{
    const double turn = 6.283185307179586477, squared = k_max * k_max;
    waves->dimension = dimension;
    waves->n_groups = waves->n_sums = 0;
    for (int a = 0; a < 3; a++) {
        waves->unit[a] = a < dimension ? turn / length[a] : 0.0;
        waves->tiles[a] = 0;
    }
    double deep = dimension == 3 ? waves->unit[2] : 2.0 * k_max;
    int32_t step = dimension == 2 ? 2 : 1;
    for (int32_t z = 0; z * deep <= k_max; z++) {
        for (int32_t y = 0; y * waves->unit[1] <= k_max; y += step) {
            double k = y * waves->unit[1], q = dimension == 3 ? z * deep : 0.0;
            double left = squared - k * k - q * q;
            if (left >= 0.0) {
                list_group(y, z, left, waves);
            }
        }
    }
}

static int64_t phase_count(const struct gbg_reference_waves *waves)
{
    return (int64_t)BATCH * TILE * (waves->tiles[0] + waves->tiles[1] + waves->tiles[2]);
}

/* Phases of n particles, one after the other or those of a list. */
static void make_phases(const struct gbg_reference_kernels *kernels,
                        const struct gbg_reference_waves *waves,
                        const struct gbg_reference_sources *sources, int64_t first, int64_t n,
                        const int32_t *list, double *memory, const double **phase)
{
    double high[BATCH] = {0.0}, low[BATCH] = {0.0};
    phase[2] = NULL;
    for (int a = 0; a < waves->dimension; a++) {
        for (int64_t b = 0; b < n; b++) {
            int64_t i = list ? list[first + b] : first + b;
            high[b] = sources->high[a][i];
            low[b] = sources->low[a][i];
        }
        kernels->phases(n, high, low, waves->tiles[a], memory);
        phase[a] = memory;
        memory += (int64_t)BATCH * TILE * waves->tiles[a];
    }
}

/* Sums of one block of sources, those of its batches compensated. */
static void sum_block(const struct gbg_reference_kernels *kernels,
                      const struct gbg_reference_waves *waves,
                      const struct gbg_reference_sources *sources, int64_t begin, int64_t end,
                      double *memory, double *sum)
{
    size_t bytes = (size_t)waves->n_sums * sizeof(double);
    double *rest = memory + phase_count(waves);
    memset(sum, 0, bytes);
    memset(rest, 0, bytes);
    for (int64_t first = begin; first < end; first += BATCH) {
        int64_t n = end - first < BATCH ? end - first : BATCH;
        const double *phase[3];
        make_phases(kernels, waves, sources, first, n, NULL, memory, phase);
        kernels->add(waves, n, sources->alpha + first, phase, sum, rest);
    }
    for (int64_t k = 0; k < waves->n_sums; k++) {
        sum[k] += rest[k];
    }
}

/* Times the transform over the volume, for both signs of each wave number. */
static double wave_factor(const struct gbg_reference_law *law,
                          const struct gbg_reference_waves *waves, double volume,
                          const int32_t n[3])
{
    double squared = 0.0, images = 1.0;
    for (int a = 0; a < waves->dimension; a++) {
        double k = waves->unit[a] * n[a];
        squared += k * k;
        images *= n[a] ? 2.0 : 1.0;
    }
    return squared > 0.0 ? images / volume * gbg_reference_wave(law, squared) : 0.0;
}

/* Factors of group g, for both rows of wave y and both of y + 1 (plane), or all four (space). */
static void weigh_group(const struct gbg_reference_law *law,
                        const struct gbg_reference_waves *waves, double volume, int64_t g,
                        double *coefficient)
{
    const struct gbg_reference_group *group = &waves->group[g];
    for (int32_t x = 0; x < group->tiles * WAVES; x++) {
        double *sum = coefficient + group->first + (int64_t)(x / WAVES) * ROWS * TILE + x % WAVES;
        double factor[2];
        factor[0] = wave_factor(law, waves, volume, (int32_t[3]){x, group->y, group->z});
        factor[1] = waves->dimension == 3
                        ? factor[0]
                        : wave_factor(law, waves, volume, (int32_t[3]){x, group->y + 1, 0});
        for (int r = 0; r < ROWS; r++) {
            sum[r * TILE] *= factor[r / 2];
            sum[r * TILE + WAVES] *= factor[r / 2];
        }
    }
}

/* Adds blocks in their order, compensated. */
static void add_blocks(int64_t n_sums, int64_t blocks, const double *part, double *sum)
{
    for (int64_t k = 0; k < n_sums; k++) {
        double total = 0.0, rest = 0.0;
        for (int64_t b = 0; b < blocks; b++) {
            double more = part[b * n_sums + k], new = total + more, gain = new - total;
            rest += (total - (new - gain)) + (more - gain);
            total = new;
        }
        sum[k] = total + rest;
    }
}

/* As many blocks as there are sources for, fewer where their sums would take more than 1 GiB. */
static int64_t count_blocks(int64_t n, int64_t n_sums)
{
    int64_t by_sources = (n + 4 * BATCH - 1) / (4 * BATCH), by_memory = (INT64_C(1) << 27) / n_sums;
    int64_t blocks = by_sources < by_memory ? by_sources : by_memory;
    return blocks < 1 ? 1 : blocks < BLOCKS ? blocks : BLOCKS;
}

int gbg_reference_sum_waves(struct gbg_context *context,
                            const struct gbg_reference_kernels *kernels,
                            const struct gbg_reference_waves *waves,
                            const struct gbg_reference_law *law,
                            const struct gbg_reference_sources *sources, double *coefficient)
{
    const int threads = context->threads;
    int64_t n = sources->n, blocks = count_blocks(n, waves->n_sums);
    int64_t size = ((n + blocks - 1) / blocks + BATCH - 1) / BATCH * BATCH;
    int64_t own = phase_count(waves) + waves->n_sums;
    void *memory = NULL, *part = NULL;
    int status = gbg_allocate(context, &memory, threads * own, sizeof(double), "phases of waves");
    if (status == GBG_OK) {
        status = gbg_allocate(context, &part, blocks * waves->n_sums, sizeof(double),
                              "sums over blocks of sources");
    }
    if (status == GBG_OK) {
        double *work = memory, *parts = part;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
        for (int64_t b = 0; b < blocks; b++) {
            int64_t begin = b * size < n ? b * size : n;
            int64_t end = begin + size < n ? begin + size : n;
            sum_block(kernels, waves, sources, begin, end, work + this_thread() * own,
                      parts + b * waves->n_sums);
        }
        add_blocks(waves->n_sums, blocks, parts, coefficient);
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
        for (int64_t g = 0; g < waves->n_groups; g++) {
            weigh_group(law, waves, sources->volume, g, coefficient);
        }
    }
    gbg_release(memory);
    gbg_release(part);
    return status;
}

int gbg_reference_waves_at(struct gbg_context *context, const struct gbg_reference_kernels *kernels,
                           const struct gbg_reference_waves *waves, const double *coefficient,
                           const struct gbg_reference_sources *sources, int64_t n_targets,
                           const int32_t *target, double *field)
{
    const int threads = context->threads;
    const int64_t own = phase_count(waves);
    void *memory = NULL;
    int status = gbg_allocate(context, &memory, threads * own, sizeof(double), "phases of targets");
    if (status == GBG_OK) {
        double *work = memory;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
        for (int64_t first = 0; first < n_targets; first += BATCH) {
            int64_t n = n_targets - first < BATCH ? n_targets - first : BATCH;
            const double *phase[3];
            make_phases(kernels, waves, sources, first, n, target, work + this_thread() * own,
                        phase);
            for (int64_t b = 0; b < n; b++) {
                kernels->evaluate(waves, coefficient, b, phase, field + 4 * (first + b));
            }
        }
    }
    gbg_release(memory);
    return status;
}
