/* SPDX-License-Identifier: Apache-2.0 */
/* study/time_write.c -- the study "time" as tables, JSON and charts. */
#include <math.h>
#include <stdio.h>

#include "data/json_out.h"
#include "study/chart.h"
#include "study/time.h"

/* ---- Markdown ---- */

static void add_curves(const grid_study *s, size_t scene, text *out)
{
    text_add(out, "| seconds: held-out PSNR, dB |");
    for (int mark = 0; mark <= TIME_MARKS; mark++)
        text_add(out, mark < TIME_MARKS ? " |" : " end |");
    text_add(out, "\n|---|");
    for (int mark = 0; mark <= TIME_MARKS; mark++)
        text_add(out, "---|");
    for (size_t v = TIME_DEFAULT; v <= TIME_FAITHFUL; v++) {
        text_format(out, "\n| %s |", time_variants[v].name);
        for (size_t mark = 0; mark <= TIME_MARKS; mark++) {
            double seconds, psnr;
            if (time_mark(s, scene, v, mark, &seconds, &psnr))
                text_format(out, " %.3g: %.2f |", seconds, psnr);
            else
                text_add(out, " |");
        }
    }
    text_add(out, "\n");
}

static double mean_of(const grid_study *s, size_t scene, size_t variant,
                      double (*figure)(const study_figures *))
{
    double sum = 0;
    for (int seed = 0; seed < s->grid.seeds; seed++)
        sum += figure(study_grid_at(&s->grid, scene, variant, seed));
    return sum / s->grid.seeds;
}

static double iterations_of(const study_figures *run) { return run->iterations; }

static double anchors_of(const study_figures *run) { return run->anchors_final; }

static double seconds_of(const study_figures *run) { return run->train_seconds; }

static void add_variants(const grid_study *s, size_t scene, text *out)
{
    text_add(out, "\n| run | seconds | iterations | anchors | PSNR, dB | change from the default, dB "
                  "|\n|---|---|---|---|---|---|\n");
    for (size_t v = 0; v < time_variant_count; v++) {
        const stat_sample psnr = time_psnr(s, scene, v), change = time_change(s, scene, v);
        text_format(out, "| %s | %.3g | ", time_variants[v].name, mean_of(s, scene, v, seconds_of));
        text_count(out, round(mean_of(s, scene, v, iterations_of)));
        text_add(out, " | ");
        text_count(out, round(mean_of(s, scene, v, anchors_of)));
        text_add(out, " | ");
        stat_add(out, &psnr, 2, false);
        text_add(out, " | ");
        if (v != TIME_DEFAULT)
            stat_add_judged(out, &change, 2);
        text_add(out, " |\n");
    }
}

static void add_words(const grid_study *s, size_t scene, text *out)
{
    const stat_sample reached = time_to_match(s, scene), theirs = time_psnr(s, scene, TIME_FAITHFUL);
    if (!isfinite(theirs.mean)) {
        text_add(out, "\nThe faithful protocol's end: n/a.\n");
        return;
    }
    text_format(out, "\nThe faithful protocol ends at ");
    stat_add(out, &theirs, 2, false);
    text_format(out, " dB after %.3g s. ", mean_of(s, scene, TIME_FAITHFUL, seconds_of));
    if (isfinite(reached.mean)) {
        text_add(out, "The default has that after ");
        stat_add(out, &reached, 1, false);
        text_format(out, " s, %.1f times as soon.\n",
                    mean_of(s, scene, TIME_FAITHFUL, seconds_of) / reached.mean);
    } else {
        text_format(out, "The default does not reach that in its %.3g s.\n",
                    mean_of(s, scene, TIME_DEFAULT, seconds_of));
    }
}

static void add_tables(const void *study, text *out)
{
    const grid_study *s = study;
    text_format(out,
                "# Held-out PSNR against seconds\n\nA budget is %.4g s; the faithful protocol has %g of "
                "them. Photos divided by %g, ",
                s->def.budget_seconds, time_variants[TIME_FAITHFUL].budgets, s->def.downscale);
    study_grid_add_runs(&s->grid, s->def.eval_split, out);
    text_add(out, "Mean ± standard deviation over the seeds. Marks are taken in passing, while the clock "
                  "stops: schedules end with the budget, so a run of half the budget has more than the mark "
                  "at half. Each run but the first two leaves one choice of the default out. " STAT_BOLD_MEANS
                  "\n");
    for (size_t scene = 0; scene < s->grid.scene_count; scene++) {
        text_add(out, "\n## ");
        text_plain(out, s->grid.names[scene]);
        text_add(out, "\n\n");
        add_curves(s, scene, out);
        add_variants(s, scene, out);
        add_words(s, scene, out);
    }
}

/* ---- JSON ---- */

