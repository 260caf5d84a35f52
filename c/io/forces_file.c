/* Side room io: the forces on all particles as a netCDF file (CDF-2, which every reader opens). */
#include "io/forces_file.h"

#include <stdio.h>
#include <string.h>

#include "core/memory.h"
#include "engine/view.h"
#include "gamboge/version.h"
#include "io/definition.h"
#include "io/netcdf_call.h"
#include "scene/scene.h"

enum { CHUNK = 4096, TEMPORARY_BYTES = GBG_PATH_CAPACITY + 64 };

struct forces {
    struct gbg_netcdf series;
    struct gbg_engine_view view;
    double *force[3];
    uint64_t *fraction[3];
    int forces, positions, species, id; /* variables */
};

static int allocate(struct forces *all)
{
    int status = GBG_OK;
    for (int a = 0; a < all->view.box.dimension && status == GBG_OK; a++) {
        void *memory;
        status = gbg_allocate(all->view.context, &memory, all->view.n, sizeof(double),
                              "forces for a file");
        all->force[a] = memory;
        if (status == GBG_OK) {
            status = gbg_allocate(all->view.context, &memory, all->view.n, sizeof(uint64_t),
                                  "coordinates for a file");
            all->fraction[a] = memory;
        }
    }
    return status;
}

static int fetch(struct forces *all, struct gbg_engine *engine)
{
    int status = gbg_engine_copy_forces(engine, all->force);
    for (int a = 0; a < all->view.box.dimension && status == GBG_OK; a++) {
        status = gbg_engine_copy_fractions(engine, a, all->fraction[a]);
    }
    return status;
}

static void describe_force(struct forces *all, int k)
{
    static const char *const sum_name[] = {"minimum_image", "cutoff", "lattice"};
    const struct gbg_force *force = &all->view.scene->force[k];
    char name[32], text[160];
    snprintf(name, sizeof name, "force_%d", k + 1);
    int used =
        snprintf(text, sizeof text, "power %.17g, sum %s", force->power, sum_name[force->sum]);
    if (force->sum == GBG_SUM_CUTOFF) {
        snprintf(text + used, sizeof text - (size_t)used, ", cutoff %.17g", force->cutoff);
    } else if (force->sum == GBG_SUM_LATTICE) {
        snprintf(text + used, sizeof text - (size_t)used, ", tolerance %.17g", force->tolerance);
    }
    gbg_netcdf_text(&all->series, NC_GLOBAL, name, text);
}

static void describe(struct forces *all, const struct gbg_force_error *error)
{
    static const char law[] = "F_i = mobility_i sum_k alpha_k r_ik/|r_ik|^(power+1)";
    const struct gbg_scene *scene = all->view.scene;
    struct gbg_netcdf *series = &all->series;
    char digest[65];
    double samples = (double)error->samples;
    gbg_scene_digest(scene, digest);
    gbg_netcdf_text(series, NC_GLOBAL, "title", "forces on particles");
    gbg_netcdf_text(series, NC_GLOBAL, "program", "gamboge");
    gbg_netcdf_text(series, NC_GLOBAL, "programVersion", GBG_VERSION);
    gbg_netcdf_text(series, NC_GLOBAL, "scene_digest", digest);
    gbg_netcdf_text(series, NC_GLOBAL, "law", law);
    for (int k = 0; k < scene->n_forces; k++) {
        describe_force(all, k);
    }
    gbg_netcdf_reals(series, "cell_lengths", all->view.box.dimension, all->view.box.length);
    gbg_netcdf_reals(series, "cell_origin", all->view.box.dimension, all->view.box.origin);
    if (error->samples > 0) {
        gbg_netcdf_reals(series, "error_samples", 1, &samples);
        gbg_netcdf_reals(series, "error_rms_over_rms", 1, &error->over_rms);
        gbg_netcdf_reals(series, "error_rms_over_median", 1, &error->over_median);
    }
}

