/* Public: trajectories in netCDF (AMBER convention, 64-bit offset format). */
#ifndef GAMBOGE_TRAJECTORY_H
#define GAMBOGE_TRAJECTORY_H

#include <stddef.h>
#include <stdint.h>

#include "engine.h"

#ifdef __cplusplus
extern "C" {
#endif

struct gbg_trajectory;

/* Starts a trajectory of this engine. The file appears under its final name with the first frame;
 * a file of that name that was there before is kept until then. After each append the frame is on
 * the disc before the file counts it, so a kill at any instant loses at most the frame in flight.
 * What a frame holds follows from the scene: output.trajectory.precision (double or float),
 * output.trajectory.unwrapped, output.trajectory.overlap. Frames list particles in the order of
 * their ids. */
GBG_API int gbg_trajectory_create(struct gbg_engine *engine, const char *path,
                                  struct gbg_trajectory **trajectory);
/* Goes on with a trajectory after a restart: frames later than the engine's step are cut off. A
 * file of another scene, of other particles or with other variables is refused. */
GBG_API int gbg_trajectory_continue(struct gbg_engine *engine, const char *path,
                                    struct gbg_trajectory **trajectory);
/* Adds the engine's present state; refused when the file has a later step already. After a failure
 * (a full disc) the file holds the frames it had, and another append may follow. */
GBG_API int gbg_trajectory_append(struct gbg_trajectory *trajectory, struct gbg_engine *engine);
/* The same, but may return before the frame is in the file: from a GPU it is copied out and written
 * while the next steps run. It is the frame of the state at this call, whatever the engine does or
 * becomes afterwards. At most two frames are on their way; they reach the disc in their order, each
 * as append puts it there. A failure is the status of the next append, append_begin, append_end or
 * destroy, which adds no frame; the file holds the frames before the one that failed. On the CPU,
 * and where memory does not suffice, this is append. */
GBG_API int gbg_trajectory_append_begin(struct gbg_trajectory *trajectory,
                                        struct gbg_engine *engine);
/* Waits until the frames that were begun are on the disc. To be called before a restart file is
 * saved: a run that goes on from there needs the frames up to it. */
GBG_API int gbg_trajectory_append_end(struct gbg_trajectory *trajectory);

/* Opens a trajectory to read: ours, or any AMBER netCDF with a periodic rectangular box. What that
 * lacks is taken as: one species, diameter 1, time and step the number of the frame, origin 0. */
GBG_API int gbg_trajectory_open(struct gbg_context *context, const char *path,
                                struct gbg_trajectory **trajectory);
/* Closes, after the frames that were begun; their failure is its status, and the object is gone all
 * the same. */
GBG_API int gbg_trajectory_destroy(struct gbg_trajectory **trajectory);

/* frames: those in the file, without those on their way. */
GBG_API int gbg_trajectory_size(const struct gbg_trajectory *trajectory, int64_t *frames,
                                int64_t *particles, int *dimension, int *n_species);
/* 1 if coordinates are stored in double precision, else 0. */
GBG_API int gbg_trajectory_is_double(const struct gbg_trajectory *trajectory, int *is_double);
/* 0 if the file says that its particles have no hard cores (no excluded volume: the diameters are
 * only what is drawn), else 1. For a trajectory that was opened to be read. */
GBG_API int gbg_trajectory_is_hard(const struct gbg_trajectory *trajectory, int *is_hard);
/* Species counted from base (0 or 1), in the order of the file; diameters of the particles. */
GBG_API int gbg_trajectory_species(const struct gbg_trajectory *trajectory, int64_t n,
                                   int32_t *species, int base);
GBG_API int gbg_trajectory_diameters(const struct gbg_trajectory *trajectory, int64_t n,
                                     double *diameters);
/* Name of a species (index from 0); "A", "B", ... if the file has none. */
GBG_API int gbg_trajectory_species_name(const struct gbg_trajectory *trajectory, int species,
                                        int64_t capacity, char *name);
/* Time, step number and box of a frame (frames count from 0). */
GBG_API int gbg_trajectory_frame(struct gbg_trajectory *trajectory, int64_t frame, double *time,
                                 int64_t *step, double *lengths, double *origin);
/* Coordinates of a frame; consecutive particles `step` elements apart; z NULL in 2D. */
GBG_API int gbg_trajectory_positions(struct gbg_trajectory *trajectory, int64_t frame, int64_t n,
                                     double *x, double *y, double *z, ptrdiff_t step);
/* Image counts (GBG_E_NAME if the file has none) and overlap flags (likewise). */
GBG_API int gbg_trajectory_images(struct gbg_trajectory *trajectory, int64_t frame, int64_t n,
                                  int32_t *x, int32_t *y, int32_t *z, ptrdiff_t step);
GBG_API int gbg_trajectory_overlapped(struct gbg_trajectory *trajectory, int64_t frame, int64_t n,
                                      int32_t *flags);

/* forces(atom,dim), positions(atom,dim), species(atom) of the engine's present state, in the order
 * of ids, to a netCDF file (temporary name, sync, rename). */
GBG_API int gbg_engine_write_forces(struct gbg_engine *engine, const char *path);

#ifdef __cplusplus
}
#endif
#endif
