/* L3: positions, species and ids of a start: which way, and the lattice with vacancies. */
#include <inttypes.h>
#include <math.h>

#include "core/context.h"
#include "core/memory.h"
#include "scene/draws.h"
#include "scene/lattice.h"
#include "scene/parts.h"

/* Relative slack kept from contact, so that rounding never makes an overlap. */
static const double clearance = 1e-12;
enum { MOST_TRIES = 64 };

/* Elements of a loop from which on it is shared out among threads; sites that are chosen before
 * their particles are placed. */
enum { WORTH_THREADS = 1 << 16, BLOCK = 1 << 20 };

/* Species in blocks, then shuffled (Fisher and Yates). */
static void shuffle_species(const struct gbg_scene *scene, struct gbg_particles *particles)
{
    int64_t i = 0, n = particles->n;
    for (int s = 0; s < scene->n_species; s++) {
        if (scene->species[s].count == n) { /* there is nothing to shuffle */
#pragma omp parallel for num_threads(scene->context->threads) if (n > WORTH_THREADS)
            for (int64_t k = 0; k < n; k++) {
                particles->species[k] = s;
            }
            return;
        }
    }
    for (int s = 0; s < scene->n_species; s++) {
        for (int64_t k = 0; k < scene->species[s].count; k++) {
            particles->species[i++] = s;
        }
    }
    for (int64_t last = n - 1; last > 0; last--) {
        int64_t other = gbg_draw_below(scene, GBG_DRAW_SPECIES, last, last + 1);
        int32_t kept = particles->species[last];
        particles->species[last] = particles->species[other];
        particles->species[other] = kept;
    }
}

/* A point of the ball of radius 1, by rejection from the cube around it. */
static void draw_in_ball(const struct gbg_scene *scene, int64_t item, double *point)
{
    for (int attempt = 0; attempt < MOST_TRIES; attempt++) {
        double square = 0;
        gbg_draw(scene, GBG_DRAW_JITTER, item, attempt, scene->dimension, point);
        for (int a = 0; a < scene->dimension; a++) {
            point[a] = 2 * point[a] - 1;
            square += point[a] * point[a];
        }
        if (square <= 1) {
            return;
        }
    }
    for (int a = 0; a < scene->dimension; a++) {
        point[a] = 0;
    }
}

/* Particle i at a site. */
static void put(const struct gbg_scene *scene, const struct gbg_sites *sites, double reach,
                int64_t s, int64_t i, struct gbg_particles *particles)
{
    double site[3], shift[3] = {0};
    gbg_lattice_site(sites, s, site);
    if (reach > 0) {
        draw_in_ball(scene, i, shift);
    }
    for (int a = 0; a < scene->dimension; a++) {
        double r = scene->origin[a] + site[a] + reach * shift[a];
        particles->position[a][i] = gbg_wrap(r, scene->origin[a], scene->length[a]);
    }
    particles->id[i] = i;
}

/* `count` particles from `first` on, at the sites that were chosen for them; chosen NULL: each at
 * the site of its number. */
static void put_all(const struct gbg_scene *scene, const struct gbg_sites *sites, double reach,
                    const int64_t *chosen, int64_t first, int64_t count,
                    struct gbg_particles *particles)
{
#pragma omp parallel for num_threads(scene->context->threads) if (count > WORTH_THREADS)
    for (int64_t k = 0; k < count; k++) {
        put(scene, sites, reach, chosen ? chosen[k] : first + k, first + k, particles);
    }
}

/* Goes through the sites and keeps each with the probability that fills all particles: every choice
 * of n sites is equally likely, and ids follow the sites. */
