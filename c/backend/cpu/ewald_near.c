/* L1, CPU, per instruction set: near pairs of sums by a mesh: all within the reach, by power law
 * less polynomial. */
#include "backend/cpu/ewald_near.h"

#include "backend/cpu/cpu.h"
#include "backend/cpu/grid.h"

static inline int64_t gbg_near_tasks(int32_t columns)
{
    return (columns + GBG_NEAR_COLUMNS - 1) / GBG_NEAR_COLUMNS;
}

/* u^exponent - smooth in double precision, one by one. */
static vf general_single(vf u, vf minus, const struct gbg_near_sum *sum)
{
    float lane[VF_LANES];
    vf_store(lane, u);
    for (int l = 0; l < VF_LANES; l++) {
        lane[l] = lane[l] > 0.0f ? (float)pow((double)lane[l], sum->exponent) : 0.0f;
    }
    return vf_add(vf_load(lane), minus);
}

static vd general_double(vd u, vd minus, const struct gbg_near_sum *sum)
{
    double lane[VD_LANES];
    vd_store(lane, u);
    for (int l = 0; l < VD_LANES; l++) {
        lane[l] = lane[l] > 0.0 ? pow(lane[l], sum->exponent) : 0.0;
    }
    return vd_add(vd_load(lane), minus);
}

/* Lanes of n values of each axis: runs of a few vectors in single precision, these in double
 * precision. */
GBG_ALWAYS void add_lanes_single(const float *const value[3], int n, int dimension,
                                 vd sum[3][GBG_NEAR_LANES / VD_LANES])
{
    static const int32_t number[GBG_NEAR_LANES] = {0, 1, 2,  3,  4,  5,  6,  7,
                                                   8, 9, 10, 11, 12, 13, 14, 15};
    enum { VECTORS = GBG_NEAR_LANES / VF_LANES };
    for (int j = 0; j == 0 || j < n; j += GBG_NEAR_RUN * GBG_NEAR_LANES) {
        for (int l = 0; l < VECTORS; l++) {
            vi lane = vi_load(number + l * VF_LANES);
            vf some[3][GBG_NEAR_RUN];
#pragma GCC unroll 4
            for (int v = 0; v < GBG_NEAR_RUN; v++) {
                int at = j + v * GBG_NEAR_LANES;
                vm inside = vi_lt(lane, vi_set(n - at));
                for (int a = 0; a < dimension; a++) {
                    some[a][v] = vf_keep(inside, vf_load(value[a] + at + l * VF_LANES));
                }
            }
            for (int a = 0; a < dimension; a++) {
                vf all = vf_add(vf_add(some[a][0], some[a][1]), vf_add(some[a][2], some[a][3]));
                vd *to = &sum[a][2 * l];
                to[0] = j == 0 ? vd_low(all) : vd_add(to[0], vd_low(all));
                to[1] = j == 0 ? vd_high(all) : vd_add(to[1], vd_high(all));
            }
        }
    }
}

GBG_ALWAYS void add_lanes_double(const double *const value[3], int n, int dimension,
                                 vd sum[3][GBG_NEAR_LANES / VD_LANES])
{
    enum { VECTORS = GBG_NEAR_LANES / VD_LANES };
    for (int a = 0; a < dimension; a++) {
        for (int l = 0; l < VECTORS; l++) {
            sum[a][l] = vd_set(0.0);
        }
        for (int j = 0; j < n; j += GBG_NEAR_LANES) {
            for (int l = 0; l < VECTORS; l++) {
                int left = n - j - l * VD_LANES;
                vd some = vd_load(value[a] + j + l * VD_LANES);
                if (left < VD_LANES) {
                    uint32_t bits = left > 0 ? (UINT32_C(1) << left) - 1 : 0;
                    some = vd_keep(vdm_from_bits(bits), some);
                }
                sum[a][l] = vd_add(sum[a][l], some);
            }
        }
    }
}

/* 64-bit words of a particle. */
static void words_of(const struct gbg_near_sum *sum, int64_t k, uint64_t word[3])
{
    int64_t i = sum->order->index[k];
    for (int a = 0; a < sum->dimension; a++) {
        word[a] = gbg_join(sum->state->high[a][i], sum->state->low[a][i]);
    }
}

