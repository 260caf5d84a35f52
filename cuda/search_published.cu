/* L1, CUDA: neighbour searches of earlier work, for the benchmark only: Green (2010) looks into the
 * 3^d cells around a particle, Perea and Cordero (2017) into the 2^d of the octant that it stands
 * in. Both sort particles by cell, store them in that order in single precision, and give a thread
 * to a particle, which takes one candidate after the other. Rows have a fixed length, so that a
 * single pass writes them: no published code counts first. */
#include <cub/cub.cuh>

#include "cuda/search.h"

namespace
{

struct published {
    int64_t n;
    float length[3], density[3], squared;
    int cells[3];
    float4 *given, *sorted; /* coordinates and the bits of the particle's number */
    uint32_t *key, *key_sorted;
    int32_t *number, *order;
    int32_t *start, *end; /* of a cell: slots; start -1: it is empty */
    int64_t all;          /* cells */
    int32_t *row;         /* entry k of the particle in slot s at k n + s */
    int32_t longest;
    unsigned long long *found;
};

} // namespace

static __global__ void take(const __grid_constant__ struct gbg_search search,
                            const __grid_constant__ struct published p)
{
    int64_t i = gbg_cuda_index();
    if (i < p.n) {
        float r[3] = {0.0f, 0.0f, 0.0f};
        for (int a = 0; a < search.frame.box.dimension; a++) {
            r[a] = (float)search.fraction[a][i] * 0x1p-64f * p.length[a];
        }
        p.given[i] = make_float4(r[0], r[1], r[2], __int_as_float((int32_t)i));
    }
}

static __device__ __forceinline__ int cell_on(const struct published &p, int a, float r)
{
    return min((int)(r * p.density[a]), p.cells[a] - 1);
}

static __global__ void find_keys(const __grid_constant__ struct published p)
{
    int64_t i = gbg_cuda_index();
    if (i < p.n) {
        float4 r = p.given[i];
        uint32_t key = (uint32_t)cell_on(p, 2, r.z);
        key = key * (uint32_t)p.cells[1] + (uint32_t)cell_on(p, 1, r.y);
        p.key[i] = key * (uint32_t)p.cells[0] + (uint32_t)cell_on(p, 0, r.x);
        p.number[i] = (int32_t)i;
    }
}

/* Particles in the order of cells, and where each cell begins and ends. */
static __global__ void reorder(const __grid_constant__ struct published p)
{
    int64_t s = gbg_cuda_index();
    if (s < p.n) {
        uint32_t key = p.key_sorted[s];
        p.sorted[s] = p.given[p.order[s]];
        if (s == 0 || p.key_sorted[s - 1] != key) {
            p.start[key] = (int32_t)s;
        }
        if (s == p.n - 1 || p.key_sorted[s + 1] != key) {
            p.end[key] = (int32_t)(s + 1);
        }
    }
}

/* Neighbours of the particle in slot s in one cell, whose particles stand `shift` away. */
static __device__ __forceinline__ void look(const struct published &p, int64_t s, float3 r,
                                            int64_t cell, int32_t *count)
{
    int32_t first = p.start[cell];
    if (first < 0) {
        return;
    }
    for (int32_t k = first; k < p.end[cell]; k++) {
        float4 other = p.sorted[k];
        float x = r.x - other.x, y = r.y - other.y, z = r.z - other.z;
        if (x * x + y * y + z * z <= p.squared && k != s) {
            if (*count < p.longest) {
                p.row[*count * p.n + s] = __float_as_int(other.w);
            }
            ++*count;
        }
    }
}

