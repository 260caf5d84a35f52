/* L1, CUDA: influence of waves, and their multiplication by it. */
#include "cuda/ewald_kernels.h"

extern "C" {
#include "ewald/influence.h"
}

namespace
{

/* PART: numbers of influence that the host fills at a time. */
enum { THREADS = 128, ROWS = 65535, PART = 1 << 22 };

template <typename Real> struct pair_of {
    typedef float2 type;
};
template <> struct pair_of<double> {
    typedef double2 type;
};

template <typename Real> struct multiply_job {
    typedef typename pair_of<Real>::type Complex;
    int32_t cells[3];
    int64_t row_numbers, rows; /* of the spectrum */
    Real wave[3];              /* of n = 1, in units of 1/reach */
    const Real *influence;
    Complex *spectrum, *wide;
};

} // namespace

static dim3 blocks_of(int64_t row_numbers, int64_t rows)
{
    return dim3(gbg_cuda_blocks(row_numbers, THREADS), (unsigned)(rows < ROWS ? rows : ROWS));
}

/* In units of the reach, so that no choice of units overflows a float. */
template <typename Real>
static __global__ void convert(const double *from, int64_t count, double factor, Real *to)
{
    int64_t k = gbg_cuda_index();
    if (k < count) {
        to[k] = (Real)(from[k] * factor);
    }
}

/* Numbers of the influence from `first` on, by way of the workspace. */
static int put(struct gbg_device *device, struct gbg_ewald *sum, const double *host, int64_t first,
               int64_t count)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    double factor = pow(choice->reach, choice->power - 1.0);
    void *there;
    int status = gbg_cuda_workspace(device, (size_t)count * sizeof *host, &there);
    if (status != GBG_OK) {
        return status;
    }
    cudaError_t error = cudaMemcpyAsync(there, host, (size_t)count * sizeof *host,
                                        cudaMemcpyHostToDevice, device->stream);
    error = error ? error : cudaStreamSynchronize(device->stream); /* host is filled again */
    status = gbg_cuda_status(device, error, "copying the influence of waves");
    if (status == GBG_OK) {
        const double *from = (const double *)there;
        unsigned blocks = gbg_cuda_blocks(count);
        if (choice->single) {
            convert<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(
                from, count, factor, (float *)sum->influence + first);
        } else {
            convert<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(
                from, count, factor, (double *)sum->influence + first);
        }
        status = gbg_cuda_started(device, "influence of waves");
    }
    return status;
}

/* Factors of all axes, in memory of the host behind each other. */
static int fill_axes(struct gbg_device *device, const struct gbg_ewald_plan *plan, void **memory,
                     struct gbg_ewald_axis axis[3])
{
    int64_t numbers = 0, waves[3];
    for (int a = 0; a < plan->choice.dimension; a++) {
        waves[a] = plan->choice.cells[a] / 2 + 1;
        numbers += 3 * waves[a];
    }
    int status = gbg_allocate(device->context, memory, numbers, sizeof(double), "factors of waves");
    double *next = (double *)*memory;
    for (int a = 0; status == GBG_OK && a < plan->choice.dimension; a++) {
        axis[a] = {next, next + waves[a], next + 2 * waves[a]};
        next += 3 * waves[a];
        gbg_ewald_fill_axis(plan, a, &axis[a]);
    }
    return status;
}

int gbg_cuda_ewald_fill(struct gbg_device *device, struct gbg_ewald *sum)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    struct gbg_ewald_axis axis[3] = {};
    void *factors = NULL, *part = NULL;
    int threads = device->context->threads > 0 ? device->context->threads : 1;
    int64_t waves = choice->cells[0] / 2 + 1, rows = choice->cells[1] / 2 + 1;
    rows *= choice->dimension == 3 ? choice->cells[2] / 2 + 1 : 1;
    int64_t most = PART / waves > 1 ? PART / waves : 1;
    most = most < rows ? most : rows;
    int status = fill_axes(device, &sum->plan, &factors, axis);
    status = status ? status
                    : gbg_allocate(device->context, &part, most * waves, sizeof(double),
                                   "influence of waves");
    for (int64_t first = 0; first < rows && status == GBG_OK; first += most) {
        int64_t count = rows - first < most ? rows - first : most;
        gbg_ewald_fill_rows(&sum->plan, axis, threads, first, count, (double *)part);
        status = put(device, sum, (const double *)part, first * waves, count * waves);
    }
    gbg_release(factors);
    gbg_release(part);
    return status;
}

