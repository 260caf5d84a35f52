/* Benchmark: the searches of Green (2010) and of Perea and Cordero (2017) on a GPU. */
#ifndef GBG_BENCH_CASES_NEIGHBOURS_DEVICE_H
#define GBG_BENCH_CASES_NEIGHBOURS_DEVICE_H

#include <stdint.h>

struct gbg_bench;

/* 1 if the options leave one of the lines in. */
int gbg_bench_device_wanted(struct gbg_bench *bench, int dimension);

/* Lines of both on these points, as far as the backend has them: times between events on the
 * device, from coordinates there to rows there. */
int gbg_bench_published_on_device(struct gbg_bench *bench, int dimension, const double *length,
                                  double radius, int64_t n, double *const *position);

#endif
