/* L3: random sequential insertion: uniform positions, each kept if no core is hit. */
#include <inttypes.h>
#include <math.h>

#include "core/memory.h"
#include "scene/draws.h"
#include "scene/parts.h"

/* Failures in a row after which a particle has no place: far beyond what insertion needs below
 * 0.53 (2D) or 0.37 (3D), where it slows down. */
enum { MOST_TRIES = 50000 };

/* Cells at least one diameter wide over the box, with the particles of one species in linked lists:
 * a core that is not larger can only hit one in the 3^dimension cells around it. */
struct cells {
    double diameter;
    int64_t size[3];
    int32_t *head; /* -1: none */
};

struct insertion {
    struct gbg_scene *scene;
    struct gbg_particles *particles;
    int order[GBG_MAX_SPECIES]; /* species, largest first */
    struct cells cells[GBG_MAX_SPECIES];
    int32_t *next; /* in the list of a cell */
    double slack;  /* kept from contact, so that rounding never makes an overlap */
};

static int make_cells(struct insertion *work, int s)
{
    const struct gbg_scene *scene = work->scene;
    struct cells *cells = &work->cells[s];
    double most = 4.0 * (double)scene->species[s].count + 64, edge = scene->species[s].diameter;
    double volume = 1;
    int64_t total = 1;
    cells->diameter = edge;
    for (int a = 0; a < scene->dimension; a++) {
        volume *= scene->length[a];
    }
    edge = fmax(edge * 1.0001, pow(volume / most, 1.0 / scene->dimension));
    for (int a = 0; a < 3; a++) {
        double whole = a < scene->dimension ? floor(scene->length[a] / edge) : 1;
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

static void cell_of(const struct insertion *work, const struct cells *cells, const double *r,
                    int64_t *index)
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

static int64_t cell_number(const struct cells *cells, const int64_t *index)
{
    return index[0] + cells->size[0] * (index[1] + cells->size[1] * index[2]);
}

static double distance_square(const struct insertion *work, const double *r, int32_t j)
{
    double square = 0;
    for (int a = 0; a < work->scene->dimension; a++) {
        double length = work->scene->length[a];
        double d = fabs(r[a] - work->particles->position[a][j]);
        d = fmin(d, length - d);
        square += d * d;
    }
    return square;
}

/* 1 if a core closer than `contact` to r lies in the cells around it. */
static int hits(const struct insertion *work, const struct cells *cells, const double *r,
                double contact)
{
    int64_t middle[3], span[3], index[3];
    cell_of(work, cells, r, middle);
    for (int a = 0; a < 3; a++) {
        span[a] = cells->size[a] < 3 ? cells->size[a] : 3;
    }
    for (int64_t k = 0; k < span[0] * span[1] * span[2]; k++) {
        int64_t step[3] = {k % span[0], k / span[0] % span[1], k / span[0] / span[1]};
        for (int a = 0; a < 3; a++) {
            index[a] = (middle[a] + step[a] - 1 + cells->size[a]) % cells->size[a];
        }
        for (int32_t j = cells->head[cell_number(cells, index)]; j >= 0; j = work->next[j]) {
            if (distance_square(work, r, j) < contact * contact) {
                return 1;
            }
        }
    }
    return 0;
}

static int is_free(const struct insertion *work, int rank, const double *r)
{
    double own = work->scene->species[work->order[rank]].diameter;
    for (int other = 0; other <= rank; other++) {
        const struct cells *cells = &work->cells[work->order[other]];
        double contact = (own + cells->diameter) / 2 + work->slack;
        if (cells->head && hits(work, cells, r, contact)) {
            return 0;
        }
    }
    return 1;
}

static int place(struct insertion *work, int rank, int64_t i)
{
    struct gbg_scene *scene = work->scene;
    struct cells *cells = &work->cells[work->order[rank]];
    double r[3];
    for (int64_t attempt = 0; attempt < MOST_TRIES; attempt++) {
        gbg_draw(scene, GBG_DRAW_INSERTION, i, attempt, scene->dimension, r);
        for (int a = 0; a < scene->dimension; a++) {
            r[a] = gbg_wrap(scene->origin[a] + r[a] * scene->length[a], scene->origin[a],
                            scene->length[a]);
        }
        if (!is_free(work, rank, r)) {
            continue;
        }
        for (int a = 0; a < scene->dimension; a++) {
            work->particles->position[a][i] = r[a];
        }
        work->particles->species[i] = work->order[rank];
        work->particles->id[i] = i;
        if (cells->head) {
            int64_t index[3];
            cell_of(work, cells, r, index);
            int64_t c = cell_number(cells, index);
            work->next[i] = cells->head[c];
            cells->head[c] = (int32_t)i;
        }
        return 1;
    }
    return 0;
}

static int refuse(const struct insertion *work, int64_t placed)
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

static void order_by_size(struct insertion *work)
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

static int insert_all(struct insertion *work)
{
    const struct gbg_scene *scene = work->scene;
    int64_t i = 0;
    for (int rank = 0; rank < scene->n_species; rank++) {
        int s = work->order[rank];
        if (scene->rule != GBG_RULE_NONE && scene->species[s].diameter > 0) {
            int status = make_cells(work, s);
            if (status != GBG_OK) {
                return status;
            }
        }
        for (int64_t k = 0; k < scene->species[s].count; k++, i++) {
            if (!place(work, rank, i)) {
                return refuse(work, i);
            }
        }
    }
    return GBG_OK;
}

int gbg_start_insertion(struct gbg_scene *scene, struct gbg_particles *particles)
{
    struct insertion work = {.scene = scene, .particles = particles};
    double widest = 0;
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
    if (status == GBG_OK) {
        status = insert_all(&work);
    }
    for (int s = 0; s < scene->n_species; s++) {
        gbg_release(work.cells[s].head);
    }
    gbg_release(work.next);
    if (status != GBG_OK) {
        gbg_particles_release(particles);
    }
    return status;
}