static void define(struct forces *all)
{
    struct gbg_netcdf *series = &all->series;
    int shape[2] = {0, 0};
    /* int where every id fits, else double, because the format has no 64-bit integers */
    nc_type id_type = all->view.id[all->view.n - 1] <= INT32_MAX ? NC_INT : NC_DOUBLE;
    GBG_CALL(series, nc_def_dim(series->file, "atom", (size_t)all->view.n, &shape[0]));
    GBG_CALL(series, nc_def_dim(series->file, "dim", (size_t)all->view.box.dimension, &shape[1]));
    GBG_CALL(series, nc_def_var(series->file, "forces", NC_DOUBLE, 2, shape, &all->forces));
    GBG_CALL(series, nc_def_var(series->file, "positions", NC_DOUBLE, 2, shape, &all->positions));
    GBG_CALL(series, nc_def_var(series->file, "species", NC_INT, 1, shape, &all->species));
    GBG_CALL(series, nc_def_var(series->file, "id", id_type, 1, shape, &all->id));
    gbg_netcdf_text(series, all->forces, "units", "sigma tau_B-1");
    gbg_netcdf_text(series, all->forces, "long_name", "displacement a time that the force makes");
    gbg_netcdf_text(series, all->positions, "units", "sigma");
}

static void put_chunk(struct forces *all, int64_t first, int64_t m)
{
    struct gbg_netcdf *series = &all->series;
    int dimension = all->view.box.dimension;
    double force[3 * CHUNK], position[3 * CHUNK], id[CHUNK];
    int species[CHUNK];
    for (int64_t i = 0; i < m; i++) {
        for (int a = 0; a < dimension; a++) {
            force[dimension * i + a] = all->force[a][first + i];
            position[dimension * i + a] =
                gbg_box_decode(&all->view.box, a, all->fraction[a][first + i]);
        }
        species[i] = all->view.species[first + i] + 1;
        id[i] = (double)all->view.id[first + i];
    }
    size_t start[2] = {(size_t)first, 0}, count[2] = {(size_t)m, (size_t)dimension};
    GBG_CALL(series, nc_put_vara_double(series->file, all->forces, start, count, force));
    GBG_CALL(series, nc_put_vara_double(series->file, all->positions, start, count, position));
    GBG_CALL(series, nc_put_vara_int(series->file, all->species, start, count, species));
    GBG_CALL(series, nc_put_vara_double(series->file, all->id, start, count, id));
}

static int write_file(struct forces *all, const struct gbg_force_error *error, const char *file,
                      const char *path)
{
    struct gbg_netcdf *series = &all->series;
    int unused;
    GBG_CALL(series, nc_create(file, NC_CLOBBER | NC_64BIT_OFFSET, &series->file));
    if (series->code == NC_NOERR) {
        GBG_CALL(series, nc_set_fill(series->file, NC_NOFILL, &unused));
        define(all);
        describe(all, error);
        GBG_CALL(series, nc_enddef(series->file));
        for (int64_t first = 0; first < all->view.n; first += CHUNK) {
            int64_t rest = all->view.n - first;
            put_chunk(all, first, rest < CHUNK ? rest : CHUNK);
        }
        gbg_netcdf_close(series);
    }
    return gbg_netcdf_status(all->view.context, series, "write it", path);
}

static int check_limits(const struct gbg_engine_view *view, const char *path)
{
    int64_t bytes = view->n * view->box.dimension * 8;
    if (view->n < 1) {
        return gbg_fail(view->context, GBG_E_SCENE, "%s: there is no particle to write", path);
    }
    if (bytes > GBG_CDF2_VARIABLE_BYTES) {
        return gbg_fail(view->context, GBG_E_SCENE,
                        "%s: the forces on %lld particles take %lld "
                        "bytes, and the file format allows %lld",
                        path, (long long)view->n, (long long)bytes,
                        (long long)GBG_CDF2_VARIABLE_BYTES);
    }
    return GBG_OK;
}

int gbg_forces_write(struct gbg_engine *engine, const struct gbg_engine_view *view,
                     const struct gbg_force_error *error, const char *path)
{
    struct forces all = {.series = {-1, NC_NOERR}, .view = *view};
    char temporary[TEMPORARY_BYTES] = "";
    int status = check_limits(&all.view, path);
    if (status == GBG_OK) {
        status = allocate(&all);
    }
    if (status == GBG_OK) {
        status = fetch(&all, engine);
    }
    if (status == GBG_OK) {
        status = gbg_file_temporary(all.view.context, path, temporary, sizeof temporary);
    }
    if (status == GBG_OK) {
        status = write_file(&all, error, temporary, path);
    }
    if (status == GBG_OK) {
        status = gbg_file_commit(all.view.context, temporary, path);
    }
    if (status != GBG_OK) {
        gbg_file_abandon(temporary);
    }
    for (int a = 0; a < 3; a++) {
        gbg_release(all.force[a]);
        gbg_release(all.fraction[a]);
    }
    return status;
}
