/* L1, CPU: the check that nobody came too close on the bent paths of the rule event: from the
 * places of the collisions alone, with formulas of its own. */
#include <math.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/events.h"
#include "backend/cpu/grid.h"

/* A corner of a path: how far from the start of the step, without wrapping. */
struct corner {
    double time, off[3];
};

struct paths {
    const struct gbg_state *state;
    struct gbg_grid grid;
    struct corner *corner;
    int64_t *begin;    /* particles and one more: into the corners */
    double *excursion; /* largest distance of a corner */
    double largest, tolerance;
};

static int64_t count_corners(const struct gbg_state *state, const struct gbg_events *work)
{
    int64_t count = 2 * state->owned;
    for (int64_t k = 0; k < work->changes.used; k++) {
        const struct gbg_changed *changed = &work->changed[k];
        count += work->part[changed->part].member[changed->member].events;
    }
    return count;
}

/* Appends the corner that lies `quanta` after the last one; `foreseen` tells whole boxes apart. */
static void add_corner(const struct gbg_box *box, struct corner *corner, double time,
                       const uint64_t from[3], const uint64_t to[3], const double *foreseen)
{
    corner[1].time = time;
    for (int a = 0; a < box->dimension; a++) {
        double x = gbg_box_difference(box, a, to[a], from[a]);
        x += foreseen ? box->length[a] * rint((foreseen[a] - x) / box->length[a]) : 0.0;
        corner[1].off[a] = corner[0].off[a] + x;
    }
}

/* The corners of one path; returns their number. */
static int64_t trace(const struct gbg_state *state, const struct gbg_events *work, int64_t i,
                     struct corner *corner)
{
    const struct gbg_box *box = &state->box;
    uint64_t from[3], to[3];
    int64_t n = 0;
    *corner = (struct corner){0.0, {0.0, 0.0, 0.0}};
    for (int a = 0; a < box->dimension; a++) {
        from[a] = gbg_join(state->start_high[a][i], state->start_low[a][i]);
        to[a] = gbg_join(state->high[a][i], state->low[a][i]);
    }
    if (work->owner[i] == 0) {
        add_corner(box, corner, 1.0, from, to, NULL);
        return 2;
    }
    const struct gbg_changed *changed = &work->changed[work->owner[i] - 1];
    const struct gbg_leg *legs = work->part[changed->part].leg;
    int32_t k = work->part[changed->part].member[changed->member].first;
    for (; k >= 0; k = legs[k].next) {
        const struct gbg_leg *leg = &legs[k], *next = leg->next >= 0 ? &legs[leg->next] : NULL;
        double time = next ? next->time : 1.0, foreseen[3];
        for (int a = 0; a < box->dimension; a++) {
            foreseen[a] = leg->velocity[a] * (time - leg->time);
        }
        add_corner(box, corner + n, time, n == 0 ? from : leg->place, next ? next->place : to,
                   foreseen);
        n++;
    }
    return n + 1;
}

static void trace_all(struct paths *paths, const struct gbg_events *work)
{
    int dimension = paths->state->box.dimension;
    paths->begin[0] = 0;
    for (int64_t i = 0; i < paths->state->owned; i++) {
        struct corner *corner = paths->corner + paths->begin[i];
        int64_t n = trace(paths->state, work, i, corner);
        double most = 0.0;
        for (int64_t k = 1; k < n; k++) {
            double squared = 0.0;
            for (int a = 0; a < dimension; a++) {
                squared += corner[k].off[a] * corner[k].off[a];
            }
            most = fmax(most, squared);
        }
        paths->begin[i + 1] = paths->begin[i] + n;
        paths->excursion[i] = sqrt(most);
    }
}

/* Where on the piece that begins at this corner somebody is at a time. */
static void place_at(const struct corner *corner, double time, int dimension, double off[3])
{
    double length = corner[1].time - corner[0].time;
    double share = length > 0.0 ? (time - corner[0].time) / length : 1.0;
    for (int a = 0; a < dimension; a++) {
        off[a] = corner[0].off[a] + (corner[1].off[a] - corner[0].off[a]) * share;
    }
}

/* Squared distance of the origin from the piece of a straight line between p and q. */
static double nearest_of_piece(int dimension, const double p[3], const double q[3])
{
    double along = 0.0, length = 0.0, squared = 0.0;
    for (int a = 0; a < dimension; a++) {
        along -= p[a] * (q[a] - p[a]);
        length += (q[a] - p[a]) * (q[a] - p[a]);
    }
    double share = length > 0.0 ? fmin(fmax(along / length, 0.0), 1.0) : 0.0;
    for (int a = 0; a < dimension; a++) {
        double d = p[a] + (q[a] - p[a]) * share;
        squared += d * d;
    }
    return squared;
}

