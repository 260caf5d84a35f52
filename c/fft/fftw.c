/* Transforms by FFTW: plans, and the table that libgamboge looks for. Everything else in this
 * library is hidden. */
#include "core/context.h"
#include "core/memory.h"
#include "core/planner.h"
#include "fft/body.h"

static const struct gbg_fft_precision *precision_of(const struct gbg_fft_plan *plan)
{
    return plan->single ? &gbg_fft_single : &gbg_fft_double;
}

static void release(struct gbg_fft_plan *plan)
{
    if (plan) {
        gbg_planner_lock();
        precision_of(plan)->forget(plan);
        gbg_planner_unlock();
        gbg_release(plan->work);
        gbg_release(plan);
    }
}

/* Complex numbers of a thread's work: two lines of axis 0, each with one number more, or the lines
 * that are transformed together; whole cache lines. */
static int64_t work_size(const struct gbg_fft_plan *plan)
{
    int64_t most = 2 * ((int64_t)plan->cells[0] + 1);
    for (int a = 1; a < plan->dimension; a++) {
        int64_t lines = (int64_t)GBG_FFT_LINES * plan->cells[a];
        most = lines > most ? lines : most;
    }
    return (most + 31) / 32 * 32;
}

static int fill(struct gbg_context *context, struct gbg_fft_plan *plan, int hurry)
{
    const struct gbg_fft_precision *precision = precision_of(plan);
    int status = gbg_allocate_zero(context, &plan->work, plan->threads * plan->work_size,
                                   precision->size, "lines of the Fourier transform");
    if (status != GBG_OK) {
        return status;
    }
    gbg_planner_lock();
    int missing = hurry ? gbg_fft_plan_quickly(precision, plan)
                        : gbg_fft_plan_wisely(context, precision, plan);
    gbg_planner_unlock();
    return missing ? gbg_fail(context, GBG_E_INTERNAL,
                              "long-range sum: FFTW has no plan for a mesh of %d x %d x %d",
                              (int)plan->cells[0], (int)plan->cells[1], (int)plan->cells[2])
                   : GBG_OK;
}

static int make(struct gbg_context *context, int dimension, const int32_t *cells, int single,
                int threads, int hurry, struct gbg_fft_plan **plan)
{
    void *body;
    *plan = NULL;
    int status = gbg_allocate_zero(context, &body, 1, sizeof **plan, "Fourier transform");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_fft_plan *made = body;
    made->dimension = dimension;
    made->single = single;
    made->threads = threads > 0 ? threads : 1;
    for (int a = 0; a < 3; a++) {
        made->cells[a] = a < dimension ? cells[a] : 1;
    }
    made->pitch = gbg_fft_pitch(cells) / 2;
    made->rows = (int64_t)made->cells[1] * made->cells[2];
    made->work_size = work_size(made);
    status = fill(context, made, hurry);
    if (status != GBG_OK) {
        release(made);
        return status;
    }
    *plan = made;
    return GBG_OK;
}

static void forward(const struct gbg_fft_plan *plan, void *mesh)
{
    precision_of(plan)->forward(plan, mesh);
}

static void backward(const struct gbg_fft_plan *plan, void *mesh)
{
    precision_of(plan)->backward(plan, mesh);
}

#pragma GCC visibility push(default)
extern const struct gbg_fft gbg_fft_fftw;
#pragma GCC visibility pop

const struct gbg_fft gbg_fft_fftw = {
    .make = make,
    .forward = forward,
    .backward = backward,
    .release = release,
};
