/* L3: the scene file as libcyaml leaves it: every value still a text, for the table of keys. */
#ifndef GBG_SCENE_FILE_SCHEMA_H
#define GBG_SCENE_FILE_SCHEMA_H

#include <cyaml/cyaml.h>
#include <stdint.h>

/* A list of texts. */
#define GBG_FILE_LIST(name)                                                                        \
    char **name;                                                                                   \
    uint32_t name##_count

struct gbg_file_box {
    char *packing, *shape;
    GBG_FILE_LIST(size);
    GBG_FILE_LIST(origin);
    GBG_FILE_LIST(boundary);
};

struct gbg_file_species {
    char *name, *fraction, *count, *diameter, *alpha, *mobility;
};

struct gbg_file_start {
    char *lattice, *vacancies, *jitter, *random, *file, *frame;
};

struct gbg_file_particles {
    char *count;
    struct gbg_file_species *species;
    uint32_t species_count;
    struct gbg_file_start start;
};

struct gbg_file_force {
    char *law, *power, *sum, *cutoff, *tolerance, *split, *window, *gradient, *check;
};

struct gbg_file_exclusion {
    char *rule, *neighbours, *start, *max_rounds, *reverted, *skin;
};

struct gbg_file_noise {
    char *limit, *limit_by, *rescale;
};

struct gbg_file_dynamics {
    char *dt, *temperature, *kind;
    struct gbg_file_noise noise;
};

struct gbg_file_precision {
    char *mode;
};

struct gbg_file_run {
    char *steps, *seed, *run;
};

struct gbg_file_trajectory {
    char *file, *every, *precision, *overlap, *unwrapped;
};

struct gbg_file_restart {
    char *file, *every;
};

struct gbg_file_output {
    struct gbg_file_trajectory trajectory;
    struct gbg_file_restart restart;
};

struct gbg_file_scene {
    char *dimension;
    struct gbg_file_box box;
    struct gbg_file_particles particles;
    struct gbg_file_force *forces;
    uint32_t forces_count;
    struct gbg_file_exclusion excluded_volume;
    struct gbg_file_dynamics dynamics;
    struct gbg_file_precision precision;
    struct gbg_file_run run;
    struct gbg_file_output output;
};

/* The schema of the whole file; its keys are those of the table, level by level. */
extern const cyaml_schema_value_t gbg_file_schema;
extern const cyaml_schema_field_t gbg_file_species_fields[];
extern const cyaml_schema_field_t gbg_file_force_fields[];

#endif
