/* SPDX-License-Identifier: Apache-2.0 */
/* cli/progress.h -- stderr as text for people, or as one JSON object per line for programs. */
#ifndef GBT_CLI_PROGRESS_H
#define GBT_CLI_PROGRESS_H

#include <stdbool.h>
#include <stdio.h>

typedef enum progress_mode { PROGRESS_AUTO, PROGRESS_JSON, PROGRESS_NONE } progress_mode;

/** Set the mode for the rest of the program. With PROGRESS_JSON everything on stderr is JSON from here on
    (docs/command-line.md). */
void progress_start(progress_mode mode, const char *command_name);

/** A message of the command-line program itself. */
void progress_say(const char *format, ...) __attribute__((format(printf, 1, 2)));

/** Whether progress is shown as text: neither JSON nor --quiet was requested. */
bool progress_for_people(void);

/** Print an error line. */
void progress_error(const char *text);

/** The last error printed; NULL: none. */
const char *progress_last_error(void);

/** In JSON mode, write the last object, with the exit code. */
void progress_end(int exit_code);

/** A JSON string with its quotes; invalid UTF-8 becomes U+FFFD. */
void json_write_text(FILE *out, const char *text);

/** A JSON number; null if it is not finite. */
void json_write_number(FILE *out, double value);

#endif
