/* Benchmark: the sum over all pairs alone, on a backend's own arrays, by our kernel or the
 * thesis's. */
#include "bench/cases/all_pairs.h"

#include <math.h>

#include "bench/bench.h"
#include "core/context.h"
#include "core/memory.h"
#include "core/random.h"

enum { TARGETS = 1000 };

static const double power = 2.0;

static int upload_axis(struct gbg_bench_sum *sum, int a, const double *r, uint32_t *word)
{
    struct gbg_state *state = &sum->state;
    size_t bytes = (size_t)state->owned * sizeof *word;
    uint32_t *const to[2] = {state->high[a], state->low[a]};
    int status = GBG_OK;
    for (int low = 0; low < 2 && status == GBG_OK; low++) {
        for (int64_t i = 0; i < state->owned; i++) {
            uint64_t fraction = gbg_box_encode(&state->box, a, r[i], NULL);
            word[i] = (uint32_t)(low ? fraction : fraction >> 32);
        }
        status = sum->backend->upload(sum->device, to[low], word, bytes);
    }
    return status;
}

/* The first sites of a square lattice of spacing 1, each moved by up to 0.3 on each axis. */
static void place(int64_t n, int64_t side, double *const *position)
{
    for (int64_t i = 0; i < n; i++) {
        struct gbg_philox w =
            gbg_philox(gbg_philox_counter(0, (uint64_t)i, GBG_STREAM_START), 1, 3);
        position[0][i] = (double)(i % side) + 0.6 * gbg_uniform(w.word[0], w.word[1]);
        position[1][i] = (double)(i / side) + 0.6 * gbg_uniform(w.word[2], w.word[3]);
    }
}

static int upload(struct gbg_bench_sum *sum, int64_t side, double *room)
{
    struct gbg_state *state = &sum->state;
    int64_t n = state->owned;
    double *position[2] = {room, room + n};
    uint8_t *species = (uint8_t *)(room + 2 * n);
    place(n, side, position);
    int status = GBG_OK;
    for (int a = 0; a < 2 && status == GBG_OK; a++) {
        status = upload_axis(sum, a, position[a], (uint32_t *)(room + 2 * n));
    }
    for (int64_t i = 0; i < n; i++) {
        species[i] = (uint8_t)(i % 2);
    }
    return status ? status : sum->backend->upload(sum->device, state->species, species, (size_t)n);
}

static int allocate(struct gbg_bench_sum *sum)
{
    const struct gbg_backend *backend = sum->backend;
    struct gbg_state *state = &sum->state;
    int64_t n = state->owned;
    int status =
        backend->allocate(sum->device, (void **)&state->species, n, sizeof *state->species, "sum");
    for (int a = 0; a < 2 && status == GBG_OK; a++) {
        status = backend->allocate(sum->device, (void **)&state->high[a], n, 4, "sum");
        status =
            status ? status : backend->allocate(sum->device, (void **)&state->low[a], n, 4, "sum");
        status = status ? status
                        : backend->allocate(sum->device, (void **)&state->force[a], n, 8, "sum");
    }
    return status;
}

int gbg_bench_sum_create(struct gbg_context *context, int64_t n, struct gbg_bench_sum *sum)
{
    int64_t side = (int64_t)ceil(sqrt((double)n) - 1e-9);
    double *room, lengths[2] = {(double)side, (double)side};
    *sum =
        (struct gbg_bench_sum){.context = context, .backend = gbg_backend_find(context->backend)};
    struct gbg_state *state = &sum->state;
    state->box = gbg_box_make(2, lengths, NULL);
    state->owned = n;
    state->n_species = 2;
    state->alpha[0] = -1.0, state->alpha[1] = 1.0;
    state->mobility[0] = 1.0, state->mobility[1] = -2.0;
    int status = gbg_allocate(context, (void **)&room, 3 * state->owned, sizeof *room, "particles");
    if (status != GBG_OK) {
        return status;
    }
    status = sum->backend->create(context, &sum->device);
    if (status == GBG_OK) {
        sum->kernels = sum->backend->kernels(sum->device);
        status = allocate(sum);
        status = status ? status : upload(sum, side, room);
        status = status ? status : sum->kernels->direct_reserve(sum->device, state);
    }
    gbg_release(room);
    if (status != GBG_OK) {
        gbg_bench_sum_destroy(sum);
    }
    return status;
}

void gbg_bench_sum_destroy(struct gbg_bench_sum *sum)
{
    if (sum->device) {
        struct gbg_state *state = &sum->state;
        for (int a = 0; a < 2; a++) {
            sum->backend->release(sum->device, state->high[a]);
            sum->backend->release(sum->device, state->low[a]);
            sum->backend->release(sum->device, state->force[a]);
        }
        sum->backend->release(sum->device, state->species);
        sum->backend->destroy(sum->device);
    }
    *sum = (struct gbg_bench_sum){0};
}

int gbg_bench_sum_has(const struct gbg_bench_sum *sum, int design)
{
    return design == GBG_BENCH_OURS || sum->kernels->direct_published != NULL;
}

int gbg_bench_sum_make_once(void *user)
{
    struct gbg_bench_sum *sum = user;
    int status = sum->design == GBG_BENCH_OURS
                     ? sum->kernels->direct_mixed(sum->device, &sum->state, power, 0)
                     : sum->kernels->direct_published(sum->device, &sum->state, power, sum->design);
    return status ? status : sum->backend->sync(sum->device);
}

int gbg_bench_sum_error(struct gbg_bench_sum *sum, double *rms, double *median)
{
    int64_t n = sum->state.owned, targets = n < TARGETS ? n : TARGETS;
    double *room, size[TARGETS], error = 0.0, total = 0.0, exact[2][TARGETS];
    double *const reference[3] = {exact[0], exact[1], NULL};
    int32_t target[TARGETS];
    int status = gbg_allocate(sum->context, (void **)&room, 2 * n, sizeof *room, "forces");
    for (int64_t t = 0; t < targets; t++) {
        target[t] = (int32_t)(n * t / targets);
    }
    status = status ? status
                    : sum->kernels->direct_targets(sum->device, &sum->state, power, 0.0, targets,
                                                   target, reference);
    for (int a = 0; a < 2 && status == GBG_OK; a++) {
        status = sum->backend->download(sum->device, room + a * n, sum->state.force[a],
                                        (size_t)n * sizeof *room);
    }
    for (int64_t t = 0; t < targets && status == GBG_OK; t++) {
        double squared = 0.0;
        for (int a = 0; a < 2; a++) {
            error += pow(room[a * n + target[t]] - exact[a][t], 2.0);
            squared += exact[a][t] * exact[a][t];
        }
        total += squared;
        size[t] = sqrt(squared);
    }
    gbg_release(room);
    *rms = sqrt(error / total);
    *median = sqrt(error / (double)targets) / gbg_bench_median(size, (int)targets);
    return status;
}
