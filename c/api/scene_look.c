/* L4: what a scene holds: its species and forces, read back. */
#include <string.h>

#include "core/context.h"
#include "core/text.h"
#include "scene/scene.h"

static const char *sum_name(int sum)
{
    switch (sum) {
    case GBG_SUM_CUTOFF:
        return "cutoff";
    case GBG_SUM_LATTICE:
        return "lattice";
    default:
        return "minimum_image";
    }
}

int gbg_scene_size(const struct gbg_scene *scene, int *n_species, int *n_forces)
{
    if (!scene) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "gbg_scene_size: scene is NULL");
    }
    if (n_species) {
        *n_species = scene->n_species;
    }
    if (n_forces) {
        *n_forces = scene->n_forces;
    }
    return GBG_OK;
}

int gbg_scene_get_species(const struct gbg_scene *scene, int species, int64_t capacity, char *name,
                          double *diameter, double *alpha, double *mobility, int64_t *count)
{
    if (!scene) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "gbg_scene_get_species: scene is NULL");
    }
    if (species < 0 || species >= scene->n_species) {
        return gbg_fail(scene->context, GBG_E_ARGUMENT,
                        "gbg_scene_get_species: species %d is not one of the %d (counted from 0)",
                        species, scene->n_species);
    }
    const struct gbg_species *found = &scene->species[species];
    if (name && capacity <= (int64_t)strlen(found->name)) {
        return gbg_fail(scene->context, GBG_E_SPACE,
                        "gbg_scene_get_species: name \"%s\" does not fit into %lld bytes",
                        found->name, (long long)capacity);
    }
    if (name) {
        gbg_text_copy(name, (size_t)capacity, found->name);
    }
    const double value[3] = {found->diameter, found->alpha, found->mobility};
    double *const output[3] = {diameter, alpha, mobility};
    for (int i = 0; i < 3; i++) {
        if (output[i]) {
            *output[i] = value[i];
        }
    }
    if (count) {
        *count = found->count;
    }
    return GBG_OK;
}

int gbg_scene_get_force(const struct gbg_scene *scene, int force, double *power, const char **sum,
                        double *cutoff, double *tolerance)
{
    if (!scene) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "gbg_scene_get_force: scene is NULL");
    }
    if (force < 0 || force >= scene->n_forces) {
        return gbg_fail(scene->context, GBG_E_ARGUMENT,
                        "gbg_scene_get_force: force %d is not one of the %d (counted from 0)",
                        force, scene->n_forces);
    }
    const struct gbg_force *found = &scene->force[force];
    const double value[3] = {found->power, found->cutoff, found->tolerance};
    double *const output[3] = {power, cutoff, tolerance};
    for (int i = 0; i < 3; i++) {
        if (output[i]) {
            *output[i] = value[i];
        }
    }
    if (sum) {
        *sum = sum_name(found->sum);
    }
    return GBG_OK;
}
