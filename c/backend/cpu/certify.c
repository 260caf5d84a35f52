/* L1, CPU: the certificate of a step: all pairs in reach are looked at, none is too close, none
 * passed through each other. It shares no code with the rules and rounds that moved the particles,
 * nor their coordinates, marks or bounds; it reads the pair list, having checked that it holds all
 * pairs in reach, and makes cells of its own where it does not. */
#include "backend/cpu/certify.h"

#include <math.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/exact.h"
#include "backend/cpu/list.h"

/* What one chunk found. */
struct finding {
    float moved[2]; /* squared, as the vector part gives them */
    int64_t count;
    struct gbg_pair lowest;
    char padding[64]; /* a line of its own */
};

struct search {
    struct gbg_device *device;
    struct gbg_exact exact;
    struct gbg_certify_work work;
    struct finding *finding; /* of each chunk */
    struct gbg_certificate *certificate;
};

static int lower(const struct gbg_pair *a, const struct gbg_pair *b)
{
    return b->first < 0 || a->first < b->first || (a->first == b->first && a->second < b->second);
}

/* Memory of the pass, from the device's workspace. */
static int reserve(struct search *search, int64_t n, const struct gbg_list *list)
{
    struct gbg_certify_work *work = &search->work;
    size_t row = 4 * ((size_t)(n + GBG_SLICE - 1) / GBG_SLICE * GBG_SLICE + 16);
    size_t rows = (size_t)list->dimension + !search->exact.one_size;
    size_t findings = (size_t)list->n_chunks * sizeof *search->finding;
    char *memory;
    int status = gbg_cpu_workspace(search->device, findings + rows * row, (void **)&memory);
    if (status == GBG_OK) {
        search->finding = (void *)memory;
        for (int a = 0; a < list->dimension; a++) {
            work->local[a] = (void *)(memory + findings + (size_t)a * row);
        }
        work->half = search->exact.one_size ? NULL : (void *)(memory + findings + (rows - 1) * row);
    }
    return status;
}

static void fill_halves(struct search *search, int64_t first, int64_t end)
{
    const struct gbg_state *state = search->work.state;
    float half[GBG_SPECIES_MAX];
    for (int s = 0; s < state->n_species; s++) {
        half[s] = gbg_certify_room(search->work.list->reach, 0.5 * state->diameter[s]);
    }
    for (int64_t i = first; i < end; i++) {
        search->work.half[i] = half[state->species ? state->species[i] : 0];
    }
}

/* Coordinates of the chunk's particles, and how far they moved. */
static void measure_chunk(struct search *search, int c)
{
    const struct gbg_list *list = search->work.list;
    int64_t first = list->chunk[c].first_slice * GBG_SLICE,
            end = list->chunk[c].end_slice * GBG_SLICE;
    end = end < list->n ? end : list->n;
    search->device->variant->certify_moves(&search->work, first, end, search->finding[c].moved);
    if (search->work.half) {
        fill_halves(search, first, end);
    }
}

static void note(struct finding *finding, int64_t i, int64_t j, double distance)
{
    struct gbg_pair pair = {i < j ? i : j, i < j ? j : i, distance};
    finding->count++;
    if (lower(&pair, &finding->lowest)) {
        finding->lowest = pair;
    }
}

/* The exact test of all listed pairs of the particles that the vector part names. */
static void look_at_chunk(struct search *search, int c)
{
    const struct gbg_list *list = search->work.list;
    const struct gbg_chunk *chunk = &list->chunk[c];
    struct finding *finding = &search->finding[c];
    finding->count = 0;
    finding->lowest = (struct gbg_pair){-1, -1, 0.0};
    for (int64_t slice = chunk->first_slice; slice < chunk->end_slice; slice++) {
        int32_t found[GBG_SLICE];
        const int32_t *index = chunk->index + list->offset[slice];
        int64_t n = search->device->variant->certify_screen(&search->work, slice, index, found);
        for (int64_t m = 0; m < n; m++) {
            const int32_t *row = index + found[m] % GBG_SLICE;
            for (int32_t k = 0; k < list->width[slice]; k++) {
                int32_t j = row[(int64_t)k * GBG_SLICE];
                if (j > found[m] && gbg_exact_overlap(&search->exact, found[m], j)) {
                    note(finding, found[m], j, gbg_exact_distance(&search->exact, found[m], j));
                }
            }
        }
    }
}

/* Adds what was found to the certificate. */
static void take(struct gbg_certificate *certificate, const struct finding *finding,
                 int64_t *counter)
{
    *counter += finding->count;
    if (finding->count > 0 && lower(&finding->lowest, &certificate->lowest)) {
        certificate->lowest = finding->lowest;
    }
}

