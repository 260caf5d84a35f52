/* L3: a scene put together: made, given a box, species and forces, released. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/memory.h"
#include "scene/options.h"
#include "scene/parts.h"

#define SHORTEST 1e-100
#define LONGEST 1e100

int gbg_scene_make(struct gbg_context *context, int dimension, struct gbg_scene **scene)
{
    int status = gbg_allocate_zero(context, (void **)scene, 1, sizeof **scene, "a scene");
    if (status == GBG_OK) {
        (*scene)->context = context;
        (*scene)->dimension = dimension;
        (*scene)->count = -1;
        gbg_option_defaults(gbg_scene_options, *scene);
    }
    return status;
}

void gbg_scene_release(struct gbg_scene *scene)
{
    if (scene) {
        gbg_particles_release(&scene->arrays);
        gbg_release(scene);
    }
}

int gbg_box_give(struct gbg_scene *scene, const double *length, const double *origin)
{
    for (int a = 0; a < scene->dimension; a++) {
        if (!(length[a] >= SHORTEST && length[a] <= LONGEST)) {
            return gbg_fail(scene->context, GBG_E_ARGUMENT,
                            "box length %.10g on axis %d given, allowed [%g, %g]", length[a], a + 1,
                            SHORTEST, LONGEST);
        }
        if (origin && !(fabs(origin[a]) <= LONGEST)) {
            return gbg_fail(scene->context, GBG_E_ARGUMENT,
                            "box origin %.10g on axis %d given, allowed [%g, %g]", origin[a], a + 1,
                            -LONGEST, LONGEST);
        }
    }
    for (int a = 0; a < scene->dimension; a++) {
        scene->length[a] = length[a];
        scene->origin[a] = origin ? origin[a] : 0.0;
    }
    scene->packing = 0;
    return GBG_OK;
}

static int check_name(const struct gbg_scene *scene, const char *name)
{
    for (const char *c = name; *c; c++) {
        if ((unsigned char)*c < ' ' || *c == 127) {
            return gbg_fail(scene->context, GBG_E_ARGUMENT,
                            "name of species %d holds a control character, allowed printable text",
                            scene->n_species + 1);
        }
    }
    for (int s = 0; s < scene->n_species; s++) {
        if (strcmp(scene->species[s].name, name) == 0) {
            return gbg_fail(scene->context, GBG_E_ARGUMENT,
                            "name \"%s\" given to species %d and %d, allowed once", name, s + 1,
                            scene->n_species + 1);
        }
    }
    return GBG_OK;
}

int gbg_species_add(struct gbg_scene *scene, const struct gbg_species *species)
{
    struct gbg_species added = *species;
    if (scene->n_species == GBG_MAX_SPECIES) {
        return gbg_fail(scene->context, GBG_E_ARGUMENT, "species %d given, allowed at most %d",
                        scene->n_species + 1, GBG_MAX_SPECIES);
    }
    if (added.fraction >= 0 && added.asked >= 0) {
        return gbg_fail(scene->context, GBG_E_ARGUMENT,
                        "species \"%s\" has a fraction and a count, allowed one of the two",
                        added.name);
    }
    if (!added.name[0]) {
        snprintf(added.name, sizeof added.name, "%c", 'A' + scene->n_species);
    }
    int status = check_name(scene, added.name);
    if (status == GBG_OK) {
        added.count = added.asked;
        scene->species[scene->n_species++] = added;
    }
    return status;
}

int gbg_force_check(const struct gbg_scene *scene, const struct gbg_force *force)
{
    if (force->sum == GBG_SUM_CUTOFF && !(force->cutoff > 0)) {
        return gbg_fail(scene->context, GBG_E_ARGUMENT,
                        "cutoff: %.10g given, allowed (0, half the shortest box length] with sum "
                        "cutoff",
                        force->cutoff);
    }
    if (force->sum != GBG_SUM_CUTOFF && force->cutoff != 0) {
        return gbg_fail(scene->context, GBG_E_ARGUMENT,
                        "cutoff: %.10g given, allowed only with sum cutoff", force->cutoff);
    }
    int settled = force->split | force->window | force->gradient;
    if (force->sum != GBG_SUM_LATTICE && settled) {
        return gbg_fail(scene->context, GBG_E_ARGUMENT, "%s given, allowed only with sum lattice",
                        force->split    ? "split: gaussian"
                        : force->window ? "window: bspline"
                                        : "gradient: window");
    }
    return GBG_OK;
}

int gbg_force_add(struct gbg_scene *scene, const struct gbg_force *force)
{
    if (scene->n_forces == GBG_MAX_FORCES) {
        return gbg_fail(scene->context, GBG_E_ARGUMENT, "force %d given, allowed at most %d",
                        scene->n_forces + 1, GBG_MAX_FORCES);
    }
    int status = gbg_force_check(scene, force);
    if (status == GBG_OK) {
        scene->force[scene->n_forces++] = *force;
    }
    return status;
}
