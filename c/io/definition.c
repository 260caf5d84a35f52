/* Side room io: the header of a trajectory file and what does not change from frame to frame. */
#include "io/definition.h"

#include <stdio.h>
#include <string.h>

#include "engine/view.h"
#include "gamboge/version.h"
#include "io/netcdf_call.h"
#include "scene/scene.h"

enum { CHUNK = 4096, MOST_RANK = 3, NO_VARIABLE = -1 };

const char *const gbg_frame_variable_name[GBG_FRAME_VARIABLES] = {
    "time",        "step",        "step_number", "cell_origin", "cell_lengths",
    "cell_angles", "coordinates", "image",       "overlap"};

/* One letter a dimension: f frame, a atom, s spatial, c cell_spatial, g cell_angular, l label. */
static const char letters[] = "fascgl";
static const char *const dimension_name[] = {"frame",        "atom",         "spatial",
                                             "cell_spatial", "cell_angular", "label"};

/* The units are those that AMBER's convention prescribes and readers insist on; the true ones are
 * in the file's attributes length_unit and time_unit. Fixed variables come first. */
static const struct variable {
    const char *name, *shape, *units;
    nc_type type;
} fixed_variables[] = {
    {"spatial", "s", NULL, NC_CHAR},       {"cell_spatial", "c", NULL, NC_CHAR},
    {"cell_angular", "gl", NULL, NC_CHAR}, {"atom_types", "a", NULL, NC_INT},
    {"radius", "a", "angstrom", NC_FLOAT}, {"particle_id", "a", NULL, NC_DOUBLE}};
enum { SPATIAL, CELL_SPATIAL, CELL_ANGULAR, TYPES, RADIUS, PARTICLE_ID, FIXED_VARIABLES };

static const struct variable frame_variables[GBG_FRAME_VARIABLES] = {
    {"time", "f", "picosecond", NC_DOUBLE},
    {"step", "f", NULL, NC_INT},
    {"step_number", "f", NULL, NC_DOUBLE},
    {"cell_origin", "fc", "angstrom", NC_DOUBLE},
    {"cell_lengths", "fc", "angstrom", NC_DOUBLE},
    {"cell_angles", "fg", "degree", NC_DOUBLE},
    {"coordinates", "fas", "angstrom", NC_DOUBLE},
    {"image", "fas", NULL, NC_INT},
    {"overlap", "fa", NULL, NC_INT}};

struct definition {
    struct gbg_netcdf series;
    const struct gbg_engine_view *view;
    int dimension[sizeof letters - 1];
    int fixed[FIXED_VARIABLES]; /* variable ids, NO_VARIABLE: not in this file */
};

static void define_dimensions(struct definition *make)
{
    size_t length[] = {NC_UNLIMITED, (size_t)make->view->n, 3, 3, 3, 5};
    for (int d = 0; d < (int)sizeof letters - 1; d++) {
        GBG_CALL(&make->series,
                 nc_def_dim(make->series.file, dimension_name[d], length[d], &make->dimension[d]));
    }
}

static int define_variable(struct definition *make, const struct variable *variable, nc_type type)
{
    int shape[MOST_RANK], rank = 0, id = NO_VARIABLE;
    for (const char *letter = variable->shape; *letter; letter++) {
        shape[rank++] = make->dimension[strchr(letters, *letter) - letters];
    }
    GBG_CALL(&make->series, nc_def_var(make->series.file, variable->name, type, rank, shape, &id));
    if (variable->units) {
        gbg_netcdf_text(&make->series, id, "units", variable->units);
    }
    return id;
}

static int ids_are_the_order(const struct gbg_engine_view *view)
{
    return view->n == 0 || (view->id[0] == 0 && view->id[view->n - 1] == view->n - 1);
}

static void define_variables(struct definition *make)
{
    const struct gbg_engine_view *view = make->view;
    for (int v = 0; v < FIXED_VARIABLES; v++) {
        int left_out = v == PARTICLE_ID && ids_are_the_order(view);
        make->fixed[v] = left_out
                             ? NO_VARIABLE
                             : define_variable(make, &fixed_variables[v], fixed_variables[v].type);
    }
    for (int v = 0; v < GBG_FRAME_VARIABLES; v++) {
        int left_out = (v == GBG_FRAME_IMAGE && !view->has_images) ||
                       (v == GBG_FRAME_OVERLAP && !view->has_overlap);
        int as_float = v == GBG_FRAME_COORDINATES && !view->scene->output_double;
        if (!left_out) {
            define_variable(make, &frame_variables[v],
                            as_float ? NC_FLOAT : frame_variables[v].type);
        }
    }
}

static void put_text(struct definition *make, const char *name, const char *text)
{
    gbg_netcdf_text(&make->series, NC_GLOBAL, name, text);
}

static void put_real(struct definition *make, const char *name, double value)
{
    gbg_netcdf_reals(&make->series, name, 1, &value);
}

static void describe_file(struct definition *make)
{
    const struct gbg_scene *scene = make->view->scene;
    put_text(make, "Conventions", "AMBER");
    put_text(make, "ConventionVersion", "1.0");
    put_text(make, "program", "gamboge");
    put_text(make, "programVersion", GBG_VERSION);
    put_text(make, "application", "gamboge");
    put_text(make, "title", scene->source[0] ? scene->source : "gamboge");
    put_text(make, "history", "written by gamboge " GBG_VERSION);
    put_text(make, "length_unit", "sigma");
    put_text(make, "time_unit", "tau_B");
    put_text(make, "energy_unit", "kT");
    gbg_netcdf_integer(&make->series, "dimensionality", make->view->box.dimension);
}

