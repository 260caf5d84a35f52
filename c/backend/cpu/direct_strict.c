/* L1, CPU, per instruction set: minimum-image sums over all pairs with the same bits as on a GPU
 * (direct_strict.h). Targets stand in lanes, sources follow each other in the order of ids. */
#define GBG_EXACT_FMA /* generic lanes too fuse multiply-adds here */
#include "backend/cpu/direct_strict.h"
#include "backend/backend.h"
#include "backend/cpu/cpu.h"
#include "backend/cpu/variant.h"

#define VECTORS 4 /* of targets at a time */
#define GROUP (VECTORS * VF_LANES)
#define ALWAYS static inline __attribute__((always_inline))

/* Particles in the order of ids, padded with sources of strength 0 to whole blocks. */
struct packed {
    int64_t n, padded;
    uint64_t *position[3];
    int32_t *high[3];
    double *alpha;
    float *single_alpha;
    int32_t *index; /* of each in the state */
};

/* Sums of a group of targets over a span. */
struct totals {
    double sum[3][GROUP];
};

static int lay_out(struct gbg_device *device, int64_t n, int dimension, struct packed *p)
{
    void *memory;
    p->n = n;
    p->padded = (n + GBG_STRICT_BLOCK - 1) / GBG_STRICT_BLOCK * GBG_STRICT_BLOCK;
    size_t room = (size_t)p->padded * (size_t)(dimension * (8 + 4) + 8 + 4 + 4);
    int status = gbg_cpu_workspace(device, room, &memory);
    if (status != GBG_OK) {
        return status;
    }
    p->alpha = memory;
    p->position[0] = (uint64_t *)(p->alpha + p->padded);
    for (int a = 1; a < dimension; a++) {
        p->position[a] = p->position[a - 1] + p->padded;
    }
    p->high[0] = (int32_t *)(p->position[dimension - 1] + p->padded);
    for (int a = 1; a < dimension; a++) {
        p->high[a] = p->high[a - 1] + p->padded;
    }
    p->single_alpha = (float *)(p->high[dimension - 1] + p->padded);
    p->index = (int32_t *)(p->single_alpha + p->padded);
    return GBG_OK;
}

static void pack(const struct gbg_state *state, const struct gbg_strict *s, int threads,
                 const struct packed *p)
{
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int64_t i = 0; i < p->padded; i++) {
        int real = i < p->n;
        int64_t k = real ? gbg_strict_place(state, i) : i;
        p->index[k] = (int32_t)i;
        p->alpha[k] = real ? gbg_strict_alpha(s, state, i) : 0.0;
        p->single_alpha[k] = (float)p->alpha[k];
        for (int a = 0; a < s->dimension; a++) {
            uint32_t high = real ? state->high[a][i] : 0, low = real ? state->low[a][i] : 0;
            p->high[a][k] = (int32_t)high;
            p->position[a][k] = (uint64_t)high << 32 | low;
        }
    }
}

/* Targets i.. of half a vector and source k, in double precision. */
ALWAYS void add_fine(const struct gbg_strict *s, const struct packed *p, int64_t i, int64_t k,
                     vdm these, int dimension, vd *sum)
{
    vl difference[3];
    for (int a = 0; a < dimension; a++) {
        difference[a] = vl_sub(vl_load(p->position[a] + i), vl_set((int64_t)p->position[a][k]));
    }
    gbg_strict_add_fine(s, difference, vd_set(p->alpha[k]), these, dimension, sum);
}

ALWAYS void load_totals(const struct totals *t, int lane, int dimension, vd *sum)
{
    for (int a = 0; a < dimension; a++) {
        sum[a] = vd_load(t->sum[a] + lane);
    }
}

ALWAYS void store_totals(struct totals *t, int lane, int dimension, const vd *sum)
{
    for (int a = 0; a < dimension; a++) {
        vd_store(t->sum[a] + lane, sum[a]);
    }
}

/* A group and a block of sources without doubtful pairs: single-precision sums. Returns 1, and the
 * sums are void, if there are some. */
