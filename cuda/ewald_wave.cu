/* L1, CUDA: influence of waves, and their multiplication by it. */
#include "cuda/ewald_kernels.h"

extern "C" {
#include "ewald/influence.h"
}

namespace
{

enum { THREADS = 128, ROWS = 65535 };

struct axis {
    const double *square, *power, *slope;
};

/* Influence in units of the reach, so that no choice of units overflows a float. */
struct fill_job {
    struct gbg_far far;
    struct axis axis[3];
    int dimension, by_waves;
    int32_t cells[3];
    double wave[3]; /* of n = 1 */
    double scale;   /* reach^(power-1) over the volume */
    int64_t row_numbers, rows;
};

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

template <typename Real>
static __global__ void fill(const __grid_constant__ struct fill_job job, Real *influence)
{
    int32_t n0 = (int32_t)gbg_cuda_index();
    if (n0 >= job.row_numbers) {
        return;
    }
    for (int64_t row = blockIdx.y; row < job.rows; row += gridDim.y) {
        int64_t half = job.cells[1] / 2 + 1;
        int32_t n[3] = {n0, (int32_t)(row % half), (int32_t)(row / half)};
        double square[3] = {1, 1, 1}, power[3] = {1, 1, 1}, slope[3] = {0, 0, 0}, squared = 0;
        bool last = false;
        for (int a = 0; a < job.dimension; a++) {
            double k = job.wave[a] * n[a];
            squared += k * k;
            square[a] = job.axis[a].square[n[a]];
            power[a] = job.axis[a].power[n[a]];
            slope[a] = job.axis[a].slope[n[a]];
            last = last || 2 * n[a] == job.cells[a];
        }
        double far = last || !(squared > 0) ? 0 : gbg_far_at(&job.far, sqrt(squared));
        influence[row * job.row_numbers + n0] =
            far == 0 ? (Real)0
                     : (Real)(far * job.scale *
                              gbg_ewald_both_ways(job.by_waves, squared, square, power, slope));
    }
}

/* Arrays of one axis at `to`, of cells/2 + 1 numbers each; *used counts their bytes. */
static int copy_axis(struct gbg_device *device, const struct gbg_ewald_plan *plan, int a,
                     double *host, void *base, size_t *used, struct axis *axis)
{
    int64_t count = plan->choice.cells[a] / 2 + 1;
    struct gbg_ewald_axis filled = {host, host + count, host + 2 * count};
    gbg_ewald_fill_axis(plan, a, &filled);
    double *there = (double *)gbg_cuda_take(base, used, 3 * count, sizeof *there);
    *axis = {there, there + count, there + 2 * count};
    cudaError_t error = cudaMemcpyAsync(there, host, (size_t)(3 * count) * sizeof *there,
                                        cudaMemcpyHostToDevice, device->stream);
    error = error ? error : cudaStreamSynchronize(device->stream); /* host is used again */
    return gbg_cuda_status(device, error, "copying windows of waves");
}

/* Tables of the far part and of all axes on the device. */
static int copy_tables(struct gbg_device *device, const struct gbg_ewald_plan *plan, double *host,
                       struct fill_job *job)
{
    size_t bytes = 0, used = 0;
    void *base;
    const int64_t terms = GBG_FAR_OCTAVES * GBG_FAR_PANELS * GBG_FAR_TERMS;
    gbg_cuda_take(NULL, &bytes, terms, sizeof(double));
    for (int a = 0; a < plan->choice.dimension; a++) {
        gbg_cuda_take(NULL, &bytes, 3 * ((int64_t)plan->choice.cells[a] / 2 + 1), sizeof(double));
    }
    int status = gbg_cuda_workspace(device, bytes, &base);
    if (status == GBG_OK) {
        void *table = gbg_cuda_take(base, &used, terms, sizeof(double));
        job->far = gbg_far_of(&plan->split);
        status =
            gbg_cuda_status(device,
                            cudaMemcpyAsync(table, job->far.table, (size_t)terms * sizeof(double),
                                            cudaMemcpyHostToDevice, device->stream),
                            "copying the far part");
        job->far.table = (const double *)table;
    }
    for (int a = 0; status == GBG_OK && a < plan->choice.dimension; a++) {
        status = copy_axis(device, plan, a, host, base, &used, &job->axis[a]);
    }
    return status;
}

static dim3 blocks_of(int64_t row_numbers, int64_t rows)
{
    return dim3(gbg_cuda_blocks(row_numbers, THREADS), (unsigned)(rows < ROWS ? rows : ROWS));
}

static struct fill_job make_fill(const struct gbg_ewald_plan *plan)
{
    const struct gbg_ewald_choice *choice = &plan->choice;
    struct fill_job job = {};
    job.dimension = choice->dimension;
    job.by_waves = choice->gradient == GBG_GRADIENT_WAVES;
    job.scale = pow(choice->reach, choice->power - 1.0);
    job.row_numbers = choice->cells[0] / 2 + 1;
    job.rows = 1;
    for (int a = 0; a < choice->dimension; a++) {
        job.cells[a] = choice->cells[a];
        job.wave[a] = 2.0 * 3.14159265358979323846 / choice->length[a];
        job.scale /= choice->length[a];
        job.rows *= a > 0 ? choice->cells[a] / 2 + 1 : 1;
    }
    return job;
}

int gbg_cuda_ewald_fill(struct gbg_device *device, struct gbg_ewald *sum)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    struct fill_job job = make_fill(&sum->plan);
    int64_t longest = 0;
    void *host;
    for (int a = 0; a < choice->dimension; a++) {
        longest = choice->cells[a] > longest ? choice->cells[a] : longest;
    }
    int status = gbg_allocate(device->context, &host, 3 * (longest / 2 + 1), sizeof(double),
                              "windows of waves");
    if (status != GBG_OK) {
        return status;
    }
    status = copy_tables(device, &sum->plan, (double *)host, &job);
    if (status == GBG_OK) {
        dim3 blocks = blocks_of(job.row_numbers, job.rows);
        if (choice->single) {
            fill<<<blocks, THREADS, 0, device->stream>>>(job, (float *)sum->influence);
        } else {
            fill<<<blocks, THREADS, 0, device->stream>>>(job, (double *)sum->influence);
        }
        status = gbg_cuda_started(device, "influence of waves");
    }
    gbg_release(host);
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
