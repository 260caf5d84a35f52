/* Side room io: frames that are written while the engine goes on. The backend copies a state, and a
 * thread writes the copies, one after the other in the order in which they were begun. It calls
 * nothing of netCDF, the engine or the caller's context: its sentences go into a context of its
 * own. After a failure the frames behind are dropped until the caller has heard of it, so that the
 * file never lacks one in the middle. */
#include <pthread.h>
#include <signal.h>
#include <string.h>

#include "core/context.h"
#include "core/memory.h"
#include "core/view.h"
#include "engine/view.h"
#include "io/writer_body.h"

enum { SLOTS = 2 }; /* one being copied while the other is written */

struct gbg_later {
    struct gbg_writer *writer;
    pthread_t thread;
    pthread_mutex_t lock; /* for what follows, the writer's count of frames and its last step */
    pthread_cond_t changed;
    int64_t begun, finished; /* frames, written or dropped; the k-th is in slot k % SLOTS */
    int closing;
    int status; /* of the first failure that nobody has heard of */
    struct gbg_context said;
    struct gbg_stamp stamp[SLOTS]; /* a slot is the thread's from begun to finished */
    struct gbg_copy copy[SLOTS];
};

static int write_slot(struct gbg_later *later, int slot)
{
    struct gbg_writer *writer = later->writer;
    struct gbg_frame frame;
    writer->say = &later->said;
    const char *problem = gbg_copy_wait(&later->copy[slot], &frame);
    if (problem) {
        return gbg_fail(writer->say, GBG_E_DEVICE,
                        "%s: frame %lld is lost: %s (the frames before it are safe)", writer->path,
                        (long long)writer->size.frames, problem);
    }
    return gbg_writer_seal(writer, gbg_record_frame(writer, &later->stamp[slot], &frame));
}

/* With the lock held, which is open while the frame is written. */
static void serve(struct gbg_later *later)
{
    int slot = (int)(later->finished % SLOTS), status = later->status;
    if (status == GBG_OK) {
        pthread_mutex_unlock(&later->lock);
        status = write_slot(later, slot);
        pthread_mutex_lock(&later->lock);
        later->status = status;
        if (status == GBG_OK) {
            later->writer->size.frames++;
            later->writer->last_step = (double)later->stamp[slot].step;
        }
    }
    later->finished++;
    pthread_cond_broadcast(&later->changed);
}

static void *work(void *argument)
{
    struct gbg_later *later = argument;
    pthread_mutex_lock(&later->lock);
    while (!later->closing || later->finished < later->begun) {
        if (later->finished < later->begun) {
            serve(later);
        } else {
            pthread_cond_wait(&later->changed, &later->lock);
        }
    }
    pthread_mutex_unlock(&later->lock);
    return NULL;
}

/* Signals that the program waits for are for its own threads; faults are where they happen. */
static int start_thread(struct gbg_later *later)
{
    sigset_t all, former;
    sigfillset(&all);
    sigdelset(&all, SIGSEGV);
    sigdelset(&all, SIGBUS);
    sigdelset(&all, SIGFPE);
    sigdelset(&all, SIGILL);
    pthread_sigmask(SIG_SETMASK, &all, &former);
    int number = pthread_create(&later->thread, NULL, work, later);
    pthread_sigmask(SIG_SETMASK, &former, NULL);
    return number;
}

static int make(struct gbg_writer *writer)
{
    void *memory;
    int status = gbg_allocate_zero(writer->context, &memory, 1, sizeof *writer->later,
                                   "frames on their way to a file");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_later *later = memory;
    later->writer = writer;
    pthread_mutex_init(&later->lock, NULL);
    pthread_cond_init(&later->changed, NULL);
    if (start_thread(later) != 0) {
        pthread_cond_destroy(&later->changed);
        pthread_mutex_destroy(&later->lock);
        gbg_release(later);
        return gbg_fail(writer->context, GBG_E_MEMORY, "%s: no thread could be had", writer->path);
    }
    writer->later = later;
    return GBG_OK;
}

/* Until at most `most` are on their way, or none after a failure, which is handed over. */
static int wait_for(struct gbg_writer *writer, int64_t most)
{
    struct gbg_later *later = writer->later;
    if (!later) {
        return GBG_OK;
    }
    pthread_mutex_lock(&later->lock);
    while (later->begun - later->finished > (later->status ? 0 : most)) {
        pthread_cond_wait(&later->changed, &later->lock);
    }
    int status = later->status;
    later->status = GBG_OK;
    pthread_mutex_unlock(&later->lock);
    return status ? gbg_fail(writer->context, status, "%s", gbg_message_of(&later->said)) : GBG_OK;
}

int gbg_later_wait(struct gbg_writer *writer)
{
    return wait_for(writer, SLOTS - 1);
}

int gbg_later_settle(struct gbg_writer *writer)
{
    return wait_for(writer, 0);
}

int gbg_later_begin(struct gbg_writer *writer, struct gbg_engine *engine,
                    const struct gbg_stamp *stamp)
{
    int status = writer->later ? GBG_OK : make(writer);
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_later *later = writer->later;
    int slot = (int)(later->begun % SLOTS); /* only this thread changes it */
    status =
        gbg_engine_copy_begin(engine, writer->has_images, writer->has_overlap, &later->copy[slot]);
    if (status != GBG_OK) {
        return status;
    }
    later->stamp[slot] = *stamp;
    pthread_mutex_lock(&later->lock);
    later->begun++;
    pthread_cond_broadcast(&later->changed);
    pthread_mutex_unlock(&later->lock);
    return GBG_OK;
}

struct gbg_later_count gbg_later_count(const struct gbg_writer *writer)
{
    struct gbg_later *later = writer->later;
    if (!later) {
        return (struct gbg_later_count){writer->size.frames, writer->size.frames,
                                        writer->last_step};
    }
    pthread_mutex_lock(&later->lock);
    int64_t on_their_way = later->begun - later->finished;
    struct gbg_later_count count = {writer->size.frames, writer->size.frames + on_their_way,
                                    writer->last_step};
    if (on_their_way > 0) {
        count.last_step = (double)later->stamp[(later->begun - 1) % SLOTS].step;
    }
    pthread_mutex_unlock(&later->lock);
    return count;
}

void gbg_later_free(struct gbg_later *later)
{
    if (!later) {
        return;
    }
    pthread_mutex_lock(&later->lock);
    later->closing = 1;
    pthread_cond_broadcast(&later->changed);
    pthread_mutex_unlock(&later->lock);
    pthread_join(later->thread, NULL);
    for (int slot = 0; slot < SLOTS; slot++) {
        gbg_copy_release(&later->copy[slot]);
    }
    pthread_cond_destroy(&later->changed);
    pthread_mutex_destroy(&later->lock);
    gbg_release(later);
}
