/* Side room io: writes a structure factor as CF netCDF-4. */
#include "io/analysis_file.h"

#include "core/context.h"

#ifndef GBG_WITH_NETCDF

int gbg_analysis_file_write(struct gbg_context *context, const char *path,
                            const struct gbg_analysis_content *content)
{
    (void)content;
    return gbg_fail(context, GBG_E_UNBUILT,
                    "gbg_analysis_write: %s: this build has no netCDF; configure with "
                    "-DGBG_WITH_NETCDF=ON (Debian: libnetcdf-dev)",
                    path);
}

#else

#include <stdio.h>
#include <string.h>

#include "core/file.h"
#include "gamboge/version.h"
#include "io/netcdf_call.h"

enum { TEMPORARY_BYTES = 4096 + 64, NAME_BYTES = 32 };

struct writing {
    struct gbg_netcdf series;
    const struct gbg_analysis_content *content;
    int k_dim, bound_dim, type_dim, pair_dim, text_dim, space_dim;
    int k, bounds, modes, lengths, particles, type_name, pair_types;
    int column[GBG_FILE_COLUMNS], pair_column[GBG_FILE_COLUMNS];
};

static int define_variable(struct writing *all, const char *name, nc_type type, int dimensions,
                           const int *shape, const char *long_name)
{
    int id = -1;
    GBG_CALL(&all->series, nc_def_var(all->series.file, name, type, dimensions, shape, &id));
    gbg_netcdf_text(&all->series, id, "long_name", long_name);
    return id;
}

static void define_dimensions(struct writing *all)
{
    const struct gbg_analysis_content *content = all->content;
    struct {
        const char *name;
        int64_t size;
        int *id;
    } list[] = {
        {"k", content->shells, &all->k_dim},          {"bnd", 2, &all->bound_dim},
        {"dim", content->dimension, &all->space_dim}, {"type", content->species, &all->type_dim},
        {"strlen", NAME_BYTES, &all->text_dim},       {"pair", content->pairs, &all->pair_dim},
    };
    for (size_t i = 0; i < sizeof list / sizeof *list; i++) {
        if (list[i].size > 0) { /* size 0 would mean unlimited */
            GBG_CALL(&all->series,
                     nc_def_dim(all->series.file, list[i].name, (size_t)list[i].size, list[i].id));
        }
    }
}

static void define_axes(struct writing *all)
{
    struct gbg_netcdf *series = &all->series;
    int bounds[2] = {all->k_dim, all->bound_dim}, names[2] = {all->type_dim, all->text_dim};
    all->k = define_variable(all, "k", NC_DOUBLE, 1, &all->k_dim, "wave number, mean over a shell");
    gbg_netcdf_text(series, all->k, "units", "sigma-1");
    gbg_netcdf_text(series, all->k, "bounds", "k_bounds");
    GBG_CALL(series, nc_def_var(series->file, "k_bounds", NC_DOUBLE, 2, bounds, &all->bounds));
    all->modes = define_variable(all, "n_modes", NC_INT, 1, &all->k_dim,
                                 "wave vectors in the shell, one of each pair k, -k");
    all->lengths = define_variable(all, "box_lengths", NC_DOUBLE, 1, &all->space_dim,
                                   "box of the first frame");
    gbg_netcdf_text(series, all->lengths, "units", "sigma");
    all->particles =
        define_variable(all, "n_particles", NC_INT64, 1, &all->type_dim, "particles of the type");
    all->type_name = define_variable(all, "type_name", NC_CHAR, 2, names, "name of the type");
}

static int define_column(struct writing *all, const struct gbg_file_column *column, int dimensions,
                         const int *shape)
{
    struct gbg_netcdf *series = &all->series;
    int id = define_variable(all, column->name, NC_DOUBLE, dimensions, shape, column->long_name);
    gbg_netcdf_text(series, id, "units", "1");
    if (column->extra) {
        gbg_netcdf_text(series, id, column->extra_name, column->extra);
    }
    if (strcmp(column->name, "S") == 0) {
        gbg_netcdf_text(series, id, "cell_methods", "frame: mean k: mean");
        gbg_netcdf_text(series, id, "ancillary_variables",
                        "S_stderr S_numerr S_numerr_typ S_storage_err n_modes");
    }
    return id;
}

static void define_columns(struct writing *all)
{
    const struct gbg_analysis_content *content = all->content;
    for (int c = 0; c < content->columns; c++) {
        all->column[c] = define_column(all, &content->column[c], 1, &all->k_dim);
    }
    if (content->pairs == 0) {
        return;
    }
    int shape[2] = {all->pair_dim, all->k_dim}, ends[2] = {all->pair_dim, all->bound_dim};
    all->pair_types = define_variable(all, "pair_types", NC_INT, 2, ends,
                                      "the two types of a pair, counted from 0");
    for (int c = 0; c < content->pair_columns; c++) {
        all->pair_column[c] = define_column(all, &content->pair_column[c], 2, shape);
    }
}

