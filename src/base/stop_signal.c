/* SPDX-License-Identifier: Apache-2.0 */
/* base/stop_signal.c -- the time of the first signal, set by a handler. */
#include "base/stop_signal.h"

#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <time.h>
#include <unistd.h>

static const int64_t one_second = 1000000000;

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static int loops;                          /* number of loops between catch and release */
static struct sigaction old_int, old_term; /* previous handlers */

/* Lock-free, for the signal handler, which may run on any thread. */
static _Atomic int64_t asked_at; /* nanoseconds; 0: no signal so far */
static void (*_Atomic wake_loop)(void *context) = NULL;
static void *_Atomic wake_context = NULL;

/* Pass the signal to the previous handler, which usually ends the process. */
static void hand_back(int number)
{
    struct sigaction old = number == SIGINT ? old_int : old_term;
    if (old.sa_handler == SIG_IGN) /* ignored, as in a script's background jobs */
        old.sa_handler = SIG_DFL;
    sigaction(number, &old, NULL);
    raise(number);
    if (old.sa_handler == SIG_DFL) /* still alive: the default action does not end the first process of a
                                      container */
        _exit(128 + number);
}

static void on_signal(int number)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    const int64_t now = time.tv_sec * one_second + time.tv_nsec;
    int64_t first = 0;
    void (*wake)(void *) = wake_loop;
    if (!atomic_compare_exchange_strong(&asked_at, &first, now)) {
        if (now - first > one_second) /* otherwise it is the same request, delivered twice by a terminal and a
                                         wrapper */
            hand_back(number);
    } else if (wake != NULL) {
        wake(wake_context);
    }
}

void stop_signal_catch(void)
{
    struct sigaction action = {.sa_handler = on_signal, .sa_flags = SA_NODEFER}; /* for hand_back() */
    sigemptyset(&action.sa_mask);
    pthread_mutex_lock(&lock);
    if (loops++ == 0) {
        asked_at = 0;
        sigaction(SIGINT, &action, &old_int);
        sigaction(SIGTERM, &action, &old_term);
    }
    pthread_mutex_unlock(&lock);
}

void stop_signal_release(void)
{
    pthread_mutex_lock(&lock);
    if (--loops == 0) {
        sigaction(SIGINT, &old_int, NULL);
        sigaction(SIGTERM, &old_term, NULL);
        asked_at = 0;
    }
    pthread_mutex_unlock(&lock);
}

void stop_signal_wake(void (*wake)(void *context), void *context)
{
    if (wake != NULL)
        wake_context = context;
    wake_loop = wake;
}

bool stop_signal_seen(void) { return asked_at != 0; }
