/* L3: the table of keys itself: names, types, defaults, ranges, meanings. */
#include <stddef.h>

#include "scene/options.h"
#include "scene/scene.h"

static void starts_from(struct gbg_scene *scene, int start)
{
    scene->start = start;
    if (start != GBG_START_ARRAYS) {
        gbg_particles_release(&scene->arrays);
        scene->next_id = 0;
    }
}

static void start_on_lattice(struct gbg_scene *scene)
{
    starts_from(scene, GBG_START_LATTICE);
}

static void start_at_random(struct gbg_scene *scene)
{
    starts_from(scene, scene->start); /* the choice has been set */
}

static void start_from_file(struct gbg_scene *scene)
{
    starts_from(scene, scene->start_file[0] ? GBG_START_FILE : GBG_START_NONE);
}

static void move(struct gbg_scene *scene)
{
    scene->dynamics = GBG_DYNAMICS_BROWNIAN;
}

#define TEXT_GBG_REAL "real"
#define TEXT_GBG_INTEGER "integer"
#define TEXT_GBG_CHOICE "choice"
#define TEXT_GBG_SWITCH "switch"
#define TEXT_GBG_TEXT "text"

#define ENTRY(body, name, type, member, standard, range, meaning, first, then)                     \
    {                                                                                              \
        name, type, offsetof(body, member), sizeof(((body *)0)->member), standard, range, meaning, \
            name "|" TEXT_##type "|" standard "|" range "|" meaning, first, then                   \
    }
#define OPTION(name, type, member, standard, range, meaning, first, then)                          \
    ENTRY(struct gbg_scene, name, type, member, standard, range, meaning, first, then)
#define PLAIN(name, type, member, standard, range, meaning)                                        \
    OPTION(name, type, member, standard, range, meaning, 0, NULL)
#define END                                                                                        \
    {                                                                                              \
        .name = NULL                                                                               \
    }

