/* Benchmark: sums over all images by a mesh (goals S3 to S5): time of one evaluation, sorting
 * included, against its measured error, for tolerances, distributions and methods. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "backend/backend.h"
#include "bench/bench.h"
#include "core/context.h"
#include "core/memory.h"
#include "core/random.h"
#include "ewald/model.h"
#include "ewald/reference.h"
#include "gamboge/gamboge.h"

enum { TARGETS = 1000, BLOBS = 64 };

/* A set of particles on the device, and the exact fields of a sample. */
struct set {
    struct gbg_context *context;
    const struct gbg_backend *backend;
    const struct gbg_kernels *kernels;
    struct gbg_device *device;
    struct gbg_state state;
    const char *name;
    double *position[3], *alpha, *force;
    int64_t targets;
    int32_t target[TARGETS];
    double exact[3][TARGETS];
    struct gbg_ewald *sum;
};

struct method {
    const char *name;
    int split, window, gradient;
};

static const struct method methods[] = {
    {"prolate", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, GBG_GRADIENT_WAVES},
    {"prolate, window gradient", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, GBG_GRADIENT_WINDOW},
    {"Gaussian split, B-splines", GBG_SPLIT_GAUSSIAN, GBG_EWALD_BSPLINE, GBG_GRADIENT_WAVES},
    {"Gaussian split, prolate window", GBG_SPLIT_GAUSSIAN, GBG_EWALD_PROLATE, GBG_GRADIENT_WAVES},
};

static struct gbg_philox words(int64_t i, uint32_t run)
{
    return gbg_philox(gbg_philox_counter(0, (uint64_t)i, GBG_STREAM_START), 7, run);
}

/* Normal deviate by the sum of 12 uniform ones. */
static double bell(int64_t i, uint32_t run)
{
    double sum = -6.0;
    for (uint32_t k = 0; k < 6; k++) {
        struct gbg_philox w = words(i, run + k);
        sum += gbg_uniform(w.word[0], w.word[1]) + gbg_uniform(w.word[2], w.word[3]);
    }
    return sum;
}

/* 64 blobs, of widths from 0.001 to 0.03 of the box. */
static void place_blobs(int dimension, const double *length, int64_t n, double *const *position)
{
    for (int64_t i = 0; i < n; i++) {
        int64_t blob = i % BLOBS;
        double width = 1e-3 * pow(30.0, (double)blob / (BLOBS - 1));
        struct gbg_philox w = words(blob, 3);
        for (int a = 0; a < dimension; a++) {
            double u = gbg_uniform(w.word[a], w.word[3]) + width * bell(i, 10 + 10 * (uint32_t)a);
            position[a][i] = length[a] * (u - floor(u));
        }
    }
}

/* Discs that cover 0.4 of the plane (balls, of the volume): at random, then moved apart. */
static int place_discs(struct set *set, int64_t n)
{
    const struct gbg_box *box = &set->state.box;
    double volume = 1.0, pi = acos(-1.0);
    for (int a = 0; a < box->dimension; a++) {
        volume *= box->length[a];
    }
    double core = 0.4 * volume / (double)n;
    double diameter = box->dimension == 2 ? sqrt(core * 4.0 / pi) : cbrt(core * 6.0 / pi);
    int64_t rounds;
    for (int64_t i = 0; i < n; i++) {
        set->force[i] = diameter;
    }
    return gbg_overlaps_remove(set->context, box->dimension, box->length, n, set->position[0],
                               set->position[1], set->position[2], 1, set->force, "contact", 0,
                               &rounds);
}

static int place(struct set *set)
{
    const struct gbg_box *box = &set->state.box;
    int64_t n = set->state.owned;
    int status = GBG_OK, lattice = strcmp(set->name, "jittered lattice") == 0;
    if (strcmp(set->name, "64 blobs") == 0) {
        place_blobs(box->dimension, box->length, n, set->position);
    } else {
        set->state.owned = gbg_bench_points(box->dimension, box->length, lattice, n, set->position);
    }
    if (strcmp(set->name, "discs at 0.4") == 0) {
        status = place_discs(set, n);
    }
    for (int64_t i = 0; i < set->state.owned; i++) {
        struct gbg_philox w = words(i, 200);
        set->alpha[i] = 0.5 + gbg_uniform(w.word[0], w.word[1]);
    }
    return status;
}

