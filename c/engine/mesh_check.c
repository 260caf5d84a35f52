/* L2: sums over all images of an engine: made with it, their error measured when a run starts and
 * when particles have gathered or spread, refined where they miss their tolerance. */
#include "engine/mesh_check.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/memory.h"
#include "engine/engine.h"
#include "engine/sample.h"
#include "engine/steps.h"

/* Steps between looks at the density, the change of its contrast that calls for a new measurement,
 * and particles in the mean in a cell of such a look. */
enum { LOOK_EVERY = 100, CROWD = 16 };

/* Particles of later measurements: their RMS error is known to some 5 %. */
enum { FEWER_SAMPLES = 200 };
static const double changed = 2.0;

/* Particles fetched at a time by a look. */
enum { PIECE = 1 << 18 };

/* A run so short is not worth trying which plan of a transform is the fastest. */
enum { SHORT_RUN = 1000 };

struct gbg_mesh_sums {
    struct gbg_mesh_sum force[GBG_MAX_FORCES]; /* as the scene's; body NULL: none of ours */
    int checked;
    double contrast; /* of the density at the last check */
    double size;     /* RMS force then; -1: not known yet */
    double typical;  /* force of a neighbour */
    int32_t cells[3];
    int32_t *count;  /* particles in each cell */
    uint32_t *words; /* of a piece: its cells, and coordinates on their way */
};

static double typical_force(const struct gbg_engine *engine, double power);

static struct gbg_mesh_place place_of(const struct gbg_engine *engine)
{
    return (struct gbg_mesh_place){.context = engine->context,
                                   .backend = engine->backend,
                                   .kernels = engine->kernels,
                                   .device = engine->device,
                                   .state = &engine->state,
                                   .hurry = engine->scene.steps < SHORT_RUN};
}

/* Square cells for the look, as many as make CROWD particles in the mean. */
static int64_t lay_cells(const struct gbg_engine *engine, int32_t cells[3])
{
    const struct gbg_box *box = &engine->state.box;
    double edge = 1.0;
    int64_t all = 1;
    for (int a = 0; a < box->dimension; a++) {
        edge *= pow(box->length[a], 1.0 / box->dimension);
    }
    edge *= pow((double)CROWD / (double)engine->state.owned, 1.0 / box->dimension);
    for (int a = 0; a < box->dimension; a++) {
        cells[a] = (int32_t)fmax(1.0, fmin(floor(box->length[a] / edge), 1e6));
        all *= cells[a];
    }
    return all;
}

static int make_mesh_sums(struct gbg_engine *engine)
{
    void *memory = NULL, *count = NULL, *words = NULL;
    int64_t n = engine->state.owned, piece = n < PIECE ? n : PIECE;
    int status = gbg_allocate_zero(engine->context, &memory, 1, sizeof *engine->mesh_sums,
                                   "long-range sums");
    if (status != GBG_OK) {
        return status;
    }
    engine->mesh_sums = memory;
    if (n > 0) {
        status = gbg_allocate(engine->context, &count, lay_cells(engine, engine->mesh_sums->cells),
                              sizeof *engine->mesh_sums->count, "density");
        engine->mesh_sums->count = count;
        status = status ? status : gbg_allocate(engine->context, &words, 2 * piece, 4, "density");
        engine->mesh_sums->words = words;
    }
    return status;
}

/* Force of a typical source at the mean distance on a typical particle. */
static double typical_force(const struct gbg_engine *engine, double power)
{
    const struct gbg_scene *scene = &engine->scene;
    double most[2] = {0.0, 0.0}, sum[2] = {0.0, 0.0}, n = fmax((double)engine->state.owned, 1.0);
    double density = n;
    for (int a = 0; a < scene->dimension; a++) {
        density /= scene->length[a];
    }
    for (int s = 0; s < scene->n_species; s++) {
        most[0] = fmax(most[0], fabs(scene->species[s].alpha));
        most[1] = fmax(most[1], fabs(scene->species[s].mobility));
    }
    for (int s = 0; s < scene->n_species; s++) {
        double alpha = scene->species[s].alpha / fmax(most[0], 1e-300);
        double mobility = scene->species[s].mobility / fmax(most[1], 1e-300);
        sum[0] += alpha * alpha * (double)scene->species[s].count;
        sum[1] += mobility * mobility * (double)scene->species[s].count;
    }
    return most[0] * sqrt(sum[0] / n) * most[1] * sqrt(sum[1] / n) *
           pow(density, power / scene->dimension);
}

