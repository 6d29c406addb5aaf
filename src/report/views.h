/* SPDX-License-Identifier: Apache-2.0 */
/* report/views.h -- the held-out views of the page: photo against render, where they differ, and their
   scores. */
#ifndef GBT_REPORT_VIEWS_H
#define GBT_REPORT_VIEWS_H

#include "eval/scores.h"
#include "report/text.h"

enum { REPORT_MAX_VIEWS = 24 }; /* of more views, a third each: worst, median, best */

/**
 * Add the section, worst PSNR first. Pictures inside the folder `run` get links. `protocol`: one sentence on
 * how scores are made, or NULL. `scored`: one sentence on which pixels count, or NULL.
 */
void report_views(text *out, const char *run, const evaluation *e, const char *protocol, const char *scored);

/**
 * Choose the views to show, worst first. Views without a score come last, and only if there is room for them.
 *
 * @param shown [out] indices, [REPORT_MAX_VIEWS]
 * @param order [out] all indices, worst first, [view_count]
 * @return how many are shown
 */
size_t report_choose_views(const evaluation *e, size_t *shown, size_t *order);

#endif
