/* SPDX-License-Identifier: Apache-2.0 */
/* pose/child.c -- runs another program: fork, exec, pipes and waiting. */
#include "pose/child.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/fail.h"
#include "base/stop_signal.h"

enum { POLL_MS = 200, LINE_SIZE = 1024 };

static const double patience = 10; /* seconds from SIGINT to SIGKILL */

/* Runs in the new process, where only async-signal-safe calls are allowed. It gets a process group of its
   own, so that Ctrl-C does not reach it directly but only once, from us. */
static void become(const char *const *arguments, int log, int output, bool with_stderr, int failure)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    setpgid(0, 0);
    const int nothing = open("/dev/null", O_RDONLY);
    struct sigaction usual = {.sa_handler = SIG_DFL};
    sigaction(SIGINT, &usual, NULL);
    sigaction(SIGTERM, &usual, NULL);
    sigaction(SIGPIPE, &usual, NULL);
    if (nothing >= 0 && dup2(nothing, STDIN_FILENO) >= 0 && dup2(output, STDOUT_FILENO) >= 0 &&
        dup2(with_stderr ? output : log, STDERR_FILENO) >= 0)
        execvp(arguments[0], (char *const *)arguments);
    const int code = errno;
    const ssize_t put = write(failure, &code, sizeof code);
    _exit(put == sizeof code ? 127 : 126);
}

static void close_both(int ends[2])
{
    close(ends[0]);
    close(ends[1]);
}

