/* SPDX-License-Identifier: Apache-2.0 */
/* base/background.c -- run one job on a background thread. */
#include "base/background.h"

#include <signal.h>
#include <stddef.h>

#include "base/plain_numbers.h"

static void *run_job(void *context)
{
    PLAIN_NUMBERS; /* a new thread has the program's locale */
    background_job *b = context;
    b->run(b->context);
    atomic_store(&b->over, true);
    return NULL;
}

void background_start(background_job *b, void (*run)(void *context), void *context)
{
    sigset_t all, before;
    b->run = run;
    b->context = context;
    atomic_store(&b->over, false);
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before); /* a new thread inherits the signal mask of its creator */
    b->started = pthread_create(&b->thread, NULL, run_job, b) == 0;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (!b->started)
        run_job(b);
}

bool background_is_over(background_job *b) { return atomic_load(&b->over); }

void background_wait(background_job *b)
{
    if (b->started)
        pthread_join(b->thread, NULL);
    b->started = false;
}
