/* Tests: the same particles written into the states of a CPU's engine and of a GPU's. */
#ifndef GBG_TESTS_BOTH_STATE_H
#define GBG_TESTS_BOTH_STATE_H

#include "both.h"

enum { PLACES_MAX = 5000 };

/* Coordinates as fractions of the box. */
struct places {
    int64_t n;
    int dimension;
    uint64_t fraction[3][PLACES_MAX];
};

static inline void both_upload(struct both *both, void *cpu, void *gpu, const void *data,
                               size_t bytes)
{
    void *to[2] = {cpu, gpu};
    for (int b = 0; b < 2 && bytes > 0; b++) {
        struct gbg_engine *engine = both->engine[b];
        assert_int_equal(engine->backend->upload(engine->device, to[b], data, bytes), GBG_OK);
    }
}

/* Puts the particles of both engines there; lists are too old then. */
static inline void both_place(struct both *both, const struct places *places)
{
    static uint32_t high[PLACES_MAX], low[PLACES_MAX];
    struct gbg_state *p = &both->engine[0]->state, *q = &both->engine[1]->state;
    size_t bytes = (size_t)places->n * 4;
    assert_int_equal(p->owned, places->n);
    for (int a = 0; a < places->dimension; a++) {
        for (int64_t i = 0; i < places->n; i++) {
            high[i] = (uint32_t)(places->fraction[a][i] >> 32);
            low[i] = (uint32_t)places->fraction[a][i];
        }
        both_upload(both, p->high[a], q->high[a], high, bytes);
        both_upload(both, p->low[a], q->low[a], low, bytes);
    }
    p->epoch++;
    q->epoch++;
}

/* The places of the first engine's particles. */
static inline void both_read(struct both *both, struct places *places)
{
    struct gbg_state *state = &both->engine[0]->state;
    places->n = state->owned;
    places->dimension = state->box.dimension;
    for (int a = 0; a < places->dimension; a++) {
        for (int64_t i = 0; i < places->n; i++) {
            places->fraction[a][i] = (uint64_t)state->high[a][i] << 32 | state->low[a][i];
        }
    }
}

/* Anywhere in the box; the first `coincident` particles in pairs at the same place, and three more
 * at one. */
static inline void places_at_random(struct places *places, int64_t n, int dimension, uint64_t seed,
                                    int64_t coincident)
{
    places->n = n;
    places->dimension = dimension;
    for (int a = 0; a < dimension; a++) {
        for (int64_t i = 0; i < n; i++) {
            struct gbg_philox r =
                gbg_philox(gbg_philox_counter(seed, (uint64_t)i, (uint32_t)(100 + a)), 12345, 6789);
            places->fraction[a][i] = (uint64_t)r.word[0] << 32 | r.word[1];
        }
        for (int64_t i = 1; i < coincident && i < n; i += 2) {
            places->fraction[a][i] = places->fraction[a][i - 1];
        }
        for (int64_t i = coincident; coincident > 0 && i < coincident + 3 && i < n; i++) {
            places->fraction[a][i] = places->fraction[a][coincident];
        }
    }
}

/* Everybody moves by up to `jump` on each axis. */
static inline void places_jump(struct places *places, const struct gbg_box *box, double jump,
                               uint64_t seed)
{
    for (int64_t i = 0; i < places->n; i++) {
        for (int a = 0; a < places->dimension; a++) {
            double u = 2.0 * made_uniform(seed + (uint64_t)(3 * i + a)) - 1.0;
            places->fraction[a][i] += (uint64_t)(int64_t)(u * jump / box->quantum[a]);
        }
    }
}

/* Gives the particles ids that are neither their indices nor in their order, some above 2^32. */
static inline void both_permute(struct both *both)
{
    static uint64_t id[PLACES_MAX];
    static int32_t rank[PLACES_MAX];
    int64_t n = both->engine[0]->state.owned, factor = n % 7 == 0 ? 11 : 7;
    assert_true(factor == 7 || n % 11 != 0);
    for (int64_t i = 0; i < n; i++) {
        rank[i] = (int32_t)((factor * i + 3) % n);
        id[i] = 5 * (uint64_t)rank[i] + (rank[i] > n / 2 ? UINT64_C(1) << 33 : 0);
    }
    for (int b = 0; b < 2; b++) {
        struct gbg_engine *engine = both->engine[b];
        const struct gbg_backend *backend = engine->backend;
        assert_null(engine->state.id);
        assert_int_equal(backend->allocate(engine->device, (void **)&engine->state.id, n, 8, "ids"),
                         GBG_OK);
        assert_int_equal(
            backend->allocate(engine->device, (void **)&engine->state.rank, n, 4, "ranks"), GBG_OK);
    }
    struct gbg_state *p = &both->engine[0]->state, *q = &both->engine[1]->state;
    both_upload(both, p->id, q->id, id, (size_t)n * 8);
    both_upload(both, p->rank, q->rank, rank, (size_t)n * 4);
    p->epoch++;
    q->epoch++;
}

/* Builds the lists of both. */
static inline void both_list(struct both *both)
{
    for (int b = 0; b < 2; b++) {
        struct gbg_engine *engine = both->engine[b];
        assert_int_equal(
            engine->kernels->list_update(engine->device, &engine->state, engine->contacts, 1e300),
            GBG_OK);
    }
}

/* The present coordinates become those before the step. */
static inline void both_keep(struct both *both)
{
    for (int b = 0; b < 2; b++) {
        struct gbg_engine *engine = both->engine[b];
        assert_int_equal(engine->kernels->keep(engine->device, &engine->state), GBG_OK);
    }
}

/* Diameters of a scene's species: alike, 1 : 20, a species without cores, ten between 0.3 and 1.2,
 * one species. */
enum { MIXTURES = 5 };
static inline void set_mixture(struct gbg_scene *scene, struct made_particles *made, int mixture)
{
    static const double two[][2] = {{1.0, 1.0}, {0.06, 1.2}, {0.0, 1.0}};
    if (mixture < 3) {
        scene->species[0].diameter = two[mixture][0];
        scene->species[1].diameter = two[mixture][1];
        return;
    }
    scene->n_species = mixture == 3 ? 10 : 1;
    for (int s = 0; s < scene->n_species; s++) {
        scene->species[s] = scene->species[0];
        scene->species[s].diameter = mixture == 3 ? 0.3 + 0.1 * s : 1.0;
    }
    for (int64_t i = 0; i < made->p.n; i++) {
        made->species[i] = (int32_t)(i * 13 / 7 % scene->n_species);
    }
}

#endif
