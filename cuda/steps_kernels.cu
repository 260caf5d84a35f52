/* L1, CUDA: the kernels of a batch of steps. A small system goes through all steps in one kernel,
 * whose blocks wait for each other; a large one, where waiting is cheap beside the work, has
 * kernels for the parts of a step. */
#include "cuda/kernels.h"
#include "cuda/steps_phases.h"

/* Threads of a block, blocks of a cluster at most. */
enum { THREADS = 256, CLUSTER = 16 };

static __global__ void start(control_t *control, int limit, int turn, uint64_t first)
{
    char *bytes = (char *)control->slot;
    for (unsigned int k = threadIdx.x; k < (unsigned)limit * sizeof(slot_t); k += blockDim.x) {
        bytes[k] = 0;
    }
    __syncthreads();
    for (int k = (int)threadIdx.x; k < limit; k += (int)blockDim.x) {
        control->slot[k].moves.bad = GBG_CUDA_NONE;
    }
    if (threadIdx.x == 0) {
        control->halt = control->stale = control->done = control->undo = control->spoiled = 0;
        control->limit = limit;
        control->turn = turn;
        control->first = first;
        control->ticket = 0;
        control->found = 0;
    }
}

/* Calls decide() in one thread when all blocks of the kernel have come here. */
template <typename Decide>
static __device__ __forceinline__ void when_all_done(control_t *control, Decide decide)
{
    __syncthreads();
    if (threadIdx.x == 0) {
        __threadfence(); /* also for what the block's other threads have given on */
        if (atomicAdd(&control->ticket, 1u) == gridDim.x - 1) {
            __threadfence();
            control->ticket = 0;
            decide();
        }
    }
}

/* Whether all blocks of the kernel are one cluster, whose barrier is in hardware. */
static __device__ __forceinline__ bool are_one_cluster()
{
#if __CUDA_ARCH__ >= 900
    unsigned int blocks;
    asm("mov.u32 %0, %%cluster_nctaid.x;" : "=r"(blocks));
    return blocks == gridDim.x;
#else
    return false;
#endif
}

/* Waits for all threads of the cluster, and sees what they have written. */
static __device__ __forceinline__ void wait_for_cluster()
{
#if __CUDA_ARCH__ >= 900
    asm volatile("barrier.cluster.arrive.release.aligned;\n"
                 "barrier.cluster.wait.acquire.aligned;" ::
                     : "memory");
#endif
}

/* Waits for all blocks of the kernel, the last of which to come calls decide() before. *generation:
 * how often they have met, in the first thread of a block. */
template <typename Decide>
static __device__ __forceinline__ void meet_by_counting(control_t *control,
                                                        unsigned int *generation, Decide decide)
{
    __syncthreads();
    if (threadIdx.x == 0) {
        volatile unsigned int *common = &control->generation;
        __threadfence();
        if (gridDim.x == 1 || atomicAdd(&control->arrived, 1u) == gridDim.x - 1) {
            __threadfence();
            control->arrived = 0;
            decide();
            __threadfence();
            *common = *generation + 1;
        } else {
            while (*common == *generation) {
            }
        }
        __threadfence();
        *generation += 1;
    }
    __syncthreads();
}

/* The same in whichever way is the fastest. */
template <typename Decide>
static __device__ __forceinline__ void meet(control_t *control, unsigned int *generation,
                                            Decide decide)
{
    if (are_one_cluster()) {
        wait_for_cluster();
        if (blockIdx.x == 0 && threadIdx.x == 0) {
            decide();
        }
        wait_for_cluster();
    } else {
        meet_by_counting(control, generation, decide);
    }
}

/* The same with nothing to decide. */
static __device__ __forceinline__ void meet(control_t *control, unsigned int *generation)
{
    if (are_one_cluster()) {
        wait_for_cluster();
    } else {
        meet_by_counting(control, generation, [] {});
    }
}

static __device__ __forceinline__ bool halted(const control_t *control)
{
    return __ldcg(&control->halt) != 0;
}

