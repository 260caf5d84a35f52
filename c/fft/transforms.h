/* Transforms by FFTW in one precision: included with GBG_REAL, a precision's number,
 * GBG_FFTW(name), its function or type of FFTW, and GBG_TABLE, the name of the table. */
#include "fft/body.h"

#include <complex.h>
#include <fftw3.h>
#include <stdlib.h>
#include <string.h>

#ifdef _OPENMP
#include <omp.h>
#endif

#define COMPLEX GBG_FFTW(complex)
#define PLAN GBG_FFTW(plan)

enum { LINES = GBG_FFT_LINES };

static int make_plans(struct gbg_fft_plan *plan, unsigned flags)
{
    static const int sign[2] = {FFTW_FORWARD, FFTW_BACKWARD};
    COMPLEX *work = plan->work;
    int missing = 0;
    for (int way = 0; way < 2; way++) {
        plan->row[way] = GBG_FFTW(plan_dft_1d)(plan->cells[0], work, work + plan->work_size / 2,
                                               sign[way], flags);
        missing |= !plan->row[way];
        for (int a = 1; a < plan->dimension; a++) {
            int n = plan->cells[a];
            plan->lines[a][way] = GBG_FFTW(plan_many_dft)(1, &n, LINES, work, NULL, LINES, 1, work,
                                                          NULL, LINES, 1, sign[way], flags);
            missing |= !plan->lines[a][way];
        }
    }
    return missing;
}

static void destroy(void **plan)
{
    if (*plan) {
        GBG_FFTW(destroy_plan)(*plan);
    }
    *plan = NULL;
}

static void forget_plans(struct gbg_fft_plan *plan)
{
    for (int way = 0; way < 2; way++) {
        destroy(&plan->row[way]);
        destroy(&plan->lines[1][way]);
        destroy(&plan->lines[2][way]);
    }
}

static COMPLEX *work_of_thread(const struct gbg_fft_plan *plan)
{
#ifdef _OPENMP
    return (COMPLEX *)plan->work + omp_get_thread_num() * plan->work_size;
#else
    return plan->work;
#endif
}

/* Two rows are the real and the imaginary part of one complex line z, whose transform Z holds
 * theirs: A(k) = (Z(k) + Z*(-k))/2, B(k) = (Z(k) - Z*(-k))/2i. */
static void forward_rows(const struct gbg_fft_plan *plan, GBG_REAL *a, GBG_REAL *b)
{
    GBG_REAL *z = (GBG_REAL *)work_of_thread(plan), *w = z + plan->work_size;
    const int64_t n = plan->cells[0];
    for (int64_t i = 0; i < n; i++) {
        z[2 * i] = a[i];
        z[2 * i + 1] = b[i];
    }
    GBG_FFTW(execute_dft)((PLAN)plan->row[0], (COMPLEX *)z, (COMPLEX *)w);
    w[2 * n] = w[0]; /* wave n is wave 0 */
    w[2 * n + 1] = w[1];
    const GBG_REAL half = (GBG_REAL)0.5;
#pragma omp simd
    for (int64_t k = 0; k <= n / 2; k++) {
        GBG_REAL re = w[2 * k], im = w[2 * k + 1];
        GBG_REAL other_re = w[2 * (n - k)], other_im = w[2 * (n - k) + 1];
        a[2 * k] = half * (re + other_re);
        a[2 * k + 1] = half * (im - other_im);
        b[2 * k] = half * (im + other_im);
        b[2 * k + 1] = half * (other_re - re);
    }
}

/* The other way: Z(k) = A(k) + i B(k), Z(-k) = A*(k) + i B*(k). Imaginary parts of waves 0 and n/2,
 * which no real row has, are not read. */
