/* Tests: small scenes and engines made in memory, and naive loops to compare them with. */
#ifndef GBG_TESTS_MADE_SCENE_H
#define GBG_TESTS_MADE_SCENE_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/random.h"
#include "engine/engine.h"

static inline double made_uniform(uint64_t k)
{
    struct gbg_philox r = gbg_philox(gbg_philox_counter(k, 0, 99), 12345, 6789);
    return gbg_uniform(r.word[0], r.word[1]);
}

static inline struct gbg_context *made_context(const char *text)
{
    struct gbg_context *context;
    assert_int_equal(gbg_context_create(text, &context), GBG_OK);
    return context;
}

/* A resolved scene without particles (both species count as present): Brownian, no forces, bounce
 * rule, two species A(alpha -1, mobility 1) and B(alpha 1, mobility -2) of diameter 1. */
static inline struct gbg_scene made_scene(struct gbg_context *context, int dimension,
                                          const double *length)
{
    struct gbg_scene scene = {.context = context, .dimension = dimension, .n_species = 2};
    for (int a = 0; a < dimension; a++) {
        scene.length[a] = length[a];
        scene.origin[a] = -0.25 * length[a];
    }
    scene.species[0] = (struct gbg_species){
        .name = "A", .diameter = 1.0, .alpha = -1.0, .mobility = 1.0, .count = 1};
    scene.species[1] = (struct gbg_species){
        .name = "B", .diameter = 1.0, .alpha = 1.0, .mobility = -2.0, .count = 1};
    scene.start = GBG_START_LATTICE;
    scene.rule = GBG_RULE_BOUNCE;
    scene.max_rounds = 1000;
    scene.reverted = 1e-6;
    scene.dynamics = GBG_DYNAMICS_BROWNIAN;
    scene.dt = 0.01;
    scene.temperature = 0.01;
    scene.seed = 7;
    return scene;
}

/* The force of Carter 2016 in short range, r/r^7 cut at 2.5. */
static inline void made_short_forces(struct gbg_scene *scene)
{
    scene->n_forces = 1;
    scene->force[0] = (struct gbg_force){.power = 6.0, .sum = GBG_SUM_CUTOFF, .cutoff = 2.5};
}

enum { MADE_MOST = 70000 };

struct made_particles {
    struct gbg_particles p;
    double store[3][MADE_MOST];
    int32_t species[MADE_MOST];
    int64_t id[MADE_MOST];
};

/* n particles on a jittered square or cubic lattice with spacing box/m, alternating species. */
static inline void made_lattice(struct made_particles *made, const struct gbg_scene *scene,
                                int64_t m, double jitter)
{
    int64_t n = scene->dimension == 2 ? m * m : m * m * m;
    assert_true(n <= MADE_MOST);
    made->p = (struct gbg_particles){n,
                                     scene->dimension,
                                     {made->store[0], made->store[1], made->store[2]},
                                     made->species,
                                     made->id};
    for (int64_t i = 0; i < n; i++) {
        int64_t cell[3] = {i % m, i / m % m, i / m / m};
        for (int a = 0; a < scene->dimension; a++) {
            double shift = jitter * (2.0 * made_uniform((uint64_t)(3 * i + a)) - 1.0);
            made->store[a][i] =
                scene->origin[a] + scene->length[a] / (double)m * ((double)cell[a] + 0.5 + shift);
        }
        made->species[i] = (int32_t)(made_uniform((uint64_t)(100000 + i)) < 0.5);
        made->id[i] = i;
    }
}

/* A lattice of m particles a side in a box of edge 4 m, drawn together around the origin until they
 * all but touch, that attract each other over all distances. Sums are strict: the same bits
 * everywhere. */
static inline void made_pressed(struct made_particles *made, struct gbg_scene *scene, int64_t m)
{
    scene->precision = GBG_PRECISION_STRICT;
    scene->n_forces = 1;
    scene->force[0] = (struct gbg_force){.power = 2.0, .sum = GBG_SUM_MINIMUM_IMAGE};
    for (int s = 0; s < 2; s++) {
        scene->species[s].alpha = 2.0;
        scene->species[s].mobility = -1.0;
    }
    made_lattice(made, scene, m, 0.005);
    for (int64_t i = 0; i < made->p.n; i++) {
        for (int a = 0; a < scene->dimension; a++) {
            made->store[a][i] *= 1.02 / 4.0;
        }
    }
}

static inline struct gbg_engine *made_engine(struct gbg_scene *scene,
                                             const struct made_particles *made)
{
    struct gbg_engine *engine = NULL;
    int status = gbg_engine_make(scene, &made->p, &engine);
    if (status != GBG_OK) {
        fail_msg("%s", gbg_message(scene->context));
    }
    return engine;
}

/* Smallest distance over contact distance of all pairs, by a plain double loop. */
static inline double naive_closest(struct gbg_engine *engine)
{
    static double r[3][MADE_MOST];
    double least = INFINITY;
    int64_t n = engine->state.owned;
    int dimension = engine->state.box.dimension;
    for (int a = 0; a < dimension; a++) {
        assert_int_equal(gbg_engine_decode(engine, 1, a, r[a], 1), GBG_OK);
    }
    for (int64_t i = 0; i < n; i++) {
        for (int64_t j = 0; j < i; j++) {
            double squared = 0.0;
            for (int a = 0; a < dimension; a++) {
                double length = engine->state.box.length[a], d = r[a][i] - r[a][j];
                d -= length * rint(d / length);
                squared += d * d;
            }
            int s = engine->state.species ? engine->state.species[i] : 0;
            int t = engine->state.species ? engine->state.species[j] : 0;
            double contact = 0.5 * (engine->state.diameter[s] + engine->state.diameter[t]);
            least = fmin(least, sqrt(squared) / contact);
        }
    }
    return least;
}

/* Steps with contacts, after each of which the loop above finds no overlap. */
static inline void run_without_overlap(struct gbg_engine *engine, int steps, const char *what)
{
    int64_t before = engine->contact_pairs;
    for (int k = 0; k < steps; k++) {
        if (gbg_engine_advance(engine, 1) != GBG_OK) {
            fail_msg("%s", gbg_message(engine->context));
        }
        double closest = naive_closest(engine);
        if (closest < 1.0 - 1e-12) {
            fail_msg("%s, step %d: closest pair at %.17g contacts", what, k, closest);
        }
    }
    print_message("%s: %.2f pushes a particle and step\n", what,
                  (double)(engine->contact_pairs - before) / steps / (double)engine->state.owned);
    assert_true(engine->contact_pairs > before);
}

#endif