/* After a first look that found overlaps: rounds until nobody overlaps, and the certificate. */
template <int dimension>
static __device__ void part(const work_t &work, int step, unsigned int *generation)
{
    control_t *control = work.control;
    for (int64_t round = 1; !__ldcg(&control->parted); round++) {
        apply<dimension>(work, step, round);
        meet(control, generation, [&] { decide_applied(work, step); });
        if (__ldcg(&control->parted)) {
            break;
        }
        find<dimension>(work, step, round);
        meet(control, generation,
             [&] { decide_found(work, step, round, __ldcg(&control->found)); });
    }
    if (!halted(control) && __ldcg(&control->done) == step) {
        certify<dimension>(work, step);
        meet(control, generation, [&] { decide_certified(work, step, seen(work, step)); });
    }
}

template <int dimension, int law, bool cores>
static __global__ void __launch_bounds__(THREADS) together(const __grid_constant__ work_t work)
{
    control_t *control = work.control;
    unsigned int met = __ldcg(&control->generation), *generation = &met;
    int limit = control->limit;
    bool stopped = halted(control);
    for (int step = 0; step < limit && !stopped; step++) {
        advance<dimension, law, cores>(work, step);
        if (!cores) {
            meet(control, generation,
                 [&] { decide_advanced<cores>(work, step, seen(work, step)); });
            stopped = halted(control);
            continue;
        }
        meet(control, generation);
        find<dimension>(work, step, 0);
        certify<dimension>(work, step);
        meet(control, generation, [&] { decide_moved_and_looked(work, step); });
        int parted = __ldcg(&control->parted);
        stopped = halted(control);
        if (!parted) {
            part<dimension>(work, step, generation);
            stopped = halted(control);
        }
    }
}

template <int dimension, int law, bool cores>
static __global__ void __launch_bounds__(THREADS, 4)
    advance_alone(const __grid_constant__ work_t work, int step)
{
    if (!halted(work.control)) {
        advance<dimension, law, cores>(work, step);
        when_all_done(work.control, [&] { decide_advanced<cores>(work, step, seen(work, step)); });
    }
}

template <int dimension>
static __global__ void __launch_bounds__(THREADS, 5)
    look_alone(const __grid_constant__ work_t work, int step)
{
    if (!halted(work.control)) {
        find<dimension>(work, step, 0);
        certify<dimension>(work, step);
        when_all_done(work.control, [&] {
            decide_looked(work, step, seen(work, step), __ldcg(&work.control->found));
        });
    }
}

template <int dimension>
static __global__ void __launch_bounds__(THREADS, 4)
    part_alone(const __grid_constant__ work_t work, int step)
{
    if (!halted(work.control)) {
        unsigned int met = __ldcg(&work.control->generation);
        part<dimension>(work, step, &met);
    }
}

static __global__ void bridged(const __grid_constant__ work_t work,
                               const struct bridge_results *results, int64_t capacity, int step)
{
    if (!halted(work.control)) {
        decide_bridged(work, results, capacity, step);
    }
}

template <int dimension>
static __global__ void __launch_bounds__(THREADS) begin_alone(const __grid_constant__ work_t work)
{
    begin<dimension>(work);
    when_all_done(work.control, [&] { decide_begun(work); });
}

/* Local coordinates of the list of forces. */
template <int dimension>
static __global__ void __launch_bounds__(THREADS) follow(const __grid_constant__ work_t work)
{
    const struct gbg_state &state = work.state;
    if (halted(work.control)) {
        return;
    }
    for (int64_t i = gbg_cuda_index(); i < work.pairs.n; i += threads_in_all()) {
        for (int a = 0; a < dimension; a++) {
            work.pairs.local[a][i] =
                gbg_cuda_local(state.high[a][i], state.low[a][i], work.pairs.shift[a]);
        }
    }
}

template <int dimension, bool sources>
static __global__ void __launch_bounds__(THREADS)
    unpack(const __grid_constant__ work_t work, int turn)
{
    typedef typename gbg_cuda_place<dimension, sources>::type place;
    for (int64_t i = gbg_cuda_index(); i < work.pairs.n; i += threads_in_all()) {
        place own = ((const place *)work.place[turn])[i];
        for (int a = 0; a < dimension; a++) {
            work.pairs.local[a][i] = gbg_cuda_on_axis(own, a);
        }
    }
}

