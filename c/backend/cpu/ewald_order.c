/* L1, CPU: particles in the order of cells, for sums by a mesh: sorted in two passes, by groups of
 * cells and then in each group, so that threads share nothing but the counts of groups. */
#include <string.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/ewald.h"
#include "backend/cpu/grid.h"
#include "core/memory.h"

/* GRAIN: particles a worker at least. */
enum { GROUPS = 1024, WORKERS_MAX = 64, GRAIN = 4096, SHORT = 32 };

struct record {
    int32_t cell, index;
};

struct sorting {
    const struct gbg_state *state;
    struct gbg_ewald_order *order;
    int dimension, workers, group_shift, groups;
    int64_t n_cells;
    struct record *record;
    int32_t *cell_of;
    int32_t (*at)[GROUPS];     /* of a worker: counts, then where its next record of a group goes */
    int64_t begin[GROUPS + 1]; /* of groups */
    float single[GBG_SPECIES_MAX];
    double alpha[GBG_SPECIES_MAX]; /* over the largest */
};

/* Cells of an axis whose edge is at least reach/parts, which takes a unit of high words more. */
static double most_cells(const struct gbg_ewald_choice *choice, int a, int parts)
{
    double edge = choice->reach / parts * (1.0 + 1e-9) + choice->length[a] * 0x1p-31;
    double most = floor(choice->length[a] / edge);
    return most < 1.0 ? 1.0 : most;
}

static int64_t choose_cells(const struct gbg_ewald_choice *choice, int64_t n, int32_t cells[3])
{
    /* not many more cells than particles */
    double most = n < INT32_MAX / 2 - 64 ? 2.0 * (double)n + 64.0 : INT32_MAX - 1, product = 1.0;
    double wanted[3] = {1.0, 1.0, 1.0};
    for (int a = 0; a < choice->dimension; a++) {
        wanted[a] = most_cells(choice, a, a == 0 ? GBG_EWALD_PARTS : 1);
        product *= wanted[a];
    }
    while (product > most) {
        int longest = 0;
        for (int a = 1; a < choice->dimension; a++) {
            longest = wanted[a] > wanted[longest] ? a : longest;
        }
        product /= wanted[longest];
        wanted[longest] = ceil(wanted[longest] / 2.0);
        product *= wanted[longest];
    }
    for (int a = 0; a < 3; a++) {
        cells[a] = (int32_t)wanted[a];
    }
    return (int64_t)cells[0] * cells[1] * cells[2];
}

/* The bits of a coordinate that tell neighbours apart: two that stand in cells that are looked at
 * together, or one more reach apart, never look nearer than they are. */
static int spare_bits(const struct gbg_ewald_choice *choice, int a, int32_t cells, int32_t around)
{
    int spare = 0;
    double edge = choice->length[a] / cells, half = 0.5 * choice->length[a];
    double window = (around + 1) * edge + choice->reach * (1.0 + 1e-6);
    while (cells > 2 * around && spare < 32 && half > window) {
        half *= 0.5;
        spare++;
    }
    return spare;
}

/* How far to look; axes of one length have one unit. */
static void choose_window(const struct gbg_ewald_choice *choice, struct gbg_ewald_order *order)
{
    for (int a = 0; a < 3; a++) {
        order->around[a] = order->shift[a] = 0;
        if (a >= choice->dimension) {
            continue;
        }
        for (int k = GBG_EWALD_PARTS; k >= 1; k--) {
            order->around[a] = order->cells[a] <= most_cells(choice, a, k) ? k : order->around[a];
        }
        order->shift[a] = spare_bits(choice, a, order->cells[a], order->around[a]);
    }
    for (int k = 0; k < choice->dimension * choice->dimension; k++) {
        int a = k % choice->dimension, b = k / choice->dimension;
        if (choice->length[a] == choice->length[b] && order->shift[a] > order->shift[b]) {
            order->shift[a] = order->shift[b];
        }
    }
}

static int renew(struct gbg_device *device, void **pointer, int64_t count, size_t size,
                 const char *what)
{
    gbg_release(*pointer);
    *pointer = NULL;
    return gbg_cpu_scratch(device, pointer, count, size, what);
}

