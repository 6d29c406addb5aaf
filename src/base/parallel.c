/* SPDX-License-Identifier: Apache-2.0 */
/* base/parallel.c -- account of what blocks take; who runs them is in shim/. */
#include "base/parallel.h"

#include <stdatomic.h>
#include <stdint.h>

#include "base/clock.h"

typedef struct accounted_call {
    parallel_body *body;
    void *context;
    _Atomic uint64_t work, longest; /* nanoseconds */
} accounted_call;

static _Thread_local int inside; /* blocks on this thread's stack */
static _Thread_local parallel_account account;

static void run_accounted(size_t block, size_t begin, size_t end, void *context)
{
    accounted_call *call = context;
    const double start = clock_wall();
    inside++;
    call->body(block, begin, end, call->context);
    inside--;
    const uint64_t took = (uint64_t)(1e9 * (clock_wall() - start));
    atomic_fetch_add(&call->work, took);
    for (uint64_t longest = atomic_load(&call->longest); longest < took;)
        if (atomic_compare_exchange_weak(&call->longest, &longest, took))
            break;
}

void parallel_blocks(size_t count, size_t grain, parallel_body *body, void *context)
{
    if (inside > 0) {
        parallel_run(count, grain, body, context);
        return;
    }
    accounted_call call = {.body = body, .context = context};
    atomic_init(&call.work, 0);
    atomic_init(&call.longest, 0);
    const double start = clock_wall();
    parallel_run(count, grain, run_accounted, &call);
    account.wall += clock_wall() - start;
    account.work += 1e-9 * (double)atomic_load(&call.work);
    account.span += 1e-9 * (double)atomic_load(&call.longest);
}

parallel_account parallel_account_now(void) { return account; }
