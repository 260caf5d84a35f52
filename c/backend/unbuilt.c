/* L1: backends that this build leaves out: they answer with the option that brings them. */
#include "backend/backend.h"
#include "core/context.h"

static int refuse(struct gbg_context *context)
{
    return gbg_fail(context, GBG_E_UNBUILT,
                    "backend cuda is not part of this build: configure with -DGBG_WITH_CUDA=ON");
}

const struct gbg_backend gbg_backend_cuda = {.name = "cuda", .probe = refuse};
