/* Tests of the transforms: against plain sums in long double, both ways and both precisions; the
 * same bits for any number of threads and for any plan made again; a cache that cannot be used. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/memory.h"
#include "core/random.h"
#include "fft/fft.h"
#include "gamboge/gamboge.h"

static const struct gbg_fft *fft;
static struct gbg_context *context;

static double uniform(int64_t i)
{
    struct gbg_philox w = gbg_philox(gbg_philox_counter(3, (uint64_t)i, GBG_STREAM_START), 5, 9);
    return 2.0 * gbg_uniform(w.word[0], w.word[1]) - 1.0;
}

static double at(const void *mesh, int single, int64_t i)
{
    return single ? (double)((const float *)mesh)[i] : ((const double *)mesh)[i];
}

static void *new_mesh(int dimension, const int32_t *cells, int single)
{
    void *mesh;
    assert_int_equal(gbg_allocate_zero(context, &mesh, gbg_fft_numbers(dimension, cells),
                                       single ? sizeof(float) : sizeof(double), "mesh"),
                     GBG_OK);
    return mesh;
}

static void fill(void *mesh, int dimension, const int32_t *cells, int single)
{
    int64_t rows = (int64_t)cells[1] * (dimension == 3 ? cells[2] : 1);
    for (int64_t r = 0; r < rows; r++) {
        for (int64_t x = 0; x < cells[0]; x++) {
            int64_t i = r * gbg_fft_pitch(cells) + x;
            if (single) {
                ((float *)mesh)[i] = (float)uniform(r * cells[0] + x);
            } else {
                ((double *)mesh)[i] = uniform(r * cells[0] + x);
            }
        }
    }
}

static struct gbg_fft_plan *planned(int dimension, const int32_t *cells, int single, int threads,
                                    int hurry)
{
    struct gbg_fft_plan *plan;
    assert_int_equal(fft->make(context, dimension, cells, single, threads, hurry, &plan), GBG_OK);
    return plan;
}

/* Wave n of the mesh by a plain sum. */
static long double complex plain(const void *mesh, int dimension, const int32_t *cells, int single,
                                 const int32_t n[3])
{
    const long double turn = 2.0L * acosl(-1.0L);
    int32_t deep = dimension == 3 ? cells[2] : 1;
    long double complex sum = 0.0L;
    for (int32_t z = 0; z < deep; z++) {
        for (int32_t y = 0; y < cells[1]; y++) {
            for (int32_t x = 0; x < cells[0]; x++) {
                long double phase = (long double)(n[0] * x % cells[0]) / cells[0] +
                                    (long double)(n[1] * y % cells[1]) / cells[1] +
                                    (long double)(n[2] * z % deep) / deep;
                int64_t i = ((int64_t)z * cells[1] + y) * gbg_fft_pitch(cells) + x;
                sum += (long double)at(mesh, single, i) * cexpl(-I * turn * phase);
            }
        }
    }
    return sum;
}

/* Largest differences, over the root of the number of cells, of forward from the plain sum in some
 * waves, and of the way forth and back from the mesh. */
static void errors(int dimension, const int32_t *cells, int single, int hurry, double worst[2])
{
    int64_t numbers = gbg_fft_numbers(dimension, cells), pitch = gbg_fft_pitch(cells);
    int64_t rows = numbers / pitch, count = rows * cells[0];
    void *mesh = new_mesh(dimension, cells, single), *copy = new_mesh(dimension, cells, single);
    fill(mesh, dimension, cells, single);
    fill(copy, dimension, cells, single);
    struct gbg_fft_plan *plan = planned(dimension, cells, single, 2, hurry);
    fft->forward(plan, mesh);
    int64_t waves = rows * (pitch / 2);
    for (int64_t w = 0; w < waves; w += 1 + waves / 60) {
        int64_t r = w / (pitch / 2);
        const int32_t n[3] = {(int32_t)(w % (pitch / 2)), (int32_t)(r % cells[1]),
                              (int32_t)(r / cells[1])};
        long double complex d = plain(copy, dimension, cells, single, n) - at(mesh, single, 2 * w) -
                                I * at(mesh, single, 2 * w + 1);
        worst[0] = fmax(worst[0], (double)cabsl(d) / sqrt((double)count));
    }
    fft->backward(plan, mesh);
    for (int64_t r = 0; r < rows; r++) {
        for (int64_t i = r * pitch; i < r * pitch + cells[0]; i++) {
            double d = at(mesh, single, i) / (double)count - at(copy, single, i);
            worst[1] = fmax(worst[1], fabs(d));
        }
    }
    fft->release(plan);
    gbg_release(mesh);
    gbg_release(copy);
}

