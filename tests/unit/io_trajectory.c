/* Tests of trajectories: what is written, read by netCDF's own library and by our reader. */
#include <dirent.h>
#include <math.h>
#include <sys/stat.h>

#include <netcdf.h>

#include "core/memory.h"
#include "io_made.h"

static void good(int code)
{
    if (code != NC_NOERR) {
        fail_msg("%s", nc_strerror(code));
    }
}

static const int64_t steps[3] = {0, 100, INT64_C(5000000000)};

static void write_three(struct gbg_engine *engine, const char *path)
{
    struct gbg_trajectory *trajectory;
    made_good(engine->context, gbg_trajectory_create(engine, path, &trajectory));
    for (int f = 0; f < 3; f++) {
        made_set(engine, steps[f]);
        made_good(engine->context, gbg_trajectory_append(trajectory, engine));
    }
    gbg_trajectory_destroy(&trajectory);
    assert_null(trajectory);
}

static double value_of(int file, const char *name, size_t a, size_t b, size_t c)
{
    int id;
    size_t at[3] = {a, b, c};
    double value;
    good(nc_inq_varid(file, name, &id));
    good(nc_get_var1_double(file, id, at, &value));
    return value;
}

static void has_text(int file, const char *variable, const char *name, const char *expected)
{
    char text[256] = "";
    size_t length;
    int id = NC_GLOBAL;
    if (variable) {
        good(nc_inq_varid(file, variable, &id));
    }
    good(nc_inq_attlen(file, id, name, &length));
    assert_true(length < sizeof text);
    good(nc_get_att_text(file, id, name, text));
    assert_string_equal(text, expected);
}

static void check_header(int file, const struct made *made)
{
    int format, unlimited, frame, type;
    size_t length;
    char text[16] = "";
    good(nc_inq_format(file, &format));
    assert_int_equal(format, NC_FORMAT_64BIT_OFFSET);
    good(nc_inq_unlimdim(file, &unlimited));
    good(nc_inq_dimid(file, "frame", &frame));
    assert_int_equal(frame, unlimited);
    good(nc_inq_dimlen(file, frame, &length));
    assert_int_equal(length, 3);
    has_text(file, NULL, "Conventions", "AMBER");
    has_text(file, NULL, "ConventionVersion", "1.0");
    has_text(file, NULL, "program", "gamboge");
    has_text(file, NULL, "species_1", "big");
    has_text(file, NULL, "species_2", "small one");
    has_text(file, NULL, "noise_limit_by", "none");
    has_text(file, "time", "units", "picosecond");
    has_text(file, "coordinates", "units", "angstrom");
    has_text(file, "cell_lengths", "units", "angstrom");
    has_text(file, "cell_angles", "units", "degree");
    good(nc_get_att_int(file, NC_GLOBAL, "dimensionality", &type));
    assert_int_equal(type, made->dimension);
    good(nc_inq_varid(file, "cell_angular", &type));
    good(nc_get_var_text(file, type, text));
    assert_memory_equal(text, "alphabeta gamma", 15);
    good(nc_inq_varid(file, "coordinates", &type));
    good(nc_inq_vartype(file, type, &type));
    assert_int_equal(type, strcmp(made->precision, "double") == 0 ? NC_DOUBLE : NC_FLOAT);
}

static void check_particle(int file, const struct made *made, size_t f, size_t i)
{
    double scale = strcmp(made->precision, "double") == 0 ? 0x1p-52 : 0x1p-24;
    int64_t k = (int64_t)i;
    for (int a = 0; a < 3; a++) {
        size_t axis = (size_t)a;
        double stored = value_of(file, "coordinates", f, i, axis);
        if (a < made->dimension) {
            double expected = made_coordinate(steps[f], k, a);
            double size = made_length[a] + fabs(made_origin[a]);
            assert_true(fabs(stored - expected) <= size * scale);
        } else {
            assert_true(stored == 0.0);
        }
        if (made->unwrapped) {
            double image = a < made->dimension ? made_image(steps[f], k, a) : 0;
            assert_true(value_of(file, "image", f, i, axis) == image);
        }
    }
    if (made->overlap) {
        assert_true(value_of(file, "overlap", f, i, 0) == made_flag(steps[f], k));
    }
}

