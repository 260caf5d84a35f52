/* L1, CUDA: sums over all images by a mesh: the body, and what its kernels share. */
#ifndef GBG_CUDA_EWALD_H
#define GBG_CUDA_EWALD_H

#include "backend/cpu/grid.h"
#include "cuda/ewald_fft.h"
#include "cuda/kernels.h"

extern "C" {
#include "ewald/plan.h"
}

/* A particle in the order of cells. Single precision: 32 bits of each place from bit `shift` below
 * the top on (differences between neighbours do not need those above, and gain as many below), and
 * those above packed in `top`, in space in an array of its own. Double precision: all bits. */
template <int D, typename Real> struct gbg_cuda_ewald_record;
template <> struct alignas(16) gbg_cuda_ewald_record<2, float> {
    uint32_t at[2];
    float source; /* alpha over the largest |alpha| */
    uint32_t top;
};
template <> struct alignas(16) gbg_cuda_ewald_record<3, float> {
    uint32_t at[3];
    float source;
};
template <int D> struct alignas(16) gbg_cuda_ewald_record<D, double> {
    uint64_t at[3];
    double source;
};

/* Bits of `top` for an axis: the largest shift. */
static __host__ __device__ constexpr int gbg_cuda_ewald_top(int dimension)
{
    return dimension == 2 ? 16 : 10;
}

/* Cells of particles, row after row along axis 0, and which of them somebody's reach touches. */
struct gbg_cuda_ewald_cells {
    int32_t cells[3];
    int32_t all[3];    /* 1: the reach touches all cells of this axis */
    int32_t shift[3];  /* single precision: of places in records */
    uint32_t reach[3]; /* in units of high words, a little more */
    float edge[3];     /* of a cell, in units of the reach */
    int32_t *begin;    /* of each cell, and n */
};

/* What is written to. */
struct gbg_cuda_ewald_targets {
    int64_t owned;
    const uint8_t *species;
    double *force[3]; /* or the potential alone */
    double mobility[GBG_SPECIES_MAX];
};

/* How the sums of both parts become what is asked for: their units are those of the reach. */
struct gbg_cuda_ewald_output {
    int add;
    double unit;       /* reach^-power (potential: ^(1-power)) times the largest |alpha| */
    double self, mean; /* potential: far part of a source at its own place, mean of all */
    double *potential; /* NULL: forces */
};

struct gbg_ewald {
    struct gbg_ewald_plan plan;
    double largest; /* |alpha| */
    int64_t n;      /* particles in order */
    struct gbg_cuda_ewald_cells cells;
    int64_t n_cells, begin_capacity, record_capacity, index_capacity, top_capacity;
    void *record;   /* gbg_cuda_ewald_record */
    int32_t *index; /* in the state; the complement while ewald_mend.cu is to add to the sums */
    uint32_t *top;  /* single precision in space */
    /* In the device's workspace: of near pairs dimension (potential: one) numbers a particle,
     * blocked by particles; slots of those whose closest pairs are to be made in double precision.
     */
    void *near_field;
    int32_t *mended, *mended_count;
    void *mesh;        /* sources; potential; in space with GBG_GRADIENT_WAVES field 2 */
    void *wide;        /* GBG_GRADIENT_WAVES: fields 0 and 1, a complex number a node */
    void *influence;   /* (cells[0]/2 + 1) x ... x (cells[1]/2 + 1): of waves n_a >= 0 */
    double *window;    /* double precision: gbg_cuda_ewald_window */
    size_t mesh_bytes; /* of both meshes, one behind the other; sorting works there too */
    double held_bytes; /* of all that lives as long as the sum */
    struct gbg_cuda_fft fft;
};

static inline struct gbg_cuda_ewald_targets
gbg_cuda_ewald_targets_of(const struct gbg_state *state, const struct gbg_cuda_ewald_output *output)
{
    struct gbg_cuda_ewald_targets to = {state->owned, state->species, {}, {}};
    memcpy(to.force, state->force, sizeof to.force);
    memcpy(to.mobility, state->mobility, sizeof to.mobility);
    to.force[0] = output->potential ? output->potential : state->force[0];
    return to;
}