template <int DIMENSION, bool OCTANT>
static __global__ void __launch_bounds__(GBG_CUDA_THREADS)
    scan(const __grid_constant__ struct published p)
{
    int64_t s = gbg_cuda_index();
    int32_t count = 0;
    if (s < p.n) {
        float4 own = p.sorted[s];
        const float at[3] = {own.x, own.y, own.z};
        int c[3] = {0, 0, 0}, low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
        for (int a = 0; a < DIMENSION; a++) {
            c[a] = cell_on(p, a, at[a]);
            bool lower = at[a] * p.density[a] - (float)c[a] < 0.5f;
            low[a] = !OCTANT || lower ? -1 : 0;
            high[a] = !OCTANT || !lower ? 1 : 0;
        }
        for (int dz = low[2]; dz <= high[2]; dz++) {
            for (int dy = low[1]; dy <= high[1]; dy++) {
                for (int dx = low[0]; dx <= high[0]; dx++) {
                    int d[3] = {c[0] + dx, c[1] + dy, c[2] + dz};
                    float r[3];
                    for (int a = 0; a < 3; a++) {
                        r[a] = at[a];
                        if (d[a] < 0) {
                            d[a] += p.cells[a];
                            r[a] += p.length[a];
                        } else if (d[a] >= p.cells[a]) {
                            d[a] -= p.cells[a];
                            r[a] -= p.length[a];
                        }
                    }
                    int64_t cell = d[0] + (int64_t)p.cells[0] * (d[1] + (int64_t)p.cells[1] * d[2]);
                    look(p, s, make_float3(r[0], r[1], r[2]), cell, &count);
                }
            }
        }
    }
    count = __reduce_add_sync(0xFFFFFFFFu, count);
    if (threadIdx.x % 32 == 0 && count > 0) {
        atomicAdd(p.found, (unsigned long long)count);
    }
}

static size_t sort_bytes(int64_t n, int bits)
{
    size_t bytes = 0;
    cub::DeviceRadixSort::SortPairs(NULL, bytes, (const uint32_t *)NULL, (uint32_t *)NULL,
                                    (const int32_t *)NULL, (int32_t *)NULL, (int)n, 0, bits);
    return bytes;
}

/* The arrays of a search in one block; base NULL: their size alone. */
static size_t lay_out(struct published *p, void *base, size_t scratch_bytes, void **scratch)
{
    size_t used = 0;
    p->given = (float4 *)gbg_cuda_take(base, &used, p->n, sizeof *p->given);
    p->sorted = (float4 *)gbg_cuda_take(base, &used, p->n, sizeof *p->sorted);
    p->key = (uint32_t *)gbg_cuda_take(base, &used, p->n, sizeof *p->key);
    p->key_sorted = (uint32_t *)gbg_cuda_take(base, &used, p->n, sizeof *p->key_sorted);
    p->number = (int32_t *)gbg_cuda_take(base, &used, p->n, sizeof *p->number);
    p->order = (int32_t *)gbg_cuda_take(base, &used, p->n, sizeof *p->order);
    p->start = (int32_t *)gbg_cuda_take(base, &used, p->all, sizeof *p->start);
    p->end = (int32_t *)gbg_cuda_take(base, &used, p->all, sizeof *p->end);
    p->found = (unsigned long long *)gbg_cuda_take(base, &used, 1, sizeof *p->found);
    p->row = (int32_t *)gbg_cuda_take(base, &used, p->n * p->longest, sizeof *p->row);
    *scratch = gbg_cuda_take(base, &used, (int64_t)scratch_bytes, 1);
    return used;
}

/* What is timed: from coordinates on the device to rows there. */
static int search_once(struct gbg_device *device, const struct published *p, int octant, int deep,
                       void *scratch, size_t scratch_bytes, int bits)
{
    unsigned blocks = gbg_cuda_blocks(p->n);
    cudaStream_t stream = device->stream;
    int status = gbg_cuda_clear(device, p->found, sizeof *p->found);
    if (status == GBG_OK) {
        status = gbg_cuda_status(
            device, cudaMemsetAsync(p->start, 0xFF, (size_t)p->all * sizeof *p->start, stream),
            "emptying cells");
    }
    if (status == GBG_OK) {
        find_keys<<<blocks, GBG_CUDA_THREADS, 0, stream>>>(*p);
        status = gbg_cuda_started(device, "keys of a published search");
    }
    if (status == GBG_OK) {
        status = gbg_cuda_status(device,
                                 cub::DeviceRadixSort::SortPairs(scratch, scratch_bytes, p->key,
                                                                 p->key_sorted, p->number, p->order,
                                                                 (int)p->n, 0, bits, stream),
                                 "sorting into cells");
    }
    if (status == GBG_OK) {
        reorder<<<blocks, GBG_CUDA_THREADS, 0, stream>>>(*p);
        status = gbg_cuda_started(device, "order of a published search");
    }
    if (status == GBG_OK) {
        void (*chosen)(const struct published) = deep ? (octant ? scan<3, true> : scan<3, false>)
                                                      : (octant ? scan<2, true> : scan<2, false>);
        chosen<<<blocks, GBG_CUDA_THREADS, 0, stream>>>(*p);
        status = gbg_cuda_started(device, "published search");
    }
    return status;
}

