/* Side room io: restart files. Layout, in the byte order of the machine, without gaps:
 *   struct head | id[n] int64 | species[n] int32 | fraction[n] uint64 an axis |
 *   image[n] int32 an axis, if any | SHA-256 of everything before, 32 bytes. */
#include "io/restart.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/file.h"
#include "core/memory.h"
#include "core/sha256.h"
#include "engine/view.h"

enum { VERSION = 1, DIGEST_BYTES = 32, DIGITS = 64, TEMPORARY_BYTES = GBG_PATH_CAPACITY + 64 };
static const uint32_t order_mark = 0x01020304;

struct head {
    char magic[8];
    uint32_t order, version;
    char digest[DIGITS];
    int64_t n;
    int32_t dimension, n_species, has_images, unused;
    uint64_t step;
    double time, length[3], origin[3];
    char name[GBG_MAX_SPECIES][GBG_NAME_CAPACITY];
};
_Static_assert(sizeof(struct head) == 8 + 8 + 64 + 8 + 16 + 16 + 48 + 320,
               "the head of a restart file has no gaps");

/* A file being read or written from the start to the end, with its hash. */
struct stream {
    struct gbg_context *context;
    const char *path;
    int descriptor;
    int64_t at;
    struct gbg_sha256 hash;
};

static int fail(const struct stream *stream, const char *what, int number)
{
    char text[GBG_ERROR_TEXT];
    return gbg_fail(stream->context, GBG_E_FILE, "%s: cannot %s it: %s", stream->path, what,
                    gbg_file_error(number, text));
}

static int put(struct stream *stream, const void *data, size_t bytes)
{
    int number = gbg_file_write(stream->descriptor, data, bytes, stream->at);
    gbg_sha256_add(&stream->hash, data, bytes);
    stream->at += (int64_t)bytes;
    return number ? fail(stream, "write", number) : GBG_OK;
}

static int get(struct stream *stream, void *data, int64_t count, size_t size)
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

static void fill_head(struct head *head, const struct gbg_engine_view *view)
{
    char digest[DIGITS + 1];
    const struct gbg_scene *scene = view->scene;
    memset(head, 0, sizeof *head);
    memcpy(head->magic, GBG_RESTART_MAGIC, sizeof head->magic);
    head->order = order_mark;
    head->version = VERSION;
    gbg_scene_digest(scene, digest);
    memcpy(head->digest, digest, DIGITS);
    head->n = view->n;
    head->dimension = view->box.dimension;
    head->n_species = scene->n_species;
    head->has_images = view->has_images;
    head->step = view->step;
    head->time = view->time;
    for (int a = 0; a < view->box.dimension; a++) {
        head->length[a] = view->box.length[a];
        head->origin[a] = view->box.origin[a];
    }
    for (int s = 0; s < scene->n_species; s++) {
        snprintf(head->name[s], GBG_NAME_CAPACITY, "%s", scene->species[s].name);
    }
}

/* What the engine hands over goes through one buffer of n 64-bit words. */
static int put_state(struct stream *stream, struct gbg_engine *engine,
                     const struct gbg_engine_view *view, void *buffer)
{
    size_t n = (size_t)view->n;
    int status = put(stream, view->id, n * sizeof *view->id);
    if (status == GBG_OK) {
        status = put(stream, view->species, n * sizeof *view->species);
    }
    for (int a = 0; a < view->box.dimension && status == GBG_OK; a++) {
        status = gbg_engine_copy_fractions(engine, a, buffer);
        if (status == GBG_OK) {
            status = put(stream, buffer, n * sizeof(uint64_t));
        }
    }
    for (int a = 0; a < view->box.dimension && view->has_images && status == GBG_OK; a++) {
        status = gbg_engine_copy_images(engine, a, buffer);
        if (status == GBG_OK) {
            status = put(stream, buffer, n * sizeof(int32_t));
        }
    }
    return status;
}

