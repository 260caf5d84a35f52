/* Benchmark: neighbour search; the two experiments of Perea and Cordero (2017) and the library. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "bench/bench.h"
#include "bench/cases/neighbours_device.h"
#include "bench/cases/neighbours_published.h"
#include "core/context.h"
#include "core/memory.h"
#include "gamboge/gamboge.h"

enum { SIZES = 8, EDGES = 3, ROOM_EACH = 4 };

/* Mean particles of a cell, by size and edge, of the paper's tables 1 (time per direction) and 2
 * (total time). The text says so; the captions call the same numbers mean neighbours, which cannot
 * be: at R = l/4 a cell with 31 particles has 2 of them within R. */
static const int64_t paper_sizes[] = {1000, 2000, 5000, 10000, 20000, 50000, 100000, 200000, 0};
static const double edges[EDGES] = {2.0, 2.52, 4.0};
static const double occupancy[2][EDGES][SIZES] = {
    {{10, 13, 17, 21, 30, 41, 50, 62},
     {15, 21, 31, 43, 57, 69, 78, 83},
     {26, 31, 45, 56, 65, 74, 81, 96}},
    {{12, 13, 19, 24, 31, 44, 53, 66},
     {18, 25, 36, 48, 61, 71, 79, 90},
     {31, 40, 51, 59, 68, 77, 89, 115}},
};

/* A set of points and what a search of them is checked against. */
struct set {
    struct gbg_context *context;
    int dimension;
    int64_t n, capacity;
    double length[3], radius, per_cell;
    double *position[3];
    int64_t *offset;
    int32_t *neighbour;
    uint64_t digest;
    int has_device_time; /* 1: the backend tells the time of the device apart */
    int64_t rows;        /* neighbours of all */
};

/* Times of the parts of each call, the first left out: to find the pairs from the caller's
 * coordinates, without the way to the GPU if that is told apart, and to hand the rows over. */
enum { UPDATE, DEVICE, ROWS, PARTS, MOST_CALLS = 128 };
struct job {
    struct set *set;
    struct gbg_neighbours *neighbours;
    int calls;
    double part[PARTS][MOST_CALLS];
};

static int search(void *user)
{
    struct job *job = user;
    struct set *set = job->set;
    double start = gbg_bench_now(), found, device = NAN;
    int status = gbg_neighbours_update(job->neighbours, set->n, set->position[0], set->position[1],
                                       set->position[2], 1, NULL);
    found = gbg_bench_now();
    status = status ? status
                    : gbg_neighbours_csr(job->neighbours, 0, set->n + 1, set->offset, set->capacity,
                                         set->neighbour);
    int k = job->calls++ - 1;
    if (status == GBG_OK && k >= 0 && k < MOST_CALLS) {
        double times[PARTS] = {found - start, 0.0, gbg_bench_now() - found};
        if (set->has_device_time) {
            status = gbg_neighbours_statistic(job->neighbours, "device_seconds", &device);
        }
        times[DEVICE] = device;
        for (int p = 0; p < PARTS; p++) {
            job->part[p][k] = times[p];
        }
    }
    return status;
}

/* Median of a part in milliseconds. */
static double part_ms(struct job *job, int part)
{
    int n = job->calls - 1 < MOST_CALLS ? job->calls - 1 : MOST_CALLS;
    return 1e3 * gbg_bench_median(job->part[part], n);
}

/* A number that two different results share by chance once in 2^64: rows of a set of 2^26 are too
 * long for a cryptographic one. */
static uint64_t stir(uint64_t hash, const void *data, size_t bytes)
{
    const unsigned char *from = data;
    for (size_t at = 0; at < bytes; at += 8) {
        uint64_t word = 0;
        memcpy(&word, from + at, bytes - at < 8 ? bytes - at : 8);
        hash = (hash ^ word) * UINT64_C(0x9E3779B97F4A7C15);
        hash ^= hash >> 29;
    }
    return hash;
}

