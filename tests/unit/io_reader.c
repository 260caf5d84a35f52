/* Tests of reading trajectories that others wrote, and files that are none. */
#include <fcntl.h>
#include <math.h>

#include <netcdf.h>

#include "core/file.h"
#include "core/memory.h"
#include "io/start_file.h"
#include "io_made.h"

static struct gbg_context *context;

static void good(int code)
{
    if (code != NC_NOERR) {
        fail_msg("%s", nc_strerror(code));
    }
}

/* What a foreign file is like. Three particles, two frames; coordinate a of particle i in frame f
 * is 10 f + i + a/4. */
struct foreign {
    int format;
    nc_type type;             /* of coordinates */
    int spatial;              /* 3 but for a bad file */
    int no_lengths, no_time;  /* 1: left out */
    int origin, framed_types; /* 1: present; types (frame,atom) instead of (atom) */
    int types[3];             /* 0: none */
    double radius;            /* 0: none */
    double angle, scale;      /* 0: none */
    double bad;               /* not 0: stands for y of particle 1 in frame 1 */
    double length;            /* 0: 20 */
};

static void define_properties(int file, const struct foreign *how, const int *dims, int id[2])
{
    if (how->radius > 0.0) {
        good(nc_def_var(file, "radius", NC_FLOAT, 1, dims + 1, &id[0]));
    }
    if (how->types[0]) {
        int skip = how->framed_types ? 0 : 1;
        good(nc_def_var(file, "atom_types", NC_INT, 2 - skip, dims + skip, &id[1]));
    }
}

static void put_properties(int file, const struct foreign *how, const int id[2])
{
    for (size_t i = 0; i < 3; i++) {
        size_t at[2] = {0, i};
        if (how->radius > 0.0) {
            good(nc_put_var1_double(file, id[0], &i, &how->radius));
        }
        if (how->types[0]) {
            good(nc_put_var1_int(file, id[1], how->framed_types ? at : at + 1, &how->types[i]));
        }
    }
}

static void put_frames(int file, const struct foreign *how, int coordinates, int lengths,
                       int angles, int time)
{
    double length = how->length != 0.0 ? how->length : 20.0;
    for (size_t f = 0; f < 2; f++) {
        double when = 3.0 * (double)f;
        if (!how->no_time) {
            good(nc_put_var1_double(file, time, &f, &when));
        }
        for (size_t a = 0; a < 3 && a < (size_t)how->spatial; a++) {
            for (size_t i = 0; i < 3; i++) {
                size_t at[3] = {f, i, a};
                double r = 10.0 * (double)f + (double)i + 0.25 * (double)a;
                r = how->bad != 0.0 && f == 1 && i == 1 && a == 1 ? how->bad : r;
                good(nc_put_var1_double(file, coordinates, at, &r));
            }
            size_t at[2] = {f, a};
            if (!how->no_lengths) {
                good(nc_put_var1_double(file, lengths, at, &length));
            }
            if (how->angle != 0.0) {
                good(nc_put_var1_double(file, angles, at, &how->angle));
            }
        }
    }
}

static void make(const struct foreign *how, const char *path)
{
    int file, dims[3], cell[2], angular, coordinates, lengths = -1, angles = -1, time = -1, origin;
    int properties[2] = {-1, -1};
    good(nc_create(path, NC_CLOBBER | how->format, &file));
    good(nc_def_dim(file, "frame", NC_UNLIMITED, &dims[0]));
    good(nc_def_dim(file, "atom", 3, &dims[1]));
    good(nc_def_dim(file, "spatial", (size_t)how->spatial, &dims[2]));
    good(nc_def_dim(file, "cell_spatial", 3, &cell[1]));
    good(nc_def_dim(file, "cell_angular", 3, &angular));
    cell[0] = dims[0];
    good(nc_put_att_text(file, NC_GLOBAL, "Conventions", 5, "AMBER"));
    good(nc_def_var(file, "coordinates", how->type, 3, dims, &coordinates));
    if (how->scale != 0.0) {
        good(nc_put_att_double(file, coordinates, "scale_factor", NC_DOUBLE, 1, &how->scale));
    }
    if (!how->no_lengths) {
        good(nc_def_var(file, "cell_lengths", NC_FLOAT, 2, cell, &lengths));
    }
    if (how->angle != 0.0) {
        good(nc_def_var(file, "cell_angles", NC_FLOAT, 2, (int[]){dims[0], angular}, &angles));
    }
    if (!how->no_time) {
        good(nc_def_var(file, "time", NC_FLOAT, 1, dims, &time));
    }
    if (how->origin) {
        good(nc_def_var(file, "cell_origin", NC_DOUBLE, 2, cell, &origin));
    }
    define_properties(file, how, dims, properties);
    good(nc_enddef(file));
    put_frames(file, how, coordinates, lengths, angles, time);
    for (size_t f = 0; how->origin && f < 2; f++) {
        good(nc_put_vara_double(file, origin, (size_t[]){f, 0}, (size_t[]){1, 3},
                                (double[]){-1.0, -2.0, -3.0}));
    }
    put_properties(file, how, properties);
    good(nc_close(file));
}

