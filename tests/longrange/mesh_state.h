/* Tests of long-range sums: sets of particles as states of a backend, and sums on them. */
#ifndef GBG_TESTS_LONGRANGE_MESH_STATE_H
#define GBG_TESTS_LONGRANGE_MESH_STATE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "sets.h"

#include "backend/backend.h"
#include "ewald/plan.h"
#include "gamboge/gamboge.h"

struct bench {
    struct gbg_context *context;
    const struct gbg_backend *backend;
    struct gbg_device *device;
    const struct gbg_kernels *kernels;
};

static inline struct bench bench_open(const char *text)
{
    struct bench b;
    if (gbg_context_create(text, &b.context) != GBG_OK) {
        fail_msg("%s", gbg_message(NULL));
    }
    b.backend = gbg_backend_find(strncmp(text, "poison", 6) == 0 ? "poison" : "cpu");
    assert_int_equal(b.backend->create(b.context, &b.device), GBG_OK);
    b.kernels = b.backend->kernels(b.device);
    return b;
}

static inline void bench_close(struct bench *b)
{
    b->backend->destroy(b->device);
    gbg_context_destroy(&b->context);
}

/* A caller's own alphas, one species. Particle i of the set stands at place i, or, shuffled, at a
 * place of its own, its id being i. */
struct particles {
    struct gbg_state state;
    int32_t *place;
};

static inline void *new_array(int64_t n, size_t size)
{
    void *array = calloc((size_t)n + 16, size);
    assert_non_null(array);
    return array;
}

static inline void place_at(struct particles *p, const struct particle_set *s, const double *shift)
{
    for (int a = 0; a < s->dimension; a++) {
        for (int64_t i = 0; i < s->n; i++) {
            uint64_t f = gbg_box_encode(&p->state.box, a, s->position[a][i], NULL);
            f += shift ? (uint64_t)(shift[a] * 0x1p53) << 11 : 0;
            p->state.high[a][p->place[i]] = (uint32_t)(f >> 32);
            p->state.low[a][p->place[i]] = (uint32_t)f;
        }
    }
}

static inline struct particles particles_of(const struct particle_set *s, int shuffled)
{
    struct particles p = {.state = {.owned = s->n, .n_species = 1}};
    struct gbg_state *state = &p.state;
    state->box = gbg_box_make(s->dimension, s->length, NULL);
    p.place = new_array(s->n, sizeof *p.place);
    state->own_alpha = new_array(s->n, sizeof(double));
    for (int64_t i = 0; i < s->n; i++) {
        p.place[i] = (int32_t)(shuffled ? (i * 7919 + 13) % s->n : i);
        state->own_alpha[p.place[i]] = s->alpha[i];
    }
    if (shuffled) {
        state->id = new_array(s->n, sizeof *state->id);
        state->rank = new_array(s->n, sizeof *state->rank);
        for (int64_t i = 0; i < s->n; i++) {
            state->id[p.place[i]] = (uint64_t)i;
            state->rank[p.place[i]] = (int32_t)i;
        }
    }
    for (int a = 0; a < s->dimension; a++) {
        state->high[a] = new_array(s->n, 4);
        state->low[a] = new_array(s->n, 4);
        state->force[a] = new_array(s->n, sizeof(double));
    }
    state->alpha[0] = 1.0;
    state->mobility[0] = 1.0;
    place_at(&p, s, NULL);
    return p;
}

static inline void particles_free(struct particles *p)
{
    free(p->place);
    free(p->state.own_alpha);
    free(p->state.id);
    free(p->state.rank);
    for (int a = 0; a < 3; a++) {
        free(p->state.high[a]);
        free(p->state.low[a]);
        free(p->state.force[a]);
    }
}

/* A solver by hand: band (times the reach), cells over those that it needs, widths by waves and by
 * slopes of the window. */
struct recipe {
    const char *name;
    int split, window, single, width[2];
    double band, finer;
};

static inline struct gbg_ewald_plan plan_of(const struct recipe *r, const struct particle_set *s,
                                            double power, int gradient)
{
    struct gbg_ewald_plan plan;
    struct gbg_ewald_choice c = {.dimension = s->dimension,
                                 .power = power,
                                 .split = r->split,
                                 .window = r->window,
                                 .gradient = gradient,
                                 .single = r->single,
                                 .band = r->band,
                                 .width = r->width[gradient]};
    double volume = s->length[0] * s->length[1] * s->length[2], shortest = s->length[0];
    for (int a = 0; a < s->dimension; a++) {
        c.length[a] = s->length[a];
        shortest = fmin(shortest, s->length[a]);
    }
    c.reach = fmin((s->dimension == 2 ? 3.6 : 2.2) * pow(volume / (double)s->n, 1.0 / s->dimension),
                   0.5 * shortest);
    for (int a = 0; a < s->dimension; a++) {
        double least = r->finer * r->band * s->length[a] / (3.141592653589793 * c.reach);
        c.cells[a] = gbg_ewald_cells(fmax(least, c.width));
    }
    assert_int_equal(gbg_ewald_plan_make(&c, &plan), GBG_OK);
    return plan;
}

static inline void forces_by_mesh(const struct bench *b, const struct gbg_ewald_plan *plan,
                                  int hurry, struct particles *p)
{
    struct gbg_ewald *sum;
    if (b->kernels->ewald_create(b->device, &p->state, plan, hurry, &sum) != GBG_OK) {
        fail_msg("%s", gbg_message(b->context));
    }
    assert_int_equal(b->kernels->ewald_force(b->device, &p->state, sum, 0), GBG_OK);
    b->kernels->ewald_destroy(b->device, sum);
}

#endif
