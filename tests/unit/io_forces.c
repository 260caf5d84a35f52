/* Tests of the file of forces. */
#include <math.h>

#include <netcdf.h>

#include "core/memory.h"
#include "io_made.h"

enum { N = 9 };
static struct gbg_context *context;

static void good(int code)
{
    if (code != NC_NOERR) {
        fail_msg("%s", nc_strerror(code));
    }
}

/* N particles far apart by place and with ids against the order; two forces.
 */
static struct gbg_engine *engine_with(int dimension, int n, int64_t largest_id)
{
    struct gbg_scene *scene;
    struct gbg_engine *engine;
    static const double length[3] = {20.0, 30.0, 25.0};
    made_good(context, gbg_scene_create(context, dimension, &scene));
    made_good(context, gbg_scene_set_box(scene, length, NULL));
    made_good(context, gbg_scene_add_species(scene, "A", 1, -1, 1, -1, n ? -1 : 0, NULL));
    made_good(context, gbg_scene_add_species(scene, "B", 1, 2, -2, -1, n ? -1 : 0, NULL));
    made_good(context, gbg_scene_add_force(scene, 2, "minimum_image", 0, 0));
    made_good(context, gbg_scene_add_force(scene, 6, "cutoff", 4.5, 0));
    for (int i = 0; i < n; i++) {
        double r[3] = {1.0 + 2.1 * i, 0.5 + 7.3 * (i % 4), 3.0 * i};
        int32_t species = i % 2;
        int64_t id = i == 0 ? largest_id : N - i;
        made_good(context,
                  gbg_scene_add_particles(scene, 1, &r[0], &r[1], dimension == 3 ? &r[2] : NULL, 1,
                                          &species, 0, &id));
    }
    if (n == 0) {
        made_good(context, gbg_scene_set_text(scene, "particles.start.random", "insertion"));
    }
    made_good(context, gbg_engine_create(scene, &engine));
    gbg_scene_destroy(&scene);
    return engine;
}

static void get(int file, const char *name, double *values)
{
    int id;
    good(nc_inq_varid(file, name, &id));
    good(nc_get_var_double(file, id, values));
}

static void check_file(const char *path, struct gbg_engine *engine, int64_t largest_id)
{
    int file, dimension = engine->state.box.dimension, format;
    double force[3][N], place[3][N], stored[3 * N], others[3 * N], ids[N], kinds[N], samples;
    int32_t species[N];
    int64_t id[N];
    char text[128] = "";
    good(nc_open(path, NC_NOWRITE, &file));
    good(nc_inq_format(file, &format));
    assert_int_equal(format, NC_FORMAT_64BIT_OFFSET);
    made_good(context, gbg_engine_forces(engine, N, force[0], force[1], force[2], 1));
    made_good(context, gbg_engine_positions(engine, 1, N, place[0], place[1], place[2], 1));
    made_good(context, gbg_engine_species(engine, N, species, 1));
    made_good(context, gbg_engine_ids(engine, N, id));
    get(file, "forces", stored);
    get(file, "positions", others);
    get(file, "id", ids);
    get(file, "species", kinds);
    for (int i = 0; i < N; i++) { /* the file lists them by id: 1 to N-1, then the largest */
        int k = i == 0 ? N - 1 : N - i - 1;
        assert_true(ids[k] == (double)id[i]);
        assert_true(kinds[k] == species[i]);
        for (int a = 0; a < dimension; a++) {
            assert_true(stored[dimension * k + a] == force[a][i]);
            assert_true(others[dimension * k + a] == place[a][i]);
        }
    }
    assert_true(ids[N - 1] == (double)largest_id);
    good(nc_get_att_text(file, NC_GLOBAL, "force_1", text));
    assert_string_equal(text, "power 2, sum minimum_image");
    memset(text, 0, sizeof text);
    good(nc_get_att_text(file, NC_GLOBAL, "force_2", text));
    assert_string_equal(text, "power 6, sum cutoff, cutoff 4.5");
    good(nc_get_att_double(file, NC_GLOBAL, "error_samples", &samples));
    good(nc_get_att_double(file, NC_GLOBAL, "error_rms_over_rms", &samples));
    assert_true(samples >= 0.0 && samples < 1e-3);
    good(nc_close(file));
}

static void forces_come_back(void **state)
{
    (void)state;
    const char *path = made_path("f.nc");
    static const int64_t largest[2] = {100, INT64_C(100000000000)};
    for (int set = 0; set < 4; set++) {
        struct gbg_engine *engine = engine_with(2 + (set & 1), N, largest[set >> 1]);
        made_good(context, gbg_engine_write_forces(engine, path));
        check_file(path, engine, largest[set >> 1]);
        gbg_engine_destroy(&engine);
    }
    unlink(path);
}

static void refusals_leave_no_file(void **state)
{
    (void)state;
    const char *path = made_path("f.nc");
    int status, failures = 0;
    struct gbg_engine *engine = engine_with(2, 0, 0);
    made_refused(context, gbg_engine_write_forces(engine, path), GBG_E_SCENE, "no particle");
    gbg_engine_destroy(&engine);
    engine = engine_with(2, N, 100);
    assert_int_equal(gbg_engine_write_forces(NULL, path), GBG_E_ARGUMENT);
    made_refused(context, gbg_engine_write_forces(engine, NULL), GBG_E_ARGUMENT,
                 "gbg_engine_write_forces: path is NULL");
    made_refused(context, gbg_engine_write_forces(engine, made_path("none/f.nc")), GBG_E_FILE,
                 "No such file");
    for (int64_t n = 1;; n++) {
        gbg_memory_fail_after(n);
        status = gbg_engine_write_forces(engine, path);
        gbg_memory_fail_after(0);
        if (status == GBG_OK) {
            break;
        }
        failures++;
        assert_int_equal(status, GBG_E_MEMORY);
        assert_int_equal(access(path, F_OK), -1);
    }
    assert_true(failures >= 4);
    gbg_engine_destroy(&engine);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(forces_come_back),
        cmocka_unit_test(refusals_leave_no_file),
    };
    return made_run(tests, "cpu:threads=1", &context);
}