static const struct foreign amber = {.format = NC_64BIT_OFFSET, .type = NC_FLOAT, .spatial = 3};

static struct gbg_trajectory *opened(const char *path)
{
    struct gbg_trajectory *trajectory;
    made_good(context, gbg_trajectory_open(context, path, &trajectory));
    return trajectory;
}

static void check_frames(struct gbg_trajectory *trajectory, double scale, int origin)
{
    for (int f = 1; f >= 0; f--) {
        double time, length[3], corner[3], r[9];
        int64_t step;
        made_good(context, gbg_trajectory_frame(trajectory, f, &time, &step, length, corner));
        assert_int_equal(step, f);
        assert_true(length[0] == 20.0 && length[2] == 20.0);
        assert_true(corner[1] == (origin ? -2.0 : 0.0));
        made_good(context, gbg_trajectory_positions(trajectory, f, 3, r, r + 3, r + 6, 1));
        for (int k = 0; k < 9; k++) {
            double expected = 10.0 * f + k % 3 + k / 3 * 0.25;
            assert_true(r[k] == expected * scale);
        }
    }
}

static void plain_files_get_defaults(void **state)
{
    (void)state;
    static const int format[4] = {0, NC_64BIT_OFFSET, NC_64BIT_DATA, NC_NETCDF4};
    const char *path = made_path("foreign.nc");
    for (int k = 0; k < 8; k++) {
        struct foreign how = amber;
        how.format = format[k % 4];
        how.type = k < 4 ? NC_FLOAT : NC_DOUBLE;
        how.angle = k % 2 ? 90.0 : 0.0;
        how.origin = k % 3 == 0;
        how.scale = k == 7 ? 2.0 : 0.0;
        how.no_time = k == 2;
        make(&how, path);
        struct gbg_trajectory *trajectory = opened(path);
        int64_t frames, n;
        int dimension, n_species, is_double, species[3];
        double diameter[3], time;
        char name[2];
        made_good(context, gbg_trajectory_size(trajectory, &frames, &n, &dimension, &n_species));
        assert_true(frames == 2 && n == 3 && dimension == 3 && n_species == 1);
        made_good(context, gbg_trajectory_is_double(trajectory, &is_double));
        assert_int_equal(is_double, k >= 4);
        made_good(context, gbg_trajectory_species(trajectory, 3, species, 0));
        made_good(context, gbg_trajectory_diameters(trajectory, 3, diameter));
        assert_true(species[2] == 0 && diameter[2] == 1.0);
        made_good(context, gbg_trajectory_species_name(trajectory, 0, 2, name));
        assert_string_equal(name, "A");
        check_frames(trajectory, k == 7 ? 2.0 : 1.0, how.origin);
        made_good(context, gbg_trajectory_frame(trajectory, 1, &time, NULL, NULL, NULL));
        assert_true(time == (k == 2 ? 1.0 : 3.0));
        gbg_trajectory_destroy(&trajectory);
    }
    unlink(path);
}

