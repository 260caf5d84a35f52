/* Prints docs/errors.md from the list in include/gamboge/status.h. */
#include <stdio.h>

#include "gamboge/status.h"

#define ROW(name, value, meaning, remedy) {#name, value, meaning, remedy},

static const struct {
    const char *name;
    int value;
    const char *meaning, *remedy;
} rows[] = {GBG_STATUS_LIST(ROW)};

int main(void)
{
    puts("# Statuses\n\n"
         "Every call returns one of these. Zero: done. Positive: the call was refused and every\n"
         "object is as it was before. Negative: the object is spent; destroy it. The sentence for\n"
         "the case at hand is `gbg_message(context)`: what was wrong, the value given, the range\n"
         "allowed, the call. The program `gamboge` prints that sentence and ends with 1 (the run,\n"
         "the check, memory or the GPU failed, or this build or this machine has not what was\n"
         "asked for) or 2 (bad use or a bad scene).\n\n"
         "Made from `GBG_STATUS_LIST` by `tests/docs/errors.c`; a test compares the two.\n\n"
         "| status | value | what it means | what to do |\n"
         "|---|---|---|---|");
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        printf("| `%s` | %d | %s | %s |\n", rows[k].name, rows[k].value, rows[k].meaning,
               rows[k].remedy);
    }
    return 0;
}