/* The search between two events; they are gone afterwards. */
static int time_search(struct gbg_device *device, const struct published *p, int octant, int deep,
                       void *scratch, size_t scratch_bytes, int bits, double *seconds)
{
    cudaEvent_t event[2] = {NULL, NULL};
    float ms = 0.0f;
    int status = GBG_OK;
    for (int k = 0; k < 2 && status == GBG_OK; k++) {
        status = gbg_cuda_status(device, cudaEventCreate(&event[k]), "making an event");
    }
    if (status == GBG_OK) {
        status = gbg_cuda_status(device, cudaEventRecord(event[0], device->stream), "an event");
    }
    status = status ? status : search_once(device, p, octant, deep, scratch, scratch_bytes, bits);
    if (status == GBG_OK) {
        status = gbg_cuda_status(device, cudaEventRecord(event[1], device->stream), "an event");
    }
    if (status == GBG_OK) {
        status = gbg_cuda_status(device, cudaEventSynchronize(event[1]), "published search");
    }
    if (status == GBG_OK) {
        status = gbg_cuda_status(device, cudaEventElapsedTime(&ms, event[0], event[1]), "an event");
    }
    for (int k = 0; k < 2; k++) {
        if (event[k]) {
            cudaEventDestroy(event[k]);
        }
    }
    *seconds = 1e-3 * ms;
    return status;
}

/* Cells of edge `edge` or more; GBG_E_ARGUMENT with fewer than three on an axis. */
static int choose_cells(struct gbg_device *device, const struct gbg_search *search, double edge,
                        struct published *p)
{
    p->all = 1;
    for (int a = 0; a < 3; a++) {
        double length = a < search->frame.box.dimension ? search->frame.box.length[a] : 1.0;
        p->cells[a] = a < search->frame.box.dimension ? (int)fmin(length / edge, 30000.0) : 1;
        p->length[a] = (float)length;
        p->density[a] = (float)(p->cells[a] / length);
        p->all *= p->cells[a];
        if (a < search->frame.box.dimension && p->cells[a] < 3) {
            return gbg_fail(device->context, GBG_E_ARGUMENT,
                            "a published search needs three cells on each axis; %d of edge %g fit",
                            p->cells[a], edge);
        }
    }
    return p->all < INT32_MAX
               ? GBG_OK
               : gbg_fail(device->context, GBG_E_ARGUMENT,
                          "%lld cells are too many for a published search", (long long)p->all);
}

int gbg_cuda_search_published(struct gbg_device *device, struct gbg_search *search, int octant,
                              double edge, double *seconds, int64_t *rows)
{
    struct published p = {};
    void *base = NULL, *scratch;
    unsigned long long found = 0;
    int bits = 1, deep = search->frame.box.dimension > 2;
    p.n = search->frame.n;
    p.squared = (float)(search->frame.plan.radius * search->frame.plan.radius);
    *seconds = 0.0;
    *rows = 0;
    if (p.n == 0 || !search->has_result) {
        return GBG_OK;
    }
    int status = choose_cells(device, search, edge, &p);
    while (bits < 32 && (p.all - 1) >> bits > 0) {
        bits++;
    }
    p.longest = (int32_t)(search->out.longest + 2); /* single precision may see a pair more */
    size_t scratch_bytes = sort_bytes(p.n, bits);
    int64_t bytes = (int64_t)lay_out(&p, NULL, scratch_bytes, &scratch);
    status = status ? status : gbg_cuda_allocate(device, &base, bytes, 1, "published search");
    if (status == GBG_OK) {
        lay_out(&p, base, scratch_bytes, &scratch);
        take<<<gbg_cuda_blocks(p.n), GBG_CUDA_THREADS, 0, device->stream>>>(*search, p);
        status = gbg_cuda_started(device, "coordinates of a published search");
    }
    status = status ? status
                    : time_search(device, &p, octant, deep, scratch, scratch_bytes, bits, seconds);
    status = status ? status : gbg_cuda_fetch(device, &found, p.found, sizeof found);
    *rows = (int64_t)found;
    gbg_cuda_release(device, base, bytes, 1);
    return status;
}