/* clang-format off */
const struct gbg_option gbg_scene_options[] = {
    PLAIN("box.packing", GBG_REAL, packing, "not given", "[0, 1]",
          "area (2D) or volume (3D) of the cores over that of the box, from which its size "
          "follows; at most 0.9069 (2D) and 0.74048 (3D) with hard cores of one size"),
    PLAIN("box.shape", GBG_CHOICE, shape, "square", "square, lattice",
          "with box.packing: all lengths equal, or lengths that hold whole cells of the lattice"),
    PLAIN("particles.count", GBG_INTEGER, count, "not given", "[0, 2147483647]",
          "number of particles; needed when species have fractions"),
    OPTION("particles.start.lattice", GBG_CHOICE, lattice, "not given",
           "triangular, square, fcc, cubic",
           "start on lattice sites (triangular, square in 2D; fcc, cubic in 3D), those that are "
           "too many left empty at random, species at random", 0, start_on_lattice),
    PLAIN("particles.start.vacancies", GBG_REAL, vacancies, "0", "[0, 0.9]",
          "share of the lattice sites that stays empty, or a little more"),
    PLAIN("particles.start.jitter", GBG_REAL, jitter, "0", "[0, 1]",
          "random shift over half the free gap between neighbours: never an overlap"),
    OPTION("particles.start.random", GBG_CHOICE, start, "not given",
           "insertion, uniform",
           "start by random insertion without overlap, large particles first; or at points that "
           "know nothing of each other, for particles without cores or excluded_volume.start relax",
           GBG_START_INSERTION, start_at_random),
    OPTION("particles.start.file", GBG_TEXT, start_file, "not given", "a path",
           "start from a trajectory, a restart file or a text file", 0, start_from_file),
    PLAIN("particles.start.frame", GBG_INTEGER, start_frame, "-1", "[-1, 9007199254740992]",
          "frame of a trajectory, from 0; -1 is the last"),
    PLAIN("excluded_volume.rule", GBG_CHOICE, rule, "none",
          "none, auto, event, bridge, bounce, contact, carter",
          "how overlapping cores part; auto takes event without forces and bridge with them. "
          "carter is bounce with the cut of summed pushes of Carter (2016), which breaks momentum: "
          "for reproduction. In a file a block without a rule means auto"),
    PLAIN("excluded_volume.neighbours", GBG_CHOICE, neighbours, "auto", "auto, grid, delaunay",
          "how close pairs are found; delaunay is not in this version"),
    PLAIN("excluded_volume.start", GBG_CHOICE, separate, "refuse", "refuse, relax",
          "what is done with a start in which cores overlap: refuse, or move particles until none "
          "do, which is refused too where it does not succeed"),
    PLAIN("excluded_volume.max_rounds", GBG_INTEGER, max_rounds, "1000", "[1, 1000000000]",
          "rounds of contact corrections in a step, after which it is made once more with pushes to "
          "contact only; pairs that then overlap are put back to where they were before it"),
    PLAIN("excluded_volume.reverted", GBG_REAL, reverted, "1e-06", "[0, 1]",
          "largest share of all moves of a run that may be put back because the particle overlaps "
          "or passed through another; 32 particles, or 1 in 1000, are allowed whatever its length "
          "(0: none at all). A run that exceeds it stops and says which dt would do"),
    PLAIN("excluded_volume.skin", GBG_REAL, skin, "0", "[0, 1e100]",
          "extra radius of neighbour lists, a length; 0: chosen"),
    PLAIN("dynamics.kind", GBG_CHOICE, dynamics, "none", "none, brownian",
          "none: forces only, no run; brownian as soon as another key of dynamics is set"),
    OPTION("dynamics.dt", GBG_REAL, dt, "required", "(0, 1e100]",
           "time step", 0, move),
    OPTION("dynamics.temperature", GBG_REAL, temperature, "0", "[0, 1e100]",
           "noise of a component in a step has the variance temperature dt: free particles "
           "diffuse with D = temperature / 2", 0, move),
    OPTION("dynamics.noise.limit", GBG_REAL, noise_limit, "not given", "[1, 40]",
           "largest noise of a component in standard deviations", 0, move),
    OPTION("dynamics.noise.limit_by", GBG_CHOICE, limit_by, "none", "none, clamp, redraw",
           "what is done with larger noise: cut to the limit, or drawn again", 0, move),
    OPTION("dynamics.noise.rescale", GBG_SWITCH, rescale, "false", "false, true",
           "limited noise is rescaled to unit variance", 0, move),
    PLAIN("precision.mode", GBG_CHOICE, precision, "auto", "auto, mixed, double, strict",
          "of the forces: mixed is 32-bit pairs and 64-bit sums; strict is mixed with the same bits "
          "on every processor and GPU (cut-off sums have that in every mode)"),
    PLAIN("run.steps", GBG_INTEGER, steps, "0", "[0, 9007199254740992]",
          "number of steps that `gamboge run` makes"),
    PLAIN("run.seed", GBG_INTEGER, seed, "0", "[0, 4294967295]",
          "first key of all random numbers, those of the start included"),
    PLAIN("run.run", GBG_INTEGER, run, "0", "[0, 4294967295]",
          "second key: independent runs of one seed"),
    PLAIN("output.trajectory.file", GBG_TEXT, trajectory_file, "not given", "a path",
          "netCDF trajectory that `gamboge run` writes"),
    PLAIN("output.trajectory.every", GBG_INTEGER, trajectory_every, "100",
          "[1, 9007199254740992]", "steps between frames"),
    PLAIN("output.trajectory.precision", GBG_CHOICE, output_double, "double", "float, double",
          "of the stored coordinates"),
    PLAIN("output.trajectory.overlap", GBG_SWITCH, overlap, "false", "false, true",
          "a flag for each particle that took part in an overlap in the step of the frame"),
    PLAIN("output.trajectory.unwrapped", GBG_SWITCH, unwrapped, "false", "false, true",
          "image counts are kept and stored, so that paths can be unwrapped"),
    PLAIN("output.restart.file", GBG_TEXT, restart_file, "not given", "a path",
          "restart file that `gamboge run` writes"),
    PLAIN("output.restart.every", GBG_INTEGER, restart_every, "1000", "[1, 9007199254740992]",
          "steps between restart files"),
    END};