static uint64_t digest_of(const struct set *set)
{
    uint64_t hash = stir(1, set->offset, (size_t)(set->n + 1) * sizeof *set->offset);
    return stir(hash, set->neighbour, (size_t)set->offset[set->n] * sizeof *set->neighbour);
}

static void release(struct set *set)
{
    for (int a = 0; a < 3; a++) {
        gbg_release(set->position[a]);
    }
    gbg_release(set->offset);
    gbg_release(set->neighbour);
}

static int reserve(struct set *set, double neighbours_each)
{
    int status = GBG_OK;
    set->capacity = (int64_t)((double)set->n * (1.3 * neighbours_each + 8.0)) + 1024;
    for (int a = 0; a < set->dimension && status == GBG_OK; a++) {
        status = gbg_allocate(set->context, (void **)&set->position[a], set->n, 8, "points");
    }
    status = status ? status
                    : gbg_allocate(set->context, (void **)&set->offset, set->n + 1, 8, "offsets");
    return status ? status
                  : gbg_allocate(set->context, (void **)&set->neighbour, set->capacity, 4, "rows");
}

/* The pairs by brute force (small sets) or by the grid. */
static int find_reference(struct set *set)
{
    struct job job = {.set = set};
    int status = gbg_neighbours_create(set->context, set->dimension, set->length, set->radius,
                                       set->n <= 10000 ? "brute" : "grid", 0.0, &job.neighbours);
    status = status ? status : search(&job);
    if (status == GBG_OK) {
        set->rows = set->offset[set->n];
        set->digest = digest_of(set);
    }
    gbg_neighbours_destroy(&job.neighbours);
    return status;
}

static void describe(const struct set *set, double candidates, double found,
                     struct gbg_bench_result *result)
{
    gbg_bench_extra(result, "candidates per neighbour", candidates / found);
    gbg_bench_extra(result, "neighbours", found / (double)set->n);
    if (set->per_cell > 0.0) {
        gbg_bench_extra(result, "per cell", set->per_cell);
    }
}

/* Whether a device tells its time is known after a first update. */
static int look_for_device_time(struct job *job)
{
    double seconds;
    job->set->has_device_time =
        gbg_neighbours_statistic(job->neighbours, "device_seconds", &seconds) == GBG_OK &&
        seconds > 0.0;
    return GBG_OK;
}

/* One method of the library: checked, then timed with the copying of rows to the caller. */
static int time_method(struct gbg_bench *bench, struct set *set, const char *what,
                       const char *method, double skin)
{
    struct job job = {.set = set};
    if (!gbg_bench_wanted(bench, what)) {
        return GBG_OK;
    }
    struct gbg_bench_result result = {.what = what,
                                      .precision = "exact",
                                      .unit = "particles",
                                      .n = set->n,
                                      .work = (double)set->n,
                                      .error_median = NAN,
                                      .allowed = 1e-300};
    double candidates = 0.0;
    int status = gbg_neighbours_create(set->context, set->dimension, set->length, set->radius,
                                       method, skin, &job.neighbours);
    status = status ? status : search(&job);
    if (status == GBG_OK) {
        result.error_rms = digest_of(set) == set->digest ? 0.0 : 1.0;
        status = gbg_neighbours_statistic(job.neighbours, "candidates", &candidates);
    }
    status = status ? status : look_for_device_time(&job);
    job.calls = 0; /* that was one to check */
    status = status ? status : gbg_bench_time(search, &job, &result.seconds);
    gbg_neighbours_destroy(&job.neighbours);
    describe(set, candidates, (double)set->rows, &result);
    gbg_bench_extra(&result, "update ms", part_ms(&job, UPDATE));
    gbg_bench_extra(&result, "rows ms", part_ms(&job, ROWS));
    if (set->has_device_time) {
        gbg_bench_extra(&result, "device ms", part_ms(&job, DEVICE));
    }
    return status ? gbg_bench_leave_out(bench, what, set->n, status)
                  : gbg_bench_report(bench, &result);
}

struct published_job {
    struct gbg_published *search;
    int stage;
};

static int search_published(void *user)
{
    struct published_job *job = user;
    gbg_published_search(job->search, job->stage);
    return GBG_OK;
}