static int reserve_particles(struct gbg_device *device, const struct gbg_ewald_choice *choice,
                             int64_t n, struct gbg_ewald_order *order)
{
    order->capacity = 0;
    int status = renew(device, (void **)&order->index, n, sizeof *order->index, "sorted indices");
    for (int a = 0; status == GBG_OK && a < choice->dimension; a++) {
        uint32_t **second = choice->single ? &order->fine[a] : &order->low[a];
        status = renew(device, (void **)&order->high[a], n, 4, "sorted coordinates");
        status = status ? status : renew(device, (void **)second, n, 4, "sorted coordinates");
        status = status ? status : renew(device, (void **)&order->field[a], n, 8, "sorted fields");
    }
    if (status == GBG_OK && choice->single) {
        status = renew(device, (void **)&order->source, n, 4, "sorted sources");
    } else if (status == GBG_OK) {
        status = renew(device, (void **)&order->source_double, n, 8, "sorted sources");
    }
    order->capacity = status == GBG_OK ? n : 0;
    return status;
}

static int64_t scratch_bytes(int64_t n)
{
    return (n + 16) * (int64_t)(sizeof(struct record) + sizeof(int32_t)) +
           WORKERS_MAX * (int64_t)sizeof(int32_t[GROUPS]);
}

int gbg_ewald_order_reserve(struct gbg_device *device, const struct gbg_state *state,
                            const struct gbg_ewald_plan *plan, struct gbg_ewald_order *order)
{
    int64_t n = state->owned, n_cells = choose_cells(&plan->choice, n, order->cells);
    int status = GBG_OK;
    void *scratch;
    choose_window(&plan->choice, order);
    order->n = n;
    if (n_cells + 1 > order->cell_capacity) {
        order->cell_capacity = 0;
        status = renew(device, (void **)&order->begin, n_cells + 1, sizeof *order->begin,
                       "starts of cells");
        order->cell_capacity = status == GBG_OK ? n_cells + 1 : 0;
    }
    if (status == GBG_OK && (n > order->capacity || !order->index)) {
        status = reserve_particles(device, &plan->choice, n, order);
    }
    return status ? status : gbg_cpu_workspace(device, (size_t)scratch_bytes(n), &scratch);
}

void gbg_ewald_order_release(struct gbg_ewald_order *order)
{
    gbg_release(order->begin);
    gbg_release(order->index);
    gbg_release(order->source);
    gbg_release(order->source_double);
    for (int a = 0; a < 3; a++) {
        gbg_release(order->high[a]);
        gbg_release(order->low[a]);
        gbg_release(order->fine[a]);
        gbg_release(order->field[a]);
    }
    memset(order, 0, sizeof *order);
}

double gbg_ewald_order_bytes(const struct gbg_ewald_order *order)
{
    double each = 4.0 + (order->source ? 4.0 : 8.0);
    for (int a = 0; a < 3; a++) {
        each += order->high[a] ? 16.0 : 0.0;
    }
    return each * (double)order->capacity + 8.0 * (double)order->cell_capacity;
}

/* The largest |alpha|, and those of species over it. */
static void scale_sources(struct gbg_device *device, struct sorting *sorting)
{
    const struct gbg_state *state = sorting->state;
    double largest = 0.0;
    if (state->own_alpha) {
#pragma omp parallel for num_threads(sorting->workers) reduction(max : largest)
        for (int64_t i = 0; i < state->owned; i++) {
            double size = fabs(state->own_alpha[i]);
            largest = size > largest ? size : largest;
        }
    } else {
        for (int s = 0; s < state->n_species; s++) {
            largest = fmax(largest, fabs(state->alpha[s]));
        }
        for (int s = 0; s < state->n_species; s++) {
            sorting->alpha[s] = largest > 0.0 ? state->alpha[s] / largest : 0.0;
            sorting->single[s] = (float)sorting->alpha[s];
        }
    }
    sorting->order->largest = largest;
    sorting->order->uniform = !state->own_alpha;
    for (int s = 1; s < state->n_species; s++) {
        sorting->order->uniform &= state->alpha[s] == state->alpha[0];
    }
    (void)device;
}

static int64_t chunk_begin(const struct sorting *sorting, int worker)
{
    return sorting->state->owned * worker / sorting->workers;
}

