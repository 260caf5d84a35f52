/* L1, CPU: the checks of hard cores, and keeping the coordinates of before a step. */
#include <math.h>
#include <string.h>

#include "backend/cpu/contacts.h"
#include "backend/cpu/cpu.h"
#include "backend/cpu/grid.h"
#include "core/memory.h"

/* Copies the share of one thread: the particles that are its own in the other kernels too, so that
 * they stay in its caches. */
static void copy_share(const struct gbg_state *state, int64_t first, int64_t end, int back)
{
    size_t words = (size_t)(end - first) * sizeof(uint32_t);
    for (int a = 0; a < state->box.dimension; a++) {
        uint32_t *now[2] = {state->high[a] + first, state->low[a] + first};
        uint32_t *start[2] = {state->start_high[a] + first, state->start_low[a] + first};
        for (int w = 0; w < 2; w++) {
            memcpy(back ? now[w] : start[w], back ? start[w] : now[w], words);
        }
        if (state->image[a]) {
            int32_t *image = state->image[a] + first, *before = state->start_image[a] + first;
            memcpy(back ? image : before, back ? before : image, words);
        }
    }
    if (state->overlapped && !back) {
        memset(state->overlapped + first, 0, (size_t)(end - first));
    }
}

static void copy_all(const struct gbg_device *device, const struct gbg_state *state, int back)
{
    int64_t n = state->owned, threads = device->threads;
#pragma omp parallel for num_threads(device->threads) schedule(static, 1)
    for (int64_t t = 0; t < threads; t++) {
        copy_share(state, n * t / threads, n * (t + 1) / threads, back);
    }
}

int gbg_keep(struct gbg_device *device, struct gbg_state *state)
{
    copy_all(device, state, 0);
    return GBG_OK;
}

int gbg_put_back(struct gbg_device *device, struct gbg_state *state)
{
    copy_all(device, state, 1);
    return GBG_OK;
}

/* What to look for among the pairs of a grid. */
struct search {
    const struct gbg_state *state;
    const struct gbg_grid *grid;
    double tolerance;
};

static double contact_of(const struct gbg_state *state, int64_t i, int64_t j)
{
    if (state->own_diameter) {
        return 0.5 * (state->own_diameter[i] + state->own_diameter[j]);
    }
    int s = state->species ? state->species[i] : 0, t = state->species ? state->species[j] : 0;
    return 0.5 * (state->diameter[s] + state->diameter[t]);
}

static double distance_of(const struct search *search, int64_t i, int64_t j)
{
    const struct gbg_state *state = search->state;
    double squared = 0.0;
    for (int a = 0; a < state->box.dimension; a++) {
        double d = gbg_box_difference(&state->box, a, gbg_join(state->high[a][i], state->low[a][i]),
                                      gbg_join(state->high[a][j], state->low[a][j]));
        squared += d * d;
    }
    return sqrt(squared);
}

/* Overlapping partners j > i of particle i in ascending order, at most `room` of them stored;
 * returns their number. */
static int64_t overlaps_of(const struct search *search, int32_t i, int64_t room, int32_t *partner,
                           struct gbg_pair *lowest)
{
    struct gbg_run runs[GBG_RUNS_MAX];
    int n_runs = gbg_grid_runs(search->grid, search->grid->cell_of[i], runs);
    int64_t found = 0, kept = 0;
    int32_t least = INT32_MAX;
    for (int r = 0; r < n_runs; r++) {
        for (int32_t slot = runs[r].begin; slot < runs[r].end; slot++) {
            int32_t j = search->grid->particle[slot];
            double contact = j > i ? contact_of(search->state, i, j) : 0.0;
            if (j <= i || contact == 0.0) {
                continue;
            }
            double distance = distance_of(search, i, j);
            if (distance >= contact * (1.0 - search->tolerance)) {
                continue;
            }
            found++;
            if (j < least) {
                least = j;
                *lowest = (struct gbg_pair){i, j, distance};
            }
            /* keep the `room` smallest, sorted */
            int64_t k = kept < room ? kept++ : room - 1;
            if (room == 0 || (found > room && partner[k] <= j)) {
                continue;
            }
            for (; k > 0 && partner[k - 1] > j; k--) {
                partner[k] = partner[k - 1];
            }
            partner[k] = j;
        }
    }
    return found;
}

int gbg_overlaps(struct gbg_device *device, struct gbg_state *state, double tolerance,
                 int64_t capacity, int32_t *first, int32_t *second, struct gbg_pair *lowest,
                 int64_t *count)
{
    struct gbg_grid grid = {0};
    double largest = 0.0;
    for (int s = 0; s < state->n_species; s++) {
        largest = state->diameter[s] > largest ? state->diameter[s] : largest;
    }
    int64_t total = 0;
    *lowest = (struct gbg_pair){-1, -1, 0.0};
    *count = 0;
    int status =
        gbg_grid_build(device->context, &grid, &state->box, largest, state->owned, state->high);
    struct search search = {state, &grid, tolerance};
    for (int64_t i = 0; status == GBG_OK && i < state->owned; i++) {
        struct gbg_pair found = {-1, -1, 0.0};
        int64_t room = capacity > total ? capacity - total : 0;
        int64_t n = overlaps_of(&search, (int32_t)i, room, second ? second + total : NULL, &found);
        for (int64_t k = 0; k < n && k < room; k++) {
            first[total + k] = (int32_t)i;
        }
        if (n > 0 && lowest->first < 0) {
            *lowest = found;
        }
        total += n;
    }
    *count = total;
    gbg_grid_release(&grid);
    return status;
}
