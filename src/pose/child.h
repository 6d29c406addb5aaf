/* SPDX-License-Identifier: Apache-2.0 */
/* pose/child.h -- another program at work: its output, its log, its end, and signals passed on to it. */
#ifndef GBT_POSE_CHILD_H
#define GBT_POSE_CHILD_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

#include "gbtrace/status.h"

typedef struct child {
    const char *name;     /* of the program; borrowed */
    const char *log_path; /* borrowed */
    pid_t process;        /* 0: ended */
    int output;           /* the reading end of a pipe; -1: closed */
    bool was_told;        /* to stop */
    double told_at;
} child;

/**
 * Start a program from PATH, without a shell. It dies with this process.
 *
 * @param arguments [in] the program's name first, NULL last; borrowed for the call
 * @param log_path  [in] file to which stderr is appended; borrowed until child_end()
 * @param whole     [in] the pipe that child_read() reads takes stderr as well as stdout
 * @return GBT_OK; GBT_ERR_IO, also when the program is not there: how to install it
 */
gbt_status child_start(child *c, const char *const *arguments, const char *log_path, bool whole,
                       gbt_error *err);

/** The next bytes of its output, 0 at the end. When stop_signal_seen(), it gets SIGINT, and SIGKILL ten
    seconds later. */
gbt_status child_read(child *c, void *out, size_t size, size_t *count, gbt_error *err);

/** Wait for it. GBT_ERR_INTERRUPTED when it was told to stop; GBT_ERR_IO when it failed: `last` is what it
    said. `c` may have been started or not. */
gbt_status child_end(child *c, const char *last, gbt_error *err);

/** Kill it, without a word; for failures of our own. */
void child_kill(child *c);

typedef void child_hear(const char *line, void *context);

/** Start, append all it says to the log, hand over every line, end. */
gbt_status child_run(const char *const *arguments, const char *log_path, child_hear *hear, void *context,
                     gbt_error *err);

#endif
