/* L1, CUDA: the certificate of a step: all pairs in reach are looked at, none is too close, none
 * passed through each other. It shares no code with the rules and rounds that moved the particles,
 * nor their coordinates, marks or bounds; it reads the pair list, having checked that it holds all
 * pairs in reach, and makes cells of its own where it does not. */
#include "cuda/kernels.h"

extern "C" {
#include "backend/cpu/certify.h"
}
#include "backend/cpu/certify_pair.h"
#include "cuda/exact.h"
#include "cuda/grid.h"
#include "cuda/list.h"

/* What the passes over the list found. */
struct report {
    unsigned int moved,
        drifted; /* bits of squares: since the step began, since the list was built */
    struct gbg_cuda_finding close;
};

/* What these passes work on. The coordinates are the certificate's own, made from the 64-bit ones.
 */
struct pass {
    struct gbg_cuda_rows rows;
    uint32_t *local[3];
    float *half; /* half diameters with room for rounding; NULL: `limit` for all pairs */
    float limit; /* squared distance with that room */
    float unit[3];
    float half_of[GBG_SPECIES_MAX];
};

struct search {
    struct gbg_device *device;
    const struct gbg_state *state;
    const struct gbg_list *list;
    struct gbg_certificate *certificate;
    struct gbg_exact exact;
};

static __global__ void clear(struct report *report)
{
    report->moved = report->drifted = 0;
    report->close.count = 0;
    report->close.lowest = GBG_CUDA_NO_PAIR;
}

/* Maxima of floats >= 0: their bits are in the same order as integers. */
static __device__ __forceinline__ void largest(unsigned int *bits, float value)
{
    unsigned int most = __reduce_max_sync(0xFFFFFFFFu, (unsigned int)__float_as_int(value));
    if ((threadIdx.x & 31) == 0 && most > 0) {
        atomicMax(bits, most);
    }
}

/* Coordinates of the particles, and how far they moved: by the high words alone, so each difference
 * is off by up to 2^-32 of the box. */
template <int dimension>
static __global__ void measure(const __grid_constant__ struct gbg_state state,
                               const __grid_constant__ struct pass pass, struct report *report)
{
    int64_t i = gbg_cuda_index();
    vf moved = vf_set(0.0f), drifted = vf_set(0.0f);
    if (i < pass.rows.n) {
        for (int a = 0; a < dimension; a++) {
            uint32_t high = state.high[a][i], low = state.low[a][i];
            vf unit = vf_set(pass.unit[a]);
            pass.local[a][i] = (uint32_t)(gbg_join(high, low) << pass.rows.shift[a] >> 32);
            moved = gbg_certify_squared((vi)high, (vi)state.start_high[a][i], unit, moved);
            drifted = gbg_certify_squared((vi)high, (vi)pass.rows.built_high[a][i], unit, drifted);
        }
        if (pass.half) {
            pass.half[i] = pass.half_of[state.species ? state.species[i] : 0];
        }
    }
    largest(&report->moved, moved);
    largest(&report->drifted, drifted);
}

/* Bits of the up to 32 neighbours in a row that may be too close to particle i and have a higher
 * index: a row is filled up with the particle itself, which has not. */
template <int dimension, bool sizes>
static __device__ __forceinline__ uint32_t too_close(const struct pass &pass, int64_t i,
                                                     const int32_t *row, int32_t count,
                                                     const vi own[3], vf half)
{
    vf limit = vf_set(pass.limit);
    uint32_t found = 0;
#pragma unroll 4
    for (int32_t k = 0; k < count; k++) {
        int32_t j = row[(int64_t)k * GBG_CUDA_SLICE];
        vf squared = vf_set(0.0f);
        for (int a = 0; a < dimension; a++) {
            squared = gbg_certify_squared(own[a], (vi)pass.local[a][j], vf_set(pass.rows.scale[a]),
                                          squared);
        }
        if (sizes) {
            limit = vf_add(half, pass.half[j]);
            limit = vf_mul(limit, limit);
        }
        found |= (uint32_t)(j > i && vf_lt(squared, limit)) << k;
    }
    return found;
}