/* One of the paper's searches in plain C; a part of the cells has no pairs to compare. */
static int time_published(struct gbg_bench *bench, struct set *set, struct gbg_published *published,
                          const char *what, int stage)
{
    if (!gbg_bench_wanted(bench, what)) {
        return GBG_OK;
    }
    struct published_job job = {published, stage};
    struct gbg_bench_result result = {.what = what,
                                      .precision = "double",
                                      .unit = "particles",
                                      .n = set->n,
                                      .work = (double)set->n,
                                      .error_rms = NAN,
                                      .error_median = NAN};
    search_published(&job);
    if (stage == GBG_PUBLISHED_OCTANT || stage == GBG_PUBLISHED_ALL) {
        result.error_rms = fabs((double)(published->found - set->rows)) / (double)set->rows;
        result.allowed = 1e-9; /* doubles at the very edge of the radius */
    }
    int status = gbg_bench_time(search_published, &job, &result.seconds);
    describe(set, (double)published->looked, (double)published->found, &result);
    return status ? status : gbg_bench_report(bench, &result);
}

/* Box of whole cells of edge 1, as near to a cube and to so many particles each as there is one. */
static int make_paper_set(struct set *set, double edge, double wanted, int cells[3])
{
    int least = (int)fmax(3.0, floor(cbrt((double)set->n / wanted)));
    double best = INFINITY;
    set->dimension = 3;
    set->radius = (1.0 - 1e-6) / edge;
    for (int k = 0; k < 27; k++) {
        int side[3] = {least + k % 3, least + k / 3 % 3, least + k / 9};
        double each = (double)set->n / ((double)side[0] * side[1] * side[2]);
        if (fabs(log(each / wanted)) < best) {
            best = fabs(log(each / wanted));
            set->per_cell = each;
            memcpy(cells, side, sizeof side);
        }
    }
    for (int a = 0; a < 3; a++) {
        set->length[a] = cells[a];
    }
    int status = reserve(set, set->per_cell * 4.19 * pow(set->radius, 3.0));
    if (status == GBG_OK) {
        gbg_bench_points(3, set->length, 0, set->n, set->position);
        status = find_reference(set);
    }
    return status;
}

/* The searches in plain C are for comparison on the same processor. */
static int on_host(const struct gbg_bench *bench)
{
    return strcmp(bench->context->backend, "cuda") != 0;
}

static int any_wanted(struct gbg_bench *bench, const char *const *names, int n)
{
    int wanted = 0;
    for (int k = 0; k < n; k++) {
        wanted |= gbg_bench_wanted(bench, names[k]);
    }
    return wanted;
}

/* Experiment 1: the containing cell, then the neighbour cells axis after axis. Experiment 2: all 27
 * cells (Green 2010) against the 8 of an octant, and the library on the same points. */
