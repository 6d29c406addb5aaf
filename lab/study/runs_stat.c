/* SPDX-License-Identifier: Apache-2.0 */
/* study/runs_stat.c -- mean and spread of figures over few runs, with confidence intervals. */
#include "study/runs_stat.h"

#include <math.h>

#include "data/json_out.h"

stat_sample stat_of(const double *values, size_t count)
{
    stat_sample s = {.mean = NAN, .deviation = NAN};
    double sum = 0, squares = 0;
    for (size_t i = 0; i < count; i++)
        if (isfinite(values[i])) {
            sum += values[i];
            s.count++;
        }
    if (s.count == 0)
        return s;
    s.mean = sum / (double)s.count;
    for (size_t i = 0; i < count; i++)
        if (isfinite(values[i]))
            squares += (values[i] - s.mean) * (values[i] - s.mean);
    if (s.count > 1)
        s.deviation = sqrt(squares / (double)(s.count - 1));
    return s;
}

double stat_half_width(const stat_sample *s)
{
    static const double t95[] = {12.706, 4.303, 3.182, 2.776, 2.571,
                                 2.447,  2.365, 2.306, 2.262}; /* for 1 to 9 degrees of freedom */
    const size_t most = sizeof t95 / sizeof *t95;
    if (s->count < 2)
        return NAN;
    return t95[s->count - 1 < most ? s->count - 2 : most - 1] * s->deviation / sqrt((double)s->count);
}

bool stat_is_apart(const stat_sample *s, double value)
{
    return fabs(s->mean - value) >
           stat_half_width(s) + 1e-12 * fabs(value); /* false if the width is NaN; the tolerance is for
                                                        rounding in the sum of equal numbers */
}

void stat_add_change(text *out, double value, int decimals)
{
    const double least = 0.5 * pow(10, -decimals); /* a value that rounds to zero gets no sign */
    text_format(out, fabs(value) < least ? "%.*f" : "%+.*f", decimals, fabs(value) < least ? 0 : value);
}

void stat_add(text *out, const stat_sample *s, int decimals, bool is_change)
{
    if (is_change && isfinite(s->mean))
        stat_add_change(out, s->mean, decimals);
    else
        text_number(out, s->mean, decimals);
    if (isfinite(s->deviation))
        text_format(out, " ± %.*f", decimals, s->deviation);
}

void stat_add_judged(text *out, const stat_sample *s, int decimals)
{
    const char *mark = stat_is_apart(s, 0) ? "**" : "";
    text_add(out, mark);
    stat_add(out, s, decimals, true);
    text_add(out, mark);
}

json_t *stat_to_json(const stat_sample *s)
{
    return json_pack("{s:o,s:o,s:I}", "mean", json_number(s->mean), "deviation", json_number(s->deviation),
                     "count", (json_int_t)s->count);
}
