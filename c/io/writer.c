/* Side room io: trajectories being written: records of a classic netCDF file, put in place by
 * ourselves, because netCDF's library gives no command of what reaches the disc when. Order of an
 * append: record, sync, number of records, sync; so the file never counts a record that is not
 * whole on the disc. */
#include "io/writer.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <string.h>
#include <unistd.h>

#include "core/file.h"
#include "core/memory.h"
#include "core/text.h"
#include "engine/view.h"
#include "io/classic.h"
#include "io/definition.h"
#include "io/reader.h"
#include "scene/scene.h"

enum { CHUNK = 4096, RECORDS_OFFSET = 4, TEMPORARY_BYTES = GBG_PATH_CAPACITY + 64 };
static const int64_t most_frames = INT64_C(0xfffffffe); /* all ones means streaming */
static const int32_t fill_int = -2147483647;            /* netCDF's mark of a missing int */

struct gbg_writer {
    struct gbg_context *context;
    char path[GBG_PATH_CAPACITY], temporary[TEMPORARY_BYTES]; /* temporary "": has its name */
    int descriptor;                                           /* -1: none */
    struct gbg_writer_size size;
    int has_images, has_overlap;
    struct gbg_classic header;
    struct gbg_classic_variable variable[GBG_FRAME_VARIABLES];
    double last_step; /* of the frames so far, -1 without any */
    uint64_t *copy;   /* n values an axis: what the engine hands over */
    unsigned char *chunk;
};

static void put_bits(unsigned char *to, uint64_t bits, int bytes)
{
    for (int k = bytes - 1; k >= 0; k--) {
        to[k] = (unsigned char)bits;
        bits >>= 8;
    }
}

static void put_double(unsigned char *to, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_bits(to, bits, 8);
}

static void put_float(unsigned char *to, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_bits(to, bits, 4);
}

static int write_failed(struct gbg_writer *writer, int number)
{
    char text[GBG_ERROR_TEXT];
    return gbg_fail(writer->context, GBG_E_FILE,
                    "%s: cannot write frame %" PRId64 ": %s (the "
                    "frames before it are safe)",
                    writer->path, writer->size.frames, gbg_file_error(number, text));
}

/* Writes bytes of the frame in flight, `skip` bytes into a variable. */
static int put(struct gbg_writer *writer, int v, int64_t skip, const void *data, size_t bytes)
{
    int64_t offset = gbg_classic_offset(&writer->header, &writer->variable[v], writer->size.frames);
    int number = gbg_file_write(writer->descriptor, data, bytes, offset + skip);
    return number ? write_failed(writer, number) : GBG_OK;
}

static int put_reals(struct gbg_writer *writer, int v, const double *values, int n)
{
    unsigned char raw[3 * 8];
    for (int k = 0; k < n; k++) {
        put_double(raw + 8 * k, values[k]);
    }
    return put(writer, v, 0, raw, (size_t)n * 8);
}

static int put_step(struct gbg_writer *writer, uint64_t step)
{
    unsigned char raw[4];
    double number = (double)step;
    int32_t fits = step <= INT32_MAX ? (int32_t)step : fill_int;
    put_bits(raw, (uint32_t)fits, 4);
    int status = put(writer, GBG_FRAME_STEP, 0, raw, sizeof raw);
    return status == GBG_OK ? put_reals(writer, GBG_FRAME_STEP_NUMBER, &number, 1) : status;
}

/* In two dimensions the box gets a height: neighbour searches of readers fail without. */
static int put_box(struct gbg_writer *writer, const struct gbg_box *box)
{
    static const double right_angles[3] = {90.0, 90.0, 90.0};
    double length[3], origin[3] = {0.0, 0.0, 0.0};
    memcpy(length, box->length, sizeof length);
    memcpy(origin, box->origin, sizeof origin);
    if (box->dimension == 2) {
        length[2] = length[0] > length[1] ? length[0] : length[1];
        origin[2] = 0.0;
    }
    int status = put_reals(writer, GBG_FRAME_ORIGIN, origin, 3);
    if (status == GBG_OK) {
        status = put_reals(writer, GBG_FRAME_LENGTHS, length, 3);
    }
    return status == GBG_OK ? put_reals(writer, GBG_FRAME_ANGLES, right_angles, 3) : status;
}

static size_t pack_coordinates(const struct gbg_writer *writer, const struct gbg_box *box,
                               int64_t first, int64_t m)
{
    int bytes = writer->size.is_double ? 8 : 4;
    unsigned char *to = writer->chunk;
    for (int64_t i = first; i < first + m; i++) {
        for (int a = 0; a < 3; a++, to += bytes) {
            const uint64_t *fraction = writer->copy + a * writer->size.particles;
            double r = a < box->dimension ? gbg_box_decode(box, a, fraction[i]) : 0.0;
            if (bytes == 8) {
                put_double(to, r);
            } else {
                put_float(to, (float)r);
            }
        }
    }
    return (size_t)(to - writer->chunk);
}

