/* L3: the table of keys: what the setters, the scene file, the checks and the docs all read. */
#ifndef GBG_SCENE_OPTIONS_H
#define GBG_SCENE_OPTIONS_H

#include <stddef.h>
#include <stdint.h>

#include "core/context.h"

struct gbg_scene;

enum gbg_option_type { GBG_REAL, GBG_INTEGER, GBG_CHOICE, GBG_SWITCH, GBG_TEXT };

/* One key. The value is a member of the struct that the table belongs to: a real is a double, an
 * integer an int64_t, a choice and a switch an int, a text a char array. */
struct gbg_option {
    const char *name; /* dotted, as in the scene file */
    int type;         /* enum gbg_option_type */
    size_t offset, size;
    const char *standard; /* default, as written in a file; "required", "not given" */
    const char *range;    /* an interval like "(0, 1]", or the choices: "none, clamp, redraw" */
    const char *meaning;
    const char *line;                      /* name|type|default|range|meaning */
    int first;                             /* value of the first choice */
    void (*then)(struct gbg_scene *scene); /* what else setting it means; or NULL */
};

/* A table is ended by an entry whose name is NULL. */
extern const struct gbg_option gbg_scene_options[];   /* of struct gbg_scene */
extern const struct gbg_option gbg_species_options[]; /* of struct gbg_species */
extern const struct gbg_option gbg_force_options[];   /* of struct gbg_force */
/* Keys of the scene file that calls give in other ways; documentation only, no member. */
extern const struct gbg_option gbg_file_options[];

/* The entry of that name; GBG_E_NAME with the nearest name. */
int gbg_option_find(struct gbg_context *context, const struct gbg_option *table, const char *name,
                    const struct gbg_option **option);

/* Writes a checked value into the struct at base; a refused value changes nothing. */
int gbg_option_set_real(struct gbg_context *context, const struct gbg_option *option, void *base,
                        double value);
int gbg_option_set_integer(struct gbg_context *context, const struct gbg_option *option, void *base,
                           int64_t value);
int gbg_option_set_text(struct gbg_context *context, const struct gbg_option *option, void *base,
                        const char *value);
/* Any type, from its text in a scene file. */
int gbg_option_parse(struct gbg_context *context, const struct gbg_option *option, void *base,
                     const char *text);

int gbg_option_get_real(struct gbg_context *context, const struct gbg_option *option,
                        const void *base, double *value);
int gbg_option_get_integer(struct gbg_context *context, const struct gbg_option *option,
                           const void *base, int64_t *value);
/* Any type, as it would be written in a scene file; 1 if it fitted, else 0. */
int gbg_option_format(const struct gbg_option *option, const void *base, size_t capacity,
                      char *text);

/* Gives every member that has a default its default. */
void gbg_option_defaults(const struct gbg_option *table, void *base);

#endif
