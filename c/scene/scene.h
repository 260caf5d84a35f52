/* L3: the scene's body: pure data, and the functions that check it and make a start from it. */
#ifndef GBG_SCENE_SCENE_H
#define GBG_SCENE_SCENE_H

#include <stdint.h>

#include "core/box.h"
#include "core/context.h"
#include "gamboge/scene.h"

enum { GBG_NAME_CAPACITY = 32, GBG_PATH_CAPACITY = 1024 };

enum gbg_law { GBG_LAW_POWER };
enum gbg_sum_kind { GBG_SUM_MINIMUM_IMAGE, GBG_SUM_CUTOFF, GBG_SUM_LATTICE };
enum gbg_rule {
    GBG_RULE_NONE,
    GBG_RULE_AUTO,
    GBG_RULE_EVENT,
    GBG_RULE_BRIDGE,
    GBG_RULE_BOUNCE,
    GBG_RULE_CONTACT,
    GBG_RULE_CARTER
};
enum gbg_overlapping { GBG_OVERLAPPING_REFUSE, GBG_OVERLAPPING_RELAX };
enum gbg_neighbour_choice { GBG_NEIGHBOURS_AUTO, GBG_NEIGHBOURS_GRID, GBG_NEIGHBOURS_DELAUNAY };
enum gbg_dynamics { GBG_DYNAMICS_NONE, GBG_DYNAMICS_BROWNIAN };
enum gbg_limit_by { GBG_LIMIT_NONE, GBG_LIMIT_CLAMP, GBG_LIMIT_REDRAW };
enum gbg_precision {
    GBG_PRECISION_AUTO,
    GBG_PRECISION_MIXED,
    GBG_PRECISION_DOUBLE,
    GBG_PRECISION_STRICT
};
enum gbg_start {
    GBG_START_NONE,
    GBG_START_LATTICE,
    GBG_START_INSERTION,
    GBG_START_UNIFORM, /* after insertion: the order of the choices of particles.start.random */
    GBG_START_FILE,
    GBG_START_ARRAYS
};
enum gbg_lattice { GBG_LATTICE_TRIANGULAR, GBG_LATTICE_SQUARE, GBG_LATTICE_FCC, GBG_LATTICE_CUBIC };
enum gbg_shape { GBG_SHAPE_SQUARE, GBG_SHAPE_LATTICE }; /* of a box given by its packing */

struct gbg_species {
    char name[GBG_NAME_CAPACITY];
    double diameter, alpha, mobility;
    double fraction; /* of particles.count, -1: not given */
    int64_t asked;   /* number given for this species, -1: not given */
    int64_t count;   /* after gbg_scene_resolve always the number; before it: asked */
};

struct gbg_force {
    double power;
    int sum;          /* enum gbg_sum_kind */
    double cutoff;    /* 0: none */
    double tolerance; /* relative RMS error asked for; 0: default */
    int law;          /* enum gbg_law */
    /* sum lattice only: 0 prolate, prolate, waves; 1 the other one */
    int split, window, gradient;
    int check; /* 1: its error is measured when a run starts */
};

/* Coordinates of a start, blocked: position[axis][i]. */
struct gbg_particles {
    int64_t n;
    int dimension;
    double *position[3];
    int32_t *species; /* from 0 */
    int64_t *id;
};

struct gbg_scene {
    struct gbg_context *context;
    int dimension;

    double length[3], origin[3]; /* length 0: not given yet */
    double packing;              /* area or volume fraction asked for; 0: box lengths are given */
    int shape;                   /* enum gbg_shape, with packing only */

    int n_species;
    struct gbg_species species[GBG_MAX_SPECIES];
    int n_forces;
    struct gbg_force force[GBG_MAX_FORCES];

    int64_t count;    /* particles.count; -1: follows from species counts, arrays or file */
    int64_t n;        /* after gbg_scene_resolve: the number of particles */
    int start;        /* enum gbg_start */
    int lattice;      /* enum gbg_lattice */
    double vacancies; /* share of the sites left empty at least, 0..1 */
    double jitter;    /* of the lattice, as a fraction of the free gap between neighbours, 0..1 */
    char start_file[GBG_PATH_CAPACITY];
    int64_t start_frame;         /* of a trajectory; -1: the last */
    int64_t next_id;             /* free for the next particle added */
    struct gbg_particles arrays; /* from gbg_scene_add_particles, or the file, as they were added */

    int rule;           /* enum gbg_rule: excluded volume; NONE when the scene has none */
    int neighbours;     /* enum gbg_neighbour_choice */
    int64_t max_rounds; /* of contact corrections in a step */
    int separate;       /* enum gbg_overlapping: what is done with an overlapping start */
    double reverted;    /* largest share of particle-steps that may be put back */

    int dynamics; /* enum gbg_dynamics */
    double dt, temperature;
    double noise_limit; /* in standard deviations */
    int limit_by;       /* enum gbg_limit_by */
    int rescale;        /* 1: limited noise is rescaled to unit variance */

    int precision; /* enum gbg_precision: of the forces */
    double skin;   /* of neighbour lists, length; 0: chosen */

    int64_t steps, seed, run;

    char trajectory_file[GBG_PATH_CAPACITY]; /* "": none */
    int64_t trajectory_every;
    char restart_file[GBG_PATH_CAPACITY];
    int64_t restart_every;
    int output_double; /* 1: coordinates stored as double */
    int unwrapped;     /* 1: image counts are kept and stored */
    int overlap;       /* 1: per-particle overlap flags are kept and stored */

    char source[GBG_PATH_CAPACITY]; /* scene file, "" for a scene made by calls */
};

/* Checks everything that can be checked without positions, fills in what follows from other keys
 * (box lengths from packing, counts from fractions) and leaves the scene ready to start. Called for
 * scenes whose particles come from a file after these have been read. Idempotent. */
int gbg_scene_resolve(struct gbg_scene *scene);

/* Positions, species and ids of the start (lattice, insertion, arrays), sorted by id, wrapped into
 * the box; allocated here. Needs a resolved scene. Refuses what cannot be placed, naming the limit.
 * Overlaps in given arrays are the engine's to find. */
int gbg_scene_start(struct gbg_scene *scene, struct gbg_particles *particles);

/* Arrays of n particles; released by gbg_particles_release (also half-made ones). */
int gbg_particles_allocate(struct gbg_context *context, int64_t n, int dimension,
                           struct gbg_particles *particles);
void gbg_particles_release(struct gbg_particles *particles);

/* Checks a block of particles and adds it to scene->arrays, which become the start; the terms are
 * those of gbg_scene_add_particles. */
struct gbg_points;
int gbg_particles_add(struct gbg_scene *scene, const struct gbg_points *points,
                      const int32_t *species, int base, const int64_t *ids);

/* SHA-256 text of everything that the dynamics depend on (box, species, forces, rule, dynamics,
 * seed, precision; not steps or output), for restart files. */
void gbg_scene_digest(const struct gbg_scene *scene, char text[65]);

/* Total area (2D) or volume (3D) of the cores over that of the box. */
double gbg_scene_packing(const struct gbg_scene *scene);

#endif
