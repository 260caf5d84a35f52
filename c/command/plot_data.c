/* Command: the structure factor in a file of gamboge sk, read with netcdf-c. */
#include "command/plot_data.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef GBG_WITH_NETCDF

#include <netcdf.h>

/* Length of a dimension, 0 if the file has none of that name. */
static size_t dimension_length(int file, const char *name)
{
    int id;
    size_t length = 0;
    if (nc_inq_dimid(file, name, &id) == NC_NOERR) {
        nc_inq_dimlen(file, id, &length);
    }
    return length;
}

/* Number of values of a variable, 0 if the file has none of that name. */
static size_t variable_size(int file, const char *name)
{
    int id, rank, shape[NC_MAX_VAR_DIMS];
    if (nc_inq_varid(file, name, &id) != NC_NOERR ||
        nc_inq_var(file, id, NULL, NULL, &rank, shape, NULL) != NC_NOERR) {
        return 0;
    }
    size_t size = 1;
    for (int d = 0; d < rank; d++) {
        size_t length = 0;
        nc_inq_dimlen(file, shape[d], &length);
        size *= length;
    }
    return size;
}

/* All `size` values of a variable as doubles; NULL if it is missing or of another size. */
static double *read_variable(int file, const char *name, size_t size)
{
    int id;
    if (size == 0 || variable_size(file, name) != size || nc_inq_varid(file, name, &id)) {
        return NULL;
    }
    double *values = malloc(size * sizeof *values);
    if (values && nc_get_var_double(file, id, values) != NC_NOERR) {
        free(values);
        return NULL;
    }
    return values;
}

static void read_text(int file, const char *name, size_t capacity, char *text)
{
    size_t length = 0;
    text[0] = 0;
    nc_type type;
    if (nc_inq_att(file, NC_GLOBAL, name, &type, &length) == NC_NOERR && type == NC_CHAR &&
        length < capacity && nc_get_att_text(file, NC_GLOBAL, name, text) == NC_NOERR) {
        text[length] = 0;
    }
}

/* Name of a species from type_name(type, strlen). */
static void species_name(int file, int species, size_t capacity, char *name)
{
    int id;
    size_t types = dimension_length(file, "type"), letters = dimension_length(file, "strlen");
    snprintf(name, capacity, "%c", 'A' + species);
    if ((size_t)species >= types || letters == 0 || letters >= capacity ||
        variable_size(file, "type_name") != types * letters ||
        nc_inq_varid(file, "type_name", &id) != NC_NOERR) {
        return;
    }
    size_t start[2] = {(size_t)species, 0}, count[2] = {1, letters};
    char text[GBG_TEXT_MOST] = "";
    if (nc_get_vara_text(file, id, start, count, text) == NC_NOERR && text[0]) {
        text[letters] = 0;
        snprintf(name, capacity, "%s", text);
    }
}

static double *copy_row(const double *values, int row, size_t size)
{
    double *copy = values ? malloc(size * sizeof *copy) : NULL;
    if (copy) {
        memcpy(copy, values + (size_t)row * size, size * sizeof *copy);
    }
    return copy;
}

static void read_partials(int file, struct gbg_plot_data *data)
{
    size_t pairs = dimension_length(file, "pair");
    if (pairs < 1 || pairs > GBG_PAIRS_MOST) {
        return;
    }
    double *value = read_variable(file, "S_partial", pairs * data->shells);
    double *error = read_variable(file, "S_partial_stderr", pairs * data->shells);
    double *types = read_variable(file, "pair_types", 2 * pairs);
    for (int p = 0; value && types && p < (int)pairs; p++) {
        char first[GBG_TEXT_MOST], second[GBG_TEXT_MOST];
        species_name(file, (int)types[2 * p], sizeof first, first);
        species_name(file, (int)types[2 * p + 1], sizeof second, second);
        struct gbg_curve *curve = &data->pair[data->pairs++];
        snprintf(curve->label, sizeof curve->label, "%s-%s", first, second);
        curve->value = copy_row(value, p, data->shells);
        curve->error = copy_row(error, p, data->shells);
    }
    free(value);
    free(error);
    free(types);
}

static void read_description(int file, struct gbg_plot_data *data)
{
    read_text(file, "input_files", sizeof data->source, data->source);
    int frames;
    data->frames =
        nc_get_att_int(file, NC_GLOBAL, "frames_used", &frames) == NC_NOERR ? frames : -1;
    size_t types = dimension_length(file, "type");
    double *particles = read_variable(file, "n_particles", types);
    for (size_t t = 0; particles && t < types; t++) {
        data->particles += particles[t];
    }
    free(particles);
    double *bound = read_variable(file, "S_numerr", data->shells);
    data->largest_bound = bound ? 0 : NAN;
    for (size_t s = 0; bound && s < data->shells; s++) {
        data->largest_bound = fmax(data->largest_bound, bound[s]);
    }
    free(bound);
}

int gbg_plot_data_read(const char *path, struct gbg_plot_data *data)
{
    memset(data, 0, sizeof *data);
    int file, status = nc_open(path, NC_NOWRITE, &file);
    if (status != NC_NOERR) {
        return gbg_complain(GBG_EXIT_USE, "%s cannot be read as netCDF: %s", path,
                            nc_strerror(status));
    }
    data->shells = dimension_length(file, "k");
    data->k = read_variable(file, "k", data->shells);
    data->total.value = read_variable(file, "S", data->shells);
    data->total.error = read_variable(file, "S_stderr", data->shells);
    snprintf(data->total.label, sizeof data->total.label, "all");
    if (data->k && data->total.value) {
        read_partials(file, data);
        read_description(file, data);
    }
    nc_close(file);
    if (!data->k || !data->total.value) {
        return gbg_complain(GBG_EXIT_USE,
                            "%s holds no structure factor: variables k(k) and S(k), as gamboge sk "
                            "writes them, are needed",
                            path);
    }
    return GBG_EXIT_DONE;
}

#else

int gbg_plot_data_read(const char *path, struct gbg_plot_data *data)
{
    memset(data, 0, sizeof *data);
    return gbg_complain(GBG_EXIT_FAILED,
                        "%s: this build cannot read netCDF; configure with -DGBG_WITH_NETCDF=ON",
                        path);
}

#endif

static void release_curve(struct gbg_curve *curve)
{
    free(curve->value);
    free(curve->error);
}

void gbg_plot_data_release(struct gbg_plot_data *data)
{
    free(data->k);
    release_curve(&data->total);
    for (int p = 0; p < data->pairs; p++) {
        release_curve(&data->pair[p]);
    }
}
