/* L1, CPU: where particles stand in memory. */
#ifndef GBG_BACKEND_CPU_ORDER_H
#define GBG_BACKEND_CPU_ORDER_H

#include "backend/backend.h"

int gbg_arrange(struct gbg_device *device, struct gbg_state *state, int by_place);
double gbg_list_scatter(const struct gbg_list *list);

#endif
