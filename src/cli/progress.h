/* SPDX-License-Identifier: Apache-2.0 */
/* cli/progress.h -- stderr as lines for a person, or as one JSON object a line for a program. */
#ifndef GBT_CLI_PROGRESS_H
#define GBT_CLI_PROGRESS_H

#include <stdbool.h>
#include <stdio.h>

typedef enum progress_mode { PROGRESS_AUTO, PROGRESS_JSON, PROGRESS_NONE } progress_mode;

/** For the rest of the program. With PROGRESS_JSON everything on stderr is JSON from here on
    (docs/command-line.md). */
void progress_start(progress_mode mode, const char *command_name);

/** A message of the program's own. */
void progress_say(const char *format, ...) __attribute__((format(printf, 1, 2)));

/** Whether a person is told what goes on: neither JSON nor silence was asked for. */
bool progress_for_people(void);

/** One line of an error. */
void progress_error(const char *text);

/** The last one; NULL: there was none. */
const char *progress_last_error(void);

/** The last line with "json": how the program ends. */
void progress_end(int exit_code);

/** A JSON string with its quotes; bytes that are not UTF-8 become U+FFFD. */
void json_write_text(FILE *out, const char *text);

/** A JSON number; null when it is not finite. */
void json_write_number(FILE *out, double value);

#endif
