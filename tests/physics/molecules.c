/* Exact laws of the deterministic part, through contacts: the chase of C0 and C1, the symmetric
 * molecule B-A-B, the centre of mass. No statistics but in one test, which says so. */
#include "gates.h"

static const char *const rules[] = {"event", "bridge", "bounce", "contact"};
enum { RULES = sizeof rules / sizeof *rules };

/* C0, C1: A flees B and B follows A with the same velocity 1/r^n at any distance r, so the distance
 * stays and the pair moves in a straight line. A (the first) starts at +x of B. */
static void chase_of(struct gbg_context *context, const char *rule, double power, double distance,
                     const char *precision)
{
    enum { STEPS = 1000 };
    struct gbg_sample sample = {.rule = rule,
                                .edge = 40.0,
                                .dt = 0.01,
                                .species = 2,
                                .alpha = {1.0, 1.0},
                                .mobility = {1.0, -1.0},
                                .power = power,
                                .cutoff = 10.0,
                                .precision = precision,
                                .seed = 1};
    const double angle = 0.7, e[2] = {cos(angle), sin(angle)};
    double x[2] = {20.0 + distance * e[0], 20.0}, y[2] = {20.0 + distance * e[1], 20.0};
    double to_x[2], to_y[2], path = STEPS * sample.dt / pow(distance, power);
    int32_t species[2] = {0, 1};
    struct gbg_engine *engine;
    done(context, gbg_sample_engine(context, &sample, 2, x, y, species, &engine));
    done(context, gbg_engine_run(engine, STEPS));
    done(context, gbg_engine_positions(engine, 0, 2, to_x, to_y, NULL, 1));
    gbg_engine_destroy(&engine);
    double apart = hypot(to_x[0] - to_x[1], to_y[0] - to_y[1]) - distance, off = 0.0;
    for (int i = 0; i < 2; i++) {
        off = fmax(off, hypot(to_x[i] - x[i] - path * e[0], to_y[i] - y[i] - path * e[1]));
    }
    /* mixed: three factors 1/|r| and one power in 32 bits, all errors of one sign at worst */
    double allowed = strcmp(precision, "double") == 0 ? 1e-12 : 1e-6 * path;
    print_message(
        "chase, %s, r^-%g at %g, %s: distance %+.1e, place %.1e after %g (allowed %.1e)\n", rule,
        power, distance, precision, apart, off, path, allowed);
    assert_true(fabs(apart) <= fmax(allowed, 1e-12) && off <= allowed);
}

static void chase(void **state)
{
    (void)state;
    struct gbg_context *context = opened_context();
    for (int k = 0; k < RULES; k++) {
        chase_of(context, rules[k], 2.0, 1.0 + 1e-9, "double");
        chase_of(context, rules[k], 2.0, 1.7, "double");
        chase_of(context, rules[k], 6.0, 1.001, "double");
        chase_of(context, rules[k], 6.0, 1.2, "mixed");
    }
    gbg_context_destroy(&context);
}

/* Chains B-A-B of C2, far from each other: positions of chain c at 3 c, 3 c + 1 (A), 3 c + 2. */
enum { CHAINS = 256, SIDE = 16, MEMBERS = 3 * CHAINS };

static struct gbg_engine *chains(struct gbg_context *context, const char *rule, double power,
                                 double temperature, double gap)
{
    static double x[MEMBERS], y[MEMBERS];
    static int32_t species[MEMBERS];
    struct gbg_sample sample = {.rule = rule,
                                .edge = SIDE * 16.0,
                                .dt = 0.01,
                                .temperature = temperature,
                                .species = 2,
                                .alpha = {1.0, -1.0},
                                .mobility = {1.0, -2.0},
                                .power = power,
                                .cutoff = 5.0,
                                .precision = "double",
                                .seed = 9};
    for (int i = 0; i < MEMBERS; i++) {
        int chain = i / 3;
        double angle = 2.399963 * chain, along = (1.0 + gap) * (i % 3 - 1);
        x[i] = 16.0 * (chain % SIDE) + 8.0 + along * cos(angle);
        y[i] = 16.0 * (chain / SIDE) + 8.0 + along * sin(angle);
        species[i] = i % 3 == 1 ? 0 : 1;
    }
    struct gbg_engine *engine;
    done(context, gbg_sample_engine(context, &sample, MEMBERS, x, y, species, &engine));
    return engine;
}

static double x0[MEMBERS], z0[MEMBERS], x1[MEMBERS], z1[MEMBERS], column[CHAINS];

/* Without noise the middle stays where it is and the ends stay bound, whatever the rule does. The
 * state is unstable: a rounding error grows with every bounce, hence few steps. */
static void still_chain(void **state)
{
    (void)state;
    struct gbg_context *context = opened_context();
    for (int k = 0; k < RULES; k++) {
        struct gbg_engine *engine = chains(context, rules[k], 2.0, 0.0, 0.01);
        double moved = 0.0, longest = 0.0;
        done(context, gbg_engine_positions(engine, 0, MEMBERS, x0, z0, NULL, 1));
        done(context, gbg_engine_run(engine, 50));
        done(context, gbg_engine_positions(engine, 0, MEMBERS, x1, z1, NULL, 1));
        gbg_engine_destroy(&engine);
        for (int i = 0; i < MEMBERS; i += 3) {
            moved = fmax(moved, hypot(x1[i + 1] - x0[i + 1], z1[i + 1] - z0[i + 1]));
            longest = fmax(longest, hypot(x1[i] - x1[i + 1], z1[i] - z1[i + 1]));
        }
        print_message("B-A-B, %s: the middle moved by %.1e, largest bond %.4f\n", rules[k], moved,
                      longest);
        /* bridge: its pushes solve equations, to a tolerance */
        assert_true(moved < (strcmp(rules[k], "bridge") == 0 ? 1e-5 : 1e-9) && longest < 1.1);
    }
    gbg_context_destroy(&context);
}

