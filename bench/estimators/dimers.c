/* Estimators: bound pairs, far from each other or in a dense suspension. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench/estimators/estimators.h"

static const double pi = 3.14159265358979323846;

/* Distance of isolated pairs: those of one generation start in parallel and swim side by side. */
static const double spacing = 24.0;

/* Gaps that count as those of a pair in contact, and the bin at contact. */
static const double near_below = 0.02, first_bin = 0.00125;

const struct gbg_pair_law gbg_bound_pairs[GBG_BOUND_PAIRS] = {
    {"C0 and C1, B-B", {1.0, 1.0}, {1.0, -1.0}, {1, 1}, 6.0},
    {"C2, A-B", {1.0, -1.0}, {1.0, -2.0}, {0, 1}, 6.0},
    {"C3, A-A", {-1.0, 1.0}, {1.0, -2.0}, {0, 0}, 6.0},
    {"C3, B-B", {-1.0, 1.0}, {1.0, -2.0}, {1, 1}, 6.0},
    {"C4, A-B", {1.0, -1.0}, {1.0, -4.0}, {0, 1}, 6.0},
};

/* mu_1 alpha_2 and mu_2 alpha_1: responses of the partners to each other. */
static void responses(const struct gbg_pair_law *law, double response[2])
{
    int a = law->partner[0], b = law->partner[1];
    response[0] = law->mobility[a] * law->alpha[b];
    response[1] = law->mobility[b] * law->alpha[a];
}

double gbg_pair_drift(const struct gbg_pair_law *law)
{
    double response[2];
    responses(law, response);
    return response[0] + response[1];
}

double gbg_pair_speed(const struct gbg_pair_law *law)
{
    double response[2];
    responses(law, response);
    return 0.5 * fabs(response[0] - response[1]);
}

struct gbg_pair_exact gbg_pair_exact(const struct gbg_pair_law *law, double temperature,
                                     double below)
{
    enum { PANELS = 100000 };
    double n = law->power, strength = gbg_pair_drift(law) / temperature;
    double end = below > 0.0 ? below : 0.3, width = end / PANELS;
    double norm = 0.0, gap = 0.0, speed = 0.0;
    for (int k = 0; k <= PANELS; k++) { /* Simpson's rule */
        double g = k * width, r = 1.0 + g;
        double potential = n == 1.0 ? log(r) : (1.0 - pow(r, 1.0 - n)) / (n - 1.0);
        double weight = (k == 0 || k == PANELS ? 1.0
                         : k % 2               ? 4.0
                                               : 2.0) *
                        r * exp(strength * potential);
        norm += weight;
        gap += weight * g;
        speed += weight * pow(r, -n);
    }
    return (struct gbg_pair_exact){gap / norm, gbg_pair_speed(law) * speed / norm};
}

/* Sums of one pair over a run. */
struct sums {
    double gap, count, near_gap, near_count, speed;
};

/* A generation of isolated pairs: particles 2p and 2p + 1 are partners. */
struct generation {
    int64_t n;
    double edge, sign; /* of the speed along the axis from the second to the first */
    double *x, *y, *later_x, *later_y, *noise;
    int32_t *species;
};

static void release(struct generation *g)
{
    free(g->x);
    free(g->species);
}

static int reserve(struct generation *g, int pairs)
{
    size_t n = 2 * (size_t)pairs;
    g->n = (int64_t)n;
    g->x = malloc(6 * n * sizeof *g->x);
    g->species = malloc(n * sizeof *g->species);
    if (!g->x || !g->species) {
        release(g);
        return GBG_E_MEMORY;
    }
    g->y = g->x + n;
    g->later_x = g->y + n;
    g->later_y = g->later_x + n;
    g->noise = g->later_y + n; /* two components a particle */
    return GBG_OK;
}

/* Pairs on a square lattice, all along one direction, gaps at the quantiles of an exponential. */
static void place(struct generation *g, const struct gbg_pair_law *law, double temperature,
                  double angle)
{
    int64_t pairs = g->n / 2, side = (int64_t)ceil(sqrt((double)pairs));
    double mean_gap = temperature / fabs(gbg_pair_drift(law));
    g->edge = spacing * (double)side;
    for (int64_t p = 0; p < pairs; p++) {
        /* multiples of the golden section: every quantile in every part of the box */
        double quantile = fmod(0.5 + 0.618033988749895 * (double)p, 1.0);
        double half = 0.5 * (1.0 - mean_gap * log1p(-quantile));
        double cx = spacing * ((double)(p % side) + 0.5);
        double cy = spacing * ((double)(p / side) + 0.5);
        for (int k = 0; k < 2; k++) {
            double out = k ? -half : half;
            g->x[2 * p + k] = cx + out * cos(angle);
            g->y[2 * p + k] = cy + out * sin(angle);
            g->species[2 * p + k] = law->partner[k];
        }
    }
}

