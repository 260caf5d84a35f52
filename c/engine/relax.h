/* L2: parts the hard cores of an overlapping start. */
#ifndef GBG_ENGINE_RELAX_H
#define GBG_ENGINE_RELAX_H

struct gbg_engine;

/* Moves particles until no cores overlap; a start without overlaps keeps every bit. GBG_E_OVERLAP
 * with a sentence when that does not succeed: the positions are then undefined. `call` begins the
 * sentence. */
int gbg_engine_relax(struct gbg_engine *engine, const char *call);

#endif
