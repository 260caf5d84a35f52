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

/* Before a step: the check of gbg_engine_check_sums if there was none, and another one when the
 * density has changed. */
int gbg_engine_watch_sums(struct gbg_engine *engine);

/* All particles in the order of ids, coordinates from the lower corner of the box. */
int gbg_engine_sources(struct gbg_engine *engine, struct gbg_sources *sources);

#endif
