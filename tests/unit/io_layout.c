/* Tests of c/io/classic: where the data of a classic netCDF file lie, against netCDF's library. */
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <netcdf.h>

#include "core/file.h"
#include "io/classic.h"

static char path[] = "/tmp/gbg_layout_XXXXXX";

static void good(int code)
{
    if (code != NC_NOERR) {
        fail_msg("%s", nc_strerror(code));
    }
}

/* Fixed variables fa(n) short and fb(7) char, record variables as asked for, `frames` records. The
 * values are 1000 times the number of the variable, plus 100 times the frame, plus the index. */
struct shape {
    int format, n, frames;
    int a, b, c; /* record variables: a(frame,n) short, b(frame) double, c(frame,n) char */
};

static void put_record_variable(int file, int id, int scale, int rank, int n, int frames)
{
    for (size_t f = 0; f < (size_t)frames; f++) {
        for (size_t i = 0; i < (size_t)(rank == 2 ? n : 1); i++) {
            size_t at[2] = {f, i};
            double value = 1000.0 * scale + 100.0 * (double)f + (double)i;
            char letter = (char)('a' + (int)f + (int)i);
            good(scale == 3 ? nc_put_var1_text(file, id, at, &letter)
                            : nc_put_var1_double(file, id, at, &value));
        }
    }
}

static void make(const struct shape *shape)
{
    int file, frame, atom, seven, fa, fb, id[3], dims[2];
    good(nc_create(path, NC_CLOBBER | shape->format, &file));
    good(nc_def_dim(file, "frame", NC_UNLIMITED, &frame));
    good(nc_def_dim(file, "atom", (size_t)shape->n, &atom));
    good(nc_def_dim(file, "seven", 7, &seven));
    good(nc_put_att_text(file, NC_GLOBAL, "odd", 5, "12345"));
    good(nc_def_var(file, "fa", NC_SHORT, 1, &atom, &fa));
    good(nc_def_var(file, "fb", NC_CHAR, 1, &seven, &fb));
    good(nc_put_att_double(file, fa, "half", NC_DOUBLE, 1, (double[]){0.5}));
    dims[0] = frame;
    dims[1] = atom;
    if (shape->a) {
        good(nc_def_var(file, "a", NC_SHORT, 2, dims, &id[0]));
    }
    if (shape->b) {
        good(nc_def_var(file, "b", NC_DOUBLE, 1, dims, &id[1]));
    }
    if (shape->c) {
        good(nc_def_var(file, "c", NC_CHAR, 2, dims, &id[2]));
    }
    good(nc_enddef(file));
    good(nc_put_var_text(file, fb, "sevenup"));
    int present[3] = {shape->a, shape->b, shape->c};
    for (int v = 0; v < 3; v++) {
        if (present[v]) {
            put_record_variable(file, id[v], v + 1, v == 1 ? 1 : 2, shape->n, shape->frames);
        }
    }
    good(nc_close(file));
}

static int64_t big_endian(int file, int64_t offset, int bytes)
{
    unsigned char raw[8];
    assert_int_equal(gbg_file_read(file, raw, (size_t)bytes, offset), 0);
    uint64_t value = 0;
    for (int k = 0; k < bytes; k++) {
        value = value << 8 | raw[k];
    }
    return (int64_t)value;
}

static void check_values(int file, const struct gbg_classic *header,
                         const struct gbg_classic_variable *wanted, const struct shape *shape)
{
    for (int f = 0; f < shape->frames; f++) {
        for (int i = 0; i < shape->n && shape->a; i++) {
            int64_t at = gbg_classic_offset(header, &wanted[0], f) + 2 * i;
            assert_int_equal(big_endian(file, at, 2), 1000 + 100 * f + i);
        }
        if (shape->b) {
            int64_t bits = big_endian(file, gbg_classic_offset(header, &wanted[1], f), 8);
            double value;
            memcpy(&value, &bits, sizeof value);
            assert_true(value == 2000.0 + 100.0 * f);
        }
        for (int i = 0; i < shape->n && shape->c; i++) {
            int64_t at = gbg_classic_offset(header, &wanted[2], f) + i;
            assert_int_equal(big_endian(file, at, 1), 'a' + f + i);
        }
    }
}

