/* Side room io: start configurations from trajectories and restart files. */
#include "io/start_file.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <string.h>
#include <unistd.h>

#include "core/file.h"
#include "core/view.h"
#include "io/reader.h"
#include "io/restart.h"

enum kind { KIND_TRAJECTORY, KIND_RESTART, KIND_TEXT };

/* The box that a file has, for scenes without one. */
struct found_box {
    int known;
    double length[3], origin[3];
};

static int detect(struct gbg_scene *scene, enum kind *kind)
{
    char text[GBG_ERROR_TEXT];
    unsigned char first[8] = {0};
    int descriptor = open(scene->start_file, O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) {
        return gbg_fail(scene->context, GBG_E_FILE, "%s: cannot open it: %s", scene->start_file,
                        gbg_file_error(errno, text));
    }
    int number = gbg_file_read(descriptor, first, sizeof first, 0);
    close(descriptor);
    if (number > 0) {
        return gbg_fail(scene->context, GBG_E_FILE, "%s: cannot read it: %s", scene->start_file,
                        gbg_file_error(number, text));
    }
    *kind = KIND_TEXT;
    if (memcmp(first, "CDF", 3) == 0 || memcmp(first, "\211HDF", 4) == 0) {
        *kind = KIND_TRAJECTORY;
    } else if (memcmp(first, GBG_RESTART_MAGIC, sizeof first) == 0) {
        *kind = KIND_RESTART;
    }
    return GBG_OK;
}

static int check_dimension(struct gbg_scene *scene, int dimension)
{
    if (dimension == scene->dimension) {
        return GBG_OK;
    }
    return gbg_fail(scene->context, GBG_E_SCENE, "%s: it has %d dimensions, the scene %d",
                    scene->start_file, dimension, scene->dimension);
}

/* map[s]: species of the scene for species s of the file. */
static void map_species(struct gbg_scene *scene, int n_species, int by_name,
                        char name[][GBG_NAME_CAPACITY], int map[GBG_MAX_SPECIES])
{
    for (int s = 0; s < n_species; s++) {
        map[s] = !by_name && s < scene->n_species ? s : -1;
        for (int t = 0; by_name && t < scene->n_species; t++) {
            map[s] = strcmp(name[s], scene->species[t].name) == 0 ? t : map[s];
        }
    }
}

/* Turns species of the file into those of the scene; only those that occur must be there. */
static int apply_map(struct gbg_scene *scene, struct gbg_particles *particles, int n_species,
                     char name[][GBG_NAME_CAPACITY], const int map[GBG_MAX_SPECIES])
{
    for (int64_t i = 0; i < particles->n; i++) {
        int32_t s = particles->species[i];
        if (s < 0 || s >= n_species) {
            return gbg_fail(scene->context, GBG_E_FORMAT,
                            "%s: particle %" PRId64 " is of species "
                            "%d, and the file has %d",
                            scene->start_file, i, (int)s + 1, n_species);
        }
        if (map[s] < 0) {
            return gbg_fail(scene->context, GBG_E_SCENE,
                            "%s: particle %" PRId64 " is of species "
                            "%d (%s), which the scene with its %d species does not have",
                            scene->start_file, i, (int)s + 1, name[s], scene->n_species);
        }
        particles->species[i] = map[s];
    }
    return GBG_OK;
}

static int read_frame(struct gbg_scene *scene, struct gbg_reader *reader,
                      struct gbg_particles *particles, struct found_box *box)
{
    int map[GBG_MAX_SPECIES];
    double time;
    int64_t step, frame = scene->start_frame < 0 ? reader->frames - 1 : scene->start_frame;
    int status = check_dimension(scene, reader->dimension);
    if (status != GBG_OK) {
        return status;
    }
    if (frame < 0 || frame >= reader->frames) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "%s: frame %" PRId64 " was asked for, and it "
                        "has %" PRId64 " (counted from 0)",
                        scene->start_file, scene->start_frame, reader->frames);
    }
    status =
        gbg_particles_allocate(scene->context, reader->particles, reader->dimension, particles);
    if (status == GBG_OK) {
        status = gbg_reader_frame(reader, frame, &time, &step, box->length, box->origin);
    }
    if (status == GBG_OK) {
        status = gbg_reader_positions(reader, frame, particles->position, 1);
    }
    if (status == GBG_OK) {
        status = gbg_reader_ids(reader, particles->id);
    }
    if (status == GBG_OK) {
        box->known = 1;
        memcpy(particles->species, reader->species, (size_t)particles->n * sizeof(int32_t));
        map_species(scene, reader->n_species, reader->has_names, reader->name, map);
        status = apply_map(scene, particles, reader->n_species, reader->name, map);
    }
    return status;
}

