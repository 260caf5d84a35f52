/* L4: trajectories, restart files and the file of forces. */
#include "gamboge/trajectory.h"

#include <inttypes.h>
#include <string.h>

#include "core/context.h"
#include "core/memory.h"
#include "engine/view.h"
#include "io/forces_file.h"
#include "io/reader.h"
#include "io/restart.h"
#include "io/writer.h"

/* One of the two is NULL. */
struct gbg_trajectory {
    struct gbg_context *context;
    struct gbg_writer *writer;
    struct gbg_reader *reader;
};

/* A failure of a lower room, with the name of the call before it. */
static int named(struct gbg_context *context, int status, const char *call)
{
    if (status != GBG_OK) {
        gbg_message_prefix(context, "%s", call);
    }
    return status;
}

static int missing(struct gbg_context *context, const char *call, const char *argument)
{
    return gbg_fail(context, GBG_E_ARGUMENT, "%s: %s is NULL", call, argument);
}

static int check_path(struct gbg_context *context, const char *call, const char *path)
{
    if (!path || !path[0]) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: path is %s", call, path ? "empty" : "NULL");
    }
    return GBG_OK;
}

/* A handle around nothing yet; released by gbg_trajectory_destroy. */
static int make_handle(struct gbg_context *context, const char *call,
                       struct gbg_trajectory **trajectory)
{
    void *memory;
    int status = gbg_allocate_zero(context, &memory, 1, sizeof **trajectory, "a trajectory");
    if (status != GBG_OK) {
        return named(context, status, call);
    }
    *trajectory = memory;
    (*trajectory)->context = context;
    return GBG_OK;
}

static int finish(struct gbg_trajectory **trajectory, int status, const char *call)
{
    struct gbg_context *context = (*trajectory)->context;
    if (status != GBG_OK) {
        gbg_trajectory_destroy(trajectory);
    }
    return named(context, status, call);
}

typedef int (*begin_writing)(const struct gbg_engine_view *, const char *, struct gbg_writer **);

static int write_to(struct gbg_engine *engine, const char *path, const char *call,
                    begin_writing begin, struct gbg_trajectory **trajectory)
{
    struct gbg_engine_view view;
    if (!trajectory) {
        return missing(NULL, call, "trajectory");
    }
    *trajectory = NULL;
    if (!engine) {
        return missing(NULL, call, "engine");
    }
    int status = gbg_engine_check_sums(engine); /* the header says what came of it */
    int seen = gbg_engine_look(engine, &view);
    status = status ? status : seen;
    if (status != GBG_OK) {
        return named(view.context, status, call);
    }
    status = check_path(view.context, call, path);
    if (status == GBG_OK) {
        status = make_handle(view.context, call, trajectory);
    }
    return status == GBG_OK ? finish(trajectory, begin(&view, path, &(*trajectory)->writer), call)
                            : status;
}

int gbg_trajectory_create(struct gbg_engine *engine, const char *path,
                          struct gbg_trajectory **trajectory)
{
    return write_to(engine, path, "gbg_trajectory_create", gbg_writer_create, trajectory);
}

int gbg_trajectory_continue(struct gbg_engine *engine, const char *path,
                            struct gbg_trajectory **trajectory)
{
    return write_to(engine, path, "gbg_trajectory_continue", gbg_writer_continue, trajectory);
}

typedef int (*add_frame)(struct gbg_writer *, struct gbg_engine *, const struct gbg_engine_view *);

static int check_writing(const struct gbg_trajectory *trajectory, const char *call)
{
    if (!trajectory) {
        return missing(NULL, call, "trajectory");
    }
    return trajectory->writer ? GBG_OK
                              : gbg_fail(trajectory->context, GBG_E_ORDER,
                                         "%s: the trajectory was opened to be read", call);
}

