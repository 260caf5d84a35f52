/* Estimators: hard discs: contact value, displacement virial, their ratio, displacements. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench/estimators/estimators.h"

static const double pi = 3.14159265358979323846, gap_range = 0.1;
enum { BINS = 80, SLOW = 5 };

const double gbg_disc_lags[GBG_LAGS] = {0.04, 0.16, 0.64};

/* Work arrays of a measurement. */
struct discs {
    int64_t n;
    double edge;
    double *x, *y; /* unwrapped */
    double *origin[GBG_LAGS][2];
    int cells, *head, *next;
    double pairs[BINS];
};

static void release(struct discs *d)
{
    free(d->x);
    free(d->head);
}

static int reserve(struct discs *d, int64_t n, double edge)
{
    size_t count = (size_t)n;
    *d = (struct discs){.n = n, .edge = edge, .cells = (int)fmin(edge / (1.0 + gap_range), 4096.0)};
    size_t squares = (size_t)d->cells * (size_t)d->cells;
    d->x = malloc((2 + 2 * GBG_LAGS) * count * sizeof *d->x);
    d->head = malloc((squares + count) * sizeof *d->head);
    if (!d->x || !d->head) {
        release(d);
        return GBG_E_MEMORY;
    }
    d->y = d->x + count;
    d->next = d->head + squares;
    for (int k = 0; k < 2 * GBG_LAGS; k++) {
        d->origin[k / 2][k % 2] = d->x + (size_t)(2 + k) * count;
    }
    return GBG_OK;
}

static int cell_of(const struct discs *d, double x)
{
    double fraction = x / d->edge;
    int cell = (int)((fraction - floor(fraction)) * d->cells);
    return cell < d->cells ? cell : d->cells - 1;
}

static void count_near(struct discs *d, int64_t i, int j)
{
    for (; j >= 0; j = d->next[j]) {
        double rx = d->x[i] - d->x[j], ry = d->y[i] - d->y[j];
        rx -= d->edge * rint(rx / d->edge);
        ry -= d->edge * rint(ry / d->edge);
        double square = rx * rx + ry * ry;
        if (square < (1.0 + gap_range) * (1.0 + gap_range)) {
            int bin = (int)((sqrt(square) - 1.0) * (BINS / gap_range));
            d->pairs[bin < 0 ? 0 : bin < BINS ? bin : BINS - 1] += 1.0;
        }
    }
}

/* Adds the gaps of all near pairs to the histogram: linked cells, each pair once. */
static void count_pairs(struct discs *d)
{
    int m = d->cells;
    memset(d->head, -1, (size_t)m * (size_t)m * sizeof *d->head);
    for (int64_t i = 0; i < d->n; i++) {
        int cx = cell_of(d, d->x[i]), cy = cell_of(d, d->y[i]);
        for (int k = 0; k < 9; k++) {
            int nx = (cx + k % 3 + m - 1) % m, ny = (cy + k / 3 + m - 1) % m;
            count_near(d, i, d->head[ny * m + nx]);
        }
        d->next[i] = d->head[cy * m + cx];
        d->head[cy * m + cx] = (int)i;
    }
}

/* g at contact from the histogram of `samples` states. N^2/V, not N(N - 1)/V: the virial theorem of
 * N discs in a box holds for this one. */
static double contact_value(const struct discs *d, double samples)
{
    double middle[BINS], g[BINS], width = gap_range / BINS;
    for (int b = 0; b < BINS; b++) {
        double inner = 1.0 + b * width, outer = inner + width;
        double area = pi * (outer * outer - inner * inner);
        middle[b] = (b + 0.5) * width;
        g[b] = 2.0 * d->pairs[b] * d->edge * d->edge / ((double)d->n * d->n * area * samples);
    }
    return gbg_estimate_intercept(BINS, middle, g, 3);
}

/* Mean square over steps since the last origin, which becomes the present state. */
static double displacement(struct discs *d, int lag)
{
    double sum = 0.0, *const *origin = d->origin[lag];
    for (int64_t i = 0; i < d->n; i++) {
        double rx = d->x[i] - origin[0][i], ry = d->y[i] - origin[1][i];
        sum += rx * rx + ry * ry;
    }
    memcpy(origin[0], d->x, (size_t)d->n * sizeof *d->x);
    memcpy(origin[1], d->y, (size_t)d->n * sizeof *d->y);
    return sum / (double)d->n;
}

