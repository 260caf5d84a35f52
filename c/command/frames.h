/* Command: a trajectory opened to read, one frame of it in memory at a time. */
#ifndef GBG_COMMAND_FRAMES_H
#define GBG_COMMAND_FRAMES_H

#include "command/command.h"

struct gbg_frames {
    struct gbg_context *context;
    struct gbg_trajectory *trajectory;
    const char *path;
    int64_t frames, n;
    int dimension, n_species, is_double;
    int is_hard;      /* 0: diameters are only what is drawn */
    int32_t *species; /* from 0 */
    double *diameter;
    int64_t count[GBG_MAX_SPECIES];
    /* The frame that gbg_frames_load read last. */
    int64_t frame, step;
    double time, length[3], origin[3];
    double *r[3];
};

/* Opens the operand of a command (--threads is taken if the command has it). GBG_EXIT_DONE or the
 * exit status after a complaint; gbg_frames_close belongs after it in either case. */
int gbg_frames_open(const struct gbg_arguments *arguments, struct gbg_frames *frames);
int gbg_frames_load(struct gbg_frames *frames, int64_t frame);
/* The same without a complaint: the library's status. */
int gbg_frames_try(struct gbg_frames *frames, int64_t frame);
void gbg_frames_close(struct gbg_frames *frames);

/* The frames that --first, --last and --stride ask for; refuses those that the file has not. */
int gbg_frames_range(const struct gbg_arguments *arguments, const struct gbg_frames *frames,
                     int64_t *first, int64_t *last, int64_t *stride);
/* Largest error of a stored coordinate of the present frame: rounding to the file's precision. */
double gbg_frames_storage_error(const struct gbg_frames *frames);
/* Name of a species, cut to the capacity. */
void gbg_frames_species_name(const struct gbg_frames *frames, int species, size_t capacity,
                             char *name);

#endif
