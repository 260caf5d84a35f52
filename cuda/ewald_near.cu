/* L1, CUDA: fields and potentials of near pairs: a thread a particle, over runs of cells that the
 * reach touches, in the order of cells. Lengths are in units of the reach. */
#include "cuda/direct.h"
#include "cuda/ewald_kernels.h"
#include "cuda/ewald_visit.h"

namespace
{

template <int D, typename Real> struct near_job {
    struct gbg_cuda_ewald_cells cells;
    int64_t n;
    const gbg_cuda_ewald_record<D, Real> *record;
    const uint32_t *top;
    Real *field;
    /* Single precision: squared distance up to which a pair is left to ewald_mend.cu, and who has
     * one. */
    Real close;
    int32_t *mended, *mended_count, *index;
    Real scale[3]; /* of differences of places */
    Real power;
    int degree;
    Real coefficient[GBG_SPLIT_DEGREE + 1]; /* with the sign turned */
};

} // namespace

/* 1/sqrt: the unit's 23 bits in single precision. */
static __device__ __forceinline__ float inverse_root(float a)
{
    float y;
    asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(y) : "f"(a));
    return y;
}
static __device__ __forceinline__ double inverse_root(double a)
{
    return gbg_cuda_rsqrt(a);
}

/* What a pair at squared distance q adds for a unit source: the law without the polynomial that the
 * far part makes up for. whole: the power, 0 for others; terms: of the polynomial, 0: as many as
 * the job says. */
template <int whole, int terms> struct force_law {
    template <int D, typename Real>
    static __device__ __forceinline__ Real of(const near_job<D, Real> &job, Real q)
    {
        Real z = fma((Real)2, q, (Real)-1), root = inverse_root(q), sum;
        if (sizeof(Real) == 4 && whole > 2) { /* high powers multiply its error */
            root = fma((Real)0.5 * root, fma(-q * root, root, (Real)1), root);
        }
        if (terms) {
            sum = job.coefficient[terms ? terms - 1 : 0];
#pragma unroll
            for (int k = terms - 2; k >= 0; k--) {
                sum = fma(sum, z, job.coefficient[k]);
            }
        } else {
            sum = job.coefficient[job.degree];
            for (int k = job.degree - 1; k >= 0; k--) {
                sum = fma(sum, z, job.coefficient[k]);
            }
        }
        if (whole == 2) {
            return fma(root * root, root, sum);
        }
        return (whole ? gbg_cuda_raise<(whole ? whole : 1)>(root)
                      : (Real)pow(q, (Real)-0.5 * (job.power + (Real)1))) +
               sum;
    }
};

/* The same for potentials. Of a coincident pair the singular law is left out, as with a particle
 * and itself: what remains takes the far part's away. */
struct potential_law {
    template <int D, typename Real>
    static __device__ __forceinline__ Real of(const near_job<D, Real> &job, Real q)
    {
        Real z = fma((Real)2, q, (Real)-1), s = job.power - (Real)1, sum = 0;
        for (int k = job.degree; k >= 0; k--) {
            sum = fma(sum, z, job.coefficient[k]);
        }
        Real law = s > 0 ? pow(q, (Real)-0.5 * s) / s : (Real)-0.5 * log(q);
        return (q > 0 ? law : (Real)0) + sum;
    }
};

/* O numbers a particle: a vector of D, or a potential. */
template <int D, int O, typename Real, typename Law>
static __global__
__launch_bounds__(GBG_CUDA_THREADS) void near_pairs(const __grid_constant__ near_job<D, Real> job)
{
    int64_t slot = gbg_cuda_index();
    if (slot >= job.n) {
        return;
    }
    const gbg_cuda_ewald_record<D, Real> own = job.record[slot];
    uint64_t whole[D];
    uint32_t high[D];
    Real sum[O];
    gbg_cuda_ewald_read(job.cells.shift, own, job.top, slot, whole);
    for (int a = 0; a < D; a++) {
        high[a] = (uint32_t)(whole[a] >> 32);
    }
    for (int a = 0; a < O; a++) {
        sum[a] = 0;
    }
    int near = 0; /* itself, and those too close */
    gbg_cuda_ewald_visit<D>(job.cells, high, [&](int32_t k) {
        const gbg_cuda_ewald_record<D, Real> other = job.record[k];
        Real r[D], q = gbg_cuda_ewald_squared<D, Real>(own, other, job.scale, r);
        Real f = Law::of(job, q) * other.source;
        bool counts;
        if (sizeof(Real) == 4) {
            near += q > job.close ? 0 : 1;
            counts = q < 1 && q > job.close;
        } else {
            counts = q < 1 && (O == 1 ? k != slot : q > 0);
        }
        f = counts ? f : (Real)0;
        for (int a = 0; a < O; a++) {
            sum[a] = O == 1 ? sum[a] + f : fma(f, r[a], sum[a]);
        }
    });
    if (sizeof(Real) == 4 && near > 1) {
        job.mended[atomicAdd(job.mended_count, 1)] = (int32_t)slot;
        job.index[slot] = ~job.index[slot];
    }
    for (int a = 0; a < O; a++) {
        job.field[slot * O + a] = sum[a];
    }
}

