/* L3: arrays of particles: made, released, added to, taken as a start. */
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "scene/parts.h"

int gbg_particles_allocate(struct gbg_context *context, int64_t n, int dimension,
                           struct gbg_particles *particles)
{
    *particles = (struct gbg_particles){.n = n, .dimension = dimension};
    int status = GBG_OK;
    for (int a = 0; a < dimension && status == GBG_OK; a++) {
        status = gbg_allocate(context, (void **)&particles->position[a], n, sizeof(double),
                              "coordinates of the start");
    }
    if (status == GBG_OK) {
        status = gbg_allocate(context, (void **)&particles->species, n, sizeof(int32_t),
                              "species of the start");
    }
    if (status == GBG_OK) {
        status =
            gbg_allocate(context, (void **)&particles->id, n, sizeof(int64_t), "ids of the start");
    }
    if (status != GBG_OK) {
        gbg_particles_release(particles);
    }
    return status;
}

void gbg_particles_release(struct gbg_particles *particles)
{
    for (int a = 0; a < 3; a++) {
        gbg_release(particles->position[a]);
    }
    gbg_release(particles->species);
    gbg_release(particles->id);
    *particles = (struct gbg_particles){0};
}

/* Arrays that are added to grow by powers of two, so their room follows from their number. */
static int64_t room(int64_t n)
{
    int64_t capacity = n > 0 ? 64 : 0;
    while (capacity < n) {
        capacity *= 2;
    }
    return capacity;
}

static int make_room(struct gbg_context *context, int64_t n, int dimension,
                     struct gbg_particles *particles)
{
    if (room(particles->n) >= n) {
        return GBG_OK;
    }
    struct gbg_particles larger;
    int status = gbg_particles_allocate(context, room(n), dimension, &larger);
    if (status != GBG_OK) {
        return status;
    }
    larger.n = particles->n;
    size_t old = (size_t)particles->n;
    for (int a = 0; old && a < dimension; a++) {
        memcpy(larger.position[a], particles->position[a], old * sizeof(double));
    }
    if (old) {
        memcpy(larger.species, particles->species, old * sizeof(int32_t));
        memcpy(larger.id, particles->id, old * sizeof(int64_t));
    }
    gbg_particles_release(particles);
    *particles = larger;
    return GBG_OK;
}

static int compare_ids(const void *a, const void *b)
{
    int64_t first = *(const int64_t *)a, second = *(const int64_t *)b;
    return (first > second) - (first < second);
}

/* Refuses an id that occurs twice among the old and the new ones, by sorting a copy of them all. */
static int check_distinct(struct gbg_context *context, const struct gbg_particles *old, int64_t n,
                          const int64_t *ids)
{
    int64_t *all;
    int64_t total = old->n + n;
    int status = gbg_allocate(context, (void **)&all, total, sizeof *all, "sorted ids");
    if (status != GBG_OK) {
        return status;
    }
    if (old->n) {
        memcpy(all, old->id, (size_t)old->n * sizeof *all);
    }
    memcpy(all + old->n, ids, (size_t)n * sizeof *all);
    qsort(all, (size_t)total, sizeof *all, compare_ids);
    for (int64_t i = 1; i < total && status == GBG_OK; i++) {
        if (all[i] == all[i - 1]) {
            status = gbg_fail(context, GBG_E_ARGUMENT,
                              "id %" PRId64 " is given twice, allowed once", all[i]);
        }
    }
    gbg_release(all);
    return status;
}

static int check_ids(const struct gbg_scene *scene, int64_t n, const int64_t *ids, int64_t *next)
{
    struct gbg_context *context = scene->context;
    int ascending = 1;
    *next = scene->next_id;
    for (int64_t i = 0; i < n; i++) {
        if (ids[i] < 0 || ids[i] > GBG_LARGEST_ID) {
            return gbg_fail(context, GBG_E_ARGUMENT,
                            "id %" PRId64 " of particle %" PRId64 " given, allowed 0..%" PRId64,
                            ids[i], i, GBG_LARGEST_ID);
        }
        ascending &= ids[i] >= *next;
        *next = ids[i] >= *next ? ids[i] + 1 : *next;
    }
    return ascending ? GBG_OK : check_distinct(context, &scene->arrays, n, ids);
}

