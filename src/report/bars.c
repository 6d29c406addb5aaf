/* SPDX-License-Identifier: Apache-2.0 */
/* report/bars.c -- the parts of a whole as inline SVG: a bar chart, and a stacked area chart over time. */
#include <math.h>
#include <stdio.h>

#include "report/chart.h"
#include "report/plot.h"

static bool is_amount(double value) { return isfinite(value) && value >= 0 && value < 1e100; }

void chart_bars(text *out, const char *title, const char *unit, const chart_bar *bars, size_t count,
                double whole)
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
    text_format(out, "<svg viewBox=\"0 0 %d %zu\" role=\"img\" aria-label=\"", CHART_WIDTH, count * ROW + 4);
    text_escaped(out, title);
    text_add(out, "\">");
    for (size_t i = 0; i < count; i++) {
        const size_t top = i * ROW + 4, base = top + 12;
        text_format(out, "<g class=\"bar s%d\"><title>", bars[i].color);
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
        text_format(
            out,
            "<rect x=\"%d\" y=\"%zu\" width=\"%.1f\" height=\"%d\" rx=\"2\"/><text x=\"%.1f\" y=\"%zu\">",
            BAR_LEFT, top, width, BAR, BAR_LEFT + width + 6, base);
        text_number(out, bars[i].value, bars[i].value < 9.995 ? 2 : bars[i].value < 99.95 ? 1 : 0);
        text_add(out, " ");
        text_escaped(out, unit);
        text_format(out, " <tspan>%.1f %%</tspan></text></g>", 100 * bars[i].value / whole);
    }
    text_add(out, "</svg></figure>\n");
}

/* ---- layers ---- */

enum { STEPS = 60, LAYERS_MAX = 16 };

typedef struct stack {
    size_t count, layer_count;
    double x[STEPS], top[LAYERS_MAX + 1][STEPS]; /* top[k + 1]: upper edge of layer k; top[0] is 0 */
} stack;

/** Average neighbouring rows into at most STEPS steps. Steps without a complete row are left out. */
static void average(const double *x, size_t count, const chart_layer *layers, size_t layer_count, stack *s)
{
    const size_t per_step = (count + STEPS - 1) / STEPS;
    *s = (stack){.layer_count = layer_count < LAYERS_MAX ? layer_count : LAYERS_MAX};
    for (size_t first = 0; first < count; first += per_step) {
        double sum_x = 0, sum[LAYERS_MAX] = {0};
        size_t rows = 0;
        for (size_t i = first; i < count && i < first + per_step; i++) {
            bool known = fabs(x[i]) < 1e100;
            for (size_t k = 0; k < s->layer_count; k++)
                known = known && is_amount(layers[k].y[i]);
            for (size_t k = 0; k < s->layer_count && known; k++)
                sum[k] += layers[k].y[i];
            sum_x += known ? x[i] : 0;
            rows += known;
        }
        if (rows == 0)
            continue;
        s->x[s->count] = sum_x / (double)rows;
        for (size_t k = 0; k < s->layer_count; k++)
            s->top[k + 1][s->count] = s->top[k][s->count] + sum[k] / (double)rows;
        s->count++;
    }
}

static void draw_layer(text *out, const stack *s, size_t layer, const plot *p, const char *name, int color)
{
    bool open = false;
    text_format(out, "<path class=\"area s%d\" d=\"", color);
    for (size_t i = 0; i < s->count; i++)
        plot_line_to(out, p, &open, s->x[i], s->top[layer + 1][i]);
    for (size_t i = s->count; i-- > 0;)
        plot_line_to(out, p, &open, s->x[i], s->top[layer][i]);
    text_add(out, "Z\"><title>");
    text_escaped(out, name);
    text_add(out, "</title></path>");
}

void chart_stack(text *out, const char *title, const char *x_unit, const char *y_unit, const double *x,
                 size_t count, const chart_layer *layers, size_t layer_count)
{
    stack s;
    char x_label[64];
    average(x, count, layers, layer_count, &s);
    if (s.count == 1) { /* a single row is the mean over all the time before it */
        s.x[1] = s.x[0], s.x[0] = 0;
        for (size_t k = 0; k <= s.layer_count; k++)
            s.top[k][1] = s.top[k][0];
        s.count = 2;
    }
    snprintf(x_label, sizeof x_label, "training time, %s", x_unit);
    plot p = {.left = CHART_LEFT,
              .right = CHART_RIGHT,
              .top = CHART_TOP,
              .bottom = CHART_BOTTOM,
              .x = {.label = x_label, .wanted = 6},
              .y = {.label = y_unit, .from_ticks = true, .grid = true, .wanted = 5}};
    plot_clear(&p);
    plot_take(&p, 0, 0);
    for (size_t i = 0; i < s.count; i++)
        plot_take(&p, s.x[i], s.top[s.layer_count][i]);
    text_add(out, "<figure class=\"chart card\"><figcaption><h3>");
    text_escaped(out, title);
    text_add(out, "</h3>");
    if (s.count < 2 || !plot_close(&p)) {
        text_add(out, "</figcaption><p class=\"none\">n/a: nothing was logged.</p></figure>\n");
        return;
    }
    text_add(out, "<p class=\"legend\">");
    for (size_t k = 0; k < s.layer_count; k++) {
        text_format(out, "<span class=\"key block s%d\">", layers[k].color);
        text_escaped(out, layers[k].name);
        text_add(out, "</span>");
    }
    text_format(out, "</p></figcaption><svg viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"", CHART_WIDTH,
                CHART_HEIGHT);
    text_escaped(out, title);
    text_add(out, "\">");
    plot_draw_axes(out, &p);
    for (size_t k = 0; k < s.layer_count; k++)
        draw_layer(out, &s, k, &p, layers[k].name, layers[k].color);
    text_add(out, "</svg></figure>\n");
}
