/* L3: checks the scene as a whole, and fills in what follows from other keys. */
#include <inttypes.h>
#include <math.h>

#include "scene/lattice.h"
#include "scene/parts.h"

/* Of a sum of fractions, and of the densest packing. */
static const double slack = 1e-9;

/* Of sums over all images: the relative RMS error where none is asked for, and the largest. */
static const double usual_tolerance = 1e-4, loosest = 0.1;

double gbg_densest(int dimension)
{
    return dimension == 2 ? 0.90689968211710892530 : 0.74048048969306104117;
}

double gbg_largest_diameter(const struct gbg_scene *scene)
{
    double largest = 0;
    for (int s = 0; s < scene->n_species; s++) {
        largest = fmax(largest, scene->species[s].diameter);
    }
    return largest;
}

double gbg_core_volume(const struct gbg_scene *scene)
{
    static const double pi = 3.14159265358979323846;
    double sum = 0;
    for (int s = 0; s < scene->n_species; s++) {
        double d = scene->species[s].diameter;
        double core = scene->dimension == 2 ? pi / 4 * d * d : pi / 6 * d * d * d;
        sum += core * (double)scene->species[s].count;
    }
    return sum;
}

double gbg_scene_packing(const struct gbg_scene *scene)
{
    double volume = 1;
    for (int a = 0; a < scene->dimension; a++) {
        volume *= scene->length[a];
    }
    return volume > 0 ? gbg_core_volume(scene) / volume : 0;
}

/* Largest remainder: whole parts first, what is left goes one each to the largest fractional parts,
 * the first species first among equals. */
static void share_out(struct gbg_scene *scene, int64_t total)
{
    double rest[GBG_MAX_SPECIES], sum = 0;
    int64_t left = total;
    for (int s = 0; s < scene->n_species; s++) {
        sum += scene->species[s].fraction;
    }
    for (int s = 0; s < scene->n_species; s++) {
        double part = scene->species[s].fraction / sum * (double)total;
        scene->species[s].count = (int64_t)floor(part + slack);
        rest[s] = part - (double)scene->species[s].count;
        left -= scene->species[s].count;
    }
    while (left > 0) {
        int best = 0;
        for (int s = 1; s < scene->n_species; s++) {
            best = rest[s] > rest[best] ? s : best;
        }
        scene->species[best].count++;
        rest[best] -= 1;
        left--;
    }
}

static int check_fractions(const struct gbg_scene *scene)
{
    double sum = 0;
    for (int s = 0; s < scene->n_species; s++) {
        if (scene->species[s].fraction < 0) {
            return gbg_fail(scene->context, GBG_E_SCENE,
                            "particles.species[%d]: \"%s\" has no fraction but others have one; "
                            "give every species a fraction, or every species a count",
                            s, scene->species[s].name);
        }
        sum += scene->species[s].fraction;
    }
    if (fabs(sum - 1) > slack) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "particles.species: the fractions sum to %.12g, allowed 1 within 1e-9",
                        sum);
    }
    return GBG_OK;
}

static int count_from_fractions(struct gbg_scene *scene)
{
    int status = check_fractions(scene);
    if (status != GBG_OK) {
        return status;
    }
    if (scene->count < 0) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "particles.count is missing: species with fractions need it");
    }
    share_out(scene, scene->count);
    scene->n = scene->count;
    return GBG_OK;
}

static int sum_of_counts(struct gbg_scene *scene)
{
    scene->n = 0;
    for (int s = 0; s < scene->n_species; s++) {
        struct gbg_species *species = &scene->species[s];
        if (species->asked < 0) {
            return gbg_fail(scene->context, GBG_E_SCENE,
                            "particles.species[%d]: \"%s\" has neither a fraction nor a count", s,
                            species->name);
        }
        species->count = species->asked;
        scene->n += species->count;
    }
    if (scene->n > GBG_MOST_PARTICLES) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "particles.species: the counts sum to %" PRId64
                        ", allowed at most %" PRId64,
                        scene->n, GBG_MOST_PARTICLES);
    }
    return GBG_OK;
}

/* Counts of the arrays; those that the species ask for must be the same. */
static int count_arrays(struct gbg_scene *scene)
{
    int64_t found[GBG_MAX_SPECIES] = {0};
    const struct gbg_particles *arrays = &scene->arrays;
    for (int64_t i = 0; i < arrays->n; i++) {
        if (arrays->species[i] >= scene->n_species) {
            return gbg_fail(scene->context, GBG_E_SCENE,
                            "particle %" PRId64 " is of species %d (from 0), but there are %d",
                            arrays->id[i], (int)arrays->species[i], scene->n_species);
        }
        found[arrays->species[i]]++;
    }
    int shares = scene->species[0].fraction >= 0;
    if (shares) {
        int status = check_fractions(scene);
        if (status != GBG_OK) {
            return status;
        }
        share_out(scene, arrays->n);
    }
    for (int s = 0; s < scene->n_species; s++) {
        struct gbg_species *species = &scene->species[s];
        int64_t expected = shares ? species->count : species->asked;
        if (expected >= 0 && expected != found[s]) {
            return gbg_fail(scene->context, GBG_E_SCENE,
                            "particles.species[%d]: \"%s\" asks for %" PRId64
                            " particles, but %" PRId64 " were given",
                            s, species->name, expected, found[s]);
        }
        species->count = found[s];
    }
    scene->n = arrays->n;
    return GBG_OK;
}

