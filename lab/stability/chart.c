/* SPDX-License-Identifier: Apache-2.0 */
/* stability/chart.c -- the charts of the study "stability": small panels side by side, each with one curve
   per renderer. */
#include <string.h>

#include "report/plot.h"
#include "stability/stability.h"

/* Sizes of a panel, in its own units. */
enum {
    WIDTH = 430,
    HEIGHT = 316,
    LEFT = 54,
    RIGHT = 412,
    TOP = 106,
    BOTTOM = 264,
    ACROSS = 2,
    NOTE_LETTERS = 68
};

static const char css[] = ".plot text{font-size:11px}\n"
                          ".plot .line{fill:none;stroke:var(--k);stroke-width:2;stroke-linejoin:round}.plot "
                          ".s1.line{stroke-width:2.5}\n"
                          ".plot .dot{fill:var(--k)}\n"
                          ".plot .key{fill:var(--k);font-weight:600}\n";

/* Style classes of report/plot.h for the series: ours, the rasterizer, others. */
static const int colors[STABILITY_SERIES] = {1, 2, 4, 3};

static bool find_plot(const stability_chart *c, plot *p)
{
    *p = (plot){.left = LEFT,
                .right = RIGHT,
                .top = TOP,
                .bottom = BOTTOM,
                .x = {.label = c->x_unit, .log = c->log_x, .wanted = 6},
                .y = {.label = c->y_unit, .log = c->log_y, .from_ticks = true, .grid = true, .wanted = 5}};
    plot_clear(p);
    for (int k = 0; k < STABILITY_SERIES; k++)
        for (size_t i = 0; i < c->series[k].count; i++)
            plot_take(p, c->series[k].x[i], c->series[k].y[i]);
    if (!c->log_y && p->y.low > 0 && p->y.low < 0.4 * p->y.high)
        p->y.low = 0; /* start at zero if that costs little space */
    return plot_close(p);
}

static void draw_series(text *out, const stability_chart *c, int k, const plot *p)
{
    const stability_series *line = &c->series[k];
    bool open = false;
    text_format(out, "<path class=\"line s%d\" d=\"", colors[k]);
    for (size_t i = 0; i < line->count; i++)
        if (plot_can_show(p, line->x[i], line->y[i]))
            plot_line_to(out, p, &open, line->x[i], line->y[i]);
    text_add(out, open ? "\"/>" : "M0 0\"/>");
    for (size_t i = 0; i < line->count && line->count <= 32; i++)
        if (plot_can_show(p, line->x[i], line->y[i]))
            text_format(out,
                        "<circle class=\"dot s%d\" cx=\"%.1f\" cy=\"%.1f\" r=\"3.5\"><title>%.4g: "
                        "%.3g</title></circle>",
                        colors[k], plot_x(p, line->x[i]), plot_y(p, line->y[i]), line->x[i], line->y[i]);
}

/* A legend in one row: the names of the curves, in their colours. */
static void draw_keys(text *out, const stability_chart *c)
{
    double at = 10;
    for (int k = 0; k < STABILITY_SERIES; k++) {
        if (c->series[k].name == NULL || c->series[k].count == 0)
            continue;
        text_format(out, "<text class=\"key s%d\" x=\"%.1f\" y=\"%d\">", colors[k], at, TOP - 28);
        text_escaped(out, c->series[k].name);
        text_add(out, "</text>");
        at += 6.4 * (double)strlen(c->series[k].name) + 14; /* approximate width of the name */
    }
}

/* The note in one line, or in two, broken between words. */
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
    plot p;
    text_format(out, "<g transform=\"translate(%d %d)\"><text class=\"title\" x=\"10\" y=\"24\">", left, top);
    text_escaped(out, c->title);
    text_add(out, "</text>");
    draw_note(out, c->note);
    if (find_plot(c, &p)) {
        plot_draw_axes(out, &p);
        for (int k = STABILITY_SERIES - 1; k >= 0; k--) /* ours on top */
            draw_series(out, c, k, &p);
        draw_keys(out, c);
    } else
        text_format(out, "<text x=\"%d\" y=\"%d\">n/a: nothing was measured.</text>", LEFT, TOP + 20);
    text_add(out, "</g>\n");
}

void stability_draw_charts(const stability_study *study, text *out)
{
    const int rows = study->chart_count > 0 ? (int)(study->chart_count + ACROSS - 1) / ACROSS : 1;
    plot_begin(out, "stability", css, "", ACROSS * WIDTH, rows * HEIGHT);
    for (size_t i = 0; i < study->chart_count; i++)
        draw_panel(out, &study->charts[i], (int)(i % ACROSS) * WIDTH, (int)(i / ACROSS) * HEIGHT);
    text_add(out, "</svg>\n");
}