static void types_and_radii_of_others(void **state)
{
    (void)state;
    const char *path = made_path("foreign.nc");
    for (int framed = 0; framed < 2; framed++) {
        struct foreign how = amber;
        memcpy(how.types, (int[]){79, 8, 79}, sizeof how.types);
        how.framed_types = framed;
        how.radius = 0.75;
        make(&how, path);
        struct gbg_trajectory *trajectory = opened(path);
        int32_t species[3];
        double diameter[3];
        int n_species;
        char name[2];
        made_good(context, gbg_trajectory_size(trajectory, NULL, NULL, NULL, &n_species));
        made_good(context, gbg_trajectory_species(trajectory, 3, species, 1));
        made_good(context, gbg_trajectory_diameters(trajectory, 3, diameter));
        made_good(context, gbg_trajectory_species_name(trajectory, 1, 2, name));
        assert_true(n_species == 2 && species[0] == 2 && species[1] == 1 && species[2] == 2);
        assert_true(diameter[0] == 1.5 && diameter[2] == 1.5);
        assert_string_equal(name, "B");
        gbg_trajectory_destroy(&trajectory);
    }
    unlink(path);
}

static void open_refused(const char *path, int expected, const char *words)
{
    struct gbg_trajectory *trajectory;
    made_refused(context, gbg_trajectory_open(context, path, &trajectory), expected, words);
    assert_null(trajectory);
    assert_non_null(strstr(gbg_message(context), "gbg_trajectory_open: "));
}

static void bad_coordinates_are_named(void **state)
{
    (void)state;
    static const double bad[] = {NAN, INFINITY, -INFINITY, NC_FILL_DOUBLE, NC_FILL_FLOAT};
    const char *path = made_path("foreign.nc");
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        struct foreign how = amber;
        how.type = k < 4 ? NC_DOUBLE : NC_FLOAT;
        how.bad = bad[k];
        make(&how, path);
        struct gbg_trajectory *trajectory = opened(path);
        double r[9];
        made_good(context, gbg_trajectory_positions(trajectory, 0, 3, r, r + 3, r + 6, 1));
        made_refused(context, gbg_trajectory_positions(trajectory, 1, 3, r, r + 3, r + 6, 1),
                     GBG_E_FORMAT, "frame 1, particle 1 (both from 0): y is ");
        gbg_trajectory_destroy(&trajectory);
    }
    unlink(path);
}

static void bad_boxes_are_refused(void **state)
{
    (void)state;
    static const struct {
        double angle, length;
        const char *words;
    } bad[] = {{60.0, 20.0, "frame 0: cell angle 1 is 60"},
               {90.0, -3.0, "frame 0: cell length 1 is -3"},
               {90.0, NAN, "cell length 1 is nan"},
               {90.0, NC_FILL_FLOAT, "cell length 1 is 9.96921e+36"},
               {NAN, 20.0, "cell angle 1 is nan"}};
    const char *path = made_path("foreign.nc");
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        struct foreign how = amber;
        double length[3], time;
        how.angle = bad[k].angle;
        how.length = bad[k].length;
        make(&how, path);
        struct gbg_trajectory *trajectory = opened(path);
        made_refused(context, gbg_trajectory_frame(trajectory, 0, &time, NULL, length, NULL),
                     GBG_E_FORMAT, bad[k].words);
        gbg_trajectory_destroy(&trajectory);
    }
    unlink(path);
}

static void put(const char *path, const void *data, size_t bytes)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, bytes, file), bytes);
    fclose(file);
}

static void files_that_are_no_trajectories(void **state)
{
    (void)state;
    const char *path = made_path("foreign.nc");
    int file, dim, id;
    struct foreign how = amber;
    open_refused(made_path("none.nc"), GBG_E_FILE, "No such file or directory");
    open_refused(made_directory, GBG_E_FILE, "Is a directory");
    put(path, "", 0);
    open_refused(path, GBG_E_FORMAT, "not a netCDF file");
    put(path, "hello, world\n", 13);
    open_refused(path, GBG_E_FORMAT, "not a netCDF file");
    put(path, "\211HDF\r\n\032\n and then nothing", 25);
    open_refused(path, GBG_E_FILE, "cannot open it");
    put(path, "CDF\002", 4);
    open_refused(path, GBG_E_FORMAT, "ends inside its netCDF header");
    put(path, "CDF\003\0\0\0\0", 8);
    open_refused(path, GBG_E_FORMAT, "not a classic netCDF file");
    good(nc_create(path, NC_CLOBBER | NC_NETCDF4, &file));
    good(nc_def_dim(file, "x", 3, &dim));
    good(nc_def_var(file, "y", NC_DOUBLE, 1, &dim, &id));
    good(nc_close(file));
    open_refused(path, GBG_E_FORMAT, "no AMBER trajectory");
    how.spatial = 2;
    make(&how, path);
    open_refused(path, GBG_E_FORMAT, "spatial is not 3");
    how = amber;
    how.no_lengths = 1;
    make(&how, path);
    open_refused(path, GBG_E_FORMAT, "no box");
    make(&amber, path);
    file = open(path, O_RDWR);
    off_t size = lseek(file, 0, SEEK_END);
    assert_int_equal(ftruncate(file, size - 1), 0);
    open_refused(path, GBG_E_FORMAT, "cut short: 2 frames need");
    assert_int_equal(gbg_file_write(file, "\xff\xff\xff\xff", 4, 4), 0);
    open_refused(path, GBG_E_FORMAT, "streaming");
    close(file);
    unlink(path);
}

