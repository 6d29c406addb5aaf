/* SPDX-License-Identifier: Apache-2.0 */
/* study/paper_chart.c -- the charts of the study "paper": one dot plot per scene, and anchors against PSNR.
 */
#include <math.h>
#include <stdio.h>

#include "report/plot.h"
#include "study/chart.h"
#include "study/paper.h"

/* One panel per scene, with a row per variant and two plots side by side. */
enum { NAMES_RIGHT = 196, PLOT_WIDTH = 252, PLOT_GAP = 38, ROW = 24, HEAD = 44, FOOT = 42, MARGIN = 12 };

static const char css[] =
    ".plot .seed{fill:var(--k);opacity:.45}.plot .bar{stroke:var(--k);stroke-width:2}.plot "
    ".name{text-anchor:end;fill:var(--text)}\n";

static int panel_height(size_t variant_count) { return HEAD + ROW * (int)variant_count + FOOT; }

/* Fit the axis of one figure to everything that will be drawn: means, spreads, single seeds. False if there
   is nothing. */
static bool find_plot(const paper_study *s, size_t scene, const paper_variant_id *variants, size_t count,
                      paper_figure figure, plot *p)
{
    p->x = (plot_axis){
        .label = paper_figure_texts[figure].value_name, .from_ticks = true, .grid = true, .wanted = 4};
    plot_clear(p);
    for (size_t v = 0; v < count; v++) {
        const stat_sample stat = paper_stat(s, scene, variants[v], figure);
        const double reach = isfinite(stat.deviation) ? stat.deviation : 0;
        plot_take(p, stat.mean - reach, 0);
        plot_take(p, stat.mean + reach, 0);
        for (int seed = 0; seed < s->grid.seeds; seed++)
            plot_take(p, paper_figure_of(paper_run(s, scene, variants[v], seed), figure), 0);
    }
    return plot_close(p);
}

static void draw_row(text *out, const paper_study *s, size_t scene, paper_variant_id variant,
                     paper_figure figure, const plot *p, int y)
{
    const stat_sample stat = paper_stat(s, scene, variant, figure);
    const int color = variant == PAPER_VOXEL || variant == PAPER_VOXEL_SCALED ? 2 : 1;
    if (!isfinite(stat.mean))
        return;
    if (isfinite(stat.deviation))
        text_format(out, "<path class=\"bar s%d\" d=\"M%.1f %dH%.1f\"/>", color,
                    plot_x(p, stat.mean - stat.deviation), y, plot_x(p, stat.mean + stat.deviation));
    for (int seed = 0; seed < s->grid.seeds; seed++) {
        const double value = paper_figure_of(paper_run(s, scene, variant, seed), figure);
        if (isfinite(value))
            text_format(out, "<circle class=\"seed s%d\" cx=\"%.1f\" cy=\"%d\" r=\"2.5\"/>", color,
                        plot_x(p, value), y);
    }
    text_format(out, "<circle class=\"mark s%d\" cx=\"%.1f\" cy=\"%d\" r=\"5\"><title>", color,
                plot_x(p, stat.mean), y);
    stat_add(out, &stat, paper_figure_texts[figure].decimals, false);
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
        const paper_figure figure = i == 0 ? PAPER_FINAL : PAPER_PSNR;
        const int left = NAMES_RIGHT + i * (PLOT_WIDTH + PLOT_GAP);
        plot p = {.left = left, .right = left + PLOT_WIDTH, .top = HEAD, .bottom = bottom};
        if (!find_plot(s, scene, variants, count, figure, &p))
            continue;
        plot_draw_axes(out, &p);
        for (size_t v = 0; v < count; v++)
            draw_row(out, s, scene, variants[v], figure, &p, HEAD + ROW * (int)v + ROW / 2);
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

/* ---- the file ---- */

void paper_charts(const void *study, text *out)
{
    const paper_study *s = study;
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