/* Single precision: the square of 2^20 units of places, in units of the reach: that near they are
 * too coarse. */
static inline float gbg_cuda_ewald_close(const struct gbg_ewald *sum, int a)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    double close = ldexp(choice->length[a], -12 - sum->cells.shift[a]) / choice->reach;
    return choice->single ? (float)(close * close) : 0.0f;
}

/* Nodes in a row of the real mesh, in numbers. */
static inline int64_t gbg_cuda_ewald_pitch(const struct gbg_ewald_choice *choice)
{
    return 2 * ((int64_t)choice->cells[0] / 2 + 1);
}

/* All bits of a place that a record keeps, as a fraction of the box. */
template <int D>
static __device__ __forceinline__ uint64_t gbg_cuda_ewald_whole(const int32_t *shift, int a,
                                                                uint32_t at, uint32_t top)
{
    const int bits = gbg_cuda_ewald_top(D);
    uint64_t above = top >> (a * bits) & ((1u << bits) - 1);
    return above << (63 - shift[a]) << 1 | (uint64_t)at << (32 - shift[a]);
}
template <int D>
static __device__ __forceinline__ uint64_t gbg_cuda_ewald_whole(const int32_t *shift, int a,
                                                                uint64_t at, uint32_t top)
{
    (void)shift;
    (void)a;
    (void)top;
    return at;
}

/* What a record holds besides, and its places with all their bits. */
template <int D, typename Real>
static __device__ __forceinline__ void
gbg_cuda_ewald_read(const int32_t *shift, const gbg_cuda_ewald_record<D, Real> &record,
                    const uint32_t *top, int64_t slot, uint64_t whole[D])
{
    uint32_t bits = 0;
    if constexpr (sizeof(Real) == 4 && D == 2) {
        bits = record.top;
    } else if constexpr (sizeof(Real) == 4) {
        bits = top[slot];
    }
#pragma unroll
    for (int a = 0; a < D; a++) {
        whole[a] = gbg_cuda_ewald_whole<D>(shift, a, record.at[a], bits);
    }
}

/* A place in cells (or spacings of the mesh), times 2^32, rounded down. */
static __device__ __forceinline__ uint64_t gbg_cuda_ewald_scaled(uint64_t whole, int32_t cells)
{
    return (whole >> 32) * (uint32_t)cells + __umulhi((uint32_t)whole, (uint32_t)cells);
}
static __device__ __forceinline__ int32_t gbg_cuda_ewald_cell(uint64_t whole, int32_t cells)
{
    return (int32_t)(gbg_cuda_ewald_scaled(whole, cells) >> 32);
}

/* First node of a window of this width, 0 .. cells-1, and the offset z in [-1, 1] between nodes
 * (ewald/window.h). */
static __device__ __forceinline__ int32_t gbg_cuda_ewald_place(uint64_t whole, int32_t cells,
                                                               int32_t width, float *z)
{
    uint64_t scaled = gbg_cuda_ewald_scaled(whole, cells) + (width & 1 ? 0x80000000u : 0u);
    *z = __int2float_rn((int32_t)((uint32_t)scaled ^ 0x80000000u)) * 0x1p-31f;
    int32_t first = (int32_t)(scaled >> 32) - (width - 1) / 2;
    return first < 0 ? first + cells : first;
}
static __device__ __forceinline__ int32_t gbg_cuda_ewald_place(uint64_t whole, int32_t cells,
                                                               int32_t width, double *z)
{
    const uint64_t half = UINT64_C(1) << 63;
    uint64_t low = whole * (uint32_t)cells, moved = low + (width & 1 ? half : 0);
    *z = __ll2double_rn((int64_t)(moved ^ half)) * 0x1p-63;
    int32_t first = gbg_cuda_ewald_cell(whole, cells) + (moved < low ? 1 : 0) - (width - 1) / 2;
    return first < 0 ? first + cells : first;
}

/* Windows of all axes as kernels have them: with their parameters in single precision, where the
 * unit that reads constants feeds the multiply-adds, in memory in double, where these are slower
 * than loads. */