/* Overlaps by cells of its own: for a list that cannot be shown to be complete. */
static int look_at_cells(struct search *search, const struct gbg_state *state)
{
    struct gbg_grid grid = {0};
    struct finding finding = {.lowest = {-1, -1, 0.0}};
    int status = gbg_grid_build(search->device->context, &grid, &state->box, search->exact.largest,
                                state->owned, state->high);
    for (int64_t i = 0; status == GBG_OK && i < state->owned; i++) {
        struct gbg_run runs[GBG_RUNS_MAX];
        int n_runs = gbg_grid_runs(&grid, grid.cell_of[i], runs);
        for (int r = 0; r < n_runs; r++) {
            for (int32_t slot = runs[r].begin; slot < runs[r].end; slot++) {
                int32_t j = grid.particle[slot];
                if (j > i && gbg_exact_overlap(&search->exact, i, j)) {
                    note(&finding, i, j, gbg_exact_distance(&search->exact, i, j));
                }
            }
        }
    }
    gbg_grid_release(&grid);
    take(search->certificate, &finding, &search->certificate->overlapping);
    return status;
}

static double largest_move(const struct gbg_state *state)
{
    double largest = 0.0;
    for (int64_t i = 0; i < state->owned; i++) {
        double squared = gbg_exact_moved_squared(state, i);
        largest = squared > largest ? squared : largest;
    }
    return sqrt(largest);
}

/* Pairs that passed through each other. One of the two moved farther than contact/sqrt(2)
 * (exact.h), and before the step the two were within contact/sqrt(2) and both moves. */
static int look_at_paths(struct search *search, const struct gbg_state *state)
{
    struct gbg_certificate *certificate = search->certificate;
    struct gbg_grid grid = {0};
    struct finding finding = {.lowest = {-1, -1, 0.0}};
    double fast = 0.7 * search->exact.least, reach;
    certificate->largest = largest_move(state);
    reach = search->exact.largest / sqrt(2.0) + 2.0 * certificate->largest;
    if (certificate->largest < fast) {
        return GBG_OK;
    }
    for (int a = 0; a < state->box.dimension; a++) {
        certificate->undecided |= reach > 0.5 * state->box.length[a];
    }
    if (certificate->undecided) {
        return GBG_OK;
    }
    int status = gbg_grid_build(search->device->context, &grid, &state->box, reach, state->owned,
                                state->start_high);
    for (int64_t i = 0; status == GBG_OK && i < state->owned; i++) {
        if (gbg_exact_moved_squared(state, i) < fast * fast) {
            continue;
        }
        struct gbg_run runs[GBG_RUNS_MAX];
        int n_runs = gbg_grid_runs(&grid, grid.cell_of[i], runs);
        for (int r = 0; r < n_runs; r++) {
            for (int32_t slot = runs[r].begin; slot < runs[r].end; slot++) {
                int32_t j = grid.particle[slot];
                double nearest;
                int seen_from_both = gbg_exact_moved_squared(state, j) >= fast * fast;
                if (j != i && !(seen_from_both && j < i) &&
                    gbg_exact_passed(&search->exact, i, j, &nearest) &&
                    !gbg_exact_overlap(&search->exact, i, j)) {
                    note(&finding, i, j, nearest);
                }
            }
        }
    }
    gbg_grid_release(&grid);
    take(certificate, &finding, &certificate->passed);
    return status;
}

int gbg_certify(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                struct gbg_certificate *certificate)
{
    struct search search = {.device = device, .certificate = certificate};
    double moved = 0.0, drifted = 0.0, error = 0.0;
    certificate->overlapping = certificate->passed = 0;
    certificate->listed = certificate->undecided = 0;
    certificate->largest = 0.0;
    certificate->lowest = (struct gbg_pair){-1, -1, 0.0};
    gbg_exact_make(state, certificate->tolerance, &search.exact);
    search.work.state = state;
    search.work.list = list;
    float edge = 2.0f * gbg_certify_room(list->reach, 0.5 * search.exact.largest);
    search.work.limit = edge * edge;
    int status = reserve(&search, state->owned, list);
    if (status != GBG_OK || state->owned == 0) {
        return status;
    }
#pragma omp parallel for num_threads(device->threads) schedule(static, 1)
    for (int c = 0; c < list->n_chunks; c++) {
        measure_chunk(&search, c);
    }
    for (int c = 0; c < list->n_chunks; c++) {
        moved = fmax(moved, sqrt((double)search.finding[c].moved[0]));
        drifted = fmax(drifted, sqrt((double)search.finding[c].moved[1]));
    }
    for (int a = 0; a < state->box.dimension; a++) {
        error += state->box.length[a] * 0x1p-31;
    }
    certificate->largest = moved;
    certificate->listed =
        list->builds > 0 && gbg_certify_complete(list->reach, list->radius, drifted, error);
    if (certificate->listed) {
#pragma omp parallel for num_threads(device->threads) schedule(static, 1)
        for (int c = 0; c < list->n_chunks; c++) {
            look_at_chunk(&search, c);
        }
        for (int c = 0; c < list->n_chunks; c++) {
            take(certificate, &search.finding[c], &certificate->overlapping);
        }
    } else {
        status = look_at_cells(&search, state);
    }
    if (status == GBG_OK && certificate->straight &&
        moved * (1.0 + 1e-6) + error >= 0.7 * search.exact.least) {
        status = look_at_paths(&search, state);
    }
    return status;
}