/* Vector between partners, and its length; positions are unwrapped, so no images. */
static double axis_of(const double *x, const double *y, int64_t p, double e[2])
{
    e[0] = x[2 * p] - x[2 * p + 1];
    e[1] = y[2 * p] - y[2 * p + 1];
    double r = hypot(e[0], e[1]);
    e[0] /= r;
    e[1] /= r;
    return r;
}

/* Adds the state in x, y, and the move to the state one step later. The mean of a step's noise
 * along the axis at its start is 0, so it may be taken off: the speed then has hardly any noise. */
static void add_sample(const struct generation *g, double dt, double s, struct sums *sums)
{
    for (int64_t p = 0; p < g->n / 2; p++) {
        double e[2], r = axis_of(g->x, g->y, p, e), move = 0.0;
        for (int64_t i = 2 * p; i < 2 * p + 2; i++) {
            move += e[0] * (g->later_x[i] - g->x[i] - s * g->noise[2 * i]);
            move += e[1] * (g->later_y[i] - g->y[i] - s * g->noise[2 * i + 1]);
        }
        sums[p].gap += r - 1.0;
        sums[p].count += 1.0;
        sums[p].speed += 0.5 * g->sign * move / dt;
        if (r - 1.0 < near_below) {
            sums[p].near_gap += r - 1.0;
            sums[p].near_count += 1.0;
        }
    }
}

static int sample_step(struct gbg_context *context, struct gbg_engine *engine, int64_t seed,
                       struct generation *g, const struct gbg_dimer_plan *plan,
                       struct gbg_work *work, struct sums *sums)
{
    int64_t step = 0;
    int status = gbg_engine_integer(engine, "step", &step);
    status = status ? status : gbg_engine_positions(engine, 0, g->n, g->x, g->y, NULL, 1);
    status = status ? status : gbg_normals(context, seed, 0, step, 0, 2, g->n, g->noise);
    status = status ? status : gbg_work_run(engine, 1, work);
    status =
        status ? status : gbg_engine_positions(engine, 0, g->n, g->later_x, g->later_y, NULL, 1);
    if (status == GBG_OK) {
        add_sample(g, plan->dt, sqrt(plan->temperature * plan->dt), sums);
    }
    return status;
}

static int run_generation(struct gbg_context *context, const struct gbg_pair_law *law,
                          const struct gbg_dimer_plan *plan, int index, struct generation *g,
                          struct gbg_work *work, struct sums *sums)
{
    double drift = gbg_pair_drift(law), relaxation = plan->temperature / (drift * drift);
    struct gbg_sample sample = {.rule = plan->rule,
                                .dt = plan->dt,
                                .temperature = plan->temperature,
                                .species = 2,
                                .alpha = {law->alpha[0], law->alpha[1]},
                                .mobility = {law->mobility[0], law->mobility[1]},
                                .power = law->power,
                                .cutoff = 2.5,
                                .seed = plan->seed + index};
    struct gbg_engine *engine = NULL;
    place(g, law, plan->temperature, 2.399963 * index);
    sample.edge = g->edge;
    int64_t stride = (int64_t)fmax(1.0, rint(0.5 * relaxation / plan->dt));
    int64_t forget = (int64_t)fmax(20.0, rint(20.0 * relaxation / plan->dt));
    int64_t looks = (int64_t)fmax(1.0, rint(plan->duration / plan->dt / (double)stride));
    int status = gbg_sample_engine(context, &sample, g->n, g->x, g->y, g->species, &engine);
    status = status ? status : gbg_work_run(engine, forget, work);
    for (int64_t look = 0; look < looks && status == GBG_OK; look++) {
        status = sample_step(context, engine, sample.seed, g, plan, work, sums);
        status = status ? status : gbg_work_run(engine, stride - 1, work);
    }
    gbg_engine_destroy(&engine);
    return status;
}

