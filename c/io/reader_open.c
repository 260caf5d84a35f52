/* Side room io: trajectories being read: what is in the file, checked once when it is opened. */
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "core/memory.h"
#include "core/text.h"
#include "io/classic.h"
#include "io/netcdf_call.h"
#include "io/reader.h"

enum { MOST_RANK = 3 };

struct opening {
    struct gbg_reader *reader;
    struct gbg_netcdf series;
    int frame, atom, spatial, cell_spatial, cell_angular; /* dimension ids, -1: none */
};

static int refuse(struct gbg_reader *reader, const char *text)
{
    return gbg_fail(reader->context, GBG_E_FORMAT, "%s: %s", reader->path, text);
}

/* A classic file must be as long as its header says; netCDF's library would read zeros. */
static int check_classic(struct gbg_reader *reader, int descriptor)
{
    struct gbg_classic header;
    const char *defect = gbg_classic_read(descriptor, &header, NULL, 0);
    if (defect) {
        return refuse(reader, defect);
    }
    if (header.size < header.needed) {
        return gbg_fail(reader->context, GBG_E_FORMAT,
                        "%s: it is cut short: %" PRId64 " frames need %" PRId64
                        " bytes, and it has %" PRId64,
                        reader->path, header.frames, header.needed, header.size);
    }
    return GBG_OK;
}

/* The kind of file by its first bytes: classic netCDF, HDF5 (netCDF-4), or something else. */
static int check_bytes(struct gbg_reader *reader)
{
    char text[GBG_ERROR_TEXT];
    unsigned char magic[4];
    int descriptor = open(reader->path, O_RDONLY | O_CLOEXEC), status = GBG_OK;
    if (descriptor < 0) {
        return gbg_fail(reader->context, GBG_E_FILE, "%s: cannot open it: %s", reader->path,
                        gbg_file_error(errno, text));
    }
    int number = gbg_file_read(descriptor, magic, sizeof magic, 0);
    if (number > 0) {
        status = gbg_fail(reader->context, GBG_E_FILE, "%s: cannot read it: %s", reader->path,
                          gbg_file_error(number, text));
    } else if (number == 0 && memcmp(magic, "CDF", 3) == 0) {
        status = check_classic(reader, descriptor);
    } else if (number < 0 || memcmp(magic, "\211HDF", 4) != 0) {
        status = refuse(reader, "it is not a netCDF file");
    }
    close(descriptor);
    return status;
}

/* The answers "no such dimension, variable or attribute" are none of the failures. */
static int missing(struct opening *opening, int code, int answer)
{
    if (opening->series.code == NC_NOERR && code == answer) {
        return 1;
    }
    if (opening->series.code == NC_NOERR) {
        opening->series.code = code;
    }
    return code != NC_NOERR;
}

static int find_dimension(struct opening *opening, const char *name)
{
    int id = -1;
    gbg_file_netcdf_lock();
    int code = nc_inq_dimid(opening->reader->file, name, &id);
    gbg_file_netcdf_unlock();
    return missing(opening, code, NC_EBADDIM) ? -1 : id;
}

static int64_t dimension_length(struct opening *opening, int id)
{
    size_t length = 0;
    GBG_CALL(&opening->series, nc_inq_dimlen(opening->reader->file, id, &length));
    return (int64_t)length;
}

/* A real attribute of one or more values: 1 if it is there with exactly n. */
static int get_reals(struct opening *opening, int variable, const char *name, int n, double *values)
{
    size_t length = 0;
    nc_type type = NC_NAT;
    gbg_file_netcdf_lock();
    int code = nc_inq_att(opening->reader->file, variable, name, &type, &length);
    gbg_file_netcdf_unlock();
    if (missing(opening, code, NC_ENOTATT) || type == NC_CHAR || type >= NC_STRING ||
        length != (size_t)n) {
        return 0;
    }
    GBG_CALL(&opening->series, nc_get_att_double(opening->reader->file, variable, name, values));
    return opening->series.code == NC_NOERR;
}

