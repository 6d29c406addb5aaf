/* SPDX-License-Identifier: Apache-2.0 */
/* shim/parallel_pthread.c -- base/parallel.h with pthreads, for the tsan preset: ThreadSanitizer understands
   every lock in it.

   Nested calls run on the calling thread. */
#include "base/parallel.h"

#include <fenv.h>
#include <pthread.h>
#include <stdatomic.h>

#include "base/machine.h"

enum { MAX_THREADS = 64 };

typedef struct job {
    size_t count, grain, blocks;
    parallel_body *body;
    void *context;
    atomic_size_t next;
} job;

static int thread_count = 0;
static _Thread_local int inside = 0;

void parallel_set_threads(int threads)
{
    thread_count = threads < 1 ? 1 : threads > MAX_THREADS ? MAX_THREADS : threads;
}

static void find_threads(void)
{
    const machine m = machine_read("");
    if (thread_count == 0)
        parallel_set_threads(machine_threads(&m));
}

int parallel_threads(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, find_threads);
    return thread_count;
}

static void *work(void *argument)
{
    job *j = argument;
    fenv_t saved; /* every thread gets the same floating-point environment, whatever a library has set */
    fegetenv(&saved);
    fesetenv(FE_DFL_ENV);
    /* A single block does not count as nesting: calls inside it may use the threads. */
    inside += j->blocks > 1;
    for (;;) {
        const size_t block = atomic_fetch_add(&j->next, 1);
        if (block >= j->blocks)
            break;
        const size_t begin = block * j->grain;
        const size_t end = begin + j->grain < j->count ? begin + j->grain : j->count;
        j->body(block, begin, end, j->context);
    }
    inside -= j->blocks > 1;
    fesetenv(&saved);
    return NULL;
}

void parallel_run(size_t count, size_t grain, parallel_body *body, void *context)
{
    job j = {.count = count,
             .grain = grain,
             .blocks = parallel_block_count(count, grain),
             .body = body,
             .context = context};
    atomic_init(&j.next, 0);
    pthread_t threads[MAX_THREADS];
    int started = 0;
    const int wanted = inside > 0 ? 0 : parallel_threads() - 1;
    for (int i = 0; i < wanted && (size_t)i + 1 < j.blocks; i++)
        if (pthread_create(&threads[started], NULL, work, &j) == 0)
            started++;
    work(&j);
    for (int i = 0; i < started; i++)
        pthread_join(threads[i], NULL);
}

const char *parallel_library(void) { return "pthreads"; }
