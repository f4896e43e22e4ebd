#include "base/thread.h"

#include "base/base.h"

#include <pthread.h>
#include <unistd.h>

enum { THREAD_MAX = 256 };

typedef struct Job {
    ParallelFn *fn;
    void *ctx;
    int n, grain;
    int next; /* first block nobody has taken */
    int busy; /* workers still inside the job */
} Job;

static struct {
    pthread_mutex_t lock;
    pthread_cond_t wake, done;
    pthread_t thread[THREAD_MAX];
    int want, running;
    bool stop;
    unsigned round; /* counts jobs, so that a worker sees each once */
    Job job;
} pool = {.lock = PTHREAD_MUTEX_INITIALIZER, .wake = PTHREAD_COND_INITIALIZER, .done = PTHREAD_COND_INITIALIZER, .want = 1};

static _Thread_local bool alone;

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

/* Takes blocks until none is left. Called and left with the lock held. */
static void work(Job *job)
{
    while (job->next < job->n) {
        int begin = job->next;
        int end = job->n - begin > job->grain ? begin + job->grain : job->n;
        job->next = end;
        pthread_mutex_unlock(&pool.lock);
        job->fn(job->ctx, begin, end);
        pthread_mutex_lock(&pool.lock);
    }
}

static void *worker(void *unused)
{
    (void)unused;
    unsigned seen = 0;
    pthread_mutex_lock(&pool.lock);
    for (;;) {
        while (!pool.stop && pool.round == seen) pthread_cond_wait(&pool.wake, &pool.lock);
        if (pool.stop) break;
        seen = pool.round;
        pool.job.busy++;
        work(&pool.job);
        if (--pool.job.busy == 0) pthread_cond_signal(&pool.done);
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

void parallel_for(int n, int grain, ParallelFn *fn, void *ctx)
{
    ASSERT(grain > 0);
    if (n <= 0) return;
    if (alone || pool.want == 1 || n <= grain) {
        for (int i = 0; i < n; i += grain) fn(ctx, i, n - i > grain ? i + grain : n);
        return;
    }
    pthread_mutex_lock(&pool.lock);
    start_workers();
    pool.job = (Job){.fn = fn, .ctx = ctx, .n = n, .grain = grain};
    pool.round++;
    pthread_cond_broadcast(&pool.wake);
    work(&pool.job);
    while (pool.job.busy) pthread_cond_wait(&pool.done, &pool.lock);
    pthread_mutex_unlock(&pool.lock);
}

void thread_shutdown(void)
{
    pthread_mutex_lock(&pool.lock);
    pool.stop = true;
    pthread_cond_broadcast(&pool.wake);
    pthread_mutex_unlock(&pool.lock);
    for (int i = 0; i < pool.running; i++) pthread_join(pool.thread[i], NULL);
    pool.running = 0;
    pool.stop = false;
}