/* The exact test of all listed pairs that may be too close. */
template <int dimension, bool sizes>
static __global__ void look(const __grid_constant__ struct gbg_state state,
                            const __grid_constant__ struct pass pass,
                            const __grid_constant__ struct gbg_exact exact, struct report *report)
{
    int64_t i = gbg_cuda_index();
    if (i >= pass.rows.n) {
        return;
    }
    int64_t slice = i / GBG_CUDA_SLICE;
    const int32_t *row = pass.rows.index + pass.rows.offset[slice] + i % GBG_CUDA_SLICE;
    int32_t width = pass.rows.width[slice];
    vf half = sizes ? pass.half[i] : 0.0f;
    vi own[3];
    for (int a = 0; a < dimension; a++) {
        own[a] = (vi)pass.local[a][i];
    }
    for (int32_t begin = 0; begin < width; begin += 32) {
        const int32_t *part = row + (int64_t)begin * GBG_CUDA_SLICE;
        int32_t count = width - begin < 32 ? width - begin : 32;
        uint32_t near = too_close<dimension, sizes>(pass, i, part, count, own, half);
        for (; near != 0; near &= near - 1) {
            int64_t j = part[(int64_t)(__ffs((int)near) - 1) * GBG_CUDA_SLICE];
            if (gbg_exact_pair_overlap(&exact, &state, dimension, i, j)) {
                gbg_cuda_note(&report->close, i, j);
            }
        }
    }
}

/* Overlaps by cells: a thread for each slot. */
template <int dimension>
static __global__ void look_around(const __grid_constant__ struct gbg_state state,
                                   const __grid_constant__ struct gbg_cuda_grid grid,
                                   const __grid_constant__ struct gbg_exact exact,
                                   struct report *report)
{
    int64_t slot = gbg_cuda_index();
    if (slot >= grid.n) {
        return;
    }
    int32_t i = grid.particle[slot];
    gbg_cuda_visit(grid, grid.cell_of[i], [&](int32_t other) {
        int32_t j = grid.particle[other];
        if (j > i && gbg_exact_pair_overlap(&exact, &state, dimension, i, j)) {
            gbg_cuda_note(&report->close, i, j);
        }
    });
}

/* Pairs that passed through each other; `fast` is squared, and one of the two moved farther. */
template <int dimension>
static __global__ void look_along(const __grid_constant__ struct gbg_state state,
                                  const __grid_constant__ struct gbg_cuda_grid grid,
                                  const __grid_constant__ struct gbg_exact exact, double fast,
                                  struct report *report)
{
    int64_t slot = gbg_cuda_index();
    if (slot >= grid.n) {
        return;
    }
    int32_t i = grid.particle[slot];
    if (gbg_exact_way_squared(&state, dimension, i) < fast) {
        return;
    }
    gbg_cuda_visit(grid, grid.cell_of[i], [&](int32_t other) {
        int32_t j = grid.particle[other];
        double nearest;
        bool seen_from_both = gbg_exact_way_squared(&state, dimension, j) >= fast;
        if (j != i && !(seen_from_both && j < i) &&
            gbg_exact_pair_passed(&exact, &state, dimension, i, j, &nearest) &&
            !gbg_exact_pair_overlap(&exact, &state, dimension, i, j)) {
            gbg_cuda_note(&report->close, i, j);
        }
    });
}

/* How near a pair came: now, or on its straight path. */
template <int dimension>
static __global__ void measure_pair(const __grid_constant__ struct gbg_state state,
                                    const __grid_constant__ struct gbg_exact exact, int64_t i,
                                    int64_t j, int along_path, double *distance)
{
    *distance = sqrt(gbg_exact_pair_squared(&state, dimension, i, j));
    if (along_path) {
        gbg_exact_pair_passed(&exact, &state, dimension, i, j, distance);
    }
}

template <int dimension>
static __global__ void widest(const __grid_constant__ struct gbg_state state,
                              unsigned long long *largest_squared)
{
    int64_t i = gbg_cuda_index();
    gbg_cuda_max(largest_squared,
                 i < state.owned ? gbg_exact_way_squared(&state, dimension, i) : 0.0);
}

int gbg_cuda_widest_move(struct gbg_device *device, const struct gbg_state *state, double *largest)
{
    void *memory;
    double squared = 0.0;
    int status = gbg_cuda_workspace(device, sizeof squared, &memory);
    status = status ? status : gbg_cuda_clear(device, memory, sizeof squared);
    if (status == GBG_OK && state->owned > 0) {
        (state->box.dimension == 2
             ? widest<2>
             : widest<3>)<<<gbg_cuda_blocks(state->owned), GBG_CUDA_THREADS, 0, device->stream>>>(
            *state, (unsigned long long *)memory);
        status = gbg_cuda_started(device, "largest move");
        status = status ? status : gbg_cuda_fetch(device, &squared, memory, sizeof squared);
    }
    *largest = sqrt(squared);
    return status;
}