/* A refusal of the sum becomes one of the scene, its sentence begins with the key. */
static int name_refusal(struct gbg_engine *engine, int f)
{
    char sentence[GBG_MESSAGE_CAPACITY];
    snprintf(sentence, sizeof sentence, "%s", gbg_message_of(engine->context));
    return gbg_fail(engine->context, GBG_E_SCENE, "forces[%d].%s", f, sentence);
}

int gbg_engine_make_mesh_sum(struct gbg_engine *engine, int f)
{
    const struct gbg_scene *scene = &engine->scene;
    const struct gbg_force *force = &scene->force[f];
    const struct gbg_mesh_place place = place_of(engine);
    int status = engine->mesh_sums ? GBG_OK : make_mesh_sums(engine);
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_mesh_sum *sum = &engine->mesh_sums->force[f];
    gbg_mesh_sum_begin(scene->dimension, scene->length, force->power, engine->state.owned,
                       force->tolerance, sum);
    engine->mesh_sums->typical =
        fmax(engine->mesh_sums->typical, typical_force(engine, force->power));
    sum->wish.split = force->split;
    sum->wish.window = force->window;
    sum->wish.gradient = force->gradient;
    sum->wish.single = engine->use_double ? 0 : -1;
    status = gbg_mesh_sum_make(&place, sum);
    if (status == GBG_E_ARGUMENT) {
        status = name_refusal(engine, f);
    } else if (status != GBG_OK) {
        gbg_message_prefix(engine->context, "forces[%d].sum: lattice", f);
    }
    return status;
}

void gbg_engine_free_mesh_sums(struct gbg_engine *engine)
{
    const struct gbg_mesh_place place = place_of(engine);
    if (!engine->mesh_sums) {
        return;
    }
    for (int f = 0; f < GBG_MAX_FORCES; f++) {
        gbg_mesh_sum_free(&place, &engine->mesh_sums->force[f]);
    }
    gbg_release(engine->mesh_sums->count);
    gbg_release(engine->mesh_sums->words);
    gbg_release(engine->mesh_sums);
    engine->mesh_sums = NULL;
}

const struct gbg_mesh_sum *gbg_engine_mesh_sum(const struct gbg_engine *engine, int f)
{
    return engine->mesh_sums && engine->mesh_sums->force[f].body ? &engine->mesh_sums->force[f]
                                                                 : NULL;
}

static int is_first(const struct gbg_engine *engine, int f)
{
    int before = 0;
    for (int g = 0; g < f; g++) {
        before |= gbg_engine_mesh_sum(engine, g) != NULL;
    }
    return !before;
}

double gbg_engine_mesh_bytes(const struct gbg_engine *engine, int f)
{
    int64_t n = engine->state.owned, cells = 1;
    const struct gbg_mesh_sum *sum = gbg_engine_mesh_sum(engine, f);
    if (!sum || n == 0) {
        return 0.0;
    }
    double bytes = engine->kernels->ewald_bytes(sum->body);
    for (int a = 0; a < engine->scene.dimension; a++) {
        cells *= engine->mesh_sums->cells[a];
    }
    if (is_first(engine, f)) { /* what looks at the density need, once */
        bytes += 4.0 * (double)cells + 8.0 * (double)(n < PIECE ? n : PIECE);
    }
    return bytes / (double)n;
}

/* One axis of all particles in the order of ids; the integers become lengths in place. */
static int fetch_axis(struct gbg_engine *engine, int a, double *position)
{
    double unit = engine->state.box.length[a] * 0x1p-64;
    int status = gbg_engine_copy_fractions(engine, a, (uint64_t *)(void *)position);
    for (int64_t i = 0; status == GBG_OK && i < engine->state.owned; i++) {
        uint64_t fraction;
        memcpy(&fraction, &position[i], sizeof fraction);
        position[i] = (double)fraction * unit;
    }
    return status;
}

