/* L3: random sequential insertion: uniform positions, each kept if no core is hit. */
#include <inttypes.h>
#include <math.h>

#include "core/memory.h"
#include "scene/draws.h"
#include "scene/insertion.h"
#include "scene/parts.h"

/* Failures in a row after which voxels take over; halvings of voxels after which there is no place
 * for all that insertion can find. */
enum { MOST_BLIND = 200, MOST_HALVINGS = 12 };

static int make_cells(struct gbg_insertion *work, int s)
{
    const struct gbg_scene *scene = work->scene;
    struct gbg_cells *cells = &work->cells[s];
    double most = 4.0 * (double)scene->species[s].count + 64, edge = scene->species[s].diameter;
    double volume = 1;
    int64_t total = 1;
    cells->diameter = edge;
    for (int a = 0; a < scene->dimension; a++) {
        volume *= scene->length[a];
    }
    edge = fmax((edge + work->slack) * 1.0001, pow(volume / most, 1.0 / scene->dimension));
    for (int a = 0; a < 3; a++) {
        double whole = a < scene->dimension ? floor(scene->length[a] / edge) : 1;
        whole = fmin(whole, most / (double)total);
        cells->size[a] = whole > 1 ? (int64_t)whole : 1;
        total *= cells->size[a];
    }
    int status = gbg_allocate(scene->context, (void **)&cells->head, total, sizeof(int32_t),
                              "cells of the insertion");
    for (int64_t c = 0; status == GBG_OK && c < total; c++) {
        cells->head[c] = -1;
    }
    return status;
}

static void cell_of(const struct gbg_insertion *work, const struct gbg_cells *cells,
                    const double *r, int64_t *index)
{
    for (int a = 0; a < 3; a++) {
        index[a] = 0;
        if (a < work->scene->dimension) {
            double offset = (r[a] - work->scene->origin[a]) / work->scene->length[a];
            index[a] = (int64_t)(offset * (double)cells->size[a]);
            index[a] = index[a] < cells->size[a] ? index[a] : cells->size[a] - 1;
        }
    }
}

static int64_t cell_number(const struct gbg_cells *cells, const int64_t *index)
{
    return index[0] + cells->size[0] * (index[1] + cells->size[1] * index[2]);
}

/* Square of the distance from particle j to the farthest corner of a box around r. */
static double farthest_square(const struct gbg_insertion *work, const double *r, const double *half,
                              int32_t j)
{
    double square = 0;
    for (int a = 0; a < work->scene->dimension; a++) {
        double length = work->scene->length[a];
        double d = fabs(r[a] - work->particles->position[a][j]);
        d = (d < length - d ? d : length - d) + half[a];
        square += d * d;
    }
    return square;
}

/* Numbers of the cells next to a cell along an axis, itself first, times the step of the axis;
 * returns how many differ. */
static int neighbours(const struct gbg_cells *cells, int a, int64_t middle, int64_t *number)
{
    int64_t size = cells->size[a], step = 1;
    for (int b = 0; b < a; b++) {
        step *= cells->size[b];
    }
    number[0] = middle * step;
    number[1] = (middle + 1 < size ? middle + 1 : 0) * step;
    number[2] = (middle > 0 ? middle - 1 : size - 1) * step;
    return size < 3 ? (int)size : 3;
}

static int hits(const struct gbg_insertion *work, const struct gbg_cells *cells, const double *r,
                const double *half, double contact)
{
    int64_t middle[3], number[3][3];
    int span[3];
    cell_of(work, cells, r, middle);
    for (int a = 0; a < 3; a++) {
        span[a] = neighbours(cells, a, middle[a], number[a]);
    }
    for (int z = 0; z < span[2]; z++) {
        for (int y = 0; y < span[1]; y++) {
            for (int x = 0; x < span[0]; x++) {
                int64_t c = number[0][x] + number[1][y] + number[2][z];
                for (int32_t j = cells->head[c]; j >= 0; j = work->next[j]) {
                    if (farthest_square(work, r, half, j) < contact * contact) {
                        return 1;
                    }
                }
            }
        }
    }
    return 0;
}

int gbg_insertion_blocks(const struct gbg_insertion *work, const double *r, const double *half)
{
    double own = work->scene->species[work->order[work->rank]].diameter;
    for (int other = 0; other <= work->rank; other++) {
        const struct gbg_cells *cells = &work->cells[work->order[other]];
        double contact = (own + cells->diameter) / 2 + work->slack;
        if (cells->head && hits(work, cells, r, half, contact)) {
            return 1;
        }
    }
    return 0;
}

static void put(struct gbg_insertion *work, int64_t i, const double *r)
{
    struct gbg_cells *cells = &work->cells[work->order[work->rank]];
    for (int a = 0; a < work->scene->dimension; a++) {
        work->particles->position[a][i] = r[a];
    }
    work->particles->species[i] = work->order[work->rank];
    work->particles->id[i] = i;
    if (cells->head) {
        int64_t index[3];
        cell_of(work, cells, r, index);
        int64_t c = cell_number(cells, index);
        work->next[i] = cells->head[c];
        cells->head[c] = (int32_t)i;
    }
}

