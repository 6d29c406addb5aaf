/* SPDX-License-Identifier: Apache-2.0 */
/* report/plot.c -- axes of charts: round ticks, labels, data to chart coordinates; and the frame of an SVG
   file. */
#include "report/plot.h"

#include <math.h>

/* ---- ticks ---- */

/** The smallest number 1, 2 or 5 times a power of ten that is >= x > 0. */
static double round_up(double x)
{
    const double power = pow(10, floor(log10(x))), digit = x / power;
    return power * (digit <= 1.0000001 ? 1 : digit <= 2.0000001 ? 2 : digit <= 5.0000001 ? 5 : 10);
}

int chart_ticks(double low, double high, int wanted, double *ticks)
{
    double span = high - low;
    if (!(span > 1e-9 * fmax(fabs(low), fabs(high)))) /* equal up to rounding: make a step around them */
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
    int first = 3 * (int)floor(log10(low)), last; /* tick k is digits[k mod 3] * 10^floor(k / 3) */
    int stride = 1;
#define LOG_TICK(k) (digits[(((k) % 3) + 3) % 3] * pow(10, floor((k) / 3.0)))
    while (LOG_TICK(first + 1) <= low * 1.0000001)
        first++;
    last = first + 1;
    while (LOG_TICK(last) < high * 0.9999999)
        last++;
    if (last - first + 1 > 8) { /* too many: powers of ten only, of these every n-th */
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

/** A tick label, short enough for an axis (20k, 1.5M), with enough digits to distinguish neighbours that are
    `step` apart. */
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
    else if (size >= 1e16 || size < 9e-5)
        text_format(out, "%.2g", value);
    else {
        const double digits = ceil(-log10(step / units[i].unit) - 1e-6);
        text_format(out, "%.*f%s", (int)fmin(fmax(digits, 0), 6), value / units[i].unit, units[i].suffix);
    }
}

/* ---- values ---- */

/* Beyond this limit, differences and powers of ten may overflow a double; no measurement comes near it. */
static const double value_limit = 1e100;

static bool axis_can_show(const plot_axis *a, double value)
{
    return isfinite(value) && fabs(value) < value_limit && (!a->log || value > 1 / value_limit);
}

bool plot_can_show(const plot *p, double x, double y)
{
    return axis_can_show(&p->x, x) && axis_can_show(&p->y, y);
}

void plot_clear(plot *p)
{
    p->x.low = p->y.low = INFINITY;
    p->x.high = p->y.high = -INFINITY;
}

void plot_take(plot *p, double x, double y)
{
    if (!plot_can_show(p, x, y))
        return;
    p->x.low = fmin(p->x.low, x);
    p->x.high = fmax(p->x.high, x);
    p->y.low = fmin(p->y.low, y);
    p->y.high = fmax(p->y.high, y);
}

static void close_axis(plot_axis *a)
{
    a->tick_count = 0;
    if (a->wanted == 0)
        return;
    a->tick_count = a->log ? chart_log_ticks(a->low, a->high, a->ticks)
                           : chart_ticks(a->low, a->high, a->wanted, a->ticks);
    if (a->from_ticks) {
        a->low = a->ticks[0];
        a->high = a->ticks[a->tick_count - 1];
    } else if (a->high <= a->low) {
        a->high = a->ticks[a->tick_count - 1];
    }
}

bool plot_close(plot *p)
{
    if (!(p->x.low <= p->x.high))
        return false;
    close_axis(&p->x);
    close_axis(&p->y);
    return true;
}

static double share(const plot_axis *a, double value)
{
    return a->log ? log(value / a->low) / log(a->high / a->low) : (value - a->low) / (a->high - a->low);
}

double plot_x(const plot *p, double x) { return p->left + (p->right - p->left) * share(&p->x, x); }

double plot_y(const plot *p, double y) { return p->bottom - (p->bottom - p->top) * share(&p->y, y); }

/* ---- drawing ---- */

static void add_axis_tick(text *out, const plot_axis *a, int i)
{
    const double step = a->log ? pow(10, floor(log10(a->ticks[i]) + 1e-9)) : a->ticks[1] - a->ticks[0];
    add_tick_label(out, a->ticks[i], step);
    text_add(out, "</text>");
}

/* Whether a tick lies outside the axis, which can be where the axis ends with the values. */
static bool is_outside(const plot_axis *a, double tick)
{
    return tick < a->low - 1e-9 * fabs(a->low) || tick > a->high + 1e-9 * fabs(a->high);
}

static void draw_grid(text *out, const plot *p)
{
    text_add(out, "<g class=\"grid\">");
    for (int i = 0; i < p->y.tick_count && p->y.grid; i++)
        text_format(out, "<line x1=\"%d\" y1=\"%.1f\" x2=\"%d\" y2=\"%.1f\"/>", p->left,
                    plot_y(p, p->y.ticks[i]), p->right, plot_y(p, p->y.ticks[i]));
    for (int i = 0; i < p->x.tick_count && p->x.grid; i++)
        if (!is_outside(&p->x, p->x.ticks[i]))
            text_format(out, "<line x1=\"%.1f\" y1=\"%d\" x2=\"%.1f\" y2=\"%d\"/>", plot_x(p, p->x.ticks[i]),
                        p->top, plot_x(p, p->x.ticks[i]), p->bottom);
    text_add(out, "</g>");
}

static void draw_x(text *out, const plot *p)
{
    text_add(out, "<g class=\"x\">");
    for (int i = 0; i < p->x.tick_count; i++) {
        const double at = plot_x(p, p->x.ticks[i]);
        if (is_outside(&p->x, p->x.ticks[i]))
            continue;
        text_format(out, "<line x1=\"%.1f\" y1=\"%d\" x2=\"%.1f\" y2=\"%d\"/><text x=\"%.1f\" y=\"%d\">", at,
                    p->bottom, at, p->bottom + 4, at, p->bottom + 18);
        add_axis_tick(out, &p->x, i);
    }
    text_format(out, "<line x1=\"%d\" y1=\"%d\" x2=\"%d\" y2=\"%d\"/>", p->left, p->bottom, p->right,
                p->bottom);
    if (p->x.label != NULL) {
        text_format(out, "<text class=\"unit\" x=\"%d\" y=\"%d\">", (p->left + p->right) / 2, p->bottom + 36);
        text_escaped(out, p->x.label);
        text_add(out, "</text>");
    }
    text_add(out, "</g>");
}

void plot_draw_axes(text *out, const plot *p)
{
    draw_grid(out, p);
    text_add(out, "<g class=\"y\">");
    for (int i = 0; i < p->y.tick_count; i++) {
        text_format(out, "<text x=\"%d\" y=\"%.1f\">", p->left - 7, plot_y(p, p->y.ticks[i]) + 4);
        add_axis_tick(out, &p->y, i);
    }
    text_add(out, "</g>");
    draw_x(out, p);
    if (p->y.label == NULL)
        return;
    text_format(out, "<text class=\"unit\" x=\"%d\" y=\"%d\">", p->left - 44, p->top - 12);
    text_escaped(out, p->y.label);
    text_add(out, "</text>");
}

void plot_line_to(text *out, const plot *p, bool *open, double x, double y)
{
    text_format(out, "%s%.1f %.1f", *open ? "L" : "M", plot_x(p, x), plot_y(p, y));
    *open = true;
}

/* ---- files ---- */

static const char plot_css[] =
    ".plot{--k0:#1b1c1e;--k1:#0b62c4;--k2:#d9480f;--k3:#2b8a3e;--k4:#7b3fc4;--k5:#b0246e;--k6:#0a7f8c;--"
    "page:#fff;--text:#1b1c1e;--dim:#62666d;--rule:#e8e8e5}\n"
    "@media(prefers-color-scheme:dark){.plot{--k0:#f2f2f0;--k1:#6cb0ff;--k2:#ff9a5c;--k3:#6fd08c;--k4:#"
    "c19bff;--k5:#ff8cc2;--k6:#5fd3e0;--page:#1c1e22;--text:#e8e8e6;--dim:#9ba0a8;--rule:#2e3136}}\n"
    ".plot .paper{fill:var(--page)}\n"
    ".plot text{font:12px system-ui,-apple-system,\"Segoe UI\",Roboto,Arial,sans-serif;fill:var(--dim)}\n"
    ".plot .title{font-size:15px;font-weight:600;fill:var(--text)}\n"
    ".plot .key{fill:var(--text)}\n"
    ".plot .y text{text-anchor:end}.plot .x text{text-anchor:middle}\n"
    ".plot .grid line{stroke:var(--rule);stroke-width:1}.plot .x line{stroke:var(--dim);stroke-width:1}\n"
    ".plot .s0{--k:var(--k0)}.plot .s1{--k:var(--k1)}.plot .s2{--k:var(--k2)}.plot .s3{--k:var(--k3)}.plot "
    ".s4{--k:var(--k4)}.plot .s5{--k:var(--k5)}.plot .s6{--k:var(--k6)}\n";

void plot_begin(text *out, const char *label, const char *css, const char *more, int width, int height)
{
    text_format(out,
                "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot\" viewBox=\"0 0 %d %d\" width=\"%d\" "
                "height=\"%d\" role=\"img\" aria-label=\"%s\"><style>",
                width, height, width, height, label);
    text_add(out, plot_css);
    text_add(out, css);
    text_add(out, more);
    text_format(out, "</style><rect class=\"paper\" width=\"%d\" height=\"%d\" rx=\"12\"/>\n", width, height);
}
