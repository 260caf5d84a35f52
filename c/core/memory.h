/* L0: aligned memory with the overflow check and the message in one place. */
#ifndef GBG_CORE_MEMORY_H
#define GBG_CORE_MEMORY_H

#include <stddef.h>
#include <stdint.h>

/* Hidden from users, shared between our own libraries. */
#pragma GCC visibility push(default)

struct gbg_context;

enum { GBG_ALIGNMENT = 64 };

/* count elements of `size` bytes, 64-byte aligned, padded by one cache line so that a vector load
 * at the end stays inside; *pointer NULL and GBG_E_MEMORY with a message when it cannot be had.
 * `what` names the array in the message. Contents undefined. */
int gbg_allocate(struct gbg_context *context, void **pointer, int64_t count, size_t size,
                 const char *what);
/* The same, all bytes zero. */
int gbg_allocate_zero(struct gbg_context *context, void **pointer, int64_t count, size_t size,
                      const char *what);
void gbg_release(void *pointer);

/* For tests: the n-th allocation from now fails, on the host or a device (0: none does). Returns
 * how many were left to the one that was to fail before: 0: it has failed. */
int64_t gbg_memory_fail_after(int64_t n);

#pragma GCC visibility pop

/* Asked by whoever allocates elsewhere than here, once an allocation: 1 if this one shall fail. */
int gbg_memory_told_to_fail(void);

#endif
