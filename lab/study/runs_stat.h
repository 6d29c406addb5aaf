/* SPDX-License-Identifier: Apache-2.0 */
/* study/runs_stat.h -- mean and spread of figures over few runs, with confidence intervals. */
#ifndef GBT_STUDY_RUNS_STAT_H
#define GBT_STUDY_RUNS_STAT_H

#include <jansson.h>
#include <stdbool.h>

#include "report/text.h"

typedef struct stat_sample {
    size_t count;     /* number of finite values */
    double mean;      /* NaN without values */
    double deviation; /* sample standard deviation (n - 1); NaN for fewer than two values */
} stat_sample;

/** Statistics of the finite values. */
stat_sample stat_of(const double *values, size_t count);

/** Half the width of the 95 % confidence interval of the mean (Student's t, count - 1 degrees of freedom);
    NaN for fewer than two values. */
double stat_half_width(const stat_sample *s);

/** Whether `value` is outside the 95 % confidence interval of the mean. False for fewer than two values; with
    zero spread, whether it differs from the mean. */
bool stat_is_apart(const stat_sample *s, double value);

/** "1.23 ± 0.04"; the mean alone if there is no spread; "n/a" without a mean. Changes have a + if positive.
 */
void stat_add(text *out, const stat_sample *s, int decimals, bool is_change);

/** stat_add() for a change; bold if zero is outside the 95 % confidence interval of the mean. */
void stat_add_judged(text *out, const stat_sample *s, int decimals);

/** Explains the bold cells of a table. */
#define STAT_BOLD_MEANS "Bold: zero is outside the 95 % interval of the mean (Student's t over the seeds)."

/** "+1.23" or "-1.23"; "0.00" if it rounds to zero. `value` is finite. */
void stat_add_change(text *out, double value, int decimals);

/** {"mean", "deviation", "count"}; non-finite values become null. */
json_t *stat_to_json(const stat_sample *s);

#endif