static int put_all(struct stream *stream, struct gbg_engine *engine,
                   const struct gbg_engine_view *view)
{
    struct head head;
    void *buffer;
    unsigned char digest[DIGEST_BYTES];
    int status = gbg_allocate(view->context, &buffer, view->n, sizeof(uint64_t),
                              "a copy of the coordinates");
    if (status != GBG_OK) {
        return status;
    }
    fill_head(&head, view);
    gbg_sha256_start(&stream->hash);
    status = put(stream, &head, sizeof head);
    if (status == GBG_OK) {
        status = put_state(stream, engine, view, buffer);
    }
    gbg_release(buffer);
    if (status == GBG_OK) {
        struct gbg_sha256 hash = stream->hash;
        gbg_sha256_finish(&hash, digest);
        status = put(stream, digest, sizeof digest);
    }
    return status;
}

int gbg_restart_save(struct gbg_engine *engine, const char *path)
{
    struct gbg_engine_view view;
    char temporary[TEMPORARY_BYTES];
    gbg_engine_look(engine, &view);
    int status = gbg_file_temporary(view.context, path, temporary, sizeof temporary);
    if (status != GBG_OK) {
        return status;
    }
    struct stream stream = {.context = view.context, .path = path};
    stream.descriptor = open(temporary, O_WRONLY | O_CLOEXEC);
    if (stream.descriptor < 0) {
        status = fail(&stream, "write", errno);
    } else {
        status = put_all(&stream, engine, &view);
        if (close(stream.descriptor) != 0 && status == GBG_OK) {
            status = fail(&stream, "write", errno);
        }
    }
    if (status == GBG_OK) {
        status = gbg_file_commit_keeping(view.context, temporary, path);
    }
    if (status != GBG_OK) {
        gbg_file_abandon(temporary);
    }
    return status;
}

/* Every refusal of a damaged file ends with where an older one is. */
static int damaged(const struct stream *stream, const char *check)
{
    char previous[GBG_PATH_CAPACITY + 16];
    snprintf(previous, sizeof previous, "%s.previous", stream->path);
    int exists = access(previous, F_OK) == 0;
    return gbg_fail(stream->context, GBG_E_FORMAT, "%s: %s%s%s%s", stream->path, check,
                    exists ? "; the file before it is still there: " : "", exists ? previous : "",
                    exists ? " (rename it to use it)" : "");
}

static int64_t bytes_a_particle(const struct head *head)
{
    int64_t axis = (int64_t)sizeof(uint64_t) + (head->has_images ? (int64_t)sizeof(int32_t) : 0);
    return (int64_t)(sizeof(int64_t) + sizeof(int32_t)) + head->dimension * axis;
}

static int names_are_closed(const struct head *head)
{
    for (int s = 0; s < head->n_species; s++) {
        if (!memchr(head->name[s], 0, GBG_NAME_CAPACITY)) {
            return 0;
        }
    }
    return 1;
}

static int check_head(const struct stream *stream, const struct head *head, int64_t size)
{
    if (memcmp(head->magic, GBG_RESTART_MAGIC, sizeof head->magic) != 0) {
        return damaged(stream, "it is no restart file of gamboge (its first bytes differ)");
    }
    if (head->order != order_mark) {
        return damaged(stream, "its byte-order mark is not that of this machine");
    }
    if (head->version != VERSION) {
        return damaged(stream, "its version is none that this program knows");
    }
    if ((head->dimension != 2 && head->dimension != 3) || head->n < 0 || head->n_species < 0 ||
        head->n_species > GBG_MAX_SPECIES || (head->has_images & ~1) || !names_are_closed(head)) {
        return damaged(stream, "it is damaged: its head holds impossible sizes");
    }
    int64_t body = size - (int64_t)sizeof *head - DIGEST_BYTES, each = bytes_a_particle(head);
    if (body < 0 || head->n != body / each || body % each != 0) {
        return damaged(stream, "it is damaged: its length does not fit its number of particles");
    }
    return GBG_OK;
}

