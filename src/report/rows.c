/* SPDX-License-Identifier: Apache-2.0 */
/* report/rows.c -- rows of the tables of facts: a name and a value. */
#include "report/rows.h"

#include <math.h>

void report_open_row(text *out, const char *name) { text_format(out, "<tr><th>%s</th><td>", name); }

void report_close_row(text *out) { text_add(out, "</td></tr>\n"); }

void report_text_row(text *out, const char *name, const char *value)
{
    report_open_row(out, name);
    text_escaped(out, value);
    report_close_row(out);
}

void report_count_row(text *out, const char *name, double value)
{
    report_open_row(out, name);
    text_count(out, value);
    report_close_row(out);
}

void report_number_row(text *out, const char *name, double value, int decimals, const char *unit)
{
    report_open_row(out, name);
    text_number(out, value, decimals);
    text_format(out, "%s%s", isfinite(value) && unit[0] != '\0' ? "\xc2\xa0" : "",
                isfinite(value) ? unit : "");
    report_close_row(out);
}

void report_bytes_row(text *out, const char *name, double value)
{
    report_open_row(out, name);
    text_bytes(out, value);
    if (isfinite(value) && value >= 1000) {
        text_add(out, " (");
        text_count(out, value);
        text_add(out, " bytes)");
    }
    report_close_row(out);
}