template <int dimension>
static __global__ void __launch_bounds__(THREADS)
    take_back_alone(const __grid_constant__ work_t work)
{
    take_back<dimension>(work);
}

/* Blocks for n threads, but no more than are at work at once. */
static int blocks_at_once(struct gbg_device *device, const void *kernel, int threads, int64_t n,
                          unsigned *blocks)
{
    int each = 0;
    int status = gbg_cuda_status(
        device, cudaOccupancyMaxActiveBlocksPerMultiprocessor(&each, kernel, threads, 0),
        "asking for room for a batch of steps");
    int64_t most = (int64_t)each * device->multiprocessors, wanted = gbg_cuda_blocks(n, threads);
    *blocks = (unsigned)(wanted < 1 || most < 1 ? 1 : wanted < most ? wanted : most);
    return status;
}

/* Starts a kernel whose blocks wait for each other. */
static int start_at_once(struct gbg_device *device, const void *kernel, int threads, int64_t n,
                         void **arguments)
{
    unsigned blocks;
    int status = blocks_at_once(device, kernel, threads, n, &blocks);
    return status ? status
                  : gbg_cuda_status(device,
                                    cudaLaunchCooperativeKernel(kernel, dim3(blocks),
                                                                dim3((unsigned)threads), arguments,
                                                                0, device->stream),
                                    "a batch of steps");
}

/* Starts a kernel whose blocks are one cluster; *started 0: this GPU cannot. */
static int start_cluster(struct gbg_device *device, const void *kernel, int64_t n, void **arguments,
                         int *started)
{
    int threads = (int)((n + 32 * CLUSTER - 1) / (32 * CLUSTER)) * 32, clusters = 0;
    cudaLaunchAttribute whole;
    cudaLaunchConfig_t config = {};
    *started = 0;
    if (!device->clusters || threads > THREADS) {
        return GBG_OK;
    }
    config.blockDim = dim3((unsigned)threads);
    config.gridDim = dim3((unsigned)((n + threads - 1) / threads));
    config.stream = device->stream;
    whole.id = cudaLaunchAttributeClusterDimension;
    whole.val.clusterDim = {config.gridDim.x, 1, 1};
    config.attrs = &whole;
    config.numAttrs = 1;
    if (cudaFuncSetAttribute(kernel, cudaFuncAttributeNonPortableClusterSizeAllowed, 1) !=
            cudaSuccess ||
        cudaOccupancyMaxActiveClusters(&clusters, kernel, &config) != cudaSuccess || clusters < 1) {
        cudaGetLastError(); /* it is no failure: there is another way */
        return GBG_OK;
    }
    *started = 1;
    return gbg_cuda_status(device, cudaLaunchKernelExC(&config, kernel, arguments),
                           "a batch of steps");
}

typedef void (*of_step)(const work_t, int);
typedef void (*of_batch)(const work_t);

template <int dimension, bool cores> static of_step choose_advance(int law)
{
    return law == GBG_CUDA_FREE      ? advance_alone<dimension, GBG_CUDA_FREE, cores>
           : law == GBG_CUDA_STORED  ? advance_alone<dimension, GBG_CUDA_STORED, cores>
           : law == GBG_CUDA_POWER_2 ? advance_alone<dimension, GBG_CUDA_POWER_2, cores>
                                     : advance_alone<dimension, GBG_CUDA_POWER_6, cores>;
}

template <int dimension, bool cores> static of_batch choose_together(int law)
{
    return law == GBG_CUDA_FREE      ? together<dimension, GBG_CUDA_FREE, cores>
           : law == GBG_CUDA_POWER_2 ? together<dimension, GBG_CUDA_POWER_2, cores>
                                     : together<dimension, GBG_CUDA_POWER_6, cores>;
}

/* A kernel of a step, in as many blocks as are at work at once: a block that ends waits for its
 * last writes, which costs too much for a particle a thread. */
static int start_part(struct gbg_device *device, of_step kernel, const struct gbg_cuda_work *work,
                      int step)
{
    unsigned blocks;
    int status = blocks_at_once(device, (const void *)kernel, THREADS, work->state.owned, &blocks);
    if (status == GBG_OK) {
        kernel<<<blocks, THREADS, 0, device->stream>>>(*work, step);
        status = gbg_cuda_started(device, "a step");
    }
    return status;
}

