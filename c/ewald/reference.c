/* Numbers of long-range sums: Ewald sums without a mesh: arguments, the choice of the split, and
 * the pairs. */
#include "ewald/reference.h"

#include <math.h>
#include <string.h>

#include "core/context.h"
#include "core/memory.h"
#include "ewald/reference_waves.h"
#include "gamboge/status.h"

extern const struct gbg_reference_kernels gbg_reference_kernels_generic;
#ifdef GBG_X86_VARIANTS
extern const struct gbg_reference_kernels gbg_reference_kernels_avx2, gbg_reference_kernels_avx512;
#endif

const struct gbg_reference_kernels *gbg_reference_kernels_of(const char *instructions)
{
#ifdef GBG_X86_VARIANTS
    if (strcmp(instructions, "avx512") == 0) {
        return &gbg_reference_kernels_avx512;
    }
    if (strcmp(instructions, "avx2") == 0) {
        return &gbg_reference_kernels_avx2;
    }
#endif
    (void)instructions;
    return &gbg_reference_kernels_generic;
}

enum {
    GROUP = 16,       /* targets that share a look at a block of sources */
    SPAN = 4096,      /* sources, which stay in the cache meanwhile */
    WORTH = 20000,    /* pairs: fewer are evaluated without tables */
    MANY = 10000000,  /* pairs: fewer take half a table, in which x is above 2^-10 */
    LARGEST = 1 << 26 /* sums over waves */
};

static int refuse_shape(struct gbg_context *context, const struct gbg_ewald_sources *s,
                        double balance)
{
    if (s->dimension != 2 && s->dimension != 3) {
        return gbg_fail(context, GBG_E_ARGUMENT, "reference: dimension is %d, not 2 or 3",
                        s->dimension);
    }
    for (int a = 0; a < s->dimension; a++) {
        if (!(s->length[a] > 0.0 && isfinite(s->length[a]))) {
            return gbg_fail(context, GBG_E_ARGUMENT,
                            "reference: length %d is %g, not positive and finite", a, s->length[a]);
        }
    }
    if (!(s->power >= 1.0 && s->power <= 6.0)) {
        return gbg_fail(context, GBG_E_ARGUMENT, "reference: power is %g, outside of 1 to 6",
                        s->power);
    }
    if (!(balance >= 0.0625 && balance <= 16.0)) {
        return gbg_fail(context, GBG_E_ARGUMENT, "reference: balance is %g, outside of 1/16 to 16",
                        balance);
    }
    return GBG_OK;
}

static int refuse_particles(struct gbg_context *context, const struct gbg_ewald_sources *s,
                            int64_t n_targets, const int32_t *target)
{
    if (s->n < 1 || s->n > INT32_MAX) {
        return gbg_fail(context, GBG_E_ARGUMENT, "reference: %lld particles, not 1 to 2147483647",
                        (long long)s->n);
    }
    for (int64_t i = 0; i < s->n; i++) {
        double sum = s->alpha[i];
        for (int a = 0; a < s->dimension; a++) {
            sum += s->position[a][i] - s->position[a][i];
        }
        if (!isfinite(sum)) {
            return gbg_fail(context, GBG_E_ARGUMENT, "reference: particle %lld is not finite",
                            (long long)i);
        }
    }
    for (int64_t t = 0; t < n_targets; t++) {
        if (target[t] < 0 || target[t] >= s->n) {
            return gbg_fail(context, GBG_E_ARGUMENT, "reference: target %d of %lld particles",
                            (int)target[t], (long long)s->n);
        }
    }
    return GBG_OK;
}

static void order_axes(const struct gbg_ewald_sources *s, struct gbg_reference_sources *own)
{
    own->dimension = s->dimension;
    own->volume = 1.0;
    for (int a = 0; a < s->dimension; a++) {
        int place = a;
        for (; place > 0 && s->length[a] > own->length[place - 1]; place--) {
            own->axis[place] = own->axis[place - 1];
            own->length[place] = own->length[place - 1];
        }
        own->axis[place] = a;
        own->length[place] = s->length[a];
        own->volume *= s->length[a];
    }
}

/* A coordinate taken modulo its length, and its fraction as a multiple of 2^-53 and a rest. */
static void reduce(double r, double length, double *place, double *high, double *low)
{
    double x = fmod(r, length);
    x = x < 0.0 ? x + length : x;
    x = x < length ? x : 0.0;
    double fraction = rint(x / length * 0x1p53) * 0x1p-53;
    *place = x;
    *low = fma(-fraction, length, x) / length;
    *high = fraction > 0.5 ? fraction - 1.0 : fraction;
}