static int put_coordinates(struct gbg_writer *writer, struct gbg_engine *engine,
                           const struct gbg_box *box)
{
    int64_t n = writer->size.particles, done = 0;
    int status = GBG_OK;
    for (int a = 0; a < box->dimension && status == GBG_OK; a++) {
        status = gbg_engine_copy_fractions(engine, a, writer->copy + a * n);
    }
    for (int64_t first = 0; first < n && status == GBG_OK; first += CHUNK) {
        size_t bytes = pack_coordinates(writer, box, first, n - first < CHUNK ? n - first : CHUNK);
        status = put(writer, GBG_FRAME_COORDINATES, done, writer->chunk, bytes);
        done += (int64_t)bytes;
    }
    return status;
}

/* Integers of all particles, `width` a particle; axis a at copy + a n, missing axes are 0. */
static int put_integers(struct gbg_writer *writer, int v, int axes, int width)
{
    int64_t n = writer->size.particles, done = 0;
    int status = GBG_OK;
    for (int64_t first = 0; first < n && status == GBG_OK; first += CHUNK) {
        int64_t end = n - first < CHUNK ? n : first + CHUNK;
        unsigned char *to = writer->chunk;
        for (int64_t i = first; i < end; i++) {
            for (int a = 0; a < width; a++, to += 4) {
                const int32_t *value = (const int32_t *)(writer->copy + a * n);
                put_bits(to, a < axes ? (uint32_t)value[i] : 0, 4);
            }
        }
        size_t bytes = (size_t)(to - writer->chunk);
        status = put(writer, v, done, writer->chunk, bytes);
        done += (int64_t)bytes;
    }
    return status;
}

static int put_images(struct gbg_writer *writer, struct gbg_engine *engine)
{
    int status = GBG_OK, axes = writer->size.dimension;
    for (int a = 0; a < axes && status == GBG_OK; a++) {
        int32_t *to = (int32_t *)(writer->copy + a * writer->size.particles);
        status = gbg_engine_copy_images(engine, a, to);
    }
    return status == GBG_OK ? put_integers(writer, GBG_FRAME_IMAGE, axes, 3) : status;
}

static int put_record(struct gbg_writer *writer, struct gbg_engine *engine,
                      const struct gbg_engine_view *view)
{
    int status = put_reals(writer, GBG_FRAME_TIME, &view->time, 1);
    if (status == GBG_OK) {
        status = put_step(writer, view->step);
    }
    if (status == GBG_OK) {
        status = put_box(writer, &view->box);
    }
    if (status == GBG_OK) {
        status = put_coordinates(writer, engine, &view->box);
    }
    if (status == GBG_OK && writer->has_images) {
        status = put_images(writer, engine);
    }
    if (status == GBG_OK && writer->has_overlap) {
        status = gbg_engine_copy_overlap(engine, (int32_t *)writer->copy);
        if (status == GBG_OK) {
            status = put_integers(writer, GBG_FRAME_OVERLAP, 1, 1);
        }
    }
    return status;
}

static int sync_data(struct gbg_writer *writer)
{
    return fdatasync(writer->descriptor) == 0 ? GBG_OK : write_failed(writer, errno);
}

/* Makes the header count `frames` records. */
static int put_count(struct gbg_writer *writer, int64_t frames)
{
    unsigned char raw[4];
    put_bits(raw, (uint64_t)frames, 4);
    int number = gbg_file_write(writer->descriptor, raw, sizeof raw, RECORDS_OFFSET);
    return number ? write_failed(writer, number) : sync_data(writer);
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
    put_bits(raw, (uint64_t)writer->size.frames, 4);
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
    if ((double)view->step < writer->last_step) {
        return gbg_fail(writer->context, GBG_E_ORDER,
                        "%s: the engine is at step %" PRIu64
                        " and the file already at step %.0f; gbg_trajectory_continue cuts it back",
                        writer->path, view->step, writer->last_step);
    }
    if (size->frames >= most_frames) {
        return gbg_fail(writer->context, GBG_E_FILE,
                        "%s: it holds %" PRId64 " frames, the most "
                        "that the file format can count",
                        writer->path, size->frames);
    }
    return GBG_OK;
}

int gbg_writer_append(struct gbg_writer *writer, struct gbg_engine *engine,
                      const struct gbg_engine_view *view)
{
    int status = check_engine(writer, view);
    if (status != GBG_OK) {
        return status;
    }
    status = put_record(writer, engine, view);
    if (status == GBG_OK) {
        status = sync_data(writer);
    }
    if (status == GBG_OK) {
        status = put_count(writer, writer->size.frames + 1);
    }
    if (status == GBG_OK) {
        status = give_name(writer);
    }
    if (status != GBG_OK) {
        cut_back(writer);
        return status;
    }
    writer->size.frames++;
    writer->last_step = (double)view->step;
    return GBG_OK;
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
    fresh->context = view->context;
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
        status = write_failed(*writer, errno);
    }
    if (status == GBG_OK) {
        (*writer)->size.frames = kept;
    }
    return finish(writer, status);
}

void gbg_writer_look(const struct gbg_writer *writer, struct gbg_writer_size *size)
{
    *size = writer->size;
}

void gbg_writer_close(struct gbg_writer *writer)
{
    if (!writer) {
        return;
    }
    if (writer->descriptor >= 0) {
        close(writer->descriptor);
    }
    gbg_file_abandon(writer->temporary);
    gbg_release(writer->copy);
    gbg_release(writer->chunk);
    gbg_release(writer);
}
