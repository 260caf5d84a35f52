/* Benchmark: the sum over all pairs alone, on a backend's own arrays, by our kernel or the
 * thesis's. */
#ifndef GBG_BENCH_CASES_ALL_PAIRS_H
#define GBG_BENCH_CASES_ALL_PAIRS_H

#include "backend/backend.h"

/* As direct_published counts them; ours last. */
enum gbg_bench_design { GBG_BENCH_TILES, GBG_BENCH_SHUFFLE, GBG_BENCH_OURS, GBG_BENCH_DESIGNS };

struct gbg_bench_sum {
    struct gbg_context *context;
    const struct gbg_backend *backend;
    const struct gbg_kernels *kernels;
    struct gbg_device *device;
    struct gbg_state state;
    int design; /* enum gbg_bench_design: what gbg_bench_sum_make_once takes */
};

/* n particles of two species, on a square lattice, each moved by up to 0.3 of its spacing. On
 * failure nothing is left behind. */
int gbg_bench_sum_create(struct gbg_context *context, int64_t n, struct gbg_bench_sum *sum);
void gbg_bench_sum_destroy(struct gbg_bench_sum *sum);

/* 1 if the backend has the design. */
int gbg_bench_sum_has(const struct gbg_bench_sum *sum, int design);

/* r/r^3 on all particles, waited for: what gbg_bench_time calls with a struct gbg_bench_sum. */
int gbg_bench_sum_make_once(void *user);

/* Error of the last sum on 1000 particles against double precision: over RMS, over the median. */
int gbg_bench_sum_error(struct gbg_bench_sum *sum, double *rms, double *median);

#endif
