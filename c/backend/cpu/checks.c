/* L1, CPU: the checks of hard cores, and keeping the coordinates of before a step. */
#include <math.h>
#include <string.h>

#include "backend/cpu/contacts.h"
#include "backend/cpu/cpu.h"
#include "backend/cpu/grid.h"
#include "core/memory.h"

int gbg_keep(struct gbg_device *device, struct gbg_state *state)
{
    size_t words = (size_t)state->owned * sizeof(uint32_t);
    (void)device;
    for (int a = 0; a < state->box.dimension; a++) {
        memcpy(state->start_high[a], state->high[a], words);
        memcpy(state->start_low[a], state->low[a], words);
        if (state->image[a]) {
            memcpy(state->start_image[a], state->image[a], words);
        }
    }
    if (state->overlapped) {
        memset(state->overlapped, 0, (size_t)state->owned);
    }
    return GBG_OK;
}

int gbg_put_back(struct gbg_device *device, struct gbg_state *state)
{
    size_t words = (size_t)state->owned * sizeof(uint32_t);
    (void)device;
    for (int a = 0; a < state->box.dimension; a++) {
        memcpy(state->high[a], state->start_high[a], words);
        memcpy(state->low[a], state->start_low[a], words);
        if (state->image[a]) {
            memcpy(state->image[a], state->start_image[a], words);
        }
    }
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
    int status = gbg_grid_build(device->context, &grid, &state->box, largest, state->owned,
                                state->high, state->low);
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