/* A text attribute that fits into `capacity` bytes: 1 if it is there. */
static int get_text(struct opening *opening, const char *name, char *text, size_t capacity)
{
    size_t length = 0;
    nc_type type = NC_NAT;
    gbg_file_netcdf_lock();
    int code = nc_inq_att(opening->reader->file, NC_GLOBAL, name, &type, &length);
    gbg_file_netcdf_unlock();
    text[0] = 0;
    if (missing(opening, code, NC_ENOTATT) || type != NC_CHAR || length >= capacity) {
        return 0;
    }
    GBG_CALL(&opening->series, nc_get_att_text(opening->reader->file, NC_GLOBAL, name, text));
    text[length] = 0;
    return opening->series.code == NC_NOERR;
}

/* A numeric variable with these dimensions; id -1 when the file has none such. */
static void find_variable(struct opening *opening, const char *name, int rank, const int *shape,
                          struct gbg_reader_variable *variable)
{
    int file = opening->reader->file, found[MOST_RANK], found_rank = -1, id = -1;
    nc_type type = NC_NAT;
    variable->id = -1;
    variable->scale = 1.0;
    gbg_file_netcdf_lock();
    int code = nc_inq_varid(file, name, &id);
    gbg_file_netcdf_unlock();
    if (missing(opening, code, NC_ENOTVAR)) {
        return;
    }
    GBG_CALL(&opening->series, nc_inq_varndims(file, id, &found_rank));
    if (found_rank != rank) {
        return;
    }
    GBG_CALL(&opening->series, nc_inq_vardimid(file, id, found));
    GBG_CALL(&opening->series, nc_inq_vartype(file, id, &type));
    if (opening->series.code == NC_NOERR && type != NC_CHAR && type < NC_STRING &&
        memcmp(found, shape, (size_t)rank * sizeof *shape) == 0) {
        variable->id = id;
        get_reals(opening, id, "scale_factor", 1, &variable->scale);
    }
}

/* Older files and LAMMPS give particle properties with a frame. */
static void find_property(struct opening *opening, const char *name,
                          struct gbg_reader_variable *variable, int *has_frames)
{
    int shape[2] = {opening->frame, opening->atom};
    find_variable(opening, name, 1, shape + 1, variable);
    *has_frames = 0;
    if (variable->id < 0) {
        find_variable(opening, name, 2, shape, variable);
        *has_frames = variable->id >= 0;
    }
}

static int find_dimensions(struct opening *opening)
{
    struct gbg_reader *reader = opening->reader;
    double dimension = 3.0;
    opening->frame = find_dimension(opening, "frame");
    opening->atom = find_dimension(opening, "atom");
    opening->spatial = find_dimension(opening, "spatial");
    opening->cell_spatial = find_dimension(opening, "cell_spatial");
    opening->cell_angular = find_dimension(opening, "cell_angular");
    if (opening->series.code != NC_NOERR) {
        return GBG_OK; /* reported by the caller */
    }
    if (opening->frame < 0 || opening->atom < 0 || opening->spatial < 0) {
        return refuse(reader, "it is netCDF, but no AMBER trajectory: that has dimensions frame, "
                              "atom and spatial");
    }
    reader->frames = dimension_length(opening, opening->frame);
    reader->particles = dimension_length(opening, opening->atom);
    if (dimension_length(opening, opening->spatial) != 3) {
        return refuse(reader, "its dimension spatial is not 3");
    }
    get_reals(opening, NC_GLOBAL, "dimensionality", 1, &dimension);
    if (dimension != 2.0 && dimension != 3.0) {
        return refuse(reader, "its attribute dimensionality is neither 2 nor 3");
    }
    reader->dimension = (int)dimension;
    return GBG_OK;
}

