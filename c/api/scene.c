/* L4: scenes: handles and arguments checked, then the scene room. */
#include "gamboge/scene.h"

#include "scene/options.h"
#include "scene/parts.h"

/* The message of a room gets the name of the call before it. */
static int named(struct gbg_context *context, const char *call, int status)
{
    if (status != GBG_OK) {
        gbg_message_prefix(context, "%s", call);
    }
    return status;
}

static int missing(struct gbg_context *context, const char *call, const char *argument)
{
    return gbg_fail(context, GBG_E_ARGUMENT, "%s: %s is NULL", call, argument);
}

int gbg_scene_create(struct gbg_context *context, int dimension, struct gbg_scene **scene)
{
    if (!context || !scene) {
        return missing(context, __func__, context ? "scene" : "context");
    }
    *scene = NULL;
    if (dimension != 2 && dimension != 3) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: dimension: %d given, allowed 2, 3", __func__,
                        dimension);
    }
    return named(context, __func__, gbg_scene_make(context, dimension, scene));
}

int gbg_scene_read(struct gbg_context *context, const char *path, struct gbg_scene **scene)
{
    if (!context || !path || !scene) {
        return missing(context, __func__, !context ? "context" : path ? "scene" : "path");
    }
    *scene = NULL;
    return gbg_scene_read_file(context, path, scene);
}

int gbg_scene_destroy(struct gbg_scene **scene)
{
    if (scene) {
        gbg_scene_release(*scene);
        *scene = NULL;
    }
    return GBG_OK;
}

static int find(const struct gbg_scene *scene, const char *call, const char *option,
                const void *value, const struct gbg_option **found)
{
    if (!scene) {
        return missing(NULL, call, "scene");
    }
    if (!option || !value) {
        return missing(scene->context, call, option ? "value" : "option");
    }
    return named(scene->context, call,
                 gbg_option_find(scene->context, gbg_scene_options, option, found));
}

int gbg_scene_set_real(struct gbg_scene *scene, const char *option, double value)
{
    const struct gbg_option *found;
    int status = find(scene, __func__, option, &value, &found);
    return status != GBG_OK ? status
                            : named(scene->context, __func__,
                                    gbg_option_set_real(scene->context, found, scene, value));
}

int gbg_scene_set_integer(struct gbg_scene *scene, const char *option, int64_t value)
{
    const struct gbg_option *found;
    int status = find(scene, __func__, option, &value, &found);
    return status != GBG_OK ? status
                            : named(scene->context, __func__,
                                    gbg_option_set_integer(scene->context, found, scene, value));
}

int gbg_scene_set_text(struct gbg_scene *scene, const char *option, const char *value)
{
    const struct gbg_option *found;
    int status = find(scene, __func__, option, value, &found);
    return status != GBG_OK ? status
                            : named(scene->context, __func__,
                                    gbg_option_set_text(scene->context, found, scene, value));
}

int gbg_scene_get_real(const struct gbg_scene *scene, const char *option, double *value)
{
    const struct gbg_option *found;
    int status = find(scene, __func__, option, value, &found);
    return status != GBG_OK ? status
                            : named(scene->context, __func__,
                                    gbg_option_get_real(scene->context, found, scene, value));
}

int gbg_scene_get_integer(const struct gbg_scene *scene, const char *option, int64_t *value)
{
    const struct gbg_option *found;
    int status = find(scene, __func__, option, value, &found);
    return status != GBG_OK ? status
                            : named(scene->context, __func__,
                                    gbg_option_get_integer(scene->context, found, scene, value));
}

int gbg_scene_get_text(const struct gbg_scene *scene, const char *option, int64_t capacity,
                       char *text)
{
    const struct gbg_option *found;
    int status = find(scene, __func__, option, text, &found);
    if (status != GBG_OK) {
        return status;
    }
    if (capacity < 1 || !gbg_option_format(found, scene, (size_t)capacity, text)) {
        return gbg_fail(scene->context, GBG_E_SPACE,
                        "%s: %s does not fit into %lld bytes, at most "
                        "%d are needed",
                        __func__, option, (long long)capacity, GBG_PATH_CAPACITY);
    }
    return GBG_OK;
}

int gbg_scene_option(int index, const char **line)
{
    if (!line) {
        return missing(NULL, __func__, "line");
    }
    int count = 0;
    while (gbg_scene_options[count].name) {
        count++;
    }
    if (index < 0 || index >= count) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "%s: index: %d given, allowed 0..%d", __func__, index,
                        count - 1);
    }
    *line = gbg_scene_options[index].line;
    return GBG_OK;
}

int gbg_scene_set_box(struct gbg_scene *scene, const double *lengths, const double *origin)
{
    if (!scene || !lengths) {
        return missing(scene ? scene->context : NULL, __func__, scene ? "lengths" : "scene");
    }
    return named(scene->context, __func__, gbg_box_give(scene, lengths, origin));
}

int gbg_scene_get_box(const struct gbg_scene *scene, int *dimension, double *lengths,
                      double *origin)
{
    if (!scene) {
        return missing(NULL, __func__, "scene");
    }
    struct gbg_scene resolved = *scene;
    if (scene->packing > 0 || scene->length[0] == 0) {
        int status = gbg_scene_resolve(&resolved);
        if (status != GBG_OK) {
            return named(scene->context, __func__, status);
        }
    }
    if (dimension) {
        *dimension = scene->dimension;
    }
    for (int a = 0; a < scene->dimension; a++) {
        if (lengths) {
            lengths[a] = resolved.length[a];
        }
        if (origin) {
            origin[a] = resolved.origin[a];
        }
    }
    return GBG_OK;
}

