/* Benchmarks: runs a case, times it, prints the table and writes the figures. */
#include "bench/bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "bench/machine.h"
#include "core/context.h"
#include "core/file.h"
#include "core/memory.h"
#include "core/random.h"
#include "core/text.h"
#include "gamboge/context.h"

enum { LEAST_TIMES = 5, MOST_TIMES = 101 };

static const double ENOUGH_SECONDS = 0.5; /* of timing, once there are LEAST_TIMES */

static const struct gbg_bench_case *const cases[] = {
    &gbg_bench_direct,      &gbg_bench_neighbours,    &gbg_bench_noise,
    &gbg_bench_short_range, &gbg_bench_sizes_case,    &gbg_bench_structure_factor,
    &gbg_bench_carter2016,  &gbg_bench_contact_rules, &gbg_bench_contact_rules_open,
    &gbg_bench_long_range};

enum { CASES = sizeof cases / sizeof *cases };

static double now(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double gbg_bench_median(double *values, int n)
{
    qsort(values, (size_t)n, sizeof *values, ascending);
    return n > 0 ? values[n / 2] : 0.0;
}

/* The moment (gbg_bench_now) from which on no evaluation should begin; 0: never. Set once by
 * gbg_bench_main. */
static double ending;

/* 1 if another evaluation as long as the last would end after it. */
static int is_late(double last)
{
    return ending > 0.0 && gbg_bench_now() + last > ending;
}

static int time_between(int (*evaluate)(void *user), void *user, int least, int most,
                        struct gbg_bench_seconds *seconds)
{
    double wall[MOST_TIMES], core[MOST_TIMES], total = 0.0;
    int n = 0, status = evaluate(user);
    while (status == 0 && n < most && (n < least || total < ENOUGH_SECONDS)) {
        double wall_start = now(CLOCK_MONOTONIC), core_start = now(CLOCK_PROCESS_CPUTIME_ID);
        status = evaluate(user);
        core[n] = now(CLOCK_PROCESS_CPUTIME_ID) - core_start;
        wall[n] = now(CLOCK_MONOTONIC) - wall_start;
        total += wall[n++];
        if (is_late(wall[n - 1])) {
            break;
        }
    }
    seconds->wall = gbg_bench_median(wall, n);
    seconds->core = gbg_bench_median(core, n);
    seconds->mean = n > 0 ? total / n : 0.0;
    seconds->times = n;
    return status;
}

int gbg_bench_time(int (*evaluate)(void *user), void *user, struct gbg_bench_seconds *seconds)
{
    return time_between(evaluate, user, LEAST_TIMES, MOST_TIMES, seconds);
}

int gbg_bench_time_exactly(int (*evaluate)(void *user), void *user, int times,
                           struct gbg_bench_seconds *seconds)
{
    int n = times < MOST_TIMES ? times : MOST_TIMES;
    return time_between(evaluate, user, n, n, seconds);
}

double gbg_bench_now(void)
{
    return now(CLOCK_MONOTONIC);
}

void gbg_bench_extra(struct gbg_bench_result *line, const char *name, double value)
{
    int k = 0;
    while (k < GBG_BENCH_EXTRAS && line->extra[k].name) {
        k++;
    }
    if (k < GBG_BENCH_EXTRAS) {
        line->extra[k].name = name;
        line->extra[k].value = value;
    }
}

int gbg_bench_wanted(struct gbg_bench *bench, const char *what)
{
    const struct gbg_bench_options *o = bench->options;
    if (o->only && !strstr(what, o->only)) {
        return 0;
    }
    int late = is_late(0.0);
    bench->late += late;
    return !late;
}

int gbg_bench_leave_out(struct gbg_bench *bench, const char *what, int64_t n, int status)
{
    fflush(stdout);
    fprintf(stderr, "%s, N = %lld: %s\n", what, (long long)n, gbg_message(bench->context));
    bench->refused += status != GBG_E_MEMORY;
    bench->left_out++;
    return status == GBG_E_DEVICE || status == GBG_E_FILE ? status : GBG_OK;
}

int gbg_bench_sizes(const struct gbg_bench *bench, const int64_t *list, int64_t quick_most,
                    int64_t size[16])
{
    if (bench->options->n > 0) {
        size[0] = bench->options->n;
        return 1;
    }
    int n = 0;
    for (int k = 0; list[k] && n < 16; k++) {
        if (!bench->options->quick || list[k] <= quick_most) {
            size[n++] = list[k];
        }
    }
    return n;
}

int64_t gbg_bench_points(int dimension, const double *lengths, int lattice, int64_t n,
                         double *const *position)
{
    int64_t side = (int64_t)floor(pow((double)n, 1.0 / dimension) + 1e-9);
    if (lattice) {
        n = dimension == 2 ? side * side : side * side * side;
    }
    for (int64_t i = 0; i < n; i++) {
        struct gbg_philox w =
            gbg_philox(gbg_philox_counter(0, (uint64_t)i, GBG_STREAM_START), 1, 2);
        int64_t cell = i;
        for (int a = 0; a < dimension; a++) {
            double u = gbg_uniform(w.word[a], w.word[3]);
            double fraction = lattice ? ((double)(cell % side) + 0.6 * u) / (double)side : u;
            position[a][i] = lengths[a] * fraction;
            cell /= side;
        }
    }
    return n;
}

static void print_head(const struct gbg_bench *bench)
{
    const char *name, *instructions, *card = bench->context->card;
    int threads;
    struct gbg_machine machine;
    gbg_machine_look(&machine);
    gbg_context_backend(bench->context, &name, &instructions, &threads);
    printf("case %s, backend %s (%s), %d thread%s, commit %s\n%s%s%s, %d cores, load %.2f\n",
           bench->case_name, name, instructions, threads, threads == 1 ? "" : "s",
           gbg_machine_commit(), card, card[0] ? ", " : "", machine.model, machine.cores,
           machine.load);
}

static int is_too_large(const struct gbg_bench_result *line)
{
    return line->allowed > 0.0 && !(line->error_rms <= line->allowed);
}

/* Above the first line, which says what the columns are. */
static void print_columns(const struct gbg_bench_result *line)
{
    if (line->published.table) {
        printf("%-9s %-26s %8s %10s %10s %10s %10s %9s %9s %7s %7s\n", "table", "what", "N",
               "thesis ms", "scaled ms", "ours ms", "scaled/", "error/", "error/", "rounds",
               "rounds");
        printf("%-9s %-26s %8s %10s %10s %10s %10s %9s %9s %7s %7s\n", "", "", "", "", "", "",
               "ours", "RMS", "median", "thesis", "ours");
        return;
    }
    if (line->measured.quantity) {
        printf("%-18s %-8s %7s %-9s %-24s %12s %9s %9s %10s %10s\n", "what", "rule", "N", "dt",
               "quantity", "value", "+-", "expected", "rel. error", "core ns");
        return;
    }
    printf("%-26s %-9s %9s %11s %11s %12s %-15s %9s %12s\n", "what", "precision", "N", "seconds",
           "per second", "core ns each", "", "error/RMS", "error/median");
}

static void print_measured(const struct gbg_bench_result *line)
{
    const struct gbg_bench_measured *m = &line->measured;
    printf("%-18s %-8s %7lld %-9.4g %-24s %12.6g %9.1e", line->what, m->rule, (long long)line->n,
           m->dt, m->quantity, m->value, m->standard_error);
    if (isfinite(m->reference)) {
        printf(" %9.5g %+9.3f%%", m->reference, 100.0 * (m->value / m->reference - 1.0));
    } else {
        printf(" %9s %10s", "-", "-");
    }
    printf(" %10.4g\n", 1e9 * line->seconds.core / line->work);
}

/* A number that may be missing. */
static void print_cell(int width, const char *format, double value)
{
    char text[32] = "-";
    if (isfinite(value)) {
        snprintf(text, sizeof text, format, value);
    }
    printf(" %*s", width, text);
}

static double our_ms(const struct gbg_bench_result *line)
{
    return 1e3 * line->seconds.wall / line->published.per;
}

static void print_published(const struct gbg_bench_result *line)
{
    const struct gbg_bench_published *p = &line->published;
    printf("%-9s %-26s %8lld", p->table, line->what, (long long)line->n);
    print_cell(10, "%.4g", p->ms);
    print_cell(10, "%.4g", p->scaled_ms);
    print_cell(10, "%.4g", our_ms(line));
    print_cell(10, "%.3g", p->scaled_ms / our_ms(line));
    print_cell(9, "%.1e", line->error_rms);
    print_cell(9, "%.1e", line->error_median);
    print_cell(7, "%.2f", p->rounds);
    print_cell(7, "%.2f", p->our_rounds);
    printf("%s", is_too_large(line) ? "  TOO LARGE" : "");
}

static void print_extra(const struct gbg_bench_result *result)
{
    for (int k = 0; k < GBG_BENCH_EXTRAS && result->extra[k].name; k++) {
        printf("  %s %.3g", result->extra[k].name, result->extra[k].value);
    }
    printf("\n");
}

static void print_timed(const struct gbg_bench_result *result)
{
    printf("%-26s %-9s %9lld %11.4e %11.3e %12.4g %-15s %9.2e %12.2e%s", result->what,
           result->precision, (long long)result->n, result->seconds.wall,
           result->work / result->seconds.wall, 1e9 * result->seconds.core / result->work,
           result->unit, result->error_rms, result->error_median,
           is_too_large(result) ? "  TOO LARGE" : "");
    print_extra(result);
}

static void print_line(const struct gbg_bench_result *result)
{
    if (result->published.table) {
        print_published(result);
        print_extra(result);
    } else if (result->measured.quantity) {
        print_measured(result);
    } else {
        print_timed(result);
    }
    fflush(stdout);
}

/* Room for one more line. */
static int make_room(struct gbg_bench *bench)
{
    if (bench->n_results == bench->capacity) {
        int capacity = 2 * bench->capacity + 8;
        struct gbg_bench_result *more = realloc(bench->result, (size_t)capacity * sizeof *more);
        if (!more) {
            return GBG_E_MEMORY;
        }
        bench->result = more;
        bench->capacity = capacity;
    }
    return GBG_OK;
}

static void write_number(FILE *file, const char *key, double value)
{
    if (isfinite(value)) {
        fprintf(file, ", \"%s\": %.6g", key, value);
    } else {
        fprintf(file, ", \"%s\": null", key);
    }
}

static void write_measured(FILE *file, const struct gbg_bench_measured *m)
{
    if (m->quantity) {
        fprintf(file, ", \"rule\": \"%s\", \"quantity\": \"%s\"", m->rule, m->quantity);
        write_number(file, "dt", m->dt);
        write_number(file, "value", m->value);
        write_number(file, "standard_error", m->standard_error);
        write_number(file, "reference", m->reference);
    }
}

static void write_published(FILE *file, const struct gbg_bench_result *r)
{
    const struct gbg_bench_published *p = &r->published;
    if (p->table) {
        fprintf(file, ", \"table\": \"%s\"", p->table);
        write_number(file, "ms", our_ms(r));
        write_number(file, "thesis_ms", p->ms);
        write_number(file, "thesis_scaled_ms", p->scaled_ms);
        write_number(file, "thesis_over_ours", p->ms / our_ms(r));
        write_number(file, "scaled_over_ours", p->scaled_ms / our_ms(r));
        write_number(file, "rounds", p->our_rounds);
        write_number(file, "thesis_rounds", p->rounds);
    }
}

static void write_results(FILE *file, const struct gbg_bench *bench)
{
    const char *name, *instructions;
    int threads;
    struct gbg_machine machine;
    gbg_machine_look(&machine);
    gbg_context_backend(bench->context, &name, &instructions, &threads);
    fprintf(file, "[");
    for (int k = 0; k < bench->n_results; k++) {
        const struct gbg_bench_result *r = &bench->result[k];
        fprintf(
            file,
            "%s\n {\"case\": \"%s\", \"what\": \"%s\", \"n\": %lld, \"backend\": \"%s\", "
            "\"instructions\": \"%s\", \"threads\": %d, \"precision\": \"%s\", \"unit\": \"%s\"",
            k ? "," : "", bench->case_name, r->what, (long long)r->n, name, instructions, threads,
            r->precision, r->unit);
        write_number(file, "seconds", r->seconds.wall);
        write_number(file, "times", r->seconds.times > 0 ? r->seconds.times : NAN);
        write_number(file, "mean_seconds", r->seconds.mean > 0.0 ? r->seconds.mean : NAN);
        write_number(file, "core_seconds", r->seconds.core);
        write_number(file, "per_second", r->work / r->seconds.wall);
        write_number(file, "per_core_second", r->work / r->seconds.core);
        write_number(file, "error_over_rms", r->error_rms);
        write_number(file, "error_over_median", r->error_median);
        write_number(file, "allowed", r->allowed > 0.0 ? r->allowed : NAN);
        for (int x = 0; x < GBG_BENCH_EXTRAS && r->extra[x].name; x++) {
            write_number(file, r->extra[x].name, r->extra[x].value);
        }
        write_measured(file, &r->measured);
        write_published(file, r);
        fprintf(file,
                ", \"commit\": \"%s\", \"machine\": \"%s\", \"card\": \"%s\", \"cores\": %d, "
                "\"load\": %.2f}",
                gbg_machine_commit(), machine.model, bench->context->card, machine.cores,
                machine.load);
    }
    fprintf(file, "\n]\n");
}

static int write_file(const struct gbg_bench *bench)
{
    char temporary[4096];
    const char *path = bench->options->json;
    int status = gbg_file_temporary(bench->context, path, temporary, sizeof temporary);
    if (status != GBG_OK) {
        return status;
    }
    FILE *file = fopen(temporary, "w");
    if (file) {
        write_results(file, bench);
        int failed = ferror(file);
        failed |= fclose(file);
        if (!failed) {
            return gbg_file_commit(bench->context, temporary, path);
        }
    }
    gbg_file_abandon(temporary);
    fprintf(stderr, "gamboge bench: %s could not be written\n", path);
    return GBG_E_FILE;
}

int gbg_bench_report(struct gbg_bench *bench, const struct gbg_bench_result *result)
{
    const char *only = bench->options->only;
    if (only && !strstr(result->what, only)) { /* of a case that cannot leave it out before */
        return GBG_OK;
    }
    int status = make_room(bench);
    if (status != GBG_OK) {
        return status;
    }
    if (bench->n_results == 0) {
        print_columns(result);
    }
    bench->result[bench->n_results++] = *result;
    print_line(result);
    return bench->options->json ? write_file(bench) : GBG_OK;
}

static int list_cases(void)
{
    for (int k = 0; k < CASES; k++) {
        printf("%-16s %s\n", cases[k]->name, cases[k]->about);
    }
    return 0;
}

static const struct gbg_bench_case *find_case(const char *name)
{
    const char *names[CASES + 1] = {NULL};
    for (int k = 0; k < CASES; k++) {
        names[k] = cases[k]->name;
    }
    int found = gbg_text_find(name, names);
    if (found >= 0) {
        return cases[found];
    }
    fprintf(stderr, "gamboge bench: there is no case \"%s\"; the nearest is \"%s\"\n", name,
            gbg_text_nearest(name, names));
    return NULL;
}

static int open_context(const struct gbg_bench_options *options, struct gbg_context **context)
{
    char text[128];
    const char *backend = options->backend ? options->backend : "auto";
    int length = snprintf(text, sizeof text, "%s", backend);
    if (options->threads > 0 && length < (int)sizeof text) {
        length = snprintf(text, sizeof text, "%s%sthreads=%d", backend,
                          strchr(backend, ':') ? "," : ":", options->threads);
    }
    if (length >= (int)sizeof text || gbg_context_create(text, context) != GBG_OK) {
        fprintf(stderr, "gamboge bench: %s\n", gbg_message(NULL));
        return 0;
    }
    return 1;
}

static int too_large(const struct gbg_bench *bench)
{
    int n = 0;
    for (int k = 0; k < bench->n_results; k++) {
        const struct gbg_bench_result *r = &bench->result[k];
        n += is_too_large(r);
    }
    return n;
}

int gbg_bench_main(const struct gbg_bench_options *options)
{
    if (!options->name) {
        return list_cases();
    }
    const struct gbg_bench_case *chosen = find_case(options->name);
    struct gbg_bench bench = {.options = options, .case_name = options->name};
    double began = gbg_bench_now();
    if (!chosen || !open_context(options, &bench.context)) {
        return 2;
    }
    print_head(&bench);
    ending = options->seconds > 0.0 ? began + options->seconds : 0.0;
    int status = chosen->run(&bench);
    if (bench.late > 0) {
        printf("%g s are over: lines are missing\n", options->seconds);
    }
    if (status == GBG_OK && options->only && bench.n_results + bench.left_out + bench.late == 0) {
        fprintf(stderr, "gamboge bench: case %s has no line whose name holds \"%s\"\n",
                options->name, options->only);
        gbg_context_destroy(&bench.context);
        return 2;
    }
    if (status == GBG_OK && options->json && bench.n_results == 0) {
        status = write_file(&bench);
    }
    if (status != GBG_OK) {
        fprintf(stderr, "gamboge bench: %s\n", gbg_message(bench.context));
    }
    int failed = status != GBG_OK || bench.refused > 0 || too_large(&bench) > 0;
    free(bench.result);
    gbg_context_destroy(&bench.context);
    return failed;
}
