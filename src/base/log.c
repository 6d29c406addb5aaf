/* SPDX-License-Identifier: Apache-2.0 */
/* base/log.c -- events to the listener, or to stderr. */
#include "base/log.h"

#include <math.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "base/clock.h"

enum { LINE_SIZE = 1024 };

static const double often_seconds = 0.5, line_seconds = 10;

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER; /* protects all statics, and keeps lines of different
                                                            threads apart */
static gbt_listener listener;
static void *listener_context;
static bool line_is_open; /* the last line on the terminal is progress, without a newline */

void gbt_listen(gbt_listener to, void *context)
{
    pthread_mutex_lock(&lock);
    listener = to;
    listener_context = context;
    pthread_mutex_unlock(&lock);
}

/* Whether stderr is a terminal, on which a line can be overwritten. */
static bool on_terminal(void)
{
    const char *kind = getenv("TERM");
    return isatty(STDERR_FILENO) && kind != NULL && strcmp(kind, "dumb") != 0;
}

/* Width at which progress is cut, because a wrapped line cannot be overwritten. */
static int terminal_width(void)
{
    struct winsize size;
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 ? size.ws_col - 1 : LINE_SIZE;
}

static void print_event(const gbt_event *e)
{
    const bool over = e->kind == GBT_EVENT_PROGRESS && on_terminal();
    if (over)
        fprintf(stderr, "\r%.*s\033[K", terminal_width(), e->text); /* clear to the end of the line, since the
                                                                       previous one may have been longer */
    else
        fprintf(stderr, "%s%s%s\n", line_is_open ? "\n" : "", e->kind == GBT_EVENT_WARNING ? "warning: " : "",
                e->text);
    line_is_open = over && !(e->fraction >= 1);
    if (over && !line_is_open)
        fputc('\n', stderr);
}

static void tell(const gbt_event *e)
{
    pthread_mutex_lock(&lock);
    if (listener != NULL)
        listener(e, listener_context);
    else
        print_event(e);
    pthread_mutex_unlock(&lock);
}

static void tell_text(gbt_event_kind kind, const char *format, va_list args)
{
    char line[LINE_SIZE];
    vsnprintf(line, sizeof line, format, args);
    const gbt_event e = {.kind = kind, .text = line};
    tell(&e);
}

void log_warn(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    tell_text(GBT_EVENT_WARNING, format, args);
    va_end(args);
}

void log_info(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    tell_text(GBT_EVENT_MESSAGE, format, args);
    va_end(args);
}

/* Call with the lock held. */
static bool is_due(void)
{
    static double last = -1;
    const double now = clock_wall(),
                 interval = listener != NULL || on_terminal() ? often_seconds : line_seconds;
    if (last >= 0 && now - last < interval)
        return false;
    const bool due = last >= 0;
    last = now;
    return due;
}

bool log_progress_due(void)
{
    pthread_mutex_lock(&lock);
    const bool due = is_due();
    pthread_mutex_unlock(&lock);
    return due;
}

void log_progress(const gbt_event *event)
{
    gbt_event e = *event;
    e.kind = GBT_EVENT_PROGRESS;
    tell(&e);
}

void log_count(const char *stage, uint64_t done, uint64_t total, double psnr)
{
    static struct {
        const char *stage;
        uint64_t done;
        double start;
    } current;
    pthread_mutex_lock(&lock);
    if (current.stage == NULL || strcmp(current.stage, stage) != 0 || done <= current.done) {
        current.stage = stage;
        current.start = clock_wall();
    }
    current.done = done;
    const double seconds = clock_wall() - current.start;
    /* Without a listener nothing is printed at done = 0, and the end of a stage only completes an open
       progress line: its end has a message of its own. */
    const bool is_reported =
        ((done > 0 || listener != NULL) && is_due()) || (done == total && (listener != NULL || line_is_open));
    pthread_mutex_unlock(&lock);
    if (!is_reported)
        return;
    char line[LINE_SIZE];
    gbt_event e = {
        .text = line, .stage = stage, .done = done, .total = total, .psnr = psnr, .loss = (double)NAN};
    e.fraction = total > 0 ? (double)done / (double)total : (double)NAN;
    e.seconds = seconds;
    e.seconds_left = done > 0 && total > 0 ? seconds * (double)(total - done) / (double)done : (double)NAN;
    int used = snprintf(line, sizeof line, "%s: %llu", stage, (unsigned long long)done);
    if (total > 0)
        used += snprintf(line + used, sizeof line - (size_t)used, " of %llu", (unsigned long long)total);
    if (isfinite(e.seconds_left))
        snprintf(line + used, sizeof line - (size_t)used, "  %.0f:%02.0f left", floor(e.seconds_left / 60),
                 floor(fmod(e.seconds_left, 60)));
    log_progress(&e);
}
