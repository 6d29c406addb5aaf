/* SPDX-License-Identifier: Apache-2.0 */
/* report/rows.h -- rows of the tables of facts: a name and a value. */
#ifndef GBT_REPORT_ROWS_H
#define GBT_REPORT_ROWS_H

#include "report/text.h"

/* Names are trusted markup of this program; unknown values appear as "n/a". */
void report_open_row(text *out, const char *name);
void report_close_row(text *out);
void report_text_row(text *out, const char *name, const char *value);
void report_count_row(text *out, const char *name, double value);
void report_number_row(text *out, const char *name, double value, int decimals, const char *unit);
void report_bytes_row(text *out, const char *name, double value);

#endif