static void check_frame(int file, const struct made *made, size_t f)
{
    double step = (double)steps[f];
    assert_true(value_of(file, "step_number", f, 0, 0) == step);
    assert_true(value_of(file, "step", f, 0, 0) == (f < 2 ? step : (double)NC_FILL_INT));
    assert_true(fabs(value_of(file, "time", f, 0, 0) - 0.01 * step) <= 1e-15 * step);
    for (size_t a = 0; a < 3; a++) {
        double length = made_length[a], origin = made_origin[a];
        if (made->dimension == 2 && a == 2) {
            length = made_length[0], origin = 0.0;
        }
        assert_true(value_of(file, "cell_lengths", f, a, 0) == length);
        assert_true(value_of(file, "cell_origin", f, a, 0) == origin);
        assert_true(value_of(file, "cell_angles", f, a, 0) == 90.0);
    }
    size_t n = (size_t)made->n, stride = n > 100 ? 97 : 1;
    for (size_t i = 0; i < n; i += i + stride < n ? stride : 1) {
        check_particle(file, made, f, i);
    }
}

static void check_by_library(const char *path, const struct made *made)
{
    int file, id;
    good(nc_open(path, NC_NOWRITE, &file));
    check_header(file, made);
    for (size_t f = 0; f < 3; f++) {
        check_frame(file, made, f);
    }
    for (size_t i = 0; i < (size_t)made->n; i++) {
        assert_true(value_of(file, "atom_types", i, 0, 0) == (i % 3 == 1 ? 2 : 1));
        assert_true(value_of(file, "radius", i, 0, 0) == (i % 3 == 1 ? 0.05F : 0.625F));
        if (made->spread_ids) {
            double expected = (double)made_id(made, (int64_t)i);
            assert_true(value_of(file, "particle_id", i, 0, 0) == expected);
        }
    }
    assert_int_equal(nc_inq_varid(file, "image", &id), made->unwrapped ? NC_NOERR : NC_ENOTVAR);
    assert_int_equal(nc_inq_varid(file, "overlap", &id), made->overlap ? NC_NOERR : NC_ENOTVAR);
    good(nc_close(file));
}

static void check_reader_head(struct gbg_trajectory *trajectory, const struct made *made)
{
    int64_t frames, n;
    int dimension, n_species, is_double;
    char name[32];
    double *diameter = malloc((size_t)made->n * sizeof *diameter);
    int32_t *species = malloc((size_t)made->n * sizeof *species);
    made_good(NULL, gbg_trajectory_size(trajectory, &frames, &n, &dimension, &n_species));
    assert_int_equal(frames, 3);
    assert_int_equal(n, made->n);
    assert_int_equal(dimension, made->dimension);
    assert_int_equal(n_species, 2);
    made_good(NULL, gbg_trajectory_is_double(trajectory, &is_double));
    assert_int_equal(is_double, strcmp(made->precision, "double") == 0);
    made_good(NULL, gbg_trajectory_species_name(trajectory, 1, sizeof name, name));
    assert_string_equal(name, "small one");
    made_good(NULL, gbg_trajectory_species(trajectory, n, species, 1));
    made_good(NULL, gbg_trajectory_diameters(trajectory, n, diameter));
    for (int64_t i = 0; i < n; i++) {
        assert_int_equal(species[i], i % 3 == 1 ? 2 : 1);
        assert_true(diameter[i] == (i % 3 == 1 ? 0.1 : 1.25)); /* all 53 bits */
    }
    free(diameter);
    free(species);
}

/* The reader's coordinates are the stored ones: those that the engine itself gives, as double or
 * rounded to float. Consecutive particles three elements apart. */
static void check_reader_frame(struct gbg_trajectory *trajectory, struct gbg_engine *engine, int f)
{
    int64_t n = engine->state.owned, step;
    int dimension = engine->state.box.dimension, is_double;
    size_t bytes = 3 * (size_t)n * sizeof(double);
    double time, length[3], origin[3], *stored = malloc(bytes), *present = malloc(bytes);
    int32_t *image = malloc(bytes);
    double *z = dimension == 3 ? stored + 2 : NULL, *pz = dimension == 3 ? present + 2 : NULL;
    made_set(engine, steps[f]);
    made_good(NULL, gbg_trajectory_is_double(trajectory, &is_double));
    made_good(engine->context, gbg_trajectory_frame(trajectory, f, &time, &step, length, origin));
    assert_true(step == steps[f]);
    made_good(engine->context, gbg_engine_positions(engine, 1, n, present, present + 1, pz, 3));
    made_good(engine->context,
              gbg_trajectory_positions(trajectory, f, n, stored, stored + 1, z, 3));
    int has_images = engine->state.image[0] != NULL;
    int status = gbg_trajectory_images(trajectory, f, n, image, image + 1,
                                       dimension == 3 ? image + 2 : NULL, 3);
    assert_int_equal(status, has_images ? GBG_OK : GBG_E_NAME);
    for (int a = 0; a < dimension; a++) {
        assert_true(length[a] == made_length[a] && origin[a] == made_origin[a]);
        for (int64_t i = 0; i < n; i++) {
            double r = present[3 * i + a];
            assert_true(stored[3 * i + a] == (is_double ? r : (double)(float)r));
            assert_true(!has_images || image[3 * i + a] == made_image(steps[f], i, a));
        }
    }
    int has_overlap = engine->state.overlapped != NULL;
    status = gbg_trajectory_overlapped(trajectory, f, n, image);
    assert_int_equal(status, has_overlap ? GBG_OK : GBG_E_NAME);
    for (int64_t i = 0; has_overlap && i < n; i++) {
        assert_int_equal(image[i], made_flag(steps[f], i));
    }
    free(stored);
    free(present);
    free(image);
}

