/* thread.h: the program's concurrency, besides the threads that read ahead and write behind.
 *
 * parallel_for cuts [0, n) into blocks of `grain` items and calls fn(ctx, begin, end) for each, on up
 * to thread_count() threads. Which thread takes a block is open; the blocks are the same for any
 * number of threads, so results are the same bytes as long as a block writes only what is its own and
 * sums are kept a block and added in block order. fn may not fail. It may be called from within a block or a task; on
 * threads that thread_alone was called on it runs there, block by block.
 *
 * A task is one call of fn beside the caller's own work: on another of the threads, or with one thread alone on the spot. Its
 * parallel_for comes after the caller's, whose blocks are taken between its own: they are what somebody waits for. */
#pragma once
#include <stdbool.h>

typedef void ParallelFn(void *ctx, int begin, int end);
void parallel_for(int n, int grain, ParallelFn *fn, void *ctx);

/* Work shared out block by block; the caller's until it is done. */
typedef struct ThreadJob {
    ParallelFn *fn;
    void *ctx;
    int n, grain;
    int next;          /* the first item nobody has taken */
    int busy;          /* threads inside a block of it */
    bool aside;        /* a task, or part of one */
    struct ThreadJob *after; /* in the pool's list */
} ThreadJob;

typedef struct Task {
    ThreadJob job;
    void (*fn)(void *ctx);
    void *ctx;
    bool started;
} Task;

/* `t` stays where it is until task_wait, which must be called once for each start; not on threads that are alone. */
void task_start(Task *t, void (*fn)(void *ctx), void *ctx);
/* Returns when fn has; runs it, where no other thread has come to it. Does nothing for a task that is zero or was waited for. */
void task_wait(Task *t);

void thread_alone(void);
void thread_set_count(int n); /* 1 ... 256; before the first parallel_for, later only the same again */
int thread_count(void);
int thread_hardware_count(void);
void thread_shutdown(void);   /* ends the workers; idempotent */
