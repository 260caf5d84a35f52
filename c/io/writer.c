/* Side room io: trajectories being written: records of a classic netCDF file, put in place by
 * ourselves, because netCDF's library gives no command of what reaches the disc when. Order of an
 * append: record, sync, number of records, sync; so the file never counts a record that is not
 * whole on the disc. */
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <string.h>
#include <unistd.h>

#include "core/file.h"
#include "core/memory.h"
#include "core/text.h"
#include "engine/view.h"
#include "io/reader.h"
#include "io/writer_body.h"
#include "scene/scene.h"

enum { CHUNK = GBG_WRITER_CHUNK, RECORDS_OFFSET = 4, TEMPORARY_BYTES = GBG_WRITER_TEMPORARY };
static const int64_t most_frames = INT64_C(0xfffffffe); /* all ones means streaming */

static int put_coordinates(struct gbg_writer *writer, struct gbg_engine *engine,
                           const struct gbg_box *box)
{
    const uint64_t *fraction[3] = {NULL, NULL, NULL};
    int status = GBG_OK;
    for (int a = 0; a < box->dimension && status == GBG_OK; a++) {
        uint64_t *to = writer->copy + a * writer->size.particles;
        status = gbg_engine_copy_fractions(engine, a, to);
        fraction[a] = to;
    }
    return status ? status : gbg_record_coordinates(writer, box, fraction);
}

static int put_images(struct gbg_writer *writer, struct gbg_engine *engine)
{
    const int32_t *image[3] = {NULL, NULL, NULL};
    int status = GBG_OK, axes = writer->size.dimension;
    for (int a = 0; a < axes && status == GBG_OK; a++) {
        int32_t *to = (int32_t *)(writer->copy + a * writer->size.particles);
        status = gbg_engine_copy_images(engine, a, to);
        image[a] = to;
    }
    return status ? status : gbg_record_integers(writer, GBG_FRAME_IMAGE, image, axes, 3);
}

static int put_overlap(struct gbg_writer *writer, struct gbg_engine *engine)
{
    const int32_t *flag = (const int32_t *)writer->copy;
    int status = gbg_engine_copy_overlap(engine, (int32_t *)writer->copy);
    return status ? status : gbg_record_integers(writer, GBG_FRAME_OVERLAP, &flag, 1, 1);
}

/* An engine that can be read at any time hands over array by array: one of them is held. */
static int put_record(struct gbg_writer *writer, struct gbg_engine *engine,
                      const struct gbg_stamp *stamp)
{
    int status = gbg_record_stamp(writer, stamp);
    status = status ? status : put_coordinates(writer, engine, &stamp->box);
    if (status == GBG_OK && writer->has_images) {
        status = put_images(writer, engine);
    }
    if (status == GBG_OK && writer->has_overlap) {
        status = put_overlap(writer, engine);
    }
    return status;
}

static int sync_data(struct gbg_writer *writer)
{
    return fdatasync(writer->descriptor) == 0 ? GBG_OK : gbg_writer_failed(writer, errno);
}

static void pack_count(unsigned char raw[4], int64_t frames)
{
    for (int k = 0; k < 4; k++) {
        raw[k] = (unsigned char)((uint64_t)frames >> (24 - 8 * k));
    }
}

/* Makes the header count `frames` records. */
static int put_count(struct gbg_writer *writer, int64_t frames)
{
    unsigned char raw[4];
    pack_count(raw, frames);
    int number = gbg_file_write(writer->descriptor, raw, sizeof raw, RECORDS_OFFSET);
    return number ? gbg_writer_failed(writer, number) : sync_data(writer);
}

/* Bytes of the file with a number of frames: records follow each other without gaps. */
static int64_t bytes_with(const struct gbg_writer *writer, int64_t frames)
{
    return writer->variable[GBG_FRAME_TIME].begin + frames * writer->header.record;
}

/* After a failure: the count of before and no part of the frame. The failure is reported already;
 * if this fails too, the count was not raised or will be put right by the next append. */
