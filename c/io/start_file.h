/* Side room io: start configurations from files. */
#ifndef GBG_IO_START_FILE_H
#define GBG_IO_START_FILE_H

#include "scene/scene.h"

/* Reads scene->start_file into scene->arrays and makes the start one from arrays. The kind of file
 * follows from its first bytes: a trajectory (netCDF, frame scene->start_frame, -1: the last), a
 * restart file, or text. The box comes from the scene; if the scene has neither lengths nor
 * packing, from a trajectory or restart. Species of our own files are found by name, of others by
 * number. A restart's 64-bit fractions pass through double coordinates here: 53 bits of them,
 * relative to the distance from zero, survive (gbg_engine_load keeps all). On failure the scene is
 * unchanged. */
int gbg_io_read_start(struct gbg_scene *scene);

/* The text kind: columns x y [z] species; # starts a comment. The species is the name of one of
 * the scene, or its number from 1; it may be left out in a scene with one species. Fortran's D
 * exponents are taken, the user's locale is not. Fills particles, which the caller releases. */
int gbg_io_read_text(struct gbg_scene *scene, struct gbg_particles *particles);

#endif