ALWAYS int sweep(const struct gbg_strict *s, const struct packed *p, int64_t i, int64_t k,
                 vf sum[VECTORS][3], int dimension, int law)
{
    const vi near = vi_of_bits(vf_set(s->near));
    vi own[VECTORS][3], least = near, lowest = vi_set(0);
    for (int v = 0; v < VECTORS; v++) {
        for (int a = 0; a < dimension; a++) {
            own[v][a] = vi_load(p->high[a] + i + v * VF_LANES);
            sum[v][a] = vf_set(0.0f);
        }
    }
    for (int64_t row = k; row < k + GBG_STRICT_BLOCK; row++) {
        const vf strength = vf_set(p->single_alpha[row]);
        for (int v = 0; v < VECTORS; v++) {
            vi difference[3];
            vf r[3];
            for (int a = 0; a < dimension; a++) {
                difference[a] = vi_sub(own[v][a], vi_set(p->high[a][row]));
                lowest = vi_min(lowest, difference[a]);
            }
            vf squared = gbg_strict_vector(s->scale, difference, dimension, r);
            /* Floats that are not negative are in the order of their bits. */
            least = vi_min(least, vi_of_bits(squared));
            vf w = vf_mul(gbg_strict_weight(squared, s->general, law), strength);
            for (int a = 0; a < dimension; a++) {
                sum[v][a] = vf_fma(w, r[a], sum[v][a]);
            }
        }
    }
    return vm_any(vm_or(vi_lt(least, near), vi_eq(lowest, vi_set(INT32_MIN))));
}

/* A vector of targets and a block in which pairs may be doubtful. */
ALWAYS void sweep_doubtful(const struct gbg_strict *s, const struct packed *p, int64_t i, int64_t k,
                           vf sum[3], struct totals *t, int lane, int dimension, int law)
{
    for (int a = 0; a < dimension; a++) {
        sum[a] = vf_set(0.0f);
    }
    for (int64_t row = k; row < k + GBG_STRICT_BLOCK; row++) {
        vi difference[3];
        vf r[3];
        for (int a = 0; a < dimension; a++) {
            difference[a] = vi_sub(vi_load(p->high[a] + i), vi_set(p->high[a][row]));
        }
        vf squared = gbg_strict_vector(s->scale, difference, dimension, r);
        vm doubt = gbg_strict_doubtful(squared, s->near, difference, dimension);
        vf w = vf_mul(gbg_strict_weight(squared, s->general, law), vf_set(p->single_alpha[row]));
        w = vf_keep(vm_not(doubt), w);
        for (int a = 0; a < dimension; a++) {
            sum[a] = vf_fma(w, r[a], sum[a]);
        }
        uint32_t bits = vm_bits(doubt);
        for (int half = 0; half < VF_LANES && bits; half += VD_LANES) {
            vd total[3];
            load_totals(t, lane + half, dimension, total);
            add_fine(s, p, i + half, row, vdm_from_bits(bits >> half & ((1u << VD_LANES) - 1)),
                     dimension, total);
            store_totals(t, lane + half, dimension, total);
        }
    }
}

/* A group and the sources of a span, of which there are `end` - k. */
ALWAYS void span(const struct gbg_strict *s, const struct packed *p, int64_t i, int64_t k,
                 int64_t end, struct totals *t, int dimension, int law)
{
    for (; k < end; k += GBG_STRICT_BLOCK) {
        vf sum[VECTORS][3];
        int doubts = sweep(s, p, i, k, sum, dimension, law);
        for (int v = 0; v < VECTORS; v++) {
            int lane = v * VF_LANES;
            if (doubts) {
                sweep_doubtful(s, p, i + lane, k, sum[v], t, lane, dimension, law);
            }
            for (int a = 0; a < dimension; a++) {
                double *to = t->sum[a] + lane;
                vd_store(to, vd_add(vd_load(to), vd_low(sum[v][a])));
                vd_store(to + VD_LANES, vd_add(vd_load(to + VD_LANES), vd_high(sum[v][a])));
            }
        }
    }
}

/* The same, every pair in double precision. */
ALWAYS void span_fine(const struct gbg_strict *s, const struct packed *p, int64_t i, int64_t k,
                      int64_t end, struct totals *t, int dimension)
{
    for (int lane = 0; lane < GROUP; lane += VD_LANES) {
        vd sum[3];
        load_totals(t, lane, dimension, sum);
        for (int64_t row = k; row < end; row++) {
            add_fine(s, p, i + lane, row, vdm_from_bits((1u << VD_LANES) - 1), dimension, sum);
        }
        store_totals(t, lane, dimension, sum);
    }
}