/* Adds what was found to the certificate. Its lowest pair is measured here: it is rare that there
 * is one. */
static int take(const struct search *search, const struct gbg_cuda_finding *finding, int along_path)
{
    struct gbg_certificate *certificate = search->certificate;
    struct gbg_pair pair = {(int64_t)(finding->lowest >> 32),
                            (int64_t)(finding->lowest & UINT32_MAX), 0.0};
    const struct gbg_pair *least = &certificate->lowest;
    *(along_path ? &certificate->passed : &certificate->overlapping) += (int64_t)finding->count;
    if (finding->count == 0 ||
        (least->first >= 0 && (least->first < pair.first ||
                               (least->first == pair.first && least->second <= pair.second)))) {
        return GBG_OK;
    }
    struct gbg_device *device = search->device;
    void *memory;
    int status = gbg_cuda_workspace(device, sizeof pair.distance, &memory);
    if (status == GBG_OK) {
        (search->state->box.dimension == 2 ? measure_pair<2>
                                           : measure_pair<3>)<<<1, 1, 0, device->stream>>>(
            *search->state, search->exact, pair.first, pair.second, along_path, (double *)memory);
        status = gbg_cuda_started(device, "certify");
    }
    status = status ? status : gbg_cuda_fetch(device, &pair.distance, memory, sizeof pair.distance);
    certificate->lowest = pair;
    return status;
}

static int fetch(struct gbg_device *device, struct report *found, const void *memory)
{
    int status = gbg_cuda_started(device, "certify");
    return status ? status : gbg_cuda_fetch(device, found, memory, sizeof *found);
}

/* Overlaps by cells of its own: for a list that cannot be shown to be complete. */
static int look_at_cells(const struct search *search)
{
    const struct gbg_state *state = search->state;
    struct gbg_device *device = search->device;
    struct gbg_cuda_grid grid = {};
    struct report found;
    void *memory = NULL;
    int status = gbg_cuda_grid_build(device, &grid, &state->box, search->exact.largest,
                                     state->owned, state->high);
    status = status ? status : gbg_cuda_workspace(device, sizeof found, &memory);
    if (status == GBG_OK) {
        clear<<<1, 1, 0, device->stream>>>((struct report *)memory);
        (state->box.dimension == 2
             ? look_around<2>
             : look_around<
                   3>)<<<gbg_cuda_blocks(state->owned), GBG_CUDA_THREADS, 0, device->stream>>>(
            *state, grid, search->exact, (struct report *)memory);
        status = fetch(device, &found, memory);
    }
    gbg_cuda_grid_release(device, &grid);
    return status ? status : take(search, &found.close, 0);
}

/* Pairs that passed through each other. One of the two moved farther than contact/sqrt(2)
 * (exact.h), and before the step the two were within contact/sqrt(2) and both moves. */
static int look_at_paths(const struct search *search)
{
    const struct gbg_state *state = search->state;
    struct gbg_device *device = search->device;
    struct gbg_certificate *certificate = search->certificate;
    struct gbg_cuda_grid grid = {};
    struct report found;
    void *memory = NULL;
    int status = gbg_cuda_widest_move(device, state, &certificate->largest);
    double fast = 0.7 * search->exact.least;
    double reach = search->exact.largest / sqrt(2.0) + 2.0 * certificate->largest;
    if (status != GBG_OK || certificate->largest < fast) {
        return status;
    }
    for (int a = 0; a < state->box.dimension; a++) {
        certificate->undecided |= reach > 0.5 * state->box.length[a];
    }
    if (certificate->undecided) {
        return GBG_OK;
    }
    status =
        gbg_cuda_grid_build(device, &grid, &state->box, reach, state->owned, state->start_high);
    status = status ? status : gbg_cuda_workspace(device, sizeof found, &memory);
    if (status == GBG_OK) {
        clear<<<1, 1, 0, device->stream>>>((struct report *)memory);
        (state->box.dimension == 2
             ? look_along<2>
             : look_along<
                   3>)<<<gbg_cuda_blocks(state->owned), GBG_CUDA_THREADS, 0, device->stream>>>(
            *state, grid, search->exact, fast * fast, (struct report *)memory);
        status = fetch(device, &found, memory);
    }
    gbg_cuda_grid_release(device, &grid);
    return status ? status : take(search, &found.close, 1);
}