static json_t *curve_to_json(const grid_study *s, size_t scene, size_t variant)
{
    json_t *curve = json_array();
    for (size_t mark = 0; mark <= TIME_MARKS; mark++) {
        double seconds, psnr;
        if (time_mark(s, scene, variant, mark, &seconds, &psnr))
            json_array_append_new(curve, json_pack("{s:f,s:f}", "seconds", seconds, "psnr", psnr));
    }
    return curve;
}

static void add_scene(const grid_study *s, size_t scene, json_t *rows, json_t *runs)
{
    char row[STUDY_NAME_SIZE + 160];
    const stat_sample reached = time_to_match(s, scene);
    snprintf(row, sizeof row,
             "%s: seconds of the default to the PSNR that the faithful protocol has after %g budgets",
             s->grid.names[scene], time_variants[TIME_FAITHFUL].budgets);
    json_array_append_new(rows, json_pack("{s:o,s:f,s:o,s:b}", "row", json_text(row), "limit",
                                          s->def.budget_seconds, "value", json_number(reached.mean), "pass",
                                          reached.mean <= s->def.budget_seconds));
    for (size_t v = 0; v < time_variant_count; v++) {
        const stat_sample psnr = time_psnr(s, scene, v), change = time_change(s, scene, v);
        json_array_append_new(runs,
                              json_pack("{s:o,s:s,s:s,s:f,s:o,s:o}", "scene", json_text(s->grid.names[scene]),
                                        "run", time_variants[v].name, "settings", time_variants[v].settings,
                                        "budgets", time_variants[v].budgets, "psnr", stat_to_json(&psnr),
                                        "marks", curve_to_json(s, scene, v)));
        if (v == TIME_DEFAULT)
            continue;
        snprintf(row, sizeof row, "%s: %s: change of PSNR from the default, dB", s->grid.names[scene],
                 time_variants[v].name);
        json_array_append_new(rows,
                              json_pack("{s:o,s:n,s:o,s:n,s:o}", "row", json_text(row), "limit", "value",
                                        json_number(change.mean), "pass", "ours", stat_to_json(&change)));
    }
}

static json_t *data_of(const void *study)
{
    const grid_study *s = study;
    json_t *rows = json_array(), *runs = json_array();
    for (size_t scene = 0; scene < s->grid.scene_count; scene++)
        add_scene(s, scene, rows, runs);
    return json_pack("{s:f,s:f,s:i,s:o,s:o}", "budget_seconds", s->def.budget_seconds, "downscale",
                     s->def.downscale, "seeds", s->grid.seeds, "rows", rows, "runs", runs);
}

/* ---- charts ---- */

/* The curves of the first two variants, the end points of all others, and a line at the final PSNR of the
   faithful protocol. */
static void draw_scene(const grid_study *s, size_t scene, int top, text *out)
{
    scatter_point points[2 * (TIME_MARKS + 1) + TIME_VARIANTS_MAX];
    char title[STUDY_NAME_SIZE + 40];
    const scatter_level level = {time_psnr(s, scene, TIME_FAITHFUL).mean, "the faithful protocol in the end"};
    snprintf(title, sizeof title, "%s: held-out PSNR against seconds", s->grid.names[scene]);
    scatter_chart chart = {.title = title,
                           .note = "marks in passing; one choice left out: its end",
                           .x_unit = "seconds of training (log)",
                           .y_unit = "held-out PSNR, dB",
                           .apart = 1u << 3,
                           .points = points,
                           .levels = &level,
                           .level_count = 1,
                           .series = {NULL, time_variants[TIME_DEFAULT].name,
                                      time_variants[TIME_FAITHFUL].name, "one choice left out"}};
    for (size_t v = 0; v < time_variant_count; v++)
        for (size_t mark = v <= TIME_FAITHFUL ? 0 : TIME_MARKS; mark <= TIME_MARKS; mark++) {
            scatter_point p = {v <= TIME_FAITHFUL ? 1 + (int)v : 3, 0, 0,
                               v <= TIME_FAITHFUL ? "" : time_variants[v].name};
            if (time_mark(s, scene, v, mark, &p.x, &p.y))
                points[chart.point_count++] = p;
        }
    scatter_draw(out, &chart, top);
}

static void add_charts(const void *study, text *out)
{
    const grid_study *s = study;
    scatter_begin(out, "PSNR against seconds", "", SCATTER_HEIGHT * (int)s->grid.scene_count);
    for (size_t scene = 0; scene < s->grid.scene_count; scene++)
        draw_scene(s, scene, SCATTER_HEIGHT * (int)scene, out);
    text_add(out, "</svg>\n");
}

const study_output time_output = {
    .name = "time", .tables = add_tables, .charts = add_charts, .data = data_of};
