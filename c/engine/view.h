/* L2: what side rooms (io, analysis) may see of an engine: copies, in the order of ids. */
#ifndef GBG_ENGINE_VIEW_H
#define GBG_ENGINE_VIEW_H

#include <stdint.h>

#include "core/box.h"
#include "gamboge/scene.h"

struct gbg_engine;
struct gbg_context;
struct gbg_scene;
struct gbg_frame;
struct gbg_backend;
struct gbg_slot;

struct gbg_engine_view {
    struct gbg_context *context;
    const struct gbg_scene *scene; /* resolved: species, options, source */
    struct gbg_box box;
    int64_t n;
    uint64_t step;
    double time;
    int has_images, has_overlap; /* kept by this engine */
    /* one a force: relative RMS error asked for and measured, NaN where there is none */
    double force_tolerance[GBG_MAX_FORCES], force_error[GBG_MAX_FORCES];
    int has_sums;           /* 1: some force has these */
    const int32_t *species; /* n, in the order of ids, from 0 */
    const int64_t *id;      /* n, ascending */
};

/* The view of the present state; valid until the next call that changes the engine. */
int gbg_engine_look(struct gbg_engine *engine, struct gbg_engine_view *view)
    __attribute__((warn_unused_result));

/* Copies of the present state for one axis, in the order of ids (n values). */
int gbg_engine_copy_fractions(struct gbg_engine *engine, int axis, uint64_t *fraction);
int gbg_engine_copy_images(struct gbg_engine *engine, int axis, int32_t *image);
int gbg_engine_copy_overlap(struct gbg_engine *engine, int32_t *flag);
/* A copy of a state that its backend makes while the engine goes on. All zero: none yet. It may
 * outlive the engine. */
struct gbg_copy {
    const struct gbg_backend *backend;
    struct gbg_slot *slot;
};
/* 1 if the backend makes such copies; else the state is there to be read at any time. */
int gbg_engine_copies_ahead(const struct gbg_engine *engine);
/* Takes the present state, with images and overlap flags or without; nobody may read an earlier
 * frame of this copy any more. */
int gbg_engine_copy_begin(struct gbg_engine *engine, int images, int overlap,
                          struct gbg_copy *copy);
/* NULL when the frame is there, good until the copy is begun again or released; else what went
 * wrong. For any thread. */
const char *gbg_copy_wait(const struct gbg_copy *copy, struct gbg_frame *frame);
void gbg_copy_release(struct gbg_copy *copy);

/* Forces at the present positions for all axes (dimension pointers). */
int gbg_engine_copy_forces(struct gbg_engine *engine, double *const *force);

/* Puts back a state that a restart file holds (n values an axis, order of ids; image NULL when the
 * engine keeps none), with step and run counters. */
int gbg_engine_restore(struct gbg_engine *engine, uint64_t step, const uint64_t *const *fraction,
                       const int32_t *const *image);

/* What is known of the sums over all images: it must go on with the state, because a sum that was
 * refined adds other numbers. */
struct gbg_sum_state {
    double contrast, size,
        measured; /* of the density, RMS force, relative error: at the last check */
    int32_t force, refined, symmetric, unused;
};
/* Measures the sums if this was not done yet. */
int gbg_engine_check_sums(struct gbg_engine *engine);
/* Those that were measured: their number; room for one a force. */
int gbg_engine_copy_sums(const struct gbg_engine *engine, struct gbg_sum_state *states);
int gbg_engine_restore_sums(struct gbg_engine *engine, int count,
                            const struct gbg_sum_state *states);

#endif