static int upload(struct set *set)
{
    struct gbg_state *state = &set->state;
    uint32_t *word = (uint32_t *)set->force;
    int status = GBG_OK;
    for (int a = 0; a < state->box.dimension && status == GBG_OK; a++) {
        uint32_t *const to[2] = {state->high[a], state->low[a]};
        for (int low = 0; low < 2 && status == GBG_OK; low++) {
            for (int64_t i = 0; i < state->owned; i++) {
                uint64_t fraction = gbg_box_encode(&state->box, a, set->position[a][i], NULL);
                word[i] = (uint32_t)(low ? fraction : fraction >> 32);
            }
            status = set->backend->upload(set->device, to[low], word,
                                          (size_t)state->owned * sizeof *word);
        }
    }
    return status ? status
                  : set->backend->upload(set->device, state->own_alpha, set->alpha,
                                         (size_t)state->owned * sizeof *set->alpha);
}

static int allocate(struct set *set)
{
    struct gbg_state *state = &set->state;
    int64_t n = state->owned;
    double *room;
    int status = gbg_allocate(set->context, (void **)&room, 5 * n, sizeof *room, "particles");
    if (status != GBG_OK) {
        return status;
    }
    set->force = room;
    set->alpha = room + n;
    for (int a = 0; a < 3; a++) {
        set->position[a] = a < state->box.dimension ? room + (2 + a) * n : NULL;
    }
    const struct gbg_backend *backend = set->backend;
    status = backend->allocate(set->device, (void **)&state->own_alpha, n, 8, "sources");
    for (int a = 0; a < state->box.dimension && status == GBG_OK; a++) {
        status = backend->allocate(set->device, (void **)&state->high[a], n, 4, "positions");
        status = status
                     ? status
                     : backend->allocate(set->device, (void **)&state->low[a], n, 4, "positions");
        status = status ? status
                        : backend->allocate(set->device, (void **)&state->force[a], n, 8, "forces");
    }
    return status;
}

/* The exact fields of 1000 particles. */
static int measure_exact(struct set *set, double power)
{
    const struct gbg_state *state = &set->state;
    struct gbg_ewald_sources sources = {
        .dimension = state->box.dimension, .power = power, .n = state->owned, .alpha = set->alpha};
    double *const exact[3] = {set->exact[0], set->exact[1], set->exact[2]};
    set->targets = state->owned < TARGETS ? state->owned : TARGETS;
    for (int a = 0; a < state->box.dimension; a++) {
        sources.length[a] = state->box.length[a];
        sources.position[a] = set->position[a];
    }
    for (int64_t t = 0; t < set->targets; t++) {
        set->target[t] = (int32_t)(state->owned * t / set->targets);
    }
    return gbg_ewald_reference(set->context, &sources, 1.0, set->targets, set->target, exact, NULL);
}

static void destroy(struct set *set)
{
    struct gbg_state *state = &set->state;
    if (set->device) {
        for (int a = 0; a < 3; a++) {
            set->backend->release(set->device, state->high[a]);
            set->backend->release(set->device, state->low[a]);
            set->backend->release(set->device, state->force[a]);
        }
        set->backend->release(set->device, state->own_alpha);
        set->backend->destroy(set->device);
    }
    gbg_release(set->force);
}

static int create(struct set *set, int dimension, double power, int64_t n)
{
    double length[3];
    for (int a = 0; a < 3; a++) {
        length[a] = pow((double)n, 1.0 / dimension);
    }
    set->state.box = gbg_box_make(dimension, length, NULL);
    set->state.owned = n;
    set->state.n_species = 1;
    set->state.mobility[0] = set->state.alpha[0] = 1.0;
    set->backend = gbg_backend_find(set->context->backend);
    int status = set->backend->create(set->context, &set->device);
    if (status != GBG_OK) {
        return status;
    }
    set->kernels = set->backend->kernels(set->device);
    status = allocate(set);
    status = status ? status : place(set);
    status = status ? status : upload(set);
    return status ? status : measure_exact(set, power);
}

static int evaluate(void *user)
{
    struct set *set = user;
    int status = set->kernels->ewald_force(set->device, &set->state, set->sum, 0);
    return status ? status : set->backend->sync(set->device);
}

static int measure_error(struct set *set, struct gbg_bench_result *line)
{
    double error = 0.0, total = 0.0, size[TARGETS] = {0.0};
    int status = GBG_OK;
    for (int a = 0; a < set->state.box.dimension && status == GBG_OK; a++) {
        status = set->backend->download(set->device, set->force, set->state.force[a],
                                        (size_t)set->state.owned * sizeof *set->force);
        for (int64_t t = 0; t < set->targets; t++) {
            double d = set->force[set->target[t]] - set->exact[a][t];
            error += d * d;
            size[t] += set->exact[a][t] * set->exact[a][t];
        }
    }
    for (int64_t t = 0; t < set->targets; t++) {
        total += size[t];
        size[t] = sqrt(size[t]);
    }
    line->error_rms = sqrt(error / total);
    line->error_median =
        sqrt(error / (double)set->targets) / gbg_bench_median(size, (int)set->targets);
    return status;
}

