/* L3: a walk through the events of a scene file that notes the line of each key. */
#include "scene/file_lines.h"

#include <stdio.h>
#include <string.h>
#include <yaml.h>

#include "core/memory.h"

enum { DEEPEST = 16 };

/* An open block or list. */
struct level {
    int is_list;
    int awaits_value; /* a block whose key was read */
    int entries;      /* of a list so far */
    size_t path;      /* length of its own path */
};

struct walk {
    struct gbg_context *context;
    struct gbg_lines *lines;
    struct level level[DEEPEST];
    int depth;
    int documents;
    char path[GBG_KEY_CAPACITY];
};

static int refuse(const struct walk *walk, const yaml_event_t *event, const char *what)
{
    return gbg_fail(walk->context, GBG_E_FORMAT, "%d: %s", (int)event->start_mark.line + 1, what);
}

static int note(struct walk *walk, const yaml_event_t *event)
{
    struct gbg_lines *lines = walk->lines;
    if (lines->n == GBG_MOST_KEYS) {
        return refuse(walk, event, "too many keys, allowed 4096");
    }
    if (gbg_lines_has(lines, walk->path)) {
        return gbg_fail(walk->context, GBG_E_FORMAT, "%d: %s: given twice, first in line %d",
                        (int)event->start_mark.line + 1, walk->path,
                        gbg_lines_find(lines, walk->path));
    }
    struct gbg_line *line = &lines->line[lines->n++];
    line->line = (int)event->start_mark.line + 1;
    memcpy(line->path, walk->path, sizeof walk->path);
    return GBG_OK;
}

/* A scalar where a block awaits a key: the path of what follows. */
static int read_key(struct walk *walk, struct level *level, const yaml_event_t *event)
{
    size_t room = sizeof walk->path - level->path;
    const char *key = (const char *)event->data.scalar.value;
    int length = snprintf(walk->path + level->path, room, "%s%s", level->path ? "." : "", key);
    if (length < 0 || (size_t)length >= room || strlen(key) != event->data.scalar.length) {
        walk->path[level->path] = 0;
        return refuse(walk, event, "a key is no word or longer than any key of a scene");
    }
    level->awaits_value = 1;
    return note(walk, event);
}

/* Before a value: an entry of a list gets its number. */
static int begin_value(struct walk *walk, const yaml_event_t *event)
{
    if (walk->depth == 0) {
        return GBG_OK;
    }
    struct level *level = &walk->level[walk->depth - 1];
    if (level->is_list) {
        size_t room = sizeof walk->path - level->path;
        int length = snprintf(walk->path + level->path, room, "[%d]", level->entries++);
        if (length < 0 || (size_t)length >= room) {
            return refuse(walk, event, "lists are nested deeper than in any scene");
        }
        return note(walk, event);
    }
    return level->awaits_value ? GBG_OK
                               : refuse(walk, event, "a key is a list or a block, not a word");
}

static void end_value(struct walk *walk)
{
    if (walk->depth > 0) {
        struct level *level = &walk->level[walk->depth - 1];
        level->awaits_value = 0;
        walk->path[level->path] = 0;
    }
}

static int open_level(struct walk *walk, const yaml_event_t *event)
{
    int status = begin_value(walk, event);
    if (status == GBG_OK && walk->depth == DEEPEST) {
        status = refuse(walk, event, "blocks are nested deeper than in any scene, allowed 16");
    }
    if (status == GBG_OK) {
        walk->level[walk->depth++] = (struct level){
            .is_list = event->type == YAML_SEQUENCE_START_EVENT, .path = strlen(walk->path)};
    }
    return status;
}

static int read_scalar(struct walk *walk, const yaml_event_t *event)
{
    struct level *level = walk->depth > 0 ? &walk->level[walk->depth - 1] : NULL;
    if (level && !level->is_list && !level->awaits_value) {
        return read_key(walk, level, event);
    }
    int status = begin_value(walk, event);
    end_value(walk);
    return status;
}

