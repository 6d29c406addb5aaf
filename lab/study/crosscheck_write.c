/* SPDX-License-Identifier: Apache-2.0 */
/* study/crosscheck_write.c -- the study "crosscheck" as tables, JSON and a chart. */
#include <jansson.h>
#include <math.h>

#include "data/json_out.h"
#include "report/plot.h"
#include "study/crosscheck.h"

enum {
    BAR_HEIGHT = 16,
    BAR_GAP = 6,
    HEAD = 62,
    VIEW_GAP = 26,
    LABEL_WIDTH = 96,
    BARS_RIGHT = 700,
    PICTURE_WIDTH = 760
};

/* What a step changes: in a word or two (step_name), and as a sentence. */
static const char *step_name(cross_step step)
{
    static const char *const names[CROSS_STEPS] = {"tiles", "order", "projection", "dilation", "cut-offs"};
    return names[step];
}

static const char *step_text(cross_step step)
{
    static const char *const texts[CROSS_STEPS] = {
        "the same responses in the same order, found through tiles in place of a tree: rounding alone",
        "blended by the depth of the centres in place of the depth on each ray",
        "the affine projection at the centre in place of the response along the ray",
        "0.3 px^2 added to every projection, in place of the footprint of a run",
        "drawn to 3 std-devs by tiles, and from z = 0.2 on, in place of where the response ends",
    };
    return texts[step];
}

static bool passes(const cross_check *c) { return c->value >= c->limit; }

static size_t count_failures(const cross_study *study)
{
    size_t failures = 0;
    for (size_t m = 0; m < study->model_count; m++)
        for (size_t v = 0; v < study->models[m].view_count; v++)
            for (size_t i = 0; i < CROSS_CHECKS; i++)
                failures += !passes(&study->models[m].views[v].checks[i]);
    return failures;
}

/* ---- tables ---- */

static void add_error_row(text *out, const char *name, const bench_error *a, const bench_error *b)
{
    text_format(out, "| %s | %.1f | %.2g |", name, a->psnr, a->max);
    if (b != NULL)
        text_format(out, " %.1f | %.2g |", b->psnr, b->max);
    text_add(out, "\n");
}

static void add_view_table(const cross_model *model, const cross_view *v, text *out)
{
    text_format(out, "**%s, %s**: %zu Gaussians, %d x %d pixels%s\n\n", model->name, v->name, v->gaussians,
                v->width, v->height,
                v->stand_in ? "; the camera's lens is left out: splats are projected" : "");
    text_add(
        out,
        "| change | dB to the step before | largest | dB to the tracer | largest |\n|---|---|---|---|---|\n");
    for (cross_step step = 0; step < CROSS_STEPS; step++)
        add_error_row(out, step_name(step), &v->step[step], &v->total[step]);
    text_add(out, "\n| own cut-offs, against double | dB | largest |\n|---|---|---|\n");
    add_error_row(out, "tracer", &v->traced, NULL);
    add_error_row(out, "per-ray form", &v->per_ray, NULL);
    add_error_row(out, "EWA form", &v->splat, NULL);
    text_add(out, "\n| row | limit | value | pass |\n|---|---|---|---|\n");
    for (size_t i = 0; i < CROSS_CHECKS; i++)
        text_format(out, "| %s | >= %g | %.5g | %s |\n", v->checks[i].row, v->checks[i].limit,
                    v->checks[i].value, passes(&v->checks[i]) ? "yes" : "**NO**");
}

static void cross_table(const cross_study *study, text *out)
{
    bool first = true;
    for (size_t m = 0; m < study->model_count; m++)
        for (size_t v = 0; v < study->models[m].view_count; v++, first = false) {
            text_add(out, first ? "" : "\n");
            add_view_table(&study->models[m], &study->models[m].views[v], out);
        }
}

static void add_tables(const void *of, text *out)
{
    const cross_study *study = of;
    text_format(out,
                "# Tracer against rasterizer\n\nFrom the tracer's picture to that of 3D Gaussian splatting, "
                "one change at a time; each keeps those before it. Rows beyond their limit: %zu.\n\n",
                count_failures(study));
    for (cross_step step = 0; step < CROSS_STEPS; step++)
        text_format(out, "- **%s**: %s\n", step_name(step), step_text(step));
    text_format(
        out,
        "\nPictures of each view, from the upper left: tracer, splats, their difference x %d, that of the "
        "tiles x %d; order, projection, dilation and cut-offs, each x %d. Differences are the largest of the "
        "three channels, dark to light for 0 to 1. Against double: every 8th pixel in both directions.\n\n",
        (int)CROSS_AMPLIFIED, (int)CROSS_AMPLIFIED_TILES, (int)CROSS_AMPLIFIED);
    cross_table(study, out);
    text_add(out, "\n");
    for (size_t m = 0; m < study->model_count; m++)
        for (size_t v = 0; v < study->models[m].view_count; v++)
            text_format(out, "![%s](%s)\n", study->models[m].views[v].sheet, study->models[m].views[v].sheet);
}

static json_t *error_to_json(const bench_error *e)
{
    return json_pack("{s:f,s:f}", "psnr", e->psnr, "max_error", e->max);
}

