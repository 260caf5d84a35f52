/* Tests of c/io/analysis_file.c: the file read back through netCDF's own library and by ncdump. */
#include "analysis_help.h"

#include <netcdf.h>
#include <unistd.h>

static struct points points;
static const double box[3] = {12, 9, 10};
static const char path[] = "unit_analysis_file.nc";

static struct gbg_analysis *analyse(struct gbg_context *context, int dimension, int partials,
                                    int frames)
{
    struct gbg_analysis *a;
    MUST(context, gbg_analysis_create(context, dimension, box, 4, &a));
    MUST(context, gbg_analysis_set_text(a, "partials", partials ? "yes" : "no"));
    MUST(context, gbg_analysis_set_species_name(a, 0, "colloid"));
    MUST(context, gbg_analysis_set_attribute(a, "title", "a test"));
    MUST(context, gbg_analysis_set_attribute(a, "title", "another test"));
    MUST(context, gbg_analysis_set_attribute(a, "input_sha256", "00ff"));
    for (int f = 0; f < frames; f++) {
        fill_uniform(&points, 300, 20 + (uint64_t)f, box);
        MUST(context, gbg_analysis_add_frame(a, points.n, points.x[0], points.x[1], points.x[2], 1,
                                             points.species, 0, NULL, 1e-6));
    }
    return a;
}

static void read_values(int file, const char *name, double *value)
{
    int id;
    assert_int_equal(nc_inq_varid(file, name, &id), NC_NOERR);
    assert_int_equal(nc_get_var_double(file, id, value), NC_NOERR);
}

static void must_have_text(int file, const char *variable, const char *name, const char *expected)
{
    int id = NC_GLOBAL;
    char text[512] = "";
    size_t length;
    if (variable) {
        assert_int_equal(nc_inq_varid(file, variable, &id), NC_NOERR);
    }
    assert_int_equal(nc_inq_attlen(file, id, name, &length), NC_NOERR);
    assert_true(length < sizeof text);
    assert_int_equal(nc_get_att_text(file, id, name, text), NC_NOERR);
    if (!strstr(text, expected)) {
        fail_msg("%s: \"%s\" lacks \"%s\"", name, text, expected);
    }
}

static double number(int file, const char *name)
{
    double value = NAN;
    assert_int_equal(nc_get_att_double(file, NC_GLOBAL, name, &value), NC_NOERR);
    return value;
}

/* Equal bit for bit, NaN included. */
static void must_equal(const double *a, const double *b, int64_t n)
{
    assert_memory_equal(a, b, (size_t)n * sizeof *a);
}

static void check_totals(int file, struct gbg_analysis *a)
{
    static const char *const both[] = {
        "k", "n_modes", "S", "S_stderr", "S_numerr", "S_numerr_typ", "S_storage_err"};
    static double from_file[2 * HELP_MOST], from_call[HELP_MOST];
    int64_t shells = a->shells.count;
    for (int i = 0; i < 7; i++) {
        read_values(file, both[i], from_file);
        MUST(a->context, gbg_analysis_get(a, both[i], HELP_MOST, from_call));
        must_equal(from_file, from_call, shells);
    }
    read_values(file, "k_bounds", from_file);
    MUST(a->context, gbg_analysis_get(a, "k_high", HELP_MOST, from_call));
    for (int64_t s = 0; s < shells; s++) {
        assert_true(from_file[2 * s + 1] == from_call[s]);
    }
    read_values(file, "box_lengths", from_file);
    must_equal(from_file, box, a->dimension);
    read_values(file, "n_particles", from_file);
    assert_true(from_file[0] == 100 && from_file[2] == 100 && from_file[3] == 0);
}

