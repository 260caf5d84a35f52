/* L3: reads, checks and writes the values of keys after the table. */
#include "scene/options.h"

#include <errno.h>
#include <inttypes.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/text.h"

enum { LONGEST_VALUE = 80 }; /* of a value repeated in a message */

static const char *const type_names[] = {"a real", "an integer", "a choice", "a switch", "a text"};

int gbg_option_find(struct gbg_context *context, const struct gbg_option *table, const char *name,
                    const struct gbg_option **option)
{
    const char *nearest = "";
    int least = INT32_MAX;
    for (const struct gbg_option *entry = table; entry->name; entry++) {
        if (strcmp(entry->name, name) == 0) {
            *option = entry;
            return GBG_OK;
        }
        int distance = gbg_text_distance(entry->name, name);
        if (distance < least) {
            least = distance;
            nearest = entry->name;
        }
    }
    return gbg_fail(context, GBG_E_NAME, "no option \"%.*s\"; the nearest is \"%s\"", LONGEST_VALUE,
                    name, nearest);
}

static int wrong_type(struct gbg_context *context, const struct gbg_option *option, const char *as)
{
    return gbg_fail(context, GBG_E_ARGUMENT, "%s is %s with values %s, not %s", option->name,
                    type_names[option->type], option->range, as);
}

/* Numbers mean the same in every locale: their decimal point is a point. */
static double parse_real(const char *text, char **end)
{
    locale_t plain = newlocale(LC_NUMERIC_MASK, "C", (locale_t)0);
    locale_t old = plain ? uselocale(plain) : (locale_t)0;
    double value = strtod(text, end);
    if (plain) {
        uselocale(old);
        freelocale(plain);
    }
    return value;
}

/* Shortest of 15 or 17 digits that is read back as the same number. */
static void format_real(double value, size_t capacity, char *text)
{
    locale_t plain = newlocale(LC_NUMERIC_MASK, "C", (locale_t)0);
    locale_t old = plain ? uselocale(plain) : (locale_t)0;
    snprintf(text, capacity, "%.15g", value);
    if (strtod(text, NULL) != value) {
        snprintf(text, capacity, "%.17g", value);
    }
    if (plain) {
        uselocale(old);
        freelocale(plain);
    }
}

static int inside(const char *range, double value)
{
    char *end;
    double low = parse_real(range + 1, &end);
    double high = parse_real(end + 1, &end);
    int above = range[0] == '(' ? value > low : value >= low;
    int below = *end == ')' ? value < high : value <= high;
    return above && below;
}

/* Index of a word in "one, two, three", -1 if it is not there. */
static int choice_index(const char *choices, const char *word)
{
    size_t length = strlen(word);
    const char *at = choices;
    for (int index = 0; *at; index++) {
        size_t step = strcspn(at, ",");
        if (step == length && strncmp(at, word, length) == 0) {
            return index;
        }
        at += step;
        at += strspn(at, ", ");
    }
    return -1;
}

static void choice_word(const char *choices, int index, size_t capacity, char *word)
{
    const char *at = index < 0 ? "" : choices;
    while (index-- > 0 && *at) {
        at += strcspn(at, ",");
        at += strspn(at, ", ");
    }
    snprintf(word, capacity, "%.*s", (int)strcspn(at, ","), at);
}

static char *member(const struct gbg_option *option, void *base)
{
    return (char *)base + option->offset;
}

static const char *const_member(const struct gbg_option *option, const void *base)
{
    return (const char *)base + option->offset;
}

static int done(const struct gbg_option *option, void *base)
{
    if (option->then) {
        option->then(base);
    }
    return GBG_OK;
}

int gbg_option_set_real(struct gbg_context *context, const struct gbg_option *option, void *base,
                        double value)
{
    if (option->type != GBG_REAL) {
        return wrong_type(context, option, "a real");
    }
    if (!isfinite(value) || !inside(option->range, value)) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: %.10g given, allowed %s", option->name, value,
                        option->range);
    }
    memcpy(member(option, base), &value, sizeof value);
    return done(option, base);
}

static int set_word(const struct gbg_option *option, void *base, int value)
{
    memcpy(member(option, base), &value, sizeof value);
    return done(option, base);
}