static void transforms_are_those_of_a_plain_sum(void **state)
{
    (void)state;
    static const int32_t meshes[][3] = {{4, 4, 4},    {6, 10, 14}, {30, 4, 8},  {2, 2, 2},
                                        {126, 98, 6}, {64, 48, 4}, {48, 16, 20}};
    for (int single = 0; single < 2; single++) {
        double worst[2] = {0.0, 0.0};
        for (size_t m = 0; m < sizeof meshes / sizeof *meshes; m++) {
            for (int dimension = 2; dimension <= 3; dimension++) {
                for (int hurry = m < 3 ? 0 : 1; hurry < 2; hurry++) {
                    errors(dimension, meshes[m], single, hurry, worst);
                }
            }
        }
        print_message("%s: forward within %.2g of the RMS of a wave, forth and back within %.2g\n",
                      single ? "single" : "double", worst[0], worst[1]);
        assert_true(worst[0] < (single ? 2e-6 : 4e-15));
        assert_true(worst[1] < (single ? 1e-6 : 2e-15));
    }
}

/* Transforms a mesh forth and back; the bytes of both. */
static void *both_ways(const int32_t *cells, int single, int threads, int hurry, size_t *bytes)
{
    size_t size = (single ? sizeof(float) : sizeof(double)) * (size_t)gbg_fft_numbers(3, cells);
    void *mesh = new_mesh(3, cells, single);
    unsigned char *all = malloc(2 * size);
    fill(mesh, 3, cells, single);
    struct gbg_fft_plan *plan = planned(3, cells, single, threads, hurry);
    fft->forward(plan, mesh);
    memcpy(all, mesh, size);
    fft->backward(plan, mesh);
    memcpy(all + size, mesh, size);
    fft->release(plan);
    gbg_release(mesh);
    *bytes = 2 * size;
    return all;
}

static void bits_depend_neither_on_threads_nor_on_the_time_of_planning(void **state)
{
    (void)state;
    const int32_t cells[3] = {60, 42, 28};
    for (int k = 0; k < 4; k++) {
        size_t bytes;
        void *one = both_ways(cells, k % 2, 1, k / 2, &bytes);
        for (int threads = 1; threads <= 5; threads += 1 + threads / 3) {
            void *more = both_ways(cells, k % 2, threads, k / 2, &bytes);
            assert_memory_equal(one, more, bytes);
            free(more);
        }
        free(one);
    }
}

/* A cache with nonsense in it, one that is not a folder, none: plans are made all the same, and
 * where a file can be written there is a sound one afterwards. */
static void a_cache_that_cannot_be_used_is_no_error(void **state)
{
    (void)state;
    char folder[] = "/tmp/gbg_fft_XXXXXX", path[256], before[256];
    snprintf(before, sizeof before, "%s", getenv("XDG_CACHE_HOME") ? getenv("XDG_CACHE_HOME") : "");
    assert_non_null(mkdtemp(folder));
    const char *places[] = {folder, "/dev/null", "", "relative"};
    for (int k = 0; k < 4; k++) {
        const int32_t cells[3] = {70 + 14 * k, 36 + 6 * k, 2};
        double worst[2] = {0.0, 0.0};
        setenv("XDG_CACHE_HOME", places[k], 1);
        if (!places[k][0]) {
            unsetenv("XDG_CACHE_HOME");
            setenv("HOME", "/nonexistent", 1);
        }
        errors(2, cells, 1, 0, worst);
        assert_true(worst[0] < 2e-6);
    }
    int found = 0;
    for (int k = 0; k < 4; k++) {
        static const char *const hosts[] = {"generic", "avx2", "avx512", "any"};
        snprintf(path, sizeof path, "%s/gamboge/fftw-%s-single.wisdom", folder, hosts[k]);
        FILE *file = fopen(path, "r");
        if (file) {
            char start[16] = "";
            assert_non_null(fgets(start, sizeof start, file));
            assert_true(strncmp(start, "(fftw", 5) == 0);
            fclose(file);
            found++;
            unlink(path);
        }
    }
    assert_int_equal(found, 1);
    snprintf(path, sizeof path, "%s/gamboge", folder);
    rmdir(path);
    rmdir(folder);
    setenv("XDG_CACHE_HOME", before, 1);
}

static void failing_allocations_are_reported(void **state)
{
    (void)state;
    const int32_t cells[3] = {16, 16, 16};
    struct gbg_fft_plan *plan;
    for (int k = 1; k <= 2; k++) {
        gbg_memory_fail_after(k);
        assert_int_equal(fft->make(context, 3, cells, 1, 2, 1, &plan), GBG_E_MEMORY);
        assert_null(plan);
    }
    gbg_memory_fail_after(0);
}

int main(void)
{
    char folder[] = "/tmp/gbg_fft_cache_XXXXXX", remove[300];
    const char *why;
    if (!mkdtemp(folder)) {
        return 1;
    }
    setenv("XDG_CACHE_HOME", folder, 1);
    fft = gbg_fft_find(&why);
    if (!fft) {
        printf("skipped: %s\n", why);
        return 77;
    }
    if (gbg_context_create("cpu", &context) != GBG_OK) {
        return 1;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(transforms_are_those_of_a_plain_sum),
        cmocka_unit_test(bits_depend_neither_on_threads_nor_on_the_time_of_planning),
        cmocka_unit_test(a_cache_that_cannot_be_used_is_no_error),
        cmocka_unit_test(failing_allocations_are_reported),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    gbg_context_destroy(&context);
    snprintf(remove, sizeof remove, "rm -rf %s", folder);
    return system(remove) != 0 ? 1 : failed;
}
