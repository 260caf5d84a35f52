/* Benchmark: contact rules: error against the step and against the time of a step. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench/bench.h"
#include "bench/estimators/estimators.h"

/* Exact or best known values. Z(0.52): virial series; C4 and C2 in dense suspensions: the rule
 * bridge at a step 16 times below that of Carter 2016 (24 starts, +- 0.010e-3); beta P sigma^2 at
 * 0.698: Li et al. 2022, N = 128^2. */
static const double z_052 = 4.464, pressure_0698 = 9.17405, pi = 3.14159265358979323846;
static const char *const rules[] = {"event", "bridge", "bounce", "contact", "carter"};
enum { EVENT, BRIDGE, BOUNCE, CONTACT, CARTER, RULES };

/* One line: a quantity of one run. reference NAN: none. */
static int report(struct gbg_bench *bench, const char *what, const char *rule, int64_t n, double dt,
                  const char *quantity, struct gbg_estimate value, double reference,
                  const struct gbg_work *work)
{
    struct gbg_bench_result line = {
        .what = what,
        .precision = "mixed",
        .unit = "particle-steps",
        .n = n,
        .work = work->particle_steps,
        .seconds = {work->wall, work->core, 0.0}, /* no mean: one run */
        .error_rms = fabs(value.mean - reference) / fabs(reference),
        .error_median = NAN,
        .measured = {rule, quantity, dt, value.mean, value.error, reference},
    };
    return gbg_bench_report(bench, &line);
}

/* ---- isolated bound pairs at T = 0.01 ---- */

static int isolated_pair(struct gbg_bench *bench, const struct gbg_pair_law *law, const char *rule,
                         double dt, double effort)
{
    struct gbg_dimer_plan plan = {rule, dt, 0.01, 1024, 1, fmax(400.0 * dt, 1.0) * effort, 1};
    struct gbg_dimer_result r;
    struct gbg_pair_exact exact = gbg_pair_exact(law, plan.temperature, 0.0);
    struct gbg_pair_exact near = gbg_pair_exact(law, plan.temperature, 0.02);
    /* partners may swim to within 6 of those beside them at most */
    double fastest = 0.5 * 18.0 / fmax(gbg_pair_speed(law), 0.1);
    plan.generations = (int)ceil(plan.duration / fastest);
    plan.duration /= plan.generations;
    int status = gbg_dimers_measure(bench->context, law, &plan, &r);
    int64_t n = 2 * plan.pairs;
    status = status ? status
                    : report(bench, law->name, rule, n, dt, "isolated mean gap", r.gap, exact.gap,
                             &r.work);
    status = status ? status
                    : report(bench, law->name, rule, n, dt, "isolated near gap", r.near_gap,
                             near.gap, &r.work);
    if (status == GBG_OK && exact.speed > 0.0) {
        status =
            report(bench, law->name, rule, n, dt, "isolated speed", r.speed, exact.speed, &r.work);
    }
    return status;
}

static int isolated_pairs(struct gbg_bench *bench, const char *rule, double effort)
{
    static const double steps[] = {0.04, 0.01, 0.0025, 0.000625, 0.00015625};
    static struct gbg_pair_law slow[2];
    int status = GBG_OK, n_steps = bench->options->quick ? 2 : 5;
    for (int k = 0; k < 2;
         k++) { /* the long-range power as well; the cut does not matter to them */
        slow[k] = gbg_bound_pairs[k ? 4 : 1];
        slow[k].name = k ? "C4, A-B, power 2" : "C2, A-B, power 2";
        slow[k].power = 2.0;
    }
    for (int s = 0; s < n_steps; s++) {
        for (int k = 0; k < GBG_BOUND_PAIRS && status == GBG_OK; k++) {
            status = isolated_pair(bench, &gbg_bound_pairs[k], rule, steps[s], effort);
        }
        for (int k = 0; k < 2 && status == GBG_OK; k++) {
            status = isolated_pair(bench, &slow[k], rule, steps[s], effort);
        }
    }
    return status;
}

/* ---- passive discs ---- */