static void bad_arguments_are_refused(void **state)
{
    (void)state;
    const char *path = made_path("foreign.nc");
    struct gbg_trajectory *t, *other;
    double r[9];
    int32_t k[9];
    char name[2];
    make(&amber, path);
    t = opened(path);
    made_refused(context, gbg_trajectory_positions(t, 2, 3, r, r, r, 1), GBG_E_ARGUMENT,
                 "frame is 2");
    made_refused(context, gbg_trajectory_positions(t, -1, 3, r, r, r, 1), GBG_E_ARGUMENT,
                 "frame is -1");
    made_refused(context, gbg_trajectory_positions(t, 0, 2, r, r, r, 1), GBG_E_SPACE, "n is 2");
    made_refused(context, gbg_trajectory_positions(t, 0, 3, NULL, r, r, 1), GBG_E_ARGUMENT,
                 "x is NULL");
    made_refused(context, gbg_trajectory_positions(t, 0, 3, r, NULL, r, 1), GBG_E_ARGUMENT,
                 "y is NULL");
    made_refused(context, gbg_trajectory_positions(t, 0, 3, r, r, NULL, 1), GBG_E_ARGUMENT,
                 "z is NULL");
    made_refused(context, gbg_trajectory_positions(t, 0, 3, r, r, r, 0), GBG_E_ARGUMENT,
                 "step is 0");
    made_refused(context, gbg_trajectory_images(t, 0, 3, k, k, k, 1), GBG_E_NAME,
                 "no image counts");
    made_refused(context, gbg_trajectory_overlapped(t, 0, 3, k), GBG_E_NAME, "no overlap flags");
    made_refused(context, gbg_trajectory_species(t, 3, k, 2), GBG_E_ARGUMENT, "base is 2");
    made_refused(context, gbg_trajectory_species(t, 2, k, 0), GBG_E_SPACE, "n is 2");
    made_refused(context, gbg_trajectory_diameters(t, 3, NULL), GBG_E_ARGUMENT,
                 "diameters is NULL");
    made_refused(context, gbg_trajectory_species_name(t, 1, 2, name), GBG_E_ARGUMENT,
                 "species is 1");
    made_refused(context, gbg_trajectory_species_name(t, 0, 1, name), GBG_E_SPACE, "needs 2");
    made_refused(context, gbg_trajectory_frame(t, 7, r, NULL, NULL, NULL), GBG_E_ARGUMENT,
                 "frame is 7");
    made_refused(context, gbg_trajectory_is_double(t, NULL), GBG_E_ARGUMENT, "is_double is NULL");
    made_refused(context, gbg_trajectory_is_hard(t, NULL), GBG_E_ARGUMENT, "is_hard is NULL");
    assert_int_equal(gbg_trajectory_size(NULL, NULL, NULL, NULL, NULL), GBG_E_ARGUMENT);
    assert_int_equal(gbg_trajectory_positions(NULL, 0, 3, r, r, r, 1), GBG_E_ARGUMENT);
    assert_int_equal(gbg_trajectory_open(NULL, path, &other), GBG_E_ARGUMENT);
    gbg_trajectory_destroy(&t);
    assert_int_equal(gbg_trajectory_open(context, path, NULL), GBG_E_ARGUMENT);
    t = opened(path);
    /* a negative step: the last particle first in memory */
    made_good(context, gbg_trajectory_positions(t, 1, 3, r + 2, r + 5, r + 8, -1));
    assert_true(r[0] == 12.0 && r[2] == 10.0 && r[5] == 10.25);
    gbg_trajectory_destroy(&t);
    gbg_trajectory_destroy(&t);
    unlink(path);
}