int gbg_cuda_steps_begin(struct gbg_device *device, const struct gbg_cuda_work *work, int limit,
                         int turn, uint64_t first, int renew)
{
    start<<<1, THREADS, 0, device->stream>>>(work->control, limit, turn, first);
    int status = gbg_cuda_started(device, "a batch of steps");
    if (status == GBG_OK && renew) {
        (work->state.box.dimension == 2
             ? begin_alone<2>
             : begin_alone<
                   3>)<<<gbg_cuda_blocks(work->state.owned, THREADS), THREADS, 0, device->stream>>>(
            *work);
        status = gbg_cuda_started(device, "the places of a batch of steps");
    }
    return status;
}

int gbg_cuda_steps_together(struct gbg_device *device, const struct gbg_cuda_work *work, int law)
{
    int64_t n = work->state.owned;
    bool flat = work->state.box.dimension == 2, cores = work->contacts.n > 0;
    of_batch kernel = flat ? cores ? choose_together<2, true>(law) : choose_together<2, false>(law)
                      : cores ? choose_together<3, true>(law)
                              : choose_together<3, false>(law);
    int64_t each = (n + device->multiprocessors - 1) / device->multiprocessors;
    int threads = each > THREADS ? (int)THREADS : (int)((each + 31) / 32 * 32);
    void *arguments[] = {(void *)work};
    int started, status = start_cluster(device, (const void *)kernel, n, arguments, &started);
    return status || started ? status
                             : start_at_once(device, (const void *)kernel, threads, n, arguments);
}

int gbg_cuda_steps_follow(struct gbg_device *device, const struct gbg_cuda_work *work)
{
    (work->state.box.dimension == 2
         ? follow<2>
         : follow<3>)<<<gbg_cuda_blocks(work->state.owned, THREADS), THREADS, 0, device->stream>>>(
        *work);
    return gbg_cuda_started(device, "following the pair list");
}

int gbg_cuda_steps_unpack(struct gbg_device *device, const struct gbg_cuda_work *work, int turn)
{
    of_step kernel = work->state.box.dimension == 3 ? unpack<3, true>
                     : work->state.source           ? unpack<2, true>
                                                    : unpack<2, false>;
    kernel<<<gbg_cuda_blocks(work->state.owned, THREADS), THREADS, 0, device->stream>>>(*work,
                                                                                        turn);
    return gbg_cuda_started(device, "places of a step");
}

int gbg_cuda_steps_move(struct gbg_device *device, const struct gbg_cuda_work *work, int law,
                        int step)
{
    bool flat = work->state.box.dimension == 2, cores = work->contacts.n > 0;
    of_step kernel = flat    ? cores ? choose_advance<2, true>(law) : choose_advance<2, false>(law)
                        : cores ? choose_advance<3, true>(law)
                             : choose_advance<3, false>(law);
    return start_part(device, kernel, work, step);
}

int gbg_cuda_steps_bridged(struct gbg_device *device, const struct gbg_cuda_work *work,
                           const struct bridge_results *results, int64_t capacity, int step)
{
    bridged<<<1, 1, 0, device->stream>>>(*work, results, capacity, step);
    return gbg_cuda_started(device, "the rule bridge in a step");
}

int gbg_cuda_steps_part(struct gbg_device *device, const struct gbg_cuda_work *work, int step)
{
    bool flat = work->state.box.dimension == 2;
    void *arguments[] = {(void *)work, &step};
    int status = start_part(device, flat ? look_alone<2> : look_alone<3>, work, step);
    return status ? status
                  : start_at_once(device,
                                  flat ? (const void *)part_alone<2> : (const void *)part_alone<3>,
                                  THREADS, work->state.owned, arguments);
}

int gbg_cuda_steps_take_back(struct gbg_device *device, const struct gbg_cuda_work *work)
{
    (work->state.box.dimension == 2
         ? take_back_alone<2>
         : take_back_alone<
               3>)<<<gbg_cuda_blocks(work->state.owned, THREADS), THREADS, 0, device->stream>>>(
        *work);
    return gbg_cuda_started(device, "taking a step back");
}
