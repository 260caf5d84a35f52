/* Side room io: the bytes of a restart file, in the byte order of the machine, without gaps:
 *   struct gbg_restart_head | struct gbg_sum_state, n_sums of them | id[n] int64 | species[n] int32
 * | fraction[n] uint64 an axis | image[n] int32 an axis, if any | SHA-256 of everything before, 32
 * bytes. */
#ifndef GBG_IO_RESTART_LAYOUT_H
#define GBG_IO_RESTART_LAYOUT_H

#include <stdint.h>

#include "core/sha256.h"
#include "engine/view.h"
#include "scene/scene.h"

enum { GBG_RESTART_VERSION = 1, GBG_RESTART_HASH_BYTES = 32, GBG_RESTART_DIGITS = 64 };
#define GBG_RESTART_ORDER UINT32_C(0x01020304)

struct gbg_restart_head {
    char magic[8];
    uint32_t order, version;
    char digest[GBG_RESTART_DIGITS];
    int64_t n;
    int32_t dimension, n_species, has_images;
    int32_t n_sums; /* sums over all images of which something is known */
    uint64_t step;
    double time, length[3], origin[3];
    char name[GBG_MAX_SPECIES][GBG_NAME_CAPACITY];
};
_Static_assert(sizeof(struct gbg_restart_head) == 8 + 8 + 64 + 8 + 16 + 16 + 48 + 320,
               "the head of a restart file has no gaps");

_Static_assert(sizeof(struct gbg_sum_state) == 40, "a sum of a restart file has no gaps");

/* A file being read or written from the start to the end, with the hash of what went by. */
struct gbg_restart_stream {
    struct gbg_context *context;
    const char *path;
    int descriptor;
    int64_t at;
    struct gbg_sha256 hash;
};

#endif
