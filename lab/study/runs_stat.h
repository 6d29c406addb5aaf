/* SPDX-License-Identifier: Apache-2.0 */
/* study/runs_stat.h -- mean and spread of figures over runs, and what so few runs can tell. */
#ifndef GBT_STUDY_RUNS_STAT_H
#define GBT_STUDY_RUNS_STAT_H

#include <jansson.h>
#include <stdbool.h>

#include "report/text.h"

typedef struct stat_sample {
    size_t count;     /* finite values */
    double mean;      /* NaN without values */
    double deviation; /* sample standard deviation, n - 1; NaN below two values */
} stat_sample;

/** Of the finite ones among `values`. */
stat_sample stat_of(const double *values, size_t count);

/** Half the width of the 95 % interval of the mean (Student's t, count - 1 degrees of freedom); NaN below two
    values. */
double stat_half_width(const stat_sample *s);

/** Is `value` outside the 95 % interval of the mean? Never below two values; without spread, when it is not
    the mean. */
bool stat_is_apart(const stat_sample *s, double value);

/** "1.23 ± 0.04"; without a spread the mean alone; "n/a" without a mean. A change has its sign even when
    positive. */
void stat_add(text *out, const stat_sample *s, int decimals, bool is_change);

/** stat_add() of a change, bold when zero is outside the 95 % interval of the mean. */
void stat_add_judged(text *out, const stat_sample *s, int decimals);

/** What bold cells of a page mean. */
#define STAT_BOLD_MEANS "Bold: zero is outside the 95 % interval of the mean (Student's t over the seeds)."

/** "+1.23", "-1.23", "0.00" for what rounds to that; `value` is finite. */
void stat_add_change(text *out, double value, int decimals);

/** {"mean", "deviation", "count"}; null for what is not finite. */
json_t *stat_to_json(const stat_sample *s);

#endif