static int check_block(struct gbg_context *context, const struct gbg_scene *scene,
                       const struct gbg_points *points, const int32_t *species, int base)
{
    if (points->n > GBG_MOST_PARTICLES - scene->arrays.n) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "%" PRId64 " particles more than the %" PRId64
                        " there are, allowed %" PRId64 " in all",
                        points->n, scene->arrays.n, GBG_MOST_PARTICLES);
    }
    int64_t bad = gbg_points_first_bad(points, scene->dimension);
    if (bad >= 0) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "a coordinate of particle %" PRId64 " is not finite", bad + base);
    }
    for (int64_t i = 0; species && i < points->n; i++) {
        if (species[i] < base || species[i] - base >= GBG_MAX_SPECIES) {
            return gbg_fail(context, GBG_E_ARGUMENT,
                            "species %d of particle %" PRId64 " given, allowed %d..%d",
                            (int)species[i], i + base, base, base + GBG_MAX_SPECIES - 1);
        }
    }
    return GBG_OK;
}

int gbg_particles_add(struct gbg_scene *scene, const struct gbg_points *points,
                      const int32_t *species, int base, const int64_t *ids)
{
    struct gbg_context *context = scene->context;
    struct gbg_particles *arrays = &scene->arrays;
    int64_t n = points->n, first = arrays->n, next = scene->next_id + n;
    int status = check_block(context, scene, points, species, base);
    if (status == GBG_OK && ids) {
        status = check_ids(scene, n, ids, &next);
    } else if (status == GBG_OK && next > GBG_LARGEST_ID + 1) {
        status = gbg_fail(context, GBG_E_ARGUMENT, "no %" PRId64 " ids are left below %" PRId64, n,
                          GBG_LARGEST_ID);
    }
    if (status == GBG_OK) {
        status = make_room(context, first + n, scene->dimension, arrays);
    }
    if (status != GBG_OK) {
        return status;
    }
    for (int64_t i = 0; i < n; i++) {
        for (int a = 0; a < scene->dimension; a++) {
            arrays->position[a][first + i] = gbg_point(points, a, i);
        }
        arrays->species[first + i] = species ? species[i] - base : 0;
        arrays->id[first + i] = ids ? ids[i] : scene->next_id + i;
    }
    arrays->n = first + n;
    arrays->dimension = scene->dimension;
    scene->next_id = next;
    scene->start = GBG_START_ARRAYS;
    return GBG_OK;
}

double gbg_wrap(double r, double origin, double length)
{
    if (r >= origin && r < origin + length) {
        return r;
    }
    double offset = fmod(fmod(r, length) - fmod(origin, length), length);
    if (offset < 0) {
        offset += length;
    }
    double wrapped = origin + (offset < length ? offset : 0);
    return wrapped < origin + length ? wrapped : origin;
}

struct rank {
    int64_t id, from;
};

static int compare_ranks(const void *a, const void *b)
{
    return compare_ids(&((const struct rank *)a)->id, &((const struct rank *)b)->id);
}

int gbg_start_arrays(struct gbg_scene *scene, struct gbg_particles *particles)
{
    const struct gbg_particles *arrays = &scene->arrays;
    struct rank *rank;
    int64_t n = arrays->n;
    int status = gbg_allocate(scene->context, (void **)&rank, n, sizeof *rank, "order of ids");
    if (status == GBG_OK) {
        status = gbg_particles_allocate(scene->context, n, scene->dimension, particles);
        if (status != GBG_OK) {
            gbg_release(rank);
        }
    }
    if (status != GBG_OK) {
        return status;
    }
    for (int64_t i = 0; i < n; i++) {
        rank[i] = (struct rank){arrays->id[i], i};
    }
    qsort(rank, (size_t)n, sizeof *rank, compare_ranks);
    for (int64_t i = 0; i < n; i++) {
        int64_t from = rank[i].from;
        for (int a = 0; a < scene->dimension; a++) {
            particles->position[a][i] =
                gbg_wrap(arrays->position[a][from], scene->origin[a], scene->length[a]);
        }
        particles->species[i] = arrays->species[from];
        particles->id[i] = rank[i].id;
    }
    gbg_release(rank);
    return GBG_OK;
}
