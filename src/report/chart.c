/* SPDX-License-Identifier: Apache-2.0 */
/* report/chart.c -- line charts as inline SVG. */
#include <math.h>
#include <stdio.h>

#include "report/chart.h"
#include "report/plot.h"

enum { PATH_POINTS = 400, STRIPS = 80 };

static void draw_dot(text *out, const plot *p, int color, double x, double y)
{
    text_format(out, "<circle class=\"dot c%d\" cx=\"%.1f\" cy=\"%.1f\" r=\"4\"", color & 3, plot_x(p, x),
                plot_y(p, y));
}

/* A single point has no line: draw a dot. */
static void draw_line(text *out, const chart_series *line, const plot *p)
{
    const size_t per_point = (line->count + PATH_POINTS - 1) / PATH_POINTS;
    size_t points = 0;
    double last_x = 0, last_y = 0;
    bool is_open = false;
    text_format(out, "<path class=\"%s c%d\" d=\"", line->style == CHART_FAINT ? "faint" : "line",
                line->color & 3);
    for (size_t i = 0; i < line->count; i += per_point) {
        double x = 0, y = 0, n = 0;
        for (size_t j = i; j < line->count && j < i + per_point; j++)
            if (plot_can_show(p, line->x[j], line->y[j])) {
                x += line->x[j];
                y += line->y[j];
                n++;
            }
        if (n == 0) /* gaps (a score between two rows) are bridged */
            continue;
        last_x = x / n, last_y = y / n;
        plot_line_to(out, p, &is_open, last_x, last_y);
        points++;
    }
    text_add(out, "\"/>");
    if (points != 1 || line->style == CHART_FAINT)
        return;
    draw_dot(out, p, line->color, last_x, last_y);
    text_add(out, "/>");
}

static void add_value(text *out, const line_chart *c, double y)
{
    if (c->y_decimals < 0)
        text_count(out, y);
    else
        text_number(out, y, c->y_decimals);
}

static void draw_dots(text *out, const line_chart *c, const chart_series *line, const plot *p)
{
    for (size_t i = 0; i < line->count; i++) {
        if (!plot_can_show(p, line->x[i], line->y[i]))
            continue;
        draw_dot(out, p, line->color, line->x[i], line->y[i]);
        text_add(out, "><title>");
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

static void add_readout(text *out, const line_chart *c, const plot *p, double x)
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
            if (plot_can_show(p, line->x[i], line->y[i]) &&
                (nearest == line->count || fabs(line->x[i] - x) < fabs(line->x[nearest] - x)))
                nearest = i;
        if (nearest == line->count)
            continue;
        text_add(out, " \xc2\xb7 ");
        text_escaped(out, line->name);
        text_add(out, " ");
        add_value(out, c, line->y[nearest]);
    }
}

/** Invisible strips over the plot: the one under the pointer shows a guide line and the values there. On a
    phone a tap does the same. */
static void draw_strips(text *out, const line_chart *c, const plot *p)
{
    const double width = (double)(CHART_RIGHT - CHART_LEFT) / STRIPS;
    for (int i = 0; i < STRIPS; i++) {
        const double left = CHART_LEFT + i * width, middle = left + width / 2,
                     x = p->x.low + (p->x.high - p->x.low) * (i + 0.5) / STRIPS;
        text_format(out, "<g class=\"tip\"><rect x=\"%.1f\" y=\"%d\" width=\"%.1f\" height=\"%d\"><title>",
                    left, CHART_TOP, width, CHART_BOTTOM - CHART_TOP);
        add_readout(out, c, p, x);
        text_format(
            out, "</title></rect><line x1=\"%.1f\" y1=\"%d\" x2=\"%.1f\" y2=\"%d\"/><text x=\"%d\" y=\"%d\">",
            middle, CHART_TOP, middle, CHART_BOTTOM, CHART_RIGHT, CHART_TOP - 12);
        add_readout(out, c, p, x);
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
        text_format(out, "<span class=\"key %s c%d\">",
                    line->style == CHART_DOTS    ? "dots"
                    : line->style == CHART_FAINT ? "faint"
                                                 : "line",
                    line->color & 3);
        text_escaped(out, line->name);
        text_add(out, "</span>");
    }
    text_add(out, "</p>");
}

/* The y axis ends at round numbers; x goes from 0, the start of the run, to the last value. */
static bool find_plot(const line_chart *c, const char *x_label, plot *p)
{
    *p = (plot){.left = CHART_LEFT,
                .right = CHART_RIGHT,
                .top = CHART_TOP,
                .bottom = CHART_BOTTOM,
                .x = {.label = x_label, .wanted = 6},
                .y = {.label = c->y_unit, .log = c->log_y, .from_ticks = true, .grid = true, .wanted = 5}};
    plot_clear(p);
    for (size_t s = 0; s < c->series_count; s++)
        for (size_t i = 0; i < c->series[s].count; i++)
            plot_take(p, c->series[s].x[i], c->series[s].y[i]);
    if (c->from_zero) {
        p->y.low = fmin(p->y.low, 0);
        p->y.high = fmax(p->y.high, 0);
    }
    p->x.low = fmin(p->x.low, 0);
    return plot_close(p);
}

void chart_lines(text *out, const line_chart *c)
{
    text_add(out, "<figure class=\"chart card\"><figcaption><h3>");
    text_escaped(out, c->title);
    text_add(out, "</h3>");
    plot p;
    char x_label[64];
    snprintf(x_label, sizeof x_label, "training time, %s", c->x_unit);
    if (!find_plot(c, x_label, &p)) {
        text_add(out, "</figcaption><p class=\"none\">n/a: nothing was logged.</p></figure>\n");
        return;
    }
    draw_legend(out, c);
    text_format(out, "</figcaption><svg viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"", CHART_WIDTH,
                CHART_HEIGHT);
    text_escaped(out, c->title);
    text_add(out, " over training time\">");
    plot_draw_axes(out, &p);
    for (int pass = 0; pass < 2; pass++) /* faint series first, below the others */
        for (size_t s = 0; s < c->series_count; s++)
            if (c->series[s].count > 0 &&
                (pass == 0 ? c->series[s].style == CHART_FAINT : c->series[s].style == CHART_LINE))
                draw_line(out, &c->series[s], &p);
    draw_strips(out, c, &p);
    for (size_t s = 0; s < c->series_count; s++)
        if (c->series[s].style == CHART_DOTS)
            draw_dots(out, c, &c->series[s], &p);
    text_add(out, "</svg>");
    if (c->note != NULL) {
        text_add(out, "<p class=\"note\">");
        text_escaped(out, c->note);
        text_add(out, "</p>");
    }
    text_add(out, "</figure>\n");
}
