/* L1, CUDA: pairs of a sum by a mesh in single precision that are closer than its places are exact
 * for: in double precision, from all bits, added to what the other parts have given. */
#include "cuda/ewald_kernels.h"
#include "cuda/ewald_visit.h"

namespace
{

template <int D> struct mend_job {
    struct gbg_cuda_ewald_cells cells;
    const gbg_cuda_ewald_record<D, float> *record;
    const uint32_t *top;
    const int32_t *index, *mended, *mended_count;
    const float *sums; /* of the other parts, where gather has left them */
    const uint32_t *high[D], *low[D];
    float close, scale[3]; /* as in ewald_near.cu */
    int potential, degree, add;
    double self, mean;              /* gbg_cuda_ewald_output */
    double quantum[3], power, unit; /* lengths in units of the reach */
    double coefficient[GBG_SPLIT_DEGREE + 1];
    struct gbg_cuda_ewald_targets to;
};

} // namespace

/* What a pair of a unit source gives: over r, as the law and the polynomial of ewald_near.cu. */
template <int D> static __device__ double pair(const mend_job<D> &job, const double r[D])
{
    double q = 0.0, sum = 0.0, s = job.power - 1.0;
    for (int a = 0; a < D; a++) {
        q = fma(r[a], r[a], q);
    }
    for (int k = job.degree; k >= 0; k--) {
        sum = fma(sum, fma(2.0, q, -1.0), job.coefficient[k]);
    }
    if (q == 0.0) {
        return job.potential ? -sum : 0.0;
    }
    if (!job.potential) {
        return pow(q, -0.5 * (job.power + 1.0)) - sum;
    }
    return (s > 0.0 ? pow(q, -0.5 * s) / s : -0.5 * log(q)) - sum;
}

template <int D>
static __device__ void read_words(const mend_job<D> &job, int32_t slot, uint64_t word[D])
{
    int32_t i = job.index[slot];
    i = i < 0 ? ~i : i;
    for (int a = 0; a < D; a++) {
        word[a] = gbg_join(job.high[a][i], job.low[a][i]);
    }
}

template <int D>
static __device__ void write_mended(const mend_job<D> &job, int32_t slot, int32_t i, double source,
                                    const double sum[D])
{
    if (job.potential) {
        double both = (double)job.sums[slot] + sum[0];
        job.to.force[0][i] = job.unit * (both - job.mean - job.self * source);
        return;
    }
    double mobility = job.to.mobility[job.to.species ? job.to.species[i] : 0];
    for (int a = 0; a < D; a++) {
        double force = mobility * job.unit * ((double)job.sums[(int64_t)slot * D + a] + sum[a]);
        double *target = &job.to.force[a][i];
        *target = job.add ? *target + force : force;
    }
}

/* All pairs of one particle that are that close. */
template <int D> static __device__ void mend_one(const mend_job<D> &job, int32_t slot)
{
    const gbg_cuda_ewald_record<D, float> own = job.record[slot];
    uint64_t whole[D], word[D];
    uint32_t high[D];
    double sum[D] = {};
    int32_t i = ~job.index[slot];
    if (i >= job.to.owned) {
        return;
    }
    gbg_cuda_ewald_read(job.cells.shift, own, job.top, slot, whole);
    read_words(job, slot, word);
    for (int a = 0; a < D; a++) {
        high[a] = (uint32_t)(whole[a] >> 32);
    }
    gbg_cuda_ewald_visit<D>(job.cells, high, [&](int32_t k) {
        const gbg_cuda_ewald_record<D, float> other = job.record[k];
        float coarse[D];
        if (k == slot ||
            gbg_cuda_ewald_squared<D, float>(own, other, job.scale, coarse) > job.close) {
            return;
        }
        uint64_t there[D];
        double r[D];
        read_words(job, k, there);
        for (int a = 0; a < D; a++) {
            r[a] = (double)(int64_t)(word[a] - there[a]) * job.quantum[a];
        }
        double f = pair(job, r) * (double)other.source;
        for (int a = 0; a < (job.potential ? 1 : D); a++) {
            sum[a] += job.potential ? f : f * r[a];
        }
    });
    write_mended(job, slot, i, (double)own.source, sum);
}

/* Those of the list, whatever its order: each has its own numbers. */
template <int D>
static __global__
__launch_bounds__(GBG_CUDA_THREADS) void mend(const __grid_constant__ mend_job<D> job)
{
    int32_t count = *job.mended_count;
    for (int64_t k = gbg_cuda_index(); k < count; k += (int64_t)gridDim.x * blockDim.x) {
        mend_one(job, job.mended[k]);
    }
}

template <int D>
static int run(struct gbg_device *device, const struct gbg_state *state, struct gbg_ewald *sum,
               const struct gbg_cuda_ewald_output *output)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    const struct gbg_split *split = &sum->plan.split;
    mend_job<D> job = {};
    job.cells = sum->cells;
    job.record = (const gbg_cuda_ewald_record<D, float> *)sum->record;
    job.top = sum->top;
    job.index = sum->index;
    job.mended = sum->mended;
    job.mended_count = sum->mended_count;
    job.sums = (const float *)sum->near_field;
    job.add = output->add;
    job.self = output->self;
    job.mean = output->mean;
    job.potential = output->potential != NULL;
    job.degree = split->degree;
    job.power = choice->power;
    job.unit = output->unit;
    job.to = gbg_cuda_ewald_targets_of(state, output);
    for (int a = 0; a < D; a++) {
        job.high[a] = state->high[a];
        job.low[a] = state->low[a];
        job.scale[a] = (float)(ldexp(choice->length[a], -32 - sum->cells.shift[a]) / choice->reach);
        job.close = fmaxf(job.close, gbg_cuda_ewald_close(sum, a));
        job.quantum[a] = ldexp(choice->length[a], -64) / choice->reach;
    }
    for (int k = 0; k <= split->degree; k++) {
        job.coefficient[k] = job.potential ? split->potential[k] : split->near[k];
    }
    unsigned most = 8 * (unsigned)device->multiprocessors, blocks = gbg_cuda_blocks(sum->n);
    blocks = blocks < most ? blocks : most;
    mend<<<blocks, GBG_CUDA_THREADS, 0, device->stream>>>(job);
    return gbg_cuda_started(device, "closest pairs of a sum by a mesh");
}

int gbg_cuda_ewald_mend(struct gbg_device *device, const struct gbg_state *state,
                        struct gbg_ewald *sum, const struct gbg_cuda_ewald_output *output)
{
    return sum->plan.choice.dimension == 2 ? run<2>(device, state, sum, output)
                                           : run<3>(device, state, sum, output);
}