/* Cells of the worker's particles, and how many are in each group. */
static void count_groups(const struct sorting *sorting, int worker)
{
    const struct gbg_ewald_order *order = sorting->order;
    const uint32_t *x = sorting->state->high[0], *y = sorting->state->high[1];
    const uint32_t *z = sorting->dimension == 3 ? sorting->state->high[2] : NULL;
    int32_t *count = sorting->at[worker], columns = order->cells[0], rows = order->cells[1];
    int64_t end = chunk_begin(sorting, worker + 1);
    memset(count, 0, sizeof sorting->at[worker]);
    for (int64_t i = chunk_begin(sorting, worker); i < end; i++) {
        int32_t cell = z ? gbg_grid_cell(z[i], order->cells[2]) * rows : 0;
        cell = (cell + gbg_grid_cell(y[i], rows)) * columns + gbg_grid_cell(x[i], columns);
        sorting->cell_of[i] = cell;
        count[cell >> sorting->group_shift]++;
    }
}

/* Where groups begin, and in them the records of each worker, so that they keep their order. */
static void place_groups(struct sorting *sorting)
{
    int32_t sum = 0;
    for (int g = 0; g < sorting->groups; g++) {
        sorting->begin[g] = sum;
        for (int w = 0; w < sorting->workers; w++) {
            int32_t count = sorting->at[w][g];
            sorting->at[w][g] = sum;
            sum += count;
        }
    }
    sorting->begin[sorting->groups] = sum;
    sorting->order->begin[sorting->n_cells] = sum;
}

static void scatter(const struct sorting *sorting, int worker)
{
    int32_t *at = sorting->at[worker];
    int64_t end = chunk_begin(sorting, worker + 1);
    for (int64_t i = chunk_begin(sorting, worker); i < end; i++) {
        int32_t cell = sorting->cell_of[i];
        sorting->record[at[cell >> sorting->group_shift]++] = (struct record){cell, (int32_t)i};
    }
}

/* Puts the largest rank of the heap index[root..n) at its root. */
static void sink(int32_t *index, int64_t root, int64_t n, const int32_t *rank)
{
    for (int64_t child; (child = 2 * root + 1) < n; root = child) {
        child += child + 1 < n && rank[index[child + 1]] > rank[index[child]];
        if (rank[index[child]] <= rank[index[root]]) {
            return;
        }
        int32_t swap = index[root];
        index[root] = index[child];
        index[child] = swap;
    }
}

static void sort_many(int32_t *index, int64_t n, const int32_t *rank)
{
    for (int64_t root = n / 2; root-- > 0;) {
        sink(index, root, n, rank);
    }
    for (int64_t left = n; left-- > 1;) {
        int32_t swap = index[0];
        index[0] = index[left];
        index[left] = swap;
        sink(index, 0, left, rank);
    }
}

static void sort_few(int32_t *index, int64_t n, const int32_t *rank)
{
    for (int64_t k = 1; k < n; k++) {
        int32_t own = index[k], key = rank[own];
        int64_t to = k;
        for (; to > 0 && rank[index[to - 1]] > key; to--) {
            index[to] = index[to - 1];
        }
        index[to] = own;
    }
}

/* Indices of a group in the order of cells, and where its cells begin. */
static void sort_group(const struct sorting *sorting, int group)
{
    int64_t *begin = sorting->order->begin, start = sorting->begin[group];
    int64_t first = (int64_t)group << sorting->group_shift;
    int64_t last = (int64_t)(group + 1) << sorting->group_shift;
    last = last < sorting->n_cells ? last : sorting->n_cells;
    memset(begin + first, 0, (size_t)(last - first) * sizeof *begin);
    for (int64_t k = start; k < sorting->begin[group + 1]; k++) {
        begin[sorting->record[k].cell]++;
    }
    for (int64_t cell = first; cell < last; cell++) {
        int64_t count = begin[cell];
        begin[cell] = start;
        start += count;
    }
    for (int64_t k = sorting->begin[group]; k < sorting->begin[group + 1]; k++) {
        sorting->order->index[begin[sorting->record[k].cell]++] = sorting->record[k].index;
    }
    for (int64_t cell = last - 1; cell > first; cell--) { /* ends have become starts */
        begin[cell] = begin[cell - 1];
    }
    begin[first] = sorting->begin[group];
}

