/* Side room io: trajectories being read. */
#ifndef GBG_IO_READER_H
#define GBG_IO_READER_H

#include <stddef.h>
#include <stdint.h>

#include "scene/scene.h"

struct gbg_reader {
    struct gbg_context *context;
    char path[GBG_PATH_CAPACITY];
    int64_t frames, particles;
    int dimension, n_species, is_double, has_images, has_overlap;
    int has_names;   /* of species, from the file */
    int is_hard;     /* 0: the file says that there is no excluded volume */
    char digest[65]; /* of the scene that wrote it, "" in a foreign file */
    char name[GBG_MAX_SPECIES][GBG_NAME_CAPACITY];

    int file; /* netCDF's id, -1: none */
    struct gbg_reader_variable {
        int id;       /* -1: the file has none */
        double scale; /* attribute scale_factor, else 1 */
    } time, step, origin, lengths, angles, coordinates, image, overlap, types, radius, ids;
    int types_have_frames, radius_has_frames; /* (frame,atom) instead of (atom) */
    int has_diameters;                        /* 1: of our own file, else see radius */
    double diameter[GBG_MAX_SPECIES];
    int32_t *species; /* n, from 0 */
    double *buffer;   /* GBG_READER_CHUNK particles, 3 values each */
};

enum { GBG_READER_CHUNK = 4096 };

/* Opens a trajectory of the AMBER convention, ours or another's. What such a file need not have:
 * atom_types (then one species), radius (then diameter 1), time (then the number of the frame),
 * origin (0), dimensionality (3). A box that is not rectangular or not periodic is refused. */
int gbg_reader_open(struct gbg_context *context, const char *path, struct gbg_reader **reader);
void gbg_reader_close(struct gbg_reader *reader);

/* Frames count from 0; the caller has checked that it exists. */
int gbg_reader_frame(struct gbg_reader *reader, int64_t frame, double *time, int64_t *step,
                     double *length, double *origin);
/* Refuses a coordinate that is not finite or a fill value, with its frame and particle. */
int gbg_reader_positions(struct gbg_reader *reader, int64_t frame, double *const base[3],
                         ptrdiff_t step);
int gbg_reader_images(struct gbg_reader *reader, int64_t frame, int32_t *const base[3],
                      ptrdiff_t step);
int gbg_reader_overlap(struct gbg_reader *reader, int64_t frame, int32_t *flag);
int gbg_reader_diameters(struct gbg_reader *reader, double *diameter);
/* Permanent ids; those of the order when the file has none. */
int gbg_reader_ids(struct gbg_reader *reader, int64_t *id);

#endif
