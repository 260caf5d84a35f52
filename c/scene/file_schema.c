/* L3: libcyaml's schema of the scene file: which keys there are, and what is a list or a block. */
#include "scene/file_schema.h"

#include <stddef.h>

#define VALUE(body, key)                                                                           \
    CYAML_FIELD_STRING_PTR(#key, CYAML_FLAG_POINTER | CYAML_FLAG_OPTIONAL, struct body, key, 0,    \
                           CYAML_UNLIMITED)
#define BLOCK(body, key, fields)                                                                   \
    CYAML_FIELD_MAPPING(#key, CYAML_FLAG_OPTIONAL, struct body, key, fields)
#define LIST(body, key, entry)                                                                     \
    CYAML_FIELD_SEQUENCE(#key, CYAML_FLAG_POINTER | CYAML_FLAG_OPTIONAL, struct body, key, &entry, \
                         0, CYAML_UNLIMITED)

static const cyaml_schema_value_t text = {
    CYAML_VALUE_STRING(CYAML_FLAG_POINTER, char *, 0, CYAML_UNLIMITED),
};

static const cyaml_schema_field_t box_fields[] = {
    VALUE(gbg_file_box, packing),       VALUE(gbg_file_box, shape),
    LIST(gbg_file_box, size, text),     LIST(gbg_file_box, origin, text),
    LIST(gbg_file_box, boundary, text), CYAML_FIELD_END,
};

const cyaml_schema_field_t gbg_file_species_fields[] = {
    VALUE(gbg_file_species, name),
    VALUE(gbg_file_species, fraction),
    VALUE(gbg_file_species, count),
    VALUE(gbg_file_species, diameter),
    VALUE(gbg_file_species, alpha),
    VALUE(gbg_file_species, mobility),
    CYAML_FIELD_END,
};

static const cyaml_schema_value_t species = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct gbg_file_species, gbg_file_species_fields),
};

static const cyaml_schema_field_t start_fields[] = {
    VALUE(gbg_file_start, lattice),
    VALUE(gbg_file_start, vacancies),
    VALUE(gbg_file_start, jitter),
    VALUE(gbg_file_start, random),
    VALUE(gbg_file_start, file),
    VALUE(gbg_file_start, frame),
    CYAML_FIELD_END,
};

static const cyaml_schema_field_t particles_fields[] = {
    VALUE(gbg_file_particles, count),
    LIST(gbg_file_particles, species, species),
    BLOCK(gbg_file_particles, start, start_fields),
    CYAML_FIELD_END,
};

const cyaml_schema_field_t gbg_file_force_fields[] = {
    VALUE(gbg_file_force, law),       VALUE(gbg_file_force, power),
    VALUE(gbg_file_force, sum),       VALUE(gbg_file_force, cutoff),
    VALUE(gbg_file_force, tolerance), VALUE(gbg_file_force, split),
    VALUE(gbg_file_force, window),    VALUE(gbg_file_force, gradient),
    VALUE(gbg_file_force, check),     CYAML_FIELD_END,
};

static const cyaml_schema_value_t force = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct gbg_file_force, gbg_file_force_fields),
};

static const cyaml_schema_field_t exclusion_fields[] = {
    VALUE(gbg_file_exclusion, rule),
    VALUE(gbg_file_exclusion, neighbours),
    VALUE(gbg_file_exclusion, start),
    VALUE(gbg_file_exclusion, max_rounds),
    VALUE(gbg_file_exclusion, reverted),
    VALUE(gbg_file_exclusion, skin),
    CYAML_FIELD_END,
};

static const cyaml_schema_field_t noise_fields[] = {
    VALUE(gbg_file_noise, limit),
    VALUE(gbg_file_noise, limit_by),
    VALUE(gbg_file_noise, rescale),
    CYAML_FIELD_END,
};

/* kind comes last: it has the last word over what the other keys mean by being there */
static const cyaml_schema_field_t dynamics_fields[] = {
    VALUE(gbg_file_dynamics, dt),
    VALUE(gbg_file_dynamics, temperature),
    BLOCK(gbg_file_dynamics, noise, noise_fields),
    VALUE(gbg_file_dynamics, kind),
    CYAML_FIELD_END,
};

static const cyaml_schema_field_t precision_fields[] = {
    VALUE(gbg_file_precision, mode),
    CYAML_FIELD_END,
};

static const cyaml_schema_field_t run_fields[] = {
    VALUE(gbg_file_run, steps),
    VALUE(gbg_file_run, seed),
    VALUE(gbg_file_run, run),
    CYAML_FIELD_END,
};

static const cyaml_schema_field_t trajectory_fields[] = {
    VALUE(gbg_file_trajectory, file),      VALUE(gbg_file_trajectory, every),
    VALUE(gbg_file_trajectory, precision), VALUE(gbg_file_trajectory, overlap),
    VALUE(gbg_file_trajectory, unwrapped), CYAML_FIELD_END,
};

static const cyaml_schema_field_t restart_fields[] = {
    VALUE(gbg_file_restart, file),
    VALUE(gbg_file_restart, every),
    CYAML_FIELD_END,
};

static const cyaml_schema_field_t output_fields[] = {
    BLOCK(gbg_file_output, trajectory, trajectory_fields),
    BLOCK(gbg_file_output, restart, restart_fields),
    CYAML_FIELD_END,
};

static const cyaml_schema_field_t scene_fields[] = {
    VALUE(gbg_file_scene, dimension),
    BLOCK(gbg_file_scene, box, box_fields),
    BLOCK(gbg_file_scene, particles, particles_fields),
    LIST(gbg_file_scene, forces, force),
    BLOCK(gbg_file_scene, excluded_volume, exclusion_fields),
    BLOCK(gbg_file_scene, dynamics, dynamics_fields),
    BLOCK(gbg_file_scene, precision, precision_fields),
    BLOCK(gbg_file_scene, run, run_fields),
    BLOCK(gbg_file_scene, output, output_fields),
    CYAML_FIELD_END,
};

const cyaml_schema_value_t gbg_file_schema = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_POINTER, struct gbg_file_scene, scene_fields),
};