static json_t *view_to_json(const cross_view *v)
{
    json_t *rows = json_array(), *chain = json_array();
    for (size_t i = 0; i < CROSS_CHECKS; i++)
        json_array_append_new(
            rows,
            json_pack("{s:s,s:f,s:o,s:b}", "row", v->checks[i].row, "limit", v->checks[i].limit, "value",
                      isfinite(v->checks[i].value) ? json_real(v->checks[i].value) : json_null(), "pass",
                      passes(&v->checks[i])));
    for (cross_step step = 0; step < CROSS_STEPS; step++)
        json_array_append_new(chain,
                              json_pack("{s:s,s:s,s:o,s:o}", "change", step_name(step), "what",
                                        step_text(step), "to_step_before", error_to_json(&v->step[step]),
                                        "to_tracer", error_to_json(&v->total[step])));
    return json_pack("{s:o,s:i,s:i,s:I,s:b,s:o,s:o,s:{s:o,s:o,s:o},s:o}", "view", json_text(v->name), "width",
                     v->width, "height", v->height, "gaussians", (json_int_t)v->gaussians, "pinhole_stand_in",
                     v->stand_in, "chain", chain, "rows", rows, "to_double", "tracer",
                     error_to_json(&v->traced), "per_ray", error_to_json(&v->per_ray), "ewa",
                     error_to_json(&v->splat), "pictures", json_text(v->sheet));
}

static json_t *data_of(const void *of)
{
    const cross_study *study = of;
    json_t *models = json_array();
    for (size_t m = 0; m < study->model_count; m++) {
        json_t *views = json_array();
        for (size_t v = 0; v < study->models[m].view_count; v++)
            json_array_append_new(views, view_to_json(&study->models[m].views[v]));
        json_array_append_new(
            models, json_pack("{s:o,s:o}", "model", json_text(study->models[m].name), "views", views));
    }
    return json_pack("{s:i,s:i,s:o}", "amplified", (int)CROSS_AMPLIFIED, "amplified_tiles",
                     (int)CROSS_AMPLIFIED_TILES, "models", models);
}

/* ---- chart ---- */

static const char bar_css[] =
    ".plot .bar{fill:var(--k);opacity:.55}.plot .total{stroke:var(--k);stroke-width:2.5}\n";

static int view_height(void) { return CROSS_STEPS * (BAR_HEIGHT + BAR_GAP) + VIEW_GAP; }

/* Right end of a bar on a scale from 10 to 120 dB: the closer two pictures are, the longer the bar. */
static double bar_end(double psnr)
{
    return LABEL_WIDTH + (BARS_RIGHT - LABEL_WIDTH) * fmin(fmax((psnr - 10) / 110, 0), 1);
}

static void draw_bars(const cross_model *model, const cross_view *v, int top, text *out)
{
    text_format(out, "<text class=\"key\" x=\"8\" y=\"%d\">", top + 14);
    text_escaped(out, model->name);
    text_add(out, ", ");
    text_escaped(out, v->name);
    text_add(out, "</text>");
    for (int i = 0; i < CROSS_STEPS; i++) {
        const int y = top + VIEW_GAP - 4 + i * (BAR_HEIGHT + BAR_GAP);
        const double end = bar_end(v->step[i].psnr), total = bar_end(v->total[i].psnr);
        text_format(out, "<text x=\"%d\" y=\"%d\" text-anchor=\"end\">%s</text>", LABEL_WIDTH - 8, y + 12,
                    step_name((cross_step)i));
        text_format(out, "<rect class=\"s1 bar\" x=\"%d\" y=\"%d\" width=\"%.1f\" height=\"%d\"/>",
                    LABEL_WIDTH, y, end - LABEL_WIDTH, BAR_HEIGHT);
        text_format(out, "<path class=\"s2 total\" d=\"M%.1f %dv%d\"/>", total, y - 2, BAR_HEIGHT + 4);
        text_format(out, "<text x=\"%.1f\" y=\"%d\">%.1f</text>", fmax(end, total) + 6, y + 12,
                    v->step[i].psnr);
    }
}

static void add_charts(const void *of, text *out)
{
    const cross_study *study = of;
    int height = HEAD, top = HEAD;
    for (size_t m = 0; m < study->model_count; m++)
        height += (int)study->models[m].view_count * view_height();
    plot_begin(out, "from tracer to splats", bar_css, "", PICTURE_WIDTH, height);
    text_add(out, "<text class=\"title\" x=\"8\" y=\"22\">From tracer to splats, one change at a time</text>"
                  "<text x=\"8\" y=\"42\">PSNR in dB, longer is closer: the bar to the step before, the mark "
                  "to the tracer</text>");
    for (size_t m = 0; m < study->model_count; m++)
        for (size_t v = 0; v < study->models[m].view_count; v++, top += view_height())
            draw_bars(&study->models[m], &study->models[m].views[v], top, out);
    text_add(out, "</svg>\n");
}

const study_output cross_output = {
    .name = "crosscheck", .tables = add_tables, .charts = add_charts, .data = data_of};
