/* Side room io: what a trajectory file of ours consists of. */
#ifndef GBG_IO_DEFINITION_H
#define GBG_IO_DEFINITION_H

#include <stdint.h>

struct gbg_engine_view;

/* The variables of a frame, in the order of the file. */
enum gbg_frame_variable {
    GBG_FRAME_TIME,
    GBG_FRAME_STEP,
    GBG_FRAME_STEP_NUMBER,
    GBG_FRAME_ORIGIN,
    GBG_FRAME_LENGTHS,
    GBG_FRAME_ANGLES,
    GBG_FRAME_COORDINATES,
    GBG_FRAME_IMAGE,
    GBG_FRAME_OVERLAP,
    GBG_FRAME_VARIABLES
};
extern const char *const gbg_frame_variable_name[GBG_FRAME_VARIABLES];

/* Makes the file: header, attributes and everything that does not change from frame to frame, by
 * netCDF's own library in its 64-bit offset format (CDF-2). Layout: AMBER convention; `spatial` is
 * always 3, in two dimensions z is 0 and the box as high as it is wide, because readers need both.
 * `path` is the name for messages. */
int gbg_trajectory_define(const struct gbg_engine_view *view, const char *file, const char *path);

/* The format allows no variable that takes more than this in one frame. */
#define GBG_CDF2_VARIABLE_BYTES INT64_C(4294967292)

#endif
