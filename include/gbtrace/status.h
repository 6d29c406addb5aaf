/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/status.h -- how every function of the library reports failure.

   A status is the kind of failure; an error adds one line of text. The library never exits the process; its
   messages and progress go to the listener of gbtrace/progress.h.

   In all headers a pointer, as an argument or in a struct, may be NULL only where its comment says so, and
   `err` always. After a failure the contents of the caller's arrays are undefined, unless a comment says
   otherwise. */
#ifndef GBTRACE_STATUS_H
#define GBTRACE_STATUS_H

#include "gbtrace/api.h"

GBT_API_BEGIN

typedef enum gbt_status {
    GBT_OK = 0,
    GBT_ERR_ARGUMENT,    /* the caller's fault: usage, exit code 2 */
    GBT_ERR_FORMAT,      /* bad input: exit code 3 */
    GBT_ERR_IO,          /* file system or device: exit code 4 */
    GBT_ERR_NO_MEMORY,   /* out of memory or over a stated limit: exit code 5 */
    GBT_ERR_INTERRUPTED, /* stopped by a signal after saving: exit code 130 */
    GBT_ERR_INTERNAL     /* a library that gbtrace uses failed in a way that no input explains: exit code 1 */
} gbt_status;

/** The first failure wins: an error that already holds a text is not overwritten. Start from `gbt_error err =
    {0};`, in C++ from `gbt_error err = {};`, and again from there when you go on after a failure. */
typedef struct gbt_error {
    gbt_status status; /* of the first failure; calls also return theirs */
    char text[512];    /* one line, no newline: "FILE[:LINE|@OFFSET]: what was wrong (wanted, got)" */
} gbt_error;

/** The exit code that a program should end with for a status: 0, 2, 3, 4, 5; 1 for GBT_ERR_INTERNAL, 130 for
    GBT_ERR_INTERRUPTED. */
int gbt_status_exit_code(gbt_status status);

GBT_API_END
#endif
