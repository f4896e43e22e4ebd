#include "cli/reader.h"

#include "base/thread.h"
#include "cli/inputs.h"
#include "cli/stop.h"
#include "cli/velocity.h"

#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <string.h>
#include <time.h>

struct Reader {
    const MeshJob *job;
    Sequence *sequence;
    Surface surface; /* this and the next only the thread's */
    LastSamples last;
    /* shared, under the lock */
    pthread_mutex_t lock;
    pthread_cond_t changed;
    pthread_t thread;
    ReadFrame slot;
    bool full, quit, ended;
};

void readframe_free(ReadFrame *f)
{
    if (!f->lent) field_free(&f->field);
    scene_frame_free(f->scene);
    if (f->has_velocity) grid_free(&f->velocity);
    for (int i = 0; i < f->nattribute; i++) grid_free(&f->attribute[i]);
    mem_free(f->attribute);
    *f = (ReadFrame){0};
}

static void choose_surface(const MeshJob *job, const Volume *v, ReadFrame *f)
{
    if (f->surface.chosen) return;
    if (job->has_scene) { /* its samples need no choice */
        f->surface.spec.inside_below = true;
        return;
    }
    SurfaceChoice choice = volume_choose_surface(v, job->iso, job->inside);
    f->surface.spec = choice.spec;
    if (grid_is_empty(&v->surface)) return; /* a guess that serves this frame only */
    f->surface.chosen = true;
    memcpy(f->why, choice.why, sizeof f->why);
}

/* A scene's samples are a volume like any other. */
static bool read_volume(const MeshJob *job, ReadFrame *f, Volume *v)
{
    *v = (Volume){0};
    if (!job->has_scene) return volume_read(f->frame.path, &job->request, v, &f->err);
    f->scene = scene_frame(&job->scene, f->frame.number);
    grid_init(&v->surface, 1);
    if (scene_fill_grid(f->scene, false, &v->surface, &f->err)) return true;
    volume_free(v);
    return false;
}

/* Are they the last frame's samples, of a surface chosen before? A surface that stands still costs no field. */
static bool is_same(const ReadFrame *f, const Grid *g, LastSamples *last)
{
    if (!last || f->scene) return false;
    LastSamples was = *last;
    *last = (LastSamples){f->surface.chosen, grid_digest(g)};
    return was.known && digest_is_same(was.digest, last->digest);
}

static bool build_field(const MeshJob *job, Grid *g, ReadFrame *f)
{
    Err err;
    if (!field_take(&f->field, g, &f->surface.spec, &err)) return fail(&f->err, err.code, "%.400s: %.500s", f->frame.path, err.text);
    if (f->scene && !job->trilinear) f->field.exact = scene_exact(f->scene);
    return true;
}

static bool read_field(const MeshJob *job, LastSamples *last, ReadFrame *f)
{
    Volume v;
    if (job->source.next) return job->source.next(job->source.maker, &f->frame, &f->field, &f->err);
    if (!read_volume(job, f, &v)) return false;
    choose_surface(job, &v, f);
    f->same = is_same(f, &v.surface, last);
    bool good = f->same || build_field(job, &v.surface, f);
    if (!good && last) last->known = false;
    if (good && v.has_velocity) {
        f->units = velocity_units_of(&v.velocity, job->request.velocity, job->velocity_units);
        velocity_to_world(&v.velocity, f->units);
        f->velocity = v.velocity;
        f->has_velocity = true;
        v.velocity = (Grid){0};
        v.has_velocity = false;
    }
    if (good) {
        f->nattribute = v.nattribute;
        f->attribute = v.attribute;
        v.nattribute = 0;
        v.attribute = NULL;
    }
    volume_free(&v);
    return good;
}

void readframe_read(const MeshJob *job, Surface surface, LastSamples *last, ReadFrame *f)
{
    double start = console_clock();
    f->surface = surface;
    f->good = read_field(job, last, f);
    f->digest = input_digest(&f->frame);
    f->seconds = console_clock() - start;
}

