/* L0: output files that are complete or absent: temporary name, sync, rename. */
#ifndef GBG_CORE_FILE_H
#define GBG_CORE_FILE_H

#include <stddef.h>
#include <stdint.h>

/* Hidden from users, shared between our own libraries. */
#pragma GCC visibility push(default)

struct gbg_context;

enum { GBG_ERROR_TEXT = 128 };

/* Makes an empty file with a new name beside `path` and puts that name in `temporary`. Fails with
 * GBG_E_FILE when the directory cannot be written, or when something is at `path` that must not be
 * replaced: not a regular file, or write protected. Rights are those of any new file. */
int gbg_file_temporary(struct gbg_context *context, const char *path, char *temporary,
                       size_t capacity);

/* Brings the content to the disc and gives the file its final name, replacing what was there; the
 * new name is on the disc when the call returns 0. A symbolic link at `path` is replaced, not
 * followed. When it fails the temporary file is still there and `path` untouched, except that the
 * last act, syncing the directory, can only fail after both. */
int gbg_file_commit(struct gbg_context *context, const char *temporary, const char *path);

/* The same, and what was at `path` stays as PATH.previous. At every instant one of the two names
 * holds a complete file. */
int gbg_file_commit_keeping(struct gbg_context *context, const char *temporary, const char *path);

/* Removes a temporary file that will not be finished; "" is allowed. Keeps errno. */
void gbg_file_abandon(const char *temporary);

/* Writes all bytes at an offset: 0, or the errno of the write that failed. */
int gbg_file_write(int descriptor, const void *data, size_t bytes, int64_t offset);
/* Reads all bytes at an offset: 0, the errno, or -1 when the file ends before. */
int gbg_file_read(int descriptor, void *data, size_t bytes, int64_t offset);

/* netCDF and the HDF5 below it keep tables without locks: whoever calls them holds this lock, in
 * every library of ours. */
void gbg_file_netcdf_lock(void);
void gbg_file_netcdf_unlock(void);

/* The system's text of an errno, safe in threads; returns `text`. */
const char *gbg_file_error(int number, char text[GBG_ERROR_TEXT]);

#pragma GCC visibility pop

#endif