static int add_to(struct gbg_trajectory *trajectory, struct gbg_engine *engine, const char *call,
                  add_frame add)
{
    struct gbg_engine_view view;
    if (trajectory && !engine) {
        return missing(trajectory->context, call, "engine");
    }
    int status = check_writing(trajectory, call);
    if (status != GBG_OK) {
        return status;
    }
    status = gbg_engine_look(engine, &view);
    status = status ? status : add(trajectory->writer, engine, &view);
    return named(trajectory->context, status, call);
}

int gbg_trajectory_append(struct gbg_trajectory *trajectory, struct gbg_engine *engine)
{
    return add_to(trajectory, engine, "gbg_trajectory_append", gbg_writer_append);
}

int gbg_trajectory_append_begin(struct gbg_trajectory *trajectory, struct gbg_engine *engine)
{
    return add_to(trajectory, engine, "gbg_trajectory_append_begin", gbg_writer_begin);
}

int gbg_trajectory_append_end(struct gbg_trajectory *trajectory)
{
    static const char call[] = "gbg_trajectory_append_end";
    int status = check_writing(trajectory, call);
    return status ? status
                  : named(trajectory->context, gbg_writer_settle(trajectory->writer), call);
}

int gbg_trajectory_open(struct gbg_context *context, const char *path,
                        struct gbg_trajectory **trajectory)
{
    static const char call[] = "gbg_trajectory_open";
    if (!trajectory) {
        return missing(context, call, "trajectory");
    }
    *trajectory = NULL;
    if (!context) {
        return missing(NULL, call, "context");
    }
    int status = check_path(context, call, path);
    if (status == GBG_OK) {
        status = make_handle(context, call, trajectory);
    }
    return status == GBG_OK
               ? finish(trajectory, gbg_reader_open(context, path, &(*trajectory)->reader), call)
               : status;
}

int gbg_trajectory_destroy(struct gbg_trajectory **trajectory)
{
    int status = GBG_OK;
    if (trajectory && *trajectory) {
        status = named((*trajectory)->context, gbg_writer_close((*trajectory)->writer),
                       "gbg_trajectory_destroy");
        gbg_reader_close((*trajectory)->reader);
        gbg_release(*trajectory);
        *trajectory = NULL;
    }
    return status;
}

static struct gbg_writer_size size_of(const struct gbg_trajectory *trajectory)
{
    struct gbg_writer_size size;
    if (trajectory->writer) {
        gbg_writer_look(trajectory->writer, &size);
    } else {
        const struct gbg_reader *reader = trajectory->reader;
        size = (struct gbg_writer_size){reader->frames, reader->particles, reader->dimension,
                                        reader->n_species, reader->is_double};
    }
    return size;
}

int gbg_trajectory_size(const struct gbg_trajectory *trajectory, int64_t *frames,
                        int64_t *particles, int *dimension, int *n_species)
{
    if (!trajectory) {
        return missing(NULL, "gbg_trajectory_size", "trajectory");
    }
    struct gbg_writer_size size = size_of(trajectory);
    if (frames) {
        *frames = size.frames;
    }
    if (particles) {
        *particles = size.particles;
    }
    if (dimension) {
        *dimension = size.dimension;
    }
    if (n_species) {
        *n_species = size.n_species;
    }
    return GBG_OK;
}

int gbg_trajectory_is_double(const struct gbg_trajectory *trajectory, int *is_double)
{
    static const char call[] = "gbg_trajectory_is_double";
    if (!trajectory) {
        return missing(NULL, call, "trajectory");
    }
    if (!is_double) {
        return missing(trajectory->context, call, "is_double");
    }
    *is_double = size_of(trajectory).is_double;
    return GBG_OK;
}

/* Handle and output of a call that reads. */
static int check_reading(const struct gbg_trajectory *trajectory, const char *call,
                         const void *output, const char *name)
{
    if (!trajectory) {
        return missing(NULL, call, "trajectory");
    }
    if (!trajectory->reader) {
        return gbg_fail(trajectory->context, GBG_E_ORDER,
                        "%s: the trajectory is being written; "
                        "open the file with gbg_trajectory_open",
                        call);
    }
    return output ? GBG_OK : missing(trajectory->context, call, name);
}