void readframe_borrow(ReadFrame *f, ReadFrame *before)
{
    ASSERT(f->same && !before->lent);
    f->field = before->field;
    before->lent = true;
}

static void next_frame(Reader *r, ReadFrame *f)
{
    *f = (ReadFrame){0};
    f->step = sequence_next(r->sequence, &f->frame, &f->err);
    if (f->step == SEQUENCE_FRAME && r->job->follow && !sequence_await(r->sequence, &f->frame)) f->step = SEQUENCE_END;
    if (f->step != SEQUENCE_FRAME) return;
    readframe_read(r->job, r->surface, &r->last, f);
    r->surface = f->surface;
}

static void *reader_run(void *context)
{
    Reader *r = context;
    thread_alone();
    for (bool more = true; more;) {
        pthread_mutex_lock(&r->lock);
        while (r->full && !r->quit) pthread_cond_wait(&r->changed, &r->lock);
        more = !r->quit;
        pthread_mutex_unlock(&r->lock);
        if (!more) break;

        ReadFrame frame;
        next_frame(r, &frame);
        more = frame.step == SEQUENCE_FRAME;

        pthread_mutex_lock(&r->lock);
        r->slot = frame;
        r->full = true;
        pthread_cond_signal(&r->changed);
        pthread_mutex_unlock(&r->lock);
    }
    pthread_mutex_lock(&r->lock);
    r->ended = true;
    pthread_cond_signal(&r->changed);
    pthread_mutex_unlock(&r->lock);
    return NULL;
}

/* Its only use: to interrupt a read of standard input that nothing comes to. */
static void wake(int number)
{
    (void)number;
}

Reader *reader_open(const MeshJob *job, Sequence *sequence, Surface surface, Err *err)
{
    struct sigaction nudge = {.sa_handler = wake};
    sigemptyset(&nudge.sa_mask);
    sigaction(SIGUSR1, &nudge, NULL);
    Reader *r = NEW0(Reader, 1);
    r->job = job;
    r->sequence = sequence;
    r->surface = surface;
    pthread_mutex_init(&r->lock, NULL);
    pthread_cond_init(&r->changed, NULL);
    if (pthread_create(&r->thread, NULL, reader_run, r) == 0) return r;
    fail(err, ERR_RESOURCE, "no thread could be had to read frames");
    mem_free(r);
    return NULL;
}

/* Waits a tenth of a second at most. The lock is held. */
static void wait_a_little(Reader *r)
{
    struct timespec until;
    clock_gettime(CLOCK_REALTIME, &until);
    until.tv_nsec += 100 * 1000 * 1000;
    if (until.tv_nsec >= 1000 * 1000 * 1000) {
        until.tv_sec++;
        until.tv_nsec -= 1000 * 1000 * 1000;
    }
    pthread_cond_timedwait(&r->changed, &r->lock, &until);
}

bool reader_take(Reader *r, ReadFrame *out)
{
    pthread_mutex_lock(&r->lock);
    while (!r->full && !stop_signal()) wait_a_little(r);
    bool have = !stop_signal();
    if (have) {
        *out = r->slot;
        r->full = false;
        pthread_cond_signal(&r->changed);
    }
    pthread_mutex_unlock(&r->lock);
    return have;
}

void reader_close(Reader *r)
{
    if (!r) return;
    pthread_mutex_lock(&r->lock);
    r->quit = true;
    pthread_cond_signal(&r->changed);
    while (!r->ended) {
        wait_a_little(r);
        if (!r->ended) pthread_kill(r->thread, SIGUSR1);
    }
    pthread_mutex_unlock(&r->lock);
    pthread_join(r->thread, NULL);
    if (r->full) readframe_free(&r->slot);
    pthread_mutex_destroy(&r->lock);
    pthread_cond_destroy(&r->changed);
    mem_free(r);
}