static void take_head(struct gbg_restart *restart, const struct head *head)
{
    memcpy(restart->digest, head->digest, DIGITS);
    restart->digest[DIGITS] = 0;
    restart->n = head->n;
    restart->dimension = head->dimension;
    restart->n_species = head->n_species;
    restart->has_images = head->has_images;
    restart->step = head->step;
    restart->time = head->time;
    memcpy(restart->length, head->length, sizeof restart->length);
    memcpy(restart->origin, head->origin, sizeof restart->origin);
    memcpy(restart->name, head->name, sizeof restart->name);
}

static int get_array(struct stream *stream, void **array, int64_t n, size_t size, const char *what)
{
    int status = gbg_allocate(stream->context, array, n, size, what);
    return status == GBG_OK ? get(stream, *array, n, size) : status;
}

static int get_arrays(struct stream *stream, struct gbg_restart *restart)
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

static int check_hash(struct stream *stream)
{
    unsigned char expected[DIGEST_BYTES], stored[DIGEST_BYTES];
    struct gbg_sha256 hash = stream->hash;
    gbg_sha256_finish(&hash, expected);
    int status = get(stream, stored, 1, sizeof stored);
    if (status == GBG_OK && memcmp(expected, stored, sizeof stored) != 0) {
        status = damaged(stream, "it is damaged: its SHA-256 is not that of its content");
    }
    return status;
}

static int get_all(struct stream *stream, struct gbg_restart *restart)
{
    struct head head;
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
        status = get_arrays(stream, restart);
    }
    return status == GBG_OK ? check_hash(stream) : status;
}

int gbg_restart_read(struct gbg_context *context, const char *path, struct gbg_restart *restart)
{
    struct stream stream = {.context = context, .path = path};
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

static int check_engine(const struct gbg_restart *restart, const struct gbg_engine_view *view,
                        const char *path)
{
    char digest[DIGITS + 1];
    gbg_scene_digest(view->scene, digest);
    if (restart->n != view->n || restart->dimension != view->box.dimension) {
        return gbg_fail(view->context, GBG_E_FORMAT, "%s: it holds %" PRId64 " particles in %d "
                        "dimensions, the engine %" PRId64 " in %d", path, restart->n,
                        restart->dimension, view->n, view->box.dimension);
    }
    if (strcmp(restart->digest, digest) != 0) {
        return gbg_fail(view->context, GBG_E_FORMAT, "%s: it belongs to another scene (digest "
                        "%.12s..., this scene has %.12s...)", path, restart->digest, digest);
    }
    for (int64_t i = 0; i < view->n; i++) {
        if (restart->id[i] != view->id[i] || restart->species[i] != view->species[i]) {
            return gbg_fail(view->context, GBG_E_FORMAT, "%s: its particles are not those of the "
                            "engine: number %" PRId64 " has id %" PRId64 " and species %d there, "
                            "%" PRId64 " and %d here", path, i, restart->id[i],
                            (int)restart->species[i] + 1, view->id[i], (int)view->species[i] + 1);
        }
    }
    if (view->has_images && !restart->has_images) {
        return gbg_fail(view->context, GBG_E_FORMAT, "%s: it holds no image counts, and the scene "
                        "asks for them (output.unwrapped)", path);
    }
    return GBG_OK;
}

int gbg_restart_load(struct gbg_engine *engine, const char *path)
{
    struct gbg_engine_view view;
    struct gbg_restart restart;
    gbg_engine_look(engine, &view);
    int status = gbg_restart_read(view.context, path, &restart);
    if (status == GBG_OK) {
        status = check_engine(&restart, &view, path);
    }
    if (status == GBG_OK) {
        status = gbg_engine_restore(engine, restart.step,
                                    (const uint64_t *const *)restart.fraction,
                                    view.has_images ? (const int32_t *const *)restart.image : NULL);
    }
    gbg_restart_release(&restart);
    return status;
}