static int occupy(const struct gbg_scene *scene, const struct gbg_sites *sites, double reach,
                  struct gbg_particles *particles)
{
    int64_t n = particles->n, i = 0, held = 0, *chosen;
    if (sites->n == n) {
        put_all(scene, sites, reach, NULL, 0, n, particles);
        return GBG_OK;
    }
    int status = gbg_allocate(scene->context, (void **)&chosen, n < BLOCK ? n : BLOCK,
                              sizeof *chosen, "sites of the start");
    for (int64_t s = 0; status == GBG_OK && s < sites->n && i < n; s++) {
        if (gbg_draw_below(scene, GBG_DRAW_SITE, s, sites->n - s) >= n - i) {
            continue;
        }
        chosen[held++] = s;
        i++;
        if (held == BLOCK || i == n) {
            put_all(scene, sites, reach, chosen, i - held, held, particles);
            held = 0;
        }
    }
    gbg_release(chosen);
    return status;
}

static int refuse_lattice(const struct gbg_scene *scene, const struct gbg_sites *sites, double core)
{
    double fits = gbg_scene_packing(scene) * pow(sites->distance / core, scene->dimension);
    return gbg_fail(scene->context, GBG_E_SCENE,
                    "particles.start.lattice: %s sites for %" PRId64
                    " particles are %.8g apart in this box, allowed at least the largest diameter, "
                    "%.8g; the packing is %.6g, and up to %.6g would fit",
                    gbg_lattice_name(sites->kind), scene->n, sites->distance, core,
                    gbg_scene_packing(scene), fits * (1 - 1e-6));
}

int gbg_start_lattice(struct gbg_scene *scene, struct gbg_particles *particles)
{
    struct gbg_sites sites;
    int64_t wanted = (int64_t)ceil((double)scene->n / (1 - scene->vacancies) - 1e-9);
    gbg_lattice_fit(scene->dimension, scene->lattice, scene->length, wanted, &sites);
    double core = scene->rule == GBG_RULE_NONE ? 0 : gbg_largest_diameter(scene);
    double widest = 0;
    for (int a = 0; a < scene->dimension; a++) {
        widest = fmax(widest, scene->length[a] + fabs(scene->origin[a]));
    }
    double gap = sites.distance - core - clearance * (core + widest);
    if (gap < 0 && core > 0) {
        return refuse_lattice(scene, &sites, core);
    }
    int status = gbg_particles_allocate(scene->context, scene->n, scene->dimension, particles);
    if (status == GBG_OK) {
        status = occupy(scene, &sites, scene->jitter * gap / 2, particles);
        if (status != GBG_OK) {
            gbg_particles_release(particles);
            return status;
        }
        shuffle_species(scene, particles);
    }
    return status;
}

/* Points that know nothing of each other. */
static int start_uniform(struct gbg_scene *scene, struct gbg_particles *particles)
{
    int status = gbg_particles_allocate(scene->context, scene->n, scene->dimension, particles);
    if (status != GBG_OK) {
        return status;
    }
#pragma omp parallel for num_threads(scene->context->threads) if (scene->n > WORTH_THREADS)
    for (int64_t i = 0; i < scene->n; i++) {
        double point[3];
        gbg_draw(scene, GBG_DRAW_UNIFORM, i, 0, scene->dimension, point);
        for (int a = 0; a < scene->dimension; a++) {
            particles->position[a][i] = scene->origin[a] + scene->length[a] * point[a];
        }
        particles->id[i] = i;
    }
    shuffle_species(scene, particles);
    return GBG_OK;
}

int gbg_scene_start(struct gbg_scene *scene, struct gbg_particles *particles)
{
    *particles = (struct gbg_particles){.dimension = scene->dimension};
    if (scene->start == GBG_START_ARRAYS) {
        return gbg_start_arrays(scene, particles);
    }
    if (scene->n == 0) {
        return gbg_particles_allocate(scene->context, 0, scene->dimension, particles);
    }
    return scene->start == GBG_START_LATTICE   ? gbg_start_lattice(scene, particles)
           : scene->start == GBG_START_UNIFORM ? start_uniform(scene, particles)
                                               : gbg_start_insertion(scene, particles);
}
