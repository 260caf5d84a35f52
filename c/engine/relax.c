/* L2: parts the hard cores of an overlapping start, or says why it cannot.
 *
 * First plain rounds of bounce with the whole diameters: from random points they part discs up to a
 * packing of about 0.8 and spheres up to 0.6. What they leave is done by growth (Lubachevsky and
 * Stillinger's idea in Brownian form): diameters are made so small that rounds part them, then grow
 * by a little before every Brownian step without forces, as fast as rounds can follow. All random
 * numbers come from the scene's seed and the ids, so a start is relaxed to the same bits on any
 * number of threads. */
#include "engine/relax.h"

#include <math.h>

#include "engine/engine.h"

static const double tolerance = 0.9e-12;

/* Rounds, and the largest part of contact that one moves a disc: deep overlaps of random points
 * need large pushes; after a step of growth they are shallow, and rounds that do not part them soon
 * never will. */
enum { PLAIN_ROUNDS = 200, ROUNDS = 60 };
static const double plain_cap = 0.25, cap = 0.1, cap_of_mixtures = 0.05;

/* Steps of growth without visible progress after which a start is given up, and in all. */
enum { PATIENCE = 3000, MOST_STEPS = 60000 };
static const double visible = 0.01, slowest = 1e-5, loosening = 0.02;

struct growth {
    struct gbg_engine *engine;
    struct gbg_state *state; /* the engine's, without forces */
    double whole[GBG_SPECIES_MAX];
    double size;         /* present diameters over whole ones */
    double speed;        /* relative growth a step */
    double kick, widest; /* standard deviation of a step, and its largest */
    uint64_t step;
    int mixture; /* 1: diameters differ */
};

static void set_size(struct growth *growth, double size)
{
    growth->size = size;
    for (int s = 0; s < growth->state->n_species; s++) {
        growth->state->diameter[s] = growth->whole[s] * size;
    }
}

/* Rounds at the present diameters; *left: pairs that overlap after them. */
static int part(struct growth *growth, double moved, int64_t rounds, double push, int64_t *left)
{
    struct gbg_engine *engine = growth->engine;
    struct gbg_contacts contacts = {
        .parting = GBG_PARTING_BOUNCE, .max_rounds = rounds, .tolerance = tolerance, .cap = push};
    int status =
        engine->kernels->list_update(engine->device, growth->state, engine->contacts, moved);
    if (status == GBG_OK) {
        status =
            engine->kernels->contacts(engine->device, growth->state, engine->contacts, &contacts);
    }
    *left = contacts.left;
    return status;
}

static int take_back(struct growth *growth)
{
    growth->state->epoch++; /* lists do not know the way back */
    return growth->engine->kernels->put_back(growth->engine->device, growth->state);
}

/* Small enough that rounds part random points in a few. */
static double first_size(const struct gbg_engine *engine)
{
    double packing = gbg_scene_packing(&engine->scene);
    double easy = engine->state.box.dimension == 2 ? 0.5 : 0.3;
    return packing > easy ? pow(easy / packing, 1.0 / engine->state.box.dimension) : 0.9;
}

static int shrink(struct growth *growth)
{
    int64_t left = 1;
    double size = first_size(growth->engine);
    int status = GBG_OK;
    for (int k = 0; status == GBG_OK && left > 0 && k < 20; k++, size *= 0.9) {
        set_size(growth, size);
        status = part(growth, 0.0, PLAIN_ROUNDS, plain_cap, &left);
    }
    return status;
}

/* A Brownian step with larger diameters; where rounds cannot follow it is taken back, and the next
 * one is smaller. */
