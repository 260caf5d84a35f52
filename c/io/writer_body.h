/* Side room io: the body of a trajectory's writer, for the files that share its work. */
#ifndef GBG_IO_WRITER_BODY_H
#define GBG_IO_WRITER_BODY_H

#include "core/box.h"
#include "io/classic.h"
#include "io/definition.h"
#include "io/writer.h"
#include "scene/scene.h"

enum { GBG_WRITER_CHUNK = 4096, GBG_WRITER_TEMPORARY = GBG_PATH_CAPACITY + 64 };

struct gbg_later;
struct gbg_frame;

/* What a frame says of itself before its arrays. */
struct gbg_stamp {
    double time;
    uint64_t step;
    struct gbg_box box;
};

struct gbg_writer {
    struct gbg_context *context;
    struct gbg_context *say; /* where sentences of the frame being written go */
    char path[GBG_PATH_CAPACITY], temporary[GBG_WRITER_TEMPORARY]; /* temporary "": has its name */
    int descriptor;                                                /* -1: none */
    struct gbg_writer_size size;
    int has_images, has_overlap;
    struct gbg_classic header;
    struct gbg_classic_variable variable[GBG_FRAME_VARIABLES];
    double last_step; /* of the frames so far, -1 without any */
    uint64_t *copy;   /* n values an axis: what the engine hands over */
    unsigned char *chunk;
    struct gbg_later *later; /* frames on their way; NULL: none was begun */
    int never_later;         /* 1: there was no memory for it */
};

/* GBG_E_FILE with the errno of a write of the frame in flight. */
int gbg_writer_failed(struct gbg_writer *writer, int number);

/* Parts of the frame in flight (record.c). Integers: n an axis, `width` a particle, of which the
 * missing ones are 0. */
int gbg_record_stamp(struct gbg_writer *writer, const struct gbg_stamp *stamp);
int gbg_record_coordinates(struct gbg_writer *writer, const struct gbg_box *box,
                           const uint64_t *const *fraction);
int gbg_record_integers(struct gbg_writer *writer, int variable, const int32_t *const *value,
                        int axes, int width);
/* All of a frame whose arrays are in memory. */
int gbg_record_frame(struct gbg_writer *writer, const struct gbg_stamp *stamp,
                     const struct gbg_frame *frame);

/* After the parts, which went well or not (status): the frame counts when it is on the disc, or
 * nothing is left of it. The caller counts it in writer->size. */
int gbg_writer_seal(struct gbg_writer *writer, int status);

/* Frames on their way (later.c): at most two. wait: until another has room; the first failure that
 * nobody has heard of, after which none is on its way. begin, after it: GBG_E_MEMORY if frames
 * cannot go this way. settle: until none is on its way; the same failure. */
int gbg_later_wait(struct gbg_writer *writer);
int gbg_later_begin(struct gbg_writer *writer, struct gbg_engine *engine,
                    const struct gbg_stamp *stamp);
int gbg_later_settle(struct gbg_writer *writer);
/* After a settle; NULL is allowed. */
void gbg_later_free(struct gbg_later *later);

struct gbg_later_count {
    int64_t frames, begun; /* in the file; with those on their way */
    double last_step;      /* of the last that was begun, -1: none */
};
struct gbg_later_count gbg_later_count(const struct gbg_writer *writer);

#endif
