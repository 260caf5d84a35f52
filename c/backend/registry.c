/* L1: which backends there are. */
#include <string.h>

#include "backend/backend.h"

extern const struct gbg_backend gbg_backend_cpu, gbg_backend_poison, gbg_backend_cuda;

const struct gbg_backend *gbg_backend_find(const char *name)
{
    static const struct gbg_backend *const all[] = {&gbg_backend_cpu, &gbg_backend_poison,
                                                    &gbg_backend_cuda};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
        if (strcmp(all[k]->name, name) == 0) {
            return all[k];
        }
    }
    return NULL;
}