struct state {
    int64_t n;
    double packing, edge, *x, *y;
};

static int equilibrium(struct gbg_bench *bench, double packing, int64_t n, struct state *state)
{
    *state = (struct state){n, packing, 0.0, malloc(2 * (size_t)n * sizeof(double)), NULL};
    if (!state->x) {
        return GBG_E_MEMORY;
    }
    state->y = state->x + n;
    return gbg_discs_equilibrium(bench->context, packing, n, 5, state->x, state->y, &state->edge);
}

static int discs(struct gbg_bench *bench, const struct state *state, const char *rule, double s,
                 double duration, int only_pressure)
{
    static const char *const lags[GBG_LAGS] = {
        "displacement at lag 0.04", "displacement at lag 0.16", "displacement at lag 0.64"};
    /* limits of small steps at 0.52, by the rule event */
    static const double limits[GBG_LAGS] = {0.9050, 0.700, 0.412};
    struct gbg_disc_plan plan = {rule, state->packing, s, state->n, 11, duration};
    struct gbg_disc_result r;
    const char *what = state->packing < 0.6 ? "discs 0.52" : "discs 0.698";
    double exact_z = state->packing < 0.6 ? z_052 : pressure_0698 * pi / (4.0 * state->packing);
    double exact_g = 0.5 * (exact_z - 1.0) / state->packing, dt = s * s;
    int status = gbg_discs_measure(bench->context, &plan, state->edge, state->x, state->y, &r);
    r.contact.error = fmax(r.contact.error, r.slow_error);
#define LINE(quantity, value, reference)                                                           \
    status = status ? status                                                                       \
                    : report(bench, what, rule, state->n, dt, quantity, value, reference, &r.work)
    LINE("contact value g", r.contact, exact_g);
    LINE("displacement virial Z", r.virial, exact_z);
    LINE("ratio C", r.ratio, 1.0);
    for (int k = 0; k < GBG_LAGS && !only_pressure; k++) {
        LINE(lags[k], r.msd[k], state->packing < 0.6 ? limits[k] : NAN);
    }
#undef LINE
    return status;
}

static int all_discs(struct gbg_bench *bench, const int *built, double packing, double effort)
{
    static const double steps[] = {0.04, 0.02, 0.01}, duration[] = {80.0, 60.0, 25.0};
    struct state state;
    int status = equilibrium(bench, packing, bench->options->quick ? 256 : 1024, &state);
    for (int rule = 0; rule < CARTER; rule++) {
        /* contact takes ten times as long a step, and is that wrong at once */
        int n_steps = bench->options->quick || rule == CONTACT ? 1 : 3;
        for (int s = 0; s < n_steps && built[rule] && status == GBG_OK; s++) {
            double share = rule == CONTACT ? 0.1 : 1.0;
            status = discs(bench, &state, rules[rule], steps[s], duration[s] * effort * share, 0);
        }
    }
    free(state.x);
    return status;
}

/* ---- dense active suspensions ---- */

static int dense(struct gbg_bench *bench, int pair, const char *rule, double dt, int starts,
                 double packing, double reference)
{
    const struct gbg_pair_law *law = &gbg_bound_pairs[pair];
    struct gbg_dense_plan plan = {rule, dt, packing, 1024, 61, starts, 1.0, 4.0};
    struct gbg_dense_result r;
    if (bench->options->quick) {
        plan.n = 256;
        plan.until = 2.0;
    }
    int status = gbg_dense_measure(bench->context, law, &plan, &r);
#define LINE(quantity, value, known)                                                               \
    status = status ? status                                                                       \
                    : report(bench, law->name, rule, plan.n, dt, quantity, value, known, &r.work)
    LINE("dense near gap", r.gap, reference);
    LINE("dense pairs at contact", r.first_bin, NAN);
    LINE("dense speed", r.speed, NAN);
#undef LINE
    return status;
}

