/* Side room io: restart files: the whole state, bit for bit, with a checksum. */
#ifndef GBG_IO_RESTART_H
#define GBG_IO_RESTART_H

#include <stdint.h>

#include "engine/view.h"
#include "scene/scene.h"

/* The first bytes of every restart file: a line end that text transfers would change, as PNG has.
 */
#define GBG_RESTART_MAGIC "gbgrst\r\n"

struct gbg_restart {
    char digest[65]; /* of the scene */
    int64_t n;
    int dimension, n_species, has_images, n_sums;
    struct gbg_sum_state sum[GBG_MAX_FORCES];
    uint64_t step;
    double time, length[3], origin[3];
    char name[GBG_MAX_SPECIES][GBG_NAME_CAPACITY];
    int64_t *id;      /* n, ascending */
    int32_t *species; /* n, from 0 */
    uint64_t *fraction[3];
    int32_t *image[3]; /* NULL without images */
};

/* Writes the engine's state: temporary name, sync, rename; the former file becomes PATH.previous.
 */
int gbg_restart_save(struct gbg_engine *engine, const struct gbg_engine_view *view,
                     const char *path);

/* Reads a file and checks all of it before anything is returned. The arrays are released by
 * gbg_restart_release, also after a failure. */
int gbg_restart_read(struct gbg_context *context, const char *path, struct gbg_restart *restart);
void gbg_restart_release(struct gbg_restart *restart);

/* Puts the state of a file into an engine of the same scene. */
int gbg_restart_load(struct gbg_engine *engine, const struct gbg_engine_view *view,
                     const char *path);

#endif