static int run_experiment(struct gbg_bench *bench, int experiment, int e, int64_t n, double wanted)
{
    static const char *const names[EDGES][9] = {
        {"1: l=2R own cell", "1: l=2R and x", "1: l=2R and y", "1: l=2R and z", "2: l=2R 27 cells",
         "2: l=2R 8 cells", "library l=2R octant", "library l=2R grid2", "library l=2R auto"},
        {"1: l=2.52R own cell", "1: l=2.52R and x", "1: l=2.52R and y", "1: l=2.52R and z",
         "2: l=2.52R 27 cells", "2: l=2.52R 8 cells", "library l=2.52R octant",
         "library l=2.52R grid", "library l=2.52R auto"},
        {"1: l=4R own cell", "1: l=4R and x", "1: l=4R and y", "1: l=4R and z", "2: l=4R 27 cells",
         "2: l=4R 8 cells", "library l=4R octant", "library l=4R grid", "library l=4R auto"}};
    static const char *const octants[EDGES] = {"octant:2", "octant:2.52", "octant:4"};
    static const char *const grids[EDGES] = {"grid:2", "grid:2.52", "grid:4"};
    struct set set = {.context = bench->context, .n = n};
    struct gbg_published *published = NULL;
    int cells[3];
    int first = experiment == 0 ? 0 : on_host(bench) ? 4 : 6;
    int last = experiment == 0 ? (on_host(bench) ? 3 : -1) : 8;
    if (!any_wanted(bench, &names[e][first], last - first + 1)) {
        return GBG_OK;
    }
    int status = make_paper_set(&set, edges[e], wanted, cells);
    if (status == GBG_OK && on_host(bench)) {
        status = gbg_published_create(set.context, n, set.length, cells, set.radius, set.position,
                                      set.capacity, &published);
    }
    for (int s = 0; s <= GBG_PUBLISHED_OCTANT && status == GBG_OK && experiment == 0; s++) {
        status = time_published(bench, &set, published, names[e][s], s);
    }
    if (status == GBG_OK && experiment == 1 && published) {
        status = time_published(bench, &set, published, names[e][4], GBG_PUBLISHED_ALL);
        status = status ? status
                        : time_published(bench, &set, published, names[e][5], GBG_PUBLISHED_OCTANT);
    }
    if (status == GBG_OK && experiment == 1) {
        status = time_method(bench, &set, names[e][6], octants[e], 0.0);
        status = status ? status : time_method(bench, &set, names[e][7], grids[e], 0.0);
        status = status ? status : time_method(bench, &set, names[e][8], "auto", 0.0);
    }
    gbg_published_destroy(published);
    release(&set);
    return status;
}

struct method {
    const char *what[2], *name;
    double skin; /* radii */
};
static const struct method methods[] = {
    {{"2D grid R", "3D grid R"}, "grid", 0.0},
    {{"2D grid 1.5R", "3D grid 1.5R"}, "grid:1.5", 0.0},
    {{"2D grid 2R", "3D grid 2R"}, "grid2", 0.0},
    {{"2D half R/2", "3D half R/2"}, "half", 0.0},
    {{"2D octant 2R", "3D octant 2R"}, "octant", 0.0},
    {{"2D octant 2.52R", "3D octant 2.52R"}, "octant:2.52", 0.0},
    {{"2D octant 4R", "3D octant 4R"}, "octant:4", 0.0},
    {{"2D auto", "3D auto"}, "auto", 0.0},
    {{"2D verlet 0.2R, kept", "3D verlet 0.2R, kept"}, "verlet", 0.2},
};
enum { METHODS = sizeof methods / sizeof *methods };

static int any_method_wanted(struct gbg_bench *bench, int dimension)
{
    int wanted = 0;
    for (int k = 0; k < METHODS; k++) {
        wanted |= any_wanted(bench, &methods[k].what[dimension - 2], 1);
    }
    return wanted | (!on_host(bench) && gbg_bench_device_wanted(bench, dimension));
}

/* Uniform points of density 1 with so many neighbours each. */
static int run_uniform(struct gbg_bench *bench, int dimension, int64_t n, double neighbours)
{
    struct set set = {.context = bench->context, .dimension = dimension, .n = n};
    if (!any_method_wanted(bench, dimension)) {
        return GBG_OK;
    }
    for (int a = 0; a < dimension; a++) {
        set.length[a] = pow((double)n, 1.0 / dimension);
    }
    set.radius = dimension == 2 ? sqrt(neighbours / 3.14159265) : cbrt(neighbours / 4.18879);
    int status = reserve(&set, neighbours);
    if (status == GBG_OK) {
        gbg_bench_points(dimension, set.length, 0, n, set.position);
        status = find_reference(&set);
    }
    if (status != GBG_OK) {
        status =
            gbg_bench_leave_out(bench, dimension == 2 ? "2D uniform" : "3D uniform", n, status);
        release(&set);
        return status;
    }
    for (int k = 0; k < METHODS && status == GBG_OK; k++) {
        status = time_method(bench, &set, methods[k].what[dimension - 2], methods[k].name,
                             methods[k].skin * set.radius);
    }
    if (status == GBG_OK && !on_host(bench)) {
        status = gbg_bench_published_on_device(bench, dimension, set.length, set.radius, n,
                                               set.position);
        status = status ? gbg_bench_leave_out(bench, "device", n, status) : GBG_OK;
    }
    release(&set);
    return status;
}

