/* Side room io: trajectories being written. */
#ifndef GBG_IO_WRITER_H
#define GBG_IO_WRITER_H

#include <stdint.h>

struct gbg_engine;
struct gbg_engine_view;
struct gbg_writer;

struct gbg_writer_size { /* of a trajectory */
    int64_t frames, particles;
    int dimension, n_species, is_double;
};

/* A new file, under a temporary name until the first frame is in it. */
int gbg_writer_create(const struct gbg_engine_view *view, const char *path,
                      struct gbg_writer **writer);

/* A file that an earlier run of the same scene left: its frames later than the engine's step, and
 * what a broken run may have left behind the last frame, are cut off. */
int gbg_writer_continue(const struct gbg_engine_view *view, const char *path,
                        struct gbg_writer **writer);

/* Adds the engine's present state. On failure the file holds the frames that it had; so also where
 * the failure was that of a frame begun earlier, and this one is not added then. */
int gbg_writer_append(struct gbg_writer *writer, struct gbg_engine *engine,
                      const struct gbg_engine_view *view);

/* The same, but the frame may be written while the engine goes on; failures come with a later call.
 */
int gbg_writer_begin(struct gbg_writer *writer, struct gbg_engine *engine,
                     const struct gbg_engine_view *view);
/* Waits for the frames that were begun. */
int gbg_writer_settle(struct gbg_writer *writer);

void gbg_writer_look(const struct gbg_writer *writer, struct gbg_writer_size *size);

/* Closes, after the frames that were begun; a file without a first frame is removed. What it says
 * is their failure. NULL is allowed. */
int gbg_writer_close(struct gbg_writer *writer);

#endif