static int grow(struct growth *growth)
{
    struct gbg_engine *engine = growth->engine;
    const struct gbg_kernels *kernels = engine->kernels;
    struct gbg_noise noise = {
        .seed = engine->noise.seed, .run = engine->noise.run, .scale = growth->kick};
    struct gbg_moves moves;
    int64_t left = 1;
    double size = growth->size;
    int status = kernels->keep(engine->device, growth->state);
    if (status == GBG_OK) {
        status = kernels->integrate(engine->device, growth->state, &noise, growth->step++, 0.0, 1,
                                    &moves);
    }
    if (status == GBG_OK) {
        set_size(growth, fmin(1.0, size * (1.0 + growth->speed)));
        status = part(growth, moves.total, ROUNDS, growth->mixture ? cap_of_mixtures : cap, &left);
    }
    if (status == GBG_OK && left > 0) {
        status = take_back(growth);
        growth->speed *= 0.5;
        growth->kick = fmax(0.9 * growth->kick, 0.1 * growth->widest);
        if (growth->speed < slowest) { /* jammed: loosen, and try another way */
            growth->speed = 0.01;
            growth->kick = growth->widest;
            size *= 1.0 - loosening;
        }
        set_size(growth, size);
    } else {
        growth->speed = fmin(1.2 * growth->speed, 0.02);
        growth->kick = fmin(1.02 * growth->kick, growth->widest);
    }
    return status;
}

static int grow_to_whole(struct growth *growth)
{
    double reached = growth->size;
    int64_t seen = 0, step = 0;
    int status = GBG_OK;
    growth->speed = 0.01;
    growth->widest = growth->kick = 0.05 * growth->engine->contact;
    for (; status == GBG_OK && growth->size < 1.0 && step < MOST_STEPS && step - seen < PATIENCE;
         step++) {
        status = grow(growth);
        if (1.0 - growth->size < (1.0 - reached) * (1.0 - visible)) {
            reached = growth->size;
            seen = step;
        }
    }
    return status;
}

static int refuse(const struct growth *growth, const char *call, int64_t overlapping)
{
    const struct gbg_engine *engine = growth->engine;
    return gbg_fail(engine->context, GBG_E_OVERLAP,
                    "%s: excluded_volume.start: relax did not part the %lld pairs that overlap at "
                    "the start: at packing %.6g the cores could be grown to %.6g of their "
                    "diameters, and no farther in %llu steps; give a larger box or fewer "
                    "particles, or start from a lattice",
                    call, (long long)overlapping, gbg_scene_packing(&engine->scene), growth->size,
                    (unsigned long long)growth->step);
}

static int relax(struct growth *growth, const char *call, int64_t overlapping)
{
    struct gbg_engine *engine = growth->engine;
    int64_t left = 0;
    int status = engine->kernels->keep(engine->device, growth->state);
    status = status ? status : part(growth, 0.0, PLAIN_ROUNDS, plain_cap, &left);
    if (status == GBG_OK && left > 0) {
        status = take_back(growth);
        status = status ? status : shrink(growth);
        status = status ? status : grow_to_whole(growth);
        if (status == GBG_OK && growth->size < 1.0) {
            status = refuse(growth, call, overlapping);
        }
    }
    return status ? status : engine->kernels->keep(engine->device, growth->state);
}

int gbg_engine_relax(struct gbg_engine *engine, const char *call)
{
    struct gbg_state *state = &engine->state;
    struct growth growth = {.engine = engine, .state = state, .size = 1.0};
    double *force[3];
    int64_t overlapping = 0;
    int status = engine->contact > 0.0 ? gbg_engine_count_overlaps(engine, &overlapping) : GBG_OK;
    if (status != GBG_OK || overlapping == 0) {
        return status;
    }
    for (int a = 0; a < 3; a++) {
        force[a] = state->force[a];
        state->force[a] = NULL; /* a step without forces */
    }
    for (int s = 0; s < state->n_species; s++) {
        growth.whole[s] = state->diameter[s];
        growth.mixture |= growth.whole[s] != growth.whole[0];
    }
    status = relax(&growth, call, overlapping);
    for (int a = 0; a < 3; a++) {
        state->force[a] = force[a];
    }
    for (int s = 0; s < state->n_species; s++) {
        state->diameter[s] = growth.whole[s];
    }
    state->epoch++; /* lists are built anew */
    engine->forces_current = 0;
    return status;
}
