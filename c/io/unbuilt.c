/* Side room io: the answers of a build without netCDF. Restart files and text starts need none. */
#include "core/context.h"
#include "engine/view.h"
#include "io/forces_file.h"
#include "io/reader.h"
#include "io/writer.h"

static int refuse(struct gbg_context *context, const char *path)
{
    return gbg_fail(context, GBG_E_UNBUILT,
                    "%s: this build has no netCDF; configure with "
                    "-DGBG_WITH_NETCDF=ON (Debian: libnetcdf-dev)",
                    path);
}

int gbg_writer_create(const struct gbg_engine_view *view, const char *path,
                      struct gbg_writer **writer)
{
    *writer = NULL;
    return refuse(view->context, path);
}

int gbg_writer_continue(const struct gbg_engine_view *view, const char *path,
                        struct gbg_writer **writer)
{
    *writer = NULL;
    return refuse(view->context, path);
}

int gbg_reader_open(struct gbg_context *context, const char *path, struct gbg_reader **reader)
{
    *reader = NULL;
    return refuse(context, path);
}

int gbg_forces_write(struct gbg_engine *engine, const struct gbg_engine_view *view,
                     const struct gbg_force_error *error, const char *path)
{
    (void)engine, (void)error;
    return refuse(view->context, path);
}

/* The others work on objects that only the calls above make. */
int gbg_writer_append(struct gbg_writer *writer, struct gbg_engine *engine,
                      const struct gbg_engine_view *view)
{
    (void)writer, (void)engine;
    return refuse(view->context, "a trajectory");
}

int gbg_writer_begin(struct gbg_writer *writer, struct gbg_engine *engine,
                     const struct gbg_engine_view *view)
{
    return gbg_writer_append(writer, engine, view);
}

int gbg_writer_settle(struct gbg_writer *writer)
{
    (void)writer;
    return GBG_OK;
}

void gbg_writer_look(const struct gbg_writer *writer, struct gbg_writer_size *size)
{
    (void)writer;
    *size = (struct gbg_writer_size){0};
}

int gbg_writer_close(struct gbg_writer *writer)
{
    (void)writer;
    return GBG_OK;
}

void gbg_reader_close(struct gbg_reader *reader)
{
    (void)reader;
}

int gbg_reader_frame(struct gbg_reader *reader, int64_t frame, double *time, int64_t *step,
                     double *length, double *origin)
{
    (void)frame, (void)time, (void)step, (void)length, (void)origin;
    return refuse(reader->context, reader->path);
}

int gbg_reader_positions(struct gbg_reader *reader, int64_t frame, double *const base[3],
                         ptrdiff_t step)
{
    (void)frame, (void)base, (void)step;
    return refuse(reader->context, reader->path);
}

int gbg_reader_images(struct gbg_reader *reader, int64_t frame, int32_t *const base[3],
                      ptrdiff_t step)
{
    (void)frame, (void)base, (void)step;
    return refuse(reader->context, reader->path);
}

int gbg_reader_overlap(struct gbg_reader *reader, int64_t frame, int32_t *flag)
{
    (void)frame, (void)flag;
    return refuse(reader->context, reader->path);
}

int gbg_reader_diameters(struct gbg_reader *reader, double *diameter)
{
    (void)diameter;
    return refuse(reader->context, reader->path);
}

int gbg_reader_ids(struct gbg_reader *reader, int64_t *id)
{
    (void)id;
    return refuse(reader->context, reader->path);
}
