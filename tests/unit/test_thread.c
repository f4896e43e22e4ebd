// Blocks are the same for any number of threads, each is done once; tasks run beside their caller, and may share work out.

#include "base/base.h"
#include "base/thread.h"

#include <sched.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

enum { ITEMS = 10007, GRAIN = 64, THREADS = 3, TASKS = 50 };

typedef struct Sums {
    int done[ITEMS];
    int64_t block[ITEMS / GRAIN + 1];
} Sums;

static void add_block(void *ctx, int begin, int end)
{
    Sums *s = ctx;
    assert_true(begin % GRAIN == 0 && end - begin <= GRAIN);
    for (int i = begin; i < end; i++) {
        s->done[i]++;
        s->block[begin / GRAIN] += i;
    }
}

static void check_sums(const Sums *s, int times)
{
    int64_t sum = 0;
    for (int i = 0; i < ITEMS; i++) assert_int_equal(s->done[i], times);
    for (int b = 0; b <= ITEMS / GRAIN; b++) sum += s->block[b];
    assert_true(sum == (int64_t)times * ITEMS * (ITEMS - 1) / 2);
}

static void test_each_item_once(void **state)
{
    (void)state;
    Sums *s = NEW0(Sums, 1);
    for (int k = 1; k <= 20; k++) {
        parallel_for(ITEMS, GRAIN, add_block, s);
        check_sums(s, k);
    }
    parallel_for(0, GRAIN, add_block, s);
    check_sums(s, 20);
    mem_free(s);
}

static void share_out(void *ctx) { parallel_for(ITEMS, GRAIN, add_block, ctx); }

/* Loops in the task and beside it at the same time. */
static void test_task_beside_loops(void **state)
{
    (void)state;
    Sums *in = NEW0(Sums, 1), *beside = NEW0(Sums, 1);
    Task task = {0};
    task_wait(&task); /* not started: nothing to wait for */
    for (int k = 1; k <= TASKS; k++) {
        task_start(&task, share_out, in);
        parallel_for(ITEMS, GRAIN, add_block, beside);
        task_wait(&task);
        check_sums(in, k);
        check_sums(beside, k);
    }
    task_wait(&task); /* waited for already */
    mem_free(in);
    mem_free(beside);
}

static void nested_block(void *ctx, int begin, int end)
{
    Sums *s = ctx;
    for (int i = begin; i < end; i++) parallel_for(ITEMS, GRAIN, add_block, &s[i]);
}

static void test_loops_nest(void **state)
{
    (void)state;
    enum { OUTER = 8 };
    Sums *s = NEW0(Sums, OUTER);
    parallel_for(OUTER, 1, nested_block, s);
    for (int i = 0; i < OUTER; i++) check_sums(&s[i], 1);
    mem_free(s);
}

/* A task's blocks, and the caller's, of which every thread must take one before any is done. */
typedef struct Urgency {
    int task_begun, task_done, urgent_begun;
    int done_before[THREADS]; /* of the task's blocks, when each of the caller's began */
} Urgency;

static int get(const int *at) { return __atomic_load_n(at, __ATOMIC_SEQ_CST); }
static void count(int *at) { __atomic_add_fetch(at, 1, __ATOMIC_SEQ_CST); }

static void task_block(void *ctx, int begin, int end)
{
    Urgency *u = ctx;
    (void)begin, (void)end;
    count(&u->task_begun);
    while (!get(&u->urgent_begun)) sched_yield();
    count(&u->task_done);
}

static void urgent_block(void *ctx, int begin, int end)
{
    Urgency *u = ctx;
    (void)end;
    u->done_before[begin] = get(&u->task_done);
    count(&u->urgent_begun);
    while (get(&u->urgent_begun) < THREADS) sched_yield();
}

static void share_out_tasks(void *ctx) { parallel_for(ITEMS, 1, task_block, ctx); }

static void test_callers_loops_come_first(void **state)
{
    (void)state;
    Urgency u = {0};
    Task task = {0};
    task_start(&task, share_out_tasks, &u);
    while (!get(&u.task_begun)) sched_yield();
    parallel_for(THREADS, 1, urgent_block, &u);
    task_wait(&task);
    assert_int_equal(u.task_done, ITEMS);
    for (int i = 0; i < THREADS; i++) assert_true(u.done_before[i] < ITEMS);
}

static int with_threads(void **state)
{
    (void)state;
    thread_set_count(THREADS);
    return 0;
}

static int without_threads(void **state)
{
    (void)state;
    thread_shutdown();
    thread_set_count(1);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_item_once), cmocka_unit_test(test_task_beside_loops), cmocka_unit_test(test_loops_nest),
    };
    const struct CMUnitTest with_several[] = {cmocka_unit_test(test_callers_loops_come_first)};
    int failed = cmocka_run_group_tests_name("threads", tests, with_threads, without_threads);
    failed += cmocka_run_group_tests_name("several threads", with_several, with_threads, without_threads);
    return failed + cmocka_run_group_tests_name("one thread", tests, NULL, NULL);
}
