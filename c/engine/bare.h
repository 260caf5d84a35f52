/* L2: a state without an engine, made from a caller's arrays for one kernel call. */
#ifndef GBG_ENGINE_BARE_H
#define GBG_ENGINE_BARE_H

#include "backend/backend.h"
#include "core/view.h"

struct gbg_context;

struct gbg_bare {
    struct gbg_context *context;
    const struct gbg_backend *backend;
    const struct gbg_kernels *kernels;
    struct gbg_device *device;
    struct gbg_state state; /* one species; coordinates only */
    uint32_t *words;        /* transfer buffer of one axis */
};

/* Box [0, lengths) and coordinates taken modulo it. On failure nothing is left behind. */
int gbg_bare_make(struct gbg_context *context, int dimension, const double *lengths,
                  const struct gbg_points *points, struct gbg_bare *bare);
/* Other places for the same number of particles. */
int gbg_bare_move(struct gbg_bare *bare, const struct gbg_points *points);
void gbg_bare_free(struct gbg_bare *bare);

/* An array of the backend in `*pointer`, filled from host memory (NULL: zeros). Given back by
 * bare->backend->release. */
int gbg_bare_array(struct gbg_bare *bare, void **pointer, const void *from, size_t size,
                   const char *what);

/* Fractions of an axis into fraction[n]. */
int gbg_bare_fractions(struct gbg_bare *bare, int axis, uint64_t *fraction);

/* Checks that every call on a caller's arrays makes: dimension, lengths, n, bases, step, finite
 * coordinates. The message starts with the name of the call. */
int gbg_bare_check(struct gbg_context *context, const char *call, int dimension,
                   const double *lengths, const struct gbg_points *points);

#endif
