/* L1, CUDA: far part at the particles, from the nodes around them, and both parts into forces or
 * potentials: a thread a particle, nodes in a fixed order. */
#include "cuda/ewald_kernels.h"

namespace
{

/* What the mesh holds: fields, 0 and 1 as pairs (by waves); the potential, of which the field is
 * the slope; the potential that is asked for. */
enum source { FIELDS, SLOPES, POTENTIAL };

template <typename Real> struct pair_of {
    typedef float2 type;
};
template <> struct pair_of<double> {
    typedef double2 type;
};

template <int D, typename Real> struct gather_job {
    int64_t n;
    int32_t mesh[3], shift[3], add;
    Real slope[3]; /* of the field, from that in z and in units of the reach */
    const gbg_cuda_ewald_record<D, Real> *record;
    const int32_t *index;
    const uint32_t *top;
    Real *near_field;
    const Real *node;
    const typename pair_of<Real>::type *wide;
    double unit, self, mean; /* gbg_cuda_ewald_output */
    struct gbg_cuda_ewald_targets to;
    gbg_cuda_ewald_window<D, Real> window;
};
static_assert(sizeof(gather_job<3, float>) <= 4096, "parameters of a kernel before CUDA 12.1");

/* Weights along z of a block's threads, and slopes: registers cannot be counted through. */
template <int D, typename Real, int W, int from> struct layers {
    enum { KINDS = from == SLOPES ? 2 : 1 };
    Real kept[D == 3 ? KINDS : 1][D == 3 ? W : 1][D == 3 ? GBG_CUDA_THREADS : 1];
};

} // namespace

static __device__ __forceinline__ int32_t wrapped(int32_t k, int32_t period)
{
    return k >= period ? k - period : k;
}

/* Adds factor times (weights of a row of nodes times what they hold). inside: the row does not go
 * around the box. */
template <int D, typename Real, int W, int from, bool inside>
static __device__ __forceinline__ void
add_row(const gather_job<D, Real> &job, int64_t row, int32_t first, const Real *weight,
        const Real *slope, Real factor, Real factor_y, Real factor_z, Real sum[3])
{
    Real p = 0, q = 0, r = 0;
    const typename pair_of<Real>::type *wide = job.wide + row * job.mesh[0];
    const Real *node = job.node + row * (2 * (job.mesh[0] / 2 + 1));
    if (inside) {
        wide += first;
        node += first;
    }
#pragma unroll
    for (int l = 0; l < W; l++) {
        int32_t at = inside ? l : wrapped(first + l, job.mesh[0]);
        if (from == FIELDS) {
            typename pair_of<Real>::type v = __ldg(wide + at);
            p = fma(weight[l], v.x, p);
            q = fma(weight[l], v.y, q);
            r = D == 3 ? fma(weight[l], __ldg(node + at), r) : r;
        } else {
            Real v = __ldg(node + at);
            p = fma(weight[l], v, p);
            q = from == SLOPES ? fma(slope[l], v, q) : q;
        }
    }
    if (from == FIELDS) {
        sum[0] = fma(factor, p, sum[0]);
        sum[1] = fma(factor, q, sum[1]);
        sum[2] = D == 3 ? fma(factor, r, sum[2]) : sum[2];
    } else if (from == SLOPES) {
        sum[0] = fma(factor, q, sum[0]);
        sum[1] = fma(factor_y, p, sum[1]);
        sum[2] = D == 3 ? fma(factor_z, p, sum[2]) : sum[2];
    } else {
        sum[0] = fma(factor, p, sum[0]);
    }
}

/* The rows of one layer of nodes, by factors of axis z. */
template <int D, typename Real, int W, int from, bool inside>
static __device__ __forceinline__ void
add_layer(const gather_job<D, Real> &job, int64_t layer, const int32_t *first,
          const Real (*weight)[W], const Real (*slope)[W], Real z, Real slope_z, Real sum[3])
{
#pragma unroll
    for (int m = 0; m < W; m++) {
        int64_t row = layer * job.mesh[1] + wrapped(first[1] + m, job.mesh[1]);
        Real y = weight[1][m] * z;
        Real factor_y = from == SLOPES ? slope[1][m] * z : (Real)0;
        Real factor_z = from == SLOPES && D == 3 ? weight[1][m] * slope_z : (Real)0;
        add_row<D, Real, W, from, inside>(job, row, first[0], weight[0],
                                          from == SLOPES ? slope[0] : NULL, y, factor_y, factor_z,
                                          sum);
    }
}

/* In space one layer after the other. */
template <int D, typename Real, int W, int from, bool inside>
static __device__ __forceinline__ void
add_layers(const gather_job<D, Real> &job, layers<D, Real, W, from> &layers, const int32_t *first,
           const Real (*weight)[W], const Real (*slope)[W], Real sum[3])
{
    if constexpr (D == 2) {
        add_layer<D, Real, W, from, inside>(job, 0, first, weight, slope, (Real)1, (Real)0, sum);
    } else {
#pragma unroll 1
        for (int l = 0; l < W; l++) {
            Real z = layers.kept[0][l][threadIdx.x];
            Real slope_z = from == SLOPES ? layers.kept[layers.KINDS - 1][l][threadIdx.x] : (Real)0;
            add_layer<D, Real, W, from, inside>(job, wrapped(first[2] + l, job.mesh[2]), first,
                                                weight, slope, z, slope_z, sum);
        }
    }
}

/* Both parts of particle i; where its closest pairs are yet to come (index: its complement), they
 * are left for them in the place of the near part. */