static int has_anchor(const yaml_event_t *event)
{
    return (event->type == YAML_SCALAR_EVENT && event->data.scalar.anchor) ||
           (event->type == YAML_MAPPING_START_EVENT && event->data.mapping_start.anchor) ||
           (event->type == YAML_SEQUENCE_START_EVENT && event->data.sequence_start.anchor) ||
           event->type == YAML_ALIAS_EVENT;
}

static int take(struct walk *walk, const yaml_event_t *event)
{
    if (has_anchor(event)) {
        return refuse(walk, event,
                      "anchors and aliases have no place in a scene; repeat the value");
    }
    switch (event->type) {
    case YAML_DOCUMENT_START_EVENT:
        return walk->documents++ ? refuse(walk, event, "a second document, allowed one") : GBG_OK;
    case YAML_SCALAR_EVENT:
        return read_scalar(walk, event);
    case YAML_MAPPING_START_EVENT:
    case YAML_SEQUENCE_START_EVENT:
        return open_level(walk, event);
    case YAML_MAPPING_END_EVENT:
    case YAML_SEQUENCE_END_EVENT:
        walk->depth--;
        end_value(walk);
        return GBG_OK;
    default:
        return GBG_OK;
    }
}

static int no_yaml(struct gbg_context *context, const yaml_parser_t *parser)
{
    if (parser->error == YAML_MEMORY_ERROR) {
        return gbg_fail(context, GBG_E_MEMORY, "1: memory for the parser could not be had");
    }
    size_t line =
        parser->error == YAML_READER_ERROR ? parser->mark.line : parser->problem_mark.line;
    return gbg_fail(context, GBG_E_FORMAT, "%d: not YAML: %s%s%s", (int)line + 1,
                    parser->context ? parser->context : "", parser->context ? ", " : "",
                    parser->problem ? parser->problem : "cannot be parsed");
}

static int walk_events(struct walk *walk, yaml_parser_t *parser)
{
    int status = GBG_OK;
    for (int ended = 0; status == GBG_OK && !ended;) {
        yaml_event_t event;
        if (!yaml_parser_parse(parser, &event)) {
            return no_yaml(walk->context, parser);
        }
        status = take(walk, &event);
        ended = event.type == YAML_STREAM_END_EVENT;
        yaml_event_delete(&event);
    }
    return status;
}

int gbg_lines_read(struct gbg_context *context, const unsigned char *text, size_t bytes,
                   struct gbg_lines *lines)
{
    struct walk walk = {.context = context, .lines = lines};
    yaml_parser_t parser;
    *lines = (struct gbg_lines){0};
    int status = gbg_allocate(context, (void **)&lines->line, GBG_MOST_KEYS, sizeof *lines->line,
                              "lines of a scene file");
    if (status != GBG_OK) {
        return status;
    }
    if (yaml_parser_initialize(&parser)) {
        yaml_parser_set_input_string(&parser, text, bytes);
        status = walk_events(&walk, &parser);
        yaml_parser_delete(&parser);
    } else {
        status = gbg_fail(context, GBG_E_MEMORY, "1: memory for the parser could not be had");
    }
    if (status != GBG_OK) {
        gbg_lines_release(lines);
    }
    return status;
}

void gbg_lines_release(struct gbg_lines *lines)
{
    gbg_release(lines->line);
    *lines = (struct gbg_lines){0};
}

static const struct gbg_line *find(const struct gbg_lines *lines, const char *path, size_t length)
{
    for (int i = 0; i < lines->n; i++) {
        const char *has = lines->line[i].path;
        if (strncmp(has, path, length) == 0 && !has[length]) {
            return &lines->line[i];
        }
    }
    return NULL;
}

int gbg_lines_has(const struct gbg_lines *lines, const char *path)
{
    return find(lines, path, strlen(path)) != NULL;
}

int gbg_lines_find(const struct gbg_lines *lines, const char *path)
{
    size_t length = strlen(path);
    while (length > 0) {
        const struct gbg_line *found = find(lines, path, length);
        if (found) {
            return found->line;
        }
        do {
            length--;
        } while (length > 0 && path[length] != '.' && path[length] != '[');
    }
    return 1;
}