struct block {
    double contact, virial, ratio, pushes, msd[GBG_LAGS];
};

/* Steps between states that are looked at, and from there to the three lags; steps of a block. */
struct pace {
    int64_t stride, looks, every[GBG_LAGS];
};

static struct pace pace_of(const struct gbg_disc_plan *plan)
{
    struct pace p;
    double variance = plan->s * plan->s;
    p.stride = (int64_t)fmax(1.0, rint(gbg_disc_lags[0] * gbg_disc_lags[0] / variance));
    for (int k = 0; k < GBG_LAGS; k++) {
        p.every[k] = (int64_t)fmax(
            1.0, rint(gbg_disc_lags[k] * gbg_disc_lags[k] / variance / (double)p.stride));
    }
    /* a block holds whole longest lags */
    double lags = plan->duration / variance / GBG_BLOCKS / (double)(p.stride * p.every[2]);
    p.looks = p.every[2] * (int64_t)fmax(1.0, rint(lags));
    return p;
}

static int run_block(struct gbg_engine *engine, struct discs *d, const struct gbg_disc_plan *plan,
                     const struct pace *pace, struct gbg_work *work, struct block *block)
{
    double before = 0.0, after = 0.0, variance = plan->s * plan->s;
    double steps = (double)(pace->looks * pace->stride), msd[GBG_LAGS] = {0.0};
    int64_t pushes_before = 0, pushes = 0;
    int status = gbg_engine_real(engine, "contact_virial", &before);
    status = status ? status : gbg_engine_integer(engine, "contact_pairs", &pushes_before);
    memset(d->pairs, 0, sizeof d->pairs);
    for (int64_t look = 1; look <= pace->looks && status == GBG_OK; look++) {
        status = gbg_work_run(engine, pace->stride, work);
        status = status ? status : gbg_engine_positions(engine, 0, d->n, d->x, d->y, NULL, 1);
        count_pairs(d);
        for (int k = 0; k < GBG_LAGS; k++) {
            msd[k] += look % pace->every[k] ? 0.0 : displacement(d, k);
        }
    }
    status = status ? status : gbg_engine_real(engine, "contact_virial", &after);
    status = status ? status : gbg_engine_integer(engine, "contact_pairs", &pushes);
    block->contact = contact_value(d, (double)pace->looks);
    block->virial = 1.0 + (after - before) / ((double)d->n * variance * steps);
    block->ratio = (1.0 + 2.0 * plan->packing * block->contact) / block->virial;
    block->pushes = (double)(pushes - pushes_before) / ((double)d->n * steps);
    for (int k = 0; k < GBG_LAGS; k++) {
        double lag = (double)(pace->every[k] * pace->stride);
        double windows = (double)(pace->looks / pace->every[k]);
        block->msd[k] = msd[k] / windows / (2.0 * variance * lag);
    }
    return status;
}

static void summarise(const struct block *block, struct gbg_disc_result *result)
{
    double column[GBG_BLOCKS], slow[SLOW] = {0.0};
#define COLUMN(member, target)                                                                     \
    for (int b = 0; b < GBG_BLOCKS; b++) {                                                         \
        column[b] = block[b].member;                                                               \
    }                                                                                              \
    result->target = gbg_estimate_mean(GBG_BLOCKS, column)
    COLUMN(virial, virial);
    COLUMN(ratio, ratio);
    COLUMN(pushes, pushes);
    for (int k = 0; k < GBG_LAGS; k++) {
        COLUMN(msd[k], msd[k]);
    }
    COLUMN(contact, contact);
#undef COLUMN
    for (int b = 0; b < GBG_BLOCKS; b++) {
        slow[b * SLOW / GBG_BLOCKS] += column[b] * SLOW / GBG_BLOCKS;
    }
    result->slow_error = gbg_estimate_mean(SLOW, slow).error;
}

