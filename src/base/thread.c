#include "base/thread.h"

#include "base/base.h"

#include <pthread.h>
#include <sched.h>
#include <unistd.h>

enum { THREAD_MAX = 256, YIELDS = 200 };

static struct {
    pthread_mutex_t lock;
    pthread_cond_t changed; /* a job has come, one is done, or there will be no more: */
    unsigned changes;       /* how often; also read without the lock */
    pthread_t thread[THREAD_MAX];
    int want, running;
    bool stop;
    ThreadJob *first; /* jobs that threads may take blocks of: those of tasks come last, else the oldest first */
} pool = {.lock = PTHREAD_MUTEX_INITIALIZER, .changed = PTHREAD_COND_INITIALIZER, .want = 1};

static _Thread_local bool alone;
static _Thread_local bool aside; /* at work on a task */

void thread_alone(void) { alone = true; }

int thread_hardware_count(void)
{
    long n = sysconf(_SC_NPROCESSORS_ONLN);
    return int_clamp((int)n, 1, THREAD_MAX);
}

void thread_set_count(int n)
{
    n = int_clamp(n, 1, THREAD_MAX);
    ASSERT(pool.running == 0 || n == pool.want);
    pool.want = n;
}

int thread_count(void) { return pool.want; }

/* --- all below are called, and left, with the lock held ------------------------------------------------------------ */

static void announce_change(void)
{
    __atomic_store_n(&pool.changes, pool.changes + 1, __ATOMIC_RELAXED);
    pthread_cond_broadcast(&pool.changed);
}

/* Jobs follow one another closely: to fall asleep and be woken takes longer than most waits. */
static void wait_for_change(void)
{
    const unsigned seen = pool.changes;
    pthread_mutex_unlock(&pool.lock);
    for (int i = 0; i < YIELDS && __atomic_load_n(&pool.changes, __ATOMIC_RELAXED) == seen; i++) sched_yield();
    pthread_mutex_lock(&pool.lock);
    if (pool.changes == seen) pthread_cond_wait(&pool.changed, &pool.lock);
}

static void list_job(ThreadJob *job)
{
    ThreadJob **at = &pool.first;
    while (*at && (job->aside || !(*at)->aside)) at = &(*at)->after;
    job->after = *at;
    *at = job;
    announce_change();
}

static void unlist_job(ThreadJob *job)
{
    ThreadJob **at = &pool.first;
    while (*at != job) at = &(*at)->after;
    *at = job->after;
}

static ThreadJob *find_open_job(void)
{
    ThreadJob *job = pool.first;
    while (job && job->next >= job->n) job = job->after;
    return job;
}

static void run_block(ThreadJob *job)
{
    int begin = job->next;
    int end = job->n - begin > job->grain ? begin + job->grain : job->n;
    bool was_aside = aside;
    job->next = end;
    job->busy++;
    pthread_mutex_unlock(&pool.lock);
    aside = job->aside;
    job->fn(job->ctx, begin, end);
    aside = was_aside;
    pthread_mutex_lock(&pool.lock);
    if (--job->busy == 0 && job->next >= job->n) announce_change();
}

/* Works on the job, or on what is more urgent, then waits for those inside it; `help`: and works on others' meanwhile. */
static void finish_job(ThreadJob *job, bool help)
{
    while (job->next < job->n) run_block(find_open_job());
    while (job->busy) {
        ThreadJob *other = help ? find_open_job() : NULL;
        if (other) run_block(other);
        else wait_for_change();
    }
    unlist_job(job);
}

static void *worker(void *unused)
{
    (void)unused;
    pthread_mutex_lock(&pool.lock);
    while (!pool.stop) {
        ThreadJob *job = find_open_job();
        if (job) run_block(job);
        else wait_for_change();
    }
    pthread_mutex_unlock(&pool.lock);
    return NULL;
}

static void start_workers(void)
{
    while (pool.running < pool.want - 1) {
        if (pthread_create(&pool.thread[pool.running], NULL, worker, NULL) != 0) break; /* fewer threads: slower, same bytes */
        pool.running++;
    }
}

/* ------------------------------------------------------------------------------------------------------------------- */

void parallel_for(int n, int grain, ParallelFn *fn, void *ctx)
{
    ASSERT(grain > 0);
    if (n <= 0) return;
    if (alone || pool.want == 1 || n <= grain) {
        for (int i = 0; i < n; i += grain) fn(ctx, i, n - i > grain ? i + grain : n);
        return;
    }
    ThreadJob job = {.fn = fn, .ctx = ctx, .n = n, .grain = grain, .aside = aside};
    pthread_mutex_lock(&pool.lock);
    start_workers();
    list_job(&job);
    finish_job(&job, false);
    pthread_mutex_unlock(&pool.lock);
}

static void run_task(void *ctx, int begin, int end)
{
    (void)begin, (void)end;
    const Task *t = ctx;
    t->fn(t->ctx);
}

void task_start(Task *t, void (*fn)(void *ctx), void *ctx)
{
    ASSERT(!alone && !t->started);
    *t = (Task){.job = {.fn = run_task, .n = 1, .grain = 1, .aside = true}, .fn = fn, .ctx = ctx};
    if (pool.want == 1) {
        fn(ctx);
        return;
    }
    t->job.ctx = t;
    t->started = true;
    pthread_mutex_lock(&pool.lock);
    start_workers();
    list_job(&t->job);
    pthread_mutex_unlock(&pool.lock);
}

void task_wait(Task *t)
{
    if (!t->started) return;
    pthread_mutex_lock(&pool.lock);
    finish_job(&t->job, true);
    pthread_mutex_unlock(&pool.lock);
    t->started = false;
}

void thread_shutdown(void)
{
    pthread_mutex_lock(&pool.lock);
    pool.stop = true;
    announce_change();
    pthread_mutex_unlock(&pool.lock);
    for (int i = 0; i < pool.running; i++) pthread_join(pool.thread[i], NULL);
    pool.running = 0;
    pool.stop = false;
}
