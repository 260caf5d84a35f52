/* L3: a scene file held against the schema. */
#ifndef GBG_SCENE_FILE_SHAPE_H
#define GBG_SCENE_FILE_SHAPE_H

#include "scene/file_lines.h"
#include "scene/file_schema.h"

/* The texts of all keys, allocated by libcyaml; NULL for a file without any. The message of a
 * refusal starts with the line. */
int gbg_shape_read(struct gbg_context *context, const unsigned char *text, size_t bytes,
                   const struct gbg_lines *lines, struct gbg_file_scene **file);
void gbg_shape_release(struct gbg_context *context, struct gbg_file_scene *file);

#endif
