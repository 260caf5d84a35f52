/* Benchmark: the tables of Carter (2016), his figures beside ours. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench/bench.h"
#include "bench/cases/all_pairs.h"
#include "bench/cases/suspension.h"
#include "gamboge/gamboge.h"

/* What an H200 has more than the K40c of the thesis, by data sheet: 66.9 against 4.29 Tflop/s in
 * single precision, 4800 against 288 GB/s. */
static const double arithmetic = 15.6, bandwidth = 16.7;

enum { CONFIGURATIONS = 5, RANGES = 2, RULES = 2 };
enum { LONG, SHORT, SUM, PACES }; /* ranges, then the sum over all pairs alone */
enum {
    TIMES = 5,
    MOST_STEPS = 20,
    LOOSENING = 8
}; /* 100 steps are timed, as in the thesis, where they fit into: */
static const double row_seconds = 2.5;
static const double longest_row = 60.0; /* rows that would take longer are left out */

/* Largest RMS(dF)/RMS(F) of mixed sums. F is the force that is left of all pairs: in C0 and C1 all
 * sources have one sign, and it is a fraction of that of one neighbour. */
static const double allowed = 1e-6;

/* bench/carter2016.csv */
static const char figures[] =
#include "carter2016_data.h"
    ;

/* Number in a column (from 0) of the line of a table for N; NAN: the thesis has none. */
static double figure(const char *table, int64_t n, int column)
{
    char begin[32];
    int length = snprintf(begin, sizeof begin, "\n%s,%lld,", table, (long long)n);
    const char *at = strstr(figures, begin);
    if (!at) {
        return NAN;
    }
    at += length;
    for (int k = 0; k < column; k++) {
        at += strcspn(at, ",\n");
        if (*at != ',') {
            return NAN;
        }
        at++;
    }
    /* an empty field must not be read as the number that begins the next line */
    return strchr(",\n", *at) ? NAN : strtod(at, NULL);
}

/* Scenes of the examples: carter_c0 .. carter_c4, long and short. */
#define LONG_RANGE 2.0, 0.0, 0.1
#define SHORT_RANGE 6.0, 2.5, 0.1
#define FOUR(name, ...)                                                                            \
    {name " long, bounce", __VA_ARGS__, LONG_RANGE, "bounce", GBG_BENCH_LATTICE},                  \
        {name " long, auto", __VA_ARGS__, LONG_RANGE, "auto", GBG_BENCH_LATTICE},                  \
        {name " short, bounce", __VA_ARGS__, SHORT_RANGE, "bounce", GBG_BENCH_LATTICE},            \
    {                                                                                              \
        name " short, auto", __VA_ARGS__, SHORT_RANGE, "auto", GBG_BENCH_LATTICE                   \
    }
static const struct gbg_bench_suspension settings[CONFIGURATIONS * RANGES * RULES] = {
    FOUR("C0", 0.79, 0.01, 0.7, {1, 1}, {1, -1}),    FOUR("C1", 0.52, 0.01, 0.5, {1, 1}, {1, -1}),
    FOUR("C2", 0.52, 0.01, 0.5, {1, -1}, {1, -2}),   FOUR("C3", 0.79, 0.01, 0.5, {-1, 1}, {1, -2}),
    FOUR("C4", 0.0873, 0.01, 0.5, {1, -1}, {1, -4}),
};

/* Time of the thesis on our card: the sum over all pairs by arithmetic, the rest by bandwidth. */
static double scaled(double ms, double all_pairs)
{
    double sum = fmin(ms, all_pairs);
    return sum / arithmetic + (ms - sum) / bandwidth;
}

static struct gbg_bench_published published(int configuration, int range, int64_t n)
{
    struct gbg_bench_published p = {.table = range == SHORT ? "6.4, 6.5" : "6.1, 6.2"};
    p.ms = figure(range == SHORT ? "6.4" : "6.1", n, configuration);
    p.rounds = figure(range == SHORT ? "6.5" : "6.2", n, configuration);
    p.scaled_ms = scaled(p.ms, range == SHORT ? 0.0 : figure("6.6", n, 0));
    return p;
}

/* What the rows before tell of the time of the next, so that a case ends. */
struct pace {
    double seconds[PACES]; /* the longest step so far */
    int64_t n[PACES];
};

/* Seconds that the 1 + 1 + TIMES steps of a row will take at least. */
static double expected(const struct pace *pace, int work, int64_t n)
{
    double ratio = pace->n[work] ? (double)n / (double)pace->n[work] : 0.0;
    return (2 + TIMES) * pace->seconds[work] * (work == SHORT ? ratio : ratio * ratio);
}

