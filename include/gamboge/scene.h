/* Public: the scene: what to simulate, as plain data. */
#ifndef GAMBOGE_SCENE_H
#define GAMBOGE_SCENE_H

#include <stddef.h>
#include <stdint.h>

#include "context.h"

#ifdef __cplusplus
extern "C" {
#endif

struct gbg_scene;

enum gbg_limits { GBG_MAX_SPECIES = 10, GBG_MAX_FORCES = 8 };

/* An empty scene of dimension 2 or 3. */
GBG_API int gbg_scene_create(struct gbg_context *context, int dimension, struct gbg_scene **scene);
/* A scene from a YAML file (docs/scene_reference.md). A message names file, line, key, value and
 * allowed range. Relative paths inside the file are taken from the current directory. */
GBG_API int gbg_scene_read(struct gbg_context *context, const char *path, struct gbg_scene **scene);
GBG_API int gbg_scene_destroy(struct gbg_scene **scene);

/* Options by name, e.g. "dynamics.dt", "run.seed", "excluded_volume.rule", "box.packing",
 * "particles.start.jitter"; the whole list with defaults, ranges and meanings is in
 * docs/scene_reference.md and in gbg_scene_option. An unknown name is refused and the nearest one
 * named. A later call overrides an earlier one: box.packing and gbg_scene_set_box, or the kinds of
 * start (lattice, random, file, gbg_scene_add_particles). Whole numbers may be given to reals. */
GBG_API int gbg_scene_set_real(struct gbg_scene *scene, const char *option, double value);
GBG_API int gbg_scene_set_integer(struct gbg_scene *scene, const char *option, int64_t value);
GBG_API int gbg_scene_set_text(struct gbg_scene *scene, const char *option, const char *value);
GBG_API int gbg_scene_get_real(const struct gbg_scene *scene, const char *option, double *value);
GBG_API int gbg_scene_get_integer(const struct gbg_scene *scene, const char *option,
                                  int64_t *value);
/* Any option as text; it receives at most capacity bytes with the final zero. */
GBG_API int gbg_scene_get_text(const struct gbg_scene *scene, const char *option,
                               int64_t capacity, char *text);
/* The option table itself: entry index (from 0) as "name|type|default|range|meaning";
 * GBG_E_ARGUMENT past the end. Static storage. */
GBG_API int gbg_scene_option(int index, const char **line);

/* Box lengths and origin (lower corner), arrays of `dimension` reals; origin NULL: 0. */
GBG_API int gbg_scene_set_box(struct gbg_scene *scene, const double *lengths, const double *origin);
GBG_API int gbg_scene_get_box(const struct gbg_scene *scene, int *dimension, double *lengths,
                              double *origin);

/* Adds a species; *species receives its index from 0. alpha: source strength, mobility: response
 * (F_i = mobility_i sum_k alpha_k ...). Counts of particles: fraction (0..1 of particles.count) or
 * a count; give the one, pass -1 for the other; both -1 when particles come from arrays or a file. */
GBG_API int gbg_scene_add_species(struct gbg_scene *scene, const char *name, double diameter,
                                  double alpha, double mobility, double fraction, int64_t count,
                                  int *species);

/* Adds a pair force F_i = mobility_i sum_k alpha_k r_ik/|r_ik|^(power+1). sum: "minimum_image",
 * "cutoff" or "lattice" (also NULL); cutoff: only with sum "cutoff", else 0. tolerance: relative RMS
 * error asked for, 0 for the default. */
GBG_API int gbg_scene_add_force(struct gbg_scene *scene, double power, const char *sum,
                                double cutoff, double tolerance);
/* Another key of a force that was added (from 0), by the names of docs/scene_reference.md: "split",
 * "window", "gradient", "check", "tolerance", ...; value as in a scene file. */
GBG_API int gbg_scene_set_force(struct gbg_scene *scene, int force, const char *option,
                                const char *value);

/* What the scene holds: number of species and forces, and each of them (indices from 0). Any output
 * may be NULL. count: particles of the species, -1 while it is not known (gbg_scene_check settles
 * fractions; species of particles from arrays have none). */
GBG_API int gbg_scene_size(const struct gbg_scene *scene, int *n_species, int *n_forces);
GBG_API int gbg_scene_get_species(const struct gbg_scene *scene, int species, int64_t capacity,
                                  char *name, double *diameter, double *alpha, double *mobility,
                                  int64_t *count);
/* sum: "minimum_image", "cutoff" or "lattice", static storage. */
GBG_API int gbg_scene_get_force(const struct gbg_scene *scene, int force, double *power,
                                const char **sum, double *cutoff, double *tolerance);

/* Adds a block of n particles; may be called again. x, y, z: base addresses of the coordinates,
 * consecutive particles `step` elements apart; z NULL in two dimensions. Any finite coordinate is
 * taken and wrapped into the box. species: n indices counted from `base` (0 or 1), NULL: all the
 * first. ids: n permanent, distinct, non-negative ids, NULL: the next free ones in order. The noise
 * of a particle and the order of every sum follow its id, so results do not depend on the order of
 * the array. */
GBG_API int gbg_scene_add_particles(struct gbg_scene *scene, int64_t n, const double *x,
                                    const double *y, const double *z, ptrdiff_t step,
                                    const int32_t *species, int base, const int64_t *ids);

/* Checks the scene as a whole without making anything. */
GBG_API int gbg_scene_check(struct gbg_scene *scene);

#ifdef __cplusplus
}
#endif
#endif
