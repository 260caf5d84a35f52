/* Side room io: trajectories being read: the data of frames. Opening is in reader_open.c. */
#include "io/reader.h"

#include <inttypes.h>
#include <math.h>

#include "io/netcdf_call.h"

/* netCDF's fill value of reals is 9.97e36; a length beyond this is none. */
static const double absurd = 1e36;

static int64_t chunk_end(const struct gbg_reader *reader, int64_t first)
{
    int64_t rest = reader->particles - first;
    return first + (rest < GBG_READER_CHUNK ? rest : GBG_READER_CHUNK);
}

/* Values of a variable (frame,k), k < 3, or (frame): `n` of them. */
static void get_few(const struct gbg_reader *reader, struct gbg_netcdf *series,
                    const struct gbg_reader_variable *variable, int64_t frame, int n,
                    double *values)
{
    size_t start[2] = {(size_t)frame, 0}, count[2] = {1, (size_t)n};
    GBG_CALL(series, nc_get_vara_double(reader->file, variable->id, start, count, values));
    for (int k = 0; k < n; k++) {
        values[k] *= variable->scale;
    }
}

static int bad_box(struct gbg_reader *reader, int64_t frame, const char *what, int axis,
                   double value)
{
    return gbg_fail(reader->context, GBG_E_FORMAT,
                    "%s: frame %" PRId64 ": %s %d is %g; only "
                    "periodic rectangular boxes can be read",
                    reader->path, frame, what, axis + 1, value);
}

static int check_box(struct gbg_reader *reader, int64_t frame, const double *length,
                     const double *origin, const double *angle)
{
    for (int a = 0; a < reader->dimension; a++) {
        if (!(length[a] > 0.0 && length[a] < absurd)) {
            return bad_box(reader, frame, "cell length", a, length[a]);
        }
        if (!(fabs(origin[a]) < absurd)) {
            return bad_box(reader, frame, "cell origin", a, origin[a]);
        }
    }
    for (int a = 0; a < 3; a++) {
        if (!(fabs(angle[a] - 90.0) < 1e-6)) {
            return bad_box(reader, frame, "cell angle", a, angle[a]);
        }
    }
    return GBG_OK;
}

static int check_time(struct gbg_reader *reader, int64_t frame, double time, double step)
{
    if (!(fabs(time) < absurd)) {
        return gbg_fail(reader->context, GBG_E_FORMAT, "%s: frame %" PRId64 ": its time is %g",
                        reader->path, frame, time);
    }
    if (!(fabs(step) < 9.2e18)) {
        return gbg_fail(reader->context, GBG_E_FORMAT, "%s: frame %" PRId64 ": its step is %g",
                        reader->path, frame, step);
    }
    return GBG_OK;
}

int gbg_reader_frame(struct gbg_reader *reader, int64_t frame, double *time, int64_t *step,
                     double *length, double *origin)
{
    struct gbg_netcdf series = {reader->file, NC_NOERR};
    double when = (double)frame, number = (double)frame;
    double lengths[3], corner[3] = {0.0, 0.0, 0.0}, angle[3] = {90.0, 90.0, 90.0};
    get_few(reader, &series, &reader->lengths, frame, 3, lengths);
    if (reader->origin.id >= 0) {
        get_few(reader, &series, &reader->origin, frame, 3, corner);
    }
    if (reader->angles.id >= 0) {
        get_few(reader, &series, &reader->angles, frame, 3, angle);
    }
    if (reader->time.id >= 0) {
        get_few(reader, &series, &reader->time, frame, 1, &when);
    }
    if (reader->step.id >= 0) {
        get_few(reader, &series, &reader->step, frame, 1, &number);
    }
    int status = gbg_netcdf_status(reader->context, &series, "read time and box", reader->path);
    if (status == GBG_OK) {
        status = check_box(reader, frame, lengths, corner, angle);
    }
    if (status == GBG_OK) {
        status = check_time(reader, frame, when, number);
    }
    if (status != GBG_OK) {
        return status;
    }
    *time = when;
    *step = (int64_t)number;
    for (int a = 0; a < reader->dimension; a++) {
        length[a] = lengths[a];
        origin[a] = corner[a];
    }
    return GBG_OK;
}

static int bad_coordinate(struct gbg_reader *reader, int64_t frame, int64_t i, int a, double value)
{
    return gbg_fail(reader->context, GBG_E_FORMAT,
                    "%s: frame %" PRId64 ", particle %" PRId64 " (both from 0): %c is %g, %s",
                    reader->path, frame, i, "xyz"[a], value,
                    isfinite(value) ? "netCDF's mark of a value never written" : "not a number");
}

