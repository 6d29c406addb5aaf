/* SPDX-License-Identifier: Apache-2.0 */
/* report/axes.c -- the axes of charts: round numbers, labels, where a value is. */
#include "report/axes.h"

#include <math.h>

/* ---- ticks ---- */

/** The smallest 1, 2 or 5 times a power of ten that is not below x > 0. */
static double round_up(double x)
{
    const double power = pow(10, floor(log10(x))), digit = x / power;
    return power * (digit <= 1.0000001 ? 1 : digit <= 2.0000001 ? 2 : digit <= 5.0000001 ? 5 : 10);
}

int chart_ticks(double low, double high, int wanted, double *ticks)
{
    double span = high - low;
    if (!(span > 1e-9 * fmax(fabs(low), fabs(high)))) /* equal, or too near for their digits: a step around
                                                         them */
        span = fmax(fabs(low), fabs(high)) * 1e-3 + 1e-9;
    for (double step = round_up(span / (wanted > 1 ? wanted : 1));; step = round_up(step * 1.5)) {
        double first = floor(low / step + 1e-6), last = ceil(high / step - 1e-6);
        if (last <= first)
            last = first + 1;
        if (last - first + 1 > CHART_MAX_TICKS)
            continue;
        const int count = (int)(last - first) + 1;
        for (int i = 0; i < count; i++)
            ticks[i] = (first + i) * step;
        return count;
    }
}

int chart_log_ticks(double low, double high, double *ticks)
{
    static const int digits[] = {1, 2, 5};
    int first = 3 * (int)floor(log10(low)), last; /* tick k is digits[k mod 3] * 10^(k / 3) */
    int stride = 1;
#define LOG_TICK(k) (digits[(((k) % 3) + 3) % 3] * pow(10, floor((k) / 3.0)))
    while (LOG_TICK(first + 1) <= low * 1.0000001)
        first++;
    last = first + 1;
    while (LOG_TICK(last) < high * 0.9999999)
        last++;
    if (last - first + 1 > 8) { /* whole decades, and then every n-th of them */
        first -= ((first % 3) + 3) % 3;
        last += (3 - ((last % 3) + 3) % 3) % 3;
        stride = 3;
        while ((last - first + stride - 1) / stride + 1 > 8)
            stride += 3;
        last = first + (last - first + stride - 1) / stride * stride;
    }
    int count = 0;
    for (int k = first; k <= last; k += stride)
        ticks[count++] = LOG_TICK(k);
#undef LOG_TICK
    return count;
}

/** 20k, 1.5M: short enough for an axis, with the digits that tell neighbours `step` apart. */
static void add_tick_label(text *out, double value, double step)
{
    static const struct {
        double unit;
        const char *suffix;
    } units[] = {{1e12, "T"}, {1e9, "G"}, {1e6, "M"}, {1e3, "k"}, {1, ""}};
    const double size = fmax(fabs(value), step);
    size_t i = 0;
    while (i < 4 && size < units[i].unit * 0.9999999)
        i++;
    if (value == 0)
        text_add(out, "0");
    else if (size >= 1e16 || size < 1e-5)
        text_format(out, "%.2g", value);
    else {
        const double digits = ceil(-log10(step / units[i].unit) - 1e-6);
        text_format(out, "%.*f%s", (int)fmin(fmax(digits, 0), 6), value / units[i].unit, units[i].suffix);
    }
}

/* ---- axes ---- */

double chart_place_x(const chart_axes *a, double x)
{
    return CHART_LEFT + (CHART_RIGHT - CHART_LEFT) * ((x - a->x_low) / (a->x_high - a->x_low));
}

double chart_place_y(const chart_axes *a, double y)
{
    const double share =
        a->log_y ? log(y / a->y_low) / log(a->y_high / a->y_low) : (y - a->y_low) / (a->y_high - a->y_low);
    return CHART_BOTTOM - (CHART_BOTTOM - CHART_TOP) * share;
}

/* Beyond this, differences and powers of ten leave the range of a double; nothing that a run measures comes
   near. */
static const double value_limit = 1e100;