#define SPECIES(name, type, member, standard, range, meaning)                                      \
    ENTRY(struct gbg_species, name, type, member, standard, range, meaning, 0, NULL)

const struct gbg_option gbg_species_options[] = {
    SPECIES("name", GBG_TEXT, name, "A, B, ...", "1 to 31 bytes", "name of the species, distinct"),
    SPECIES("fraction", GBG_REAL, fraction, "not given", "[0, 1]",
            "share of particles.count; all fractions sum to 1, leftovers go to the largest "
            "remainders"),
    SPECIES("count", GBG_INTEGER, asked, "not given", "[0, 2147483647]",
            "number of particles, instead of a fraction"),
    SPECIES("diameter", GBG_REAL, diameter, "1", "[0, 1e100]", "of the hard core"),
    SPECIES("alpha", GBG_REAL, alpha, "0", "[-1e100, 1e100]", "strength as a source of forces"),
    SPECIES("mobility", GBG_REAL, mobility, "1", "[-1e100, 1e100]", "response to forces"),
    END};

#define FORCE(name, type, member, standard, range, meaning)                                        \
    ENTRY(struct gbg_force, name, type, member, standard, range, meaning, 0, NULL)

const struct gbg_option gbg_force_options[] = {
    FORCE("law", GBG_CHOICE, law, "power", "power",
          "force on i: mobility_i sum_k alpha_k r_ik / r^(power+1), r_ik from k to i"),
    FORCE("power", GBG_REAL, power, "required", "(0, 24]", "the force falls as r^-power"),
    FORCE("sum", GBG_CHOICE, sum, "lattice", "minimum_image, cutoff, lattice",
          "over which images: the nearest of each particle, those closer than the cut-off, or all "
          "(by a mesh, powers 1 to 6 in 2D, 2 in 3D). In a file a cut-off alone means cutoff"),
    FORCE("cutoff", GBG_REAL, cutoff, "0", "[0, 1e100]",
          "with sum cutoff: at most half the shortest box length"),
    FORCE("tolerance", GBG_REAL, tolerance, "0", "[0, 1)",
          "relative RMS error asked for; 0: the default of the sum, 1e-4 with sum lattice, which "
          "takes up to 0.1; the other sums do not read it"),
    FORCE("split", GBG_CHOICE, split, "prolate", "prolate, gaussian",
          "with sum lattice: how the law is parted into near pairs and waves: by the prolate "
          "function, which needs fewest waves, or by Ewald's Gaussian"),
    FORCE("window", GBG_CHOICE, window, "prolate", "prolate, bspline",
          "with sum lattice: how a particle is spread over the mesh"),
    FORCE("gradient", GBG_CHOICE, gradient, "waves", "waves, window",
          "with sum lattice: where the field comes from: each wave times its wave vector, or the "
          "slope of the window, with fewer transforms and wider windows"),
    FORCE("check", GBG_SWITCH, check, "true", "false, true",
          "with sum lattice: the error is measured on 1000 particles when a run starts and when "
          "the density contrast has changed twofold, and the mesh refined where it misses the "
          "tolerance"),
    END};

#define SHAPE_OF_FILE(key, kind, otherwise, allowed, means)                                        \
    {.name = key, .standard = otherwise, .range = allowed, .meaning = means,                       \
     .line = key "|" kind "|" otherwise "|" allowed "|" means}

const struct gbg_option gbg_file_options[] = {
    SHAPE_OF_FILE("dimension", "integer", "length of box.size, else 2", "2, 3", "of space"),
    SHAPE_OF_FILE("box.size", "list", "not given", "[1e-100, 1e100] each", "lengths of the box"),
    SHAPE_OF_FILE("box.origin", "list", "0", "[-1e100, 1e100] each", "lower corner of the box"),
    SHAPE_OF_FILE("box.boundary", "list", "periodic", "periodic each", "boundary on each axis"),
    SHAPE_OF_FILE("particles.species", "list", "required", "1 to 10 entries", "see below"),
    SHAPE_OF_FILE("forces", "list", "none", "0 to 8 entries", "see below"),
    END};
/* clang-format on */