gbt_status child_start(child *c, const char *const *arguments, const char *log_path, bool with_stderr,
                       gbt_error *err)
{
    *c = (child){.name = arguments[0], .log_path = log_path, .output = -1};
    const int log = open(log_path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    if (log < 0)
        return base_fail(err, GBT_ERR_IO, "%s: cannot create: %s", log_path, strerror(errno));
    int output[2], failure[2];
    if (pipe2(output, O_CLOEXEC) != 0) {
        close(log);
        return base_fail(err, GBT_ERR_IO, "%s: no pipe: %s", c->name, strerror(errno));
    }
    if (pipe2(failure, O_CLOEXEC) != 0) {
        close_both(output);
        close(log);
        return base_fail(err, GBT_ERR_IO, "%s: no pipe: %s", c->name, strerror(errno));
    }
    c->process = fork();
    if (c->process == 0)
        become(arguments, log, output[1], with_stderr, failure[1]);
    int code = c->process < 0 ? errno : 0;
    close(output[1]);
    close(failure[1]);
    close(log);
    if (c->process > 0) {
        while (read(failure[0], &code, sizeof code) < 0 && errno == EINTR)
            continue; /* exec succeeded, which closes the pipe: the program runs */
    }
    close(failure[0]);
    c->output = output[0];
    if (code == 0)
        return GBT_OK;
    child_kill(c);
    if (code != ENOENT)
        return base_fail(err, GBT_ERR_IO, "%s: does not start: %s", arguments[0], strerror(code));
    return base_fail(
        err, GBT_ERR_IO,
        "%s: this program is needed, but not installed (Debian, Ubuntu: sudo apt-get install %s)",
        arguments[0], arguments[0]);
}

/* Signal the whole process group, because the program may be a script that started others. */
static void signal_all(const child *c, int number)
{
    if (kill(-c->process, number) != 0)
        kill(c->process, number);
}

static void pass_on_stop(child *c)
{
    if (!stop_signal_seen() || c->process <= 0)
        return;
    if (!c->stop_requested) {
        c->stop_requested = true;
        c->stop_requested_at = clock_wall();
        signal_all(c, SIGINT);
    } else if (clock_wall() - c->stop_requested_at > patience) {
        signal_all(c, SIGKILL);
    }
}

gbt_status child_read(child *c, void *out, size_t size, size_t *count, gbt_error *err)
{
    *count = 0;
    for (;;) {
        pass_on_stop(c);
        struct pollfd wanted = {.fd = c->output, .events = POLLIN};
        if (poll(&wanted, 1, POLL_MS) <= 0)
            continue;
        const ssize_t got = read(c->output, out, size);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            return base_fail(err, GBT_ERR_IO, "%s: its output cannot be read: %s", c->name, strerror(errno));
        *count = (size_t)got;
        return GBT_OK;
    }
}

/* Wait for the end. The program may close its output and keep running, so a request to stop is still passed
   on. */
static int wait_for(child *c)
{
    int state = 0;
    if (c->output >= 0)
        close(c->output);
    c->output = -1;
    for (;;) {
        pass_on_stop(c);
        const pid_t ended = waitpid(c->process, &state, WNOHANG);
        if (ended == c->process)
            break;
        if (ended < 0 && errno != EINTR) { /* SIGCHLD is ignored, so the exit status is lost */
            state = 255 << 8;
            break;
        }
        poll(NULL, 0, 10);
    }
    c->process = 0;
    return state;
}

gbt_status child_end(child *c, const char *last, gbt_error *err)
{
    if (c->process <= 0)
        return GBT_OK;
    const int state = wait_for(c);
    if (c->stop_requested || stop_signal_seen())
        return base_fail(err, GBT_ERR_INTERRUPTED, "interrupted: run the same command again to continue");
    if (WIFEXITED(state) && WEXITSTATUS(state) == 0)
        return GBT_OK;
    if (WIFSIGNALED(state))
        return base_fail(err, GBT_ERR_IO, "%s: ended by signal %d%s (log: %s)", c->name, WTERMSIG(state),
                         WTERMSIG(state) == SIGKILL ? ", as when memory runs out" : "", c->log_path);
    return base_fail(err, GBT_ERR_IO, "%s: failed (code %d): %.200s (log: %s)", c->name, WEXITSTATUS(state),
                     last[0] != '\0' ? last : "no output", c->log_path);
}

void child_kill(child *c)
{
    if (c->process > 0) {
        signal_all(c, SIGKILL);
        wait_for(c);
    }
    if (c->output >= 0)
        close(c->output);
    *c = (child){.output = -1};
}

/* ---- lines ---- */

typedef struct lines {
    char now[LINE_SIZE]; /* the current line so far; longer lines are truncated */
    size_t used;
    char last[LINE_SIZE]; /* the last line that is not empty */
    bool last_is_error;
    child_hear *hear;
    void *context;
} lines;

static bool tells_error(const char *line)
{
    return strcasestr(line, "error") != NULL || strcasestr(line, "failed") != NULL;
}

static void end_line(lines *l)
{
    l->now[l->used] = '\0';
    const char *text = l->now + strspn(l->now, " \t");
    if (text[0] != '\0' && (tells_error(text) || !l->last_is_error)) {
        l->last_is_error = tells_error(text);
        memmove(l->last, text, strlen(text) + 1);
    }
    if (l->hear != NULL)
        l->hear(l->now, l->context);
    l->used = 0;
}

static void take_bytes(lines *l, const char *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (bytes[i] == '\n' || bytes[i] == '\r')
            end_line(l);
        else if (l->used + 1 < sizeof l->now)
            l->now[l->used++] = bytes[i] != '\0' ? bytes[i] : '?';
    }
}

gbt_status child_run(const char *const *arguments, const char *log_path, child_hear *hear, void *context,
                     gbt_error *err)
{
    child c;
    lines l = {.hear = hear, .context = context};
    FILE *log = fopen(log_path, "ae");
    if (log == NULL)
        return base_fail(err, GBT_ERR_IO, "%s: cannot create: %s", log_path, strerror(errno));
    for (size_t i = 0; arguments[i] != NULL; i++)
        fprintf(log, "%s%s", i == 0 ? "$ " : " ", arguments[i]);
    fputc('\n', log);
    fflush(log);
    gbt_status status = child_start(&c, arguments, log_path, true, err);
    char bytes[4096];
    size_t count = 1;
    while (status == GBT_OK && count > 0) {
        status = child_read(&c, bytes, sizeof bytes, &count, err);
        fwrite(bytes, 1, count, log);
        take_bytes(&l, bytes, count);
        if (status == GBT_OK && (fflush(log) != 0 || ferror(log)))
            status = base_fail(err, GBT_ERR_IO, "%s: write failed: %s", log_path, strerror(errno));
    }
    if (l.used > 0)
        end_line(&l);
    fclose(log);
    if (status == GBT_OK)
        return child_end(&c, l.last, err);
    child_kill(&c);
    return status;
}