static void check_shape(const struct shape *shape)
{
    struct gbg_classic header;
    struct gbg_classic_variable wanted[4] = {
        {.name = "a"}, {.name = "b"}, {.name = "c"}, {.name = "fb"}};
    make(shape);
    int file = open(path, O_RDONLY);
    assert_true(file >= 0);
    assert_null(gbg_classic_read(file, &header, wanted, 4));
    assert_int_equal(header.frames, shape->frames);
    assert_int_equal(wanted[0].found, shape->a);
    assert_int_equal(wanted[1].found, shape->b);
    assert_int_equal(wanted[2].found, shape->c);
    assert_int_equal(big_endian(file, wanted[3].begin, 7), INT64_C(0x736576656e7570));
    assert_true(header.size >= header.needed);
    check_values(file, &header, wanted, shape);
    close(file);
}

static void offsets_are_those_of_the_library(void **state)
{
    (void)state;
    static const int format[3] = {0, NC_64BIT_OFFSET, NC_64BIT_DATA};
    for (int k = 0; k < 3; k++) {
        for (int n = 1; n <= 6; n++) {
            for (int set = 1; set < 8; set++) {
                struct shape shape = {format[k], n, 3, set & 1, set >> 1 & 1, set >> 2 & 1};
                check_shape(&shape);
            }
        }
        check_shape(&(struct shape){format[k], 5, 0, 1, 1, 1});
    }
}

static const char *defect_of_file(void)
{
    struct gbg_classic header;
    int file = open(path, O_RDONLY);
    const char *defect = gbg_classic_read(file, &header, NULL, 0);
    int cut = !defect && header.size < header.needed;
    close(file);
    return cut ? "cut" : defect;
}

static void every_cut_is_noticed(void **state)
{
    (void)state;
    make(&(struct shape){NC_64BIT_OFFSET, 5, 3, 1, 1, 0});
    int file = open(path, O_RDWR);
    int64_t size = lseek(file, 0, SEEK_END);
    struct gbg_classic header;
    assert_null(gbg_classic_read(file, &header, NULL, 0));
    assert_int_equal(header.needed, size);
    for (int64_t bytes = size - 1; bytes >= 0; bytes--) {
        assert_int_equal(ftruncate(file, bytes), 0);
        assert_non_null(defect_of_file());
    }
    close(file);
}

/* Each byte of the header set to several values: an answer in every case, none of them a crash. */
static void damaged_headers_get_an_answer(void **state)
{
    (void)state;
    static const unsigned char values[] = {0x00, 0x01, 0x0a, 0x7f, 0x80, 0xff};
    static const int format[3] = {0, NC_64BIT_OFFSET, NC_64BIT_DATA};
    for (int k = 0; k < 3; k++) {
        make(&(struct shape){format[k], 5, 3, 1, 1, 1});
        int file = open(path, O_RDWR), defects = 0;
        for (int at = 0; at < 300; at++) {
            unsigned char old;
            assert_int_equal(gbg_file_read(file, &old, 1, at), 0);
            for (size_t v = 0; v < sizeof values; v++) {
                assert_int_equal(gbg_file_write(file, &values[v], 1, at), 0);
                defects += defect_of_file() != NULL;
            }
            assert_int_equal(gbg_file_write(file, &old, 1, at), 0);
        }
        assert_null(defect_of_file());
        assert_true(defects > 300);
        close(file);
    }
}

/* Frame 3e6 of records of 2,400,060 bytes lies beyond 7e12: far outside 32 bits, exact here. */
static void offsets_need_64_bits(void **state)
{
    (void)state;
    struct gbg_classic header = {.record = 2400060};
    struct gbg_classic_variable variable = {.begin = 2148};
    assert_true(gbg_classic_offset(&header, &variable, 3000000) == INT64_C(7200180002148));
    assert_true(gbg_classic_offset(&header, &variable, INT64_C(0xfffffffd)) ==
                INT64_C(10308179201239728));
}

static int start(void **state)
{
    (void)state;
    int file = mkstemp(path);
    return file < 0 ? -1 : close(file);
}

static int stop(void **state)
{
    (void)state;
    return unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(offsets_are_those_of_the_library),
        cmocka_unit_test(every_cut_is_noticed),
        cmocka_unit_test(damaged_headers_get_an_answer),
        cmocka_unit_test(offsets_need_64_bits),
    };
    return cmocka_run_group_tests(tests, start, stop);
}