static int resolve_counts(struct gbg_scene *scene)
{
    if (scene->n_species == 0) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "particles.species is missing: give 1 to %d species", GBG_MAX_SPECIES);
    }
    int shares = 0;
    for (int s = 0; s < scene->n_species; s++) {
        shares |= scene->species[s].fraction >= 0;
    }
    if (scene->start == GBG_START_FILE) {
        scene->n = -1;
        return shares ? check_fractions(scene) : GBG_OK;
    }
    int status = scene->start == GBG_START_ARRAYS ? count_arrays(scene)
                 : shares                         ? count_from_fractions(scene)
                                                  : sum_of_counts(scene);
    if (status == GBG_OK && scene->count >= 0 && scene->count != scene->n) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "particles.count: %" PRId64 " given, but the particles sum to %" PRId64,
                        scene->count, scene->n);
    }
    return status;
}

static int resolve_box(struct gbg_scene *scene)
{
    if (scene->n < 0) {
        return GBG_OK;
    }
    if (scene->packing == 0 && scene->length[0] == 0) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "box is missing: give box.size or box.packing");
    }
    if (scene->packing == 0) {
        return GBG_OK;
    }
    double cores = gbg_core_volume(scene);
    if (!(cores > 0)) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "box.packing: %.10g needs particles with diameters above 0; give box.size",
                        scene->packing);
    }
    double volume = cores / scene->packing, side = pow(volume, 1.0 / scene->dimension);
    for (int a = 0; a < scene->dimension; a++) {
        scene->length[a] = side;
    }
    if (scene->shape == GBG_SHAPE_LATTICE) {
        gbg_lattice_box(scene->dimension, gbg_lattice_of(scene), scene->n, volume, scene->length);
    }
    if (!(side >= 1e-100 && side <= 1e100)) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "box.packing: %.10g gives a box of length %g, allowed [1e-100, 1e100]",
                        scene->packing, side);
    }
    return GBG_OK;
}

static double shortest_length(const struct gbg_scene *scene)
{
    double shortest = scene->length[0];
    for (int a = 1; a < scene->dimension; a++) {
        shortest = fmin(shortest, scene->length[a]);
    }
    return shortest;
}

static int one_size(const struct gbg_scene *scene)
{
    for (int s = 0; s < scene->n_species; s++) {
        if (scene->species[s].count > 0 &&
            scene->species[s].diameter != gbg_largest_diameter(scene)) {
            return 0;
        }
    }
    return 1;
}

/* Not so while a start file, which may give the box, was not read. */
static int box_is_known(const struct gbg_scene *scene)
{
    return scene->n >= 0;
}

/* Cores of several sizes can fill more than those of one, but never the whole box. */
static int check_cores(const struct gbg_scene *scene)
{
    double packing = gbg_scene_packing(scene), widest = gbg_largest_diameter(scene);
    double most = one_size(scene) ? gbg_densest(scene->dimension) : 1;
    if (packing > most * (1 + slack)) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "%s: the hard cores fill %.6g of the box, allowed at most %.6g%s",
                        scene->packing > 0 ? "box.packing" : "box.size", packing, most,
                        most == 1               ? ""
                        : scene->dimension == 2 ? " = pi/(2 sqrt 3), close-packed discs"
                                                : " = pi/(3 sqrt 2), close-packed spheres");
    }
    if (shortest_length(scene) < 2 * widest) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "box.size: the shortest length %.10g given, allowed at least 2 of the "
                        "largest diameter, %.10g",
                        shortest_length(scene), 2 * widest);
    }
    return GBG_OK;
}

static int resolve_exclusion(struct gbg_scene *scene)
{
    if (scene->neighbours == GBG_NEIGHBOURS_DELAUNAY) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "excluded_volume.neighbours: delaunay is not in this version; take grid");
    }
    if (scene->rule == GBG_RULE_AUTO) {
        /* elastic events are exact for free moves, and wrong where forces hold pairs together */
        scene->rule = scene->n_forces > 0 ? GBG_RULE_BRIDGE : GBG_RULE_EVENT;
    }
    if (scene->rule == GBG_RULE_NONE && scene->overlap) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "output.trajectory.overlap: true needs an excluded_volume.rule");
    }
    return scene->rule == GBG_RULE_NONE || !box_is_known(scene) ? GBG_OK : check_cores(scene);
}