static void backward_rows(const struct gbg_fft_plan *plan, GBG_REAL *a, GBG_REAL *b)
{
    GBG_REAL *w = (GBG_REAL *)work_of_thread(plan), *z = w + plan->work_size;
    const int64_t n = plan->cells[0];
#pragma omp simd
    for (int64_t k = 1; k < n / 2; k++) {
        w[2 * k] = a[2 * k] - b[2 * k + 1];
        w[2 * k + 1] = a[2 * k + 1] + b[2 * k];
        w[2 * (n - k)] = a[2 * k] + b[2 * k + 1];
        w[2 * (n - k) + 1] = b[2 * k] - a[2 * k + 1];
    }
    w[0] = a[0];
    w[1] = b[0];
    w[n] = a[n];
    w[n + 1] = b[n];
    GBG_FFTW(execute_dft)((PLAN)plan->row[1], (COMPLEX *)w, (COMPLEX *)z);
    for (int64_t i = 0; i < n; i++) {
        a[i] = z[2 * i];
        b[i] = z[2 * i + 1];
    }
}

/* Rows come in twos: all numbers of cells are even. */
static void all_rows(const struct gbg_fft_plan *plan, GBG_REAL *mesh, int way)
{
    int64_t pitch = 2 * plan->pitch;
#pragma omp parallel for num_threads(plan->threads) schedule(static)
    for (int64_t r = 0; r < plan->rows; r += 2) {
        GBG_REAL *row = mesh + r * pitch;
        (way ? backward_rows : forward_rows)(plan, row, row + pitch);
    }
}

/* `count` neighbouring lines along axis a, `stride` complex numbers from node to node. */
static void some_lines(const struct gbg_fft_plan *plan, int a, int way, COMPLEX *first,
                       int64_t stride, int64_t count)
{
    COMPLEX *work = work_of_thread(plan);
    const int64_t cells = plan->cells[a];
    if (count < LINES) {
        memset(work, 0, (size_t)(cells * LINES) * sizeof *work);
        for (int64_t i = 0; i < cells; i++) {
            memcpy(work + i * LINES, first + i * stride, (size_t)count * sizeof *work);
        }
    } else {
        for (int64_t i = 0; i < cells; i++) {
            memcpy(work + i * LINES, first + i * stride, LINES * sizeof *work);
        }
    }
    GBG_FFTW(execute_dft)((PLAN)plan->lines[a][way], work, work);
    for (int64_t i = 0; i < cells; i++) {
        memcpy(first + i * stride, work + i * LINES,
               (size_t)(count < LINES ? count : LINES) * sizeof *work);
    }
}

/* All lines along axis 1 or 2: groups of them in every row of the other axis. */
static void all_lines(const struct gbg_fft_plan *plan, int a, int way, COMPLEX *mesh)
{
    int64_t pitch = plan->pitch, plane = pitch * plan->cells[1];
    int64_t groups = (pitch + LINES - 1) / LINES, others = plan->cells[3 - a];
    int64_t stride = a == 1 ? pitch : plane, other_stride = a == 1 ? plane : pitch;
#pragma omp parallel for num_threads(plan->threads) schedule(static)
    for (int64_t j = 0; j < groups * others; j++) {
        int64_t first = j % groups * LINES;
        some_lines(plan, a, way, mesh + j / groups * other_stride + first, stride, pitch - first);
    }
}

static void forward(const struct gbg_fft_plan *plan, void *mesh)
{
    all_rows(plan, mesh, 0);
    for (int a = 1; a < plan->dimension; a++) {
        all_lines(plan, a, 0, mesh);
    }
}

static void backward(const struct gbg_fft_plan *plan, void *mesh)
{
    for (int a = plan->dimension - 1; a > 0; a--) {
        all_lines(plan, a, 1, mesh);
    }
    all_rows(plan, mesh, 1);
}

const struct gbg_fft_precision GBG_TABLE = {
    .size = sizeof(COMPLEX),
    .plan = make_plans,
    .forget = forget_plans,
    .forward = forward,
    .backward = backward,
    .wisdom = GBG_FFTW(export_wisdom_to_string),
    .learn = GBG_FFTW(import_wisdom_from_string),
    .unlearn = GBG_FFTW(forget_wisdom),
};
