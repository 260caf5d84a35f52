/* Side room io: restart files: reading and checking. */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/file.h"
#include "core/memory.h"
#include "io/restart.h"
#include "io/restart_layout.h"

static int fail(const struct gbg_restart_stream *stream, const char *what, int number)
{
    char text[GBG_ERROR_TEXT];
    return gbg_fail(stream->context, GBG_E_FILE, "%s: cannot %s it: %s", stream->path, what,
                    gbg_file_error(number, text));
}

static int get(struct gbg_restart_stream *stream, void *data, int64_t count, size_t size)
{
    size_t bytes = (size_t)count * size;
    int number = gbg_file_read(stream->descriptor, data, bytes, stream->at);
    if (number == 0) {
        gbg_sha256_add(&stream->hash, data, bytes);
        stream->at += (int64_t)bytes;
        return GBG_OK;
    }
    return fail(stream, "read", number > 0 ? number : EIO);
}

/* Every refusal of a damaged file ends with where an older one is. */
static int damaged(const struct gbg_restart_stream *stream, const char *check)
{
    char previous[GBG_PATH_CAPACITY + 16];
    snprintf(previous, sizeof previous, "%s.previous", stream->path);
    int exists = access(previous, F_OK) == 0;
    return gbg_fail(stream->context, GBG_E_FORMAT, "%s: %s%s%s%s", stream->path, check,
                    exists ? "; the file before it is still there: " : "", exists ? previous : "",
                    exists ? " (rename it to use it)" : "");
}

static int64_t bytes_a_particle(const struct gbg_restart_head *head)
{
    int64_t axis = (int64_t)sizeof(uint64_t) + (head->has_images ? (int64_t)sizeof(int32_t) : 0);
    return (int64_t)(sizeof(int64_t) + sizeof(int32_t)) + head->dimension * axis;
}

static int names_are_closed(const struct gbg_restart_head *head)
{
    for (int s = 0; s < head->n_species; s++) {
        if (!memchr(head->name[s], 0, GBG_NAME_CAPACITY)) {
            return 0;
        }
    }
    return 1;
}

static int check_head(const struct gbg_restart_stream *stream, const struct gbg_restart_head *head,
                      int64_t size)
{
    if (memcmp(head->magic, GBG_RESTART_MAGIC, sizeof head->magic) != 0) {
        return damaged(stream, "it is no restart file of gamboge (its first bytes differ)");
    }
    if (head->order != GBG_RESTART_ORDER) {
        return damaged(stream, "its byte-order mark is not that of this machine");
    }
    if (head->version != GBG_RESTART_VERSION) {
        return damaged(stream, "its version is none that this program knows");
    }
    if ((head->dimension != 2 && head->dimension != 3) || head->n < 0 || head->n_species < 0 ||
        head->n_species > GBG_MAX_SPECIES || (head->has_images & ~1) || head->n_sums < 0 ||
        head->n_sums > GBG_MAX_FORCES || !names_are_closed(head)) {
        return damaged(stream, "it is damaged: its head holds impossible sizes");
    }
    int64_t sums = (int64_t)sizeof(struct gbg_sum_state) * head->n_sums;
    int64_t body = size - (int64_t)sizeof *head - sums - GBG_RESTART_HASH_BYTES,
            each = bytes_a_particle(head);
    if (body < 0 || head->n != body / each || body % each != 0) {
        return damaged(stream, "it is damaged: its length does not fit its number of particles");
    }
    return GBG_OK;
}

static void take_head(struct gbg_restart *restart, const struct gbg_restart_head *head)
{
    memcpy(restart->digest, head->digest, GBG_RESTART_DIGITS);
    restart->digest[GBG_RESTART_DIGITS] = 0;
    restart->n = head->n;
    restart->dimension = head->dimension;
    restart->n_species = head->n_species;
    restart->has_images = head->has_images;
    restart->n_sums = head->n_sums;
    restart->step = head->step;
    restart->time = head->time;
    memcpy(restart->length, head->length, sizeof restart->length);
    memcpy(restart->origin, head->origin, sizeof restart->origin);
    memcpy(restart->name, head->name, sizeof restart->name);
}

static int get_array(struct gbg_restart_stream *stream, void **array, int64_t n, size_t size,
                     const char *what)
{
    int status = gbg_allocate(stream->context, array, n, size, what);
    return status == GBG_OK ? get(stream, *array, n, size) : status;
}

static int get_arrays(struct gbg_restart_stream *stream, struct gbg_restart *restart)
{
    void *memory;
    int status = get_array(stream, &memory, restart->n, sizeof *restart->id, "ids of a restart");
    restart->id = memory;
    if (status == GBG_OK) {
        status = get_array(stream, &memory, restart->n, sizeof *restart->species,
                           "species of a restart");
        restart->species = memory;
    }
    for (int a = 0; a < restart->dimension && status == GBG_OK; a++) {
        status = get_array(stream, &memory, restart->n, sizeof *restart->fraction[a],
                           "coordinates of a restart");
        restart->fraction[a] = memory;
    }
    for (int a = 0; a < restart->dimension && restart->has_images && status == GBG_OK; a++) {
        status = get_array(stream, &memory, restart->n, sizeof *restart->image[a],
                           "images of a restart");
        restart->image[a] = memory;
    }
    return status;
}

static int check_hash(struct gbg_restart_stream *stream)
{
    unsigned char expected[GBG_RESTART_HASH_BYTES], stored[GBG_RESTART_HASH_BYTES];
    struct gbg_sha256 hash = stream->hash;
    gbg_sha256_finish(&hash, expected);
    int status = get(stream, stored, 1, sizeof stored);
    if (status == GBG_OK && memcmp(expected, stored, sizeof stored) != 0) {
        status = damaged(stream, "it is damaged: its SHA-256 is not that of its content");
    }
    return status;
}

static int get_all(struct gbg_restart_stream *stream, struct gbg_restart *restart)
{
    struct gbg_restart_head head;
    struct stat about;
    gbg_sha256_start(&stream->hash);
    if (fstat(stream->descriptor, &about) != 0) {
        return fail(stream, "read", errno);
    }
    if (about.st_size < (off_t)sizeof head) {
        return damaged(stream, "it is no restart file of gamboge or cut short");
    }
    int status = get(stream, &head, 1, sizeof head);
    if (status == GBG_OK) {
        status = check_head(stream, &head, (int64_t)about.st_size);
    }
    if (status == GBG_OK) {
        take_head(restart, &head);
        status = get(stream, restart->sum, restart->n_sums, sizeof *restart->sum);
    }
    if (status == GBG_OK) {
        status = get_arrays(stream, restart);
    }
    return status == GBG_OK ? check_hash(stream) : status;
}

int gbg_restart_read(struct gbg_context *context, const char *path, struct gbg_restart *restart)
{
    struct gbg_restart_stream stream = {.context = context, .path = path};
    memset(restart, 0, sizeof *restart);
    stream.descriptor = open(path, O_RDONLY | O_CLOEXEC);
    if (stream.descriptor < 0) {
        return fail(&stream, "open", errno);
    }
    int status = get_all(&stream, restart);
    close(stream.descriptor);
    return status;
}

void gbg_restart_release(struct gbg_restart *restart)
{
    gbg_release(restart->id);
    gbg_release(restart->species);
    for (int a = 0; a < 3; a++) {
        gbg_release(restart->fraction[a]);
        gbg_release(restart->image[a]);
    }
    memset(restart, 0, sizeof *restart);
}