static void put_attributes(struct writing *all)
{
    const struct gbg_analysis_content *content = all->content;
    struct gbg_netcdf *series = &all->series;
    double n = (double)content->n, frames = (double)content->frames;
    gbg_netcdf_text(series, NC_GLOBAL, "Conventions", "CF-1.10");
    gbg_netcdf_text(series, NC_GLOBAL, "source", "gamboge " GBG_VERSION);
    for (int i = 0; i < content->texts; i++) {
        if (content->text[i]) {
            gbg_netcdf_text(series, NC_GLOBAL, content->text_name[i], content->text[i]);
        }
    }
    gbg_netcdf_reals(series, "tolerance", 1, &content->tolerance);
    gbg_netcdf_reals(series, "rho_bound", 1, &content->bound);
    gbg_netcdf_integer(series, "k0_in_shells", 0);
    gbg_netcdf_reals(series, "k0_value", 1, &n);
    gbg_netcdf_reals(series, "frames_used", 1, &frames);
    gbg_netcdf_reals(series, "n_effective", 1, &content->n_effective);
}

static void put_types(struct writing *all)
{
    const struct gbg_analysis_content *content = all->content;
    struct gbg_netcdf *series = &all->series;
    long long particles[GBG_FILE_SPECIES];
    char name[GBG_FILE_SPECIES][NAME_BYTES] = {{0}};
    for (int a = 0; a < content->species; a++) {
        particles[a] = content->particles[a];
        snprintf(name[a], NAME_BYTES, "%s", content->species_name[a]);
    }
    GBG_CALL(series, nc_put_var_longlong(series->file, all->particles, particles));
    GBG_CALL(series, nc_put_var_text(series->file, all->type_name, name[0]));
    for (int a = 0, pair = 0; a < content->species && content->pairs; a++) {
        for (int b = a; b < content->species; b++, pair++) {
            size_t start[2] = {(size_t)pair, 0}, count[2] = {1, 2};
            int ends[2] = {a, b};
            GBG_CALL(series, nc_put_vara_int(series->file, all->pair_types, start, count, ends));
        }
    }
}

static void put_values(struct writing *all)
{
    const struct gbg_analysis_content *content = all->content;
    struct gbg_netcdf *series = &all->series;
    GBG_CALL(series, nc_put_var_double(series->file, all->k, content->k));
    GBG_CALL(series, nc_put_var_double(series->file, all->bounds, content->k_bounds));
    GBG_CALL(series, nc_put_var_double(series->file, all->modes, content->modes));
    GBG_CALL(series, nc_put_var_double(series->file, all->lengths, content->lengths));
    for (int c = 0; c < content->columns; c++) {
        GBG_CALL(series, nc_put_var_double(series->file, all->column[c], content->column[c].value));
    }
    for (int c = 0; c < content->pair_columns && content->pairs; c++) {
        GBG_CALL(series, nc_put_var_double(series->file, all->pair_column[c],
                                           content->pair_column[c].value));
    }
    put_types(all);
}

static int write_file(struct gbg_context *context, struct writing *all, const char *file,
                      const char *path)
{
    struct gbg_netcdf *series = &all->series;
    GBG_CALL(series, nc_create(file, NC_CLOBBER | NC_NETCDF4, &series->file));
    if (series->code == NC_NOERR) {
        define_dimensions(all);
        define_axes(all);
        define_columns(all);
        put_attributes(all);
        GBG_CALL(series, nc_enddef(series->file));
        put_values(all);
        gbg_netcdf_close(series);
    }
    return gbg_netcdf_status(context, series, "write it", path);
}

int gbg_analysis_file_write(struct gbg_context *context, const char *path,
                            const struct gbg_analysis_content *content)
{
    struct writing all = {.series = {-1, NC_NOERR}, .content = content};
    char temporary[TEMPORARY_BYTES] = "";
    int status = gbg_file_temporary(context, path, temporary, sizeof temporary);
    if (status == GBG_OK) {
        status = write_file(context, &all, temporary, path);
    }
    if (status == GBG_OK) {
        status = gbg_file_commit(context, temporary, path);
    }
    if (status != GBG_OK) {
        gbg_file_abandon(temporary);
        gbg_message_prefix(context, "gbg_analysis_write");
    }
    return status;
}

#endif
