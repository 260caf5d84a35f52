/* Side room io: start configurations from plain text. */
#include <errno.h>
#include <inttypes.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "io/start_file.h"

enum { LINE_BYTES = 4096, MOST_FIELDS = 5 };

struct text {
    struct gbg_scene *scene;
    FILE *file;
    int64_t line;
    char raw[LINE_BYTES];
    char *field[MOST_FIELDS + 1];
    int fields;
};

static int refuse(const struct text *text, int column, const char *what)
{
    const struct gbg_scene *scene = text->scene;
    return gbg_fail(scene->context, GBG_E_FORMAT,
                    "%s, line %" PRId64 ", column %d: \"%.60s\" is %s", scene->start_file,
                    text->line, column + 1, text->field[column], what);
}

/* Splits the line at blanks, up to a comment; fields beyond the most are counted only. */
static void split(struct text *text)
{
    char *at = text->raw;
    at[strcspn(at, "#")] = 0;
    text->fields = 0;
    for (;;) {
        at += strspn(at, " \t\r\n\v\f");
        if (!*at) {
            return;
        }
        if (text->fields <= MOST_FIELDS) {
            text->field[text->fields] = at;
        }
        text->fields++;
        at += strcspn(at, " \t\r\n\v\f");
        if (*at) {
            *at++ = 0;
        }
    }
}

/* Next line with content: 1, 0 at the end, -1 after a failure that is reported. */
static int next_line(struct text *text)
{
    const struct gbg_scene *scene = text->scene;
    while (fgets(text->raw, LINE_BYTES, text->file)) {
        text->line++;
        size_t length = strlen(text->raw);
        if ((length == 0 || text->raw[length - 1] != '\n') && !feof(text->file)) {
            gbg_fail(scene->context, GBG_E_FORMAT,
                     "%s, line %" PRId64 ": it is longer than %d "
                     "bytes or holds a zero byte: this is neither a text of columns, a netCDF "
                     "trajectory nor a restart file",
                     scene->start_file, text->line, LINE_BYTES - 2);
            return -1;
        }
        split(text);
        if (text->fields > 0) {
            return 1;
        }
    }
    if (ferror(text->file)) {
        char words[GBG_ERROR_TEXT];
        gbg_fail(scene->context, GBG_E_FILE, "%s: cannot read it: %s", scene->start_file,
                 gbg_file_error(errno, words));
        return -1;
    }
    return 0;
}

static int read_real(struct text *text, int column, double *value)
{
    static const char digits[] = "+-.0123456789eEdD";
    char copy[64];
    const char *field = text->field[column];
    size_t length = strlen(field);
    if (length >= sizeof copy || strspn(field, digits) != length) {
        return refuse(text, column, "not a number");
    }
    for (size_t k = 0; k <= length; k++) {
        copy[k] = field[k] == 'd' || field[k] == 'D' ? 'e' : field[k];
    }
    char *end;
    *value = strtod(copy, &end);
    if (end == copy || *end) {
        return refuse(text, column, "not a number");
    }
    return isfinite(*value) ? GBG_OK : refuse(text, column, "beyond the range of numbers");
}

static int read_species(struct text *text, int column, int32_t *species)
{
    const struct gbg_scene *scene = text->scene;
    const char *field = text->field[column];
    for (int s = 0; s < scene->n_species; s++) {
        if (strcmp(field, scene->species[s].name) == 0) {
            *species = s;
            return GBG_OK;
        }
    }
    char *end, what[96];
    errno = 0;
    long number = strtol(field, &end, 10);
    if (*end || errno || number < 1 || number > scene->n_species) {
        snprintf(what, sizeof what, "neither a species of the scene nor its number (1 to %d)",
                 scene->n_species);
        return refuse(text, column, what);
    }
    *species = (int32_t)number - 1;
    return GBG_OK;
}

static int read_particle(struct text *text, struct gbg_particles *particles, int64_t i)
{
    const struct gbg_scene *scene = text->scene;
    int dimension = scene->dimension, status = GBG_OK;
    int may_lack = scene->n_species == 1 && text->fields == dimension;
    if (text->fields != dimension + 1 && !may_lack) {
        return gbg_fail(scene->context, GBG_E_FORMAT,
                        "%s, line %" PRId64 ": it has %d columns "
                        "(\"%.60s\" ...), expected are %d: %s species",
                        scene->start_file, text->line, text->fields, text->field[0], dimension + 1,
                        dimension == 2 ? "x y" : "x y z");
    }
    for (int a = 0; a < dimension && status == GBG_OK; a++) {
        status = read_real(text, a, &particles->position[a][i]);
    }
    particles->species[i] = 0;
    particles->id[i] = i;
    if (status == GBG_OK && !may_lack) {
        status = read_species(text, dimension, &particles->species[i]);
    }
    return status;
}

static int count_particles(struct text *text, int64_t *n)
{
    int more;
    for (*n = 0; (more = next_line(text)) > 0;) {
        ++*n;
    }
    if (more == 0 && *n == 0) {
        return gbg_fail(text->scene->context, GBG_E_FORMAT, "%s: there is no particle in it",
                        text->scene->start_file);
    }
    return more == 0 ? GBG_OK : GBG_E_FORMAT;
}

static int read_all(struct text *text, struct gbg_particles *particles)
{
    int64_t n, i = 0;
    int more = 0, status = count_particles(text, &n);
    if (status == GBG_OK) {
        status = gbg_particles_allocate(text->scene->context, n, text->scene->dimension, particles);
    }
    rewind(text->file);
    text->line = 0;
    while (status == GBG_OK && i < n && (more = next_line(text)) > 0) {
        status = read_particle(text, particles, i++);
    }
    if (status == GBG_OK && (more < 0 || i < n)) {
        status = gbg_fail(text->scene->context, GBG_E_FILE, "%s: it changed while it was read",
                          text->scene->start_file);
    }
    return status;
}

int gbg_io_read_text(struct gbg_scene *scene, struct gbg_particles *particles)
{
    char words[GBG_ERROR_TEXT];
    struct text text = {.scene = scene, .file = fopen(scene->start_file, "rb")};
    if (!text.file) {
        return gbg_fail(scene->context, GBG_E_FILE, "%s: cannot open it: %s", scene->start_file,
                        gbg_file_error(errno, words));
    }
    /* The decimal point is a point, whatever locale the calling program has set. */
    locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    locale_t former = plain ? uselocale(plain) : (locale_t)0;
    int status = plain ? read_all(&text, particles)
                       : gbg_fail(scene->context, GBG_E_MEMORY, "%s: no memory for a locale",
                                  scene->start_file);
    if (plain) {
        uselocale(former);
        freelocale(plain);
    }
    fclose(text.file);
    return status;
}
