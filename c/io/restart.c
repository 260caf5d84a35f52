/* Side room io: restart files: saving and loading the state of an engine. */
#include "io/restart.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "core/file.h"
#include "core/memory.h"
#include "engine/view.h"
#include "io/restart_layout.h"

enum { TEMPORARY_BYTES = GBG_PATH_CAPACITY + 64 };

static int fail(const struct gbg_restart_stream *stream, int number)
{
    char text[GBG_ERROR_TEXT];
    return gbg_fail(stream->context, GBG_E_FILE, "%s: cannot write it: %s", stream->path,
                    gbg_file_error(number, text));
}

static int put(struct gbg_restart_stream *stream, const void *data, size_t bytes)
{
    int number = gbg_file_write(stream->descriptor, data, bytes, stream->at);
    gbg_sha256_add(&stream->hash, data, bytes);
    stream->at += (int64_t)bytes;
    return number ? fail(stream, number) : GBG_OK;
}

static void fill_head(struct gbg_restart_head *head, const struct gbg_engine_view *view)
{
    char digest[GBG_RESTART_DIGITS + 1];
    const struct gbg_scene *scene = view->scene;
    memset(head, 0, sizeof *head);
    memcpy(head->magic, GBG_RESTART_MAGIC, sizeof head->magic);
    head->order = GBG_RESTART_ORDER;
    head->version = GBG_RESTART_VERSION;
    gbg_scene_digest(scene, digest);
    memcpy(head->digest, digest, GBG_RESTART_DIGITS);
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
static int put_state(struct gbg_restart_stream *stream, struct gbg_engine *engine,
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

static int put_all(struct gbg_restart_stream *stream, struct gbg_engine *engine,
                   const struct gbg_engine_view *view)
{
    struct gbg_restart_head head;
    void *buffer;
    unsigned char digest[GBG_RESTART_HASH_BYTES];
    int status = gbg_allocate(view->context, &buffer, view->n, sizeof(uint64_t),
                              "a copy of the coordinates");
    if (status != GBG_OK) {
        return status;
    }
    fill_head(&head, view);
    struct gbg_sum_state sums[GBG_MAX_FORCES] = {0};
    head.n_sums = gbg_engine_copy_sums(engine, sums);
    gbg_sha256_start(&stream->hash);
    status = put(stream, &head, sizeof head);
    if (status == GBG_OK && head.n_sums > 0) {
        status = put(stream, sums, (size_t)head.n_sums * sizeof *sums);
    }
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

int gbg_restart_save(struct gbg_engine *engine, const struct gbg_engine_view *view,
                     const char *path)
{
    char temporary[TEMPORARY_BYTES];
    int status = gbg_file_temporary(view->context, path, temporary, sizeof temporary);
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_restart_stream stream = {.context = view->context, .path = path};
    stream.descriptor = open(temporary, O_WRONLY | O_CLOEXEC);
    if (stream.descriptor < 0) {
        status = fail(&stream, errno);
    } else {
        status = put_all(&stream, engine, view);
        if (close(stream.descriptor) != 0 && status == GBG_OK) {
            status = fail(&stream, errno);
        }
    }
    if (status == GBG_OK) {
        status = gbg_file_commit_keeping(view->context, temporary, path);
    }
    if (status != GBG_OK) {
        gbg_file_abandon(temporary);
    }
    return status;
}

static int check_engine(const struct gbg_restart *restart, const struct gbg_engine_view *view,
                        const char *path)
{
    char digest[GBG_RESTART_DIGITS + 1];
    gbg_scene_digest(view->scene, digest);
    if (restart->n != view->n || restart->dimension != view->box.dimension) {
        return gbg_fail(view->context, GBG_E_FORMAT,
                        "%s: it holds %" PRId64 " particles in %d "
                        "dimensions, the engine %" PRId64 " in %d",
                        path, restart->n, restart->dimension, view->n, view->box.dimension);
    }
    if (strcmp(restart->digest, digest) != 0) {
        return gbg_fail(view->context, GBG_E_FORMAT,
                        "%s: it belongs to another scene (digest "
                        "%.12s..., this scene has %.12s...)",
                        path, restart->digest, digest);
    }
    for (int64_t i = 0; i < view->n; i++) {
        if (restart->id[i] != view->id[i] || restart->species[i] != view->species[i]) {
            return gbg_fail(view->context, GBG_E_FORMAT,
                            "%s: its particles are not those of the "
                            "engine: number %" PRId64 " has id %" PRId64 " and species %d there, "
                            "%" PRId64 " and %d here",
                            path, i, restart->id[i], (int)restart->species[i] + 1, view->id[i],
                            (int)view->species[i] + 1);
        }
    }
    if (view->has_images && !restart->has_images) {
        return gbg_fail(view->context, GBG_E_FORMAT,
                        "%s: it holds no image counts, and the scene "
                        "asks for them (output.trajectory.unwrapped)",
                        path);
    }
    return GBG_OK;
}

int gbg_restart_load(struct gbg_engine *engine, const struct gbg_engine_view *view,
                     const char *path)
{
    struct gbg_restart restart;
    int status = gbg_restart_read(view->context, path, &restart);
    if (status == GBG_OK) {
        status = check_engine(&restart, view, path);
    }
    if (status == GBG_OK) {
        status = gbg_engine_restore_sums(engine, restart.n_sums, restart.sum);
        if (status == GBG_E_FORMAT) {
            gbg_message_prefix(view->context, "%s", path);
        }
    }
    if (status == GBG_OK) {
        status =
            gbg_engine_restore(engine, restart.step, (const uint64_t *const *)restart.fraction,
                               view->has_images ? (const int32_t *const *)restart.image : NULL);
    }
    gbg_restart_release(&restart);
    return status;
}