static void describe_species(struct definition *make)
{
    const struct gbg_scene *scene = make->view->scene;
    double diameter[GBG_MAX_SPECIES], alpha[GBG_MAX_SPECIES], mobility[GBG_MAX_SPECIES];
    gbg_netcdf_integer(&make->series, "n_species", scene->n_species);
    for (int s = 0; s < scene->n_species; s++) {
        char name[32];
        snprintf(name, sizeof name, "species_%d", s + 1);
        put_text(make, name, scene->species[s].name);
        diameter[s] = scene->species[s].diameter;
        alpha[s] = scene->species[s].alpha;
        mobility[s] = scene->species[s].mobility;
    }
    gbg_netcdf_reals(&make->series, "species_diameter", scene->n_species, diameter);
    gbg_netcdf_reals(&make->series, "species_alpha", scene->n_species, alpha);
    gbg_netcdf_reals(&make->series, "species_mobility", scene->n_species, mobility);
}

static void describe_dynamics(struct definition *make)
{
    static const char *const limit_name[] = {"none", "clamp", "redraw"};
    static const char *const rule_name[] = {
        [GBG_RULE_NONE] = "none",     [GBG_RULE_AUTO] = "auto",     [GBG_RULE_EVENT] = "event",
        [GBG_RULE_BRIDGE] = "bridge", [GBG_RULE_BOUNCE] = "bounce", [GBG_RULE_CONTACT] = "contact",
        [GBG_RULE_CARTER] = "carter"};
    const struct gbg_scene *scene = make->view->scene;
    char digest[65];
    gbg_scene_digest(scene, digest);
    put_text(make, "scene_digest", digest);
    put_text(make, "excluded_volume", rule_name[scene->rule]);
    put_real(make, "seed", (double)scene->seed);
    put_real(make, "run", (double)scene->run);
    put_real(make, "dt", scene->dt);
    put_real(make, "temperature", scene->temperature);
    put_text(make, "noise_limit_by", limit_name[scene->limit_by]);
    put_real(make, "noise_limit", scene->noise_limit);
    gbg_netcdf_integer(&make->series, "noise_rescaled", scene->rescale);
    if (make->view->has_sums) {
        gbg_netcdf_reals(&make->series, "force_tolerance", scene->n_forces,
                         make->view->force_tolerance);
        gbg_netcdf_reals(&make->series, "force_error_measured", scene->n_forces,
                         make->view->force_error);
    }
}

static void put_labels(struct definition *make)
{
    struct gbg_netcdf *series = &make->series;
    GBG_CALL(series, nc_put_var_text(series->file, make->fixed[SPATIAL], "xyz"));
    GBG_CALL(series, nc_put_var_text(series->file, make->fixed[CELL_SPATIAL], "abc"));
    GBG_CALL(series, nc_put_var_text(series->file, make->fixed[CELL_ANGULAR], "alphabeta gamma"));
}

static void put_particles(struct definition *make)
{
    struct gbg_netcdf *series = &make->series;
    const struct gbg_engine_view *view = make->view;
    for (int64_t first = 0; first < view->n; first += CHUNK) {
        int64_t m = view->n - first < CHUNK ? view->n - first : CHUNK;
        size_t start = (size_t)first, count = (size_t)m;
        int type[CHUNK];
        float radius[CHUNK];
        double id[CHUNK];
        for (int64_t i = 0; i < m; i++) {
            int32_t species = view->species[first + i];
            type[i] = species + 1;
            radius[i] = (float)(view->scene->species[species].diameter / 2.0);
            id[i] = (double)view->id[first + i];
        }
        GBG_CALL(series, nc_put_vara_int(series->file, make->fixed[TYPES], &start, &count, type));
        GBG_CALL(series,
                 nc_put_vara_float(series->file, make->fixed[RADIUS], &start, &count, radius));
        if (make->fixed[PARTICLE_ID] != NO_VARIABLE) {
            GBG_CALL(series, nc_put_vara_double(series->file, make->fixed[PARTICLE_ID], &start,
                                                &count, id));
        }
    }
}

static int check_limits(const struct gbg_engine_view *view, const char *path)
{
    int64_t bytes = view->n * 3 * (view->scene->output_double ? 8 : 4);
    if (view->n < 1) {
        return gbg_fail(view->context, GBG_E_SCENE, "%s: a trajectory needs at least one particle",
                        path);
    }
    if (bytes > GBG_CDF2_VARIABLE_BYTES) {
        return gbg_fail(
            view->context, GBG_E_SCENE,
            "%s: the coordinates of %lld particles take "
            "%lld bytes a frame, and the file format allows %lld (output.trajectory.precision "
            "float takes half of double)",
            path, (long long)view->n, (long long)bytes, (long long)GBG_CDF2_VARIABLE_BYTES);
    }
    return GBG_OK;
}

int gbg_trajectory_define(const struct gbg_engine_view *view, const char *file, const char *path)
{
    struct definition make = {.view = view};
    int status = check_limits(view, path), unused;
    if (status != GBG_OK) {
        return status;
    }
    GBG_CALL(&make.series, nc_create(file, NC_CLOBBER | NC_64BIT_OFFSET, &make.series.file));
    if (make.series.code == NC_NOERR) {
        GBG_CALL(&make.series, nc_set_fill(make.series.file, NC_NOFILL, &unused));
        define_dimensions(&make);
        define_variables(&make);
        describe_file(&make);
        describe_species(&make);
        describe_dynamics(&make);
        GBG_CALL(&make.series, nc_enddef(make.series.file));
        put_labels(&make);
        put_particles(&make);
        gbg_netcdf_close(&make.series);
    }
    return gbg_netcdf_status(view->context, &make.series, "write its header", path);
}
