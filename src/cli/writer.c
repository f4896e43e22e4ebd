#include "cli/writer.h"

#include "base/thread.h"

#include <pthread.h>

struct Writer {
    Outputs *out;
    pthread_t thread;
    /* shared, under the lock */
    pthread_mutex_t lock;
    pthread_cond_t changed;
    OutFrame frame;
    bool full;      /* there is a frame, waiting or being written */
    bool quit;
    bool broken;    /* err tells why */
    Err err;
};

static void *writer_run(void *context)
{
    Writer *w = context;
    thread_alone(); /* the pool is the tracker's */
    pthread_mutex_lock(&w->lock);
    for (;;) {
        while (!w->full && !w->quit) pthread_cond_wait(&w->changed, &w->lock);
        if (!w->full) break;
        pthread_mutex_unlock(&w->lock);
        bool good = outputs_add_frame(w->out, &w->frame, &w->err);
        outframe_free(&w->frame);
        pthread_mutex_lock(&w->lock);
        w->broken = !good;
        w->full = false;
        pthread_cond_signal(&w->changed);
    }
    pthread_mutex_unlock(&w->lock);
    return NULL;
}

Writer *writer_open(Outputs *out, Err *err)
{
    Writer *w = NEW0(Writer, 1);
    w->out = out;
    pthread_mutex_init(&w->lock, NULL);
    pthread_cond_init(&w->changed, NULL);
    if (pthread_create(&w->thread, NULL, writer_run, w) == 0) return w;
    fail(err, ERR_RESOURCE, "no thread could be had to write frames");
    mem_free(w);
    return NULL;
}

/* Waits until the last frame is written. The lock is held. */
static bool wait_written(Writer *w, Err *err)
{
    while (w->full) pthread_cond_wait(&w->changed, &w->lock);
    if (!w->broken) return true;
    *err = w->err;
    return false;
}

bool writer_wait(Writer *w, Err *err)
{
    pthread_mutex_lock(&w->lock);
    bool good = wait_written(w, err);
    pthread_mutex_unlock(&w->lock);
    return good;
}

void writer_give(Writer *w, OutFrame *f)
{
    pthread_mutex_lock(&w->lock);
    ASSERT(!w->full && !w->broken);
    w->frame = *f;
    w->full = true;
    *f = (OutFrame){0};
    pthread_cond_signal(&w->changed);
    pthread_mutex_unlock(&w->lock);
}

bool writer_close(Writer *w, Err *err)
{
    if (!w) return true;
    pthread_mutex_lock(&w->lock);
    bool good = wait_written(w, err);
    w->quit = true;
    pthread_cond_signal(&w->changed);
    pthread_mutex_unlock(&w->lock);
    pthread_join(w->thread, NULL);
    pthread_mutex_destroy(&w->lock);
    pthread_cond_destroy(&w->changed);
    mem_free(w);
    return good;
}
