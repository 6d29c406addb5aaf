/* SPDX-License-Identifier: Apache-2.0 */
/* base/parallel.c -- time accounting of parallel blocks; the schedulers are in shim/. */
#include "base/parallel.h"

#include <stdatomic.h>
#include <stdint.h>

#include "base/paged.h"
#include "base/stage.h"

typedef struct accounted_call {
    parallel_body *body;
    void *context;
    _Atomic uint64_t work, longest; /* nanoseconds */
} accounted_call;

static _Thread_local parallel_account account;

/* Time a block. Nested calls are accounted on the thread that makes them. */
static void run_accounted(size_t block, size_t begin, size_t end, void *context)
{
    accounted_call *call = context;
    paged_check();
    stage_clock clock = stage_begin();
    call->body(block, begin, end, call->context);
    const stage_time took = stage_lap(&clock);
    atomic_fetch_add(&call->work, (uint64_t)(1e9 * took.work));
    const uint64_t span = (uint64_t)(1e9 * took.span);
    for (uint64_t longest = atomic_load(&call->longest); longest < span;)
        if (atomic_compare_exchange_weak(&call->longest, &longest, span))
            break;
}

void parallel_blocks(size_t count, size_t grain, parallel_body *body, void *context)
{
    accounted_call call = {.body = body, .context = context};
    atomic_init(&call.work, 0);
    atomic_init(&call.longest, 0);
    const parallel_account before =
        account; /* nested calls are already part of the time of their blocks: drop what they add */
    const double start = clock_wall();
    parallel_run(count, grain, run_accounted, &call);
    account = (parallel_account){.wall = before.wall + clock_wall() - start,
                                 .work = before.work + 1e-9 * (double)atomic_load(&call.work),
                                 .span = before.span + 1e-9 * (double)atomic_load(&call.longest)};
}

parallel_account parallel_account_now(void) { return account; }