static int check_n(const struct gbg_trajectory *trajectory, const char *call, int64_t n)
{
    if (n < trajectory->reader->particles) {
        return gbg_fail(trajectory->context, GBG_E_SPACE,
                        "%s: n is %" PRId64 " and the trajectory "
                        "has %" PRId64 " particles",
                        call, n, trajectory->reader->particles);
    }
    return GBG_OK;
}

static int check_frame(const struct gbg_trajectory *trajectory, const char *call, int64_t frame)
{
    int64_t frames = trajectory->reader->frames;
    if (frame >= 0 && frame < frames) {
        return GBG_OK;
    }
    return gbg_fail(trajectory->context, GBG_E_ARGUMENT,
                    "%s: frame is %" PRId64 ", and the file "
                    "has %" PRId64 " (counted from 0)",
                    call, frame, frames);
}

static int check_vectors(const struct gbg_trajectory *trajectory, const char *call, const void *y,
                         const void *z, ptrdiff_t step)
{
    if (!y) {
        return missing(trajectory->context, call, "y");
    }
    if (!z && trajectory->reader->dimension == 3) {
        return missing(trajectory->context, call, "z");
    }
    if (step == 0 && trajectory->reader->particles > 1) {
        return gbg_fail(trajectory->context, GBG_E_ARGUMENT, "%s: step is 0", call);
    }
    return GBG_OK;
}

int gbg_trajectory_is_hard(const struct gbg_trajectory *trajectory, int *is_hard)
{
    int status = check_reading(trajectory, "gbg_trajectory_is_hard", is_hard, "is_hard");
    if (status == GBG_OK) {
        *is_hard = trajectory->reader->is_hard;
    }
    return status;
}

int gbg_trajectory_species(const struct gbg_trajectory *trajectory, int64_t n, int32_t *species,
                           int base)
{
    static const char call[] = "gbg_trajectory_species";
    int status = check_reading(trajectory, call, species, "species");
    if (status == GBG_OK) {
        status = check_n(trajectory, call, n);
    }
    if (status == GBG_OK && base != 0 && base != 1) {
        status = gbg_fail(trajectory->context, GBG_E_ARGUMENT,
                          "%s: base is %d, allowed are 0 and 1", call, base);
    }
    for (int64_t i = 0; status == GBG_OK && i < trajectory->reader->particles; i++) {
        species[i] = trajectory->reader->species[i] + base;
    }
    return status;
}

int gbg_trajectory_diameters(const struct gbg_trajectory *trajectory, int64_t n, double *diameters)
{
    static const char call[] = "gbg_trajectory_diameters";
    int status = check_reading(trajectory, call, diameters, "diameters");
    if (status == GBG_OK) {
        status = check_n(trajectory, call, n);
    }
    return status == GBG_OK ? named(trajectory->context,
                                    gbg_reader_diameters(trajectory->reader, diameters), call)
                            : status;
}

int gbg_trajectory_species_name(const struct gbg_trajectory *trajectory, int species,
                                int64_t capacity, char *name)
{
    static const char call[] = "gbg_trajectory_species_name";
    int status = check_reading(trajectory, call, name, "name");
    if (status != GBG_OK) {
        return status;
    }
    const struct gbg_reader *reader = trajectory->reader;
    if (species < 0 || species >= reader->n_species) {
        return gbg_fail(trajectory->context, GBG_E_ARGUMENT,
                        "%s: species is %d, allowed are 0 to "
                        "%d",
                        call, species, reader->n_species - 1);
    }
    size_t needed = strlen(reader->name[species]) + 1;
    if (capacity < (int64_t)needed) {
        return gbg_fail(trajectory->context, GBG_E_SPACE,
                        "%s: capacity is %" PRId64 " bytes, the "
                        "name needs %zu",
                        call, capacity, needed);
    }
    memcpy(name, reader->name[species], needed);
    return GBG_OK;
}