int gbg_engine_sources(struct gbg_engine *engine, struct gbg_sources *sources)
{
    const struct gbg_state *state = &engine->state;
    const uint32_t *words = engine->words;
    const int32_t *place = NULL;
    int64_t n = state->owned;
    int status =
        gbg_sources_make(engine->context, state->box.dimension, state->box.length, n, sources);
    for (int a = 0; status == GBG_OK && a < state->box.dimension; a++) {
        status = fetch_axis(engine, a, sources->position[a]);
    }
    status = status ? status : gbg_engine_places(engine, &place);
    if (status == GBG_OK && state->species) {
        status = gbg_engine_fetch(engine, state->species, (size_t)n);
    }
    for (int64_t k = 0; status == GBG_OK && k < n; k++) {
        const uint8_t *species = (const uint8_t *)engine->words;
        int s = state->species ? species[gbg_engine_place(place, k)] : 0;
        sources->alpha[k] = state->alpha[s];
        sources->mobility[k] = state->mobility[s];
    }
    if (!words) { /* a run without output has no transfer buffer */
        gbg_release(engine->words);
        engine->words = NULL;
    }
    return status;
}

struct check {
    struct gbg_engine *engine;
    const struct gbg_sources *sources;
    struct gbg_sample *sample;
    int force;
    int referred; /* 1: the sample's reference is that of this force */
};

/* Forces of this sum alone on the sample. */
static int sample_forces(const struct check *check)
{
    struct gbg_engine *engine = check->engine;
    const struct gbg_state *state = &engine->state;
    struct gbg_sample *sample = check->sample;
    const int32_t *place;
    int status = engine->kernels->ewald_force(engine->device, &engine->state,
                                              engine->mesh_sums->force[check->force].body, 0);
    engine->forces_current = 0;
    status = status ? status : gbg_engine_places(engine, &place);
    for (int a = 0; status == GBG_OK && a < state->box.dimension; a++) {
        for (int64_t s = 0; status == GBG_OK && s < sample->size; s++) {
            int64_t i = gbg_engine_place(place, sample->index[s]);
            status = engine->backend->download(engine->device, &sample->force[a][s],
                                               state->force[a] + i, sizeof(double));
        }
    }
    return status;
}

/* RMS of the forces that the state holds. Their squares are added as integers, so that the order in
 * memory does not show; unit: what they are measured in, at most 1e4 of it counts. */
static int force_size(struct gbg_engine *engine, double unit, double *rms)
{
    int64_t n = engine->state.owned, piece = n < PIECE ? n : PIECE;
    uint64_t sum = 0;
    int status = GBG_OK;
    double *value = (double *)(void *)engine->mesh_sums->words;
    for (int a = 0; a < engine->scene.dimension; a++) {
        for (int64_t first = 0; status == GBG_OK && first < n; first += piece) {
            int64_t count = n - first < piece ? n - first : piece;
            status =
                engine->backend->download(engine->device, value, engine->state.force[a] + first,
                                          (size_t)count * sizeof *value);
            for (int64_t i = 0; status == GBG_OK && i < count; i++) {
                double r = fmin(fabs(value[i] / unit), 1e4);
                sum += (uint64_t)(r * r * 0x1p20);
            }
        }
    }
    *rms = unit * sqrt((double)sum * 0x1p-20 / (double)n);
    return status;
}

static int measure(void *user, struct gbg_mesh_sum *sum)
{
    struct check *check = user;
    double typical = typical_force(check->engine, sum->wish.power), rms = 0.0;
    int status = sample_forces(check);
    status = status ? status : force_size(check->engine, typical > 0.0 ? typical : 1.0, &rms);
    if (status == GBG_OK && !check->referred) {
        status = gbg_sources_reference(check->engine->context, check->sources, sum->wish.power,
                                       check->sample, check->sample->reference);
        check->referred = status == GBG_OK;
    }
    if (status == GBG_OK) {
        gbg_mesh_sum_judge(sum, check->sample, rms, typical);
    }
    return status;
}

static void describe(struct gbg_engine *engine, int f)
{
    for (int k = 0; k < engine->n_plan; k++) {
        struct gbg_plan_step *step = &engine->plan[k];
        if (step->force == f && step->run == gbg_step_ewald) {
            step->bytes += gbg_engine_mesh_bytes(engine, f) - step->mesh_bytes;
            step->mesh_bytes = gbg_engine_mesh_bytes(engine, f);
            gbg_mesh_sum_describe(&engine->mesh_sums->force[f], sizeof step->what, step->what);
        }
    }
}

static int settle(struct check *check)
{
    struct gbg_engine *engine = check->engine;
    struct gbg_mesh_sum *sum = &engine->mesh_sums->force[check->force];
    struct gbg_mesh_place place = place_of(engine);
    char name[64];
    snprintf(name, sizeof name, "step %llu: forces[%d]", (unsigned long long)engine->step,
             check->force);
    place.name = name;
    int status = gbg_mesh_sum_settle(&place, check->sample->size, measure, check, sum);
    describe(engine, check->force);
    return status == GBG_E_ARGUMENT ? name_refusal(engine, check->force) : status;
}

