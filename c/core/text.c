/* L0: names. */
#include "core/text.h"

#include <string.h>

enum { LONGEST = 64 };

static int smallest(int a, int b, int c)
{
    int m = a < b ? a : b;
    return m < c ? m : c;
}

int gbg_text_distance(const char *a, const char *b)
{
    size_t rows = strlen(a), columns = strlen(b);
    if (rows >= LONGEST || columns >= LONGEST) {
        return LONGEST;
    }
    int row[LONGEST + 1];
    for (size_t j = 0; j <= columns; j++) {
        row[j] = (int)j;
    }
    for (size_t i = 1; i <= rows; i++) {
        int diagonal = row[0];
        row[0] = (int)i;
        for (size_t j = 1; j <= columns; j++) {
            int above = row[j];
            row[j] = smallest(above + 1, row[j - 1] + 1, diagonal + (a[i - 1] != b[j - 1]));
            diagonal = above;
        }
    }
    return row[columns];
}

const char *gbg_text_nearest(const char *name, const char *const *list)
{
    const char *best = NULL;
    int least = 2 * LONGEST;
    for (int i = 0; list[i]; i++) {
        int distance = gbg_text_distance(name, list[i]);
        if (distance < least) {
            least = distance;
            best = list[i];
        }
    }
    return best;
}

int gbg_text_find(const char *name, const char *const *list)
{
    for (int i = 0; list[i]; i++) {
        if (strcmp(name, list[i]) == 0) {
            return i;
        }
    }
    return -1;
}

int gbg_text_copy(char *to, size_t capacity, const char *text)
{
    if (capacity == 0) {
        return 0;
    }
    size_t length = strlen(text);
    size_t kept = length < capacity ? length : capacity - 1;
    memcpy(to, text, kept);
    to[kept] = 0;
    return length < capacity;
}
