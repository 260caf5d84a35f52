/* L3: the digest of a scene: what a restart file must have been made with. */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "core/sha256.h"
#include "scene/scene.h"

/* Numbers enter as text with a sign that ends them, the reals bit by bit, so that the digest
 * depends neither on the machine nor on padding. */
static void add_integer(struct gbg_sha256 *hash, int64_t value)
{
    char text[32];
    int length = snprintf(text, sizeof text, "%" PRId64 ";", value);
    gbg_sha256_add(hash, text, (size_t)length);
}

static void add_real(struct gbg_sha256 *hash, double value)
{
    int64_t bits;
    value += 0.0; /* minus zero is zero */
    memcpy(&bits, &value, sizeof bits);
    add_integer(hash, bits);
}

static void add_species(struct gbg_sha256 *hash, const struct gbg_species *species)
{
    add_real(hash, species->diameter);
    add_real(hash, species->alpha);
    add_real(hash, species->mobility);
    add_integer(hash, species->count);
}

static void add_force(struct gbg_sha256 *hash, const struct gbg_force *force)
{
    add_integer(hash, force->law);
    add_real(hash, force->power);
    add_integer(hash, force->sum);
    add_real(hash, force->cutoff);
    add_real(hash, force->tolerance);
    if (force->sum == GBG_SUM_LATTICE) {
        add_integer(hash, force->split);
        add_integer(hash, force->window);
        add_integer(hash, force->gradient);
        add_integer(hash, force->check);
    }
}

static void add_dynamics(struct gbg_sha256 *hash, const struct gbg_scene *scene)
{
    const int64_t words[] = {scene->rule, scene->dynamics, scene->limit_by, scene->rescale,
                             scene->precision, scene->seed, scene->run,
                             /* where rounds run out, what is put back depends on their number */
                             scene->max_rounds};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++) {
        add_integer(hash, words[i]);
    }
    add_real(hash, scene->dt);
    add_real(hash, scene->temperature);
    add_real(hash, scene->noise_limit);
}

void gbg_scene_digest(const struct gbg_scene *scene, char text[65])
{
    struct gbg_sha256 hash;
    unsigned char digest[32];
    gbg_sha256_start(&hash);
    add_integer(&hash, scene->dimension);
    for (int a = 0; a < scene->dimension; a++) {
        add_real(&hash, scene->length[a]);
        add_real(&hash, scene->origin[a]);
    }
    add_integer(&hash, scene->n_species);
    for (int s = 0; s < scene->n_species; s++) {
        add_species(&hash, &scene->species[s]);
    }
    add_integer(&hash, scene->n_forces);
    for (int f = 0; f < scene->n_forces; f++) {
        add_force(&hash, &scene->force[f]);
    }
    add_dynamics(&hash, scene);
    gbg_sha256_finish(&hash, digest);
    gbg_sha256_text(digest, text);
}
