/* L3: libcyaml called: its memory ours, its log lines made one sentence. */
#include "scene/file_shape.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "core/text.h"

/* What libcyaml says of an error: first what is wrong, then the blocks around it from inside out.
 */
struct complaint {
    int heard;
    char what[200];
    char path[GBG_KEY_CAPACITY];
};

/* Puts a block or list entry before the path of those inside it. */
static void put_before(struct complaint *complaint, const char *outer)
{
    char inner[GBG_KEY_CAPACITY];
    gbg_text_copy(inner, sizeof inner, complaint->path);
    const char *joint = inner[0] && inner[0] != '[' ? "." : "";
    snprintf(complaint->path, sizeof complaint->path, "%.60s%s%.90s", outer, joint, inner);
}

static void listen(cyaml_log_t level, void *user, const char *format, va_list arguments)
{
    static const char *const field = "in mapping field '", *const entry = "in sequence entry '";
    struct complaint *complaint = user;
    char line[200], outer[64];
    if (level != CYAML_LOG_ERROR) {
        return;
    }
    vsnprintf(line, sizeof line, format, arguments);
    line[strcspn(line, "\n")] = 0;
    char *at;
    if ((at = strstr(line, field))) {
        at += strlen(field);
        at[strcspn(at, "'")] = 0;
        put_before(complaint, at);
    } else if ((at = strstr(line, entry))) {
        snprintf(outer, sizeof outer, "[%d]", atoi(at + strlen(entry)) - 1);
        put_before(complaint, outer);
    } else if (!complaint->heard) {
        complaint->heard = 1;
        at = strncmp(line, "Load: ", 6) == 0 ? line + 6 : line;
        gbg_text_copy(complaint->what, sizeof complaint->what, at);
    }
}

/* libcyaml's reallocation on our allocator: the size stands before the block. */
static void *allocate(void *user, void *old, size_t bytes)
{
    char *fresh = NULL, *from = old;
    if (bytes > 0 && gbg_allocate(user, (void **)&fresh, (int64_t)(bytes + GBG_ALIGNMENT), 1,
                                  "values of a scene file") != GBG_OK) {
        return NULL;
    }
    if (fresh) {
        memcpy(fresh, &bytes, sizeof bytes);
        fresh += GBG_ALIGNMENT;
    }
    if (from) {
        size_t size;
        memcpy(&size, from - GBG_ALIGNMENT, sizeof size);
        if (fresh) {
            memcpy(fresh, from, size < bytes ? size : bytes);
        }
        gbg_release(from - GBG_ALIGNMENT);
    }
    return fresh;
}

static cyaml_config_t configuration(struct gbg_context *context, struct complaint *complaint)
{
    return (cyaml_config_t){.log_fn = listen,
                            .log_ctx = complaint,
                            .mem_fn = allocate,
                            .mem_ctx = context,
                            .log_level = CYAML_LOG_ERROR,
                            .flags = CYAML_CFG_NO_ALIAS};
}

/* The fields of the block at a path, NULL if it is none. */
static const cyaml_schema_field_t *fields_at(const char *path)
{
    const cyaml_schema_value_t *value = &gbg_file_schema;
    while (*path && value->type == CYAML_MAPPING) {
        size_t length = strcspn(path, ".[");
        const cyaml_schema_field_t *field = value->mapping.fields;
        while (field->key && (strncmp(field->key, path, length) != 0 || field->key[length])) {
            field++;
        }
        if (!field->key) {
            return NULL;
        }
        value = field->value.type == CYAML_SEQUENCE ? field->value.sequence.entry : &field->value;
        path += length;
        path += *path == '[' ? strcspn(path, ".") : 0;
        path += *path == '.';
    }
    return value->type == CYAML_MAPPING ? value->mapping.fields : NULL;
}

static int unknown_key(struct gbg_context *context, const struct gbg_lines *lines,
                       const struct complaint *complaint, const char *key)
{
    const cyaml_schema_field_t *field = fields_at(complaint->path);
    const char *nearest = "";
    char path[2 * GBG_KEY_CAPACITY];
    int least = 1000;
    for (; field && field->key; field++) {
        int distance = gbg_text_distance(key, field->key);
        if (distance < least) {
            least = distance;
            nearest = field->key;
        }
    }
    snprintf(path, sizeof path, "%s%s%s", complaint->path, complaint->path[0] ? "." : "", key);
    return gbg_fail(context, GBG_E_NAME, "%d: %s: no such key; the nearest is \"%s\"",
                    gbg_lines_find(lines, path), path, nearest);
}

/* "MAPPING", "SCALAR", ... in words. */
static const char *kind(const char *event)
{
    static const char *const words[][2] = {{"MAPPING", "a block of keys"},
                                           {"SEQUENCE", "a list"},
                                           {"STRING", "a single value"},
                                           {"SCALAR", "a single value"}};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++) {
        if (strncmp(event, words[i][0], strlen(words[i][0])) == 0) {
            return words[i][1];
        }
    }
    return "something else";
}

static int explain(struct gbg_context *context, const struct gbg_lines *lines,
                   const struct complaint *complaint, cyaml_err_t error)
{
    static const char *const key = "Unexpected key: ", *const expecting = "Expecting ",
                             *const got = "got event: ";
    if (error == CYAML_ERR_OOM) {
        return GBG_E_MEMORY; /* our allocator has said what was asked for */
    }
    int line = gbg_lines_find(lines, complaint->path);
    const char *path = complaint->path[0] ? complaint->path : "scene";
    if (strncmp(complaint->what, key, strlen(key)) == 0) {
        return unknown_key(context, lines, complaint, complaint->what + strlen(key));
    }
    const char *event = strstr(complaint->what, got);
    if (event && strncmp(complaint->what, expecting, strlen(expecting)) == 0) {
        return gbg_fail(context, GBG_E_FORMAT, "%d: %s: %s given, allowed %s", line, path,
                        kind(event + strlen(got)), kind(complaint->what + strlen(expecting)));
    }
    return gbg_fail(context, GBG_E_FORMAT, "%d: %s: %s", line, path,
                    complaint->heard ? complaint->what : cyaml_strerror(error));
}

int gbg_shape_read(struct gbg_context *context, const unsigned char *text, size_t bytes,
                   const struct gbg_lines *lines, struct gbg_file_scene **file)
{
    struct complaint complaint = {0};
    const cyaml_config_t config = configuration(context, &complaint);
    cyaml_data_t *data = NULL;
    cyaml_err_t error = cyaml_load_data(text, bytes, &config, &gbg_file_schema, &data, NULL);
    *file = data;
    return error == CYAML_OK ? GBG_OK : explain(context, lines, &complaint, error);
}

void gbg_shape_release(struct gbg_context *context, struct gbg_file_scene *file)
{
    struct complaint complaint = {0};
    const cyaml_config_t config = configuration(context, &complaint);
    if (file) {
        cyaml_free(&config, &gbg_file_schema, file, 0);
    }
}
