/* Command: how far a long job is: a bar with the time left on a terminal, plain lines otherwise. */
#ifndef GBG_COMMAND_PROGRESS_H
#define GBG_COMMAND_PROGRESS_H

#include <stdint.h>

struct gbg_progress {
    const char *unit; /* "step", "frame" */
    int64_t first, last;
    int quiet, terminal;
    double started, shown; /* seconds of a steady clock */
    int tenths;            /* plain lines printed */
};

double gbg_clock(void);
void gbg_progress_start(struct gbg_progress *progress, const char *unit, int64_t first,
                        int64_t last, int quiet);
void gbg_progress_show(struct gbg_progress *progress, int64_t now);
/* Takes the bar away, so that what follows starts on a clean line. */
void gbg_progress_end(struct gbg_progress *progress);

#endif