/* Squared distance as single precision has it, to the last bit. */
static float squared_single(const struct gbg_near_sum *sum, int64_t i, int64_t k)
{
    vf squared = vf_set(0.0f);
    float lane[VF_LANES];
    for (int a = 0; a < sum->dimension; a++) {
        vf r = vf_from_vi(vi_set((int32_t)(sum->order->fine[a][i] - sum->order->fine[a][k])));
        r = vf_mul(r, vf_set((float)sum->ratio[a]));
        squared = a == 0 ? vf_mul(r, r) : vf_fma(r, r, squared);
    }
    vf_store(lane, squared);
    return lane[0];
}

/* Adds to the field of particle i that of a pair which is too near for single precision. */
static void mend_pair(const struct gbg_near_sum *sum, int64_t i, int64_t k)
{
    const struct gbg_box *box = &sum->state->box;
    uint64_t own[3], other[3];
    double r[3], squared = 0.0, smooth = sum->near[sum->degree];
    words_of(sum, i, own);
    words_of(sum, k, other);
    for (int a = 0; a < sum->dimension; a++) {
        r[a] = gbg_box_difference(box, a, own[a], other[a]) / sum->length;
        squared += r[a] * r[a];
    }
    if (squared == 0.0) {
        return;
    }
    for (int d = sum->degree - 1; d >= 0; d--) {
        smooth = smooth * (2.0 * squared - 1.0) + sum->near[d];
    }
    double weight = pow(squared, sum->exponent) - smooth;
    weight *= pow(sum->length, 2.0 * sum->exponent + 1.0) * (double)sum->order->source[k];
    for (int a = 0; a < sum->dimension; a++) {
        sum->order->field[a][i] += weight * r[a];
    }
}

/* Candidates `from` .. of a particle. */
static void mend_segment(const struct gbg_near_sum *sum, const struct gbg_near_segment *segment)
{
    const struct gbg_ewald_order *order = sum->order;
    const int32_t *cells = order->cells;
    struct gbg_near_rows rows = {.own = 0};
    int64_t k = segment->k, row = gbg_grid_cell(order->high[1][k], cells[1]), number = 0;
    int32_t first, column = gbg_grid_cell(order->high[0][k], cells[0]);
    if (sum->dimension == 3) {
        row += (int64_t)gbg_grid_cell(order->high[2][k], cells[2]) * cells[1];
    }
    gbg_near_find_rows(order, row, &rows);
    gbg_near_span(order, 0, column, &first);
    for (int64_t c = 0; c < (int64_t)rows.columns * rows.count; c++) {
        int32_t at = gbg_near_wrap(first + (int32_t)(c / rows.count), cells[0]);
        const int64_t *begin = order->begin + rows.first[c % rows.count] + at;
        for (int64_t other = begin[0]; other < begin[1]; other++, number++) {
            if (number >= segment->from && number < segment->from + segment->candidates &&
                other != k && !(squared_single(sum, k, other) > (float)sum->finest)) {
                mend_pair(sum, k, other);
            }
        }
    }
}

static void mend(const struct gbg_near_sum *sum, int segments,
                 const struct gbg_near_segment *segment)
{
    for (int s = 0; s < segments; s++) {
        mend_segment(sum, &segment[s]);
    }
}

/* Coincident particles: nothing is left to do. */
static void nothing(const struct gbg_near_sum *sum, int segments,
                    const struct gbg_near_segment *segment)
{
    (void)sum;
    (void)segments;
    (void)segment;
}

