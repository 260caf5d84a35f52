/* L3: voxels of a random insertion. A place drawn uniformly from the voxels that are not blocked
 * has the law of one drawn uniformly from the box and kept if free, at a small part of the draws.
 */
#include <math.h>

#include "core/memory.h"
#include "scene/insertion.h"
#include "scene/parts.h"

/* At most this many voxels in the beginning. */
static const double most = 1 << 26;
/* Draws without success that voxels get before they are halved: some for all, some for each. */
enum { FOR_ALL = 1000, FOR_EACH = 2 };

static void split_number(const struct gbg_voxels *voxels, int64_t number, int64_t *index)
{
    for (int a = 0; a < 3; a++) {
        index[a] = number % voxels->size[a];
        number /= voxels->size[a];
    }
}

static int is_blocked(const struct gbg_insertion *work, int64_t number)
{
    const struct gbg_scene *scene = work->scene;
    int64_t index[3];
    double centre[3], half[3];
    split_number(&work->voxels, number, index);
    for (int a = 0; a < scene->dimension; a++) {
        double edge = scene->length[a] / (double)work->voxels.size[a];
        centre[a] = scene->origin[a] + ((double)index[a] + 0.5) * edge;
        centre[a] = gbg_wrap(centre[a], scene->origin[a], scene->length[a]);
        half[a] = edge / 2;
    }
    return gbg_insertion_blocks(work, centre, half);
}

/* Of the present species with those that have cores so far. */
static double least_contact(const struct gbg_insertion *work)
{
    double own = work->scene->species[work->order[work->rank]].diameter, least = INFINITY;
    for (int rank = 0; rank <= work->rank; rank++) {
        const struct gbg_cells *cells = &work->cells[work->order[rank]];
        least = cells->head ? fmin(least, (own + cells->diameter) / 2) : least;
    }
    return least;
}

int gbg_voxels_make(struct gbg_insertion *work)
{
    const struct gbg_scene *scene = work->scene;
    struct gbg_voxels *voxels = &work->voxels;
    double edge = least_contact(work) / 2, volume = 1;
    int64_t total = 1, n = 0;
    for (int a = 0; a < scene->dimension; a++) {
        volume *= scene->length[a];
    }
    edge = fmax(edge, pow(volume / most, 1.0 / scene->dimension));
    voxels->level = 0;
    for (int a = 0; a < 3; a++) {
        double whole = a < scene->dimension ? ceil(scene->length[a] / edge) : 1;
        voxels->size[a] = (int64_t)fmax(1, fmin(whole, 2 * most / (double)total));
        total *= voxels->size[a];
    }
    for (int64_t v = 0; v < total; v++) {
        n += !is_blocked(work, v);
    }
    int status = gbg_allocate(scene->context, (void **)&voxels->number, n, sizeof(int64_t),
                              "voxels of the insertion");
    voxels->n = 0;
    for (int64_t v = 0; v < total && status == GBG_OK; v++) {
        if (!is_blocked(work, v)) {
            voxels->number[voxels->n++] = v;
        }
    }
    voxels->failures = 0;
    voxels->patience = FOR_ALL + FOR_EACH * voxels->n;
    return status;
}

/* Number of child c of a voxel after the division. */
static int64_t child(const struct gbg_voxels *before, const struct gbg_voxels *after,
                     int64_t number, int c)
{
    int64_t index[3];
    split_number(before, number, index);
    for (int a = 0; a < 3; a++) {
        index[a] = after->size[a] > before->size[a] ? 2 * index[a] + (c >> a & 1) : index[a];
    }
    return index[0] + after->size[0] * (index[1] + after->size[1] * index[2]);
}

int gbg_voxels_halve(struct gbg_insertion *work)
{
    const struct gbg_voxels old = work->voxels;
    struct gbg_voxels fresh = {.level = old.level + 1, .size = {1, 1, 1}};
    int children = 1 << work->scene->dimension;
    for (int a = 0; a < work->scene->dimension; a++) {
        fresh.size[a] = 2 * old.size[a];
    }
    int status = gbg_allocate(work->scene->context, (void **)&fresh.number, old.n * children,
                              sizeof(int64_t), "voxels of the insertion");
    if (status != GBG_OK) {
        return status;
    }
    work->voxels = fresh;
    for (int64_t v = 0; v < old.n; v++) {
        for (int c = 0; c < children; c++) {
            int64_t number = child(&old, &fresh, old.number[v], c);
            if (!is_blocked(work, number)) {
                work->voxels.number[work->voxels.n++] = number;
            }
        }
    }
    work->voxels.patience = FOR_ALL + FOR_EACH * work->voxels.n;
    gbg_release(old.number);
    return GBG_OK;
}

void gbg_voxels_point(const struct gbg_insertion *work, int64_t index, const double *uniform,
                      double *r)
{
    const struct gbg_scene *scene = work->scene;
    int64_t at[3];
    split_number(&work->voxels, work->voxels.number[index], at);
    for (int a = 0; a < scene->dimension; a++) {
        double share = ((double)at[a] + uniform[a]) / (double)work->voxels.size[a];
        r[a] = scene->origin[a] + share * scene->length[a];
    }
}

void gbg_voxels_review(struct gbg_insertion *work, int64_t index)
{
    struct gbg_voxels *voxels = &work->voxels;
    if (is_blocked(work, voxels->number[index])) {
        voxels->number[index] = voxels->number[--voxels->n];
    }
}

void gbg_voxels_release(struct gbg_insertion *work)
{
    gbg_release(work->voxels.number);
    work->voxels = (struct gbg_voxels){0};
}
