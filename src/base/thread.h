/* thread.h: the program's only concurrency besides reading ahead.
 *
 * parallel_for cuts [0, n) into blocks of `grain` items and calls fn(ctx, begin, end) for each, on up
 * to thread_count() threads. Which thread takes a block is open; the blocks are the same for any
 * number of threads, so results are the same bytes as long as a block writes only what is its own and
 * sums are kept a block and added in block order. Calls do not nest; fn may not fail. One thread at a time may call it, but
 * for those that thread_alone was called on: theirs run there, block by block. */
#pragma once
typedef void ParallelFn(void *ctx, int begin, int end);
void parallel_for(int n, int grain, ParallelFn *fn, void *ctx);
void thread_alone(void);
void thread_set_count(int n); /* 1 ... 256; before the first parallel_for, later only the same again */
int thread_count(void);
int thread_hardware_count(void);
void thread_shutdown(void);   /* ends the workers; idempotent */
