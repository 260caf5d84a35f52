/* L0: messages, log lines and the texts of the status list. */
#include "core/context.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* Only for failures that have no context to keep their sentence: one a thread. */
static _Thread_local char orphan_message[GBG_MESSAGE_CAPACITY];

int gbg_fail(struct gbg_context *context, int status, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(context ? context->message : orphan_message, GBG_MESSAGE_CAPACITY, format, arguments);
    va_end(arguments);
    return status;
}

void gbg_message_prefix(struct gbg_context *context, const char *format, ...)
{
    char *message = context ? context->message : orphan_message;
    char old[GBG_MESSAGE_CAPACITY], prefix[GBG_MESSAGE_CAPACITY];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(prefix, sizeof prefix, format, arguments);
    va_end(arguments);
    memcpy(old, message, sizeof old);
    int written = snprintf(message, GBG_MESSAGE_CAPACITY, "%s: ", prefix);
    if (written >= 0 && written < GBG_MESSAGE_CAPACITY) {
        snprintf(message + written, (size_t)(GBG_MESSAGE_CAPACITY - written), "%s", old);
    }
}

void gbg_log(struct gbg_context *context, int level, const char *format, ...)
{
    if (!context || !context->sink) {
        return;
    }
    char line[GBG_MESSAGE_CAPACITY];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    context->sink(context->sink_user, level, line);
}

const char *gbg_message_of(const struct gbg_context *context)
{
    return context ? context->message : orphan_message;
}