static int is_checked(const struct gbg_engine *engine, int f)
{
    return gbg_engine_mesh_sum(engine, f) && engine->scene.force[f].check;
}

static int wants_checks(const struct gbg_engine *engine)
{
    int wants = 0;
    for (int f = 0; engine->mesh_sums && f < engine->scene.n_forces; f++) {
        wants |= is_checked(engine, f);
    }
    return wants && engine->state.owned > 0;
}

static int judge(struct gbg_engine *engine, int64_t samples)
{
    struct gbg_sources sources = {0};
    struct gbg_sample sample = {0};
    int status = gbg_engine_sources(engine, &sources);
    status = status ? status
                    : gbg_sample_make(engine->context, engine->scene.dimension, engine->state.owned,
                                      samples, &sample);
    for (int f = 0; status == GBG_OK && f < engine->scene.n_forces; f++) {
        if (is_checked(engine, f)) {
            status = settle(&(struct check){engine, &sources, &sample, f, 0});
        }
    }
    gbg_sample_release(&sample);
    gbg_sources_release(&sources);
    return status;
}

/* Puts `count` particles into the cells of the look. */
static int count_piece(struct gbg_engine *engine, int64_t first, int64_t count)
{
    struct gbg_mesh_sums *sums = engine->mesh_sums;
    uint32_t *cell = sums->words, *word = cell + count;
    int status = GBG_OK;
    memset(cell, 0, (size_t)count * sizeof *cell);
    for (int a = engine->scene.dimension - 1; a >= 0 && status == GBG_OK; a--) {
        uint32_t cells = (uint32_t)sums->cells[a];
        status = engine->backend->download(engine->device, word, engine->state.high[a] + first,
                                           (size_t)count * sizeof *word);
        for (int64_t i = 0; status == GBG_OK && i < count; i++) {
            cell[i] = cell[i] * cells + (uint32_t)((uint64_t)word[i] * cells >> 32);
        }
    }
    for (int64_t i = 0; status == GBG_OK && i < count; i++) {
        sums->count[cell[i]]++;
    }
    return status;
}

/* The fullest of the cells over the mean. */
static int look(struct gbg_engine *engine, double *contrast)
{
    struct gbg_mesh_sums *sums = engine->mesh_sums;
    int64_t n = engine->state.owned, cells = 1, piece = n < PIECE ? n : PIECE;
    int status = GBG_OK;
    for (int a = 0; a < engine->scene.dimension; a++) {
        cells *= sums->cells[a];
    }
    memset(sums->count, 0, (size_t)cells * sizeof *sums->count);
    for (int64_t first = 0; status == GBG_OK && first < n; first += piece) {
        status = count_piece(engine, first, n - first < piece ? n - first : piece);
    }
    int32_t most = 0;
    for (int64_t c = 0; c < cells; c++) {
        most = sums->count[c] > most ? sums->count[c] : most;
    }
    *contrast = (double)most * (double)cells / (double)n;
    return status;
}

int gbg_engine_check_sums(struct gbg_engine *engine)
{
    if (!engine->mesh_sums || engine->mesh_sums->checked || !wants_checks(engine)) {
        return GBG_OK;
    }
    int status = judge(engine, GBG_MESH_SAMPLES);
    status = status ? status : look(engine, &engine->mesh_sums->contrast);
    engine->mesh_sums->size = -1.0;
    engine->mesh_sums->checked = status == GBG_OK;
    return status;
}

/* 1 where a check is due whatever has changed, as the order of a start decays and shifts what the
 * mesh leaves: ever more seldom, at steps 16, 64, 256, ... */
static int is_due(const struct gbg_engine *engine)
{
    uint64_t due = 16;
    while (due < engine->step) {
        due *= 4;
    }
    return due == engine->step;
}

/* 1 if a sum, whose error in the size of a force stays, misses its tolerance for the size that
 * forces have now. */
static int would_miss(const struct gbg_engine *engine, double size)
{
    int missing = 0;
    for (int f = 0; f < engine->scene.n_forces; f++) {
        const struct gbg_mesh_sum *sum = &engine->mesh_sums->force[f];
        missing |= is_checked(engine, f) && !sum->symmetric &&
                   sum->measured * engine->mesh_sums->size > sum->tolerance * size;
    }
    return missing;
}

