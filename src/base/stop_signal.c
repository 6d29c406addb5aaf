/* SPDX-License-Identifier: Apache-2.0 */
/* base/stop_signal.c -- one flag, set by a handler. */
#include "base/stop_signal.h"

#include <stdatomic.h>
#include <stddef.h>
#include <unistd.h>

static atomic_int seen = 0; /* free of locks; the handler may run in another thread than the loop */
static void (*wake_loop)(void *context) = NULL; /* set before the handler is */
static void *wake_context = NULL;

static void on_signal(int number)
{
    if (seen != 0)
        _exit(128 + number);
    seen = number;
    if (wake_loop != NULL)
        wake_loop(wake_context);
}

void stop_signal_catch(stop_signal_guard *guard, void (*wake)(void *context), void *context)
{
    struct sigaction action = {.sa_handler = on_signal};
    sigemptyset(&action.sa_mask);
    seen = 0;
    wake_loop = wake;
    wake_context = context;
    sigaction(SIGINT, &action, &guard->old_int);
    sigaction(SIGTERM, &action, &guard->old_term);
}

void stop_signal_release(const stop_signal_guard *guard)
{
    sigaction(SIGINT, &guard->old_int, NULL);
    sigaction(SIGTERM, &guard->old_term, NULL);
    seen = 0;
}

bool stop_signal_seen(void) { return seen != 0; }
