/* L1, CUDA: sums over all images by a mesh: their memory, and the order of their parts. */
#include "cuda/ewald_kernels.h"

extern "C" {
#include "ewald/influence.h"
}

static size_t number_size(const struct gbg_ewald_choice *choice)
{
    return choice->single ? sizeof(float) : sizeof(double);
}

/* An array of a sum that lives as long as the sum. */
static int hold(struct gbg_device *device, struct gbg_ewald *sum, void **pointer, int64_t count,
                size_t size, const char *what)
{
    sum->held_bytes += (double)count * (double)size;
    return gbg_cuda_allocate(device, pointer, count, size, what);
}

static int hold_meshes(struct gbg_device *device, struct gbg_ewald *sum)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    const size_t size = number_size(choice);
    int64_t half = choice->cells[0] / 2 + 1, rows = 1, waves = half;
    size_t bytes = 0;
    for (int a = 1; a < choice->dimension; a++) {
        rows *= choice->cells[a];
        waves *= choice->cells[a] / 2 + 1;
    }
    gbg_cuda_take(NULL, &bytes, 2 * half * rows, size);
    size_t wide = bytes;
    if (choice->gradient == GBG_GRADIENT_WAVES) {
        gbg_cuda_take(NULL, &bytes, choice->cells[0] * rows, 2 * size);
    }
    int status = hold(device, sum, &sum->mesh, (int64_t)bytes, 1, "meshes");
    sum->mesh_bytes = bytes;
    sum->wide = status == GBG_OK && bytes > wide ? (char *)sum->mesh + wide : NULL;
    return status ? status : hold(device, sum, &sum->influence, waves, size, "influence of waves");
}

/* Double precision: windows as the kernels read them. */
static int hold_windows(struct gbg_device *device, struct gbg_ewald *sum)
{
    const size_t bytes = sizeof sum->plan.window[0].value;
    int d = sum->plan.choice.dimension, status = GBG_OK;
    if (!sum->plan.choice.single) {
        status =
            hold(device, sum, (void **)&sum->window, (int64_t)d * (int64_t)bytes, 1, "windows");
    }
    for (int a = 0; a < d && status == GBG_OK && sum->window; a++) {
        double *to = sum->window + (size_t)a * (bytes / sizeof(double));
        cudaError_t error = cudaMemcpyAsync(to, sum->plan.window[a].value, bytes,
                                            cudaMemcpyHostToDevice, device->stream);
        status = gbg_cuda_status(device, error, "copying windows");
    }
    return status;
}

static double largest_alpha(const struct gbg_state *state)
{
    double largest = 0.0;
    for (int s = 0; s < state->n_species && !state->own_alpha; s++) {
        largest = fmax(largest, fabs(state->alpha[s]));
    }
    return largest > 0.0 ? largest : 1.0; /* a caller's own are at most 1 */
}

void gbg_cuda_ewald_destroy(struct gbg_device *device, struct gbg_ewald *sum)
{
    if (!sum) {
        return;
    }
    void *array[] = {sum->mesh,        sum->influence, sum->window, sum->record,
                     sum->cells.begin, sum->index,     sum->top};
    for (size_t k = 0; k < sizeof array / sizeof *array; k++) {
        gbg_cuda_release(device, array[k], 0, 0);
    }
    gbg_cuda_fft_release(&sum->fft);
    gbg_release(sum);
}

int gbg_cuda_ewald_create(struct gbg_device *device, const struct gbg_state *state,
                          const struct gbg_ewald_plan *plan, int hurry, struct gbg_ewald **sum)
{
    void *body;
    (void)hurry; /* cuFFT does not try plans */
    int status = gbg_allocate_zero(device->context, &body, 1, sizeof **sum, "sum by a mesh");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_ewald *made = (struct gbg_ewald *)body;
    made->plan = *plan;
    made->largest = largest_alpha(state);
    status = gbg_cuda_fft_make(device, &plan->choice, &made->fft);
    status = status ? status : hold_meshes(device, made);
    status = status ? status : hold_windows(device, made);
    status = status ? status : gbg_cuda_ewald_fill(device, made);
    /* what steps need beside: they should not find out that there is no memory */
    status = status ? status : gbg_cuda_ewald_sort(device, state, made);
    if (status == GBG_OK) {
        status = gbg_cuda_workspace(device, made->fft.bytes, &body);
    }
    if (status != GBG_OK) {
        gbg_cuda_ewald_destroy(device, made);
        return status;
    }
    *sum = made;
    return GBG_OK;
}

/* The mean of all potentials, in units of the reach. */
static int find_mean(struct gbg_device *device, const struct gbg_ewald *sum, double *mean)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    int status = gbg_cuda_ewald_total(device, sum, mean);
    *mean *= gbg_ewald_near_integral(&sum->plan) * pow(choice->reach, choice->power - 1.0);
    for (int a = 0; a < choice->dimension; a++) {
        *mean /= choice->length[a];
    }
    return status;
}

/* Both parts, near and far, of what is asked for. */
static int run(struct gbg_device *device, const struct gbg_state *state, struct gbg_ewald *sum,
               struct gbg_cuda_ewald_output *output)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    int by_waves = choice->gradient == GBG_GRADIENT_WAVES && !output->potential;
    sum->largest = largest_alpha(state);
    output->unit =
        sum->largest * pow(choice->reach, output->potential ? 1.0 - choice->power : -choice->power);
    int status = gbg_cuda_ewald_sort(device, state, sum);
    if (status != GBG_OK || sum->n == 0) {
        return status;
    }
    if (output->potential) {
        status = find_mean(device, sum, &output->mean);
    }
    status = status ? status : gbg_cuda_ewald_spread(device, sum);
    status = status ? status : gbg_cuda_fft_run(device, &sum->fft, GBG_CUDA_FORWARD, sum->mesh);
    status = status ? status : gbg_cuda_ewald_multiply(device, sum, by_waves);
    if (status == GBG_OK && by_waves) {
        status = gbg_cuda_fft_run(device, &sum->fft, GBG_CUDA_WIDE, sum->wide);
    }
    if (status == GBG_OK && (!by_waves || choice->dimension == 3)) {
        status = gbg_cuda_fft_run(device, &sum->fft, GBG_CUDA_BACKWARD, sum->mesh);
    }
    status = status ? status : gbg_cuda_ewald_near(device, sum, output->potential != NULL);
    status = status ? status : gbg_cuda_ewald_gather(device, state, sum, output);
    return status || !choice->single ? status : gbg_cuda_ewald_mend(device, state, sum, output);
}

int gbg_cuda_ewald_force(struct gbg_device *device, struct gbg_state *state, struct gbg_ewald *sum,
                         int add)
{
    struct gbg_cuda_ewald_output output = {};
    output.add = add;
    return run(device, state, sum, &output);
}

int gbg_cuda_ewald_potential(struct gbg_device *device, struct gbg_state *state,
                             struct gbg_ewald *sum, double *potential)
{
    struct gbg_cuda_ewald_output output = {};
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    output.potential = potential;
    output.self = sum->plan.split.self * pow(choice->reach, choice->power - 1.0);
    return run(device, state, sum, &output);
}

double gbg_cuda_ewald_bytes(const struct gbg_ewald *sum)
{
    size_t record = sum->plan.choice.single ? sizeof(gbg_cuda_ewald_record<3, float>)
                                            : sizeof(gbg_cuda_ewald_record<3, double>);
    return sum->held_bytes + (double)sum->record_capacity * (double)record +
           4.0 * (double)(sum->begin_capacity + sum->index_capacity + sum->top_capacity);
}