/* Every pair of every generation is independent of the others. */
static void summarise(int n, const struct sums *sums, double *column,
                      struct gbg_dimer_result *result)
{
    double *below = column + n;
    for (int k = 0; k < n; k++) {
        column[k] = sums[k].gap / sums[k].count;
    }
    result->gap = gbg_estimate_mean(n, column);
    for (int k = 0; k < n; k++) {
        column[k] = sums[k].speed / sums[k].count;
    }
    result->speed = gbg_estimate_mean(n, column);
    for (int k = 0; k < n; k++) {
        column[k] = sums[k].near_gap;
        below[k] = sums[k].near_count;
    }
    result->near_gap = gbg_estimate_ratio(n, column, below);
}

int gbg_dimers_measure(struct gbg_context *context, const struct gbg_pair_law *law,
                       const struct gbg_dimer_plan *plan, struct gbg_dimer_result *result)
{
    int total = plan->pairs * plan->generations;
    double response[2], *column = malloc(2 * (size_t)total * sizeof *column);
    struct sums *sums = calloc((size_t)total, sizeof *sums);
    struct generation g = {0};
    int status = column && sums ? reserve(&g, plan->pairs) : GBG_E_MEMORY;
    responses(law, response);
    g.sign = response[0] < response[1] ? -1.0 : 1.0;
    *result = (struct gbg_dimer_result){0};
    for (int k = 0; k < plan->generations && status == GBG_OK; k++) {
        status = run_generation(context, law, plan, k, &g, &result->work, sums + k * plan->pairs);
    }
    if (status == GBG_OK) {
        summarise(total, sums, column, result);
        release(&g);
    }
    free(column);
    free(sums);
    return status;
}

/* A dense suspension: sums over unlike pairs in contact. */
struct dense {
    int64_t n;
    double edge, looks;
    double *x, *y, *fx, *fy, *noise; /* fx, fy: velocities in a step, less the noise */
    int32_t *species;
    struct sums sums;
    double at_contact;
};

static void add_pair(struct dense *d, double sign, int64_t i, int64_t j)
{
    double rx = d->x[i] - d->x[j], ry = d->y[i] - d->y[j];
    rx -= d->edge * rint(rx / d->edge);
    ry -= d->edge * rint(ry / d->edge);
    double square = rx * rx + ry * ry;
    if (square >= (1.0 + near_below) * (1.0 + near_below)) {
        return;
    }
    double r = sqrt(square);
    d->sums.near_gap += r - 1.0;
    d->sums.near_count += 1.0;
    d->at_contact += r - 1.0 < first_bin;
    d->sums.speed += 0.5 * sign * ((d->fx[i] + d->fx[j]) * rx + (d->fy[i] + d->fy[j]) * ry) / r;
}

/* Velocities in the next step, pushes of contacts included and noise taken off. */
static int step_once(struct gbg_context *context, struct gbg_engine *engine,
                     const struct gbg_sample *sample, struct gbg_work *work, struct dense *d)
{
    int64_t step = 0;
    double s = sqrt(sample->temperature * sample->dt);
    int status = gbg_engine_integer(engine, "step", &step);
    status = status ? status : gbg_normals(context, sample->seed, 0, step, 0, 2, d->n, d->noise);
    status = status ? status : gbg_engine_positions(engine, 0, d->n, d->x, d->y, NULL, 1);
    status = status ? status : gbg_work_run(engine, 1, work);
    status = status ? status : gbg_engine_positions(engine, 0, d->n, d->fx, d->fy, NULL, 1);
    for (int64_t i = 0; i < d->n; i++) {
        d->fx[i] = (d->fx[i] - d->x[i] - s * d->noise[2 * i]) / sample->dt;
        d->fy[i] = (d->fy[i] - d->y[i] - s * d->noise[2 * i + 1]) / sample->dt;
    }
    return status;
}

/* All pairs of the present state that could be bound. */
static void look(const struct gbg_pair_law *law, struct dense *d)
{
    double response[2];
    responses(law, response);
    double sign = response[0] < response[1] ? -1.0 : 1.0;
    int like = law->partner[0] == law->partner[1];
    for (int64_t i = 0; i < d->n; i++) {
        for (int64_t j = like ? i + 1 : 0; d->species[i] == law->partner[0] && j < d->n; j++) {
            if (d->species[j] == law->partner[1]) {
                add_pair(d, sign, i, j);
            }
        }
    }
    d->looks += 1.0;
}

