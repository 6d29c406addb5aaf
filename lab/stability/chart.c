/* SPDX-License-Identifier: Apache-2.0 */
/* stability/chart.c -- the charts of the study "stability": small panels side by side, each with one curve
   per renderer. */
#include <math.h>
#include <string.h>

#include "report/chart.h"
#include "report/text.h"
#include "stability/stability.h"

/* A panel in its own units. */
enum {
    WIDTH = 430,
    HEIGHT = 316,
    LEFT = 56,
    RIGHT = 412,
    TOP = 106,
    BOTTOM = 264,
    ACROSS = 2,
    NOTE_LETTERS = 68
};

static const char css[] =
    ".panels{--k0:#0b62c4;--k1:#d9480f;--k2:#7b3fc4;--k3:#2b8a3e;--page:#fff;--text:#1b1c1e;--dim:#62666d;--"
    "rule:#e8e8e5}\n"
    "@media(prefers-color-scheme:dark){.panels{--k0:#6cb0ff;--k1:#ff9a5c;--k2:#c19bff;--k3:#6fd08c;--page:#"
    "1c1e22;--text:#e8e8e6;--dim:#9ba0a8;--rule:#2e3136}}\n"
    ".panels .paper{fill:var(--page)}\n"
    ".panels text{font:11px system-ui,-apple-system,\"Segoe UI\",Roboto,Arial,sans-serif;fill:var(--dim)}\n"
    ".panels .title{font-size:15px;font-weight:600;fill:var(--text)}\n"
    ".panels .y{text-anchor:end}.panels .x{text-anchor:middle}\n"
    ".panels .rule{stroke:var(--rule);stroke-width:1}\n"
    ".panels .c0{--k:var(--k0)}.panels .c1{--k:var(--k1)}.panels .c2{--k:var(--k2)}.panels "
    ".c3{--k:var(--k3)}\n"
    ".panels .line{fill:none;stroke:var(--k);stroke-width:2.5;stroke-linejoin:round}.panels .c1.line,.panels "
    ".c2.line{stroke-width:2}\n"
    ".panels .dot{fill:var(--k)}\n"
    ".panels .key{fill:var(--k);font-weight:600}\n";

typedef struct axis {
    double low, high;
    bool log;
    double ticks[CHART_MAX_TICKS];
    int tick_count;
} axis;

static double share(const axis *a, double value)
{
    return a->log ? log(value / a->low) / log(a->high / a->low) : (value - a->low) / (a->high - a->low);
}

static double place_x(const axis *a, double value) { return LEFT + (RIGHT - LEFT) * share(a, value); }

static double place_y(const axis *a, double value) { return BOTTOM - (BOTTOM - TOP) * share(a, value); }

static bool can_show(const stability_chart *c, double x, double y)
{
    return isfinite(x) && isfinite(y) && (!c->log_x || x > 0) && (!c->log_y || y > 0);
}

/* From the points, out to round numbers along y; false without a point. */
static bool find_axes(const stability_chart *c, axis *x, axis *y)
{
    *x = (axis){.low = INFINITY, .high = -INFINITY, .log = c->log_x};
    *y = (axis){.low = INFINITY, .high = -INFINITY, .log = c->log_y};
    for (int k = 0; k < STABILITY_SERIES; k++)
        for (size_t i = 0; i < c->series[k].count; i++) {
            const double at = c->series[k].x[i], value = c->series[k].y[i];
            if (!can_show(c, at, value))
                continue;
            x->low = fmin(x->low, at);
            x->high = fmax(x->high, at);
            y->low = fmin(y->low, value);
            y->high = fmax(y->high, value);
        }
    if (!(x->low < x->high))
        return false;
    x->tick_count =
        x->log ? chart_log_ticks(x->low, x->high, x->ticks) : chart_ticks(x->low, x->high, 6, x->ticks);
    if (!y->log)
        y->low =
            y->low > 0 && y->low < 0.4 * y->high ? 0 : y->low; /* from zero where that costs little room */
    y->tick_count =
        y->log ? chart_log_ticks(y->low, y->high, y->ticks) : chart_ticks(y->low, y->high, 5, y->ticks);
    y->low = y->ticks[0];
    y->high = y->ticks[y->tick_count - 1];
    return true;
}