static int run_line(struct gbg_bench *bench, struct set *set, const struct method *method,
                    double power, double tolerance, const char *what)
{
    struct gbg_bench_result line = {
        .what = what, .unit = "particles", .n = set->state.owned, .allowed = tolerance};
    struct gbg_ewald_wish wish = {.dimension = set->state.box.dimension,
                                  .power = power,
                                  .n = set->state.owned,
                                  .tolerance = tolerance,
                                  .split = method->split,
                                  .window = method->window,
                                  .gradient = method->gradient,
                                  .single = -1};
    struct gbg_ewald_choice choice;
    struct gbg_ewald_plan *plan;
    double predicted, cost;
    memcpy(wish.length, set->state.box.length, sizeof wish.length);
    if (gbg_ewald_choose(&wish, &choice, &predicted, &cost) != GBG_OK) {
        return GBG_OK; /* this method has no window as good as that */
    }
    int status = gbg_allocate(set->context, (void **)&plan, 1, sizeof *plan, "plan of a sum");
    if (status != GBG_OK) {
        return status;
    }
    status = gbg_ewald_plan_make(&choice, plan);
    status =
        status ? status : set->kernels->ewald_create(set->device, &set->state, plan, 0, &set->sum);
    line.precision = choice.single ? "single" : "double";
    line.work = (double)line.n;
    status = status ? status : gbg_bench_time(evaluate, set, &line.seconds);
    status = status ? status : measure_error(set, &line);
    gbg_bench_extra(&line, "tolerance", tolerance);
    gbg_bench_extra(&line, "predicted", predicted);
    gbg_bench_extra(&line, "predicted core ns", cost);
    gbg_bench_extra(&line, "reach", choice.reach);
    gbg_bench_extra(&line, "cells", choice.cells[0]);
    gbg_bench_extra(&line, "width", choice.width);
    if (set->sum) {
        set->kernels->ewald_destroy(set->device, set->sum);
        set->sum = NULL;
    }
    gbg_release(plan);
    return status ? gbg_bench_leave_out(bench, what, line.n, status)
                  : gbg_bench_report(bench, &line);
}

/* Sets in the order of their lines. */
static const struct {
    const char *name;
    int dimension;
} sets[] = {
    {"jittered lattice", 2}, {"uniform", 2}, {"discs at 0.4", 2}, {"64 blobs", 2}, {"uniform", 3}};
enum { SETS = sizeof sets / sizeof *sets, METHODS = sizeof methods / sizeof *methods };

/* Lines of one set: the name of a line is that of the set and the method. */
static int run_set(struct gbg_bench *bench, int which, double power, int64_t n)
{
    static const double tolerances[] = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10, 1e-12};
    static char names[SETS][METHODS][96]; /* lines keep them */
    struct set *set;
    int status = gbg_allocate_zero(bench->context, (void **)&set, 1, sizeof *set, "set");
    if (status != GBG_OK) {
        return status;
    }
    set->context = bench->context;
    set->name = sets[which].name;
    for (size_t t = 0; t < sizeof tolerances / sizeof *tolerances && status == GBG_OK; t++) {
        for (int m = 0; m < METHODS && status == GBG_OK; m++) {
            char *what = names[which][m];
            snprintf(what, sizeof names[which][m], "%dD %s, %s", sets[which].dimension, set->name,
                     methods[m].name);
            if (gbg_bench_wanted(bench, what)) {
                status = set->device ? GBG_OK : create(set, sets[which].dimension, power, n);
                status =
                    status ? status : run_line(bench, set, &methods[m], power, tolerances[t], what);
            }
        }
    }
    destroy(set);
    gbg_release(set);
    return status ? gbg_bench_leave_out(bench, sets[which].name, n, status) : GBG_OK;
}

static int run(struct gbg_bench *bench)
{
    static const int64_t list[] = {1 << 12, 1 << 16, 1000000, 0};
    int64_t size[16];
    int sizes = gbg_bench_sizes(bench, list, 1 << 12, size), status = GBG_OK;
    for (int k = 0; k < sizes && status == GBG_OK; k++) {
        for (int s = 0; s < SETS && status == GBG_OK; s++) {
            status = run_set(bench, s, 2.0, size[k]);
        }
    }
    return status;
}

const struct gbg_bench_case gbg_bench_long_range = {
    "long-range",
    "sums over all images by a mesh; error on 1000 particles against Ewald sums in double", run};