static int run_dense(struct gbg_context *context, const struct gbg_pair_law *law,
                     const struct gbg_dense_plan *plan, int64_t seed, struct dense *d,
                     struct gbg_work *work)
{
    static const double look_every = 0.02; /* of time: gaps are forgotten within 0.002 */
    struct gbg_engine *engine = NULL;
    struct gbg_sample sample = {.rule = plan->rule,
                                .dt = plan->dt,
                                .temperature = 0.01,
                                .species = 2,
                                .alpha = {law->alpha[0], law->alpha[1]},
                                .mobility = {law->mobility[0], law->mobility[1]},
                                .power = law->power,
                                .cutoff = 2.5,
                                .seed = seed};
    int64_t stride = (int64_t)fmax(1.0, rint(look_every / plan->dt));
    int64_t looks = (int64_t)rint((plan->until - plan->from) / (plan->dt * (double)stride));
    int status = gbg_discs_equilibrium(context, plan->packing, d->n, seed, d->x, d->y, &d->edge);
    sample.edge = d->edge;
    status = status ? status
                    : gbg_sample_engine(context, &sample, d->n, d->x, d->y, d->species, &engine);
    status = status ? status : gbg_work_run(engine, (int64_t)rint(plan->from / plan->dt), work);
    for (int64_t k = 0; k < looks && status == GBG_OK; k++) {
        status = gbg_work_run(engine, stride - 1, work);
        status = status ? status : step_once(context, engine, &sample, work, d);
        look(law, d);
    }
    gbg_engine_destroy(&engine);
    return status;
}

/* Half of the particles of each species, at random places. */
static void shuffle(struct dense *d, int64_t seed)
{
    uint64_t state = (uint64_t)seed;
    for (int64_t i = 0; i < d->n; i++) {
        d->species[i] = (int32_t)(i % 2);
    }
    for (int64_t i = d->n - 1; i > 0; i--) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        int64_t k = (int64_t)((state >> 33) % (uint64_t)(i + 1));
        int32_t species = d->species[i];
        d->species[i] = d->species[k];
        d->species[k] = species;
    }
}

/* Ratios over starts, which are independent. */
static void summarise_dense(const struct gbg_dense_plan *plan, const double *column,
                            struct gbg_dense_result *result)
{
    int n = plan->starts;
    result->gap = gbg_estimate_ratio(n, column, column + n);
    result->speed = gbg_estimate_ratio(n, column + 2 * n, column + n);
    result->first_bin = gbg_estimate_mean(n, column + 3 * n);
}

int gbg_dense_measure(struct gbg_context *context, const struct gbg_pair_law *law,
                      const struct gbg_dense_plan *plan, struct gbg_dense_result *result)
{
    size_t n = (size_t)plan->n, starts = (size_t)plan->starts;
    struct dense d = {.n = plan->n, .x = malloc(6 * n * sizeof(double))};
    double *column = malloc(4 * starts * sizeof *column);
    d.species = malloc(n * sizeof *d.species);
    int status = d.x && d.species && column ? GBG_OK : GBG_E_MEMORY;
    *result = (struct gbg_dense_result){0};
    for (size_t k = 0; k < starts && status == GBG_OK; k++) {
        d.y = d.x + n;
        d.fx = d.x + 2 * n;
        d.fy = d.x + 3 * n;
        d.noise = d.x + 4 * n;
        d.looks = d.at_contact = 0.0;
        d.sums = (struct sums){0};
        shuffle(&d, plan->seed + (int64_t)k);
        status = run_dense(context, law, plan, plan->seed + 100 * (int64_t)k, &d, &result->work);
        double outer = 1.0 + first_bin, area = pi * (outer * outer - 1.0);
        double like = law->partner[0] == law->partner[1] ? 0.5 : 1.0;
        double uniform = 0.25 * like * (double)n * (double)n * area / (d.edge * d.edge) * d.looks;
        column[k] = d.sums.near_gap;
        column[starts + k] = d.sums.near_count;
        column[2 * starts + k] = d.sums.speed;
        column[3 * starts + k] = d.at_contact / uniform;
    }
    if (status == GBG_OK) {
        summarise_dense(plan, column, result);
    }
    free(d.x);
    free(d.species);
    free(column);
    return status;
}
