/* L0: one lock for the planner of FFTW, the one part of it that must not run twice at a time:
 * whoever plans holds it, in every library of ours. */
#ifndef GBG_CORE_PLANNER_H
#define GBG_CORE_PLANNER_H

/* Hidden from users, shared between our own libraries. */
#pragma GCC visibility push(default)

void gbg_planner_lock(void);
void gbg_planner_unlock(void);

#pragma GCC visibility pop

#endif