static int resolve_forces(struct gbg_scene *scene)
{
    for (int f = 0; f < scene->n_forces; f++) {
        struct gbg_force *force = &scene->force[f];
        if (force->sum == GBG_SUM_LATTICE && force->tolerance == 0) {
            force->tolerance = usual_tolerance;
        }
    }
    return GBG_OK;
}

static int check_lattice(const struct gbg_scene *scene, int f)
{
    const struct gbg_force *force = &scene->force[f];
    double most = scene->dimension == 2 ? 6 : 2, least = scene->dimension == 2 ? 1 : 2;
    if (!(force->power >= least && force->power <= most)) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "forces[%d].power: %.10g given, allowed %s with sum lattice in %d "
                        "dimensions; take sum cutoff or minimum_image",
                        f, force->power, scene->dimension == 2 ? "1 to 6" : "2", scene->dimension);
    }
    if (force->tolerance > loosest) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "forces[%d].tolerance: %.10g given, allowed (0, 0.1] with sum lattice", f,
                        force->tolerance);
    }
    if (scene->precision == GBG_PRECISION_STRICT) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "precision.mode: strict given, but forces[%d] has sum lattice, whose bits "
                        "are those of one processor only; take auto, mixed or double",
                        f);
    }
    return GBG_OK;
}

static int check_forces(const struct gbg_scene *scene)
{
    double half = shortest_length(scene) / 2;
    for (int f = 0; f < scene->n_forces; f++) {
        int status = scene->force[f].sum == GBG_SUM_LATTICE ? check_lattice(scene, f) : GBG_OK;
        if (status != GBG_OK) {
            return status;
        }
        if (box_is_known(scene) && scene->force[f].cutoff > half) {
            return gbg_fail(scene->context, GBG_E_SCENE,
                            "forces[%d].cutoff: %.10g given, allowed at most half the shortest box "
                            "length, %.10g",
                            f, scene->force[f].cutoff, half);
        }
    }
    return GBG_OK;
}

static int check_dynamics(const struct gbg_scene *scene)
{
    if (scene->dynamics == GBG_DYNAMICS_NONE) {
        return GBG_OK;
    }
    if (!(scene->dt > 0)) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "dynamics.dt is missing: give a time step above 0");
    }
    if (scene->limit_by != GBG_LIMIT_NONE && scene->noise_limit == 0) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "dynamics.noise.limit is missing: limit_by needs it, allowed [1, 40]");
    }
    if (scene->limit_by == GBG_LIMIT_NONE && scene->noise_limit > 0) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "dynamics.noise.limit: %.10g given, but limit_by is none; say clamp or "
                        "redraw",
                        scene->noise_limit);
    }
    return GBG_OK;
}

static int check_start(const struct gbg_scene *scene)
{
    if (scene->start == GBG_START_NONE && scene->n > 0) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "particles.start is missing: give lattice, random or file, or add "
                        "particles");
    }
    int flat = gbg_lattice_of(scene) <= GBG_LATTICE_SQUARE;
    if (scene->start == GBG_START_LATTICE && flat != (scene->dimension == 2)) {
        return gbg_fail(scene->context, GBG_E_SCENE,
                        "particles.start.lattice: %s in %d dimensions, allowed %s",
                        gbg_lattice_name(gbg_lattice_of(scene)), scene->dimension,
                        scene->dimension == 2 ? "triangular, square" : "fcc, cubic");
    }
    return GBG_OK;
}

int gbg_scene_resolve_known(struct gbg_scene *scene)
{
    static int (*const steps[])(struct gbg_scene *) = {resolve_counts, resolve_box,
                                                       resolve_exclusion, resolve_forces};
    static int (*const checks[])(const struct gbg_scene *) = {check_forces, check_dynamics,
                                                              check_start};
    struct gbg_scene resolved = *scene;
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
        int status = steps[i](&resolved);
        if (status != GBG_OK) {
            return status;
        }
    }
    for (size_t i = 0; i < sizeof checks / sizeof *checks; i++) {
        int status = checks[i](&resolved);
        if (status != GBG_OK) {
            return status;
        }
    }
    *scene = resolved;
    return GBG_OK;
}

int gbg_scene_resolve(struct gbg_scene *scene)
{
    if (scene->start == GBG_START_FILE) {
        return gbg_fail(scene->context, GBG_E_ORDER,
                        "particles.start.file: \"%s\" has to be read first", scene->start_file);
    }
    int status = gbg_scene_resolve_known(scene);
    if (status != GBG_OK && scene->source[0]) {
        gbg_message_prefix(scene->context, "%.700s", scene->source);
    }
    return status;
}
