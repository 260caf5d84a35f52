/* Command: how far a long job is: a bar with the time left on a terminal, plain lines otherwise. */
#include "command/progress.h"

#include <time.h>
#include <unistd.h>

#include "command/command.h"

enum { BAR_CELLS = 30 };

double gbg_clock(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void gbg_progress_start(struct gbg_progress *progress, const char *unit, int64_t first,
                        int64_t last, int quiet)
{
    *progress = (struct gbg_progress){.unit = unit,
                                      .first = first,
                                      .last = last,
                                      .quiet = quiet,
                                      .terminal = isatty(STDERR_FILENO),
                                      .started = gbg_clock()};
    progress->shown = progress->started;
}

static void draw_bar(const struct gbg_progress *progress, int64_t now, double part, double left)
{
    char bar[BAR_CELLS + 1];
    for (int i = 0; i < BAR_CELLS; i++) {
        bar[i] = i < (int)(part * BAR_CELLS) ? '#' : '.';
    }
    bar[BAR_CELLS] = 0;
    fprintf(stderr, "\r[%s] %3.0f %%  %s %lld of %lld, %s left  ", bar, 100 * part, progress->unit,
            (long long)now, (long long)progress->last, gbg_duration_text(left));
    fflush(stderr);
}

void gbg_progress_show(struct gbg_progress *progress, int64_t now)
{
    int64_t whole = progress->last - progress->first;
    if (progress->quiet || whole <= 0) {
        return;
    }
    double part = (double)(now - progress->first) / (double)whole;
    double clock = gbg_clock();
    double left = part > 0 ? (clock - progress->started) * (1 - part) / part : 0;
    if (progress->terminal && clock - progress->shown > 0.1) {
        progress->shown = clock;
        draw_bar(progress, now, part, left);
    } else if (!progress->terminal && (int)(10 * part) > progress->tenths &&
               clock - progress->shown > 1) {
        progress->shown = clock;
        progress->tenths = (int)(10 * part);
        printf("%s %lld of %lld, %.0f %%, %s left\n", progress->unit, (long long)now,
               (long long)progress->last, 100 * part, gbg_duration_text(left));
        fflush(stdout);
    }
}

void gbg_progress_end(struct gbg_progress *progress)
{
    if (!progress->quiet && progress->terminal && progress->shown > progress->started) {
        fprintf(stderr, "\r%*s\r", BAR_CELLS + 60, "");
        fflush(stderr);
    }
}