static void draw_axes(text *out, const stability_chart *c, const axis *x, const axis *y)
{
    for (int i = 0; i < y->tick_count; i++)
        text_format(out,
                    "<line class=\"rule\" x1=\"%d\" y1=\"%.1f\" x2=\"%d\" y2=\"%.1f\"/><text class=\"y\" "
                    "x=\"%d\" y=\"%.1f\">%.4g</text>",
                    LEFT, place_y(y, y->ticks[i]), RIGHT, place_y(y, y->ticks[i]), LEFT - 6,
                    place_y(y, y->ticks[i]) + 4, y->ticks[i]);
    for (int i = 0; i < x->tick_count; i++) {
        const double at = place_x(x, x->ticks[i]);
        if (at < LEFT - 0.5 || at > RIGHT + 0.5)
            continue;
        text_format(out,
                    "<line class=\"rule\" x1=\"%.1f\" y1=\"%d\" x2=\"%.1f\" y2=\"%d\"/><text class=\"x\" "
                    "x=\"%.1f\" y=\"%d\">%.4g</text>",
                    at, BOTTOM, at, BOTTOM + 4, at, BOTTOM + 16, x->ticks[i]);
    }
    text_format(out, "<text class=\"x\" x=\"%d\" y=\"%d\">", (LEFT + RIGHT) / 2, BOTTOM + 34);
    text_escaped(out, c->x_unit);
    text_format(out, "</text><text x=\"%d\" y=\"%d\">", 10, TOP - 10);
    text_escaped(out, c->y_unit);
    text_add(out, "</text>");
}

static void draw_series(text *out, const stability_chart *c, int k, const axis *x, const axis *y)
{
    const stability_series *line = &c->series[k];
    bool open = false;
    text_format(out, "<path class=\"line c%d\" d=\"", k);
    for (size_t i = 0; i < line->count; i++)
        if (can_show(c, line->x[i], line->y[i])) {
            text_format(out, "%s%.1f %.1f", open ? "L" : "M", place_x(x, line->x[i]), place_y(y, line->y[i]));
            open = true;
        }
    text_add(out, open ? "\"/>" : "M0 0\"/>");
    for (size_t i = 0; i < line->count && line->count <= 32; i++)
        if (can_show(c, line->x[i], line->y[i]))
            text_format(out,
                        "<circle class=\"dot c%d\" cx=\"%.1f\" cy=\"%.1f\" r=\"3.5\"><title>%.4g: "
                        "%.3g</title></circle>",
                        k, place_x(x, line->x[i]), place_y(y, line->y[i]), line->x[i], line->y[i]);
}

/* The names of the curves in their colours, in one row. */
static void draw_keys(text *out, const stability_chart *c)
{
    double at = 10;
    for (int k = 0; k < STABILITY_SERIES; k++) {
        if (c->series[k].name == NULL || c->series[k].count == 0)
            continue;
        text_format(out, "<text class=\"key c%d\" x=\"%.1f\" y=\"%d\">", k, at, TOP - 28);
        text_escaped(out, c->series[k].name);
        text_add(out, "</text>");
        at += 6.4 * (double)strlen(c->series[k].name) + 14; /* about the width of its letters */
    }
}

/* One line, or two broken between words. */
static void draw_note(text *out, const char *note)
{
    char lines[2][NOTE_LETTERS + 1] = {"", ""};
    size_t length = strlen(note), cut = length;
    if (length > NOTE_LETTERS)
        for (cut = NOTE_LETTERS; cut > 0 && note[cut] != ' ';)
            cut--;
    memcpy(lines[0], note, cut);
    if (cut < length)
        strncat(lines[1], note + cut + 1, NOTE_LETTERS);
    for (int i = 0; i < 2; i++) {
        text_format(out, "<text x=\"10\" y=\"%d\">", 42 + 14 * i);
        text_escaped(out, lines[i]);
        text_add(out, "</text>");
    }
}

static void draw_panel(text *out, const stability_chart *c, int left, int top)
{
    axis x, y;
    text_format(out, "<g transform=\"translate(%d %d)\"><text class=\"title\" x=\"10\" y=\"24\">", left, top);
    text_escaped(out, c->title);
    text_add(out, "</text>");
    draw_note(out, c->note);
    if (find_axes(c, &x, &y)) {
        draw_axes(out, c, &x, &y);
        for (int k = STABILITY_SERIES - 1; k >= 0; k--) /* ours on top */
            draw_series(out, c, k, &x, &y);
        draw_keys(out, c);
    } else
        text_format(out, "<text x=\"%d\" y=\"%d\">n/a: nothing was measured.</text>", LEFT, TOP + 20);
    text_add(out, "</g>\n");
}

void stability_draw_charts(const stability_study *study, text *out)
{
    const int rows = study->chart_count > 0 ? (int)(study->chart_count + ACROSS - 1) / ACROSS : 1;
    text_format(out,
                "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"panels\" viewBox=\"0 0 %d %d\" "
                "width=\"%d\" role=\"img\" aria-label=\"stability\">\n<style>",
                ACROSS * WIDTH, rows * HEIGHT, ACROSS * WIDTH);
    text_add(out, css);
    text_format(out, "</style><rect class=\"paper\" width=\"%d\" height=\"%d\" rx=\"12\"/>\n", ACROSS * WIDTH,
                rows * HEIGHT);
    for (size_t i = 0; i < study->chart_count; i++)
        draw_panel(out, &study->charts[i], (int)(i % ACROSS) * WIDTH, (int)(i / ACROSS) * HEIGHT);
    text_add(out, "</svg>\n");
}
