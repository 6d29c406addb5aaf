/* SPDX-License-Identifier: Apache-2.0 */
/* report/studies.h -- charts that studies left, as a section of the page. */
#ifndef GBT_REPORT_STUDIES_H
#define GBT_REPORT_STUDIES_H

#include <stdbool.h>

#include "report/text.h"

/** Whether a file of this name is a chart: .svg, and not hidden. */
bool report_is_chart(const char *name);

/**
 * Add every SVG file of RUN, of RUN/studies and of the given folders, or those given by name; nothing when
 * there is none.
 *
 * They go in as pictures: whatever they hold, nothing in them runs or is loaded. Files that cannot be read,
 * or are larger than a megabyte, are left out with a warning, as are all beyond 16.
 */
void report_studies(text *out, const char *run, const char *const *studies, size_t count);

#endif