/* With noise the mean velocity along the axis, from one end to the other, is zero since the ends
 * are alike. Sample: 256 chains for 4000 steps; four standard errors. */
static void mean_velocity(void **state)
{
    (void)state;
    enum { LOOKS = 4000 };
    struct gbg_context *context = opened_context();
    for (int k = 0; k < RULES; k++) {
        struct gbg_engine *engine = chains(context, rules[k], 6.0, 0.001, 0.001);
        memset(column, 0, sizeof column);
        for (int look = 0; look < LOOKS; look++) {
            done(context, gbg_engine_positions(engine, 0, MEMBERS, x0, z0, NULL, 1));
            done(context, gbg_engine_run(engine, 1));
            done(context, gbg_engine_positions(engine, 0, MEMBERS, x1, z1, NULL, 1));
            for (int c = 0; c < CHAINS; c++) {
                int i = 3 * c;
                double ex = x0[i + 2] - x0[i], ey = z0[i + 2] - z0[i], r = hypot(ex, ey);
                for (int j = i; j < i + 3; j++) {
                    column[c] +=
                        (ex * (x1[j] - x0[j]) + ey * (z1[j] - z0[j])) / (3.0 * r) / (0.01 * LOOKS);
                }
            }
        }
        gbg_engine_destroy(&engine);
        struct gbg_estimate speed = gbg_estimate_mean(CHAINS, column);
        print_message("B-A-B, %s: speed along the axis %+.1e +- %.1e\n", rules[k], speed.mean,
                      speed.error);
        assert_true(fabs(speed.mean) < 4.0 * speed.error && speed.error < 0.01);
    }
    gbg_context_destroy(&context);
}

/* A dense suspension of C2 or C4: the sum of all moves of a step is that of noise and of forces, by
 * loops of its own; contacts add nothing, to the rounding of the coordinates. */
enum { N = 400 };
static double sx[N], sy[N], px[N], py[N], qx[N], qy[N], noise[2 * N];
static int32_t kind[N];

static void sum_of_forces(const struct gbg_sample *sample, double sum[2])
{
    sum[0] = sum[1] = 0.0;
    for (int i = 0; i < N; i++) {
        for (int j = 0; j < N; j++) {
            double rx = px[i] - px[j], ry = py[i] - py[j];
            rx -= sample->edge * rint(rx / sample->edge);
            ry -= sample->edge * rint(ry / sample->edge);
            double r = hypot(rx, ry);
            if (i != j && r < sample->cutoff) {
                double f = sample->mobility[kind[i]] * sample->alpha[kind[j]] /
                           pow(r, sample->power + 1.0);
                sum[0] += f * rx;
                sum[1] += f * ry;
            }
        }
    }
}

static void momentum_of(struct gbg_context *context, const char *rule, double mobility, double edge)
{
    enum { STEPS = 60 };
    struct gbg_sample sample = {.rule = rule,
                                .edge = edge,
                                .dt = 0.01,
                                .temperature = 0.01,
                                .species = 2,
                                .alpha = {1.0, -1.0},
                                .mobility = {1.0, mobility},
                                .power = 6.0,
                                .cutoff = 2.5,
                                .precision = "double",
                                .seed = 3};
    struct gbg_engine *engine;
    int64_t pushes;
    double worst = 0.0, s = sqrt(sample.temperature * sample.dt), total = 0.0;
    for (int i = 0; i < N; i++) {
        kind[i] = i / 3 % 2;
    }
    done(context, gbg_sample_engine(context, &sample, N, sx, sy, kind, &engine));
    for (int step = 0; step < STEPS; step++) {
        double force[2], off[2] = {0.0, 0.0};
        done(context, gbg_engine_positions(engine, 0, N, px, py, NULL, 1));
        sum_of_forces(&sample, force);
        done(context, gbg_normals(context, sample.seed, 0, step, 0, 2, N, noise));
        done(context, gbg_engine_run(engine, 1));
        done(context, gbg_engine_positions(engine, 0, N, qx, qy, NULL, 1));
        for (int i = 0; i < N; i++) {
            off[0] += qx[i] - px[i] - s * noise[2 * i];
            off[1] += qy[i] - py[i] - s * noise[2 * i + 1];
        }
        for (int a = 0; a < 2; a++) {
            worst = fmax(worst, fabs(off[a] - sample.dt * force[a]));
            total = fmax(total, fabs(sample.dt * force[a]));
        }
    }
    done(context, gbg_engine_integer(engine, "contact_pairs", &pushes));
    gbg_engine_destroy(&engine);
    print_message(
        "momentum, %s, mobility of B %g: %lld pushes; sum of moves less noise less forces "
        "%.1e (moves by forces to %.1e)\n",
        rule, mobility, (long long)pushes, worst, total);
    /* N coordinates near 30 in double, read out before and after */
    assert_true(pushes > STEPS && worst < 1e-11);
}

static void momentum(void **state)
{
    (void)state;
    struct gbg_context *context = opened_context();
    double edge;
    done(context, gbg_discs_equilibrium(context, 0.6, N, 4, sx, sy, &edge));
    for (int k = 0; k < RULES; k++) {
        momentum_of(context, rules[k], -2.0, edge);
        momentum_of(context, rules[k], -4.0, edge);
    }
    gbg_context_destroy(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(chase),
        cmocka_unit_test(still_chain),
        cmocka_unit_test(mean_velocity),
        cmocka_unit_test(momentum),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