#define NEAR(name) name##_single
#define WORD int32_t
#define REAL float
#define LANES VF_LANES
#define VECTOR vf
#define MASK vm
#define V(name) vf_##name
#define WORDS(name) vi_##name
#define FROM_WORDS vf_from_vi
#define BITS vm_bits
#define SQUEEZE squeeze_single
#define WEIGHT gbg_ewald_weight
#define WEIGHT_GENERAL general_single
#define ADD_LANES add_lanes_single
#define COEFFICIENTS(sum) (sum)->single
#define SOURCES(order) (order)->source
#define FINEST sum->finest
#define MEND mend
#define COPY 8
#define WORD_OF(order, a, k) (int32_t)(order)->fine[a][k]
#define COPY_WORDS(to, order, a, k) memcpy(to, (order)->fine[a] + (k), COPY * sizeof(WORD))
#include "backend/cpu/ewald_near_body.h"
#undef NEAR
#undef WORD
#undef REAL
#undef LANES
#undef VECTOR
#undef MASK
#undef V
#undef WORDS
#undef FROM_WORDS
#undef BITS
#undef SQUEEZE
#undef WEIGHT
#undef WEIGHT_GENERAL
#undef ADD_LANES
#undef COEFFICIENTS
#undef SOURCES
#undef FINEST
#undef MEND
#undef COPY
#undef WORD_OF
#undef COPY_WORDS
#define NEAR(name) name##_double
#define WORD int64_t
#define REAL double
#define LANES VD_LANES
#define VECTOR vd
#define MASK vdm
#define V(name) vd_##name
#define WORDS(name) vl_##name
#define FROM_WORDS vd_from_vl
#define BITS vdm_bits
#define SQUEEZE squeeze_double
#define WEIGHT gbg_ewald_weight_double
#define WEIGHT_GENERAL general_double
#define ADD_LANES add_lanes_double
#define COEFFICIENTS(sum) (sum)->minus
#define SOURCES(order) (order)->source_double
#define FINEST 0.0
#define MEND nothing
#define COPY 8
#define WORD_OF(order, a, k) (int64_t) gbg_join((order)->high[a][k], (order)->low[a][k])
#define COPY_WORDS(to, order, a, k) join_words(to, (order)->high[a] + (k), (order)->low[a] + (k))

static inline void join_words(int64_t to[COPY], const uint32_t *high, const uint32_t *low)
{
    for (int l = 0; l < COPY; l++) {
        to[l] = (int64_t)gbg_join(high[l], low[l]);
    }
}
#include "backend/cpu/ewald_near_body.h"

#define DEFINE_EVALUATE(precision, dimension, power)                                               \
    static int evaluate_##precision##_##dimension##_##power(const struct gbg_near_sum *sum,        \
                                                            struct batch_##precision *batch)       \
    {                                                                                              \
        return evaluate_law_##precision(sum, batch, dimension, power);                             \
    }
#define DEFINE_POWERS(precision, dimension)                                                        \
    DEFINE_EVALUATE(precision, dimension, 0)                                                       \
    DEFINE_EVALUATE(precision, dimension, 1)                                                       \
    DEFINE_EVALUATE(precision, dimension, 2)                                                       \
    DEFINE_EVALUATE(precision, dimension, 3)                                                       \
    DEFINE_EVALUATE(precision, dimension, 4)                                                       \
    DEFINE_EVALUATE(precision, dimension, 5)                                                       \
    DEFINE_EVALUATE(precision, dimension, 6)
#define NAME_POWERS(precision, dimension)                                                          \
    {                                                                                              \
        evaluate_##precision##_##dimension##_0, evaluate_##precision##_##dimension##_1,            \
            evaluate_##precision##_##dimension##_2, evaluate_##precision##_##dimension##_3,        \
            evaluate_##precision##_##dimension##_4, evaluate_##precision##_##dimension##_5,        \
            evaluate_##precision##_##dimension##_6                                                 \
    }
DEFINE_POWERS(single, 2)
DEFINE_POWERS(single, 3)
DEFINE_POWERS(double, 2)
DEFINE_POWERS(double, 3)

/* All tasks of a sum, shared out to threads; which thread has a task does not show. */
#define DEFINE_RUN(precision, dimension, scaled)                                                   \
    static void run_##precision##_##dimension##_##scaled(                                          \
        const struct gbg_near_sum *sum, evaluate_##precision evaluate, int threads)                \
    {                                                                                              \
        const int32_t *cells = sum->order->cells;                                                  \
        int64_t tasks = gbg_near_tasks(cells[0]) * cells[1] * cells[2];                            \
        _Pragma("omp parallel num_threads(threads)")                                               \
        {                                                                                          \
            struct work_##precision work;                                                          \
            start_##precision(&work, sum, evaluate);                                               \
            _Pragma("omp for schedule(dynamic, 4)") for (int64_t t = 0; t < tasks; t++)            \
            {                                                                                      \
                task_##precision(&work, t, dimension, scaled);                                     \
            }                                                                                      \
        }                                                                                          \
        (void)threads;                                                                             \
    }
