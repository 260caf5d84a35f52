/* Side room io: the bytes of a frame in a trajectory: one record of a classic netCDF file. */
#include <errno.h>
#include <inttypes.h>
#include <string.h>

#include "core/context.h"
#include "core/file.h"
#include "core/view.h"
#include "io/writer_body.h"

enum { CHUNK = GBG_WRITER_CHUNK };
static const int32_t fill_int = -2147483647; /* netCDF's mark of a missing int */

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

int gbg_writer_failed(struct gbg_writer *writer, int number)
{
    char text[GBG_ERROR_TEXT];
    return gbg_fail(writer->say, GBG_E_FILE,
                    "%s: cannot write frame %" PRId64 ": %s (the "
                    "frames before it are safe)",
                    writer->path, writer->size.frames, gbg_file_error(number, text));
}

/* Writes bytes of the frame in flight, `skip` bytes into a variable. */
static int put(struct gbg_writer *writer, int v, int64_t skip, const void *data, size_t bytes)
{
    int64_t offset = gbg_classic_offset(&writer->header, &writer->variable[v], writer->size.frames);
    int number = gbg_file_write(writer->descriptor, data, bytes, offset + skip);
    return number ? gbg_writer_failed(writer, number) : GBG_OK;
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
                               const uint64_t *const *fraction, int64_t first, int64_t m)
{
    int bytes = writer->size.is_double ? 8 : 4;
    unsigned char *to = writer->chunk;
    for (int64_t i = first; i < first + m; i++) {
        for (int a = 0; a < 3; a++, to += bytes) {
            double r = a < box->dimension ? gbg_box_decode(box, a, fraction[a][i]) : 0.0;
            if (bytes == 8) {
                put_double(to, r);
            } else {
                put_float(to, (float)r);
            }
        }
    }
    return (size_t)(to - writer->chunk);
}

int gbg_record_coordinates(struct gbg_writer *writer, const struct gbg_box *box,
                           const uint64_t *const *fraction)
{
    int64_t n = writer->size.particles, done = 0;
    int status = GBG_OK;
    for (int64_t first = 0; first < n && status == GBG_OK; first += CHUNK) {
        int64_t m = n - first < CHUNK ? n - first : CHUNK;
        size_t bytes = pack_coordinates(writer, box, fraction, first, m);
        status = put(writer, GBG_FRAME_COORDINATES, done, writer->chunk, bytes);
        done += (int64_t)bytes;
    }
    return status;
}

int gbg_record_integers(struct gbg_writer *writer, int variable, const int32_t *const *value,
                        int axes, int width)
{
    int64_t n = writer->size.particles, done = 0;
    int status = GBG_OK;
    for (int64_t first = 0; first < n && status == GBG_OK; first += CHUNK) {
        int64_t end = n - first < CHUNK ? n : first + CHUNK;
        unsigned char *to = writer->chunk;
        for (int64_t i = first; i < end; i++) {
            for (int a = 0; a < width; a++, to += 4) {
                put_bits(to, a < axes ? (uint32_t)value[a][i] : 0, 4);
            }
        }
        size_t bytes = (size_t)(to - writer->chunk);
        status = put(writer, variable, done, writer->chunk, bytes);
        done += (int64_t)bytes;
    }
    return status;
}

int gbg_record_stamp(struct gbg_writer *writer, const struct gbg_stamp *stamp)
{
    int status = put_reals(writer, GBG_FRAME_TIME, &stamp->time, 1);
    status = status ? status : put_step(writer, stamp->step);
    return status ? status : put_box(writer, &stamp->box);
}

int gbg_record_frame(struct gbg_writer *writer, const struct gbg_stamp *stamp,
                     const struct gbg_frame *frame)
{
    int status = gbg_record_stamp(writer, stamp);
    status = status ? status : gbg_record_coordinates(writer, &stamp->box, frame->fraction);
    if (status == GBG_OK && writer->has_images) {
        status =
            gbg_record_integers(writer, GBG_FRAME_IMAGE, frame->image, stamp->box.dimension, 3);
    }
    if (status == GBG_OK && writer->has_overlap) {
        status = gbg_record_integers(writer, GBG_FRAME_OVERLAP, &frame->overlapped, 1, 1);
    }
    return status;
}
