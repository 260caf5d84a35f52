/* Public: every status a call can return, in one list. */
#ifndef GAMBOGE_STATUS_H
#define GAMBOGE_STATUS_H

#include "export.h"

#ifdef __cplusplus
extern "C" {
#endif

/* X(name, value, meaning, what to do).
 * 0: done. Positive: the call was refused and every object is as it was before the call.
 * Negative: the object that the call worked on is spent; destroy it. */
#define GBG_STATUS_LIST(X)                                                                         \
    X(GBG_OK, 0, "done", "nothing")                                                                \
    X(GBG_E_ARGUMENT, 1, "an argument is missing or outside its range",                            \
      "read the message: it names the argument, its value and the range")                          \
    X(GBG_E_NAME, 2, "no option, quantity or choice has this name",                                \
      "the message names the nearest one that exists")                                             \
    X(GBG_E_SCENE, 3, "the scene contradicts itself or lacks something",                           \
      "the message names the key; with a file also the line")                                      \
    X(GBG_E_FILE, 4, "a file cannot be opened, read or written", "check path, rights and space")   \
    X(GBG_E_FORMAT, 5, "a file was read but its content is not what it should be",                 \
      "the message names what was expected and where")                                             \
    X(GBG_E_UNBUILT, 6, "this build or this machine has no such component",                        \
      "the message names the CMake option that brings it, or what the machine lacks")              \
    X(GBG_E_MEMORY, 7, "memory could not be had", "the message names the bytes asked for")         \
    X(GBG_E_OVERLAP, 8, "hard cores overlap or particles coincide",                                \
      "the message names both ids and the distance")                                               \
    X(GBG_E_STEP, 9, "the time step is too large for this state",                                  \
      "take the dt that the message estimates; the state is that of the last good step")           \
    X(GBG_E_ORDER, 10, "the call is not allowed at this point", "the message says what comes first") \
    X(GBG_E_SPACE, 11, "the caller's array is too small", "the message names the size needed")     \
    X(GBG_E_INTERNAL, -1, "a defect in the library", "please report the message")                  \
    X(GBG_E_DEVICE, -2, "the GPU or its driver failed",                                            \
      "the message names the call and the error; what was written before is whole")

enum gbg_status {
#define GBG_STATUS_ENTRY(name, value, meaning, remedy) name = value,
    GBG_STATUS_LIST(GBG_STATUS_ENTRY)
#undef GBG_STATUS_ENTRY
};

/* Name of a status ("GBG_E_STEP") and its meaning; never NULL, static storage. */
GBG_API const char *gbg_status_name(int status);
GBG_API const char *gbg_status_text(int status);

#ifdef __cplusplus
}
#endif
#endif