DEFINE_RUN(single, 2, 0)
DEFINE_RUN(single, 2, 1)
DEFINE_RUN(single, 3, 0)
DEFINE_RUN(single, 3, 1)
DEFINE_RUN(double, 2, 0)
DEFINE_RUN(double, 2, 1)
DEFINE_RUN(double, 3, 0)
DEFINE_RUN(double, 3, 1)

static void run_single(const struct gbg_near_sum *sum, int scaled, int threads)
{
    static const evaluate_single evaluate[2][7] = {NAME_POWERS(single, 2), NAME_POWERS(single, 3)};
    const evaluate_single law = evaluate[sum->dimension - 2][sum->power];
    if (sum->dimension == 2) {
        (scaled ? run_single_2_1 : run_single_2_0)(sum, law, threads);
    } else {
        (scaled ? run_single_3_1 : run_single_3_0)(sum, law, threads);
    }
}

static void run_double(const struct gbg_near_sum *sum, int scaled, int threads)
{
    static const evaluate_double evaluate[2][7] = {NAME_POWERS(double, 2), NAME_POWERS(double, 3)};
    const evaluate_double law = evaluate[sum->dimension - 2][sum->power];
    if (sum->dimension == 2) {
        (scaled ? run_double_2_1 : run_double_2_0)(sum, law, threads);
    } else {
        (scaled ? run_double_3_1 : run_double_3_0)(sum, law, threads);
    }
}

/* Returns 1 if the axes have different units. */
static int choose_units(const struct gbg_ewald_choice *choice, struct gbg_near_sum *sum)
{
    double word[3] = {0.0, 0.0, 0.0}, coarsest = 0.0;
    int scaled = 0;
    for (int a = 0; a < choice->dimension; a++) {
        word[a] = choice->single ? ldexp(choice->length[a], -32 - sum->order->shift[a])
                                 : ldexp(choice->length[a], -64);
        coarsest = fmax(coarsest, word[a]);
    }
    for (int a = 0; a < choice->dimension; a++) {
        sum->ratio[a] = word[a] / coarsest;
        scaled |= sum->ratio[a] != 1.0;
    }
    double words = choice->reach / coarsest, unit = exp2(floor(log2(words)));
    double reach = words / unit;
    sum->limit = words * words;
    sum->inverse = 1.0 / (unit * unit);
    sum->slope = 2.0 / (reach * reach);
    sum->factor = pow(choice->reach / reach, -choice->power) / unit;
    for (int d = 0; d <= sum->degree; d++) {
        sum->minus[d] = -pow(reach, -choice->power - 1.0) * sum->near[d];
        sum->single[d] = (float)sum->minus[d];
    }
    return scaled;
}

void GBG_ISA_NAME(gbg_ewald_near)(struct gbg_device *device, const struct gbg_state *state,
                                  struct gbg_ewald *ewald)
{
    const struct gbg_ewald_choice *choice = &ewald->plan.choice;
    const struct gbg_split *split = &ewald->plan.split;
    struct gbg_near_sum sum = {.state = state,
                               .order = &ewald->order,
                               .dimension = choice->dimension,
                               .exponent = -0.5 * (choice->power + 1.0),
                               .degree = split->degree,
                               .finest = GBG_NEAR_FINEST * GBG_NEAR_FINEST,
                               .length = choice->reach};
    int whole = gbg_whole_power(choice->power);
    sum.power = whole <= 6 ? whole : 0;
    for (int d = 0; d <= split->degree; d++) {
        sum.near[d] = split->near[d];
    }
    sum.uniform = ewald->order.uniform;
    int scaled = choose_units(choice, &sum);
    if (ewald->order.n > 0) {
        (choice->single ? run_single : run_double)(&sum, scaled, device->threads);
    }
}
