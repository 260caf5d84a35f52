/* L3: a scene file made a scene: the texts of its keys go through the table of keys. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "core/memory.h"
#include "core/text.h"
#include "scene/file_shape.h"
#include "scene/options.h"
#include "scene/parts.h"

enum { MOST_BYTES = 1 << 20 };

struct reading {
    struct gbg_context *context;
    struct gbg_lines lines;
    struct gbg_file_scene *file;
    struct gbg_scene *scene;
};

/* Puts the line of a path before the message. */
static int at_line(const struct reading *reading, const char *path, int status)
{
    if (status != GBG_OK) {
        gbg_message_prefix(reading->context, "%d", gbg_lines_find(&reading->lines, path));
    }
    return status;
}

static void join(char *path, size_t capacity, const char *outer, const char *key)
{
    snprintf(path, capacity, "%s%s%s", outer, outer[0] ? "." : "", key);
}

/* A value by the table; messages name the whole path instead of the key alone. */
static int apply_text(const struct reading *reading, const struct gbg_option *table,
                      const char *outer, const char *key, const char *text, void *base)
{
    const struct gbg_option *found;
    char path[2 * GBG_KEY_CAPACITY];
    join(path, sizeof path, outer, key);
    int status =
        gbg_option_find(reading->context, table, table == gbg_scene_options ? path : key, &found);
    if (status == GBG_OK) {
        struct gbg_option option = *found;
        option.name = path;
        status = gbg_option_parse(reading->context, &option, base, text);
    }
    return at_line(reading, path, status);
}

/* All single values of a block and of the blocks inside it that the file gives. */
static int apply_fields(const struct reading *reading, const struct gbg_option *table,
                        const cyaml_schema_field_t *fields, const char *data, const char *outer,
                        void *base)
{
    int status = GBG_OK;
    for (const cyaml_schema_field_t *f = fields; f->key && status == GBG_OK; f++) {
        if (f->value.type == CYAML_MAPPING) {
            char path[GBG_KEY_CAPACITY];
            join(path, sizeof path, outer, f->key);
            status = apply_fields(reading, table, f->value.mapping.fields, data + f->data_offset,
                                  path, base);
        } else if (f->value.type == CYAML_STRING) {
            const char *text;
            memcpy(&text, data + f->data_offset, sizeof text);
            if (text && strcmp(f->key, "dimension") != 0) { /* the scene was made with it */
                status = apply_text(reading, table, outer, f->key, text, base);
            }
        }
    }
    return status;
}

static int refuse(const struct reading *reading, const char *path, const char *what)
{
    return at_line(reading, path, gbg_fail(reading->context, GBG_E_SCENE, "%s: %s", path, what));
}

/* Dimension: as given, else the length of box.size, else 2. */
static int find_dimension(const struct reading *reading, int *dimension)
{
    const struct gbg_file_scene *file = reading->file;
    const struct gbg_file_box *box = &file->box;
    *dimension = box->size_count ? (int)box->size_count : 2;
    if (file->dimension) {
        *dimension = strcmp(file->dimension, "2") == 0   ? 2
                     : strcmp(file->dimension, "3") == 0 ? 3
                                                         : 0;
        if (*dimension == 0) {
            return at_line(reading, "dimension",
                           gbg_fail(reading->context, GBG_E_ARGUMENT,
                                    "dimension: \"%.80s\" given, allowed 2, 3", file->dimension));
        }
    }
    if (*dimension != 2 && *dimension != 3) {
        return at_line(reading, "box.size",
                       gbg_fail(reading->context, GBG_E_ARGUMENT,
                                "box.size: %d lengths given, allowed 2, 3", *dimension));
    }
    return GBG_OK;
}

/* A list with one entry an axis. */
static int check_axes(const struct reading *reading, const char *path, uint32_t given)
{
    if (given == 0 && gbg_lines_has(&reading->lines, path)) {
        return refuse(reading, path, "an empty list given, allowed one entry an axis");
    }
    if (given > 0 && given != (uint32_t)reading->scene->dimension) {
        return at_line(reading, path,
                       gbg_fail(reading->context, GBG_E_ARGUMENT,
                                "%s: %u entries given, allowed %d", path, given,
                                reading->scene->dimension));
    }
    return GBG_OK;
}