/* Smallest squared distance of two paths whose starts differ by d. */
static double nearest_of_paths(const struct paths *paths, int64_t i, int64_t j, const double d[3])
{
    int dimension = paths->state->box.dimension;
    const struct corner *p = paths->corner + paths->begin[i], *q = paths->corner + paths->begin[j];
    double before[3], least = INFINITY;
    for (int a = 0; a < dimension; a++) {
        before[a] = d[a];
    }
    for (double time = 0.0; time < 1.0;) {
        double own[3], its[3], after[3];
        time = p[1].time < q[1].time ? p[1].time : q[1].time;
        place_at(p, time, dimension, own);
        place_at(q, time, dimension, its);
        for (int a = 0; a < dimension; a++) {
            after[a] = d[a] + own[a] - its[a];
        }
        least = fmin(least, nearest_of_piece(dimension, before, after));
        for (int a = 0; a < dimension; a++) {
            before[a] = after[a];
        }
        int own_ends = p[1].time <= time && time < 1.0, its_ends = q[1].time <= time && time < 1.0;
        p += own_ends;
        q += its_ends;
    }
    return least;
}

/* Whether a pair came too close, over all images that it could reach. */
static int too_close(const struct paths *paths, int64_t i, int64_t j, double *distance)
{
    const struct gbg_state *state = paths->state;
    const struct gbg_box *box = &state->box;
    double contact = gbg_events_contact(state, i, j), squared = 0.0, d[3] = {0.0, 0.0, 0.0};
    double reach = contact + paths->excursion[i] + paths->excursion[j];
    int images[3] = {0, 0, 0};
    for (int a = 0; a < box->dimension; a++) {
        d[a] = gbg_box_difference(box, a, gbg_join(state->start_high[a][i], state->start_low[a][i]),
                                  gbg_join(state->start_high[a][j], state->start_low[a][j]));
        squared += d[a] * d[a];
        images[a] = (int)floor((reach + fabs(d[a])) / box->length[a]);
    }
    if (squared > reach * reach || contact <= 0.0) { /* other images are farther still */
        return 0;
    }
    double least = INFINITY;
    for (int z = -images[2]; z <= images[2]; z++) {
        for (int y = -images[1]; y <= images[1]; y++) {
            for (int x = -images[0]; x <= images[0]; x++) {
                double image[3] = {d[0] + x * box->length[0], d[1] + y * box->length[1],
                                   d[2] + z * box->length[2]};
                least = fmin(least, nearest_of_paths(paths, i, j, image));
            }
        }
    }
    *distance = sqrt(least);
    return *distance < contact * (1.0 - paths->tolerance);
}

/* The first pair in the order of indices among those whose lower index is first .. end-1. */
static struct gbg_pair search(const struct paths *paths, int64_t first, int64_t end)
{
    struct gbg_pair found = {-1, -1, 0.0};
    for (int64_t i = first; i < end && found.first < 0; i++) {
        struct gbg_run runs[GBG_RUNS_MAX];
        int n_runs = gbg_grid_runs(&paths->grid, paths->grid.cell_of[i], runs);
        for (int r = 0; r < n_runs; r++) {
            for (int32_t slot = runs[r].begin; slot < runs[r].end; slot++) {
                int32_t j = paths->grid.particle[slot];
                double distance;
                if (j > i && (found.first < 0 || j < found.second) &&
                    too_close(paths, i, j, &distance)) {
                    found = (struct gbg_pair){i, j, distance};
                }
            }
        }
    }
    return found;
}

int gbg_events_clear(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                     double tolerance, struct gbg_pair *first)
{
    const struct gbg_events *work = list->events;
    struct paths paths = {.state = state, .tolerance = tolerance};
    int64_t n = state->owned, corners = work ? count_corners(state, work) : 0;
    void *memory;
    *first = (struct gbg_pair){-1, -1, 0.0};
    if (!work || n == 0) {
        return GBG_OK;
    }
    int status = gbg_cpu_workspace(device,
                                   (size_t)corners * sizeof *paths.corner +
                                       (size_t)(n + 1) * (sizeof *paths.begin + sizeof(double)),
                                   &memory);
    if (status != GBG_OK) {
        return status;
    }
    paths.corner = memory;
    paths.begin = (int64_t *)(paths.corner + corners);
    paths.excursion = (double *)(paths.begin + n + 1);
    trace_all(&paths, work);
    double farthest = 0.0, contact = 0.0;
    for (int64_t i = 0; i < n; i++) {
        farthest = fmax(farthest, paths.excursion[i]);
        contact = fmax(contact, gbg_events_contact(state, i, i));
    }
    status = gbg_grid_build(device->context, &paths.grid, &state->box, contact + 2.0 * farthest, n,
                            state->start_high);
    int64_t shares = status == GBG_OK ? 64 : 0;
    struct gbg_pair found[64];
#pragma omp parallel for num_threads(device->threads) schedule(dynamic, 1)
    for (int64_t s = 0; s < shares; s++) {
        found[s] = search(&paths, n * s / shares, n * (s + 1) / shares);
    }
    for (int64_t s = 0; s < shares && first->first < 0; s++) {
        *first = found[s];
    }
    gbg_grid_release(&paths.grid);
    return status;
}