template <int D, typename Real>
static near_job<D, Real> make_job(const struct gbg_ewald *sum, int potential)
{
    near_job<D, Real> job = {};
    const struct gbg_split *split = &sum->plan.split;
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    job.cells = sum->cells;
    job.n = sum->n;
    job.record = (const gbg_cuda_ewald_record<D, Real> *)sum->record;
    job.top = sum->top;
    job.field = (Real *)sum->near_field;
    job.mended = sum->mended;
    job.mended_count = sum->mended_count;
    job.index = sum->index;
    job.power = (Real)choice->power;
    job.degree = split->degree;
    for (int a = 0; a < D; a++) {
        int bits = sizeof(Real) == 4 ? 32 + sum->cells.shift[a] : 64;
        job.scale[a] = (Real)(ldexp(choice->length[a], -bits) / choice->reach);
        job.close = fmax(job.close, gbg_cuda_ewald_close(sum, a));
    }
    for (int k = 0; k <= split->degree; k++) {
        job.coefficient[k] = (Real) - (potential ? split->potential[k] : split->near[k]);
    }
    return job;
}

template <int D, typename Real, typename Law>
static void start(struct gbg_device *device, const near_job<D, Real> &job)
{
    near_pairs<D, D, Real, Law>
        <<<gbg_cuda_blocks(job.n), GBG_CUDA_THREADS, 0, device->stream>>>(job);
}

/* Single precision and power 2, which is what runs are made of: a kernel for each number of terms
 * up to two more than are needed. */
template <int D> static void start_square(struct gbg_device *device, const near_job<D, float> &job)
{
    int terms = job.degree + 1;
    if (terms <= 6) {
        start<D, float, force_law<2, 6>>(device, job);
    } else if (terms <= 8) {
        start<D, float, force_law<2, 8>>(device, job);
    } else if (terms <= 10) {
        start<D, float, force_law<2, 10>>(device, job);
    } else if (terms <= 12) {
        start<D, float, force_law<2, 12>>(device, job);
    } else if (terms <= 14) {
        start<D, float, force_law<2, 14>>(device, job);
    } else {
        start<D, float, force_law<2, 0>>(device, job);
    }
}
template <int D> static void start_square(struct gbg_device *device, const near_job<D, double> &job)
{
    if (job.degree < 16) {
        start<D, double, force_law<2, 16>>(device, job);
    } else if (job.degree < 20) {
        start<D, double, force_law<2, 20>>(device, job);
    } else {
        start<D, double, force_law<2, 0>>(device, job);
    }
}

template <int D, typename Real>
static void start_force(struct gbg_device *device, const near_job<D, Real> &job, double power)
{
    if (power == 2.0) {
        start_square<D>(device, job);
    } else if (power == 1.0) {
        start<D, Real, force_law<1, 0>>(device, job);
    } else if (power == 3.0) {
        start<D, Real, force_law<3, 0>>(device, job);
    } else if (power == 6.0) {
        start<D, Real, force_law<6, 0>>(device, job);
    } else {
        start<D, Real, force_law<0, 0>>(device, job);
    }
}

template <int D, typename Real>
static int run(struct gbg_device *device, const struct gbg_ewald *sum, int potential)
{
    near_job<D, Real> job = make_job<D, Real>(sum, potential);
    if (potential) {
        near_pairs<D, 1, Real, potential_law>
            <<<gbg_cuda_blocks(job.n), GBG_CUDA_THREADS, 0, device->stream>>>(job);
    } else {
        start_force<D>(device, job, sum->plan.choice.power);
    }
    return gbg_cuda_started(device, "near pairs of a sum by a mesh");
}

/* Fields, and the list of those who have pairs too close. */
static int take_field(struct gbg_device *device, struct gbg_ewald *sum, int potential)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    int64_t numbers = sum->n * (potential ? 1 : choice->dimension);
    void *base = NULL;
    int status = GBG_OK;
    for (int pass = 0; status == GBG_OK && pass < 2; pass++) {
        size_t used = 0;
        sum->near_field =
            gbg_cuda_take(base, &used, numbers, choice->single ? sizeof(float) : sizeof(double));
        sum->mended = (int32_t *)gbg_cuda_take(base, &used, choice->single ? sum->n : 0, 4);
        sum->mended_count = (int32_t *)gbg_cuda_take(base, &used, 1, 4);
        status = pass ? status : gbg_cuda_workspace(device, used, &base);
    }
    return status ? status : gbg_cuda_clear(device, sum->mended_count, 4);
}

int gbg_cuda_ewald_near(struct gbg_device *device, struct gbg_ewald *sum, int potential)
{
    int d = sum->plan.choice.dimension, single = sum->plan.choice.single;
    int status = take_field(device, sum, potential);
    if (status != GBG_OK) {
        return status;
    }
    return d == 2   ? single ? run<2, float>(device, sum, potential)
                             : run<2, double>(device, sum, potential)
             : single ? run<3, float>(device, sum, potential)
                    : run<3, double>(device, sum, potential);
}
