/* L2: neighbour search on a caller's arrays: its state, and which method is taken. */
#include "engine/neighbours.h"

#include <math.h>
#include <stdio.h>

#include "core/context.h"
#include "core/memory.h"

enum { BLOCK = 4096 };

int gbg_neighbours_make(struct gbg_context *context, int dimension, const double *lengths,
                        struct gbg_neighbours **neighbours)
{
    struct gbg_neighbours *made;
    int status = gbg_allocate_zero(context, (void **)&made, 1, sizeof *made, "neighbour search");
    if (status != GBG_OK) {
        return status;
    }
    made->context = context;
    made->box = gbg_box_make(dimension, lengths, NULL);
    made->backend = gbg_backend_find(context->backend);
    status = made->backend->create(context, &made->device);
    if (status == GBG_OK) {
        made->kernels = made->backend->kernels(made->device);
        status = made->kernels->search_create
                     ? made->kernels->search_create(made->device, &made->box, &made->search)
                     : gbg_fail(context, GBG_E_UNBUILT,
                                "gbg_neighbours_create: the backend %s has no neighbour search",
                                context->backend);
    }
    if (status != GBG_OK) {
        gbg_neighbours_free(made);
        return status;
    }
    *neighbours = made;
    return GBG_OK;
}

void gbg_neighbours_free(struct gbg_neighbours *neighbours)
{
    if (!neighbours) {
        return;
    }
    if (neighbours->search) {
        neighbours->kernels->search_destroy(neighbours->device, neighbours->search);
    }
    if (neighbours->device) {
        neighbours->backend->destroy(neighbours->device);
    }
    gbg_release(neighbours);
}

/* Neighbours of a particle if all were spread evenly. */
static double expected(const struct gbg_neighbours *neighbours, int64_t n, double reach)
{
    double share = neighbours->box.dimension == 2 ? 3.14159265358979 : 4.18879020478639;
    for (int a = 0; a < neighbours->box.dimension; a++) {
        share *= reach / neighbours->box.length[a];
    }
    return share * (double)n;
}

/* Cell edge in radii for auto. Cells of one radius are best where their 3^d hold enough candidates
 * to fill two vectors; fewer are had at the same price from larger cells, up to twice the radius;
 * where rows are long, cells of half a radius look at fewer. Measured: docs/physics.md. A set that
 * turned out to be crowded counts as dense as it was found to be. */
static double best_edge(const struct gbg_neighbours *neighbours, int64_t n, double reach)
{
    int dimension = neighbours->box.dimension;
    double each = expected(neighbours, n, reach) * fmax(1.0, neighbours->crowding);
    if (neighbours->kernels->search_edge) {
        return neighbours->kernels->search_edge(neighbours->device, dimension, each);
    }
    double candidates = each * (dimension == 2 ? 9.0 / 3.14159265358979 : 27.0 / 4.18879020478639);
    if (each >= (dimension == 2 ? 60.0 : 100.0)) {
        return 0.5;
    }
    double edge = dimension == 2 ? sqrt(24.0 / candidates) : cbrt(36.0 / candidates);
    return fmin(2.0, fmax(1.0, edge));
}

static struct gbg_search_plan choose(const struct gbg_neighbours *neighbours, int64_t n)
{
    /* sifting a list costs as much as finding the pairs in cells again: only on request */
    double skin = neighbours->listed ? neighbours->skin : 0.0, reach = neighbours->radius + skin;
    struct gbg_search_plan plan = {GBG_SEARCH_GRID, neighbours->radius, skin, 0.0};
    switch (neighbours->method) {
    case GBG_FIND_BRUTE:
        plan.method = GBG_SEARCH_BRUTE;
        break;
    case GBG_FIND_GRID:
        plan.edge = neighbours->number * reach;
        break;
    case GBG_FIND_OCTANT:
        plan.method = GBG_SEARCH_OCTANT;
        plan.edge = neighbours->number * reach;
        break;
    case GBG_FIND_OCCUPANCY:
        plan.method = GBG_SEARCH_OCCUPANCY;
        plan.edge = neighbours->number / sqrt((double)neighbours->box.dimension);
        break;
    default:
        plan.edge = best_edge(neighbours, n, reach) * reach;
    }
    return plan;
}

int gbg_neighbours_find(struct gbg_neighbours *neighbours, const struct gbg_points *points)
{
    const struct gbg_pair *crowded = &neighbours->report.crowded;
    neighbours->filled = 0;
    neighbours->n = points->n;
    neighbours->plan = choose(neighbours, points->n);
    int status = neighbours->kernels->search_update(neighbours->device, neighbours->search,
                                                    &neighbours->plan, points, &neighbours->report);
    if (status != GBG_OK) {
        return status;
    }
    if (crowded->first >= 0) {
        return gbg_fail(neighbours->context, GBG_E_OVERLAP,
                        "gbg_neighbours_update: particles %lld and %lld (from 0) are %.17g apart, "
                        "and the method occupancy:%g is for distances from %g: take grid or auto",
                        (long long)crowded->first, (long long)crowded->second, crowded->distance,
                        neighbours->number, neighbours->number);
    }
    neighbours->filled = 1;
    double even = expected(neighbours, points->n, neighbours->radius);
    neighbours->crowding =
        points->n > 1 ? (double)neighbours->report.rows / (double)points->n / even : 1.0;
    neighbours->updates++;
    neighbours->searches += neighbours->report.searched;
    return GBG_OK;
}

int gbg_neighbours_each(struct gbg_neighbours *neighbours, int base,
                        void (*batch)(void *user, int64_t n, const int32_t *first,
                                      const int32_t *second, const double *separation),
                        void *user)
{
    struct gbg_search_block block = {.capacity = BLOCK};
    void *memory;
    int dimension = neighbours->box.dimension;
    int status = gbg_allocate(neighbours->context, &memory, BLOCK, 8 + 8 * (size_t)dimension,
                              "pairs of a batch");
    if (status != GBG_OK) {
        return status;
    }
    block.separation = memory;
    block.first = (int32_t *)(block.separation + BLOCK * dimension);
    block.second = block.first + BLOCK;
    do {
        status = neighbours->kernels->search_block(neighbours->device, neighbours->search, &block);
        for (int64_t k = 0; k < block.count; k++) {
            block.first[k] += base;
            block.second[k] += base;
        }
        if (status == GBG_OK && block.count > 0) {
            batch(user, block.count, block.first, block.second, block.separation);
        }
    } while (status == GBG_OK && block.count > 0);
    gbg_release(memory);
    return status;
}

void gbg_neighbours_text(const struct gbg_neighbours *neighbours, size_t capacity, char *text)
{
    static const char *const names[GBG_SEARCH_METHODS] = {"brute", "grid", "octant", "occupancy"};
    const struct gbg_search_plan *plan = &neighbours->plan;
    if (plan->method == GBG_SEARCH_BRUTE) {
        snprintf(text, capacity, "brute");
        return;
    }
    char cells[80] = "";
    for (int a = 0, at = 0; a < neighbours->box.dimension; a++) {
        int64_t count = neighbours->report.cells[a];
        at += snprintf(cells + at, sizeof cells - (size_t)at, "%s%lld", a ? "x" : "",
                       (long long)count);
    }
    int at = snprintf(text, capacity, "%s, %s cells of %.3g radius", names[plan->method], cells,
                      neighbours->report.edge / plan->radius);
    if (plan->skin > 0.0 && at > 0 && (size_t)at < capacity) {
        snprintf(text + at, capacity - (size_t)at, ", list with skin %g (%s)", plan->skin,
                 neighbours->report.searched ? "made" : "kept");
    }
}