static int find_variables(struct opening *opening)
{
    struct gbg_reader *reader = opening->reader;
    int vectors[3] = {opening->frame, opening->atom, opening->spatial};
    int lengths[2] = {opening->frame, opening->cell_spatial};
    int angles[2] = {opening->frame, opening->cell_angular};
    nc_type type = NC_NAT;
    find_variable(opening, "coordinates", 3, vectors, &reader->coordinates);
    find_variable(opening, "image", 3, vectors, &reader->image);
    find_variable(opening, "overlap", 2, vectors, &reader->overlap);
    find_variable(opening, "time", 1, vectors, &reader->time);
    find_variable(opening, "step_number", 1, vectors, &reader->step);
    if (reader->step.id < 0) {
        find_variable(opening, "step", 1, vectors, &reader->step);
    }
    find_variable(opening, "cell_lengths", 2, lengths, &reader->lengths);
    find_variable(opening, "cell_origin", 2, lengths, &reader->origin);
    find_variable(opening, "cell_angles", 2, angles, &reader->angles);
    find_variable(opening, "particle_id", 1, vectors + 1, &reader->ids);
    find_property(opening, "atom_types", &reader->types, &reader->types_have_frames);
    find_property(opening, "radius", &reader->radius, &reader->radius_has_frames);
    if (opening->series.code != NC_NOERR) {
        return GBG_OK; /* reported by the caller */
    }
    if (reader->coordinates.id < 0) {
        return refuse(reader, "it has no variable coordinates(frame, atom, spatial)");
    }
    if (reader->lengths.id < 0 || dimension_length(opening, opening->cell_spatial) != 3 ||
        (reader->angles.id >= 0 && dimension_length(opening, opening->cell_angular) != 3)) {
        return refuse(reader, "it has no box: cell_lengths(frame, cell_spatial) with three lengths "
                              "is needed");
    }
    GBG_CALL(&opening->series, nc_inq_vartype(reader->file, reader->coordinates.id, &type));
    reader->is_double = type == NC_DOUBLE;
    reader->has_images = reader->image.id >= 0;
    reader->has_overlap = reader->overlap.id >= 0;
    return GBG_OK;
}

static int get_types(struct opening *opening)
{
    struct gbg_reader *reader = opening->reader;
    size_t start[2] = {0, 0}, count[2] = {1, (size_t)reader->particles};
    int skip = reader->types_have_frames ? 0 : 1;
    if (reader->types.id < 0 || (reader->types_have_frames && reader->frames == 0)) {
        memset(reader->species, 0, (size_t)reader->particles * sizeof *reader->species);
        return 0;
    }
    GBG_CALL(&opening->series, nc_get_vara_int(reader->file, reader->types.id, start + skip,
                                               count + skip, reader->species));
    return opening->series.code == NC_NOERR;
}

/* Types of a foreign file are any integers: the distinct ones in ascending order are the species.
 */
static int number_species(struct gbg_reader *reader)
{
    int32_t type[GBG_MAX_SPECIES];
    int known = 0;
    for (int64_t i = 0; i < reader->particles; i++) {
        int k = 0;
        while (k < known && type[k] < reader->species[i]) {
            k++;
        }
        if (k < known && type[k] == reader->species[i]) {
            continue;
        }
        if (known == GBG_MAX_SPECIES) {
            return gbg_fail(reader->context, GBG_E_FORMAT,
                            "%s: atom_types has more than %d "
                            "different values",
                            reader->path, (int)GBG_MAX_SPECIES);
        }
        memmove(type + k + 1, type + k, (size_t)(known - k) * sizeof *type);
        type[k] = reader->species[i];
        known++;
    }
    for (int64_t i = 0; i < reader->particles; i++) {
        int k = 0;
        while (type[k] != reader->species[i]) {
            k++;
        }
        reader->species[i] = k;
    }
    reader->n_species = known > 0 ? known : 1;
    return GBG_OK;
}

/* Types of our own files count from 1 and need not all occur. */
static int check_species(struct gbg_reader *reader, int n_species)
{
    for (int64_t i = 0; i < reader->particles; i++) {
        if (reader->species[i] < 1 || reader->species[i] > n_species) {
            return gbg_fail(reader->context, GBG_E_FORMAT,
                            "%s: atom_types of particle %" PRId64 " is %d, allowed are 1 to %d",
                            reader->path, i, (int)reader->species[i], n_species);
        }
        reader->species[i]--;
    }
    reader->n_species = n_species;
    return GBG_OK;
}

