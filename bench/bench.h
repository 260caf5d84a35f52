/* Benchmarks: the options of a run, and what its cases use to time and to report. */
#ifndef GBG_BENCH_BENCH_H
#define GBG_BENCH_BENCH_H

#include <stdint.h>

struct gbg_context;

struct gbg_bench_options {
    const char *name;    /* of the case; NULL: list them */
    const char *backend; /* as for gbg_context_create, without threads; NULL: auto */
    const char *json;    /* file that receives each line as it is measured; NULL: none */
    int64_t n;           /* particles; 0: the sizes of the case */
    int threads;         /* 0: as many as there are */
    int quick;           /* 1: small sizes, a few seconds in all */
    const char *only;    /* lines whose names hold this text alone; NULL: all */
    double seconds;      /* no line begins later, lines that are slow then have fewer timings; 0: no
                            limit */
};

/* Runs a case, prints its table, writes the file. Exit status: 0 done, 1 it failed (an error that
 * is too large counts), 2 bad use. */
int gbg_bench_main(const struct gbg_bench_options *options);

/* What a case sees. */
struct gbg_bench {
    const struct gbg_bench_options *options;
    const char *case_name;
    struct gbg_context *context;
    struct gbg_bench_result *result;
    int n_results, capacity;
    int late;              /* lines that would have begun after the time was up */
    int refused, left_out; /* lines that failed, and all that are missing, while the case went on */
};

/* Medians of one evaluation: on the clock, and summed over the cores that worked. On a machine that
 * others use too, the second tells more about the code. The mean holds what happens in few of the
 * evaluations only, as new lists do; 0: not known. */
struct gbg_bench_seconds {
    double wall, core, mean;
    int times; /* evaluations they are of */
};

/* A quantity of physics that a line reports besides its time: the rule and the step it was measured
 * with, its standard error, and what it should be (NAN: not known). Texts in static storage. */
struct gbg_bench_measured {
    const char *rule, *quantity; /* NULL: the line has no such thing */
    double dt, value, standard_error, reference;
};

/* Figures of an earlier work that stand beside ours: milliseconds as they were published, those
 * that the same work would take if only the hardware were ours, and rounds of overlap correction a
 * step. NAN: there is none. */
struct gbg_bench_published {
    const char *table; /* NULL: the line has no such figures */
    double ms, scaled_ms, rounds, our_rounds;
    double per; /* evaluations of ours in `seconds`, as steps */
};

enum { GBG_BENCH_EXTRAS = 6 };

/* One line of the table. Units are short words: "pairs", "deviates", "particle-steps". */
struct gbg_bench_result {
    const char *what;      /* variant within the case, e.g. "2D power 2"; static storage */
    const char *precision; /* "mixed", "double"; static storage */
    const char *unit;
    int64_t n;
    double work;                      /* units done in one evaluation */
    struct gbg_bench_seconds seconds; /* filled in by gbg_bench_time */
    double error_rms, error_median; /* RMS error over RMS and over median size; NAN: not measured */
    double allowed;                 /* largest error_rms that the case accepts; 0: no limit */
    /* Further columns, printed after the row and written to the file; static storage, NULL: none.
     */
    struct {
        const char *name;
        double value;
    } extra[GBG_BENCH_EXTRAS];
    struct gbg_bench_measured measured;
    struct gbg_bench_published published;
};

struct gbg_bench_case {
    const char *name, *about;
    /* 0, or a status when a call failed (the harness prints the context's message). */
    int (*run)(struct gbg_bench *bench);
};

/* Median times of at least 5 evaluations (more while they are short) after one to warm up; of
 * fewer, but one, where the time that the options leave is over. */
int gbg_bench_time(int (*evaluate)(void *user), void *user, struct gbg_bench_seconds *seconds);
/* The same of so many evaluations, at most 101, for what changes as it is repeated. */
int gbg_bench_time_exactly(int (*evaluate)(void *user), void *user, int times,
                           struct gbg_bench_seconds *seconds);

/* 1 if the options leave this line in: its name, and the time that is left. */
int gbg_bench_wanted(struct gbg_bench *bench, const char *what);

/* Says on the screen why a line is missing, with the library's sentence. GBG_OK, so that the case
 * goes on, unless the device is lost or the file of figures cannot be written; then the status. A
 * line that failed other than for lack of memory makes the case fail in the end. */
int gbg_bench_leave_out(struct gbg_bench *bench, const char *what, int64_t n, int status);

/* Adds a column to a line, if there is room; name in static storage. */
void gbg_bench_extra(struct gbg_bench_result *line, const char *name, double value);

/* Of n values, which are sorted; 0 of none. */
double gbg_bench_median(double *values, int n);

/* Seconds of a clock that only goes forward. */
double gbg_bench_now(void);

/* Adds a line to the table, prints it and writes the file anew: it holds every line so far, and is
 * whole at every moment. */
int gbg_bench_report(struct gbg_bench *bench, const struct gbg_bench_result *result);

/* Sizes of a case: those of the option n alone, or the list (ended by 0), of which `quick` keeps
 * those up to quick_most. Returns the number of sizes put into size (at most 16). */
int gbg_bench_sizes(const struct gbg_bench *bench, const int64_t *list, int64_t quick_most,
                    int64_t size[16]);

/* Coordinates for cases: n points (blocked: position[axis]) in a box of the given lengths, made
 * from the library's random numbers. lattice 0: uniform; 1: a square (cubic) lattice, each point
 * moved by up to 0.3 of the spacing on each axis (n is then the nearest power at or below). */
int64_t gbg_bench_points(int dimension, const double *lengths, int lattice, int64_t n,
                         double *const *position);

/* The cases (bench/cases). */
extern const struct gbg_bench_case gbg_bench_direct, gbg_bench_neighbours, gbg_bench_noise,
    gbg_bench_short_range, gbg_bench_sizes_case, gbg_bench_structure_factor, gbg_bench_carter2016,
    gbg_bench_contact_rules, gbg_bench_contact_rules_open, gbg_bench_long_range;

#endif