/* The arrays of the passes over the list, from the workspace. */
static int reserve(const struct search *search, struct pass *pass, struct report **report)
{
    const struct gbg_list *list = search->list;
    int64_t n = search->state->owned;
    size_t used = 0, needed = 0;
    void *memory;
    gbg_cuda_take(NULL, &needed, 1, sizeof **report);
    for (int row = 0; row < list->rows.dimension + !search->exact.one_size; row++) {
        gbg_cuda_take(NULL, &needed, n, 4);
    }
    int status = gbg_cuda_workspace(search->device, needed, &memory);
    if (status != GBG_OK) {
        return status;
    }
    *report = (struct report *)gbg_cuda_take(memory, &used, 1, sizeof **report);
    for (int a = 0; a < list->rows.dimension; a++) {
        pass->local[a] = (uint32_t *)gbg_cuda_take(memory, &used, n, 4);
    }
    pass->half = search->exact.one_size ? NULL : (float *)gbg_cuda_take(memory, &used, n, 4);
    return GBG_OK;
}

static void fill_pass(const struct search *search, struct pass *pass)
{
    const struct gbg_state *state = search->state;
    double reach = search->list->reach;
    float edge = 2.0f * gbg_certify_room(reach, 0.5 * search->exact.largest);
    pass->rows = search->list->rows;
    pass->limit = edge * edge;
    for (int a = 0; a < state->box.dimension; a++) {
        pass->unit[a] = (float)(state->box.length[a] * 0x1p-32);
    }
    for (int s = 0; s < state->n_species; s++) {
        pass->half_of[s] = gbg_certify_room(reach, 0.5 * state->diameter[s]);
    }
}

/* Both passes at once, before it is known whether the list is complete: nearly always it is, and
 * then the host waits once. */
template <int dimension>
static int pass_over_list(const struct search *search, const struct pass *pass,
                          struct report *report, struct report *found)
{
    struct gbg_device *device = search->device;
    const struct gbg_state *state = search->state;
    unsigned blocks = gbg_cuda_blocks(state->owned);
    clear<<<1, 1, 0, device->stream>>>(report);
    measure<dimension><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(*state, *pass, report);
    if (search->list->builds > 0) {
        (pass->half ? look<dimension, true>
                    : look<dimension, false>)<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(
            *state, *pass, search->exact, report);
    }
    return fetch(device, found, report);
}

static int certify_list(const struct search *search, struct report *found)
{
    struct pass pass = {};
    struct report *report = NULL;
    int status = reserve(search, &pass, &report);
    if (status != GBG_OK) {
        return status;
    }
    fill_pass(search, &pass);
    return search->state->box.dimension == 2 ? pass_over_list<2>(search, &pass, report, found)
                                             : pass_over_list<3>(search, &pass, report, found);
}

static double length_of(unsigned int bits)
{
    float squared;
    memcpy(&squared, &bits, sizeof squared);
    return sqrt((double)squared);
}

int gbg_cuda_certify(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                     struct gbg_certificate *certificate)
{
    struct search search = {device, state, list, certificate, {}};
    struct report found;
    double error = 0.0;
    certificate->overlapping = certificate->passed = 0;
    certificate->listed = certificate->undecided = 0;
    certificate->largest = 0.0;
    certificate->lowest = {-1, -1, 0.0};
    gbg_exact_make(state, certificate->tolerance, &search.exact);
    if (state->owned == 0) {
        return GBG_OK;
    }
    int status = certify_list(&search, &found);
    if (status != GBG_OK) {
        return status;
    }
    double moved = length_of(found.moved), drifted = length_of(found.drifted);
    for (int a = 0; a < state->box.dimension; a++) {
        error += state->box.length[a] * 0x1p-31;
    }
    certificate->largest = moved;
    certificate->listed =
        list->builds > 0 && gbg_certify_complete(list->reach, list->radius, drifted, error);
    status = certificate->listed ? take(&search, &found.close, 0) : look_at_cells(&search);
    if (status == GBG_OK && certificate->straight &&
        moved * (1.0 + 1e-6) + error >= 0.7 * search.exact.least) {
        status = look_at_paths(&search);
    }
    return status;
}