static void order_ranks(const struct sorting *sorting, int group)
{
    const int64_t *begin = sorting->order->begin;
    const int32_t *rank = sorting->state->rank;
    int64_t first = (int64_t)group << sorting->group_shift;
    int64_t last = (int64_t)(group + 1) << sorting->group_shift;
    int64_t end = sorting->begin[group + 1];
    for (int64_t cell = first; cell < last && cell < sorting->n_cells; cell++) {
        /* the next group writes its starts at the same time */
        int64_t stop = cell + 1 < last && cell + 1 < sorting->n_cells ? begin[cell + 1] : end;
        int32_t *index = sorting->order->index + begin[cell];
        if (stop - begin[cell] <= SHORT) {
            sort_few(index, stop - begin[cell], rank);
        } else {
            sort_many(index, stop - begin[cell], rank);
        }
    }
}

static void copy_coordinates(const struct sorting *sorting, int a, int64_t first, int64_t end)
{
    struct gbg_ewald_order *order = sorting->order;
    const uint32_t *high = sorting->state->high[a], *low = sorting->state->low[a];
    const int32_t *index = order->index;
    if (order->low[a]) {
        for (int64_t k = first; k < end; k++) {
            order->high[a][k] = high[index[k]];
            order->low[a][k] = low[index[k]];
        }
    } else {
        int down = 32 - order->shift[a];
        for (int64_t k = first; k < end; k++) {
            int32_t i = index[k];
            order->high[a][k] = high[i];
            order->fine[a][k] = (uint32_t)(gbg_join(high[i], low[i]) >> down);
        }
    }
}

static void copy_sources(const struct sorting *sorting, int64_t first, int64_t end)
{
    struct gbg_ewald_order *order = sorting->order;
    const unsigned char *species = sorting->state->species;
    const double *own = sorting->state->own_alpha;
    double largest = order->largest > 0.0 ? order->largest : 1.0;
    for (int64_t k = first; k < end; k++) {
        int32_t i = order->index[k];
        int s = species ? species[i] : 0;
        if (order->source) {
            order->source[k] = own ? (float)(own[i] / largest) : sorting->single[s];
        } else {
            order->source_double[k] = own ? own[i] / largest : sorting->alpha[s];
        }
    }
}

static void sort_all(struct sorting *sorting)
{
#pragma omp parallel num_threads(sorting->workers)
    {
#pragma omp for schedule(static, 1)
        for (int w = 0; w < sorting->workers; w++) {
            count_groups(sorting, w);
        }
#pragma omp single
        place_groups(sorting);
#pragma omp for schedule(static, 1)
        for (int w = 0; w < sorting->workers; w++) {
            scatter(sorting, w);
        }
#pragma omp for schedule(dynamic)
        for (int g = 0; g < sorting->groups; g++) {
            int64_t first = sorting->begin[g], end = sorting->begin[g + 1];
            sort_group(sorting, g);
            if (sorting->state->rank) {
                order_ranks(sorting, g);
            }
            for (int a = 0; a < sorting->dimension; a++) {
                copy_coordinates(sorting, a, first, end);
            }
            copy_sources(sorting, first, end);
        }
    }
}

int gbg_ewald_sort(struct gbg_device *device, const struct gbg_state *state, struct gbg_ewald *sum)
{
    struct gbg_ewald_order *order = &sum->order;
    void *scratch;
    int status = gbg_ewald_order_reserve(device, state, &sum->plan, order);
    status =
        status ? status : gbg_cpu_workspace(device, (size_t)scratch_bytes(state->owned), &scratch);
    if (status != GBG_OK) {
        return status;
    }
    struct sorting sorting = {
        .state = state, .order = order, .dimension = state->box.dimension, .record = scratch};
    int64_t most = state->owned / GRAIN + 1;
    most = most < WORKERS_MAX ? most : WORKERS_MAX;
    sorting.workers = device->threads < most ? device->threads : (int)most;
    sorting.cell_of = (int32_t *)(sorting.record + state->owned + 8);
    sorting.at = (int32_t(*)[GROUPS])(sorting.cell_of + state->owned + 8);
    sorting.n_cells = (int64_t)order->cells[0] * order->cells[1] * order->cells[2];
    while ((sorting.n_cells - 1) >> sorting.group_shift >= GROUPS) {
        sorting.group_shift++;
    }
    sorting.groups = (int)((sorting.n_cells - 1) >> sorting.group_shift) + 1;
    scale_sources(device, &sorting);
    sort_all(&sorting);
    return GBG_OK;
}
