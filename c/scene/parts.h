/* L3: what the files of this room share with each other and with the API above them. */
#ifndef GBG_SCENE_PARTS_H
#define GBG_SCENE_PARTS_H

#include "core/view.h"
#include "scene/scene.h"

#define GBG_LARGEST_ID ((INT64_C(1) << 48) - 1)
#define GBG_MOST_PARTICLES INT64_C(2147483647)

/* An empty scene with every default. */
int gbg_scene_make(struct gbg_context *context, int dimension, struct gbg_scene **scene);
void gbg_scene_release(struct gbg_scene *scene);

/* Checks and adds; a refused call changes nothing. */
int gbg_box_give(struct gbg_scene *scene, const double *length, const double *origin);
int gbg_species_add(struct gbg_scene *scene, const struct gbg_species *species);
int gbg_force_add(struct gbg_scene *scene, const struct gbg_force *force);
/* Keys of a force that exclude each other. */
int gbg_force_check(const struct gbg_scene *scene, const struct gbg_force *force);

/* A scene file into a fresh scene. */
int gbg_scene_read_file(struct gbg_context *context, const char *path, struct gbg_scene **scene);

/* gbg_scene_resolve, but a start file that was not read yet leaves open what depends on it. */
int gbg_scene_resolve_known(struct gbg_scene *scene);

/* r in [origin, origin + length), unchanged if it is there already. */
double gbg_wrap(double r, double origin, double length);

/* Most of the box that cores of one size can fill: pi/(2 sqrt 3), pi/(3 sqrt 2). */
double gbg_densest(int dimension);
double gbg_largest_diameter(const struct gbg_scene *scene);
/* Area or volume of all cores, with the counts of a resolved scene. */
double gbg_core_volume(const struct gbg_scene *scene);

/* The kinds of start, each into arrays allocated here; scene resolved. */
int gbg_start_arrays(struct gbg_scene *scene, struct gbg_particles *particles);
int gbg_start_lattice(struct gbg_scene *scene, struct gbg_particles *particles);
int gbg_start_insertion(struct gbg_scene *scene, struct gbg_particles *particles);

#endif
