/* SPDX-License-Identifier: Apache-2.0 */
/* report/views.h -- the held-out views of the page: photo against render, where they differ, and their
   scores. */
#ifndef GBT_REPORT_VIEWS_H
#define GBT_REPORT_VIEWS_H

#include "eval/scores.h"
#include "report/text.h"

enum { REPORT_MAX_VIEWS = 24 }; /* of more, a third each: worst, middle, best */

/**
 * Add the section, worst PSNR first. Pictures below the folder `run` get links. `protocol`: how scores are
 * made, one sentence; NULL: nothing is said. `scored`: of which pixels; optional (NULL).
 */
void report_views(text *out, const char *run, const evaluation *e, const char *protocol, const char *scored);

/**
 * Which views to show, worst first; those without a score last, and only where there is room for them.
 *
 * @param shown [out] indices, [REPORT_MAX_VIEWS]
 * @param order [out] all indices, worst first, [view_count]
 * @return how many are shown
 */
size_t report_choose_views(const evaluation *e, size_t *shown, size_t *order);

#endif
