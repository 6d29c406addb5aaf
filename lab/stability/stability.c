/* SPDX-License-Identifier: Apache-2.0 */
/* stability/stability.c -- the study "stability": measure all cases, write the files, print the table. */
#include "stability/stability.h"

#include <math.h>
#include <stdio.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "data/json_out.h"
#include "lab/lab.h"
#include "report/text.h"

/* ---- table ---- */

/* Integers as they are, other numbers with three digits. */
static void add_figure(text *out, double value)
{
    if (isnan(value))
        text_add(out, "-");
    else if (value == floor(value) && fabs(value) < 1e7)
        text_format(out, "%.0f", value);
    else
        text_format(out, "%.3g", value);
}

static void stability_table(const stability_study *study, text *out)
{
    text_add(out, "| row | what is measured | limit | gbtrace | within | rasterizer (3DGS) "
                  "|\n|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < study->row_count; i++) {
        const stability_row *row = &study->rows[i];
        text_format(out, "| %s | %s | %s ", row->id, row->quantity, row->at_least ? ">=" : "<=");
        add_figure(out, row->limit);
        text_add(out, " | ");
        add_figure(out, row->value);
        text_add(out, row->pass ? " | yes | " : " | **NO** | ");
        add_figure(out, row->raster);
        text_add(out, " |\n");
    }
}

/* For each case: what goes wrong in other renderers, what is done here, and notes on its rows. */
static void add_parts(const stability_study *study, text *out)
{
    for (size_t p = 0; p < study->part_count; p++) {
        const stability_part *part = &study->parts[p];
        text_format(out, "\n### %s %s\n\nElsewhere: %s\n\nHere: %s\n\n", part->id, part->title,
                    part->elsewhere, part->ours);
        for (size_t i = 0; i < study->row_count; i++)
            if (study->rows[i].part == (int)p && study->rows[i].note[0] != '\0')
                text_format(out, "- %s: %s\n", study->rows[i].id, study->rows[i].note);
    }
}

static size_t count_passes(const stability_study *study)
{
    size_t passes = 0;
    for (size_t i = 0; i < study->row_count; i++)
        passes += study->rows[i].pass;
    return passes;
}

/* ---- files ---- */

static json_t *chart_to_json(const stability_chart *chart)
{
    json_t *all = json_array();
    for (int k = 0; k < STABILITY_SERIES; k++) {
        const stability_series *line = &chart->series[k];
        if (line->name == NULL || line->count == 0)
            continue;
        json_t *x = json_array(), *y = json_array();
        for (size_t i = 0; i < line->count; i++) {
            json_array_append_new(x, json_number(line->x[i]));
            json_array_append_new(y, json_number(line->y[i]));
        }
        json_array_append_new(all, json_pack("{s:s,s:o,s:o}", "name", line->name, "x", x, "y", y));
    }
    return json_pack("{s:s,s:s,s:s,s:o}", "chart", chart->title, "x", chart->x_unit, "y", chart->y_unit,
                     "series", all);
}

static gbt_status write_json(const stability_study *study, const char *path, gbt_error *err)
{
    json_t *rows = json_array(), *parts = json_array(), *charts = json_array();
    for (size_t i = 0; i < study->row_count; i++) {
        const stability_row *r = &study->rows[i];
        json_array_append_new(
            rows, json_pack("{s:s,s:s,s:s,s:o,s:o,s:b,s:b,s:o,s:s}", "row", r->id, "quantity", r->quantity,
                            "is", r->at_least ? "at least" : "at most", "limit", json_number(r->limit),
                            "value", json_number(r->value), "pass", r->pass, "open", r->open, "raster",
                            json_number(r->raster), "note", r->note));
    }
    for (size_t i = 0; i < study->part_count; i++) {
        const stability_part *p = &study->parts[i];
        json_array_append_new(parts,
                              json_pack("{s:s,s:s,s:s,s:s,s:f}", "case", p->id, "title", p->title,
                                        "elsewhere", p->elsewhere, "here", p->ours, "seconds", p->seconds));
    }
    for (size_t i = 0; i < study->chart_count; i++)
        json_array_append_new(charts, chart_to_json(&study->charts[i]));
    json_t *root = json_pack("{s:i,s:s,s:b,s:o,s:o,s:o}", "schema", 1, "study", "stability", "quick",
                             study->quick, "rows", rows, "cases", parts, "charts", charts);
    const gbt_status status = json_save(root, path, err);
    json_decref(root);
    return status;
}

static gbt_status stability_write(const stability_study *study, const char *folder, gbt_error *err)
{
    char path[4096];
    GBT_TRY(file_join(path, sizeof path, folder, "stability.json", err));
    GBT_TRY(write_json(study, path, err));
    text page = {.err = err}, charts = {.err = err};
    text_format(&page, "# Stability: %zu of %zu rows within their limits\n\n", count_passes(study),
                study->row_count);
    stability_table(study, &page);
    add_parts(study, &page);
    GBT_TRY(text_save(&page, folder, "stability.md"));
    stability_draw_charts(study, &charts);
    return text_save(&charts, folder, "stability.svg");
}

/* ---- the study ---- */

lab_stability_def lab_stability_def_default(void) { return (lab_stability_def){.only = NULL, .quick = 0}; }

gbt_status lab_study_stability(const lab_stability_def *def, const char *folder, FILE *out, gbt_error *err)
{
    stability_study *study = mem_calloc(1, sizeof *study, "study", err);
    if (study == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = stability_measure(def->only, def->quick != 0, folder, study, err);
    if (status == GBT_OK)
        status = stability_write(study, folder, err);
    if (status == GBT_OK) {
        text table = {.err = err};
        stability_table(study, &table);
        text_format(&table, "\n%zu of %zu rows within their limits\n", count_passes(study), study->row_count);
        status = text_print(&table, out);
    }
    mem_free(study);
    return status;
}
