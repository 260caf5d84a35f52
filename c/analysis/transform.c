/* Analysis room: the pruned transform, as batches of one-dimensional transforms by FFTW. */
#include "analysis/transform.h"

#include <complex.h>
#include <fftw3.h>
#include <string.h>

#ifdef _OPENMP
#include <omp.h>
#endif

#include "core/context.h"
#include "core/memory.h"
#include "core/planner.h"

enum { LINES = 8 }; /* lines along axis 1 or 2 that are transformed together */

struct gbg_transform {
    int dimension, threads;
    int32_t cells[3], reach[3];
    int64_t pitch; /* complex numbers */
    double *mesh;
    fftw_complex *work; /* threads * work_size */
    int64_t work_size;
    fftw_plan row, lines[3]; /* lines[1], lines[2]: LINES transforms, interleaved */
};

int64_t gbg_transform_pitch(int32_t cells)
{
    return 2 * (((int64_t)cells / 2 + LINES) / LINES * LINES);
}

static int plan(struct gbg_context *context, struct gbg_transform *transform)
{
    int missing = 0;
    gbg_planner_lock();
    transform->row = fftw_plan_dft_r2c_1d(transform->cells[0], transform->mesh,
                                          (fftw_complex *)transform->mesh, FFTW_ESTIMATE);
    missing |= !transform->row;
    for (int a = 1; a < transform->dimension; a++) {
        int n = transform->cells[a];
        transform->lines[a] =
            fftw_plan_many_dft(1, &n, LINES, transform->work, NULL, LINES, 1, transform->work, NULL,
                               LINES, 1, FFTW_FORWARD, FFTW_ESTIMATE);
        missing |= !transform->lines[a];
    }
    gbg_planner_unlock();
    return missing ? gbg_fail(context, GBG_E_INTERNAL, "structure factor: FFTW has no plan")
                   : GBG_OK;
}

int gbg_transform_make(struct gbg_context *context, int dimension, const int32_t *cells,
                       const int32_t *reach, double *mesh, struct gbg_transform **transform)
{
    void *body, *work;
    *transform = NULL;
    int status = gbg_allocate_zero(context, &body, 1, sizeof **transform, "Fourier transform");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_transform *made = body;
    made->dimension = dimension;
    made->threads = context->threads;
    made->mesh = mesh;
    made->pitch = gbg_transform_pitch(cells[0]) / 2;
    for (int a = 0; a < 3; a++) {
        made->cells[a] = a < dimension ? cells[a] : 1;
        made->reach[a] = a < dimension ? reach[a] : 0;
    }
    int32_t longest = made->cells[1] > made->cells[2] ? made->cells[1] : made->cells[2];
    made->work_size = (int64_t)longest * LINES;
    status = gbg_allocate_zero(context, &work, made->threads * made->work_size,
                               sizeof(fftw_complex), "lines of the Fourier transform");
    made->work = work;
    if (status == GBG_OK) {
        status = plan(context, made);
    }
    if (status != GBG_OK) {
        gbg_transform_free(made);
        return status;
    }
    *transform = made;
    return GBG_OK;
}

void gbg_transform_free(struct gbg_transform *transform)
{
    if (!transform) {
        return;
    }
    gbg_planner_lock();
    fftw_plan plans[] = {transform->row, transform->lines[1], transform->lines[2]};
    for (int i = 0; i < 3; i++) {
        if (plans[i]) {
            fftw_destroy_plan(plans[i]);
        }
    }
    gbg_planner_unlock();
    gbg_release(transform->work);
    gbg_release(transform);
}

static fftw_complex *work_of_thread(const struct gbg_transform *transform)
{
#ifdef _OPENMP
    return transform->work + omp_get_thread_num() * transform->work_size;
#else
    return transform->work;
#endif
}

static void copy_line(fftw_complex *to, const fftw_complex *from)
{
    memcpy(to, from, LINES * sizeof *to);
}

/* LINES neighbouring lines along axis a, `stride` complex numbers from node to node; the kept modes
 * go back to the mesh. */
static void transform_lines(const struct gbg_transform *transform, int a, fftw_complex *first,
                            int64_t stride)
{
    fftw_complex *work = work_of_thread(transform);
    const int64_t cells = transform->cells[a], reach = transform->reach[a];
    for (int64_t i = 0; i < cells; i++) {
        copy_line(work + i * LINES, first + i * stride);
    }
    fftw_execute_dft(transform->lines[a], work, work);
    for (int64_t i = 0; i <= reach; i++) {
        copy_line(first + i * stride, work + i * LINES);
    }
    for (int64_t i = cells - reach; i < cells; i++) {
        copy_line(first + i * stride, work + i * LINES);
    }
}

static void transform_rows(const struct gbg_transform *transform)
{
    int64_t rows = (int64_t)transform->cells[1] * transform->cells[2];
    int64_t pitch = transform->pitch;
#pragma omp parallel for num_threads(transform->threads) schedule(static)
    for (int64_t r = 0; r < rows; r++) {
        double *row = transform->mesh + 2 * r * pitch;
        fftw_execute_dft_r2c(transform->row, row, (fftw_complex *)row);
    }
}

static void transform_axis_1(const struct gbg_transform *transform)
{
    fftw_complex *mesh = (fftw_complex *)transform->mesh;
    int64_t blocks = transform->reach[0] / LINES + 1, pitch = transform->pitch;
    int64_t plane = pitch * transform->cells[1], jobs = blocks * transform->cells[2];
#pragma omp parallel for num_threads(transform->threads) schedule(static)
    for (int64_t j = 0; j < jobs; j++) {
        transform_lines(transform, 1, mesh + j / blocks * plane + j % blocks * LINES, pitch);
    }
}

static void transform_axis_2(const struct gbg_transform *transform)
{
    fftw_complex *mesh = (fftw_complex *)transform->mesh;
    int64_t blocks = transform->reach[0] / LINES + 1, pitch = transform->pitch;
    int64_t plane = pitch * transform->cells[1], reach = transform->reach[1];
    int64_t jobs = blocks * (2 * reach + 1);
#pragma omp parallel for num_threads(transform->threads) schedule(static)
    for (int64_t j = 0; j < jobs; j++) {
        int64_t n1 = j / blocks - reach;
        int64_t row = n1 < 0 ? n1 + transform->cells[1] : n1;
        transform_lines(transform, 2, mesh + row * pitch + j % blocks * LINES, plane);
    }
}

void gbg_transform_run(const struct gbg_transform *transform)
{
    transform_rows(transform);
    transform_axis_1(transform);
    if (transform->dimension == 3) {
        transform_axis_2(transform);
    }
}