static void cut_back(struct gbg_writer *writer)
{
    unsigned char raw[4];
    pack_count(raw, writer->size.frames);
    if (gbg_file_write(writer->descriptor, raw, sizeof raw, RECORDS_OFFSET) == 0 &&
        ftruncate(writer->descriptor, (off_t)bytes_with(writer, writer->size.frames)) == 0) {
        fdatasync(writer->descriptor);
    }
}

static int give_name(struct gbg_writer *writer)
{
    if (!writer->temporary[0]) {
        return GBG_OK;
    }
    int status = gbg_file_commit(writer->context, writer->temporary, writer->path);
    if (status == GBG_OK || access(writer->temporary, F_OK) != 0) {
        writer->temporary[0] = 0; /* also when only the sync of the directory failed */
    }
    return status;
}

static int check_engine(struct gbg_writer *writer, const struct gbg_engine_view *view)
{
    const struct gbg_writer_size *size = &writer->size;
    struct gbg_later_count count = gbg_later_count(writer);
    if (view->n != size->particles || view->box.dimension != size->dimension) {
        return gbg_fail(
            writer->context, GBG_E_ARGUMENT,
            "%s: the engine has %" PRId64 " particles in %d dimensions, the file %" PRId64 " in %d",
            writer->path, view->n, view->box.dimension, size->particles, size->dimension);
    }
    if (view->has_images < writer->has_images || view->has_overlap < writer->has_overlap) {
        return gbg_fail(writer->context, GBG_E_ARGUMENT,
                        "%s: the file holds %s and the engine "
                        "keeps none",
                        writer->path,
                        view->has_images < writer->has_images ? "images" : "overlap flags");
    }
    if ((double)view->step < count.last_step) {
        return gbg_fail(writer->context, GBG_E_ORDER,
                        "%s: the engine is at step %" PRIu64
                        " and the file already at step %.0f; gbg_trajectory_continue cuts it back",
                        writer->path, view->step, count.last_step);
    }
    if (count.begun >= most_frames) {
        return gbg_fail(writer->context, GBG_E_FILE,
                        "%s: it holds %" PRId64 " frames, the most "
                        "that the file format can count",
                        writer->path, count.begun);
    }
    return GBG_OK;
}

int gbg_writer_seal(struct gbg_writer *writer, int status)
{
    status = status ? status : sync_data(writer);
    status = status ? status : put_count(writer, writer->size.frames + 1);
    status = status ? status : give_name(writer);
    if (status != GBG_OK) {
        cut_back(writer);
    }
    return status;
}

int gbg_writer_append(struct gbg_writer *writer, struct gbg_engine *engine,
                      const struct gbg_engine_view *view)
{
    const struct gbg_stamp stamp = {view->time, view->step, view->box};
    int status = gbg_later_settle(writer);
    status = status ? status : check_engine(writer, view);
    if (status != GBG_OK) {
        return status;
    }
    writer->say = writer->context;
    status = gbg_writer_seal(writer, put_record(writer, engine, &stamp));
    if (status == GBG_OK) {
        writer->size.frames++;
        writer->last_step = (double)view->step;
    }
    return status;
}

int gbg_writer_begin(struct gbg_writer *writer, struct gbg_engine *engine,
                     const struct gbg_engine_view *view)
{
    const struct gbg_stamp stamp = {view->time, view->step, view->box};
    if (!gbg_engine_copies_ahead(engine) || writer->never_later) {
        return gbg_writer_append(writer, engine, view);
    }
    int status = gbg_later_wait(writer);
    status = status ? status : check_engine(writer, view);
    if (status != GBG_OK) {
        return status;
    }
    status = gbg_later_begin(writer, engine, &stamp);
    if (status == GBG_E_MEMORY) {
        writer->never_later = 1;
        return gbg_writer_append(writer, engine, view);
    }
    return status;
}

/* Finds the variables of the file that is open and checks that they lie as this code writes them.
 */