static int all_dense(struct gbg_bench *bench, const int *built)
{
    static const double steps[] = {0.01, 0.0025, 0.000625}, gap[2] = {3.997e-3, 2.957e-3};
    int status = GBG_OK, quick = bench->options->quick;
    for (int rule = EVENT; rule <= BOUNCE; rule++) {
        int n_steps = quick || rule == EVENT ? 1 : 3;
        for (int s = 0; s < n_steps && built[rule]; s++) {
            for (int k = 0; k < 2 && status == GBG_OK; k++) {
                status =
                    dense(bench, k ? 4 : 1, rules[rule], steps[s], quick ? 2 : 6, 0.52, gap[k]);
            }
        }
    }
    return status;
}

static void find_built(struct gbg_bench *bench, int built[RULES])
{
    for (int rule = 0; rule < RULES; rule++) {
        built[rule] = gbg_rule_is_built(bench->context, rules[rule]);
        if (!built[rule]) {
            printf("no rule %s in this build\n", rules[rule]);
        }
    }
}

static int run(struct gbg_bench *bench)
{
    int built[RULES], status = GBG_OK;
    double effort = bench->options->quick ? 0.1 : 1.0;
    find_built(bench, built);
    for (int rule = 0; rule < CARTER && status == GBG_OK; rule++) { /* carter: as bounce */
        if (built[rule]) {
            status = isolated_pairs(bench, rules[rule], effort);
        }
    }
    status = status ? status : all_discs(bench, built, 0.52, effort);
    status = status ? status : all_discs(bench, built, 0.698, effort);
    return status ? status : all_dense(bench, built);
}

const struct gbg_bench_case gbg_bench_contact_rules = {
    "contact-rules",
    "contact rules: error against step and time (dimers, discs, dense suspensions)", run};

/* ---- what the case above leaves open; about two hours ---- */

/* Speeds and gaps of C2 and C4 with more starts than above, C3 at its own packing; and the limit of
 * small steps, a step 16 times below that of Carter 2016: for C2 and C4 by one rule. */
static int open_dense(struct gbg_bench *bench, const char *rule, int limit)
{
    int status = GBG_OK, quick = bench->options->quick;
    for (int k = 1; k < GBG_BOUND_PAIRS && status == GBG_OK; k++) {
        int c3 = k == 2 || k == 3;
        double packing = c3 ? 0.79 : 0.52;
        status = dense(bench, k, rule, 0.01, quick ? 2 : c3 ? 6 : 24, packing, NAN);
        for (int part = 2; part <= 4 && limit && !c3 && status == GBG_OK; part += 2) {
            status = dense(bench, k, rule, 0.01 / part, quick ? 2 : 24, packing, NAN);
        }
        if ((c3 || limit) && status == GBG_OK) {
            status = dense(bench, k, rule, 0.000625, quick ? 2 : c3 ? 4 : 24, packing, NAN);
        }
    }
    return status;
}

static int run_open(struct gbg_bench *bench)
{
    int built[RULES], quick = bench->options->quick;
    double effort = quick ? 0.01 : 1.0;
    struct state fluid, large;
    find_built(bench, built);
    int status = equilibrium(bench, 0.52, 1024, &fluid);
    for (int rule = EVENT; rule <= BOUNCE && status == GBG_OK; rule++) {
        if (built[rule]) { /* s = 0.005 */
            status = discs(bench, &fluid, rules[rule], 0.005, 15.0 * effort, 0);
        }
    }
    free(fluid.x);
    status = status ? status : equilibrium(bench, 0.698, quick ? 1024 : 16384, &large);
    if (status == GBG_OK) { /* the equation of state near freezing */
        status =
            discs(bench, &large, rules[built[EVENT] ? EVENT : BOUNCE], 0.04, 100.0 * effort, 1);
        free(large.x);
    }
    for (int rule = BRIDGE; rule <= BOUNCE && status == GBG_OK; rule++) {
        status = built[rule] ? open_dense(bench, rules[rule], rule == BRIDGE) : status;
    }
    return status;
}

const struct gbg_bench_case gbg_bench_contact_rules_open = {
    "contact-rules-open",
    "the same at s = 0.005, at 0.698 with N = 128^2, C3, dense pairs; about two hours", run_open};