static int read_axes(const struct reading *reading, const char *path, char *const *texts,
                     uint32_t given, double *values)
{
    int status = check_axes(reading, path, given);
    for (uint32_t a = 0; a < given && status == GBG_OK; a++) {
        double value;
        struct gbg_option axis = {
            .name = path, .type = GBG_REAL, .size = sizeof value, .range = "[-1e100, 1e100]"};
        status =
            at_line(reading, path, gbg_option_parse(reading->context, &axis, &values[a], texts[a]));
    }
    return status;
}

static int check_boundary(const struct reading *reading)
{
    const struct gbg_file_box *box = &reading->file->box;
    int status = check_axes(reading, "box.boundary", box->boundary_count);
    for (uint32_t a = 0; a < box->boundary_count && status == GBG_OK; a++) {
        if (strcmp(box->boundary[a], "periodic") != 0) {
            status = at_line(reading, "box.boundary",
                             gbg_fail(reading->context, GBG_E_NAME,
                                      "box.boundary: \"%.80s\" given, allowed periodic in this "
                                      "version",
                                      box->boundary[a]));
        }
    }
    return status;
}

static int apply_box(const struct reading *reading)
{
    const struct gbg_file_box *box = &reading->file->box;
    double length[3] = {1, 1, 1}, origin[3] = {0};
    int status = read_axes(reading, "box.size", box->size, box->size_count, length);
    if (status == GBG_OK) {
        status = check_boundary(reading);
    }
    if (status == GBG_OK) {
        status = read_axes(reading, "box.origin", box->origin, box->origin_count, origin);
    }
    if (status == GBG_OK && box->packing && box->size_count) {
        status = refuse(reading, "box.packing", "given beside box.size, allowed one of the two");
    }
    if (status == GBG_OK && box->size_count) {
        status = at_line(reading, "box.size", gbg_box_give(reading->scene, length, origin));
    }
    for (int a = 0; a < 3 && status == GBG_OK; a++) {
        reading->scene->origin[a] = origin[a];
    }
    return status;
}

static int apply_species(const struct reading *reading)
{
    const struct gbg_file_particles *particles = &reading->file->particles;
    int status = GBG_OK;
    for (uint32_t s = 0; s < particles->species_count && status == GBG_OK; s++) {
        char path[GBG_KEY_CAPACITY];
        struct gbg_species species = {.fraction = -1, .asked = -1};
        gbg_option_defaults(gbg_species_options, &species);
        snprintf(path, sizeof path, "particles.species[%u]", s);
        status = apply_fields(reading, gbg_species_options, gbg_file_species_fields,
                              (const char *)&particles->species[s], path, &species);
        if (status == GBG_OK) {
            status = at_line(reading, path, gbg_species_add(reading->scene, &species));
        }
    }
    return status;
}

static int apply_forces(const struct reading *reading)
{
    int status = GBG_OK;
    for (uint32_t k = 0; k < reading->file->forces_count && status == GBG_OK; k++) {
        char path[GBG_KEY_CAPACITY];
        const struct gbg_file_force *given = &reading->file->forces[k];
        struct gbg_force force = {0};
        gbg_option_defaults(gbg_force_options, &force);
        snprintf(path, sizeof path, "forces[%u]", k);
        status = apply_fields(reading, gbg_force_options, gbg_file_force_fields,
                              (const char *)given, path, &force);
        if (status == GBG_OK && !given->power) {
            return refuse(reading, path, "power is missing");
        }
        if (given->cutoff && !given->sum) {
            force.sum = GBG_SUM_CUTOFF;
        }
        if (status == GBG_OK) {
            status = at_line(reading, path, gbg_force_add(reading->scene, &force));
        }
    }
    return status;
}

/* What the mere presence of a block means, and keys that exclude each other. */
static int apply_blocks(const struct reading *reading)
{
    const struct gbg_file_start *start = &reading->file->particles.start;
    struct gbg_scene *scene = reading->scene;
    if ((start->lattice != NULL) + (start->random != NULL) + (start->file != NULL) > 1) {
        return refuse(reading, "particles.start",
                      "two kinds of start given, allowed one of lattice, random, file");
    }
    if (gbg_lines_has(&reading->lines, "excluded_volume") && !reading->file->excluded_volume.rule) {
        scene->rule = GBG_RULE_AUTO;
    }
    if (gbg_lines_has(&reading->lines, "dynamics") && !reading->file->dynamics.kind) {
        scene->dynamics = GBG_DYNAMICS_BROWNIAN;
    }
    return GBG_OK;
}