static int read_species(struct opening *opening)
{
    struct gbg_reader *reader = opening->reader;
    double n_species = 0.0;
    int has_types = get_types(opening);
    int ours = get_reals(opening, NC_GLOBAL, "n_species", 1, &n_species);
    if (ours && !(n_species >= 1.0 && n_species <= GBG_MAX_SPECIES)) {
        return refuse(reader, "its attribute n_species is not from 1 to 10");
    }
    int status = ours && has_types ? check_species(reader, (int)n_species) : number_species(reader);
    if (status != GBG_OK) {
        return status;
    }
    reader->has_names = 1;
    for (int s = 0; s < reader->n_species; s++) {
        char attribute[32];
        snprintf(attribute, sizeof attribute, "species_%d", s + 1);
        if (!get_text(opening, attribute, reader->name[s], GBG_NAME_CAPACITY)) {
            snprintf(reader->name[s], GBG_NAME_CAPACITY, "%c", 'A' + s);
            reader->has_names = 0;
        }
    }
    reader->has_diameters =
        get_reals(opening, NC_GLOBAL, "species_diameter", reader->n_species, reader->diameter);
    get_text(opening, "scene_digest", reader->digest, sizeof reader->digest);
    char rule[GBG_NAME_CAPACITY];
    reader->is_hard =
        !get_text(opening, "excluded_volume", rule, sizeof rule) || strcmp(rule, "none") != 0;
    return GBG_OK;
}

static int allocate(struct gbg_reader *reader)
{
    void *memory;
    int status = gbg_allocate(reader->context, &memory, reader->particles, sizeof *reader->species,
                              "species of a trajectory");
    reader->species = memory;
    if (status == GBG_OK) {
        status = gbg_allocate(reader->context, &memory, GBG_READER_CHUNK, 3 * sizeof(double),
                              "a file buffer");
        reader->buffer = memory;
    }
    return status;
}

static int read_all(struct gbg_reader *reader)
{
    struct opening opening = {.reader = reader, .series = {-1, NC_NOERR}};
    GBG_CALL(&opening.series, nc_open(reader->path, NC_NOWRITE, &reader->file));
    if (opening.series.code != NC_NOERR) {
        reader->file = -1;
        return gbg_netcdf_status(reader->context, &opening.series, "open it", reader->path);
    }
    int status = find_dimensions(&opening);
    if (status == GBG_OK && opening.series.code == NC_NOERR) {
        status = find_variables(&opening);
    }
    if (status == GBG_OK && opening.series.code == NC_NOERR) {
        status = allocate(reader);
    }
    if (status == GBG_OK && opening.series.code == NC_NOERR) {
        status = read_species(&opening);
    }
    if (status == GBG_OK) {
        status =
            gbg_netcdf_status(reader->context, &opening.series, "read its header", reader->path);
    }
    return status;
}

int gbg_reader_open(struct gbg_context *context, const char *path, struct gbg_reader **reader)
{
    void *memory;
    *reader = NULL;
    int status = gbg_allocate_zero(context, &memory, 1, sizeof **reader, "a trajectory reader");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_reader *fresh = memory;
    fresh->context = context;
    fresh->file = -1;
    if (!gbg_text_copy(fresh->path, sizeof fresh->path, path)) {
        status = gbg_fail(context, GBG_E_ARGUMENT, "%.60s...: the path is longer than %d bytes",
                          path, GBG_PATH_CAPACITY - 1);
    }
    if (status == GBG_OK) {
        status = check_bytes(fresh);
    }
    if (status == GBG_OK) {
        status = read_all(fresh);
    }
    if (status != GBG_OK) {
        gbg_reader_close(fresh);
        return status;
    }
    *reader = fresh;
    return GBG_OK;
}

void gbg_reader_close(struct gbg_reader *reader)
{
    if (!reader) {
        return;
    }
    if (reader->file >= 0) {
        struct gbg_netcdf series = {reader->file, NC_NOERR};
        gbg_netcdf_close(&series);
    }
    gbg_release(reader->species);
    gbg_release(reader->buffer);
    gbg_release(reader);
}
