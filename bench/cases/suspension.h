/* Benchmark: suspensions in the plane that several cases run: an engine of them, and its checks. */
#ifndef GBG_BENCH_CASES_SUSPENSION_H
#define GBG_BENCH_CASES_SUSPENSION_H

#include <stdint.h>

struct gbg_bench_result;
struct gbg_context;
struct gbg_engine;

enum gbg_bench_start {
    GBG_BENCH_LATTICE, /* triangular, shifted by half the free gap; with vacancies by a twentieth */
    GBG_BENCH_SCATTERED /* by random insertion, so that memory and space begin apart */
};

/* Discs of diameter 1 that feel r/r^(power+1) and noise of T = 0.01. */
struct gbg_bench_suspension {
    const char *what;
    double packing, dt;
    double share; /* of the first species; 1: it is the only one */
    double alpha[2], mobility[2];
    double power, cutoff; /* cutoff 0: all pairs, nearest images */
    double vacancies; /* of the lattice; above 0: in a square box, as the scenes of Carter 2016 */
    const char *rule; /* of excluded volume; NULL: no hard cores */
    int start;        /* enum gbg_bench_start */
};

/* Scene S10: one species, r/r^7 cut at 2.5, packing 0.52, dt 0.001. */
#define GBG_BENCH_S10 0.52, 0.001, 1.0, {1}, {1}, 6.0, 2.5, 0.0

int gbg_bench_suspend(struct gbg_context *context, const struct gbg_bench_suspension *suspension,
                      int64_t n, struct gbg_engine **engine);

/* GBG_E_OVERLAP with a sentence if a pair of hard cores overlaps now, found by a search of its own
 * on the coordinates that the engine gives. */
int gbg_bench_check_cores(struct gbg_context *context, struct gbg_engine *engine, int64_t n);

/* What gbg_bench_time calls: `steps` steps of an engine. */
struct gbg_bench_steps {
    struct gbg_engine *engine;
    int64_t steps;
};
int gbg_bench_make_steps(void *user);

/* Times them (times 0: as gbg_bench_time) and says how many lists were built meanwhile. */
int gbg_bench_time_steps(struct gbg_bench_steps *job, int times, struct gbg_bench_result *line);

#endif