static int read_layout(struct gbg_writer *writer)
{
    for (int v = 0; v < GBG_FRAME_VARIABLES; v++) {
        writer->variable[v].name = gbg_frame_variable_name[v];
    }
    const char *defect = gbg_classic_read(writer->descriptor, &writer->header, writer->variable,
                                          GBG_FRAME_VARIABLES);
    if (defect) {
        return gbg_fail(writer->context, GBG_E_FORMAT, "%s: %s", writer->path, defect);
    }
    int64_t next = writer->variable[GBG_FRAME_TIME].begin, first = next;
    for (int v = 0; v < GBG_FRAME_VARIABLES; v++) {
        const struct gbg_classic_variable *variable = &writer->variable[v];
        int wanted = (v != GBG_FRAME_IMAGE || writer->has_images) &&
                     (v != GBG_FRAME_OVERLAP || writer->has_overlap);
        if (variable->found != wanted ||
            (wanted && (!variable->is_record || variable->begin != next))) {
            return gbg_fail(writer->context, GBG_E_FORMAT,
                            "%s: variable %s is not where gamboge "
                            "puts it, so frames cannot be added",
                            writer->path, gbg_frame_variable_name[v]);
        }
        next += wanted ? variable->bytes : 0;
    }
    if (writer->header.version != 2 || next - first != writer->header.record) {
        return gbg_fail(writer->context, GBG_E_FORMAT,
                        "%s: it was not laid out by gamboge, so "
                        "frames cannot be added",
                        writer->path);
    }
    return GBG_OK;
}

static int open_file(struct gbg_writer *writer, const char *name)
{
    char text[GBG_ERROR_TEXT];
    writer->descriptor = open(name, O_RDWR | O_CLOEXEC);
    if (writer->descriptor < 0) {
        return gbg_fail(writer->context, GBG_E_FILE, "%s: cannot open it for writing: %s",
                        writer->path, gbg_file_error(errno, text));
    }
    return read_layout(writer);
}

static int make(const struct gbg_engine_view *view, const char *path, struct gbg_writer **writer)
{
    *writer = NULL;
    void *memory;
    int status =
        gbg_allocate_zero(view->context, &memory, 1, sizeof **writer, "a trajectory writer");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_writer *fresh = *writer = memory;
    fresh->context = fresh->say = view->context;
    fresh->descriptor = -1;
    fresh->last_step = -1.0;
    fresh->has_images = view->has_images;
    fresh->has_overlap = view->has_overlap;
    fresh->size = (struct gbg_writer_size){0, view->n, view->box.dimension, view->scene->n_species,
                                           view->scene->output_double};
    if (!gbg_text_copy(fresh->path, sizeof fresh->path, path)) {
        return gbg_fail(view->context, GBG_E_ARGUMENT, "%.60s...: the path is longer than %d bytes",
                        path, GBG_PATH_CAPACITY - 1);
    }
    status = gbg_allocate(view->context, &memory, view->n * fresh->size.dimension,
                          sizeof *fresh->copy, "a copy of the coordinates");
    fresh->copy = memory;
    if (status == GBG_OK) {
        status = gbg_allocate(view->context, &memory, CHUNK, 3 * sizeof(double), "a file buffer");
        fresh->chunk = memory;
    }
    return status;
}

static int finish(struct gbg_writer **writer, int status)
{
    if (status != GBG_OK) {
        gbg_writer_close(*writer);
        *writer = NULL;
    }
    return status;
}

int gbg_writer_create(const struct gbg_engine_view *view, const char *path,
                      struct gbg_writer **writer)
{
    int status = make(view, path, writer);
    if (status == GBG_OK) {
        status = gbg_file_temporary(view->context, path, (*writer)->temporary, TEMPORARY_BYTES);
    }
    if (status == GBG_OK) {
        status = gbg_trajectory_define(view, (*writer)->temporary, path);
    }
    if (status == GBG_OK) {
        status = open_file(*writer, (*writer)->temporary);
    }
    return finish(writer, status);
}