static int copy_sources(struct gbg_context *context, const struct gbg_ewald_sources *s,
                        struct gbg_reference_sources *own)
{
    order_axes(s, own);
    own->n = s->n;
    own->alpha = s->alpha;
    for (int a = 0; a < s->dimension; a++) {
        void *array = NULL;
        int status = gbg_allocate(context, &array, 3 * s->n, sizeof(double), "places of sources");
        if (status != GBG_OK) {
            return status;
        }
        own->position[a] = array;
        own->high[a] = own->position[a] + s->n;
        own->low[a] = own->high[a] + s->n;
        const double *from = s->position[own->axis[a]];
#pragma omp parallel for num_threads(context->threads) schedule(static)
        for (int64_t i = 0; i < s->n; i++) {
            reduce(from[i], own->length[a], &own->position[a][i], &own->high[a][i],
                   &own->low[a][i]);
        }
    }
    return GBG_OK;
}

/* Images of each source on either side that may be within the cut. */
static int64_t images_of(const struct gbg_reference_sources *s, double cut, int64_t most[3])
{
    int64_t images = 1;
    for (int a = 0; a < 3; a++) {
        most[a] = a < s->dimension ? (int64_t)floor(cut / s->length[a] + 0.5) : 0;
        images *= 2 * most[a] + 1;
    }
    return images;
}

/* Estimated nanoseconds of one core; *waves: sums that it takes. */
static double cost_of(const struct gbg_reference_sources *s, int64_t n_targets, double a,
                      int64_t *n_sums)
{
    const double product = 0.055, look = 0.6, pair = 5.0, wave = 2000.0;
    double cut = sqrt(GBG_REFERENCE_END) / a;
    double ball = s->dimension == 2 ? 3.14159 * cut * cut : 4.18879 * cut * cut * cut;
    double n = (double)s->n, targets = (double)n_targets;
    struct gbg_reference_waves waves = {0};
    int64_t most[3];
    gbg_reference_list_waves(s->dimension, s->length, 2.0 * a * sqrt(GBG_REFERENCE_END), &waves);
    *n_sums = waves.n_sums;
    double phases = 25.0 * (waves.tiles[0] + waves.tiles[1] + waves.tiles[2]);
    return (double)waves.n_sums * (product * n + 4.0 * product * targets + wave / 8.0) +
           phases * n +
           targets * n * (look * (double)images_of(s, cut, most) + pair * ball / s->volume);
}

/* The cheapest width of the split among steps of 2^(1/8). */
static double choose_width(const struct gbg_reference_sources *s, int64_t n_targets)
{
    double best = INFINITY, chosen = 1.0 / s->length[s->dimension - 1];
    double a = 0.5 / s->length[0];
    for (int64_t sums = 0; sums < LARGEST / 16; a *= 1.0905077326652577) {
        double cost = cost_of(s, n_targets, a, &sums);
        if (cost < best) {
            best = cost;
            chosen = a;
        }
    }
    return chosen;
}

/* Everything of one call. */
struct work {
    struct gbg_context *context;
    const struct gbg_reference_kernels *kernels;
    struct gbg_reference_sources sources;
    struct gbg_reference_law law;
    struct gbg_reference_waves waves;
    struct gbg_reference_near near;
    int64_t n_targets, most[3];
    const int32_t *target;
    gbg_reference_panel *table[2];
    double *coefficient, *field; /* field: 4 a target */
};

static int make_waves(struct work *w)
{
    struct gbg_reference_waves *waves = &w->waves;
    const double k_max = 2.0 * w->law.a * sqrt(GBG_REFERENCE_END);
    const struct gbg_reference_sources *s = &w->sources;
    void *group = NULL, *coefficient = NULL;
    gbg_reference_list_waves(s->dimension, s->length, k_max, waves);
    if (waves->n_sums > LARGEST) {
        return gbg_fail(w->context, GBG_E_ARGUMENT,
                        "reference: %lld sums over waves, more than %d: take a smaller balance",
                        (long long)waves->n_sums, LARGEST);
    }
    int status = gbg_allocate(w->context, &group, waves->n_groups, sizeof *waves->group, "waves");
    if (status == GBG_OK) {
        waves->group = group;
        status = gbg_allocate(w->context, &coefficient, waves->n_sums, sizeof(double),
                              "sums over waves");
    }
    if (status == GBG_OK) {
        w->coefficient = coefficient;
        gbg_reference_list_waves(s->dimension, s->length, k_max, waves);
        status = gbg_reference_sum_waves(w->context, w->kernels, waves, &w->law, s, coefficient);
    }
    return status == GBG_OK ? gbg_reference_waves_at(w->context, w->kernels, waves, coefficient, s,
                                                     w->n_targets, w->target, w->field)
                            : status;
}

static int make_table(struct work *w, int potential)
{
    void *table = NULL;
    int status = gbg_allocate(w->context, &table, GBG_REFERENCE_PANELS, sizeof(gbg_reference_panel),
                              "table of the short part");
    if (status == GBG_OK) {
        gbg_reference_table_make(&w->law, potential, w->context->threads, w->near.first, table);
        w->table[potential] = table;
    }
    return status;
}

