/* L2: sums over all images of an engine: made, measured, refined. */
#ifndef GBG_ENGINE_MESH_CHECK_H
#define GBG_ENGINE_MESH_CHECK_H

#include "engine/mesh_sum.h"

struct gbg_engine;
struct gbg_sources;

/* The sum of force f of the scene. */
int gbg_engine_make_mesh_sum(struct gbg_engine *engine, int f);
void gbg_engine_free_mesh_sums(struct gbg_engine *engine);
/* NULL: that force is another sum. */
const struct gbg_mesh_sum *gbg_engine_mesh_sum(const struct gbg_engine *engine, int f);
/* A particle. */
double gbg_engine_mesh_bytes(const struct gbg_engine *engine, int f);

/* In a step, when its forces are there: now and then looks at the density and at the size of the
 * forces, and measures the sums anew if these have changed: then *measured is 1, and the forces
 * have to be made again. */
int gbg_engine_watch_sums(struct gbg_engine *engine, int *measured);

/* All particles in the order of ids, coordinates from the lower corner of the box. */
int gbg_engine_sources(struct gbg_engine *engine, struct gbg_sources *sources);

#endif
