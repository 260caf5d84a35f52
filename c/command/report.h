/* Command: the summary of a run as JSON. */
#ifndef GBG_COMMAND_REPORT_H
#define GBG_COMMAND_REPORT_H

#include "command/session.h"

/* What a run knows beside its engine. */
struct gbg_run_report {
    const struct gbg_session *session;
    const char *scene; /* path */
    int64_t first, last;
    double seconds; /* on the clock */
};

/* Puts one JSON object into `path`, whole or not at all: GBG_EXIT_DONE or an exit status after a
 * complaint. Figures that could not be measured are null. */
int gbg_report_write(const struct gbg_run_report *report, const char *path);

#endif