bool chart_can_show(const line_chart *c, double x, double y)
{
    return isfinite(x) && isfinite(y) && fabs(x) < value_limit && fabs(y) < value_limit &&
           (!c->log_y || y > 1 / value_limit);
}

bool chart_find_range(const line_chart *c, chart_axes *a)
{
    *a = (chart_axes){
        .x_low = INFINITY, .x_high = -INFINITY, .y_low = INFINITY, .y_high = -INFINITY, .log_y = c->log_y};
    for (size_t s = 0; s < c->series_count; s++) {
        const chart_series *line = &c->series[s];
        for (size_t i = 0; i < line->count; i++) {
            if (!chart_can_show(c, line->x[i], line->y[i]))
                continue;
            a->x_low = fmin(a->x_low, line->x[i]);
            a->x_high = fmax(a->x_high, line->x[i]);
            a->y_low = fmin(a->y_low, line->y[i]);
            a->y_high = fmax(a->y_high, line->y[i]);
        }
    }
    return a->x_low <= a->x_high;
}

void chart_draw_axes(text *out, const line_chart *c, chart_axes *a)
{
    double ticks[CHART_MAX_TICKS];
    if (c->from_zero) {
        a->y_low = fmin(a->y_low, 0);
        a->y_high = fmax(a->y_high, 0);
    }
    int count =
        a->log_y ? chart_log_ticks(a->y_low, a->y_high, ticks) : chart_ticks(a->y_low, a->y_high, 5, ticks);
    a->y_low = ticks[0];
    a->y_high = ticks[count - 1];
    text_add(out, "<g class=\"grid\">");
    for (int i = 0; i < count; i++)
        text_format(out, "<line x1=\"%d\" y1=\"%.1f\" x2=\"%d\" y2=\"%.1f\"/>", CHART_LEFT,
                    chart_place_y(a, ticks[i]), CHART_RIGHT, chart_place_y(a, ticks[i]));
    text_add(out, "</g><g class=\"y\">");
    for (int i = 0; i < count; i++) {
        text_format(out, "<text x=\"%d\" y=\"%.1f\">", CHART_LEFT - 7, chart_place_y(a, ticks[i]) + 4);
        const double step = a->log_y ? pow(10, floor(log10(ticks[i]) + 1e-9)) : ticks[1] - ticks[0];
        add_tick_label(out, ticks[i], step);
        text_add(out, "</text>");
    }
    text_add(out, "</g><g class=\"x\">");
    a->x_low = fmin(a->x_low, 0);
    count = chart_ticks(a->x_low, a->x_high, 6, ticks);
    if (a->x_high <= a->x_low)
        a->x_high = ticks[count - 1];
    for (int i = 0; i < count; i++) {
        if (ticks[i] < a->x_low - 1e-9 * fabs(a->x_low) || ticks[i] > a->x_high * (1 + 1e-9))
            continue;
        text_format(out, "<line x1=\"%.1f\" y1=\"%d\" x2=\"%.1f\" y2=\"%d\"/><text x=\"%.1f\" y=\"%d\">",
                    chart_place_x(a, ticks[i]), CHART_BOTTOM, chart_place_x(a, ticks[i]), CHART_BOTTOM + 4,
                    chart_place_x(a, ticks[i]), CHART_BOTTOM + 18);
        add_tick_label(out, ticks[i], ticks[1] - ticks[0]);
        text_add(out, "</text>");
    }
    text_format(out,
                "<line x1=\"%d\" y1=\"%d\" x2=\"%d\" y2=\"%d\"/><text class=\"unit\" x=\"%d\" "
                "y=\"%d\">training time, ",
                CHART_LEFT, CHART_BOTTOM, CHART_RIGHT, CHART_BOTTOM, (CHART_LEFT + CHART_RIGHT) / 2,
                CHART_HEIGHT - 8);
    text_escaped(out, c->x_unit);
    text_format(out, "</text></g><text class=\"unit\" x=\"%d\" y=\"%d\">", 6, CHART_TOP - 12);
    text_escaped(out, c->y_unit);
    text_add(out, "</text>");
}

bool chart_is_amount(double value) { return isfinite(value) && value >= 0 && value < value_limit; }