/* A value of a species or force by the table of its keys. */
static int put(struct gbg_scene *scene, const struct gbg_option *table, void *base,
               const char *name, double value)
{
    const struct gbg_option *option;
    int status = gbg_option_find(scene->context, table, name, &option);
    return status != GBG_OK ? status : gbg_option_set_real(scene->context, option, base, value);
}

static int fill_species(struct gbg_scene *scene, struct gbg_species *species, double fraction,
                        int64_t count)
{
    const struct gbg_option *asked;
    const double value[3] = {species->diameter, species->alpha, species->mobility};
    static const char *const names[3] = {"diameter", "alpha", "mobility"};
    int status = GBG_OK;
    for (int i = 0; i < 3 && status == GBG_OK; i++) {
        status = put(scene, gbg_species_options, species, names[i], value[i]);
    }
    if (status == GBG_OK && fraction != -1) {
        status = put(scene, gbg_species_options, species, "fraction", fraction);
    }
    if (status == GBG_OK && count != -1) {
        status = gbg_option_find(scene->context, gbg_species_options, "count", &asked);
        if (status == GBG_OK) {
            status = gbg_option_set_integer(scene->context, asked, species, count);
        }
    }
    return status;
}

int gbg_scene_add_species(struct gbg_scene *scene, const char *name, double diameter, double alpha,
                          double mobility, double fraction, int64_t count, int *species)
{
    if (!scene) {
        return missing(NULL, __func__, "scene");
    }
    struct gbg_species added = {
        .diameter = diameter, .alpha = alpha, .mobility = mobility, .fraction = -1, .asked = -1};
    const struct gbg_option *option;
    int status = gbg_option_find(scene->context, gbg_species_options, "name", &option);
    if (status == GBG_OK && name) {
        status = gbg_option_set_text(scene->context, option, &added, name);
    }
    if (status == GBG_OK) {
        status = fill_species(scene, &added, fraction, count);
    }
    if (status == GBG_OK) {
        status = gbg_species_add(scene, &added);
    }
    if (status == GBG_OK && species) {
        *species = scene->n_species - 1;
    }
    return named(scene->context, __func__, status);
}

int gbg_scene_add_force(struct gbg_scene *scene, double power, const char *sum, double cutoff,
                        double tolerance)
{
    if (!scene) {
        return missing(NULL, __func__, "scene");
    }
    struct gbg_force force = {0};
    const struct gbg_option *option;
    gbg_option_defaults(gbg_force_options, &force);
    int status = gbg_option_find(scene->context, gbg_force_options, "sum", &option);
    if (status == GBG_OK && sum) {
        status = gbg_option_set_text(scene->context, option, &force, sum);
    }
    const double value[3] = {power, cutoff, tolerance};
    static const char *const names[3] = {"power", "cutoff", "tolerance"};
    for (int i = 0; i < 3 && status == GBG_OK; i++) {
        status = put(scene, gbg_force_options, &force, names[i], value[i]);
    }
    if (status == GBG_OK) {
        status = gbg_force_add(scene, &force);
    }
    return named(scene->context, __func__, status);
}

int gbg_scene_set_force(struct gbg_scene *scene, int force, const char *option, const char *value)
{
    if (!scene || !option || !value) {
        return missing(scene ? scene->context : NULL, __func__,
                       !scene   ? "scene"
                       : option ? "value"
                                : "option");
    }
    if (force < 0 || force >= scene->n_forces) {
        return gbg_fail(scene->context, GBG_E_ARGUMENT,
                        "%s: force %d is not one of the %d (counted from 0)", __func__, force,
                        scene->n_forces);
    }
    struct gbg_force changed = scene->force[force];
    const struct gbg_option *found;
    int status = gbg_option_find(scene->context, gbg_force_options, option, &found);
    status = status ? status : gbg_option_parse(scene->context, found, &changed, value);
    status = status ? status : gbg_force_check(scene, &changed);
    if (status == GBG_OK) {
        scene->force[force] = changed;
    }
    return named(scene->context, __func__, status);
}

int gbg_scene_add_particles(struct gbg_scene *scene, int64_t n, const double *x, const double *y,
                            const double *z, ptrdiff_t step, const int32_t *species, int base,
                            const int64_t *ids)
{
    if (!scene) {
        return missing(NULL, __func__, "scene");
    }
    if (n < 0 || n > GBG_MOST_PARTICLES) {
        return gbg_fail(scene->context, GBG_E_ARGUMENT, "%s: n: %lld given, allowed 0..2147483647",
                        __func__, (long long)n);
    }
    if (n > 0 && (!x || !y || (!z && scene->dimension == 3))) {
        return missing(scene->context, __func__, !x ? "x" : !y ? "y" : "z");
    }
    if (base != 0 && base != 1) {
        return gbg_fail(scene->context, GBG_E_ARGUMENT, "%s: base: %d given, allowed 0, 1",
                        __func__, base);
    }
    if (n > 1 && step == 0) {
        return gbg_fail(scene->context, GBG_E_ARGUMENT,
                        "%s: step: 0 given, allowed any other for more than one particle",
                        __func__);
    }
    struct gbg_points points = {.n = n, .base = {x, y, z}, .step = step};
    return named(scene->context, __func__, gbg_particles_add(scene, &points, species, base, ids));
}

int gbg_scene_check(struct gbg_scene *scene)
{
    if (!scene) {
        return missing(NULL, __func__, "scene");
    }
    struct gbg_scene resolved = *scene;
    return named(scene->context, __func__, gbg_scene_resolve_known(&resolved));
}
