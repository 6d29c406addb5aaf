/* SPDX-License-Identifier: Apache-2.0 */
/* pose/child.h -- a child process: its output, its log and its end; it also gets our request to stop. */
#ifndef GBT_POSE_CHILD_H
#define GBT_POSE_CHILD_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

#include "gbtrace/status.h"

typedef struct child {
    const char *name;     /* the program; borrowed */
    const char *log_path; /* borrowed */
    pid_t process;        /* 0: ended */
    int output;           /* the reading end of a pipe; -1: closed */
    bool stop_requested;  /* it was asked to stop */
    double stop_requested_at;
} child;

/**
 * Start a program found in PATH, without a shell. It is killed when this process ends.
 *
 * @param arguments [in] the program's name first, NULL last; borrowed for the call
 * @param log_path  [in] file to which stderr is appended; borrowed until child_end()
 * @param with_stderr [in] child_read() gets stderr as well as stdout; else stderr goes to the log
 * @return GBT_OK; GBT_ERR_IO, also when the program is not installed; the message says how to install it
 */
gbt_status child_start(child *c, const char *const *arguments, const char *log_path, bool with_stderr,
                       gbt_error *err);

/** Read the next bytes of its output; 0 at the end. If stop_signal_seen(), the child gets SIGINT, and ten
    seconds later SIGKILL. */
gbt_status child_read(child *c, void *out, size_t size, size_t *count, gbt_error *err);

/** Wait for its end. GBT_ERR_INTERRUPTED when it was asked to stop; GBT_ERR_IO when it failed, with `last`,
    the last line of its output, in the message. Does nothing if `c` was not started. */
gbt_status child_end(child *c, const char *last, gbt_error *err);

/** Kill it without an error; for failures of our own. */
void child_kill(child *c);

typedef void child_hear(const char *line, void *context);

/** Start a program, append all its output to the log, pass every line to `hear`, and wait for its end. */
gbt_status child_run(const char *const *arguments, const char *log_path, child_hear *hear, void *context,
                     gbt_error *err);

#endif
