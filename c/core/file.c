/* L0: output files that are complete or absent. */
#include "core/file.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/context.h"

_Static_assert(sizeof(off_t) == 8, "files beyond 2 GiB need a 64-bit off_t");

enum { NAME_TRIES = 1000, PATH_BYTES = 4096 };

static pthread_mutex_t netcdf_mutex = PTHREAD_MUTEX_INITIALIZER;

void gbg_file_netcdf_lock(void)
{
    pthread_mutex_lock(&netcdf_mutex);
}

void gbg_file_netcdf_unlock(void)
{
    pthread_mutex_unlock(&netcdf_mutex);
}

const char *gbg_file_error(int number, char text[GBG_ERROR_TEXT])
{
    if (strerror_r(number, text, GBG_ERROR_TEXT) != 0) {
        snprintf(text, GBG_ERROR_TEXT, "error %d", number);
    }
    return text;
}

static int fail(struct gbg_context *context, const char *what, const char *path)
{
    char text[GBG_ERROR_TEXT];
    return gbg_fail(context, GBG_E_FILE, "cannot %s %s: %s", what, path,
                    gbg_file_error(errno, text));
}

static int check_target(struct gbg_context *context, const char *path)
{
    struct stat status;
    if (stat(path, &status) != 0) {
        return GBG_OK; /* nothing there; other troubles show when the file is made */
    }
    if (!S_ISREG(status.st_mode)) {
        return gbg_fail(context, GBG_E_FILE, "cannot write %s: it is there and not a regular file",
                        path);
    }
    return access(path, W_OK) == 0 ? GBG_OK : fail(context, "replace", path);
}

int gbg_file_temporary(struct gbg_context *context, const char *path, char *temporary,
                       size_t capacity)
{
    temporary[0] = 0;
    int status = check_target(context, path);
    for (int attempt = 0; status == GBG_OK && attempt < NAME_TRIES; attempt++) {
        int length =
            snprintf(temporary, capacity, "%s.%ld-%d.partial", path, (long)getpid(), attempt);
        if (length < 0 || (size_t)length >= capacity) {
            temporary[0] = 0;
            return gbg_fail(context, GBG_E_FILE, "the path %.80s... is longer than %zu bytes", path,
                            capacity);
        }
        int descriptor = open(temporary, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor >= 0) {
            close(descriptor);
            return GBG_OK;
        }
        if (errno != EEXIST) {
            break;
        }
    }
    if (status == GBG_OK) {
        status = fail(context, "make a file for", path);
    }
    temporary[0] = 0;
    return status;
}

static int sync_path(const char *path, int flags)
{
    int descriptor = open(path, flags | O_CLOEXEC);
    if (descriptor < 0) {
        return -1;
    }
    int failed = fsync(descriptor);
    int number = errno;
    close(descriptor);
    errno = number;
    return failed;
}

/* Some file systems cannot sync a directory and say EINVAL: then there is no more to be done. */
static int sync_directory_of(struct gbg_context *context, const char *path)
{
    char copy[PATH_BYTES];
    if (snprintf(copy, sizeof copy, "%s", path) >= (int)sizeof copy) {
        errno = ENAMETOOLONG;
        return fail(context, "sync the directory of", path);
    }
    if (sync_path(dirname(copy), O_RDONLY | O_DIRECTORY) != 0 && errno != EINVAL) {
        return fail(context, "sync the directory of", path);
    }
    return GBG_OK;
}

int gbg_file_commit(struct gbg_context *context, const char *temporary, const char *path)
{
    if (sync_path(temporary, O_RDWR) != 0) {
        return fail(context, "bring to the disc", temporary);
    }
    if (rename(temporary, path) != 0) {
        return fail(context, "give a finished file the name", path);
    }
    return sync_directory_of(context, path);
}

/* A second name first, so that `path` never lacks; file systems without hard links get a rename. */
static int keep_previous(struct gbg_context *context, const char *temporary, const char *path)
{
    char spare[PATH_BYTES], previous[PATH_BYTES];
    if (snprintf(spare, sizeof spare, "%s.old", temporary) >= (int)sizeof spare ||
        snprintf(previous, sizeof previous, "%s.previous", path) >= (int)sizeof previous) {
        errno = ENAMETOOLONG;
        return fail(context, "keep the former", path);
    }
    if (access(path, F_OK) != 0) {
        return GBG_OK;
    }
    if (link(path, spare) == 0) {
        if (rename(spare, previous) == 0) {
            return GBG_OK;
        }
        gbg_file_abandon(spare);
    } else if (rename(path, previous) == 0) {
        return GBG_OK;
    }
    return fail(context, "keep the former file as", previous);
}

int gbg_file_commit_keeping(struct gbg_context *context, const char *temporary, const char *path)
{
    if (sync_path(temporary, O_RDWR) != 0) {
        return fail(context, "bring to the disc", temporary);
    }
    int status = keep_previous(context, temporary, path);
    return status == GBG_OK ? gbg_file_commit(context, temporary, path) : status;
}

void gbg_file_abandon(const char *temporary)
{
    int number = errno;
    if (temporary[0]) {
        unlink(temporary);
    }
    errno = number;
}

int gbg_file_write(int descriptor, const void *data, size_t bytes, int64_t offset)
{
    const char *from = data;
    while (bytes > 0) {
        ssize_t done = pwrite(descriptor, from, bytes, (off_t)offset);
        if (done < 0 && errno != EINTR) {
            return errno;
        }
        if (done > 0) {
            from += done;
            offset += done;
            bytes -= (size_t)done;
        }
    }
    return 0;
}

int gbg_file_read(int descriptor, void *data, size_t bytes, int64_t offset)
{
    char *to = data;
    while (bytes > 0) {
        ssize_t done = pread(descriptor, to, bytes, (off_t)offset);
        if (done == 0) {
            return -1;
        }
        if (done < 0 && errno != EINTR) {
            return errno;
        }
        if (done > 0) {
            to += done;
            offset += done;
            bytes -= (size_t)done;
        }
    }
    return 0;
}