int gbg_trajectory_frame(struct gbg_trajectory *trajectory, int64_t frame, double *time,
                         int64_t *step, double *lengths, double *origin)
{
    static const char call[] = "gbg_trajectory_frame";
    double when, length[3], corner[3];
    int64_t number;
    int status = check_reading(trajectory, call, trajectory, "trajectory");
    if (status == GBG_OK) {
        status = check_frame(trajectory, call, frame);
    }
    if (status == GBG_OK) {
        status = named(trajectory->context,
                       gbg_reader_frame(trajectory->reader, frame, &when, &number, length, corner),
                       call);
    }
    if (status != GBG_OK) {
        return status;
    }
    if (time) {
        *time = when;
    }
    if (step) {
        *step = number;
    }
    for (int a = 0; a < trajectory->reader->dimension; a++) {
        if (lengths) {
            lengths[a] = length[a];
        }
        if (origin) {
            origin[a] = corner[a];
        }
    }
    return GBG_OK;
}

int gbg_trajectory_positions(struct gbg_trajectory *trajectory, int64_t frame, int64_t n, double *x,
                             double *y, double *z, ptrdiff_t step)
{
    static const char call[] = "gbg_trajectory_positions";
    double *base[3] = {x, y, z};
    int status = check_reading(trajectory, call, x, "x");
    if (status == GBG_OK) {
        status = check_vectors(trajectory, call, y, z, step);
    }
    if (status == GBG_OK) {
        status = check_n(trajectory, call, n);
    }
    if (status == GBG_OK) {
        status = check_frame(trajectory, call, frame);
    }
    return status == GBG_OK
               ? named(trajectory->context,
                       gbg_reader_positions(trajectory->reader, frame, base, step), call)
               : status;
}

int gbg_trajectory_images(struct gbg_trajectory *trajectory, int64_t frame, int64_t n, int32_t *x,
                          int32_t *y, int32_t *z, ptrdiff_t step)
{
    static const char call[] = "gbg_trajectory_images";
    int32_t *base[3] = {x, y, z};
    int status = check_reading(trajectory, call, x, "x");
    if (status == GBG_OK) {
        status = check_vectors(trajectory, call, y, z, step);
    }
    if (status == GBG_OK) {
        status = check_n(trajectory, call, n);
    }
    if (status == GBG_OK) {
        status = check_frame(trajectory, call, frame);
    }
    if (status == GBG_OK && !trajectory->reader->has_images) {
        status = gbg_fail(trajectory->context, GBG_E_NAME,
                          "%s: %s holds no image counts (scene "
                          "option output.trajectory.unwrapped)",
                          call, trajectory->reader->path);
    }
    return status == GBG_OK ? named(trajectory->context,
                                    gbg_reader_images(trajectory->reader, frame, base, step), call)
                            : status;
}

int gbg_trajectory_overlapped(struct gbg_trajectory *trajectory, int64_t frame, int64_t n,
                              int32_t *flags)
{
    static const char call[] = "gbg_trajectory_overlapped";
    int status = check_reading(trajectory, call, flags, "flags");
    if (status == GBG_OK) {
        status = check_n(trajectory, call, n);
    }
    if (status == GBG_OK) {
        status = check_frame(trajectory, call, frame);
    }
    if (status == GBG_OK && !trajectory->reader->has_overlap) {
        status = gbg_fail(trajectory->context, GBG_E_NAME,
                          "%s: %s holds no overlap flags (scene "
                          "option output.trajectory.overlap)",
                          call, trajectory->reader->path);
    }
    return status == GBG_OK ? named(trajectory->context,
                                    gbg_reader_overlap(trajectory->reader, frame, flags), call)
                            : status;
}
