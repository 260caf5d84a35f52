/* Transforms by FFTW: which plans were the fastest, kept for the process and, in a file for each
 * precision and instruction set, for the user. What goes wrong with the file is nobody's trouble:
 * the trial is made again. FFTW's own wisdom, which others in the process may use, is left as it
 * was. */
#include "fft/body.h"

#include <fcntl.h>
#include <fftw3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/context.h"

enum { PATH_BYTES = 4096, MOST_BYTES = 1 << 24 };

/* Guarded by the planner's lock: what this process knows, "" once the file has been looked for. */
static char *known[2];

/* The file, its folders made; 0: there is no place for it. */
static int path_of(const struct gbg_context *context, int single, char path[PATH_BYTES])
{
    const char *cache = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    char folder[PATH_BYTES];
    int length;
    if (cache && cache[0] == '/') {
        length = snprintf(folder, sizeof folder, "%s", cache);
    } else if (home && home[0] == '/') {
        length = snprintf(folder, sizeof folder, "%s/.cache", home);
    } else {
        return 0;
    }
    if (length >= PATH_BYTES - 256) {
        return 0;
    }
    mkdir(folder, 0700);
    strcat(folder, "/gamboge");
    mkdir(folder, 0700);
    length =
        snprintf(path, PATH_BYTES, "%s/fftw-%s-%s.wisdom", folder,
                 context && context->host[0] ? context->host : "any", single ? "single" : "double");
    return length < PATH_BYTES;
}

/* The text of a file, to be freed; NULL: none. */
static char *read_file(const char *path)
{
    struct stat status;
    char *text = NULL;
    int descriptor = open(path, O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) {
        return NULL;
    }
    if (fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode) && status.st_size < MOST_BYTES) {
        text = malloc((size_t)status.st_size + 1);
        ssize_t got = text ? read(descriptor, text, (size_t)status.st_size) : -1;
        if (text) {
            text[got > 0 ? got : 0] = '\0';
        }
    }
    close(descriptor);
    return text;
}

static void write_file(const char *path, const char *text)
{
    char temporary[PATH_BYTES + 8];
    snprintf(temporary, sizeof temporary, "%s.XXXXXX", path);
    int descriptor = mkstemp(temporary);
    if (descriptor < 0) {
        return;
    }
    size_t bytes = strlen(text);
    int good = write(descriptor, text, bytes) == (ssize_t)bytes;
    good = close(descriptor) == 0 && good;
    if (!good || rename(temporary, path) != 0) {
        unlink(temporary);
    }
}

static void learn_known(const struct gbg_context *context,
                        const struct gbg_fft_precision *precision, int single)
{
    char path[PATH_BYTES];
    if (!known[single]) {
        char *text = path_of(context, single, path) ? read_file(path) : NULL;
        known[single] = text ? text : calloc(1, 1);
    }
    if (known[single] && known[single][0]) {
        precision->learn(known[single]);
    }
}

static void keep(const struct gbg_context *context, const struct gbg_fft_precision *precision,
                 int single)
{
    char path[PATH_BYTES], *text = precision->wisdom();
    if (text) {
        free(known[single]);
        known[single] = text;
        if (path_of(context, single, path)) {
            write_file(path, text);
        }
    }
}

/* FFTW without wisdom; returns what it had. */
static char *clear(const struct gbg_fft_precision *precision)
{
    char *before = precision->wisdom();
    precision->unlearn();
    return before;
}

static void restore(const struct gbg_fft_precision *precision, char *before)
{
    precision->unlearn();
    if (before) {
        precision->learn(before);
    }
    free(before);
}

int gbg_fft_plan_wisely(const struct gbg_context *context,
                        const struct gbg_fft_precision *precision, struct gbg_fft_plan *plan)
{
    char *before = clear(precision);
    learn_known(context, precision, plan->single);
    int missing = precision->plan(plan, FFTW_MEASURE | FFTW_WISDOM_ONLY);
    if (missing) {
        precision->forget(plan);
        missing = precision->plan(plan, FFTW_MEASURE);
        if (!missing) {
            keep(context, precision, plan->single);
        }
    }
    restore(precision, before);
    return missing;
}

int gbg_fft_plan_quickly(const struct gbg_fft_precision *precision, struct gbg_fft_plan *plan)
{
    char *before = clear(precision);
    int missing = precision->plan(plan, FFTW_ESTIMATE);
    restore(precision, before);
    return missing;
}