template <int D, typename Real, int from>
static __device__ __forceinline__ void write(const gather_job<D, Real> &job, int64_t slot,
                                             int32_t index, Real source, const Real sum[3])
{
    enum { NUMBERS = from == POTENTIAL ? 1 : D };
    Real *near = &job.near_field[slot * NUMBERS];
    double both[NUMBERS];
    for (int a = 0; a < NUMBERS; a++) {
        double far = from == SLOPES ? (double)sum[a] * (double)job.slope[a] : (double)sum[a];
        both[a] = far + (double)near[a];
        if (index < 0) {
            near[a] = (Real)both[a];
        }
    }
    if (index < 0) {
        return;
    }
    if (from == POTENTIAL) {
        job.to.force[0][index] = job.unit * (both[0] - job.mean - job.self * (double)source);
        return;
    }
    double mobility = job.to.mobility[job.to.species ? job.to.species[index] : 0];
    for (int a = 0; a < NUMBERS; a++) {
        double force = mobility * job.unit * both[a], *target = &job.to.force[a][index];
        *target = job.add ? *target + force : force;
    }
}

template <int D, typename Real, int W, int from>
static __global__
__launch_bounds__(GBG_CUDA_THREADS) void gather(const __grid_constant__ gather_job<D, Real> job)
{
    __shared__ layers<D, Real, W, from> layers;
    int64_t slot = gbg_cuda_index();
    if (slot >= job.n) {
        return;
    }
    gbg_cuda_ewald_record<D, Real> record = job.record[slot];
    int32_t index = job.index[slot];
    uint64_t whole[D];
    int32_t first[D];
    Real z[D], weight[D][W], slope[from == SLOPES ? D : 1][W], sum[3] = {0, 0, 0};
    if ((index < 0 ? ~index : index) >= job.to.owned) {
        return; /* it only acts on others */
    }
    gbg_cuda_ewald_read(job.shift, record, job.top, slot, whole);
#pragma unroll
    for (int a = 0; a < D; a++) {
        first[a] = gbg_cuda_ewald_place(whole[a], job.mesh[a], job.window.width, &z[a]);
    }
    gbg_cuda_ewald_weights<D, Real, W>(job.window, z, weight, from == SLOPES ? slope : NULL);
#pragma unroll
    for (int l = 0; l < W && D == 3; l++) { /* read by the same thread alone */
        layers.kept[0][l][threadIdx.x] = weight[D - 1][l];
        if (from == SLOPES) {
            layers.kept[layers.KINDS - 1][l][threadIdx.x] = slope[from == SLOPES ? D - 1 : 0][l];
        }
    }
    if (first[0] + W <= job.mesh[0]) {
        add_layers<D, Real, W, from, true>(job, layers, first, weight, slope, sum);
    } else {
        add_layers<D, Real, W, from, false>(job, layers, first, weight, slope, sum);
    }
    write<D, Real, from>(job, slot, index, record.source, sum);
}

template <int D, typename Real, int W>
static void start(struct gbg_device *device, const gather_job<D, Real> &job, int from)
{
    unsigned blocks = gbg_cuda_blocks(job.n);
    if (from == FIELDS) {
        gather<D, Real, W, FIELDS><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(job);
    } else if (from == SLOPES) {
        gather<D, Real, W, SLOPES><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(job);
    } else {
        gather<D, Real, W, POTENTIAL><<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(job);
    }
}

template <int D, typename Real>
static int run(struct gbg_device *device, const struct gbg_state *state, struct gbg_ewald *sum,
               const struct gbg_cuda_ewald_output *output)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    gather_job<D, Real> job = {};
    int from = output->potential                        ? POTENTIAL
               : choice->gradient == GBG_GRADIENT_WAVES ? FIELDS
                                                        : SLOPES;
    job.n = sum->n;
    job.record = (const gbg_cuda_ewald_record<D, Real> *)sum->record;
    job.index = sum->index;
    job.top = sum->top;
    memcpy(job.shift, sum->cells.shift, sizeof job.shift);
    job.near_field = (Real *)sum->near_field;
    job.node = (const Real *)sum->mesh;
    job.wide = (const typename pair_of<Real>::type *)sum->wide;
    job.add = output->add;
    job.unit = output->unit;
    job.self = output->self;
    job.mean = output->mean;
    job.to = gbg_cuda_ewald_targets_of(state, output);
    for (int a = 0; a < D; a++) {
        job.mesh[a] = choice->cells[a];
        /* a node is at t = .. - z/2, and the particle moves by dz = 2 cells/length dx: the field is
         * minus the slope */
        job.slope[a] = from == SLOPES
                           ? (Real)(-2.0 * choice->cells[a] / choice->length[a] * choice->reach)
                           : (Real)1;
    }
    gbg_cuda_ewald_fill_window(sum, &job.window);
    switch ((choice->width + 1) / 2) {
    case 2:
        start<D, Real, 4>(device, job, from);
        break;
    case 3:
        start<D, Real, 6>(device, job, from);
        break;
    case 4:
        start<D, Real, 8>(device, job, from);
        break;
    case 5:
        start<D, Real, 10>(device, job, from);
        break;
    case 6:
        start<D, Real, 12>(device, job, from);
        break;
    case 7:
        start<D, Real, 14>(device, job, from);
        break;
    default:
        start<D, Real, 16>(device, job, from);
        break;
    }
    return gbg_cuda_started(device, "far part at the particles");
}

int gbg_cuda_ewald_gather(struct gbg_device *device, const struct gbg_state *state,
                          struct gbg_ewald *sum, const struct gbg_cuda_ewald_output *output)
{
    int d = sum->plan.choice.dimension, single = sum->plan.choice.single;
    return d == 2   ? single ? run<2, float>(device, state, sum, output)
                             : run<2, double>(device, state, sum, output)
             : single ? run<3, float>(device, state, sum, output)
                    : run<3, double>(device, state, sum, output);
}
