/* eval/report_chart.c -- line and bar charts as inline SVG. */
#include "eval/report_chart.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* The picture in its own units; the page scales it. Small enough that its text can still be read on a phone. */
enum { WIDTH = 460, HEIGHT = 268, LEFT = 50, RIGHT = 448, TOP = 26, BOTTOM = 224, PATH_POINTS = 400, STRIPS = 80 };

/* ---- ticks -------------------------------------------------------------------------------------------------------------------- */

/** The smallest 1, 2 or 5 times a power of ten that is not below x > 0. */
static double round_up(double x)
{
    const double power = pow(10, floor(log10(x))), digit = x / power;
    return power * (digit <= 1.0000001 ? 1 : digit <= 2.0000001 ? 2 : digit <= 5.0000001 ? 5 : 10);
}

int chart_ticks(double low, double high, int wanted, double *ticks)
{
    double span = high - low;
    if (!(span > 1e-9 * fmax(fabs(low), fabs(high)))) /* equal, or too near for their digits: a step around them */
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
    int first = 3 * (int)floor(log10(low)), last = first; /* tick k is digits[k mod 3] * 10^(k / 3) */
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
    static const struct { double unit; const char *suffix; } units[] = {{1e12, "T"}, {1e9, "G"}, {1e6, "M"}, {1e3, "k"}, {1, ""}};
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

/* ---- lines -------------------------------------------------------------------------------------------------------------------- */

typedef struct axes {
    double x_low, x_high, y_low, y_high;
    bool log_y;
} axes;

static double place_x(const axes *a, double x)
{
    return LEFT + (RIGHT - LEFT) * ((x - a->x_low) / (a->x_high - a->x_low));
}

static double place_y(const axes *a, double y)
{
    const double share = a->log_y ? log(y / a->y_low) / log(a->y_high / a->y_low) : (y - a->y_low) / (a->y_high - a->y_low);
    return BOTTOM - (BOTTOM - TOP) * share;
}

/* Beyond this, differences and powers of ten leave the range of a double; nothing that a run measures comes near. */
static const double value_limit = 1e100;

static bool can_show(const line_chart *c, double x, double y)
{
    return isfinite(x) && isfinite(y) && fabs(x) < value_limit && fabs(y) < value_limit && (!c->log_y || y > 1 / value_limit);
}

static bool find_range(const line_chart *c, axes *a)
{
    *a = (axes){.x_low = INFINITY, .x_high = -INFINITY, .y_low = INFINITY, .y_high = -INFINITY, .log_y = c->log_y};
    for (size_t s = 0; s < c->series_count; s++) {
        const chart_series *line = &c->series[s];
        for (size_t i = 0; i < line->count; i++) {
            if (!can_show(c, line->x[i], line->y[i]))
                continue;
            a->x_low = fmin(a->x_low, line->x[i]), a->x_high = fmax(a->x_high, line->x[i]);
            a->y_low = fmin(a->y_low, line->y[i]), a->y_high = fmax(a->y_high, line->y[i]);
        }
    }
    return a->x_low <= a->x_high;
}

/** Axes that end at ticks; x starts at 0 (the run does), ends with the data. */
static void draw_axes(text *out, const line_chart *c, axes *a)
{
    double ticks[CHART_MAX_TICKS];
    if (c->from_zero)
        a->y_low = fmin(a->y_low, 0), a->y_high = fmax(a->y_high, 0);
    int count = a->log_y ? chart_log_ticks(a->y_low, a->y_high, ticks) : chart_ticks(a->y_low, a->y_high, 5, ticks);
    a->y_low = ticks[0], a->y_high = ticks[count - 1];
    text_add(out, "<g class=\"grid\">");
    for (int i = 0; i < count; i++)
        text_format(out, "<line x1=\"%d\" y1=\"%.1f\" x2=\"%d\" y2=\"%.1f\"/>", LEFT, place_y(a, ticks[i]), RIGHT, place_y(a, ticks[i]));
    text_add(out, "</g><g class=\"y\">");
    for (int i = 0; i < count; i++) {
        text_format(out, "<text x=\"%d\" y=\"%.1f\">", LEFT - 7, place_y(a, ticks[i]) + 4);
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
        text_format(out, "<line x1=\"%.1f\" y1=\"%d\" x2=\"%.1f\" y2=\"%d\"/><text x=\"%.1f\" y=\"%d\">", place_x(a, ticks[i]), BOTTOM,
                    place_x(a, ticks[i]), BOTTOM + 4, place_x(a, ticks[i]), BOTTOM + 18);
        add_tick_label(out, ticks[i], ticks[1] - ticks[0]);
        text_add(out, "</text>");
    }
    text_format(out, "<line x1=\"%d\" y1=\"%d\" x2=\"%d\" y2=\"%d\"/><text class=\"unit\" x=\"%d\" y=\"%d\">training time, ", LEFT, BOTTOM, RIGHT, BOTTOM,
                (LEFT + RIGHT) / 2, HEIGHT - 8);
    text_escaped(out, c->x_unit);
    text_format(out, "</text></g><text class=\"unit\" x=\"%d\" y=\"%d\">", 6, TOP - 12);
    text_escaped(out, c->y_unit);
    text_add(out, "</text>");
}

static void draw_marks(text *out, const line_chart *c, const axes *a)
{
    double free_from = LEFT - 1; /* labels must not cover each other */
    text_add(out, "<g class=\"marks\">");
    for (size_t i = 0; i < c->mark_count; i++) {
        if (!(c->marks[i].x >= a->x_low && c->marks[i].x <= a->x_high))
            continue;
        const double x = place_x(a, c->marks[i].x), width = 6.0 * (double)strlen(c->marks[i].label);
        if (x > LEFT + 1)
            text_format(out, "<line x1=\"%.1f\" y1=\"%d\" x2=\"%.1f\" y2=\"%d\"/>", x, TOP, x, BOTTOM);
        if (x < free_from || x + width > RIGHT)
            continue;
        text_format(out, "<text x=\"%.1f\" y=\"%d\">", x + 4, BOTTOM - 6);
        text_escaped(out, c->marks[i].label);
        text_add(out, "</text>");
        free_from = x + width + 8;
    }
    text_add(out, "</g>");
}

static void draw_line(text *out, const line_chart *c, const chart_series *line, const axes *a)
{
    const size_t per_point = (line->count + PATH_POINTS - 1) / PATH_POINTS;
    bool is_open = false;
    text_format(out, "<path class=\"%s c%d\" d=\"", line->style == CHART_FAINT ? "faint" : "line", line->color & 3);
    for (size_t i = 0; i < line->count; i += per_point) {
        double x = 0, y = 0, n = 0;
        for (size_t j = i; j < line->count && j < i + per_point; j++)
            if (can_show(c, line->x[j], line->y[j]))
                x += line->x[j], y += line->y[j], n++;
        if (n > 0)
            text_format(out, "%s%.1f %.1f", is_open ? "L" : "M", place_x(a, x / n), place_y(a, y / n));
        is_open = is_open || n > 0; /* a gap (a score between two rows) is bridged */
    }
    text_add(out, "\"/>");
}

static void add_value(text *out, const line_chart *c, double y)
{
    if (c->y_decimals < 0)
        text_count(out, y);
    else
        text_number(out, y, c->y_decimals);
}

static void draw_dots(text *out, const line_chart *c, const chart_series *line, const axes *a)
{
    for (size_t i = 0; i < line->count; i++) {
        if (!can_show(c, line->x[i], line->y[i]))
            continue;
        text_format(out, "<circle class=\"dot c%d\" cx=\"%.1f\" cy=\"%.1f\" r=\"4\"><title>", line->color & 3, place_x(a, line->x[i]), place_y(a, line->y[i]));
        text_escaped(out, line->name != NULL ? line->name : "");
        text_add(out, " ");
        add_value(out, c, line->y[i]);
        text_add(out, " at ");
        text_number(out, line->x[i], 2);
        text_add(out, " ");
        text_escaped(out, c->x_unit);
        text_add(out, "</title></circle>");
    }
}

static void add_readout(text *out, const line_chart *c, double x)
{
    text_number(out, x, 2);
    text_add(out, " ");
    text_escaped(out, c->x_unit);
    for (size_t s = 0; s < c->series_count; s++) {
        const chart_series *line = &c->series[s];
        if (line->style != CHART_LINE)
            continue;
        size_t nearest = line->count;
        for (size_t i = 0; i < line->count; i++)
            if (can_show(c, line->x[i], line->y[i]) && (nearest == line->count || fabs(line->x[i] - x) < fabs(line->x[nearest] - x)))
                nearest = i;
        if (nearest == line->count)
            continue;
        text_add(out, " \xc2\xb7 ");
        text_escaped(out, line->name);
        text_add(out, " ");
        add_value(out, c, line->y[nearest]);
    }
}

/** Invisible columns over the plot; the one under the pointer shows a guide and the values there (a tap does it on a phone). */
static void draw_strips(text *out, const line_chart *c, const axes *a)
{
    const double width = (double)(RIGHT - LEFT) / STRIPS;
    for (int i = 0; i < STRIPS; i++) {
        const double left = LEFT + i * width, middle = left + width / 2, x = a->x_low + (a->x_high - a->x_low) * (i + 0.5) / STRIPS;
        text_format(out, "<g class=\"tip\"><rect x=\"%.1f\" y=\"%d\" width=\"%.1f\" height=\"%d\"><title>", left, TOP, width, BOTTOM - TOP);
        add_readout(out, c, x);
        text_format(out, "</title></rect><line x1=\"%.1f\" y1=\"%d\" x2=\"%.1f\" y2=\"%d\"/><text x=\"%d\" y=\"%d\">", middle, TOP, middle, BOTTOM, RIGHT,
                    TOP - 12);
        add_readout(out, c, x);
        text_add(out, "</text></g>");
    }
}

static void draw_legend(text *out, const line_chart *c)
{
    text_add(out, "<p class=\"legend\">");
    for (size_t s = 0; s < c->series_count; s++) {
        const chart_series *line = &c->series[s];
        if (line->name == NULL || line->count == 0)
            continue;
        text_format(out, "<span class=\"key %s c%d\">", line->style == CHART_DOTS ? "dots" : line->style == CHART_FAINT ? "faint" : "line", line->color & 3);
        text_escaped(out, line->name);
        text_add(out, "</span>");
    }
    text_add(out, "</p>");
}

void chart_lines(text *out, const line_chart *c)
{
    text_add(out, "<figure class=\"chart card\"><figcaption><h3>");
    text_escaped(out, c->title);
    text_add(out, "</h3>");
    axes a;
    if (!find_range(c, &a)) {
        text_add(out, "</figcaption><p class=\"none\">n/a: nothing was logged.</p></figure>\n");
        return;
    }
    draw_legend(out, c);
    text_format(out, "</figcaption><svg viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"", WIDTH, HEIGHT);
    text_escaped(out, c->title);
    text_add(out, " over training time\">");
    draw_axes(out, c, &a);
    draw_marks(out, c, &a);
    for (int pass = 0; pass < 2; pass++) /* what is faint lies below */
        for (size_t s = 0; s < c->series_count; s++)
            if (c->series[s].count > 0 && (pass == 0 ? c->series[s].style == CHART_FAINT : c->series[s].style == CHART_LINE))
                draw_line(out, c, &c->series[s], &a);
    draw_strips(out, c, &a);
    for (size_t s = 0; s < c->series_count; s++)
        if (c->series[s].style == CHART_DOTS)
            draw_dots(out, c, &c->series[s], &a);
    text_add(out, "</svg>");
    if (c->note != NULL) {
        text_add(out, "<p class=\"note\">");
        text_escaped(out, c->note);
        text_add(out, "</p>");
    }
    text_add(out, "</figure>\n");
}

/* ---- bars --------------------------------------------------------------------------------------------------------------------- */

static bool is_amount(double value)
{
    return isfinite(value) && value >= 0 && value < value_limit;
}

void chart_bars(text *out, const char *title, const char *unit, const chart_bar *bars, size_t count, double whole)
{
    enum { BAR_LEFT = 140, BAR_RIGHT = 352, ROW = 24, BAR = 15 };
    double longest = 0, sum = 0;
    for (size_t i = 0; i < count; i++)
        if (is_amount(bars[i].value))
            longest = fmax(longest, bars[i].value), sum += bars[i].value;
    if (!(is_amount(whole) && whole > 0))
        whole = sum;
    text_add(out, "<figure class=\"chart card\"><figcaption><h3>");
    text_escaped(out, title);
    text_add(out, "</h3></figcaption>");
    if (!(longest > 0)) {
        text_add(out, "<p class=\"none\">n/a: nothing was measured.</p></figure>\n");
        return;
    }
    text_format(out, "<svg viewBox=\"0 0 %d %zu\" role=\"img\" aria-label=\"", WIDTH, count * ROW + 4);
    text_escaped(out, title);
    text_add(out, "\">");
    for (size_t i = 0; i < count; i++) {
        const size_t top = i * ROW + 4, base = top + 12;
        text_format(out, "<g class=\"bar\"><title>");
        text_escaped(out, bars[i].name);
        text_add(out, ": ");
        text_number(out, bars[i].value, 2);
        text_add(out, " ");
        text_escaped(out, unit);
        text_format(out, "</title><text class=\"name\" x=\"%d\" y=\"%zu\">", BAR_LEFT - 8, base);
        text_escaped(out, bars[i].name);
        text_add(out, "</text>");
        if (!is_amount(bars[i].value)) {
            text_format(out, "<text x=\"%d\" y=\"%zu\">n/a</text></g>", BAR_LEFT + 6, base);
            continue;
        }
        const double width = fmax((BAR_RIGHT - BAR_LEFT) * (bars[i].value / longest), 1);
        text_format(out, "<rect x=\"%d\" y=\"%zu\" width=\"%.1f\" height=\"%d\" rx=\"2\"/><text x=\"%.1f\" y=\"%zu\">", BAR_LEFT, top, width, BAR,
                    BAR_LEFT + width + 6, base);
        text_number(out, bars[i].value, bars[i].value < 9.995 ? 2 : bars[i].value < 99.95 ? 1 : 0);
        text_add(out, " ");
        text_escaped(out, unit);
        text_format(out, " <tspan>%.1f %%</tspan></text></g>", 100 * bars[i].value / whole);
    }
    text_add(out, "</svg></figure>\n");
}