/* The scene as a whole; its messages begin with a path. A scene without a start may get particles
 * by calls. */
static int check_whole(const struct reading *reading)
{
    struct gbg_scene resolved = *reading->scene;
    if (resolved.start == GBG_START_NONE) {
        resolved.start = GBG_START_FILE;
    }
    int status = gbg_scene_resolve_known(&resolved);
    char path[GBG_KEY_CAPACITY];
    gbg_text_copy(path, sizeof path, gbg_message_of(reading->context));
    path[strcspn(path, ": ")] = 0;
    return at_line(reading, path, status);
}

static int build(struct reading *reading)
{
    int dimension = 0, status = find_dimension(reading, &dimension);
    if (status == GBG_OK) {
        status = gbg_scene_make(reading->context, dimension, &reading->scene);
        at_line(reading, "", status);
    }
    if (status == GBG_OK) {
        status = apply_fields(reading, gbg_scene_options, gbg_file_schema.mapping.fields,
                              (const char *)reading->file, "", reading->scene);
    }
    int (*const steps[])(const struct reading *) = {apply_box, apply_species, apply_forces,
                                                    apply_blocks, check_whole};
    for (size_t i = 0; i < sizeof steps / sizeof *steps && status == GBG_OK; i++) {
        status = steps[i](reading);
    }
    return status;
}

static int read_bytes(struct gbg_context *context, const char *path, unsigned char **text,
                      size_t *bytes)
{
    char error[GBG_ERROR_TEXT];
    FILE *stream = fopen(path, "rb");
    if (!stream) {
        return gbg_fail(context, GBG_E_FILE, "cannot open the scene file: %s",
                        gbg_file_error(errno, error));
    }
    int status = gbg_allocate(context, (void **)text, MOST_BYTES + 1, 1, "a scene file");
    if (status == GBG_OK) {
        *bytes = fread(*text, 1, MOST_BYTES + 1, stream);
        if (ferror(stream)) {
            status = gbg_fail(context, GBG_E_FILE, "cannot read the scene file: %s",
                              gbg_file_error(errno, error));
        } else if (*bytes > MOST_BYTES) {
            status = gbg_fail(context, GBG_E_FORMAT,
                              "1: more than %d bytes given, allowed at most that in a scene file",
                              MOST_BYTES);
        }
    }
    fclose(stream);
    return status;
}

static int read_text(struct reading *reading, const unsigned char *text, size_t bytes)
{
    int status = gbg_lines_read(reading->context, text, bytes, &reading->lines);
    if (status == GBG_OK) {
        status = gbg_shape_read(reading->context, text, bytes, &reading->lines, &reading->file);
    }
    if (status == GBG_OK && !reading->file) {
        status = gbg_fail(reading->context, GBG_E_SCENE,
                          "1: scene: nothing given, allowed a block with box and particles");
    }
    return status == GBG_OK ? build(reading) : status;
}

/* A message is one line of printable text, whatever bytes the file had; it begins with the file. */
static void finish_message(struct gbg_context *context, const char *path)
{
    const char *rest = gbg_message_of(context);
    size_t digits = strspn(rest, "0123456789");
    char clean[GBG_MESSAGE_CAPACITY];
    snprintf(clean, sizeof clean, "%.700s%s%s", path, digits && rest[digits] == ':' ? ":" : ": ",
             rest);
    for (char *c = clean; *c; c++) {
        *c = (unsigned char)*c < ' ' || *c == 127 ? '?' : *c;
    }
    gbg_fail(context, GBG_OK, "%s", clean);
}

int gbg_scene_read_file(struct gbg_context *context, const char *path, struct gbg_scene **scene)
{
    struct reading reading = {.context = context};
    unsigned char *text = NULL;
    size_t bytes = 0;
    int status = read_bytes(context, path, &text, &bytes);
    if (status == GBG_OK) {
        status = read_text(&reading, text, bytes);
    }
    if (status == GBG_OK) {
        gbg_text_copy(reading.scene->source, sizeof reading.scene->source, path);
    } else {
        finish_message(context, path);
        gbg_scene_release(reading.scene);
        reading.scene = NULL;
    }
    gbg_shape_release(context, reading.file);
    gbg_lines_release(&reading.lines);
    gbg_release(text);
    *scene = reading.scene;
    return status;
}