static int make_near(struct work *w, int with_potential)
{
    const struct gbg_reference_sources *s = &w->sources;
    struct gbg_reference_near *near = &w->near;
    double cut = sqrt(GBG_REFERENCE_END) / w->law.a;
    int64_t images = images_of(s, cut, w->most);
    *near = (struct gbg_reference_near){.dimension = s->dimension,
                                        .cut = cut * cut,
                                        .squared_a = w->law.a * w->law.a,
                                        .law = &w->law,
                                        .with_potential = with_potential,
                                        .alpha = s->alpha};
    for (int a = 0; a < s->dimension; a++) {
        near->length[a] = s->length[a];
        near->position[a] = s->position[a];
    }
    double pairs = (double)images * (double)s->n * (double)w->n_targets;
    near->first = pairs > MANY    ? 0
                  : pairs > WORTH ? GBG_REFERENCE_PANELS / 2
                                  : GBG_REFERENCE_PANELS;
    int status = GBG_OK;
    if (near->first < GBG_REFERENCE_PANELS) {
        status = make_table(w, 0);
        status = status == GBG_OK && with_potential ? make_table(w, 1) : status;
    }
    near->force = w->table[0];
    near->potential = w->table[1];
    return status;
}

/* Adds all pairs of up to GROUP targets. */
static void near_group(const struct work *w, int64_t first, int64_t n)
{
    const struct gbg_reference_sources *s = &w->sources;
    struct gbg_reference_field field[GROUP];
    memset(field, 0, sizeof field);
    for (int64_t image = 0;
         image < (2 * w->most[0] + 1) * (2 * w->most[1] + 1) * (2 * w->most[2] + 1); image++) {
        double shift[3] = {0.0};
        int64_t left = image;
        for (int a = 0; a < s->dimension; a++) {
            int64_t row = 2 * w->most[a] + 1;
            shift[a] = (double)(left % row - w->most[a]) * s->length[a];
            left /= row;
        }
        for (int64_t begin = 0; begin < s->n; begin += SPAN) {
            int64_t end = s->n - begin < SPAN ? s->n : begin + SPAN;
            for (int64_t t = 0; t < n; t++) {
                double place[3] = {0.0};
                for (int a = 0; a < s->dimension; a++) {
                    place[a] = s->position[a][w->target[first + t]];
                }
                w->kernels->near(&w->near, begin, end, place, shift, &field[t]);
            }
        }
    }
    for (int64_t t = 0; t < n; t++) {
        for (int k = 0; k < 4; k++) {
            w->field[4 * (first + t) + k] += field[t].sum[k] + field[t].rest[k];
        }
    }
}

static void hand_over(const struct work *w, double *const *force, double *potential)
{
    const struct gbg_reference_sources *s = &w->sources;
    double total = 0.0, rest = 0.0;
    for (int64_t i = 0; i < s->n; i++) {
        double more = s->alpha[i], new = total + more, gain = new - total;
        rest += (total - (new - gain)) + (more - gain);
        total = new;
    }
    double mean = w->law.mean * (total + rest) / s->volume;
    for (int64_t t = 0; t < w->n_targets; t++) {
        for (int a = 0; a < s->dimension; a++) {
            force[s->axis[a]][t] = w->field[4 * t + a];
        }
        if (potential) {
            potential[t] = w->field[4 * t + 3] - mean;
        }
    }
}

static int evaluate(struct work *w, const struct gbg_ewald_sources *sources, double balance,
                    int with_potential)
{
    void *field = NULL;
    int status = copy_sources(w->context, sources, &w->sources);
    if (status == GBG_OK) {
        double a = balance * choose_width(&w->sources, w->n_targets);
        gbg_reference_law_make(sources->dimension, sources->power, a, w->sources.volume, &w->law);
        status = gbg_allocate(w->context, &field, w->n_targets, 4 * sizeof(double), "fields");
        w->field = field;
    }
    status = status == GBG_OK ? make_waves(w) : status;
    status = status == GBG_OK ? make_near(w, with_potential) : status;
    if (status == GBG_OK) {
#pragma omp parallel for num_threads(w->context->threads) schedule(dynamic, 1)
        for (int64_t first = 0; first < w->n_targets; first += GROUP) {
            near_group(w, first, w->n_targets - first < GROUP ? w->n_targets - first : GROUP);
        }
    }
    return status;
}

int gbg_ewald_reference(struct gbg_context *context, const struct gbg_ewald_sources *sources,
                        double balance, int64_t n_targets, const int32_t *target,
                        double *const *force, double *potential)
{
    int status = refuse_shape(context, sources, balance);
    status = status == GBG_OK ? refuse_particles(context, sources, n_targets, target) : status;
    if (status != GBG_OK || n_targets < 1) {
        return status;
    }
    struct work work = {.context = context,
                        .kernels = gbg_reference_kernels_of(context->host),
                        .n_targets = n_targets,
                        .target = target};
    status = evaluate(&work, sources, balance, potential != NULL);
    if (status == GBG_OK) {
        hand_over(&work, force, potential);
    }
    for (int a = 0; a < 3; a++) {
        gbg_release(work.sources.position[a]);
    }
    gbg_release(work.waves.group);
    gbg_release(work.coefficient);
    gbg_release(work.field);
    gbg_release(work.table[0]);
    gbg_release(work.table[1]);
    return status;
}
