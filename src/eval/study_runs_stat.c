/* eval/study_runs_stat.c -- mean and spread of figures over runs, and what so few runs can tell. */
#include "eval/study_runs_stat.h"

#include <math.h>

stat_sample stat_of(const double *values, size_t count)
{
    stat_sample s = {.mean = NAN, .deviation = NAN};
    double sum = 0, squares = 0;
    for (size_t i = 0; i < count; i++)
        if (isfinite(values[i]))
            sum += values[i], s.count++;
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
    static const double t95[] = {12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262}; /* 1 to 9 degrees of freedom */
    const size_t most = sizeof t95 / sizeof *t95;
    if (s->count < 2)
        return NAN;
    return t95[s->count - 1 < most ? s->count - 2 : most - 1] * s->deviation / sqrt((double)s->count);
}

bool stat_is_apart(const stat_sample *s, double value)
{
    return fabs(s->mean - value) > stat_half_width(s) + 1e-12 * fabs(value); /* false when the width is NaN; sums of equal numbers round */
}

void stat_add(text *out, const stat_sample *s, int decimals, bool sign)
{
    if (!isfinite(s->mean)) {
        text_add(out, "n/a");
        return;
    }
    text_format(out, sign ? "%+.*f" : "%.*f", decimals, s->mean);
    if (isfinite(s->deviation))
        text_format(out, " ± %.*f", decimals, s->deviation);
}

json_t *stat_number(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

json_t *stat_to_json(const stat_sample *s)
{
    return json_pack("{s:o,s:o,s:I}", "mean", stat_number(s->mean), "deviation", stat_number(s->deviation), "count", (json_int_t)s->count);
}
