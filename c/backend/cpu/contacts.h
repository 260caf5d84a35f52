/* L1, CPU: hard cores: corrections, and the checks that nothing overlaps or passed through. */
#ifndef GBG_BACKEND_CPU_CONTACTS_H
#define GBG_BACKEND_CPU_CONTACTS_H

#include "backend/backend.h"

int gbg_contacts(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                 struct gbg_contacts *contacts);
int gbg_keep(struct gbg_device *device, struct gbg_state *state);
int gbg_put_back(struct gbg_device *device, struct gbg_state *state);
int gbg_overlaps(struct gbg_device *device, struct gbg_state *state, double tolerance,
                 int64_t capacity, int32_t *first, int32_t *second, struct gbg_pair *lowest,
                 int64_t *count);
int gbg_roll_back(struct gbg_device *device, struct gbg_state *state, double tolerance,
                  int straight, int64_t *reverted);

#endif
