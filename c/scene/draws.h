/* L3: random numbers of start configurations: each use has its own counters. */
#ifndef GBG_SCENE_DRAWS_H
#define GBG_SCENE_DRAWS_H

#include "core/random.h"
#include "scene/scene.h"

/* What a draw is for: the top 8 bits of the id in its counter. */
enum gbg_draw { GBG_DRAW_SITE, GBG_DRAW_SPECIES, GBG_DRAW_JITTER, GBG_DRAW_INSERTION, GBG_DRAW_UNIFORM };

/* `dimension` uniform numbers in (0,1) for one try of one item (item below 2^48). */
static inline void gbg_draw(const struct gbg_scene *scene, enum gbg_draw use, int64_t item,
                            int64_t attempt, int dimension, double *values)
{
    uint64_t id = (uint64_t)use << 48 | (uint64_t)item;
    for (int a = 0; a < dimension; a += 2) {
        uint64_t step = (uint64_t)attempt * 2 + (uint64_t)(a / 2);
        struct gbg_philox w = gbg_philox(gbg_philox_counter(step, id, GBG_STREAM_START),
                                         (uint32_t)scene->seed, (uint32_t)scene->run);
        values[a] = gbg_uniform(w.word[0], w.word[1]);
        if (a + 1 < dimension) {
            values[a + 1] = gbg_uniform(w.word[2], w.word[3]);
        }
    }
}

/* A whole number in 0 .. n-1. */
static inline int64_t gbg_draw_below(const struct gbg_scene *scene, enum gbg_draw use, int64_t item,
                                     int64_t n)
{
    double value;
    gbg_draw(scene, use, item, 0, 1, &value);
    int64_t whole = (int64_t)(value * (double)n);
    return whole < n ? whole : n - 1;
}

#endif
