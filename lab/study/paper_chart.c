/* SPDX-License-Identifier: Apache-2.0 */
/* study/paper_chart.c -- the charts of the study "paper": spreads by scene and variant, and anchors against
   PSNR. */
#include <math.h>
#include <stdio.h>

#include "report/chart.h"
#include "study/chart.h"
#include "study/paper.h"

/* A panel per scene: a row per variant, and two plots side by side. */
enum { NAMES_RIGHT = 196, PLOT_WIDTH = 252, PLOT_GAP = 38, ROW = 24, HEAD = 66, FOOT = 42, MARGIN = 12 };

static const char css[] =
    ".scatter .seed{fill:var(--k);opacity:.45}.scatter .bar{stroke:var(--k);stroke-width:2}.scatter "
    ".name{text-anchor:end;fill:var(--text)}\n";

typedef struct plot {
    paper_figure figure;
    double left, low, high;
} plot;

static double place(const plot *p, double value)
{
    return p->left + PLOT_WIDTH * (value - p->low) / (p->high - p->low);
}

static int panel_height(size_t variant_count) { return HEAD + ROW * (int)variant_count + FOOT; }

/* Everything that will be drawn: means, their spreads, single seeds. False without any of it. */
static bool find_range(const paper_study *s, size_t scene, const paper_variant_id *variants, size_t count,
                       plot *p)
{
    p->low = INFINITY;
    p->high = -INFINITY;
    for (size_t v = 0; v < count; v++) {
        const stat_sample stat = paper_stat(s, scene, variants[v], p->figure);
        const double reach = isfinite(stat.deviation) ? stat.deviation : 0;
        if (isfinite(stat.mean)) {
            p->low = fmin(p->low, stat.mean - reach);
            p->high = fmax(p->high, stat.mean + reach);
        }
        for (int seed = 0; seed < s->grid.seeds; seed++) {
            const double value = paper_figure_of(paper_run(s, scene, variants[v], seed), p->figure);
            if (isfinite(value)) {
                p->low = fmin(p->low, value);
                p->high = fmax(p->high, value);
            }
        }
    }
    return p->low <= p->high && fmax(fabs(p->low), fabs(p->high)) < 1e15;
}

static void draw_frame(text *out, plot *p, int top, int bottom)
{
    double ticks[CHART_MAX_TICKS];
    const int count = chart_ticks(p->low, p->high, 4, ticks);
    p->low = ticks[0];
    p->high = ticks[count - 1];
    for (int i = 0; i < count; i++)
        text_format(
            out,
            "<path class=\"rule\" d=\"M%.1f %dV%d\"/><text class=\"tick-x\" x=\"%.1f\" y=\"%d\">%.6g</text>",
            place(p, ticks[i]), top, bottom, place(p, ticks[i]), bottom + 17, ticks[i]);
    text_format(out, "<text x=\"%.1f\" y=\"%d\">%s</text>", p->left, top - 10,
                paper_figure_texts[p->figure].value_name);
}

static void draw_row(text *out, const paper_study *s, size_t scene, paper_variant_id variant, const plot *p,
                     int y)
{
    const stat_sample stat = paper_stat(s, scene, variant, p->figure);
    const int color = variant == PAPER_VOXEL || variant == PAPER_VOXEL_SCALED ? 2 : 1;
    if (!isfinite(stat.mean))
        return;
    if (isfinite(stat.deviation))
        text_format(out, "<path class=\"bar s%d\" d=\"M%.1f %dH%.1f\"/>", color,
                    place(p, stat.mean - stat.deviation), y, place(p, stat.mean + stat.deviation));
    for (int seed = 0; seed < s->grid.seeds; seed++) {
        const double value = paper_figure_of(paper_run(s, scene, variant, seed), p->figure);
        if (isfinite(value))
            text_format(out, "<circle class=\"seed s%d\" cx=\"%.1f\" cy=\"%d\" r=\"2.5\"/>", color,
                        place(p, value), y);
    }
    text_format(out, "<circle class=\"mark s%d\" cx=\"%.1f\" cy=\"%d\" r=\"5\"><title>", color,
                place(p, stat.mean), y);
    stat_add(out, &stat, paper_figure_texts[p->figure].decimals, false);
    text_add(out, "</title></circle>");
}

