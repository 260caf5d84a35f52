/* L3: which line of a scene file holds which key. */
#ifndef GBG_SCENE_FILE_LINES_H
#define GBG_SCENE_FILE_LINES_H

#include <stddef.h>

#include "core/context.h"

enum { GBG_KEY_CAPACITY = 160, GBG_MOST_KEYS = 4096 };

/* A key by its path, "particles.species[1].fraction", entries of lists counted from 0. */
struct gbg_line {
    int line; /* from 1 */
    char path[GBG_KEY_CAPACITY];
};

struct gbg_lines {
    int n;
    struct gbg_line *line;
};

/* Walks through the text once. Refuses what is no YAML, and what no scene needs: repeated keys,
 * anchors and aliases, several documents, keys that are not words, deep nesting, too many keys.
 * The message starts with the line. */
int gbg_lines_read(struct gbg_context *context, const unsigned char *text, size_t bytes,
                   struct gbg_lines *lines);
void gbg_lines_release(struct gbg_lines *lines);

/* Line of the path, or of the longest beginning of it (block by block) that the file has; 1 if it
 * has none. */
int gbg_lines_find(const struct gbg_lines *lines, const char *path);
/* 1 if the file has exactly this path. */
int gbg_lines_has(const struct gbg_lines *lines, const char *path);

#endif