/* The file must be of this scene and hold what this engine would write. */
static int check_file(const struct gbg_reader *reader, const struct gbg_writer *writer,
                      const struct gbg_engine_view *view)
{
    char digest[65];
    const struct gbg_writer_size *size = &writer->size;
    gbg_scene_digest(view->scene, digest);
    if (reader->particles != size->particles || reader->dimension != size->dimension) {
        return gbg_fail(view->context, GBG_E_FORMAT,
                        "%s: it holds %" PRId64 " particles in %d "
                        "dimensions, the engine %" PRId64 " in %d",
                        writer->path, reader->particles, reader->dimension, size->particles,
                        size->dimension);
    }
    if (strcmp(reader->digest, digest) != 0) {
        return gbg_fail(view->context, GBG_E_FORMAT,
                        "%s: it belongs to another scene (digest "
                        "%.12s..., this scene has %.12s...)",
                        writer->path, reader->digest[0] ? reader->digest : "missing", digest);
    }
    if (reader->is_double != size->is_double || reader->has_images != writer->has_images ||
        reader->has_overlap != writer->has_overlap) {
        return gbg_fail(view->context, GBG_E_FORMAT,
                        "%s: its frames hold %s coordinates, images: "
                        "%s, overlap flags: %s; this scene asks for %s, %s, %s",
                        writer->path, reader->is_double ? "double" : "float",
                        reader->has_images ? "yes" : "no", reader->has_overlap ? "yes" : "no",
                        size->is_double ? "double" : "float", writer->has_images ? "yes" : "no",
                        writer->has_overlap ? "yes" : "no");
    }
    return GBG_OK;
}

static int check_path(struct gbg_writer *writer, const struct gbg_engine_view *view)
{
    struct gbg_reader *reader;
    int status = gbg_reader_open(view->context, writer->path, &reader);
    if (status == GBG_OK) {
        status = check_file(reader, writer, view);
        gbg_reader_close(reader);
    }
    return status;
}

/* Number of frames whose step is not later than `step`. */
static int count_kept(struct gbg_writer *writer, uint64_t step, int64_t *kept)
{
    for (*kept = writer->header.frames; *kept > 0; --*kept) {
        unsigned char raw[8];
        int64_t offset = gbg_classic_offset(&writer->header,
                                            &writer->variable[GBG_FRAME_STEP_NUMBER], *kept - 1);
        if (gbg_file_read(writer->descriptor, raw, sizeof raw, offset) != 0) {
            return gbg_fail(writer->context, GBG_E_FILE,
                            "%s: cannot read the step of frame %" PRId64, writer->path, *kept - 1);
        }
        uint64_t bits = 0;
        for (int k = 0; k < 8; k++) {
            bits = bits << 8 | raw[k];
        }
        memcpy(&writer->last_step, &bits, sizeof bits);
        if (writer->last_step <= (double)step) {
            return GBG_OK;
        }
    }
    writer->last_step = -1.0;
    return GBG_OK;
}

int gbg_writer_continue(const struct gbg_engine_view *view, const char *path,
                        struct gbg_writer **writer)
{
    int64_t kept = 0;
    int status = make(view, path, writer);
    if (status == GBG_OK) {
        status = check_path(*writer, view);
    }
    if (status == GBG_OK) {
        status = open_file(*writer, path);
    }
    if (status == GBG_OK) {
        status = count_kept(*writer, view->step, &kept);
    }
    if (status == GBG_OK && kept < (*writer)->header.frames) {
        status = put_count(*writer, kept);
    }
    if (status == GBG_OK &&
        ftruncate((*writer)->descriptor, (off_t)bytes_with(*writer, kept)) != 0) {
        status = gbg_writer_failed(*writer, errno);
    }
    if (status == GBG_OK) {
        (*writer)->size.frames = kept;
    }
    return finish(writer, status);
}

void gbg_writer_look(const struct gbg_writer *writer, struct gbg_writer_size *size)
{
    *size = writer->size; /* but for the frames it never changes */
    size->frames = gbg_later_count(writer).frames;
}

int gbg_writer_settle(struct gbg_writer *writer)
{
    return gbg_later_settle(writer);
}

int gbg_writer_close(struct gbg_writer *writer)
{
    if (!writer) {
        return GBG_OK;
    }
    int status = gbg_later_settle(writer);
    gbg_later_free(writer->later);
    if (writer->descriptor >= 0) {
        close(writer->descriptor);
    }
    gbg_file_abandon(writer->temporary);
    gbg_release(writer->copy);
    gbg_release(writer->chunk);
    gbg_release(writer);
    return status;
}