enum { GBG_CUDA_EWALD_TERMS = GBG_EWALD_DEGREE + 1 };
template <int D, typename Real> struct gbg_cuda_ewald_window;
template <int D> struct gbg_cuda_ewald_window<D, float> {
    int32_t width, degree;
    float value[D][GBG_CUDA_EWALD_TERMS][GBG_EWALD_WIDEST];
    __device__ __forceinline__ float at(int a, int k, int l) const
    {
        return value[a][k][l];
    }
};
template <int D> struct gbg_cuda_ewald_window<D, double> {
    int32_t width, degree;
    const double *value; /* the same order, D axes */
    __device__ __forceinline__ double at(int a, int k, int l) const
    {
        return __ldg(value + (a * GBG_CUDA_EWALD_TERMS + k) * GBG_EWALD_WIDEST + l);
    }
};

template <int D>
static inline void gbg_cuda_ewald_fill_window(const struct gbg_ewald *sum,
                                              gbg_cuda_ewald_window<D, float> *window)
{
    *window = {sum->plan.choice.width, 0, {}};
    for (int a = 0; a < D; a++) {
        const struct gbg_ewald_window *from = &sum->plan.window[a];
        window->degree = from->degree > window->degree ? from->degree : window->degree;
        for (int k = 0; k <= from->degree; k++) {
            for (int l = 0; l < GBG_EWALD_WIDEST; l++) {
                window->value[a][k][l] = (float)from->value[k][l];
            }
        }
    }
}
template <int D>
static inline void gbg_cuda_ewald_fill_window(const struct gbg_ewald *sum,
                                              gbg_cuda_ewald_window<D, double> *window)
{
    *window = {sum->plan.choice.width, 0, sum->window};
    for (int a = 0; a < D; a++) {
        int degree = sum->plan.window[a].degree;
        window->degree = degree > window->degree ? degree : window->degree;
    }
}

/* One term of all windows; a term below the highest enters by the case of the highest. */
#define GBG_CUDA_EWALD_TERM(k)                                                                     \
    case k:                                                                                        \
        _Pragma("unroll") for (int a = 0; a < D; a++)                                              \
        {                                                                                          \
            _Pragma("unroll") for (int l = 0; l < W; l++)                                          \
            {                                                                                      \
                if (slope) {                                                                       \
                    slope[a][l] = fma(slope[a][l], z[a], weight[a][l]);                            \
                }                                                                                  \
                weight[a][l] = fma(weight[a][l], z[a], window.at(a, k, l));                        \
            }                                                                                      \
        }                                                                                          \
        [[fallthrough]];

/* Weights of the nodes of all axes, and slopes d weight/dz (NULL: not wanted). */
template <int D, typename Real, int W>
static __device__ __forceinline__ void
gbg_cuda_ewald_weights(const gbg_cuda_ewald_window<D, Real> &window, const Real z[D],
                       Real weight[D][W], Real (*slope)[W])
{
#pragma unroll
    for (int a = 0; a < D; a++) {
#pragma unroll
        for (int l = 0; l < W; l++) {
            weight[a][l] = 0;
            if (slope) {
                slope[a][l] = 0;
            }
        }
    }
    switch (window.degree) {
        GBG_CUDA_EWALD_TERM(19)
        GBG_CUDA_EWALD_TERM(18)
        GBG_CUDA_EWALD_TERM(17)
        GBG_CUDA_EWALD_TERM(16)
        GBG_CUDA_EWALD_TERM(15)
        GBG_CUDA_EWALD_TERM(14)
        GBG_CUDA_EWALD_TERM(13)
        GBG_CUDA_EWALD_TERM(12)
        GBG_CUDA_EWALD_TERM(11)
        GBG_CUDA_EWALD_TERM(10)
        GBG_CUDA_EWALD_TERM(9)
        GBG_CUDA_EWALD_TERM(8)
        GBG_CUDA_EWALD_TERM(7)
        GBG_CUDA_EWALD_TERM(6)
        GBG_CUDA_EWALD_TERM(5)
        GBG_CUDA_EWALD_TERM(4)
        GBG_CUDA_EWALD_TERM(3)
        GBG_CUDA_EWALD_TERM(2)
        GBG_CUDA_EWALD_TERM(1)
        GBG_CUDA_EWALD_TERM(0)
    default:
        break;
    }
}

#endif