int gbg_reader_positions(struct gbg_reader *reader, int64_t frame, double *const base[3],
                         ptrdiff_t step)
{
    struct gbg_netcdf series = {reader->file, NC_NOERR};
    for (int64_t first = 0; first < reader->particles; first += GBG_READER_CHUNK) {
        int64_t end = chunk_end(reader, first);
        size_t start[3] = {(size_t)frame, (size_t)first, 0},
               count[3] = {1, (size_t)(end - first), 3};
        GBG_CALL(&series, nc_get_vara_double(reader->file, reader->coordinates.id, start, count,
                                             reader->buffer));
        if (series.code != NC_NOERR) {
            break;
        }
        const double *from = reader->buffer;
        for (int64_t i = first; i < end; i++, from += 3) {
            for (int a = 0; a < reader->dimension; a++) {
                if (!(fabs(from[a]) < absurd)) {
                    return bad_coordinate(reader, frame, i, a, from[a]);
                }
                base[a][i * step] = from[a] * reader->coordinates.scale;
            }
        }
    }
    return gbg_netcdf_status(reader->context, &series, "read coordinates", reader->path);
}

int gbg_reader_images(struct gbg_reader *reader, int64_t frame, int32_t *const base[3],
                      ptrdiff_t step)
{
    struct gbg_netcdf series = {reader->file, NC_NOERR};
    int *values = (int *)reader->buffer;
    for (int64_t first = 0; first < reader->particles && series.code == NC_NOERR;
         first += GBG_READER_CHUNK) {
        int64_t end = chunk_end(reader, first);
        size_t start[3] = {(size_t)frame, (size_t)first, 0},
               count[3] = {1, (size_t)(end - first), 3};
        GBG_CALL(&series, nc_get_vara_int(reader->file, reader->image.id, start, count, values));
        for (int64_t i = first; i < end && series.code == NC_NOERR; i++) {
            for (int a = 0; a < reader->dimension; a++) {
                base[a][i * step] = values[3 * (i - first) + a];
            }
        }
    }
    return gbg_netcdf_status(reader->context, &series, "read image counts", reader->path);
}

int gbg_reader_overlap(struct gbg_reader *reader, int64_t frame, int32_t *flag)
{
    struct gbg_netcdf series = {reader->file, NC_NOERR};
    size_t start[2] = {(size_t)frame, 0}, count[2] = {1, (size_t)reader->particles};
    GBG_CALL(&series, nc_get_vara_int(reader->file, reader->overlap.id, start, count, flag));
    return gbg_netcdf_status(reader->context, &series, "read overlap flags", reader->path);
}

/* A real for each particle, of a variable (atom) or (frame,atom): the first frame. */
static int get_reals(struct gbg_reader *reader, const struct gbg_reader_variable *variable,
                     int has_frames, const char *what, double *values)
{
    struct gbg_netcdf series = {reader->file, NC_NOERR};
    size_t start[2] = {0, 0}, count[2] = {1, (size_t)reader->particles};
    int skip = has_frames ? 0 : 1;
    GBG_CALL(&series,
             nc_get_vara_double(reader->file, variable->id, start + skip, count + skip, values));
    return gbg_netcdf_status(reader->context, &series, what, reader->path);
}

int gbg_reader_diameters(struct gbg_reader *reader, double *diameter)
{
    if (reader->has_diameters || reader->radius.id < 0) {
        for (int64_t i = 0; i < reader->particles; i++) {
            diameter[i] = reader->has_diameters ? reader->diameter[reader->species[i]] : 1.0;
        }
        return GBG_OK;
    }
    int status =
        get_reals(reader, &reader->radius, reader->radius_has_frames, "read radii", diameter);
    for (int64_t i = 0; i < reader->particles && status == GBG_OK; i++) {
        diameter[i] *= 2.0 * reader->radius.scale;
        if (!(diameter[i] >= 0.0 && diameter[i] < absurd)) {
            status = gbg_fail(reader->context, GBG_E_FORMAT,
                              "%s: the radius of particle %" PRId64 " is %g", reader->path, i,
                              diameter[i] / 2.0);
        }
    }
    return status;
}

int gbg_reader_ids(struct gbg_reader *reader, int64_t *id)
{
    int status = GBG_OK;
    double last = -1.0;
    for (int64_t first = 0; first < reader->particles && status == GBG_OK;
         first += GBG_READER_CHUNK) {
        int64_t end = chunk_end(reader, first);
        struct gbg_netcdf series = {reader->file, NC_NOERR};
        size_t start = (size_t)first, count = (size_t)(end - first);
        if (reader->ids.id >= 0) {
            GBG_CALL(&series, nc_get_vara_double(reader->file, reader->ids.id, &start, &count,
                                                 reader->buffer));
            status = gbg_netcdf_status(reader->context, &series, "read ids", reader->path);
        }
        for (int64_t i = first; i < end && status == GBG_OK; i++) {
            double value = reader->ids.id >= 0 ? reader->buffer[i - first] : (double)i;
            if (!(value > last && value <= 0x1p53 && value == floor(value))) {
                status = gbg_fail(reader->context, GBG_E_FORMAT,
                                  "%s: the id of particle %" PRId64
                                  " is %g, not a whole number up to 2^53 above the one before",
                                  reader->path, i, value);
            }
            last = value;
            id[i] = status == GBG_OK ? (int64_t)value : 0;
        }
    }
    return status;
}