static struct gbg_scene *scene_from(const char *path, int64_t frame, int n_species)
{
    struct gbg_scene *scene;
    made_good(context, gbg_scene_create(context, 3, &scene));
    for (int s = 0; s < n_species; s++) {
        char name[2] = {(char)('p' + s), 0};
        made_good(context, gbg_scene_add_species(scene, name, 0.1, 1, 1, -1, -1, NULL));
    }
    made_good(context, gbg_scene_set_text(scene, "particles.start.file", path));
    made_good(context, gbg_scene_set_integer(scene, "particles.start.frame", frame));
    return scene;
}

static void trajectories_are_starts(void **state)
{
    (void)state;
    struct foreign how = amber;
    const char *path = made_path("foreign.nc");
    memcpy(how.types, (int[]){1, 2, 1}, sizeof how.types);
    make(&how, path);
    for (int64_t frame = -1; frame < 2; frame++) {
        struct gbg_scene *scene = scene_from(path, frame, 2);
        made_good(context, gbg_io_read_start(scene));
        assert_int_equal(scene->arrays.n, 3);
        assert_true(scene->arrays.position[1][2] == (frame == 0 ? 2.25 : 12.25));
        assert_int_equal(scene->arrays.species[1], 1);
        assert_true(scene->length[2] == 20.0);
        gbg_scene_destroy(&scene);
    }
    struct gbg_scene *scene = scene_from(path, 2, 2);
    made_refused(context, gbg_io_read_start(scene), GBG_E_SCENE,
                 "frame 2 was asked for, and it has 2");
    gbg_scene_destroy(&scene);
    scene = scene_from(path, 0, 1);
    made_refused(context, gbg_io_read_start(scene), GBG_E_SCENE,
                 "species 2 (B), which the scene with its 1");
    assert_int_equal(scene->arrays.n, 0);
    gbg_scene_destroy(&scene);
    scene = scene_from(path, 0, 2);
    made_good(context, gbg_scene_set_box(scene, (double[]){5.0, 6.0, 7.0}, NULL));
    made_good(context, gbg_io_read_start(scene));
    assert_true(scene->length[2] == 7.0);
    gbg_scene_destroy(&scene);
    unlink(path);
}

/* Each byte of a file changed in several ways: an answer in every case, never a crash. */
static void damaged_files_get_an_answer(void **state)
{
    (void)state;
    static const unsigned char flips[] = {0x01, 0x80, 0xff, 0x10};
    const char *path = made_path("foreign.nc");
    int opens = 0, refusals = 0;
    make(&amber, path);
    int file = open(path, O_RDWR);
    int64_t size = lseek(file, 0, SEEK_END);
    for (int64_t at = 0; at < size; at++) {
        for (size_t k = 0; k < sizeof flips; k++) {
            unsigned char byte, other;
            struct gbg_trajectory *trajectory;
            assert_int_equal(gbg_file_read(file, &byte, 1, at), 0);
            other = byte ^ flips[k];
            assert_int_equal(gbg_file_write(file, &other, 1, at), 0);
            if (gbg_trajectory_open(context, path, &trajectory) == GBG_OK) {
                int64_t frames, n;
                double time, length[3], x[64], y[64], z[64];
                opens++;
                gbg_trajectory_size(trajectory, &frames, &n, NULL, NULL);
                assert_true(n <= 64);
                gbg_trajectory_frame(trajectory, 0, &time, NULL, length, NULL);
                gbg_trajectory_positions(trajectory, 0, n, x, y, z, 1);
                gbg_trajectory_destroy(&trajectory);
            } else {
                refusals++;
                assert_true(gbg_message(context)[0] != 0);
            }
            assert_int_equal(gbg_file_write(file, &byte, 1, at), 0);
        }
    }
    close(file);
    print_message("%d opened, %d refused\n", opens, refusals);
    assert_true(refusals > 100 && opens > 100);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(plain_files_get_defaults),
        cmocka_unit_test(types_and_radii_of_others),
        cmocka_unit_test(bad_coordinates_are_named),
        cmocka_unit_test(bad_boxes_are_refused),
        cmocka_unit_test(files_that_are_no_trajectories),
        cmocka_unit_test(bad_arguments_are_refused),
        cmocka_unit_test(trajectories_are_starts),
        cmocka_unit_test(damaged_files_get_an_answer),
    };
    return made_run(tests, "cpu:threads=1", &context);
}