int gbg_discs_measure(struct gbg_context *context, const struct gbg_disc_plan *plan, double edge,
                      const double *x, const double *y, struct gbg_disc_result *result)
{
    struct gbg_sample sample = {.rule = plan->rule,
                                .edge = edge,
                                .dt = plan->s * plan->s,
                                .temperature = 1.0,
                                .species = 1,
                                .mobility = {1.0},
                                .seed = plan->seed};
    struct gbg_engine *engine = NULL;
    struct gbg_work ignored = {0};
    struct block block[GBG_BLOCKS];
    struct discs d;
    struct pace pace = pace_of(plan);
    int64_t forget = (int64_t)rint(0.1 * plan->duration / sample.dt);
    *result = (struct gbg_disc_result){0};
    int status = reserve(&d, plan->n, edge);
    if (status != GBG_OK) {
        return status;
    }
    status = gbg_sample_engine(context, &sample, plan->n, x, y, NULL, &engine);
    status = status ? status : gbg_work_run(engine, forget, &ignored);
    status = status ? status : gbg_engine_positions(engine, 0, d.n, d.x, d.y, NULL, 1);
    for (int k = 0; k < GBG_LAGS && status == GBG_OK; k++) {
        displacement(&d, k);
    }
    for (int b = 0; b < GBG_BLOCKS && status == GBG_OK; b++) {
        status = run_block(engine, &d, plan, &pace, &result->work, &block[b]);
    }
    if (status == GBG_OK) {
        summarise(block, result);
    }
    gbg_engine_destroy(&engine);
    release(&d);
    return status;
}

/* A start: insertion where it ends soon, else a square lattice, which melts at once. */
static int start(struct gbg_context *context, double packing, int64_t n, int64_t seed, double *x,
                 double *y, double *edge)
{
    struct gbg_scene *scene = NULL;
    struct gbg_engine *engine = NULL;
    double lengths[2];
    int index, status = gbg_scene_create(context, 2, &scene);
    status = status ? status : gbg_scene_add_species(scene, "A", 1.0, 0.0, 1.0, 1.0, -1, &index);
    status = status ? status : gbg_scene_set_real(scene, "box.packing", packing);
    status = status ? status : gbg_scene_set_text(scene, "excluded_volume.rule", "bounce");
    status = status ? status : gbg_scene_set_integer(scene, "particles.count", n);
    status = status ? status : gbg_scene_set_integer(scene, "run.seed", seed);
    if (packing <= 0.5) {
        status = status ? status : gbg_scene_set_text(scene, "particles.start.random", "insertion");
    } else {
        const char *lattice = packing <= 0.75 ? "square" : "triangular";
        status = status ? status : gbg_scene_set_text(scene, "particles.start.lattice", lattice);
        status = status ? status : gbg_scene_set_real(scene, "particles.start.jitter", 0.9);
    }
    status = status ? status : gbg_engine_create(scene, &engine);
    status = status ? status : gbg_engine_box(engine, lengths, NULL);
    status = status ? status : gbg_engine_positions(engine, 1, n, x, y, NULL, 1);
    *edge = lengths[0];
    gbg_engine_destroy(&engine);
    gbg_scene_destroy(&scene);
    return status;
}

int gbg_discs_equilibrium(struct gbg_context *context, double packing, int64_t n, int64_t seed,
                          double *x, double *y, double *edge)
{
    int event = gbg_rule_is_built(context, "event");
    /* event keeps the law of hard discs for any step, so it may take long ones */
    static const double stage[2][3] = {{0.03, 0.02, 0.01}, {0.05, 0.1, 0.1}};
    struct gbg_engine *engine = NULL;
    struct gbg_sample sample = {
        .rule = event ? "event" : "bounce", .temperature = 1.0, .species = 1, .mobility = {1.0}};
    int status = start(context, packing, n, seed, x, y, &sample.edge);
    for (int k = 0; k < 3 && status == GBG_OK; k++) {
        sample.dt = stage[event][k] * stage[event][k];
        sample.seed = seed + 1 + k;
        status = gbg_sample_engine(context, &sample, n, x, y, NULL, &engine);
        status = status ? status : gbg_engine_run(engine, event ? 400 : 800);
        status = status ? status : gbg_engine_positions(engine, 1, n, x, y, NULL, 1);
        gbg_engine_destroy(&engine);
    }
    *edge = sample.edge;
    return status;
}