static void round_trip(const struct made *made)
{
    struct gbg_context *context;
    struct gbg_trajectory *trajectory;
    const char *path = made_path("t.nc");
    made_good(NULL, gbg_context_create("cpu:threads=1", &context));
    struct gbg_engine *engine = made_engine(context, made);
    write_three(engine, path);
    check_by_library(path, made);
    made_good(context, gbg_trajectory_open(context, path, &trajectory));
    check_reader_head(trajectory, made);
    for (int f = 2; f >= 0; f--) {
        check_reader_frame(trajectory, engine, f);
    }
    gbg_trajectory_destroy(&trajectory);
    gbg_engine_destroy(&engine);
    gbg_context_destroy(&context);
    assert_int_equal(unlink(path), 0);
}

static void frames_come_back(void **state)
{
    (void)state;
    for (int set = 0; set < 16; set++) {
        struct made made = {.dimension = set & 1 ? 3 : 2,
                            .n = set & 2 ? 5 : 1,
                            .precision = set & 4 ? "float" : "double",
                            .unwrapped = set >> 3 & 1,
                            .overlap = set % 3 == 0,
                            .spread_ids = set % 5 == 0};
        round_trip(&made);
    }
    round_trip(&(struct made){2, 7, "double", 0, 0, 1, 0});
    round_trip(&(struct made){3, 4097, "double", 1, 1, 0, 0}); /* more than a chunk of the writer */
    round_trip(&(struct made){2, 8193, "float", 1, 1, 1, 0});
}

/* A start from a file of ours: species by their names, permanent ids, the box of the file. */
static void our_file_is_a_start(void **state)
{
    (void)state;
    static const struct made made = {3, 11, "double", 1, 0, 1, 0};
    static const char *const names[2] = {"small one", "big"}; /* not in the order of the file */
    struct gbg_context *context;
    struct gbg_engine *engine, *again;
    struct gbg_scene *scene;
    const char *path = made_path("t.nc");
    made_good(NULL, gbg_context_create("cpu:threads=1", &context));
    engine = made_engine(context, &made);
    write_three(engine, path);
    made_good(context, gbg_scene_create(context, 3, &scene));
    for (int s = 0; s < 2; s++) {
        made_good(context, gbg_scene_add_species(scene, names[s], 0.1, 1, 1, -1, -1, NULL));
    }
    made_good(context, gbg_scene_set_text(scene, "particles.start.file", path));
    made_good(context, gbg_scene_set_integer(scene, "particles.start.frame", 1));
    made_good(context, gbg_scene_set_real(scene, "dynamics.dt", 0.01));
    made_good(context, gbg_engine_create(scene, &again));
    int32_t species[11];
    int64_t ids[11];
    double x[11], y[11], z[11], length[3], origin[3];
    made_good(context, gbg_engine_species(again, 11, species, 0));
    made_good(context, gbg_engine_ids(again, 11, ids));
    made_good(context, gbg_engine_positions(again, 1, 11, x, y, z, 1));
    made_good(context, gbg_engine_box(again, length, origin));
    for (int64_t i = 0; i < 11; i++) {
        assert_int_equal(species[i], i % 3 == 1 ? 0 : 1);
        assert_int_equal(ids[i], made_id(&made, i));
        assert_true(fabs(x[i] - made_coordinate(steps[1], i, 0)) <= 3e-13);
        assert_true(fabs(z[i] - made_coordinate(steps[1], i, 2)) <= 3e-13);
    }
    assert_true(length[2] == made_length[2] && origin[2] == made_origin[2]);
    gbg_engine_destroy(&again);
    gbg_engine_destroy(&engine);
    gbg_scene_destroy(&scene);
    gbg_context_destroy(&context);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_come_back),
        cmocka_unit_test(our_file_is_a_start),
    };
    return cmocka_run_group_tests(tests, made_start, made_stop);
}