static void draw_panel(text *out, const paper_study *s, size_t scene, const paper_variant_id *variants,
                       size_t count, int top)
{
    const int bottom = HEAD + ROW * (int)count;
    text_format(out, "<g transform=\"translate(0 %d)\"><text class=\"title\" x=\"10\" y=\"24\">", top);
    text_escaped(out, s->grid.names[scene]);
    text_add(out, "</text>");
    for (size_t v = 0; v < count; v++)
        text_format(out, "<text class=\"name\" x=\"%d\" y=\"%d\">%s</text>", NAMES_RIGHT - MARGIN,
                    HEAD + ROW * (int)v + ROW / 2 + 4, paper_variants[variants[v]].says);
    for (int i = 0; i < 2; i++) {
        plot p = {.figure = i == 0 ? PAPER_FINAL : PAPER_PSNR,
                  .left = NAMES_RIGHT + i * (PLOT_WIDTH + PLOT_GAP)};
        if (!find_range(s, scene, variants, count, &p))
            continue;
        draw_frame(out, &p, HEAD, bottom);
        for (size_t v = 0; v < count; v++)
            draw_row(out, s, scene, variants[v], &p, HEAD + ROW * (int)v + ROW / 2);
    }
    text_add(out, "</g>");
}

/* ---- anchors against PSNR ---- */

static void draw_growth(text *out, const paper_study *s, size_t scene, int top)
{
    static const struct {
        int table, series;
        paper_variant_id variant;
        const char *label;
    } marks[] = {
        {3, 2, PAPER_VOXEL_SIXTH, "1/6"}, {3, 2, PAPER_VOXEL_THIRD, "1/3"}, {3, 2, PAPER_VOXEL, "1/2"},
        {3, 1, PAPER_GBSP_SIXTH, "1/6"},  {3, 1, PAPER_GBSP_THIRD, "1/3"},  {3, 1, PAPER_GBSP, "1/2"},
        {4, 3, PAPER_DEPTH_10, "D 10"},   {4, 3, PAPER_DEPTH_12, "D 12"},   {4, 3, PAPER_DEPTH_14, "D 14"},
        {4, 3, PAPER_DEPTH_16, "D 16"},   {4, 3, PAPER_GBSP, "D 18"}};
    enum { MARKS = sizeof marks / sizeof *marks };
    scatter_point points[MARKS];
    char title[STUDY_NAME_SIZE + 40];
    snprintf(title, sizeof title, "%s: anchors against PSNR", s->grid.names[scene]);
    scatter_chart chart = {.title = title,
                           .note = "means over the seeds",
                           .x_unit = "final anchors (log)",
                           .y_unit = "held-out PSNR, dB",
                           .points = points};
    if (s->has_table[3])
        chart.series[1] = "balls, growth to", chart.series[2] = "voxels, growth to";
    if (s->has_table[4])
        chart.series[3] = "balls, D_max";
    for (size_t i = 0; i < MARKS; i++)
        if (s->has_table[marks[i].table])
            points[chart.point_count++] =
                (scatter_point){marks[i].series, paper_stat(s, scene, marks[i].variant, PAPER_FINAL).mean,
                                paper_stat(s, scene, marks[i].variant, PAPER_PSNR).mean, marks[i].label};
    scatter_draw(out, &chart, top);
}

/* ---- the picture ---- */

void paper_charts(const paper_study *s, text *out)
{
    const int spread_table = s->has_table[2] ? 2 : s->has_table[1] ? 1 : 0;
    const bool has_growth = s->has_table[3] || s->has_table[4];
    const paper_variant_id *variants = NULL;
    const size_t count = spread_table > 0 ? paper_table_variants(spread_table, &variants) : 0;
    const int spread = spread_table > 0 ? panel_height(count) : 0,
              one = spread + (has_growth ? SCATTER_HEIGHT : 0);
    scatter_begin(out, "anchors and PSNR by start", css, one * (int)s->grid.scene_count);
    for (size_t scene = 0; scene < s->grid.scene_count; scene++) {
        if (spread_table > 0)
            draw_panel(out, s, scene, variants, count, (int)scene * one);
        if (has_growth)
            draw_growth(out, s, scene, (int)scene * one + spread);
    }
    text_add(out, "</svg>\n");
}