/* Steps to a timing, by those that are not counted: 20 if they fit into the time of a row. Some go
 * before, for under rule bounce the dense lattice of the start takes hundreds of rounds a step
 * until it has come loose. */
static int choose_steps(struct gbg_bench_steps *job, struct pace *pace, int range, int64_t n)
{
    struct gbg_bench_seconds one = {0};
    double spent = 0.0;
    int status = GBG_OK;
    job->steps = 1;
    for (int k = 0; k < LOOSENING && spent < row_seconds && status == GBG_OK; k++) {
        status = gbg_bench_time_exactly(gbg_bench_make_steps, job, 1, &one);
        spent += one.wall;
    }
    double fit = row_seconds / ((1 + TIMES) * fmax(one.wall, 1e-9));
    job->steps = (int64_t)fmin(fmax(fit, 1.0), MOST_STEPS);
    pace->seconds[range] = n == pace->n[range] ? fmax(one.wall, pace->seconds[range]) : one.wall;
    pace->n[range] = n;
    return status;
}

/* The error now, if it is the largest so far: it grows as a regular start is forgotten. */
static int measure_error(struct gbg_engine *engine, struct gbg_bench_result *line)
{
    double rms, median;
    int status = gbg_engine_force_error(engine, 1000, &rms, &median);
    if (status == GBG_OK && !isnan(line->error_rms) && !(rms <= line->error_rms)) {
        line->error_rms = rms;
        line->error_median = median;
    }
    return status;
}

/* Timings of an engine, errors before and after; the rounds are those of all steps from the start.
 */
static int time_steps(struct gbg_engine *engine, struct pace *pace, int range,
                      struct gbg_bench_result *line)
{
    struct gbg_bench_steps job = {engine, 1};
    int64_t rounds = 0, steps = 0;
    int status = choose_steps(&job, pace, range, line->n);
    status = status ? status : measure_error(engine, line);
    status = status ? status : gbg_bench_time_steps(&job, TIMES, line);
    status = status ? status : measure_error(engine, line);
    status = status ? status : gbg_engine_integer(engine, "contact_rounds", &rounds);
    status = status ? status : gbg_engine_integer(engine, "step", &steps);
    line->published.per = (double)job.steps;
    line->published.our_rounds = (double)rounds / (double)steps;
    line->work = (double)(line->n * job.steps);
    gbg_bench_extra(line, "steps", (double)steps);
    return status;
}

static int measure(struct gbg_bench *bench, int setting, int64_t n, struct pace *pace)
{
    const struct gbg_bench_suspension *s = &settings[setting];
    int range = setting / RULES % RANGES;
    struct gbg_engine *engine = NULL;
    struct gbg_bench_result line = {
        .what = s->what, .precision = "mixed", .unit = "particle-steps", .n = n};
    line.allowed = allowed;
    line.published = published(setting / (RULES * RANGES), range, n);
    int status = gbg_bench_suspend(bench->context, s, n, &engine);
    status = status ? status : time_steps(engine, pace, range, &line);
    status = status ? status : gbg_bench_check_cores(bench->context, engine, n);
    gbg_engine_destroy(&engine);
    return status ? gbg_bench_leave_out(bench, s->what, n, status) : gbg_bench_report(bench, &line);
}

static int is_too_long(const struct gbg_bench *bench, int work, int64_t n, const struct pace *pace)
{
    static const char *const name[PACES] = {"long range", "short range", "sum over all pairs"};
    double seconds = expected(pace, work, n);
    if (bench->options->n > 0 || seconds <= longest_row) {
        return 0;
    }
    printf("%s, N = %lld: left out, a line would take %.0f s or more; --n %lld asks for it\n",
           name[work], (long long)n, seconds, (long long)n);
    return 1;
}

/* One table pair, long (6.1, 6.2) or short range (6.4, 6.5), for one N. */
static int run_range(struct gbg_bench *bench, int range, int64_t n, struct pace *pace)
{
    int status = GBG_OK;
    if (is_too_long(bench, range, n, pace)) {
        return GBG_OK;
    }
    for (int k = 0; k < CONFIGURATIONS * RANGES * RULES && status == GBG_OK; k++) {
        if (k / RULES % RANGES == range && gbg_bench_wanted(bench, settings[k].what)) {
            status = measure(bench, k, n, pace);
        }
    }
    return status;
}