/* One draw: 1 and the place, if it is free. */
static int draw_place(struct gbg_insertion *work, int64_t i, int64_t attempt, double *r)
{
    static const double point[3] = {0};
    const struct gbg_scene *scene = work->scene;
    struct gbg_voxels *voxels = &work->voxels;
    double uniform[4];
    int64_t index = 0;
    gbg_draw(scene, GBG_DRAW_INSERTION, i, attempt, scene->dimension + (voxels->number != NULL),
             uniform);
    if (voxels->number) {
        index = (int64_t)(uniform[scene->dimension] * (double)voxels->n);
        gbg_voxels_point(work, index, uniform, r);
    }
    for (int a = 0; a < scene->dimension; a++) {
        r[a] = voxels->number ? r[a] : scene->origin[a] + uniform[a] * scene->length[a];
        r[a] = gbg_wrap(r[a], scene->origin[a], scene->length[a]);
    }
    if (!gbg_insertion_blocks(work, r, point)) {
        return 1;
    }
    if (voxels->number) {
        gbg_voxels_review(work, index);
    }
    return 0;
}

/* After a draw without success: voxels are made when blind draws fail too often in a row, and
 * halved when each has had its draws. */
static int think_again(struct gbg_insertion *work, int64_t failures)
{
    struct gbg_voxels *voxels = &work->voxels;
    if (!voxels->number) {
        return failures > MOST_BLIND ? gbg_voxels_make(work) : GBG_OK;
    }
    voxels->failures++;
    return voxels->failures > voxels->patience ? gbg_voxels_halve(work) : GBG_OK;
}

/* Puts particle i somewhere; *found 0 when no place is left. */
static int place(struct gbg_insertion *work, int64_t i, int *found)
{
    struct gbg_voxels *voxels = &work->voxels;
    double r[3];
    int status = GBG_OK;
    *found = 0;
    for (int64_t attempt = 0; status == GBG_OK && !*found; attempt++) {
        if (voxels->number && (voxels->n == 0 || voxels->level > MOST_HALVINGS)) {
            return GBG_OK;
        }
        if (draw_place(work, i, attempt, r)) {
            put(work, i, r);
            *found = 1;
        } else {
            status = think_again(work, attempt);
        }
    }
    return status;
}

static int refuse(const struct gbg_insertion *work, int64_t placed)
{
    struct gbg_scene reached = *work->scene;
    int64_t left = placed;
    for (int rank = 0; rank < reached.n_species; rank++) {
        struct gbg_species *species = &reached.species[work->order[rank]];
        species->count = left < species->count ? left : species->count;
        left -= species->count;
    }
    return gbg_fail(work->scene->context, GBG_E_SCENE,
                    "particles.start.random: insertion placed %" PRId64 " of %" PRId64
                    " particles and stopped at packing %.5g of %.5g; take a smaller "
                    "packing or particles.start.lattice",
                    placed, work->scene->n, gbg_scene_packing(&reached),
                    gbg_scene_packing(work->scene));
}

static void order_by_size(struct gbg_insertion *work)
{
    const struct gbg_scene *scene = work->scene;
    for (int s = 0; s < scene->n_species; s++) {
        int rank = s;
        for (; rank > 0 &&
               scene->species[work->order[rank - 1]].diameter < scene->species[s].diameter;
             rank--) {
            work->order[rank] = work->order[rank - 1];
        }
        work->order[rank] = s;
    }
}

static int insert_species(struct gbg_insertion *work, int64_t *placed)
{
    const struct gbg_scene *scene = work->scene;
    int s = work->order[work->rank], status = GBG_OK;
    if (scene->rule != GBG_RULE_NONE && scene->species[s].diameter > 0) {
        status = make_cells(work, s);
    }
    for (int64_t k = 0; k < scene->species[s].count && status == GBG_OK; k++) {
        int found = 0;
        status = place(work, *placed, &found);
        if (status == GBG_OK && !found) {
            return refuse(work, *placed);
        }
        ++*placed;
    }
    gbg_voxels_release(work);
    return status;
}

int gbg_start_insertion(struct gbg_scene *scene, struct gbg_particles *particles)
{
    struct gbg_insertion work = {.scene = scene, .particles = particles};
    double widest = 0;
    int64_t placed = 0;
    for (int a = 0; a < scene->dimension; a++) {
        widest = fmax(widest, scene->length[a] + fabs(scene->origin[a]));
    }
    order_by_size(&work);
    work.slack = 1e-12 * (gbg_largest_diameter(scene) + widest);
    int status = gbg_particles_allocate(scene->context, scene->n, scene->dimension, particles);
    if (status == GBG_OK) {
        status = gbg_allocate(scene->context, (void **)&work.next, scene->n, sizeof(int32_t),
                              "lists of the insertion");
    }
    for (; work.rank < scene->n_species && status == GBG_OK; work.rank++) {
        status = insert_species(&work, &placed);
    }
    for (int s = 0; s < scene->n_species; s++) {
        gbg_release(work.cells[s].head);
    }
    gbg_voxels_release(&work);
    gbg_release(work.next);
    if (status != GBG_OK) {
        gbg_particles_release(particles);
    }
    return status;
}
