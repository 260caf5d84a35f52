/* Public: the context: which backend, how many threads, where messages go. */
#ifndef GAMBOGE_CONTEXT_H
#define GAMBOGE_CONTEXT_H

#include <stddef.h>
#include <stdint.h>

#include "status.h"

#ifdef __cplusplus
extern "C" {
#endif

struct gbg_context;

enum gbg_log_level { GBG_LOG_INFO = 0, GBG_LOG_WARNING = 1 };

/* A sink of log lines (no newline at the end). level: enum gbg_log_level. */
typedef void (*gbg_log_sink)(void *user, int level, const char *line);

/* backend: "cpu", "cpu:threads=4", "poison" (the CPU backend with every fresh array and output
 * filled with NaN first), "cuda" or "cuda:1" (the GPU of that number, 0 without one), "auto". NULL
 * means "auto": a GPU if this build has the backend cuda and there is a GPU that it can use, else
 * the CPU; which one and why is a line of the log when an engine is created. Small systems may be
 * faster on the CPU: measure, and name it. "auto:1" means GPU 1; "auto:threads=4" takes the CPU.
 * For tests the instruction set may be fixed: "cpu:threads=2,isa=generic" (or avx2, avx512).
 * Objects made from a context must be destroyed before it. A context and its objects belong to one
 * thread at a time; several contexts may live in several threads. */
GBG_API int gbg_context_create(const char *backend, struct gbg_context **context);
/* Destroys and sets *context to NULL; NULL is allowed. So for every destroy of this library. */
GBG_API int gbg_context_destroy(struct gbg_context **context);

/* The sentence that belongs to the last failed call on this context or its objects: what was
 * wrong, the value given, the range allowed, the call. "" if none failed. With NULL: the last
 * failure in this thread of a call that had no context in hand. Valid until the next call. */
GBG_API const char *gbg_message(const struct gbg_context *context);

/* Sink for log lines; NULL (the default) drops them. The library itself never prints. */
GBG_API int gbg_context_set_log(struct gbg_context *context, gbg_log_sink sink, void *user);

/* Name of the backend ("cpu"), of the instruction set its kernels use ("avx512", "avx2",
 * "generic"; "sm_90" on a GPU of compute capability 9.0), and the number of threads on the
 * processor. */
GBG_API int gbg_context_backend(const struct gbg_context *context, const char **name,
                                const char **instructions, int *threads);

/* "gamboge 0.1.0 (...)": version and the components that this build has. Static storage. */
GBG_API const char *gbg_version_text(void);
/* 1 if the build has the component: "fftw", "netcdf", "yaml", "openmp", "cuda"; else 0. */
GBG_API int gbg_has_component(const char *component);

#ifdef __cplusplus
}
#endif
#endif
