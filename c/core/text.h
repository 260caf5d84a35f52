/* L0: names: compare them, and find the nearest one for a message. */
#ifndef GBG_CORE_TEXT_H
#define GBG_CORE_TEXT_H

#include <stddef.h>

/* Hidden from users, shared between our own libraries. */
#pragma GCC visibility push(default)

/* Edit distance of two names (insert, delete, replace, each 1), for names below 64 letters. */
int gbg_text_distance(const char *a, const char *b);

/* The entry of a NULL-terminated list that is nearest to name; never NULL for a non-empty list. */
const char *gbg_text_nearest(const char *name, const char *const *list);

/* Index of name in a NULL-terminated list, -1 if it is not there. */
int gbg_text_find(const char *name, const char *const *list);

/* Copies text to a buffer of `capacity` bytes: 1 if it fitted with its zero, else 0 (cut). */
int gbg_text_copy(char *to, size_t capacity, const char *text);

#pragma GCC visibility pop

#endif