static void tell(struct gbg_engine *engine, const char *why, double before, double now)
{
    for (int f = 0; f < engine->scene.n_forces; f++) {
        if (is_checked(engine, f)) {
            gbg_log(engine->context, GBG_LOG_INFO,
                    "step %llu: %s has gone from %.3g to %.3g; error of forces[%d] %.2g, tolerance "
                    "%.3g",
                    (unsigned long long)engine->step, why, before, now, f,
                    engine->mesh_sums->force[f].measured, engine->mesh_sums->force[f].tolerance);
        }
    }
}

int gbg_engine_watch_sums(struct gbg_engine *engine, int *measured)
{
    struct gbg_mesh_sums *sums = engine->mesh_sums;
    *measured = 0;
    if (!sums || !sums->checked ||
        (engine->step % LOOK_EVERY != 0 && !is_due(engine) && sums->size >= 0.0)) {
        return GBG_OK;
    }
    double contrast = 0.0, size = 0.0;
    double unit = sums->size > 0.0 ? sums->size : sums->typical > 0.0 ? sums->typical : 1.0;
    int status = look(engine, &contrast);
    status = status ? status : force_size(engine, unit, &size);
    if (status != GBG_OK || sums->size < 0.0) {
        sums->size = size;
        return status;
    }
    int gathered = contrast > changed * sums->contrast || sums->contrast > changed * contrast;
    int weaker = would_miss(engine, size);
    if (!(gathered || weaker || is_due(engine))) {
        return GBG_OK;
    }
    status = judge(engine, FEWER_SAMPLES);
    *measured = 1;
    if (status == GBG_OK) {
        if (gathered) {
            tell(engine, "the densest place in means", sums->contrast, contrast);
        } else if (weaker) {
            tell(engine, "the RMS force", sums->size, size);
        }
        sums->contrast = contrast;
        sums->size = size;
    }
    return status;
}

int gbg_engine_copy_sums(const struct gbg_engine *engine, struct gbg_sum_state *states)
{
    int count = 0;
    for (int f = 0; engine->mesh_sums && f < engine->scene.n_forces; f++) {
        const struct gbg_mesh_sum *sum = &engine->mesh_sums->force[f];
        if (engine->mesh_sums->checked && is_checked(engine, f)) {
            states[count++] = (struct gbg_sum_state){.contrast = engine->mesh_sums->contrast,
                                                     .size = engine->mesh_sums->size,
                                                     .measured = sum->measured,
                                                     .force = f,
                                                     .refined = sum->refined,
                                                     .symmetric = sum->symmetric};
        }
    }
    return count;
}

/* Whether those that a file holds are sums of this scene. */
static int belong(const struct gbg_engine *engine, int count, const struct gbg_sum_state *states)
{
    int good = 1;
    for (int k = 0; k < count; k++) {
        int f = states[k].force;
        good &= f >= 0 && f < engine->scene.n_forces && is_checked(engine, f) &&
                states[k].refined >= 0 && states[k].refined <= GBG_MESH_REFINEMENTS;
    }
    return good;
}

int gbg_engine_restore_sums(struct gbg_engine *engine, int count,
                            const struct gbg_sum_state *states)
{
    const struct gbg_mesh_place place = place_of(engine);
    int status = GBG_OK;
    if (!belong(engine, count, states)) {
        return gbg_fail(engine->context, GBG_E_FORMAT,
                        "it holds a sum over all images that the scene has not");
    }
    for (int f = 0; f < engine->scene.n_forces && status == GBG_OK; f++) {
        struct gbg_sum_state state = {.measured = -1.0, .force = f};
        for (int k = 0; k < count; k++) {
            state = states[k].force == f ? states[k] : state;
        }
        struct gbg_mesh_sum *sum = is_checked(engine, f) ? &engine->mesh_sums->force[f] : NULL;
        if (sum && sum->refined != state.refined) {
            status = gbg_mesh_sum_refine(&place, state.refined, sum);
            describe(engine, f);
        }
        if (sum && status == GBG_OK) {
            sum->measured = state.measured;
            sum->symmetric = state.symmetric;
        }
    }
    if (engine->mesh_sums) {
        engine->mesh_sums->checked = count > 0 && status == GBG_OK;
        engine->mesh_sums->contrast = count > 0 ? states[0].contrast : 0.0;
        engine->mesh_sums->size = count > 0 ? states[0].size : 0.0;
    }
    engine->forces_current = 0;
    return status;
}
