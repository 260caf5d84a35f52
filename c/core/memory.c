/* L0: aligned memory. */
#include "core/memory.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "core/context.h"

static _Atomic int64_t countdown; /* to the allocation that a test wants to fail */

int64_t gbg_memory_fail_after(int64_t n)
{
    return atomic_exchange(&countdown, n);
}

int gbg_memory_told_to_fail(void)
{
    return atomic_load(&countdown) > 0 && atomic_fetch_sub(&countdown, 1) == 1;
}

int gbg_allocate(struct gbg_context *context, void **pointer, int64_t count, size_t size,
                 const char *what)
{
    *pointer = NULL;
    const uint64_t limit = (UINT64_C(1) << 62) / (size ? size : 1);
    if (count < 0 || (uint64_t)count > limit) {
        return gbg_fail(context, GBG_E_MEMORY,
                        "%s: %lld elements of %zu bytes are more than memory "
                        "can hold",
                        what, (long long)count, size);
    }
    size_t bytes = ((size_t)count * size + 2 * GBG_ALIGNMENT - 1) & ~(size_t)(GBG_ALIGNMENT - 1);
    if (!gbg_memory_told_to_fail()) {
        *pointer = aligned_alloc(GBG_ALIGNMENT, bytes);
    }
    if (!*pointer) {
        return gbg_fail(context, GBG_E_MEMORY, "%s: %zu bytes could not be had", what, bytes);
    }
    return GBG_OK;
}

int gbg_allocate_zero(struct gbg_context *context, void **pointer, int64_t count, size_t size,
                      const char *what)
{
    int status = gbg_allocate(context, pointer, count, size, what);
    if (status == GBG_OK) {
        size_t bytes = (size_t)count * size;
        bytes = (bytes + 2 * GBG_ALIGNMENT - 1) & ~(size_t)(GBG_ALIGNMENT - 1);
        memset(*pointer, 0, bytes);
    }
    return status;
}

void gbg_release(void *pointer)
{
    free(pointer);
}