/* Contacts: a lattice of spacing 1 that is a little disturbed, so that no two are closer than 0.8.
 */
static int run_contacts(struct gbg_bench *bench, int dimension, int64_t n)
{
    static const char *const what[2][3] = {
        {"2D contacts occupancy", "2D contacts grid R", "2D contacts auto"},
        {"3D contacts occupancy", "3D contacts grid R", "3D contacts auto"}};
    if (!any_wanted(bench, what[dimension - 2], 3)) {
        return GBG_OK;
    }
    struct set set = {.context = bench->context, .dimension = dimension, .n = n, .radius = 1.0};
    int status = reserve(&set, 8.0);
    if (status == GBG_OK) {
        double side = floor(pow((double)n, 1.0 / dimension) + 1e-9);
        for (int a = 0; a < dimension; a++) {
            set.length[a] = side;
        }
        set.n = gbg_bench_points(dimension, set.length, 1, n, set.position);
        for (int a = 0; a < dimension; a++) { /* a third of the jitter that the call makes, 0.6 */
            for (int64_t i = 0; i < set.n; i++) {
                double site = floor(set.position[a][i]);
                set.position[a][i] = site + (set.position[a][i] - site) / 3.0;
            }
        }
        status = find_reference(&set);
    }
    status = status ? status : time_method(bench, &set, what[dimension - 2][0], "occupancy:0.8", 0);
    status = status ? status : time_method(bench, &set, what[dimension - 2][1], "grid", 0.0);
    status = status ? status : time_method(bench, &set, what[dimension - 2][2], "auto", 0.0);
    release(&set);
    return status;
}

/* The measurement behind the choice of auto: N = 20 000, from few neighbours to many. */
static int run_densities(struct gbg_bench *bench)
{
    static const double neighbours[] = {0.5, 2.0, 5.0, 10.0, 30.0, 60.0, 120.0};
    int status = GBG_OK;
    for (int dimension = 2; dimension <= 3; dimension++) {
        for (size_t k = 0; k < sizeof neighbours / sizeof *neighbours && status == GBG_OK; k++) {
            status = run_uniform(bench, dimension, 20000, neighbours[k]);
        }
    }
    return status;
}

static int run(struct gbg_bench *bench)
{
    static const int64_t large[] = {1 << 12, 1 << 16, 1 << 20, 0};
    static const int64_t on_device[] = {1 << 12, 1 << 16, 1 << 20, 1 << 22, 1 << 24, 1 << 26, 0};
    int64_t size[16];
    int status = GBG_OK, quick = bench->options->quick;
    int n_sizes = gbg_bench_sizes(bench, paper_sizes, 1000, size);
    for (int experiment = 0; experiment < 2; experiment++) {
        for (int k = 0; k < n_sizes; k++) {
            int column = 0;
            while (column < SIZES - 1 && paper_sizes[column] < size[k]) {
                column++;
            }
            for (int e = 0; e < (quick ? 1 : EDGES) && status == GBG_OK; e++) {
                status =
                    run_experiment(bench, experiment, e, size[k], occupancy[experiment][e][column]);
            }
        }
    }
    n_sizes = gbg_bench_sizes(bench, on_host(bench) ? large : on_device, 1 << 12, size);
    for (int k = 0; k < n_sizes && status == GBG_OK; k++) {
        status = run_uniform(bench, 2, size[k], 10.0);
        status = status ? status : run_uniform(bench, 3, size[k], 30.0);
        status = status ? status : run_contacts(bench, 2, size[k]);
        status = status ? status : run_contacts(bench, 3, size[k]);
    }
    return status || quick || bench->options->n > 0 ? status : run_densities(bench);
}

const struct gbg_bench_case gbg_bench_neighbours = {
    "neighbours", "all pairs within a radius: Perea and Cordero 2017 in plain C, and the library",
    run};
