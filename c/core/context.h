/* L0: the context's body, and the functions that set its message. */
#ifndef GBG_CORE_CONTEXT_H
#define GBG_CORE_CONTEXT_H

#include "gamboge/context.h"

/* Hidden from users, shared between our own libraries. */
#pragma GCC visibility push(default)

enum { GBG_MESSAGE_CAPACITY = 1024 };

struct gbg_context {
    char backend[32];      /* registry name: "cpu", "poison", "cuda" */
    char instructions[16]; /* of the kernels chosen: "avx512", "avx2", "generic", "sm_90" */
    char host[16];         /* of what runs on the processor whatever the backend: analysis */
    int threads;           /* on the processor */
    int threads_given;     /* 1: the caller named a number of threads, which is taken as it is */
    int device;            /* number of the GPU */
    char card[64];         /* name of the GPU, "" without one */
    char choice[320];      /* what `auto` took and why, a line for the log; "": nothing to choose */
    gbg_log_sink sink;
    void *sink_user;
    char message[GBG_MESSAGE_CAPACITY];
};

/* Stores the sentence and returns `status`, so that a check reads: return gbg_fail(...). A NULL
 * context stores it for gbg_message(NULL) of this thread. */
int gbg_fail(struct gbg_context *context, int status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Puts "prefix: " before the message that is stored, for a caller that knows where (file, line). */
void gbg_message_prefix(struct gbg_context *context, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* The stored sentence; of this thread for NULL. */
const char *gbg_message_of(const struct gbg_context *context);

void gbg_log(struct gbg_context *context, int level, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#pragma GCC visibility pop

#endif