static void check_pairs(int file, struct gbg_analysis *a)
{
    static double value[10 * HELP_MOST], error[10 * HELP_MOST], types[20], one[2][HELP_MOST];
    int64_t shells = a->shells.count;
    read_values(file, "S_partial", value);
    read_values(file, "S_partial_stderr", error);
    read_values(file, "pair_types", types);
    for (int i = 0, pair = 0; i < 4; i++) {
        for (int j = i; j < 4; j++, pair++) {
            assert_true(types[2 * pair] == i && types[2 * pair + 1] == j);
            MUST(a->context, gbg_analysis_get_partial(a, i, j, HELP_MOST, one[0], one[1]));
            for (int64_t s = 0; s < shells; s++) {
                double v = value[pair * shells + s], e = error[pair * shells + s];
                assert_true(v == one[0][s] || (j == 3 && isnan(v) && isnan(one[0][s])));
                assert_true(e == one[1][s] || (j == 3 && isnan(e) && isnan(one[1][s])));
            }
        }
    }
    must_have_text(file, "S_partial", "convention", "Ashcroft-Langreth");
}

static void file_holds_what_the_calls_return(void **state)
{
    (void)state;
    struct gbg_context *c = context_of("cpu");
    for (int i = 0; i < 4; i++) {
        int file, frames = i < 2 ? 3 : 20;
        struct gbg_analysis *a = analyse(c, 2 + i % 2, i % 2, frames);
        char name[4][32];
        MUST(c, gbg_analysis_write(a, path));
        assert_int_equal(nc_open(path, NC_NOWRITE, &file), NC_NOERR);
        check_totals(file, a);
        if (i % 2) {
            check_pairs(file, a);
        }
        must_have_text(file, NULL, "Conventions", "CF-1.10");
        must_have_text(file, NULL, "title", "another test");
        must_have_text(file, NULL, "input_sha256", "00ff");
        must_have_text(file, NULL, "source", "gamboge");
        must_have_text(file, NULL, "estimator", "bound");
        must_have_text(file, "k", "units", "sigma-1");
        must_have_text(file, "k", "bounds", "k_bounds");
        must_have_text(file, "S", "cell_methods", "frame: mean k: mean");
        must_have_text(file, "S_stderr", "method", frames == 3 ? "too few frames" : "blocking");
        assert_true(number(file, "k0_in_shells") == 0 && number(file, "k0_value") == 300);
        assert_true(number(file, "frames_used") == frames);
        assert_true(number(file, "tolerance") == 1e-6);
        assert_true(number(file, "n_effective") > 0 && number(file, "n_effective") < 40);
        int id;
        assert_int_equal(nc_inq_varid(file, "type_name", &id), NC_NOERR);
        assert_int_equal(nc_get_var_text(file, id, name[0]), NC_NOERR);
        assert_string_equal(name[0], "colloid");
        assert_string_equal(name[1], "B");
        nc_close(file);
        gbg_analysis_destroy(&a);
    }
    gbg_context_destroy(&c);
}

static void ncdump_reads_it(void **state)
{
    (void)state;
    char command[256];
    snprintf(command, sizeof command,
             "command -v ncdump > /dev/null || exit 77; ncdump %s > %s.txt 2> %s.err && test ! -s "
             "%s.err && grep -q 'double S(k)' %s.txt",
             path, path, path, path, path);
    int status = system(command);
    assert_true(status != -1);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 77) {
        print_message("ncdump is not installed: not tried\n");
        return;
    }
    assert_int_equal(status, 0);
}

/* A failed write leaves the file that was there, and no rubbish beside it. */
static void failed_writes_replace_nothing(void **state)
{
    (void)state;
    struct gbg_context *c = context_of("cpu");
    struct gbg_analysis *a = analyse(c, 2, 0, 1);
    int64_t size = 0;
    MUST_FAIL(c, GBG_E_FILE,
              "gbg_analysis_write: ", gbg_analysis_write(a, "no_such_directory/S.nc"));
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    size = ftell(file);
    fclose(file);
    assert_true(size > 1000);
    assert_int_equal(system("ls unit_analysis_file.nc.* 2> /dev/null | grep -v 'txt\\|err' > left"),
                     256);
    gbg_analysis_destroy(&a);
    gbg_context_destroy(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(file_holds_what_the_calls_return),
        cmocka_unit_test(ncdump_reads_it),
        cmocka_unit_test(failed_writes_replace_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
