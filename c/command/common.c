/* Command: messages, contexts, output names and numbers for people. */
#include <errno.h>
#include <libgen.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "command/command.h"
#include "core/context.h"

int gbg_complain(int exit_status, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    fflush(stdout);
    fputs("gamboge: ", stderr);
    vfprintf(stderr, format, list);
    fputc('\n', stderr);
    va_end(list);
    return exit_status;
}

int gbg_complain_library(int exit_status, const struct gbg_context *context)
{
    return gbg_complain(exit_status, "%s", gbg_message(context));
}

int gbg_exit_of(int status)
{
    int failed = status < 0 || status == GBG_E_MEMORY || status == GBG_E_UNBUILT;
    return failed ? GBG_EXIT_FAILED : status == GBG_OK ? GBG_EXIT_DONE : GBG_EXIT_USE;
}

const char *gbg_backend_text(const struct gbg_context *context)
{
    static char text[640];
    const char *name, *instructions;
    int threads;
    gbg_context_backend(context, &name, &instructions, &threads);
    if (context->card[0]) {
        snprintf(text, sizeof text, "%s:%d, %s, %s", name, context->device, context->card,
                 instructions);
    } else {
        snprintf(text, sizeof text, "%s, %s instructions, %d thread%s%s%s", name, instructions,
                 threads, threads == 1 ? "" : "s", context->choice[0] ? "; " : "", context->choice);
    }
    return text;
}

static void print_log(void *user, int level, const char *line)
{
    (void)user;
    if (level == GBG_LOG_WARNING) {
        fprintf(stderr, "gamboge: warning: %s\n", line);
    }
}

int gbg_open_context(const char *backend, int64_t threads, struct gbg_context **context)
{
    char text[GBG_TEXT_MOST];
    backend = backend ? backend : "auto";
    if (threads > 0) {
        snprintf(text, sizeof text, "%s:threads=%lld", backend, (long long)threads);
    } else {
        snprintf(text, sizeof text, "%s", backend);
    }
    int status = gbg_context_create(text, context);
    if (status != GBG_OK) {
        return gbg_complain_library(gbg_exit_of(status), NULL);
    }
    gbg_context_set_log(*context, print_log, NULL);
    return GBG_EXIT_DONE;
}

int gbg_has_suffix(const char *path, const char *suffix)
{
    size_t length = strlen(path), size = strlen(suffix);
    return length > size && strcasecmp(path + length - size, suffix) == 0;
}

const char *gbg_base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static int same_file(const char *path, const char *other)
{
    struct stat a, b;
    return stat(path, &a) == 0 && stat(other, &b) == 0 && a.st_dev == b.st_dev &&
           a.st_ino == b.st_ino;
}

int gbg_check_output(const char *path, const char *input)
{
    char folder[GBG_PATH_MOST];
    if (strlen(path) + 32 > sizeof folder) {
        return gbg_complain(GBG_EXIT_USE, "the output name of %zu letters is too long",
                            strlen(path));
    }
    struct stat about;
    if (stat(path, &about) == 0 && !S_ISREG(about.st_mode)) {
        return gbg_complain(GBG_EXIT_USE, "cannot write %s: it is not a plain file", path);
    }
    if (input && same_file(path, input)) {
        return gbg_complain(GBG_EXIT_USE, "the output %s is the input: give another --out", path);
    }
    strcpy(folder, path);
    const char *parent = dirname(folder);
    if (stat(parent, &about) != 0 || !S_ISDIR(about.st_mode)) {
        return gbg_complain(GBG_EXIT_USE, "cannot write %s: there is no folder %s", path, parent);
    }
    if (access(parent, W_OK | X_OK) != 0) {
        return gbg_complain(GBG_EXIT_USE, "cannot write %s: %s", path, strerror(errno));
    }
    return GBG_EXIT_DONE;
}

int gbg_partial_name(const char *path, char name[GBG_PATH_MOST])
{
    int size = snprintf(name, GBG_PATH_MOST, "%s.partial", path);
    if (size >= GBG_PATH_MOST) {
        return gbg_complain(GBG_EXIT_USE, "the output name of %zu letters is too long",
                            strlen(path));
    }
    return GBG_EXIT_DONE;
}

static char *next_text(void)
{
    static char texts[4][48];
    static int turn;
    turn = (turn + 1) % 4;
    return texts[turn];
}

const char *gbg_count_text(int64_t count)
{
    char digits[32], *text = next_text();
    int length = snprintf(digits, sizeof digits, "%lld", (long long)count);
    int at = 0;
    for (int i = 0; i < length; i++) {
        if (i > 0 && (length - i) % 3 == 0 && digits[i - 1] != '-') {
            text[at++] = ' ';
        }
        text[at++] = digits[i];
    }
    text[at] = 0;
    return text;
}

const char *gbg_duration_text(double seconds)
{
    char *text = next_text();
    if (seconds < 120) {
        snprintf(text, 48, seconds < 10 ? "%.2f s" : "%.0f s", seconds);
    } else if (seconds < 7200) {
        snprintf(text, 48, "%.0f min %02.0f s", (double)(long)(seconds / 60),
                 (double)((long)seconds % 60));
    } else {
        snprintf(text, 48, "%.0f h %02.0f min", (double)(long)(seconds / 3600),
                 (double)((long)(seconds / 60) % 60));
    }
    return text;
}

double gbg_core_size(int dimension, double diameter)
{
    return dimension == 2 ? GBG_PI / 4 * diameter * diameter
                          : GBG_PI / 6 * diameter * diameter * diameter;
}

/* Okabe and Ito's palette (2002), yellow late because it is faint on white, then three more. */
void gbg_palette(int index, double colour[3])
{
    static const unsigned char palette[GBG_MAX_SPECIES][3] = {
        {0, 114, 178}, {230, 159, 0},  {0, 158, 115},   {204, 121, 167}, {86, 180, 233},
        {213, 94, 0},  {240, 228, 66}, {120, 120, 120}, {102, 51, 0},    {40, 40, 40}};
    const unsigned char *entry = palette[index % GBG_MAX_SPECIES];
    for (int i = 0; i < 3; i++) {
        colour[i] = entry[i] / 255.0;
    }
}