/* Signed number of the wave that stands at n. */
static __device__ __forceinline__ int32_t signed_wave(int32_t n, int32_t cells)
{
    return 2 * n <= cells ? n : n - cells;
}

/* Potentials of waves stay where they are. Fields 0 and 1 go into the wide mesh as one complex
 * number a node, whose transform is field 0 + i field 1, so that their waves -k are written too;
 * field 2 takes the spectrum's place. */
template <int D, bool by_waves, typename Real>
static __global__ void multiply(const __grid_constant__ multiply_job<Real> job)
{
    int32_t n0 = (int32_t)gbg_cuda_index();
    if (n0 >= job.row_numbers) {
        return;
    }
    for (int64_t row = blockIdx.y; row < job.rows; row += gridDim.y) {
        int32_t n1 = D == 3 ? (int32_t)(row % job.cells[1]) : (int32_t)row;
        int32_t n2 = D == 3 ? (int32_t)(row / job.cells[1]) : 0;
        int32_t k1 = signed_wave(n1, job.cells[1]), k2 = D == 3 ? signed_wave(n2, job.cells[2]) : 0;
        int64_t place = ((int64_t)abs(k2) * (job.cells[1] / 2 + 1) + abs(k1)) * job.row_numbers;
        Real influence = job.influence[place + n0];
        typename pair_of<Real>::type *spectrum = &job.spectrum[row * job.row_numbers + n0];
        typename pair_of<Real>::type v = *spectrum;
        v.x *= influence;
        v.y *= influence;
        if (!by_waves) {
            *spectrum = v;
            continue;
        }
        Real x = job.wave[0] * (Real)n0, y = job.wave[1] * (Real)k1;
        /* -i x v + i (-i y v), and the same of the complex conjugate at -k */
        typename pair_of<Real>::type there = {x * v.y + y * v.x, y * v.y - x * v.x};
        typename pair_of<Real>::type back = {x * v.y - y * v.x, x * v.x + y * v.y};
        job.wide[row * job.cells[0] + n0] = there;
        if (n0 > 0 && 2 * n0 < job.cells[0]) {
            int64_t m1 = n1 > 0 ? job.cells[1] - n1 : 0;
            int64_t m2 = D == 3 && n2 > 0 ? job.cells[2] - n2 : 0;
            job.wide[(m2 * job.cells[1] + m1) * job.cells[0] + job.cells[0] - n0] = back;
        }
        if (D == 3) {
            Real z = job.wave[2] * (Real)k2;
            *spectrum = {z * v.y, -z * v.x};
        }
    }
}

template <int D, typename Real>
static int run(struct gbg_device *device, struct gbg_ewald *sum, int by_waves)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    multiply_job<Real> job = {};
    job.row_numbers = choice->cells[0] / 2 + 1;
    job.rows = 1;
    for (int a = 0; a < D; a++) {
        job.cells[a] = choice->cells[a];
        job.rows *= a > 0 ? choice->cells[a] : 1;
        job.wave[a] = (Real)(2.0 * 3.14159265358979323846 / choice->length[a] * choice->reach);
    }
    job.influence = (const Real *)sum->influence;
    job.spectrum = (typename pair_of<Real>::type *)sum->mesh;
    job.wide = (typename pair_of<Real>::type *)sum->wide;
    dim3 blocks = blocks_of(job.row_numbers, job.rows);
    if (by_waves) {
        multiply<D, true><<<blocks, THREADS, 0, device->stream>>>(job);
    } else {
        multiply<D, false><<<blocks, THREADS, 0, device->stream>>>(job);
    }
    return gbg_cuda_started(device, "waves times their influence");
}

int gbg_cuda_ewald_multiply(struct gbg_device *device, struct gbg_ewald *sum, int by_waves)
{
    int d = sum->plan.choice.dimension, single = sum->plan.choice.single;
    return d == 2   ? single ? run<2, float>(device, sum, by_waves)
                             : run<2, double>(device, sum, by_waves)
             : single ? run<3, float>(device, sum, by_waves)
                    : run<3, double>(device, sum, by_waves);
}
