/* L1, CPU: putting violated pairs back to where they were before the step. */
#include <math.h>

#include "backend/cpu/contacts.h"
#include "backend/cpu/cpu.h"
#include "backend/cpu/exact.h"
#include "core/memory.h"

enum { FREE, VIOLATED, REVERTED };

/* Cells of the coordinates before the step, so wide that two particles which overlap after it, or
 * passed through each other, are neighbours there: whoever is put back stays in his cell. */
struct roll {
    struct gbg_device *device;
    struct gbg_state *state;
    struct gbg_exact exact;
    struct gbg_grid grid;
    int straight;
    unsigned char *mark;
    int32_t *wave; /* put back in the last pass */
    int64_t n_wave;
};

static int violated(const struct roll *roll, int64_t i, int64_t j)
{
    double nearest;
    return gbg_exact_contact(&roll->exact, i, j) > 0.0 &&
           (gbg_exact_overlap(&roll->exact, i, j) ||
            (roll->straight && gbg_exact_passed(&roll->exact, i, j, &nearest)));
}

static void mark(struct roll *roll, int64_t i)
{
    __atomic_store_n(&roll->mark[i], VIOLATED, __ATOMIC_RELAXED); /* several threads may */
}

/* Marks whoever is in a violated pair with i: those after i only, and i, if i was not put back. */
static void look_around(struct roll *roll, int32_t i, int put_back)
{
    struct gbg_run runs[GBG_RUNS_MAX];
    int n_runs = gbg_grid_runs(&roll->grid, roll->grid.cell_of[i], runs);
    for (int r = 0; r < n_runs; r++) {
        for (int32_t slot = runs[r].begin; slot < runs[r].end; slot++) {
            int32_t j = roll->grid.particle[slot];
            if (put_back ? roll->mark[j] == FREE && violated(roll, i, j)
                         : j > i && violated(roll, i, j)) {
                mark(roll, j);
                if (!put_back) {
                    mark(roll, i);
                }
            }
        }
    }
}

static void put_back(struct gbg_state *state, int64_t i)
{
    for (int a = 0; a < state->box.dimension; a++) {
        state->high[a][i] = state->start_high[a][i];
        state->low[a][i] = state->start_low[a][i];
        if (state->image[a]) {
            state->image[a][i] = state->start_image[a][i];
        }
    }
    if (state->overlapped) {
        state->overlapped[i] = 1;
    }
}

/* Puts the marked particles back: the next wave. */
static void collect(struct roll *roll)
{
    roll->n_wave = 0;
    for (int64_t i = 0; i < roll->state->owned; i++) {
        if (roll->mark[i] == VIOLATED) {
            roll->mark[i] = REVERTED;
            put_back(roll->state, i);
            roll->wave[roll->n_wave++] = (int32_t)i;
        }
    }
}

static double widest_move(const struct gbg_state *state)
{
    double largest = 0.0;
    for (int64_t i = 0; i < state->owned; i++) {
        largest = fmax(largest, gbg_exact_moved_squared(state, i));
    }
    return sqrt(largest);
}

static int reserve(struct roll *roll)
{
    struct gbg_state *state = roll->state;
    struct gbg_context *context = roll->device->context;
    int status =
        gbg_allocate_zero(context, (void **)&roll->mark, state->owned, 1, "particles put back");
    if (status == GBG_OK) {
        status = gbg_allocate(context, (void **)&roll->wave, state->owned, sizeof *roll->wave,
                              "particles put back");
    }
    return status ? status
                  : gbg_grid_build(context, &roll->grid, &state->box,
                                   roll->exact.largest + 2.0 * widest_move(state), state->owned,
                                   state->start_high);
}

int gbg_roll_back(struct gbg_device *device, struct gbg_state *state, double tolerance,
                  int straight, int64_t *reverted)
{
    struct roll roll = {.device = device, .state = state, .straight = straight};
    gbg_exact_make(state, tolerance, &roll.exact);
    *reverted = 0;
    int status = reserve(&roll);
    if (status == GBG_OK) {
#pragma omp parallel for num_threads(device->threads) schedule(static)
        for (int64_t i = 0; i < state->owned; i++) {
            look_around(&roll, (int32_t)i, 0);
        }
        for (collect(&roll); roll.n_wave > 0; collect(&roll)) {
            *reverted += roll.n_wave;
            /* only pairs with one who was put back can be violated anew */
            for (int64_t k = 0; k < roll.n_wave; k++) {
                look_around(&roll, roll.wave[k], 1);
            }
        }
    }
    gbg_grid_release(&roll.grid);
    gbg_release(roll.mark);
    gbg_release(roll.wave);
    return status;
}