static int read_trajectory(struct gbg_scene *scene, struct gbg_particles *particles,
                           struct found_box *box)
{
    struct gbg_reader *reader;
    int status = gbg_reader_open(scene->context, scene->start_file, &reader);
    if (status == GBG_OK) {
        status = read_frame(scene, reader, particles, box);
        gbg_reader_close(reader);
    }
    return status;
}

static int take_restart(struct gbg_scene *scene, struct gbg_restart *restart,
                        struct gbg_particles *particles, struct found_box *found)
{
    int map[GBG_MAX_SPECIES];
    int status = check_dimension(scene, restart->dimension);
    if (status == GBG_OK) {
        status = gbg_particles_allocate(scene->context, restart->n, restart->dimension, particles);
    }
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_box box = gbg_box_make(restart->dimension, restart->length, restart->origin);
    for (int a = 0; a < restart->dimension; a++) {
        found->length[a] = restart->length[a];
        found->origin[a] = restart->origin[a];
        for (int64_t i = 0; i < restart->n; i++) {
            particles->position[a][i] = gbg_box_decode(&box, a, restart->fraction[a][i]);
        }
    }
    found->known = 1;
    memcpy(particles->id, restart->id, (size_t)restart->n * sizeof(int64_t));
    memcpy(particles->species, restart->species, (size_t)restart->n * sizeof(int32_t));
    map_species(scene, restart->n_species, 1, restart->name, map);
    return apply_map(scene, particles, restart->n_species, restart->name, map);
}

static int read_restart(struct gbg_scene *scene, struct gbg_particles *particles,
                        struct found_box *box)
{
    struct gbg_restart restart;
    int status = gbg_restart_read(scene->context, scene->start_file, &restart);
    if (status == GBG_OK) {
        status = take_restart(scene, &restart, particles, box);
    }
    gbg_restart_release(&restart);
    return status;
}

static void take_box(struct gbg_scene *scene, const struct found_box *box)
{
    if (!box->known) {
        return;
    }
    if (scene->length[0] == 0.0 && scene->packing == 0.0) {
        memcpy(scene->length, box->length, sizeof box->length);
        memcpy(scene->origin, box->origin, sizeof box->origin);
        return;
    }
    for (int a = 0; a < scene->dimension; a++) {
        if (scene->length[a] != 0.0 && scene->length[a] != box->length[a]) {
            gbg_log(scene->context, GBG_LOG_WARNING,
                    "%s: its box is %.17g long on axis %d, the "
                    "scene's %.17g; particles are wrapped into the scene's",
                    scene->start_file, box->length[a], a + 1, scene->length[a]);
        }
    }
}

static int read_kind(struct gbg_scene *scene, enum kind kind, struct gbg_particles *particles,
                     struct found_box *box)
{
    if (kind == KIND_TEXT) {
        return gbg_io_read_text(scene, particles);
    }
    return kind == KIND_TRAJECTORY ? read_trajectory(scene, particles, box)
                                   : read_restart(scene, particles, box);
}

static int add(struct gbg_scene *scene, const struct gbg_particles *particles)
{
    struct gbg_points points = {.n = particles->n, .step = 1};
    for (int a = 0; a < scene->dimension; a++) {
        points.base[a] = particles->position[a];
    }
    int status = gbg_particles_add(scene, &points, particles->species, 0, particles->id);
    if (status != GBG_OK) {
        gbg_message_prefix(scene->context, "%s", scene->start_file);
    }
    return status;
}

int gbg_io_read_start(struct gbg_scene *scene)
{
    enum kind kind;
    struct gbg_particles particles = {0};
    struct found_box box = {0};
    if (scene->arrays.n > 0) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "%s: the scene already has %" PRId64
                        " particles from arrays; give them or a start file, not both",
                        scene->start_file, scene->arrays.n);
    }
    int status = detect(scene, &kind);
    if (status == GBG_OK) {
        status = read_kind(scene, kind, &particles, &box);
    }
    if (status == GBG_OK) {
        status = add(scene, &particles);
    }
    if (status == GBG_OK) {
        take_box(scene, &box);
    }
    gbg_particles_release(&particles);
    return status;
}