#define DEFINE_SPAN(name, dimension, law)                                                          \
    static void name(const struct gbg_strict *s, const struct packed *p, int64_t i, int64_t k,     \
                     int64_t end, struct totals *t)                                                \
    {                                                                                              \
        span(s, p, i, k, end, t, dimension, law);                                                  \
    }
#define DEFINE_FINE(name, dimension)                                                               \
    static void name(const struct gbg_strict *s, const struct packed *p, int64_t i, int64_t k,     \
                     int64_t end, struct totals *t)                                                \
    {                                                                                              \
        span_fine(s, p, i, k, end, t, dimension);                                                  \
    }

DEFINE_FINE(fine_2d, 2)
DEFINE_FINE(fine_3d, 3)
DEFINE_SPAN(span_2d, 2, GBG_STRICT_GENERAL)
DEFINE_SPAN(span_3d, 3, GBG_STRICT_GENERAL)
DEFINE_SPAN(span_2d_1, 2, 1)
DEFINE_SPAN(span_3d_1, 3, 1)
DEFINE_SPAN(span_2d_2, 2, 2)
DEFINE_SPAN(span_3d_2, 3, 2)
DEFINE_SPAN(span_2d_3, 2, 3)
DEFINE_SPAN(span_3d_3, 3, 3)
DEFINE_SPAN(span_2d_4, 2, 4)
DEFINE_SPAN(span_3d_4, 3, 4)
DEFINE_SPAN(span_2d_5, 2, 5)
DEFINE_SPAN(span_3d_5, 3, 5)
DEFINE_SPAN(span_2d_6, 2, 6)
DEFINE_SPAN(span_3d_6, 3, 6)

typedef void (*span_function)(const struct gbg_strict *, const struct packed *, int64_t, int64_t,
                              int64_t, struct totals *);

static span_function choose(const struct gbg_strict *s)
{
    static const span_function all[GBG_STRICT_MOST + 2][2] = {
        {fine_2d, fine_3d},     {span_2d, span_3d},     {span_2d_1, span_3d_1},
        {span_2d_2, span_3d_2}, {span_2d_3, span_3d_3}, {span_2d_4, span_3d_4},
        {span_2d_5, span_3d_5}, {span_2d_6, span_3d_6}};
    return all[s->law - GBG_STRICT_DOUBLE][s->dimension - 2];
}

/* Forces on the targets of the group at i. */
static void group_forces(const struct gbg_strict *s, const struct packed *p,
                         struct gbg_state *state, int64_t i, span_function add_span, int add)
{
    double field[3][GROUP] = {{0.0}};
    for (int64_t k = 0; k < p->padded; k += GBG_STRICT_SPAN) {
        struct totals t = {{{0.0}}};
        int64_t end = k + GBG_STRICT_SPAN < p->padded ? k + GBG_STRICT_SPAN : p->padded;
        add_span(s, p, i, k, end, &t);
        for (int a = 0; a < s->dimension; a++) {
            for (int lane = 0; lane < GROUP; lane++) {
                field[a][lane] += t.sum[a][lane];
            }
        }
    }
    for (int lane = 0; lane < GROUP && i + lane < p->n; lane++) {
        int32_t target = p->index[i + lane];
        double mobility = state->mobility[state->species ? state->species[target] : 0] * s->factor;
        for (int a = 0; a < s->dimension && target < state->owned; a++) {
            double force = mobility * field[a][lane], *to = &state->force[a][target];
            *to = add ? *to + force : force;
        }
    }
}

int GBG_ISA_NAME(gbg_cpu_direct_strict)(struct gbg_device *device, struct gbg_state *state,
                                        double power, int add)
{
    const struct gbg_strict s = gbg_strict_make(state, power);
    struct packed p;
    int status = lay_out(device, state->owned + state->ghost, s.dimension, &p);
    if (status != GBG_OK) {
        return status;
    }
    pack(state, &s, device->threads, &p);
    const span_function add_span = choose(&s);
#pragma omp parallel for num_threads(device->threads) schedule(dynamic)
    for (int64_t i = 0; i < p.padded; i += GROUP) {
        group_forces(&s, &p, state, i, add_span, add);
    }
    return GBG_OK;
}
