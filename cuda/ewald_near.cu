/* L1, CUDA: fields and potentials of near pairs: a thread a particle, over runs of cells that the
 * reach touches, in the order of cells. Lengths are in units of the reach. */
#include "cuda/direct.h"
#include "cuda/ewald_kernels.h"

namespace
{

template <int D, typename Real> struct near_job {
    struct gbg_cuda_ewald_cells cells;
    int64_t n;
    const gbg_cuda_ewald_record<D, Real> *record;
    const uint32_t *top;
    Real *field;
    Real scale[3]; /* of differences of places */
    Real power;
    int degree;
    Real coefficient[GBG_SPLIT_DEGREE + 1];
};

/* Rows of cells along an axis that the reach touches. */
struct span {
    int32_t first, count, before; /* before: rows ahead of the particle's own */
    float inside;                 /* its place in its own row, in cells */
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

static __device__ __forceinline__ float difference(uint32_t p, uint32_t q)
{
    return __int2float_rn((int32_t)(p - q));
}
static __device__ __forceinline__ double difference(uint64_t p, uint64_t q)
{
    return __ll2double_rn((int64_t)(p - q));
}

/* What a pair at squared distance q adds for a unit source: the law without the polynomial that the
 * far part makes up for. whole: the power, 0 for others; terms: of the polynomial, 0: as many as
 * the job says. */
template <int whole, int terms> struct force_law {
    template <int D, typename Real>
    static __device__ __forceinline__ Real of(const near_job<D, Real> &job, Real q)
    {
        Real z = fma((Real)2, q, (Real)-1), root = inverse_root(q), sum;
        Real law = whole ? gbg_cuda_raise<(whole ? whole : 1)>(root)
                         : (Real)pow(q, (Real)-0.5 * (job.power + (Real)1));
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
        return law - sum;
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
        return (q > 0 ? law : (Real)0) - sum;
    }
};

static __device__ __forceinline__ struct span rows_of(const struct gbg_cuda_ewald_cells &cells,
                                                      int a, uint32_t high)
{
    struct span span = {0, cells.cells[a], 0, 0.0f};
    if (!cells.all[a]) {
        uint32_t count = (uint32_t)cells.cells[a];
        int32_t own = (int32_t)__umulhi(high, count);
        span.first = (int32_t)__umulhi(high - cells.reach[a], count);
        span.count = (int32_t)__umulhi(high + cells.reach[a], count) - span.first;
        span.count += (span.count < 0 ? cells.cells[a] : 0) + 1;
        span.before = own - span.first + (own < span.first ? cells.cells[a] : 0);
        span.inside = __uint2float_rn(high * count) * 0x1p-32f;
    }
    return span;
}

/* Squared distance of the particle from row k of the span: 0 in its own, and where all are. */
static __device__ __forceinline__ float squared_to(const struct gbg_cuda_ewald_cells &cells, int a,
                                                   const struct span &span, int32_t k)
{
    float rows = (float)(k - span.before);
    float away = rows > 0.0f ? rows - span.inside : rows < 0.0f ? span.inside - rows - 1.0f : 0.0f;
    away = cells.all[a] ? 0.0f : away * cells.edge[a];
    return away * away;
}

/* Calls visit(slot) for the particles in a row of cells that what is left of the squared reach
 * touches: one run of them, two around the edge of the box. */
template <typename Visit>
static __device__ __forceinline__ void visit_row(const struct gbg_cuda_ewald_cells &cells,
                                                 uint32_t high, int64_t row, float left,
                                                 Visit visit)
{
    const int32_t *begin = cells.begin + row * cells.cells[0];
    int32_t first = 0, last = cells.cells[0] - 1;
    if (!cells.all[0]) {
        /* a little more than the half chord, at most the reach */
        float chord = __uint2float_rz(cells.reach[0]) * __fsqrt_rn(left) + 1024.0f;
        uint32_t words = min((uint32_t)chord, cells.reach[0]);
        first = (int32_t)__umulhi(high - words, (uint32_t)cells.cells[0]);
        last = (int32_t)__umulhi(high + words, (uint32_t)cells.cells[0]);
    }
    int parts = first <= last ? 1 : 2;
    for (int part = 0; part < parts; part++) {
        int32_t from = part == 0 ? first : 0;
        int32_t end = begin[parts == 2 && part == 0 ? cells.cells[0] : last + 1];
#pragma unroll 2
        for (int32_t k = begin[from]; k < end; k++) {
            visit(k);
        }
    }
}

template <int D, typename Visit>
static __device__ __forceinline__ void visit_around(const struct gbg_cuda_ewald_cells &cells,
                                                    const uint32_t *high, Visit visit)
{
    struct span y = rows_of(cells, 1, high[1]), z = {0, 1, 0, 0.0f};
    if (D == 3) {
        z = rows_of(cells, 2, high[2]);
    }
    for (int32_t l = 0; l < z.count; l++) {
        int32_t layer = z.first + l;
        layer -= layer >= cells.cells[2] ? cells.cells[2] : 0;
        float left = 1.0f + 1e-5f - (D == 3 ? squared_to(cells, 2, z, l) : 0.0f);
        for (int32_t k = 0; k < y.count; k++) {
            float here = left - squared_to(cells, 1, y, k);
            int32_t row = y.first + k;
            row -= row >= cells.cells[1] ? cells.cells[1] : 0;
            if (here > 0.0f) {
                visit_row(cells, high[0], (int64_t)layer * cells.cells[1] + row, here, visit);
            }
        }
    }
}

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
    visit_around<D>(job.cells, high, [&](int32_t k) {
        const gbg_cuda_ewald_record<D, Real> other = job.record[k];
        Real r[D], q = 0;
        for (int a = 0; a < D; a++) {
            r[a] = difference(own.at[a], other.at[a]) * job.scale[a];
            q = fma(r[a], r[a], q);
        }
        Real f = Law::of(job, q) * other.source;
        bool counts = q < 1 && (O == 1 ? k != slot : q > 0);
        f = counts ? f : (Real)0;
        for (int a = 0; a < O; a++) {
            sum[a] = O == 1 ? sum[a] + f : fma(f, r[a], sum[a]);
        }
    });
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
    job.power = (Real)choice->power;
    job.degree = split->degree;
    for (int a = 0; a < D; a++) {
        int bits = sizeof(Real) == 4 ? 32 + sum->cells.shift[a] : 64;
        job.scale[a] = (Real)(ldexp(choice->length[a], -bits) / choice->reach);
    }
    for (int k = 0; k <= split->degree; k++) {
        job.coefficient[k] = (Real)(potential ? split->potential[k] : split->near[k]);
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

int gbg_cuda_ewald_near(struct gbg_device *device, struct gbg_ewald *sum, int potential)
{
    int d = sum->plan.choice.dimension, single = sum->plan.choice.single;
    size_t numbers = (size_t)sum->n * (size_t)(potential ? 1 : d);
    int status = gbg_cuda_workspace(device, numbers * (single ? sizeof(float) : sizeof(double)),
                                    &sum->near_field);
    if (status != GBG_OK) {
        return status;
    }
    return d == 2   ? single ? run<2, float>(device, sum, potential)
                             : run<2, double>(device, sum, potential)
             : single ? run<3, float>(device, sum, potential)
                    : run<3, double>(device, sum, potential);
}
