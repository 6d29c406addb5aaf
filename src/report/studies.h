/* SPDX-License-Identifier: Apache-2.0 */
/* report/studies.h -- embed the charts of studies as a section of the page. */
#ifndef GBT_REPORT_STUDIES_H
#define GBT_REPORT_STUDIES_H

#include <stdbool.h>

#include "report/text.h"

/** Whether a file of this name is a chart: it ends in .svg and is not hidden. */
bool report_is_chart(const char *name);

/**
 * Add all SVG files of RUN, of RUN/studies and of the given folders, and SVG files given by name. Without
 * any, nothing is added.
 *
 * They are embedded as images, so that nothing in them can run or load anything. Files that cannot be read or
 * are larger than a megabyte are skipped with a warning, as are all beyond 16.
 */
void report_studies(text *out, const char *run, const char *const *studies, size_t count);

#endif