/* Table 6.6 beside our sum, and beside his two designs made anew. */
static const struct {
    const char *what;
    int design, column; /* of the table: shuffle, shared memory, CPU */
} sums[] = {
    {"his shuffle, made anew", GBG_BENCH_SHUFFLE, 0}, {"his tiles, made anew", GBG_BENCH_TILES, 1},
    {"our sum, his shuffle", GBG_BENCH_OURS, 0},      {"our sum, his tiles", GBG_BENCH_OURS, 1},
    {"our sum, his CPU", GBG_BENCH_OURS, 2},
};
enum { SUMS = sizeof sums / sizeof *sums };

/* One design, timed once for all its lines. The thesis's sums are all in single precision. */
static int time_design(struct gbg_bench *bench, struct gbg_bench_sum *sum, int design,
                       struct pace *pace)
{
    struct gbg_bench_result line = {
        .precision = "mixed", .unit = "pairs", .n = sum->state.owned, .published.per = 1.0};
    int status = GBG_OK, wanted = 0;
    for (int k = 0; k < SUMS; k++) {
        wanted |= sums[k].design == design && gbg_bench_wanted(bench, sums[k].what);
    }
    if (!wanted || !gbg_bench_sum_has(sum, design)) {
        return GBG_OK;
    }
    sum->design = design;
    line.work = (double)line.n * (double)(line.n - 1);
    line.precision = design == GBG_BENCH_OURS ? "mixed" : "single";
    line.allowed = design == GBG_BENCH_OURS ? allowed : 0.0;
    status = gbg_bench_time_exactly(gbg_bench_sum_make_once, sum, TIMES, &line.seconds);
    status = status ? status : gbg_bench_sum_error(sum, &line.error_rms, &line.error_median);
    if (design == GBG_BENCH_OURS) {
        pace->seconds[SUM] = line.seconds.wall;
        pace->n[SUM] = line.n;
    }
    for (int k = 0; k < SUMS && status == GBG_OK; k++) {
        double ms = figure("6.6", line.n, sums[k].column); /* his CPU ends at 131072 */
        int missing = isnan(ms) && !isnan(figure("6.6", line.n, 0));
        if (sums[k].design == design && !missing) {
            line.what = sums[k].what;
            line.published.table = "6.6";
            line.published.ms = ms;
            line.published.scaled_ms = sums[k].column < 2 ? line.published.ms / arithmetic : NAN;
            line.published.rounds = line.published.our_rounds = NAN;
            status = gbg_bench_report(bench, &line);
        }
    }
    return status;
}

static int run_sums(struct gbg_bench *bench, int64_t n, struct pace *pace)
{
    struct gbg_bench_sum sum;
    if (is_too_long(bench, SUM, n, pace)) {
        return GBG_OK;
    }
    int status = gbg_bench_sum_create(bench->context, n, &sum);
    if (status != GBG_OK) {
        return gbg_bench_leave_out(bench, "sum over all pairs", n, status);
    }
    for (int design = 0; design < GBG_BENCH_DESIGNS && status == GBG_OK; design++) {
        status = time_design(bench, &sum, design, pace);
    }
    gbg_bench_sum_destroy(&sum);
    return status ? gbg_bench_leave_out(bench, "sum over all pairs", n, status) : GBG_OK;
}

static int run(struct gbg_bench *bench)
{
    static const int64_t list[] = {1 << 10, 1 << 11, 1 << 12, 1 << 13, 1 << 14, 1 << 15,
                                   1 << 16, 1 << 17, 1 << 18, 1 << 19, 1 << 20, 0};
    int64_t size[16];
    int n_sizes = gbg_bench_sizes(bench, list, 1 << 10, size), status = GBG_OK;
    struct pace pace = {{0.0}, {0}};
    printf("scaled: the thesis's time on a K40c / %.1f (sum over all pairs) and / %.1f (the rest), "
           "which is what an H200 explains\n",
           arithmetic, bandwidth);
    /* Steps over all pairs of many particles take longest: last, in case time is up. */
    for (int k = 0; k < n_sizes && status == GBG_OK; k++) {
        status = run_range(bench, SHORT, size[k], &pace);
    }
    for (int k = 0; k < n_sizes && status == GBG_OK; k++) {
        status = run_sums(bench, size[k], &pace);
    }
    for (int k = 0; k < n_sizes && status == GBG_OK; k++) {
        status = run_range(bench, LONG, size[k], &pace);
    }
    return status;
}

const struct gbg_bench_case gbg_bench_carter2016 = {
    "carter2016", "tables 6.1, 6.2, 6.4, 6.5, 6.6 of Carter (2016), his figures beside ours", run};
