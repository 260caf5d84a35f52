/* L1: packing and unpacking for the direct sums, and the reference sum on single particles. */
#include "backend/cpu/direct.h"

#include <math.h>
#include <string.h>

#include "backend/cpu/cpu.h"

struct gbg_power gbg_power_make(double power)
{
    double halves = 2.0 * (power + 1.0);
    return (struct gbg_power){power, halves == rint(halves) ? (int)halves : 0};
}

double gbg_power_scalar(const struct gbg_power *power, double squared)
{
    return power->power == 2.0 ? 1.0 / (squared * sqrt(squared))
                               : pow(squared, -0.5 * (power->power + 1.0));
}

static double alpha_of(const struct gbg_state *state, int64_t i)
{
    return state->own_alpha ? state->own_alpha[i]
                            : state->alpha[state->species ? state->species[i] : 0];
}

static double largest_alpha(const struct gbg_state *state)
{
    double largest = 0.0;
    if (state->own_alpha) {
        for (int64_t i = 0; i < state->owned + state->ghost; i++) {
            largest = fmax(largest, fabs(state->own_alpha[i]));
        }
    } else {
        for (int s = 0; s < state->n_species; s++) {
            largest = fmax(largest, fabs(state->alpha[s]));
        }
    }
    return largest > 0.0 ? largest : 1.0;
}

/* Long rows need few reductions, many blocks keep many threads busy. */
static int64_t block_size(int64_t n)
{
    return n >= 32768 ? 512 : n >= 8192 ? 256 : GBG_DIRECT_TILE;
}

static int lay_out(struct gbg_device *device, const struct gbg_state *state,
                   struct gbg_direct *direct)
{
    int dimension = direct->dimension;
    direct->n = state->owned + state->ghost;
    direct->block = block_size(direct->n);
    direct->blocks = (direct->n + direct->block - 1) / direct->block;
    direct->padded = direct->blocks * direct->block;
    size_t room = (size_t)direct->padded * (size_t)(dimension * (8 + 4 + 8) + 8 + 4);
    void *memory;
    int status = gbg_cpu_workspace(device, room, &memory);
    if (status != GBG_OK) {
        return status;
    }
    char *next = memory;
    for (int a = 0; a < dimension; a++) {
        direct->position[a] = (uint64_t *)(void *)next;
        next += direct->padded * 8;
        direct->field[a] = (double *)(void *)next;
        next += direct->padded * 8;
    }
    direct->alpha = (double *)(void *)next;
    next += direct->padded * 8;
    for (int a = 0; a < dimension; a++) {
        direct->high[a] = (int32_t *)(void *)next;
        next += direct->padded * 4;
    }
    direct->single_alpha = (float *)(void *)next;
    return GBG_OK;
}

int gbg_cpu_direct_reserve(struct gbg_device *device, const struct gbg_state *state)
{
    struct gbg_direct direct = {.dimension = state->box.dimension};
    return lay_out(device, state, &direct);
}

static void fill(const struct gbg_state *state, double largest, double norm, int threads,
                 const struct gbg_direct *direct)
{
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int64_t i = 0; i < direct->padded; i++) {
        int real = i < direct->n;
        double alpha = real ? alpha_of(state, i) / largest * norm : 0.0;
        direct->alpha[i] = alpha;
        direct->single_alpha[i] = (float)alpha;
        for (int a = 0; a < direct->dimension; a++) {
            uint32_t high = real ? state->high[a][i] : 0, low = real ? state->low[a][i] : 0;
            direct->high[a][i] = (int32_t)high;
            direct->position[a][i] = (uint64_t)high << 32 | low;
            direct->field[a][i] = 0.0;
        }
    }
}

int gbg_direct_pack(struct gbg_device *device, const struct gbg_state *state, double power,
                    int scaled, struct gbg_direct *direct)
{
    *direct =
        (struct gbg_direct){.dimension = state->box.dimension, .power = gbg_power_make(power)};
    int status = lay_out(device, state, direct);
    if (status != GBG_OK) {
        return status;
    }
    double longest = 0.0, largest = largest_alpha(state), norm = scaled ? 1.0 : 0x1p60;
    for (int a = 0; a < direct->dimension; a++) {
        longest = fmax(longest, state->box.length[a]);
    }
    direct->quantum = scaled ? 0x1p-26 : 1.0;
    double unit = longest * (scaled ? 0x1p-6 : 0x1p-32);
    for (int a = 0; a < direct->dimension; a++) {
        direct->scale[a] = state->box.length[a] / longest * direct->quantum;
    }
    direct->factor = largest / norm * pow(unit, -power);
    fill(state, largest, norm, device->threads, direct);
    return GBG_OK;
}

void gbg_direct_unpack(const struct gbg_direct *direct, struct gbg_state *state, int threads,
                       int add)
{
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int64_t i = 0; i < state->owned; i++) {
        double mobility = state->mobility[state->species ? state->species[i] : 0] * direct->factor;
        for (int a = 0; a < direct->dimension; a++) {
            double force = mobility * direct->field[a][i];
            state->force[a][i] = add ? state->force[a][i] + force : force;
        }
    }
}

static uint64_t position_of(const struct gbg_state *state, int axis, int64_t i)
{
    return (uint64_t)state->high[axis][i] << 32 | state->low[axis][i];
}

/* Adds a term to a sum and its rounding error to `lost` (Neumaier). */
static void add_compensated(double term, double *sum, double *lost)
{
    double total = *sum + term;
    *lost += fabs(*sum) >= fabs(term) ? (*sum - total) + term : (term - total) + *sum;
    *sum = total;
}

static void one_target(const struct gbg_state *state, const struct gbg_power *power,
                       double cutoff_squared, int64_t i, double force[3])
{
    int dimension = state->box.dimension;
    double sum[3] = {0.0, 0.0, 0.0}, lost[3] = {0.0, 0.0, 0.0};
    for (int64_t k = 0; k < state->owned + state->ghost; k++) {
        double r[3], squared = 0.0;
        for (int a = 0; a < dimension; a++) {
            r[a] = gbg_box_difference(&state->box, a, position_of(state, a, i),
                                      position_of(state, a, k));
            squared += r[a] * r[a];
        }
        if (squared > 0.0 && squared < cutoff_squared) {
            double strength = alpha_of(state, k) * gbg_power_scalar(power, squared);
            for (int a = 0; a < dimension; a++) {
                add_compensated(strength * r[a], &sum[a], &lost[a]);
            }
        }
    }
    double mobility = state->mobility[state->species ? state->species[i] : 0];
    for (int a = 0; a < dimension; a++) {
        force[a] = mobility * (sum[a] + lost[a]);
    }
}

int gbg_cpu_direct_targets(struct gbg_device *device, struct gbg_state *state, double power,
                           double cutoff, int64_t n_targets, const int32_t *target,
                           double *const *out)
{
    struct gbg_power law = gbg_power_make(power);
    double cutoff_squared = cutoff > 0.0 ? cutoff * cutoff : INFINITY;
#pragma omp parallel for num_threads(device->threads) schedule(static)
    for (int64_t t = 0; t < n_targets; t++) {
        double force[3];
        one_target(state, &law, cutoff_squared, target[t], force);
        for (int a = 0; a < state->box.dimension; a++) {
            out[a][t] = force[a];
        }
    }
    return GBG_OK;
}