int gbg_option_set_integer(struct gbg_context *context, const struct gbg_option *option, void *base,
                           int64_t value)
{
    if (option->type == GBG_REAL) {
        return gbg_option_set_real(context, option, base, (double)value);
    }
    if (option->type == GBG_SWITCH && (value == 0 || value == 1)) {
        return set_word(option, base, (int)value);
    }
    if (option->type != GBG_INTEGER) {
        return wrong_type(context, option, "an integer");
    }
    if (!inside(option->range, (double)value)) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: %" PRId64 " given, allowed %s", option->name,
                        value, option->range);
    }
    memcpy(member(option, base), &value, sizeof value);
    return done(option, base);
}

int gbg_option_set_text(struct gbg_context *context, const struct gbg_option *option, void *base,
                        const char *value)
{
    if (option->type == GBG_TEXT) {
        size_t length = strlen(value);
        if (length >= option->size) {
            return gbg_fail(context, GBG_E_ARGUMENT, "%s: a text of %zu bytes given, allowed %zu",
                            option->name, length, option->size - 1);
        }
        memcpy(member(option, base), value, length + 1);
        return done(option, base);
    }
    if (option->type != GBG_CHOICE && option->type != GBG_SWITCH) {
        return wrong_type(context, option, "a text");
    }
    int index = choice_index(option->range, value);
    if (index < 0) {
        return gbg_fail(context, GBG_E_NAME, "%s: \"%.*s\" given, allowed %s", option->name,
                        LONGEST_VALUE, value, option->range);
    }
    return set_word(option, base, index + option->first);
}

int gbg_option_parse(struct gbg_context *context, const struct gbg_option *option, void *base,
                     const char *text)
{
    if (option->type != GBG_REAL && option->type != GBG_INTEGER) {
        return gbg_option_set_text(context, option, base, text);
    }
    char *end = NULL;
    errno = 0;
    double real = 0;
    int64_t integer = 0;
    if (option->type == GBG_REAL) {
        real = parse_real(text, &end);
    } else {
        integer = strtoll(text, &end, 10);
    }
    if (end == text || *end || (errno && option->type == GBG_INTEGER)) {
        return gbg_fail(context, GBG_E_ARGUMENT, "%s: \"%.*s\" given, allowed %s in %s",
                        option->name, LONGEST_VALUE, text, type_names[option->type], option->range);
    }
    return option->type == GBG_REAL ? gbg_option_set_real(context, option, base, real)
                                    : gbg_option_set_integer(context, option, base, integer);
}

int gbg_option_get_real(struct gbg_context *context, const struct gbg_option *option,
                        const void *base, double *value)
{
    if (option->type != GBG_REAL) {
        return wrong_type(context, option, "a real");
    }
    memcpy(value, const_member(option, base), sizeof *value);
    return GBG_OK;
}

int gbg_option_get_integer(struct gbg_context *context, const struct gbg_option *option,
                           const void *base, int64_t *value)
{
    if (option->type == GBG_SWITCH) {
        int word;
        memcpy(&word, const_member(option, base), sizeof word);
        *value = word;
        return GBG_OK;
    }
    if (option->type != GBG_INTEGER) {
        return wrong_type(context, option, "an integer");
    }
    memcpy(value, const_member(option, base), sizeof *value);
    return GBG_OK;
}

int gbg_option_format(const struct gbg_option *option, const void *base, size_t capacity,
                      char *text)
{
    char word[64];
    const char *from = const_member(option, base);
    if (option->type == GBG_TEXT) {
        return gbg_text_copy(text, capacity, from);
    }
    if (option->type == GBG_REAL) {
        double value;
        memcpy(&value, from, sizeof value);
        format_real(value, sizeof word, word);
    } else if (option->type == GBG_INTEGER) {
        int64_t value;
        memcpy(&value, from, sizeof value);
        snprintf(word, sizeof word, "%" PRId64, value);
    } else {
        int value;
        memcpy(&value, from, sizeof value);
        choice_word(option->range, value - option->first, sizeof word, word);
    }
    return gbg_text_copy(text, capacity, word);
}

void gbg_option_defaults(const struct gbg_option *table, void *base)
{
    static const char *const absent[] = {"required", "not given", "A, B, ...", NULL};
    for (const struct gbg_option *entry = table; entry->name; entry++) {
        struct gbg_option quiet = *entry;
        quiet.then = NULL;
        if (gbg_text_find(entry->standard, absent) < 0) {
            gbg_option_parse(NULL, &quiet, base, entry->standard);
        }
    }
}
